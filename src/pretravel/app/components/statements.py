"""What a laboratory states about itself, its instrument and its reference, as a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import groupby
from typing import Any

from pretravel.app.project import ScreenState, SettingValue
from pretravel.laboratory.laboratory_statements import LaboratoryStatements

STATEMENTS = "statements"
"""The setting: a mapping of table.key to text."""


def stated(values: Mapping[str, SettingValue]) -> LaboratoryStatements:
    """The statements from the fields of the form.

    Parameters
    ----------
    values : mapping of str to str
        By table and key, for example ``laboratory.name``; others are ignored.

    Returns
    -------
    LaboratoryStatements

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


def statements_form(state: ScreenState, *, certificate: bool = False) -> None:
    """Fields for what a report needs; with `certificate` for what a certificate needs."""
    from nicegui import ui

    from pretravel.app.components.layout import folded, note, text

    empty = LaboratoryStatements()
    listed = list(empty.of_certificate() if certificate else empty.of_report())
    with folded("Laboratory, instrument, environment"):
        note("A field that stays open is shown as not stated.")
        for table, statements in groupby(listed, lambda one: one.table):
            text("h3", table.capitalize())
            for one in statements:
                _statement_field(state, f"{one.table}.{one.key}", one.meaning, ui)


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
