"""Four jobs of strangers, from an empty project: how many clicks each takes.

A click is a press of the mouse, also on a menu and its entry; typing into a field and dropping a
file are none. The numbers are those that the project has set itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pretravel.drawing.screen.work import example_map
from pretravel.task.example_data import example_folder
from tests.browser.screens import chosen_with_a_key, drop, settled
from tests.browser.test_certificate import sixty_traces
from tests.browser.workbench_server import RunningWorkbench, new_context, opened
from tests.support.pdf_text import pdf_pages
from tests.support.touches_of_days import day_of

EXAMPLES = example_folder()
SPHERE = EXAMPLES / "sphere_touches.csv"


class Person:
    """Somebody with a mouse, whose clicks are counted."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.clicks = 0

    def click(self, place: Any) -> None:
        place.click()
        self.clicks += 1

    def button(self, name: str) -> Any:
        return self.page.get_by_role("button", name=name, exact=True)

    def begin(self, heading: str) -> None:
        """The first click, on a job of the home page."""
        self.click(self.page.get_by_role("heading", name=heading))
        self.page.wait_for_selector(f"main h1:has-text('{heading}')")

    def qualified(self) -> None:
        drop(self.page, "engineer", "touches", SPHERE)
        self.page.get_by_label("Diameter of the reference [mm]").fill("24.9987")
        self.page.get_by_label("Diameter of the tip [mm]").fill("6")
        self.page.get_by_label("Diameter of the tip [mm]").blur()
        self.page.wait_for_selector(".next-step:has-text('Choose your control')")


@pytest.fixture
def person(page: Any, workbench: RunningWorkbench) -> Person:
    opened(page, workbench.address)
    return Person(page)


def _saved(person: Person, button: Any, folder: Path) -> Path:
    with person.page.expect_download() as waiting:
        person.click(button)
    path = folder / waiting.value.suggested_filename
    waiting.value.save_as(path)
    return path


def test_engineer_from_a_file_to_the_values_of_a_haas(person: Person, tmp_path: Path) -> None:
    person.begin("Qualify a probe")
    person.qualified()
    person.click(person.page.get_by_label("Your control"))
    person.click(person.page.get_by_role("option", name="Haas (macro programs)", exact=True))
    path = _saved(person, person.button("Download haas.zip"), tmp_path)
    assert path.stat().st_size > 1000
    assert person.clicks <= 5


def test_part_bores_with_a_tolerance_from_a_probe_of_the_same_project(
    person: Person, tmp_path: Path
) -> None:
    """Features first: what they are is said by the labels of the touches."""
    page = person.page
    person.begin("Qualify a probe")
    person.qualified()
    person.click(person.button("Measure a part with this map"))
    page.wait_for_selector("main h1:has-text('Measure a part')")
    drop(page, "part", "touches", EXAMPLES / "bore_touches.csv")
    person.click(person.button("boss1 · 12"))  # the bores alone
    page.wait_for_selector("[aria-pressed=false]:has-text('boss1')")
    page.get_by_label("Tolerance of the diameter", exact=True).fill("19.99..20.01")
    person.click(person.button("Measure"))
    rows = page.locator(".feature-rows tbody tr:has(.tolerance-bar)")
    rows.first.wait_for()
    settled(page)
    assert [row.locator("th").inner_text() for row in rows.all()] == ["bore1", "bore2"]
    # 20.010 and 19.995 mm in a tolerance of ±0.01 mm.
    assert rows.locator(".row-verdict").all_inner_texts()[1].endswith("within the tolerance")
    assert person.clicks <= 6


def test_laboratory_from_sixty_traces_to_a_certificate(person: Person, tmp_path: Path) -> None:
    person.begin("Calibration rig and separation")
    drop(person.page, "laboratory", "traces", *sorted(sixty_traces(tmp_path).iterdir()))
    person.page.wait_for_selector("text=60 traces, 12 directions")
    person.click(person.page.get_by_role("tab", name="Files"))
    path = _saved(person, person.button("Certificate (PDF)"), tmp_path)
    assert len(pdf_pages(path)) <= 4
    assert person.clicks <= 4


def test_the_check_of_a_morning_from_home_to_the_answer(person: Person, tmp_path: Path) -> None:
    """Once there is a map: the link, and the place of the file."""
    page = person.page
    person.begin("Qualify a probe")
    person.qualified()
    opened(page, page.url.split("engineer")[0])
    person.clicks = 0
    person.click(page.get_by_role("link", name="Drop today's touches"))
    page.wait_for_selector('.file-name:has-text("map.json")')
    person.clicks += 1  # on the place of the file, where it is chosen instead of dropped
    drop(page, "daily", "touches", day_of(tmp_path, 1))
    page.wait_for_selector(".verdict-card:has-text('No change found')")
    assert person.clicks <= 2


