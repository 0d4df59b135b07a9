"""Which few touches on the reference reduce the uncertainty of a map most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray, PretravelError, azimuth_angle, frozen
from pretravel.maps import PretravelMap
from pretravel.qualification.probe_drift import (
    DriftedMap,
    ProbeDrift,
    drifted_map,
    spread_over_support,
)

FEWEST_TOUCHES = {3: 5, 2: 4}
"""Directions that a sphere (three coordinates of the centre) and a ring need."""
_CANDIDATES = 400
_UNKNOWN_CENTRE = 1.0
"""Standard deviation of the centre before the touches; far above every pretravel. [mm]"""
_CENTRE_WEIGHT = 0.01
"""Of the variance of the centre in addition to the mean variance of the map."""
_PASSES = 20
_ORDERS = 4000
_EQUAL = 1e-8
"""Relative difference below which two choices are equally good: mirror images of each other differ
by rounding, which depends on the processor. The first is taken."""
_FLAT = 0.05
"""Extent of the directions across a plane, over that along it, below which they lie in it."""


@dataclass(frozen=True, eq=False)
class TouchPlan:
    """Directions for the next touches, and what they are expected to bring.

    Attributes
    ----------
    directions : (count, 3) float
        Probe frame, in the order in which to touch them.
    normals : (count, 3) float
        The same in the machine frame.
    prior : DriftedMap
        The old map and the drift since it was made.
    places : (m, 3) float
        Directions, probe frame, over which the uncertainty is made small.
    u_before, u_after : (m,) float
        Expected standard uncertainty of the map there, apart from a shift of all points: today
        without new touches, and with these. [mm]
    u_old : (m,) float
        That of the old map when it was made. [mm]
    u_updated : (d,) float
        What the updated map is expected to give over all of its directions. [mm]
    """

    directions: FloatArray
    normals: FloatArray
    prior: DriftedMap
    places: FloatArray
    u_before: FloatArray
    u_after: FloatArray
    u_old: FloatArray
    u_updated: FloatArray


def plan_touches(
    old_map: PretravelMap,
    count: int = 9,
    *,
    normals: FloatArray | None = None,
    ring: bool = False,
    drift: ProbeDrift = ProbeDrift(),
) -> TouchPlan:
    """Choose the directions whose touches keep an old map good.

    Parameters
    ----------
    old_map : PretravelMap
        It states its uncertainty and follows the probe: kind harmonic or physical.
    count : int
        Number of touches, each in a direction of its own; five at least, on a ring four.
    normals : (m, 3) float, optional
        Directions for which the map is needed, machine frame; all that the map supports if not
        given.
    ring : bool
        The reference is a ring.
    drift : ProbeDrift
        What may have changed since the old map was made.

    Raises
    ------
    PretravelError
        Too few or too many touches; a map that cannot be updated.
    ExtrapolationError
        Normals outside the map.

    Notes
    -----
    I-optimal: the mean variance of the updated map over the normals is made small, by greedy
    choice among directions spread over the support and exchange of single directions until no
    exchange helps. Every variance follows from one update of rank one. The position of the
    reference is unknown and is determined by the same touches; its variance counts one hundredth,
    so that it is determined too.

    References
    ----------
    Fedorov, Theory of Optimal Experiments, 1972 (exchange); Atkinson, Donev and Tobias, Optimum
    Experimental Designs, with SAS, 2007.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.harmonic import HarmonicBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> old = PretravelMap(
    ...     HarmonicBasis(np.array([[0, 0], [3, 3]])), np.array([0.010, 0.001]),
    ...     Covariance.independent([1e-8, 1e-8]), DirectionSupport(sphere_pattern_25()),
    ...     tip_radius=3.0, repeatability=3e-4)
    >>> plan = plan_touches(old, 6)
    >>> len(plan.directions), bool(np.all(plan.u_after <= plan.u_before))
    (6, True)
    """
    prior = drifted_map(old_map, drift, ring=ring)
    candidates = _candidates(old_map, ring)
    _refuse_count(count, prior.axes, len(candidates))
    if normals is None:
        places = spread_over_support(old_map, _CANDIDATES)
    else:
        old_map.pretravel(normals)  # refuses normals outside the map
        places = old_map.probe_directions(normals)
    problem = _Problem.of(prior, candidates, places)
    chosen = _exchanged(problem, _greedy(problem, count))
    order = _varied_order(candidates[chosen])
    directions = candidates[chosen][order]
    size = old_map.basis.size
    with_centre = problem.covariance_after(chosen)
    after = with_centre[:size, :size]
    return TouchPlan(
        directions=frozen(directions),
        normals=frozen(directions @ old_map.rotation.T),
        prior=prior,
        places=frozen(places),
        u_before=frozen(np.sqrt(prior.variance(places, prior.covariance))),
        u_after=frozen(np.sqrt(prior.variance(places, after))),
        u_old=frozen(np.sqrt(prior.variance(places, old_map.covariance.matrix))),
        u_updated=frozen(_u_updated(prior, with_centre)),
    )


def _u_updated(prior: DriftedMap, with_centre: FloatArray) -> FloatArray:
    """As the old map has it: seen from the centre that the touches give, or without a shift."""
    axes = prior.axes
    stated = (
        np.hstack([np.eye(len(prior.shift)), -prior.shift])
        if prior.from_center
        else np.hstack([prior.without_shift, np.zeros((len(prior.shift), axes))])
    )
    old_map = prior.pretravel_map
    design = old_map.basis.design(old_map.support.spread) @ stated
    return np.asarray(np.sqrt(np.maximum(np.sum((design @ with_centre) * design, axis=1), 0.0)))


def _candidates(old_map: PretravelMap, ring: bool) -> FloatArray:
    found = spread_over_support(old_map, _CANDIDATES)
    # Within the support itself, not within its margin: the edge is touched, nothing beyond it.
    inside = old_map.support.supports(found, 1e-6)
    if ring:
        inside &= np.abs(found[:, 2]) < 1e-3
        around = 2.0 * np.pi * np.arange(120) / 120
        ring_directions = np.column_stack([np.cos(around), np.sin(around), 0.0 * around])
        held = old_map.support.supports(ring_directions, 1e-6)
        return np.concatenate([found[inside], ring_directions[held]])
    return np.asarray(found[inside])


def _refuse_count(count: int, axes: int, candidates: int) -> None:
    fewest = FEWEST_TOUCHES[axes]
    if count < fewest:
        raise PretravelError(
            f"{count} touches are too few: the centre of the reference alone takes {axes}; plan "
            f"at least {fewest}",
            inputs=("count",),
        )
    if count > candidates // 2:
        raise PretravelError(
            f"{count} touches are more than a choice of directions can help; plan at most "
            f"{candidates // 2}, or qualify again",
            inputs=("count",),
        )


@dataclass(frozen=True, eq=False)
class _Problem:
    """Unknowns are the coefficients of the map and the centre."""

    candidates: FloatArray
    rows: FloatArray
    """What a touch in each candidate direction observes, (c, k + axes)."""
    covariance: FloatArray
    """Before the touches."""
    aim: FloatArray
    """Mean variance of the map = trace of this matrix times the covariance."""
    noise: float
    """Variance of a touch. [mm²]"""

    @classmethod
    def of(cls, prior: DriftedMap, candidates: FloatArray, places: FloatArray) -> _Problem:
        old, axes = prior.pretravel_map, prior.axes
        size = old.basis.size
        rows = np.hstack([old.basis.design(candidates), -candidates[:, :axes]])
        covariance = np.zeros((size + axes, size + axes))
        covariance[:size, :size] = prior.covariance
        covariance[size:, size:] = _UNKNOWN_CENTRE**2 * np.eye(axes)
        wanted = old.basis.design(places) @ prior.without_shift
        aim = np.zeros_like(covariance)
        aim[:size, :size] = wanted.T @ wanted / len(places)
        # The centre in the convention of the map: what a shift takes from the map it gives to it.
        centre = np.hstack([-prior.shift_of, np.eye(axes)])
        aim += _CENTRE_WEIGHT * centre.T @ centre
        noise = old.repeatability**2 + float(getattr(old, "fixed_scatter", 0.0)) ** 2
        return cls(candidates, rows, covariance, aim, max(noise, 1e-12))

    def gains(self, covariance: FloatArray) -> FloatArray:
        """Decrease of the aim by one touch more in each candidate direction, (c,)."""
        carried = self.rows @ covariance
        own = np.sum(carried * self.rows, axis=1)
        return np.asarray(np.sum((carried @ self.aim) * carried, axis=1) / (own + self.noise))

    def touched(self, covariance: FloatArray, candidate: int) -> FloatArray:
        """The covariance after one touch more."""
        gain = covariance @ self.rows[candidate]
        own = float(self.rows[candidate] @ gain)
        return np.asarray(covariance - np.outer(gain, gain) / (own + self.noise))

    def covariance_after(self, chosen: IntArray) -> FloatArray:
        """The covariance after touches in the chosen directions."""
        rows = self.rows[chosen]
        gain = self.covariance @ rows.T
        seen = rows @ gain + self.noise * np.eye(len(rows))
        return np.asarray(self.covariance - gain @ np.linalg.solve(seen, gain.T))

    def value(self, covariance: FloatArray) -> float:
        return float(np.sum(self.aim * covariance))


def _greedy(problem: _Problem, count: int) -> IntArray:
    covariance, chosen = problem.covariance, list[int]()
    for _ in range(count):
        gains = problem.gains(covariance)
        gains[chosen] = -np.inf
        chosen.append(_first_of_largest(gains))
        covariance = problem.touched(covariance, chosen[-1])
    return np.array(chosen, dtype=np.int64)


def _exchanged(problem: _Problem, chosen: IntArray) -> IntArray:
    """Exchange directions one at a time, as long as that helps."""
    best = problem.value(problem.covariance_after(chosen))
    for _ in range(_PASSES):
        before = best
        for position in range(len(chosen)):
            others = np.delete(chosen, position)
            without = problem.covariance_after(others)
            gains = problem.gains(without)
            gains[others] = -np.inf
            gains[_in_one_plane(problem.candidates, others)] = -np.inf
            candidate = _first_of_largest(gains)
            value = problem.value(without) - float(gains[candidate])
            if value < best * (1.0 - _EQUAL):
                best, chosen = value, chosen.copy()
                chosen[position] = candidate
        if best > before * (1.0 - 1e-6):
            break
    return chosen


def _first_of_largest(gains: FloatArray) -> int:
    return int(np.argmax(gains >= (1.0 - _EQUAL) * gains.max()))


def _in_one_plane(candidates: FloatArray, others: IntArray) -> BoolArray:
    """Whether each candidate lies in one plane with all of the others, (c,).

    Two others and any candidate do: then none is refused.
    """
    if len(others) < 3:
        return np.zeros(len(candidates), dtype=bool)
    given = candidates[others]
    middle = given.mean(axis=0)
    extent, axes = np.linalg.svd(given - middle)[1:]
    if np.allclose(candidates[:, 2], 0.0, atol=1e-2) or extent[-1] > _FLAT * extent[0]:
        return np.zeros(len(candidates), dtype=bool)  # a ring is touched in one plane
    return np.asarray(np.abs((candidates - middle) @ axes[-1]) < 3.0 * _FLAT)


def _varied_order(directions: FloatArray) -> IntArray:
    """An order in which touches come from all sides, not always from one.

    Hysteresis depends on the touch before. Among random orders the one is taken in which the
    turns of azimuth from touch to touch are distributed most evenly.
    """
    generator = np.random.default_rng(1)
    azimuth = azimuth_angle(directions)
    orders = generator.permuted(np.tile(np.arange(len(directions)), (_ORDERS, 1)), axis=1)
    turns = np.diff(azimuth[orders], axis=1)
    uneven = sum(np.abs(np.exp(1j * k * turns).mean(axis=1)) ** 2 for k in (1, 2, 3))
    # An order and its reverse are equal.
    return np.asarray(orders[int(np.argmax(uneven <= uneven.min() + _EQUAL))], dtype=np.int64)
