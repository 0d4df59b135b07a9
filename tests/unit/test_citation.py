"""CITATION.cff: it can be read, and names the papers that the package implements."""

from __future__ import annotations

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
