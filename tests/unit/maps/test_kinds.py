"""Kinds of map: every field of their fits against independent least squares, and their centres."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import (
    fibonacci_cap,
    five_point_pattern,
    from_angles,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.maps.harmonic_regression import fit_harmonics
from pretravel.maps.kind import KindOfMap, MapFit, hidden_variance, usual_shift_covariance
from pretravel.maps.kinds.harmonic import HarmonicKind, HarmonicMapFit
from pretravel.maps.kinds.mean import MeanBasis, MeanKind, averaged
from pretravel.maps.kinds.sectors import SectorBasis, SectorsKind
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind, wozniak_constant
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import AXIAL_PRETRAVEL, U_AXIAL_PRETRAVEL
from pretravel.maps.spherical_harmonics import real_spherical_harmonics

NOTHING = Scatter(0.0, 0.0)
POLE = np.array([[0.0, 0.0, 1.0]])


def _seen(n: FloatArray, *, noise: float = 3e-4) -> Observation:
    """11 µm across the axis, 2 µm along it, lobes about 20°, a slope along y; about a centre that
    is wrong by 5 µm, with noise."""
    across = n[:, 0] ** 2 + n[:, 1] ** 2
    azimuth = np.arctan2(n[:, 1], n[:, 0])
    lobes = across**1.5 * np.cos(3.0 * (azimuth - math.radians(20.0)))
    values = 1e-3 * (2.0 + 9.0 * across + 3.0 * lobes + 0.4 * n[:, 1])
    scatter = np.random.default_rng(1).normal(0.0, noise, len(n))
    positions = n * (15.5 - values + scatter)[:, None] + [0.003, -0.004, 0.001]
    return Observation(positions, np.arange(len(n)), np.zeros(3), 12.5, 3.0, ring=False)


@cache
def _ring() -> Observation:
    """Inside a ring of 20 mm, about a centre that is wrong by 5 µm."""
    azimuth = np.arange(24) * 15.0 * DEGREE
    out = from_angles(0.5 * math.pi, azimuth)
    values = 0.011 + 0.003 * np.cos(3.0 * (azimuth + math.pi)) + 3e-4 * np.cos(7.0 * azimuth)
    positions = out * (7.0 + values)[:, None] + [1.0, 2.0, 0.7]
    return Observation(
        positions, np.arange(24), np.array([1.003, 1.996, 0.6]), 10.0, 3.0, ring=True
    )


@cache
def _fit(name: str) -> HarmonicMapFit:
    n = {
        "pole": sphere_pattern_25(),
        "near": ring_pattern(np.radians([4.9, 45.0, 85.0]), 8),
        "beside": ring_pattern(np.radians([5.3, 45.0, 85.0]), 8),
        "far": ring_pattern(np.radians([68.0, 80.0, 90.0]), 8),
    }
    return HarmonicKind().fit(_ring() if name == "ring" else _seen(n[name]), NOTHING)


class TestBases:
    def test_what_a_kind_may_leave_out(self) -> None:
        """No displacement, no probe, no form on a control, no arrays, no settings."""
        basis = SectorBasis()
        assert basis.displacement(POLE, None) is None
        assert basis.condensed_probe is None
        assert basis.form_on_control(np.zeros(10)) is None
        assert dict(basis.arrays()) == dict(basis.attributes()) == {}
        assert dict(basis.sensitivities(POLE)) == {}
        assert (basis.interpolates, TabulatedBasis.interpolates) == (False, True)
        fit = MeanKind().fit(_seen(sphere_pattern_25()), NOTHING)
        assert (fit.tip_radius, fit.noise_is_repeatability, fit.fixed_scatter) == (None, False, 0.0)
        assert MeanKind().warnings(fit, 1e-9) == []
        assert dict(MeanKind().settings()) == {}
        assert KindOfMap.refit(MeanKind(), fit, fit.observation) is None

    def test_what_is_told_of_the_kinds(self) -> None:
        kinds = (MeanKind, SectorsKind, WozniakKind, HarmonicKind)
        assert [each.needs_all_directions for each in kinds] == [False, True, False, False]
        assert [each.fits_harmonics for each in kinds] == [False, False, False, True]
        # Most probes are not a shape of one constant: what speaks for harmonics in advance.
        assert all(each.prior_weight < HarmonicKind.prior_weight < 1.0 for each in kinds[:3])


def _least_squares(seen: Observation) -> tuple[FloatArray, FloatArray]:
    """Mean and shift, and the inverse of the normal equations."""
    design = np.column_stack([np.ones(len(seen.values)), seen.directions[:, : seen.axes]])
    cofactor = np.linalg.inv(design.T @ design)
    return cofactor @ design.T @ seen.values, cofactor


def _check_average(
    kind: KindOfMap, fit: MapFit, seen: Observation, coefficients: FloatArray
) -> None:
    """Fields that means of directions have in common, about the least-squares centre."""
    solution, cofactor = _least_squares(seen)
    centred = seen.values - seen.directions[:, : seen.axes] @ solution[1:]
    assert fit.coefficients == pytest.approx(coefficients, abs=1e-12)
    residuals = centred - fit.basis.design(seen.directions) @ coefficients
    assert fit.residuals == pytest.approx(residuals, abs=1e-12)
    dof = max(len(centred) - seen.axes - len(coefficients), 1)
    variance = np.sum(residuals**2) / dof
    assert fit.dof == dof
    assert fit.noise == pytest.approx(math.sqrt(variance), rel=1e-6, abs=1e-15)
    # One standard deviation for any one direction, common to all coefficients.
    hidden = hidden_variance(seen) if seen.direction_count < 8 else 0.0
    expected = np.full((len(coefficients),) * 2, variance + hidden)
    assert fit.covariance.matrix == pytest.approx(expected, rel=1e-6, abs=1e-30)
    left = np.sum((centred - solution[0]) ** 2) / max(len(centred) - 1 - seen.axes, 1)
    assert fit.mean == pytest.approx(solution[0])
    assert fit.shift == pytest.approx(solution[1:], abs=1e-12)
    assert fit.u_mean == pytest.approx(math.sqrt(left * cofactor[0, 0]))
    expected = left * cofactor[1:, 1:] + usual_shift_covariance(seen)
    assert fit.shift_covariance == pytest.approx(expected, abs=1e-15)
    assert fit.observation is seen
    assert fit.gauge == "the reference's least-squares centre"
    centred_fit = kind.centered(fit, 1e-3)
    center = seen.center.copy()
    center[: seen.axes] -= solution[1:]
    assert centred_fit.center == pytest.approx(center, abs=1e-12)
    assert np.array_equal(centred_fit.center_covariance, fit.shift_covariance)
    assert np.array_equal(centred_fit.coefficients, fit.coefficients)


class TestAverages:
    @pytest.mark.parametrize(
        "seen", [_seen(fibonacci_cap(30, 1.6)), _seen(fibonacci_cap(5, 1.5)), _ring()]
    )
    def test_mean(self, seen: Observation) -> None:
        """Of five touches one degree of freedom is left; a fit near another one is a fit."""
        kind = MeanKind()
        fit = kind.fit(seen, NOTHING)
        for each in (fit, kind.refit(fit, seen), kind.fit_near(fit, seen, NOTHING)):
            assert each is not None
            _check_average(kind, each, seen, _least_squares(seen)[0][:1])

    @pytest.mark.parametrize(
        "n",
        [fibonacci_cap(4, 1.5), from_angles(85.0 * DEGREE, np.arange(6) * 60.0 * DEGREE)],
        ids=["four touches", "one polar angle"],
    )
    def test_a_sphere_through_all_touches_does_not_show_how_pretravel_varies(
        self, n: FloatArray
    ) -> None:
        with pytest.raises(PretravelError, match="do not determine centre and radius"):
            MeanKind().fit(_seen(n), NOTHING)

    def test_five_directions_hide_lobes_and_the_curve_to_the_pole(self) -> None:
        """1 µm + 9 µm (1 - z²), pole and four on the equator: the sphere takes 1 - z of 1 - z², and
        cos φ, -sin φ of cos 3φ, sin 3φ. What is left has the mean squares 1/30 and
        ∫(s⁶ + s²)/2 dz = (16/35 + 2/3)/2 for each azimuth of the lobes, 0.35/√2 of 9 µm. Beside
        it stands what the touches show: 0.3 µm of cos 2φ, with one degree of freedom."""
        n = five_point_pattern()
        values = 1e-3 * (1.0 + 9.0 * (n[:, 0] ** 2 + n[:, 1] ** 2))
        values += 3e-4 * (n[:, 0] ** 2 - n[:, 1] ** 2)
        seen = Observation(
            n * (15.5 - values)[:, None], np.arange(5), np.zeros(3), 12.5, 3.0, ring=False
        )
        hidden = 0.009**2 * (1.0 / 30.0 + 0.35**2 / 2.0 * (16.0 / 35.0 + 2.0 / 3.0))
        # A mean over 200 directions.
        assert hidden_variance(seen) == pytest.approx(hidden, rel=0.02)
        fit = MeanKind().fit(seen, NOTHING)
        assert fit.noise == pytest.approx(2.0 * 3e-4)
        assert fit.covariance.matrix[0, 0] == pytest.approx(hidden + fit.noise**2, rel=0.02)

    def test_repeats_do_not_show_more_of_how_pretravel_varies(self) -> None:
        once = _seen(fibonacci_cap(12, 1.5), noise=0.0)
        thrice = Observation(
            np.repeat(once.positions, 3, axis=0), np.repeat(np.arange(12), 3), once.center, 12.5,
            3.0, ring=False,
        )  # fmt: skip
        first, second = (MeanKind().fit(each, NOTHING) for each in (once, thrice))
        assert second.covariance.matrix == pytest.approx(first.covariance.matrix, rel=1e-9)
        assert (first.dof, second.dof) == (8.0, 32.0)

    def test_sectors(self) -> None:
        """Three rings of touches, of which those at polar angles of 60° and more count."""
        polar = np.repeat([30.0, 60.0, 90.0], 12)
        seen = _seen(from_angles(polar * DEGREE, np.tile(np.arange(12) * 30.0, 3) * DEGREE))
        # Contact normals lie 5 µm of 15 mm beside these: 60° must hold with a little more.
        seen = replace(seen, positions=seen.positions - np.array([0.0, 0.0, 0.02]))
        solution, _ = _least_squares(seen)
        centred = (seen.values - seen.directions @ solution[1:])[12:].reshape(2, 12)
        names = [0, 2, 3, 1, 4, 5, 0, 6, 7, 1, 8, 9]  # X, 30, 60, Y, 120, ...
        values = np.array(
            [centred[:, [i for i, name in enumerate(names) if name == k]].mean() for k in range(10)]
        )
        kind = SectorsKind()
        _check_average(kind, kind.fit(seen, NOTHING), seen, values)
        other = kind.fit(_seen(seen.directions, noise=1e-3), NOTHING)
        _check_average(kind, kind.refit(other, seen), seen, values)

    def test_a_sector_without_touches_is_named(self) -> None:
        n = from_angles(0.5 * math.pi, np.delete(np.arange(12) * 30.0, [2, 9, 3]) * DEGREE)
        seen = Observation(15.49 * n, np.arange(9), np.zeros(3), 12.5, 3.0, ring=False)
        with pytest.raises(
            PretravelError, match=r"falls into the sector Y or the sector at 60°\. A sector"
        ):
            SectorsKind().fit(seen, NOTHING)


class TestWozniak:
    @pytest.mark.parametrize(
        ("touches", "found"), [(40, False), (40, True), (4, False), (24, False), (24, True)]
    )
    def test_every_field(self, touches: int, found: bool) -> None:
        """On a sphere and inside a ring; four touches leave one degree of freedom."""
        ring, few = touches == 24, touches == 4
        seen = _ring() if ring else _seen(fibonacci_cap(touches, 1.6))
        fit = WozniakKind(None if found else 0.1).fit(seen, NOTHING)
        assert isinstance(fit.basis, WozniakBasis)
        assert fit.basis.transducer == "contact"
        if not found:
            assert fit.basis.lobe_azimuth == 0.1
        # About the centre that the fit itself found: a second fit has no shift any more.
        about = fit.observation
        n, axes = about.directions, about.axes
        shape = fit.basis.design(n)[:, 0]
        design = np.column_stack([shape, n[:, :axes]])
        solution = np.linalg.lstsq(design, about.values, rcond=None)[0]
        residuals = about.values - design @ solution
        dof = max(len(n) - 1 - axes - found, 1)
        variance = np.sum(residuals**2) / dof
        assert fit.coefficients == pytest.approx([solution[0], 0.0, 0.0])
        assert fit.residuals == pytest.approx(residuals, abs=1e-12)
        assert fit.dof == dof
        assert fit.noise == pytest.approx(math.sqrt(variance), abs=1e-12)
        assert fit.shift == pytest.approx(solution[1:], abs=1e-12)
        assert np.abs(fit.shift).max() < 1e-5
        if few:
            return
        cofactor = np.linalg.inv(design.T @ design)
        assert np.abs(about.center - seen.center)[:axes].max() > 1e-3
        sphere, of_sphere = _least_squares(about)
        assert fit.mean == pytest.approx(sphere[0])
        assert fit.u_mean == pytest.approx(math.sqrt(variance * of_sphere[0, 0]))
        left = usual_shift_covariance(about, 0.4)
        if not ring:
            left[2, 2] += AXIAL_PRETRAVEL**2 + U_AXIAL_PRETRAVEL**2
        expected = variance * cofactor[1:, 1:] + left
        assert fit.shift_covariance == pytest.approx(expected, abs=1e-15)
        # The azimuth as a fourth unknown, by the slope of the shape.
        h = 1e-6
        ahead = WozniakBasis(fit.basis.lobe_azimuth + h).design(n)[:, 0]
        back = WozniakBasis(fit.basis.lobe_azimuth - h).design(n)[:, 0]
        slope = solution[0] * (ahead - back) / (2.0 * h)
        assert np.abs(slope).max() < 10.0  # not across the edge between two lobes
        more = np.column_stack([design, slope])
        azimuth = math.sqrt(variance * np.linalg.inv(more.T @ more)[-1, -1]) if found else 0.0
        assert np.sqrt(np.diag(fit.covariance.matrix)) == pytest.approx(
            [math.sqrt(variance * cofactor[0, 0]), solution[0] * azimuth, math.sqrt(variance)],
            rel=1e-5, abs=1e-12,
        )  # fmt: skip
        assert ("lobes found at azimuth" in fit.gauge) == found

    @pytest.mark.parametrize(("lobe", "times"), [(0.4, 1), (63.0, 90), (119.7, 1)])
    def test_the_lobes_are_those_of_the_least_squares_over_all_touches(
        self, lobe: float, times: int
    ) -> None:
        """With unequal repeats; here each touch is a row of its own, and the search is another.
        From 5000 touches on, those of a direction share its place."""
        n = sphere_pattern_25()
        groups = np.repeat(np.arange(25), times * np.resize([1, 4, 2], 25))
        noise = np.random.default_rng(7).normal(0.0, 1e-3, len(groups))
        shape = WozniakBasis(math.radians(lobe)).design(n)[:, 0]
        positions = n[groups] * (15.5 - 0.01 * shape[groups] + noise)[:, None]
        seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, ring=False)
        fit = WozniakKind().fit(seen, NOTHING)
        about = fit.observation

        def squares(azimuth: float) -> float:
            own = WozniakBasis(azimuth).design(about.directions)[:, :1]
            rows = np.hstack([own, about.directions])
            solution = np.linalg.lstsq(rows, about.values, rcond=None)[0]
            return float(np.sum((about.values - rows @ solution) ** 2))

        found = fit.basis.lobe_azimuth
        best = minimize_scalar(squares, bracket=(found - 0.02, found, found + 0.03), tol=1e-10)
        assert found == pytest.approx(best.x, abs=2e-5)
        assert 0.0 <= found < math.radians(120.0)
        off = np.mod(found - math.radians(lobe) + 1.0, math.radians(120.0)) - 1.0
        assert abs(off) < math.radians(3.0)
        assert fit.dof == len(groups) - 5

    def test_a_constant_from_a_calibrated_radius(self) -> None:
        """Points of (1, 1, 2, 0) times A between and on lobes: the mean is A."""
        n = from_angles(np.radians([90.0, 90.0, 90.0, 0.0]), np.radians([60.0, 180.0, 0.0, 0.0]))
        assert wozniak_constant(2.990, 6.0, directions=n) == pytest.approx(0.010)
        assert wozniak_constant(3.0, 6.0, directions=n) == 0.0
        # Without lobes: four on the equator and one on the axis.
        assert wozniak_constant(2.992, 6.0, transducer="piezo") == pytest.approx(0.010)

    @pytest.mark.parametrize(("count", "refused"), [(7, True), (8, False)])
    def test_directions_that_determine_the_lobes(self, count: int, refused: bool) -> None:
        seen = _seen(fibonacci_cap(count, 1.6))
        if refused:
            with pytest.raises(PretravelError, match="7 directions do not determine where"):
                WozniakKind().fit(seen, NOTHING)
        else:
            WozniakKind().fit(seen, NOTHING)
        WozniakKind(0.3).fit(seen, NOTHING)
        WozniakKind(transducer="piezo").fit(seen, NOTHING)
        with pytest.raises(PretravelError, match="give the tip's diameter"):
            WozniakKind(0.3).fit(replace(seen, tip_known=False), NOTHING)

    def test_azimuths_that_no_lobe_has(self) -> None:
        for wrong in (math.nan, math.radians(3601.0), -math.radians(3601.0)):
            with pytest.raises(PretravelError):
                WozniakKind(wrong)
        assert WozniakKind(math.radians(3599.0)).lobe_azimuth == math.radians(3599.0)

    def test_settings_are_its_fields(self) -> None:
        stated = dict(WozniakKind(0.3, "piezo").settings())
        assert stated == {"lobe_azimuth": 0.3, "transducer": "piezo"}
        assert dict(WozniakBasis(0.3).attributes()) == {
            "lobe_azimuth_rad": 0.3, "transducer": "contact"
        }  # fmt: skip

    def test_a_piezo_probe_has_no_lobes(self) -> None:
        seen = _seen(sphere_pattern_25())
        fit = WozniakKind(transducer="piezo").fit(seen, NOTHING)
        assert fit.basis == WozniakBasis(0.0, "piezo")
        assert fit.dof == 25 - 4
        n = fibonacci_cap(10, 1.5)
        design = fit.basis.design(n)
        assert design[:, 0] == pytest.approx(n[:, 0] ** 2 + n[:, 1] ** 2)
        assert np.array_equal(design[:, 1], np.zeros(10))

    def test_a_refit_keeps_the_lobes(self) -> None:
        seen = _seen(sphere_pattern_25())
        found = WozniakKind().fit(seen, NOTHING)
        assert found.covariance.matrix[1, 1] > 0.0
        again = WozniakKind().refit(found, seen)
        assert again.basis is found.basis
        assert again.covariance.matrix[1, 1] == 0.0
        assert (found.dof, again.dof) == (25 - 5, 25 - 4)

    def test_residuals_above_three_times_the_repeatability_are_told(self) -> None:
        fit = WozniakKind(0.3).fit(_seen(sphere_pattern_25()), NOTHING)
        kind = WozniakKind(0.3)
        assert kind.warnings(replace(fit, noise=3e-3), 1e-3) == []
        assert kind.warnings(replace(fit, noise=2.9e-3), 1e-3) == []
        (said,) = kind.warnings(replace(fit, noise=3.1e-3), 1e-3)
        assert "are 3.1 µm, but touches repeat to 1.00 µm" in said


def _close_to_the_pole(level: float, wave: float) -> Observation:
    """Within a degree: a level, and so much more or less on every second touch."""
    n = ring_pattern(np.radians([0.5, 1.0]), 6)
    values = level + wave * np.where(np.arange(len(n)) % 2 == 0, 1.0, -1.0)
    positions = n * (15.5 - values)[:, None]
    return Observation(positions, np.arange(len(n)), np.zeros(3), 12.5, 3.0, ring=False)


class TestUsualShape:
    @pytest.mark.parametrize("tip_known", [True, False])
    @pytest.mark.parametrize("left", [1.0, 0.4])
    def test_by_hand(self, left: float, tip_known: bool) -> None:
        """A from the level of the sphere: A m + 1 µm, m that of the shape sin²;
        lobes of 0.35 A at any azimuth; a first harmonic of 0.05 A. Each seen by the least-squares
        sphere as a shift. A level that is not known: 10 µm; residuals can show less."""
        seen = replace(_seen(fibonacci_cap(30, 1.5)), tip_known=tip_known)
        n = seen.directions
        x, y = n[:, 0], n[:, 1]
        inverse = np.linalg.pinv(np.column_stack([np.ones(30), n]))
        shapes = (x**2 + y**2, x**3 - 3.0 * x * y**2, 3.0 * x**2 * y - y**3)
        level = (inverse[0] @ seen.values - 1e-3) / (inverse[0] @ shapes[0])
        residual = np.eye(30) - np.column_stack([np.ones(30), n]) @ inverse
        lobes = 0.35 / math.sqrt(2.0)
        usual = [size * s for size, s in zip((1.0, lobes, lobes), shapes, strict=True)]
        squares = sum(np.mean((residual @ each) ** 2) for each in usual)
        by_residuals = math.sqrt(np.mean((residual @ seen.values) ** 2) / squares)
        size = min(abs(level) if tip_known else 0.010, by_residuals)
        shifts = [left * size * inverse[1:] @ each for each in usual]
        expected = sum(np.outer(s, s) for s in shifts)
        expected = expected + (0.05 * size) ** 2 * np.diag([1.0, 1.0, 0.0])
        assert usual_shift_covariance(seen, left) == pytest.approx(expected, abs=1e-15)

    @pytest.mark.parametrize(
        ("level", "amplitude"),
        # 1 µm is expected along the axis. Near the pole sin² is 2 - 2 cos: a level of two.
        [(9e-3, 4e-3), (-7e-3, 4e-3), (0.1, 30e-3)],
    )
    def test_touches_near_the_pole_alone(self, level: float, amplitude: float) -> None:
        """What is unknown across the axis, a first harmonic of a twentieth, is in u across it."""
        found = usual_shift_covariance(_close_to_the_pole(level, 5e-4), 0.0)
        expected = (0.05 * amplitude) ** 2 * np.diag([1.0, 1.0, 0.0])
        # The level of the sphere is wrong by the cube of a degree.
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-18)

    def test_few_small_residuals_do_not_limit_it(self) -> None:
        """They can be near zero by chance: the level of the sphere does, up to 30 µm."""
        seen = _close_to_the_pole(0.1, 5e-6)
        assert seen.direction_count - 4 < 8
        amplitude = 30e-3
        expected = (0.05 * amplitude) ** 2 * np.diag([1.0, 1.0, 0.0])
        assert usual_shift_covariance(seen, 0.0) == pytest.approx(expected, rel=1e-6, abs=1e-18)


class TestHarmonicCentre:
    @pytest.mark.parametrize("name", ["pole", "ring", "far"])
    def test_every_field(self, name: str) -> None:
        """The shift is the first harmonic across the axis, a harmonic of degree one is sqrt(3) n;
        along it it is that of least squares. What the centre takes up is taken from the map."""
        fit = _fit(name)
        seen, posterior = fit.observation, fit.posterior
        terms = fit.basis.terms
        design = real_spherical_harmonics(seen.directions, terms)
        to_values = seen.to_sphere @ design
        to_shift = np.zeros((seen.axes, len(terms)))
        for axis, order in ((0, 1), (1, -1)):
            to_shift[axis, (terms == (1, order)).all(axis=1)] = math.sqrt(3.0)
        if seen.axes == 3:
            to_shift[2] = to_values[3]
        taken = np.eye(len(terms))
        for axis, order in ((0, 1), (1, -1), (2, 0))[: seen.axes]:
            taken[(terms == (1, order)).all(axis=1)] -= to_shift[axis] / math.sqrt(3.0)
        covariance = posterior.covariance
        assert fit.shift == pytest.approx(to_shift @ posterior.coefficients, abs=1e-15)
        unseen = posterior.amplitudes.first_harmonic_variance * np.diag([1.0, 1.0, 0.0])
        expected = to_shift @ covariance @ to_shift.T + unseen[: seen.axes, : seen.axes]
        assert fit.shift_covariance == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert fit.shift_of == pytest.approx(to_shift, abs=1e-12)
        assert fit.coefficients == pytest.approx(taken @ posterior.coefficients, abs=1e-15)
        # About a centre that was found, its errors are errors of the map.
        assert fit.covariance.matrix == pytest.approx(covariance, rel=1e-9, abs=1e-15)
        fitted = design @ posterior.coefficients
        assert fit.residuals == pytest.approx(seen.values - fitted, abs=1e-12)
        assert fit.mean == pytest.approx((seen.to_sphere @ fitted)[0])
        assert fit.u_mean == pytest.approx(math.sqrt(to_values[0] @ covariance @ to_values[0]))
        assert fit.dof == pytest.approx(len(seen.values) - posterior.smoothing.leverage.sum())
        assert (fit.noise, fit.fixed_scatter) == (posterior.noise, posterior.fixed_scatter)
        assert fit.smoothing is posterior.smoothing

    @pytest.mark.parametrize(
        ("name", "tip_known", "axial"),
        [("ring", True, 1e-3), ("pole", False, 1e-3), ("pole", True, None)],
    )
    def test_the_height_of_the_seen(self, name: str, tip_known: bool, axial: float | None) -> None:
        """A ring has none, and without the tip's diameter or a pretravel along the axis it is that
        of the least-squares sphere."""
        fit = _fit(name)
        fit = replace(fit, observation=replace(fit.observation, tip_known=tip_known))
        found = HarmonicKind().centered(fit, axial)
        seen, axes = fit.observation, fit.observation.axes
        assert found.center[:axes] == pytest.approx(seen.center[:axes] - fit.shift)
        assert found.center[axes:].tolist() == seen.center[axes:].tolist()
        expected = fit.shift_covariance.copy()
        if axes == 3:
            expected[2, 2] += usual_shift_covariance(seen)[2, 2]
            assert usual_shift_covariance(seen)[2, 2] > 1e-8
        assert found.center_covariance == pytest.approx(expected, abs=1e-18)
        assert np.array_equal(found.coefficients, fit.coefficients)
        assert found.gauge == fit.gauge or axes == 3

    def test_a_bore_about_the_centre_of_the_sphere(self) -> None:
        """Eight directions on the equator take nine lobes for one, which moves the centre, not a
        bore of 24 touches. U of its place contains that (without it χ² is 15)."""
        n, bore = sphere_pattern_25(), ring_pattern(np.array([0.5 * math.pi]), 24)

        def pretravel(normals: FloatArray, turn: float) -> FloatArray:
            across = np.hypot(normals[:, 0], normals[:, 1])
            azimuth = np.arctan2(normals[:, 1], normals[:, 0]) - turn
            lobes = 1.5 * np.cos(3.0 * azimuth) + 0.3 * np.cos(9.0 * azimuth)
            return np.asarray(1e-3 * (1.0 + 10.0 * across**2 + across * lobes))

        squares, generator = [], np.random.default_rng(1)
        for turn in np.radians([0.0, 10.0, 20.0, 30.0, 40.0, 50.0]):
            scatter = generator.normal(0.0, 2e-4, len(n))
            positions = n * (15.5 - pretravel(n, turn) + scatter)[:, None]
            seen = Observation(positions, np.arange(25), np.zeros(3), 12.5, 3.0, ring=False)
            fit = HarmonicKind().fit(seen, NOTHING)
            found = HarmonicKind().centered(fit, 1e-3)
            design = fit.basis.design(bore)
            left = pretravel(bore, turn) - design @ found.coefficients + bore @ found.center
            place = bore[:, :2].T / 12.0
            u = np.sqrt(found.covariance.variance_of(place @ design))
            squares.extend((place @ left / u) ** 2)
        assert np.mean(squares) < 2.0  # twelve squares scatter by 0.4

    @pytest.mark.parametrize("axial", [0.0, 1.5e-3])
    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("pole", ""), ("near", ""), ("beside", "the pole was not touched, its value is inter"),
            ("far", "no touch is near the pole, so that the pretravel there is extrapolated"),
        ],
    )  # fmt: skip
    def test_pretravel_at_the_pole(self, name: str, said: str, axial: float) -> None:
        """Within 5° it counts as touched; among the touches its value is interpolated. Map and
        centre together do not depend on it."""
        fit = _fit(name)
        found = HarmonicKind().centered(fit, axial)
        assert f"pretravel along the axis is {1e3 * axial:g} µm" in found.gauge
        assert said in found.gauge
        assert found.gauge.count(";") == 1 + bool(said)
        at_pole = fit.basis.design(POLE)[0]
        assert at_pole @ found.coefficients == pytest.approx(axial, abs=1e-15)
        covariance = fit.posterior.covariance
        of_pole = at_pole - fit.shift_of[2]  # of the least-squares height
        own = math.sqrt(of_pole @ covariance @ of_pole)
        if said:
            assert f"(u = {1e3 * own:.1f} µm" in found.gauge
        n = fibonacci_cap(50, 1.5)
        values = fit.basis.design(n) @ found.coefficients + n @ (
            fit.observation.center - found.center
        )
        expected = fit.basis.design(n) @ fit.posterior.coefficients
        assert values == pytest.approx(expected, abs=1e-12)
        # A shift along the axis is the value of the regression at the pole.
        to_shift = fit.shift_of.copy()
        to_shift[2] = at_pole
        unseen = fit.posterior.amplitudes.first_harmonic_variance
        expected = to_shift @ covariance @ to_shift.T
        expected += np.diag([unseen, unseen, U_AXIAL_PRETRAVEL**2])
        assert found.center_covariance == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert found.covariance is fit.covariance

    def test_a_refit_keeps_the_amplitudes_and_a_near_fit_begins_at_them(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        fit, kind = _fit("pole"), HarmonicKind()
        begun = []

        def noted(*given: object) -> object:
            begun.append(given[6])
            return fit_harmonics(*given)  # type: ignore[arg-type]

        monkeypatch.setattr("pretravel.maps.harmonic_regression.fit_harmonics", noted)
        kept = kind.refit(fit, fit.observation)
        assert kept.posterior.amplitudes is fit.posterior.amplitudes
        assert kept.coefficients == pytest.approx(fit.coefficients, abs=1e-15)
        near = kind.fit_near(fit, fit.observation, NOTHING)
        assert near.posterior.amplitudes is not fit.posterior.amplitudes
        # The search ends when the cost changes by less than 1e-9 of itself.
        assert near.coefficients == pytest.approx(fit.coefficients, abs=2e-5)
        assert near.smoothing is near.posterior.smoothing
        assert begun[0] is None
        assert begun[1] is fit.posterior.amplitudes


def test_averages_have_one_uncertainty_in_every_direction() -> None:
    """Whatever the functions: u is the scatter about them in one direction, here of the lobes."""

    class Bulge(MeanBasis):
        """A constant less one function, which is not the constant itself."""

        size = 2
        constant = np.array([2.0, -1.0])

        def design(self, directions: FloatArray) -> FloatArray:
            squared = directions[:, 2] ** 2
            return np.column_stack([0.5 + squared, 2.0 * squared])

    def solve(pretravel: FloatArray, _: float) -> FloatArray:
        design = Bulge().design(observation.directions)
        return np.asarray(np.linalg.lstsq(design, pretravel)[0])

    observation = _seen(sphere_pattern_25())
    plain = averaged(observation, MeanBasis(), lambda _, mean: np.array([mean]))
    fit = averaged(observation, Bulge(), solve)
    rows = Bulge().design(sphere_pattern_25())
    u = np.sqrt(fit.covariance.variance_of(rows))
    np.testing.assert_allclose(u, u[0], rtol=1e-9)
    assert 0.3 < u[0] / np.sqrt(plain.covariance.variances[0]) < 1.1
