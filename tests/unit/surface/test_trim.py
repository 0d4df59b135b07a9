"""Regions of parameters that faces cover."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.surface.cad.trim import Trim
from pretravel.surface.local_geometry import Domain

ENDLESS = (math.inf, math.inf)


def _box(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    return np.array([low, (high[0], low[1]), high, (low[0], high[1]), low])


def test_the_domain_is_the_box_with_a_margin_within_the_surface() -> None:
    """A twentieth on every side, and not beyond where the surface ends."""
    trim = Trim([_box((2.0, -7.0), (6.0, 3.0))], ENDLESS)
    assert (trim.lower, trim.upper, trim.area) == ((2.0, -7.0), (6.0, 3.0), 40.0)
    wide = trim.domain(Domain((-100.0, -100.0), (100.0, 100.0)))
    assert wide.lower == pytest.approx((1.8, -7.5))
    assert wide.upper == pytest.approx((6.2, 3.5))
    narrow = trim.domain(Domain((1.9, -7.2), (6.1, 3.1)))
    assert narrow.lower == pytest.approx((1.9, -7.2))
    assert narrow.upper == pytest.approx((6.1, 3.1))
    assert narrow.period == ENDLESS


def test_the_domain_of_a_periodic_parameter_is_a_whole_period_about_the_region() -> None:
    natural = Domain((0.0, -50.0), (2.0 * math.pi, 50.0), (2.0 * math.pi, math.inf))
    part = Trim([_box((1.0, 2.0), (2.0, 12.0))], (2.0 * math.pi, math.inf)).domain(natural)
    assert part.lower == pytest.approx((1.5 - math.pi, 1.5))
    assert part.upper == pytest.approx((1.5 + math.pi, 12.5))
    assert part.period == (2.0 * math.pi, math.inf)
    turn = _box((1.0, 2.0), (1.0 + 2.0 * math.pi, 12.0))
    whole = Trim([turn], (2.0 * math.pi, math.inf)).domain(natural)
    assert whole.lower[0] == pytest.approx(1.0)
    assert whole.upper[0] == pytest.approx(1.0 + 2.0 * math.pi)


def test_parameters_are_moved_by_whole_periods_to_the_region() -> None:
    trim = Trim([_box((1.0, 2.0), (2.0, 12.0))], (2.0 * math.pi, math.inf))
    given = np.array([[1.5, 3.0], [1.5 + 4.0 * math.pi, 3.0], [1.5 - 2.0 * math.pi, 99.0]])
    assert trim.wrapped(given) == pytest.approx(np.array([[1.5, 3.0], [1.5, 3.0], [1.5, 99.0]]))
    assert trim.inside(given).tolist() == [True, True, False]
    assert given[1, 0] == 1.5 + 4.0 * math.pi


def test_holes_and_rings_that_cross_themselves() -> None:
    outer, hole = _box((0.0, 0.0), (10.0, 10.0)), _box((4.0, 4.0), (6.0, 6.0))
    for rings in ([outer, hole], [hole, outer], [outer[::-1], hole]):
        trim = Trim(rings, ENDLESS)
        assert trim.area == pytest.approx(96.0)
        assert trim.inside(np.array([[5.0, 5.0], [2.0, 5.0], [11.0, 5.0]])).tolist() == [
            False, True, False,
        ]  # fmt: skip
    bow = np.array([[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [0.0, 0.0]])
    crossed = Trim([bow], ENDLESS)
    assert crossed.area == pytest.approx(2.0)
    # Its sides meet in the middle: left and right are inside, above and below are not.
    places = np.array([[0.3, 1.0], [1.7, 1.0], [1.0, 1.7], [1.0, 0.3]])
    assert crossed.inside(places).tolist() == [True, True, False, False]


def test_a_boundary_without_area_is_refused() -> None:
    line = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 0.0]])
    with pytest.raises(PretravelError, match="encloses no area"):
        Trim([line], ENDLESS)


def test_a_region_covers_a_surface_whose_whole_area_it_has() -> None:
    trim = Trim([_box((0.0, 0.0), (4.0, 3.0))], ENDLESS)
    assert trim.covers(Domain((0.0, 0.0), (4.0, 3.0)))
    assert not trim.covers(Domain((0.0, 0.0), (4.0, 3.01)))
    turn = Trim([_box((0.0, 0.0), (2.0 * math.pi, 3.0))], (2.0 * math.pi, math.inf))
    endless = (2.0 * math.pi, math.inf)
    assert turn.covers(Domain((-9.0, 0.0), (9.0, 3.0), endless))
    assert not turn.covers(Domain((-9.0, 0.0), (9.0, 3.1), endless))


@pytest.mark.parametrize(("lengths", "inner"), [((1.0, 1.0), 2.0), ((0.5, 3.0), 3.0)])
def test_the_middle_has_the_largest_distance_from_the_rings(
    lengths: tuple[float, float], inner: float
) -> None:
    """Of a rectangle of 12 x 4: half its shorter side, in lengths on the surface."""
    trim = Trim([_box((3.0, 5.0), (15.0, 9.0))], ENDLESS)
    u, v = trim.middle(np.array(lengths))
    sides = [u - 3.0, 15.0 - u, v - 5.0, 9.0 - v]
    free = min(np.array(sides) * np.repeat(lengths, 2))
    # The search ends within a fiftieth of the width.
    assert free == pytest.approx(inner, abs=0.03 * 2.0 * inner)


def _odd(rings: list[np.ndarray], points: np.ndarray) -> np.ndarray:
    """Which points an odd number of rings surrounds: crossings of a ray along +u, counted."""
    crossings = np.zeros(len(points), dtype=int)
    for ring in rings:
        for (u, v), (next_u, next_v) in pairwise(ring):
            passes = (v > points[:, 1]) != (next_v > points[:, 1])
            at = u + (points[:, 1] - v) / (next_v - v if next_v != v else 1.0) * (next_u - u)
            crossings += passes & (at > points[:, 0])
    return crossings % 2 == 1


BOW = np.array([[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0], [0.0, 0.0]])


@pytest.mark.parametrize(
    ("rings", "area"),
    [
        ([_box((0.0, 0.0), (0.5, 0.5))], 0.25),
        ([_box((0.0, 0.0), (3.0, 2.0)), BOW + np.array([5.0, 1.0])], 8.0),
        ([_box((0.0, 0.0), (7.0, 7.0)), BOW + np.array([2.0, 3.0])], 47.0),
        # Rings that cross each other: a hole across an edge, two overlapping squares.
        ([_box((0.0, 0.0), (7.0, 6.0)), _box((6.0, 2.0), (8.0, 3.0))], 42.0),
        ([_box((0.0, 0.0), (2.0, 2.0)), _box((1.0, 1.0), (3.0, 3.0))], 6.0),
        ([_box((0.0, 0.0), (2.0, 2.0)), _box((1.0, 0.0), (3.0, 2.0))], 4.0),
    ],
)
def test_a_point_is_inside_where_an_odd_number_of_rings_surrounds_it(
    rings: list[np.ndarray], area: float
) -> None:
    trim = Trim(rings, ENDLESS)
    assert trim.area == pytest.approx(area, rel=1e-12)
    points = np.random.default_rng(7).uniform(-1.0, 9.0, (2000, 2))
    assert np.array_equal(trim.inside(points), _odd(rings, points))


@pytest.mark.parametrize("high", [(31.0, -3.0), (12.0, 17.0)])
def test_points_beyond_an_edge_by_a_billionth_of_the_size_count(high: tuple[float, float]) -> None:
    """Of the longer side, whatever the place is; at a corner along both axes together."""
    low = np.array([9.0, -5.0])
    trim = Trim([_box((9.0, -5.0), high)], ENDLESS)
    share = 1e-9 * float(np.max(high - low))
    inwards = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    start = np.array([[9.0, -4.0], [10.0, -5.0], [9.0, -5.0]])
    assert trim.inside(start - 0.9 * share * inwards).all()
    assert not trim.inside(start - 1.1 * share * inwards).any()
    end = np.array([[high[0], -4.0], [10.0, high[1]], high])
    assert trim.inside(end + 0.9 * share * inwards).all()
    assert not trim.inside(end + 1.1 * share * inwards).any()


def test_a_region_away_from_zero_covers_the_surface_with_its_sides() -> None:
    trim = Trim([_box((1.0, 2.0), (5.0, 5.0))], ENDLESS)
    assert trim.covers(Domain((1.0, 2.0), (5.0, 5.0)))
    assert not trim.covers(Domain((1.0, 2.0), (5.0, 5.01)))


def test_parameters_are_at_most_half_a_period_from_the_middle_of_the_region() -> None:
    """Middle 5.5, period 4: from 3.5 to 7.5."""
    trim = Trim([_box((-8.0, 5.0), (8.0, 6.0))], (math.inf, 4.0))
    v = np.array([3.51, 7.49, 7.51, 3.49, -4.0])
    wrapped = trim.wrapped(np.column_stack([np.full(5, 77.0), v]))
    assert wrapped[:, 1] == pytest.approx([3.51, 7.49, 3.51, 7.49, 4.0], abs=1e-12)
    assert np.all(wrapped[:, 0] == 77.0)


def test_parameters_just_below_the_region_are_on_its_seam() -> None:
    """By less than a billionth of the period; others stay where they are."""
    trim = Trim([_box((5.0, 0.0), (6.0, 1.0))], (40.0, math.inf))
    u = 5.0 + np.array([-2e-8, -6e-8, 2e-8, 0.5, 1.5])
    moved = trim.wrapped(np.column_stack([u, np.zeros(5)]))[:, 0]
    assert moved[0] == 5.0
    assert moved[1:] == pytest.approx(u[1:], abs=1e-13)


def test_the_domain_of_a_region_far_along_a_period_is_about_its_middle() -> None:
    natural = Domain((-50.0, 0.0), (50.0, 6.0), (math.inf, 6.0))
    for low in (3.5, -20.0):
        trim = Trim([_box((2.0, low), (12.0, low + 1.0))], (math.inf, 6.0))
        domain = trim.domain(natural)
        assert domain.lower == pytest.approx((1.5, low - 2.5))
        assert domain.upper == pytest.approx((12.5, low + 3.5))
        assert domain.period == (math.inf, 6.0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_middle_of_an_angle_is_in_its_corner(scale: float) -> None:
    """Two arms 4 wide: the largest circle touches both outer sides and the inner corner, so that
    r √2 + r = 4 √2 along the diagonal."""
    angle = np.array([[0, 0], [20, 0], [20, 4], [4, 4], [4, 20], [0, 20], [0, 0]], dtype=float)
    at = Trim([angle / [2.0, 0.5]], ENDLESS).middle(scale * np.array([2.0, 0.5]))
    u, v = at * [2.0, 0.5]
    free = min(u, v, math.hypot(4.0 - u, 4.0 - v))
    # The shape and the search are each within a fiftieth of the width, 144 / (20 √2).
    assert free == pytest.approx(4.0 * math.sqrt(2.0) / (1.0 + math.sqrt(2.0)), abs=0.1)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("radius", [0.2, 1.0, 5.0])
def test_the_middle_of_a_tall_band_around_an_axis_is_at_half_its_height(
    axis: int, radius: float
) -> None:
    """Wherever its seam is: the seam is no edge. A band that is not closed has its edges there."""
    turn, order = 2.0 * math.pi, [axis, 1 - axis]
    lengths = np.array([radius, 1.0])[order]
    height = 400.0 * radius
    for share, closed in ((1.0, True), (0.9, False), (0.2, False)):
        ring = _box((1.0, 2.0), (1.0 + share * turn, 2.0 + height))[:, order]
        given = lengths.copy()
        periods = (turn, math.inf) if axis == 0 else (math.inf, turn)
        middle = Trim([ring], periods).middle(given)
        assert np.array_equal(given, lengths)
        around, along = middle[order]
        if closed:
            assert along == pytest.approx(2.0 + 0.5 * height, abs=0.1 * turn * radius)
        else:
            assert around == pytest.approx(1.0 + 0.5 * share * turn, abs=0.03 * share * turn)
