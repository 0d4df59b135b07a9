"""Files of LinuxCNC's PROBEOPEN: nine numbers a line; reading."""

from __future__ import annotations

import re

import numpy as np

from pretravel.files import FileFormat, FilePositions, Source, SourceFile, opened

_COLUMNS = 9
_DECIMALS = 6
_ROTARY = slice(3, 9)
_MOVED = 1e-4
"""Other axes that differ by more than this have moved. [deg, or the file's unit]"""


def read_probeopen(source: Source, units: str | None = None) -> FilePositions:
    r"""Read positions from a file that ``(PROBEOPEN …)`` wrote.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str
        mm or inch: the units of the program that ran (G21 or G20). The file does not state them.

    Returns
    -------
    FilePositions
        In work coordinates. The file does not state which positions are misses.

    Raises
    ------
    InputError
        The units are missing; a line has not nine numbers, for example the last one, cut off; a
        rotary axis has moved. The message contains the line.

    >>> file = SourceFile("probe.txt", b"1.0 2.0 3.0 0.0 0.0 0.0 0.0 0.0 0.0\n")
    >>> read_probeopen(file, "inch").positions.round(6).tolist()
    [[25.4, 50.8, 76.2]]
    """
    file = opened(source)
    lines = file.lines("a file of PROBEOPEN")
    scale = file.scale(
        units, "a file of PROBEOPEN is in the units of the program that ran and does not give them"
    )
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, text in enumerate(lines, start=1):
        if not text.strip():
            continue
        row = _row(file, text, number, len(lines))
        if rows and np.any(np.abs(np.subtract(rows[0][_ROTARY], row[_ROTARY])) > _MOVED):
            raise file.error(
                "a rotary axis (columns 4 to 6) or an axis U, V, W (7 to 9) has moved since the "
                "first row; such positions cannot be joined with one plan",
                number,
            )
        rows.append(row)
        numbers.append(number)
    return FilePositions(file.path, scale * np.array(rows)[:, :3], tuple(numbers))


def _row(file: SourceFile, text: str, number: int, last: int) -> list[float]:
    """Read the nine numbers of a line; `last` is the number of the file's last line."""
    cells = text.split()
    if len(cells) != _COLUMNS:
        hint = (
            "; the last line is cut off: delete it, or run the program again"
            if number >= last - 1
            else f" ('{text.strip()[:40]}')"
        )
        raise file.error(f"{len(cells)} values where PROBEOPEN writes {_COLUMNS}{hint}", number)
    row = file.numbers(cells, number)
    # A complete last line ends with a line end, so that an empty line follows it.
    if number == last and len(text.rstrip().rpartition(".")[2]) < _DECIMALS:
        raise file.error(
            f"the last number, '{cells[-1]}', is cut off: PROBEOPEN writes six decimals. Delete "
            "the line, or run the program again",
            number,
        )
    return row


def _is_probeopen(lines: list[str]) -> bool:
    return (
        re.fullmatch(r"[-+.,\deE\s]+", lines[0]) is not None and len(lines[0].split()) == _COLUMNS
    )


PROBEOPEN = FileFormat(
    name="probeopen",
    what="file of LinuxCNC's PROBEOPEN",
    reads="positions",
    needs="units, plan",
    verified="LinuxCNC 2.9 (Debian 12), running",
    recognises=_is_probeopen,
    by_shape=True,
    parse=lambda file, options: read_probeopen(file, options.units),
    other_lines="refused",
)
