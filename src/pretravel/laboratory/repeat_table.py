"""Repeated readings in a column of heights, or in columns that are not three coordinates."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import BoolArray, FloatArray, InputError, IntArray
from pretravel.files import (
    LENGTH_UNITS,
    ReadingOptions,
    SourceFile,
    column_name,
    comments_among,
    filled_in,
    read_text_table,
    unit_of,
    unit_of_title,
    unknown_lines,
)
from pretravel.touches import FEWEST_REPEATS

_POSITIONS = {"x", "y", "z"}
_MOST_GROUPS = 12
_FAR_FROM_ZERO = 0.3
"""Where all others are farther from zero than this, a zero is what was filled in. [mm]"""
_DIFFERENCE = re.compile(
    r"\W*(?:delta|Δ|δ|dev\w*|diff\w*|abw\w*|[ée]cart|error|err|residual|scost\w*|desv\w*)\b",
    re.IGNORECASE,
)
"""Titles of columns that are computed from the reading in the same row."""
_OTHER = re.compile(
    r"\b(?:temp\w*|time|zeit|date|datum|force|feed\w*|speed|vorschub|humidity|volt\w*|tol\w*|"
    r"nom\w*|soll\w*|mean|average|avg|mittel\w*|range|sigma|std\w*|spindle|angle|winkel)\b|°",
    re.IGNORECASE,
)
"""Titles of numbers that are not readings."""
_CONDITION = re.compile(r"\b(?:feed\w*|speed|vorschub|spindle|angle|winkel)\b", re.IGNORECASE)
"""Of these, such on which a reading depends."""
_MISSED = re.compile(
    r"(?:n/?a|nan|-+|—|–|\*+|\?+|miss(?:ed)?|fail(?:ed)?|no (?:contact|trigger)|error|fehler|"
    r"fehlantastung|kein kontakt|#\w+[!?]?)?",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?")


_COMMENT = ("#", "%", ";", "//")
_BETWEEN_TWO = (";", r"\t", ",", r"\s{2,}", r"\s+")
"""Separators of a count and a height."""


@dataclass(frozen=True, eq=False)
class LoggedSeries:
    """Touches of one point, in their order.

    Attributes
    ----------
    name : str
        Of the series and the place, where the file has more than one.
    values : (n,) float
        Positions along the direction of the touches. [mm]
    lines : (n,) int
        Of the file.
    """

    name: str
    values: FloatArray
    lines: IntArray


def column_of_heights(file: SourceFile, options: ReadingOptions) -> LoggedSeries | None:
    """A text of one number in each line, with a title above it or none; None: another file."""
    if file.content.startswith((b"PAR1", b"\x89HDF", b"CDF")):
        return None
    lines = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip() and not line.strip().startswith(_COMMENT)
    ]
    lines = _without_count(lines)
    title = lines[0][1] if lines and not is_number(plain_heights(lines[:1])[0][0][1]) else ""
    rows, unit = plain_heights(lines[1:] if title else lines)
    if not rows or not all(is_number(line) for _, line in rows):
        return None
    words = re.split(r"[\s_/,;:()\[\]]+", f"{title} {unit}")
    units = [LENGTH_UNITS[unit] for word in words if (unit := unit_of(word) or "") in LENGTH_UNITS]
    if len(units) > 1:
        raise file.error(f"the title '{title[:40]}' gives more than one unit", lines[0][0])
    scale = units[0] if units else file.scale(options.units, "the heights have no unit")
    values = [file.numbers([line], number)[0] for number, line in rows]
    return LoggedSeries("", scale * np.array(values), np.array([number for number, _ in rows]))


def comments_among_heights(file: SourceFile, rows: IntArray) -> tuple[tuple[int, str], ...]:
    """Comments between the heights; those that change the heights after them are refused."""
    comments = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip().startswith(_COMMENT)
    ]
    return comments_among(file, comments, rows.tolist(), is_number)


def _without_count(lines: list[tuple[int, str]]) -> list[tuple[int, str]]:
    """Lines of two cells, "3;5.0015", of which the first counts the rows: the second cells.

    >>> _without_count([(1, "Run;Z [mm]"), (2, "1;5.001"), (3, "2;5.002")])
    [(1, 'Z [mm]'), (2, '5.001'), (3, '5.002')]
    """
    for separator in _BETWEEN_TWO:
        cells = [[cell.strip() for cell in re.split(separator, line)] for _, line in lines]
        if not lines or any(len(pair) != 2 for pair in cells):
            continue
        titled = not is_number(cells[0][1])
        counts = [pair[0] for pair in cells[titled:]]
        if len(counts) > 1 and all(
            count.isdecimal() and int(count) == int(counts[0]) + row
            for row, count in enumerate(counts)
            if counts[0].isdecimal() or not row
        ):
            return [(number, pair[1]) for (number, _), pair in zip(lines, cells, strict=True)]
    return lines


def is_number(text: str) -> bool:
    """Whether a text is a number as Python reads it, but 1_0."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text  # 1_0 is ten in Python alone


