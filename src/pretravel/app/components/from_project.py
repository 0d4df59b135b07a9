"""Files that the project has already, for a place that is empty."""

from __future__ import annotations

import asyncio
from functools import partial
from pathlib import Path

from nicegui import ui

from pretravel.app.components.downloads import written_file
from pretravel.app.components.layout import live, note, text
from pretravel.app.jobs import WORKS
from pretravel.app.project import ScreenState, StoredFile
from pretravel.app.session import SESSION, address_in

_MOST = 6
"""Files that are offered."""
_MAP_FILE = "map.json"


def made_map() -> object | None:
    """The map of the engineer's screen, where there is one of what stands there now."""
    from pretravel.tasks.qualify import FIT

    work = WORKS.of(SESSION.project.screen("engineer"), FIT)
    return None if work.outdated or work.result is None else work.result.qualified


async def give_map(state: ScreenState, purpose: str) -> None:
    """Put the map of the engineer's screen into a place."""
    qualified = made_map()
    if qualified is None:
        return

    def write(path: Path) -> None:
        qualified.write("output", path)  # type: ignore[attr-defined]

    content = await asyncio.to_thread(written_file, _MAP_FILE, write)
    state.files[purpose] = (StoredFile(_MAP_FILE, content),)


def measure_with_map() -> None:
    """A button that gives the map of the engineer's screen to the part's, and shows that."""

    async def go() -> None:
        client, address = ui.context.client, address_in("/part")  # the button may be gone after it
        await give_map(SESSION.project.screen("part"), "map")
        with client:
            ui.navigate.to(address)

    button = ui.button("Measure a part with this map", icon="view_in_ar", on_click=go)
    button.props("no-caps flat")


def from_project(state: ScreenState, purpose: str, *, takes_map: bool = False) -> None:
    """Buttons that take a file of another screen, or the map that was made there.

    Parameters
    ----------
    state : ScreenState
    purpose : str
        Of the files.
    takes_map : bool
        Whether a map is asked for: the one that was made in this project stands first.
    """
    project = SESSION.project

    def offered() -> tuple[StoredFile, ...]:
        if state.files[purpose]:
            return ()
        stored = (
            file
            for other in project.screens
            if other is not state
            for place, files in other.files.items()
            for file in files
            if place == purpose or purpose in _ALIKE.get(place, ())
        )
        return tuple(dict.fromkeys(stored))[:_MOST]

    def key() -> object:
        with_map = takes_map and not state.files[purpose] and made_map() is not None
        return with_map, tuple(id(file) for file in offered())

    def take(file: StoredFile) -> None:
        state.files[purpose] = (file,)

    def build() -> None:
        with_map = takes_map and not state.files[purpose] and made_map() is not None
        files = offered()
        if not (with_map or files):
            return
        with ui.element("div").classes("from-project"):
            text("span", "From this project:")
            if with_map:
                button = ui.button("the map of Qualify a probe", icon="radar")
                button.on_click(partial(give_map, state, purpose)).props("no-caps flat dense")
            for file in files:
                button = ui.button(file.name, on_click=partial(take, file))
                button.props("no-caps flat dense")
                button.props["aria-label"] = f"Take {file.name} from this project"

    from pretravel.tasks.qualify import FIT

    fit = WORKS.of(project.screen("engineer"), FIT)
    live([project.listen, fit.listen], build, key)


_REFERENCE = ("diameter", "u_diameter_um", "sphere_form_um", "ring", "tip_diameter")
"""Of the reference and the tip; called alike by all tasks that ask for a reference."""


def take_reference(state: ScreenState) -> None:
    """Fill in reference and tip as another screen of the project has them, and say so.

    What stands on this screen already is not changed.
    """
    if any(name in state.settings for name in _REFERENCE):
        return
    for other in SESSION.project.screens:
        if other is not state and other.settings.get("diameter") is not None:
            for name in _REFERENCE:
                if name in other.settings:
                    state.settings[name] = other.settings[name]
            note("Reference and tip are those that this project has. Is it another one? Change it.")
            return


_ALIKE = {
    "touches": ("touches", "log", "readings"),
    "log": ("touches",),
    "map": ("map_file", "prior", "maps"),
    "map_file": ("map", "prior", "maps"),
    "prior": ("map", "map_file"),
    "part": ("nominal", "step", "surface"),
    "nominal": ("part", "step"),
}
"""Which purposes take the same files, by the purpose under which a file is."""
