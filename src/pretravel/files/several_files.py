"""Touches of several files as one series: a list of files, a folder, a name with wildcards."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import FloatArray, InputError, PretravelError
from pretravel.files.file_dates import moment_of_touches
from pretravel.files.file_format import FileReadings, ReadingOptions
from pretravel.files.format_registry import FORMATS
from pretravel.files.readings import read_readings
from pretravel.files.source_file import first_few
from pretravel.files.times_of_rows import several_days
from pretravel.touches import (
    WORD_COLUMNS,
    Touches,
    certain_copies,
    copied_rows_warnings,
    rows_in_a_row_warnings,
)

_TABLES = (".csv", ".tsv", ".txt", ".xyz", ".asc", ".dat", ".log")
"""Endings of text files that can have touches, in addition to those of the formats."""
_NO_TOUCHES = (".nc", ".json")
_SHOWN = 10
"""Most names of files that a sentence shows."""


def files_of(places: Sequence[Path | str]) -> list[Path]:
    """Return the files of touches that are meant; see `files_meant`.

    Parameters
    ----------
    places : sequence of Path or str

    Raises
    ------
    InputError
        As `files_meant`.

    >>> files_of(["touches.csv"])
    [PosixPath('touches.csv')]
    """
    return files_meant(places, _can_have_touches, "touches (.csv, .txt, .xyz, .asc, .parquet …)")


def _can_have_touches(path: Path) -> bool:
    endings = {e for known in FORMATS.values() if known.parse for e in known.endings}
    return (
        path.is_file()
        and not path.name.startswith(".")
        and path.name.lower().endswith(tuple(endings.union(_TABLES).difference(_NO_TOUCHES)))
    )


_LAST_NUMBER = re.compile(r"(\d{1,3})\D*$")


def _refuse_exchanged(paths: Sequence[Path], spindle: Sequence[float]) -> None:
    """Refuse orientations [rad] of which the names of the files have the same in another order."""
    found = [_LAST_NUMBER.search(path.stem) for path in paths]
    named = [int(each[1]) for each in found if each is not None]
    given = [round(math.degrees(angle), 6) for angle in spindle]
    if named == given or sorted(named) != sorted(given):
        return
    path, angle = next((p, a) for p, n, a in zip(paths, named, given, strict=True) if n != a)
    raise PretravelError(
        f"{path.name} is given the orientation {angle:g}°, and the names of the files have the "
        "same angles in another order: give the files and their orientations in one order",
        inputs=("spindle",),
    )


def read_series(
    paths: Sequence[Path],
    options: ReadingOptions | None = None,
    *,
    file_format: str | None = None,
    spindle: Sequence[float] | None = None,
) -> FileReadings:
    """Read the touches of files one after the other, as one series.

    Parameters
    ----------
    paths : sequence of Path
    options : ReadingOptions, optional
        For every file. A touch is excluded by its label in the series, or as ``name.csv:17``.
    file_format : str, optional
        Of every file.
    spindle : sequence of float, optional
        Orientation of the spindle in each file. [rad]

    Returns
    -------
    FileReadings
        In the machine's axes where there are several files. Labels that occur in several files
        have the name of their file before them.

    Raises
    ------
    InputError
        As `read_readings`; some files state feeds, nominal points or the spindle's orientation and
        others do not.
    """
    angles = [None] * len(paths) if spindle is None else list(spindle)
    if len(angles) != len(paths):
        raise PretravelError(
            f"{len(angles)} orientations of the spindle were given for {len(paths)} "
            f"file{'s' if len(paths) > 1 else ''}: each file has one",
            inputs=("spindle",),
        )
    if spindle is not None:
        _refuse_exchanged(paths, spindle)
    if len(paths) == 1:
        only = _at(read_readings(paths[0], options, file_format=file_format), angles[0])
        return _each_once(only, options)
    options = options or ReadingOptions()
    own = [tuple(n for n in options.exclude if _is_line_of(n, path)) for path in paths]
    found = [
        read_readings(path, replace(options, exclude=exclude), file_format=file_format)
        for path, exclude in zip(paths, own, strict=True)
    ]
    found = [
        _at(readings.in_machine_axes(), angle)
        for readings, angle in zip(found, angles, strict=True)
    ]
    _refuse_different(paths, [readings.frame for readings in found], "coordinates", ())
    tips = [f"{2.0 * r.tip_radius:.4g} mm" if r.tip_radius else "" for r in found]
    _refuse_different(paths, tips, "tip's diameter", ("tip_diameter",))
    touches = _one_series(paths, [readings.touches for readings in found])
    rest = [name for name in options.exclude if not any(name in names for names in own)]
    names = [path.name for path in paths]
    read = FileReadings(
        _without(touches, rest, names[0]),
        missed=tuple(
            f"{path.stem}.{label}"
            for path, readings in zip(paths, found, strict=True)
            for label in readings.missed
        ),
        warnings=tuple(
            f"{name}: {warning}"
            for name, readings in zip(names, found, strict=True)
            for warning in readings.warnings
        )
        + several_days([_day_of(path, r) for path, r in zip(paths, found, strict=True)]),
        tip_radius=found[0].tip_radius,
        unfinished="; ".join(
            f"{name}: {readings.unfinished}"
            for name, readings in zip(names, found, strict=True)
            if readings.unfinished
        ),
        normals_taken=any(readings.normals_taken for readings in found),
        digests=tuple(readings.touches.digest for readings in found),
    )
    return _each_once(read, options)


def _without(touches: Touches, labels: Sequence[str], file: str) -> Touches:
    """A series without the touches of some labels, which must be in it."""
    for name in labels:
        if name not in (touches.labels or ()):
            raise PretravelError(
                f"there is no touch with the label '{name}' in the series; a line is given with "
                f"its file: {file}:17",
                inputs=("exclude",),
            )
    kept = touches.without(labels)
    if not labels:
        return kept
    return replace(kept, reading=f"{kept.reading}; then excluded: {', '.join(labels)}")


def _day_of(path: Path, readings: FileReadings) -> datetime | None:
    return moment_of_touches(readings.touches.reading, path.name)


def _refuse_different(
    paths: Sequence[Path], stated: Sequence[str], what: str, inputs: tuple[str, ...]
) -> None:
    """Refuse files that state two values of what is one in a series; others state none."""
    there = [(path.name, value) for path, value in zip(paths, stated, strict=True) if value]
    for name, value in there[1:]:
        if value != there[0][1]:
            raise InputError(
                f"gives the {what} as {value}, and {there[0][0]} as {there[0][1]}, but "
                "all files of a series must have the same. Read them separately",
                path=name,
                inputs=inputs,
            )


def _each_once(readings: FileReadings, options: ReadingOptions | None) -> FileReadings:
    """The readings, of a reference without copies of others; elsewhere copies are named.

    On a part one touch can be of two features, with a label for each.
    """
    touches = readings.touches
    said = []
    if options is not None and options.reference_diameter is not None:
        copies = certain_copies(touches.positions)
        if copies.any():
            first = touches.where(int(np.flatnonzero(copies)[0]))
            said.append(
                f"{int(copies.sum())} of {len(touches)} rows, the first {first}, are copies of "
                "others to the last digit that is written: each reading is counted once. Was a log "
                "given or appended twice? A simulation without noise repeats so, too"
            )
            touches = touches.take(~copies)
    said += copied_rows_warnings(touches.positions, touches.where)
    said += rows_in_a_row_warnings(touches.positions)
    return replace(readings, touches=touches, warnings=(*readings.warnings, *said))


def _at(readings: FileReadings, angle: float | None) -> FileReadings:
    """The readings with the orientation of the spindle, where one is given."""
    if angle is None:
        return readings
    return replace(readings, touches=readings.touches.with_spindle(angle))


def _is_line_of(name: str, path: Path) -> bool:
    place, _, line = name.rpartition(":")
    return line.isdecimal() and place in (path.name, str(path))


def _one_series(paths: Sequence[Path], parts: Sequence[Touches]) -> Touches:
    names = [path.name for path in paths]
    listed = ", ".join(names[:_SHOWN]) + (f" … {names[-1]}" if len(names) > _SHOWN else "")
    each = sorted({part.reading for part in parts})
    same = each[0].partition("; ")[2] if len({r.partition("; ")[2] for r in each}) == 1 else ""
    reading = f"{sum(map(len, parts))} touches of {len(parts)} files in this order: {listed}"
    stated = [(name, part.reading) for name, part in zip(names, parts, strict=True) if part.reading]
    details = [same] if same else [f"{name}: {how}" for name, how in stated]
    return Touches(
        positions=np.vstack([part.positions for part in parts]),
        normals=np.vstack([part.normals for part in parts]),
        approaches=np.vstack([part.approach_directions for part in parts]),
        feeds=_joined_values(paths, [part.feeds for part in parts], "feeds"),
        spindle=_joined_values(paths, [part.spindle for part in parts], "spindle's orientation"),
        labels=_unique_labels(paths, parts),
        **_joined_words(paths, parts),
        nominal_points=_joined_values(paths, [p.nominal_points for p in parts], "nominal points"),
        source=f"{names[0]} … {names[-1]} ({len(names)} files)",
        reading="; ".join([reading, *details]),
    )


def _joined_values(
    paths: Sequence[Path], values: Sequence[FloatArray | None], what: str
) -> FloatArray | None:
    stated = [value for value in values if value is not None]
    if not stated:
        return None
    if len(stated) < len(values):
        there = next(p for p, value in zip(paths, values, strict=True) if value is not None)
        absent = next(p for p, value in zip(paths, values, strict=True) if value is None)
        raise InputError(f"has no {what}, but {there.name} does", path=absent)
    return np.concatenate(stated)


def _joined_words(paths: Sequence[Path], parts: Sequence[Touches]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, attribute in WORD_COLUMNS.items():
        words = [getattr(part, attribute) for part in parts]
        arrays = [None if each is None else np.array(each) for each in words]
        joined = _joined_values(paths, arrays, name)
        if joined is not None:
            found[attribute] = tuple(map(str, joined))
    return found


def _unique_labels(paths: Sequence[Path], parts: Sequence[Touches]) -> tuple[str, ...]:
    """The labels, with the name of the file before them where they are not unique without it."""
    own = [part.labels or tuple(str(i + 1) for i in range(len(part))) for part in parts]
    flat = [label for labels in own for label in labels]
    if len(set(flat)) == len(flat) and all(part.labels for part in parts):
        return tuple(flat)
    stems = [path.stem for path in paths]
    if len(set(stems)) < len(stems):
        stems = [f"{i + 1}.{stem}" for i, stem in enumerate(stems)]
    return tuple(
        f"{stem}.{label}" for stem, labels in zip(stems, own, strict=True) for label in labels
    )


_LISTED = 6
"""Most names of files that a message shows."""


def files_meant(
    places: Sequence[Path | str], in_folder: Callable[[Path], bool], what: str
) -> list[Path]:
    """Return the files that are meant: a folder is its files, a name with * those that match.

    Shells expand wildcards where they are not quoted, but not on Windows.

    Parameters
    ----------
    places : sequence of Path or str
    in_folder : callable
        Whether a file of a folder is meant.
    what : str
        What these files contain, for messages.

    Returns
    -------
    list of Path
        In the order that is given; within a folder or a wildcard by name, where 2 comes before 10.

    Raises
    ------
    InputError
        Nothing matches; a file is named twice.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> for name in ("a10.csv", "a2.csv", "note.md"):
    ...     (folder / name).touch()
    >>> [p.name for p in files_meant([folder], lambda path: path.suffix == ".csv", "tables")]
    ['a2.csv', 'a10.csv']
    """
    found: list[Path] = []
    for place in map(Path, places):
        if place.is_dir():
            inside = [p for p in _in_order(place.iterdir()) if p.is_file() and in_folder(p)]
            if not inside:
                raise InputError(f"the folder has no file of {what}; {_it_has(place)}", path=place)
            found += inside
        elif re.search(r"[*?\[]", str(place)) and not place.exists():
            matching = [p for p in _in_order(_matching(place)) if p.is_file()]
            if not matching:
                raise InputError(
                    f"no file has a name like this; {_it_has(place.parent)}", path=place
                )
            found += matching
        else:
            found.append(place)
    resolved = [path.resolve() for path in found]
    if len(set(resolved)) < len(resolved):
        twice = Counter(resolved).most_common(1)[0][0]
        raise InputError("this file is given twice", path=found[resolved.index(twice)])
    return found


def _it_has(folder: Path) -> str:
    """What is in a folder, as the end of a message."""
    if not folder.is_dir():
        return f"the folder {folder} does not exist"
    names = (path.name for path in _in_order(folder.iterdir()) if path.is_file())
    return f"{folder.resolve()} has {first_few(names, _LISTED) or 'no files'}"


def _matching(pattern: Path) -> list[Path]:
    inside = str(pattern.relative_to(pattern.anchor)) if pattern.anchor else str(pattern)
    hidden = pattern.name.startswith(".")  # as shells do
    try:
        found = list(Path(pattern.anchor or ".").glob(inside))
    except ValueError as error:
        raise InputError(f"not a name with wildcards: {error}", path=pattern) from None
    return [path for path in found if hidden or not path.name.startswith(".")]


def _in_order(paths: Iterable[Path]) -> list[Path]:
    """Sorted by name, with numbers by their value."""

    def key(path: Path) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", str(path))
        return [(0, int(part), "") if part.isdecimal() else (1, 0, part.lower()) for part in parts]

    return sorted(paths, key=key)
