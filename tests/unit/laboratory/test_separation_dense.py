"""The separation against dense matrices, scipy's distributions, and numbers by hand.

S has a row for each reading: +1 at its machine direction, -1 at its probe direction. Z is |S|.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    RepeatedPair,
    direction_place,
    direction_sums,
    multi_step_design,
    normal_matrix,
    weighted_residuals,
)
from pretravel.laboratory.separation import Separation, _shares, separate
from pretravel.laboratory.separation_noise import (
    TAILS,
    NoiseTails,
    ReadingScale,
    _gross_density,
    _log_density,
    _probabilities,
    noise_tails,
)
from pretravel.laboratory.separation_outliers import (
    ReadingOutlier,
    _judged,
    _largest_noise,
    _part,
    outlying_readings,
)
from pretravel.laboratory.separation_plan import (
    best_steps,
    error_factor,
    plan_separation,
    turned_pairs,
    variance_factor,
)
from pretravel.laboratory.separation_variances import (
    PairVariance,
    _floored,
    _shrunk,
    _updated,
    common_scale,
    direction_variance_uncertainty,
    likelihood_information,
    noise_of_readings,
    squared_scales,
)
from tests.support.separation_trials import separation_by_trials

UM = 1e-3


def _readings(seed: int = 3, *, lacking: int = 4, noise: float = 0.3) -> MultiStepReadings:
    """Five machine directions from 11 and four probe directions from 31; some pairs lack, and one
    is there twice."""
    rng = np.random.default_rng(seed)
    i, j = np.divmod(np.arange(20), 4)
    kept = np.sort(rng.choice(20, 20 - lacking, replace=False))
    i, j = np.append(i[kept], 2), np.append(j[kept], 1)
    scatter = noise * (1.0 + 0.5 * (i % 2)) * rng.standard_normal(len(i))
    return MultiStepReadings(11 + i, 31 + j, UM * (np.sin(i) - 2.0 * np.cos(j) + scatter))


def _signed(readings: MultiStepReadings) -> FloatArray:
    machines, probes = np.unique(readings.machine), np.unique(readings.probe)
    return np.hstack(
        [
            (readings.machine[:, None] == machines).astype(float),
            -(readings.probe[:, None] == probes).astype(float),
        ]
    )


class TestEquations:
    def test_a_design_is_made_of_indicators(self) -> None:
        readings = _readings()
        design, signed = multi_step_design(readings), _signed(readings)
        assert np.array_equal(design.incidence, np.abs(signed))
        assert np.array_equal(design.incidence * design.signs, signed)
        assert (design.split, design.size) == (5, 9)
        assert design.basis.T @ design.basis == pytest.approx(np.eye(8), abs=1e-12)
        assert design.basis[:5].sum(axis=0) == pytest.approx(0.0, abs=1e-12)
        assert design.design == pytest.approx(signed @ design.basis, abs=1e-12)
        assert np.array_equal(design.machines[design.row], readings.machine)
        assert np.array_equal(design.probes[design.column], readings.probe)
        assert (design.machine_place(13), design.probe_place(32)) == (2, 6)

    def test_sums_and_normal_equations(self) -> None:
        readings = _readings()
        design, signed = multi_step_design(readings), _signed(readings)
        weights = np.random.default_rng(1).uniform(0.5, 2.0, len(readings))
        assert direction_sums(design, weights) == pytest.approx(np.abs(signed).T @ weights)
        fixed = np.concatenate([np.ones(5), np.zeros(4)])
        dense = signed.T @ np.diag(weights) @ signed + weights.mean() * np.outer(fixed, fixed)
        assert normal_matrix(design, weights) == pytest.approx(dense, abs=1e-12)

    def test_a_direction_has_a_place(self) -> None:
        assert direction_place(np.array([4, 7, 9]), 7, "probe") == 1
        many = np.arange(20, 40)
        with pytest.raises(PretravelError, match=r"there are 20, .*, 31, …$"):
            direction_place(many, 5, "probe")
        with pytest.raises(PretravelError, match=r"there are 20, .*, 31$"):
            direction_place(many[:12], 5, "probe")

    def test_readings_are_checked(self) -> None:
        for machine, probe, errors in (
            ([1, 1, 2], [1, 2, 1], [0.0] * 3), ([1.5, 1, 2, 2], [1, 2, 1, 2], [0.0] * 4),
            ([1, 1, 2, 2], [1, 2, 1, 2.2], [0.0] * 4), ([1, 1, 2, 2], [1, 2, 1], [0.0] * 4),
            ([1, 1, 2, 2], [1, 2, 1, 2], [0.0] * 5), ([1, 1, 2, 2], [1, 2, 1, 2], [math.nan] * 4),
            ([[1, 1, 2, 2]], [[1, 2, 1, 2]], [[0.0] * 4]),
        ):  # fmt: skip
            with pytest.raises(PretravelError):
                MultiStepReadings(machine, probe, errors)
        made = MultiStepReadings([2, 2, 1, 5], [7, 9, 9, 7], [0.0] * 4)
        assert (made.machines.tolist(), made.probes.tolist()) == ([1, 2, 5], [7, 9])
        assert len(made) == 4

    @pytest.mark.parametrize(("variance", "count"), [(0.0, 5), (-1e-6, 5), (1e-6, 1), (1e-6, 0)])
    def test_repeats_that_determine_no_variance(self, variance: float, count: int) -> None:
        with pytest.raises(PretravelError):
            RepeatedPair(1, 2, variance, count)
        assert RepeatedPair(1, 2, 1e-6).count == 10
        assert RepeatedPair(1, 2, 1e-6, 2).count == 2


class TestInformation:
    def test_is_that_of_dense_projections(self) -> None:
        """P = W - W S (S'WS)⁺ S'W; half of Z'(P ∘ P) Z, with unequal weights."""
        readings = _readings()
        design, signed = multi_step_design(readings), _signed(readings)
        total = np.random.default_rng(2).uniform(0.5, 3.0, len(readings)) * 1e-6
        weights = np.diag(1.0 / total)
        hat = signed @ np.linalg.pinv(signed.T @ weights @ signed, rcond=1e-9) @ signed.T
        p = weights - weights @ hat @ weights
        found = likelihood_information(design, total)
        assert found.leverage == pytest.approx(np.diag(hat @ weights), rel=1e-7)
        assert found.weights == pytest.approx(1.0 / total)
        expected = 0.5 * np.abs(signed).T @ (p * p) @ np.abs(signed)
        assert found.matrix == pytest.approx(expected, rel=1e-6)
        inverse = np.linalg.pinv(expected, rcond=1e-9)
        assert found.inverse == pytest.approx(inverse, rel=1e-5, abs=1e-8 * np.abs(inverse).max())

    @pytest.mark.parametrize("repeats", [2, 5])
    def test_repeats_count_as_readings_of_their_own(self, repeats: int) -> None:
        readings = _readings(lacking=2)
        whole = MultiStepReadings(
            np.tile(readings.machine, repeats),
            np.tile(readings.probe, repeats),
            np.zeros(repeats * len(readings)),
        )
        expected = direction_variance_uncertainty(whole)
        assert direction_variance_uncertainty(readings, repeats) == pytest.approx(expected)
        # Half of the pair's variance is that of a direction; the share is fixed.
        information = likelihood_information(multi_step_design(whole), np.ones(len(whole)))
        u = math.sqrt(np.linalg.pinv(information.matrix, rcond=1e-9).diagonal().max())
        assert expected == pytest.approx(2.0 * u, rel=1e-9)

    def test_what_readings_do_not_determine_is_infinite(self) -> None:
        """A ring of six readings has one degree of freedom; for repeats it has seven."""
        machine, probe = turned_pairs(3, (0, 1))
        ring = MultiStepReadings(machine, probe, np.zeros(6))
        assert math.isinf(direction_variance_uncertainty(ring))
        assert math.isfinite(direction_variance_uncertainty(ring, 2))


def _wider(readings: MultiStepReadings) -> float:
    """Squares of Student's noise have the variance (2 + 6 / (dof - 4)) σ⁴, its kurtosis; that of
    normal noise is 2 σ⁴. With the probabilities that the readings give to 20, 10, … degrees."""
    share = noise_of_readings(multi_step_design(readings), readings.errors).of_tails
    dof = np.maximum(1.0 / np.array([0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.335, 0.37]), 4.5)
    kurtosis = np.append(0.0, stats.t.stats(dof, moments="k"))
    return float(share @ (2.0 + kurtosis)) / 2.0


class TestLeastSquares:
    def test_all_is_that_of_dense_matrices(self) -> None:
        """M = 1 - H. Z'(M ∘ M) Z x = Z' r², and Cov(r_a², r_b²) = 2 (M V M)_ab²."""
        rng = np.random.default_rng(5)
        i, j = np.divmod(np.arange(300) % 50, 5)
        scale = np.sqrt(1.0 + 0.3 * np.cos(i) + 0.2 * np.sin(j))
        errors = UM * (np.sin(i) - np.cos(2 * j) + 0.5 * scale * rng.standard_normal(300))
        readings = MultiStepReadings(3 + i, 8 + j, errors)
        found = separate(readings, method="least-squares", search_outliers=False)
        signed = _signed(readings)
        z = np.abs(signed)
        m = np.eye(300) - signed @ np.linalg.pinv(signed)
        inverse = np.linalg.pinv(z.T @ (m * m) @ z, rcond=1e-9)
        x = inverse @ z.T @ (m @ errors) ** 2
        v = z @ x
        assert v.min() > 0.05 * np.mean((m @ errors) ** 2)
        scatter = 2.0 * (m @ np.diag(v) @ m) ** 2
        covariance = inverse @ z.T @ scatter @ z @ inverse
        share = np.concatenate([np.full(10, 0.1), np.full(5, -0.2)]) / 2.0
        away = np.eye(15) - np.outer(np.repeat([1.0, -1.0], [10, 5]), share)
        # In µm⁴: pytest's own tolerance is wider than numbers in mm⁴.
        expected = _wider(readings) * 1e12 * (away @ covariance @ away.T)
        assert 1e12 * found.variance_covariance == pytest.approx(expected, rel=1e-6)
        assert found.machine_variance.mean() == pytest.approx(found.probe_variance.mean())
        pairs = found.machine_variance[:, None] + found.probe_variance
        assert pairs == pytest.approx(x[:10, None] + x[10:], rel=1e-9)
        solution = np.linalg.lstsq(signed, errors, rcond=None)[0]
        level = solution[:10].mean()
        assert found.machine_error == pytest.approx(solution[:10] - level, abs=1e-12)
        assert found.probe_error == pytest.approx(solution[10:] - level, abs=1e-12)
        assert found.residuals == pytest.approx(m @ errors, abs=1e-12)
        self._check_errors(found, signed, v)
        assert found.dof == 300 - 14
        assert (found.method, found.repeated, found.outliers) == ("least-squares", None, ())

    @staticmethod
    def _check_errors(found: Separation, signed: FloatArray, v: FloatArray) -> None:
        """Covariance of the solution whose machine errors add up to zero, and its interval."""
        fixed = signed.T @ signed + np.outer(*[np.repeat([1.0, 0.0], [10, 5])] * 2)
        solve = np.linalg.solve(fixed, signed.T)
        covariance = solve @ np.diag(v) @ solve.T
        assert found.error_covariance == pytest.approx(covariance, rel=1e-7, abs=1e-16)
        u = np.sqrt(np.diag(covariance))
        assert np.concatenate([found.u_machine_error, found.u_probe_error]) == pytest.approx(u)
        values = np.concatenate([found.machine_error, found.probe_error])
        for probability in (0.95, 0.7):
            half = stats.t.ppf(0.5 + 0.5 * probability, found.dof) * u
            interval = found.error_interval(probability)
            assert interval[:, 0] == pytest.approx(values - half, abs=1e-12)
            assert interval[:, 1] == pytest.approx(values + half, abs=1e-12)
        of_variances = np.sqrt(np.diag(found.variance_covariance))
        stated = np.concatenate([found.u_machine_variance, found.u_probe_variance])
        assert stated == pytest.approx(of_variances, rel=1e-12)
        assert (len(found.u_machine_variance), len(found.u_machine_error)) == (10, 10)

    def test_a_measured_pair_adds_its_information(self) -> None:
        """(C⁻¹ + h h' / R)⁻¹, R = 2 v² / dof with v the mean of both by degrees of freedom."""
        rng = np.random.default_rng(4)
        root = rng.standard_normal((6, 6))
        covariance, values = root @ root.T, rng.uniform(1.0, 3.0, 6)
        h = np.array([0.0, 1.0, 0.0, 0.0, 1.0, 0.0])
        for values_ in (values, -values):
            estimate = max(h @ values_, 0.0)
            r = 2.0 * ((5.0 * 7.0 + estimate) / 8.0) ** 2 / 7.0
            found, uncertain = _updated(values_, covariance, PairVariance(1, 4, 5.0, 7.0))
            information = np.linalg.inv(covariance) + np.outer(h, h) / r
            expected = np.linalg.inv(information)
            assert uncertain == pytest.approx(expected, rel=1e-8, abs=1e-10)
            right = np.linalg.solve(covariance, values_) + h * 5.0 / r
            assert found == pytest.approx(expected @ right, rel=1e-8, abs=1e-10)

    def test_a_measured_pair_in_the_separation(self) -> None:
        i, j = np.divmod(np.arange(64), 8)
        errors = UM * np.random.default_rng(3).standard_normal(64)
        readings = MultiStepReadings(i, j, errors)
        alone = separate(readings, method="least-squares", search_outliers=False)
        before, u = alone.pair_variance(2, 3)
        pair = RepeatedPair(2, 3, 0.4e-6, 9)
        found = separate(readings, method="least-squares", repeated=pair, search_outliers=False)
        r = 2.0 * ((0.4e-6 * 8.0 + max(before, 0.0)) / 9.0) ** 2 / 8.0
        expected = (before / u**2 + 0.4e-6 / r) / (1.0 / u**2 + 1.0 / r)
        after, uncertain = found.pair_variance(2, 3)
        assert after == pytest.approx(expected, rel=1e-6)
        assert uncertain == pytest.approx(math.sqrt(1.0 / (1.0 / u**2 + 1.0 / r)), rel=1e-6)
        assert found.repeated is pair

    def test_directions_with_too_few_readings_are_named(self) -> None:
        """A full block of three by three, and machine 9 once: its residual is always zero."""
        i, j = np.divmod(np.arange(9), 3)
        errors = UM * np.random.default_rng(1).standard_normal(10)
        readings = MultiStepReadings(np.append(i, 9), np.append(j, 0), errors)
        with pytest.raises(PretravelError, match=r"lacks 2 ranks.*too few readings: machine 9\. "):
            separate(readings, method="least-squares")
        with pytest.raises(PretravelError, match=r"lacks 2 ranks.*too few readings: machine 9\. "):
            separate(readings)

    def test_a_degree_of_freedom_is_needed(self) -> None:
        """Two by two: four readings, three errors, one degree; without one reading none."""
        four = MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], UM * np.array([0.0, 1.0, 1.0, 2.5]))
        with pytest.raises(PretravelError, match="identification matrix lacks"):
            separate(four)
        five = MultiStepReadings([1, 1, 2, 3, 3], [1, 2, 2, 2, 1], UM * np.arange(5.0))
        with pytest.raises(PretravelError, match="4 readings for 4 systematic errors leave no deg"):
            separate(five, exclude=[(3, 1)])
        with pytest.raises(PretravelError, match="method 'x' is not known"):
            separate(four, method="x")  # type: ignore[arg-type]


