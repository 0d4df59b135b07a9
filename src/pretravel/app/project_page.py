"""The page of the project: download, open, begin another one, and those of before."""

from __future__ import annotations

import asyncio
from datetime import datetime
from pathlib import Path

from nicegui import Client, ui

from pretravel.app.components.layout import note, panel, text
from pretravel.app.jobs import WORKS
from pretravel.app.project import LARGEST_PROJECT
from pretravel.app.project_file import PROJECT_ENDING
from pretravel.app.session import SESSION, RecentProject, recent_projects
from pretravel.app.shell import page_frame
from pretravel.base.errors import PretravelError


async def project_page() -> None:
    """What can be done with a project."""
    recent = await asyncio.to_thread(recent_projects)
    with page_frame("Project", "project"), ui.element("div").classes("project-page"):
        with panel("This project"):
            text("p", SESSION.project.name, "strong")
            note(f"It is saved by itself, in {SESSION.path}")
            link = text("a", "Download as one file", "button-link")
            link.props["href"] = "/project/download"
            link.props["download"] = True
        with panel("Open a file"), ui.element("div").classes("file-drop"):
            with ui.element("label"):
                ui.icon("folder_open").props('aria-hidden="true"')
                text("span", f"Open a project (*{PROJECT_ENDING})", "file-drop-label")
                text("span", "The project that is open now stays in the list.", "file-drop-hint")
                chooser = ui.element("input").props('type="file"').classes("file-drop-input")
                chooser.props["data-url"] = "/project/open"
                chooser.props["accept"] = PROJECT_ENDING
                chooser.props["data-limit"] = LARGEST_PROJECT
            ui.element("p").classes("file-drop-status").props('role="status"')
        with panel("Another project"):
            ui.button("New project", icon="add", on_click=_new).props("no-caps unelevated")
            others = [one for one in recent if one.path != SESSION.path]
            if others:
                text("h3", "Projects of before")
                with ui.element("ul").classes("file-list"):
                    for one in others:
                        _entry(one)


def _entry(recent: RecentProject) -> None:
    with ui.element("li"):
        used = datetime.fromtimestamp(recent.used).strftime("%Y-%m-%d %H:%M")
        text("span", recent.name, "file-name")
        text("span", used, "file-size")
        button = ui.button("Open", on_click=lambda: _open(recent.path)).props("no-caps outline")
        button.props["aria-label"] = f"Open {recent.name}, last used {used}"


def _new() -> None:
    SESSION.new()
    reload_all_tabs()


async def _open(path: Path) -> None:
    try:
        SESSION.open(path)
    except PretravelError as error:
        ui.notify(str(error), type="negative", multi_line=True, close_button="Close")
        return
    reload_all_tabs()


def reload_all_tabs() -> None:
    """Show another project in every tab."""
    WORKS.forget_all()
    for client in tuple(Client.instances.values()):
        client.run_javascript("location.reload()")
