"""A button that fills a screen with example data, so that one click shows a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from nicegui import ui

from pretravel.app.project import ScreenState, SettingValue, StoredFile
from pretravel.tasks.example_data import example_folder


def example_button(
    state: ScreenState,
    files: Mapping[str, Sequence[str]],
    settings: Mapping[str, SettingValue],
    *,
    label: str = "Try it with example data",
) -> ui.button:
    """A button that takes files of the example data, and the settings that belong to them.

    Parameters
    ----------
    state : ScreenState
    files : mapping of str to sequence of str
        By purpose, names below examples/data.
    settings : mapping of str to value
    label : str
    """

    def fill() -> None:
        folder = example_folder()
        for name, value in settings.items():
            state.settings[name] = value
        for purpose, names in files.items():
            state.files[purpose] = tuple(
                StoredFile((folder / name).name, (folder / name).read_bytes()) for name in names
            )

    return ui.button(label, icon="school", on_click=fill).props("no-caps flat")
