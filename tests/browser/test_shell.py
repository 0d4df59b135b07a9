"""The frame that all screens share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.app.project import Project, StoredFile
from pretravel.app.project_file import read_project, write_project
from pretravel.app.screens import SCREENS
from tests.browser.workbench_server import (
    RunningWorkbench,
    opened,
    running_workbench,
    serious_problems,
)


def test_pages_are_accessible_and_the_theme_that_was_chosen_stays(
    page: Any, workbench: RunningWorkbench
) -> None:
    """The pages of screens are judged in the tests of the screens, where they show results."""
    opened(page, workbench.address)
    assert serious_problems(page) == []
    for theme, dark, then in (("dark", True, "help"), ("light", False, "")):
        page.locator("#theme").select_option(theme)
        assert page.evaluate("document.body.classList.contains('body--dark')") is dark
        opened(page, f"{workbench.address}{then}")
        assert page.evaluate("document.body.classList.contains('body--dark')") is dark
        if then == "help":
            assert serious_problems(page) == []


def test_projects_are_named_downloaded_and_opened_again(
    page: Any, workbench: RunningWorkbench, tmp_path: Path
) -> None:
    opened(page, f"{workbench.address}project")
    name = page.get_by_label("Name of the project")
    name.fill("Probe 7")
    other = page.context.new_page()
    opened(other, workbench.address)
    other.wait_for_function("document.querySelector('.project-name input').value === 'Probe 7'")
    with page.expect_download() as download:
        page.get_by_text("Download as one file").click()
    assert download.value.suggested_filename == "Probe-7.pretravel"
    path = tmp_path / "p.pretravel"
    download.value.save_as(path)
    assert read_project(path).name == "Probe 7"
    page.get_by_role("button", name="New project").click()
    for tab in (page, other):  # every tab shows the project that is open
        tab.wait_for_function("document.querySelector('.project-name input')?.value === 'Untitled'")
    page.get_by_role("button", name="Open Probe 7").click()
    other.wait_for_function("document.querySelector('.project-name input')?.value === 'Probe 7'")
    write_project(path, Project("Of a colleague"))
    page.wait_for_function("document.querySelector('.project-name input')?.value === 'Probe 7'")
    page.set_input_files(".file-drop-input", str(path))
    other.wait_for_function(
        "document.querySelector('.project-name input')?.value === 'Of a colleague'"
    )
    page.wait_for_function(
        "document.querySelector('.project-name input')?.value === 'Of a colleague'"
    )
    assert serious_problems(page) == []
    path.write_bytes(b"x_mm")
    page.set_input_files(".file-drop-input", str(path))
    page.wait_for_selector("text=p.pretravel: this is no project of pretravel")


def test_settings_that_a_screen_cannot_show_are_said_and_can_be_taken_away(
    page: Any, tmp_path: Path
) -> None:
    """A project that was sent can have settings of any type; its files stay."""
    project = Project("<script>alert(1)</script>")
    wrong = {"diameter": "</script><script>alert(1)</script>", "probe": [1, {"a": []}], "feed": "x",
             "mark": None, "statements": True, "temperature": {}, "standard": []}  # fmt: skip
    for screen in SCREENS:
        project.screen(screen.name).settings.update(wrong)
    project.screen("laboratory").files["traces"] = (StoredFile("rig_000_1.csv", b"time_s"),)
    path = tmp_path / "sent.pretravel"
    write_project(path, project)
    with running_workbench(tmp_path, str(path)) as workbench:
        for screen in SCREENS:
            opened(page, f"{workbench.address}{screen.name}")
            assert page.locator("main h1").inner_text() == screen.title
            assert page.evaluate("document.querySelectorAll('main script').length") == 0
        opened(page, f"{workbench.address}laboratory")
        page.get_by_role("button", name="Begin this screen with empty settings").click()
        page.get_by_text("rig_000_1.csv").first.wait_for()
        assert serious_problems(page) == []
        page.goto("about:blank")  # before the server ends
