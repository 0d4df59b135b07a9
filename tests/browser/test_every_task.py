"""Every task has a screen; what one screen made is offered on another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.tasks.example_data import example_folder
from tests.browser.test_engineer import SPHERE, downloaded, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run


def test_a_task_without_a_screen_of_its_own_runs_as_its_command(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}tasks")
    assert serious_problems(page) == []
    page.get_by_role("link", name="Reversal", exact=True).click()
    page.wait_for_url("**/task/reversal")
    log = example_folder() / "reversal_touches.csv"
    page.set_input_files('.file-drop-input[data-url$="/task-reversal/touches"]', str(log))
    page.wait_for_selector('.file-name:has-text("reversal_touches.csv")')
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("text=36 means of two orientations")
    assert "pretravel reversal reversal_touches.csv" in page.inner_html("main")
    mine, theirs = downloaded(page, "reversal.csv", tmp_path), tmp_path / "theirs.csv"
    run("reversal", log, "-o", theirs)
    assert mine.read_text().splitlines()[1:] == theirs.read_text().splitlines()[1:]
    assert serious_problems(page) == []


def test_a_map_made_here_measures_a_part_without_a_download(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    step(page, "Choose your control")
    page.get_by_role("button", name="Measure a part with this map").click()
    page.wait_for_url("**/part")
    page.wait_for_selector('.file-name:has-text("map.json")')
    bores = example_folder() / "bore_touches.csv"
    page.set_input_files('.file-drop-input[data-url$="/part/touches"]', str(bores))
    page.wait_for_selector(".document, .verdict")
    # The same map is offered to every task that asks for one, and a file of one screen to others.
    opened(page, f"{workbench.address}task/compensate")
    page.get_by_role("button", name="the map of Qualify a probe").click()
    page.wait_for_selector('.file-name:has-text("map.json")')
    page.get_by_role("button", name="Take bore_touches.csv from this project").click()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".document")
    assert "touches" in page.inner_text(".document")


def test_an_address_of_no_task_shows_all_of_them(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}task/nothing")
    page.wait_for_selector("text=Plan touches")
