"""The support of a map: which directions it holds, and the nearest point of it for others."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import (
    fibonacci_cap,
    from_angles,
    polar_angle,
    sphere_pattern_25,
    unit,
)
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.maps import support as module
from pretravel.maps.support import DirectionSupport, some_directions


def _plane(n: FloatArray) -> FloatArray:
    """Stereographic from -z: slope of the line from there, in the plane z = 0."""
    return np.asarray(n[:, :2] / (1.0 + n[:, 2:]))


def _far(nodes: FloatArray, edge: tuple[int, int], d: FloatArray) -> tuple[float, float]:
    """Angle from a direction to an arc, and the share of the arc there, by a projection."""
    a, b = nodes[list(edge)]
    span = np.stack([a, b], axis=1)
    share = np.linalg.lstsq(span, d, rcond=None)[0]
    if not share.min() >= 0.0:
        ends = [float(np.arccos(np.clip(end @ d, -1.0, 1.0))) for end in (a, b)]
        return min(ends), float(ends[1] < ends[0])
    foot = span @ share
    left = float(np.arctan2(np.linalg.norm(d - foot), np.linalg.norm(foot)))
    foot /= np.linalg.norm(foot)
    way = np.arctan2(np.linalg.norm(np.cross(a, foot)), a @ foot)
    return left, float(way / np.arccos(a @ b))


def _supported(nodes: FloatArray) -> tuple[list[FloatArray], set[tuple[int, int]]]:
    """Triangles with a circle of up to 60°, one by one; all edges that bound the support."""
    plane = _plane(nodes)
    mesh = Delaunay(plane)
    held, edges, inner = [], [], []
    for triangle in mesh.simplices:
        # The centre of the circle has the same product with all three.
        centre = unit(np.linalg.solve(nodes[triangle], np.ones(3))[None])[0]
        own = [(int(a), int(b)) for a, b in np.sort(triangle)[[[0, 1], [1, 2], [0, 2]]]]
        edges += own
        if centre @ nodes[triangle[0]] >= 0.5:
            held.append(triangle)
            inner += own
    kept = {each for each in inner if inner.count(each) == 1}
    for a, b in set(edges) - set(inner):
        middle, half = 0.5 * (plane[a] + plane[b]), 0.5 * np.linalg.norm(plane[a] - plane[b])
        others = np.delete(np.linalg.norm(plane - middle, axis=1), [a, b])
        if others.min() >= half and nodes[a] @ nodes[b] >= np.cos(np.radians(120.0)):
            kept.add((a, b))
    return held, kept


def _is_in(corners: FloatArray, point: FloatArray) -> bool:
    """Shares of three corners, in the plane or of the sphere, that are not negative."""
    rows = corners.T if len(point) == 3 else np.vstack([corners.T, np.ones(3)])
    right = point if len(point) == 3 else np.append(point, 1.0)
    return bool(np.linalg.solve(rows, right).min() >= -1e-12)


def _sparse(seed: int) -> FloatArray:
    """A patch of close nodes beside the pole, and some that are far apart."""
    rng = np.random.default_rng(seed)
    polar = np.concatenate([rng.uniform(15.0, 60.0, 12), rng.uniform(60.0, 125.0, 5)])
    azimuth = np.concatenate([rng.uniform(20.0, 130.0, 12), rng.uniform(0.0, 360.0, 5)])
    return from_angles(np.radians(polar), np.radians(azimuth))


@pytest.mark.parametrize(
    "nodes",
    [
        _sparse(1),
        _sparse(4)[::-1],
        np.roll(_sparse(6), 5, axis=0),
        sphere_pattern_25()[3:19],
    ],
)
def test_the_support_is_that_of_all_triangles_one_by_one(nodes: FloatArray) -> None:
    """In a triangle, flat or on the sphere, the distance is zero; else it is that to the nearest
    of the edges without a second triangle. Directions from everywhere."""
    support = DirectionSupport(nodes)
    held, edges = _supported(nodes)
    d = fibonacci_cap(150, 2.9)
    found, weights, distance = support.interpolation(d)
    plane, points = _plane(nodes), _plane(d)
    inside = 0
    for row, each in enumerate(d):
        assert weights[row].sum() == pytest.approx(1.0)
        flat = any(_is_in(plane[t], points[row]) for t in held)
        within = flat or any(_is_in(nodes[t], each) for t in held)
        inside += within
        assert (distance[row] == 0.0) == within
        far = {edge: _far(nodes, edge, each) for edge in edges}
        if flat:
            here = sum(w * plane[k] for k, w in zip(found[row], weights[row], strict=True))
            assert here == pytest.approx(points[row], abs=1e-9)
            continue
        edge = min(far, key=lambda e: far[e][0])
        if distance[row] != 0.0:
            assert distance[row] == pytest.approx(far[edge][0], abs=1e-7)
        own = np.zeros(len(nodes))
        np.add.at(own, found[row], weights[row])
        expected = np.zeros(len(nodes))
        expected[list(edge)] = 1.0 - far[edge][1], far[edge][1]
        assert own == pytest.approx(expected, abs=1e-6)
    assert inside > 3
    assert np.sum(distance > 0.0) > 10


def test_beyond_many_edges_the_nearest_counts() -> None:
    """Of a ring of 120 at 45°; an arc of 2.1° between two lies 0.01° nearer to the pole."""
    support = DirectionSupport(from_angles(0.25 * np.pi, np.arange(120) * 3.0 * DEGREE))
    d = fibonacci_cap(80, 2.0)
    expected = np.maximum(polar_angle(d) - 0.25 * np.pi, 0.0)
    assert support.interpolation(d)[2] == pytest.approx(expected, abs=2e-4)


def test_results_do_not_depend_on_blocks_of_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 71)[:-1]
    nodes = unit(np.column_stack([np.cos(turn), np.sin(turn), np.full(70, 0.4)]))
    support, d = DirectionSupport(nodes[:66]), fibonacci_cap(60, 2.9)
    whole = support.interpolation(d)
    monkeypatch.setattr(module, "_CHUNK", 7)
    monkeypatch.setattr(module, "_PAIRS", 200)
    for one, other in zip(whole, support.interpolation(d), strict=True):
        assert other == pytest.approx(one, abs=1e-12)


def test_edges_of_wide_holes_support_up_to_twice_sixty_degrees() -> None:
    """Three directions on the equator: arcs of 114° and 119° hold, one of 127° does not."""
    nodes = from_angles(np.full(3, 0.5 * np.pi), np.radians([0.0, 114.0, 233.0]))
    middles = from_angles(np.full(3, 0.5 * np.pi), np.radians([57.0, 173.5, 296.5]))
    distance = DirectionSupport(nodes).interpolation(middles)[2]
    assert np.degrees(distance) == pytest.approx([0.0, 0.0, 63.5], abs=1e-6)


def test_directions_that_would_pull_the_stylus_out_are_refused() -> None:
    """The limit is the height -0.985; that of 170° in degrees of the polar angle is -0.98481."""
    at_limit = [[np.sqrt(1.0 - 0.985**2), 0.0, -0.985]]
    assert DirectionSupport(at_limit).nodes[0, 2] == -0.985
    with pytest.raises(PretravelError, match="polar angle above 170°"):
        DirectionSupport(from_angles(np.radians([20.0, 170.2]), np.array([0.0, 0.3])))


@pytest.mark.parametrize("short", [0, 80])
def test_an_arc_of_touches_supports_what_lies_along_it(short: int) -> None:
    """Given in any order, on a meridian; the distance is the angle beside it. Its long edge is
    found behind many short ones too, whose middles are nearer."""
    polar = np.append(np.radians([60.0, 10.0, 35.0, 85.0]), np.linspace(0.612, 0.62, short))
    support = DirectionSupport(from_angles(polar, np.full(4 + short, 0.4)))
    beside = np.radians([0.0, 4.0, 4.9, 5.1, 20.0])
    at = 47.5 if not short else 40.0
    up = from_angles(np.full(5, np.radians(at)), np.full(5, 0.4))
    across = np.array([-np.sin(0.4), np.cos(0.4), 0.0])
    n = np.cos(beside)[:, None] * up + np.sin(beside)[:, None] * across
    nodes, weights, distance = support.interpolation(n)
    assert distance == pytest.approx(beside, abs=1e-7)
    assert support.supports(n).tolist() == [True, True, True, False, False]
    assert support.supports(n, 21.0 * DEGREE).all()
    assert support.supports(n, 0.0).tolist()[1:] == [False] * 4
    before = 3 + short if short else 2
    share = (np.radians(at) - polar[before]) / (polar[0] - polar[before])
    for row in range(5):
        own = {int(k): float(w) for k, w in zip(nodes[row], weights[row], strict=True) if w}
        assert own == {0: pytest.approx(share), before: pytest.approx(1.0 - share)}
    ends = from_angles(np.radians([7.0, 88.0]), np.full(2, 0.4))
    nodes, weights, distance = support.interpolation(ends)
    assert distance == pytest.approx(np.radians([3.0, 3.0]))
    for row, end in enumerate((1, 3)):
        assert nodes[row, weights[row].argmax()] == end
        assert weights[row].max() == 1.0


def test_one_direction_supports_its_neighbourhood() -> None:
    support = DirectionSupport([[0.0, 0.0, 1.0]])
    n = from_angles(np.radians([0.0, 4.9, 5.1]), np.zeros(3))
    assert support.supports(n).tolist() == [True, True, False]


def test_nodes_their_opposites_and_poles_of_edges_have_a_distance() -> None:
    """Products of unit vectors may be beyond one by rounding: no distance is lost by that."""
    turn = np.linspace(0.0, 1.9 * np.pi, 40)
    nodes = unit(np.column_stack([np.cos(turn), np.sin(turn), 0.3 * np.ones(40)]))
    nodes = nodes[np.linalg.norm(nodes - nodes[0], axis=1) < 5.0]
    for part in (nodes[:3], nodes[10:13], nodes[:20], nodes, nodes[7:8]):
        support = DirectionSupport(part)
        poles = unit(np.cross(part, np.roll(part, -1, axis=0))) if len(part) > 1 else part
        found, weights, distance = support.interpolation(np.vstack([part, -part, poles, -poles]))
        assert np.isfinite(distance).all()
        assert np.isfinite(weights).all()
        assert distance[: len(part)] == pytest.approx(np.zeros(len(part)), abs=1e-7)
        own = np.sum((found == np.arange(len(found))[:, None]) * weights, axis=1)
        assert own[: len(part)] == pytest.approx(np.ones(len(part)), abs=1e-6)
    # From a node, the opposite of it is farther away than any other direction.
    opposite = DirectionSupport(nodes[7:8]).interpolation(-nodes[7:8])[2]
    assert opposite == pytest.approx([np.pi], abs=1e-7)


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


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (2, 0, 3, 1), (1, 3, 0, 2)])
@pytest.mark.parametrize("turn", [0.0, 40.0, 90.0])
def test_directions_on_one_line_of_the_plane_are_joined_to_their_neighbours(
    order: tuple[int, ...], turn: float
) -> None:
    """The plane of the stereographic projection from -z, (2 X, 2 Y, 1 - r²) / (1 + r²); a line
    beside its origin, evenly on both sides of the foot of its perpendicular."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    across = np.array([-0.3, -0.1, 0.1, 0.3])[list(order)]
    x, y = 0.5 * c - across * s, 0.5 * s + across * c
    square = x**2 + y**2
    nodes = np.stack([2.0 * x, 2.0 * y, 1.0 - square], axis=1) / (1.0 + square)[:, None]
    line = nodes[np.argsort(order)]
    found, weights, distance = DirectionSupport(nodes).interpolation(unit(line[1:] + line[:-1]))
    assert distance == pytest.approx(np.zeros(3), abs=1e-7)
    for row in range(3):
        own = {order[k]: w for k, w in zip(found[row], weights[row], strict=True) if w}
        assert own == {row: pytest.approx(0.5), row + 1: pytest.approx(0.5)}


