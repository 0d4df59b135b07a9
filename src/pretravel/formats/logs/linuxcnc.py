"""Logs of LinuxCNC: those of our own programs, those of PROBEOPEN, and positions from LOG lines."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.controls.log_format import (
    LOG_HEAD,
    SUBROUTINE_TOUCH_COLUMNS,
    SURFACE_POINT_COLUMNS,
    TOUCH_COLUMNS,
)
from pretravel.errors import InputError, PretravelError
from pretravel.formats.logs.joining import FileReadings, Rows, file_lines, finite, scale_of
from pretravel.touches import Touches
from pretravel.units import DEGREE, MICROMETRE

_PROBEOPEN_COLUMNS = 9
_ROTARY = slice(3, 6)
_SCALES = {"um": MICROMETRE, "millionths": 1e-6}
_MOVED = 1e-4  # rotary axes that differ by more were moved. [deg]


def read_own_log(path: str | Path) -> FileReadings:
    r"""The log of a program written by pretravel.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    FileReadings
        In work coordinates; those that touched. Surface points, where the control worked
        them out.

    Raises
    ------
    InputError
        Lines that are cut off, a second run in the same file, a label that comes twice, numbers
        that are none: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "one.log"
    >>> _ = file.write_text(
    ...     "pretravel-log,1,one,1,end\nwork,G54,0.0,end\ncolumns," + ",".join(TOUCH_COLUMNS)
    ...     + ",end\ntouch,top,0,0,2990.0,0,0,1,0,0,-1,50,0,0,0,1.0,end\ndone,1,end\n")
    >>> read_own_log(file).touches.positions.tolist()
    [[0.0, 0.0, 2.99]]
    """
    lines = file_lines(path, "a log of a probing program")
    rotation, told = 0.0, 0
    labels: list[str] = []
    missed: list[str] = []
    rows: list[list[float]] = []
    numbers: list[int] = []
    points: dict[str, FloatArray] = {}
    columns = TOUCH_COLUMNS
    seen: set[str] = set()
    begun = finished = worked = False
    for number, text in enumerate(lines, start=1):
        line = text.strip()
        if not line:
            continue
        cells = [cell.strip() for cell in line.split(",")]
        if cells[-1] != "end":
            raise InputError(
                f"this line is cut off ('…{line[-20:]}' does not end in ',end'): the program was "
                "stopped, or the disk was full. Run it again, or delete the line to use what "
                "came before it",
                path=path,
                line=number,
            )
        kind, values = cells[0], cells[1:-1]
        seen.add(kind)
        if kind in ("touch", "point") and not {"work", "columns"} <= seen and begun:
            raise InputError(
                "the lines 'work' and 'columns' must come before the first touch: without them "
                "neither the turn of the work coordinates nor the units are known",
                path=path,
                line=number,
            )
        if kind == LOG_HEAD:
            if begun:
                raise InputError(
                    "a second run begins here; keep the runs in files of their own",
                    path=path,
                    line=number,
                )
            if values[:1] != ["1"] or len(values) != 3:
                raise InputError(
                    f"a log of another version ('{line[:40]}'); this pretravel reads version 1",
                    path=path,
                    line=number,
                )
            begun = True
            told = int(finite(values[-1:], path, number)[0])
        elif not begun:
            raise InputError(
                f"not the log of a program of pretravel: its first line must begin with {LOG_HEAD}",
                path=path,
                line=number,
            )
        elif kind == "work":
            if len(values) != 2 or worked:
                raise InputError(
                    "one line 'work' with offset and turn is needed", path=path, line=number
                )
            worked = True
            rotation = finite(values[1:2], path, number)[0] * DEGREE
        elif kind == "columns":
            columns = tuple(values)
            if columns not in (TOUCH_COLUMNS, SUBROUTINE_TOUCH_COLUMNS):
                raise InputError(
                    f"columns {', '.join(values)} are not those that this version knows "
                    f"({', '.join(TOUCH_COLUMNS)})",
                    path=path,
                    line=number,
                )
        elif kind == "touch":
            if len(values) != len(TOUCH_COLUMNS):
                raise InputError(
                    f"{len(values)} values, {len(TOUCH_COLUMNS)} are needed", path=path, line=number
                )
            if values[0] in labels or values[0] in missed:
                raise InputError(f"the touch {values[0]} is there twice", path=path, line=number)
            found = finite(values[1:], path, number)
            if round(found[-1]) == 0:
                missed.append(values[0])
            else:
                labels.append(values[0])
                rows.append(found)
                numbers.append(number)
        elif kind == "point":
            if len(values) != len(SURFACE_POINT_COLUMNS):
                raise InputError(
                    f"{len(values)} values, {len(SURFACE_POINT_COLUMNS)} are needed",
                    path=path,
                    line=number,
                )
            points[values[0]] = MICROMETRE * np.array(finite(values[1:4], path, number))
        elif kind == "done":
            finished = True
        elif kind != "point-columns":
            raise InputError(f"'{kind}' is not a line of such a log", path=path, line=number)
    if not rows:
        raise InputError(
            "no touch in it" + (f"; {len(missed)} were missed" if missed else ""), path=path
        )
    scales = [_SCALES.get(name.rpartition("_")[2], 1.0) for name in columns[1:]]
    table = np.array(rows) * np.array(scales)
    warnings = []
    there = len(rows) + len(missed)
    if finished and there != told:
        warnings.append(
            f"lines have been lost: {there} of its {told} touches are in the log, though the "
            "program ran to its end"
        )
    if not finished and told:  # a program of one's own tells no number, and no end
        warnings.append(
            f"the program did not run to its end: {there} of its {told} touches are in the log"
        )
    try:
        touches = Touches(
            positions=table[:, 0:3],
            normals=table[:, 3:6],
            approaches=table[:, 6:9],
            feeds=table[:, 9],
            labels=tuple(labels),
            nominal_points=table[:, 10:13],
            source=Path(path).name,
            lines=tuple(numbers),
        )
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    return FileReadings(touches, tuple(missed), rotation, tuple(warnings), points)


def read_probeopen(path: str | Path, units: str | None = None) -> Rows:
    r"""Rows of a file that ``(PROBEOPEN …)`` wrote.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch: those of the program that ran (G21, G20), which the file does not tell.

    Returns
    -------
    Rows
        Work coordinates. Which rows are misses the file does not tell either.

    Raises
    ------
    InputError
        Units not told; lines without nine numbers, such as a last one cut off; rotary
        axes that moved: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "probe.txt"
    >>> _ = file.write_text("1.0 2.0 3.0 0.0 0.0 0.0 0.0 0.0 0.0\n")
    >>> read_probeopen(file, "inch").positions.round(6).tolist()
    [[25.4, 50.8, 76.2]]
    """
    lines = file_lines(path, "a file of PROBEOPEN")
    scale = scale_of(
        units, path, "a file of PROBEOPEN is in the units of the program that ran, and does not say"
    )
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, text in enumerate(lines, start=1):
        cells = text.split()
        if not cells:
            continue
        if len(cells) != _PROBEOPEN_COLUMNS:
            last = number >= len(lines) - 1
            hint = (
                "; the last line is cut off: delete it, or run the program again"
                if last
                else f" ('{text.strip()[:40]}')"
            )
            raise InputError(
                f"{len(cells)} values where PROBEOPEN writes {_PROBEOPEN_COLUMNS}{hint}",
                path=path,
                line=number,
            )
        row = finite(cells, path, number)
        if last_is_cut(text, lines, number):
            raise InputError(
                f"the last number, '{cells[-1]}', is cut off: PROBEOPEN writes six decimals. "
                "Delete the line, or run the program again",
                path=path,
                line=number,
            )
        if rows and max(abs(a - b) for a, b in zip(rows[0][_ROTARY], row[_ROTARY], strict=True)) > (
            _MOVED
        ):
            raise InputError(
                "a rotary axis (columns 4 to 6) has moved since the first row; positions at "
                "different rotary angles cannot be joined with one plan",
                path=path,
                line=number,
            )
        rows.append(row)
        numbers.append(number)
    return Rows(str(path), scale * np.array(rows)[:, :3], tuple(numbers))


def last_is_cut(text: str, lines: list[str], number: int) -> bool:
    """Whether a line is the file's last, has no line end, and its last number too few decimals."""
    if number != len(lines):
        return False
    return len(text.rstrip().rpartition(".")[2]) < 6


