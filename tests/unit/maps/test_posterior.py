"""The posterior of the regression, from Bayes' rule with single touches and no short cuts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.maps.harmonic_regression import (
    Amplitudes,
    HarmonicFit,
    _averaged_over,
    _by_terms,
    _by_touches,
    _given_amplitudes,
    _Problem,
    fit_harmonics,
    sphere_terms,
)
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics

N = sphere_pattern_25()
TERMS = sphere_terms(25)
FREE = degrees_and_orders(1)
# Zonal, lobed and other amplitudes, decays, noise, azimuth of the lobes, fixed scatter.
POINTS = np.array(
    [
        [-0.6, -0.2, -2.0, 2.5, 2.2, np.log(0.3), 0.3, np.log(0.06)],
        [0.4, 0.5, -1.2, 2.0, 3.0, np.log(0.2), 0.7, np.log(0.10)],
    ]
)
KEPT = Amplitudes(POINTS[1], POINTS, np.array([0.7, 0.3]))
REPEATS = np.resize([2, 1, 3], len(N))
GROUPS = np.repeat(np.arange(len(N)), REPEATS)
VALUES = np.random.default_rng(5).normal(0.0, 0.5, len(GROUPS)) + np.repeat(3.0 * N[:, 0], REPEATS)


def _by_hand(h: FloatArray, *, repeated: bool = True) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of all coefficients, in um, from every touch by itself.

    Lobes are even about their azimuth: in cosine and sine of an order, the vector (cos, sin) of
    order times azimuth has the variance of the lobes, the one across it that of other terms.
    """
    degree = TERMS[:, 0]
    other = np.exp(2.0 * h[2]) * (degree / 3.0) ** (-2.0 * 2.5)
    prior = np.diag(other)
    place = {(d, m): i for i, (d, m) in enumerate(TERMS.tolist())}
    for (d, m), i in place.items():
        if m == 0:
            prior[i, i] = np.exp(2.0 * h[0]) * (d / 3.0) ** (-2.0 * h[3])
        elif m > 0 and m % 3 == 0:
            j = place[d, -m]
            way = np.array([np.cos(m * h[6]), np.sin(m * h[6])])
            size = np.exp(2.0 * h[1]) * (d / 3.0) ** (-2.0 * h[4])
            prior[np.ix_([i, j], [i, j])] += (size - other[i]) * np.outer(way, way)
    design = real_spherical_harmonics(N, np.concatenate([FREE, TERMS]))[GROUPS]
    same = GROUPS[:, None] == GROUPS
    covariance = np.exp(2.0 * h[5]) * np.eye(len(GROUPS))
    if repeated:
        covariance = covariance + np.exp(2.0 * h[7]) * same
    precision = design.T @ np.linalg.solve(covariance, design)
    precision[len(FREE) :, len(FREE) :] += np.linalg.inv(prior)
    found = np.linalg.inv(precision)
    return found @ design.T @ np.linalg.solve(covariance, VALUES), found


def _fit() -> HarmonicFit:
    each = Places(N, np.arange(len(N)), GROUPS)
    return fit_harmonics(each, 1e-3 * VALUES, GROUPS, FREE, TERMS, KEPT)


def test_every_field_is_that_of_the_mixture_of_the_points() -> None:
    fit = _fit()
    means, covariances = zip(*(_by_hand(h) for h in POINTS), strict=True)
    mean = 0.7 * means[0] + 0.3 * means[1]
    covariance = 0.7 * covariances[0] + 0.3 * covariances[1]
    between = means[0] - means[1]
    covariance += 0.7 * 0.3 * np.outer(between, between)
    assert np.array_equal(fit.terms, np.concatenate([FREE, TERMS]))
    # The precision has a condition of 1e5: inverses lose five to six of sixteen digits.
    assert np.allclose(fit.coefficients, 1e-3 * mean, rtol=0.0, atol=1e-11)
    assert np.allclose(fit.covariance, 1e-6 * covariance, rtol=0.0, atol=1e-14)
    assert np.array_equal(fit.covariance, fit.covariance.T)
    assert fit.noise == pytest.approx(1e-3 * np.sqrt(0.7 * 0.3**2 + 0.3 * 0.2**2))
    assert fit.fixed_scatter == pytest.approx(1e-3 * np.sqrt(0.7 * 0.06**2 + 0.3 * 0.10**2))
    assert fit.lobe_azimuth == pytest.approx(0.7)
    assert fit.amplitudes is KEPT


def test_fitted_values_and_leverages_are_those_of_the_fit() -> None:
    """With the amplitudes kept, the fit is linear: the hat matrix from fits to single touches."""
    smoothing = _fit().smoothing
    design = real_spherical_harmonics(N, np.concatenate([FREE, TERMS]))[GROUPS]
    each = Places(N, np.arange(len(N)), GROUPS)
    hat = np.stack(
        [
            design @ fit_harmonics(each, one, GROUPS, FREE, TERMS, KEPT).coefficients
            for one in np.eye(len(GROUPS))[:7]
        ],
        axis=1,
    )
    assert smoothing.fitted(VALUES, GROUPS) == pytest.approx(
        design @ (1e3 * _fit().coefficients), abs=1e-9
    )
    leverage = np.bincount(GROUPS[:6], np.diag(hat)[:6])
    assert smoothing.leverage[: len(leverage)] == pytest.approx(leverage, abs=1e-9)


