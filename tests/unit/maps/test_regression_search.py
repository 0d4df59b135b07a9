"""Terms and priors of the harmonic regression, and the search for its amplitudes."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from scipy.stats import norm, qmc

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.maps import harmonic_regression as regression
from pretravel.maps.harmonic_regression import (
    _SOBOL,
    Amplitudes,
    _averaged_over,
    _given_amplitudes,
    _inverse_of_factor,
    _most_probable,
    _Problem,
    _spread_points,
    fit_harmonics,
    ring_terms,
    sphere_terms,
)
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics

N = sphere_pattern_25()
FREE = degrees_and_orders(1)
H = np.array([-0.6, -0.2, -2.0, 2.5, 2.2, np.log(0.3), 0.2, np.log(0.06)])


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


def _problem(values: FloatArray, n: FloatArray, groups: FloatArray, terms: FloatArray) -> _Problem:
    groups = np.asarray(groups, dtype=np.int64)
    return _Problem(Places(n, np.arange(len(n)), groups), values, groups, FREE, terms)


def test_the_prior_is_normal_in_the_logarithms() -> None:
    """Density by scipy: amplitudes, decays and scatter about their usual values, that of other
    terms about the lobes; none of the azimuth. The usual amplitude is 5.5 % of the mean, here 8
    µm; of a mean below 0.3 µm, which nobody knows, it is that of a usual probe."""
    each = np.arange(25)
    unknown = _problem(0.29 + 0.0 * N[:, 0], N, each, sphere_terms(25))
    assert unknown.typical_amplitude == regression._TYPICAL_AMPLITUDE
    problem = _problem(8.0 + 3.0 * N[:, 0] - 2.0 * N[:, 2], N, each, sphere_terms(25))
    typical = math.log(0.055 * 8.0)

    def density(h: FloatArray) -> float:
        r = regression
        middles = [
            (h[0], typical, r._AMPLITUDE_SPREAD),
            (h[1], typical, r._AMPLITUDE_SPREAD),
            (h[2] - h[1], r._ASYMMETRY, r._ASYMMETRY_SPREAD),
            (h[3], 2.5, r._DECAY_SPREAD),
            (h[4], 2.5, r._DECAY_SPREAD),
            (h[5], r._TYPICAL_NOISE, r._NOISE_SPREAD),
            (h[7], r._TYPICAL_FIXED, r._FIXED_SPREAD),
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


def _variances(terms: FloatArray, h: FloatArray) -> FloatArray:
    degree, order = terms[:, 0], terms[:, 1]
    lobe = (order % 3 == 0) & (order != 0)
    size = np.where(order == 0, h[0], np.where(lobe, h[1], h[2]))
    decay = np.where(order == 0, h[3], np.where(lobe, h[4], 2.5))
    return np.asarray(np.exp(2.0 * size) * (degree / 3.0) ** (-2.0 * decay))


def test_many_directions_have_the_likelihood_of_all_of_them() -> None:
    """More directions than terms: a reduction of rows. The likelihood is that of all contrasts of
    the 60 directions, whose covariance is written down here in full; no order is three, so that
    the azimuth of the lobes does not matter."""
    n = fibonacci_cap(60, 1.6)
    terms = degrees_and_orders(4)[4:]
    terms = terms[terms[:, 1] % 3 != 0]
    values = np.random.default_rng(8).normal(0.0, 0.7, 60)
    problem = _problem(values, n, np.arange(60), terms)
    assert len(problem.y) < 60
    assert problem.left_dof == 60 - len(terms) - 4
    free = real_spherical_harmonics(n, FREE)
    contrasts = np.linalg.svd(free)[0][:, 4:]
    design = real_spherical_harmonics(n, terms)

    def by_hand(h: FloatArray) -> float:
        covariance = (design * _variances(terms, h)) @ design.T + np.exp(2.0 * h[5]) * np.eye(60)
        covariance, seen = contrasts.T @ covariance @ contrasts, contrasts.T @ values
        log = np.linalg.slogdet(covariance)[1]
        return float(0.5 * seen @ np.linalg.solve(covariance, seen) + 0.5 * log)

    def of_code(h: FloatArray) -> float:
        return problem.cost_and_slopes(h)[0] - problem._minus_log_prior(h)

    other = H + np.array([0.3, -0.4, 0.9, 0.2, -0.5, 0.7, 0.1, 0.6])
    assert of_code(other) - of_code(H) == pytest.approx(by_hand(other) - by_hand(H), abs=1e-9)


def test_slopes_of_many_repeated_directions_are_those_of_the_cost() -> None:
    """Central differences: the error is 1e-4² times the third derivative."""
    n = fibonacci_cap(60, 1.6)
    groups = np.repeat(np.arange(60), np.resize([2, 1, 3], 60))
    values = np.random.default_rng(8).normal(0.0, 0.7, len(groups))
    problem = _problem(values, n, groups, degrees_and_orders(4)[4:])
    assert problem.small_count == pytest.approx(np.full(len(problem.small_y), 2.0))
    step = 1e-4
    for place, slope in enumerate(problem.cost_and_slopes(H)[1]):
        way = step * np.eye(8)[place]
        there, back = problem.cost_and_slopes(H + way)[0], problem.cost_and_slopes(H - way)[0]
        assert slope == pytest.approx((there - back) / (2.0 * step), abs=1e-4)


def test_the_inverse_of_a_cholesky_factor() -> None:
    half = np.random.default_rng(2).normal(size=(5, 5))
    covariance = half @ half.T
    inverse = _inverse_of_factor(covariance)
    assert inverse == pytest.approx(np.linalg.inv(np.linalg.cholesky(covariance)), rel=1e-9)
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        _inverse_of_factor(np.diag([1.0, -1.0]))


def test_amplitudes_without_a_likelihood_are_never_the_most_probable() -> None:
    """Zero noise and no map: the touches would all have to be the same."""
    problem = _problem(np.sin(np.arange(25.0)), N, np.arange(25), sphere_terms(25))
    h = H.copy()
    h[[0, 1, 2, 5]] = -400.0
    cost, slopes = problem.cost_and_slopes(h)
    assert cost >= 1e12
    assert slopes.tolist() == [0.0] * 8


@cache
def _seen(repeats: int) -> _Problem:
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
    from scipy.optimize import minimize

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
    amplitudes = Amplitudes(found, found[None], np.ones(1))
    to_coefficients, _ = _given_amplitudes(problem, amplitudes.mode)
    fitted = to_coefficients @ problem.y
    assert fitted[0] == pytest.approx(10.0, abs=1e-9)
    assert np.abs(fitted[1:]).max() < 1e-9


def test_without_noise_the_map_contains_each_touch() -> None:
    """Noise of 1e-6 µm beside a map of a micrometre: normal equations would lose all of it."""
    values = 2.0 + np.sin(np.arange(25.0))
    problem = _problem(values, N, np.arange(25), sphere_terms(25))
    h = H.copy()
    h[5] = np.log(1e-6)
    to_coefficients, covariance = _given_amplitudes(problem, h)
    rows = real_spherical_harmonics(N, np.concatenate([FREE, sphere_terms(25)]))
    assert rows @ (to_coefficients @ problem.y) == pytest.approx(values, abs=1e-9)
    assert np.sqrt(np.diag(rows @ covariance @ rows.T)) == pytest.approx(np.full(25, 1e-6), rel=0.1)


@pytest.mark.parametrize(("stated", "expected"), [(74.5, 14.5), (-10.0, 50.0), (59.0, 59.0)])
def test_the_azimuth_of_the_lobes_is_told_within_sixty_degrees(
    stated: float, expected: float
) -> None:
    h = H.copy()
    h[6] = np.radians(stated)
    each = np.arange(25)
    fit = fit_harmonics(
        Places(N, each, each), np.sin(each), each, FREE, sphere_terms(25),
        Amplitudes(h, h[None], np.ones(1)),
    )  # fmt: skip
    assert np.degrees(fit.lobe_azimuth) == pytest.approx(expected)


def test_points_about_the_mode_have_mean_zero_unit_covariance_and_one_length() -> None:
    points = _spread_points()
    assert points.shape == (16, 8)
    assert points[8:] == pytest.approx(-points[:8], abs=1e-12)
    assert points.T @ points / 16.0 == pytest.approx(np.eye(8), abs=1e-12)
    # The sum of the squares is 16 times 8.
    assert np.sum(points**2, axis=1) == pytest.approx(np.full(16, 8.0))


def test_the_stored_sequence_is_that_of_scipy() -> None:
    expected = qmc.Sobol(8, scramble=True, rng=1).random(8)
    assert np.array_equal(np.array(_SOBOL) / 2.0**30, expected)


def test_the_average_is_over_the_posterior_of_the_problem() -> None:
    problem = _seen(3)
    mode = _most_probable(problem, None)
    found = _averaged_over(problem, mode)
    costs = np.array([problem.cost_and_slopes(each)[0] for each in found.points])
    log = np.log(found.weights) + costs
    limited = costs < np.median(costs) - 2.0
    assert np.ptp(log[~limited]) == pytest.approx(0.0, abs=1e-9)
    assert np.sum(~limited) > 4
    assert found.weights.sum() == pytest.approx(1.0)