_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))(?![\d.,eE])", re.IGNORECASE)


def read_log_positions(path: str | Path, units: str | None = None) -> Rows:
    r"""Positions from lines such as ``G1 X1.0 Y2.0 Z3.0``, as people write them with LOG.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch; the file may tell by G20 or G21 itself.

    Returns
    -------
    Rows

    Raises
    ------
    InputError
        Units not told; lines without X, Y and Z: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "a.txt"
    >>> _ = file.write_text("G21\nG1 X1.0 Y2.0 Z3.0\n")
    >>> read_log_positions(file).positions.tolist()
    [[1.0, 2.0, 3.0]]
    """
    lines = file_lines(path, "a log of positions")
    rows, numbers = [], []
    for number, text in enumerate(lines, start=1):
        line = re.sub(r"\(.*?\)", "", text).strip()
        if not line or line.startswith((";", "%")):
            continue
        unit_word = re.search(r"\bG2([01])\b", line, re.IGNORECASE)
        if unit_word:
            told = "inch" if unit_word[1] == "0" else "mm"
            if units is not None and units != told:
                raise InputError(
                    f"the file says {told} (G2{unit_word[1]}), --units says {units}",
                    path=path,
                    line=number,
                )
            units = told
        if re.search(r"\bG91\b", line, re.IGNORECASE):
            raise InputError(
                "G91: positions that are differences are not read", path=path, line=number
            )
        left = _WORD.sub("", line).strip()
        pairs = [(name.upper(), value) for name, value in _WORD.findall(line)]
        words = {name: value for name, value in pairs if name in "XYZ"}
        if left:
            raise InputError(
                f"'{line[:40]}' is no position; G1 X… Y… Z… is needed"
                + ("; use points as decimal signs" if "," in left else ""),
                path=path,
                line=number,
            )
        if len(words) < sum(name in "XYZ" for name, _ in pairs):
            raise InputError("a coordinate is there twice", path=path, line=number)
        if not words:
            continue
        if len(words) < 3:
            raise InputError(
                f"'{line[:40]}' has no {' and no '.join(sorted(set('XYZ') - set(words)))}",
                path=path,
                line=number,
            )
        rows.append([float(words[axis]) for axis in "XYZ"])
        numbers.append(number)
    scale = scale_of(units, path, "the file does not say its units (G20 or G21)")
    if not rows:
        raise InputError("no position in it", path=path)
    return Rows(str(path), scale * np.array(rows), tuple(numbers))
