"""Residuals, slopes and priors of a six-seat fit, from their definitions with dense matrices."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.six_seats import six_seat_fit
from pretravel.six_seats.hertz import curved_part_factor
from pretravel.six_seats.six_seat_fit import (
    PriorScales,
    SixSeatProblem,
    _Weighted,
    modes,
    most_probable,
    promised_gain,
)
from pretravel.six_seats.uneven_seats import PARAMETERS, six_seat_response
from tests.support.six_seat_unknowns import ANGLE, PRIORS, parameters_of

CASES = ["sphere", "tip unknown", "ring"]
REPEATS = np.array([1, 2, 3, 1, 2, 1, 1, 4, 1, 2, 1, 1, 2])
SCALES = PriorScales(0.4, 0.7e-3, 0.2e-3, 0.5e-3)
LEVEL = 2.5e-3


def _observation(case: str) -> Observation:
    """Thirteen directions with one to four touches each, 10 µm of pretravel, more or less 2 µm."""
    groups = np.repeat(np.arange(13), REPEATS)
    values = 0.010 + 0.002 * np.cos(1.7 * np.arange(len(groups)))
    center = np.array([3.0, -4.0, 5.0])
    if case == "ring":
        azimuth = 0.1 + np.arange(13) * 0.47
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)[groups]
        positions = center + outward * (20.0 - 2.5 + values)[:, None]
        return Observation(positions, groups, center, 20.0, 2.5, ring=True, u_constant=3e-4)
    n = fibonacci_cap(13, math.radians(95.0))[groups]
    positions = center + n * (12.5 + 2.5 - values)[:, None]
    return Observation(
        positions, groups, center, 12.5, 2.5, ring=False, tip_known=case == "sphere",
        u_constant=3e-4,
    )  # fmt: skip


def _place(case: str) -> np.ndarray:
    """Unknowns beside their priors: a shift, a level where the tip is open, 18 parameters."""
    shift = [0.9e-3, -1.3e-3] if case == "ring" else [0.9e-3, -1.3e-3, 2.1e-3]
    level = [LEVEL] if case == "tip unknown" else []
    spread = np.array([min(p.spread, 0.5) for p in PARAMETERS])
    parameters = np.array(PRIORS) + 0.3 * spread * np.sin(np.arange(18) + 1)
    return np.concatenate([shift, level, parameters])


def _by_hand(case: str, x: np.ndarray) -> np.ndarray:
    """Observed less modelled pretravel of the mean touch of each direction, one by one."""
    seen, axes = _observation(case), 2 if case == "ring" else 3
    response = six_seat_response(parameters_of(x), 2.5)
    bend = [-1.0 / 20.0, 0.0] if case == "ring" else [1.0 / 12.5, 1.0 / 12.5]
    factor = float(curved_part_factor(2.5, np.array([bend]))[0])
    found = []
    for group in range(13):
        place = seen.positions[seen.groups == group].mean(axis=0) - seen.center
        place[:axes] -= x[:axes]
        place[axes:] = 0.0
        distance = math.hypot(*place)
        normal = (-1.0 if case == "ring" else 1.0) * place[None] / distance
        value = distance - (20.0 - 2.5) if case == "ring" else 12.5 + 2.5 - distance
        force, _ = response.force(normal)
        along = float(np.sum(response.deflection(normal, force) * normal))
        modelled = along + factor * float(response.tip_approach(force)[0])
        found.append(value + (x[3] if case == "tip unknown" else 0.0) - modelled)
    return np.array(found)


def _dense(problem: SixSeatProblem, scales: PriorScales) -> np.ndarray:
    """Covariance of the mean touches: scatter, and a correction whose terms add up."""
    degree = np.maximum(problem.terms[:, 0], 2)
    shares = 1.0 / degree**3.0
    variances = scales.correction**2 * shares / shares.sum()
    variances[0] += 3e-4**2  # of the reference's radius
    functions = real_spherical_harmonics(_group_directions(problem), problem.terms)
    own = scales.fixed_scatter**2 + scales.noise**2 / REPEATS
    return np.asarray((functions * variances) @ functions.T + np.diag(own))


def _group_directions(problem: SixSeatProblem) -> np.ndarray:
    seen = problem.observation
    return np.array([seen.directions[seen.groups == group][0] for group in range(13)])


def _spread(asymmetry: float) -> np.ndarray:
    """Seven parameters of the ideal probe, then eleven of its asymmetry."""
    return np.array([p.spread * (asymmetry if i >= 7 else 1.0) for i, p in enumerate(PARAMETERS)])


@pytest.mark.parametrize("case", CASES)
def test_misses_are_those_of_each_mean_touch(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one block as in blocks of five; slopes are differences of the misses. A shift counts as
    n·s: that the direction turns too, by s over 15 mm, is left out."""
    problem, x = SixSeatProblem(_observation(case)), _place(case)
    sizes = {"sphere": (3, 3, 21, 5), "tip unknown": (3, 4, 22, 6), "ring": (2, 2, 20, 4)}[case]
    assert (problem.axes, problem.extra, problem.size, problem.azimuth) == sizes
    assert problem.count.tolist() == REPEATS.tolist()
    assert problem.prior.tolist() == [0.0] * problem.extra + PRIORS
    misses, slopes = problem.misses(x)
    # The response smooths Hertz's law below a micronewton, by less than 0.01 nm.
    assert misses == pytest.approx(_by_hand(case, x), abs=1e-11)
    step = 1e-6
    normals = problem.moved(x).group_directions
    assert slopes[:, : problem.axes] == pytest.approx(normals[:, : problem.axes], abs=1e-6)
    for column, unit in list(enumerate(np.eye(len(x))))[problem.axes :]:
        change = (_by_hand(case, x + step * unit) - _by_hand(case, x - step * unit)) / (2.0 * step)
        assert slopes[:, column] == pytest.approx(change, abs=2e-6 * (1.0 + np.abs(change).max()))
    monkeypatch.setattr(six_seat_fit, "_BLOCK", 5)
    blocks = SixSeatProblem(_observation(case)).misses(x)
    assert blocks[0] == pytest.approx(misses, abs=1e-14)
    assert blocks[1] == pytest.approx(slopes, abs=1e-12)


