"""The dates of files: from their names or their rows, else from when they were last changed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base import InputError
from pretravel.files.format_registry import format_of
from pretravel.files.source_file import SourceFile, opened
from pretravel.files.table_formats import CSV
from pretravel.files.text_table import read_text_table
from pretravel.files.times_of_rows import RowTimes, first_touched, row_times
from pretravel.touches import Touches

if TYPE_CHECKING:
    from pretravel.maps import PretravelMap

_OTHER_DATE = r"(?!\d{4}[-_.]?\d\d[-_.]?\d\d)"
_TIME = (
    r"(?:[T _.-]{0,2}"
    + _OTHER_DATE
    + r"([01]\d|2[0-3])[:h._-]?([0-5]\d)(?:[:m._-]?([0-5]\d))?(?!\d))?"
)
_YEAR_FIRST = re.compile(r"(?<!\d)((?:19|20)\d\d)([-_.]?)(\d\d)\2(\d\d)" + _TIME)
_DAY_FIRST = re.compile(r"(?<!\d)(\d\d)([-_.])(\d\d)\2((?:19|20)\d\d)" + _TIME)

_ONE_DAY = timedelta(days=1)
_HALF_A_DAY = 0.5 * _ONE_DAY


@dataclass(frozen=True)
class DatedFile:
    """A file with its date.

    Attributes
    ----------
    path : Path
    moment : datetime
        Without a time zone, as the name states it or as the clock here shows it.
    from_name : bool
        Whether the name states it.
    from_rows : str
        The columns or the line that state it, where the name does not. Without both it is when the
        file was last changed.
    unclear : str
        Why a date of the rows was not used.
    """

    path: Path
    moment: datetime
    from_name: bool
    from_rows: str = ""
    unclear: str = ""


def dated_file(path: Path) -> DatedFile:
    """The date of a file.

    Parameters
    ----------
    path : Path
        Its name may contain a date: 2026-03-14, 20260314, 2026_03_14 or 14-03-2026 (14.03.2026),
        and after it a time: 0630, 06-30, T06:30:00.

    Raises
    ------
    InputError
        The name contains two dates, or one with the month before the day, or another day than the
        rows of the table; the file does not exist.

    >>> dated_file(Path("sphere_2026-03-14_0630.csv")).moment.isoformat()
    '2026-03-14T06:30:00'
    >>> dated_file(Path("14.03.2026 ball.csv")).moment.isoformat()
    '2026-03-14T00:00:00'
    """
    found = set(_moments(path))
    if len(found) > 1:
        shown = " and ".join(sorted(f"{moment:%Y-%m-%d %H:%M}" for moment in found))
        raise InputError(
            f"its name contains two dates, {shown}: rename it so that only the date of the "
            "touches remains",
            path=path,
        )
    times = times_of_file(path) if path.is_file() else RowTimes()
    if found:
        moment = found.pop()
        _refuse_other_day(path, moment, times)
        return DatedFile(path, moment, from_name=True)
    if times.first is not None:
        return DatedFile(path, times.first, from_name=False, from_rows=times.where)
    try:
        changed = path.stat().st_mtime
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    changed_at = datetime.fromtimestamp(changed)
    return DatedFile(path, changed_at, from_name=False, unclear=times.unclear)


def times_of_file(source: Path | str | SourceFile) -> RowTimes:
    """When the rows of a file were touched; nothing of a file that is not a table of text."""
    file = opened(source)
    try:
        return row_times(read_text_table(file)) if format_of(file) is CSV else RowTimes()
    except InputError:  # which is said where the touches are read
        return RowTimes()


def time_of_touches(paths: Sequence[Path]) -> tuple[datetime | None, str]:
    """When the last of the touches of files were made, by their rows, else by their names.

    Returns
    -------
    datetime or None
        None where not all files state it, and for today without a time: it is now. A day without a
        time is its noon.
    str
        Why one that is stated is not used.
    """
    found = [times_of_file(path) for path in paths]
    unclear = next((times.unclear for times in found if times.unclear), "")
    stated = [times.last or _by_name(path.name) for path, times in zip(paths, found, strict=True)]
    known = [moment for moment in stated if moment is not None]
    if unclear or len(known) < len(found) or not known:
        return None, ""  # said where they are read
    last = max(known)
    if last.time() == time():  # a date alone
        if last.date() == datetime.now().date():
            return None, ""
        last += _HALF_A_DAY  # the day is the same in most time zones
    if last > datetime.now() + _ONE_DAY:
        where = str(found[0]) or f"the name of {paths[0].name}"
        return None, f"{where}: this is after today, and not used as the time of the entry"
    return last, ""


def moment_of_touches(reading: str, name: str) -> datetime | None:
    """When the first touch was made: by how its file was read, else by the file's name.

    >>> moment_of_touches("decimal comma", "sphere_2026-03-14.csv")
    datetime.datetime(2026, 3, 14, 0, 0)
    """
    return first_touched(reading) or _by_name(name)


def _by_name(name: str) -> datetime | None:
    try:
        return next(iter(_moments(Path(name))), None)
    except InputError:  # which is said where the dates of files are needed
        return None


def before_those_of_map(touches: Touches, pretravel_map: PretravelMap) -> tuple[str, ...]:
    """A sentence where touches were made before those of the map that they verify."""
    made = pretravel_map.provenance
    known = moment_of_touches(made.reading, made.touches_file)
    own = moment_of_touches(touches.reading, touches.source or "")
    if known is None or own is None:
        return ()
    days_alone = known.time() == time() or own.time() == time()
    earlier = own.date() < known.date() if days_alone else own < known
    if not earlier:
        return ()
    form = "%Y-%m-%d" if days_alone else "%Y-%m-%d %H:%M"
    said = (
        f"these touches are of {own:{form}}, before those of the map, {known:{form}}: they do not "
        "show whether the probe has changed since. Touch the reference again"
    )
    return (said,)


def _refuse_other_day(path: Path, moment: datetime, times: RowTimes) -> None:
    """Refuse a date in the name that is another one than that of the rows."""
    if times.first is None or times.last is None:
        return
    if times.first - _ONE_DAY <= moment <= times.last + _ONE_DAY:
        return
    raise InputError(
        f"its name has the date {moment:%Y-%m-%d}, and its rows were {times}: one of them is "
        "wrong. Correct it",
        path=path,
    )


def _moments(path: Path) -> list[datetime]:
    found = []
    for year, _, month, day, *clock in _YEAR_FIRST.findall(path.stem):
        moment = _moment(year, month, day, clock)
        found += [] if moment is None else [moment]
    for day, _, month, year, *clock in _DAY_FIRST.findall(path.stem):
        moment = _moment(year, month, day, clock)
        if moment is None and _moment(year, day, month, clock) is not None:
            raise InputError(
                f"the date {day}-{month}-{year} in its name has the month before the day, and "
                "dates in other names can be read both ways: rename the files, year first, such "
                f"as {year}-{day}-{month}",
                path=path,
            )
        found += [] if moment is None else [moment]
    return found


def _moment(year: str, month: str, day: str, clock: list[str]) -> datetime | None:
    """The moment of a date and a time; None if there is no such day."""
    try:
        hour, minute, second = (int(part or 0) for part in clock)
        return datetime(int(year), int(month), int(day), hour, minute, second)
    except ValueError:
        return None
