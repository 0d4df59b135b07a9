"""Four jobs of strangers, from an empty project: how many clicks each takes.

A click is a press of the mouse, also on a menu and its entry; typing into a field and dropping a
file are none. The numbers are those that the project has set itself.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pretravel.tasks.example_data import example_folder
from tests.browser.screens import drop
from tests.browser.workbench_server import RunningWorkbench, opened

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
    person.begin("Qualify a probe")
    person.qualified()
    person.click(person.page.locator("a.brand"))
    person.click(person.page.get_by_role("link", name="Measure a part with this map"))
    person.page.wait_for_selector("main h1:has-text('Measure a part')")
    drop(person.page, "part", "touches", EXAMPLES / "bore_touches.csv")
    person.clicks += 0
    assert person.clicks <= 6


def _reached(page: Any, name: str) -> None:
    """Press Tab until the element of a name has the focus, as somebody without a mouse."""
    said = (
        "e => e.ariaLabel || e.labels?.[0]?.innerText || e.innerText || "
        "e.closest('label')?.innerText || ''"
    )
    seen = []
    for _ in range(150):
        page.keyboard.press("Tab")
        seen.append(page.evaluate(f"({said})(document.activeElement)").strip())
        if name in seen[-1]:
            return
    raise AssertionError(f"{name} is not reached: {seen}")


def test_engineer_with_a_german_keyboard_and_no_mouse(
    browser: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    context = browser.new_context(locale="de-DE", viewport={"width": 1440, "height": 900})
    try:
        page = context.new_page()
        opened(page, workbench.address)
        _reached(page, "Qualify a probe")
        page.keyboard.press("Enter")
        page.wait_for_selector("main h1:has-text('Qualify a probe')")
        page.wait_for_function("window.socket?.connected && window.did_handshake")
        _reached(page, "Touches on the reference sphere")
        with page.expect_file_chooser() as choosing:
            page.keyboard.press("Enter")
        choosing.value.set_files(str(SPHERE))
        page.wait_for_selector(".file-name:has-text('sphere_touches.csv')")
        _reached(page, "Diameter of the reference")
        page.keyboard.type("24,9987")
        _reached(page, "Diameter of the tip")
        page.keyboard.type("6,0")
        _reached(page, "Your control")
        page.wait_for_selector("text=understood as 24.9987 mm")
        page.wait_for_selector(".next-step:has-text('Choose your control')")
        page.keyboard.press("Enter")
        for _ in range(20):
            page.keyboard.press("ArrowDown")
            chosen = page.locator(".q-manual-focusable--focused, .q-item--active").all_inner_texts()
            if any("Haas" in each for each in chosen):
                break
        page.keyboard.press("Enter")
        page.wait_for_selector(".next-step:has-text('Download the values')")
        _reached(page, "Download haas.zip")
        with page.expect_download() as waiting:
            page.keyboard.press("Enter")
        waiting.value.save_as(tmp_path / "haas.zip")
        assert (tmp_path / "haas.zip").stat().st_size > 1000
    finally:
        context.close()
