"""Kinds of map by hand: what each keeps, refuses and says, and where its centre is."""

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
    from_angles,
    grid,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.maps import spherical_harmonics
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.harmonic_regression import fit_harmonics
from pretravel.maps.kind import KindOfMap, MapFit, usual_shift_covariance
from pretravel.maps.kinds import harmonic
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind, HarmonicMapFit
from pretravel.maps.kinds.mean import MeanBasis, MeanKind
from pretravel.maps.kinds.sectors import SectorBasis, SectorsKind
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind
from pretravel.maps.observation import Observation, Places, Scatter
from pretravel.maps.provenance import U_AXIAL_PRETRAVEL
from pretravel.maps.spherical_harmonics import (
    DirectionMeans,
    Smoothing,
    checked_terms,
    degrees_and_orders,
    real_spherical_harmonics,
)
from pretravel.maps.support import DirectionSupport

NOTHING = Scatter(0.0, 0.0)
POLE = np.array([[0.0, 0.0, 1.0]])


def _pretravel(n: FloatArray) -> FloatArray:
    """11 µm across the axis, 2 µm along it, lobes about 20°, a slope along y. [mm]"""
    across = n[:, 0] ** 2 + n[:, 1] ** 2
    azimuth = np.arctan2(n[:, 1], n[:, 0])
    lobes = across**1.5 * np.cos(3.0 * (azimuth - math.radians(20.0)))
    return np.asarray(1e-3 * (2.0 + 9.0 * across + 3.0 * lobes + 0.4 * n[:, 1]))


def _seen(n: FloatArray, groups: FloatArray | None = None, *, noise: float = 3e-4) -> Observation:
    each = np.arange(len(n)) if groups is None else np.asarray(groups, dtype=np.int64)
    scatter = np.random.default_rng(1).normal(0.0, noise, len(each))
    positions = n[each] * (15.5 - _pretravel(n)[each] + scatter)[:, None] + [0.003, -0.004, 0.001]
    return Observation(positions, each, np.zeros(3), 12.5, 3.0, ring=False)


