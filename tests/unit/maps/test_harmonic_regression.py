"""The harmonic regression: its terms, its likelihood and posterior by Bayes' rule with single
touches and no short cuts, the search for its amplitudes, and their average."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm, qmc

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.maps import harmonic_likelihood as likelihood
from pretravel.maps.harmonic_likelihood import RestrictedLikelihood
from pretravel.maps.harmonic_regression import (
    Amplitudes,
    HarmonicFit,
    _averaged_over,
    _most_probable,
    _posterior,
    fit_harmonics,
)
from pretravel.maps.likelihood_search import _SOBOL, CostAt
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import (
    degrees_and_orders,
    real_spherical_harmonics,
    ring_terms,
    sphere_terms,
)

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
H = POINTS[0]
KEPT = Amplitudes(POINTS[1], POINTS, np.array([0.7, 0.3]))


@pytest.mark.parametrize(
    ("directions", "highest"), [(4, 15), (31, 15), (32, 16), (95, 23), (96, 24), (5000, 24)]
)
def test_terms_of_a_sphere(directions: int, highest: int) -> None:
    """Lobes and zonal terms to degree 12 + n / 8, within 15 and 24; all others to degree 8."""
    expected = {
        (degree, order)
        for degree in range(2, highest + 1)
        for order in range(-degree, degree + 1)
        if degree <= 8 or order in range(-24, 25, 3)
    }
    found = sphere_terms(directions)
    assert {(int(d), int(m)) for d, m in found} == expected
    assert len(found) == len(expected)


def test_terms_of_a_ring() -> None:
    """Cosine and sine of two to thirty times the azimuth."""
    found = ring_terms()
    assert found[:, 0].tolist() == [m for m in range(2, 31) for _ in range(2)]
    assert found[::2, 1].tolist() == list(range(2, 31))
    assert found[1::2, 1].tolist() == [-m for m in range(2, 31)]


@dataclass(frozen=True)
class _Touched:
    """Directions, the touches of each, the terms of a fit; values are scatter and a shift. [um]"""

    n: FloatArray
    repeats: IntArray
    terms: IntArray

    @property
    def groups(self) -> IntArray:
        return np.repeat(np.arange(len(self.n)), self.repeats)

    @property
    def values(self) -> FloatArray:
        scatter = np.random.default_rng(5).normal(0.0, 0.5, len(self.groups))
        return np.asarray(scatter + 3.0 * self.n[self.groups, 0])

    @property
    def places(self) -> Places:
        return Places(self.n, np.arange(len(self.n)), self.groups)

    @property
    def problem(self) -> RestrictedLikelihood:
        return RestrictedLikelihood(self.places, self.values, self.groups, FREE, self.terms)

    def fit(self, values: FloatArray | None = None) -> HarmonicFit:
        given = 1e-3 * self.values if values is None else values
        return fit_harmonics(self.places, given, self.groups, FREE, self.terms, KEPT)

    def prior(self, h: FloatArray) -> FloatArray:
        """Covariance of the terms: each decreases with a power of degree / 3. Lobes are even about
        their azimuth: in cosine and sine of an order, the vector (cos, sin) of order times azimuth
        has the variance of the lobes, the one across it that of other terms. [um²]"""
        other = np.exp(2.0 * h[2]) * (self.terms[:, 0] / 3.0) ** (-2.0 * 2.5)
        found = np.diag(other)
        place = {(d, m): i for i, (d, m) in enumerate(self.terms.tolist())}
        for (d, m), i in place.items():
            if m == 0:
                found[i, i] = np.exp(2.0 * h[0]) * (d / 3.0) ** (-2.0 * h[3])
            elif m > 0 and m % 3 == 0:
                j = place[d, -m]
                way = np.array([np.cos(m * h[6]), np.sin(m * h[6])])
                size = np.exp(2.0 * h[1]) * (d / 3.0) ** (-2.0 * h[4])
                found[np.ix_([i, j], [i, j])] += (size - other[i]) * np.outer(way, way)
        return found

    def scatter(self, h: FloatArray) -> FloatArray:
        """Covariance of the touches about the map; without repeats noise alone. [um²]"""
        same = self.groups[:, None] == self.groups
        fixed = np.exp(2.0 * h[7]) * (self.repeats.max() > 1)
        return np.asarray(np.exp(2.0 * h[5]) * np.eye(len(same)) + fixed * same)

    @property
    def design(self) -> FloatArray:
        terms = np.concatenate([FREE, self.terms])
        return real_spherical_harmonics(self.n, terms)[self.groups]

    def by_hand(self, h: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and covariance of all coefficients, from every touch by itself. [um]"""
        design, scatter = self.design, self.scatter(h)
        precision = design.T @ np.linalg.solve(scatter, design)
        precision[len(FREE) :, len(FREE) :] += np.linalg.inv(self.prior(h))
        found = np.linalg.inv(precision)
        return found @ design.T @ np.linalg.solve(scatter, self.values), found


