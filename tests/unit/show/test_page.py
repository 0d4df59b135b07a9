"""What a page contains: it is whole, needs no network, shows attacks as text, is read back."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.show.as_json import document_values
from pretravel.show.document import Document, KeyFigure
from pretravel.show.glossary import glossary, words_used
from pretravel.show.page import LARGEST, contents_text, page_text, write_contents
from pretravel.show.page_content import (
    PageContent,
    packed_values,
    picture_figures,
    read_page,
    unpacked_values,
)
from tests.support.commands import both_outputs, run
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
    assert "stand still" in page
    monkeypatch.undo()
    assert "stand still" not in contents_text([plain_content()])


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
    order = ["The probe is good", "a warning", "Key figures", "What was done with what", "Pictures"]
    order += ["All columns", "a note", "Settings", "Words of this page"]
    places = [body.index(words) for words in order]
    assert places == sorted(places)
    assert "U (k = 2)" in page
    assert '<th scope="row">--diameter</th><td class="words">25 (Diameter of the sphere)' in page
    assert '<td class="number expanded">0.50 µm</td>' in page  # 2 · 0.25


@cache
def plain_text() -> str:
    """The page of the plain content, drawn once."""
    return contents_text([plain_content()])


class TestReadingBack:
    def test_reports_records_and_pictures_are_the_same(self, tmp_path: Path) -> None:
        write_contents(tmp_path / "a.html", [plain_content()])
        (found,) = read_page(tmp_path / "a.html")
        first = plain_content()
        assert document_values(found.document) == document_values(first.document)
        assert found.record == first.record
        assert picture_figures(found.document.pictures[0]) == picture_figures(
            first.document.pictures[0]
        )
        write_contents(tmp_path / "b.html", [found])
        assert (tmp_path / "b.html").read_bytes() == (tmp_path / "a.html").read_bytes()

    def test_an_attack_is_text_again(self, tmp_path: Path) -> None:
        write_contents(tmp_path / "a.html", [attacked_content()])
        contents = read_page(tmp_path / "a.html")
        assert contents[0].document.title == ATTACK
        assert ATTACK not in contents_text([*contents, *contents], title=ATTACK)

    def test_several_are_bound_with_one_plotly(self, tmp_path: Path) -> None:
        for name in ("a.html", "b.html"):
            write_contents(tmp_path / name, [plain_content(3)])
        run("report", tmp_path / "a.html", tmp_path / "b.html", "-o", tmp_path / "all.html")
        page = (tmp_path / "all.html").read_text(encoding="utf-8")
        assert page.count('id="plotly"') == 1
        assert len(page.encode()) < LARGEST
        assert page.count("a warning</li>") == 2
        assert len(read_page(tmp_path / "all.html")) == 2

    def test_the_picture_of_an_older_page_is_kept_when_it_cannot_be_turned(
        self, tmp_path: Path
    ) -> None:
        text = plain_text()
        text = re.sub(r'<script type="text/plain" id="charts">.*?</script>', "", text, flags=re.S)
        (tmp_path / "a.html").write_text(text, encoding="utf-8")
        (found,) = read_page(tmp_path / "a.html")
        assert "data:image/" in contents_text([found])
        assert 'id="plotly"' not in contents_text([found])

    @pytest.mark.parametrize(
        ("before", "after", "words"),
        [
            ('"title":"The probe', '"titel":"The probe', "not those of a report"),
            ('"values":["P3",', '"values":[', "not those of a report"),  # a shorter column
            ('"size":5124', f'"size":{10**400}', "not those of a report"),
            ('"format":"pretravel page"', '"format":"other"', "no page of pretravel"),
            ('"version":1', '"version":7', "another version"),
            ('{"format"', "[" * 100_000 + '{"format"', "not complete"),
            ("data:image/", "https://example.com/", "picture of it is missing"),
            ('"count":', '"count":1000000000,"more":', "not those of a report"),
            ('"reports":[', '"reports":7,"other":[', "a part of it is missing"),
            ("page.html", "../secret.html", "another form"),
        ],
    )
    def test_a_changed_page_is_refused(
        self, tmp_path: Path, before: str, after: str, words: str
    ) -> None:
        text = plain_text()
        assert before in text or before == '"count":'
        if before == '"count":':
            before, after = '"unit":"µm"', '"unit":"µm","digits":{"count":1000000000}'
        (tmp_path / "a.html").write_text(text.replace(before, after), encoding="utf-8")
        message = run("report", tmp_path / "a.html", "-o", tmp_path / "b.html", code=2)
        assert words in message
        assert "a.html" in message

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ({"data": [{"type": "image"}], "layout": {}}, "unknown kinds"),
            ({"data": [], "layout": {"title": {"text": "<a href='x'>x</a>"}}}, "HTML"),
            ({"data": [], "layout": {"images": [{"source": "https://example.com"}]}}, "images"),
            ({"data": [], "layout": {}, "config": {}}, "another form"),
            ({"data": 3, "layout": {}}, "missing"),
        ],
    )
    def test_charts_of_strangers_are_checked(
        self, tmp_path: Path, change: object, words: str
    ) -> None:
        text = plain_text()
        packed = re.search(r'id="charts">(.*?)</script>', text, re.S)
        assert packed is not None
        charts = unpacked_values(packed[1].strip())
        charts["figures"]["picture-0-0"] = [change]
        text = text.replace(packed[1], packed_values(charts))
        (tmp_path / "a.html").write_text(text, encoding="utf-8")
        with pytest.raises(PretravelError, match=words):
            read_page(tmp_path / "a.html")

    def test_a_page_of_another_program_is_refused(self, tmp_path: Path) -> None:
        (tmp_path / "a.html").write_text("<h1>hello</h1>", encoding="utf-8")
        _, error = both_outputs("report", tmp_path / "a.html", "-o", tmp_path / "b.html", code=2)
        assert "it is no page of pretravel" in error


class TestGlossary:
    def test_it_is_that_of_the_nomenclature(self) -> None:
        """One place for each definition: the table of the documentation and the pages agree."""
        text = NOMENCLATURE.read_text(encoding="utf-8").partition("## Letters of the papers")[0]
        rows = re.findall(r"^\| (.*?) \| (.*?) \| (.*?)\|$", text, re.M)
        stated = [
            (term.strip(), meaning.strip().replace("`", ""), unit.strip().replace("–", ""))
            for term, meaning, unit in rows
            if term not in ("word", "---")
        ]
        assert [(word.term, word.meaning, word.unit) for word in glossary()] == stated
        assert len(stated) > 70

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