class TestShares:
    DESIGN = multi_step_design(MultiStepReadings(*np.divmod(np.arange(6), 3), np.zeros(6)))

    @pytest.mark.parametrize(
        ("values", "shared", "movable", "negative"),
        [
            # Means 6 and 2: half each is 4; nothing is negative.
            ([5.0, 7.0, 1.0, 2.0, 3.0], [3.0, 5.0, 3.0, 4.0, 5.0], (3.0, 3.0), False),
            # Half each leaves -1 of a probe: 1 is moved there from the machine.
            ([6.0, 6.0, -1.0, 8.0, 11.0], [5.0, 5.0, 0.0, 9.0, 12.0], (5.0, 0.0), False),
            # Half each leaves -2 of the machine.
            ([-2.0, 8.0, 1.0, 3.0, 5.0], [0.0, 10.0, -1.0, 1.0, 3.0], (0.0, -1.0), True),
            ([-1.0, 7.0, 2.0, 3.0, 4.0], [0.0, 8.0, 1.0, 2.0, 3.0], (0.0, 1.0), False),
        ],
    )
    def test_half_each_where_none_is_negative(
        self, values: list[float], shared: list[float], movable: tuple[float, float], negative: bool
    ) -> None:
        if negative:  # the middle between both: a pair of -1 has half of it in each
            shared, movable = [-0.5, 9.5, -0.5, 1.5, 3.5], (-0.5, -0.5)
        found = _shares(self.DESIGN, np.array(values))
        assert found.variances == pytest.approx(shared, abs=1e-12)
        assert found.movable == pytest.approx(movable, abs=1e-12)
        assert found.negative is negative

    def test_far_below_the_mean_no_pair_gets_the_weight(self) -> None:
        """Machine 1, 7 and probe -0.8, 1, 1: the lowest pair has 0.2 and gets 0.4, a tenth of 4;
        all move to the half, 2, by the factor 3.6 / 3.8, with equal means before: 4 and 0.4."""
        values = np.array([1.0, 7.0, -0.8, 1.0, 1.0])
        found = _shrunk(self.DESIGN, values, np.zeros((5, 5)), 4.0)
        shared = np.array([-0.8, 5.2, 1.0, 2.8, 2.8])
        assert found == pytest.approx(2.0 + 3.6 / 3.8 * (shared - 2.0), abs=1e-12)
        assert found[0] + found[2] == pytest.approx(0.4)
        assert _shrunk(self.DESIGN, values, np.zeros((5, 5)), 1.9) == pytest.approx(values)

    def test_scales_are_floored_at_a_tenth_of_the_mean(self) -> None:
        """Pairs 0.1, 2, 3, 4.1, 6, 7: their mean is 3.7."""
        found = _floored(self.DESIGN, np.array([0.0, 4.0, 0.1, 2.0, 3.0]))
        assert found == pytest.approx([0.37, 2.0, 3.0, 4.1, 6.0, 7.0])


