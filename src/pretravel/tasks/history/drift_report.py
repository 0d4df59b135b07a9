"""Report and picture of the drift of a probe over many days, with the due date."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, BoolArray, FloatArray
from pretravel.files import DatedFile
from pretravel.maps import PretravelMap
from pretravel.qualification import (
    FEWEST_VALUES,
    DailyQuantity,
    DayTerms,
    DriftOverTime,
    QuantityCourse,
    radius_beside,
)
from pretravel.show import (
    Area,
    Axis,
    Colour,
    Column,
    Digits,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Mark,
    Picture,
    PlaneChart,
    Rule,
    Symbol,
    Table,
    View,
    decimals,
    signed_decimals,
    significant,
    value_text,
)

_BAND = 2.0
"""Bars and bands are this many standard uncertainties."""
_TICKS = 5
_STEPS = (1, 2, 5, 7, 14, 30, 61, 91, 183, 365)
"""Days between two dates on an axis; beyond the last one, multiples of it."""
_AHEAD = 2.0
"""Recorded times by which a picture goes beyond it, to a date that is due."""
_FAR = 3.0
"""A date that is farther ahead than so many recorded times is an extrapolation."""


@dataclass(frozen=True)
class DayFile:
    """A day's file and what its touches say."""

    file: DatedFile
    terms: DayTerms


@dataclass(frozen=True, eq=False)
class FolderDrift:
    """The files of many days, and the drift that they show.

    Attributes
    ----------
    days : tuple of DayFile
    unusable : tuple of pair of DatedFile and str
        Files that say nothing, with the reason.
    drift : DriftOverTime
    pretravel_map : PretravelMap
        That all days are compared with.
    map_name : str
        Its file, or that of the touches that it was made from.
    limit_assumed : bool
        Whether the limit is the expanded uncertainty of the map.
    """

    days: tuple[DayFile, ...]
    unusable: tuple[tuple[DatedFile, str], ...]
    drift: DriftOverTime
    pretravel_map: PretravelMap
    map_name: str
    limit_assumed: bool


def folder_document(history: FolderDrift, name: str = "") -> Document:
    """The report of the touches of many days.

    Parameters
    ----------
    history : FolderDrift
    name : str
        Of the folder.
    """
    drift = history.drift
    limit = "twice the rms u of the map" if history.limit_assumed else "given"
    days = len(history.days)
    return Document(
        title=name or "History of a probe",
        verdict=drift_verdict(drift),
        figures=(
            KeyFigure("files", f"{days}, from {_date(drift.moments[0])} to "
                      f"{_date(drift.moments[-1])}, compared with the map of {history.map_name}",
                      remark=_where_dates_are(history)),
            KeyFigure("allowed change of the map", drift.limit / MICROMETRE, "µm", decimals(2),
                      remark=limit),
            *drift_figures(drift),
        ),
        tables=(*drift_tables(drift), _days_table(history)),
        pictures=(Picture("Drift over time", lambda: drift_view(drift, name)),),
        notes=_notes(drift),
        warnings=(
            *_unseen_turns(history), *_unusable_warnings(history), *_future(history),
            *_without_date(history), *_gross(history), *_said_of_days(history),
        ),
    )  # fmt: skip


def _time_span(days: float) -> str:
    """A time in words, rounded up: it follows "within".

    >>> _time_span(40 / 86400), _time_span(79 / 86400), _time_span(0.01), _time_span(0.2)
    ('one minute', '2 minutes', '15 minutes', '5 hours')
    """
    # A millisecond less: a whole number of minutes is no whole number of days in binary.
    minutes = math.ceil(days * 24 * 60 - 1e-5)
    if minutes <= 1:
        return "one minute"
    return f"{minutes} minutes" if minutes < 90 else f"{math.ceil(minutes / 60)} hours"


