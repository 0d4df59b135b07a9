"""Series of touches of one point, from any file of touches, positions or heights."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.files.column_names import LENGTH_UNITS, unit_of
from pretravel.files.file_format import FilePositions, FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.preview import look_at
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.files.table_formats import CSV, PARQUET
from pretravel.qualification import FEWEST_REPEATS

MachineAxis: TypeAlias = Literal["x", "y", "z"]
_AXES: tuple[MachineAxis, ...] = ("x", "y", "z")
_ONE_PLACE = 0.1
"""Touches are of one point if their places differ by less than this across their direction. [mm]"""
_ALIKE = 0.5
"""Another axis that scatters by more than this share of the first leaves the direction open."""
_SERIES_OF_LABEL = re.compile(r"(.+)/\d+")
_ONCE = (
    "PROBEOPEN does not write a touch whose position is equal to the one before: such touches are "
    "missing, and the noise looks larger than it is. Log with LOG instead"
)
_COMMENT = ("#", "%", ";", "//")


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
    source: Source, options: ReadingOptions = ReadingOptions(), axis: MachineAxis | None = None
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

    Returns
    -------
    RepeatLog

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
    if (heights := _column_of_heights(file, options)) is not None:
        return _checked(file, [heights], 0, "the column of heights", ())
    stated = (PARQUET if file.ending == ".parquet" else CSV) if options.columns else None
    known = stated or format_of(file)
    origin = options.offset or (0.0, 0.0, 0.0)
    looking = replace(options, offset=origin, look_only=True, plan=None)
    found, unit_known = look_at(file, looking, known)
    if not unit_known:
        raise file.error("the table states no unit; give the units, mm or inch", inputs=("units",))
    warnings = (_ONCE,) if known.name == "probeopen" else ()
    if isinstance(found, FilePositions):
        return _of_positions(file, found, axis, warnings)
    return _of_touches(file, found, (*warnings, *found.notes()))


def _column_of_heights(file: SourceFile, options: ReadingOptions) -> LoggedSeries | None:
    """A text of one number in each line, with a title above it or none; None: another file."""
    if file.content.startswith((b"PAR1", b"\x89HDF", b"CDF")):
        return None
    lines = [
        (number, line.strip())
        for number, line in enumerate(file.lines("a file of readings"), start=1)
        if line.strip() and not line.strip().startswith(_COMMENT)
    ]
    title = lines[0][1] if lines and not _is_number(lines[0][1]) else ""
    rows = lines[1:] if title else lines
    if not rows or not all(_is_number(line) for _, line in rows):
        return None
    words = re.split(r"[\s_/,;:()\[\]]+", title)
    units = [LENGTH_UNITS[unit] for word in words if (unit := unit_of(word) or "") in LENGTH_UNITS]
    if len(units) > 1:
        raise file.error(f"the title '{title[:40]}' states more than one unit", lines[0][0])
    scale = units[0] if units else file.scale(options.units, "the heights have no unit")
    values = [file.numbers([line], number)[0] for number, line in rows]
    return LoggedSeries("", scale * np.array(values), np.array([number for number, _ in rows]))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _of_touches(file: SourceFile, found: FileReadings, warnings: tuple[str, ...]) -> RepeatLog:
    """Series of touches: the same normal, and one place across it."""
    touches = found.touches
    along = np.sum(touches.positions * touches.normals, axis=1)
    across = touches.positions - along[:, None] * touches.normals
    places = np.concatenate([across, touches.normals], axis=1)
    groups = _groups(touches.labels, places)
    lines = _lines(touches.lines, len(along))
    series = [LoggedSeries(name, along[rows], lines[rows]) for name, rows in groups]
    alike = np.ptp(touches.normals, axis=0).max() == 0.0
    normal = ", ".join(f"{part:.4g}" for part in touches.normals[0])
    words = f"the normal {normal}" if alike else "the normal of each touch"
    return _checked(file, *_repeated(series), words, warnings)


def _of_positions(
    file: SourceFile, found: FilePositions, axis: MachineAxis | None, warnings: tuple[str, ...]
) -> RepeatLog:
    """Series of positions: one place across the axis."""
    touched = np.ones(len(found.positions), dtype=np.bool_)
    if found.contact is not None:
        touched = np.array(found.contact, dtype=np.bool_)
    missed = int(np.sum(~touched))
    if missed:
        warnings = (*warnings, f"{missed} touches without contact are left out")
    positions = found.positions[touched]
    labels = None
    if found.labels is not None:
        labels = tuple(name for name, on in zip(found.labels, touched, strict=True) if on)
    if not len(positions):
        raise file.error("none of the touches made contact")
    used = axis or _axis_of(file, positions, labels)
    place = _AXES.index(used)
    across = np.delete(positions, place, axis=1)
    lines = np.array(found.lines)[touched]
    groups = _groups(labels, across)
    series = [LoggedSeries(name, positions[rows, place], lines[rows]) for name, rows in groups]
    return _checked(file, *_repeated(series), f"the axis {used}", warnings)


def _axis_of(
    file: SourceFile, positions: FloatArray, labels: tuple[str, ...] | None
) -> MachineAxis:
    """The axis along which the touches of one place differ."""
    scores = []
    for place in range(3):
        across = np.delete(positions, place, axis=1)
        rows = [rows for _, rows in _groups(labels, across) if len(rows) >= FEWEST_REPEATS]
        scatter = [float(np.std(positions[own, place])) for own in rows]
        scores.append((sum(map(len, rows)), max(scatter, default=0.0)))
    order = sorted(range(3), key=lambda place: scores[place], reverse=True)
    best, next_best = scores[order[0]], scores[order[1]]
    if best[0] == next_best[0] > 0 and next_best[1] > _ALIKE * best[1]:
        raise file.error(
            f"the positions differ along {_AXES[order[0]]} and {_AXES[order[1]]}: give the axis "
            "along which the touches went",
            inputs=("axis",),
        )
    return _AXES[order[0]]


def _groups(labels: Sequence[str] | None, places: FloatArray) -> list[tuple[str, IntArray]]:
    """Rows of each series, by the part of the label before a slash and by the place."""
    groups: list[tuple[str, FloatArray, list[int]]] = []
    for row, place in enumerate(places):
        stated = _SERIES_OF_LABEL.fullmatch(labels[row]) if labels else None
        name = stated[1] if stated else ""
        for own, center, rows in groups:
            if own == name and float(np.abs(place - center).max()) < _ONE_PLACE:
                rows.append(row)
                break
        else:
            groups.append((name, place, [row]))
    names = [name for name, _, _ in groups]
    return [
        (
            name if name and names.count(name) == 1 else f"{name} place {number}".strip(),
            np.array(rows),
        )
        for number, (name, _, rows) in enumerate(groups, start=1)
    ]


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
    most = max((len(one.values) for one in series), default=0)
    if most < FEWEST_REPEATS:
        raise file.error(
            f"no point was touched {FEWEST_REPEATS} times or more, one touch after the other: in a "
            "mesh of heights each point is touched once, and says nothing of how a touch repeats. "
            "Touch one point ten times (Klipper PROBE_ACCURACY SAMPLES=10, Marlin M48 P10 V4)"
        )
    return RepeatLog(tuple(series), single, along, warnings)
