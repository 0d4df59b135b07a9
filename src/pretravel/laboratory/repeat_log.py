"""Series of touches of one point, from any file of touches, positions or heights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, InputError, IntArray
from pretravel.files import (
    ALL,
    CSV,
    PARQUET,
    SERIES_COLUMNS,
    FilePositions,
    FileReadings,
    ReadingOptions,
    Source,
    SourceFile,
    chosen,
    contacts,
    format_named,
    format_of,
    look_at,
    missed_sentence,
    opened,
    read_touch_columns,
)
from pretravel.laboratory.repeat_table import (
    SERIES_OF_LABEL,
    LoggedSeries,
    column_of_heights,
    columns_of_readings,
    counted_heights,
    without_filled_in,
)
from pretravel.touches import (
    FEWEST_REPEATS,
    WORD_COLUMNS,
    Touches,
    copied_rows_warnings,
    rows_in_a_row_warnings,
)

MachineAxis: TypeAlias = Literal["x", "y", "z"]
_AXES: tuple[MachineAxis, ...] = ("x", "y", "z")
_PERIODS = (2, 3, 4, 5)
"""Touches of one measurement, of which the first can be faster."""
_RARE = 1e-4
"""Probability by chance at which one of every few touches is called apart."""
_ONE_PLACE = 0.1
"""Touches are of one point if their places differ by less than this across their direction. [mm]"""
_ALONG = 1.0
"""And along it by less than this: the opposite wall of a bore is another place. [mm]"""
_FAR_ALONG = 10.0
"""A single touch at a place that differs by less along the direction is a gross one of it. [mm]"""
_ONE_WAY = 0.99
"""Cosine between directions of travel from which they are one: 8°."""
_ALIKE = 0.5
"""Another axis that scatters by more than this share of the first leaves the direction open."""
_TURNS = 3
"""Changes between two levels; a jump has one, an outlier two."""
_APART = 5.0
"""Levels are apart by more than this many times the range at a level."""
_ONCE = (
    "PROBEOPEN does not write a touch whose position is equal to the one before: such touches are "
    "missing, and the noise looks larger than it is. Log with LOG instead"
)


@dataclass(frozen=True, eq=False)
class RepeatLog:
    """What a file contains.

    Attributes
    ----------
    series : tuple of LoggedSeries
        Those with at least `FEWEST_REPEATS` touches.
    single : int
        Touches of the other places.
    along : str
        The direction of the values.
    warnings : tuple of str
    """

    series: tuple[LoggedSeries, ...]
    single: int
    along: str
    warnings: tuple[str, ...]


def read_repeats(
    source: Source,
    options: ReadingOptions = ReadingOptions(),
    axis: MachineAxis | None = None,
    *,
    file_format: str | None = None,
) -> RepeatLog:
    r"""Read touches of one point or a few.

    Parameters
    ----------
    source : str, Path or SourceFile
        Any file of touches or positions; or a column of heights.
    options : ReadingOptions
        What the file does not state. Work coordinates do not matter, nor does a plan.
    axis : str, optional
        Along which the touches went, for positions without normals; by default the one along which
        the positions of one place differ.
    file_format : str, optional
        Detected when not given.

    Raises
    ------
    InputError
        The file cannot be read; its unit is not known; no point was touched often enough, as in a
        mesh of heights; positions leave open along which axis they were touched.

    >>> log = SourceFile("z.txt", b"z_mm\n1.32\n1.3175\n1.325\n1.32\n1.3025\n")
    >>> read_repeats(log).series[0].values.tolist()
    [1.32, 1.3175, 1.325, 1.32, 1.3025]
    """
    file = opened(source)
    heights = None if file_format else column_of_heights(file, options)
    if heights is not None:
        if options.columns:
            raise file.error(
                "the file has one column of heights: names of columns are not used, leave them out",
                inputs=("columns",),
            )
        log = _checked(file, [heights[0]], 0, axis or "the column of heights", heights[1])
        return _named(file, log, options.series)
    stated = (PARQUET if file.ending == ".parquet" else CSV) if options.columns else None
    known = stated or (None if file_format is None else format_named(file_format))
    if known is None and (table := _of_columns(file, options)) is not None:
        return _named(file, table, options.series)
    try:
        known = known or format_of(file)
    except InputError:
        if (counted := counted_heights(file, options)) is None:
            raise
        log = _checked(file, *_repeated(counted[0]), "the column of heights", counted[1])
        return _named(file, log, options.series)
    if known in (CSV, PARQUET) and (one := _one_coordinate(file, options, axis)) is not None:
        return _named(file, one, options.series)
    looking = replace(options, anywhere=True, look_only=True, plan=None, series=())
    if known.name == "g2core" and options.offset is None:
        looking = replace(looking, offset=(0.0, 0.0, 0.0))
    found, unit_known = look_at(file, looking, known)
    rows = found if isinstance(found, FilePositions) else found.touches
    given = {word for column in SERIES_COLUMNS for word in rows.words.get(column, ())}
    named = [name for name in options.series if name not in given]
    found = chosen(
        found, replace(options, series=tuple(n for n in options.series if n in {*given, ALL}))
    )
    if not unit_known:
        raise file.error("the table has no unit; give the units, mm or inch", inputs=("units",))
    warnings: tuple[str, ...] = (_ONCE,) if known.name == "probeopen" else ()
    if known in (CSV, PARQUET):
        warnings = _not_read(read_touch_columns(file, looking).table.unread)
    if isinstance(found, FilePositions):
        log = _of_positions(file, found, axis, warnings)
    else:
        _refuse_other_axis(file, axis, found.touches.normals)
        log = _of_touches(file, found, (*warnings, *found.notes()))
    return _named(file, log, named)


def _named(file: SourceFile, log: RepeatLog, names: Sequence[str]) -> RepeatLog:
    """The series of these names, which labels or places gave them; all where none is named."""
    there = [one.name for one in log.series]
    names = [name for name in names if name != ALL]
    for name in names:
        if name not in there:
            shown = ", ".join(filter(None, there)) or "one, without a name"
            raise file.error(f"no series is '{name}'; there are: {shown}", inputs=("series",))
    return replace(log, series=tuple(s for s in log.series if not names or s.name in names))


def _of_columns(file: SourceFile, options: ReadingOptions) -> RepeatLog | None:
    """Readings in columns with names, not the three coordinates of a touch; None: another file."""
    try:
        table = format_of(file).name == CSV.name
    except InputError:
        table = True
    found = columns_of_readings(file, options) if table else None
    if found is None:
        return None
    series, along, told = found
    return _checked(file, *_repeated(series), along, (*told, *_between_passes(series)))


_ALONG = 0.9
"""Component of a normal along an axis from which touches went along it."""


def _refuse_other_axis(file: SourceFile, axis: MachineAxis | None, normals: FloatArray) -> None:
    """Refuse an axis along which the touches of the file did not go."""
    if axis is not None and np.any(np.abs(normals[:, _AXES.index(axis)]) < _ALONG):
        shown = ", ".join(f"{part:.4g}" for part in normals[0])
        raise file.error(
            f"the touches went along their normal ({shown}), not along {axis}: leave the axis out",
            inputs=("axis",),
        )


def _one_coordinate(
    file: SourceFile, options: ReadingOptions, axis: MachineAxis | None
) -> RepeatLog | None:
    """A table with one of the three coordinates, in addition to a running number or differences."""
    table = read_touch_columns(file, replace(options, look_only=True)).table
    there = [axis for axis in _AXES if table.has(f"{axis}_mm")]
    if len(there) != 1:
        return None
    _refuse_other_axis(file, axis, np.eye(3)[[_AXES.index(there[0])]])
    found_columns = read_touch_columns(file, options)
    found = found_columns.table
    values, lines = found.numbers(f"{there[0]}_mm")[:, 0], np.array(found.lines)
    words = {name: found.columns[name] for name in WORD_COLUMNS if found.has(name)}
    conditions = {
        name: found.numbers(name)[:, 0] / unit
        for name, unit in (("feed_mm_min", 1.0), ("spindle_deg", DEGREE))
        if found.has(name)
    }
    stated = {**words, **_conditions(words, conditions)}
    keys = [" ".join(each) for each in zip(*stated.values(), strict=True)] or [""] * len(values)
    several = list(dict.fromkeys(keys))
    series = [
        LoggedSeries(key if len(several) > 1 else "", values[rows], lines[rows])
        for key in several
        if len(rows := np.flatnonzero([own == key for own in keys]))
    ]
    told = (*found_columns.notes, *_not_read(found.unread))
    return _checked(file, *_repeated(series), f"the axis {there[0]}", told)


def _not_read(titles: Sequence[str]) -> tuple[str, ...]:
    """A sentence that names columns."""
    return (f"columns that are not read: {', '.join(titles)}",) if titles else ()


_CONDITIONS = {"feed_mm_min": "{:g} mm/min", "spindle_deg": "spindle {:g}°"}
"""Numbers on which a touch depends, and how a series is named by them."""
_ONE_CONDITION = 0.01
"""Share of the largest by which a condition varies where it is one."""


def _conditions(
    words: Mapping[str, Sequence[str]], conditions: Mapping[str, FloatArray | None]
) -> dict[str, list[str]]:
    """Feed and orientation of the spindle of each touch in words, where they change.

    A pass says already what the feeds of fast and slow touches say.
    """
    found = {}
    for name, values in conditions.items():
        if values is None or (name == "feed_mm_min" and "pass" in words):
            continue
        order = np.sort(values)
        apart = np.diff(order) > _ONE_CONDITION * float(np.abs(values).max())
        if apart.any():
            group = np.searchsorted(order[1:][apart], values, side="right")
            means = [float(np.median(values[group == k])) for k in range(int(group.max()) + 1)]
            found[name] = [_CONDITIONS[name].format(means[k]) for k in group]
    return found


def _conditions_of(rows: Touches | FilePositions) -> dict[str, list[str]]:
    turned = None if rows.spindle is None else rows.spindle / DEGREE
    return _conditions(rows.words, {"feed_mm_min": rows.feeds, "spindle_deg": turned})


def _of_touches(file: SourceFile, found: FileReadings, warnings: tuple[str, ...]) -> RepeatLog:
    """Series of touches: the same normal, and one place across it."""
    touches = found.touches
    along = np.sum(touches.positions * touches.normals, axis=1)
    stated = {**touches.words, **_conditions_of(touches), **_travel(touches.approaches)}
    groups = _groups(touches.labels, stated, touches.positions, touches.normals)
    lines = _lines(touches.lines, len(along))
    series = [LoggedSeries(name, along[rows], lines[rows]) for name, rows in groups]
    alike = np.ptp(touches.normals, axis=0).max() == 0.0
    normal = ", ".join(f"{part:.4g}" for part in touches.normals[0])
    words = f"the normal {normal}" if alike else "the normal of each touch"
    return _checked(file, *_repeated(series), words, (*warnings, *_between_passes(series)))


def _of_positions(
    file: SourceFile, found: FilePositions, axis: MachineAxis | None, warnings: tuple[str, ...]
) -> RepeatLog:
    """Series of positions: one place each, along the axis in which its touches differ."""
    if found.contact is not None and not any(found.contact):
        raise file.error("none of the touches made contact")
    missed = found.misses()
    if missed:
        warnings = (*warnings, *missed_sentence(missed))
    kept = contacts(found)
    positions, lines = kept.positions, np.array(kept.lines)
    stated = {**kept.words, **_conditions_of(kept), **_travel(kept.approaches)}
    groups = _groups(kept.labels, stated, positions, None)
    series: list[LoggedSeries] = []
    axes: dict[str, None] = {}
    for name, rows in groups:
        used = _axis_of(file, positions[rows], lines[rows], axis)
        if len(rows) >= FEWEST_REPEATS:
            axes[used] = None
        series.append(LoggedSeries(name, positions[rows, _AXES.index(used)], lines[rows]))
    one = len(axes) == 1
    words = f"the axis {next(iter(axes))}" if one else "the axis in which each place differs"
    told = (*warnings, *kept.warnings, *_between_passes(series))
    return _checked(file, *_repeated(series), words, told)


def _axis_of(
    file: SourceFile, positions: FloatArray, lines: IntArray, stated: MachineAxis | None
) -> MachineAxis:
    """The axis along which the touches of one place differ, or the stated one if they can."""
    scatter = np.std(positions, axis=0)
    order = np.argsort(-scatter, kind="stable")
    if stated is not None:
        if np.ptp(positions[:, _AXES.index(stated)]) == 0.0 < np.ptp(positions[:, order[0]]):
            raise file.error(
                f"the positions differ along {_AXES[order[0]]}, and not along {stated}: leave the "
                "axis out, or give the one along which the touches went",
                int(lines[0]),
                inputs=("axis",),
            )
        return stated
    if not scatter.any():  # equal to the last digit
        return "z"
    if len(positions) >= FEWEST_REPEATS and scatter[order[1]] > _ALIKE * scatter[order[0]]:
        raise file.error(
            f"the positions differ along {_AXES[order[0]]} and {_AXES[order[1]]}: give the axis "
            "along which the touches went",
            int(lines[0]),
            inputs=("axis",),
        )
    return _AXES[int(order[0])]


def _groups(
    labels: Sequence[str] | None,
    words: Mapping[str, Sequence[str]],
    positions: FloatArray,
    normals: FloatArray | None,
) -> list[tuple[str, IntArray]]:
    """Rows of each series: by the label before a slash, the words, the normal and the place."""
    groups: list[_Group] = []
    keys = [
        (_series_name(labels, row), *(each[row] for each in words.values()))
        for row in range(len(positions))
    ]
    for row, place in enumerate(positions):
        normal = None if normals is None else normals[row]
        for group in groups:
            if group.key == keys[row] and group.has(place, normal, _ALONG):
                group.rows.append(row)
                break
        else:
            groups.append(_Group(keys[row], place, normal, [row]))
    long = [group for group in groups if len(group.rows) >= FEWEST_REPEATS]
    for group in groups:  # a gross touch of a place
        owner = next((g for g in long if g is not group and group.key == g.key
                      and len(group.rows) == 1 and g.has(group.place, group.normal, _FAR_ALONG,
                                                         positions[g.rows])), None)  # fmt: skip
        if owner is not None:
            owner.rows.append(group.rows.pop())
    kept = [group for group in groups if group.rows]
    names = [" ".join(filter(None, group.key)) for group in kept]
    return [
        (
            name if name and names.count(name) == 1 else _place_name(name, number, group),
            np.array(sorted(group.rows)),
        )
        for number, (name, group) in enumerate(zip(names, kept, strict=True), start=1)
    ]


def _travel(approaches: FloatArray | None) -> dict[str, list[str]]:
    """The direction of travel of each touch in words, where a file states more than one."""
    if approaches is None:
        return {}
    ways: list[FloatArray] = []
    found = []
    for travel in approaches:
        near = (i for i, way in enumerate(ways) if float(travel @ way) > _ONE_WAY)
        found.append(next(near, len(ways)))
        if found[-1] == len(ways):
            ways.append(travel)
    if len(ways) < 2:
        return {}
    names = []
    for way in ways:
        axis = int(np.argmax(np.abs(way)))
        sign = "+" if way[axis] > 0.0 else "-"
        straight = abs(way[axis]) > _ONE_WAY
        parts = ", ".join(f"{part:.3g}" for part in way)
        names.append(f"towards {sign}{_AXES[axis]}" if straight else f"towards ({parts})")
    return {"travel": [names[i] for i in found]}


def _series_name(labels: Sequence[str] | None, row: int) -> str:
    stated = SERIES_OF_LABEL.fullmatch(labels[row]) if labels else None
    return stated[1] if stated else ""


def _place_name(name: str, number: int, group: _Group) -> str:
    x, y, z = (f"{value:.6g}" for value in np.round(group.place, 2) + 0.0)
    return f"{name} place {number} ({x}, {y}, {z})".strip()


@dataclass
class _Group:
    """Rows of one place."""

    key: tuple[str, ...]
    place: FloatArray
    normal: FloatArray | None
    rows: list[int]

    def has(
        self,
        place: FloatArray,
        normal: FloatArray | None,
        reach: float,
        own: FloatArray | None = None,
    ) -> bool:
        """Whether another touch is of this place: near across its direction, and along it."""
        away = place - self.place
        if self.normal is not None and normal is not None:
            if float(np.abs(normal - self.normal).max()) >= _ONE_PLACE:
                return False
            along = float(away @ self.normal)
            across = away - along * self.normal
            return abs(along) < reach and float(np.abs(across).max()) < _ONE_PLACE
        order = np.argsort(-np.abs(away))
        if own is not None:  # the axis is known
            order = np.argsort(-np.std(own, axis=0), kind="stable")
        return bool(abs(away[order[0]]) < reach and np.abs(away[order[1:]]).max() < _ONE_PLACE)


def _between_passes(series: Sequence[LoggedSeries]) -> tuple[str, ...]:
    """How far the touches of two passes are apart, at the places that both touched."""
    told = []
    for first, second in (("fast", "slow"), ("first", "second")):
        of = {word: [one for one in series if word in one.name.split()] for word in (first, second)}
        if not (of[first] and of[second]):
            continue
        steps = [
            float(np.median(b.values) - np.median(a.values))
            for a, b in zip(of[first], of[second], strict=False)
        ]
        step = float(np.median(steps)) / MICROMETRE
        told.append(
            f"each place was touched twice: the {second} touches lie {abs(step):.0f} µm from the "
            f"{first} ones ({step:+.0f} µm), which is feed × delay; they are evaluated separately"
        )
    return tuple(told)


def _in_a_rhythm(series: Sequence[LoggedSeries]) -> tuple[list[LoggedSeries], tuple[str, ...]]:
    """Series, and words about those in which one of every few touches is apart: a fast one.

    Where these all lie on one side of the others, they are a series of their own.
    """
    told, parts = [], []
    for one in series:
        found = [
            (_chance(one.values, period, phase), period, phase)
            for period in _PERIODS
            if len(one.values) >= 3 * period
            for phase in range(period)
        ]
        if not found or min(found)[0] * len(found) >= _RARE:
            parts.append(one)
            continue
        _, period, phase = min(found)
        own = np.arange(len(one.values)) % period == phase
        size = float(np.mean(one.values[own]) - np.mean(one.values[~own])) / MICROMETRE
        lies = (
            f"{one.name or 'the touches'}: of every {period} touches number {phase + 1} lies "
            f"{abs(size):.1f} µm from the others, as a fast touch before slow ones does; they "
        )
        low, high = sorted([one.values[own], one.values[~own]], key=lambda part: part[0])
        if period > 2 and phase == 0 and low.max() < high.min():
            parts += [
                LoggedSeries(f"{one.name} {name}".strip(), one.values[rows], one.lines[rows])
                for name, rows in (("first", own), ("second", ~own))
                if rows.sum() >= FEWEST_REPEATS
            ]
            told.append(f"{lies}are evaluated separately")
        else:
            parts.append(one)
            how = "Leave the fast touches out, or give a column pass"
            told.append(f"{lies}are evaluated together. {how}")
    return parts, (*told, *_two_levels(parts, told))


def _two_levels(series: Sequence[LoggedSeries], told: Sequence[str]) -> list[str]:
    """Words about series whose touches lie at two levels in turn, in no rhythm that was named."""
    found = []
    for one in series:
        order = np.sort(one.values)
        place = int(np.argmax(np.diff(order))) + 1
        low, high = order[:place], order[place:]
        gap = float(high[0] - low[-1])
        turns = np.count_nonzero(np.diff(one.values > low[-1]))
        steps = np.diff(order)
        scatter = max(np.ptp(low), np.ptp(high), steps[steps > 0.0].min(initial=gap))
        named = any(sentence.startswith(one.name or "the touches") for sentence in told)
        if min(len(low), len(high)) < 2 or turns < _TURNS or gap < _APART * scatter or named:
            continue
        found.append(
            f"{one.name or 'the touches'}: {len(low)} and {len(high)} touches lie at two levels, "
            f"{gap / MICROMETRE:.1f} µm apart, in turn: fast and slow ones, two places, or a probe "
            "that seats in two ways? They are evaluated together. If they are not of one kind, "
            "give a column that names their kind"
        )
    return found


def _chance(values: FloatArray, period: int, phase: int) -> float:
    """Probability of such a difference of one of every few touches, by Student's t."""
    from scipy.special import stdtr

    mine, others = values[phase::period], np.delete(values, np.s_[phase::period])
    free = len(values) - 2
    variance = (np.sum((mine - mine.mean()) ** 2) + np.sum((others - others.mean()) ** 2)) / free
    u = np.sqrt(max(variance, 1e-18) * (1.0 / len(mine) + 1.0 / len(others)))
    return 2.0 * float(stdtr(free, -abs(mine.mean() - others.mean()) / u))


