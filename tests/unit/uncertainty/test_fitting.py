"""Least-squares plane, circle and cylinder: exact, ill-scaled, with valid covariances."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.uncertainty.circle_fit import fit_circle
from pretravel.uncertainty.cone_fit import fit_cone
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.cylinder_fit import fit_cylinder
from pretravel.uncertainty.plane_fit import fit_plane
from pretravel.uncertainty.sphere_fit import fit_sphere


def _frame(rng: np.random.Generator) -> np.ndarray:
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q


def _cylinder(
    rng: np.random.Generator, radius: float, length: float, count: int, spread: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    frame = _frame(rng)
    angle = rng.uniform(0.0, spread, count)
    outward = np.cos(angle)[:, None] * frame[0] + np.sin(angle)[:, None] * frame[1]
    foot = rng.normal(size=3) * 10.0 ** rng.uniform(0.0, 5.0)
    points = foot + radius * outward + rng.uniform(-1, 1, count)[:, None] * length * frame[2]
    return points, outward, frame[2], foot


class TestCylinder:
    @pytest.mark.parametrize("seed", range(30))
    def test_any_size_place_and_proportion(self, seed: int) -> None:
        """Radius 0.1 to 1000 mm, length a tenth to tenfold, far from the origin, arcs of 100°."""
        rng = np.random.default_rng(seed)
        radius = 10.0 ** rng.uniform(-1.0, 3.0)
        length = radius * 10.0 ** rng.uniform(-1.0, 1.0)
        points, _, axis, _ = _cylinder(rng, radius, length, 30, rng.choice([1.8, 2.0 * np.pi]))
        fit = fit_cylinder(points)
        rounding = 1e-14 * np.abs(points).max()
        assert np.abs(fit.residuals).max() < 1e-10 * radius + 100.0 * rounding
        assert abs(fit.axis @ axis) > 1.0 - 1e-9 - (1e3 * rounding / min(radius, length)) ** 2
        assert fit.radius == pytest.approx(radius, rel=1e-6)

    @pytest.mark.parametrize("trials", [150, pytest.param(1500, marks=pytest.mark.slow)])
    def test_covariance_against_trials(self, trials: int) -> None:
        """A deviation of n trials scatters by 1/√(2n); four of that are allowed."""
        rng = np.random.default_rng(5)
        points, outward, axis, _ = _cylinder(rng, 5.0, 10.0, 25, 6.0)
        sigma = 1e-3
        found = []
        for _ in range(trials):
            fit = fit_cylinder(points + sigma * rng.normal(size=(25, 1)) * outward, axis=axis)
            found.append(np.concatenate([fit.point, fit.axis, [fit.radius]]))
        stated = np.sqrt(np.diag(fit_cylinder(points, axis=axis).cofactor)) * sigma
        assert np.std(found, axis=0) == pytest.approx(stated, rel=4.0 / np.sqrt(2.0 * trials))

    @pytest.mark.slow
    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_cross_covariances_wherever_the_start_points(self, sign: float) -> None:
        """The sense of an axis makes its largest component positive; its covariances with point
        and radius change sign with it."""
        angle = np.linspace(0.0, 2.5, 20)
        outward = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        points = 5.0 * outward + np.outer(8.0 * angle**2, [0.0, 0.0, 1.0])
        start, sigma, rng = np.array([0.0, 0.0, sign]), 1e-4, np.random.default_rng(1)
        found = []
        for _ in range(3000):
            fit = fit_cylinder(points + sigma * rng.normal(size=(20, 1)) * outward, axis=start)
            found.append(np.concatenate([fit.point, fit.axis, [fit.radius]]))
        stated = fit_cylinder(points, axis=start).cofactor
        trials = np.cov(found, rowvar=False) / sigma**2
        root = np.sqrt(np.outer(np.diag(stated), np.diag(stated)))
        assert np.abs(trials - stated).max() < 0.08 * root.max()
        assert trials[6, 3:5] == pytest.approx(stated[6, 3:5], rel=0.15)

    def test_points_in_a_line_or_a_place(self) -> None:
        for points in (np.outer(np.arange(6.0), [1.0, 2.0, 3.0]), np.ones((6, 3))):
            with pytest.raises(PretravelError, match="one line"):
                fit_cylinder(points)

    def test_one_circle_leaves_the_axis_open(self) -> None:
        angle = np.linspace(0.0, 6.0, 20)
        ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        with pytest.raises(PretravelError, match="one circle"):
            fit_cylinder(ring)

    def test_too_few(self) -> None:
        with pytest.raises(PretravelError, match="at least 5 points"):
            fit_cylinder(np.eye(3))


def _cone(
    rng: np.random.Generator, half_angle: float, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a cone with radius 10 mm at its middle, its outward normals and its axis."""
    frame = _frame(rng)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    outward = np.cos(angle)[:, None] * frame[0] + np.sin(angle)[:, None] * frame[1]
    height = rng.uniform(-5.0, 5.0, count) / max(1.0, np.tan(half_angle))
    radius = 10.0 + height * np.tan(half_angle)
    points = [1e3, -2e3, 50.0] + radius[:, None] * outward + height[:, None] * frame[2]
    return points, np.cos(half_angle) * outward - np.sin(half_angle) * frame[2], frame[2]


