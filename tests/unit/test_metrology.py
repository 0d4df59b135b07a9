"""Fits, uncertainties and outliers, against Monte Carlo and by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.compensation import apply, compensation_warnings
from pretravel.directions import fibonacci_cap, from_angles, sphere_pattern_25, unit
from pretravel.errors import ExtrapolationError, PretravelError
from pretravel.formats.csv_table import read_csv_table
from pretravel.formats.points import write_points
from pretravel.formats.touches_csv import read_touches
from pretravel.maps.bases import HarmonicBasis, MeanBasis, SectorBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.map_fit import Kind
from pretravel.qualification.qualification import qualify
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.uncertainty.fitting import fit_sphere
from tests.conftest import EXAMPLES, sphere_touches


class TestSphereFit:
    def test_far_from_the_origin(self) -> None:
        """A 10 mm ball 100 m away: doubles leave 1.5e-11 mm there, the fit hardly more."""
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

    def test_covariance_against_monte_carlo(self) -> None:
        """4000 draws: variances are known to 2.2 % (one sigma); 10 % is allowed."""
        rng = np.random.default_rng(2)
        n, sigma = sphere_pattern_25(), 1e-3
        fits = [fit_sphere(n * (10.0 + rng.normal(0.0, sigma, 25))[:, None]) for _ in range(4000)]
        sample = np.cov(np.array([[*fit.center, fit.radius] for fit in fits]).T)
        expected = sigma**2 * fits[0].cofactor
        assert np.allclose(np.diag(sample), np.diag(expected), rtol=0.1)

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


class TestCompensation:
    SUPPORT = DirectionSupport(fibonacci_cap(60, np.pi / 2))

    def _map(self) -> PretravelMap:
        return PretravelMap(
            MeanBasis(), np.array([0.012]), np.array([[4e-8]]), self.SUPPORT,
            tip_radius=3.0, u_tip_radius=1.5e-4, repeatability=3e-4,
        )  # fmt: skip

    def test_covariance_against_monte_carlo(self) -> None:
        """Reading, map and tip radius drawn at random; 20 000 draws know variances to 1 %."""
        rng = np.random.default_rng(7)
        n = np.array([[0.6, 0.0, 0.8]])
        a = unit([[-0.2, 0.1, -1.0]])
        pretravel_map = self._map()
        points = apply(Touches([[10.0, 20.0, 30.0]], n, a), pretravel_map)
        closing = -(a @ n.T).item()
        draws = 20_000
        reading = [10.0, 20.0, 30.0] + rng.normal(0.0, 3e-4, (draws, 1)) * a
        travel = (0.012 + rng.normal(0.0, 2e-4, (draws, 1))) / closing
        radius = 3.0 + rng.normal(0.0, 1.5e-4, (draws, 1))
        sample = np.cov((reading - travel * a - radius * n).T)
        assert np.allclose(sample, points.covariance[0], atol=0.04 * np.trace(sample))
        along = (n @ sample @ n.T).item()
        assert points.standard_uncertainty[0] == pytest.approx(np.sqrt(along), rel=0.03)

    def test_oblique_map_uncertainty_in_closed_form(self) -> None:
        """Approach 60° off the normal: the travel's uncertainty is that of the map over cos 60°,
        and along the normal it comes back to the map's. Repeatability acts along the approach."""
        n = np.array([[0.0, 0.0, 1.0]])
        a = np.array([[math.sqrt(0.75), 0.0, -0.5]])
        quiet = replace(self._map(), repeatability=0.0, u_tip_radius=0.0)
        points = apply(Touches([[0.0, 0.0, 3.0]], n, a), quiet)
        assert np.allclose(points.covariance[0], 4.0 * 4e-8 * np.outer(a[0], a[0]), atol=1e-18)
        assert points.standard_uncertainty[0] == pytest.approx(2e-4)
        noisy = replace(quiet, repeatability=3e-4, covariance=np.zeros((1, 1)))
        along = apply(Touches([[0.0, 0.0, 3.0]], n, a), noisy).standard_uncertainty[0]
        assert along == pytest.approx(0.5 * 3e-4)

    def test_oblique_approaches_are_warned_of(self) -> None:
        """Only of a map that was measured, so that it may hold a delay."""
        n = np.array([[0.0, 0.0, 1.0]])
        for tilt, noise, expected in ((30.0, 3e-4, True), (5.0, 3e-4, False), (30.0, 0.0, False)):
            a = [[math.sin(math.radians(tilt)), 0.0, -math.cos(math.radians(tilt))]]
            touches = Touches([[0.0, 0.0, 3.0]], n, a)  # type: ignore[arg-type]
            pretravel_map = replace(self._map(), repeatability=noise)
            warnings = compensation_warnings(touches, apply(touches, pretravel_map), pretravel_map)
            assert any("off the normal" in warning for warning in warnings) == expected

    def test_deviation_has_a_sign_and_only_the_normal_part(self) -> None:
        n = np.array([[0.0, 0.0, 1.0]])
        low = Touches([[6.0, 5.0, 3.0 - 0.012 - 0.005]], n, nominal_points=[[5.0, 5.0, 0.0]])
        deviation = apply(low, self._map()).deviation
        assert deviation is not None
        assert deviation[0] == pytest.approx(-0.005, abs=1e-12)

    def test_u_um_in_the_file_is_along_the_normal(self, tmp_path: Path) -> None:
        n = np.array([[0.0, 0.6, 0.8]])
        a = unit([[0.3, -0.1, -1.0]])
        points = apply(Touches([[0.0, 0.0, 3.0]], n, a), self._map())
        write_points(tmp_path / "p.csv", points)
        written = read_csv_table(tmp_path / "p.csv").numbers("u_um")[0, 0]
        assert written == pytest.approx(1e3 * math.sqrt((n @ points.covariance[0] @ n.T).item()))

    def test_deviation_from_nominal_points_and_surfaces(self) -> None:
        n = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
        surface = np.array([[5.0, 5.0, 0.0], [0.0, 6.0, 8.0]])
        positions = surface + (3.0 - 0.012 + 0.005) * n
        touches = Touches(positions, n, nominal_points=surface)
        assert np.allclose(apply(touches, self._map()).deviation, 0.005, atol=1e-12)
        ball = apply(touches, self._map(), nominal=Sphere([0.0, 0.0, 0.0], 10.0)).deviation
        # The stem gives 16 µm along the ball: it slides to where 16² / (2 · 13 mm) is 10 nm.
        assert ball[1] == pytest.approx(0.005, abs=2e-5)
        floor = apply(touches, self._map(), nominal=Plane([0, 0, 0], [0, 0, 1])).deviation
        assert floor[0] == pytest.approx(0.005, abs=1e-12)
        assert apply(Touches(positions, n), self._map()).deviation is None

    def test_outside_the_map(self) -> None:
        down = unit([[0.0, 0.5, -0.8]])
        with pytest.raises(ExtrapolationError, match="1 of 1 directions"):
            apply(Touches([[0.0, 0.0, 0.0]], down), self._map())
        apply(Touches([[0.0, 0.0, 0.0]], down), self._map(), extrapolate=True)


