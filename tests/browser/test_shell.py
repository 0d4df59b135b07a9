"""The frame that all screens share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.app.project import Project, StoredFile
from pretravel.app.project_file import read_project, write_project
from pretravel.app.screens import SCREENS
from tests.browser.test_engineer import SPHERE, drop, state_diameters, step
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
    named = "document.querySelector('.project-name input')?.value === '{}'".format
    page.get_by_role("button", name="New project").click()
    page.wait_for_function(named("Untitled"))
    assert other.get_by_label("Name of the project").input_value() == "Probe 7"  # its own one
    other.reload()
    other.wait_for_function(named("Probe 7"))
    page.locator("header a:has-text('Project')").click()
    page.wait_for_function("location.pathname === '/project'")
    page.get_by_role("button", name="Open Probe 7").click()
    page.wait_for_function(named("Probe 7"))
    page.locator("header a:has-text('Project')").click()
    page.wait_for_selector("text=Open a file")
    write_project(path, Project("Of a colleague"))
    page.set_input_files(".file-drop-input", str(path))
    page.wait_for_function(named("Of a colleague"))
    page.locator("header a:has-text('Project')").click()
    page.wait_for_selector("text=Open a file")
    assert serious_problems(page) == []
    path.write_bytes(b"x_mm")
    page.set_input_files(".file-drop-input", str(path))
    page.wait_for_selector("text=p.pretravel: this is not a project of pretravel")


def test_home_shows_what_a_project_holds_and_what_comes_next(
    page: Any, workbench: RunningWorkbench
) -> None:
    """A project takes the name of its first file; its map is one click from a part."""
    opened(page, f"{workbench.address}project")
    page.get_by_role("button", name="New project").click()
    page.wait_for_selector("main h1:has-text('What do you want to do?')")
    assert page.get_by_text("In this project").count() == 0
    page.get_by_role("heading", name="Qualify a probe").click()
    drop(page, SPHERE.read_bytes(), "probe 7.csv")
    state_diameters(page)
    step(page, "Choose your control")
    assert page.get_by_label("Name of the project").input_value() == "probe 7"
    page.locator("a.brand").click()
    page.wait_for_selector("text=In this project")
    page.wait_for_selector(".contents:has-text('probe 7.csv')")
    page.wait_for_selector(".contents:has-text('Choose your control')")
    page.get_by_role("button", name="Measure a part with this map").click()
    page.wait_for_function("location.pathname === '/part'")
    assert page.get_by_label("Name of the project").input_value() == "probe 7"


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
