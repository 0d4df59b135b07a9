"""Probabilities of scales, and the numbers of a fit averaged over them, by dense matrices."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm
from scipy.stats import t as student

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation, Scatter
from pretravel.six_seats.scale_weights import (
    ASYMMETRY_SCALES,
    CORRECTIONS,
    FIXED_SCATTERS,
    WeightedScales,
    _log_prior,
    _noises,
    _own_scatters,
    correction_at,
    covariance_over_scales,
    log_likelihoods,
    weighted_scales,
)
from pretravel.six_seats.six_seat_fit import PriorScales, SixSeatProblem
from pretravel.six_seats.uneven_seats import PARAMETERS
from tests.support.six_seat_unknowns import PRIORS

UM = 1e-3
UNKNOWN = [0.3 * UM * 1.6**step for step in range(-6, 7)]


def _problem(directions: int, tip_known: bool) -> SixSeatProblem:
    """One to three touches in each direction of a cap, with 10 µm of pretravel and two lobes."""
    repeats = 1 + np.arange(directions) % 3
    groups = np.repeat(np.arange(directions), repeats)
    n = fibonacci_cap(directions, math.radians(100.0))[groups]
    values = 0.010 + 0.001 * n[:, 0] * n[:, 1] + 0.0003 * np.cos(2.3 * np.arange(len(groups)))
    return SixSeatProblem(
        Observation(n * (15.0 - values)[:, None], groups, np.zeros(3), 12.5, 2.5, ring=False,
                    tip_known=tip_known, u_constant=2e-4)
    )  # fmt: skip


def _place(problem: SixSeatProblem) -> np.ndarray:
    x = problem.prior
    x[: problem.extra] = UM * np.array([0.5, -0.8, 1.1, 1.7])[: problem.extra]
    x[problem.extra :] += (
        0.1 * np.sin(np.arange(18) + 1.0) * [min(p.spread, 0.5) for p in PARAMETERS]
    )
    return x


def _priors(problem: SixSeatProblem, scales: PriorScales) -> np.ndarray:
    """Variances before the touches: 50 µm or 50 mrad where nothing is known, else the spreads."""
    found = [0.05**2] * problem.extra
    for index, parameter in enumerate(PARAMETERS):
        spread = 0.05 if parameter.name == "rod_azimuth" else parameter.spread
        found.append((spread * (scales.asymmetry if index >= 7 else 1.0)) ** 2)
    return np.concatenate([found, problem.correction_variances(scales.correction)])


def _from_prior(problem: SixSeatProblem, x: np.ndarray) -> np.ndarray:
    """From x to what is expected before the touches; without a prior nothing else is."""
    kept = np.array(PRIORS)
    kept[problem.azimuth - problem.extra] = x[problem.azimuth]
    return np.concatenate([np.zeros(problem.extra), kept - x[problem.extra :]])


def _own(problem: SixSeatProblem, scales: PriorScales) -> np.ndarray:
    return np.asarray(scales.fixed_scatter**2 + scales.noise**2 / problem.count)


@pytest.mark.parametrize(
    ("repeats", "noises", "fixed"),
    [
        (Scatter(0.0, 0.0), UNKNOWN, (0.0,)),
        (Scatter(0.7 * UM, 1.0), [math.sqrt((0.49 + 4.0 * 0.09) / 5.0) * UM], FIXED_SCATTERS),
        (Scatter(0.7 * UM, 9.0), [math.sqrt((9 * 0.49 + 4 * 0.09) / 13) * UM], FIXED_SCATTERS),
        (Scatter(0.7 * UM, 10.0), [0.7 * UM], FIXED_SCATTERS),
        (Scatter(0.0, 10.0), [1e-3 * UM], FIXED_SCATTERS),
    ],
)
def test_noises_that_are_considered(
    repeats: Scatter, noises: list[float], fixed: tuple[float, ...]
) -> None:
    """Many without repeats; from ten degrees of freedom that of the repeats, and at least a
    nanometre; between them the mean of its square and of 0.3 µm, which counts as four."""
    assert _noises(repeats) == pytest.approx(noises, rel=1e-12)
    expected = np.array([(scatter, noise) for scatter in fixed for noise in noises])
    assert np.array(_own_scatters(repeats)) == pytest.approx(expected, rel=1e-12)


def test_priors_of_the_scales() -> None:
    """In steps of equal factors: a density is that of the logarithm, size times that of the size.
    Half of Student's distributions, 3 degrees of freedom, 0.1 µm and 0.03 µm; normal ones of
    logarithms about 0.3, with 1.2, and about 0.3 µm, with 1. The noise has one where it is not
    separated by repeats."""

    def density(scales: PriorScales) -> float:
        found = norm.logpdf(math.log(scales.asymmetry), math.log(0.3), 1.2)
        found += math.log(scales.correction) + student.logpdf(scales.correction, 3, 0.0, 0.1 * UM)
        if scales.fixed_scatter:
            size = scales.fixed_scatter
            return float(found + math.log(size) + student.logpdf(size, 3.0, 0.0, 0.03 * UM))
        return float(found + norm.logpdf(math.log(scales.noise), math.log(0.3 * UM), 1.0))

    for fixed in ((0.02 * UM, 0.4 * UM), (0.0,)):
        cases = [
            PriorScales(*each)
            for each in product((0.1, 3.0), (0.03 * UM, 2.0 * UM), fixed, (0.1 * UM, 0.5 * UM))
        ]
        found = np.array([_log_prior(scales) for scales in cases])
        expected = np.array([density(scales) for scales in cases])
        assert found - found[0] == pytest.approx(expected - expected[0], abs=1e-9)


def test_a_mean_scale_is_the_root_of_mean_squares() -> None:
    scales = (PriorScales(1.0, 2.0, 3.0, 4.0), PriorScales(5.0, 6.0, 7.0, 8.0))
    found = WeightedScales(scales, np.array([0.75, 0.25]), 0.0)
    assert found.mean("asymmetry") == pytest.approx(math.sqrt(0.75 + 6.25))
    assert found.mean("noise") == pytest.approx(math.sqrt(12.0 + 16.0))


@pytest.mark.parametrize(("directions", "tip_known"), [(11, True), (12, False)])
def test_scales_have_the_probability_of_the_touches(directions: int, tip_known: bool) -> None:
    """Touches are normal about the prior's mean, with the prior's covariance and their own. Of all
    scales the least probable ones are left out that have a fiftieth together."""
    problem = _problem(directions, tip_known)
    x, repeats = _place(problem), Scatter(0.3 * UM, 6.0)
    misses, slopes = problem.misses(x)
    expected = misses + slopes @ _from_prior(problem, x)
    columns = np.hstack([slopes, problem.harmonics])
    found = weighted_scales(problem, x, repeats)
    logarithms = {}
    for pair in product(ASYMMETRY_SCALES, CORRECTIONS):
        shared = (columns * _priors(problem, PriorScales(*pair, 0.0, 0.0))) @ columns.T
        for scatter in _own_scatters(repeats):
            scales = PriorScales(*pair, *scatter)
            total = shared + np.diag(_own(problem, scales))
            logarithm = multivariate_normal(cov=total, allow_singular=True).logpdf(expected)
            logarithms[scales] = float(logarithm) + _log_prior(scales)
    best = max(logarithms.values())
    total = sum(math.exp(value - best) for value in logarithms.values())
    constant = 0.5 * directions * math.log(2.0 * math.pi)
    assert found.evidence == pytest.approx(best + math.log(total) + constant, abs=1e-4)
    share = np.array([math.exp(logarithms[scales] - best) / total for scales in found.scales])
    assert np.all(np.diff(share) < 1e-6)
    assert share[:-1].sum() < 0.98 <= share.sum() + 1e-6
    assert found.weights == pytest.approx(share / share.sum(), rel=1e-3)


@pytest.mark.parametrize(("directions", "tip_known"), [(11, True), (12, False), (120, False)])
def test_unknowns_are_those_of_a_regression_over_all_scales(
    directions: int, tip_known: bool
) -> None:
    """Normal equations with the priors as further rows, for each of three scales. The covariance
    about the first has those of each, and the squares of the differences."""
    problem = _problem(directions, tip_known)
    x = _place(problem)
    scales = (
        PriorScales(0.3, 0.4 * UM, 0.1 * UM, 0.3 * UM),
        PriorScales(3.0, 1.6 * UM, 0.0, 0.5 * UM),
        PriorScales(0.1, 0.1 * UM, 0.5 * UM, 0.2 * UM),
    )
    weights = np.array([0.5, 0.2, 0.3])
    misses, slopes = problem.misses(x)
    # A change of the unknowns by d leaves misses + slopes d, and a correction c takes H c of them.
    columns = np.hstack([-slopes, problem.harmonics])
    before = np.concatenate([_from_prior(problem, x), np.zeros(len(problem.terms))])
    means, covariances = [], []
    for each in scales:
        # In units of the priors, so that the matrix is far from singular.
        size = np.sqrt(_priors(problem, each))
        own = np.sqrt(_own(problem, each))
        rows = columns * size / own[:, None]
        inverse = np.linalg.inv(rows.T @ rows + np.eye(len(size)))
        change = inverse @ (rows.T @ ((misses - columns @ before) / own))
        means.append(before + size * change)
        covariances.append(size[:, None] * inverse * size)
    covariance = covariance_over_scales(problem, x, WeightedScales(scales, weights, 0.0))
    expected = sum(
        weight * (own + np.outer(mean - means[0], mean - means[0]))
        for weight, own, mean in zip(weights, covariances, means, strict=True)
    )
    root = np.sqrt(np.diag(expected))
    assert covariance / np.outer(root, root) == pytest.approx(
        expected / np.outer(root, root), abs=1e-4
    )
    assert np.array_equal(covariance, covariance.T)


@pytest.mark.parametrize("directions", [11, 120])
def test_correction_is_that_of_a_regression_on_what_the_probe_leaves(directions: int) -> None:
    """Normal equations with the prior as further rows. The unknowns stay where they are."""
    problem, each = _problem(directions, tip_known=True), PriorScales(0.3, 4e-4, 1e-4, 3e-4)
    x = _place(problem)
    size = np.sqrt(problem.correction_variances(each.correction))
    own = np.sqrt(_own(problem, each))
    rows = problem.harmonics * size / own[:, None]
    left = problem.misses(x)[0] / own
    expected = size * np.linalg.solve(rows.T @ rows + np.eye(len(size)), rows.T @ left)
    assert correction_at(problem, x, each) == pytest.approx(expected, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("counts", [(3,), (2, 3, 5)])
@pytest.mark.parametrize("directions", [6, 30])
def test_likelihood_is_that_of_the_normal_distribution(
    counts: tuple[int, ...], directions: int
) -> None:
    """From reduced rows, that of the matrix of all pairs of directions."""
    rng = np.random.default_rng(5)
    count = rng.choice(counts, directions).astype(float)
    columns, values = rng.standard_normal((directions, 8)), rng.standard_normal(directions)
    # Columns that tell much, and columns beside which the noise is large; more than one block.
    variances = np.concatenate([rng.uniform(0.01, 2.0, (14, 8)), rng.uniform(1e-6, 1e-4, (5, 8))])
    scatters = np.array([[0.1, 0.5], [0.02, 0.3], [0.0, 1.0]])
    found = log_likelihoods(columns, variances, values, count, scatters)
    expected = [
        multivariate_normal(
            cov=(columns * prior) @ columns.T + np.diag(fixed + noise / count)
        ).logpdf(values)
        for prior in variances
        for fixed, noise in scatters
    ]
    constant = 0.5 * directions * np.log(2.0 * np.pi)
    assert found == pytest.approx(np.array(expected) + constant, rel=1e-9, abs=1e-9)