def test_terms_of_the_correction() -> None:
    """On a sphere all harmonics of degree eight but the first, 81 - 3. In a ring two for each order
    from the second to the sixteenth, which are cosine and sine there, beside the mean."""
    sphere = SixSeatProblem(_observation("sphere")).terms.tolist()
    expected = [[n, m] for n in range(9) for m in range(-n, n + 1) if n != 1]
    assert sorted(sphere) == sorted(expected)
    assert sphere[0] == [0, 0]
    ring = SixSeatProblem(_observation("ring"))
    expected = [[0, 0]] + [[m, m * sign] for m in range(2, 17) for sign in (-1, 1)]
    assert sorted(ring.terms.tolist()) == sorted(expected)
    assert ring.terms[0].tolist() == [0, 0]
    azimuth = np.arctan2(*_group_directions(ring).T[1::-1])
    for (_, order), values in list(zip(ring.terms, ring.harmonics.T, strict=True))[1:]:
        wave = np.cos(order * azimuth) if order >= 0 else np.sin(-order * azimuth)
        assert abs(np.corrcoef(wave, values)[0, 1]) > 1.0 - 1e-9


def _squares(case: str, x: np.ndarray, inverse: np.ndarray) -> float:
    """Of the misses by their covariance, and of the parameters by their priors."""
    misses = _by_hand(case, x)
    own = (x[-18:] - PRIORS) / _spread(0.4)
    return float(misses @ inverse @ misses + own @ own)


@pytest.mark.parametrize("case", CASES)
def test_the_cost_has_the_covariance_of_touches_and_the_priors(case: str) -> None:
    """Half of m' C⁻¹ m and of the squares of the priors; the gradient by differences, the matrix
    from the slopes; of several places at a time what they have alone."""
    problem, x = SixSeatProblem(_observation(case)), _place(case)
    inverse = np.linalg.inv(_dense(problem, SCALES))
    places = np.tile(x, (4, 1))
    places[:, problem.azimuth] += [0.0, 0.2, -0.1, 0.0]
    weighted = _Weighted(
        problem, [SCALES, SCALES, PriorScales(0.4, 0.7e-3, 0.1e-3, 0.9e-3), SCALES]
    )
    cost, gradient, matrix = weighted.evaluated(places, np.arange(4))
    for number in (0, 1, 3):
        assert cost[number] == pytest.approx(
            0.5 * _squares(case, places[number], inverse), rel=1e-7
        )
    assert cost[2] != pytest.approx(0.5 * _squares(case, places[2], inverse), rel=1e-2)
    for column, unit in enumerate(np.eye(len(x))):
        change = _squares(case, x + 1e-6 * unit, inverse) - _squares(case, x - 1e-6 * unit, inverse)
        turning = 1e-2 if column < problem.axes else 1e-4  # of the direction with the centre
        assert gradient[0, column] == pytest.approx(change / 4e-6, rel=turning)
    slopes = problem.misses(x)[1]
    priors = np.zeros(problem.size)
    priors[problem.extra :] = 1.0 / _spread(0.4) ** 2
    expected = slopes.T @ inverse @ slopes + np.diag(priors)
    assert matrix[0] == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())
    alone = weighted.evaluated(places[2:3], np.array([2]))
    for together, one in zip((cost, gradient, matrix), alone, strict=True):
        assert one[0] == pytest.approx(together[2], rel=1e-10)


