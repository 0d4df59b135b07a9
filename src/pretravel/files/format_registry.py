"""The list of file formats, and which of them a file has."""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping

from pretravel.base import Plugins, PretravelError
from pretravel.files.file_format import FileFormat
from pretravel.files.lines_of_tables import has_known_header, has_worded_rows, is_table, not_a_table
from pretravel.files.number_tables import NEEDED
from pretravel.files.source_file import COUNTED, Source, SourceFile, opened

_LOG = logging.getLogger(__name__)
READABLE_FORMATS = "Formats that can be read (pretravel formats describes them):"
"""Begins the list of names in the error of a file of no known format; the workbench folds it."""
_HEAD = 1000
_OWN_COLUMNS = frozenset(
    [
        *("label", *NEEDED, "ax", "ay", "az", "feed_mm_min", "spindle_deg"),
        *("nominal_x_mm", "nominal_y_mm", "nominal_z_mm"),
    ]
)
"""Of the tables of touches that this package writes."""
_PLAIN_TEXT = re.compile(rb"[\t\n\r -~]*\Z")
_NUMBERS = re.compile(r"[-+\d.,;\s]*(?:\de[-+]?\d[-+\d.,;\s]*)*", re.IGNORECASE)
FORMATS: Mapping[str, FileFormat] = Plugins(
    "pretravel.formats",
    own={
        "csv": "pretravel.files.table_formats:CSV",
        "parquet": "pretravel.files.table_formats:PARQUET",
        "netcdf": "pretravel.files.table_formats:NETCDF",
        "json": "pretravel.files.table_formats:JSON",
        "linuxcnc": "pretravel.controls.logs.pretravel_log:PRETRAVEL_LOG",
        "qif": "pretravel.files.logs.qif:QIF",
        "fusion": "pretravel.files.logs.fusion:FUSION",
        "grbl": "pretravel.controls.logs.grbl:GRBL",
        "g2core": "pretravel.controls.logs.g2core:G2CORE",
        "klipper": "pretravel.controls.logs.klipper:KLIPPER",
        "marlin": "pretravel.controls.logs.marlin:MARLIN",
        "reprap": "pretravel.controls.logs.reprap:REPRAP",
        "pcdmis": "pretravel.files.logs.pcdmis:PC_DMIS",
        "dmis": "pretravel.files.logs.dmis:DMIS",
        "cmm-listing": "pretravel.files.logs.cmm_listing:CMM_LISTING",
        "cmm-centres": "pretravel.files.logs.cmm_centres:CMM_CENTRES",
        "print": "pretravel.controls.logs.print_file:PRINT_FILE",
        "height-grid": "pretravel.controls.logs.height_grid:HEIGHT_GRID",
        "candle-map": "pretravel.controls.logs.candle_map:CANDLE_MAP",
        "trip-map": "pretravel.controls.logs.trip_map:TRIP_MAP",
        "pcdmis-report": "pretravel.files.logs.refused_formats:PC_DMIS_REPORT",
        "calypso": "pretravel.files.logs.refused_formats:CALYPSO",
        "feature-list": "pretravel.files.logs.refused_formats:FEATURE_LIST",
        "heidenhain-log": "pretravel.files.logs.refused_formats:HEIDENHAIN_LOG",
        "bed-mesh": "pretravel.files.logs.refused_formats:BED_MESH",
        "i++": "pretravel.files.logs.refused_formats:I_PLUS_PLUS",
        "geometry": "pretravel.files.logs.refused_formats:GEOMETRY",
        "document": "pretravel.files.logs.refused_formats:DOCUMENT",
        "program": "pretravel.files.logs.refused_formats:PROGRAM",
        "listing": "pretravel.files.logs.refused_formats:LISTING",
        "probeopen": "pretravel.controls.logs.probeopen:PROBEOPEN",
        "positions": "pretravel.controls.logs.log_lines:POSITIONS",
    },
)
"""Every file format by its name, in the order in which tables show them.

A table with the header of this package's own is CSV. Another file has the first format that
recognises it; those that are read come before those that are refused, and those that are recognised
by their shape alone come last. Text that no format recognises is a table (CSV) if it has a header
or rows of numbers; else it is refused.
"""


def format_of(source: Source) -> FileFormat:
    r"""Detect the format of a file of readings from its ending and its content.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        The file does not exist, is empty, is not a text file or has none of the formats.

    >>> from pretravel.files.source_file import SourceFile
    >>> format_of(SourceFile("a.txt", b"[PRB:1.0,2.0,3.0:1]\n")).name
    'grbl'
    """
    file = opened(source)
    if _is_own_table(file):
        return FORMATS["csv"]
    formats = FORMATS.values()
    by_ending = _known_by_ending(file)
    # A CMM's software names its report, which is DMIS, .igs.
    if by_ending is not None and (by_ending.parse or not _PLAIN_TEXT.match(file.content[:_HEAD])):
        return by_ending
    numbered = [(i, line.strip()) for i, line in enumerate(file.lines("a file of readings"), 1)]
    lines = [line for _, line in numbered if line]
    # Further rows of numbers alone tell nothing about the format of a long table.
    lines = lines[:_HEAD] + [line for line in lines[_HEAD:] if not _NUMBERS.fullmatch(line)]
    # Logs repeat the lines of programs, which are refused.
    for count, known in enumerate(sorted(formats, key=lambda known: bool(known.refusal)), 1):
        if len(lines) > COUNTED:
            _LOG.info("%s: compared with format %d of %d", file.name, count, len(formats))
        if known.refusal and by_ending is not None:
            return by_ending
        if not known.by_shape and known.recognises is not None and known.recognises(lines):
            return known
    if has_known_header(lines) or has_worded_rows(lines):
        return FORMATS["csv"]
    for known in formats:
        if known.by_shape and known.recognises is not None and known.recognises(lines):
            return known
    if is_table(lines):
        return FORMATS["csv"]
    readable = ", ".join(each.name for each in formats if each.parse or each.parse_features)
    first = next(number for number, line in numbered if line)
    raise file.error(
        f"{not_a_table(lines)}. {READABLE_FORMATS} {readable}",
        first,
    )


def _known_by_ending(file: SourceFile) -> FileFormat | None:
    for known in FORMATS.values():
        # Programs of controls have the ending .nc, as NetCDF has.
        begins = file.content.startswith(known.begins or b"")
        if known.binary and file.ending in known.endings and begins:
            return known
    return None


def _is_own_table(file: SourceFile) -> bool:
    """Whether a text has the header of this package's touches, and rows of its width below it.

    Known without the other formats, whose modules need not be imported then.
    """
    first, _, rest = file.content.partition(b"\n")
    header = [name.strip('"') for name in first.decode("ascii", "replace").strip().split(",")]
    if file.ending != ".csv" or not _OWN_COLUMNS.issuperset(header):
        return False
    widths = {line.count(b",") for line in rest.splitlines() if line.strip()}
    return set(NEEDED).issubset(header) and widths == {len(header) - 1}


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
