"""Regions of parameters that faces cover."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.errors import PretravelError
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