class TestNoise:
    SQUARED = np.array([0.0, 0.3, 1.0, 2.5, 9.0, 40.0])

    def test_densities_are_those_of_student(self) -> None:
        found = _log_density(np.tile(self.SQUARED, (len(TAILS), 1)))
        root = np.sqrt(self.SQUARED)
        assert found[0] == pytest.approx(stats.norm.logpdf(root), rel=1e-12)
        for row, tail in zip(found[1:], TAILS[1:], strict=True):
            assert row == pytest.approx(stats.t.logpdf(root, 1.0 / tail), rel=1e-9)
        both = _log_density(np.tile(self.SQUARED, (len(TAILS), 2, 1)))
        assert both[:, 1] == pytest.approx(found)

    def test_gross_errors_have_a_density(self) -> None:
        """1 / size between 4 and 50 on both sides, 1 / size² beyond; continuous, in all one."""
        at = _gross_density(np.array([3.99, 4.01, 8.02, 49.9999, 50.0001, 100.0, 200.0]))
        assert at[0] == 0.0
        assert at[1] == pytest.approx(2.0 * at[2], rel=1e-12)
        assert at[3] == pytest.approx(at[4], rel=1e-4)
        assert at[5] == pytest.approx(4.0 * at[6], rel=1e-12)
        inner = integrate.quad(lambda x: float(_gross_density(np.array(x))), 4.0, 50.0)[0]
        outer = integrate.quad(lambda x: float(_gross_density(np.array(x))), 50.0, np.inf)[0]
        assert 2.0 * (inner + outer) == pytest.approx(1.0, rel=1e-6)

    def test_levels_and_probabilities_maximise_the_likelihood(self) -> None:
        """Of each distribution and share of gross errors, by a search of scipy. Prior: normal noise
        five times that of each other; that of gross errors is shared by the five shares. Twelve
        rounds of the iteration are within some 10 % of its end."""
        rng = np.random.default_rng(2)
        size = np.abs(rng.standard_t(6.0, 120))
        size[:2] = 14.0, 23.0
        shares = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.05])
        found = _probabilities(np.tile(size**2, (9, 1, 1)), np.full(9, 1.2), shares)
        log = np.empty((9, 6))
        for place in [(0, 0), (0, 3), (2, 0), (2, 1), (5, 0), (5, 5), (8, 0), (8, 4)]:
            log[place], level = _maximum(size, TAILS[place[0]], shares[place[1]])
            assert found.level[place] == pytest.approx(level, rel=0.03)
        prior = {0: 5.0, 2: 1.0, 5: 1.0, 8: 1.0}
        reference = log[5, 0]
        for k, g in [(0, 0), (0, 3), (2, 0), (2, 1), (5, 5), (8, 0), (8, 4)]:
            ratio = prior[k] * (0.2 if g else 1.0) * math.exp(log[k, g] - reference)
            ratio_found = found.probability[k, g] / found.probability[5, 0]
            assert ratio_found == pytest.approx(ratio, rel=0.15, abs=1e-9)
        assert found.probability.sum() == pytest.approx(1.0)
        alone = _probabilities(np.tile(size**2, (9, 1, 1)), np.full(9, 1.2), shares[:1])
        ratio = alone.probability[2, 0] / alone.probability[5, 0]
        assert ratio == pytest.approx(math.exp(log[2, 0] - reference), rel=0.02)

    @pytest.mark.parametrize("gross", [False, True])
    def test_tails_of_readings_are_those_of_their_residuals(self, gross: bool) -> None:
        """Residuals of each distribution by iterated weights, (1 + t) / (1 + t r²), to the end."""
        readings, design, scale = self._case()
        found = noise_tails(design, readings.errors, scale, gross=gross)
        own = scale.squared * (1.0 - scale.leverage)
        shares = [0.0, 0.005, 0.01, 0.02, 0.03, 0.05] if gross else [0.0]
        squares, start = np.empty((9, 1, len(own))), np.empty(9)
        for k, tail in enumerate(TAILS):
            fitted = max(tail, 0.15) if gross else tail
            level, factor = 1.0, np.ones(len(own))
            for _ in range(60):
                now = weighted_residuals(design, readings.errors, factor / scale.squared)
                factor = (1.0 + fitted) / (1.0 + fitted * now**2 / own / level)
                level = float(np.mean(factor * now**2 / own))
            squares[k, 0], start[k] = now**2 / own, level
        expected = _probabilities(squares, start, np.array(shares))
        assert found.probability == pytest.approx(expected.probability, rel=0.1, abs=1e-4)
        assert found.levels == pytest.approx(expected.levels, rel=0.02)

    @staticmethod
    def _case() -> tuple[MultiStepReadings, MultiStepDesign, ReadingScale]:
        rng = np.random.default_rng(8)
        i, j = np.divmod(np.arange(60), 6)
        errors = UM * (np.sin(i) + np.cos(j) + 0.3 * rng.standard_t(5.0, 60))
        errors[17] += 5.0 * UM
        readings = MultiStepReadings(i, j, errors)
        squared = (0.3 * UM) ** 2 * rng.uniform(0.5, 2.0, 60)
        return readings, multi_step_design(readings), ReadingScale(squared, np.full(60, 0.25))

    def test_means_over_the_distributions(self) -> None:
        probability = np.zeros((9, 2))
        probability[0], probability[5] = [0.1, 0.3], [0.4, 0.2]
        probability[[1, 2, 3, 4, 6, 7, 8]] = 1e-30
        level = np.ones((9, 2))
        level[0], level[5] = [2.0, 6.0], [3.0, 9.0]
        tails = NoiseTails(probability, level)
        assert tails.of_tails[[0, 5]] == pytest.approx([0.4, 0.6])
        assert tails.levels[[0, 5]] == pytest.approx([5.0, 5.0])
        assert tails.mean_tail == pytest.approx(0.6 * 0.25)
        # Half of either side: with both, twice the tails at the root of the level.
        for beyond in (0.01, 1e-4):
            size = _largest_noise(tails, beyond) / math.sqrt(5.0)
            left = 0.4 * stats.norm.sf(size) + 0.6 * stats.t.sf(size, 4.0)
            assert 2.0 * left == pytest.approx(beyond, rel=1e-6)


