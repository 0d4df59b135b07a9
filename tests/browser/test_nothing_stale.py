"""What stands on a page is the result of its fields, or it is pale and cannot be taken."""

from __future__ import annotations

from typing import Any

from tests.browser.test_engineer import SPHERE, choose_control, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened

REFERENCE = "Diameter of the reference [mm]"
RESULTS = (".verdict", ".plot-area", "text=Full report of the qualification", ".main-download")
"""One thing of each section that a qualification has made."""


def _qualified(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    choose_control(page, "Fanuc (macro programs)")
    step(page, "Download the values")
    page.wait_for_selector(".main-download")


def _pale(page: Any, results: tuple[str, ...] = RESULTS) -> list[bool]:
    """Of each of them: whether it stands in a place that is pale."""
    return [page.locator(one).first.evaluate("e => !!e.closest('.stale')") for one in results]


def test_a_number_that_is_none_makes_everything_pale_that_depends_on_it(
    page: Any, workbench: RunningWorkbench
) -> None:
    _qualified(page, workbench)
    assert _pale(page) == [False] * len(RESULTS)
    page.get_by_label(REFERENCE).fill("24.99.87")
    step(page, "Diameter of the reference: what stands in this field is no valid value")
    assert _pale(page) == [True] * len(RESULTS)
    # What would act on the old result cannot be reached.
    assert page.locator(".main-download").evaluate("e => !!e.closest('[inert]')")
    page.get_by_label(REFERENCE).fill("24.9987")
    step(page, "Download the values")
    assert _pale(page) == [False] * len(RESULTS)
    assert not page.locator(".main-download").evaluate("e => !!e.closest('[inert]')")


def test_a_reference_that_does_not_fit_makes_all_sections_pale(
    page: Any, workbench: RunningWorkbench
) -> None:
    _qualified(page, workbench)
    page.get_by_label(REFERENCE).fill("20")
    step(page, "the message says what to correct")
    assert _pale(page, RESULTS[:3]) == [True] * 3
    assert page.locator(".main-download").count() == 0  # no files without a map


def test_an_invalid_setting_of_the_control_holds_its_files_alone(
    page: Any, workbench: RunningWorkbench
) -> None:
    """The probe is qualified without it: its verdict stays."""
    _qualified(page, workbench)
    page.get_by_text("Settings of the control", exact=True).click()
    field = page.get_by_label("Largest deviation from the map")
    field.fill("much")
    step(page, "no valid value")
    assert _pale(page) == [False, False, False, True]
    # Another control has other fields: what stood in the old one holds nothing.
    choose_control(page, "Haas (macro programs)")
    page.wait_for_function("!document.querySelector('.next-step').innerText.includes('no valid')")


def test_cancel_brings_back_the_file_of_before(page: Any, workbench: RunningWorkbench) -> None:
    """A file of many megabytes, in a process that ends at once; all of before is back."""
    _qualified(page, workbench)
    head, *rows = SPHERE.read_text("utf-8").splitlines(keepends=True)
    drop(page, (head + "".join(rows) * 1500).encode(), "large.csv")
    page.wait_for_selector('.file-name:has-text("large.csv")')
    page.get_by_role("button", name="Cancel").first.click()
    step(page, "Download the values")
    assert page.locator(".file-name").all_inner_texts()[0] == "sphere.csv"
    assert _pale(page) == [False] * len(RESULTS)
    assert "Files and settings are those of before" in page.inner_text("main")
    # The next one does not wait for what was cancelled.
    drop(page, SPHERE.read_bytes(), "next.csv")
    page.wait_for_selector('.file-name:has-text("next.csv")')
    step(page, "Download the values")
