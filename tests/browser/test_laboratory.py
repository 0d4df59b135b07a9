"""The screen Laboratory: traces with marks that a person moves, and separation, to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.task.example_data import example_folder
from tests.browser.screens import downloaded, drop, resting_box, run_shown_lines, settled, tab
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run
from tests.support.results import data_of

TRACES = sorted((example_folder() / "rig").glob("*.csv"))
READINGS = example_folder() / "redundancy_24x24.csv"
CONTACT = '.plot[aria-label*="near the contact"]'


def test_a_dragged_mark_and_the_command_give_the_same_calibration(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}laboratory")
    drop(page, "laboratory", "traces", *TRACES)
    page.wait_for_selector(f"text={len(TRACES)} traces")
    settled(page)
    assert serious_problems(page) == []
    tab(page, "One trace")
    leave_a_trace_out_and_take_it_back(page)
    place = page.get_by_label("r0 [µm]")
    before = float(place.input_value())
    line = page.locator(f"{CONTACT} .shapelayer path").first
    line.scroll_into_view_if_needed()
    box = resting_box(page, line)
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 20.0, y, steps=5)
    page.mouse.up()
    page.wait_for_selector("text=r0 was moved by hand")
    settled(page)
    after = float(place.input_value())
    assert after < before - 0.1
    tab(page, "Files")
    mine = data_of(downloaded(page, "rig.json", tmp_path))
    command = page.locator(".copy-button").first.get_attribute("data-copy")
    mark = command.split("--mark ")[1].split()[0]
    run("rig", *TRACES, "--mark", mark, "-o", tmp_path / "by_command.json")
    assert mine == data_of(tmp_path / "by_command.json")
    folder = tmp_path / "lines"
    folder.mkdir()
    run_shown_lines(page, folder, TRACES)


def leave_a_trace_out_and_take_it_back(page: Any) -> None:
    page.get_by_role("button", name="Leave this trace out").click()
    page.get_by_role("button", name="Include this trace").wait_for()
    settled(page)  # a click while the page is built again would be lost
    page.get_by_role("button", name="Include this trace").click()
    page.get_by_role("button", name="Leave this trace out").wait_for()
    settled(page)


def test_a_separation_is_that_of_the_command_line(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}laboratory")
    page.get_by_label("What do you have?").click()
    page.get_by_role("option", name="Machine and probe separated").click()
    page.wait_for_selector('.file-drop-input[data-url$="/laboratory/readings"]', state="attached")
    drop(page, "laboratory", "readings", READINGS)
    page.wait_for_selector(".verdict")
    settled(page)
    assert serious_problems(page) == []
    tab(page, "Files")
    mine = data_of(downloaded(page, "separation.json", tmp_path))
    run("separate", READINGS, "-o", tmp_path / "by_command.json")
    assert mine == data_of(tmp_path / "by_command.json")
