"""Look at a file of touches before it is used: how it is understood, and what it lacks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base import FloatArray
from pretravel.files import (
    CSV,
    PARQUET,
    FileFormat,
    FilePositions,
    FileReadings,
    ReadingOptions,
    SourceFile,
    format_named,
    format_of,
    look_at,
    opened,
)

if TYPE_CHECKING:
    from pretravel.show import Document


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
