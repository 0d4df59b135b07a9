"""The table of tolerances: the model's own fill it, and what fails stands first."""

from __future__ import annotations

from typing import Any

from pretravel.drawing.screen.work import example_map
from pretravel.task.example_data import example_folder
from tests.browser.screens import drop, seen_at, settled, stays
from tests.browser.test_clicks import Person
from tests.browser.workbench_server import RunningWorkbench, opened

EXAMPLES = example_folder()
_CUT = """() => [...document.querySelectorAll(
    '.table-frame:has(.tolerance-rows, .feature-rows), .tolerance-rows td:nth-child(3) input')]
  .filter((one) => one.scrollWidth > one.clientWidth + 1)
  .map((one) => one.value ?? one.querySelector('table').className)"""
_NARROW_VERDICTS = """() => [...document.querySelectorAll('.feature-rows .row-verdict')]
  .filter((one) => one.clientWidth < 0.9 * one.parentElement.clientWidth)
  .map((one) => one.textContent)"""


def test_the_model_fills_the_table(page: Any, workbench: RunningWorkbench, tmp_path: Any) -> None:
    """A boss of 14 mm fails 14 g6 of the model; another limit that is typed is kept."""
    name, content = example_map(EXAMPLES)
    (tmp_path / name).write_bytes(content)
    opened(page, workbench.address)
    person = Person(page)
    person.begin("Measure a part")
    drop(page, "part", "touches", EXAMPLES / "bracket_tip_centres.csv")
    drop(page, "part", "map", tmp_path / name)
    guide = page.locator(".next-step")
    guide.locator("text=the part as a STEP file").wait_for()
    drop(page, "part", "part", EXAMPLES / "bracket_pmi.step")
    guide.locator("text=press “Find the part”").wait_for()
    # Coordinates alone are no mistake: nothing is red before all is there.
    assert page.locator(".error-view").count() == 0
    person.click(person.button("Find the part"))
    guide.locator("text=Fill the table").wait_for()
    person.click(person.button("Fill from the model or the drawing"))
    page.wait_for_selector(".tolerance-rows tbody tr")
    person.click(person.button("Measure"))
    first = page.locator(".feature-rows tbody tr").first
    first.wait_for()
    settled(page)
    guide.locator("text=Type u of the machine").wait_for()
    assert person.clicks <= 6
    # The verdict is above the tabs, in the words of the count.
    verdict = page.locator(".screen-status .verdict")
    assert "1 outside the tolerance (cylinder13: diameter)" in verdict.inner_text()
    assert first.locator("th").inner_text() == "cylinder13"
    assert "does not conform" in first.inner_text() or "outside" in first.inner_text()
    row = page.locator(".tolerance-rows tbody tr:has(th:text-is('cylinder13'))").first
    row.locator("td.number:has-text('mm')").wait_for()  # its value stands beside what is typed
    page.screenshot(path=tmp_path / "table.png", full_page=True)
    # The verdict of each row is seen without moving a table sideways.
    for size in ((1280, 900), (1440, 900)):
        seen_at(page, size)
        assert stays(page, _CUT) == [], size
    seen_at(page, (390, 844))
    assert stays(page, _NARROW_VERDICTS) == []
    seen_at(page, (1280, 900))
    page.get_by_label("limits of cylinder13").fill("13.9..14.1")
    page.wait_for_selector("text=The settings have changed since this result.")
    page.get_by_role("button", name="Measure", exact=True).click()
    page.wait_for_selector(".verdict:not(:has-text('cylinder13: diameter'))")