def _reached(page: Any, name: str) -> None:
    """Press Tab until the element of a name has the focus, as somebody without a mouse."""
    said = (
        "e => e.ariaLabel || e.labels?.[0]?.innerText || e.innerText || "
        "e.closest('label')?.innerText || ''"
    )
    seen = []
    for _ in range(250):
        page.keyboard.press("Tab")
        seen.append(page.evaluate(f"({said})(document.activeElement)").strip())
        if name in seen[-1]:
            return
    raise AssertionError(f"{name} is not reached: {seen}")


@pytest.fixture
def german(browser: Any, workbench: RunningWorkbench) -> Iterator[Any]:
    """A page of somebody with a German browser and no mouse."""
    context = new_context(browser, locale="de-DE", viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.on("filechooser", lambda _: None)  # long before the first one
    opened(page, workbench.address)
    yield page
    context.close()


def _begin(page: Any, heading: str) -> None:
    _reached(page, heading)
    page.keyboard.press("Enter")
    page.wait_for_selector(f"main h1:has-text('{heading}')")
    page.wait_for_function("window.socket?.connected && window.did_handshake")


def _choose_files(page: Any, place: str, *paths: Path, key: str = "Space") -> None:
    _reached(page, place)
    chosen_with_a_key(page, key, [str(path) for path in paths])
    page.wait_for_selector(f".file-name:has-text('{paths[0].name}'), .many-files")


def _choose_tab(page: Any, chosen: str, wanted: str) -> None:
    """From the tab that is chosen, which Tab reaches, with the arrows to another one."""
    _reached(page, chosen)
    for _ in range(5):
        page.keyboard.press("ArrowRight")
        if page.evaluate("document.activeElement.innerText").strip() == wanted:
            break
    page.keyboard.press("Enter")
    page.wait_for_selector(f'.q-tab--active:has-text("{wanted}")')


def test_engineer_with_a_german_keyboard_and_no_mouse(german: Any, tmp_path: Path) -> None:
    _begin(german, "Qualify a probe")
    _choose_files(german, "Touches on the reference sphere", SPHERE, key="Enter")
    _reached(german, "Diameter of the reference")
    german.keyboard.type("24,9987")
    _reached(german, "Diameter of the tip")
    german.keyboard.type("6,0")
    _reached(german, "Your control")
    german.wait_for_selector("text=understood as 24.9987 mm")
    german.wait_for_selector(".next-step:has-text('Choose your control')")
    german.keyboard.press("Enter")
    german.get_by_role("option", name="Haas (macro programs)", exact=True).wait_for()
    for _ in range(20):
        german.keyboard.press("ArrowDown")
        chosen = german.locator(".q-manual-focusable--focused, .q-item--active").all_inner_texts()
        if any("Haas" in each for each in chosen):
            break
    german.keyboard.press("Enter")
    german.wait_for_selector(".next-step:has-text('Download the values')")
    _reached(german, "Download haas.zip")
    with german.expect_download() as waiting:
        german.keyboard.press("Enter")
    waiting.value.save_as(tmp_path / "haas.zip")
    assert (tmp_path / "haas.zip").stat().st_size > 1000


def test_part_without_a_mouse(german: Any, tmp_path: Path) -> None:
    name, content = example_map(EXAMPLES)
    (tmp_path / name).write_bytes(content)
    _begin(german, "Measure a part")
    _choose_files(german, "1. Touches on the part", EXAMPLES / "bore_touches.csv")
    _choose_files(german, "2. Map of the probe", tmp_path / name)
    german.wait_for_selector(".chips")
    _reached(german, "Tolerance of the diameter")
    german.keyboard.type("19.99..20.01")
    _reached(german, "Measure")
    german.keyboard.press("Enter")
    german.wait_for_selector(".feature-rows .tolerance-bar")


def test_laboratory_without_a_mouse(german: Any, tmp_path: Path) -> None:
    _begin(german, "Calibration rig and separation")
    _choose_files(german, "Traces of the rig", *sorted((EXAMPLES / "rig").glob("*.csv")))
    german.wait_for_selector(".verdict")
    _choose_tab(german, "Details", "Files")
    _reached(german, "Certificate (PDF)")
    with german.expect_download() as waiting:
        german.keyboard.press("Enter")
    waiting.value.save_as(tmp_path / "certificate.pdf")
    assert len(pdf_pages(tmp_path / "certificate.pdf")) <= 4


def test_designer_without_a_mouse(german: Any) -> None:
    _begin(german, "Design a probe")
    _reached(german, "Stylus length to the tip centre")
    german.keyboard.press("Tab")
    german.keyboard.press("ArrowRight")
    german.wait_for_selector("td:has-text('38.5 mm')")
    _choose_tab(german, "Comparison", "Finite elements")
    _reached(german, "Compute with finite elements")
    german.keyboard.press("Enter")
    german.get_by_text("Unknowns of the meshes").wait_for()