@cache
def _ring() -> Observation:
    azimuth = np.arange(24) * 15.0 * DEGREE
    out = from_angles(0.5 * math.pi, azimuth)
    values = 0.011 + 0.003 * np.cos(3.0 * (azimuth + math.pi)) + 3e-4 * np.cos(7.0 * azimuth)
    positions = out * (7.0 + values)[:, None] + [1.0, 2.0, 0.7]
    return Observation(positions, np.arange(24), np.array([1.0, 2.0, 0.6]), 10.0, 3.0, ring=True)


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
    @pytest.mark.parametrize(
        "basis",
        [
            MeanBasis(), SectorBasis(), WozniakBasis(0.3), WozniakBasis(0.3, "piezo"),
            HarmonicBasis(np.array([[2, 0], [0, 0], [1, -1]])),
            TabulatedBasis(DirectionSupport(fibonacci_cap(30, 1.6))),
        ],
    )  # fmt: skip
    def test_the_constant_adds_one_everywhere(self, basis: MapBasis) -> None:
        n = fibonacci_cap(40, 1.5)
        constant = basis.constant
        assert constant is not None
        assert constant.shape == (basis.size,)
        assert basis.design(n) @ constant == pytest.approx(np.ones(40), abs=1e-12)
        coefficients = np.sin(1.0 + np.arange(basis.size))
        expected = basis.design(n) @ coefficients
        assert basis.value(n, coefficients) == pytest.approx(expected, abs=1e-12)

    def test_only_a_table_interpolates_and_coarse_kinds_do_not_follow(self) -> None:
        bases = (MeanBasis, SectorBasis, WozniakBasis, HarmonicBasis, TabulatedBasis)
        assert [each.interpolates for each in bases] == [False, False, False, False, True]
        assert [each.follows_probe for each in bases] == [False, False, False, True, True]

    def test_a_basis_comes_back_from_what_is_stored(self) -> None:
        support = DirectionSupport(fibonacci_cap(5, 1.0))
        terms = np.array([[2, 0], [0, 0], [3, -1]])
        basis = HarmonicBasis(terms)
        stored = StoredBasis(support, 3.0, basis.arrays())
        assert np.array_equal(HarmonicBasis.restored(stored).terms, terms)
        for array in basis.arrays().values():
            assert array.axes == ("coefficient",)
        lobed = WozniakBasis(0.3, "piezo")
        assert WozniakBasis.restored(StoredBasis(support, 3.0, {}, lobed.attributes())) == lobed
        assert MeanBasis.restored(stored) == MeanBasis()
        mean = MeanBasis().form_on_control(np.array([0.01]))
        assert mean.terms.tolist() == [[0, 0]]  # of degree 0: one everywhere
        assert TabulatedBasis.restored(stored).support is support
        form = basis.form_on_control(np.arange(3.0))
        assert np.array_equal(form.terms, terms)
        assert form.coefficients.tolist() == [0.0, 1.0, 2.0]

    def test_what_a_kind_may_leave_out(self) -> None:
        """No displacement, no probe, no form on a control, no arrays, no settings."""
        basis = SectorBasis()
        assert basis.displacement(POLE, None) is None
        assert basis.condensed_probe is None
        assert basis.form_on_control(np.zeros(10)) is None
        assert dict(basis.arrays()) == dict(basis.attributes()) == {}
        assert dict(basis.sensitivities(POLE)) == {}
        fit = MeanKind().fit(_seen(sphere_pattern_25()), NOTHING)
        assert MeanKind().warnings(fit, 1e-9) == []
        assert dict(MeanKind().settings()) == {}
        assert KindOfMap.refit(MeanKind(), fit, fit.observation) is None
        near = MeanKind().fit_near(fit, fit.observation, NOTHING)
        assert near.coefficients == pytest.approx(fit.coefficients, abs=1e-15)

    def test_what_is_told_of_the_kinds(self) -> None:
        kinds = (MeanKind, SectorsKind, WozniakKind, HarmonicKind)
        assert [each.needs_all_directions for each in kinds] == [False, True, False, False]
        assert [each.fits_harmonics for each in kinds] == [False, False, False, True]
        # Most probes are not a shape of one constant: what speaks for harmonics in advance.
        assert all(each.prior_weight < HarmonicKind.prior_weight < 1.0 for each in kinds[:3])

    @pytest.mark.parametrize("kind", [MeanKind(), SectorsKind()])
    def test_a_refit_of_an_average_is_a_fit(self, kind: KindOfMap) -> None:
        n = grid(np.radians([30.0, 89.0]), np.radians(np.arange(0.0, 360.0, 30.0)))
        fit = kind.fit(_seen(n), NOTHING)
        other = _seen(n, noise=1e-3)
        again, expected = kind.refit(fit, other), kind.fit(other, NOTHING)
        assert again is not None
        assert np.array_equal(again.coefficients, expected.coefficients)

    def test_four_touches_leave_one_degree_of_freedom(self) -> None:
        """Centre and mean take all four; the scatter is then the sum of squares over one."""
        n = fibonacci_cap(4, 1.5)
        seen = _seen(n)
        fit = MeanKind().fit(seen, NOTHING)
        wozniak = WozniakKind(0.3).fit(seen, NOTHING)
        for each in (fit, wozniak):
            assert each.dof == 1.0
            assert each.noise == pytest.approx(np.linalg.norm(each.residuals), abs=1e-18)
        assert fit.u_mean < 1e-12  # nothing is left over


