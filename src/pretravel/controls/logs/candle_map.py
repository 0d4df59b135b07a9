"""Maps of heights of Candle (.map): border, grid, interpolation, then a row for each line; reading.

The first line is x;y;width;height of the border, the second columns;rows;lowest;highest z of the
probing, the third the interpolation. Then come the heights, a line for each row of the grid.
"""

from __future__ import annotations

import numpy as np

from pretravel.files import FileFormat, FileReadings, Source, opened
from pretravel.touches import Touches

_HEAD = ((4,), (4,), (2, 3))
"""Numbers of the first three lines; of the third, old versions wrote two."""
_NOT_PROBED = "nan"
"""A place that was not probed."""
_MOST = 1000


def read_candle_map(source: Source, units: str | None = None) -> FileReadings:
    r"""Read the heights of a map that Candle probed along -z.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str
        mm or inch; the file does not state it.

    Returns
    -------
    FileReadings
        Normals along z. A height at the lowest limit is a miss, and so is nan.

    Raises
    ------
    InputError
        The units are missing; a line has another number of heights than the grid has columns.

    >>> from pretravel.files import SourceFile
    >>> text = b"0;0;10;5\r\n2;2;-1;1\r\n0;1;1\r\n0.1;0.2\r\n0.3;0.4\r\n"
    >>> read_candle_map(SourceFile("a.map", text), "mm").touches.positions[3].tolist()
    [10.0, 5.0, 0.4]
    """
    file = opened(source)
    rows = [
        (number, _cells(line))
        for number, line in enumerate(file.lines("a map of Candle"), start=1)
        if line.strip()
    ]
    head = [file.numbers(cells, number) for number, cells in rows[: len(_HEAD)]]
    x, y, width, height = head[0]
    columns, lines_of_grid = int(head[1][0]), int(head[1][1])
    lowest = head[1][2]
    body = rows[len(_HEAD) :]
    odd = next((row for row in body if len(row[1]) != columns), None)
    if odd is not None:
        raise file.error(f"{len(odd[1])} heights, but the grid has {columns} columns", odd[0])
    if len(body) != lines_of_grid:
        raise file.error(f"{len(body)} rows of heights, but the grid has {lines_of_grid}")
    scale = file.scale(units, "a map of heights does not give its units")
    places_x = np.linspace(x, x + width, columns)
    places_y = np.linspace(y, y + height, lines_of_grid)
    points, numbers, missed = [], [], []
    for row, (number, cells) in enumerate(body):
        heights = [str(lowest) if cell.lower() == _NOT_PROBED else cell for cell in cells]
        for column, z in enumerate(file.numbers(heights, number)):
            if abs(z - lowest) < _AT_THE_END:
                missed.append(f"column {column + 1} of line {number}")
                continue
            points.append([places_x[column], places_y[row], z])
            numbers.append(number)
    if not points:
        raise file.error("no point of the map was touched")
    with file.named_in_errors(numbers):
        touches = Touches(
            scale * np.array(points),
            np.tile([0.0, 0.0, 1.0], (len(points), 1)),
            source=file.name,
            lines=tuple(numbers),
        )
    return FileReadings(touches, missed=tuple(missed))


_AT_THE_END = 1e-4
"""A height this close to the lowest one is a miss. [file's unit]"""


def _cells(line: str) -> list[str]:
    """The cells of a line; its boxes of numbers have the decimal sign of the computer."""
    return [cell.strip().replace(",", ".") for cell in line.strip().split(";")]


def _is_candle_map(lines: list[str]) -> bool:
    try:
        head = [[float(cell) for cell in _cells(line)] for line in lines[: len(_HEAD)]]
    except ValueError:
        return False
    if len(head) != len(_HEAD):
        return False
    if not all(len(row) in counts for row, counts in zip(head, _HEAD, strict=True)):
        return False
    columns, rows = head[1][:2]
    whole = columns == int(columns) and rows == int(rows)
    return (
        whole
        and min(columns, rows) >= 2
        and max(columns, rows) <= _MOST
        and min(head[0][2:]) > 0.0
        and len(lines) > len(_HEAD)
    )


CANDLE_MAP = FileFormat(
    name="candle-map",
    what="map of heights of Candle (.map): border, grid, interpolation, rows of heights",
    reads="touches",
    needs="units",
    verified="the lines of Candle's program that write and read it, in its repository and two "
    "successors; its repository's one sample, whose counts do not fit, is refused; no file of a "
    "machine",
    recognises=_is_candle_map,
    parse=lambda file, options: read_candle_map(file, options.units),
    other_lines="refused",
)
