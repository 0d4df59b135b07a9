"""What a laboratory states about itself, its instrument and its reference, as a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

from pretravel.app.jobs import without_folder
from pretravel.app.project import OF_ALL_SCREENS, ScreenState, SettingValue
from pretravel.base import PretravelError
from pretravel.files import LaboratoryStatements

(STATEMENTS,) = OF_ALL_SCREENS
"""The setting: a mapping of table.key to text."""
LABORATORY_FILE = "laboratory.toml"
_DROPPED, _LARGEST = "laboratory_file", 100_000
"""Purpose of a file that fills in the fields, and most of its bytes."""


def stated(values: Mapping[str, SettingValue]) -> LaboratoryStatements:
    """The statements from the fields of the form.

    Parameters
    ----------
    values : mapping of str to str
        By table and key, for example ``laboratory.name``; others are ignored.

    >>> stated({"laboratory.name": "North"}).laboratory.name
    'North'
    """
    tables: dict[str, Any] = {}
    empty = LaboratoryStatements()
    for table in fields(empty):
        part = getattr(empty, table.name)
        given = {
            key.name: str(values[f"{table.name}.{key.name}"]).strip()
            for key in fields(part)
            if str(values.get(f"{table.name}.{key.name}", "")).strip()
        }
        tables[table.name] = replace(part, **given)
    return LaboratoryStatements(**tables)


def laboratory_file(settings: Mapping[str, SettingValue], folder: Path) -> Path | None:
    """The file of the laboratory for a task, from the fields of the form.

    Parameters
    ----------
    settings : mapping of str to value
        Of a screen.
    folder : Path
        Where it is written.

    Returns
    -------
    Path or None
        None where nothing is stated.
    """
    from pretravel.files import laboratory_template

    given = settings.get(STATEMENTS)
    if not given:
        return None
    path = folder / LABORATORY_FILE
    path.write_text(laboratory_template(stated(given)), encoding="utf-8")
    return path


def statements_form(state: ScreenState) -> None:
    """Fields for all that a laboratory states, which every screen of the project shows.

    A file of the laboratory fills them in, and they give one, for commands.
    """
    from nicegui import ui

    from pretravel.app.components.downloads import download_button
    from pretravel.app.components.file_drop import file_drop
    from pretravel.app.components.layout import folded, here, note, text

    listed = LaboratoryStatements().statements()
    with folded("Laboratory, instrument, environment"):
        note(
            "You fill these fields in once: all screens of the project have them. A field that "
            "a report needs and that stays empty is shown as not stated."
        )
        file_drop(
            state, _DROPPED, "File of the laboratory", endings=(".toml",), limit=_LARGEST,
            hint="fills in the fields; the command laboratory prints one",
        )  # fmt: skip
        here([state.listen], lambda: _take_file(state))
        with ui.element("div").classes("buttons"):
            write = partial(_write_file, state)
            download_button(LABORATORY_FILE, LABORATORY_FILE, write)
        for table, statements in groupby(listed, lambda one: one.table):
            text("h3", table.capitalize())
            if table == "standards":
                note(
                    "Standards whose text you own and have compared with the definitions of a "
                    "report."
                )
            with ui.element("div").classes("field-grid"):
                for one in statements:
                    _statement_field(state, f"{one.table}.{one.key}", one.meaning, ui)


def _write_file(state: ScreenState, path: Path) -> None:
    from pretravel.files import laboratory_template

    path.write_text(
        laboratory_template(stated(state.settings.get(STATEMENTS, {}))), encoding="utf-8"
    )


def _take_file(state: ScreenState) -> None:
    """Fill in the fields from a file that was dropped; its fields that are open change nothing."""
    from pretravel.app.components.layout import problem_said
    from pretravel.base import temporary_folder
    from pretravel.files import read_laboratory

    dropped = state.files[_DROPPED]
    if not dropped:
        return
    state.files[_DROPPED] = ()
    with temporary_folder() as folder:
        path = folder / dropped[0].name
        path.write_bytes(dropped[0].content)
        try:
            found = read_laboratory(path)
        except PretravelError as error:
            problem_said(without_folder(str(error), folder))
            return
    filled = {f"{one.table}.{one.key}": one.text for one in found.statements() if one.text}
    state.settings[STATEMENTS] = {**state.settings.get(STATEMENTS, {}), **filled}


def _statement_field(state: ScreenState, name: str, meaning: str, ui: Any) -> None:
    from pretravel.app.components.layout import here

    def value() -> str:
        return str(state.settings.get(STATEMENTS, {}).get(name, ""))

    field = ui.input(meaning, value=value())
    field.props('outlined debounce="250" autocomplete="off" maxlength="1000" stack-label')
    field.classes("field")

    def commit() -> None:
        given = {**state.settings.get(STATEMENTS, {}), name: str(field.value or "")}
        state.settings[STATEMENTS] = {key: text for key, text in given.items() if text}

    def refresh() -> None:
        if field.value != value():
            field.set_value(value())

    field.on_value_change(commit)
    here([state.listen], refresh)
