"""Repeated readings in a column of heights, or in columns that are not three coordinates."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import BoolArray, FloatArray, InputError, IntArray
from pretravel.files import (
    LENGTH_UNITS,
    ReadingOptions,
    SourceFile,
    TextTable,
    column_name,
    comments_among,
    conditions_not_read,
    filled_in,
    is_verdict,
    marked_rows,
    numbers_columns,
    plain_number,
    read_text_table,
    refuse_other_units,
    unit_of,
    unit_of_rows,
    unit_of_title,
    units_in_text,
    unknown_lines,
    verdicts,
)
from pretravel.touches import FEWEST_REPEATS

SERIES_OF_LABEL = re.compile(r"(.+)/\d+")
"""A label that names the series of its touch, before the slash."""
_POSITIONS = {"x", "y", "z"}
_MOST_GROUPS = 12
_FEWEST_AT_PLACE = 3
_APART = 1.0
"""Places are at least this far apart. [unit of the file]"""
_FAR_FROM_ZERO = 0.3
"""Where all others are farther from zero than this, a zero is what was filled in. [mm]"""
_DIFFERENCE = re.compile(
    r"\W*(?:delta|Δ|δ|dev\w*|diff\w*|abw\w*|[ée]cart|error|err|residual|scost\w*|desv\w*)\b",
    re.IGNORECASE,
)
"""Titles of columns that are computed from the reading in the same row."""
_OTHER = re.compile(
    r"\b(?:temp\w*|time|zeit|date|datum|force|feed\w*|speed|vorschub|humidity|volt\w*|tol\w*|"
    r"nom\w*|soll\w*|mean|average|avg|mittel\w*|range|sigma|std\w*|limit|grenz\w*|usl|lsl|upper|lower|rh|spindle|angle|winkel)\b|°",
    re.IGNORECASE,
)
"""Titles of numbers that are not readings."""
_OTHER_UNIT = re.compile(
    r".*[\[(/ ](?:°?[CKF]|%|s|sec|ms|min|h|N|mN|m?V|bar|h?Pa|rpm)[\])]?", re.IGNORECASE
)
"""Titles whose unit is not one of length."""
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


def column_of_heights(
    file: SourceFile, options: ReadingOptions
) -> tuple[LoggedSeries, tuple[str, ...]] | None:
    """A text of one number in each line, with a title above it or none, and what is to know of it.

    None: another file.
    """
    if file.content.startswith((b"PAR1", b"\x89HDF", b"CDF")):
        return None
    lines = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip() and not line.strip().startswith(_COMMENT)
    ]
    lines = _without_count(lines)
    title = lines[0][1] if lines and not is_number(plain_heights(lines[:1])[0][0][1]) else ""
    body = lines[1:] if title and not _TWO_MEANINGS.fullmatch(title) else lines
    if body and all(_TWO_MEANINGS.fullmatch(line) for _, line in body):
        raise file.error(
            f"'{body[0][1]}' can be a number with three decimals or with thousands: write the "
            "heights with decimal points, or with four decimals",
            body[0][0],
        )
    rows, unit = plain_heights(body)
    if not rows or not all(is_number(line) for _, line in rows):
        return None
    words = re.split(r"[\s_/,;:()\[\]]+", f"{title} {unit}")
    units = [unit for word in words if (unit := unit_of(word) or "") in LENGTH_UNITS]
    if len(units) > 1 and "in" in words:  # Reading in mm
        units.remove("inch")
    comments = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip().startswith(_COMMENT)
    ]
    numbers = [number for number, _ in rows]
    among = comments_among(file, comments, numbers, is_number)
    around = [one for one in comments if one not in among]
    units = [*{*units, *units_in_text([line for _, line in around])}]
    if len(units) > 1:
        raise file.error(
            f"the title or the comments give more than one unit ({', '.join(sorted(units))})",
            lines[0][0],
        )
    scale = _stated_scale(file, units[0] if units else "", options, "the heights have no unit")
    values = [file.numbers([line], number)[0] for number, line in rows]
    heights = LoggedSeries("", scale * np.array(values), np.array(numbers))
    told = (*unknown_lines(among), *conditions_not_read(around))
    return heights, (*told, *size_words([title]))


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
        text = _with_series_of_labels(read_text_table(file, options.exclude, fewest=1))
    except InputError:
        return None
    if text.names is None:
        return None
    if {"level_mm", "left_um"} <= set(text.names):
        raise file.error(
            "this table has the columns level_mm and left_um: it is a result of repeated touches, "
            "not their log. Evaluate the log"
        )
    names = [column_name(title) for title in text.names]
    known = {name.role for name in names}
    of_one_axis = len(known & _POSITIONS) == 1 and known & {"feed", "spindle"}
    if known >= _POSITIONS or (of_one_axis and text.width > 2):
        return None
    columns = [text.column(i) for i in range(text.width)]
    values, words, unread = _kinds_of_columns(text)
    if not values:
        return None
    words, unread, failed = _without_misses(text, values, words, unread)
    series = []
    missed: list[int] = [text.lines[k] for k in failed]
    keys = [" ".join(_named(text.title(i), row[i]) for i in words if row[i]) for row in text.rows]
    lines = np.array(text.lines)
    for i in values:
        scale = _scale(text, i, values, options)
        for key in dict.fromkeys(keys):
            of_key = [k for k, word in enumerate(keys) if word == key and k not in failed]
            read = [k for k in of_key if _is_reading(columns[i][k])]
            missed += [text.lines[k] for k in of_key if not _is_reading(columns[i][k])]
            column = text.title(i) if len(values) > 1 else ""
            heights = scale * np.array(
                [file.numbers([_plain(columns[i][k])], text.lines[k])[0] for k in read]
            )
            name = f"{column} {key if len({*keys}) > 1 else ''}".strip()
            if len(heights):
                series.append(LoggedSeries(name, heights, lines[read]))
    if len(text.rows) < FEWEST_REPEATS <= len(values) and numbers_columns(
        [text.title(i) for i in values], []
    ):
        series = _of_rows(text, series, [i for i in range(text.width) if i not in values])
    if not any(len(one.values) >= FEWEST_REPEATS for one in series):
        return None
    titles = [text.title(i) for i in values]
    told = _told(text.title, unread, missed, text.among)
    told += (*verdicts(text, unread), *size_words(titles), *conditions_not_read(text.around))
    return series, f"the column {', '.join(titles)}", told


def _scale(text: TextTable, column: int, values: Sequence[int], options: ReadingOptions) -> float:
    """Millimetres in the unit of a column of readings."""
    own = (
        unit_of_title(text.title(column))
        or (unit_of(text.units[column]) if text.units else None)
        or text.unit
        or unit_of_rows(text, values)
        or ""
    )
    refuse_other_units(text, values, own)
    what = f"the column {text.title(column)} has no unit"
    return _stated_scale(text.file, own, options, what)


def _stated_scale(file: SourceFile, own: str, options: ReadingOptions, without: str) -> float:
    """Millimetres in the unit that the file states, or the user; refused where they differ."""
    if own not in LENGTH_UNITS:
        return file.scale(options.units, without)
    if options.units not in (None, own):
        raise file.error(f"the file is in {own}, but {options.units} was given", inputs=("units",))
    return LENGTH_UNITS[own]


def _without_misses(
    text: TextTable, values: Sequence[int], words: Sequence[int], unread: Sequence[int]
) -> tuple[list[int], list[int], set[int]]:
    """Columns of words and what is not read, without those that mark misses; and their rows."""
    judged = [i for i in unread if is_verdict(text.title(i))]
    failed = {k for k, row in enumerate(text.rows) if any(_says_miss(row[i]) for i in judged)}
    marks = dict(marked_rows(text, values))
    failed.update(*marks.values())
    marks |= {i: [] for i in unread if unit_of(text.column(i)[0]) in LENGTH_UNITS}  # of the unit
    return [i for i in words if i not in marks], [i for i in unread if i not in marks], failed


def _with_series_of_labels(text: TextTable) -> TextTable:
    """The table with the name of a series, A, in place of labels such as A/1."""
    rows = [list(row) for row in text.rows]
    for i, title in enumerate(text.names or ()):
        found = [SERIES_OF_LABEL.fullmatch(row[i]) for row in rows]
        if column_name(title).role == "label" and all(found):
            for row, match in zip(rows, found, strict=True):
                row[i] = match[1] if match else ""
    return replace(text, rows=tuple(map(tuple, rows)))


def _kinds_of_columns(text: TextTable) -> tuple[list[int], list[int], list[int]]:
    """Columns of readings, of words that distinguish series, and of what is not read."""
    values: list[int] = []
    words: list[int] = []
    unread: list[int] = []
    places = sum(column_name(title).role in _POSITIONS for title in text.names or ())
    for i in range(text.width):
        cells, title = text.column(i), text.title(i)
        role = column_name(title).role
        of_place = role in _POSITIONS and len({*cells}) == 1
        grouping = role in ("tip", "pass", "orientation") and len({*cells}) < len(cells)
        if (_counts(cells) and not grouping) or (len(cells) == 1 and cells[0].isdecimal() and role):
            continue
        if of_place and _others_vary(text, i):
            continue
        if role == "label" and len({*cells}) == 1:
            continue  # one series
        if (
            not _are_numbers(cells)
            or (_are_groups(cells) and role not in _POSITIONS)
            or (role in _POSITIONS and places > 1 and _are_places(cells))
        ):
            told_apart = 1 < len({*cells}) <= _MOST_GROUPS and len({*cells}) < len(cells)
            (words if told_apart and not is_verdict(title) else unread).append(i)
        elif (
            role in ("feed", "spindle")
            or _CONDITION.search(title)
            or _DIFFERENCE.match(title)
            or _OTHER.search(title)
            or _OTHER_UNIT.fullmatch(title)
        ):
            unread.append(i)
        else:
            values.append(i)
    return values, words, unread


def _says_miss(cell: str) -> bool:
    return bool(cell.strip()) and _MISSED.fullmatch(cell.strip()) is not None


def _of_rows(
    text: TextTable, columns: Sequence[LoggedSeries], others: Sequence[int]
) -> list[LoggedSeries]:
    """A series of each row, where columns are counted and rows are few: M1, M2 … of run 1."""
    series = []
    for row, line in enumerate(text.lines):
        values = [one.values[one.lines == line] for one in columns]
        name = " ".join(_named(text.title(i), text.rows[row][i]) for i in others)
        found = np.concatenate(values)
        series.append(LoggedSeries(name, found, np.full(len(found), line)))
    return series


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


_AXIS_BEFORE = re.compile(r"([XYZ])\s*[:=]?\s*(?=[-+−.\d])", re.IGNORECASE)
"""Before the number of a line such as Z = 27.304 mm."""
_TWO_MEANINGS = re.compile(r"[-+−]?[1-9]\d{0,2},\d{3}")
_COUNTED_LINE = re.compile(
    r"(?P<name>[A-Za-z][A-Za-z ]{0,20}+)?+\s*+#?+\s*+(?P<count>\d{1,5})(?:\s*+[:=)]\s*|[.]?\s++)"
    r"(?P<height>[^F]*)(?P<feed>F\s*+[=:]?+\s*+\d+(?:\.\d+)?\W*)?"
)
"""A line such as Probe 3: 12.305 mm or #3 Z=12.305 F50."""
_SIZE = re.compile(
    r"\W*(?:(?:mean|act\w*|meas\w*|ist|bore|ring|hole)[ _]?)?"
    r"(?:d|Ø|⌀|dia(?:meter)?|durchmesser|r|radius|size|width|length|form|roundness|flatness|distance|breite|rundheit|mass|maß)\b.*",
    re.IGNORECASE,
)
"""Titles of results, each of several touches."""


