"""The step of a latch: positions that a machine reports in multiples of a step only.

The error of such a position is that of rounding, with the variance q²/12 of a step q. It is the
same in every repeat if the scatter is much smaller than the step: repeats do not reduce it then.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import INCH, FloatArray

SMALLEST_STEP, LARGEST_STEP = 1e-5, 5e-3
"""Steps that are looked for. A smaller one does not matter, a larger one no machine has. [mm]"""
FALSE_STEP_LEVEL = 1e-4
"""Largest probability that continuous positions are reported as quantised."""
_USUAL_STEPS = tuple(
    sorted(
        {
            unit * 10.0**exponent * digit
            for unit in (1.0, INCH)
            for exponent in range(-7, -2)
            for digit in (1.0, 1.25, 2.0, 2.5, 5.0)
            if SMALLEST_STEP * 0.999 <= unit * 10.0**exponent * digit <= LARGEST_STEP * 1.001
        },
        reverse=True,
    )
)
"""Steps of scales and displays, also found where the multiples are not exact. [mm]"""
_WIDEST_ARC = 0.4
"""Share of a step in which all phases must lie; twice the step has them in an arc of 0.5."""
_EXACT = 1e-7
"""Remainders below this are rounding of numbers, not of a latch. [mm]"""


def quantisation_step(positions: npt.ArrayLike) -> float:
    """The step of the coordinates of touches along the machine's axes.

    Each axis has an offset of its own. The step is the same for all axes: with steps that differ,
    the largest common one is found. The last printed digit of a file is a step too.

    Parameters
    ----------
    positions : (n, 3) float
        In the machine's axes. [mm]

    Returns
    -------
    float
        The step; 0.0 if the positions are continuous, or if they are too few to show a step. [mm]

    Notes
    -----
    A step q is accepted if the phases x/q of each axis lie within 0.4 of a turn. Phases of
    continuous positions lie in an arc w < 0.5 with probability m w^(m-1) for m values (Stevens
    1939). Repeats, and the symmetry of patterns of touches, reduce m: values closer than half a
    step count once, and half of the rest is used. The probability of a false step is below
    `FALSE_STEP_LEVEL`.

    >>> rng = np.random.default_rng(1)
    >>> touches = 10.0 * rng.standard_normal((12, 3))
    >>> quantisation_step(touches)
    0.0
    >>> round(quantisation_step(0.001 * np.round(touches / 0.001) + 0.0004), 9)
    0.001
    """
    axes = [_distinct(column, _EXACT) for column in np.asarray(positions, dtype=np.float64).T]
    axes = [values for values in axes if len(values) >= 3]
    if not axes:
        return 0.0
    exact = _common_divisor(np.concatenate([values[1:] - values[0] for values in axes]))
    if exact > LARGEST_STEP * 1.001:
        return 0.0  # a calculated pattern in round numbers
    reach = max(float(np.ptp(values)) for values in axes)
    for step in _candidates(exact):
        # A step found from the data is one of reach / step that could have been found.
        trials = reach / step if step == exact else 1.0
        log_chance = 0.0
        for values in axes:
            cells = _distinct(values, 0.5 * step)
            arc = _arc(np.mod(values / step, 1.0))
            if arc > _WIDEST_ARC:
                break
            free = 0.5 * (len(cells) - 1)
            log_chance += math.log(free + 1.0) + free * math.log(max(arc, _EXACT))
        else:
            if log_chance + math.log(trials * (len(_USUAL_STEPS) + 1)) < math.log(FALSE_STEP_LEVEL):
                return float(step)
    return 0.0


def repeat_step(values: npt.ArrayLike, groups: npt.ArrayLike) -> float:
    """The step in which repeated readings of one direction differ.

    It shows a latch that is quantised along the approach, where the axes do not show it.

    Parameters
    ----------
    values : (n,) float
        Readings along the direction. [mm]
    groups : (n,) int
        Number of the direction of each.

    Returns
    -------
    float
        The step; 0.0 if differences are continuous, or fewer than two of them are not zero. [mm]

    Notes
    -----
    Differences d of neighbours within a group are multiples of q: |d/q - round(d/q)| is at most
    0.2, and k differences that are not zero do this by chance with probability below (2 e)^k, e the
    largest of these deviations. Their chance to be found is below `FALSE_STEP_LEVEL`.

    >>> rng = np.random.default_rng(1)
    >>> readings, direction = rng.normal(0.0, 0.0005, 30), np.repeat(np.arange(10), 3)
    >>> repeat_step(readings, direction)
    0.0
    >>> round(repeat_step(0.001 * np.round(readings / 0.001) + 0.01 * direction**0.5, direction), 9)
    0.001
    """
    reading = np.asarray(values, dtype=np.float64)
    label = np.asarray(groups, dtype=np.int64)
    order = np.lexsort((reading, label))
    gap = np.diff(reading[order])[np.diff(label[order]) == 0]
    if np.count_nonzero(gap > _EXACT) < 2:
        return 0.0
    exact = _common_divisor(gap[gap > _EXACT])
    for step in _candidates(exact):
        apart = gap[gap > 0.5 * step]
        turns = gap / step
        deviation = float(np.max(np.abs(turns - np.round(turns))))
        if len(apart) < 2 or deviation > 0.5 * _WIDEST_ARC:
            continue
        trials = float(np.max(apart)) / step if step == exact else 1.0
        log_chance = len(apart) * math.log(max(2.0 * deviation, _EXACT))
        log_chance += math.log(trials * (len(_USUAL_STEPS) + 1))
        if log_chance < math.log(FALSE_STEP_LEVEL):
            return float(step)
    return 0.0


def tied_step(values: npt.ArrayLike, groups: npt.ArrayLike) -> float:
    """The step of readings of which some are equal to the last digit.

    Continuous readings are never equal. Unlike `repeat_step`, it needs no proof that the step is
    not chance: it is for series that are too short for one.

    Parameters
    ----------
    values : (n,) float
        Readings. [mm]
    groups : (n,) int
        Number of the series of each.

    Returns
    -------
    float
        The largest step of which all differences within a series are multiples, which can be a
        multiple of the true one; 0.0 if no two readings of a series are equal, or all are. [mm]

    >>> round(tied_step([4.6375, 4.65, 4.65, 4.65], [0, 0, 0, 0]), 9)
    0.0125
    >>> tied_step([4.6375, 4.6512, 4.65], [0, 0, 0])
    0.0
    """
    reading = np.asarray(values, dtype=np.float64)
    label = np.asarray(groups, dtype=np.int64)
    order = np.lexsort((reading, label))
    gap = np.diff(reading[order])[np.diff(label[order]) == 0]
    apart = gap[gap > _EXACT]
    if len(apart) in (0, len(gap)):
        return 0.0
    return _common_divisor(apart)


def _candidates(exact: float) -> list[float]:
    """Steps to test, the largest first.

    A usual step that exact multiples show only roughly must be at least four of their step: then
    their divisor is that of a rounding after the latch, such as the last digit of a file.
    """
    usual = [step for step in _USUAL_STEPS if step > 3.999 * exact]
    return [*usual, exact] if exact > 0.0 else usual


def _distinct(values: FloatArray, nearest: float) -> FloatArray:
    """Sorted values, without those closer than this to the value before."""
    ordered = np.sort(values)
    return ordered[np.concatenate(([True], np.diff(ordered) > nearest))]


def _arc(phases: FloatArray) -> float:
    """Length of the smallest arc that holds all phases, in turns."""
    ordered = np.sort(phases)
    gaps = np.append(np.diff(ordered), 1.0 + ordered[0] - ordered[-1])
    return 1.0 - float(np.max(gaps))


def _common_divisor(differences: FloatArray) -> float:
    """Largest number of which all differences are multiples, to rounding; 0.0 without one."""
    rest = np.abs(differences)
    chain: list[float] = []
    while True:
        chain.append(float(np.min(rest)))
        if chain[-1] < 0.99 * SMALLEST_STEP:
            return 0.0
        remainder = np.mod(rest, chain[-1])
        remainder = np.minimum(remainder, chain[-1] - remainder)
        remainder = remainder[remainder > _EXACT]
        if len(remainder) == 0:
            break
        rest = np.append(remainder, chain[-1])
    # Errors of rounding grow along the chain; the way back takes the last digits from its start.
    divisor = chain[-1]
    for multiple in chain[::-1]:
        divisor = multiple / round(multiple / divisor)
    turns = np.round(np.abs(differences) / divisor)
    return float(turns @ np.abs(differences)) / float(turns @ turns)
