"""A touch that disagrees with the others and the map: limits by hand, predictions by kriging."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation, Scatter
from pretravel.qualification.change_tests import TouchesAndMap
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.touch_noise import TouchNoise
from pretravel.qualification.verification import _left_out, _robust_scatter, gross_touch
from pretravel.touches import Touches

NOISE = 3e-4  # mm


def _compared(values: FloatArray, groups: IntArray, step: float = 0.0) -> TouchesAndMap:
    """Touches beside a map of zero that is certain; columns of centre and size alone."""
    count = np.bincount(groups)
    normals = fibonacci_cap(len(count), 1.5)
    positions = normals[groups] * (15.5 - values)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    same = np.full(len(count), NOISE**2)
    scatter = Scatter(NOISE, 50.0)
    noise = TouchNoise(scatter, NOISE, same, same, 0.0 * same, count.astype(float), 0.0)
    mean = np.bincount(groups, values) / count
    return TouchesAndMap(
        seen, noise, scatter, step, 0.0 * same, mean,
        np.column_stack([normals, np.ones(len(count))]), np.zeros((len(count),) * 2),
        np.diag(same / count), scatter, math.nan, math.nan, math.nan,
    )  # fmt: skip


def _gross(values: FloatArray, groups: IntArray, step: float = 0.0) -> Outlier | None:
    compared = _compared(values, groups, step)
    positions = np.concatenate([np.full((3, 3), 1.0), compared.observation.positions])
    normals = np.concatenate([np.eye(3), compared.observation.directions])
    return gross_touch(Touches(positions, normals), compared, np.arange(3, 3 + len(values)))


def _limit(count: int) -> float:
    """One and a half times what one of a thousand sets of normal errors exceeds, by Bonferroni."""
    return 1.5 * float(stats.norm.ppf(1.0 - 0.0005 / count)) * NOISE


TRIPLES = np.repeat(np.arange(12), 3)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("step", [0.0, 2e-3])
def test_a_touch_of_three_is_compared_with_their_median(sign: float, step: float) -> None:
    limit = max(_limit(36), 1.5 * step)
    for factor, named in ((0.999, False), (1.001, True)):
        values = np.full(36, 0.008)
        values[16] += sign * factor * limit
        found = _gross(values, TRIPLES, step)
        assert (found is not None) == named
    assert found is not None
    assert found.rows == (19,)
    assert found.distance == pytest.approx(1.001 * sign * limit, rel=1e-9)
    assert found.limit == pytest.approx(limit, rel=1e-9)
    assert found.message.startswith("touch 20 at polar ")
    assert (
        f"triggered {1001.0 * limit:.1f} µm {'later' if sign > 0.0 else 'earlier'} than the median "
        "of the 3 touches of its direction; "
        f"noise explains {1e3 * limit:.1f} µm" in found.message
    )


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_of_a_pair_the_one_farther_from_the_map_is_named(sign: float) -> None:
    """The difference of two scatters by the root of two times more."""
    limit = _limit(24)
    for factor, named in ((0.999, False), (1.001, True)):
        values = np.zeros(24)
        values[7] = sign * factor * math.sqrt(2.0) * limit
        found = _gross(values, np.repeat(np.arange(12), 2))
        assert (found is not None) == named
    assert found is not None
    assert found.rows == (10,)
    assert found.distance == pytest.approx(1.001 * sign * math.sqrt(2.0) * limit, rel=1e-9)
    assert found.limit == pytest.approx(limit, rel=1e-9)
    assert "than the other touch of its direction" in found.message


def test_a_single_touch_is_compared_with_the_map() -> None:
    """The others determine centre and size: the touch differs with its own scatter and theirs."""
    groups = np.arange(12)
    design = _compared(np.zeros(12), groups).design
    others = np.delete(design, 5, axis=0)
    own = design[5] @ np.linalg.inv(others.T @ others) @ design[5]
    limit = _limit(12) * math.sqrt(1.0 + own)
    for factor, named in ((0.999, False), (1.001, True)):
        values = np.zeros(12)
        values[5] = factor * limit
        found = _gross(values, groups)
        assert (found is not None) == named
    assert found is not None
    assert found.rows == (8,)
    assert found.distance == pytest.approx(1.001 * limit, rel=1e-9)
    assert found.limit == pytest.approx(limit, rel=1e-9)
    assert "than the map; noise" in found.message
    # One and a half steps excuse it.
    assert _gross(values, groups, step=1.002 * limit / 1.5) is None
    assert _gross(values, groups, step=limit / 1.5) is not None


@pytest.mark.parametrize(("directions", "named"), [(6, False), (7, True)])
def test_three_directions_remain_beyond_those_of_the_columns(directions: int, named: bool) -> None:
    """Centre and size take four."""
    values = np.zeros(directions)
    values[2] = 0.1
    found = _gross(values, np.arange(directions))
    assert (found is not None) == named


def test_a_direction_that_alone_shows_a_change_is_not_predicted() -> None:
    compared = _compared(np.zeros(12), np.arange(12))
    alone = np.zeros((12, 1))
    alone[3] = 1.0
    object.__setattr__(compared, "design", np.hstack([compared.design, alone]))
    u = _left_out(compared, np.arange(12.0), NOISE)[1]
    assert np.isinf(u[3])
    assert np.isfinite(np.delete(u, 3)).all()


def test_predictions_are_those_of_the_other_directions() -> None:
    """Generalised least squares on the others, and what their residuals tell of this one."""
    rng = np.random.default_rng(4)
    groups = np.repeat(np.arange(10), [1, 2, 3, 1, 1, 2, 1, 1, 4, 1])
    values = 1e-3 * rng.standard_normal(len(groups))
    compared = _compared(values, groups)
    root = NOISE * rng.standard_normal((10, 10))
    of_map = root @ root.T
    covariance = of_map + compared.covariance
    object.__setattr__(compared, "covariance", covariance)
    object.__setattr__(compared, "value", 1e-3 * rng.standard_normal(10))
    differences = compared.differences - compared.value
    object.__setattr__(compared, "differences", differences)
    apart, u = _left_out(compared, values, 2.0 * NOISE)
    noise = NOISE**2 / np.bincount(groups)
    for g in range(10):
        rest = np.arange(10) != g
        inverse = np.linalg.inv(covariance[np.ix_(rest, rest)])
        design, own = compared.design[rest], compared.design[g]
        information = np.linalg.inv(design.T @ inverse @ design)
        fitted = information @ design.T @ inverse @ differences[rest]
        shared = covariance[g, rest] @ inverse
        expected = own @ fitted + shared @ (differences[rest] - design @ fitted)
        lever = own - shared @ design
        variance = covariance[g, g] - shared @ covariance[rest, g] + lever @ information @ lever
        mine = groups == g
        assert apart[mine] == pytest.approx(values[mine] - compared.value[g] - expected, abs=1e-9)
        single = math.sqrt(variance - noise[g] + 4.0 * NOISE**2)
        assert u[mine] == pytest.approx(np.full(mine.sum(), single), rel=1e-6)


@pytest.mark.parametrize("known", [0.1, 5.0])
def test_scatter_of_a_touch_is_that_of_the_median_direction(known: float) -> None:
    """Sums of squares about the means of the directions, by hand: 0.5, 2, 8, 50 and 5; of 1, 2, 2,
    1 and 3 degrees of freedom. At least that of the map."""
    values = [9.0, 1.0, 2.0, 1.0, 2.0, 3.0, -2.0, 0.0, 2.0, 5.0, 15.0, 0.0, 1.0, 2.0, 3.0]
    groups = np.repeat([0, 1, 2, 3, 4, 5], [1, 2, 3, 3, 2, 4])
    compared: Any = SimpleNamespace(scatter_of_map=Scatter(known, 20.0))
    medians = sorted(stats.chi2.median(dof) for dof in (1, 2, 2, 1, 3))
    expected = max(math.sqrt(5.0 / medians[2]), known)
    found = _robust_scatter(np.array(values), groups, compared)
    assert found == pytest.approx(expected, rel=1e-9)
    assert _robust_scatter(np.arange(4.0), np.arange(4), compared) == known
