"""What stands on a page is the result of its fields, or it is pale and cannot be taken."""

from __future__ import annotations

from typing import Any

from tests.browser.screens import tab
from tests.browser.test_engineer import SPHERE, choose_control, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened

REFERENCE = "Diameter of the reference [mm]"
RESULTS = {
    ".screen-picture .plot-area": "",
    ".main-download": "",
    ".table-frame.touches": "Touches",
    ".q-tab-panel .plot-area >> nth=0": "Lobes",
    "text=All corrections, over the azimuth": "Corrections",
    "text=The same on the command line and in Python": "Files",
    ".verdict": "",
}
"""One thing of each place that a qualification has made, and its tab."""


def _qualified(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    choose_control(page, "Fanuc (macro programs)")
    step(page, "Download the values")
    page.wait_for_selector(".main-download")


def _pale(page: Any) -> set[str]:
    """Those that stand in a place that is pale."""
    found = set()
    for one, name in RESULTS.items():
        if name:
            tab(page, name)
        place = page.locator(one)
        if place.count() and place.first.evaluate("e => !!e.closest('.stale')"):
            found.add(one)
    return found


def test_a_number_that_is_none_makes_everything_pale_that_depends_on_it(
    page: Any, workbench: RunningWorkbench
) -> None:
    _qualified(page, workbench)
    assert _pale(page) == set()
    page.get_by_label(REFERENCE).fill("24.99.87")
    step(page, "Diameter of the reference: the value in this field is not valid")
    assert _pale(page) == set(RESULTS)
    # What would act on the old result cannot be reached.
    assert page.locator(".main-download").evaluate("e => !!e.closest('[inert]')")
    page.get_by_label(REFERENCE).fill("24.9987")
    step(page, "Download the values")
    assert _pale(page) == set()
    assert not page.locator(".main-download").evaluate("e => !!e.closest('[inert]')")


def test_a_reference_that_does_not_fit_makes_all_sections_pale(
    page: Any, workbench: RunningWorkbench
) -> None:
    _qualified(page, workbench)
    page.get_by_label(REFERENCE).fill("20")
    step(page, "the message says what to correct")
    assert _pale(page) == set(RESULTS) - {".main-download"}
    assert page.locator(".main-download").count() == 0  # no files without a map


def test_an_invalid_setting_of_the_control_holds_its_files_alone(
    page: Any, workbench: RunningWorkbench
) -> None:
    """The probe is qualified without it: its verdict stays."""
    _qualified(page, workbench)
    page.get_by_text("Settings of the control", exact=True).click()
    field = page.get_by_label("Largest deviation from the map")
    field.fill("much")
    step(page, "is not valid")
    assert _pale(page) == {".main-download", "text=The same on the command line and in Python"}
    # Another control has other fields: what stood in one that is gone holds nothing.
    choose_control(page, "Renishaw cycles (vector radii)")
    page.wait_for_function("!document.querySelector('.next-step').innerText.includes('not valid')")
