"""Columns of a table that state whether a row is a contact, and its unit of length."""

from __future__ import annotations

import re
from collections.abc import Iterator

from pretravel.files.column_names import LENGTH_UNITS, unit_of
from pretravel.files.roles_of_columns import ColumnRoles
from pretravel.files.text_table import TextTable

_CONTACT = {
    "contact", "triggered", "touched", "success", "kontakt", "ausgelöst", "hit", "probed",
    "detected",
}  # fmt: skip
"""Titles, or words of titles, of columns of yes and no."""
_MISSED = {"miss", "missed"}
_STATUS = {*_CONTACT, "status", "state", "result", "probestatus", "probe status", "ergebnis"}
_YES = {"1", "true", "yes", "y", "ja"}
_NO = {"0", "false", "no", "n", "nein"}
_OF_PROBE = {"probe", "probing", "touch", "trigger", "sensor", "taster", "antastung"}
"""With one of these in its title, a status is that of the touch and no verdict about the part."""
_FAILED = {"failed", "fail", "failure", "error", "timeout", "nok", "fehler"}
_MISSES = {"miss", "missed", "no contact", "not triggered", "no trigger", "kein kontakt"}
_UNIT = {"unit", "units", "einheit", "unit of length"}


def refuse_stated_misses(text: TextTable, roles: ColumnRoles) -> None:
    """Refuse rows that state in a column of their own that they are no contact.

    Raises
    ------
    InputError
        With the line of the first of these rows.
    """
    for i, name in _other_columns(text, roles):
        cells = [cell.strip().lower() for cell in text.column(i)]
        words = {*re.findall(r"\w+", name), name}
        no = set(_MISSES) if words & _STATUS else set()
        if words & _STATUS and words & _OF_PROBE:
            no |= _FAILED
        if set(cells) <= _YES | _NO:
            no |= (_NO if words & _CONTACT else set()) | (_YES if words & _MISSED else set())
        missed = [row for row, cell in enumerate(cells) if cell in no]
        if missed:
            rows = "this row" if len(missed) == 1 else f"this row, and in {len(missed) - 1} more"
            raise text.file.error(
                f"{text.title(i)} is '{text.column(i)[missed[0]]}' in {rows}: a touch without "
                "contact is no point; exclude the line",
                text.lines[missed[0]],
                inputs=("exclude",),
            )


def refuse_other_units(text: TextTable, roles: ColumnRoles, unit: str) -> None:
    """Refuse rows that state another unit of length than the one in which the table is read.

    Parameters
    ----------
    text : TextTable
    roles : ColumnRoles
    unit : str
        In which the table is read.

    Raises
    ------
    InputError
        With the line of the first of these rows.
    """
    for i, name in _other_columns(text, roles):
        units = [unit_of(cell) for cell in text.column(i)] if name in _UNIT else []
        for row, stated in enumerate(units):
            if stated in LENGTH_UNITS and unit in LENGTH_UNITS and stated != unit:
                raise text.file.error(
                    f"{text.title(i)} is '{text.column(i)[row]}' in this row, and the table is "
                    f"read in {unit}",
                    text.lines[row],
                    inputs=("units",),
                )


def _other_columns(text: TextTable, roles: ColumnRoles) -> Iterator[tuple[int, str]]:
    """Index and lower-case name of each column that has no role."""
    for i, title in enumerate(text.names or ()):
        if i not in roles.used:
            yield i, title.strip().lower()