def drift_verdict(drift: DriftOverTime) -> str:
    """What a process engineer asks first: does it drift, and when is the probe due again."""
    limit = value_text(drift.limit / MICROMETRE, "µm")
    since = drift.moments[drift.starts[-1]]
    start = drift.starts[-1]
    beginning = _beginning(drift, start)
    act = " (qualify now if you have not since)" if beginning == "jump" else ""
    after = f"since the {beginning} of {_date(since)}{act}: " if start else ""
    last_day = "" if drift.drifting else _last_day_words(drift)
    span = float(drift.times[-1] - drift.times[drift.starts[-1]])
    if not drift.last and len(drift.times) - drift.starts[-1] >= FEWEST_VALUES:
        several = f"all within {_time_span(span)}: a drift shows only over several days"
        return f"{after}{several}{last_day}"
    if not drift.last:
        return f"{after}too few days to distinguish drift from scatter (3 are needed){last_day}"
    moving = ", ".join(_movement(one) for one in drift.drifting)
    due, time = drift.first_due()
    _, early = drift.first_due(early=True)
    on = f"on {_date(drift.moment(early))}"
    before = f"at the earliest {on} (95 %{_sooner(drift)})"
    if _over(drift, early):
        before = f"and may be beyond {limit} already (more than 5 % probable)"
    if due is not None and time <= drift.times[-1]:
        moved = f"{due.quantity.name} has probably changed the map by more than {limit}"
        return f"{after}{moving or 'a random walk'}. QUALIFY NOW: {moved}"
    if last_day:
        return f"{after}no trend{last_day}"
    if drift.drifting:
        when = f"due on {_date(drift.moment(time))}" if due is not None else "no due date"
        reached = f"Qualify next when the change reaches {limit}"
        return f"{after}drift: {moving}. {reached}: {when}, {before}"
    walking = [one.quantity.name for one in drift.last if one.course.kind == "random walk"]
    if walking:
        reach = f"does not reach {limit}"
        if due is not None:
            reach = f"is beyond {limit} with 50 % on {_date(drift.moment(time))}, {before}"
        moved = f"{', '.join(walking)} is a random walk"
        return f"{after}no steady drift is detected; {moved}, and {reach}"
    if not math.isfinite(early):
        return f"{after}no drift is detected"
    if _over(drift, early):
        count = len(drift.times) - drift.starts[-1]
        return (
            f"{after}no drift is detected. A change of the map by more than {limit} cannot be "
            f"excluded (its probability is above 5 %): {count} days are too few to show a trend. "
            "Touch on more days"
        )
    return (
        f"{after}no drift is detected. A drift too small to be detected would reach {limit} {on} "
        f"at the earliest (95 %{_sooner(drift)})"
    )


def _beginning(drift: DriftOverTime, start: int) -> str:
    """Why the trend starts again in a row."""
    return "jump" if start in {b.day for b in drift.breaks if not b.apart} else "new map"


def _over(drift: DriftOverTime, time: float) -> bool:
    """Whether a time is before the end of the last recorded day."""
    if time <= drift.times[-1]:
        return True
    moment = drift.moment(time)
    return moment is not None and moment.date() == drift.moments[-1].date()


def _last_day_words(drift: DriftOverTime) -> str:
    """That the last day, or an earlier one, alone is beyond the limit; empty where none is."""
    changed = drift.beyond_on_last_day()
    if changed is None:
        return _one_day_words(drift)
    value = value_text(changed.values[-1], changed.unit, Digits(2, signed=True))
    u = value_text(changed.u[-1], changed.unit, decimals(2))
    return (
        f", but on the last day {changed.name} is {value} (u = {u}), and the change of the map is "
        f"above the allowed {value_text(drift.limit / MICROMETRE, 'µm')}: VERIFY AGAIN, and "
        "qualify if the change remains"
    )


def _one_day_words(drift: DriftOverTime) -> str:
    """That one earlier day alone is beyond the limit; empty where none is."""
    found = drift.beyond_on_one_day()
    if found is None or any(one.course.kind == "random walk" for one in drift.last):
        return ""
    row, changed = found
    value = value_text(changed.values[row], changed.unit, Digits(2, signed=True))
    u = value_text(changed.u[row], changed.unit, decimals(2))
    return (
        f", but on {_date(drift.moments[row])} alone {changed.name} was {value} (u = {u}), and the "
        f"change of the map above the limit of {value_text(drift.limit / MICROMETRE, 'µm')}: what "
        "was measured then may be wrong"
    )


