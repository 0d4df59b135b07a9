"""The list of file formats, and which of them a file has."""

from __future__ import annotations

from pretravel.base.errors import PretravelError
from pretravel.files.file_format import FileFormat
from pretravel.files.logs.dmis import DMIS
from pretravel.files.logs.fusion import FUSION
from pretravel.files.logs.g2core import G2CORE
from pretravel.files.logs.grbl import GRBL
from pretravel.files.logs.log_lines import POSITIONS
from pretravel.files.logs.pcdmis import PC_DMIS
from pretravel.files.logs.pretravel_log import PRETRAVEL_LOG
from pretravel.files.logs.print_file import PRINT_FILE
from pretravel.files.logs.probeopen import PROBEOPEN
from pretravel.files.logs.qif import QIF
from pretravel.files.logs.refused_formats import REFUSED
from pretravel.files.source_file import Source, opened
from pretravel.files.table_formats import CSV, JSON, NETCDF, PARQUET
from pretravel.files.text_table import has_known_header, has_worded_rows, is_table, not_a_table

FORMATS = (
    CSV,
    PARQUET,
    NETCDF,
    JSON,
    PRETRAVEL_LOG,
    QIF,
    FUSION,
    GRBL,
    G2CORE,
    PC_DMIS,
    DMIS,
    PRINT_FILE,
    *REFUSED,
    PROBEOPEN,
    POSITIONS,
)
"""Every file format, in the order in which tables show them.

A file has the first format that recognises it. The formats that are recognised by their shape
alone, PROBEOPEN and lines of positions, stand last. Text that no format recognises is a table
(CSV) if it has a header or rows of numbers; else it is refused.
"""

_BY_SHAPE = (PROBEOPEN, POSITIONS)


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
    for known in FORMATS:
        # Programs of controls have the ending .nc, as NetCDF has.
        begins = file.content.startswith(known.begins or b"")
        if known.binary and file.ending in known.endings and begins:
            return known
    numbered = [(i, line.strip()) for i, line in enumerate(file.lines("a file of readings"), 1)]
    lines = [line for _, line in numbered if line]
    by_content = [known for known in FORMATS if known not in _BY_SHAPE]
    for known in by_content:
        if known.recognises is not None and known.recognises(lines):
            return known
    if has_known_header(lines) or has_worded_rows(lines):
        return CSV
    for known in _BY_SHAPE:
        if known.recognises is not None and known.recognises(lines):
            return known
    if is_table(lines):
        return CSV
    readable = "; ".join(f"{f.name}: {f.what}" for f in FORMATS if f.parse or f.parse_features)
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
    for known in FORMATS:
        if known.name == name:
            return known
    names = ", ".join(known.name for known in FORMATS)
    raise PretravelError(f"format '{name}' is not known; there are {names}")
