"""The list of file formats, and which of them a file has."""

from __future__ import annotations

from collections.abc import Mapping

from pretravel.base import Plugins, PretravelError
from pretravel.files.file_format import FileFormat
from pretravel.files.source_file import Source, opened
from pretravel.files.text_table import has_known_header, has_worded_rows, is_table, not_a_table

FORMATS: Mapping[str, FileFormat] = Plugins(
    "pretravel.formats",
    first=(
        "csv",
        "parquet",
        "netcdf",
        "json",
        "linuxcnc",
        "qif",
        "fusion",
        "grbl",
        "g2core",
        "klipper",
        "marlin",
        "reprap",
        "pcdmis",
        "dmis",
        "cmm-listing",
        "cmm-centres",
        "print",
        "height-grid",
        "trip-map",
        "pcdmis-report",
        "calypso",
        "heidenhain-log",
        "bed-mesh",
        "i++",
        "geometry",
        "document",
        "program",
        "probeopen",
        "positions",
    ),
)
"""Every file format by its name, in the order in which tables show them.

A file has the first format that recognises it; those that are read come before those that are
refused, and those that are recognised by their shape alone come last. Text that no format
recognises is a table (CSV) if it has a header or rows of numbers; else it is refused.
"""


def format_of(source: Source) -> FileFormat:
    r"""Detect the format of a file of readings from its ending and its content.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    FileFormat

    Raises
    ------
    InputError
        The file does not exist, is empty, is not a text file or has none of the formats.

    >>> from pretravel.files.source_file import SourceFile
    >>> format_of(SourceFile("a.txt", b"[PRB:1.0,2.0,3.0:1]\n")).name
    'grbl'
    """
    file = opened(source)
    formats = FORMATS.values()
    for known in formats:
        # Programs of controls have the ending .nc, as NetCDF has.
        begins = file.content.startswith(known.begins or b"")
        if known.binary and file.ending in known.endings and begins:
            return known
    numbered = [(i, line.strip()) for i, line in enumerate(file.lines("a file of readings"), 1)]
    lines = [line for _, line in numbered if line]
    # Logs repeat the lines of programs, which are refused.
    for known in sorted(formats, key=lambda known: bool(known.refusal)):
        if not known.by_shape and known.recognises is not None and known.recognises(lines):
            return known
    if has_known_header(lines) or has_worded_rows(lines):
        return FORMATS["csv"]
    for known in formats:
        if known.by_shape and known.recognises is not None and known.recognises(lines):
            return known
    if is_table(lines):
        return FORMATS["csv"]
    readable = "; ".join(f"{f.name}: {f.what}" for f in formats if f.parse or f.parse_features)
    first = next(number for number, line in numbered if line)
    raise file.error(f"{not_a_table(lines)}. These formats can be read: {readable}", first)


def format_named(name: str) -> FileFormat:
    """Return the format that has a name.

    Raises
    ------
    PretravelError
        No format has this name.

    >>> format_named("qif").endings
    ('.qif',)
    """
    if name not in FORMATS:
        known = ", ".join(FORMATS)
        raise PretravelError(f"format '{name}' is not known; there are {known}")
    return FORMATS[name]
