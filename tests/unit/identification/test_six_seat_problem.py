"""Residuals, slopes and priors of a six-seat fit, from their definitions with dense matrices."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.prediction.hertz import curved_part_factor
from pretravel.six_seats import six_seat_fit
from pretravel.six_seats.six_seat_fit import (
    PriorScales,
    SixSeatProblem,
    _Weighted,
    most_probable,
)
from pretravel.six_seats.uneven_seats import PARAMETERS, six_seat_response

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
        return Observation(positions, groups, center, 20.0, 2.5, ring=True, u_reference_radius=3e-4)
    n = fibonacci_cap(13, math.radians(95.0))[groups]
    positions = center + n * (12.5 + 2.5 - values)[:, None]
    return Observation(
        positions, groups, center, 12.5, 2.5, ring=False, tip_known=case == "sphere",
        u_reference_radius=3e-4,
    )  # fmt: skip


def _place(case: str) -> np.ndarray:
    """Unknowns beside their priors: a shift, a level where the tip is open, 18 parameters."""
    shift = [0.9e-3, -1.3e-3] if case == "ring" else [0.9e-3, -1.3e-3, 2.1e-3]
    level = [LEVEL] if case == "tip unknown" else []
    spread = np.array([min(p.spread, 0.5) for p in PARAMETERS])
    parameters = np.array([p.prior for p in PARAMETERS]) + 0.3 * spread * np.sin(np.arange(18) + 1)
    return np.concatenate([shift, level, parameters])


def _by_hand(case: str, x: np.ndarray) -> np.ndarray:
    """Observed less modelled pretravel of the mean touch of each direction, one by one."""
    seen, axes = _observation(case), 2 if case == "ring" else 3
    response = six_seat_response(x[-18:], 2.5)
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
    assert problem.prior.tolist() == [0.0] * problem.extra + [p.prior for p in PARAMETERS]
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


@pytest.mark.parametrize("case", CASES)
def test_residuals_have_the_covariance_of_touches_and_priors(case: str) -> None:
    """Their squares add up to m' C⁻¹ m and the squares of the priors, at each place anew; the
    Jacobian is the derivative of the residuals."""
    problem, x = SixSeatProblem(_observation(case)), _place(case)
    inverse = np.linalg.inv(_dense(problem, SCALES))
    weighted = _Weighted(problem, SCALES)

    def squares(x: np.ndarray) -> float:
        misses = _by_hand(case, x)
        own = (x[-18:] - [p.prior for p in PARAMETERS]) / _spread(0.4)
        return float(misses @ inverse @ misses + own @ own)

    turned = x.copy()
    for angle in (0.0, 0.2, -0.1, 0.0):
        turned[:] = x
        turned[problem.azimuth] += angle  # in place: what was found before is not of this x
        found = weighted.residuals(turned)
        assert found @ found == pytest.approx(squares(turned), rel=1e-7)
    jacobian = weighted.jacobian(x)
    assert jacobian.shape == (13 + 18, problem.size)
    gradient = 2.0 * jacobian.T @ weighted.residuals(x)
    for column, unit in enumerate(np.eye(len(x))):
        change = (squares(x + 1e-6 * unit) - squares(x - 1e-6 * unit)) / 2e-6
        turning = 1e-2 if column < problem.axes else 1e-4  # of the direction with the centre
        assert gradient[column] == pytest.approx(change, rel=turning, abs=1e-3 * abs(change))
    assert jacobian[13:, problem.extra :] == pytest.approx(np.diag(1.0 / _spread(0.4)))
    assert np.all(jacobian[13:, : problem.extra] == 0.0)


@pytest.mark.parametrize("case", CASES)
def test_slopes_are_those_of_the_place_that_is_asked_for(case: str) -> None:
    problem, x = SixSeatProblem(_observation(case)), _place(case)
    whitening = np.linalg.inv(np.linalg.cholesky(_dense(problem, SCALES)))
    weighted = _Weighted(problem, SCALES)
    weighted.residuals(problem.prior)
    jacobian = weighted.jacobian(x)[:13]
    expected = whitening @ problem.misses(x)[1]
    assert jacobian.T @ jacobian == pytest.approx(expected.T @ expected, rel=1e-6)


def test_numbers_that_are_no_probe_are_a_millimetre_away() -> None:
    """A spring 1.5 radii beside the axis lifts a rod: every miss is 1 mm, without slopes."""
    problem, x = SixSeatProblem(_observation("sphere")), _place("sphere")
    x[problem.extra + 7] = 1.5
    weighted = _Weighted(problem, SCALES)
    inverse = np.linalg.inv(_dense(problem, SCALES))
    own = (x[-18:] - [p.prior for p in PARAMETERS]) / _spread(0.4)
    found = weighted.residuals(x)
    assert found @ found == pytest.approx(float(inverse.sum() + own @ own), rel=1e-7)
    assert np.all(weighted.jacobian(x)[:13] == 0.0)


def test_directions_that_never_trigger_are_a_millimetre_away(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without slopes; the other directions keep theirs."""
    problem, x = SixSeatProblem(_observation("sphere")), _place("sphere")
    misses, slopes = problem.misses(x)
    never = np.arange(13) % 5 == 1
    infinite = np.where(np.arange(13) == 1, np.nan, -np.inf)
    told = np.where(never, infinite, misses), np.where(never[:, None], np.nan, slopes)
    monkeypatch.setattr(problem, "misses", lambda _: told)
    inverse = np.linalg.inv(_dense(problem, SCALES))
    weighted = _Weighted(problem, SCALES)
    expected = np.where(never, 1.0, misses)
    own = (x[-18:] - [p.prior for p in PARAMETERS]) / _spread(0.4)
    found = weighted.residuals(x)
    assert found @ found == pytest.approx(float(expected @ inverse @ expected + own @ own))
    jacobian = weighted.jacobian(x)[:13]
    kept = np.where(never[:, None], 0.0, slopes)
    assert jacobian.T @ jacobian == pytest.approx(kept.T @ inverse @ kept, rel=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_the_cost_is_that_of_the_place_that_is_found(case: str) -> None:
    """The cost is half of the sum of squares at the place that is stated, and less than at the
    start."""
    problem = SixSeatProblem(_observation(case))
    inverse = np.linalg.inv(_dense(problem, SCALES))
    best, cost = most_probable(problem, SCALES, _place(case))
    misses = _by_hand(case, best)
    own = (best[-18:] - [p.prior for p in PARAMETERS]) / _spread(0.4)
    assert cost == pytest.approx(0.5 * float(misses @ inverse @ misses + own @ own), rel=1e-7)
    start = _Weighted(problem, SCALES).residuals(_place(case))
    assert cost < 0.5 * float(start @ start)


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
