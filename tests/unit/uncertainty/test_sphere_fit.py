"""Fit of a sphere: far from the origin, with covariance against Monte Carlo."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25, unit
from pretravel.base.errors import PretravelError
from pretravel.uncertainty.sphere_fit import fit_sphere


class TestSphereFit:
    def test_far_from_the_origin(self) -> None:
        """A 10 mm ball 100 m away: doubles have an error of 1.5e-11 mm, the fit hardly more."""
        n = fibonacci_cap(50, np.pi)
        center = np.array([1e5, -1e5, 5e4])
        fit = fit_sphere(center + 5.0 * n)
        assert np.allclose(fit.center, center, atol=1e-10)
        assert fit.radius == pytest.approx(5.0, abs=1e-10)

    def test_gradient_of_the_squares_vanishes(self) -> None:
        rng = np.random.default_rng(1)
        points = [1.0, 2.0, 3.0] + 10.0 * fibonacci_cap(40, 1.2) + rng.normal(0, 0.1, (40, 3))
        fit = fit_sphere(points)
        directions = unit(points - fit.center)
        assert abs(fit.residuals.sum()) < 1e-10
        assert np.abs(directions.T @ fit.residuals).max() < 1e-10

    @pytest.mark.parametrize("draws", [600, pytest.param(4000, marks=pytest.mark.slow)])
    def test_covariance_against_monte_carlo(self, draws: int) -> None:
        """n draws determine variances to √(2/n) (one sigma); four and a half of that."""
        rng = np.random.default_rng(2)
        n, sigma = sphere_pattern_25(), 1e-3
        fits = [fit_sphere(n * (10.0 + rng.normal(0.0, sigma, 25))[:, None]) for _ in range(draws)]
        sample = np.cov(np.array([[*fit.center, fit.radius] for fit in fits]).T)
        expected = sigma**2 * fits[0].cofactor
        assert np.allclose(np.diag(sample), np.diag(expected), rtol=4.5 * np.sqrt(2.0 / draws))

    @pytest.mark.parametrize(
        ("points", "words"),
        [
            (np.eye(3), "at least 4 points"),
            (np.hstack([np.random.default_rng(0).normal(size=(9, 2)), np.zeros((9, 1))]), "plane"),
        ],
    )
    def test_refuses(self, points: np.ndarray, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            fit_sphere(points)

    def test_flat_points_with_noise_end_with_a_message(self) -> None:
        """Some of these ended in a LinAlgError: the centre was some kilometres away."""
        rng = np.random.default_rng(1)
        for _ in range(300):
            flat = np.c_[rng.uniform(0.0, 100.0, (9, 2)), rng.normal(0.0, 0.005, 9)]
            with contextlib.suppress(PretravelError):
                fit_sphere(flat)
