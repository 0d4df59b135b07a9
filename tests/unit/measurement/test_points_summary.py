"""Summaries of points and touches; those of blocks make the summary of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.measurement.compensation import apply
from pretravel.measurement.points import joined_points
from pretravel.measurement.points_summary import (
    Moments,
    PointsSummary,
    TouchSummary,
    other_nominal_points,
)
from pretravel.surface import parse_surface
from pretravel.touches import Touches
from tests.support.example_maps import mean_map
from tests.unit.measurement.test_points import some_points

UP = np.array([[0.0, 0.0, 1.0]])


def test_moments_of_blocks_are_those_of_all_values() -> None:
    """Against NumPy; the values lie far from zero, where a sum of squares loses its digits."""
    values = 1e3 + np.random.default_rng(3).normal(0.0, 1e-3, 1000)
    joined = Moments.of(values[:1])
    for begin, end in ((1, 17), (17, 600), (600, 1000)):
        joined = joined.joined(Moments.of(values[begin:end]))
    assert (joined.count, joined.low, joined.high) == (1000, values.min(), values.max())
    assert joined.mean == pytest.approx(values.mean(), abs=1e-12)  # the last digits of 1e3
    assert joined.spread == pytest.approx(values.std(), rel=1e-9)


def test_shifted_moments_keep_their_spread() -> None:
    moved = Moments.of(np.array([-3.0, 1.0])).shifted(1.0)
    assert (moved.low, moved.high, moved.mean, moved.spread) == (-2.0, 2.0, 0.0, 2.0)
    assert Moments.of(np.array([-3.0, 1.0])).largest == 3.0


def test_deviations_before_compensation() -> None:
    """A point 5 µm above the nominal, pretravel 10 µm: by the radius alone, 5 µm below it."""
    touches = Touches(
        [[0.0, 0.0, 2.995], [0.0, 0.0, 2.996]], UP[[0, 0]], nominal_points=np.zeros((2, 3))
    )
    made = replace(mean_map(0.010), repeatability=3e-4)
    found = PointsSummary.of(apply(touches, made))
    assert found.pretravel == Moments.of(np.array([0.010, 0.010]))
    assert found.u.mean == pytest.approx(3e-4)
    for moments, low in ((found.deviation, 0.005), (found.before, -0.005)):
        assert moments is not None
        assert (moments.low, moments.high) == pytest.approx((low, low + 0.001), abs=1e-12)
    plain = PointsSummary.of(apply(replace(touches, nominal_points=None), made))
    assert plain.deviation is None
    assert plain.before is not None
    assert (plain.before.low, plain.before.high) == pytest.approx((-0.010, -0.010))


@pytest.mark.parametrize(
    ("x", "z", "apart"), [(0.2, 0.01, ""), (0.2, 1.0, "lie 1 mm from"), (3.0, 0.0, "lie 3 mm from")]
)
def test_nominal_points_that_are_not_on_the_nominal_surface(x: float, z: float, apart: str) -> None:
    """A touch 0.2 mm from its target belongs to it; deviations are from the surface."""
    touches = Touches([[0.0, 0.0, 2.99]], UP, nominal_points=[[x, 0.0, z]])
    points = apply(touches, mean_map(0.010), nominal=parse_surface("plane:polar=0"))
    assert (apart != "") == bool(found := other_nominal_points(touches, points))
    assert all(apart in said for said in found)


def test_joined_summaries_are_those_of_joined_points() -> None:
    one, other = some_points(1, 2), some_points(2, 3)
    found = PointsSummary.of(one).joined(PointsSummary.of(other))
    expected = PointsSummary.of(joined_points([one, other]))
    assert len(found) == len(expected) == 5
    for name in ("pretravel", "u", "deviation", "before"):
        own, all_ = getattr(found, name), getattr(expected, name)
        for part in ("count", "low", "high", "mean", "squares"):
            assert getattr(own, part) == pytest.approx(getattr(all_, part)), (name, part)
    without = PointsSummary.of(some_points(2, 3, deviation=None, uncompensated=None))
    for joined in (found.joined(without), without.joined(found)):
        assert joined.deviation is None
        assert joined.before is None


def test_touches_state_range_obliqueness_middle_and_how_many_are_outside() -> None:
    n = from_angles(np.radians([0.0, 0.0, 120.0, 150.0, 140.0]), np.zeros(5))
    a = -n.copy()
    a[1] = [0.6, 0.0, -0.8]
    touches = Touches(3.0 * n, n, a, feeds=[60.0, 50.0, 80.0, 70.0, 55.0])
    made = mean_map(0.0)
    points = apply(touches, made, extrapolate=True)
    deviation = np.array([0.3, 0.1, 0.9, 0.2, 0.25])
    found = TouchSummary.of(touches, replace(points, deviation=deviation), made)
    assert [each.name for each in found.gross] == ["touch 3"]
    found = replace(found, gross=())
    assert found == TouchSummary(5, pytest.approx(0.8), (50.0, 80.0), pytest.approx(0.25), 3)
    bare = TouchSummary.of(replace(touches, feeds=None), points, made)
    assert (bare.feeds, bare.middle) == (None, None)


@pytest.mark.parametrize(
    ("other", "feeds", "middle"),
    [
        (TouchSummary(3, 0.8, (50.0, 70.0), 0.1, 2), (50.0, 80.0), 0.26),
        (TouchSummary(3, 0.8, (70.0, 90.0), None, 2), (60.0, 90.0), None),
        (TouchSummary(3, 0.8, None, 0.1, 2), None, 0.26),
    ],
)
@pytest.mark.parametrize("first", [False, True])
def test_what_both_blocks_of_touches_state_is_joined(
    other: TouchSummary, feeds: object, middle: float | None, first: bool
) -> None:
    """The middle: two touches with 0.5 and three with 0.1."""
    one = TouchSummary(2, 0.9, (60.0, 80.0), 0.5, 1)
    joined = other.joined(one) if first else one.joined(other)
    expected = TouchSummary(5, 0.8, feeds, None, 3)  # type: ignore[arg-type]
    assert replace(joined, middle=None) == expected
    assert joined.middle == (middle if middle is None else pytest.approx(middle))
