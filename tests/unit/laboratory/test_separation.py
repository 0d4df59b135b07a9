"""The separation against dense matrices, and the intervals, shares and notes of its results.

S has a row for each reading: +1 at its machine direction, -1 at its probe direction. Z is |S|.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepReadings,
    RepeatedPair,
    multi_step_design,
)
from pretravel.laboratory.separation.separation import Separation, _shares, separate
from pretravel.laboratory.separation.variances import likelihood_information, noise_of_readings

UM = 1e-3


def _signed(readings: MultiStepReadings) -> FloatArray:
    machines, probes = np.unique(readings.machine), np.unique(readings.probe)
    return np.hstack(
        [
            (readings.machine[:, None] == machines).astype(float),
            -(readings.probe[:, None] == probes).astype(float),
        ]
    )


def _complete(machines: int, probes: int, scatter: float, seed: int = 3) -> MultiStepReadings:
    """All pairs once; machine directions count from 10, the probe's from 20."""
    i, j = np.divmod(np.arange(machines * probes), probes)
    noise = np.random.default_rng(seed).standard_normal(machines * probes)
    return MultiStepReadings(10 + i, 20 + j, UM * (np.sin(i) - np.cos(j) + scatter * noise))


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
        rng = np.random.default_rng(6)
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

    @pytest.mark.parametrize("seed", [3, 8])
    def test_a_measured_pair_adds_its_information(self, seed: int) -> None:
        """For the variances of all pairs (C⁻¹ + h h' / R)⁻¹, R = 2 v² / dof with v the mean of both
        by degrees of freedom; one estimate of the pair is negative, and counts as zero there."""
        readings = _complete(8, 8, 1.0, seed)
        alone = separate(readings, method="least-squares", search_outliers=False)
        before, u = alone.pair_variance(12, 23)
        assert (before < 0.0) == (seed == 3)
        pair = RepeatedPair(12, 23, 0.4e-6, 9)
        found = separate(readings, method="least-squares", repeated=pair, search_outliers=False)
        r = 2.0 * ((0.4e-6 * 8.0 + max(before, 0.0)) / 9.0) ** 2 / 8.0
        z = np.abs(_signed(readings))
        covariance = z @ alone.variance_covariance @ z.T
        gain = covariance[:, 19] / (u**2 + r)  # the pair is in the twentieth reading
        values = z @ np.concatenate([alone.machine_variance, alone.probe_variance])
        now = z @ np.concatenate([found.machine_variance, found.probe_variance])
        assert 1e6 * now == pytest.approx(1e6 * (values + gain * (0.4e-6 - before)), rel=1e-6)
        expected = covariance - np.outer(gain, covariance[19])
        assert 1e12 * (z @ found.variance_covariance @ z.T) == pytest.approx(
            1e12 * expected, rel=1e-6, abs=1e-7
        )
        assert found.repeated is pair
        note = next(note for note in found.notes if "repeated pair (12, 23)" in note)
        # u of a variance of 9 normally distributed repeats: the variance times the root of 2/8.
        assert "has the variance 0.4 µm² from 9 repeats (u = 0.2 µm²)" in note
        assert f"with all readings together it is {1e6 * now[19]:.3g} µm²" in note

    def test_directions_with_too_few_readings_are_named(self) -> None:
        """A full block of three by three, and machine 9 once: its residual is always zero."""
        i, j = np.divmod(np.arange(9), 3)
        errors = UM * np.random.default_rng(1).standard_normal(10)
        readings = MultiStepReadings(np.append(i, 9), np.append(j, 0), errors)
        with pytest.raises(PretravelError, match=r"deficient by 2.*too few readings: machine 9\. "):
            separate(readings, method="least-squares")
        with pytest.raises(PretravelError, match=r"deficient by 2.*too few readings: machine 9\. "):
            separate(readings)

    def test_a_degree_of_freedom_is_needed(self) -> None:
        """Two by two: four readings, three errors, one degree; without one reading none."""
        four = MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], UM * np.array([0.0, 1.0, 1.0, 2.5]))
        with pytest.raises(
            PretravelError, match="identification matrix of the variances is rank deficient"
        ):
            separate(four)
        five = MultiStepReadings([1, 1, 2, 3, 3], [1, 2, 2, 2, 1], UM * np.arange(5.0))
        with pytest.raises(PretravelError, match="4 readings for 4 systematic errors leave no deg"):
            separate(five, exclude=[(3, 1)])