class TestTerms:
    def test_degrees_and_orders_that_a_map_has(self) -> None:
        given = [[0, 0], [60, -60], [60, 60], [7, -3]]
        found = checked_terms(given)
        assert found.tolist() == given
        assert not found.flags.writeable
        assert checked_terms(np.zeros((0, 2), dtype=int)).shape == (0, 2)
        assert checked_terms(np.array([[3, 1]], dtype=np.uint8)).tolist() == [[3, 1]]

    @pytest.mark.parametrize(
        "terms",
        [
            [[61, 0]], [[-1, 0]], [[3, 4]], [[3, -4]], [[3, 1], [2, 0], [3, 1]], [[0.0, 0.0]],
            [[1, 0, 0]], [1, 0], [[[1, 0]]], [[True, False]], [],
        ],
    )  # fmt: skip
    def test_others_are_refused(self, terms: list[object]) -> None:
        with pytest.raises(PretravelError, match="degrees 0 to 60 and orders from -degree"):
            checked_terms(np.array(terms))

    def test_orders_above_the_degree_are_zero(self) -> None:
        n = fibonacci_cap(5, 1.0)
        rows = real_spherical_harmonics(n, [(1, 2), (0, -1), (2, 2)])
        assert np.array_equal(rows[:, :2], np.zeros((5, 2)))
        expected = math.sqrt(15.0) / 2.0 * (n[:, 0] ** 2 - n[:, 1] ** 2)
        assert rows[:, 2] == pytest.approx(expected, abs=1e-13)

    def test_pairs_up_to_a_degree(self) -> None:
        found = degrees_and_orders(2).tolist()
        assert found == [[0, 0], *([1, m] for m in (-1, 0, 1)), *([2, m] for m in range(-2, 3))]


class TestWozniak:
    def test_azimuths_that_no_lobe_has(self) -> None:
        for wrong in (math.nan, math.radians(3601.0), -math.radians(3601.0)):
            with pytest.raises(PretravelError):
                WozniakKind(wrong)
        assert WozniakKind(math.radians(3599.0)).lobe_azimuth == math.radians(3599.0)

    def test_settings_are_its_fields(self) -> None:
        stated = dict(WozniakKind(0.3, "piezo").settings())
        assert stated == {"lobe_azimuth": 0.3, "transducer": "piezo"}
        assert WozniakKind(**stated) == WozniakKind(0.3, "piezo")
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
        assert "residuals of 3.1 µm, but touches repeat to 1.00 µm" in said

    @pytest.mark.parametrize("lobe", [0.4, 63.0, 119.7])
    def test_the_lobes_are_those_of_the_least_squares_over_all_touches(self, lobe: float) -> None:
        """With unequal repeats; here each touch is a row of its own, and the search is another."""
        n = sphere_pattern_25()
        groups = np.repeat(np.arange(25), np.resize([1, 4, 2], 25))
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