def _sooner(drift: DriftOverTime) -> str:
    """The earliest date if a quantity walks at random, where that is another day."""
    first, early = drift.first_due(early=True)
    walking = _date(drift.moment(drift.earliest_if_walking))
    if first is None or walking == _date(drift.moment(early)):
        return ""
    return f"; {walking} if the {first.quantity.name} is a random walk"


def _movement(one: QuantityCourse) -> str:
    course, unit = one.course, f"{one.quantity.unit}/day"
    digits = decimals(max(1 - math.floor(math.log10(max(course.u_slope, 1e-9))), 0))
    slope = value_text(course.slope, unit, Digits(digits.count, signed=True))
    return f"{one.quantity.name} {slope} (u = {value_text(course.u_slope, unit, digits)})"


def drift_figures(drift: DriftOverTime) -> tuple[KeyFigure, ...]:
    """The slope of each quantity since the last jump, and the dates."""
    found = [
        KeyFigure(
            f"trend of {one.quantity.name}", one.course.slope, f"{one.quantity.unit}/day",
            Digits(3, significant=True, signed=True), one.course.u_slope, "", significant(2),
            remark=f"{_MEANING.get(one.quantity.name, '')}{_kind_words(one)}",
        )
        for one in drift.last
    ]  # fmt: skip
    due, time = drift.first_due()
    first, early = drift.first_due(early=True)
    far = drift.times[-1] + _FAR * max(float(np.ptp(drift.times)), 1.0)
    if due is not None:
        remark = f"because of {due.quantity.name}" + (
            "; far beyond the recorded days" if time > far else ""
        )
        found.append(KeyFigure("due date", _date(drift.moment(time)), remark=remark))
    if first is not None:
        remark = f"because of {first.quantity.name}" + (
            "; far beyond the recorded days" if early > far else ""
        )
        over = _over(drift, early)
        remark += "" if over else _sooner(drift)
        date = (
            "may already have passed during the recorded days"
            if over
            else _date(drift.moment(early))
        )
        found.append(KeyFigure("earliest due date (95 %)", date, remark=remark))
    return tuple(found)


_MEANING = {
    "size": "of the mean pretravel; ",
    "amplitude": "of the map's variation over the directions; ",
    "turn": "of the map about the probe axis; ",
    "form": "form: remaining differences from the map, the noise subtracted in quadrature; ",
}


def _kind_words(one: QuantityCourse) -> str:
    words = {"drift": "drift", "random walk": "random walk", "scatter": "no drift detected"}
    course = one.course
    walking = (
        f"; u of the trend {course.walking.slope[1]:.2g} if this quantity is a random walk"
        if course.may_walk
        else ""
    )
    chance = f"p, the probability of such a trend by chance, is {course.p_slope:.2g}"
    return f"{words[course.kind]}; {chance}{walking}"


def drift_tables(drift: DriftOverTime) -> tuple[Table, ...]:
    """The course of each quantity in each series, and the jumps."""
    rows = [
        (drift.moments[start], one)
        for start, courses in zip(drift.starts, drift.courses, strict=True)
        for one in courses
    ]
    last = drift.moments[drift.starts[-1]]
    found = []
    if rows:
        found.append(_courses_table(drift, rows, last))
    if drift.breaks:
        units = {one.name: one.unit for one in drift.quantities}
        found.append(
            Table(
                (
                    Column.of("date", [_date(drift.moments[b.day]) for b in drift.breaks]),
                    Column.of("what", [_BREAK[b.apart] for b in drift.breaks]),
                    Column.of("clearest in", [b.quantity for b in drift.breaks]),
                    Column.of("jump", [b.size for b in drift.breaks], "", signed_decimals(2)),
                    Column.of("u", [b.u for b in drift.breaks]),
                    Column.of("unit", [units[b.quantity] for b in drift.breaks]),
                ),
                "Jumps and days that deviate",
            )
        )
    return tuple(found)