def _maximum(size: FloatArray, tail: float, share: float) -> tuple[float, float]:
    """Largest log likelihood over the level, and this level."""
    law = stats.t(1.0 / tail) if tail else stats.norm()

    def negative(log_level: float) -> float:
        z = size * math.exp(-0.5 * log_level)
        norm = 2.0 * (math.log(50.0 / 4.0) + 1.0)
        wide = np.where(z > 4.0, np.minimum(50.0 / z, 1.0) / z / norm, 0.0)
        density = (1.0 - share) * law.pdf(z) + share * wide
        return -float(np.sum(np.log(density))) + 0.5 * len(size) * log_level

    found = optimize.minimize_scalar(negative, bracket=(-1.0, 0.5), tol=1e-10)
    return -float(found.fun), math.exp(float(found.x))


class TestScales:
    def test_the_common_scale_agrees_with_its_own_weights(self) -> None:
        """(1.4826 median |r|)² over the share of degrees of freedom, r with weights
        1.25 / (1 + r² / (4 s²)): dense, to the end of the iteration."""
        rng = np.random.default_rng(9)
        i, j = np.divmod(np.arange(99), 9)
        errors = UM * (np.sin(i) + np.cos(j) + 0.3 * rng.standard_normal(99))
        errors[[4, 50]] += 8.0 * UM
        readings = MultiStepReadings(i, j, errors)
        signed = _signed(readings)
        level, weights = 1.0, np.ones(99)
        for _ in range(200):
            root = np.sqrt(weights)
            solution = np.linalg.lstsq(signed * root[:, None], errors * root, rcond=None)[0]
            left = errors - signed @ solution
            level = (1.4826 * np.median(np.abs(left))) ** 2 / (1.0 - 19.0 / 99.0)
            weights = 1.25 / (1.0 + 0.25 * left**2 / level)
        assert common_scale(multi_step_design(readings), errors) == pytest.approx(level, rel=0.01)
        with pytest.raises(PretravelError, match="no scatter"):
            common_scale(multi_step_design(readings), np.sin(i) - np.cos(j))

    def test_scales_of_directions_follow_their_scatter(self) -> None:
        """Six machine directions with 120 normal readings each: a scale has some 15 %. Student's
        scale with four degrees of freedom of normal noise: its share where E(w z²) = 1."""
        i, j = np.divmod(np.arange(720) % 240, 40)
        true = 0.5e-6 * (1.0 + 0.95 * np.cos(2.0 * np.pi * np.arange(6) / 6.0))
        total = true[i] + 0.05e-6
        errors = np.sqrt(total) * np.random.default_rng(6).standard_normal(len(i))
        found = squared_scales(multi_step_design(MultiStepReadings(i, j, errors)), errors)
        share = optimize.brentq(
            lambda s: stats.norm.expect(lambda z: 1.25 * z**2 / (s + 0.25 * z**2)) - 1.0, 0.3, 1.0
        )
        pairs = (found[:6, None] + found[6:]) / share
        expected = true[:, None] + np.full(40, 0.05e-6)
        assert np.mean(pairs) == pytest.approx(np.mean(expected), rel=0.15)
        slope = np.polyfit(expected.mean(axis=1), pairs.mean(axis=1), 1)[0]
        assert slope == pytest.approx(1.0, abs=0.2)
        for unit in (1e-3, 7.0):
            again = squared_scales(
                multi_step_design(MultiStepReadings(i, j, unit * errors)), unit * errors
            )
            assert again == pytest.approx(unit**2 * found, rel=1e-6)


