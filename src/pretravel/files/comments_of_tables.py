"""What comments of a table with fixed columns and units state: nothing of it is read."""

from __future__ import annotations

import re
from collections.abc import Sequence

from pretravel.files.csv_table import CsvTable
from pretravel.files.row_statements import Record, comments_among, lines_not_read
from pretravel.files.source_file import SourceFile, shortened
from pretravel.files.words_of_lines import days_in_text, units_in_text

_OF_LENGTH = re.compile(
    r"\b(?:all|values|readings|numbers|errors?|uncertaint(?:y|ies)|ruler|laser|scale|reference)\b"
    r"(?:\W+(?:are|is))?\W+in\W+"
    r"(nm|[µμu]m|mm|cm|inch(?:es)?|mil|thou|V(?![\w-]|\s(?:block|groove))|mV|volts?)\b(?! were)|"
    r"\bunits?\b\W*(nm|mV|V|volts?)\b",
    re.IGNORECASE,
)
_STATES = (
    r"\b(?:tip|ball|probe|stylus|taster|tastkugel|kugel|ruler|scale|encoder|laser|reference|rig|"
    r"machine|azimuth|direction|polar|gain|range|filter|k|u|standard)\b[^\d\n]{0,60}+\d|"
    r"\d\s?(?:k?Hz|S/s|V|nm|[µμu]m|mm|K|°|deg|rad|%)(?!\w)|\d\s?°\s?[CF]\b|\b(?:S/?N|serial)\b|"
    r"\b(?:expanded|rectangular|triangular|half.?width|divisor|correlat\w*|valid|expire\w*|until|"
    r"deviations?|invert\w*|revers\w*|active (?:low|high)|decreas\w*|negative|fahrenheit)\b|"
    r"[01]\s?=\s?[a-z]|"
    r"\btemp(?:eratur\w*|\.)?\W*(?:[:=]\W*)?-?\d|\b(?:feed|speed|vorschub|offset|delay)\b\W*\d"
)
"""What a comment states that a result depends on, or that says which thing was measured."""


def refuse_other_comments(table: CsvTable, unit: str) -> None:
    """Refuse comments that contradict the names of the columns, or may change what rows mean.

    Parameters
    ----------
    table : CsvTable
    unit : str
        Of the lengths in the columns, by their names.

    Raises
    ------
    InputError
        A comment gives another unit, or stands between the rows and may change their meaning.
    """
    file = SourceFile(table.path, b"")
    comments_among(file, list(table.comments), table.lines, _is_row)
    for number, line in table.comments:
        if others := {*_units(line)} - {unit}:
            raise file.error(
                f"'{shortened(line)}' gives the unit {min(others)}, and the columns are in {unit} "
                "by their names: correct the one that is wrong",
                number,
            )


def telling_comments(comments: Sequence[Record]) -> list[Record]:
    """The comments that state what a result depends on, or which thing was measured.

    >>> telling_comments([(1, "# coffee at ten"), (2, "# temperature 27 °C")])
    [(2, '# temperature 27 °C')]
    """
    return [each for each in comments if _is_telling(each[1])]


def comments_not_read(table: CsvTable) -> tuple[str, ...]:
    """A sentence that quotes telling comments and dates; none without them."""
    return lines_not_read(
        [each for each in table.comments if _is_telling(each[1]) or days_in_text(each[1])]
    )


def _is_telling(line: str) -> bool:
    return re.search(_STATES, line, re.IGNORECASE) is not None


def _units(line: str) -> list[str]:
    """Units of the numbers of a table that a comment gives."""
    found = [short or named for short, named in _OF_LENGTH.findall(line)]
    named = [unit.lower() if unit[-1:] == "m" else unit for unit in found]
    other = {"um": "µm", "μm": "µm", "inches": "inch", "v": "V", "volt": "V", "volts": "V"}
    return [*(other.get(unit, unit) for unit in named), *units_in_text([line])]


def _is_row(text: str) -> bool:
    """Whether a comment without its sign is a row that was disabled."""
    cells = text.split(",")
    return len(cells) > 1 and any(re.fullmatch(r"\s*-?[\d.]+(?:e-?\d+)?\s*", c) for c in cells)
