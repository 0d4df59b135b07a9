"""What the project of a page holds, and what comes next."""

from __future__ import annotations

from dataclasses import dataclass

from nicegui import ui

from pretravel.app.components.document_view import sign_and_word
from pretravel.app.components.from_project import made_map, measure_with_map
from pretravel.app.components.layout import live, note, panel, text
from pretravel.app.components.newer import newer_words
from pretravel.app.jobs import WORKS
from pretravel.app.links import newer_inputs
from pretravel.app.project import ScreenState
from pretravel.app.screens import EVERY_MORNING, QUALIFYING, SCREENS, title_of_screen
from pretravel.app.session import SESSION, address_in
from pretravel.base import object_at
from pretravel.show import Judgement

_MOST_NAMES = 3
"""Files of a screen that are named."""


def project_contents() -> None:
    """Each screen with files: what it holds, its verdict and its next step."""
    project = SESSION.project
    if not project.file_names:
        return
    for screen in SCREENS:
        for job in screen.jobs if project.screen(screen.name).files else ():
            WORKS.of(project.screen(screen.name), object_at(job))
    works = [work for state in project.screens for work in WORKS.made(state)]
    live(
        [project.listen, *(work.listen for work in works)],
        _build,
        lambda: (_rows(), made_map() is None),
    )


@dataclass(frozen=True)
class _Row:
    """What is said of a screen.

    Attributes
    ----------
    title, address, files : str
    judgement : Judgement or None
    verdict : str
    step : str
        What comes next.
    old : bool
        Whether the result is not that of the inputs any more.
    """

    title: str
    address: str
    files: str
    judgement: Judgement | None
    verdict: str
    step: str
    old: bool


def _build() -> None:
    daily = SESSION.project.screen(EVERY_MORNING.name)
    if made_map() is not None or daily.files:
        with panel(EVERY_MORNING.title) as first:
            first.classes("daily-first")
            row = _row(daily)
            if row.verdict:
                _result(row)
            link = text("a", "Drop today's touches", "button-link")
            link.props["href"] = address_in(f"/{EVERY_MORNING.name}")
    with panel("In this project"), ui.element("ul").classes("file-list contents"):
        for row in _rows():
            with ui.element("li").classes("stale" if row.old else ""):
                with ui.element("div").classes("file-name"):
                    text("a", row.title, "strong").props["href"] = address_in(row.address)
                    note(row.files)
                _result(row)
        if made_map() is not None and not SESSION.project.screen("part").files["map"]:
            with ui.element("li"):
                text("span", "A map of the probe is ready.", "file-name")
                measure_with_map()


def _result(row: _Row) -> None:
    """The verdict of a screen, and what comes next."""
    with ui.element("div").classes("home-verdict" + " stale" * row.old):
        if row.judgement is not None:
            with text("p", "", f"judgement {row.judgement.level}"):
                sign_and_word(row.judgement, "strong")
        if row.verdict:
            text("p", row.verdict)
        if row.step:
            note(row.step)


def _rows() -> list[_Row]:
    """The screens with files, in the order of the menu."""
    places = {screen.name: place for place, screen in enumerate(SCREENS)}
    states = sorted(SESSION.project.screens, key=lambda state: places.get(state.name, len(places)))
    return [
        _row(state) for state in states if any(_names(state)) and state.name != EVERY_MORNING.name
    ]


def _names(state: ScreenState) -> list[str]:
    return list(dict.fromkeys(f.name for files in state.files.values() for f in files))


def _row(state: ScreenState) -> _Row:
    names, newer = _names(state), newer_inputs(state)
    more = len(names) - _MOST_NAMES
    files = ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" * (more > 0))
    title, address = _place(state)
    works = WORKS.made(state)
    report = next(
        (
            found
            for work in works
            if work.result is not None and (found := work.job.report(work.result)) is not None
        ),
        None,
    )
    step = "; ".join(newer_words(name, link) for name, link in newer.items()) or _next(state)
    return _Row(
        title,
        address,
        files,
        None if report is None else report.judgement,
        "" if report is None or state.name == QUALIFYING.name else report.verdict,
        step,
        bool(newer) or any(work.outdated and work.result is not None for work in works),
    )


def _place(state: ScreenState) -> tuple[str, str]:
    """Title and address of a screen."""
    title = title_of_screen(state.name)
    if any(screen.name == state.name for screen in SCREENS):
        return title, f"/{state.name}"
    return title, f"/task/{state.name.removeprefix('task-')}"


def _next(state: ScreenState) -> str:
    """The next step of a screen that states one."""
    stating = [screen.next_step for screen in SCREENS if screen.name == state.name]
    if not any(stating):
        return ""
    heading, words = object_at(stating[0])(state)
    return f"{heading}: {words}"
