"""A regression of many directions is that of all pairs of them, without their matrix."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.harmonic_regression import Amplitudes, _Problem, fit_harmonics, sphere_terms
from pretravel.maps.observation import Observation
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics

_POINTS = np.log(
    [[2.0, 3.0, 0.3, 1.0, 1.0, 0.3, 1.0, 0.1], [1.0, 2.0, 0.1, 1.0, 1.0, 0.2, 1.0, 0.05]]
)
_POINTS[:, 3:5], _POINTS[:, 6] = 2.5, [0.2, 0.3]  # decays, and azimuth of the lobes
_AMPLITUDES = Amplitudes(_POINTS[0], _POINTS, np.array([0.7, 0.3]))


def _observation(directions: int, repeats: tuple[int, ...]) -> Observation:
    rng = np.random.default_rng(6)
    normals = fibonacci_cap(directions, 1.7)
    groups = np.repeat(np.arange(directions), np.resize(repeats, directions))
    lobes = real_spherical_harmonics(normals, [(3, 3), (2, 0)]) @ [0.003, 0.004]
    radius = 15.49 - lobes[groups] + rng.normal(0.0, 3e-4, len(groups))
    return Observation(normals[groups] * radius[:, None], groups, np.zeros(3), 12.5, 3.0, False)


@pytest.mark.parametrize("repeats", [(2,), (2, 1, 3)])
def test_coefficients_of_many_directions_are_those_of_generalised_least_squares(repeats):
    seen = _observation(300, repeats)
    free, terms = degrees_and_orders(1), sphere_terms(300)
    fit = fit_harmonics(seen.places, seen.values, seen.groups, free, terms, _AMPLITUDES)
    problem = _Problem(seen.places, seen.values, seen.groups, free, terms)
    count = np.bincount(seen.groups).astype(float)
    average = np.zeros((300, len(seen.groups)))
    average[seen.groups, np.arange(len(seen.groups))] = 1.0 / count[seen.groups]
    design = average @ real_spherical_harmonics(seen.directions, np.concatenate([free, terms]))
    hat = np.zeros((300, 300))
    for h, weight in zip(fit.amplitudes.points, fit.amplitudes.weights, strict=True):
        turned = design.copy()
        turned[:, 4:] = problem.turned(design[:, 4:], h[6])
        # Terms without a prior: a variance far above that of everything else. [um²]
        prior = np.concatenate([np.full(4, 1e6), problem.prior_variances(h)])
        own = np.exp(2.0 * h[5]) / count + np.exp(2.0 * h[7])
        total = (turned * prior) @ turned.T + np.diag(own)
        hat += weight * turned @ (prior[:, None] * np.linalg.solve(total, turned).T)
    expected = hat @ (average @ seen.values)
    # The matrix of all pairs has a condition of 1e6 * 300 / 0.01: it loses ten of sixteen digits.
    assert np.allclose(design @ fit.coefficients, expected, rtol=0.0, atol=1e-6 * 0.01)
    assert np.allclose(fit.smoothing.leverage, np.diag(hat), rtol=0.0, atol=1e-6)


def test_fitted_values_are_linear_in_the_touches_with_the_stated_leverage():
    seen = _observation(300, (2, 1, 3))
    free, terms = degrees_and_orders(1), sphere_terms(300)
    first = fit_harmonics(seen.places, seen.values, seen.groups, free, terms, _AMPLITUDES)
    again = fit_harmonics(
        seen.places, 1.5 * seen.values, seen.groups, free, terms, first.amplitudes
    )
    values = first.smoothing.means.values(again.coefficients)
    # Normal equations lose half of the digits of 0.03 mm; a tenth of a nanometre is enough.
    fitted = first.smoothing.fitted(1.5 * seen.values, seen.groups)
    assert np.allclose(fitted, values, rtol=0.0, atol=1e-7)
    each = np.array(
        [
            first.smoothing.fitted(one, seen.groups)[row]
            for row, one in enumerate(np.eye(len(seen.groups))[:12])
        ]
    )
    by_direction = np.bincount(seen.groups[:12], each)
    assert np.allclose(first.smoothing.leverage[: len(by_direction) - 1], by_direction[:-1])


def test_harmonics_in_blocks_are_those_of_single_directions():
    directions = fibonacci_cap(9000, 3.0)
    terms = sphere_terms(1000)
    whole = real_spherical_harmonics(directions, terms)
    rows = [0, 4095, 4096, 8999]
    each = np.concatenate([real_spherical_harmonics(directions[r : r + 1], terms) for r in rows])
    assert np.array_equal(whole[rows], each)


def test_harmonics_are_those_of_scipy():
    from scipy.special import sph_harm_y

    directions = np.concatenate([fibonacci_cap(200, 3.1), np.eye(3), -np.eye(3)])
    polar = np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2])
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    for degree, order in ((0, 0), (3, 3), (24, 24), (24, 21), (15, -6), (30, 0), (8, -7)):
        value = np.sqrt(4.0 * np.pi) * sph_harm_y(degree, abs(order), polar, azimuth)
        if order:  # without the Condon-Shortley phase, real parts of mean square one
            value = value * (-1.0) ** order * np.sqrt(2.0)
        expected = value.imag if order < 0 else value.real
        found = real_spherical_harmonics(directions, [(degree, order)])[:, 0]
        assert np.allclose(found, expected, rtol=0.0, atol=1e-12)
