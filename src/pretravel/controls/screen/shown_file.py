"""A file of touches as the screen shows it: its first lines, and its columns to choose from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pretravel.base import InputError
from pretravel.files import ROLES, ReadingOptions, column_roles, opened, read_text_table

_LINES = 8
"""First lines of a text that are shown."""
_SIGNS = 160
"""Of a line that is shown."""


def first_lines(path: Path) -> tuple[str, ...]:
    """The first lines of a text as they are in the file; none of a binary file."""
    with path.open("rb") as file:
        start = file.read(_LINES * 4 * _SIGNS)
    if b"\0" in start:
        return ()
    lines = start.decode("utf-8", errors="replace").splitlines()
    return tuple(line[:_SIGNS] for line in lines[:_LINES])


@dataclass(frozen=True)
class ColumnsOfTable:
    """The columns of a table and what they are taken for.

    Attributes
    ----------
    titles : tuple of str
        Names in the file; those of columns without a name are their numbers.
    roles : mapping of str to str
        Title of the column of each role that was found.
    """

    titles: tuple[str, ...]
    roles: dict[str, str]


def columns_of_table(path: Path, options: ReadingOptions) -> ColumnsOfTable | None:
    """The columns of a text table, to choose from; None of a file that is not such a table.

    Parameters
    ----------
    path : Path
    options : ReadingOptions
        Its columns are used where they are stated.
    """
    file = opened(path)
    try:
        table = read_text_table(file)
    except InputError:
        return None
    titles = _titles(table.names or ("",) * table.width)
    try:
        index = column_roles(table, options).index
    except InputError:
        index = {}
    return ColumnsOfTable(titles, {role: titles[index[role]] for role in ROLES if role in index})


def _titles(names: Sequence[str]) -> tuple[str, ...]:
    """A title of each column by which it can be stated: its name, or else its number from 1."""
    counts = Counter(names)
    return tuple(
        name if counts[name] == 1 and name and not set(name) & set(",=") else str(i + 1)
        for i, name in enumerate(names)
    )