class TestHarmonicCentre:
    def test_of_a_ring_there_is_no_height(self) -> None:
        fit = _fit("ring")
        found = HarmonicKind().centered(fit, 1e-3)
        assert fit.basis.terms[3:7].tolist() == [[2, 2], [2, -2], [3, 3], [3, -3]]
        assert fit.basis.terms.max() == 30
        assert found.center[2] == 0.6
        assert found.center[:2] == pytest.approx(np.array([1.0, 2.0]) - fit.shift)
        assert np.array_equal(found.center_covariance, fit.shift_covariance)
        assert np.array_equal(found.coefficients, fit.coefficients)
        assert found.gauge == fit.gauge

    def test_without_the_tip_the_height_is_that_of_the_sphere(self) -> None:
        fit = _fit("pole")
        unknown = replace(fit, observation=replace(fit.observation, tip_known=False))
        found = HarmonicKind().centered(unknown, 1e-3)
        assert np.array_equal(found.coefficients, fit.coefficients)
        usual = usual_shift_covariance(unknown.observation)[2, 2]
        expected = fit.shift_covariance + np.diag([0.0, 0.0, usual])
        assert found.center_covariance == pytest.approx(expected, abs=1e-18)
        assert usual > 1e-8

    @pytest.mark.parametrize("name", ["pole", "ring", "far"])
    def test_the_shift_is_the_first_harmonic_and_along_the_axis_least_squares(
        self, name: str
    ) -> None:
        """A harmonic of degree one is sqrt(3) n: its coefficient is the shift over sqrt(3)."""
        fit = _fit(name)
        seen, posterior = fit.observation, fit.posterior
        terms = fit.basis.terms
        to_shift = np.zeros((seen.axes, len(terms)))
        for axis, order in ((0, 1), (1, -1)):
            to_shift[axis, (terms == (1, order)).all(axis=1)] = math.sqrt(3.0)
        if seen.axes == 3:
            to_shift[2] = seen.to_sphere[3] @ real_spherical_harmonics(seen.directions, terms)
        taken = np.eye(len(terms))
        for axis, order in ((0, 1), (1, -1), (2, 0))[: seen.axes]:
            taken[(terms == (1, order)).all(axis=1)] -= to_shift[axis] / math.sqrt(3.0)
        covariance = posterior.covariance
        assert fit.shift == pytest.approx(to_shift @ posterior.coefficients, abs=1e-15)
        unseen = posterior.amplitudes.first_harmonic_variance * np.eye(3)[: seen.axes, : seen.axes]
        if seen.axes == 3:
            unseen[2, 2] = 0.0
        expected = to_shift @ covariance @ to_shift.T + unseen
        assert fit.shift_covariance == pytest.approx(expected, rel=1e-9, abs=1e-15)
        mixed = to_shift @ covariance @ taken.T
        assert fit.shift_covariance_with_map == pytest.approx(mixed, rel=1e-9, abs=1e-15)
        assert fit.coefficients == pytest.approx(taken @ posterior.coefficients, abs=1e-15)
        own = taken @ covariance @ taken.T
        assert fit.covariance.matrix == pytest.approx(own, rel=1e-9, abs=1e-15)

    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("pole", ""), ("near", ""), ("beside", "the pole was not touched, its value is inter"),
            ("far", "no touch is near the pole, whose value is extrapolated"),
        ],
    )  # fmt: skip
    def test_what_is_known_of_the_pole_is_told(self, name: str, said: str) -> None:
        """Within 5° it counts as touched; among the touches its value is interpolated."""
        fit = _fit(name)
        found = HarmonicKind().centered(fit, 1.5e-3)
        assert "pretravel 1.5 µm along the axis" in found.gauge
        assert said in found.gauge
        assert found.gauge.count(";") == 1 + bool(said)
        at_pole = fit.basis.design(POLE)[0]
        assert at_pole @ found.coefficients == pytest.approx(1.5e-3, abs=1e-15)
        own = math.sqrt(at_pole @ fit.covariance.matrix @ at_pole)
        if said:
            assert f"(u {1e3 * own:.1f} µm" in found.gauge
        shifted = fit.observation.center[2] - fit.shift[2]
        assert shifted - found.center[2] == pytest.approx(
            at_pole @ fit.coefficients - 1.5e-3, abs=1e-15
        )
        u_height = found.center_covariance[2, 2] - fit.shift_covariance[2, 2]
        mixed = 2.0 * fit.shift_covariance_with_map[2] @ at_pole
        assert u_height == pytest.approx(own**2 + U_AXIAL_PRETRAVEL**2 + mixed, rel=1e-9)
        at_found = at_pole @ found.covariance.matrix @ at_pole
        # Where the pole is extrapolated the map keeps its covariance.
        assert at_found == pytest.approx(own**2 if name == "far" else 0.0, abs=1e-15)

    def test_a_refit_keeps_the_amplitudes_and_a_near_fit_begins_at_them(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        fit, kind = _fit("pole"), HarmonicKind()
        begun = []

        def noted(*given: object) -> object:
            begun.append(given[6])
            return fit_harmonics(*given)  # type: ignore[arg-type]

        monkeypatch.setattr(harmonic, "fit_harmonics", noted)
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


def _close_to_the_pole(level: float, wave: float) -> Observation:
    n = ring_pattern(np.radians([0.5, 1.0]), 6)
    wave_of = wave * np.where(np.arange(len(n)) % 2 == 0, 1.0, -1.0)
    return Observation(
        n * (15.5 - level - wave_of)[:, None], np.arange(len(n)), np.zeros(3), 12.5, 3.0, ring=False
    )


class TestUsualShape:
    @pytest.mark.parametrize(
        ("level", "wave", "amplitude"),
        [
            # 1 µm is expected along the axis. Near the pole sin² is 2 - 2 cos: a level of two.
            (9e-3, 5e-4, 4e-3),
            (-7e-3, 5e-4, 4e-3),
            (0.1, 5e-4, 30e-3),
        ],
    )
    def test_touches_near_the_pole_alone(self, level: float, wave: float, amplitude: float) -> None:
        """What is unknown across the axis, a first harmonic of a twentieth, is in u across it."""
        found = usual_shift_covariance(_close_to_the_pole(level, wave), 0.0)
        expected = (0.05 * amplitude) ** 2 * np.diag([1.0, 1.0, 0.0])
        # The level of the sphere is wrong by the cube of a degree.
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-18)

    def test_residuals_limit_it_to_a_thousand_times_their_size(self) -> None:
        """Of a pretravel of 1 mm across the axis the touches leave at least 1 µm, it is assumed."""
        seen = _close_to_the_pole(0.1, 5e-6)
        left = seen.values - seen.free_design @ (seen.to_sphere @ seen.values)
        amplitude = math.sqrt(np.mean(left**2) / 1e-6)
        assert 1e-3 < amplitude < 30e-3
        expected = (0.05 * amplitude) ** 2 * np.diag([1.0, 1.0, 0.0])
        assert usual_shift_covariance(seen, 0.0) == pytest.approx(expected, rel=1e-6, abs=1e-18)


