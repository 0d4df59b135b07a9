"""The drift of a probe over many days: jumps, the course since the last one, the due date.

Every quantity has its own course and its own limit: the size of it that changes the map by the
allowed length in some direction. The map is due for a new qualification at the first due date of
any quantity.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError, frozen
from pretravel.qualification.series_breaks import Break, breaks_of
from pretravel.qualification.series_courses import Course, DueDate, course_of, due_date
from pretravel.qualification.time_series import FEWEST_VALUES, series_of

_SURE = 4.0
"""Standard uncertainties that one of many days and quantities is beyond the limit, to be named."""
_SECONDS_PER_DAY = 86400.0


SHORTEST_SPAN = 0.5
"""Verifications within less say nothing of a drift in days. [days]"""


@dataclass(frozen=True, eq=False)
class DailyQuantity:
    """A quantity of a probe on n days.

    Attributes
    ----------
    name, unit : str
    values, u : (n,) float
        Less those of the map, and the standard uncertainty that the days do not share; not a
        number where not determined.
    share : float
        Largest change of the map, in any direction, for one unit of the quantity; zero where it
        is not known. [mm/unit]
    known_u : bool
        Whether u is that of the day alone. If not, the scatter of the days is determined from the
        values alone.
    """

    name: str
    unit: str
    values: FloatArray
    u: FloatArray
    share: float
    known_u: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))
        object.__setattr__(self, "u", frozen(self.u))

    @property
    def own_u(self) -> FloatArray:
        """The uncertainty of each day, in addition to the scatter that the days show."""
        if self.known_u:
            return self.u
        small = 1e-3 * float(np.nanmedian(self.u)) if np.isfinite(self.u).any() else math.nan
        return np.where(np.isfinite(self.values), small, math.nan)


@dataclass(frozen=True)
class QuantityCourse:
    """The course of a quantity in the days since the last break.

    Attributes
    ----------
    quantity : DailyQuantity
    course : Course
    start : float
        Value that the limit counts from: zero, that of the map, or after a jump the state of the
        first day, since the map is recomputed then.
    due : DueDate or None
        None where it is not known by how much the quantity changes the map.
    """

    quantity: DailyQuantity
    course: Course
    start: float
    due: DueDate | None


@dataclass(frozen=True, eq=False)
class DriftOverTime:
    """The drift of a probe over n days.

    Attributes
    ----------
    moments : tuple of datetime
        Not decreasing.
    quantities : tuple of DailyQuantity
    breaks : tuple of Break
    starts : tuple of int
        First day of each series without a jump; a new map begins one too.
    courses : tuple of tuple of QuantityCourse
        Of each series, those quantities that have enough days.
    limit : float
        Allowed change of the map. [mm]
    """

    moments: tuple[datetime, ...]
    quantities: tuple[DailyQuantity, ...]
    breaks: tuple[Break, ...]
    starts: tuple[int, ...]
    courses: tuple[tuple[QuantityCourse, ...], ...]
    limit: float

    @property
    def last(self) -> tuple[QuantityCourse, ...]:
        """Courses since the last jump."""
        return self.courses[-1]

    @property
    def drifting(self) -> tuple[QuantityCourse, ...]:
        """Those of the last series that drift."""
        return tuple(one for one in self.last if one.course.kind == "drift")

    def first_due(self, *, early: bool = False) -> tuple[QuantityCourse | None, float]:
        """The quantity that is due first, and its time; none and infinite if none is.

        Parameters
        ----------
        early : bool
            The early dates instead.
        """
        found: QuantityCourse | None = None
        least = math.inf
        for one in self.last:
            time = math.inf if one.due is None else one.due.early if early else one.due.due
            if time < least:
                found, least = one, time
        return found, least

    def beyond_on_last_day(self) -> DailyQuantity | None:
        """The quantity that the last day alone shows beyond the limit, by two u; None: none is.

        A change of one day is no trend, and no jump before another day confirms it.
        """
        return self._beyond_on(len(self.moments) - 1)

    def beyond_on_one_day(self) -> tuple[int, DailyQuantity] | None:
        """The only day since the last jump that is beyond the limit in this way, and its quantity.

        None where there is none or several. A day that `breaks` has as apart does not count; they
        need five days.
        """
        apart = {one.day for one in self.breaks if one.apart}
        rows = [row for row in range(self.starts[-1], len(self.moments)) if row not in apart]
        found = [(row, one) for row in rows if (one := self._beyond_on(row)) is not None]
        return found[0] if len(found) == 1 else None

    def _beyond_on(self, row: int) -> DailyQuantity | None:
        start = {one.quantity.name: one.start for one in self.last}
        if not self.starts[-1]:
            start = {one.name: 0.0 for one in self.quantities} | start
        for one in self.quantities:
            change = abs(one.values[row] - start.get(one.name, math.nan)) - _SURE * one.u[row]
            if change * one.share > self.limit:
                return one
        return None

    @property
    def earliest_if_walking(self) -> float:
        """The first early date of any quantity if they walk at random about their trends; the
        first early date where the values exclude it. [days]
        """
        return min((one.due.early_if_walking for one in self.last if one.due), default=math.inf)

    def moment(self, time: float) -> datetime | None:
        """The moment of a time in days from the first; None where it is infinite."""
        return self.moments[0] + timedelta(days=time) if math.isfinite(time) else None

    @property
    def times(self) -> FloatArray:
        """Days from the first moment, (n,)."""
        return days_from(self.moments)


def days_from(moments: Sequence[datetime]) -> FloatArray:
    """Days from the first of several moments, (n,).

    >>> days_from([datetime(2026, 3, 1), datetime(2026, 3, 2, 12)]).tolist()
    [0.0, 1.5]
    """
    return np.array([(m - moments[0]).total_seconds() / _SECONDS_PER_DAY for m in moments])


def drift_over_time(
    moments: Sequence[datetime],
    quantities: Sequence[DailyQuantity],
    limit: float,
    new_maps: Collection[int] = (),
) -> DriftOverTime:
    """Find jumps, determine the course between them, and forecast the due date.

    Parameters
    ----------
    moments : sequence of datetime
        Of the days, not decreasing.
    quantities : sequence of DailyQuantity
    limit : float
        Allowed change of the map. [mm]
    new_maps : collection of int
        Days from which the values are less a new map.

    Raises
    ------
    PretravelError
        No day; a limit that is not positive.

    >>> days = np.arange(8)
    >>> level = DailyQuantity("level", "µm", 0.1 * days, np.full(8, 1e-6), share=1e-3)
    >>> found = drift_over_time([datetime(2026, 3, 1 + d) for d in days.tolist()], [level], 1e-3)
    >>> found.moment(round(found.first_due()[1], 3))
    datetime.datetime(2026, 3, 11, 0, 0)
    """
    if not moments:
        raise PretravelError("no day has a result: the drift is unknown")
    if not (math.isfinite(limit) and limit > 0.0):
        raise PretravelError(
            f"the allowed change of the map is {limit:g} mm; it must be positive", inputs=("limit",)
        )
    times = days_from(moments)
    known = {one.name: (one.values, one.own_u) for one in quantities}
    breaks = breaks_of(times, known, frozenset(new_maps))
    apart = {one.day for one in breaks if one.apart}
    jumps = {one.day for one in breaks if not one.apart}
    starts = sorted({0, *new_maps, *jumps})
    courses = []
    for first, end in zip(starts, [*starts[1:], len(times)], strict=True):
        rows = np.array([row for row in range(first, end) if row not in apart], dtype=np.intp)
        counted_from_map = first not in jumps
        courses.append(
            tuple(
                found
                for one in quantities
                if (found := _course(times, one, rows, limit, zero=counted_from_map)) is not None
            )
        )
    return DriftOverTime(
        tuple(moments), tuple(quantities), breaks, tuple(starts), tuple(courses), limit
    )


def _course(
    times: FloatArray, quantity: DailyQuantity, rows: IntArray, limit: float, *, zero: bool
) -> QuantityCourse | None:
    """The course of a quantity on some days; None where too few determine it."""
    series = series_of(times[rows], quantity.values[rows], quantity.own_u[rows])
    if len(series) < FEWEST_VALUES or np.ptp(series.times) < SHORTEST_SPAN:
        return None
    course = course_of(series)
    start = 0.0 if zero else float(course.expected.level[0][0])
    due = due_date(course, limit / quantity.share, start) if quantity.share > 0.0 else None
    return QuantityCourse(quantity, course, start, due)
