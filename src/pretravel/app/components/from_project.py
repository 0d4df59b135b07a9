"""Files that the project has already, for a place that is empty."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import Client, background_tasks, ui

from pretravel.app.components.layout import here, live, note, problem_said, text
from pretravel.app.components.newer import take_file, take_reference_of, take_result
from pretravel.app.jobs import WORKS, Work
from pretravel.app.links import OF_REFERENCE, holds, reference_of
from pretravel.app.project import Link, ScreenState, StoredFile
from pretravel.app.recognised import kind_of
from pretravel.app.screens import QUALIFYING, title_of_screen
from pretravel.app.session import SESSION, address_in
from pretravel.base import PretravelError, object_at

_MOST = 6
"""Files that are offered."""


def made_map() -> object | None:
    """The map that the project made, where there is one of what stands there now."""
    work = _qualifying()
    return None if work.outdated or work.result is None else work.result.qualified


def _qualifying() -> Work[Any]:
    state = SESSION.project.screen(QUALIFYING.name)
    return WORKS.of(state, object_at(QUALIFYING.jobs[0]))


async def _give_map(state: ScreenState, purpose: str, client: Client) -> bool:
    """Put the map of the engineer's screen into a place, as a link; or say why there is none.

    A map that is being computed, as after a value that the click itself has ended, is waited for.
    """
    source = SESSION.project.screen(QUALIFYING.name)
    try:
        await take_result(state, purpose, source, object_at(QUALIFYING.jobs[0]).name)
    except PretravelError as error:
        with client:
            problem_said(str(error))
        return False
    return True


def follow_map(state: ScreenState, purpose: str) -> None:
    """Take the map of the engineer's screen into an empty place, as soon as there is one."""

    async def give() -> None:
        await _give_map(state, purpose, client)
        taking.clear()  # after an error the next map is taken

    def take() -> None:
        if not state.files[purpose] and made_map() is not None and not taking:
            taking.append(True)
            background_tasks.create(give(), name="map")

    taking: list[bool] = []
    client = ui.context.client
    take()
    here([_qualifying().listen], take)


def measure_with_map() -> None:
    """A button that gives the map of the engineer's screen to the part's, and shows that."""

    async def go() -> None:
        client, address = ui.context.client, address_in("/part")
        if await _give_map(SESSION.project.screen("part"), "map", client):
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

    def offers_map() -> bool:
        return takes_map and not state.files[purpose] and made_map() is not None

    def is_that_map(link: Link | None) -> bool:
        """Whether a file is a copy of the map that was made, which has a button of its own."""
        return link is not None and link.screen == QUALIFYING.name and link.kind == "result"

    def offered() -> dict[StoredFile, tuple[ScreenState, str]]:
        """Files that fit, with where they are: the one that was dropped, before its copies."""
        if state.files[purpose]:
            return {}
        with_map = offers_map()
        stored = sorted(
            (place in other.links, file.name, file.digest, other.name, place)
            for other in project.screens
            if other is not state
            for place, files in other.files.items()
            for file in files
            if place == purpose or purpose in _ALIKE.get(place, ())
            if not (with_map and is_that_map(other.links.get(place)))
        )
        found: dict[StoredFile, tuple[ScreenState, str]] = {}
        for _, _, digest, screen, place in stored:
            other = project.screen(screen)
            file = next(each for each in other.files[place] if each.digest == digest)
            found.setdefault(file, (other, place))
        return dict(list(found.items())[:_MOST])

    def made() -> dict[StoredFile, tuple[ScreenState, str]]:
        """Files that screens of tasks have made, with the place of their link."""
        return {} if state.files[purpose] else _made_by_tasks(state, purpose)

    def key() -> object:
        return offers_map(), tuple(file.digest for file in (*offered(), *made()))

    def build() -> None:
        with_map = offers_map()
        files, results = offered(), made()
        if not (with_map or files or results):
            return
        with ui.element("div").classes("from-project"):
            text("span", "From this project:")
            if with_map:
                button = ui.button("the map of Qualify a probe", icon="radar")
                take_map = partial(_give_map, state, purpose, ui.context.client)
                button.on_click(take_map).props("no-caps flat dense")
            for file, place in files.items():
                take = partial(take_file, state, purpose, *place, file)
                button = ui.button(file.name, on_click=take)
                button.props("no-caps flat dense")
                button.props["aria-label"] = f"Take {file.name} from this project"

            for file, place in results.items():
                take_made = partial(take_result, state, purpose, *place)
                button = ui.button(
                    f"{file.name} of {title_of_screen(place[0].name)}", on_click=take_made
                )
                button.props("no-caps flat dense")

    tasks = [
        work for other in project.screens for work in WORKS.made(other) if work.job.name == "run"
    ]
    listened = [project.listen, _qualifying().listen, *(work.listen for work in tasks)]
    live(listened, build, key)


def _made_by_tasks(state: ScreenState, purpose: str) -> dict[StoredFile, tuple[ScreenState, str]]:
    found = {}
    for other in SESSION.project.screens:
        for work in WORKS.made(other) if other is not state else ():
            if work.result is None or work.outdated:
                continue
            for name, content in work.job.gives(work.result).items():
                kind = kind_of(content)
                if kind and purpose in (kind.purpose, *_ALIKE.get(kind.purpose, ())):
                    found[StoredFile(name, content)] = (other, f"{work.job.name}:{name}")
    return found


def take_reference(state: ScreenState) -> None:
    """Fill in reference and tip as another screen of the project has them, and say so.

    What stands on this screen already is not changed.
    """
    if OF_REFERENCE not in state.links and not reference_of(state.settings):
        for other in SESSION.project.screens:
            if other is not state and other.settings.get("diameter") is not None:
                take_reference_of(state, other)
                break
    live([state.listen], lambda: _say_reference(state), lambda: _has_reference_of(state))


def _has_reference_of(state: ScreenState) -> str:
    """The screen whose reference stands here; none once the user has typed another one."""
    link = state.links.get(OF_REFERENCE)
    return "" if link is None or not holds(state, OF_REFERENCE, link) else link.screen


def _say_reference(state: ScreenState) -> None:
    if _has_reference_of(state):
        title = title_of_screen(state.links[OF_REFERENCE].screen)
        note(f"Reference and tip are those of this project ({title}). Change them if you use "
             "others.")  # fmt: skip


_ALIKE = {
    "touches": ("touches", "log", "readings"),
    "log": ("touches",),
    "map": ("map_file", "prior", "maps"),
    "map_file": ("map", "prior", "maps"),
    "prior": ("map", "map_file"),
    "part": ("nominal", "step", "surface"),
    "nominal": ("part", "step"),
    "history": ("places",),
}
"""Which purposes take the same files, by the purpose under which a file is."""