class TestQualification:
    def _pretravel(self, n: np.ndarray) -> np.ndarray:
        azimuth = np.arctan2(n[:, 1], n[:, 0])
        sine = np.hypot(n[:, 0], n[:, 1])
        return 0.002 + 0.010 * sine**2 + 0.003 * sine**3 * np.cos(3.0 * azimuth - 0.7)

    def _touches(self, seed: int = 0, noise: float = 3e-4, repeats: int = 3) -> Touches:
        n = np.repeat(sphere_pattern_25(), repeats, axis=0)
        rng = np.random.default_rng(seed)
        return sphere_touches(self._pretravel(n) + rng.normal(0.0, noise, len(n)), n)

    def test_repeatability_is_pooled(self) -> None:
        """By hand: mean of the 25 variances of three."""
        touches = self._touches()
        result = qualify(touches, 25.0, tip_diameter=6.0)
        distance = np.linalg.norm(touches.positions - result.center, axis=1)
        pooled = np.sqrt(distance.reshape(25, 3).var(axis=1, ddof=1).mean())
        assert result.repeatability == pytest.approx(pooled, rel=1e-3)
        assert result.repeatability_dof == 50.0

    def test_an_outlier_among_repeats_is_named_not_dropped(self) -> None:
        touches = self._touches()
        assert qualify(touches, 25.0, tip_diameter=6.0).outliers == ()
        positions = touches.positions.copy()
        positions[31] += 0.005 * touches.normals[31]
        bad = Touches(positions, touches.normals, lines=tuple(range(2, 77)))
        result = qualify(bad, 25.0, tip_diameter=6.0)
        assert [outlier.rows for outlier in result.outliers] == [(31,)]
        assert "touch 32 (line 33)" in result.outliers[0].message
        assert len(result.residuals) == 75

    def test_an_outlier_without_repeats_is_named(self) -> None:
        n = fibonacci_cap(120, np.radians(90.0))
        rng = np.random.default_rng(1)
        pretravel = self._pretravel(n) + rng.normal(0.0, 3e-4, 120)
        assert qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0).outliers == ()
        pretravel[60] += 0.01
        rows = [
            o.rows for o in qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0).outliers
        ]
        assert rows == [(60,)]

    @pytest.mark.parametrize("kind", ["mean", "sectors", "harmonic"])
    def test_tip_uncertainty_comes_from_the_sphere(self, kind: Kind) -> None:
        result = qualify(self._touches(), 25.0, tip_diameter=6.0, kind=kind, u_diameter=4e-4)
        assert result.pretravel_map.u_tip_radius == pytest.approx(2e-4)
        assert result.u_effective_radius > 2e-4

    def test_uncertainties_of_the_mean_kind_by_hand(self) -> None:
        """Eight directions once. What the mean leaves in any one direction: sum of squares over
        8 - 4. The radius: the same over the normal equations of a sphere, by numpy alone."""
        n = sphere_pattern_25()[[0, 5, 7, 9, 13, 15, 17, 19]]
        touches = sphere_touches(self._pretravel(n), n)
        result = qualify(
            touches, 25.0, tip_diameter=6.0, kind="mean", u_diameter=4e-4, search_outliers=False
        )
        distance = np.linalg.norm(touches.positions - result.center, axis=1)
        left = distance - distance.mean()
        variance = np.sum(left**2) / 4
        normals = (touches.positions - result.center) / distance[:, None]
        design = np.hstack([np.ones((8, 1)), normals])
        inverse = np.linalg.inv(design.T @ design)
        u = result.pretravel_map.standard_uncertainty(n)
        assert np.allclose(u, math.sqrt(variance), rtol=1e-4)
        expected = math.hypot(math.sqrt(variance * inverse[0, 0]), 2e-4)
        assert result.u_effective_radius == pytest.approx(expected, rel=1e-4)
        assert np.allclose(result.center_covariance, variance * inverse[1:, 1:], rtol=1e-3)

    def test_without_repeats_noise_is_not_lobing(self) -> None:
        """Kind mean, each direction once: 3 µm of lobing around it, yet the probe repeats to
        0.3 µm; degrees of freedom are the harmonic fit's."""
        n = fibonacci_cap(150, np.radians(90.0))
        rng = np.random.default_rng(1)
        pretravel = self._pretravel(n) + rng.normal(0.0, 3e-4, 150)
        result = qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0, kind="mean")
        assert np.std(result.residuals) > 1.5e-3
        assert result.repeatability == pytest.approx(3e-4, rel=0.25)
        assert result.repeatability_dof < 150

    def test_repeatability_without_repeats_has_the_fit_s_degrees_of_freedom(self) -> None:
        n = fibonacci_cap(150, np.radians(90.0))
        result = qualify(sphere_touches(self._pretravel(n), n), 25.0, tip_diameter=6.0)
        assert result.repeatability_dof == result.degrees_of_freedom

    @pytest.mark.parametrize("told", [1e-3, None])
    def test_harmonic_centre_radius_and_map_in_either_gauge(self, told: float | None) -> None:
        """60 noises on one probe. Scatter of a standard deviation from 60 draws is 9 % (one
        sigma); a prior makes the map scatter less than it says, never more: factors 0.5 to 1.3.
        In the gauge of the pole the value there is told, so it has no uncertainty left."""
        centers, radii, values, stated = [], [], [], []
        check = fibonacci_cap(40, np.radians(85.0))
        for seed in range(60):
            result = qualify(
                self._touches(seed), 25.0, tip_diameter=6.0, axial_pretravel=told,
                search_outliers=False,
            )  # fmt: skip
            centers.append(result.center)
            radii.append(result.effective_radius)
            values.append(result.pretravel_map.pretravel(check))
            stated.append(
                [
                    *np.sqrt(np.diag(result.center_covariance)),
                    result.u_effective_radius,
                    *result.pretravel_map.standard_uncertainty(check),
                ]
            )
        scatter = np.concatenate([np.std(centers, axis=0), [np.std(radii)], np.std(values, axis=0)])
        u = np.mean(stated, axis=0)
        ratio = scatter[:4] / u[:4]
        assert np.all((ratio > 0.5) & (ratio < 1.3)), ratio
        assert np.all(scatter[4:] < 1.3 * u[4:])
        pole = result.pretravel_map.standard_uncertainty([[0.0, 0.0, 1.0]])[0]
        assert (pole < 1e-9) == (told is not None)

    def test_in_its_gauge_the_map_has_no_first_harmonic(self) -> None:
        """Neither the map nor its uncertainty: across the axis its coefficients are zero, along it
        a least-squares sphere finds no shift over the touched directions."""
        touches = self._touches()
        result = qualify(touches, 25.0, tip_diameter=6.0, axial_pretravel=None)
        made = result.pretravel_map
        assert isinstance(made.basis, HarmonicBasis)
        across = (made.basis.terms[:, 0] == 1) & (made.basis.terms[:, 1] != 0)
        assert np.abs(made.coefficients[across]).max() < 1e-15
        assert np.abs(made.covariance[across]).max() < 1e-9 * made.covariance.max()
        n = result.contact_normals
        shift = np.linalg.pinv(np.hstack([np.ones((75, 1)), n]))[3]
        assert abs(shift @ made.pretravel(n)) < 1e-9
        assert shift @ made.value_covariance(n) @ shift < 1e-6 * result.center_covariance.max()

    def test_sectors_without_a_tip_diameter_give_the_same_points(self) -> None:
        touches = self._touches()
        found = []
        for tip_diameter in (6.0, None):
            made = qualify(touches, 25.0, tip_diameter=tip_diameter, kind="sectors").pretravel_map
            found.append(apply(touches, made).positions)
        assert np.allclose(found[0], found[1], atol=1e-9)

    def test_a_pair_that_disagrees_is_named(self) -> None:
        touches = self._touches(repeats=2)
        assert qualify(touches, 25.0, tip_diameter=6.0).outliers == ()
        positions = touches.positions.copy()
        positions[20] += 0.005 * touches.normals[20]
        result = qualify(Touches(positions, touches.normals), 25.0, tip_diameter=6.0)
        assert [outlier.rows for outlier in result.outliers] == [(20, 21)]

    def test_one_bad_touch_does_not_hide_a_bad_direction(self) -> None:
        touches = self._touches()
        positions = touches.positions.copy()
        positions[30:33] += 0.02 * touches.normals[30:33]
        positions[50] += 0.005 * touches.normals[50]
        result = qualify(Touches(positions, touches.normals), 25.0, tip_diameter=6.0)
        assert {outlier.rows for outlier in result.outliers} == {(50,), (30, 31, 32)}

    def test_repeats_are_told_by_distance(self) -> None:
        """A cell's border between two normals 1e-9 apart is no border."""
        n = np.repeat(sphere_pattern_25(), 2, axis=0)
        n[::2, 0] += 1e-9
        n[:, 0] += 0.0005 * n[:, 2]
        result = qualify(sphere_touches(self._pretravel(n), unit(n)), 25.0, tip_diameter=6.0)
        assert result.groups.max() == 24

    def test_mixed_feeds_tell_the_delay(self) -> None:
        """Touches that were made without one: zero, within three standard uncertainties."""
        touches = self._touches()
        mixed = replace(touches, feeds=np.where(np.arange(75) % 2 == 0, 50.0, 500.0))
        result = qualify(mixed, 25.0, tip_diameter=6.0, kind="mean")
        assert result.delay is not None
        assert abs(result.delay.delay) < 3.0 * result.delay.u_delay
        assert result.pretravel_map.feed == 0.0

    def test_centre_of_a_three_lobed_probe(self) -> None:
        """Rings of four and eight touches see lobes as a shift of the least-squares sphere by 1 um;
        the harmonic kind does not: within three of its standard uncertainties, and 0.5 um."""
        from pretravel.probe.catalogue import load_probe
        from pretravel.trigger.predict import predict

        probe, n = load_probe("omp40-2-100mm"), np.repeat(sphere_pattern_25(), 3, axis=0)
        rng = np.random.default_rng(1)
        distance = 15.5 - predict(probe, n).pretravel + rng.normal(0.0, 3e-4, 75)
        touches = Touches(n * distance[:, None], n)
        assert np.abs(fit_sphere(touches.positions).center[:2]).max() > 0.8e-3
        result = qualify(touches, 25.0, tip_diameter=6.0)
        u = np.sqrt(np.diag(result.center_covariance))[:2]
        assert np.all(np.abs(result.center[:2]) < np.minimum(3.0 * u, 0.5e-3))

    def test_degrees_of_freedom(self) -> None:
        """Mean: 75 touches less centre (3) and mean (1)."""
        assert (
            qualify(self._touches(), 25.0, tip_diameter=6.0, kind="mean").degrees_of_freedom == 71
        )
        harmonic = qualify(self._touches(), 25.0, tip_diameter=6.0)
        assert 50.0 <= harmonic.degrees_of_freedom < 71.0

    def test_centre_and_radius_covariance_against_monte_carlo(self) -> None:
        """Mean kind on a perfect probe; 600 draws know variances to 6 %, 25 % is allowed."""
        n = np.repeat(sphere_pattern_25(), 3, axis=0)
        rng = np.random.default_rng(3)
        results = [
            qualify(
                sphere_touches(0.01 + rng.normal(0.0, 3e-4, 75), n),
                25.0,
                tip_diameter=6.0,
                kind="mean",
                search_outliers=False,
            )
            for _ in range(600)
        ]
        centers = np.array([r.center for r in results])
        stated = np.mean([np.diag(r.center_covariance) for r in results], axis=0)
        assert np.allclose(centers.var(axis=0), stated, rtol=0.25)
        radii = np.array([r.effective_radius for r in results])
        u_radius = np.mean([r.u_effective_radius for r in results])
        assert radii.std() == pytest.approx(u_radius, rel=0.125)

    def test_harmonic_uncertainty_at_the_touches_against_monte_carlo(self) -> None:
        """A fixed smooth probe, many noises: where it is touched, the map scatters no more than it
        says, and its mean error is small against u (a prior's bias)."""
        n = sphere_pattern_25()
        values, stated = [], []
        for seed in range(60):
            result = qualify(self._touches(seed), 25.0, tip_diameter=6.0, axial_pretravel=None)
            values.append(result.pretravel_map.pretravel(n))
            stated.append(result.pretravel_map.standard_uncertainty(n))
        scatter = np.array(values).std(axis=0)
        u = np.mean(stated, axis=0)
        assert np.all(scatter < 1.3 * u)
        assert np.median(scatter) > 0.5 * np.median(u)


