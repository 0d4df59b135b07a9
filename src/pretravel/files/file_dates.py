"""The dates of files: from their names, else from when they were last changed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from pretravel.base import InputError

_OTHER_DATE = r"(?!\d{4}[-_.]?\d\d[-_.]?\d\d)"
_TIME = (
    r"(?:[T _.-]{0,2}"
    + _OTHER_DATE
    + r"([01]\d|2[0-3])[:h._-]?([0-5]\d)(?:[:m._-]?([0-5]\d))?(?!\d))?"
)
_YEAR_FIRST = re.compile(r"(?<!\d)((?:19|20)\d\d)([-_.]?)(\d\d)\2(\d\d)" + _TIME)
_DAY_FIRST = re.compile(r"(?<!\d)(\d\d)([-_.])(\d\d)\2((?:19|20)\d\d)" + _TIME)


@dataclass(frozen=True)
class DatedFile:
    """A file with its date.

    Attributes
    ----------
    path : Path
    moment : datetime
        Without a time zone, as the name states it or as the clock here shows it.
    from_name : bool
        Whether the name states it; else it is when the file was last changed.
    """

    path: Path
    moment: datetime
    from_name: bool


def dated_file(path: Path) -> DatedFile:
    """The date of a file.

    Parameters
    ----------
    path : Path
        Its name may contain a date: 2026-03-14, 20260314, 2026_03_14 or 14-03-2026 (14.03.2026),
        and after it a time: 0630, 06-30, T06:30:00.

    Returns
    -------
    DatedFile

    Raises
    ------
    InputError
        The name contains two dates, or one with the month before the day; the file does not exist.

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
    if found:
        return DatedFile(path, found.pop(), from_name=True)
    try:
        changed = path.stat().st_mtime
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    return DatedFile(path, datetime.fromtimestamp(changed), from_name=False)


def _moments(path: Path) -> list[datetime]:
    found = []
    for year, _, month, day, *time in _YEAR_FIRST.findall(path.stem):
        moment = _moment(year, month, day, time)
        found += [] if moment is None else [moment]
    for day, _, month, year, *time in _DAY_FIRST.findall(path.stem):
        moment = _moment(year, month, day, time)
        if moment is None and _moment(year, day, month, time) is not None:
            raise InputError(
                f"the date {day}-{month}-{year} in its name has the month before the day, and "
                "dates in other names can be read both ways: rename the files, year first, such "
                f"as {year}-{day}-{month}",
                path=path,
            )
        found += [] if moment is None else [moment]
    return found


def _moment(year: str, month: str, day: str, time: list[str]) -> datetime | None:
    """The moment of a date and a time; None if there is no such day."""
    try:
        hour, minute, second = (int(part or 0) for part in time)
        return datetime(int(year), int(month), int(day), hour, minute, second)
    except ValueError:
        return None