def _repeated(series: list[LoggedSeries]) -> tuple[list[LoggedSeries], int]:
    """The series that are long enough, and the touches of the others."""
    enough = [one for one in series if len(one.values) >= FEWEST_REPEATS]
    return enough, sum(len(one.values) for one in series) - sum(len(one.values) for one in enough)


def _lines(lines: Sequence[int] | None, count: int) -> IntArray:
    return np.arange(1, count + 1) if lines is None else np.array(lines)


def _checked(
    file: SourceFile,
    series: list[LoggedSeries],
    single: int,
    along: str,
    warnings: tuple[str, ...],
) -> RepeatLog:
    kept = [without_filled_in(one.values) for one in series]
    lost = [str(n) for one, own in zip(series, kept, strict=True) for n in one.lines[~own]]
    if lost:
        warnings = (*warnings, f"no reading, and left out: line {', '.join(lost)}")
        series = [
            replace(one, values=one.values[own], lines=one.lines[own])
            for one, own in zip(series, kept, strict=True)
        ]
    most = max((len(one.values) for one in series), default=0)
    if most < FEWEST_REPEATS:
        raise file.error(
            f"no point was touched {FEWEST_REPEATS} times or more, one touch after the other: in a "
            "mesh of heights each point is touched once, which does not show how a touch repeats. "
            "Touch one point ten times (Klipper PROBE_ACCURACY SAMPLES=10, Marlin M48 P10 V4)"
        )
    values = np.concatenate([one.values for one in series])
    lines = np.concatenate([one.lines for one in series])
    order = np.argsort(lines, kind="stable")
    copied = copied_rows_warnings(
        values[order][:, None], lambda row: f"line {int(lines[order[row]])}"
    ) + rows_in_a_row_warnings(values[order][:, None])
    parts, rhythm = _in_a_rhythm(series)
    single += sum(len(one.values) for one in series) - sum(len(one.values) for one in parts)
    return RepeatLog(tuple(parts), single, along, (*warnings, *rhythm, *copied))