UNEQUAL = _Touched(N, np.resize([2, 1, 3], 25), TERMS)
ONCE = _Touched(N, np.ones(25, dtype=np.int64), TERMS)
_MANY = fibonacci_cap(60, 1.6), degrees_and_orders(4)[4:]
MANY = _Touched(_MANY[0], np.full(60, 3), _MANY[1])
"""More directions than terms: a reduction of rows; its likelihood is exact for equal repeats."""
MANY_UNEQUAL = _Touched(_MANY[0], np.resize([2, 1, 3], 60), _MANY[1])


@pytest.mark.parametrize("seen", [UNEQUAL, ONCE, MANY])
def test_the_mean_and_the_translation_are_marginalised(seen: _Touched) -> None:
    """The restricted likelihood is that of contrasts: of combinations of the touches, whitened
    here by a basis of all vectors that mean and translation do not reach."""
    problem = seen.problem
    free, design = np.split(seen.design, [4], axis=1)
    contrasts = np.linalg.svd(free)[0][:, 4:]
    assert np.abs(contrasts.T @ free).max() < 1e-12
    values = contrasts.T @ seen.values

    def by_hand(h: FloatArray) -> float:
        covariance = contrasts.T @ (design @ seen.prior(h) @ design.T + seen.scatter(h)) @ contrasts
        log = np.linalg.slogdet(covariance)[1]
        return float(0.5 * values @ np.linalg.solve(covariance, values) + 0.5 * log)

    def of_code(h: FloatArray) -> float:
        return problem.cost_and_slopes(h)[0] - problem._minus_log_prior(h)

    expected = by_hand(POINTS[1]) - by_hand(H)
    assert of_code(POINTS[1]) - of_code(H) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("seen", [UNEQUAL, ONCE, MANY, MANY_UNEQUAL])
@pytest.mark.parametrize("h", POINTS)
def test_slopes_are_those_of_the_cost(seen: _Touched, h: FloatArray) -> None:
    """Central differences: the error is 1e-4² times the third derivative, below 1e4 here."""
    problem = seen.problem
    step = 1e-4
    for place, slope in enumerate(problem.cost_and_slopes(h)[1]):
        way = step * np.eye(8)[place]
        there, back = problem.cost_and_slopes(h + way)[0], problem.cost_and_slopes(h - way)[0]
        assert slope == pytest.approx((there - back) / (2.0 * step), abs=1e-4)


@pytest.mark.parametrize("seen", [UNEQUAL, ONCE, MANY, MANY_UNEQUAL])
@pytest.mark.parametrize("h", POINTS)
def test_second_derivatives_are_those_of_the_slopes(seen: _Touched, h: FloatArray) -> None:
    """Central differences, whose error is as small a share of the largest of 30 to 1300."""
    found = seen.problem.at(h)
    cost, slopes = seen.problem.cost_and_slopes(h)
    assert (found.cost, found.slopes.tolist()) == (cost, slopes.tolist())
    step = 1e-4
    for place, row in enumerate(found.curvature):
        way = step * np.eye(8)[place]
        there, back = (seen.problem.cost_and_slopes(h + side * way)[1] for side in (1.0, -1.0))
        largest = float(np.abs(found.curvature).max())
        assert row == pytest.approx((there - back) / (2.0 * step), abs=3e-5 * largest)


def _problem(
    values: FloatArray, n: FloatArray, groups: FloatArray, terms: IntArray
) -> RestrictedLikelihood:
    groups = np.asarray(groups, dtype=np.int64)
    return RestrictedLikelihood(Places(n, np.arange(len(n)), groups), values, groups, FREE, terms)