def test_blocks_of_directions_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Means, values, weighted sums, leverages and fits of 40 directions with 1 to 3 touches."""
    n = fibonacci_cap(40, 1.6)
    groups = np.repeat(np.arange(40), np.resize([2, 1, 3], 40))
    seen = _seen(n, groups)
    terms = degrees_and_orders(2)
    rows = real_spherical_harmonics(seen.directions, terms)
    monkeypatch.setattr(spherical_harmonics, "_BLOCK", 11)
    means = DirectionMeans(seen.places, terms)
    count = np.bincount(groups).astype(np.float64)
    average = (groups == np.arange(40)[:, None]) / count[:, None]
    assert means.rows() == pytest.approx(average @ rows, abs=1e-12)
    coefficients = np.sin(np.arange(9.0))
    assert means.values(coefficients) == pytest.approx(rows @ coefficients, abs=1e-12)
    weights = np.cos(np.arange(3.0 * len(groups))).reshape(3, -1)
    assert means.weighted(weights) == pytest.approx(weights @ rows, abs=1e-12)
    half = np.random.default_rng(2).normal(size=(2, 9, 9))
    gains = half @ half.transpose(0, 2, 1)
    classes = (count > 1.0).astype(np.int64)
    smoothing = Smoothing(means, count, gains, classes)
    # Fitted values: the functions times gain times the functions, of each touch's own class.
    own = average @ rows
    leverage = [count[g] * own[g] @ gains[classes[g]] @ own[g] for g in range(40)]
    assert smoothing.leverage == pytest.approx(leverage, rel=1e-9)
    total = np.bincount(groups, seen.values)
    solution = sum(gains[classes[g]] @ own[g] * total[g] for g in range(40))
    assert smoothing.fitted(seen.values, groups) == pytest.approx(rows @ solution, rel=1e-9)


def test_one_place_for_touches_of_a_direction() -> None:
    """Values of the functions at two places belong to the touches that state them."""
    n = fibonacci_cap(2, 1.0)
    places = Places(n, np.arange(2), np.array([1, 0, 0, 1, 1]))
    terms = degrees_and_orders(1)
    means = DirectionMeans(places, terms)
    rows = real_spherical_harmonics(n, terms)[[1, 0, 0, 1, 1]]
    assert means.values(np.arange(4.0)) == pytest.approx(rows @ np.arange(4.0))
    weights = np.array([[1.0, 2.0, 3.0, 4.0, 5.0]])
    assert means.weighted(weights) == pytest.approx(weights @ rows)


def test_defaults_of_an_observation_and_of_a_fit() -> None:
    seen = _seen(fibonacci_cap(6, 1.5))
    assert (seen.tip_known, seen.u_reference_radius) == (True, 0.0)
    fit = MeanKind().fit(seen, NOTHING)
    assert isinstance(fit, MapFit)
    assert (fit.tip_radius, fit.noise_is_repeatability, fit.fixed_scatter) == (None, False, 0.0)
    assert fit.gauge == "the reference's least-squares centre"


@pytest.mark.parametrize(("directions", "all_taken"), [(20, True), (19, False)])
def test_directions_are_drawn_from_more_than_twice_as_many(
    directions: int, all_taken: bool
) -> None:
    seen = _seen(fibonacci_cap(40, 1.5))
    assert (seen.drawn(directions) is seen) == all_taken
    assert seen.drawn(directions).direction_count == (40 if all_taken else 19)
