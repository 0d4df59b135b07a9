"""Kind physical for touches once in each direction: other kinds of probes, and the scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.observe import observe
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.six_seats import physical
from pretravel.six_seats.physical import PhysicalMapFit, fit_physical
from pretravel.six_seats.six_seat_basis import SixSeatBasis
from pretravel.six_seats.six_seat_fit import SixSeatProblem, most_probable, promised_gain
from tests.support.made_up_probes import NOISE, made_up_response, touches_of
from tests.support.reference_touches import sphere_touches

PATTERN = sphere_pattern_25()
BETWEEN = fibonacci_cap(200, np.radians(85.0))
LOBES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "five smooth lobes": lambda across, azimuth: 3.0 * across**5 * np.cos(5.0 * azimuth),
    "four edges": lambda across, azimuth: 5.0 * across**2 * np.abs(np.cos(2.0 * azimuth)),
}
SAID = "perhaps not of the six-seat kind"


def _pretravel(lobes: str, n: np.ndarray) -> np.ndarray:
    """1.5 µm along the axis, 9 µm across it, and lobes. [mm]"""
    across = np.hypot(n[:, 0], n[:, 1])
    azimuth = np.arctan2(n[:, 1], n[:, 0]) - 0.2
    return np.asarray(1e-3 * (1.5 + 7.5 * across**2 + LOBES[lobes](across, azimuth)))


def _error_over_u(found: Qualification, truth: np.ndarray) -> float:
    """Of the map between the touches; a shift of the reference is no error of distances."""
    value, u = found.pretravel_map.pretravel_and_uncertainty(BETWEEN)
    error = value - truth
    error -= BETWEEN @ np.linalg.lstsq(BETWEEN, error, rcond=None)[0]
    return float(np.sqrt(np.mean((error / u) ** 2)))


@pytest.mark.long
@pytest.mark.parametrize(
    "lobes", ["five smooth lobes", pytest.param("four edges", marks=pytest.mark.slow)]
)
def test_u_covers_another_kind_of_probe(lobes: str) -> None:
    """Of the usual map, in which the kind counts that predicts left-out directions. Of six seats
    alone, without repeats, error over u is 0.9 to 1.8, and five lobes are said. From draw to draw
    of the noise it changes by 0.1: the root mean square of three draws."""
    ratios = []
    for seed in (16, 17, 18):
        noise = np.random.default_rng(seed).normal(0.0, NOISE, len(PATTERN))
        touches = sphere_touches(_pretravel(lobes, PATTERN) + noise)
        found = qualify(touches, 25.0, tip_diameter=6.0)
        ratios.append(_error_over_u(found, _pretravel(lobes, BETWEEN)))
    assert np.sqrt(np.mean(np.square(ratios))) < 1.5


@pytest.mark.long
def test_another_kind_of_probe_is_said() -> None:
    """Four lobes look like none in rings of four and eight touches, at some azimuths."""
    rng = np.random.default_rng(16)
    pretravel = _pretravel("five smooth lobes", PATTERN) + rng.normal(0.0, NOISE, len(PATTERN))
    found = qualify(sphere_touches(pretravel), 25.0, tip_diameter=6.0, kind="physical")
    assert any(SAID in warning for warning in found.warnings)


@pytest.mark.slow
def test_rounding_does_not_choose_between_starts() -> None:
    """Searches that stop where the first seat changes have no evidence: what the linear model there
    promises is not reached. Touches that differ by rounding give the same map."""
    rng = np.random.default_rng(16)
    pretravel = _pretravel("four edges", PATTERN) + rng.normal(0.0, NOISE, len(PATTERN))
    values = []
    for rounding in (0.0, 1e-13):
        moved = pretravel + rounding * np.random.default_rng(5).normal(size=len(PATTERN))
        found = qualify(sphere_touches(moved), 25.0, tip_diameter=6.0, kind="physical")
        values.append(found.pretravel_map.pretravel(BETWEEN))
    # The fit ends within 1e-5 of its parameters, the noise is 0.3 µm.
    assert np.abs(values[1] - values[0]).max() < 1e-5


def test_a_linear_model_promises_nothing_at_a_mode() -> None:
    """Of a linear problem the gain is that of one step: from a mode moved a little, the quadratic
    form of the step."""
    found, problem = _fitted(0.05e-3), SixSeatProblem(_observed(0.05e-3))
    scales = found.scales.scales[0]
    best, cost = most_probable(problem, scales, found.unknowns)
    assert promised_gain(problem, scales, best) == pytest.approx(0.0, abs=1e-6)
    beside = best.copy()
    beside[0] += 1e-5
    whitened = problem.covariance(scales).whitened(problem.misses(beside)[0])
    own = (beside - problem.prior)[problem.extra :] / problem.spread(scales.asymmetry)
    higher = 0.5 * float(whitened @ whitened + own @ own) - cost
    assert higher > 1e-3
    assert promised_gain(problem, scales, beside) == pytest.approx(higher, rel=0.02)


@cache
def _observed(noise: float, directions: int = 60) -> Observation:
    """Each direction once; the same probe and the same errors, times the noise."""
    n, rng = fibonacci_cap(directions, np.radians(90.0)), np.random.default_rng([1, 3])
    touches = touches_of(made_up_response(rng, 0.3), n, rng, noise)
    return observe(touches, QualificationSetup(25.0, 6.0), np.eye(3))


@cache
def _fitted(noise: float) -> PhysicalMapFit:
    return fit_physical(_observed(noise), Scatter(0.0, 0.0))


class TestScatter:
    """The standard deviation of a touch that a fit states."""

    @pytest.mark.parametrize("noise", [0.05e-3, pytest.param(1.5e-3, marks=pytest.mark.slow)])
    def test_without_repeats_the_residuals_tell_it(self, noise: float) -> None:
        """At least centre and azimuth, 4 numbers, follow from the touches alone; at most all 21
        unknowns. A deviation with 39 degrees of freedom has a standard uncertainty of 11 %: a third
        is three of these. The usual noise, 0.3 µm, is only the middle of a wide prior."""
        found = _fitted(noise)
        assert 60 - 21 <= found.dof <= 60 - 4
        assert found.noise == pytest.approx(noise, rel=0.33)
        seen = np.sqrt(np.sum(found.residuals**2) / found.dof)
        assert seen == pytest.approx(noise, rel=0.33)

    @pytest.mark.parametrize("directions", [8, 10])
    def test_few_touches_without_error_leave_a_doubt(self, directions: int) -> None:
        """Without residuals the likelihood of a scatter s is s to the power -dof. Times a normal
        prior of its logarithm, spread 1 about 0.3 µm, that is another one about 0.3 µm exp(-dof),
        whose root mean square is exp(1) times as large if its range has no end."""
        found = fit_physical(_observed(0.0, directions), Scatter(0.0, 0.0))
        middle = 0.3e-3 * np.exp(-found.dof)
        assert middle < found.noise < np.e * middle

    @pytest.mark.long
    @pytest.mark.parametrize(
        ("repeats", "expected"),
        [
            # Many repeats alone.
            (Scatter(0.4e-3, 50.0), 0.4e-3),
            # Four degrees of freedom beside the usual 0.3 µm, which counts as four more: the mean
            # of both variances.
            (Scatter(0.3e-3, 4.0), 0.3e-3),
            (Scatter(0.6e-3, 4.0), 0.3e-3 * np.sqrt(2.5)),
        ],
    )
    def test_with_repeats(self, repeats: Scatter, expected: float) -> None:
        found = fit_physical(_observed(1.5e-3), repeats, _fitted(1.5e-3).unknowns)
        assert found.noise == pytest.approx(expected, rel=1e-9)

    @pytest.mark.parametrize("noise", [0.05e-3, 1.5e-3])
    def test_unknowns_and_scales_belong_together(self, noise: float) -> None:
        """Each determines the other: at the end the unknowns are the most probable ones for the
        most probable scales, and a fit that begins there stays there."""
        found, problem = _fitted(noise), SixSeatProblem(_observed(noise))
        best, _ = most_probable(problem, found.scales.scales[0], found.unknowns)
        predicted, _ = problem.misses(best)
        stated, _ = problem.misses(found.unknowns)
        # Far below what the noise leaves uncertain, also where the seat that lifts first changes:
        # there a search stops for lack of a slope.
        assert np.abs(predicted - stated).max() < 0.02 * noise
        scales = found.scales.scales[0]
        again = fit_physical(_observed(noise), Scatter(0.0, 0.0), found.unknowns, scales)
        assert again.scales.scales[0] == found.scales.scales[0]
        # Of one centre, far below the uncertainty: an unknown delay leaves level and height free.
        apart = found.basis.value(BETWEEN, found.coefficients)
        apart -= again.basis.value(BETWEEN, again.coefficients)
        apart -= BETWEEN @ np.linalg.lstsq(BETWEEN, apart, rcond=None)[0]
        u = np.sqrt(found.covariance.variance_of(found.basis.design(BETWEEN)).mean())
        assert np.abs(apart).max() < 0.3 * u


def test_modes_are_averaged_by_their_evidence() -> None:
    """Two modes of equal evidence: the map is half-way between them, where the touches support it,
    and each is one standard deviation from it; a mode without evidence changes nothing."""
    problem = SixSeatProblem(_observed(1.5e-3))
    first = _fitted(1.5e-3)
    lever = np.eye(len(first.basis.values))[0]
    moved = SixSeatBasis(first.basis.values + 0.3 * lever, 3.0, first.basis.terms)
    other = replace(first, basis=moved)
    both = physical._averaged(first, [other], np.zeros(2), problem)
    n = fibonacci_cap(60, np.radians(80.0))
    apart = _without_shift(n, moved.value(n, first.coefficients) - _value(first, n))
    middle = _without_shift(n, _value(both, n) - _value(first, n))
    design = first.basis.design(n)
    added = both.covariance.variance_of(design) - first.covariance.variance_of(design)
    size = float(np.sqrt(np.mean(apart**2)))
    assert size > 0.1e-3
    # The difference has edges, which harmonics of degree 8 leave in part.
    assert np.sqrt(np.mean((middle - 0.5 * apart) ** 2)) < 0.15 * size
    assert np.sqrt(np.mean(added)) == pytest.approx(0.5 * size, rel=0.15)
    alone = physical._averaged(first, [other], np.array([0.0, -50.0]), problem)
    assert alone.coefficients == pytest.approx(first.coefficients, abs=1e-12)


def _value(fit: PhysicalMapFit, n: np.ndarray) -> np.ndarray:
    return fit.basis.value(n, fit.coefficients)


def _without_shift(n: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.asarray(values - n @ np.linalg.lstsq(n, values, rcond=None)[0])
