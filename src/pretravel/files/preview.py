"""A look at a file of touches before it is used: what it lacks is no fault."""

from __future__ import annotations

from dataclasses import replace

from pretravel.files.file_format import FileFormat, FilePositions, FileReadings, ReadingOptions
from pretravel.files.logs.double_touches import with_passes
from pretravel.files.misses import named_misses
from pretravel.files.readings import read_readings, without_touches
from pretravel.files.source_file import Source, opened
from pretravel.files.stated_normals import one_normal, with_surface_normals
from pretravel.files.table_formats import CSV, PARQUET
from pretravel.files.touches_csv import columns_of_table, touches_or_positions


def look_at(
    source: Source, options: ReadingOptions, known: FileFormat
) -> tuple[FileReadings | FilePositions, bool]:
    r"""Read a file as far as it can be read.

    Parameters
    ----------
    source : str, Path or SourceFile
    options : ReadingOptions
        What is stated.
    known : FileFormat
        Of the file.

    Returns
    -------
    FileReadings or FilePositions
    bool
        Whether the unit of length is known; else the lengths are as in the file.

    Raises
    ------
    InputError
        The file cannot be read.

    >>> from pretravel.files.source_file import SourceFile
    >>> found, unit_known = look_at(SourceFile("a.csv", b"X;Y;Z\n1;2;3\n"), ReadingOptions(), CSV)
    >>> found.positions.tolist(), unit_known
    ([[1.0, 2.0, 3.0]], False)
    """
    file = opened(source)
    looking = replace(options, look_only=True)
    known.refuse_unused(file, options)
    if known in (CSV, PARQUET):
        columns = columns_of_table(file, looking)
        found = with_passes(named_misses(touches_or_positions(file, columns, looking)))
        return _with_normal(found, options), columns.unit_known
    if known.parse is None:
        raise without_touches(file, known)
    if options.plan is not None:
        return read_readings(file, options, file_format=known.name), True
    found = named_misses(known.parse(file, looking), unmarked=known.marks_no_misses)
    return _with_normal(with_passes(found), options), True


def _with_normal(
    found: FileReadings | FilePositions, options: ReadingOptions
) -> FileReadings | FilePositions:
    """Positions with the normal that is stated for all of them; what they lack is a warning."""
    if options.normal is None or not isinstance(found, FilePositions):
        return found
    told = tuple(f"missing: {words}" for words in found.lacks)
    found = replace(found, warnings=(*found.warnings, *told), lacks=())
    return replace(with_surface_normals(found, one_normal(options.normal)), normals_taken=False)
