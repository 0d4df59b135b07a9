"""The list of file formats, and which of them a file has."""

from __future__ import annotations

from pretravel.errors import PretravelError
from pretravel.formats.file_format import FileFormat
from pretravel.formats.logs.dmis import DMIS
from pretravel.formats.logs.fusion import FUSION
from pretravel.formats.logs.grbl import GRBL
from pretravel.formats.logs.log_lines import POSITIONS
from pretravel.formats.logs.pretravel_log import PRETRAVEL_LOG
from pretravel.formats.logs.print_file import PRINT_FILE
from pretravel.formats.logs.probeopen import PROBEOPEN
from pretravel.formats.logs.qif import QIF
from pretravel.formats.source_file import Source, opened
from pretravel.formats.table_formats import CSV, JSON, NETCDF, PARQUET

FORMATS = (
    CSV,
    PARQUET,
    NETCDF,
    JSON,
    PRETRAVEL_LOG,
    QIF,
    FUSION,
    GRBL,
    DMIS,
    PRINT_FILE,
    PROBEOPEN,
    POSITIONS,
)
"""Every file format, in the order in which tables show them.

A file has the first format that recognises it. The formats that are recognised by their shape
alone, PROBEOPEN and lines of positions, stand last. A file that no format recognises is CSV.
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
        The file does not exist, is empty or is not a text file.

    >>> from pretravel.formats.source_file import SourceFile
    >>> format_of(SourceFile("a.txt", b"[PRB:1.0,2.0,3.0:1]\n")).name
    'grbl'
    """
    file = opened(source)
    for known in FORMATS:
        if known.binary and file.ending in known.endings:
            return known
    lines = [line.strip() for line in file.lines("a file of readings") if line.strip()]
    for known in FORMATS:
        if known.recognises is not None and known.recognises(lines):
            return known
    return CSV


def format_named(name: str) -> FileFormat:
    """Return the format that has a name.

    Raises
    ------
    PretravelError
        No format has this name.

    >>> format_named("qif").endings
    ('.qif',)
    """
    for known in FORMATS:
        if known.name == name:
            return known
    names = ", ".join(known.name for known in FORMATS)
    raise PretravelError(f"format '{name}' is not known; there are {names}")
