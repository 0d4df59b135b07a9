"""The step of a latch: positions that a machine reports in multiples of a step only.

The error of such a position is that of rounding, with the variance q²/12 of a step q. It is the
same in every repeat if the scatter is much smaller than the step: repeats do not reduce it then.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import INCH, FloatArray, PretravelError

SMALLEST_STEP, LARGEST_STEP = 1e-5, 0.26
"""Steps that are looked for: a smaller one does not matter, a larger one no display has. [mm]"""
COARSE_STEP, COARSEST_STEP = 2e-3, 2e-2
"""Steps from which people are warned, and from which nothing is said of a probe. Pretravel varies
by some micrometres over the directions: positions whose step is several times as much do not show
it. [mm]"""
_USUAL_VARIATION = 1e-3
"""By which touches in different directions differ in addition to the step. [mm]"""
FALSE_STEP_LEVEL = 1e-4
"""Largest probability that continuous positions are reported as quantised."""
_LARGEST_PHASED = 5e-3
"""Larger steps must be exact: in patterns with symmetry, touches whose pretravel differs by
micrometres have nearly the same phases. [mm]"""


def _usual_steps(largest: float) -> tuple[float, ...]:
    """Steps of scales and displays, the largest first. [mm]"""
    found = {
        unit * 10.0**exponent * digit
        for unit in (1.0, INCH)
        for exponent in range(-7, 0)
        for digit in (1.0, 1.25, 2.0, 2.5, 5.0)
    }
    return tuple(
        sorted((s for s in found if SMALLEST_STEP * 0.999 <= s <= largest * 1.001), reverse=True)
    )


_USUAL_STEPS = _usual_steps(_LARGEST_PHASED)
"""Also found where the multiples are not exact."""
_WRITTEN_STEPS = tuple(step for step in _usual_steps(LARGEST_STEP) if step > 0.999e-3)
"""Of which all numbers of a file can be multiples."""
_WIDEST_ARC = 0.4
"""Share of a step in which all phases must lie; twice the step has them in an arc of 0.5."""
_PRINTED = 5.5e-4
"""Of inches that were converted to millimetres with three decimals. [mm]"""
_EXACT = 1e-7
"""Remainders below this are rounding of numbers, not of a latch. [mm]"""
_OF_DIGIT = 1e-4
"""Of the last digit, within which a number has so many decimals."""
_OF_SMALLEST = 0.01
"""Share of the smallest difference below which the last digit is finer than the step."""


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
    positions = np.asarray(positions, dtype=np.float64)
    axes = [_distinct(column, _EXACT) for column in positions.T]
    axes = [values for values in axes if len(values) >= 3]
    digits = _step_of_numbers(positions)
    if not axes:
        return digits
    exact = _common_divisor(np.concatenate([values[1:] - values[0] for values in axes]))
    if exact > LARGEST_STEP * 1.001:
        return digits  # touches that lie evenly about a centre: their differences are its radius
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
                return float(max(step, digits))
    return digits


def _step_of_numbers(positions: npt.ArrayLike) -> float:
    """The largest usual step of which all coordinates are multiples themselves; 0.0 without one.

    Few touches on a sphere lie evenly about its centre, so that their differences are multiples of
    its radius and show no step. Their numbers do: continuous ones are no multiples of 0.01 mm.
    """
    values = np.unique(np.abs(np.asarray(positions, dtype=np.float64)))
    values = values[values > _EXACT]
    for step in _WRITTEN_STEPS if len(values) > 1 and np.size(positions) > 9 else ():
        inch = abs(step / INCH * 1e5 - round(step / INCH * 1e5)) < 1e-6
        log_chance = len(values) * math.log(2.0 * _PRINTED / step)
        shown = step > _LARGEST_PHASED and log_chance < math.log(FALSE_STEP_LEVEL)
        printed = _PRINTED if inch and shown else _EXACT
        if np.all(np.abs(values - step * np.round(values / step)) < printed):
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
    return _common_divisor(apart, _last_digits(reading, float(apart.min())))


def _last_digits(values: FloatArray, smallest: float) -> float:
    """What rounding to the last printed digit changes a difference by, next to the smallest one.

    A step that is not a round number, such as 2 mm / 3003, shows so in rounded values.
    """
    for decimals in range(3, 10):
        scaled = values * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) < _OF_DIGIT):
            rounding = 1.5 * 10.0**-decimals
            return max(rounding, _EXACT) if rounding < _OF_SMALLEST * smallest else _EXACT
    return _EXACT


def step_of_touches(
    positions: npt.ArrayLike, values: npt.ArrayLike = (), groups: npt.ArrayLike = ()
) -> float:
    """The step of touches, by their coordinates or their repeats; zero where none is seen. [mm]

    Parameters
    ----------
    positions : (n, 3) float
        In the machine's axes. [mm]
    values : (n,) float
        Along the direction of each. [mm]
    groups : (n,) int
        Number of the direction of each.
    """
    by_repeats = repeat_step(values, groups) if np.size(groups) else 0.0
    return max(quantisation_step(positions), by_repeats)


def step_of_measured(positions: npt.ArrayLike, normals: npt.ArrayLike) -> float:
    """The step of touches on a part, which is seen in what they measure. [mm]

    The coordinates across the normal are those of targets, which are round in most programs; and
    those of a simulation without noise repeat on each face. Neither shows a step.

    Parameters
    ----------
    positions, normals : (n, 3) float
        In the axes in which the machine reports positions. [mm]

    >>> rng = np.random.default_rng(1)
    >>> grid = np.stack([*np.meshgrid(np.arange(5) * 5.0, np.arange(5) * 5.0), np.zeros((5, 5))])
    >>> places, up = grid.reshape(3, -1).T + [0, 0, 2.99], np.tile([0.0, 0.0, 1.0], (25, 1))
    >>> height = rng.normal(0.0, 0.02, (25, 1)) * up
    >>> step_of_measured(places, up), step_of_measured(places + height, up)
    (0.0, 0.0)
    >>> step_of_measured(0.01 * np.round((places + height) / 0.01), up)
    0.01
    """
    apart = -(-len(np.asarray(positions)) // _MOST_LOOKED_AT)
    place = np.asarray(positions, dtype=np.float64)[::apart]
    along = np.argmax(np.abs(np.asarray(normals, dtype=np.float64)[::apart]), axis=1)
    measured = [place[along == axis, axis] for axis in range(3) if np.any(along == axis)]
    step = quantisation_step(place)
    differences = sum(len(_distinct(values, 0.5 * step + _EXACT)) - 1 for values in measured)
    if step == 0.0 or differences < _FEWEST_MEASURED:
        return 0.0
    gaps = np.concatenate([np.diff(np.sort(values)) for values in measured]) / step
    return step if np.all(np.abs(gaps - np.round(gaps)) < _WIDEST_ARC) else 0.0


_MOST_LOOKED_AT = 20_000
"""Touches that show a step as well as all of a long table do."""
_FEWEST_MEASURED = 3
"""Differences between measured coordinates that show a step."""


def step_of_readings(values: npt.ArrayLike) -> float:
    """The step of a scale that is read often while it moves; zero where none is seen. [mm]

    Parameters
    ----------
    values : (n,) float
        Readings, some of which are neighbours on the scale. [mm]

    >>> moved = np.linspace(0.0, 0.1, 500)
    >>> step_of_readings(moved + 1e-4 * np.sin(7e4 * moved))
    0.0
    >>> round(step_of_readings(0.01 * np.round(moved / 0.01)), 9)
    0.01
    """
    gaps = np.diff(_distinct(np.asarray(values, dtype=np.float64), _EXACT))
    return _common_divisor(gaps) if len(gaps) >= _FEWEST_MEASURED else 0.0


def kept_by_repeats(step: float, noise: float) -> float:
    """Standard deviation by a step that repeats of a direction do not reduce. [mm]

    Parameters
    ----------
    step : float
        [mm]
    noise : float
        Standard deviation among repeats; zero without repeats. [mm]

    >>> round(1e3 * kept_by_repeats(0.01, 0.0), 3), round(1e3 * kept_by_repeats(0.001, 0.001), 3)
    (2.887, 0.0)
    """
    share = math.exp(-((2.0 * math.pi * noise / step) ** 2)) if step else 0.0
    return step * math.sqrt(share / 12.0)


def kept_by_directions(step: float, noise: float) -> float:
    """Standard deviation by a step that all directions can have in common. [mm]

    On a sphere at a round place all touches are rounded alike, if they differ by less than the
    step: nothing in them shows it. It is what no residual can make smaller.

    >>> [round(1e3 * kept_by_directions(step, 0.0), 2) for step in (0.0254, 0.001)]
    [7.11, 0.0]
    """
    return kept_by_repeats(step, max(noise, _USUAL_VARIATION))


def refuse_coarse(step: float, what: str) -> None:
    """Refuse positions that do not show what is asked for.

    Raises
    ------
    PretravelError
        The step is larger than `COARSEST_STEP`.
    """
    if step > COARSEST_STEP:
        raise PretravelError(
            f"{what}: the positions are in steps of {1e3 * step:.4g} µm, and the pretravel of a "
            "probe is about 10 µm and varies by less: write the positions with more digits "
            "(0.001 mm or 0.0001 inch, better 0.0001 mm)"
        )


def coarse_warnings(step: float) -> list[str]:
    """What to know of a coarse step, as sentences."""
    if step < COARSE_STEP:
        return []
    return [
        (
            f"the positions are in steps of {1e3 * step:.4g} µm: scatter and lobes below that are "
            "not seen, and u contains the step. Write the positions with more digits"
        )
    ]


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


def _common_divisor(differences: FloatArray, exact: float = _EXACT) -> float:
    """Largest number of which all differences are multiples, to rounding; 0.0 without one."""
    rest = np.abs(differences)
    chain: list[float] = []
    while True:
        chain.append(float(np.min(rest)))
        if chain[-1] < 0.99 * SMALLEST_STEP:
            return 0.0
        remainder = np.mod(rest, chain[-1])
        remainder = np.minimum(remainder, chain[-1] - remainder)
        remainder = remainder[remainder > exact]
        if len(remainder) == 0:
            break
        rest = np.append(remainder, chain[-1])
    # Errors of rounding grow along the chain; the way back takes the last digits from its start.
    divisor = chain[-1]
    for multiple in chain[::-1]:
        divisor = multiple / round(multiple / divisor)
    turns = np.round(np.abs(differences) / divisor)
    return float(turns @ np.abs(differences)) / float(turns @ turns)