class TestMapValidation:
    SUPPORT = DirectionSupport(sphere_pattern_25())

    @pytest.mark.parametrize(
        ("coefficients", "covariance", "words"),
        [
            (np.zeros(2), np.zeros(1), "needs 1 coefficients"),
            (np.zeros(1), np.zeros((2, 2)), "covariance of 1"),
            (np.array([np.nan]), np.zeros(1), "must be finite"),
            (np.zeros(1), np.array([-1.0]), "cannot be negative"),
        ],
    )
    def test_sizes(self, coefficients: np.ndarray, covariance: np.ndarray, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            PretravelMap(MeanBasis(), coefficients, covariance, self.SUPPORT, tip_radius=3.0)

    def test_not_a_covariance(self) -> None:
        bad = np.array([[1e-8, -9e-8], [-9e-8, 1e-8]])
        basis = HarmonicBasis(np.array([[0, 0], [1, 0]]))
        with pytest.raises(PretravelError, match="not a covariance"):
            PretravelMap(basis, np.zeros(2), bad, self.SUPPORT, tip_radius=3.0)

    def test_variances_alone_are_shared_errors(self) -> None:
        """Halfway between sectors of 2 and 4 µm u is 3 µm, not less than either's share."""
        variances = np.full(10, 4e-6)
        variances[3] = 16e-6
        made = PretravelMap(SectorBasis(), np.zeros(10), variances, self.SUPPORT, tip_radius=3.0)
        between = from_angles(np.pi / 2, np.radians([45.0, 30.0]))
        assert np.allclose(made.standard_uncertainty(between), [3e-3, 2e-3])
        assert np.allclose(made.value_covariance(between), np.outer([3e-3, 2e-3], [3e-3, 2e-3]))

    def test_values_cannot_be_written_to(self) -> None:
        made = PretravelMap(MeanBasis(), np.zeros(1), np.zeros(1), self.SUPPORT, tip_radius=3.0)
        with pytest.raises(ValueError, match="read-only"):
            made.coefficients[0] = 1.0  # type: ignore[index]

    def test_many_directions_are_the_same_as_few(self) -> None:
        """Chunks: values do not depend on how many are asked for at once."""
        basis = HarmonicBasis(degrees_and_orders(12))
        rng = np.random.default_rng(0)
        half = rng.normal(size=(basis.size, basis.size)) * 1e-5
        made = PretravelMap(
            basis, rng.normal(size=basis.size), half @ half.T, self.SUPPORT, tip_radius=3.0
        )
        n = fibonacci_cap(50_001, 1.5)
        assert np.allclose(made.pretravel(n)[-3:], made.pretravel(n[-3:]), atol=1e-13)
        assert np.allclose(
            made.standard_uncertainty(n)[-3:], made.standard_uncertainty(n[-3:]), rtol=1e-9
        )

    def test_sector_basis_sums_to_one(self) -> None:
        assert np.allclose(SectorBasis().design(fibonacci_cap(500, 3.0)).sum(axis=1), 1.0)


class TestWhatAQualificationWarnsOf:
    """Mistakes that still give a map: they must not pass in silence."""

    def _example(self) -> Touches:
        return read_touches(EXAMPLES / "sphere_touches.csv")

    @pytest.mark.parametrize("chip", [0.02, 0.25])
    def test_a_chip_under_all_repeats_is_named(self, chip: float) -> None:
        touches = self._example()
        positions = touches.positions.copy()
        positions[30:33] += chip * touches.normals[30:33]
        moved = Touches(positions, touches.normals)
        result = qualify(moved, 24.9987, tip_diameter=6.0)
        assert [outlier.rows for outlier in result.outliers] == [(30, 31, 32)]
        assert any("falls to -" in warning for warning in result.warnings)

    def test_the_example_itself_is_clean(self) -> None:
        result = qualify(self._example(), 24.9987, tip_diameter=6.0)
        assert result.outliers == ()
        assert result.warnings == ()

    @pytest.mark.parametrize(
        ("keep", "options", "words"),
        [
            (slice(None), {"diameter": 24.93}, "no probe triggers before contact"),
            (slice(None), {"tip_diameter": 6.2}, "probes give by 1 to 80"),
            (slice(None), {"tip_diameter": None}, "without --tip-diameter"),
            (slice(0, 15), {}, "from a cap"),
        ],
    )
    def test_warnings(self, keep: slice, options: dict[str, float | None], words: str) -> None:
        touches = self._example().take(np.arange(75)[keep])
        arguments = {"diameter": 24.9987, "tip_diameter": 6.0, **options}
        result = qualify(touches, **arguments)  # type: ignore[arg-type]
        assert any(words in warning for warning in result.warnings), result.warnings

    def test_delay_travel_is_allowed_for_where_the_feed_is_told(self) -> None:
        """At 600 mm/min and 14.5 ms the spindle travels 145 µm further: too much for a probe, but
        not for a machine that moves so fast."""
        example = self._example()
        late = example.positions - 0.145 * example.normals
        with pytest.raises(PretravelError, match="feed_mm_min"):
            qualify(Touches(late, example.normals), 24.9987, tip_diameter=6.0)
        told = Touches(late, example.normals, feeds=np.full(75, 600.0))
        result = qualify(told, 24.9987, tip_diameter=6.0, kind="mean")
        assert result.effective_radius == pytest.approx(2.98363 - 0.145, abs=1e-5)

    def test_a_wide_gap_is_warned_of(self) -> None:
        """Pole and equator alone: in between the map is a guess, and says so."""
        touches = self._example()
        ends = np.abs(touches.normals[:, 2] - 0.5) > 0.45
        result = qualify(touches.take(ends), 24.9987, tip_diameter=6.0)
        assert any("between the touches u" in warning for warning in result.warnings)

    def test_a_pole_that_was_not_touched_is_told(self) -> None:
        touches = self._example()
        result = qualify(touches.take(np.arange(3, 75)), 24.9987, tip_diameter=6.0)
        assert "the pole was not touched" in result.pretravel_map.provenance["gauge"]