class TestOutliers:
    def test_limits_are_those_of_dense_predictions(self) -> None:
        """Beside its direction's scale a reading that takes part has the variance s² (1 - h), one
        that does not s² + x' (X'WX)⁺ x; all limits have one quantile of the noise."""
        rng = np.random.default_rng(2)
        i, j = np.divmod(np.arange(80), 8)
        errors = UM * (np.sin(i) - np.cos(j) + 0.3 * (1.0 + (i % 2)) * rng.standard_normal(80))
        out = np.array([7, 33, 61])
        errors[out] += 20.0 * UM
        readings = MultiStepReadings(i, j, errors)
        design, signed, rows = multi_step_design(readings), _signed(readings), np.arange(80)
        rows = np.setdiff1d(rows, out)
        part = multi_step_design(MultiStepReadings(i[rows], j[rows], errors[rows]))
        distance, limits = _judged(design, part, errors, rows)
        total = np.abs(signed) @ squared_scales(part, errors[rows])
        weights = np.diag(1.0 / total[rows])
        cofactor = np.linalg.pinv(signed[rows].T @ weights @ signed[rows], rcond=1e-9)
        beside = np.einsum("ni,ij,nj->n", signed, cofactor, signed)
        own = np.where(np.isin(np.arange(80), out), total + beside, total - beside)
        leverage = likelihood_information(design, total).leverage
        tails = noise_tails(design, errors, ReadingScale(total, leverage), gross=True)
        assert limits / np.sqrt(own) == pytest.approx(_largest_noise(tails, 0.01 / 80.0), rel=1e-6)
        # The fit: what it predicts is a machine less a probe error, and its weighted residuals
        # add up to zero in each direction.
        predicted = errors - distance
        assert signed @ np.linalg.lstsq(signed, predicted)[0] == pytest.approx(predicted, abs=1e-12)
        level = float(tails.of_tails @ tails.levels)
        share = tails.mean_tail * distance[rows] ** 2 / (total[rows] * level)
        forces = distance[rows] / total[rows] / (1.0 + share)
        sums = np.abs(signed[rows]).T @ np.abs(forces)
        assert np.abs(signed[rows].T @ forces) == pytest.approx(0.0, abs=0.01 * sums.min())
        assert np.all(np.abs(distance[out] - 20.0 * UM) < 2.0 * UM)
        named = outlying_readings(design, errors)
        assert {one.row for one in named} == set(out.tolist())
        assert [abs(one.distance) for one in named] == sorted(
            (abs(one.distance) for one in named), reverse=True
        )

    def test_a_direction_keeps_two_readings(self) -> None:
        """A part with two readings of a direction is judged, one with a single one is not."""
        i, j = np.divmod(np.arange(20), 4)
        design = multi_step_design(MultiStepReadings(i, j, np.zeros(20)))
        assert _part(design, np.arange(2, 20)) is not None
        assert _part(design, np.arange(3, 20)) is None
        apart = np.flatnonzero((i < 3) == (j < 2))
        assert _part(design, apart) is None
        some = _part(design, np.arange(2, 20))
        assert some is not None
        kept = multi_step_design(MultiStepReadings(i[2:], j[2:], np.zeros(18)))
        assert np.array_equal(some.design, design.design[2:])
        assert np.array_equal(some.incidence, kept.incidence)
        assert (some.row.tolist(), some.column.tolist()) == (i[2:].tolist(), j[2:].tolist())


