"""When rows were touched: dates and times in the columns of a table, or in a line before it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from functools import lru_cache
from itertools import pairwise

from pretravel.files.roles_of_columns import ColumnRoles
from pretravel.files.source_file import shortened
from pretravel.files.text_table import TextTable

_TITLE = re.compile(
    r"(?:time|timestamp|date|datetime|date[ _]?(?:and|/)?[ _]?time|zeit|zeitstempel|datum|"
    r"datum[ _/]*(?:und[ _])?(?:uhr)?zeit|uhrzeit|heure|hora|ora|fecha|data)"
    r"(?:[ _]?(?:s|utc|\(s\)|\[s\]))?"
)
_CLOCK_TIME = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,]\d{1,9})?)?"
    r"(?:\s?(?P<half>[AP])\.?M\.?)?"
)
_DATE = re.compile(
    r"(?:(?P<y1>\d{4})(?P<s1>[-/.]?)(?P<m1>\d\d?)(?P=s1)(?P<d1>\d\d?)|"
    r"(?P<a>\d\d?)(?P<s2>[-/.])(?P<b>\d\d?)(?P=s2)(?P<y2>\d{4}|\d\d)|"
    r"(?P<d3>\d\d?)[-. /]{1,3}(?P<m3>[A-Zäû]{3,9})[-. /,]{1,3}(?P<y3>\d{4})|"
    r"(?P<m4>[A-Z]{3,9})\.?\s(?P<d4>\d\d?),?\s(?P<y4>\d{4}))"
    rf"(?:[T ,_]{{1,3}}{_CLOCK_TIME})?\s?(?P<zone>Z|UTC|[-+]\d\d:?\d\d)?",
    re.IGNORECASE,
)
_CLOCK = re.compile(_CLOCK_TIME, re.IGNORECASE)
_LINE = re.compile(
    r"\W*+(?:(?:date|datum|time|zeit|measured|touched|gemessen|angetastet|started?|and|on|at|am|um)"
    r"\b\W*+){0,4}(?P<cell>\d[-\w/.:+ ,]{5,40}?)\W*",
    re.IGNORECASE,
)
"""A line before the table that is a date alone: a calibration has one, too."""
_MONTHS = {
    word: number
    for number, words in enumerate(
        ("jan", "feb", "mar mär mrz", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt",
         "nov", "dec dez"),
        start=1,
    )
    for word in words.split()
}  # fmt: skip
_SECONDS = re.compile(r"1\d{9}(?:\d{3})?(?:\.\d{1,9})?")
"""Seconds or milliseconds since 1970."""
_MILLISECONDS = 1e11
_EPOCH = datetime(1970, 1, 1)
_ONE_SERIES = timedelta(days=1)
_HALF_A_DAY = 43_200.0
_MOST_BACK = 0.2


@dataclass(frozen=True)
class RowTimes:
    """When the rows of a table were touched.

    Attributes
    ----------
    first, last : datetime or None
        As the clock of the machine showed it; a stated time zone is changed to that of this
        computer. None where no date is stated, or one that can be read in two ways.
    where : str
        The columns or the line with the dates, for messages.
    columns : tuple of int
        Those columns, from 0.
    unclear : str
        Why a date was not used.
    """

    first: datetime | None = None
    last: datetime | None = None
    where: str = ""
    columns: tuple[int, ...] = ()
    unclear: str = ""

    def __str__(self) -> str:
        if self.first is None or self.last is None:
            return self.unclear
        form = "%Y-%m-%d" + (" %H:%M" if self.first.time() != time() else "")
        end = "" if f"{self.first:{form}}" == f"{self.last:{form}}" else f" to {self.last:{form}}"
        return f"touched {self.first:{form}}{end} ({self.where})"


def row_times(text: TextTable, used: set[int] | None = None) -> RowTimes:
    """When the rows of a table were touched.

    Parameters
    ----------
    text : TextTable
    used : set of int, optional
        Columns that are read as something else.

    >>> from pretravel.files.source_file import SourceFile
    >>> rows = (("1", "29.11.2026", "14:02"), ("2", "29.11.2026", "14:07"))
    >>> table = TextTable(SourceFile("a.csv", b""), ("X", "Datum", "Zeit"), rows, (2, 3))
    >>> print(row_times(table))
    touched 2026-11-29 14:02 to 2026-11-29 14:07 (Datum, Zeit)
    """
    for i, title in _timed_columns(text, used or set()):
        cells = text.column(i)
        found, unclear = _moments(cells)
        if unclear:
            return RowTimes(where=title, columns=(i,), unclear=f"{title}: {unclear}")
        moments = [each for each in found if each is not None]
        if not moments or len(moments) < len([cell for cell in cells if cell.strip()]):
            continue
        places: tuple[int, ...] = (i,)
        where = title
        if all(each.time() == time() for each in moments):  # days: the clock has its own column
            for k, other in _timed_columns(text, used or set()):
                clocks = [_clock(cell) for cell in text.column(k)]
                if k != i and None not in clocks and None not in found:
                    moments = [
                        datetime.combine(day, clock)
                        for day, clock in zip(moments, clocks, strict=True)
                        if clock is not None
                    ]
                    places, where = (i, k), f"{title}, {other}"
                    break
        return RowTimes(min(moments), max(moments), where, places)
    return _of_a_line(text)


def _of_a_line(text: TextTable) -> RowTimes:
    found = [
        (line, match["cell"].strip())
        for line, words in text.around
        if line < text.lines[0]
        and (match := _LINE.fullmatch(words))
        and _DATE.fullmatch(match["cell"].strip())
    ]
    if len(found) != 1:
        return RowTimes()
    (line, cell), where = found[0], f"line {found[0][0]}"
    (moment,), unclear = _moments((cell,))
    return RowTimes(moment, moment, where, (), f"line {line}: {unclear}" if unclear else "")


def _timed_columns(text: TextTable, used: set[int]) -> Iterator[tuple[int, str]]:
    for i, title in enumerate(text.names or ()):
        if i not in used and _TITLE.fullmatch(title.strip().lower()):
            yield i, title


@lru_cache(maxsize=4)  # of one table, of which several things are asked
def _moments(cells: tuple[str, ...]) -> tuple[list[datetime | None], str]:
    """The moment of each cell, and why they are not known where day and month can be exchanged."""
    found = [_DATE.fullmatch(cell.strip()) for cell in cells]
    pairs = [(int(one["a"]), int(one["b"])) for one in found if one and one["a"]]
    points = any(one["s2"] == "." for one in found if one)
    first_is_day = points or any(a > 12 for a, _ in pairs)
    second_is_day = not points and any(b > 12 for _, b in pairs)
    if first_is_day and second_is_day:
        return [None] * len(cells), ""
    if pairs and not (first_is_day or second_is_day) and any(a != b for a, b in pairs):
        ways = [_read(cells, found, day_first=way) for way in (True, False)]
        latest = datetime.now() + _ONE_SERIES
        past = [way for way in ways if all(each is None or each <= latest for each in way)]
        if len(past) != 1:
            row = next(i for i, (a, b) in enumerate(zip(*ways, strict=True)) if a != b)
            cell, day, month = cells[row], f"{ways[0][row]:%-d %B}", f"{ways[1][row]:%-d %B}"
            return [None] * len(cells), (
                f"'{shortened(cell)}' is {day} or {month}, and not used: write the year first"
            )
        return past[0], ""
    return _read(cells, found, day_first=not second_is_day), ""


def _read(
    cells: Sequence[str], found: Sequence[re.Match[str] | None], *, day_first: bool
) -> list[datetime | None]:
    return [
        _of_seconds(cell) if one is None else _moment(one, day_first=day_first)
        for cell, one in zip(cells, found, strict=True)
    ]


def _moment(one: re.Match[str], *, day_first: bool) -> datetime | None:
    """The moment that a cell states; None where there is no such day or hour."""
    year, month, day = one["y1"] or one["y3"] or one["y4"], one["m1"], one["d1"] or one["d3"]
    if one["a"]:
        year = one["y2"] if len(one["y2"]) == 4 else f"20{one['y2']}"
        day, month = (one["a"], one["b"]) if day_first else (one["b"], one["a"])
    elif name := one["m3"] or one["m4"]:
        month, day = str(_MONTHS.get(name[:3].lower(), 0)), one["d3"] or one["d4"]
    try:
        moment = datetime(int(year), int(month), int(day))
        clock = time() if one["hour"] is None else _clock_of(one)
    except ValueError:
        return None
    moment = datetime.combine(moment, clock)
    zone = (one["zone"] or "").upper().replace("UTC", "+0000").replace("Z", "+0000")
    if not zone:
        return moment
    aware = datetime.strptime(f"{moment:%Y%m%d%H%M%S}{zone}", "%Y%m%d%H%M%S%z")
    return aware.astimezone().replace(tzinfo=None)


def _clock_of(one: re.Match[str]) -> time:
    hour = int(one["hour"])
    if one["half"]:
        hour = hour % 12 + (12 if one["half"].upper() == "P" else 0)
    return time(hour, int(one["minute"]), int(one["second"] or 0))


def _clock(cell: str) -> time | None:
    found = _CLOCK.fullmatch(cell.strip())
    try:
        return None if found is None else _clock_of(found)
    except ValueError:
        return None


def _of_seconds(cell: str) -> datetime | None:
    """The moment of seconds or milliseconds since 1970."""
    if not _SECONDS.fullmatch(cell.strip()):
        return None
    seconds = float(cell)
    return datetime.fromtimestamp(seconds if seconds < _MILLISECONDS else 1e-3 * seconds)


def times_said(text: TextTable, roles: ColumnRoles) -> tuple[str, ...]:
    """Sentences where times say that rows are not in their order, or are of several days."""
    found = row_times(text, roles.used)
    said = list(_out_of_order(text, roles))
    if found.unclear:
        said.append(f"the date of the touches is not known: {found.unclear}")
    return (*said, *several_days([found.first, found.last], found.where))


def several_days(moments: Sequence[datetime | None], where: str = "the files") -> tuple[str, ...]:
    """A sentence where touches of one series are a day or more apart.

    >>> several_days([datetime(2026, 11, 2), None, datetime(2026, 11, 2, 18)])
    ()
    """
    known = [moment for moment in moments if moment is not None]
    if not known or max(known) - min(known) < _ONE_SERIES:
        return ()
    said = (
        f"the touches are of several days, {min(known):%Y-%m-%d} to {max(known):%Y-%m-%d} "
        f"({where}): they are taken as one series, and a probe changes with time"
    )
    return (said,)


_TOUCHED = re.compile(r"touched (\d{4}-\d\d-\d\d(?: \d\d:\d\d)?)")
"""As `RowTimes` says it in the way in which a file was read."""


def first_touched(reading: str) -> datetime | None:
    """When the first touch was made, by the sentence on how its file was read.

    >>> first_touched(f"mm, {RowTimes(datetime(2026, 11, 2, 6), datetime(2026, 11, 3), 'Zeit')}")
    datetime.datetime(2026, 11, 2, 6, 0)
    """
    return min(map(datetime.fromisoformat, _TOUCHED.findall(reading)), default=None)


def _out_of_order(text: TextTable, roles: ColumnRoles) -> Iterator[str]:
    for i, title in _timed_columns(text, roles.used):
        times = _comparable(text.column(i))
        back = [
            row
            for row, (before, after) in enumerate(pairwise(times), start=1)
            if before is not None and after is not None and _earlier(after, before)
        ]
        numbers = all(each is not None and each[0] == "number" for each in times)
        if not back or (numbers and len(back) > _MOST_BACK * len(times)):  # durations of touches
            continue
        row, cells = back[0], text.column(i)
        yield (
            f"line {text.lines[row]}: {title} is {cells[row]}, earlier than {cells[row - 1]} in "
            "the row before: drift and first touch depend on the order, which is that of the rows: "
            "sort the rows"
        )
        return


def _comparable(cells: tuple[str, ...]) -> list[tuple[str, float] | None]:
    """Each time in seconds, with what it counts from; None of what is not a time."""
    moments, _ = _moments(cells)
    found: list[tuple[str, float] | None] = []
    for cell, moment in zip(cells, moments, strict=True):
        if moment is not None:
            found.append(("date", (moment - _EPOCH).total_seconds()))
        elif (clock := _clock(cell)) is not None:
            found.append(("clock", 3600.0 * clock.hour + 60.0 * clock.minute + clock.second))
        else:
            found.append(_number(cell))
    return found


def _number(cell: str) -> tuple[str, float] | None:
    try:
        return None if "_" in cell else ("number", float(cell.replace(",", ".")))
    except ValueError:
        return None


def _earlier(after: tuple[str, float], before: tuple[str, float]) -> bool:
    """Whether a time is earlier; a clock that passes midnight is not."""
    if after[0] != before[0] or after[1] >= before[1]:
        return False
    return after[0] != "clock" or before[1] - after[1] < _HALF_A_DAY