def test_the_prior_is_normal_in_the_logarithms() -> None:
    """Density by scipy: amplitudes, decays and scatter about their usual values, that of other
    terms about the lobes; none of the azimuth. The usual amplitude is 5.5 % of the mean, here 8
    µm; of a mean below 0.3 µm, which nobody knows, it is that of a usual probe."""
    each = np.arange(25)
    unknown = _problem(0.29 + 0.0 * N[:, 0], N, each, sphere_terms(25))
    assert unknown.typical_amplitude == likelihood._TYPICAL_AMPLITUDE
    problem = _problem(8.0 + 3.0 * N[:, 0] - 2.0 * N[:, 2], N, each, sphere_terms(25))
    typical = math.log(0.055 * 8.0)

    def density(h: FloatArray) -> float:
        r = likelihood
        middles = [
            (h[0], typical, r._AMPLITUDE_SPREAD),
            (h[1], typical, r._AMPLITUDE_SPREAD),
            (h[2] - h[1], r._ASYMMETRY, r._ASYMMETRY_SPREAD),
            (h[3], 2.5, r._DECAY_SPREAD),
            (h[4], 2.5, r._DECAY_SPREAD),
            (h[5], r.TYPICAL_NOISE, r._NOISE_SPREAD),
            (h[7], r.TYPICAL_FIXED, r._FIXED_SPREAD),
        ]
        return float(sum(norm.logpdf(*each) for each in middles))

    other = H + np.array([0.3, -0.4, 0.9, 0.2, -0.5, 0.7, 0.1, 0.6])
    stated = problem._minus_log_prior(other) - problem._minus_log_prior(H)
    assert stated == pytest.approx(density(H) - density(other), rel=1e-12)
    assert problem._minus_log_prior(H + np.eye(8)[6]) == problem._minus_log_prior(H)


@pytest.mark.parametrize("repeats", [0, 1])
def test_one_repeat_tells_scatter_of_directions_from_noise(repeats: int) -> None:
    groups = np.array([*range(25), *[3] * repeats])
    values = np.sin(np.arange(25.0 + repeats))
    problem = _problem(values, N, groups, sphere_terms(25))
    assert problem.repeated == bool(repeats)
    assert problem.within_dof == repeats
    assert problem.fixed_variance(H) == pytest.approx(0.06**2 if repeats else 0.0)
    places = Places(N, np.arange(25), groups)
    kept = Amplitudes(H, H[None], np.ones(1))
    fit = fit_harmonics(places, 1e-3 * values, groups, FREE, sphere_terms(25), kept)
    assert fit.fixed_scatter == pytest.approx(0.06e-3 if repeats else 0.0)


def test_amplitudes_without_a_likelihood_are_never_the_most_probable() -> None:
    """Zero noise and no map: the touches would all have to be the same."""
    problem = _problem(np.sin(np.arange(25.0)), N, np.arange(25), sphere_terms(25))
    h = H.copy()
    h[[0, 1, 2, 5]] = -400.0
    cost, slopes = problem.cost_and_slopes(h)
    assert cost >= 1e12
    assert slopes.tolist() == [0.0] * 8


def test_what_no_touch_shows_is_uncertain_and_spoils_nothing_else() -> None:
    """Four touches at one polar angle, with noise: mean and height are told together, by
    c + √3·cos(85°)·h of the ring, whose u is that of a fit without the height."""
    n = from_angles(np.radians(85.0), np.array([0.1, 1.9, 3.2, 4.6]))
    places, each, terms = Places(n, np.arange(4), np.arange(4)), np.arange(4), sphere_terms(4)
    values = 1e-3 * np.array([4.1, 3.7, 5.2, 4.4])
    height = FREE.tolist().index([1, 0])
    whole = fit_harmonics(places, values, each, FREE, terms, KEPT)
    without = fit_harmonics(places, values, each, np.delete(FREE, height, axis=0), terms, KEPT)
    assert np.sqrt(whole.covariance[height, height]) > 1.0
    at = real_spherical_harmonics(n, np.concatenate([FREE, terms]))
    less = np.delete(at, height, axis=1)
    assert at @ whole.coefficients == pytest.approx(less @ without.coefficients, abs=1e-9)
    found = np.sqrt(np.einsum("ij,jk,ik->i", at, whole.covariance, at))
    expected = np.sqrt(np.einsum("ij,jk,ik->i", less, without.covariance, less))
    assert found == pytest.approx(expected, rel=1e-3)
    estimated = fit_harmonics(places, values, each, FREE, terms)
    assert np.isfinite(estimated.covariance).all()


@pytest.mark.parametrize("seen", [UNEQUAL, MANY_UNEQUAL])
def test_every_field_is_that_of_the_mixture_of_the_points(seen: _Touched) -> None:
    fit = seen.fit()
    means, covariances = zip(*(seen.by_hand(h) for h in POINTS), strict=True)
    mean = 0.7 * means[0] + 0.3 * means[1]
    covariance = 0.7 * covariances[0] + 0.3 * covariances[1]
    between = means[0] - means[1]
    covariance += 0.7 * 0.3 * np.outer(between, between)
    assert np.array_equal(fit.terms, np.concatenate([FREE, seen.terms]))
    # The precision has a condition of 1e5: inverses lose five to six of sixteen digits.
    assert np.allclose(fit.coefficients, 1e-3 * mean, rtol=0.0, atol=1e-11)
    assert np.allclose(fit.covariance, 1e-6 * covariance, rtol=0.0, atol=1e-14)
    assert np.array_equal(fit.covariance, fit.covariance.T)
    assert fit.noise == pytest.approx(1e-3 * np.sqrt(0.7 * 0.3**2 + 0.3 * 0.2**2))
    assert fit.fixed_scatter == pytest.approx(1e-3 * np.sqrt(0.7 * 0.06**2 + 0.3 * 0.10**2))
    assert fit.lobe_azimuth == pytest.approx(0.7)
    assert fit.amplitudes is KEPT


