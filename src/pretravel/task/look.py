"""Look at a file of touches before it is used: how it is understood, and what it lacks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base import FloatArray, InputError
from pretravel.files import (
    CSV,
    PARQUET,
    ROLES,
    FileFormat,
    FilePositions,
    FileReadings,
    ReadingOptions,
    SourceFile,
    column_roles,
    format_named,
    format_of,
    look_at,
    opened,
    read_text_table,
)

if TYPE_CHECKING:
    from pretravel.show import Document

_LINES = 8
"""First lines of a text that are shown."""
_SIGNS = 160
"""Of a line that is shown."""


@dataclass(frozen=True, eq=False)
class LookedAt:
    """How a file is understood.

    Attributes
    ----------
    name : str
        Of the file.
    known : FileFormat
    found : FileReadings or FilePositions
    unit_known : bool
        False: the lengths are as in the file.
    """

    name: str
    known: FileFormat
    found: FileReadings | FilePositions
    unit_known: bool

    @property
    def positions(self) -> FloatArray:
        """Positions of the touches, (n, 3). [mm, or as in the file]"""
        if isinstance(self.found, FilePositions):
            return self.found.positions
        return self.found.touches.positions

    @property
    def understood(self) -> str:
        """How a table was understood, in one line; empty where the file has a form of its own."""
        if isinstance(self.found, FilePositions):
            return self.found.understood
        return self.found.touches.reading

    def document(self) -> Document:
        """The preview."""
        from pretravel.task.preview_report import preview_document

        return preview_document(self.name, self.found, unit_known=self.unit_known)


def look_at_touches(
    path: Path, options: ReadingOptions = ReadingOptions(), *, file_format: str | None = None
) -> LookedAt:
    """Read a file as far as it can be read; what it lacks is no fault.

    Parameters
    ----------
    path : Path
    options : ReadingOptions
        What is stated.
    file_format : str, optional
        Detected when not given.

    Returns
    -------
    LookedAt

    Raises
    ------
    InputError
        The file cannot be read.
    """
    file = opened(path)
    known = format_of_touches(file, options, file_format=file_format)
    found, unit_known = look_at(file, options, known)
    return LookedAt(path.name, known, found, unit_known)


def format_of_touches(
    file: SourceFile, options: ReadingOptions, *, file_format: str | None = None
) -> FileFormat:
    """The format of a file: the one that is stated, that of a table with columns, or detected.

    Parameters
    ----------
    file : SourceFile
    options : ReadingOptions
        Columns that are stated are those of a table.
    file_format : str, optional

    Raises
    ------
    PretravelError
        A name that no format has; a file of no known format.
    """
    if file_format is not None:
        return format_named(file_format)
    if options.columns:
        return PARQUET if file.ending == ".parquet" else CSV
    return format_of(file)


def first_lines(path: Path) -> tuple[str, ...]:
    """The first lines of a text as they are in the file; none of a binary file.

    Parameters
    ----------
    path : Path
    """
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
    """The columns of a text table, to choose from; None of a file that is no such table.

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