def test_what_repeats_do_not_reduce() -> None:
    """144 pairs with an error each of 0.3 µm, touched five times with 0.05 µm: the errors of the
    machine about their mean have a variance of 11 / 12 · (0.3² + 0.05² / 5) / 12 µm², five times
    that of 720 independent readings. Without errors of the pairs nothing is said."""
    i, j = np.divmod(np.arange(144), 12)
    rng = np.random.default_rng(2)
    noise = 0.05 * rng.standard_normal((144, 5))
    u = []
    for size in (0.3, 0.0):
        pairs = np.sin(i) - np.cos(j) + size * rng.standard_normal(144)
        errors = UM * (pairs[:, None] + noise).ravel()
        found = separate(
            MultiStepReadings(np.repeat(i, 5), np.repeat(j, 5), errors), search_outliers=False
        )
        assert any("repeats of a pair scatter by 0.05 µm" in n for n in found.notes) == (size > 0.0)
        low, high = found.error_interval()[:12].T
        u.append(math.sqrt(np.mean(np.square(high - low))) / 2.0 / 1.98)
        expected = UM * math.sqrt(11.0 / 12.0 * (size**2 + 0.05**2 / 5.0) / 12.0)
        assert u[-1] == pytest.approx(expected, rel=0.12)  # 121 degrees of freedom: 2 u are 0.13


class TestPairs:
    @staticmethod
    def _pair(variance: float, u: float) -> Separation:
        """Of machine direction 12 and probe direction 21 the share 0.3 and 0.7 of a variance; the
        covariance of both with the stated u of their sum, and nothing known of the others."""
        readings = _complete(6, 5, 0.2, 1)
        found = separate(readings, method="least-squares", search_outliers=False)
        machine, probe = np.zeros(6), np.zeros(5)
        machine[2], probe[1] = 0.3 * variance, 0.7 * variance
        covariance = np.eye(11)
        covariance[np.ix_([2, 7], [2, 7])] = u**2 * np.array([[0.5, -0.2], [-0.2, 0.9]])
        return replace(
            found, machine_variance=machine, probe_variance=probe, variance_covariance=covariance
        )

    @pytest.mark.parametrize(
        ("u", "probability", "low", "high"),
        [
            # Of 4 µm². u a third of it: 18 degrees of freedom; chi-square at 2.5 %: 8.231 (NIST).
            (4.0 / 3.0, 0.95, 4.0 * (1.0 - 1.95996 / 3.0), 4.0 * 18.0 / 8.231),
            # u a half of it: 8 degrees; chi-square at 25 %: 5.071 (NIST).
            (2.0, 0.5, 4.0 - 0.67449 * 2.0, 4.0 * 8.0 / 5.071),
            # Fewer than four degrees where u is more than the root of a half: symmetric.
            (3.0, 0.95, 0.0, 4.0 + 1.95996 * 3.0),
            (3.0, 0.5, 4.0 - 0.67449 * 3.0, 4.0 + 0.67449 * 3.0),
            # Just above four degrees: chi-square 0.4844 at 2.5 %.
            (0.9999 * 4.0 * math.sqrt(0.5), 0.95, 0.0, 4.0 * 4.0 / 0.4844),
            (0.0, 0.95, 4.0, 4.0),
        ],
    )
    def test_interval(self, u: float, probability: float, low: float, high: float) -> None:
        found = self._pair(4.0e-6, 1e-6 * u)
        assert found.pair_variance(12, 21) == pytest.approx((4.0e-6, 1e-6 * u), rel=1e-12)
        interval = 1e6 * np.array(found.pair_interval(12, 21, probability))
        assert interval == pytest.approx([low, high], rel=1e-3)

    def test_directions_without_readings(self) -> None:
        with pytest.raises(PretravelError, match=r"no reading has machine direction 21; there are"):
            self._pair(1e-6, 1e-7).pair_variance(21, 21)
        with pytest.raises(PretravelError, match=r"no reading has probe direction 12; there are"):
            self._pair(1e-6, 1e-7).pair_variance(12, 12)


