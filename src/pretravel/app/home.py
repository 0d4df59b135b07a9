"""What the project of a page holds, and what comes next."""

from __future__ import annotations

from nicegui import ui

from pretravel.app.components.from_project import made_map, measure_with_map
from pretravel.app.components.layout import live, note, panel, text
from pretravel.app.jobs import WORKS
from pretravel.app.project import ScreenState
from pretravel.app.screens import SCREENS
from pretravel.app.screens.every_task import screen_of_task
from pretravel.app.session import SESSION, address_in

_MOST_NAMES = 3
"""Files of a screen that are named."""


def project_contents() -> None:
    """Each screen with files, what it holds and its next step; nothing where there are none."""
    project = SESSION.project
    if not project.file_names:
        return
    from pretravel.tasks.qualify import EXPORT, FIT

    works = [WORKS.of(project.screen("engineer"), job) for job in (FIT, EXPORT)]

    def key() -> object:
        return _rows(), made_map() is None

    live([project.listen, *(work.listen for work in works)], _build, key)


def _build() -> None:
    with panel("In this project"), ui.element("ul").classes("file-list contents"):
        for title, address, files, step in _rows():
            with ui.element("li"):
                with ui.element("div").classes("file-name"):
                    text("a", title, "strong").props["href"] = address_in(address)
                    note(files)
                text("span", step, "file-size")
        if made_map() is not None and not SESSION.project.screen("part").files["map"]:
            with ui.element("li"):
                text("span", "The map of the probe is there.", "file-name")
                measure_with_map()


def _rows() -> list[tuple[str, str, str, str]]:
    """Title and address of each screen with files, these files, and the next step."""
    found = []
    for state in SESSION.project.screens:
        names = list(dict.fromkeys(f.name for files in state.files.values() for f in files))
        if not names:
            continue
        more = len(names) - _MOST_NAMES
        files = ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" * (more > 0))
        title, address = _place(state)
        found.append((title, address, files, _next(state)))
    return found


def _place(state: ScreenState) -> tuple[str, str]:
    """Title and address of a screen."""
    for screen in SCREENS:
        if screen.name == state.name:
            return screen.title, f"/{screen.name}"
    word = state.name.removeprefix("task-")
    task = screen_of_task(word)
    return (word if task is None else task.title), f"/task/{word}"


def _next(state: ScreenState) -> str:
    """The next step of a screen that states one."""
    if state.name != "engineer":
        return ""
    from pretravel.tasks.qualify import next_sentence

    heading, words = next_sentence(state)
    return f"{heading}: {words}"
