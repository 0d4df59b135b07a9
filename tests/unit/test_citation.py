"""What is cited: by CITATION.cff, by the paper about the package, by the comparison with others."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
FORM = {
    "abstract", "authors", "cff-version", "date-released", "keywords", "license", "message",
    "references", "title", "type", "version",
}  # fmt: skip
"""Keys of the file, all of the Citation File Format 1.2.0."""

PAPERS = {
    "test_rodrigues_2021.py": ("Rodrigues", 2021),
    "test_ren_2020.py": ("Ren", 2020),
    "test_wozniak.py": ("Woźniak", None),
    "test_nafi_mayer_2011.py": ("Nafi", 2011),
}
"""First author and year, by the file that compares the package with the paper."""


def _citation() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    return found


def test_it_has_the_keys_of_the_format() -> None:
    assert set(_citation()) == FORM


def test_the_four_papers_are_cited() -> None:
    cited = {
        (each["authors"][0]["family-names"], each.get("year")): each
        for each in _citation()["references"]
    }
    assert set(cited) == set(PAPERS.values())
    assert all(each["title"] and each["type"] for each in cited.values())
    for name in PAPERS:
        assert (ROOT / "tests/validation" / name).exists()


def test_the_licence_is_that_of_the_package() -> None:
    assert f'license = "{_citation()["license"]}"' in (ROOT / "pyproject.toml").read_text("utf-8")


def _paper() -> tuple[dict[str, Any], str]:
    """Head and text of the paper."""
    _, head, text = (ROOT / "paper.md").read_text("utf-8").split("---\n", 2)
    return yaml.safe_load(head), text


def test_the_paper_has_the_form_of_the_journal_of_open_source_software() -> None:
    """Its head, its sections, and 750 to 1500 words."""
    head, text = _paper()
    assert set(head) == {"title", "tags", "authors", "affiliations", "date", "bibliography"}
    assert head["title"] == _citation()["title"]
    sections = re.findall(r"^# (.*)$", text, re.M)
    assert sections[:3] == ["Summary", "Statement of need", "State of the field"]
    assert sections[-2:] == ["Acknowledgements", "References"]
    assert 750 <= len(text.split()) <= 1500


def test_each_reference_of_the_paper_is_cited_and_each_citation_is_a_reference() -> None:
    head, text = _paper()
    entries = (ROOT / head["bibliography"]).read_text("utf-8").split("\n\n@")
    references = {re.search(r"\{(\w+),", entry)[1]: entry for entry in entries}  # type: ignore[index]
    assert len(references) == len(entries)
    assert set(re.findall(r"@(\w+)", text)) == set(references)
    for entry in entries:
        assert {"author", "title"} <= set(re.findall(r"^  (\w+) =", entry, re.M))


def test_the_files_that_the_paper_names_are_there() -> None:
    named = re.findall(r"\]\((docs/[^)]+)\)|`(docs/[^`]+)`", _paper()[1])
    assert len(named) >= 3
    for figure, file in named:
        assert (ROOT / (figure or file)).is_file()


def test_each_source_of_the_comparison_is_cited_and_has_an_address() -> None:
    page = (ROOT / "docs" / "compare.md").read_text("utf-8")
    text, _, listed = page.partition("## Sources")
    cited = {
        int(number)
        for group in re.findall(r"\[(\d+(?:, \d+)*)\]", text)
        for number in group.split(", ")
    }
    sources = dict(re.findall(r"^(\d+)\. (.*)$", listed, re.M))
    assert cited == {int(number) for number in sources}
    assert all("<http" in source for source in sources.values())


def test_the_comparison_is_with_ten_systems_in_each_table() -> None:
    text = (ROOT / "docs" / "compare.md").read_text("utf-8")
    for table in re.findall(r"(?:^\|.*\n)+", text, re.M):
        rows = table.splitlines()[2:]
        assert len(rows) == 11
        assert rows[-1].startswith("| **pretravel** |")
