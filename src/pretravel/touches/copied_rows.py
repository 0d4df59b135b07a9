"""Rows that are copies: of a log appended to itself, or of readings stored several times."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray
from pretravel.touches.quantisation import quantisation_step

EACH_ROW = "each row stands there "
"""The start of what is said of rows that stand several times."""
_FEWEST_COPIES = 5
"""Repeats from which copies are distinguished from chance."""
_COPIES_IN_STEPS = 41.0
"""Repeats for each µm of the step: with a noise of 0.1 µm all are alike in 1 % of logs."""
_COARSE = 0.1 * MICROMETRE
"""Of the steps of positions, from which single touches are not called copies. [mm]"""
_MOST_BY_CHANCE = 0.1
"""Share of touches in steps of 0.01 µm, with a noise of 0.1 µm, that are rarely like the one before
in all digits."""
_FINE = 1e-3
"""Repeats are rarely equal to digits finer than this. [mm]"""
_FEWEST, _FEWEST_COARSE = 4, 12
"""Different rows, one after the other, which come again: single touches repeat to the last digit by
chance. In steps of 1 µm three of four do, and the whole file must be copies."""
_SHIFTS = 4
_EXACT = 1e-9


def copied_readings(positions: FloatArray, groups: IntArray, step: float = 0.0) -> int:
    """Touches that are copies of others to the last digit, by a log that stored readings twice.

    Parameters
    ----------
    positions : (n, 3) float
        In the axes of the machine. Coarse digits can be alike by chance: in steps of 0.1 µm single
        touches are not called copies, in longer ones a few repeats neither. [mm]
    groups : (n,) int
        Number of the direction of each touch.
    step : float
        Of the positions, as it was found. [mm]

    Returns
    -------
    int
        All repeats of each direction, where they are alike; else those that are alike with the
        touch before, where they are more than chance explains.
    """
    count, directions = len(groups), int(groups.max()) + 1
    repeats = count - directions
    steps = positions / _COARSE
    coarse = max(step, _COARSE if bool(np.all(np.abs(steps - np.round(steps)) < 1e-4)) else 0.0)
    if repeats < fewest_copies(coarse):
        return 0
    first = np.unique(groups, return_index=True)[1]
    if np.abs(positions - positions[first[groups]]).max() == 0.0:
        return repeats
    if coarse >= _COARSE:
        return 0
    copies = int(np.sum(np.all(positions[1:] == positions[:-1], axis=1)))
    return copies if copies >= max(_FEWEST_COPIES, _MOST_BY_CHANCE * count) else 0


def fewest_copies(step: float) -> float:
    """Repeats that are all alike, from which they are copies and not alike by chance.

    Parameters
    ----------
    step : float
        Of the positions; zero where none is seen. [mm]
    """
    return max(_FEWEST_COPIES, _COPIES_IN_STEPS * step / MICROMETRE)


def rows_in_a_row(values: npt.ArrayLike) -> int:
    """How often each row stands there, one after the other and alike to the last digit.

    Parameters
    ----------
    values : (n, k) float
        Positions of touches, or their readings. [mm]

    Returns
    -------
    int
        One where rows differ, or too few are alike for steps of this length.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> rows_in_a_row(np.repeat(log, 3, axis=0)), rows_in_a_row(log)
    (3, 1)
    """
    rows = np.asarray(values, dtype=np.float64)
    if len(rows) < 2:
        return 1
    differs = np.flatnonzero(np.any(rows[1:] != rows[:-1], axis=1)) + 1
    lengths = np.diff(np.concatenate([[0], differs, [len(rows)]]))
    often = int(lengths[0])
    copies = len(rows) - len(lengths)
    if often == 1 or np.any(lengths != often):
        return 1
    return often if copies >= fewest_copies(quantisation_step(rows)) else 1


def rows_in_a_row_warnings(values: npt.ArrayLike) -> list[str]:
    """A warning where each row stands there several times; none where they do not.

    Parameters
    ----------
    values : (n, k) float
        As of `rows_in_a_row`.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> rows_in_a_row_warnings(np.repeat(log, 2, axis=0))[0][:49]
    'each row stands there 2 times, to the last digit:'
    """
    often = rows_in_a_row(values)
    if often == 1:
        return []
    return [
        (
            f"{EACH_ROW}{often} times, to the last digit: copies, not repeats. They count as "
            "touches of their own and make scatter and u too small: give each row once"
        )
    ]


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
    shift = np.arange(len(rows)) - _first_rows(number)
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


def certain_copies(values: npt.ArrayLike) -> BoolArray:
    """Rows that are copies of others in any order, also rounded ones, and not alike by chance.

    Parameters
    ----------
    values : (n, k) float
        Positions of touches. [mm]

    Returns
    -------
    (n,) bool
        False everywhere where steps of the positions can make rows alike, or where each row stands
        there several times one after the other, of which `rows_in_a_row` speaks.

    >>> log = np.random.default_rng(1).random((13, 3))
    >>> int(certain_copies(np.vstack([log, log[::-1].round(5)])).sum())
    13
    """
    rows = np.asarray(values, dtype=np.float64)
    found = np.zeros(len(rows), dtype=bool)
    if len(rows) < 2 * _FEWEST_COARSE:
        return found
    step = quantisation_step(rows)
    finest = step < _FINEST
    number, counts = np.unique(rows, axis=0, return_inverse=True, return_counts=True)[1:]
    number = number.ravel()
    again = _stand_there_before(number)
    often = int(np.gcd.reduce(counts))
    if often > 1 and np.sum(again) >= _FEWEST_COARSE:
        places = len(np.unique(np.round(rows / _ONE_PLACE), axis=0))
        if step <= _COARSE or len(counts) > _READINGS_OF_A_PLACE * places:
            found |= _earlier_ones(number) >= counts[number] // often
    elif finest and all(end - begin >= _FEWEST_COARSE for begin, end in _runs(again)):
        found |= again  # a shorter run is one of repeats that are alike by chance
    for decimals in _DECIMALS if finest else ():
        rounded = np.round(rows, decimals)
        coarse = np.max(np.abs(rows - rounded), axis=1) < _EXACT
        if coarse.all() or np.sum(coarse) < _FEWEST_COARSE:
            continue
        fine = {row.tobytes() for row in rounded[~coarse] + 0.0}
        twins = np.array([row.tobytes() in fine for row in rounded + 0.0]) & coarse
        if np.sum(twins) == np.sum(coarse):
            found |= twins
    return found


_FINEST = 0.01 * MICROMETRE
"""Steps of positions, also of encoders, in which single repeats are rarely alike. [mm]"""
_ONE_PLACE = 0.02
"""Touches of one place are closer. [mm]"""
_READINGS_OF_A_PLACE = 1.5
"""Different ones; in long steps all repeats of a place can be alike."""
_DECIMALS = (4, 5, 6)
"""Of copies that another program rounded; in steps of 1 µm real repeats are alike too often."""


def _earlier_ones(number: IntArray) -> IntArray:
    """How many rows before each have its number."""
    order = np.argsort(number, kind="stable")
    begins = np.searchsorted(number[order], number[order], side="left")
    found = np.empty(len(number), dtype=np.int64)
    found[order] = np.arange(len(number)) - begins
    return found


def _first_rows(number: IntArray) -> IntArray:
    """The first row with the number of each row."""
    first = np.full(int(number.max()) + 1, len(number))
    np.minimum.at(first, number, np.arange(len(number)))
    return np.asarray(first[number])


def _stand_there_before(number: IntArray) -> BoolArray:
    """Rows whose number occurs in an earlier row, with other numbers in between."""
    begins = np.flatnonzero(np.diff(number, prepend=-1))
    run = begins[np.searchsorted(begins, np.arange(len(number)), side="right") - 1]
    return np.asarray(_first_rows(number) < run)


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