_BREAK = {False: "jump: the trend starts again", True: "this day alone deviates"}


def _courses_table(
    drift: DriftOverTime, rows: Sequence[tuple[datetime, QuantityCourse]], last: datetime
) -> Table:
    def dates(*, early: bool) -> list[str]:
        found = []
        for begin, one in rows:
            time = math.inf if one.due is None else one.due.early if early else one.due.due
            found.append(_date(drift.moment(time)) if begin == last else "")
        return found

    course = [one.course for _, one in rows]
    return Table(
        (
            Column.of("since", [_date(begin) for begin, _ in rows]),
            Column.of("quantity", [one.quantity.name for _, one in rows]),
            Column.of("behaviour", [c.kind for c in course]),
            Column.of("days", [float(len(c.series)) for c in course], "", decimals(0)),
            Column.of("trend per day", [c.slope for c in course], "", significant(3)),
            Column.of("u", [c.u_slope for c in course], "", significant(2)),
            Column.of(
                "u, random walk",
                [c.walking.slope[1] if c.may_walk else math.nan for c in course],
                "",
                significant(2),
            ),
            Column.of("unit", [one.quantity.unit for _, one in rows]),
            Column.of("p", [c.p_slope for c in course], "", significant(2)),
            Column.of("scatter", [c.noise.scatter for c in course], "", significant(2)),
            Column.of("walk/√day", [math.sqrt(c.noise.walk) for c in course], "", significant(2)),
            Column.of("due", dates(early=False)),
            Column.of("earliest (95 %)", dates(early=True)),
        ),
        "Course of each quantity",
        "scatter: between the days, beyond the uncertainty of the touches. walk: standard "
        "deviation of the daily step of a random walk. u: for independent errors of the days. "
        "u, random walk: if the quantity walks at random, which few days do not exclude. p: "
        "probability of such a trend by chance.",
    )


def _days_table(history: FolderDrift) -> Table:
    quantities = history.drift.quantities
    columns = [
        Column.of("date", [f"{day.file.moment:%Y-%m-%d %H:%M}" for day in history.days]),
        Column.of("file", [day.file.path.name for day in history.days]),
        Column.of("touches", [float(day.terms.touches) for day in history.days], "", decimals(0)),
    ]
    for one in quantities:
        columns += [
            Column.of(one.name, one.values, one.unit, signed_decimals(2)),
            Column.of("u", one.u, one.unit),
        ]
    own = any(day.file.path.name == history.map_name for day in history.days)
    return Table(
        tuple(columns),
        "Each day: difference from the map",
        explanation=f"The map was made from {history.map_name}: the row of this file has only the "
        "residuals of the fit of the map, and no form. " * own
        + "form: remaining differences from the map (root mean square), the noise subtracted in "
        "quadrature; negative: smaller than the noise.",
    )  # fmt: skip


def day_columns(history: FolderDrift) -> dict[str, npt.ArrayLike]:
    """Columns of a file: one row for each file that could be used."""
    terms = [day.terms for day in history.days]
    apart = {b.day for b in history.drift.breaks if b.apart}
    rows = range(len(terms))
    series = [sum(start <= row for start in history.drift.starts) for row in rows]
    radius = radius_beside(history.pretravel_map)
    found: dict[str, npt.ArrayLike] = {
        "time": [day.file.moment.isoformat(timespec="seconds") for day in history.days],
        "file": [day.file.path.name for day in history.days],
        "series": series,
        "apart": [int(row in apart) for row in rows],
        "touches": [one.touches for one in terms],
        "left_out": [sum(len(o.rows) for o in one.gross) for one in terms],
        "effective_radius_mm": [radius - one.level for one in terms],
    }
    for name, label, size in _FILE_COLUMNS:
        found[label] = np.array([getattr(one, name) for one in terms]) / size
        found[f"u_{label}"] = np.array([getattr(one, f"u_{name}") for one in terms]) / size
    if any(one.unseen_turn is not None for one in terms):
        found["unseen_turn_deg"] = [
            math.nan if one.unseen_turn is None else one.unseen_turn.angle / DEGREE for one in terms
        ]
    return found


