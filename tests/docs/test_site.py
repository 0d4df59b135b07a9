"""The site of the documentation: a strict build, links, headings, search without a network."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag

import pytest

from tests.browser.workbench_server import (
    CHROMIUM,
    WITHOUT_SCENES,
    new_context,
    running_browser,
    serious_problems,
)

ROOT = Path(__file__).parents[2]
QUESTIONS = {
    "how do I drop a bad touch": "how-to/bad-touches",
    "inch file": "how-to/inches",
    "Renishaw radii": "how-to/renishaw",
    "bore diameter with U": "how-to/measure-a-bore",
    "what is a kind": "how-to/which-kind",
    "name of a material": "reference/materials",
    "add a log format": "how-to/add-a-format",
    "accept a new map": "how-to/daily-check",
    "what does u contain": "explanation/what-u-contains",
    "why is my probe triangular": "explanation/why-late",
    "delete wrong point": "how-to/bad-touches",
    "outlier": "how-to/bad-touches",
    "how many touches": "how-to/directions",
    "measure hole": "how-to/measure-a-bore",
    "semicolon decimal comma": "tutorials/first-qualification",
}
"""What people ask, and the page that has the answer."""
FIRST = 1
"""Results of the search among which this page is."""
LOOKED_AT = (
    "reference/commands-qualify.html",
    "gallery/index.html",
    *(
        pytest.param(name, marks=pytest.mark.slow)
        for name in (
            "index.html",
            "tutorials/first-qualification.html",
            "reference/csv-columns.html",
        )
    ),
)
"""Pages of each sort, for the accessibility in a browser: code and tables, pictures, others."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """As ``make docs`` builds it: every warning is an error."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fresh-env", "--fail-on-warning"]
    places = ["--doctree-dir", str(folder / "doctrees"), str(ROOT / "docs"), str(folder / "html")]
    built = subprocess.run(
        [*command, "--keep-going", "--nitpicky", *places], capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    return folder / "html"


@dataclass
class _Page(HTMLParser):
    """What a page says about itself."""

    language: str = ""
    identifiers: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    loaded: list[str] = field(default_factory=list)
    pictures: list[dict[str, str | None]] = field(default_factory=list)
    headings: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag == "html":
            self.language = values.get("lang") or ""
        self.identifiers += filter(None, [values.get("id")])
        if tag == "a":
            self.links += filter(None, [values.get("href")])
        if tag == "img":
            self.pictures.append(values)
        if tag in ("script", "img", "iframe"):
            self.loaded += filter(None, [values.get("src")])
        if tag == "link" and values.get("rel") in ("stylesheet", "preload", "icon"):
            self.loaded += filter(None, [values.get("href")])
        if re.fullmatch(r"h[1-6]", tag):
            self.headings.append(int(tag[1]))


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, _Page]:
    found = {}
    for path in sorted(site.rglob("*.html")):
        if "_static" in path.parts:  # parts of the theme
            continue
        found[path] = _Page()
        found[path].feed(path.read_text("utf-8"))
    assert len(found) > 50
    return found


def test_links_lead_somewhere(pages: dict[Path, _Page]) -> None:
    broken = []
    for path, page in pages.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            place, anchor = urldefrag(link)
            target = (path.parent / unquote(place)).resolve() if place else path
            there = target.exists() and (
                not anchor or target not in pages or unquote(anchor) in pages[target].identifiers
            )
            if not there:
                broken.append(f"{path.name}: {link}")
    assert broken == []


def test_nothing_is_loaded_from_elsewhere(site: Path, pages: dict[Path, _Page]) -> None:
    loaded = {name for page in pages.values() for name in page.loaded}
    assert [name for name in loaded if re.match(r"([a-z]+:)?//", name)] == []
    styles = list(site.rglob("*.css"))
    assert styles
    for path in styles:
        assert not re.search(r"url\(\s*['\"]?(https?:)?//", path.read_text("utf-8")), path
        assert not re.search(r"@import\s+['\"]?(https?:)?//", path.read_text("utf-8")), path


def test_pages_can_be_read_aloud(pages: dict[Path, _Page]) -> None:
    """Language, one first heading, no level left out, pictures in words, names once."""
    for path, page in pages.items():
        assert page.language == "en", path
        assert page.headings.count(1) <= 1, path
        steps = zip(page.headings, page.headings[1:], strict=False)
        assert all(after <= before + 1 for before, after in steps), (path, page.headings)
        assert all((picture.get("alt") or "").strip() for picture in page.pictures), path
        twice = [name for name, count in Counter(page.identifiers).items() if count > 1]
        assert twice == [], path


def test_every_public_name_and_command_has_its_place(site: Path, pages: dict[Path, _Page]) -> None:
    from docs.generated_reference import public_names
    from pretravel.task.listed import GROUPS

    named = {name for page in pages.values() for name in page.identifiers}
    missing = [n for n in public_names() if f"pretravel.{n}" not in named]
    assert missing == []
    text = "".join(path.read_text("utf-8") for path in (ROOT / "docs/reference").glob("*.md"))
    assert set(re.findall(r"generated: commands (\w+)", text)) == set(GROUPS)


def _stems(question: str) -> Iterator[str]:
    from sphinx.search.en import SearchEnglish

    language = SearchEnglish({})
    for word in language.split(question.lower()):
        if language.word_filter(word) and len(word) > 2:
            yield language.stem(word)


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_words_of_a_question_are_in_the_index(site: Path, question: str) -> None:
    text = (site / "searchindex.js").read_text("utf-8")
    index = json.loads(re.fullmatch(r"Search\.setIndex\((.*)\)\s*", text, re.S)[1])  # type: ignore[index]
    number = index["docnames"].index(QUESTIONS[question])
    for stem in _stems(question):
        places = [index[part].get(stem, []) for part in ("terms", "titleterms")]
        pages = {
            page for place in places for page in ([place] if isinstance(place, int) else place)
        }
        assert number in pages, stem


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not CHROMIUM.exists():
        pytest.skip("chromium is missing: the search of the site is NOT tested in a browser")
    with running_browser(WITHOUT_SCENES) as started:
        yield started


def test_the_search_answers_without_a_network(site: Path, browser: Any) -> None:
    context = new_context(browser, offline=True)
    page = context.new_page()
    for question, wanted in QUESTIONS.items():
        page.goto(f"{(site / 'search.html').as_uri()}?q={question.replace(' ', '+')}")
        page.wait_for_selector("#search-results li a")
        page.wait_for_function("document.querySelector('#search-results p.search-summary')")
        found = page.eval_on_selector_all(
            "#search-results li > a", "all => all.map(a => a.getAttribute('href'))"
        )
        names = [urldefrag(link)[0].partition("?")[0].removesuffix(".html") for link in found]
        first = list(dict.fromkeys(name.removeprefix("./") for name in names))[:FIRST]
        assert wanted in first, (question, first)
    context.close()


@pytest.mark.parametrize("name", LOOKED_AT)
def test_axe_finds_nothing_serious(site: Path, browser: Any, name: str) -> None:
    context = new_context(browser)
    page = context.new_page()
    page.goto((site / name).as_uri())
    assert serious_problems(page) == []
    context.close()
