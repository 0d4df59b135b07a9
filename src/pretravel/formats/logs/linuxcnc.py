"""Logs of LinuxCNC that pretravel's programs did not write: PROBEOPEN, and positions by LOG."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pretravel.errors import InputError
from pretravel.formats.logs.joining import Rows, file_lines, finite, scale_of

_PROBEOPEN_COLUMNS = 9
_PROBEOPEN_DECIMALS = 6
_ROTARY = slice(3, 6)
_MOVED = 1e-4
"""Rotary axes whose positions differ by more have moved. [degrees]"""
_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))(?![\d.,eE])", re.IGNORECASE)
"""A letter and its number in G-code."""


def read_probeopen(path: str | Path, units: str | None = None) -> Rows:
    r"""Read a file that ``(PROBEOPEN …)`` wrote.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch: the units of the program that ran (G21, G20), which the file does not state.

    Returns
    -------
    Rows
        In work coordinates. The file does not state which rows are misses.

    Raises
    ------
    InputError
        No units; lines without nine numbers, such as a last line that is cut off; rotary axes
        that moved: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "probe.txt"
    >>> _ = file.write_text("1.0 2.0 3.0 0.0 0.0 0.0 0.0 0.0 0.0\n")
    >>> read_probeopen(file, "inch").positions.round(6).tolist()
    [[25.4, 50.8, 76.2]]
    """
    lines = file_lines(path, "a file of PROBEOPEN")
    scale = scale_of(
        units,
        path,
        "a file of PROBEOPEN is in the units of the program that ran, and does not state them",
    )
    rows: list[list[float]] = []
    numbers: list[int] = []
    for number, text in enumerate(lines, start=1):
        if not text.strip():
            continue
        row = _probeopen_row(text, lines, path, number)
        if rows and _have_moved(rows[0][_ROTARY], row[_ROTARY]):
            raise InputError(
                "a rotary axis (columns 4 to 6) has moved since the first row; positions at "
                "different rotary angles cannot be joined with one plan",
                path=path,
                line=number,
            )
        rows.append(row)
        numbers.append(number)
    return Rows(str(path), scale * np.array(rows)[:, :3], tuple(numbers))


def _probeopen_row(text: str, lines: list[str], path: str | Path, number: int) -> list[float]:
    """The nine numbers of a line."""
    cells = text.split()
    if len(cells) != _PROBEOPEN_COLUMNS:
        hint = (
            "; the last line is cut off: delete it, or run the program again"
            if number >= len(lines) - 1
            else f" ('{text.strip()[:40]}')"
        )
        raise InputError(
            f"{len(cells)} values where PROBEOPEN writes {_PROBEOPEN_COLUMNS}{hint}",
            path=path,
            line=number,
        )
    row = finite(cells, path, number)
    # Only the last line of a file can lack its line end.
    decimals = len(cells[-1].rpartition(".")[2])
    if number == len(lines) and decimals < _PROBEOPEN_DECIMALS:
        raise InputError(
            f"the last number, '{cells[-1]}', is cut off: PROBEOPEN writes six decimals. "
            "Delete the line, or run the program again",
            path=path,
            line=number,
        )
    return row


def _have_moved(before: list[float], now: list[float]) -> bool:
    return max(abs(a - b) for a, b in zip(before, now, strict=True)) > _MOVED


def read_log_positions(path: str | Path, units: str | None = None) -> Rows:
    r"""Read positions from lines such as ``G1 X1.0 Y2.0 Z3.0``, which users write with LOG.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch; the file may state them by G20 or G21 itself.

    Returns
    -------
    Rows

    Raises
    ------
    InputError
        No units; lines without X, Y and Z: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "a.txt"
    >>> _ = file.write_text("G21\nG1 X1.0 Y2.0 Z3.0\n")
    >>> read_log_positions(file).positions.tolist()
    [[1.0, 2.0, 3.0]]
    """
    rows, numbers = [], []
    for number, text in enumerate(file_lines(path, "a log of positions"), start=1):
        line = re.sub(r"\(.*?\)", "", text).strip()
        if not line or line.startswith((";", "%")):
            continue
        units = _units_after(line, units, path, number)
        if position := _position(line, path, number):
            rows.append(position)
            numbers.append(number)
    scale = scale_of(units, path, "the file does not state its units (G20 or G21)")
    if not rows:
        raise InputError("the file contains no position", path=path)
    return Rows(str(path), scale * np.array(rows), tuple(numbers))


def _units_after(line: str, units: str | None, path: str | Path, number: int) -> str | None:
    """The units after a line: those that it states by G20 or G21, else those before."""
    word = re.search(r"\bG2([01])\b", line, re.IGNORECASE)
    if word is None:
        return units
    stated = "inch" if word[1] == "0" else "mm"
    if units is not None and units != stated:
        raise InputError(
            f"the file states {stated} (G2{word[1]}), but its units are given as {units}",
            path=path,
            line=number,
            inputs=("units",),
        )
    return stated


def _position(line: str, path: str | Path, number: int) -> list[float]:
    """X, Y and Z of a line; an empty list where it has none of them."""
    if re.search(r"\bG91\b", line, re.IGNORECASE):
        raise InputError("G91: positions that are differences are not read", path=path, line=number)
    rest = _WORD.sub("", line).strip()
    if rest:
        raise InputError(
            f"'{line[:40]}' is not a position; G1 X… Y… Z… is needed"
            + ("; use points as decimal signs" if "," in rest else ""),
            path=path,
            line=number,
        )
    pairs = [(name.upper(), value) for name, value in _WORD.findall(line)]
    axes = [name for name, _ in pairs if name in "XYZ"]
    words = {name: value for name, value in pairs if name in "XYZ"}
    if len(words) < len(axes):
        raise InputError("a coordinate occurs twice", path=path, line=number)
    if words and len(words) < 3:
        raise InputError(
            f"'{line[:40]}' has no {' and no '.join(sorted(set('XYZ') - set(words)))}",
            path=path,
            line=number,
        )
    return [float(words[axis]) for axis in "XYZ"] if words else []