@pytest.mark.parametrize("seen", [UNEQUAL, MANY_UNEQUAL])
def test_fitted_values_and_leverages_are_those_of_the_fit(seen: _Touched) -> None:
    """With the amplitudes kept, the fit is linear: the hat matrix from fits to single touches."""
    smoothing, groups = seen.fit().smoothing, seen.groups
    single = np.eye(len(groups))[:7]
    hat = np.stack([seen.design @ seen.fit(one).coefficients for one in single], axis=1)
    fitted = seen.design @ (1e3 * seen.fit().coefficients)
    assert smoothing.fitted(seen.values, groups) == pytest.approx(fitted, abs=1e-7)
    leverage = np.bincount(groups[:6], np.diag(hat)[:6])
    assert smoothing.leverage[: len(leverage)] == pytest.approx(leverage, abs=1e-9)


def test_asymmetry_across_the_axis_follows_from_that_of_higher_degrees() -> None:
    """Of degree 3, exp(2 h) um²; of degree 1, by the power 2.5, 3^5 times that; n_x is a third of
    the square of a harmonic, so that its factor has three times the variance."""
    expected = 3.0 * 3.0**5 * (0.7 * np.exp(-4.0) + 0.3 * np.exp(-2.4)) * 1e-6
    assert KEPT.first_harmonic_variance == pytest.approx(expected, rel=1e-12)


@cache
def _seen(repeats: int) -> RestrictedLikelihood:
    """Lobes and a zonal term of 2 µm and 1 µm, scatter of 0.4 µm of touches, 0.5 of directions."""
    rng = np.random.default_rng(11)
    groups = np.tile(np.arange(25), repeats)
    own = 1.5 * real_spherical_harmonics(N, [(2, 0), (5, 1)]) @ [1.0, 0.3]
    order = 3.0 * (np.arctan2(N[:, 1], N[:, 0]) - 0.7)
    own += 3.0 * np.hypot(N[:, 0], N[:, 1]) ** 3 * np.cos(order)
    own += rng.normal(0.0, 0.5, 25) * (repeats > 1)
    values = own[groups] + rng.normal(0.0, 0.4, len(groups))
    return _problem(values, N, groups, sphere_terms(25))


@pytest.mark.parametrize("repeats", [1, 3])
def test_the_search_ends_where_nothing_is_more_probable(repeats: int) -> None:
    """No slope is left, in no direction; other azimuths, and a start elsewhere, find no better."""
    problem = _seen(repeats)
    found = _most_probable(problem, None)
    cost, slopes = problem.cost_and_slopes(found)
    assert slopes == pytest.approx(np.zeros(8), abs=0.02)
    if repeats > 1:  # 50 degrees of freedom tell it to a tenth
        assert np.exp(found[5]) == pytest.approx(0.4, rel=0.3)
    assert np.mod(found[6], np.pi / 3.0) == pytest.approx(0.7, abs=0.1)
    for azimuth in (0.1, 0.4, 0.9):
        start = H.copy()
        start[6] = azimuth
        other = minimize(problem.cost_and_slopes, start, jac=True, method="BFGS")
        assert float(other.fun) > cost - 1e-4
    moved = found + 0.1 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 0.5, 1.0])
    near = Amplitudes(moved, moved[None], np.ones(1))
    again = _most_probable(problem, near)
    assert problem.cost_and_slopes(again)[0] == pytest.approx(cost, abs=1e-3)
    assert again[6] == pytest.approx(found[6], abs=0.02)


