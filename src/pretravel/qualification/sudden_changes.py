"""A change at one touch: from it on all directions read more, or the reference lies elsewhere.

Both are fitted within directions, and what they leave is compared with what a drift leaves, by the
Bayesian information criterion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray
from pretravel.qualification.touch_order import drift_columns
from pretravel.qualification.within_directions import centred_within

_NOISE_FLOOR = 1e-5 * MICROMETRE
_FEWEST_AFTER = 5
"""Touches before and after a change."""
_BY_FAR = 10.0
"""Times what other courses leave: a step leaves a fifth of a wave."""
_MUCH_BETTER = 10.0
"""Logarithm of the odds from which a drift is not the cause: the first touch was chosen, too."""


@dataclass(frozen=True, eq=False)
class SuddenChange:
    """What differs from one touch on: the level of all directions, or the place of the reference.

    Attributes
    ----------
    first : int
        The first touch that differs.
    level : float
        By how much all directions read more; zero where the reference moved. [mm]
    shift : (3,) float
        Movement of the reference, probe frame; zero where the level changed. [mm]
    """

    first: int
    level: float
    shift: FloatArray


def sudden_change(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> SuddenChange | None:
    """A change at one touch, where neither a drift nor the other change explains the touches.

    The level changes with the feed, or with the probe.

    Parameters
    ----------
    values : (n,) float
        Pretravel, in the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int
        Number of the direction of each touch.

    >>> n = np.tile([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]], (4, 1))
    >>> groups, noise = np.tile(np.arange(5), 4), 1e-5 * np.cos(np.arange(20) ** 2)
    >>> found = sudden_change(0.01 * (np.arange(20) >= 10) + noise, n, groups)
    >>> found.first, round(found.level, 6)
    (10, 0.010001)
    >>> found = sudden_change(-0.05 * n.sum(axis=1) * (np.arange(20) >= 7), n, groups)
    >>> found.first, found.shift.round(4).tolist()
    (7, [0.05, 0.05, 0.05])
    """
    level = _best_step(values, np.ones((len(values), 1)), groups)
    jump = _best_step(values, directions, groups)
    if level is None or jump is None:
        return None
    drift = _left_by_drift(values, directions, groups)
    two = math.log(len(values))  # what two coefficients more must gain
    first, value, left = level
    over_drift = _gain(drift, left, groups) + 0.5 * two
    if over_drift > _MUCH_BETTER and _gain(jump[2], left, groups) + two > 0.0:
        return SuddenChange(first, float(value[0]), np.zeros(3))
    first, value, left = jump
    gain = _gain(min(level[2], drift), left, groups)
    by_far = gain > 0.5 * _free(groups) * math.log(_BY_FAR)
    # Pretravel is smaller where the reference comes towards the tip.
    better = gain - 1.5 * two > _MUCH_BETTER
    return SuddenChange(first, 0.0, -value) if by_far and better else None


def _best_step(
    values: FloatArray, columns: FloatArray, groups: IntArray
) -> tuple[int, FloatArray, float] | None:
    """First touch of the step in columns that explains most, its coefficients, what it leaves.

    Columns are taken as the same for all touches of a direction: sums over the touches after a step
    are then cumulative ones, for all steps at once.
    """
    number = np.unique(groups, return_inverse=True)[1]
    count, size = len(values), np.bincount(number)
    seen = centred_within(values, groups)
    column = columns - centred_within(columns, groups)
    after = np.empty(count)  # touches of the same direction later than each touch
    by_direction = np.argsort(number, kind="stable")
    after[by_direction] = np.cumsum(size)[number[by_direction]] - 1 - np.arange(count)
    # Of m later ones among n, those with a step have m (1 - m/n) of its squares within.
    added = 1.0 - (2.0 * after + 1.0) / size[number]

    def later(each: FloatArray) -> FloatArray:
        total = np.cumsum(each[::-1], axis=0)[::-1]
        return np.asarray(total[_FEWEST_AFTER : count - _FEWEST_AFTER + 1])

    squares = later(added[:, None, None] * column[:, :, None] * column[:, None, :])
    along = later(seen[:, None] * column)
    inverse = np.linalg.pinv(squares, rcond=1e-9, hermitian=True)
    value = np.einsum("nij,nj->ni", inverse, along)
    left = seen @ seen - np.einsum("ni,ni->n", value, along)
    # A step that one touch alone shows is a gross error.
    left = np.where(later(added) > 1.0, left, np.inf)
    if not np.isfinite(left).any():
        return None
    best = int(np.argmin(left))
    return best + _FEWEST_AFTER, value[best], max(float(left[best]), 0.0)


def _left_by_drift(values: FloatArray, directions: FloatArray, groups: IntArray) -> float:
    """Sum of squares that a drift of the reference leaves, steady or slowing down. [mm²]"""
    seen, order = centred_within(values, groups), np.arange(len(values))
    left = []
    for slows in (False, True):
        drift = centred_within(drift_columns(directions, order, slows=slows), groups)
        found = np.linalg.lstsq(drift, seen, rcond=None)[0]
        left.append(float(np.sum((seen - drift @ found) ** 2)))
    return min(left)


def _free(groups: IntArray) -> int:
    return len(groups) - len(np.unique(groups))


def _gain(others: float, left: float, groups: IntArray) -> float:
    """Logarithm of the odds of what leaves less, without the numbers of coefficients."""
    floor = _free(groups) * _NOISE_FLOOR**2
    return 0.5 * _free(groups) * math.log((others + floor) / (left + floor))
