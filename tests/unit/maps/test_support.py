"""The nearest point of a support, for directions outside it."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.directions import fibonacci_cap, sphere_pattern_25, unit
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.observation import Observation
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.map_warnings import map_warnings, some_directions
from pretravel.uncertainty.covariance import Covariance


def _nearest_by_trial(support: DirectionSupport, direction: np.ndarray) -> float:
    """Largest cosine with points of all edges of the mesh, 2000 on each."""
    mesh = support._mesh
    share = np.linspace(0.0, 1.0, 2000)[:, None]
    best = -1.0
    for first, second in mesh.edges:
        points = (1.0 - share) * support.nodes[first] + share * support.nodes[second]
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        best = max(best, float((points @ direction).max()))
    return best


@pytest.mark.parametrize("uneven", [False, True])
def test_beyond_the_support_the_nearest_of_its_edges_counts(uneven: bool) -> None:
    """Also where one edge is so long that its middle is farther than those of many short ones."""
    beside = np.array([[0.12, -0.01, 1.0], [0.2, -0.02, 1.0], [0.3, -0.03, 1.0]])
    turn = np.linspace(0.0, 2.0 * np.pi, 121)[:-1]
    if uneven:
        # A small circle and a point far from it: beside the circle, the long tangent is nearest.
        x, y = 0.1 * np.cos(turn), 0.1 + 0.1 * np.sin(turn)
        nodes = unit(np.column_stack([[*x, 1.0], [*y, 0.0], np.ones(121)]))
    else:
        nodes = unit(np.column_stack([np.cos(turn), np.sin(turn), np.ones(120)]))
    support = DirectionSupport(nodes)
    assert len(support._mesh.edges) > 64  # fewer are all compared
    outside = np.concatenate([fibonacci_cap(60, 1.4), unit(beside)])
    outside = outside[~support.supports(outside, 1e-6)]
    assert len(outside) > 10
    nodes_of, weights, distance = support._nearest_on_edges(outside)
    for row, direction in enumerate(outside):
        best = _nearest_by_trial(support, direction)
        # 2000 points on an edge of up to 1.5 rad are apart by less than a milliradian.
        assert np.cos(distance[row]) == pytest.approx(best, abs=2e-6)
        assert np.all(weights[row] >= -1e-12)
        found = weights[row] @ support.nodes[nodes_of[row]]
        # Weights are linear in the arc, and the chord is not: 1e-4 on a long edge.
        assert found @ direction / np.linalg.norm(found) == pytest.approx(best, abs=1e-4)


def test_very_many_directions_are_drawn_in_their_order() -> None:
    few, many = fibonacci_cap(5000, 1.5), fibonacci_cap(5200, 1.5)
    assert some_directions(few) is few
    drawn = some_directions(many)
    assert drawn.shape == (5000, 3)
    rows = [int(np.flatnonzero((many == one).all(axis=1))[0]) for one in drawn[::250]]
    assert rows == sorted(rows)
    assert len(np.unique(drawn, axis=0)) == 5000
    # From everywhere, not the first ones.
    assert (drawn == many[-200:, None]).all(axis=2).any(axis=1).mean() > 0.8
    assert np.array_equal(some_directions(many), drawn)


def _warned(value: float, u: float, *, tip_known: bool = True) -> list[str]:
    """Of a map of one value, touched all over the upper half with a tip of 6 mm."""
    n = sphere_pattern_25()
    made = PretravelMap(
        HarmonicBasis(np.array([[0, 0]])), np.array([value]), Covariance.independent([u**2]),
        DirectionSupport(n), tip_radius=3.0,
    )  # fmt: skip
    seen = Observation(
        n * (15.5 - value), np.arange(25), np.zeros(3), 12.5, 3.0, ring=False, tip_known=tip_known
    )
    return map_warnings(made, seen)


def test_pretravel_that_no_probe_has_is_told() -> None:
    """Below -2 um by three u, which are 0.1 um here; above 0.1 mm."""
    assert not any("before contact" in said for said in _warned(-2.2e-3, 1e-4))
    assert any("no probe triggers before contact" in said for said in _warned(-2.4e-3, 1e-4))
    assert not any("before contact" in said for said in _warned(-2.4e-3, 2e-4))
    assert not any("before contact" in said for said in _warned(0.0, 1e-4))
    assert not any("before contact" in said for said in _warned(-2.4e-3, 1e-4, tip_known=False))
    assert not any("rises to" in said for said in _warned(0.099, 1e-4))
    assert any("pretravel rises to 101.0 µm" in said for said in _warned(0.101, 1e-4))
