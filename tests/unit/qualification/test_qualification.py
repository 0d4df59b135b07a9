"""Maps, uncertainties and outliers of a qualification, against Monte Carlo and by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25, unit
from pretravel.base.errors import PretravelError
from pretravel.files.touches_csv import read_touches
from pretravel.maps.kind import usual_shift_covariance
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicMapFit
from pretravel.maps.provenance import U_AXIAL_PRETRAVEL
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches
from pretravel.uncertainty.fitting.sphere import fit_sphere
from tests.support.examples import EXAMPLES
from tests.support.plain_qualification import qualify_plainly as qualify
from tests.support.reference_touches import sphere_touches


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
        """By hand: the mean of 25 variances, each of three touches."""
        touches = self._touches()
        result = qualify(touches, 25.0, tip_diameter=6.0)
        distance = np.linalg.norm(touches.positions - result.center, axis=1)
        assert not result.effects.change.any()
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

    def test_a_suspect_does_not_predict_itself(self) -> None:
        """Its distance is from what the others predict: a direction that is 10 µm further off
        lies exactly 10 µm further from the same prediction."""
        n = sphere_pattern_25()
        noise = np.random.default_rng(3).normal(0.0, 3e-4, 25)
        distances = []
        for error in (0.03, 0.04):
            pretravel = self._pretravel(n) + noise
            pretravel[8] += error
            (found,) = qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0).outliers
            assert found.rows == (8,)
            distances.append(found.distance)
        # The centre of all touches, about which distances are linear, moves with it a little.
        assert distances[1] - distances[0] == pytest.approx(0.01, rel=0.01)

    def test_two_wrong_directions_are_named_once_each(self) -> None:
        """With the others' prediction, which contains neither: both errors come out as made."""
        n = np.concatenate([sphere_pattern_25(), fibonacci_cap(35, np.radians(85.0))])
        pretravel = self._pretravel(n) + np.random.default_rng(4).normal(0.0, 3e-4, 60)
        pretravel[[10, 40]] += [0.03, -0.04]
        found = qualify(sphere_touches(pretravel, n), 25.0, tip_diameter=6.0).outliers
        assert sorted(outlier.rows for outlier in found) == [(10,), (40,)]
        for outlier in found:
            made = {10: 0.03, 40: -0.04}[outlier.rows[0]]
            assert outlier.distance == pytest.approx(made, abs=outlier.limit)

    @pytest.mark.parametrize("kind", ["mean", "sectors", "harmonic"])
    def test_tip_uncertainty_comes_from_the_sphere(self, kind: str) -> None:
        result = qualify(self._touches(), 25.0, tip_diameter=6.0, kind=kind, u_diameter=4e-4)
        assert result.pretravel_map.u_tip_radius == pytest.approx(2e-4)
        assert result.u_effective_radius > 2e-4

    def test_uncertainties_of_the_mean_kind_by_hand(self) -> None:
        """Eight directions once. The variance of the mean in any direction is the sum of squares
        over 8 - 4; that of the radius follows with the normal equations of a sphere, by numpy."""
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
        by_noise = result.center_covariance - usual_shift_covariance(result.fit.observation)
        assert np.allclose(by_noise, variance * inverse[1:, 1:], rtol=1e-3)

    def test_without_repeats_noise_is_not_lobing(self) -> None:
        """Kind mean, each direction once: lobes of 3 µm around it, but the probe repeats to
        0.3 µm; the degrees of freedom are those of the harmonic fit."""
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

    @pytest.mark.parametrize(
        ("told", "draws", "most"),
        [
            (1e-3, 30, 1.5),
            pytest.param(1e-3, 60, 1.3, marks=pytest.mark.slow),
            pytest.param(None, 60, 1.3, marks=pytest.mark.slow),
        ],
    )
    def test_harmonic_centre_radius_and_map_in_either_gauge(
        self, told: float | None, draws: int, most: float
    ) -> None:
        """Many noises on one probe. Scatter of a standard deviation from 60 draws is 9 % (one
        sigma), from 30 draws 13 %; a prior makes the map scatter less than stated, never more:
        factors of 0.5 to 1.3 or 1.5.
        In the gauge of the pole the value there is given, so it has no uncertainty."""
        centers, radii, values, stated = [], [], [], []
        check = fibonacci_cap(40, np.radians(85.0))
        for seed in range(draws):
            result = qualify(
                self._touches(seed), 25.0, tip_diameter=6.0, axial_pretravel=told,
                search_outliers=False,
            )  # fmt: skip
            centers.append(result.center)
            radii.append(result.effective_radius)
            values.append(result.pretravel_map.pretravel(check))
            assert isinstance(result.fit, HarmonicMapFit)
            # The conventions are uncertain too, which no noise shows.
            convention = result.fit.posterior.amplitudes.first_harmonic_variance * np.ones(3)
            usual = usual_shift_covariance(result.fit.observation)[2, 2]
            convention[2] = usual if told is None else U_AXIAL_PRETRAVEL**2
            stated.append(
                [
                    *np.sqrt(np.diag(result.center_covariance) - convention),
                    result.u_effective_radius,
                    *result.pretravel_map.standard_uncertainty(check),
                ]
            )
        scatter = np.concatenate([np.std(centers, axis=0), [np.std(radii)], np.std(values, axis=0)])
        u = np.mean(stated, axis=0)
        ratio = scatter[:4] / u[:4]
        assert np.all((ratio > 0.5) & (ratio < most)), ratio
        assert np.all(scatter[4:] < most * u[4:])
        pole = result.pretravel_map.standard_uncertainty([[0.0, 0.0, 1.0]])[0]
        assert (pole < 1e-9) == (told is not None)

    def test_in_its_gauge_the_map_has_no_first_harmonic(self) -> None:
        """A shift changes neither the map nor its uncertainty: across the axis its coefficients
        are zero, along it a least-squares sphere has no shift over the touched directions."""
        touches = self._touches()
        result = qualify(touches, 25.0, tip_diameter=6.0, axial_pretravel=None)
        made = result.pretravel_map
        assert isinstance(made.basis, HarmonicBasis)
        across = (made.basis.terms[:, 0] == 1) & (made.basis.terms[:, 1] != 0)
        assert np.abs(made.coefficients[across]).max() < 1e-15
        assert np.abs(made.covariance.matrix[across]).max() < 1e-9 * made.covariance.matrix.max()
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
        """The border of a cell between two normals 1e-9 apart does not separate them."""
        n = np.repeat(sphere_pattern_25(), 2, axis=0)
        n[::2, 0] += 1e-9
        n[:, 0] += 0.0005 * n[:, 2]
        result = qualify(sphere_touches(self._pretravel(n), unit(n)), 25.0, tip_diameter=6.0)
        assert result.groups.max() == 24

    def test_mixed_feeds_tell_the_delay(self) -> None:
        """Touches made without a shift: zero, within three standard uncertainties."""
        touches = self._touches()
        mixed = replace(touches, feeds=np.where(np.arange(75) % 2 == 0, 50.0, 500.0))
        result = qualify(mixed, 25.0, tip_diameter=6.0, kind="mean")
        assert result.delay is not None
        assert abs(result.delay.delay) < 3.0 * result.delay.u_delay
        assert result.pretravel_map.feed == 0.0

    def test_centre_of_a_three_lobed_probe(self) -> None:
        """Rings of four and eight touches with lobes shift the least-squares sphere by 1 um, but
        not the centre of the harmonic kind: within three of its standard uncertainties, and 0.5 um.
        """
        from pretravel.prediction.catalogue import load_probe
        from pretravel.prediction.predict import predict

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

    @pytest.mark.parametrize("draws", [100, pytest.param(600, marks=pytest.mark.slow)])
    def test_centre_and_radius_covariance_against_monte_carlo(self, draws: int) -> None:
        """Mean kind, perfect probe; n draws determine variances to √(2/n), four of that are
        allowed, and half of it for a deviation."""
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
            for _ in range(draws)
        ]
        centers = np.array([r.center for r in results])
        by_noise = [
            r.center_covariance - usual_shift_covariance(r.fit.observation) for r in results
        ]
        stated = np.mean([np.diag(covariance) for covariance in by_noise], axis=0)
        allowed = 4.0 * np.sqrt(2.0 / draws)
        assert np.allclose(centers.var(axis=0), stated, rtol=allowed)
        radii = np.array([r.effective_radius for r in results])
        u_radius = np.mean([r.u_effective_radius for r in results])
        assert radii.std() == pytest.approx(u_radius, rel=0.5 * allowed)

    @pytest.mark.slow
    def test_harmonic_uncertainty_at_the_touches_against_monte_carlo(self) -> None:
        """A fixed smooth probe, many noises: where it is touched, the map scatters no more than
        stated, and its mean error is small against u (a prior's bias)."""
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