def test_scatter_of_directions_as_large_as_the_map_is_found() -> None:
    """60 directions with 3 touches each and five harmonics: 0.6 µm that repeats do not reduce,
    0.2 µm that they do. The limits of the search lie beyond both."""
    rng = np.random.default_rng(12)
    groups = np.repeat(np.arange(60), 3)
    values = rng.normal(0.0, 0.6, 60)[groups] + rng.normal(0.0, 0.2, 180)
    terms = degrees_and_orders(2)[4:]
    problem = _problem(values, fibonacci_cap(60, 1.6), groups, terms)
    found = _most_probable(problem, None)
    assert problem.cost_and_slopes(found)[1] == pytest.approx(np.zeros(8), abs=0.02)
    # The most that 51 and 120 degrees of freedom tell: two deviations are a fifth and an eighth.
    assert np.exp(found[7]) == pytest.approx(0.6, rel=0.2)
    assert np.exp(found[5]) == pytest.approx(0.2, rel=0.13)


def test_touches_without_any_scatter_have_the_smallest_noise() -> None:
    """A map that is one number: 10 µm everywhere. The noise is nearly as small as it may be, the
    last digit of a position of 0.01 nm, and not zero."""
    problem = _problem(np.full(25, 10.0), N, np.arange(25), sphere_terms(25))
    found = _most_probable(problem, None)
    assert 1e-5 <= np.exp(found[5]) < 3e-5
    assert np.isfinite(problem.cost_and_slopes(found)[0])
    fitted = 1e3 * _posterior(problem, _only(found), FREE, sphere_terms(25)).coefficients
    assert fitted[0] == pytest.approx(10.0, abs=1e-9)
    assert np.abs(fitted[1:]).max() < 1e-9


@pytest.mark.parametrize(("noise", "larger"), [(1e-6, 0.0), (0.02, 12.0)])
def test_without_noise_the_map_contains_each_touch(noise: float, larger: float) -> None:
    """Noise of 1e-6 µm beside a map of a micrometre: normal equations would lose all of it. So they
    would where a million touches have a mean of that noise, and the map can be large."""
    values = 2.0 + np.sin(np.arange(25.0))
    problem = _problem(values, N, np.arange(25), sphere_terms(25))
    h = H.copy()
    h[:3] += larger
    h[5] = np.log(noise)
    found = _posterior(problem, _only(h), FREE, sphere_terms(25))
    rows = real_spherical_harmonics(N, found.terms)
    assert rows @ (1e3 * found.coefficients) == pytest.approx(values, abs=1e-9)
    u = 1e3 * np.sqrt(np.diag(rows @ found.covariance @ rows.T))
    assert u == pytest.approx(np.full(25, noise), rel=0.1)


def _only(h: FloatArray) -> Amplitudes:
    """One point of the amplitudes."""
    return Amplitudes(h, h[None], np.ones(1))


@pytest.mark.parametrize(("stated", "expected"), [(74.5, 14.5), (-10.0, 50.0), (59.0, 59.0)])
def test_the_azimuth_of_the_lobes_is_told_within_sixty_degrees(
    stated: float, expected: float
) -> None:
    h = H.copy()
    h[6] = np.radians(stated)
    each = np.arange(25)
    fit = fit_harmonics(
        Places(N, each, each), np.sin(each), each, FREE, sphere_terms(25),
        _only(h),
    )  # fmt: skip
    assert np.degrees(fit.lobe_azimuth) == pytest.approx(expected)


def test_the_stored_sequence_is_that_of_scipy() -> None:
    expected = qmc.Sobol(8, scramble=True, rng=1).random(8)
    assert np.array_equal(np.array(_SOBOL) / 2.0**30, expected)


class TestAverage:
    MODE = np.arange(8.0)

    def _averaged(
        self, curvatures: FloatArray, third: float = 0.0, fourth: float = 0.0
    ) -> Amplitudes:
        """Over a posterior whose minus logarithm is a polynomial about the mode."""
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(8, 8)))[0]

        def cost_and_slopes(h: FloatArray) -> tuple[float, FloatArray]:
            off = turn.T @ (h - self.MODE)
            cost = 0.5 * off @ (curvatures * off) + third * np.sum(off**3) + fourth * np.sum(off**4)
            slopes = curvatures * off + 3.0 * third * off**2 + 4.0 * fourth * off**3
            return float(cost), turn @ slopes

        self.turn = turn

        def at(h: FloatArray) -> CostAt:
            off = turn.T @ (h - self.MODE)
            second = curvatures + 6.0 * third * off + 12.0 * fourth * off**2
            return CostAt(*cost_and_slopes(h), turn @ np.diag(second) @ turn.T)

        problem = cast("Any", SimpleNamespace(cost_and_slopes=cost_and_slopes, at=at))
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
        """That of the noise has a deviation of two: curvature zero, or below zero, gives it. The
        curvature is that at the mode itself, which a fourth power does not change."""
        curvatures = np.array([0.0, -0.1, 0.2, 2.0, 4.0, 9.0, 16.0, 100.0])
        points = self._averaged(curvatures, fourth=1e-3).points
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
