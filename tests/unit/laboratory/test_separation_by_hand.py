"""Intervals of pairs, scales of residuals and groups of readings whose results follow by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.multi_step_readings import (
    MultiStepReadings,
    check_connected,
    multi_step_design,
    weighted_errors,
)
from pretravel.laboratory.separation import Separation, separate
from pretravel.laboratory.separation_noise import ReadingScale, noise_tails
from pretravel.laboratory.separation_variances import common_scale

UM = 1e-3


def _readings(machines: int, probes: int, seed: int = 1) -> MultiStepReadings:
    i, j = np.divmod(np.arange(machines * probes), probes)
    noise = np.random.default_rng(seed).standard_normal(machines * probes)
    return MultiStepReadings(10 + i, 20 + j, UM * (np.sin(i) - np.cos(j) + 0.2 * noise))


def _pair(variance: float, u: float) -> Separation:
    """Of machine direction 12 and probe direction 21 the share 0.3 and 0.7 of a variance; the
    covariance of both with the stated u of their sum, and nothing known of the others."""
    found = separate(_readings(6, 5), method="least-squares", search_outliers=False)
    machine, probe = np.zeros(6), np.zeros(5)
    machine[2], probe[1] = 0.3 * variance, 0.7 * variance
    covariance = np.eye(11)
    both = np.ix_([2, 7], [2, 7])
    covariance[both] = u**2 * np.array([[0.5, -0.2], [-0.2, 0.9]])
    return replace(
        found, machine_variance=machine, probe_variance=probe, variance_covariance=covariance
    )


class TestPairs:
    def test_interval_by_chi_square(self) -> None:
        """u a third of the variance: 18 degrees of freedom; chi-square at 2.5 %: 8.231 (NIST)."""
        found = _pair(4.0e-6, 4.0e-6 / 3.0)
        variance, u = found.pair_variance(12, 21)
        assert (variance, u) == pytest.approx((4.0e-6, 4.0e-6 / 3.0), rel=1e-12)
        low, high = found.pair_interval(12, 21, 0.95)
        assert low == pytest.approx(4.0e-6 * (1.0 - 1.95996 / 3.0), rel=1e-4)
        assert high == pytest.approx(4.0e-6 * 18.0 / 8.231, rel=1e-3)

    def test_interval_at_another_probability(self) -> None:
        """At 50 % and u a half of the variance: 8 degrees, chi-square at 25 %: 5.071 (NIST)."""
        low, high = _pair(4.0e-6, 2.0e-6).pair_interval(12, 21, 0.5)
        assert low == pytest.approx(4.0e-6 - 0.67449 * 2.0e-6, rel=1e-4)
        assert high == pytest.approx(4.0e-6 * 8.0 / 5.071, rel=1e-3)

    def test_few_degrees_of_freedom_make_it_symmetric(self) -> None:
        """Fewer than four where u is more than the root of a half of the variance."""
        low, high = _pair(4.0e-6, 3.0e-6).pair_interval(12, 21, 0.95)
        assert low == 0.0
        assert high == pytest.approx(4.0e-6 + 1.95996 * 3.0e-6, rel=1e-4)
        low, _ = _pair(4.0e-6, 3.0e-6).pair_interval(12, 21, 0.5)
        assert low == pytest.approx(4.0e-6 - 0.67449 * 3.0e-6, rel=1e-4)
        at = math.sqrt(0.5)
        _, high = _pair(4.0e-6, 0.999 * at * 4.0e-6).pair_interval(12, 21, 0.95)
        # Just above four degrees of freedom: chi-square 0.484 at 2.5 %.
        assert high == pytest.approx(4.0e-6 * 4.0 / 0.4844, rel=0.01)

    def test_a_variance_that_is_known(self) -> None:
        assert _pair(4.0e-6, 0.0).pair_interval(12, 21) == (pytest.approx(4.0e-6),) * 2

    def test_directions_without_readings(self) -> None:
        with pytest.raises(PretravelError, match=r"no reading has machine direction 21; there are"):
            _pair(1e-6, 1e-7).pair_variance(21, 21)
        with pytest.raises(PretravelError, match=r"no reading has probe direction 12; there are"):
            _pair(1e-6, 1e-7).pair_variance(12, 12)


class TestScales:
    def test_a_gross_error_does_not_move_the_common_scale(self) -> None:
        """12 x 10 readings of 0.2 µm, one off by 200 µm: in least squares all others of its row
        and column would be off by some 20 µm. The scale of 120 readings from a median has 11 %."""
        readings = _readings(12, 10)
        design, errors = multi_step_design(readings), np.array(readings.errors)
        clean = common_scale(design, errors)
        assert math.sqrt(clean) == pytest.approx(0.2 * UM, rel=0.35)
        errors[37] += 200.0 * UM
        # Without one of 120 readings the median moves by less than its own deviation.
        assert math.sqrt(common_scale(design, errors)) == pytest.approx(math.sqrt(clean), rel=0.11)

    @pytest.mark.parametrize("unit", [1.0, 1e-3, 40.0])
    def test_the_common_scale_has_the_square_of_the_unit(self, unit: float) -> None:
        readings = _readings(7, 5)
        design = multi_step_design(readings)
        one = common_scale(design, readings.errors)
        assert common_scale(design, unit * readings.errors) == pytest.approx(unit**2 * one)

    def test_normal_noise_has_the_mean_square_over_what_a_fit_leaves(self) -> None:
        """Unequal variances and leverages: of the first distribution, the normal one, the level is
        the mean of r² / (s² (1 - h)) about weighted least squares."""
        rng = np.random.default_rng(2)
        readings = _readings(6, 5)
        design = multi_step_design(readings)
        squared = (0.2 * UM) ** 2 * rng.uniform(0.5, 2.0, 30)
        leverage = rng.uniform(0.1, 0.9, 30)
        solution = weighted_errors(design, readings.errors, 1.0 / squared)
        i, j = np.divmod(np.arange(30), 5)
        x = np.zeros((30, 11))
        x[np.arange(30), i], x[np.arange(30), 6 + j] = 1.0, -1.0
        root = np.sqrt(1.0 / squared)
        expected = np.linalg.lstsq(x * root[:, None], readings.errors * root, rcond=None)[0]
        left = readings.errors - x @ expected
        assert readings.errors - x @ solution == pytest.approx(left, abs=1e-12)
        assert solution[:6].sum() == pytest.approx(0.0, abs=1e-12)
        scale = ReadingScale(squared, leverage)
        found = noise_tails(design, readings.errors, scale, gross=False)
        level = float(np.mean(left**2 / (squared * (1.0 - leverage))))
        assert found.level.shape[1] == 1
        assert found.level[0, 0] == pytest.approx(level, rel=1e-9)
        assert found.of_tails.sum() == pytest.approx(1.0)

    @pytest.mark.parametrize("gross", [False, True])
    def test_the_level_of_the_scale_does_not_matter(self, gross: bool) -> None:
        readings = _readings(6, 5)
        design = multi_step_design(readings)
        found = [
            noise_tails(
                design,
                readings.errors,
                ReadingScale(factor * (0.2 * UM) ** 2 * np.ones(30), np.full(30, 1.0 / 3.0)),
                gross=gross,
            )
            for factor in (1.0, 9.0)
        ]
        assert found[1].probability == pytest.approx(found[0].probability, rel=1e-6)
        assert found[1].level == pytest.approx(found[0].level / 9.0, rel=1e-6)


def test_groups_of_readings_without_a_common_direction_are_listed() -> None:
    """Machine 1 and 2 with probe 5 and 6; 3 with 7; each of the others with one of its own."""
    machines, probes = np.array([1, 1, 2, 3, 3, 4, 8]), np.array([5, 6, 6, 7, 7, 9, 11])
    three = multi_step_design(MultiStepReadings(machines[:6], probes[:6], np.zeros(6)))
    with pytest.raises(PretravelError) as refused:
        check_connected(three)
    assert (
        "3 groups that share no direction (machine 1, 2 with probe 5, 6; machine 3 with probe 7; "
        "machine 4 with probe 9): each"
    ) in str(refused.value)
    four = multi_step_design(MultiStepReadings(machines, probes, np.zeros(7)))
    with pytest.raises(PretravelError, match=r"4 groups .*machine 4 with probe 9; …\): each"):
        check_connected(four)
    check_connected(multi_step_design(MultiStepReadings([1, 1, 2, 2], [5, 6, 6, 5], np.zeros(4))))