def plain_heights(lines: Sequence[tuple[int, str]]) -> tuple[list[tuple[int, str]], str]:
    """Lines of one height each as plain numbers, and the unit behind all of them.

    >>> plain_heights([(1, "Z = 27,3041 mm"), (2, "Z = 27,304 mm")])
    ([(1, '27.3041'), (2, '27.304')], 'mm')
    """
    before = [_AXIS_BEFORE.match(line) for _, line in lines]
    letters = {found[1].upper() if found else "" for found in before}
    rest = [
        line[found.end() if found else 0 :] for (_, line), found in zip(lines, before, strict=True)
    ]
    plain = [plain_number(cell) for cell in rest]
    units = {unit for _, unit in plain}
    if len(letters) > 1 or len(units) > 1 or not all(_is_reading(cell) for cell, _ in plain):
        return [*lines], ""
    if lines and all(_TWO_MEANINGS.fullmatch(cell) for cell, _ in plain):
        return [*lines], ""
    numbers = [(n, _plain(cell)) for (n, _), (cell, _) in zip(lines, plain, strict=True)]
    return numbers, units.pop() if units else ""


def counted_heights(
    file: SourceFile, options: ReadingOptions
) -> tuple[list[LoggedSeries], tuple[str, ...]] | None:
    """Series of lines that are counted, Probe 1: 12.305, Probe 2: …, one for each feed.

    Lines above and below them are named; None: the file is another one.
    """
    lines = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip()
    ]
    matched = [_COUNTED_LINE.fullmatch(line) for _, line in lines]
    places = [i for i, found in enumerate(matched) if found]
    if len(places) < FEWEST_REPEATS or places[-1] - places[0] + 1 > len(places):
        return None
    found = [one for one in matched if one]
    names = {(one["name"] or "").strip().lower() for one in found}
    counts = [int(one["count"]) for one in found]
    feeds = [" ".join((one["feed"] or "").split()).rstrip(") ") for one in found]
    if len(names) > 1 or counts != [counts[0] + i for i in range(len(counts))]:
        return None
    if any(feeds) and not all(feeds):
        return None
    own = [(lines[i][0], one["height"].strip(" (,;")) for i, one in zip(places, found, strict=True)]
    rows, unit = plain_heights(own)
    if not all(is_number(cell) for _, cell in rows):
        return None
    scale = _stated_scale(file, unit_of(unit) or "", options, "the heights have no unit")
    values = scale * np.array([float(cell) for _, cell in rows])
    numbers = np.array([number for number, _ in rows])
    series = []
    for feed in dict.fromkeys(feeds):
        of = np.array([each == feed for each in feeds])
        series.append(LoggedSeries(feed, values[of], numbers[of]))
    return series, unknown_lines([line for i, line in enumerate(lines) if i not in {*places}])