_FILE_COLUMNS = (
    ("level", "level_um", MICROMETRE),
    ("scale", "scale_percent", 0.01),
    ("turn", "turn_deg", DEGREE),
    ("form", "form_um", MICROMETRE),
    ("delay", "delay_ms", 1e-3),
)


def _notes(drift: DriftOverTime) -> tuple[str, ...]:
    if not drift.starts[-1]:
        return ()
    return (
        (
            f"the dates hold for a map made on {_date(drift.moments[drift.starts[-1]])}. If the "
            "probe was not qualified since then, qualify it now"
        ),
    )


def _unseen_turns(history: FolderDrift) -> list[str]:
    unseen = [day for day in history.days if day.terms.unseen_turn is not None]
    if not unseen:
        return []
    days = f"{len(unseen)} of {len(history.days)} files ({unseen[0].file.path.name}"
    days += " …)" if len(unseen) > 1 else ")"
    return [f"{days}: {unseen[0].terms.unseen_turn}. Such days say nothing of a turn"]


def _unusable_warnings(history: FolderDrift) -> list[str]:
    return [f"{file.path.name} is not used: {reason}" for file, reason in history.unusable]


def _future(history: FolderDrift) -> list[str]:
    tomorrow = datetime.now() + timedelta(days=1)
    late = [day.file.path.name for day in history.days if day.file.moment > tomorrow]
    if not late:
        return []
    said = "the date of the file, or the clock of this computer, is wrong, and so are the trends"
    return [f"{_shown(late)}: a date after today; {said}"]


def _shown(names: Sequence[str]) -> str:
    return ", ".join(names[:_NAMED]) + (" …" if len(names) > _NAMED else "")


_NAMED = 3


def _said_of_days(history: FolderDrift) -> list[str]:
    """What is to be said of the touches of the days, each sentence once."""
    files: dict[str, list[str]] = {}
    for day in history.days:
        for said in day.terms.warnings:
            files.setdefault(said, []).append(day.file.path.name)
    return [f"{_shown(names)}: {said}" for said, names in files.items()]


def _without_date(history: FolderDrift) -> list[str]:
    files = [day.file for day in history.days if not (day.file.from_name or day.file.from_rows)]
    if not files:
        return []
    several = len(files) > 1
    what = f"{len(files)} file{'s have' if several else ' has'} no date in the name or the rows"
    shown = f"{files[0].path.name}{' …' if several else ''}"
    used = "the time of the last change of the file is used, which copying can change"
    return [f"{what} ({shown}): {used}"]


def _where_dates_are(history: FolderDrift) -> str:
    places = dict.fromkeys(day.file.from_rows for day in history.days if day.file.from_rows)
    return f"dates in the rows: {', '.join(list(places)[:_NAMED])}" if places else ""


def _gross(history: FolderDrift) -> list[str]:
    return [
        f"{day.file.path.name}: {outlier.message}. It was left out"
        for day in history.days
        for outlier in day.terms.gross
    ]


def drift_view(drift: DriftOverTime, title: str = "") -> View:
    """A chart for each quantity: days with bars, course with its band, limit and dates."""
    return View(title or "History of a probe", drift_charts(drift), 2)


def drift_charts(drift: DriftOverTime) -> tuple[PlaneChart, ...]:
    """The charts of `drift_view`."""
    return tuple(_chart(drift, one) for one in drift.quantities)


