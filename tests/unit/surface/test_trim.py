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


@pytest.mark.parametrize("low", [1.0, 3.5, -20.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_domain_of_a_periodic_parameter_is_a_period_about_the_region(
    low: float, axis: int
) -> None:
    """Of 6, about the middle of one that is 1 wide, far along it too; and all of a whole turn."""
    order = [axis, 1 - axis]

    def at(around: float, along: float) -> tuple[float, float]:
        return tuple(np.array([around, along])[order].tolist())

    natural = Domain(at(0.0, -50.0), at(6.0, 50.0), at(6.0, math.inf))
    for width, about in ((1.0, low + 0.5), (6.0, low + 3.0)):
        ring = _box(at(low, 2.0), at(low + width, 12.0))
        domain = Trim([ring], at(6.0, math.inf)).domain(natural)
        assert domain.lower == pytest.approx(at(about - 3.0, 1.5))
        assert domain.upper == pytest.approx(at(about + 3.0, 12.5))
        assert domain.period == at(6.0, math.inf)


def test_a_boundary_without_area_is_refused() -> None:
    line = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [0.0, 0.0]])
    with pytest.raises(PretravelError, match="encloses no area"):
        Trim([line], ENDLESS)


@pytest.mark.parametrize("low", [(0.0, 0.0), (1.0, 2.0)])
@pytest.mark.parametrize("period", [math.inf, 4.0])
def test_a_region_covers_a_surface_whose_whole_area_it_has(
    low: tuple[float, float], period: float
) -> None:
    """4 x 3; a period counts once, however far the surface states it."""
    (a, b), periods = low, (period, math.inf)
    trim = Trim([_box(low, (a + 4.0, b + 3.0))], periods)
    wide = 4.0 if math.isinf(period) else 18.0
    for height, covered in ((3.0, True), (3.01, False)):
        assert trim.covers(Domain(low, (a + wide, b + height), periods)) == covered


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
        ([_box((4.0, 4.0), (6.0, 6.0)), _box((0.0, 0.0), (8.0, 8.0))[::-1]], 60.0),
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


def test_parameters_are_at_most_half_a_period_from_the_middle_of_the_region() -> None:
    """Middle 5.5, period 4: from 3.5 to 7.5."""
    trim = Trim([_box((-8.0, 5.0), (8.0, 6.0))], (math.inf, 4.0))
    v = np.array([3.51, 7.49, 7.51, 3.49, -4.0, 5.2 + 8.0])
    given = np.column_stack([np.full(6, 7.0), v])
    wrapped = trim.wrapped(given)
    assert wrapped[:, 1] == pytest.approx([3.51, 7.49, 3.51, 7.49, 4.0, 5.2], abs=1e-12)
    assert np.all(wrapped[:, 0] == 7.0)
    assert given[5, 1] == 13.2
    assert trim.inside(given).tolist() == [False] * 5 + [True]


def test_parameters_just_below_the_region_are_on_its_seam() -> None:
    """By less than a billionth of the period; others stay where they are."""
    trim = Trim([_box((5.0, 0.0), (6.0, 1.0))], (40.0, math.inf))
    u = 5.0 + np.array([-2e-8, -6e-8, 2e-8, 0.5, 1.5])
    moved = trim.wrapped(np.column_stack([u, np.zeros(5)]))[:, 0]
    assert moved[0] == 5.0
    assert moved[1:] == pytest.approx(u[1:], abs=1e-13)


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
