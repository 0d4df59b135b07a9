"""What goes into the screen of the engineer: how the file is understood, reference and tip."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from pretravel.app import (
    ANSWERS,
    ScreenState,
    described_field,
    described_fields,
    download_button,
    folded,
    folded_until_opened,
    here,
    live,
    note,
    outcome,
    panel,
    table_view,
    take_reference,
    text,
    warning,
)
from pretravel.controls.screen.settings import QUALIFICATION, EngineerSettings, file_mark
from pretravel.controls.screen.work import LOOK, LookResult

_AXES = {
    "0,0,1": "+Z (stylus points down)",
    "0,0,-1": "-Z",
    "1,0,0": "+X",
    "-1,0,0": "-X",
    "0,1,0": "+Y",
    "0,-1,0": "-Y",
}
_FIRST = ("diameter", "tip_diameter", "ring")
_COLUMN_WORDS = {
    "x": "X position", "y": "Y position", "z": "Z position",
    "nx": "Normal X (I)", "ny": "Normal Y (J)", "nz": "Normal Z (K)",
}  # fmt: skip


def understood(state: ScreenState) -> None:
    """What was read of the file, its first lines, and what the file does not state."""
    outcome(
        state,
        LOOK,
        lambda result: _show_look(state, result),
        answer=partial(answer_about_file, state),
    )
    live([state.listen], lambda: _about_file(state), lambda: state.files["touches"])


def _about_file(state: ScreenState) -> None:
    """Unit and decimal sign as they are understood: an answer can be taken back."""
    if not state.files["touches"]:
        return
    fields = {}
    with ui.element("div").classes("field-row about-file"):
        for name, label in (("units", "Unit of the file"), ("decimal", "Decimal sign")):
            options: dict[Any, str] = {None: "as the file shows it", **ANSWERS[name][1]}
            field = ui.select(options, label=label, value=_settings_of(state)[name])
            field.props('outlined dense behavior="menu"').classes("field")
            field.on_value_change(lambda event, name=name: _answered(state, name, event.value))
            fields[name] = field

    def follow() -> None:
        if state.files["touches"]:
            for name, field in fields.items():
                field.set_value(_settings_of(state)[name])

    here([state.listen], follow)


def _answered(state: ScreenState, name: str, value: Any) -> None:
    if value != _settings_of(state)[name]:
        answer_about_file(state, name, value)


def _show_look(state: ScreenState, result: LookResult) -> None:
    if result.question:
        warning(result.question)
    elif result.found is not None:
        count = len(result.found.positions)
        text("p", f"Read: {count} touches ({result.found.known.what}).", "read-line")
        if result.found.understood:
            note(result.found.understood)
    for name in ANSWERS:
        if name in result.asked:
            _question(state, name, *ANSWERS[name])
    if result.lines or result.found is not None:
        with folded("First lines of the file", opened=bool(result.question)):
            if result.lines:
                text("pre", "\n".join(result.lines), "first-lines").props('tabindex="0"')
            if result.found is not None:
                table_view(result.found.document().tables[0])
    if result.columns is not None:
        if "columns" in result.asked:
            with folded("Columns", opened=True):
                _column_choices(state, result)
        else:
            folded_until_opened("Columns", lambda: _column_choices(state, result))


def _settings_of(state: ScreenState) -> EngineerSettings:
    return EngineerSettings.of(state.settings, state.files["touches"][0].content)


def answer_about_file(state: ScreenState, name: str, value: Any) -> None:
    """State something about the file that is there; it does not hold for another one."""
    mark = file_mark(state.files["touches"][0].content)
    before = state.settings.get("answers", {})
    kept = before if before.get("file") == mark else {"file": mark}
    state.settings["answers"] = kept | {name: value}


def _question(state: ScreenState, name: str, words: str, answers: Mapping[str, str]) -> None:
    """A question with one button for each answer."""
    with ui.element("div").classes("question of-file").props('role="group"') as group:
        group.props["aria-label"] = words
        text("p", words)
        for value, shown in answers.items():

            def answer(chosen: str = value) -> None:
                answer_about_file(state, name, chosen)

            ui.button(shown, on_click=answer).props("no-caps outline")


def _column_choices(state: ScreenState, result: LookResult) -> None:
    """A choice of the column of each quantity; what is chosen is stored as stated."""
    assert result.columns is not None
    titles: dict[str | None, str] = {
        None: "not in the file",
        **{title: title for title in result.columns.titles},
    }
    for role, words in _COLUMN_WORDS.items():
        found = result.columns.roles.get(role)
        field = ui.select(titles, label=words, value=found).props('outlined behavior="menu"')
        field.classes("field")

        def choose(event: Any, role: str = role) -> None:
            stated = dict(_settings_of(state)["columns"])
            answer_about_file(state, "columns", stated | {role: event.value or "none"})

        field.on_value_change(choose)

    def as_found() -> None:
        answer_about_file(state, "columns", {})

    if _settings_of(state)["columns"]:
        ui.button("Find the columns by their names again", on_click=as_found).props("no-caps flat")


def reference_panel(state: ScreenState) -> None:
    """Diameters first; what usually stays as it is, folded."""
    with panel("2 Reference and tip"):
        take_reference(state)
        described_fields(state, QUALIFICATION, _FIRST)
        with folded("More settings"):
            for name in QUALIFICATION.names:
                if name not in _FIRST:
                    axes = _AXES if name == "axis" else None
                    described_field(state, QUALIFICATION, name, choices=axes)


def no_touches_yet() -> None:
    """What to touch, where somebody has no file yet."""
    with folded("No touches yet?"):
        text(
            "p",
            "Touch a calibrated sphere in 25 directions, three times each, at the feed at which "
            "you measure. Write a table with a row for each touch: the position X, Y, Z at the "
            "trigger (centre of the tip, without correction of the radius) and the outward "
            "normal I, J, K.",
        )
        download_button("The 25 directions (CSV)", "directions.csv", _write_directions)
        text("p", "For LinuxCNC a command writes the program:")
        command = "pretravel program sphere mill.toml --diameter 25 -o sphere.ngc"
        text("pre", command, "file-text").props('tabindex="0"')


def _write_directions(path: Path) -> None:
    from pretravel.base import sphere_pattern_25
    from pretravel.files import write_csv_table

    pattern = sphere_pattern_25()
    names = [f"p{i + 1}" for i in range(len(pattern))]
    columns = dict(zip(("nx", "ny", "nz"), pattern.T, strict=True))
    write_csv_table(path, {"label": names, **columns})