def test_the_angle_of_the_seats_is_neither_flat_nor_upright() -> None:
    """Any unknowns are an angle between 0 and 90°, and its rate is that of differences."""
    problem, x = SixSeatProblem(_observation("sphere")), _place("sphere")
    place = problem.extra + ANGLE
    for unknown in (-50.0, -3.0, -0.36, 0.0, 2.0, 50.0):
        x[place] = unknown
        assert 0.0 < problem.parameters(x)[ANGLE] < 0.5 * math.pi
    x[place] = 0.7
    step = 1e-5 * np.eye(len(x))[place]
    difference = problem.parameters(x + step) - problem.parameters(x - step)
    assert problem.rates(x)[ANGLE] == pytest.approx(difference[ANGLE] / 2e-5, rel=1e-8)
    assert np.count_nonzero(difference) == 1


def test_numbers_that_are_no_probe_are_infinitely_far() -> None:
    """A spring 1.5 radii beside the axis lifts a rod; a seat that pushes down; never a trigger."""
    problem, x = SixSeatProblem(_observation("sphere")), _place("sphere")
    wrong = np.tile(x, (4, 1))
    wrong[0, problem.extra + 7] = 1.5
    wrong[1, problem.extra + 13] = 3.0
    wrong[2, problem.extra] = 1e9
    with np.errstate(all="raise", under="ignore"):
        cost, _, matrix = _Weighted(problem, [SCALES] * 4).evaluated(wrong, np.arange(4))
    assert np.isinf(cost).tolist() == [True, True, True, False]
    assert np.all(np.isfinite(matrix))
    found = modes(problem, [SCALES] * 4, wrong)
    assert np.array_equal(found.x[:3], wrong[:3])
    assert np.isneginf(found.evidence).tolist() == [True, True, True, False]


def test_the_evidence_is_that_of_a_normal_distribution() -> None:
    """Of the linear model about the mode: touches are normal about the prior's mean, with the
    covariance of touches and priors together, and unknowns without a prior have a wide one."""
    problem = SixSeatProblem(_observation("sphere"))
    other = PriorScales(1.0, 0.2e-3, 0.1e-3, 0.5e-3)
    found = modes(problem, [SCALES, other], np.tile(_place("sphere"), (2, 1)))
    expected = []
    for x, scales in zip(found.x, (SCALES, other), strict=True):
        misses, slopes = problem.misses(x)
        spread = np.array(
            [p.spread * (scales.asymmetry if i >= 7 else 1.0) for i, p in enumerate(PARAMETERS)]
        )
        spread = np.concatenate([np.full(3, 10.0), spread])
        before = np.concatenate([np.zeros(3), PRIORS - x[3:]])
        degree = np.maximum(problem.terms[:, 0], 2)
        variances = scales.correction**2 / degree**3.0 / np.sum(1.0 / degree**3.0)
        variances[0] += 3e-4**2
        functions = real_spherical_harmonics(_group_directions(problem), problem.terms)
        total = (functions * variances) @ functions.T + (slopes * spread**2) @ slopes.T
        total += np.diag(scales.fixed_scatter**2 + scales.noise**2 / REPEATS)
        expected.append(multivariate_normal(cov=total).logpdf(misses + slopes @ before))
    # A prior of 10 mm is wide as none; it is the same at both scales. At an edge the linear model
    # promises more than was reached.
    reached = found.evidence + [
        promised_gain(problem, scales, x)
        for x, scales in zip(found.x, (SCALES, other), strict=True)
    ]
    assert np.diff(reached) == pytest.approx(np.diff(expected), abs=1e-3)


@pytest.mark.parametrize("case", CASES)
def test_the_cost_is_that_of_the_place_that_is_found(case: str) -> None:
    """The cost is half of the sum of squares at the place that is stated, and less than at the
    start."""
    problem = SixSeatProblem(_observation(case))
    inverse = np.linalg.inv(_dense(problem, SCALES))
    best, cost = most_probable(problem, SCALES, _place(case))
    misses = _by_hand(case, best)
    own = (best[-18:] - PRIORS) / _spread(0.4)
    assert cost == pytest.approx(0.5 * float(misses @ inverse @ misses + own @ own), rel=1e-7)
    assert cost < 0.5 * _squares(case, _place(case), inverse)


def test_a_search_ends_after_its_evaluations() -> None:
    problem, start = SixSeatProblem(_observation("sphere")), _place("sphere")
    costs = [most_probable(problem, SCALES, start, number)[1] for number in (1, 3, 100)]
    assert costs[0] > 1.001 * costs[1]
    assert costs[1] > 1.001 * costs[2]


def test_a_tip_that_does_not_fit_into_the_ring_is_compressed_as_on_a_flat() -> None:
    observation = SimpleNamespace(
        axes=2, tip_known=True, groups=np.zeros(1, dtype=int), positions=np.zeros((1, 3)),
        reference_radius=2.9, ring=True, tip_radius=3.0,
    )  # fmt: skip
    problem = SixSeatProblem(cast("Any", observation))
    assert problem._compression == pytest.approx(1.0, rel=1e-12)
