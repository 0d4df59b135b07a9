"""The daily check: two clicks, an answer in a word, a colour and micrometres, days that stay."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from pretravel.files.probe_history import read_history
from tests.browser import screens
from tests.browser.screens import cut_or_covered, downloaded, seen_at, settled, tab
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems
from tests.support.commands import run
from tests.support.touches_of_days import day_of


def _qualified(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}engineer")
    drop(page, SPHERE.read_bytes())
    state_diameters(page)
    step(page, "Choose your control")


def _check(page: Any, path: Path, word: str) -> None:
    screens.drop(page, "daily", "touches", path)
    page.wait_for_selector(f".file-name:has-text('{path.name}')")
    page.wait_for_selector(f".verdict-card:has-text('{word}')")
    settled(page)


def test_a_day_is_two_clicks_and_the_days_stay(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    _qualified(page, workbench)
    opened(page, workbench.address)
    # The first thing on home, once there is a map.
    page.wait_for_selector(".daily-first")
    first = page.locator("main .panel h2").first.inner_text()
    assert first == "Daily check"
    page.get_by_role("link", name="Drop today's touches").click()  # the first click
    page.wait_for_selector('.file-name:has-text("map.json")')  # the map of this project
    days = [day_of(tmp_path, day) for day in (1, 2, 3)]
    _check(page, days[0], "No change found")  # the second: the file
    assert re.search(r"largest difference from the map\s*\d+\.\d µm", page.inner_text(".document"))
    assert "qualify again" in page.inner_text(".document")
    for path in days[1:]:
        _check(page, path, "No change found")
    page.wait_for_selector(".document:has-text('from 3 checks in the history')")
    seen_at(page, (1280, 900))
    assert cut_or_covered(page) == []
    # The next morning: another tab, after a look at another screen.
    opened(page, f"{workbench.address}daily")
    page.wait_for_selector(".document:has-text('from 3 checks in the history')")
    assert serious_problems(page) == []
    tab(page, "Files")
    mine = downloaded(page, "history.jsonl", tmp_path)
    # The command goes on with the same file, and has the same lines.
    theirs, made = tmp_path / "theirs.jsonl", tmp_path / "map.json"
    run("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6", "-o", made)
    for path in days:
        run("verify", path, "--map", made, "--diameter", "24.9987", "--history", theirs)
    for ours, command in zip(read_history(mine), read_history(theirs), strict=True):
        assert {**ours.values, "time": ""} == {**command.values, "time": ""}
    longer = day_of(tmp_path, 4, longer=0.004)
    run("verify", longer, "--map", made, "--diameter", "24.9987", "--history", mine, code=3)
    run("history", mine)


def test_a_changed_probe_is_red_and_said_on_home(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    _qualified(page, workbench)
    opened(page, f"{workbench.address}daily")
    page.wait_for_selector('.file-name:has-text("map.json")')
    _check(page, day_of(tmp_path, 1, longer=0.004), "Changed: qualify again")
    assert "bad" in str(page.locator(".verdict-card").first.get_attribute("class"))
    opened(page, workbench.address)
    page.wait_for_selector(".daily-first:has-text('Changed: qualify again')")


def test_the_touches_of_the_map_are_no_check(page: Any, workbench: RunningWorkbench) -> None:
    """A map shows no change on its own touches: that is not green, and no day of the history."""
    _qualified(page, workbench)
    opened(page, f"{workbench.address}daily")
    page.wait_for_selector('.file-name:has-text("map.json")')
    screens.drop(page, "daily", "touches", SPHERE)
    page.wait_for_selector(".error-view:has-text('nothing was tested')")


def test_the_log_of_yesterday_is_no_check_of_today(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    _qualified(page, workbench)
    opened(page, f"{workbench.address}daily")
    page.wait_for_selector('.file-name:has-text("map.json")')
    days = [day_of(tmp_path, day) for day in (1, 2)]
    for path in days:
        _check(page, path, "No change found")
    screens.drop(page, "daily", "touches", days[0])
    page.wait_for_selector(".error-view:has-text('these touches are in the history already')")
    # A day that was no check is taken out again, and a new history begins.
    page.get_by_text("History of the probe", exact=True).click()
    page.get_by_role("button", name="Begin a new history").click()
    _check(page, days[0], "No change found")
    page.wait_for_selector(".document:has-text('from 1 check in the history')")


def test_a_history_of_the_command_goes_on_here(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    made, history = tmp_path / "map.json", tmp_path / "probe7.jsonl"
    run("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6", "-o", made)
    for day in (1, 2):
        path = day_of(tmp_path, day)
        run("verify", path, "--map", made, "--diameter", "24.9987", "--history", history)
    opened(page, f"{workbench.address}task/repeat")
    screens.drop(page, "task-repeat", "log", history)
    page.locator("button.offer").click()  # it belongs to the daily check
    page.wait_for_url("**/daily?*")
    screens.drop(page, "daily", "map", made)
    page.get_by_label("Diameter of the reference [mm]").first.fill("24.9987")
    _check(page, day_of(tmp_path, 3), "No change found")
    page.wait_for_selector(".document:has-text('from 3 checks in the history')")
    opened(page, f"{workbench.address}task/history")  # which reads the history of the daily check
    page.get_by_role("button", name="Take history.jsonl from this project").click()
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".document:has-text('3 verifications')")


def test_task_history_takes_the_file(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    made, history = tmp_path / "map.json", tmp_path / "probe7.jsonl"
    run("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6", "-o", made)
    path = day_of(tmp_path, 1)
    run("verify", path, "--map", made, "--diameter", "24.9987", "--history", history)
    opened(page, f"{workbench.address}task/history")
    screens.drop(page, "task-history", "places", history)
    page.wait_for_selector('.file-name:has-text("probe7.jsonl")')
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".document:has-text('1 verification')")


def test_task_verify_adds_the_day_to_the_history_that_was_dropped(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    made, history = tmp_path / "map.json", tmp_path / "probe7.jsonl"
    run("qualify", SPHERE, "--diameter", "24.9987", "--tip-diameter", "6", "-o", made)

    def check(day: int, name: str) -> int:
        """The days in the history after a run with the touches of a day."""
        screens.drop(page, "task-verify", "touches", day_of(tmp_path, day))
        page.wait_for_selector(f".file-name:has-text('day{day}.csv')")
        page.get_by_role("button", name="Run", exact=True).click()
        page.wait_for_selector(".screen-answer .live:not(.stale) .document")
        settled(page)
        tab(page, "Files")
        return len(list(read_history(downloaded(page, name, tmp_path))))

    opened(page, f"{workbench.address}task/verify")
    screens.drop(page, "task-verify", "map_file", made)
    page.wait_for_selector(".file-name:has-text('map.json')")
    page.get_by_label("Diameter of the reference [mm]").first.fill("24.9987")
    page.get_by_label("Diameter of the reference [mm]").first.blur()
    assert check(1, "history.jsonl") == 1  # a new one, to keep
    history.write_bytes((tmp_path / "history.jsonl").read_bytes())
    page.get_by_text("More files", exact=True).click()
    screens.drop(page, "task-verify", "history", history)
    page.wait_for_selector(".file-name:has-text('probe7.jsonl')")
    assert check(2, "probe7.jsonl") == 2
    assert check(3, "probe7.jsonl") == 3  # the screen has kept that of before
