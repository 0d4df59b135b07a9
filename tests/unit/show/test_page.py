"""What a page contains: it is whole, needs no network, shows attacks as text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from docs.generated_reference import glossary as made
from pretravel.show.document import Document, KeyFigure
from pretravel.show.glossary_terms import glossary, words_used
from pretravel.show.page import LARGEST, contents_text, page_text
from pretravel.show.page_content import PageContent
from tests.support.pages import ATTACK, attacked_content, plain_content

NOMENCLATURE = Path(__file__).parents[3] / "docs" / "nomenclature.md"


class _Elements(HTMLParser):
    """Tags with their attributes, and the texts of scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] == "script" and data.strip():
            self.scripts.append(data)


def test_an_attack_stays_text_everywhere() -> None:
    elements = _Elements(contents_text([attacked_content()]))
    assert all(not name.startswith("on") for _, values in elements.tags for name in values)
    images = [values for tag, values in elements.tags if tag == "img"]
    assert [str(image["src"])[:11] for image in images] == ["data:image/"]
    kinds = [values.get("type") for tag, values in elements.tags if tag == "script"]
    assert kinds == ["application/json", "text/plain", "text/plain", None]
    content = json.loads(elements.scripts[0])
    assert content["reports"][0]["document"]["title"] == ATTACK


def test_a_page_asks_for_nothing_from_elsewhere() -> None:
    page = contents_text([plain_content()])
    elements = _Elements(page)
    for _, values in elements.tags:
        for name in ("src", "href", "srcset", "poster", "action", "data"):
            address = values.get(name) or ""
            assert not address or address.startswith(("data:", "#")), address
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style
    policy = next(v["content"] for tag, v in elements.tags if tag == "meta" and "http-equiv" in v)
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "http" not in policy
    assert "unsafe-inline" not in policy.partition("script-src")[2]


def test_the_policy_names_the_scripts_that_are_there() -> None:
    page = contents_text([plain_content()])
    script = page[page.rindex("<script>") + 8 : page.rindex("</script>")]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"&#39;sha256-{digest}&#39;" in page


def test_a_page_with_pictures_to_turn_is_below_three_megabytes() -> None:
    page = contents_text([plain_content()])
    assert 'id="plotly"' in page
    assert len(page.encode()) < LARGEST == 3_000_000


def test_a_page_that_would_be_larger_has_still_pictures_and_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("pretravel.show.page.LARGEST", 1_000_000)
    page = contents_text([plain_content()])
    assert 'id="plotly"' not in page
    assert "data:image/" in page
    assert "cannot be turned" in page
    monkeypatch.undo()
    assert "cannot be turned" not in contents_text([plain_content()])


def test_a_page_without_pictures_has_no_plotly() -> None:
    assert len(page_text(Document("Probe"))) < 100_000


def test_a_page_to_print_has_no_scripts_and_all_details_open() -> None:
    page = contents_text([plain_content()], scripts=False)
    assert "<script" not in page
    assert "<details open>" in page
    assert "script-src &#39;none&#39;" in page


def test_warnings_are_directly_below_the_verdict_and_figures_have_u_and_k() -> None:
    page = contents_text([plain_content()])
    body = page[page.index("<body>") :]
    order = ["The probe is good", "a warning", "Key figures", "Pictures", "All columns", "a note"]
    order += ["Settings", "Command and input files", "Terms on this page"]
    places = [body.index(words) for words in order]
    assert places == sorted(places)
    assert "U (k = 2)" in page
    assert '<th scope="row">--diameter</th><td class="words">25 (Diameter of the sphere)' in page
    assert '<td class="number expanded">0.50 µm</td>' in page  # 2 · 0.25


class TestGlossary:
    def test_the_nomenclature_has_all_words_in_order(self) -> None:
        """One home for each definition: the page of the documentation is made from the glossary."""
        text = NOMENCLATURE.read_text(encoding="utf-8")
        tables = "".join(map(made, re.findall(r"<!-- generated: glossary (.*?) -->", text)))
        words = re.findall(r"^- \*\*(.*?)\*\*: .", tables, re.M)
        assert words == [word.term for word in glossary()]
        assert len(glossary()) > 70

    def test_only_the_words_that_occur(self) -> None:
        used = words_used([Document("Effective radii", figures=(KeyFigure("u", 1.0, u=0.5),))])
        terms = {entry.term for entry in used}
        assert "standard uncertainty (u)" in terms
        assert "expanded uncertainty (U), coverage factor (k)" in terms
        assert "lever" not in terms

    def test_a_standard_deviation_is_no_deviation_of_a_point(self) -> None:
        assert words_used([Document("The standard deviation")]) == ()
        assert [e.term for e in words_used([Document("a deviation")])] == ["deviation"]


def test_a_certificate_is_bound_with_its_statements() -> None:
    content = PageContent(Document("Certificate"), template="certificate.html")
    page = contents_text([content, plain_content(2)], title="Both")
    assert page.count("End of certificate.") == 1
    assert page.count("The results relate only to the item calibrated") == 1
