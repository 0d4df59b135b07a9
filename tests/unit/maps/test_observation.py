"""Observations: repeats, draws of directions, and places where functions are evaluated."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.spherical_harmonics import DirectionMeans, real_spherical_harmonics


def _observed(values: np.ndarray, groups: np.ndarray, directions: np.ndarray) -> Observation:
    """Pretravel `values` on a ball of 12.5 mm with a tip of 3 mm, about the origin."""
    positions = directions[groups] * (15.5 - values)[:, None]
    return Observation(positions, groups, np.zeros(3), 12.5, 3.0, ring=False)


def test_touches_without_repeats_have_no_scatter() -> None:
    n = fibonacci_cap(7, 1.2)
    seen = _observed(0.01 + 0.001 * np.arange(7.0), np.arange(7), n)
    assert seen.repeats == Scatter(0.0, 0.0)


def test_scatter_is_pooled_over_the_directions() -> None:
    """Pairs and a triple: squares about their means 0.5, 2 and 8 / 3 over 1 + 1 + 2 degrees."""
    n = fibonacci_cap(3, 1.2)
    values = 0.01 + 1e-3 * np.array([0.0, 1.0, 5.0, 3.0, 0.0, 2.0, 0.0])
    found = _observed(values, np.array([0, 0, 1, 1, 2, 2, 2]), n).repeats
    assert found.dof == 4.0
    assert found.deviation == pytest.approx(1e-3 * np.sqrt((0.5 + 2.0 + 8.0 / 3.0) / 4.0), rel=1e-9)


def test_group_means_are_those_of_the_repeats() -> None:
    n = fibonacci_cap(2, 1.2)
    seen = _observed(np.array([0.01, 0.02, 0.03]), np.array([0, 0, 1]), n)
    assert seen.group_means == pytest.approx([0.015, 0.03], rel=1e-9)


def test_drawn_directions_keep_all_their_repeats() -> None:
    n = fibonacci_cap(40, 1.2)
    groups = np.repeat(np.arange(40), 3)
    values = 0.01 + 1e-4 * np.arange(120.0)
    seen = _observed(values, groups, n)
    assert seen.drawn(20) is seen
    part = seen.drawn(15)
    assert part.direction_count == 15
    assert np.bincount(part.groups).tolist() == [3] * 15
    # Each touch is one of the given ones, with the pretravel of that.
    rows = [int(np.argmin(np.abs(values - value))) for value in part.values]
    assert part.values == pytest.approx(values[rows], abs=1e-12)
    assert len(set(rows)) == 45
    assert all(len(set(groups[np.array(rows)[part.groups == g]])) == 1 for g in range(15))
    assert np.array_equal(seen.drawn(15).positions, part.positions)


@pytest.mark.parametrize(("off", "count"), [(0.0, 3), (2e-3, 5010)])
def test_many_touches_of_a_direction_share_its_place(off: float, count: int) -> None:
    """Unless their normals differ by more than 0.001 along an axis."""
    n = fibonacci_cap(3, 1.2)
    groups = np.repeat(np.arange(3), 1670)
    directions = n[groups].copy()
    directions[7, 0] += off
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = Observation(15.49 * directions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    places = seen.places
    assert len(places.directions) == count
    of_touches = places.directions[places.of_touches]
    assert np.abs(of_touches - seen.directions).max() < 1e-3


@pytest.mark.parametrize("repeats", [[1], [3, 1, 2], [5000, 2], [2, 9000], [4096, 4097]])
def test_means_over_the_touches_of_a_direction(repeats: list[int]) -> None:
    """More touches of one direction than are evaluated together, with normals of their own."""
    generator = np.random.default_rng(3)
    groups = np.repeat(np.arange(len(repeats)), repeats)
    directions = fibonacci_cap(len(repeats), 1.2)[groups] + 0.2 * generator.random((len(groups), 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = Observation(15.49 * directions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    terms = np.array([[0, 0], [2, 1], [3, -3]])
    rows = real_spherical_harmonics(directions, terms)
    expected = np.stack([rows[groups == g].mean(axis=0) for g in range(len(repeats))])
    assert DirectionMeans(seen.places, terms).rows() == pytest.approx(expected, abs=1e-12)