class TestPlan:
    @pytest.mark.parametrize(
        ("directions", "steps"), [(5, (0, 1, 3)), (6, (0, 1)), (7, (0, 2, 3, 6)), (4, (0, 1, 2, 3))]
    )
    def test_u_of_errors_is_that_of_dense_equations(
        self, directions: int, steps: tuple[int, ...]
    ) -> None:
        """About their mean: errors of the machine that add up to zero."""
        machine, probe = turned_pairs(directions, steps)
        readings = MultiStepReadings(machine, probe, np.zeros(len(machine)))
        covariance = np.linalg.pinv(_signed(readings).T @ _signed(readings))
        own = covariance[:directions, :directions]
        centred = np.eye(directions) - 1.0 / directions
        u = np.sqrt(np.diag(centred @ own @ centred))
        assert error_factor(directions, steps) == pytest.approx(u[0], rel=1e-9)

    def test_orientations_that_connect_nothing(self) -> None:
        assert math.isinf(error_factor(6, (0, 2)))
        assert math.isinf(error_factor(6, (0, 3)))
        assert math.isfinite(error_factor(6, (0, 5)))

    def test_each_orientation_is_the_best_beside_those_before(self) -> None:
        for directions in (5, 8):
            assert best_steps(directions, 2) == (0, 1)
            before = {0, 1}
            for count in range(3, directions + 1):
                steps = best_steps(directions, count)
                assert before < set(steps)
                assert list(steps) == sorted(steps)
                rest = set(range(directions)) - before
                least = min(error_factor(directions, (*before, step)) for step in rest)
                assert error_factor(directions, steps) == pytest.approx(least, rel=1e-9)
                before = set(steps)

    def test_pairs_of_a_plan(self) -> None:
        """In orientation s machine direction i meets probe direction i - s; repeats in a row."""
        plan = replace(plan_separation(4, 1e-6, u_error=0.9e-3), steps=(0, 3), repeats=2)
        machine, probe = plan.pairs()
        assert machine.tolist() == [1, 1, 2, 2, 3, 3, 4, 4] * 2
        assert probe.tolist() == [1, 1, 2, 2, 3, 3, 4, 4, 2, 2, 3, 3, 4, 4, 1, 1]
        assert plan.readings == len(machine) == 16

    @pytest.mark.parametrize(
        ("directions", "variance", "u_error", "u_variance"),
        [
            (2, 1e-6, 1e-3, None), (73, 1e-6, 1e-3, None), (5, 0.0, 1e-3, None),
            (5, 1e-6, None, None),
            (5, 1e-6, 0.0, None), (5, 1e-6, None, 0.0), (5, -1e-6, 1e-3, None),
            (5, 1e-6, -1e-3, None),
            (5, 1e-6, None, -0.1), (5, 1e-6, math.nan, None), (5, math.inf, 1e-3, None),
        ],
    )  # fmt: skip
    def test_requirements_are_checked(
        self, directions: int, variance: float, u_error: float | None, u_variance: float | None
    ) -> None:
        with pytest.raises(PretravelError) as refused:
            plan_separation(directions, variance, u_error=u_error, u_variance=u_variance)
        assert "no test with up to" not in str(refused.value)

    def test_the_lowest_uncertainty_is_that_of_fifty_repeats(self) -> None:
        steps = (0, 1, 2)
        lowest = error_factor(3, steps) * 2e-3 / math.sqrt(50.0)
        plan = plan_separation(3, 4e-6, u_error=1.0001 * lowest)
        assert (len(plan.steps), plan.repeats) == (3, 50)
        relative = variance_factor(3, steps, 50)
        words = f"3 orientations and 50 repeats .* {1e3 * lowest:.3g} µm of errors and"
        words += f" {100.0 * relative:.0f} % of v"
        with pytest.raises(PretravelError, match=words):
            plan_separation(3, 4e-6, u_error=0.999 * lowest)
        assert plan_separation(3, 4e-6, u_variance=1.0001 * relative).repeats == 50
        with pytest.raises(PretravelError, match=words):
            plan_separation(3, 4e-6, u_variance=0.999 * relative)
        with pytest.raises(PretravelError, match=words):
            plan_separation(3, 4e-6, u_error=1.0, u_variance=0.999 * relative)


