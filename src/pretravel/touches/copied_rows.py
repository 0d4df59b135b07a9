"""Rows of a file that stand there twice: a log that was appended to itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray

_FINE = 1e-3
"""Repeats are rarely equal to digits finer than this. [mm]"""
_FEWEST, _FEWEST_COARSE = 4, 12
"""Different rows, one after the other, which come again: single touches repeat to the last digit by
chance. In steps of 1 µm three of four do, and the whole file must be copies."""
_SHIFTS = 4
_EXACT = 1e-9


def copied_rows(values: npt.ArrayLike) -> tuple[int, int, int]:
    """The longest run of rows that comes again in the same order, to the last digit.

    Parameters
    ----------
    values : (n, k) float
        Positions of touches, or their readings. [mm]

    Returns
    -------
    first, again, count : int
        The run begins in row `first`, its copy in row `again`; the count is zero where no run is
        longer than chance explains.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> copied_rows(np.vstack([log, log]))
    (0, 5, 5)
    >>> copied_rows(np.repeat(log, 3, axis=0))
    (0, 0, 0)
    """
    rows = np.asarray(values, dtype=np.float64)
    # Equal rows have equal sums, added in one order: where no sum comes twice, no row does.
    sums = sum(column * math.sqrt(number) for number, column in enumerate(rows.T, start=2))
    if len(np.unique(sums)) == len(rows):
        return (0, 0, 0)
    number = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    first = np.full(int(number.max()) + 1, len(rows))
    np.minimum.at(first, number, np.arange(len(rows)))
    shift = np.arange(len(rows)) - first[number]
    shifts, often = np.unique(shift[shift > 1], return_counts=True)
    fine = _has_fine_digits(rows)
    fewest = _FEWEST if fine else _FEWEST_COARSE
    found = (0, 0, 0)
    for apart in shifts[np.argsort(-often, kind="stable")][:_SHIFTS].tolist():
        for begin, end in _runs(number[apart:] == number[:-apart]):
            different = len(np.unique(number[begin:end]))
            whole = end - begin == len(rows) - apart
            if end - begin > found[2] and different >= fewest and (fine or whole):
                found = begin, begin + apart, end - begin
    return found


def _runs(same: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First row of each run of true values, and the row behind its last."""
    edges: IntArray = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]])))
    return [(int(a), int(b)) for a, b in list(pairwise(edges))[::2]]


def _has_fine_digits(rows: FloatArray) -> bool:
    return bool(np.any(np.abs(rows - _FINE * np.round(rows / _FINE)) > _EXACT))


def copied_rows_warnings(values: npt.ArrayLike, where: Callable[[int], str]) -> list[str]:
    """A warning where rows come twice; none where they do not.

    Parameters
    ----------
    values : (n, k) float
        As of `copied_rows`.
    where : callable
        The name of a row in messages: `Touches.where`.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> copied_rows_warnings(np.vstack([log, log]), lambda row: f"line {row + 1}")[0][:65]
    '5 rows from line 6 on are equal to those from line 1 on, to the l'
    """
    first, again, count = copied_rows(values)
    if not count:
        return []
    return [
        (
            f"{count} rows from {where(again)} on are equal to those from {where(first)} on, to "
            "the last digit: was the log appended twice? Copies count as repeats, and make "
            "scatter and u too small: leave them out. Only a simulation without noise, or "
            "positions in steps that hide the scatter, repeat like this"
        )
    ]
