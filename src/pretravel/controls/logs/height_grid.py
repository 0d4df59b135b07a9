"""Heights of a grid as bCNC writes them (.probe): three lines of limits, then x, y, z; reading."""

from __future__ import annotations

import numpy as np

from pretravel.files import FileFormat, FileReadings, Source, opened
from pretravel.touches import Touches

_HEAD = 3
"""Lines before the first row: limits and count along x, along y; limits of z and the feed."""
_MOST_ROWS = 10**7
_AT_THE_END = 1e-4
"""A height this close to the lowest one is a miss. [file's unit]"""
_FEWEST_ZEROS = 2
"""Zeros at the end from which they are points that were not probed."""


def read_height_grid(source: Source, units: str | None = None) -> FileReadings:
    r"""Read the touches of a grid that was probed along -z.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str
        mm or inch; the file does not state it.

    Returns
    -------
    FileReadings
        Normals along z; the feed that the file states, where it is not zero. A height at the
        lowest limit and zeros at the end are missed.

    Raises
    ------
    InputError
        The units are missing; a row has not three numbers; there are more or fewer rows than the
        first two lines state. The message contains the line.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = b"0 10 2\n0 5 1\n-1 1 50\n\n0 0 0.1\n10 0 0.2\n"
    >>> found = read_height_grid(SourceFile("board.probe", text), "mm").touches
    >>> found.positions[1].tolist(), found.normals[1].tolist(), found.feeds[1].item()
    ([10.0, 0.0, 0.2], [0.0, 0.0, 1.0], 50.0)
    """
    file = opened(source)
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, text in enumerate(file.lines("a grid of heights"), start=1):
        cells = text.split()
        if not cells:
            continue
        if len(cells) != 3:
            raise file.error(f"{len(cells)} values; x, y and z are needed", number)
        rows.append(file.numbers(cells, number))
        lines.append(number)
    scale = file.scale(units, "a grid of heights does not give its units")
    head, body = rows[:_HEAD], rows[_HEAD:]
    if not body:
        raise file.error("the file has no heights after its three lines of limits")
    count = head[0][2] * head[1][2]
    if len(body) != count or count > _MOST_ROWS:
        raise file.error(
            f"{len(body)} heights, but its first two lines give {head[0][2]:g} × {head[1][2]:g}",
            lines[-1],
        )
    feed = scale * head[2][2]
    missed = _missed(body, head[2][0])
    numbers = lines[_HEAD:]
    if all(missed):
        raise file.error("no point of the grid was touched")
    names = tuple(f"line {n}" for n, out in zip(numbers, missed, strict=True) if out)
    body = [row for row, out in zip(body, missed, strict=True) if not out]
    numbers = [n for n, out in zip(numbers, missed, strict=True) if not out]
    with file.named_in_errors(numbers):
        touches = Touches(
            positions=scale * np.array(body),
            normals=np.tile([0.0, 0.0, 1.0], (len(body), 1)),
            feeds=np.full(len(body), feed) if feed > 0.0 else None,
            source=file.name,
            lines=tuple(numbers),
        )
    return FileReadings(touches, missed=names)


def _missed(body: list[list[float]], lowest: float) -> list[bool]:
    """Whether each row is no contact: it is at the end of its move, or was not probed yet.

    The program writes the lowest height for a miss, and zeros for the points after a stop.
    """
    heights = np.array([row[2] for row in body])
    missed = np.abs(heights - lowest) < _AT_THE_END
    zeros = int(np.argmax(heights[::-1] != 0.0)) if heights.any() else 0
    if zeros >= _FEWEST_ZEROS:
        missed[len(heights) - zeros :] = True
    return [bool(each) for each in missed]


def _is_height_grid(lines: list[str]) -> bool:
    try:
        head = [[float(cell) for cell in line.split()] for line in lines[:_HEAD]]
        counts = [int(lines[row].split()[2]) for row in (0, 1)]
    except (ValueError, IndexError):
        return False
    return (
        len(head) == _HEAD
        and all(len(row) == 3 and row[0] <= row[1] for row in head)
        and min(counts) >= 1
        and len(lines) - _HEAD == counts[0] * counts[1]
        and all(len(line.split()) == 3 for line in lines[_HEAD:])
    )


HEIGHT_GRID = FileFormat(
    name="height-grid",
    what="grid of heights of bCNC (.probe): limits and counts, then x y z",
    reads="touches",
    needs="units",
    verified="the lines of bCNC's program that write and read it; no file of a machine",
    recognises=_is_height_grid,
    parse=lambda file, options: read_height_grid(file, options.units),
    other_lines="refused",
)
