"""Touches far from those of their direction: limits by hand from both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import describe, fibonacci_cap
from pretravel.maps.observation import Observation
from pretravel.qualification.outliers import (
    Outlier,
    median_of_groups,
    outlier_factor,
    repeat_outliers,
)
from pretravel.qualification.within_directions import centred_within, dof_of_tails, tail_kurtosis
from pretravel.touches import Touches

S = 3e-4  # mm
NORMALS = fibonacci_cap(25, 1.5)
TRIPLES = np.repeat(np.arange(25), 3)
EVEN = np.tile([-S, 0.0, S], 25)  # the variance S² in each direction


def _found(values: FloatArray, groups: IntArray, step: float = 0.0) -> list[Outlier]:
    normals = NORMALS[groups]
    positions = normals * (15.5 - 0.008 - values)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    return repeat_outliers(seen, Touches(positions, normals).where, step)


def _limit(count: int, dof: int, step: float = 0.0) -> float:
    """One of a hundred sets exceeds it by Bonferroni, times 1.2; the noise from the median of
    variances with `dof` degrees of freedom, and the variance of rounding."""
    noise = math.hypot(S / math.sqrt(stats.chi2.median(dof) / dof), step / math.sqrt(12.0))
    return 1.2 * float(stats.norm.ppf(1.0 - 0.005 / count)) * noise


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("step", [0.0, 5e-4, 1e-2])
def test_a_touch_of_three_beyond_the_limit_is_named(sign: float, step: float) -> None:
    limit = max(_limit(75, 2, step), 2.0 * step)
    for factor, number in ((0.999, 0), (1.001, 1)):
        values = EVEN.copy()
        values[31 if sign > 0.0 else 30] = 0.0
        row = 32 if sign > 0.0 else 31
        values[row] = sign * factor * limit
        values[30 if sign > 0.0 else 32] = -sign * S
        found = _found(values, TRIPLES, step)
        assert len(found) == number
    (outlier,) = found
    assert outlier.rows == (row,)
    assert outlier.distance == pytest.approx(1.001 * sign * limit, rel=1e-6)
    assert outlier.limit == pytest.approx(limit, rel=1e-6)
    assert outlier.left_out
    assert outlier.message == (
        f"touch {row + 1} at {describe(NORMALS[10])} lies {1001.0 * sign * limit:+.1f} µm from the "
        f"median of the 3 touches of its direction; repeatability explains {1e3 * limit:.1f} µm"
    )


def test_both_of_a_pair_are_named() -> None:
    """The difference of two touches scatters by the root of two times more than one."""
    groups = np.repeat(np.arange(25), 2)
    limit = math.sqrt(2.0) * _limit(50, 1)
    for factor, number in ((0.999, 0), (1.001, 1)):
        values = np.tile([-S, S], 25) / math.sqrt(2.0)
        values[8:10] = [0.0, factor * limit]
        found = _found(values, groups)
        assert len(found) == number
    (outlier,) = found
    assert outlier.rows == (8, 9)
    assert abs(outlier.distance) == pytest.approx(1.001 * limit, rel=1e-6)
    assert outlier.limit == pytest.approx(limit, rel=1e-6)
    assert f"lie {1001.0 * limit:.1f} µm apart" in outlier.message
    assert f"repeatability explains {1e3 * limit:.1f} µm" in outlier.message


@pytest.mark.parametrize(("repeated", "number"), [(2, 0), (3, 1)])
def test_three_repeated_directions_tell_the_scatter(repeated: int, number: int) -> None:
    groups = np.concatenate([np.repeat(np.arange(repeated), 5), np.arange(repeated, 20)])
    values = np.where(np.arange(len(groups)) % 2, S, -S)
    values[2] = 1.0
    assert len(_found(values, groups)) == number


def test_equal_repeats_differ_by_rounding() -> None:
    assert _found(np.zeros(75), TRIPLES) == []


def test_several_touches_in_any_order_are_named() -> None:
    """The rows of the touches, whatever the order in which the directions were touched."""
    order = np.random.default_rng(2).permutation(75)
    values = EVEN.copy()
    values[[5, 6, 71]] += [0.1, -0.1, 0.2]
    wrong = {int(np.flatnonzero(order == row)[0]) for row in (5, 6, 71)}
    new = np.unique(TRIPLES[order], return_inverse=True)[1]
    found = _found(values[order], new)
    assert {outlier.rows[0] for outlier in found} == wrong
    assert all(len(outlier.rows) == 1 for outlier in found)


def test_the_limit_has_the_tails_of_student_where_repeats_have() -> None:
    assert outlier_factor(40) == pytest.approx(1.2 * stats.norm.ppf(1.0 - 0.005 / 40), rel=1e-9)
    assert outlier_factor(40, 6.0) == pytest.approx(1.2 * stats.t.ppf(1.0 - 0.005 / 40, 6.0))
    heavy = np.random.default_rng(6).standard_t(3, 75)
    heavy[40] = 1000.0  # a gross error shows nothing of the others' tails
    rest = np.arange(75) != 40
    tails = tail_kurtosis(heavy[rest], TRIPLES[rest])
    assert tails.p_value < 0.05
    assert dof_of_tails(heavy, TRIPLES, centred_within(heavy, TRIPLES)) == tails.student_dof < 30.0
    even = np.random.default_rng(1).standard_normal(75)
    assert tail_kurtosis(even, TRIPLES).p_value > 0.1
    even[40] = 1000.0
    assert dof_of_tails(even, TRIPLES, centred_within(even, TRIPLES)) == math.inf


def test_medians_are_those_of_each_group() -> None:
    rng = np.random.default_rng(0)
    groups = np.concatenate([np.arange(6), rng.integers(0, 6, 30)])
    values = rng.standard_normal(36)
    expected = [np.median(values[groups == g]) for g in range(6)]
    assert median_of_groups(values, groups) == pytest.approx(expected, rel=1e-12)
