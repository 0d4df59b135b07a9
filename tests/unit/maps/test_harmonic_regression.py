"""The likelihood that determines the amplitudes of a harmonic map."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.base.frames import probe_rotation
from pretravel.maps.harmonic_regression import _Problem, sphere_terms
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics

N = sphere_pattern_25()
TERMS = sphere_terms(25)
TRANSLATION = degrees_and_orders(1)
# Two sets of amplitudes, decays, noise and fixed scatter; lobes about +x.
FIRST = np.array([-0.6, -0.2, -2.0, 2.5, 2.2, np.log(0.3), 0.0, np.log(0.06)])
SECOND = np.array([0.4, 0.5, -1.2, 2.0, 3.0, np.log(0.2), 0.0, np.log(0.10)])


def _problem(values: FloatArray, n: FloatArray, repeats: int) -> _Problem:
    groups = np.tile(np.arange(len(n)), repeats)
    places = Places(n, np.arange(len(n)), groups)
    return _Problem(places, values, groups, TRANSLATION, TERMS)


def _covariance(h: FloatArray, repeats: int) -> FloatArray:
    """Of single touches by the stated prior, in um²: zonal harmonics, lobes that are even about
    +x, all others; each decreases with a power of degree / 3."""
    degree, order = TERMS[:, 0], TERMS[:, 1]
    size = np.where(order == 0, h[0], np.where((order % 3 == 0) & (order > 0), h[1], h[2]))
    decay = np.where(order == 0, h[3], np.where((order % 3 == 0) & (order > 0), h[4], 2.5))
    prior = np.exp(2.0 * size) * (degree / 3.0) ** (-2.0 * decay)
    design = real_spherical_harmonics(N, TERMS)
    of_directions = (design * prior) @ design.T + np.exp(2.0 * h[7]) * np.eye(len(N))
    touches = np.kron(np.ones((repeats, repeats)), of_directions)
    return np.asarray(touches + np.exp(2.0 * h[5]) * np.eye(len(touches)))


def test_the_mean_and_the_translation_are_marginalised() -> None:
    """The restricted likelihood is that of contrasts: of combinations of the touches, whitened
    here by a basis of all vectors that mean and translation do not reach."""
    repeats = 3
    rng = np.random.default_rng(5)
    values = rng.normal(0.0, 0.5, repeats * len(N))
    problem = _problem(values, N, repeats)
    free = np.tile(real_spherical_harmonics(N, TRANSLATION), (repeats, 1))
    contrasts = np.linalg.svd(free)[0][:, free.shape[1] :]
    assert np.abs(contrasts.T @ free).max() < 1e-12

    def by_hand(h: FloatArray) -> float:
        covariance = contrasts.T @ _covariance(h, repeats) @ contrasts
        seen = contrasts.T @ values
        return float(
            0.5 * seen @ np.linalg.solve(covariance, seen) + 0.5 * np.linalg.slogdet(covariance)[1]
        )

    def of_code(h: FloatArray) -> float:
        return problem.cost_and_slopes(h)[0] - problem._minus_log_prior(h)

    assert of_code(SECOND) - of_code(FIRST) == pytest.approx(
        by_hand(SECOND) - by_hand(FIRST), abs=1e-9
    )


def test_a_translation_of_the_reference_tells_nothing() -> None:
    """Nor does the mean, but for the usual amplitudes, which are a share of it."""
    values = 40.0 + np.random.default_rng(5).normal(0.0, 0.5, len(N))
    moved = values + 7.0 * N[:, 0] - 5.0 * N[:, 2]
    problem, shifted = (_problem(v, N, 1) for v in (values, moved))
    plain, other = (each.cost_and_slopes(FIRST) for each in (problem, shifted))
    higher = _problem(values + 40.0, N, 1)
    of_touches = [each.cost_and_slopes(FIRST)[0] - each._minus_log_prior(FIRST)
                  for each in (problem, higher)]  # fmt: skip
    assert of_touches[0] == pytest.approx(of_touches[1], abs=1e-8)
    # The squares of 40 um over the noise add up to 4e5: a hundred times their rounding.
    assert plain[0] == pytest.approx(other[0], abs=1e-8)
    assert plain[1] == pytest.approx(other[1], abs=1e-7)


def test_lobes_turn_with_the_probe() -> None:
    """Directions turned about the axis, and the lobes' azimuth with them; asymmetric terms have
    one amplitude for cosine and sine, so that they turn too."""
    values = np.random.default_rng(5).normal(0.0, 0.5, len(N))
    turn = 0.3
    turned = N @ probe_rotation(rotation=turn).T
    about = FIRST + turn * np.eye(len(FIRST))[6]
    assert _problem(values, turned, 1).cost_and_slopes(about)[0] == pytest.approx(
        _problem(values, N, 1).cost_and_slopes(FIRST)[0], abs=1e-9
    )
    assert abs(
        _problem(values, turned, 1).cost_and_slopes(FIRST)[0]
        - _problem(values, N, 1).cost_and_slopes(FIRST)[0]
    ) > 1e-3  # fmt: skip


@pytest.mark.parametrize("h", [FIRST, SECOND + 0.2 * np.eye(8)[6]])
def test_slopes_are_those_of_the_cost(h: FloatArray) -> None:
    """Central differences: the error is 1e-4² times the third derivative, below 1e3 here."""
    values = np.random.default_rng(5).normal(0.0, 0.5, 2 * len(N))
    problem = _problem(values, N, 2)
    step = 1e-4
    for place, slope in enumerate(problem.cost_and_slopes(h)[1]):
        way = step * np.eye(len(h))[place]
        there, back = problem.cost_and_slopes(h + way)[0], problem.cost_and_slopes(h - way)[0]
        assert slope == pytest.approx((there - back) / (2.0 * step), abs=1e-5)