@pytest.mark.parametrize(
    "nodes",
    [
        sphere_pattern_25(),  # rings, with many nodes on one circle
        fibonacci_cap(30, 1.7),
        from_angles(np.repeat([0.5, 1.0, 1.5], 5), np.tile(np.linspace(0.0, np.pi, 5), 3)),
        np.vstack([sphere_pattern_25()[:10]] * 2),  # each twice
        from_angles(np.radians([0.0, 90.0, 90.0, 90.0, 90.0]), np.radians([0, 0, 90, 180, 270])),
    ],
)
def test_few_nodes_have_the_support_of_another_triangulation(
    nodes: FloatArray, monkeypatch: pytest.MonkeyPatch
) -> None:
    directions = fibonacci_cap(2000, 2.9)
    own = DirectionSupport(nodes).interpolation(directions)
    monkeypatch.setattr(module, "_FEW_NODES", 0)
    others = DirectionSupport(nodes).interpolation(directions)
    assert own[2] == pytest.approx(others[2], abs=1e-9)
    # Inside, the weights lead back to each direction's point of the plane.
    inside = own[2] == 0.0
    plane = _plane(nodes)[own[0][inside]]
    point = np.sum(own[1][inside][:, :, None] * plane, axis=1)
    in_triangle = own[1][inside].min(axis=1) > 1e-9
    assert point[in_triangle] == pytest.approx(_plane(directions[inside])[in_triangle], abs=1e-9)
