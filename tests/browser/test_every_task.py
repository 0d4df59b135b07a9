"""Every task has a screen; what one screen made is offered on another."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from pretravel.task.example_data import example_folder
from tests.browser.screens import tab
from tests.browser.test_engineer import SPHERE, downloaded, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run


def test_a_task_without_a_screen_of_its_own_runs_as_its_command(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}tasks")
    assert serious_problems(page) == []
    # As somebody without a sphere, from the screen of the engineer.
    page.locator("nav").get_by_role("link", name="Qualify a probe").click()
    page.get_by_text("No sphere, several tips, a log alone").click()
    page.get_by_role("link", name="Reversal", exact=True).click()
    page.wait_for_url("**/task/reversal?*")
    log = example_folder() / "reversal_touches.csv"
    page.set_input_files('.file-drop-input[data-url$="/task-reversal/touches"]', str(log))
    page.wait_for_selector('.file-name:has-text("reversal_touches.csv")')
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector("text=36 means of two orientations")
    tab(page, "Files")
    assert "pretravel reversal reversal_touches.csv" in page.inner_html("main")
    mine, theirs = downloaded(page, "reversal.csv", tmp_path), tmp_path / "theirs.csv"
    run("reversal", log, "-o", theirs)
    assert mine.read_text().splitlines()[1:] == theirs.read_text().splitlines()[1:]
    assert serious_problems(page) == []
    # Its values, for the task that combines results in one page.
    values = downloaded(page, "Values (JSON)", tmp_path)
    opened(page, f"{workbench.address}task/report")
    page.set_input_files('.file-drop-input[data-url$="/task-report/results"]', str(values))
    page.wait_for_selector('.file-name:has-text("reversal.report.json")')
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".file-text:has-text('1 result')")
    tab(page, "Files")
    assert "36 means" in downloaded(page, "report.html", tmp_path).read_text("utf-8")


def test_a_map_made_here_measures_a_part_without_a_download(
    page: Any, workbench: RunningWorkbench
) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    step(page, "Choose your control")
    # The click ends a value: the map of this value is waited for.
    page.get_by_label("Diameter of the tip [mm]").fill("6.0001")
    page.get_by_role("button", name="Measure a part with this map").click()
    page.wait_for_url("**/part?*")
    page.wait_for_selector('.file-name:has-text("map.json")')
    bores = example_folder() / "bore_touches.csv"
    page.set_input_files('.file-drop-input[data-url$="/part/touches"]', str(bores))
    page.wait_for_selector("text=bore1 · 12")
    # Reference and tip are typed once, for the screens of people and for those of tasks.
    for name in ("metrologist", "task/verify"):
        opened(page, f"{workbench.address}{name}")
        page.wait_for_selector("text=Reference and tip are those of this project")
        field = page.get_by_label(re.compile(r"^(Diameter of the reference|Diameter) \[mm\]$"))
        assert field.first.input_value() == "24.9987"
    # The same map is offered to every task that asks for one, and a file of one screen to others.
    opened(page, f"{workbench.address}task/compensate")
    page.get_by_role("button", name="the map of Qualify a probe").click()
    page.wait_for_selector('.file-name:has-text("map.json")')
    page.get_by_role("button", name="Take bore_touches.csv from this project").click()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".document")
    assert "45 points" in page.inner_text(".document")


def test_an_address_of_no_task_shows_all_of_them(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}task/nothing")
    page.wait_for_selector("text=Plan touches")


def test_no_screen_is_wider_than_its_window(page: Any, workbench: RunningWorkbench) -> None:
    """Nor is its answer below the first window: `test_what_one_sees` has other sizes."""
    page.set_viewport_size({"width": 1440, "height": 900})
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    step(page, "Choose your control")
    for name in ("part", "metrologist", "laboratory", "designer", "task/qualify", "engineer"):
        opened(page, f"{workbench.address}{name}")
        assert page.evaluate("document.documentElement.scrollWidth") <= 1440, name
    page.wait_for_selector(".verdict")
    box = page.locator(".verdict-card").first.bounding_box()
    assert 0 <= box["y"] < box["y"] + box["height"] < 900
    assert serious_problems(page) == []
