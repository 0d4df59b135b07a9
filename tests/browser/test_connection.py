"""Typing without a connection, unfinished numbers, files that are too large: nothing is lost."""

from __future__ import annotations

from typing import Any

from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened
from tests.support.examples import EXAMPLES

REFERENCE = "Diameter of the reference [mm]"
TIP = "Diameter of the tip [mm]"


def _without_connection(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    step(page, "Type the diameter of the reference sphere")
    page.evaluate("window.socket.disconnect()")
    page.wait_for_selector(".lost:has-text('Not connected')")
    assert not page.locator(".saved:not(.lost)").is_visible()
    page.get_by_label(REFERENCE).fill("24.9987")
    page.get_by_label(TIP).fill("6")
    page.get_by_label(TIP).blur()


def test_what_is_typed_is_sent_when_the_connection_is_back(
    page: Any, workbench: RunningWorkbench
) -> None:
    _without_connection(page, workbench)
    page.evaluate("window.socket.connect()")
    step(page, "Choose your control")
    page.wait_for_selector(".saved:not(.lost):has-text('Saved')")
    assert page.locator(".lost").inner_text() == ""


def test_a_page_that_has_to_load_again_types_it_again(
    page: Any, workbench: RunningWorkbench
) -> None:
    _without_connection(page, workbench)
    page.reload()
    step(page, "Choose your control")
    assert page.get_by_label(REFERENCE).input_value() == "24.9987"
    # Once: what was kept is not typed into a page of later.
    project = page.locator(".lost").get_attribute("data-project")
    assert page.evaluate(f"localStorage.getItem('pretravel {project} /engineer')") is None


def test_an_unfinished_number_is_no_error(page: Any, workbench: RunningWorkbench) -> None:
    """24 mm contradict the touches, and are on the way to 24.9987."""
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    page.wait_for_selector(".verdict")
    page.evaluate(
        "new MutationObserver(() => { window.red ||= !!document.querySelector('.error-view') })"
        ".observe(document.body, { subtree: true, childList: true })"
    )
    field = page.get_by_label(REFERENCE)
    # As a person types, but at one moment: no pause between two keys is that of a slow computer.
    typed = """(field) => ["", "2", "24", "24.", "24.9", "24.99", "24.9987"].map((value) => {
      field.value = value;
      field.dispatchEvent(new Event("input", { bubbles: true }));
      return getComputedStyle(document.querySelector(".q-tab-panels")).pointerEvents;
    })"""
    # The verdict of before is pale at once, and nothing beside it can be taken.
    assert field.evaluate(typed) == ["none"] * 7
    field.blur()
    page.wait_for_function("!document.body.classList.contains('typing')")
    step(page, "Choose your control")
    assert not page.evaluate("window.red === true")
    field.fill("24")
    field.blur()
    page.wait_for_selector(".error-view")


def test_a_file_that_is_too_large_is_not_sent(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if "/upload/" in request.url else 0)
    page.locator("input.file-drop-input").first.evaluate("e => { e.dataset.limit = 1000 }")
    drop(page, SPHERE.read_bytes())
    page.wait_for_selector(".file-drop-status:has-text('larger than 0.001 MB')")
    assert sent == []


def test_a_step_that_is_still_to_come_is_no_error(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}part")
    chooser = page.locator("input.file-drop-input[data-url$='/part/touches']")
    chooser.set_input_files(str(EXAMPLES / "part_touches.csv"))
    page.wait_for_selector("text=Next: a map of the probe")
    assert page.locator(".error-view").count() == 0