class TestWhatIsTold:
    @staticmethod
    def _found(machine: list[float], probe: list[float]) -> list[str]:
        """Notes of least squares with these variances, by hand of the residuals' law."""
        rng = np.random.default_rng(1)
        i, j = np.divmod(
            np.arange(len(machine) * len(probe) * 30) % (len(machine) * len(probe)), len(probe)
        )
        scale = np.sqrt(np.array(machine)[i] + np.array(probe)[j])
        readings = MultiStepReadings(i, j, UM * scale * rng.standard_normal(len(i)))
        found = separate(readings, method="least-squares", search_outliers=False)
        to_probe, to_machine = 1e6 * found.movable
        assert found.movable == pytest.approx(
            [found.machine_variance.min(), found.probe_variance.min()]
        )
        words = f"up to {to_probe:.3g} µm² can move from every machine direction to every probe "
        assert f"{words}direction, or {to_machine:.3g} µm² back" in found.notes[1]
        return list(found.notes)

    def test_how_much_can_move(self) -> None:
        notes = self._found([1.0, 2.0, 1.5], [1.0, 1.5, 2.0, 1.2])
        assert len(notes) == 2
        assert notes[0].startswith(
            "360 readings, 3 machine and 4 probe directions. The readings do not "
            "determine a constant "
        )
        assert "rank 6 of 7" in notes[0]

    def test_an_outlier_is_told_with_its_size(self) -> None:
        told = ReadingOutlier(4, 7, 9, -12.5e-3, 2.25e-3).message
        assert told == (
            "reading 5, machine 7 with probe 9, lies -12.5 µm from what the others predict; noise "
            "explains 2.25 µm. It is left out"
        )

    def test_a_negative_variance_is_told(self) -> None:
        """Readings of few degrees of freedom, until one pair is negative."""
        for seed in range(20):
            errors = UM * np.random.default_rng(seed).standard_normal(12)
            readings = MultiStepReadings(*np.divmod(np.arange(12), 4), errors)
            found = separate(readings, method="least-squares", search_outliers=False)
            pairs = found.machine_variance[:, None] + found.probe_variance
            told = any("impossible; use the method reml" in note for note in found.notes)
            assert told == (pairs.min() < 0.0)
            assert ("can move" in found.notes[1]) == (not told)

    def test_rows_that_were_left_out(self) -> None:
        """Two readings of one excluded pair, and two gross errors; rows count from the first."""
        rng = np.random.default_rng(4)
        i, j = np.divmod(np.arange(144), 12)
        i, j = np.append(i, 0), np.append(j, 5)
        errors = UM * 0.2 * rng.standard_normal(145)
        errors[[60, 100]] += np.array([-9.0, 15.0]) * UM
        found = separate(MultiStepReadings(i, j, errors), exclude=[(0, 5)])
        assert found.excluded == (5, 144)
        assert [outlier.row for outlier in found.outliers] == [100, 60]
        assert [(o.machine, o.probe) for o in found.outliers] == [(8, 4), (5, 0)]
        assert [np.sign(o.distance) for o in found.outliers] == [1.0, -1.0]
        assert len(found.residuals) == 141
        assert found.dof == 141 - 23
        kept = separate(MultiStepReadings(i, j, errors), search_outliers=False)
        assert (kept.outliers, kept.excluded, len(kept.residuals)) == ((), (), 145)
        errors_of, variances = separation_by_trials(
            MultiStepReadings(i, j, errors), found, trials=400
        )
        assert errors_of.shape == variances.shape == (400, 24)
        truth = np.concatenate([found.machine_error, found.probe_error])
        assert errors_of.mean(axis=0) == pytest.approx(truth, abs=5.0 * 0.06 * UM / 20.0)