def columns_of_readings(
    file: SourceFile, options: ReadingOptions
) -> tuple[list[LoggedSeries], str, tuple[str, ...]] | None:
    """Series of a table such as Trial, Z, Delta; or Trial, X, Y; or Run, Operator, Reading.

    Each column of readings is a series, and each word of a column whose words come again.

    Returns
    -------
    list of LoggedSeries
    str
        The columns in words.
    tuple of str
        Warnings.
    None
        The file is no such table, or a table of all three coordinates.
    """
    try:
        text = read_text_table(file, options.exclude, fewest=1)
    except InputError:
        return None
    if text.names is None:
        return None
    names = [column_name(title) for title in text.names]
    known = {name.role for name in names}
    if known >= _POSITIONS or (len(known & _POSITIONS) == 1 and known & {"feed", "spindle"}):
        return None
    columns = [text.column(i) for i in range(text.width)]
    values: list[int] = []
    words: list[int] = []
    unread: list[int] = []
    for i, cells in enumerate(columns):
        title = text.names[i]
        conditional = bool(_CONDITION.search(title)) or names[i].role in ("feed", "spindle")
        if _counts(cells):
            continue
        if not _are_numbers(cells) or (_are_groups(cells) and names[i].role not in _POSITIONS):
            told_apart = 1 < len({*cells}) <= _MOST_GROUPS and len({*cells}) < len(cells)
            (words if told_apart else unread).append(i)
        elif conditional or _DIFFERENCE.match(title) or _OTHER.search(title):
            unread.append(i)
        else:
            values.append(i)
    if not values:
        return None
    series = []
    missed: list[int] = []
    keys = [" ".join(_named(text.title(i), row[i]) for i in words if row[i]) for row in text.rows]
    lines = np.array(text.lines)
    for i in values:
        own = (
            unit_of_title(text.title(i))
            or (unit_of(text.units[i]) if text.units else None)
            or text.unit
        )
        scale = LENGTH_UNITS.get(own or "") or file.scale(
            options.units, f"the column {text.title(i)} has no unit"
        )
        for key in dict.fromkeys(keys):
            of_key = [k for k, word in enumerate(keys) if word == key]
            read = [k for k in of_key if _is_reading(columns[i][k])]
            missed += [text.lines[k] for k in of_key if not _is_reading(columns[i][k])]
            column = text.title(i) if len(values) > 1 else ""
            heights = scale * np.array(
                [file.numbers([_plain(columns[i][k])], text.lines[k])[0] for k in read]
            )
            name = f"{column} {key if len({*keys}) > 1 else ''}".strip()
            if len(heights):
                series.append(LoggedSeries(name, heights, lines[read]))
    if not any(len(one.values) >= FEWEST_REPEATS for one in series):
        return None
    said = ", ".join(text.title(i) for i in values)
    return series, f"the column {said}", _told(text.title, unread, missed, text.among)


def _told(
    title: Callable[[int], str],
    unread: Sequence[int],
    missed: Sequence[int],
    among: Sequence[tuple[int, str]],
) -> tuple[str, ...]:
    """What was not read, as sentences."""
    told = list(unknown_lines(among))
    if missed:
        told.append(f"no reading, and left out: line {', '.join(map(str, sorted(set(missed))))}")
    if unread:
        told.append(f"columns that are not read: {', '.join(map(title, unread))}")
    return tuple(told)


_HEIGHT = re.compile(
    r"(?:[XYZ]\s*[:=]?\s*)?([-+−]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµμ\"]*)",
    re.IGNORECASE,
)
"""A line such as Z = 27.304 mm."""
_TWO_MEANINGS = re.compile(r"[-+−]?[1-9]\d{0,2},\d{3}")


def plain_heights(lines: Sequence[tuple[int, str]]) -> tuple[list[tuple[int, str]], str]:
    """Lines of one height each as plain numbers, and the unit behind all of them.

    >>> plain_heights([(1, "Z = 27,3041 mm"), (2, "Z = 27,304 mm")])
    ([(1, '27.3041'), (2, '27.304')], 'mm')
    """
    found = [_HEIGHT.fullmatch(line) for _, line in lines]
    letters = {line[:1].upper() for _, line in lines if line[:1].isalpha()}
    units = {match[2] for match in found if match is not None}
    if not found or None in found or len(letters) > 1 or len(units) > 1:
        return [*lines], ""
    unit = units.pop()
    numbers = [match[1] for match in found if match is not None]
    if (unit and not unit_of(unit)) or all(map(_TWO_MEANINGS.fullmatch, numbers)):
        return [*lines], ""
    return [(n, _plain(number)) for (n, _), number in zip(lines, numbers, strict=True)], unit


def without_filled_in(values: FloatArray) -> BoolArray:
    """Which heights are readings: not -9999 and the like, and not 0 far from all others.

    >>> without_filled_in(np.array([27.3, 0.0, 999.999, 27.2])).tolist()
    [True, False, False, True]
    """
    filled = filled_in(values)
    others = values[~filled & (values != 0.0)]
    if len(others) and np.abs(others).min() > _FAR_FROM_ZERO:
        filled |= values == 0.0
    return np.asarray(~filled)


def _named(title: str, cell: str) -> str:
    """What distinguishes rows: a word, or a number with the title of its column."""
    return f"{title} {cell}" if _NUMBER.fullmatch(cell) else cell


def _plain(cell: str) -> str:
    """A number as Python reads it."""
    return cell.replace(",", ".").replace("−", "-")


def _is_reading(cell: str) -> bool:
    return _NUMBER.fullmatch(cell.replace("−", "-")) is not None


def _are_numbers(cells: Sequence[str]) -> bool:
    """Whether cells are numbers, but for those of readings that failed."""
    failed = [cell for cell in cells if not _is_reading(cell)]
    return 2 * len(failed) < len(cells) and all(map(_MISSED.fullmatch, failed))


def _are_groups(cells: Sequence[str]) -> bool:
    """Whether integers come again, as numbers of places and parts do."""
    return all(cell.isdecimal() for cell in cells) and len({*cells}) * 2 <= len(cells)


def _counts(cells: Sequence[str]) -> bool:
    """Whether cells count rows, once or in each series."""
    if not all(cell.isdecimal() and len(cell) < 7 for cell in cells):
        return False
    numbers = [int(cell) for cell in cells]
    pairs = list(itertools.pairwise(numbers))
    return bool(pairs) and all(b - a == 1 or a > b == numbers[0] for a, b in pairs)
