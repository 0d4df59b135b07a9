"""What one screen takes of another is a link: the other one's change makes it old at once."""

from __future__ import annotations

import re
from typing import Any

from pretravel.task.example_data import example_folder
from tests.browser import screens
from tests.browser.screens import settled, tab
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened

REFERENCE = "Diameter of the reference [mm]"


def _qualified(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    step(page, "Choose your control")


def _part_with_map(page: Any, workbench: RunningWorkbench) -> None:
    _qualified(page, workbench)
    page.get_by_role("button", name="Measure a part with this map").click()
    page.wait_for_url("**/part?*")
    screens.drop(page, "part", "touches", example_folder() / "bore_touches.csv")
    page.wait_for_selector(".screen-picture .live:not(.stale) .plot-area")


def _is_old(page: Any) -> bool:
    return bool(page.locator(".screen-picture .live.stale").count())


def test_a_new_reference_makes_the_part_old_until_the_newer_map_is_used(
    page: Any, workbench: RunningWorkbench
) -> None:
    _part_with_map(page, workbench)
    opened(page, f"{workbench.address}engineer")
    page.get_by_label(REFERENCE).fill("25.0007")
    page.get_by_label(REFERENCE).blur()
    step(page, "Choose your control")
    # Home says so, without a look at the part.
    opened(page, workbench.address)
    page.wait_for_selector(".contents li.stale:has-text('Measure a part')")
    assert "The map is newer" in page.inner_text(".contents")
    opened(page, f"{workbench.address}part")
    page.wait_for_selector("text=The map is newer: Qualify a probe makes another one now")
    page.wait_for_selector(".screen-picture .live.stale .plot-area")
    tab(page, "Files")
    assert page.get_by_role("button", name="points.csv").evaluate("e => !!e.closest('[inert]')")
    page.get_by_role("button", name="Use the newer one").click()
    page.wait_for_selector(".screen-picture .live:not(.stale) .plot-area")
    assert page.locator(".newer").count() == 0
    opened(page, workbench.address)
    page.wait_for_selector(".contents")
    assert page.locator(".contents li.stale").count() == 0


def test_touches_that_are_left_out_make_the_part_old_and_the_old_map_can_be_kept(
    page: Any, workbench: RunningWorkbench
) -> None:
    _part_with_map(page, workbench)
    opened(page, f"{workbench.address}engineer")
    tab(page, "Touches")
    for row in range(4):
        page.locator(".touches input[type=checkbox]").nth(row).click()
    page.wait_for_selector("text=You left out 4 of")
    opened(page, f"{workbench.address}part")
    page.wait_for_selector(".newer:has-text('The map is newer')")
    assert _is_old(page)
    page.get_by_role("button", name="Keep the old one").click()
    page.wait_for_selector(".screen-picture .live:not(.stale) .plot-area")
    # What was before is before again: no link, no warning.
    page.reload()
    page.wait_for_selector(".screen-picture .live:not(.stale) .plot-area")
    assert page.locator(".newer").count() == 0


def test_a_reference_that_was_taken_from_another_screen_follows_it(
    page: Any, workbench: RunningWorkbench
) -> None:
    _qualified(page, workbench)
    opened(page, f"{workbench.address}metrologist")
    page.wait_for_selector("text=Reference and tip are those of this project")
    screens.drop(page, "metrologist", "touches", SPHERE)
    page.wait_for_selector(".verdict, .error-view")
    opened(page, f"{workbench.address}engineer")
    page.get_by_label(REFERENCE).fill("24.99")
    page.get_by_label(REFERENCE).blur()
    step(page, "Choose your control")
    opened(page, f"{workbench.address}metrologist")
    page.wait_for_selector(".newer:has-text('The reference is newer')")
    page.get_by_role("button", name="Use the newer one").click()
    page.wait_for_selector(".newer", state="detached")
    field = page.get_by_label(re.compile(r"^Diameter of the reference \[mm\]$")).first
    assert field.input_value() == "24.99"
    # What the user types here himself is his own.
    field.fill("24.98")
    field.blur()
    page.wait_for_selector("text=Reference and tip are those", state="detached")
    opened(page, f"{workbench.address}engineer")
    page.get_by_label(REFERENCE).fill("24.9987")
    page.get_by_label(REFERENCE).blur()
    step(page, "Choose your control")
    opened(page, f"{workbench.address}metrologist")
    settled(page)
    assert page.locator(".newer").count() == 0


def test_a_file_of_another_screen_is_a_link_to_it(page: Any, workbench: RunningWorkbench) -> None:
    _qualified(page, workbench)
    opened(page, f"{workbench.address}task/qualify")
    page.get_by_role("button", name="Take sphere.csv from this project").click()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".screen-answer .document")
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes().replace(b"-124.73", b"-124.74", 3))
    step(page, "Choose your control")
    opened(page, f"{workbench.address}task/qualify")
    page.wait_for_selector(".newer:has-text('Qualify a probe has another one now')")
    page.wait_for_selector(".screen-answer .live.stale")


def test_a_map_that_a_task_made_is_a_link_to_the_task(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}task/qualify")
    screens.drop(page, "task-qualify", "touches", example_folder() / "sphere_touches.csv")
    page.get_by_label(REFERENCE).first.fill("24.9987")
    page.get_by_label("Diameter of the tip [mm]").first.fill("6")
    page.get_by_label("Diameter of the tip [mm]").first.blur()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".screen-answer .live:not(.stale) .document")
    opened(page, f"{workbench.address}task/verify")
    page.get_by_role("button", name="qualify.json of Qualify").first.click()
    page.wait_for_selector(".file-name:has-text('qualify.json')")
    assert page.locator(".newer").count() == 0
    opened(page, f"{workbench.address}task/qualify")
    page.get_by_label(REFERENCE).first.fill("25.0007")
    page.get_by_label(REFERENCE).first.blur()
    page.wait_for_selector(".screen-answer .live.stale")
    opened(page, f"{workbench.address}task/verify")
    screens.drop(page, "task-verify", "touches", example_folder() / "sphere_touches.csv")
    page.wait_for_selector(".newer:has-text('The map is newer: Qualify makes another one now')")
    newer = page.locator(".newer:has-text('The map is newer')")
    newer.get_by_role("button", name="Use the newer one").click()  # it is computed there first
    newer.wait_for(state="detached")
    page.wait_for_selector(".file-name:has-text('qualify.json')")