class TestShares:
    DESIGN: ClassVar = multi_step_design(
        MultiStepReadings(*np.divmod(np.arange(6), 3), np.zeros(6))
    )

    @pytest.mark.parametrize(
        ("values", "shared", "movable", "negative"),
        [
            # Means 6 and 2: half each is 4; nothing is negative.
            ([5.0, 7.0, 1.0, 2.0, 3.0], [3.0, 5.0, 3.0, 4.0, 5.0], (3.0, 3.0), False),
            # Half each leaves -1 of a probe: 1 is moved there from the machine.
            ([6.0, 6.0, -1.0, 8.0, 11.0], [5.0, 5.0, 0.0, 9.0, 12.0], (5.0, 0.0), False),
            # Half each leaves -1 of the machine.
            ([-1.0, 7.0, 2.0, 3.0, 4.0], [0.0, 8.0, 1.0, 2.0, 3.0], (0.0, 1.0), False),
            # The middle between both: a pair of -1 has half of it in each.
            ([-2.0, 8.0, 1.0, 3.0, 5.0], [-0.5, 9.5, -0.5, 1.5, 3.5], (-0.5, -0.5), True),
        ],
    )
    def test_half_each_where_none_is_negative(
        self, values: list[float], shared: list[float], movable: tuple[float, float], negative: bool
    ) -> None:
        found = _shares(self.DESIGN, np.array(values))
        assert found.variances == pytest.approx(shared, abs=1e-12)
        assert found.movable == pytest.approx(movable, abs=1e-12)
        assert found.negative is negative

    def test_how_much_can_move_is_told(self) -> None:
        rng = np.random.default_rng(1)
        i, j = np.divmod(np.arange(360) % 12, 4)
        scale = np.sqrt(np.array([1.0, 2.0, 1.5])[i] + np.array([1.0, 1.5, 2.0, 1.2])[j])
        readings = MultiStepReadings(i, j, UM * scale * rng.standard_normal(360))
        found = separate(readings, method="least-squares", search_outliers=False)
        to_probe, to_machine = 1e6 * found.movable
        assert found.movable == pytest.approx(
            [found.machine_variance.min(), found.probe_variance.min()]
        )
        of_errors, of_variances = found.notes
        words = f"Up to {to_probe:.3g} µm² of each machine direction could belong to each probe "
        assert f"{words}direction, or {to_machine:.3g} µm² of each probe" in of_variances
        assert of_errors.startswith(
            "360 readings, 3 machine and 4 probe directions. The readings determine "
            "everything except a constant "
        )
        assert "rank 6 of 7" in of_errors

    def test_a_negative_variance_is_told(self) -> None:
        """Twelve readings, of six degrees of freedom for six variances."""
        found = separate(_complete(3, 4, 1.0), method="least-squares", search_outliers=False)
        assert (found.machine_variance[:, None] + found.probe_variance).min() < 0.0
        _, of_variances, negative = found.notes
        assert "can move" not in of_variances
        assert "impossible; use the method reml" in negative


def test_rows_that_are_left_out() -> None:
    """Two readings of one excluded pair, and two gross errors; rows count from the first."""
    rng = np.random.default_rng(4)
    i, j = np.divmod(np.arange(144), 12)
    i, j = np.append(i, 0), np.append(j, 5)
    errors = UM * 0.2 * rng.standard_normal(145)
    errors[[60, 100]] += np.array([-9.0, 15.0]) * UM
    readings = MultiStepReadings(i, j, errors)
    found = separate(readings, exclude=[(0, 5)])
    assert found.excluded == (5, 144)
    assert [(o.row, o.machine, o.probe) for o in found.outliers] == [(100, 8, 4), (60, 5, 0)]
    assert [o.distance / UM for o in found.outliers] == pytest.approx([15.0, -9.0], abs=0.8)
    assert (len(found.residuals), found.dof) == (141, 141 - 23)
    whole = separate(readings, search_outliers=False)
    assert (whole.outliers, whole.excluded, len(whole.residuals)) == ((), (), 145)
    without = separate(readings, exclude=[(0, 5), (5, 0), (8, 4)])
    assert without.excluded == (5, 60, 100, 144)
    assert np.allclose(found.machine_error, without.machine_error)
    assert np.allclose(found.probe_variance, without.probe_variance)
    with pytest.raises(
        PretravelError, match="machine direction 25 with probe direction 1"
    ) as caught:
        separate(readings, exclude=[(25, 1)])
    assert caught.value.inputs == ("exclude",)


def test_without_doubt_of_the_tails_reml_weighs_by_the_mean_of_both() -> None:
    """Many normal readings: variances of pairs within 4 of their u from the truth, with the u of
    Fisher's information, and errors with the covariance of ordinary least squares near these."""
    i, j = np.divmod(np.arange(3 * 80) % 80, 8)
    true = (0.1 + 0.05 * (i % 2)) + (0.2 + 0.1 * np.cos(j))
    errors = UM * np.sqrt(true) * np.random.default_rng(3).standard_normal(len(i))
    readings = MultiStepReadings(i, j, errors)
    found = separate(readings, search_outliers=False)
    inverse = likelihood_information(multi_step_design(readings), 1e-6 * true).inverse
    signed = _signed(readings)
    z = np.abs(signed)
    variances = z @ np.concatenate([found.machine_variance, found.probe_variance])
    u = np.sqrt(np.einsum("ni,ij,nj->n", z, found.variance_covariance, z))
    assert np.all(np.abs(variances - 1e-6 * true) < 4.0 * u)
    ratio = u / np.sqrt(np.einsum("ni,ij,nj->n", z, inverse, z))
    assert 0.7 < ratio.min() < ratio.max() < 1.6
    # The level of 240 readings, on which u depends, has 9 %.
    assert ratio.mean() == pytest.approx(1.0, abs=0.2)
    fixed = signed.T @ signed + np.outer(*[np.repeat([1.0, 0.0], [10, 8])] * 2)
    solve = np.linalg.solve(fixed, signed.T)
    expected = np.sqrt(np.diag(solve @ np.diag(1e-6 * true) @ solve.T))
    of_errors = np.concatenate([found.u_machine_error, found.u_probe_error])
    assert of_errors == pytest.approx(expected, rel=0.3)
    assert np.mean(of_errors / expected) == pytest.approx(1.0, abs=0.1)
