"""What a screen says where another screen has a newer input than the one that it took."""

from __future__ import annotations

import asyncio
from pathlib import Path

from nicegui import ui

from pretravel.app.components.downloads import written_file
from pretravel.app.components.layout import problem_said, text
from pretravel.app.jobs import WORKS, Job
from pretravel.app.links import (
    OF_REFERENCE,
    REFERENCE,
    inputs_digest,
    job_of_screen,
    link_of_file,
    link_of_reference,
    link_of_result,
    reference_of,
)
from pretravel.app.project import Link, ScreenState, StoredFile
from pretravel.app.screens import title_of_screen
from pretravel.base import PretravelError

MAP_FILE = "map.json"


def newer_words(name: str, link: Link) -> str:
    """What is newer.

    >>> newer_words("map", Link("engineer", "result", "fit", "1", "2"))
    'The map is newer: Qualify a probe makes another one now'
    >>> newer_words("reference", Link("engineer", "reference", "", "1", "2"))
    'The reference is newer: Qualify a probe states another one now'
    """
    verb = {"result": "makes", "reference": "states", "file": "has"}[link.kind]
    words = name.replace("_", " ").removesuffix(" file")
    return f"The {words} is newer: {title_of_screen(link.screen)} {verb} another one now"


def newer_input(state: ScreenState, name: str) -> None:
    """A line that says what is newer, with the buttons that take it and that keep the old one."""
    link = state.links[name]

    async def use() -> None:
        client = ui.context.client  # the button is gone when the new one is there
        try:
            await take_link(state, name, link)
        except PretravelError as error:
            with client:
                problem_said(str(error))

    with ui.element("div").classes("question newer").props('role="group"') as group:
        group.props["aria-label"] = newer_words(name, link)
        text("p", f"{newer_words(name, link)}.")
        ui.button("Use the newer one", icon="sync", on_click=use).props("no-caps unelevated")
        keep = ui.button("Keep the old one", on_click=lambda: state.link(name, None))
        keep.props("no-caps flat")


async def take_link(state: ScreenState, name: str, link: Link) -> None:
    """Take from another screen what a link names, as it is now.

    Raises
    ------
    PretravelError
        It cannot be computed there.
    """
    assert state.project is not None
    source = state.project.screen(link.screen)
    if link.kind == "reference":
        take_reference_of(state, source)
    elif link.kind == "file":
        take_file(state, name, source, link.place, source.files[link.place][-1])
    else:
        await take_result(state, name, source, link.place)


def take_reference_of(state: ScreenState, source: ScreenState) -> None:
    """Reference and tip as another screen has them."""
    given = reference_of(source.settings)
    for name in REFERENCE:
        if name in given:
            state.settings[name] = given[name]
        else:
            state.settings.pop(name, None)
    state.link(OF_REFERENCE, link_of_reference(source))


def take_file(
    state: ScreenState, name: str, source: ScreenState, purpose: str, file: StoredFile
) -> None:
    """A file of another screen."""
    state.files[name] = (file,)
    state.link(name, link_of_file(source, purpose, file.digest))


async def take_result(state: ScreenState, name: str, source: ScreenState, place: str) -> None:
    """The map that a job of another screen makes, or the file of this place of a `Link`.

    Raises
    ------
    PretravelError
        There is none.
    """
    job = job_of_screen(source.name, place)
    if not isinstance(job, Job):
        raise PretravelError(f"there is no work {place} on the screen {source.name}")
    name_of_file = place.partition(":")[2]
    work = WORKS.of(source, job)
    if not job.automatic and (work.result is None or work.outdated):
        work.start()
    result = (await work.finished()).result
    made_of = inputs_digest(source, job)
    if name_of_file:
        content = job.gives(result).get(name_of_file)
        if content is None:
            raise PretravelError(f"{title_of_screen(source.name)} has no {name_of_file} now")
        file = StoredFile(name_of_file, content)
        state.files[name] = (file,)
        state.link(name, link_of_result(source, job, file.digest, name_of_file))
        return

    def write(path: Path) -> None:
        result.qualified.write("output", path)

    file = StoredFile(MAP_FILE, await asyncio.to_thread(written_file, MAP_FILE, write))
    if inputs_digest(source, job) == made_of:  # else it is newer again, and is said so
        state.files[name] = (file,)
        state.link(name, link_of_result(source, job, file.digest))
        return
    await take_result(state, name, source, place)
