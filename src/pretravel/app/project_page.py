"""The page of the project: download, open, begin another one, and the other ones."""

from __future__ import annotations

import asyncio
from datetime import datetime
from pathlib import Path

from nicegui import ui

from pretravel.app.components.layout import note, panel, problem_said, text
from pretravel.app.project import LARGEST_PROJECT
from pretravel.app.project_file import PROJECT_ENDING
from pretravel.app.session import SESSION, RecentProject, address_in, recent_projects
from pretravel.app.shell import page_frame
from pretravel.base import PretravelError

_MOST_NAMES = 4
"""Files of a project that are named in the list."""


async def project_page() -> None:
    """What can be done with a project."""
    recent = await asyncio.to_thread(recent_projects)
    with page_frame("Project", "project"), ui.element("div").classes("project-page"):
        with panel("This project"):
            session = SESSION.current
            text("p", session.project.name, "strong")
            note(f"It is saved automatically, in {session.path}")
            link = text("a", "Download as one file", "button-link")
            link.props["href"] = address_in("/project/download")
            link.props["download"] = True
        with panel("Open a file"), ui.element("div").classes("file-drop"):
            with ui.element("label"):
                ui.icon("folder_open").props('aria-hidden="true"')
                text("span", f"Open a project (*{PROJECT_ENDING})", "file-drop-label")
                text(
                    "span",
                    "The project that is open now stays, under “Other projects”.",
                    "file-drop-hint",
                )
                chooser = ui.element("input").props('type="file"').classes("file-drop-input")
                chooser.props["data-url"] = "/project/open"
                chooser.props["accept"] = PROJECT_ENDING
                chooser.props["data-limit"] = LARGEST_PROJECT
            ui.element("p").classes("file-drop-status").props('role="status"')
        with panel("Another project"):
            ui.button("New project", icon="add", on_click=_new).props("no-caps unelevated")
            note("This one stays, under “Other projects”.")
            others = [one for one in recent if one.path != session.path]
            if others:
                text("h3", "Other projects")
                with ui.element("ul").classes("file-list"):
                    for one in others:
                        _entry(one)


def _entry(recent: RecentProject) -> None:
    with ui.element("li"):
        used = datetime.fromtimestamp(recent.used).strftime("%Y-%m-%d %H:%M")
        with ui.element("div").classes("file-name"):
            text("span", recent.name, "strong")
            more = len(recent.contents) - _MOST_NAMES
            names = ", ".join(recent.contents[:_MOST_NAMES]) + (f" and {more} more" * (more > 0))
            note(names or "no files")
        text("span", used, "file-size")
        button = ui.button("Open", on_click=lambda: _open(recent.path)).props("no-caps outline")
        button.props["aria-label"] = f"Open {recent.name}, last used {used}"


def _new() -> None:
    ui.navigate.to(address_in("/", SESSION.new().project))


async def _open(path: Path) -> None:
    try:
        session = SESSION.open(path)
    except PretravelError as error:
        problem_said(str(error))
        return
    ui.navigate.to(address_in("/", session.project))
