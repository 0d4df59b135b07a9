"""A change at one touch: from it on all directions read more, or the reference lies elsewhere.

Both are fitted within directions, and what they leave is compared with what a drift leaves, by the
Bayesian information criterion.
"""

from __future__ import annotations

import math

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


def level_change(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> tuple[int, float] | None:
    """From which touch on all directions read more alike, where a drift explains that worse.

    A feed that was changed does this, or a probe that changed.

    Parameters
    ----------
    values : (n,) float
        Pretravel, in the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int
        Number of the direction of each touch.

    Returns
    -------
    first, size : int, float, or None
        The first touch that differs, and by how much. [mm]

    >>> n = np.tile([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]], (4, 1))
    >>> later = np.arange(20) >= 10
    >>> first, size = level_change(
    ...     0.01 * later + 1e-5 * np.cos(np.arange(20) ** 2), n, np.tile(np.arange(5), 4)
    ... )
    >>> first, round(size, 6)
    (10, 0.010001)
    """
    best = _best_step(values, np.ones((len(values), 1)), groups)
    moved = _best_step(values, directions, groups)
    if best is None or moved is None:
        return None
    first, value, left = best
    two = math.log(len(values))  # what two coefficients more must gain
    over_drift = _gain(_left_by_drift(values, directions, groups), left, groups) + 0.5 * two
    over_move = _gain(moved[2], left, groups) + two
    return (first, float(value[0])) if over_drift > _MUCH_BETTER and over_move > 0.0 else None


def reference_jump(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> tuple[int, FloatArray] | None:
    """From which touch on the reference lies elsewhere, where a drift or a level explains worse.

    Parameters
    ----------
    values : (n,) float
        Pretravel, in the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int
        Number of the direction of each touch.

    Returns
    -------
    first, shift : int, (3,) float, or None
        The first touch on the moved reference, and its movement, probe frame. [mm]

    >>> n = np.tile([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]], (4, 1))
    >>> moved = -0.05 * n.sum(axis=1) * (np.arange(20) >= 7)
    >>> first, shift = reference_jump(moved, n, np.tile(np.arange(5), 4))
    >>> first, shift.round(4).tolist()
    (7, [0.05, 0.05, 0.05])
    """
    best = _best_step(values, directions, groups)
    level = _best_step(values, np.ones((len(values), 1)), groups)
    if best is None or level is None:
        return None
    first, value, left = best
    gain = _gain(min(level[2], _left_by_drift(values, directions, groups)), left, groups)
    by_far = gain > 0.5 * _free(groups) * math.log(_BY_FAR)
    # Pretravel is smaller where the reference comes towards the tip.
    better = gain - 1.5 * math.log(len(values)) > _MUCH_BETTER
    return (first, -value) if by_far and better else None


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
