"""Observations: normals and values, repeats, draws of directions, places of functions."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.units import DEGREE
from pretravel.maps.observation import Observation, Scatter


def _observed(values: FloatArray, n: FloatArray, groups: IntArray | None = None) -> Observation:
    """Pretravel `values` on a ball of 12.5 mm with a tip of 3 mm, about a centre."""
    groups = np.arange(len(n)) if groups is None else groups
    center = np.array([1.0, 2.0, 3.0])
    positions = center + n[groups] * (15.5 - values)[:, None]
    return Observation(positions, groups, center, 12.5, 3.0, ring=False)


def test_of_a_ring() -> None:
    """Inside a ring of 20 mm: contact normals point to the centre."""
    azimuth = np.arange(24) * 15.0 * DEGREE
    normals = -from_angles(0.5 * np.pi, azimuth)
    values = 0.011 - 0.003 * np.cos(3.0 * azimuth)
    positions = -normals * (7.0 + values)[:, None] + [1.0, 2.0, 0.7]
    seen = Observation(positions, np.arange(24), np.array([1.0, 2.0, 0.0]), 10.0, 3.0, ring=True)
    assert seen.axes == 2
    assert seen.directions == pytest.approx(normals, abs=1e-12)
    assert seen.values == pytest.approx(values, abs=1e-12)
    assert seen.free_terms.tolist() == [[0, 0], [1, 1], [1, -1]]
    design = np.column_stack([np.ones(24), normals[:, :2]])
    assert seen.free_design == pytest.approx(design, abs=1e-12)
    assert seen.to_sphere == pytest.approx(np.linalg.pinv(design), abs=1e-12)


def test_of_a_sphere() -> None:
    n = fibonacci_cap(9, 1.5)
    seen = _observed(np.full(9, 0.010), n)
    assert (seen.axes, seen.direction_count) == (3, 9)
    assert (seen.tip_known, seen.u_constant) == (True, 0.0)
    assert seen.directions == pytest.approx(n, abs=1e-12)
    assert seen.values == pytest.approx(np.full(9, 0.010), abs=1e-12)
    assert seen.free_terms.tolist() == [[0, 0], [1, 1], [1, -1], [1, 0]]
    assert seen.free_design == pytest.approx(np.column_stack([np.ones(9), n]))
    part = seen.take(np.arange(9) % 3 == 1)
    assert part.groups.tolist() == [0, 1, 2]
    assert np.array_equal(part.positions, seen.positions[[1, 4, 7]])


@pytest.mark.parametrize(
    ("groups", "means", "squares", "dof"),
    [
        (range(7), [0.0, 1.0, 5.0, 3.0, 0.0, 2.0, 0.0], 0.0, 0.0),
        # Pairs and a triple: squares about their means over 1 + 1 + 2 degrees of freedom.
        ([0, 0, 1, 1, 2, 2, 2], [0.5, 4.0, 2.0 / 3.0], 0.5 + 2.0 + 8.0 / 3.0, 4.0),
    ],
)
def test_scatter_is_pooled_over_the_directions(
    groups: list[int], means: list[float], squares: float, dof: float
) -> None:
    values = 0.01 + 1e-3 * np.array([0.0, 1.0, 5.0, 3.0, 0.0, 2.0, 0.0])
    seen = _observed(values, fibonacci_cap(len(means), 1.2), np.array(groups))
    assert seen.group_means == pytest.approx(0.01 + 1e-3 * np.array(means), rel=1e-9)
    deviation = 1e-3 * np.sqrt(squares / max(dof, 1.0))
    assert seen.repeats == Scatter(pytest.approx(deviation, rel=1e-9), dof)


def test_the_mean_normal_of_repeats() -> None:
    n = unit([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
    seen = Observation(15.49 * n, np.array([0, 0, 1]), np.zeros(3), 12.5, 3.0, ring=False)
    expected = unit([[1.0, 1.0, 2.0], [0.0, 0.0, 1.0]])
    assert seen.group_directions == pytest.approx(expected)


def test_drawn_directions_keep_all_their_repeats() -> None:
    """All of up to twice as many, else as many as are asked for."""
    groups = np.repeat(np.arange(40), 3)
    values = 0.01 + 1e-4 * np.arange(120.0)
    seen = _observed(values, fibonacci_cap(40, 1.2), groups)
    assert seen.drawn(20) is seen
    part = seen.drawn(19)
    assert np.bincount(part.groups).tolist() == [3] * 19
    # Each touch is one of the given ones, with the pretravel of that.
    rows = [int(np.argmin(np.abs(values - value))) for value in part.values]
    assert part.values == pytest.approx(values[rows], abs=1e-12)
    assert len(set(rows)) == 57
    assert all(len(set(groups[np.array(rows)[part.groups == g]])) == 1 for g in range(19))
    assert np.array_equal(seen.drawn(19).positions, part.positions)


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