@pytest.mark.parametrize("h", POINTS)
def test_touches_and_terms_as_unknowns_give_the_same(h: FloatArray) -> None:
    problem = _Problem(Places(N, np.arange(len(N)), GROUPS), VALUES, GROUPS, FREE, TERMS)
    own = problem.own_variances(h, problem.count)
    one, other = _by_touches(problem, h, own), _by_terms(problem, h)
    for found, also in zip(one, other, strict=True):
        assert np.allclose(found, also, rtol=0.0, atol=1e-8)  # of numbers up to 10
    mean, covariance = _by_hand(h)
    to_coefficients, found = _given_amplitudes(problem, h)
    assert np.allclose(to_coefficients @ problem.y, mean, rtol=0.0, atol=1e-8)
    assert np.allclose(found, covariance, rtol=0.0, atol=1e-8)


def test_without_repeats_there_is_no_fixed_scatter() -> None:
    """It cannot be told from noise: neither the likelihood nor the result contains it."""
    each = np.arange(len(N))
    values = VALUES[: len(N)]
    problem = _Problem(Places(N, each, each), values, each, FREE, TERMS)
    assert not problem.repeated
    likelihood = []
    for fixed in (-3.0, 1.0):
        h = POINTS[0].copy()
        h[7] = fixed
        assert problem.fixed_variance(h) == 0.0
        likelihood.append(problem.cost_and_slopes(h)[0] - problem._minus_log_prior(h))
    assert likelihood[0] == pytest.approx(likelihood[1], abs=1e-12)
    fit = fit_harmonics(Places(N, each, each), 1e-3 * values, each, FREE, TERMS, KEPT)
    assert fit.fixed_scatter == 0.0


def test_asymmetry_across_the_axis_follows_from_that_of_higher_degrees() -> None:
    """Of degree 3, exp(2 h) um²; of degree 1, by the power 2.5, 3^5 times that; n_x is a third of
    the square of a harmonic, so that its factor has three times the variance."""
    expected = 3.0 * 3.0**5 * (0.7 * np.exp(-4.0) + 0.3 * np.exp(-2.4)) * 1e-6
    assert KEPT.first_harmonic_variance == pytest.approx(expected, rel=1e-12)


class TestAverage:
    MODE = np.arange(8.0)

    def _averaged(self, curvatures: FloatArray, third: float = 0.0) -> Amplitudes:
        """Over a posterior whose minus logarithm is a quadratic and a cubic about the mode."""
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(8, 8)))[0]

        def cost_and_slopes(h: FloatArray) -> tuple[float, FloatArray]:
            off = turn.T @ (h - self.MODE)
            cost = 0.5 * off @ (curvatures * off) + third * np.sum(off**3)
            return float(cost), turn @ (curvatures * off + 3.0 * third * off**2)

        self.turn = turn
        problem = cast("Any", SimpleNamespace(cost_and_slopes=cost_and_slopes))
        return _averaged_over(problem, self.MODE)

    def test_of_a_normal_distribution_it_has_its_mean_and_covariance(self) -> None:
        curvatures = np.array([0.3, 0.5, 1.0, 2.0, 4.0, 9.0, 16.0, 100.0])
        found = self._averaged(curvatures)
        assert np.array_equal(found.mode, self.MODE)
        assert len(found.points) == 16
        assert found.weights == pytest.approx(np.full(16, 1.0 / 16.0), rel=1e-6)
        off = (found.points - self.MODE) @ self.turn
        assert found.weights @ off == pytest.approx(np.zeros(8), abs=1e-6)
        covariance = (off.T * found.weights) @ off
        assert covariance == pytest.approx(np.diag(1.0 / curvatures), abs=1e-6)

    def test_flat_directions_are_as_wide_as_the_widest_prior(self) -> None:
        """That of the noise has a deviation of two: curvature zero, or below zero, gives it."""
        curvatures = np.array([0.0, -0.1, 0.2, 2.0, 4.0, 9.0, 16.0, 100.0])
        points = self._averaged(curvatures).points
        off = (points - self.MODE) @ self.turn
        deviations = np.array([2.0, 2.0, 2.0, *1.0 / np.sqrt(curvatures[3:])])
        assert len(off) == 16
        assert off.T @ off / 16.0 == pytest.approx(np.diag(deviations**2), abs=1e-6)

    def test_weights_are_the_posterior_over_the_normal_distribution(self) -> None:
        """Of two points on both sides, the quadratic is the same: the cubic decides."""
        third = 0.02
        found = self._averaged(np.ones(8), third)
        assert len(found.points) == 16
        assert found.weights.sum() == pytest.approx(1.0)
        off = (found.points - self.MODE) @ self.turn
        cubic = third * np.sum(off**3, axis=1)
        assert np.abs(cubic).max() < 2.0  # none is limited
        ratio = np.log(found.weights[:8] / found.weights[8:])
        assert ratio == pytest.approx(cubic[8:] - cubic[:8], abs=1e-5)

    def test_the_largest_weight_is_limited_and_negligible_points_are_left_out(self) -> None:
        """At most exp(2) times the median; below a thousandth of the largest none is kept."""
        found = self._averaged(np.ones(8), 0.5)
        assert len(found.points) == len(found.weights) < 16
        assert found.weights.sum() == pytest.approx(1.0)
        assert found.weights.min() > 1e-3 * found.weights.max()
        off = (found.points - self.MODE) @ self.turn
        cubic = 0.5 * np.sum(off**3, axis=1)
        # The median of all points is that of the normal distribution: the cubic is odd.
        expected = np.exp(np.minimum(-cubic, 2.0) - 2.0)
        assert found.weights / found.weights.max() == pytest.approx(expected, rel=1e-4)
        assert np.sum(-cubic > 2.0) > 1