def size_words(titles: Sequence[str]) -> tuple[str, ...]:
    """A sentence about columns that contain results and no touches.

    >>> size_words(["Z mm"]), size_words(["D mm"])[0][:40]
    ((), 'D mm: a size is a result of several touc')
    """
    found = [title for title in titles if _SIZE.fullmatch(title)]
    if not found:
        return ()
    what = "a size is a result of several touches, perhaps: its noise is not that of one touch"
    return (f"{', '.join(found)}: {what}",)


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


def _others_vary(text: TextTable, column: int) -> bool:
    """Whether another column has numbers that are not all one, such as the heights at a place."""
    others = [text.column(i) for i in range(text.width) if i != column]
    return any(len({*cells}) > 1 and _are_numbers(cells) and not _counts(cells) for cells in others)


def _are_places(cells: Sequence[str]) -> bool:
    """Whether numbers are those of a few places, which come again to the last digit."""
    if not all(map(_is_reading, cells)) or not 1 < len({*cells}) <= len(cells) // _FEWEST_AT_PLACE:
        return False
    values = sorted(float(_plain(cell)) for cell in {*cells})
    return min(b - a for a, b in itertools.pairwise(values)) >= _APART


def _counts(cells: Sequence[str]) -> bool:
    """Whether cells count rows, once or in each series."""
    if not all(cell.isdecimal() and len(cell) < 7 for cell in cells):
        return False
    numbers = [int(cell) for cell in cells]
    pairs = list(itertools.pairwise(numbers))
    return bool(pairs) and all(b - a == 1 or a > b == numbers[0] for a, b in pairs)