def test_without_doubt_of_the_tails_reml_weighs_by_the_mean_of_both() -> None:
    """Many normal readings: variances of pairs within 4 of their u from the truth, and errors with
    the covariance of ordinary least squares at variances near these."""
    i, j = np.divmod(np.arange(3 * 80) % 80, 8)
    true = (0.1 + 0.05 * (i % 2)) + (0.2 + 0.1 * np.cos(j))
    errors = UM * np.sqrt(true) * np.random.default_rng(3).standard_normal(len(i))
    readings = MultiStepReadings(i, j, errors)
    found = separate(readings, search_outliers=False)
    information = likelihood_information(multi_step_design(readings), 1e-6 * true)
    for k in (0, 9, 22, 47, 79):
        variance, u = found.pair_variance(int(i[k]), int(j[k]))
        assert abs(variance - 1e-6 * true[k]) < 4.0 * u
        h = np.abs(_signed(readings)[k])
        assert 0.7 < u / math.sqrt(h @ information.inverse @ h) < 1.6
    signed = _signed(readings)
    fixed = signed.T @ signed + np.outer(*[np.repeat([1.0, 0.0], [10, 8])] * 2)
    solve = np.linalg.solve(fixed, signed.T)
    expected = np.sqrt(np.diag(solve @ np.diag(1e-6 * true) @ solve.T))
    u = np.concatenate([found.u_machine_error, found.u_probe_error])
    assert u == pytest.approx(expected, rel=0.3)
    assert np.mean(u / expected) == pytest.approx(1.0, abs=0.1)