class TestWhatAQualificationWarnsOf:
    """Mistakes that still lead to a map must cause a warning."""

    def _example(self) -> Touches:
        return read_touches(EXAMPLES / "sphere_touches.csv")

    def _chipped(self, chip: float) -> Touches:
        touches = self._example()
        positions = touches.positions.copy()
        positions[30:33] += chip * touches.normals[30:33]
        return Touches(positions, touches.normals)

    def test_a_chip_under_all_repeats_is_left_out(self) -> None:
        """The map is that of the other directions, and the report states what the chip would do."""
        result = qualify(self._chipped(0.02), 24.9987, tip_diameter=6.0)
        assert [outlier.rows for outlier in result.outliers] == [(30, 31, 32)]
        assert result.used.sum() == 72
        others = self._example().take(np.setdiff1d(np.arange(75), [30, 31, 32]))
        alone = qualify(others, 24.9987, tip_diameter=6.0)
        normals = others.normals
        apart = result.pretravel_map.pretravel(normals) - alone.pretravel_map.pretravel(normals)
        assert np.abs(apart).max() < 0.05e-3
        assert 1e-4 < result.effect_of_outliers < 0.02

    def test_a_large_chip_is_refused(self) -> None:
        with pytest.raises(PretravelError, match=r"touch 3[123] lies about 0.2\d mm outside"):
            qualify(self._chipped(0.25), 24.9987, tip_diameter=6.0)

    def test_the_example_itself_is_clean(self) -> None:
        result = qualify(self._example(), 24.9987, tip_diameter=6.0)
        assert result.outliers == ()
        assert result.warnings == ()

    @pytest.mark.parametrize(
        ("keep", "options", "words"),
        [
            (slice(None), {"diameter": 24.93}, "no probe triggers before contact"),
            (slice(None), {"tip_diameter": 6.2}, "probes deflect by 1 to 80"),
            (slice(None), {"tip_diameter": None}, "diameter was not given"),
            (slice(0, 15), {}, "a cap hardly"),
        ],
    )
    def test_warnings(self, keep: slice, options: dict[str, float | None], words: str) -> None:
        touches = self._example().take(np.arange(75)[keep])
        arguments = {"diameter": 24.9987, "tip_diameter": 6.0, **options}
        result = qualify(touches, **arguments)  # type: ignore[arg-type]
        assert any(words in warning for warning in result.warnings), result.warnings

    def test_delay_travel_is_allowed_for_where_the_feed_is_told(self) -> None:
        """At 600 mm/min and 14.5 ms the spindle travels 145 µm further: too much for a probe, but
        plausible for a machine that moves so fast."""
        example = self._example()
        late = example.positions - 0.145 * example.normals
        with pytest.raises(PretravelError, match="feed_mm_min"):
            qualify(Touches(late, example.normals), 24.9987, tip_diameter=6.0)
        told = Touches(late, example.normals, feeds=np.full(75, 600.0))
        result = qualify(told, 24.9987, tip_diameter=6.0, kind="mean")
        assert result.effective_radius == pytest.approx(2.98363 - 0.145, abs=1e-5)

    def test_a_wide_gap_is_warned_of(self) -> None:
        """Pole and equator alone: between them the map is uncertain, and a warning states this."""
        touches = self._example()
        ends = np.abs(touches.normals[:, 2] - 0.5) > 0.45
        result = qualify(touches.take(ends), 24.9987, tip_diameter=6.0)
        assert any("between the touches u" in warning for warning in result.warnings)

    def test_a_pole_that_was_not_touched_is_told(self) -> None:
        touches = self._example()
        result = qualify(touches.take(np.arange(3, 75)), 24.9987, tip_diameter=6.0)
        assert "the pole was not touched" in result.pretravel_map.provenance.gauge
