"""Heights of a grid as bCNC writes them (.probe): three lines of limits, then x, y, z; reading."""

from __future__ import annotations

import numpy as np

from pretravel.files.file_format import FileFormat, FileReadings
from pretravel.files.source_file import Source, opened
from pretravel.touches import Touches

_HEAD = 3
"""Lines before the first row: limits and count along x, along y; limits of z and the feed."""
_MOST_ROWS = 10**7


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
        Normals along z; the feed that the file states, where it is not zero.

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
    scale = file.scale(units, "a grid of heights does not state its units")
    head, body = rows[:_HEAD], rows[_HEAD:]
    if not body:
        raise file.error("the file has no heights after its three lines of limits")
    count = head[0][2] * head[1][2]
    if len(body) != count or count > _MOST_ROWS:
        raise file.error(
            f"{len(body)} heights, but its first two lines state {head[0][2]:g} × {head[1][2]:g}",
            lines[-1],
        )
    feed = scale * head[2][2]
    with file.named_in_errors(lines[_HEAD:]):
        touches = Touches(
            positions=scale * np.array(body),
            normals=np.tile([0.0, 0.0, 1.0], (len(body), 1)),
            feeds=np.full(len(body), feed) if feed > 0.0 else None,
            source=file.name,
            lines=tuple(lines[_HEAD:]),
        )
    return FileReadings(touches)


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
