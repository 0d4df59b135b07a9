"""Fields of fits, maps, observations and grids, each by hand or by an independent least squares."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25, unit
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.base.frames import Placement, probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.grid import effective_radius_table, map_grid
from pretravel.maps.kind import MapFit, usual_shift_covariance
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind, HarmonicMapFit
from pretravel.maps.kinds.mean import MeanBasis, MeanKind
from pretravel.maps.kinds.sectors import SectorBasis, SectorsKind
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind, wozniak_constant
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import AXIAL_PRETRAVEL, U_AXIAL_PRETRAVEL
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map

NOTHING = Scatter(0.0, 0.0)


def _pretravel(n: FloatArray) -> FloatArray:
    """Of a probe with lobes; 2 µm along the axis and 11 µm across it. [mm]"""
    across = n[:, 0] ** 2 + n[:, 1] ** 2
    lobes = n[:, 0] ** 3 - 3.0 * n[:, 0] * n[:, 1] ** 2
    return np.asarray(1e-3 * (2.0 + 9.0 * across + 3.0 * lobes + 0.4 * n[:, 1]))


def _sphere(n: FloatArray, seed: int = 1) -> Observation:
    """Touches about a centre that is wrong by 5 µm, with noise."""
    noise = np.random.default_rng(seed).normal(0.0, 3e-4, len(n))
    positions = n * (15.5 - _pretravel(n) + noise)[:, None] + [0.003, -0.004, 0.001]
    return Observation(positions, np.arange(len(n)), np.zeros(3), 12.5, 3.0, ring=False)


def _ring() -> Observation:
    """Inside a ring of 20 mm, at 24 azimuths: contact normals point to the centre."""
    azimuth = np.arange(24) * 15.0 * DEGREE
    out = from_angles(0.5 * math.pi, azimuth)
    values = 0.011 + 0.003 * np.cos(3.0 * (azimuth + math.pi))
    positions = out * (7.0 + values)[:, None] + [1.0, 2.0, 0.7]
    return Observation(positions, np.arange(24), np.array([1.0, 2.0, 0.0]), 10.0, 3.0, ring=True)


class TestObservation:
    def test_of_a_ring(self) -> None:
        seen = _ring()
        azimuth = np.arange(24) * 15.0 * DEGREE
        expected = -from_angles(0.5 * math.pi, azimuth)
        assert seen.axes == 2
        assert seen.directions == pytest.approx(expected, abs=1e-12)
        assert seen.values == pytest.approx(0.011 - 0.003 * np.cos(3.0 * azimuth), abs=1e-12)
        assert seen.free_terms.tolist() == [[0, 0], [1, 1], [1, -1]]
        design = np.column_stack([np.ones(24), expected[:, :2]])
        assert seen.free_design == pytest.approx(design, abs=1e-12)
        assert seen.to_sphere == pytest.approx(np.linalg.pinv(design), abs=1e-12)

    def test_of_a_sphere(self) -> None:
        n = fibonacci_cap(9, 1.5)
        seen = Observation(
            [1.0, 2.0, 3.0] + 15.49 * n, np.arange(9), np.array([1.0, 2.0, 3.0]), 12.5, 3.0, False
        )
        assert seen.axes == 3
        assert seen.directions == pytest.approx(n, abs=1e-12)
        assert seen.values == pytest.approx(np.full(9, 0.010), abs=1e-12)
        assert seen.direction_count == 9
        assert seen.free_terms.tolist() == [[0, 0], [1, 1], [1, -1], [1, 0]]
        assert seen.free_design == pytest.approx(np.column_stack([np.ones(9), n]))
        part = seen.take(np.arange(9) % 3 == 1)
        assert part.groups.tolist() == [0, 1, 2]
        assert np.array_equal(part.positions, seen.positions[[1, 4, 7]])

    def test_the_mean_normal_of_repeats(self) -> None:
        n = unit([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
        groups = np.array([0, 0, 1])
        seen = Observation(15.49 * n, groups, np.zeros(3), 12.5, 3.0, ring=False)
        expected = unit([[1.0, 1.0, 2.0], [0.0, 0.0, 1.0]])
        assert seen.group_directions == pytest.approx(expected)


def _least_squares(seen: Observation) -> tuple[FloatArray, FloatArray]:
    """Mean and shift, and the inverse of the normal equations."""
    design = np.column_stack([np.ones(len(seen.values)), seen.directions[:, : seen.axes]])
    cofactor = np.linalg.inv(design.T @ design)
    return cofactor @ design.T @ seen.values, cofactor


def _check_average(fit: MapFit, seen: Observation, coefficients: FloatArray) -> None:
    """Fields that means of directions have in common, about the least-squares centre."""
    solution, cofactor = _least_squares(seen)
    centred = seen.values - seen.directions[:, : seen.axes] @ solution[1:]
    assert fit.coefficients == pytest.approx(coefficients, abs=1e-12)
    residuals = centred - fit.basis.design(seen.directions) @ coefficients
    assert fit.residuals == pytest.approx(residuals, abs=1e-12)
    dof = max(len(centred) - seen.axes - len(coefficients), 1)
    variance = np.sum(residuals**2) / dof
    assert fit.dof == dof
    assert fit.noise == pytest.approx(math.sqrt(variance))
    # One standard deviation for any one direction, common to all coefficients.
    assert fit.covariance.matrix == pytest.approx(np.full((len(coefficients),) * 2, variance))
    of_sphere = np.sum((centred - solution[0]) ** 2) / (len(centred) - 1 - seen.axes)
    assert fit.mean == pytest.approx(solution[0])
    assert fit.u_mean == pytest.approx(math.sqrt(of_sphere * cofactor[0, 0]))
    assert fit.shift == pytest.approx(solution[1:], abs=1e-12)
    expected = of_sphere * cofactor[1:, 1:] + usual_shift_covariance(seen)
    assert fit.shift_covariance == pytest.approx(expected, abs=1e-15)
    assert fit.observation is seen
    centred_fit = (MeanKind() if len(coefficients) == 1 else SectorsKind()).centered(fit, 1e-3)
    center = seen.center.copy()
    center[: seen.axes] -= solution[1:]
    assert centred_fit.center == pytest.approx(center, abs=1e-12)
    assert np.array_equal(centred_fit.center_covariance, fit.shift_covariance)
    assert np.array_equal(centred_fit.coefficients, fit.coefficients)


class TestAverages:
    @pytest.mark.parametrize("seen", [_sphere(fibonacci_cap(30, 1.6)), _ring()])
    def test_mean(self, seen: Observation) -> None:
        fit = MeanKind().fit(seen, NOTHING)
        _check_average(fit, seen, _least_squares(seen)[0][:1])

    def test_sectors(self) -> None:
        """Three rings of touches, of which those at polar angles of 60° and more count."""
        polar = np.repeat([30.0, 60.0, 90.0], 12)
        n = from_angles(polar * DEGREE, np.tile(np.arange(12) * 30.0, 3) * DEGREE)
        seen = _sphere(n)
        # Contact normals lie 5 µm of 15 mm beside these: 60° must hold with a little more.
        seen = replace(seen, positions=seen.positions - np.array([0.0, 0.0, 0.02]))
        solution, _ = _least_squares(seen)
        centred = (seen.values - seen.directions @ solution[1:])[12:].reshape(2, 12)
        names = [0, 2, 3, 1, 4, 5, 0, 6, 7, 1, 8, 9]  # X, 30, 60, Y, 120, ...
        values = np.array(
            [centred[:, [i for i, name in enumerate(names) if name == k]].mean() for k in range(10)]
        )
        _check_average(SectorsKind().fit(seen, NOTHING), seen, values)

    def test_a_sector_without_touches_is_named(self) -> None:
        n = from_angles(0.5 * math.pi, np.delete(np.arange(12) * 30.0, [2, 9, 3]) * DEGREE)
        seen = Observation(15.49 * n, np.arange(9), np.zeros(3), 12.5, 3.0, ring=False)
        with pytest.raises(PretravelError, match="falls into sector Y, 60°: a sector"):
            SectorsKind().fit(seen, NOTHING)

    def test_shares_of_sectors(self) -> None:
        """Within half a degree of the axis all alike; halfway between two, a half each."""
        tilt = np.radians([0.0, 0.49, 0.51, 0.49, 0.51])
        n = from_angles(tilt, np.radians([0.0, 0.0, 0.0, 90.0, 90.0]))
        design = SectorBasis().design(n)
        assert design[[0, 1, 3]] == pytest.approx(np.full((3, 10), 0.1))
        assert design[2].tolist() == [1.0, *[0.0] * 9]
        assert design[4].tolist() == [0.0, 1.0, *[0.0] * 8]
        degrees = np.array([14.9, 15.1, 45.0, 345.0, 344.0, 346.0, 105.0])
        design = SectorBasis().design(from_angles(0.5 * math.pi, np.radians(degrees)))
        expected = np.zeros((7, 10))
        expected[0, 0] = expected[1, 2] = expected[4, 9] = expected[5, 0] = 1.0
        expected[2, 2] = expected[2, 3] = expected[3, 0] = expected[3, 9] = 0.5
        expected[6, 1] = expected[6, 4] = 0.5
        assert np.array_equal(design, expected)


class TestWozniak:
    @pytest.mark.parametrize("found", [False, True])
    @pytest.mark.parametrize("ring", [False, True])
    def test_every_field(self, found: bool, ring: bool) -> None:
        seen = _ring() if ring else _sphere(fibonacci_cap(40, 1.6))
        lobe = None if found else 0.1
        fit = WozniakKind(lobe).fit(seen, NOTHING)
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
        dof = len(n) - 1 - axes - found
        variance = np.sum(residuals**2) / dof
        cofactor = np.linalg.inv(design.T @ design)
        assert fit.coefficients == pytest.approx([solution[0], 0.0, 0.0])
        assert fit.residuals == pytest.approx(residuals, abs=1e-12)
        assert fit.dof == dof
        assert fit.noise == pytest.approx(math.sqrt(variance))
        assert fit.shift == pytest.approx(solution[1:], abs=1e-12)
        assert np.abs(fit.shift).max() < 1e-5
        assert np.abs(about.center - seen.center)[:axes].max() > (0.0 if ring else 1e-3)
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
        usable = np.abs(slope) < 10.0  # not across the edge between two lobes
        assert usable.all()
        more = np.linalg.inv(np.column_stack([design, slope]).T @ np.column_stack([design, slope]))
        u_azimuth = math.sqrt(variance * more[-1, -1]) if found else 0.0
        assert np.sqrt(np.diag(fit.covariance.matrix)) == pytest.approx(
            [math.sqrt(variance * cofactor[0, 0]), solution[0] * u_azimuth, math.sqrt(variance)],
            rel=1e-5, abs=1e-12,
        )  # fmt: skip
        assert ("lobes found at azimuth" in fit.gauge) == found

    def test_a_constant_from_a_calibrated_radius(self) -> None:
        """Points of (1, 1, 2, 0) times A between and on lobes: the mean is A."""
        n = from_angles(np.radians([90.0, 90.0, 90.0, 0.0]), np.radians([60.0, 180.0, 0.0, 0.0]))
        assert wozniak_constant(2.990, 6.0, directions=n) == pytest.approx(0.010)
        assert wozniak_constant(3.0, 6.0, directions=n) == 0.0
        with pytest.raises(PretravelError, match="is larger than that of the tip, 3 mm"):
            wozniak_constant(3.001, 6.0)
        with pytest.raises(PretravelError, match="transducer 'other' is not known"):
            wozniak_constant(2.990, 6.0, transducer="other")
        # Without lobes: four on the equator and one on the axis.
        assert wozniak_constant(2.992, 6.0, transducer="piezo") == pytest.approx(0.010)

    @pytest.mark.parametrize(("count", "refused"), [(7, True), (8, False)])
    def test_directions_that_determine_the_lobes(self, count: int, refused: bool) -> None:
        seen = _sphere(fibonacci_cap(count, 1.6))
        if refused:
            with pytest.raises(PretravelError, match="7 directions do not determine where"):
                WozniakKind().fit(seen, NOTHING)
        else:
            WozniakKind().fit(seen, NOTHING)
        WozniakKind(0.3).fit(seen, NOTHING)
        WozniakKind(transducer="piezo").fit(seen, NOTHING)
        with pytest.raises(PretravelError, match="give the tip's diameter"):
            WozniakKind(0.3).fit(replace(seen, tip_known=False), NOTHING)


def test_the_usual_shape_by_hand() -> None:
    """A from the level of the sphere: A m + 1 µm, m that of the shape sin²; lobes of 0.35 A at any
    azimuth; a first harmonic of 0.05 A. Each seen by the least-squares sphere as a shift."""
    seen = _sphere(fibonacci_cap(30, 1.5))
    n = seen.directions
    x, y = n[:, 0], n[:, 1]
    inverse = np.linalg.pinv(np.column_stack([np.ones(30), n]))
    shapes = (x**2 + y**2, x**3 - 3.0 * x * y**2, 3.0 * x**2 * y - y**3)
    level = (inverse[0] @ seen.values - 1e-3) / (inverse[0] @ shapes[0])
    residual = np.eye(30) - np.column_stack([np.ones(30), n]) @ inverse
    usual = np.array([1.0, 0.35 / math.sqrt(2.0), 0.35 / math.sqrt(2.0)])
    sizes = [np.mean((residual @ (size * s)) ** 2) for size, s in zip(usual, shapes, strict=True)]
    by_residuals = math.sqrt(np.mean((residual @ seen.values) ** 2) / sum(sizes))

    def by_hand(amplitude: float, left: float) -> FloatArray:
        shifts = [size * inverse[1:] @ s for size, s in zip(usual, shapes, strict=True)]
        found = sum((left * amplitude) ** 2 * np.outer(s, s) for s in shifts)
        return np.asarray(found + (0.05 * amplitude) ** 2 * np.diag([1.0, 1.0, 0.0]))

    for left in (1.0, 0.4):
        expected = by_hand(min(abs(level), by_residuals), left)
        assert usual_shift_covariance(seen, left) == pytest.approx(expected, abs=1e-15)
    # A level that is not known: 10 µm across the axis, unless the residuals show less.
    unknown = replace(seen, tip_known=False)
    expected = by_hand(min(0.010, by_residuals), 1.0)
    assert usual_shift_covariance(unknown) == pytest.approx(expected, abs=1e-15)


@pytest.fixture(scope="module")
def fit() -> HarmonicMapFit:
    found = HarmonicKind().fit(_sphere(sphere_pattern_25()), NOTHING)
    assert isinstance(found, HarmonicMapFit)
    return found


class TestHarmonicCentre:
    def test_what_the_centre_takes_up_is_taken_from_the_map(self, fit: HarmonicMapFit) -> None:
        """Map and centre together are the regression: its values do not depend on the gauge."""
        n = fibonacci_cap(50, 1.5)
        basis, posterior = fit.basis, fit.posterior
        before = basis.design(n) @ posterior.coefficients
        assert basis.design(n) @ fit.coefficients + n @ fit.shift == pytest.approx(
            before, abs=1e-12
        )
        for term in ((1, 1), (1, -1)):
            (row,) = np.flatnonzero((basis.terms == term).all(axis=1))
            assert fit.coefficients[row] == pytest.approx(0.0, abs=1e-15)
            assert fit.covariance.matrix[row] == pytest.approx(0.0, abs=1e-15)
        own = fit.observation.directions
        fitted = basis.design(own) @ posterior.coefficients
        assert fit.residuals == pytest.approx(fit.observation.values - fitted, abs=1e-12)
        sphere = fit.observation.to_sphere @ fitted
        assert fit.mean == pytest.approx(sphere[0])
        assert fit.shift[2] == pytest.approx(sphere[3], abs=1e-12)
        to_values = fit.observation.to_sphere @ basis.design(own)
        variance = to_values[0] @ posterior.covariance @ to_values[0]
        assert fit.u_mean == pytest.approx(math.sqrt(variance))
        assert fit.dof == pytest.approx(25.0 - posterior.smoothing.leverage.sum())
        assert (fit.noise, fit.fixed_scatter) == (posterior.noise, posterior.fixed_scatter)

    @pytest.mark.parametrize("axial", [0.0, 1e-3])
    def test_pretravel_at_the_pole(self, fit: HarmonicMapFit, axial: float) -> None:
        found = HarmonicKind().centered(fit, axial)
        pole = np.array([[0.0, 0.0, 1.0]])
        at_pole = fit.basis.design(pole)[0]
        assert at_pole @ found.coefficients == pytest.approx(axial, abs=1e-15)
        # The pole was touched: the map less its own value there has no uncertainty at the pole.
        assert at_pole @ found.covariance.matrix @ at_pole == pytest.approx(0.0, abs=1e-15)
        n = fibonacci_cap(50, 1.5)
        moved = fit.observation.center - found.center
        before = fit.basis.design(n) @ fit.posterior.coefficients
        assert fit.basis.design(n) @ found.coefficients + n @ moved == pytest.approx(
            before, abs=1e-12
        )
        own = math.sqrt(at_pole @ fit.covariance.matrix @ at_pole)
        mixed = fit.shift_covariance_with_map @ at_pole
        expected = fit.shift_covariance.copy()
        expected[2, 2] += own**2 + U_AXIAL_PRETRAVEL**2
        expected[:, 2] += mixed
        expected[2, :] += mixed
        assert found.center_covariance == pytest.approx(expected, abs=1e-15)

    def test_without_a_pretravel_the_height_is_that_of_the_sphere(
        self, fit: HarmonicMapFit
    ) -> None:
        found = HarmonicKind().centered(fit, None)
        assert found.center == pytest.approx(fit.observation.center - fit.shift)
        usual = np.diag([0.0, 0.0, usual_shift_covariance(fit.observation)[2, 2]])
        assert found.center_covariance == pytest.approx(fit.shift_covariance + usual, abs=1e-15)
        assert np.array_equal(found.coefficients, fit.coefficients)


class TestPretravelMap:
    def test_values_and_uncertainties_of_a_map_with_a_delay(self) -> None:
        """Each value has the error of its coefficient, and of the delay in common."""
        basis = HarmonicBasis(np.array([[0, 0], [1, 0]]))
        made = PretravelMap(
            basis, np.array([0.010, 0.001]), Covariance.independent([4e-8, 1e-8]),
            DirectionSupport(fibonacci_cap(40, 1.6)), tip_radius=3.0, repeatability=3e-4,
            fixed_scatter=4e-4, delay=1e-3, u_delay=1e-5, delay_effect=np.array([3e-4, 2e-4]),
        )  # fmt: skip
        n = from_angles(np.radians([0.0, 60.0]), np.zeros(2))
        root = math.sqrt(3.0) * np.array([1.0, 0.5])  # the harmonic (1, 0) is sqrt(3) cos(polar)
        assert made.pretravel(n) == pytest.approx(0.010 + 0.001 * root)
        by_delay = 3e-4 + 2e-4 * root
        assert made.change_by_delay(n) == pytest.approx(by_delay)
        expected = 4e-8 + 1e-8 * np.outer(root, root) + np.outer(by_delay, by_delay)
        assert made.value_covariance(n) == pytest.approx(expected)
        assert made.standard_uncertainty(n) == pytest.approx(np.sqrt(np.diag(expected)))
        assert made.pretravel_and_uncertainty(n)[1] == pytest.approx(np.sqrt(np.diag(expected)))
        assert made.single_touch == pytest.approx(5e-4)
        assert made.kind == "harmonic"
        assert made.states_uncertainty
        assert replace(made, delay_effect=None).change_by_delay(n).tolist() == [0.0, 0.0]
        for effect in (np.zeros(3), np.array([np.nan, 0.0])):
            with pytest.raises(PretravelError, match="effect of the delay must be 2 finite"):
                replace(made, delay_effect=effect)

    def test_seen_from_a_turned_part(self) -> None:
        made = replace(
            mean_map(0.01), basis=HarmonicBasis(np.array([[3, 3]])),
            rotation=probe_rotation((0.6, 0.0, 0.8), 0.3),
        )  # fmt: skip
        part = Placement(probe_rotation((0.0, 0.6, 0.8), 0.7), np.array([1.0, 2.0, 3.0]))
        n = fibonacci_cap(20, 0.5)
        assert made.seen_from(part).pretravel(n, extrapolate=True) == pytest.approx(
            made.pretravel(part.vectors(n), extrapolate=True), abs=1e-12
        )

    @pytest.mark.parametrize(
        ("down", "up", "opposite"), [(10, 0, True), (4, 0, False), (5, 0, True), (20, 3, False)]
    )
    def test_directions_outside_are_told_of(self, down: int, up: int, opposite: bool) -> None:
        """More than four, and more than nine of ten of all directions: normals point inwards."""
        inside = fibonacci_cap(max(down, up), 1.0)
        n = np.vstack([inside[:up], -inside[:down]])
        with pytest.raises(ExtrapolationError) as told:
            mean_map(0.01).pretravel(n)
        assert f"{down} of {down + up} directions lie outside the map" in str(told.value)
        assert ("turn the signs" in str(told.value)) == opposite
        assert ("Touch the reference there too" in str(told.value)) != opposite

    def test_a_grid_of_angles(self) -> None:
        """Supported to 90° and 5° more; rows every 25°, and one at the last touched angle."""
        made = replace(
            mean_map(0.01, tip_radius=2.0), covariance=Covariance.independent([4e-8]),
            rotation=probe_rotation((0.6, 0.0, 0.8), 0.3),
        )  # fmt: skip
        found = map_grid(made, polar_step=25.0, azimuth_step=60.0)
        assert found["polar_deg"] == pytest.approx([0.0, 25.0, 50.0, 75.0, 90.0])
        assert found["azimuth_deg"].tolist() == [0.0, 60.0, 120.0, 180.0, 240.0, 300.0]
        assert found["pretravel_um"] == pytest.approx(np.full((5, 6), 10.0))
        assert found["u_um"] == pytest.approx(np.full((5, 6), 0.2))
        assert map_grid(made, polar_step=30.0)["polar_deg"].tolist() == [0.0, 30.0, 60.0, 90.0]
        # An arc of 57° at 93°: the margin of 5° contains 90°, and azimuths of 60°.
        arc = DirectionSupport(from_angles(np.radians([93.0] * 3), np.array([0.0, 0.5, 1.0])))
        part = replace(made, support=arc)
        grid = map_grid(part, 90.0, 30.0)
        assert grid["polar_deg"] == pytest.approx([0.0, 90.0, 93.0])
        held = [[False] * 12, *[[True, True, True, *[False] * 9]] * 2]
        assert np.isfinite(grid["pretravel_um"]).tolist() == held
        assert np.isfinite(grid["u_um"]).tolist() == held
        table = {name: np.asarray(v) for name, v in effective_radius_table(part, 0.005).items()}
        assert table["polar_deg"] == pytest.approx(np.repeat([90.0, 93.0], 7))
        assert table["azimuth_deg"] == pytest.approx(np.tile(np.arange(7) * 10.0, 2))
        assert table["pretravel_um"] == pytest.approx(np.full(14, 15.0))
        assert table["effective_radius_mm"] == pytest.approx(np.full(14, 1.985))
        assert table["u_um"] == pytest.approx(np.full(14, 0.2))
        at_rest = effective_radius_table(part)
        assert np.asarray(at_rest["effective_radius_mm"]) == pytest.approx(np.full(14, 1.99))


class TestSupport:
    def test_directions_that_would_pull_the_stylus_out_are_refused(self) -> None:
        assert len(DirectionSupport(from_angles(np.radians([169.8]), 0.3)).nodes) == 1
        with pytest.raises(PretravelError, match="above 170°"):
            DirectionSupport(from_angles(np.radians([20.0, 170.2]), np.array([0.0, 0.3])))

    @pytest.mark.parametrize(("radius", "held"), [(59.5, True), (60.5, False)])
    def test_wide_triangles_are_holes(self, radius: float, held: bool) -> None:
        """Three touches around the pole: the circle through them has their polar angle."""
        nodes = from_angles(np.radians([radius] * 3), np.radians([0.0, 120.0, 240.0]))
        support = DirectionSupport(nodes)
        pole = np.array([[0.0, 0.0, 1.0]])
        assert support.supports(pole).tolist() == [held]
        nodes_of, weights, distance = support.interpolation(pole)
        if held:
            assert weights[0] == pytest.approx(np.full(3, 1.0 / 3.0))
            assert sorted(nodes_of[0].tolist()) == [0, 1, 2]
            assert distance[0] == 0.0
        else:
            assert distance[0] > 5.0 * DEGREE

    @pytest.mark.parametrize(("polar", "refused"), [(169.9, False), (170.2, True)])
    def test_directions_from_below(self, polar: float, refused: bool) -> None:
        nodes = from_angles(np.radians([0.0, polar]), np.zeros(2))
        if refused:
            with pytest.raises(PretravelError, match="polar angle above 170°"):
                DirectionSupport(nodes)
        else:
            DirectionSupport(nodes)
        with pytest.raises(PretravelError, match="at least one direction"):
            DirectionSupport(np.empty((0, 3)))

    def test_interpolation_is_linear_in_the_plane_of_the_projection(self) -> None:
        """Weights give back the projected point itself, and the nodes exactly."""
        support = DirectionSupport(fibonacci_cap(60, 1.5))
        n = fibonacci_cap(200, 1.3)
        nodes, weights, distance = support.interpolation(n)
        assert np.all(distance == 0.0)
        assert weights.sum(axis=1) == pytest.approx(np.ones(200))
        assert weights.min() > -1e-12

        def projected(d: FloatArray) -> FloatArray:
            return np.asarray(d[..., :2] / (1.0 + d[..., 2:]))

        back = np.sum(weights[:, :, None] * projected(support.nodes[nodes]), axis=1)
        assert back == pytest.approx(projected(n), abs=1e-12)
        nodes, weights, _ = support.interpolation(support.nodes)
        assert nodes[np.arange(60), weights.argmax(axis=1)].tolist() == list(range(60))
        assert weights.max(axis=1) == pytest.approx(np.ones(60))

    def test_an_arc_of_touches_supports_what_lies_along_it(self) -> None:
        """Given in any order, on a meridian; the distance is the angle beside it."""
        polar = np.radians([60.0, 10.0, 35.0, 85.0])
        support = DirectionSupport(from_angles(polar, np.full(4, 0.4)))
        beside = np.radians([0.0, 4.0, 4.9, 5.1, 20.0])
        up = from_angles(np.full(5, np.radians(47.5)), np.full(5, 0.4))
        across = np.array([-math.sin(0.4), math.cos(0.4), 0.0])
        n = np.cos(beside)[:, None] * up + np.sin(beside)[:, None] * across
        nodes, weights, distance = support.interpolation(n)
        assert distance == pytest.approx(beside, abs=1e-7)
        assert support.supports(n).tolist() == [True, True, True, False, False]
        assert support.supports(n, 21.0 * DEGREE).all()
        assert support.supports(n, 0.0).tolist()[1:] == [False] * 4
        for row in range(5):
            own = {int(k): float(w) for k, w in zip(nodes[row], weights[row], strict=True) if w}
            assert own == {0: pytest.approx(0.5), 2: pytest.approx(0.5)}
        ends = from_angles(np.radians([7.0, 88.0]), np.full(2, 0.4))
        nodes, weights, distance = support.interpolation(ends)
        assert distance == pytest.approx(np.radians([3.0, 3.0]))
        for row, end in enumerate((1, 3)):
            assert nodes[row, weights[row].argmax()] == end
            assert weights[row].max() == 1.0


def test_one_direction_supports_its_neighbourhood() -> None:
    support = DirectionSupport([[0.0, 0.0, 1.0]])
    n = from_angles(np.radians([0.0, 4.9, 5.1]), np.zeros(3))
    assert support.supports(n).tolist() == [True, True, False]
    one = PretravelMap(MeanBasis(), np.array([0.01]), Covariance.none(1), support, tip_radius=3.0)
    assert one.pretravel(n[:2]).tolist() == [0.01, 0.01]
