"""A button that fills a screen with example data, so that one click shows a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from nicegui import ui

from pretravel.app.components.layout import live
from pretravel.app.jobs import Job, do_ahead
from pretravel.app.project import ScreenState, SettingValue, StoredFile
from pretravel.base import PretravelError
from pretravel.task import example_folder


def example_button(
    state: ScreenState,
    files: Mapping[str, Sequence[str]],
    settings: Mapping[str, SettingValue],
    *,
    ahead: tuple[Job[Any], ...] = (),
) -> ui.button:
    """A button that takes files of the example data, and the settings that belong to them.

    Parameters
    ----------
    state : ScreenState
    files : mapping of str to sequence of str
        By purpose, names below examples/data.
    settings : mapping of str to value
    ahead : tuple of Job
        Jobs that are done once with the example, before the user has chosen a file: see
        `jobs.do_ahead`.
    """

    def paths() -> dict[str, tuple[Path, ...]]:
        folder = example_folder()
        return {purpose: tuple(folder / name for name in names) for purpose, names in files.items()}

    def fill() -> None:
        stored = {
            purpose: tuple(StoredFile(path.name, path.read_bytes()) for path in found)
            for purpose, found in paths().items()
        }
        state.fill(settings, stored)

    with suppress(PretravelError):  # the package can be installed without the example
        do_ahead(ahead, settings, paths())

    button = ui.button("Try it with example data", icon="school", on_click=fill)
    button.props("no-caps flat")
    own_data_back(state)
    return button


def own_data_back(state: ScreenState) -> None:
    """A button that takes an example away, where it stands instead of what the user had."""

    def build() -> None:
        if state.can_take_back:
            words = "Back to my own files and settings"
            ui.button(words, icon="undo", on_click=state.take_back).props("no-caps unelevated")

    live([state.listen], build, lambda: state.can_take_back)