class TestCone:
    @pytest.mark.parametrize("degrees", [1.0, 7.0, 30.0, 45.0, 60.0, 80.0])
    def test_any_angle_without_a_start(self, degrees: float) -> None:
        points, _, axis = _cone(np.random.default_rng(int(degrees)), np.radians(degrees), 30)
        fit = fit_cone(points)
        assert np.abs(fit.residuals).max() < 1e-9  # rounding of coordinates of 2000 mm
        assert fit.axis @ axis == pytest.approx(1.0, abs=1e-12)
        assert np.degrees(fit.half_angle) == pytest.approx(degrees, abs=1e-7)
        along = (np.array([1e3, -2e3, 50.0]) - fit.point) @ fit.axis
        assert fit.radius + along * np.tan(fit.half_angle) == pytest.approx(10.0, abs=1e-8)

    @pytest.mark.parametrize("trials", [150, pytest.param(1000, marks=pytest.mark.slow)])
    def test_covariance_against_trials(self, trials: int) -> None:
        """A deviation of n trials scatters by 1/√(2n); four of that are allowed."""
        rng = np.random.default_rng(8)
        points, normals, axis = _cone(rng, np.radians(20.0), 25)
        sigma = 1e-3
        exact = fit_cone(points, axis=axis)
        found = []
        for _ in range(trials):
            fit = fit_cone(points + sigma * rng.normal(size=(25, 1)) * normals, axis=axis)
            # The centroid moves along the axis with the noise; the height of the exact one counts.
            along = (exact.point - fit.point) @ exact.axis
            point = fit.point + along * fit.axis
            radius = fit.radius + along * np.tan(fit.half_angle)
            found.append(np.concatenate([point, fit.axis, [radius, fit.half_angle]]))
        stated = np.sqrt(np.diag(exact.cofactor)) * sigma
        assert np.std(found, axis=0) == pytest.approx(stated, rel=4.0 / np.sqrt(2.0 * trials))

    def test_one_circle(self) -> None:
        angle = np.linspace(0.0, 5.0, 8)
        with pytest.raises(PretravelError, match="cone"):
            fit_cone(np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))


class TestPlane:
    @pytest.mark.parametrize("trials", [500, pytest.param(3000, marks=pytest.mark.slow)])
    def test_covariance_against_trials(self, trials: int) -> None:
        """A deviation of n trials scatters by 1/√(2n); four of that are allowed."""
        rng = np.random.default_rng(2)
        frame = _frame(rng)
        points = 1e4 + rng.uniform(-30.0, 30.0, (40, 2)) @ frame[:2]
        sigma = 1e-3
        exact = fit_plane(points)
        assert abs(exact.normal @ frame[2]) == pytest.approx(1.0, abs=1e-12)
        tilts, offsets = [], []
        for _ in range(trials):
            fit = fit_plane(points + sigma * rng.normal(size=(40, 1)) * frame[2])
            tilts.append(fit.normal)
            offsets.append((fit.point - exact.point) @ exact.normal)
        stated = np.sqrt(np.diag(exact.cofactor)) * sigma
        allowed = 4.0 / np.sqrt(2.0 * trials)
        assert np.std(offsets) == pytest.approx(stated[0], rel=allowed)
        assert np.std(tilts, axis=0) == pytest.approx(stated[1:], rel=allowed)

    def test_points_in_a_line(self) -> None:
        with pytest.raises(PretravelError, match="one line"):
            fit_plane(np.outer(np.arange(5.0), [1.0, 2.0, 3.0]))


def test_circle_in_space() -> None:
    rng = np.random.default_rng(3)
    frame, center = _frame(rng), np.array([1e3, -2e3, 5e2])
    angle = rng.uniform(0.0, 2.0, 20)
    points = center + 7.0 * (np.cos(angle)[:, None] * frame[0] + np.sin(angle)[:, None] * frame[1])
    fit = fit_circle(points)
    assert fit.center == pytest.approx(center, abs=1e-9)
    assert fit.radius == pytest.approx(7.0, abs=1e-9)
    assert abs(fit.normal @ frame[2]) == pytest.approx(1.0, abs=1e-9)


def test_sphere_covariance_with_common_errors() -> None:
    """A common error along all normals changes the radius by its full amount and nothing else;
    independent errors follow the cofactor."""
    from pretravel.base.directions import sphere_pattern_25

    n = np.concatenate([sphere_pattern_25(), -sphere_pattern_25()])
    points = 10.0 * n
    fit = fit_sphere(points)
    common = fit.covariance(points, Covariance.fully_shared(np.full(50, 1e-6)))
    assert np.diag(common) == pytest.approx([0.0, 0.0, 0.0, 1e-6], abs=1e-18)
    own = fit.covariance(points, Covariance.independent(np.full(50, 1e-6)))
    assert own == pytest.approx(fit.cofactor * 1e-6, abs=1e-15)