def _chart(drift: DriftOverTime, quantity: DailyQuantity) -> PlaneChart:
    times, apart = drift.times, {b.day for b in drift.breaks if b.apart}
    end = _end_of_picture(drift)
    marks: list[Mark] = []
    for number, courses in enumerate(drift.courses):
        own = next((one for one in courses if one.quantity is quantity), None)
        if own is not None:
            marks += _course_marks(own, end if courses is drift.last else None, named=not number)
    rows = np.array([row not in apart for row in range(len(times))])
    labels = tuple(f"{moment:%Y-%m-%d %H:%M}" for moment in drift.moments)
    looks: tuple[tuple[BoolArray, Symbol, Colour, str], ...] = (
        (rows, "dot", "series1", f"a day, ± {_BAND:g} u"),
        (~rows, "cross", "limit", "deviates"),
    )
    for kept, symbol, colour, name in looks:
        at = np.flatnonzero(kept & np.isfinite(quantity.values))
        if len(at):
            dots = Dots(times[at], quantity.values[at], name, colour, u=_BAND * quantity.u[at],
                        symbol=symbol, labels=tuple(labels[row] for row in at))  # fmt: skip
            marks.append(dots)
    names = [_beginning(drift, start) for start in drift.starts[1:]]
    marks += [
        Rule(_middle(times, start), "" if name in names[:k] else name, "ink", upright=True)
        for k, (start, name) in enumerate(zip(drift.starts[1:], names, strict=True))
    ]
    y = Axis(f"{quantity.name}, day − map", quantity.unit)
    return PlaneChart(quantity.name, _time_axis(drift.moments[0], end), y, tuple(marks))


def _middle(times: FloatArray, row: int) -> float:
    return 0.5 * float(times[row - 1] + times[row])


def _end_of_picture(drift: DriftOverTime) -> float:
    """The first date that is due, if it is not far beyond the days. [days]"""
    last = float(drift.times[-1])
    length = max(last, 1.0)
    dates = [drift.first_due()[1], drift.first_due(early=True)[1]]
    near = [date for date in dates if date <= last + _AHEAD * length]
    return max([last + 0.05 * length, *(date + 0.05 * length for date in near)])


def _course_marks(one: QuantityCourse, end: float | None, *, named: bool) -> list[Mark]:
    """The course of a quantity with its band; to `end` where it is continued."""
    series, (level, u) = one.course.series, one.course.expected.level
    name = {"drift": "trend", "random walk": "random walk", "scatter": "no drift: trend"}
    band = f"its band, ± {_BAND:g} u"
    marks: list[Mark] = [
        Area(series.times, level - _BAND * u, level + _BAND * u, band if named or end else "",
             "series3"),
        LineMark(series.times, level, name[one.course.kind] if named or end else "", "series3"),
    ]  # fmt: skip
    if end is None:
        return marks
    ahead = np.linspace(float(series.times[-1]), end, 60)
    mean, spread = one.course.expected.later(ahead)
    marks += [
        Area(ahead, mean - _BAND * spread, mean + _BAND * spread, "", "series3", 0.1),
        LineMark(ahead, mean, "forecast", "series3", dashed=True),
    ]
    if one.due is None:
        return marks
    reach = max(float(np.abs(np.append(mean, level) - one.start).max()), 3.0 * float(u.max()))
    sides = (1.0, -1.0) if one.due.limit < 3.0 * reach else ()
    marks += [
        Rule(one.start + side * one.due.limit, "limit" if side > 0.0 else "", "limit")
        for side in sides
    ]
    for date, words in ((one.due.early, "earliest due date (95 %)"), (one.due.due, "due date")):
        if date <= end:
            marks.append(
                Rule(date, words, "series2" if "due" in words else "series4", upright=True)
            )
    return marks


def _time_axis(first: datetime, end: float) -> Axis:
    """Dates at equal steps of whole days."""
    day = datetime(first.year, first.month, first.day, tzinfo=first.tzinfo)
    offset = (day - first).total_seconds() / 86400.0
    wanted = max((end - offset) / _TICKS, 1e-9)
    if end < 1.0:
        return Axis("time", "days", -0.05 * end, end)
    step = next((s for s in _STEPS if s >= wanted), math.ceil(wanted / _STEPS[-1]) * _STEPS[-1])
    dates = np.arange(offset, end, step)
    ticks = [float(tick) for tick in dates if tick >= -0.03 * end]
    names = tuple(f"{first + timedelta(days=tick):%Y-%m-%d}" for tick in ticks)
    return Axis("date", "", -0.03 * end, end, ticks=tuple(ticks),
                tick_names=names)  # fmt: skip


def _date(moment: datetime | None) -> str:
    return "" if moment is None else f"{moment:%Y-%m-%d}"
