"""Directions that a set of nodes supports, and linear interpolation between them.

A stereographic projection from -z, a direction in which no probe is touched, maps the sphere to a
plane and preserves circles and angles: a Delaunay triangulation of the plane is therefore one of
the sphere. It has no seam in azimuth and no pole: +z is the origin of the plane.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    checked_unit,
    fibonacci_cap,
    from_angles,
    frozen,
    polar_angle,
)

LARGEST_HOLE = 60.0 * DEGREE
"""Triangles with a wider circumscribed circle than this are holes, not support. [rad]

The coarsest pattern in use is an octant with 54.7°: the five-point sphere qualification (four
touches on the equator, one at the pole).
"""

MARGIN = 5.0 * DEGREE
"""Distance from the triangles up to which a direction is still supported. [rad]"""

MOST_LOOKED_AT = 5000
"""Touched directions in which a map is evaluated for a report; a map is smooth between them."""
SOUTH_LIMIT = -0.985  # polar 170°: beyond it the projection becomes too large
_CHUNK = 8192
_CHUNK_IN_CACHE = 1024  # of points by few triangles: several matrices remain in the cache
_FEW_NODES = 30  # of more, all triples take longer than loading another library
_LITTLE = 1e-9
_FLAT = 1e-12  # area of a triangle of nodes on one line, as a share of that of all
_ROUNDING = 1e-12  # of a weight: a point on an edge is inside
_PAIRS = 100_000  # of a direction and an edge at a time
_NEAREST = 16  # edges that are compared first, where there are many


def _project(directions: FloatArray) -> FloatArray:
    # Radius tan(polar / 2), by the half-angle formula that is exact to the last digits on either
    # hemisphere; -z itself, which has no azimuth, is projected far along x.
    across, height = np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2]
    radius = np.where(
        height >= 0.0, across / (1.0 + np.abs(height)), (1.0 - height) / np.maximum(across, 1e-6)
    )
    along = np.where(
        across[:, None] > 0.0,
        directions[:, :2] / np.maximum(across, 1e-300)[:, None],
        np.array([1.0, 0.0]),
    )
    return np.asarray(radius[:, None] * along)


def _neighbours_in_turn(points: FloatArray) -> IntArray:
    """An order in which each point is near the one before: along rows, there and back.

    SciPy's search for a triangle walks from the last one. In the order of a spiral it crosses the
    mesh for each point.
    """
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64)
    low, high = points.min(axis=0), points.max(axis=0)
    rows = max(math.sqrt(len(points)), 1.0)
    row = np.floor((points[:, 1] - low[1]) * rows / max(high[1] - low[1], 1e-300))
    along = np.where(row % 2.0 == 0.0, points[:, 0], -points[:, 0])
    return np.lexsort((along, row)).astype(np.int64)


def _triangulated(plane: FloatArray) -> Any:
    """Delaunay's triangulation; None of fewer than three nodes, or of nodes on one line.

    That of few nodes is made here: loading `scipy.spatial` takes longer than a short command.
    """
    if len(plane) <= _FEW_NODES:
        return _few_triangulated(plane)
    from scipy.spatial import Delaunay, QhullError

    try:
        return Delaunay(plane)
    except (QhullError, ValueError):
        return None


@dataclass(frozen=True, eq=False)
class _FewTriangles:
    """Triangles of few nodes, with the names of `scipy.spatial.Delaunay`."""

    simplices: IntArray
    """(t, 3)"""
    transform: FloatArray
    """Inverse matrix of each triangle's sides, and its last corner, (t, 3, 2)."""

    def find_simplex(self, points: FloatArray) -> IntArray:
        """The triangle of each point, (m,); -1 where none contains it."""
        found = np.empty(len(points), dtype=np.int64)
        inverse, last = self.transform[:, :2], self.transform[:, 2]
        at_origin = -np.einsum("tij,tj->it", inverse, last)
        first_of, second_of = inverse[:, 0].T, inverse[:, 1].T
        for start in range(0, len(points), _CHUNK_IN_CACHE):
            part = points[start : start + _CHUNK_IN_CACHE]
            first, second = part @ first_of, part @ second_of
            first += at_origin[0]
            second += at_origin[1]
            third = np.subtract(1.0, first + second)
            least = np.minimum(np.minimum(first, second, out=first), third, out=first)
            best = least.argmax(axis=1)
            inside = least[np.arange(len(part)), best] >= -_ROUNDING
            found[start : start + _CHUNK_IN_CACHE] = np.where(inside, best, -1)
        return found


@lru_cache(maxsize=8)
def _triples(count: int) -> IntArray:
    """All triples of numbers below a count, (3, t)."""
    found = list(itertools.combinations(range(count), 3))
    return np.array(found, dtype=np.int64).reshape(-1, 3).T


def _few_triangulated(plane: FloatArray) -> _FewTriangles | None:
    """All triangles whose circle contains no other node.

    Nodes raised to a paraboloid: below the plane of such a triangle is no other node. Rings of a
    pattern have many nodes on one circle: each node is raised by a little more, so that only one
    triangulation of them remains.
    """
    count, middle = len(plane), plane.mean(axis=0)
    squares = np.sum((plane - middle) ** 2, axis=1)
    size = float(squares.max())
    a, b, c = _triples(count)
    raised = squares + _LITTLE * size * np.sin(np.arange(count) ** 2 + 1.0)
    nodes = np.column_stack([plane - middle, raised])
    normal = np.cross(nodes[b] - nodes[a], nodes[c] - nodes[a])
    normal *= np.sign(normal[:, 2:])
    height = normal @ nodes.T - np.sum(normal * nodes[a], axis=1)[:, None]
    rows = np.arange(len(a))
    for corner in (a, b, c):
        height[rows, corner] = np.inf
    kept = (normal[:, 2] > _FLAT * size) & np.all(height > 0.0, axis=1)
    if not kept.any():
        return None
    simplices = np.column_stack([a, b, c])[kept]
    corners = plane[simplices]
    sides = np.swapaxes(corners[:, :2] - corners[:, 2:], 1, 2)
    return _FewTriangles(simplices, np.concatenate([np.linalg.inv(sides), corners[:, 2:]], axis=1))


def _distance_to_nearest(plane: FloatArray, points: FloatArray) -> FloatArray:
    """Distance of each point from the nearest node, (m,)."""
    if len(plane) <= _FEW_NODES:
        return np.asarray(np.linalg.norm(points[:, None] - plane, axis=2).min(axis=1))
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(plane).query(points)[0])


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Triangles that support directions, and the edges that bound them."""

    triangulation: Any  # as scipy.spatial.Delaunay, or None where the nodes lie on one line
    triangle_held: BoolArray
    edges: IntArray
    edge_normals: FloatArray  # of the great circles of the edges, towards their triangles
    edge_bounds: BoolArray  # whether the edge bounds a triangle


@dataclass(frozen=True, eq=False)
class _Arcs:
    """Edges as arcs of great circles: ends, the direction from the start along the arc, length."""

    start: FloatArray
    end: FloatArray
    across: FloatArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class DirectionSupport:
    """Directions in which a map holds: those between touched or predicted directions.

    Parameters
    ----------
    nodes : (n, 3) float
        Unit vectors, all with polar angle below 170°.

    >>> from pretravel.base.directions import grid
    >>> ring = DirectionSupport(grid(np.pi / 2, np.radians(np.arange(0, 360, 30))))
    >>> ring.supports([[0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]).tolist()
    [True, False]
    """

    nodes: FloatArray
    _plane: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        nodes = checked_unit(self.nodes, "support directions")
        if len(nodes) == 0:
            raise PretravelError("a map needs at least one direction")
        if np.any(nodes[:, 2] < SOUTH_LIMIT):
            raise PretravelError(
                "directions with a polar angle above 170° cannot be mapped: "
                "there the part would pull the stylus out of the probe"
            )
        object.__setattr__(self, "nodes", frozen(nodes))
        object.__setattr__(self, "_plane", frozen(_project(nodes)))

    @cached_property
    def _mesh(self) -> _Mesh:
        plane = self._plane
        triangulation = _triangulated(plane)
        if triangulation is None:
            spread = plane - plane.mean(axis=0)
            along = spread @ np.linalg.svd(spread, full_matrices=False)[2][0]
            order = np.argsort(along, kind="stable")
            edges = np.stack([order, np.roll(order, -1)], axis=1)[: max(len(order) - 1, 1)]
            return self._with_edges(None, np.zeros(0, dtype=bool), edges.astype(np.int64))
        triangles = np.sort(triangulation.simplices, axis=1).astype(np.int64)
        a, b, c = (self.nodes[triangles[:, i]] for i in range(3))
        # The plane through three nodes cuts the sphere in their circle; its normal
        # points to the centre of the circle, or away from it.
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        height = np.abs(np.sum(normal * a, axis=1))
        radius = np.arccos(np.minimum(height / np.maximum(length, 1e-300), 1.0))
        held = (radius <= LARGEST_HOLE) & (length > 1e-14)
        pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
        pair_held = np.tile(held, 3)
        edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
        held_count = np.bincount(inverse.ravel(), weights=pair_held)
        bounds = held_count == 1
        # The triangle's third node tells which side of its boundary is inside.
        third = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
        inside = np.zeros(len(edges), dtype=np.int64)
        inside[inverse.ravel()[pair_held]] = third[pair_held]
        boundary = edges[bounds]
        loose = edges[held_count == 0]
        # Of the edges without a triangle, keep those between true neighbours:
        # no other node in the circle that has the edge as diameter (Gabriel).
        if len(loose):
            middle = 0.5 * (plane[loose[:, 0]] + plane[loose[:, 1]])
            half = 0.5 * np.linalg.norm(plane[loose[:, 0]] - plane[loose[:, 1]], axis=1)
            nearest = _distance_to_nearest(plane, middle)
            angle = np.arccos(
                np.clip(np.sum(self.nodes[loose[:, 0]] * self.nodes[loose[:, 1]], axis=1), -1, 1)
            )
            loose = loose[(nearest >= half * (1.0 - 1e-9)) & (angle <= 2.0 * LARGEST_HOLE)]
        return self._with_edges(triangulation, held, loose, boundary, inside[bounds])

    def _with_edges(
        self,
        triangulation: Any,
        held: BoolArray,
        loose: IntArray,
        boundary: IntArray | None = None,
        inside: IntArray | None = None,
    ) -> _Mesh:
        edges = loose if boundary is None else np.concatenate([boundary, loose])
        normals = np.cross(self.nodes[edges[:, 0]], self.nodes[edges[:, 1]])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0)
        bounds = np.zeros(len(edges), dtype=bool)
        if boundary is not None and inside is not None:
            bounds[: len(boundary)] = True
            side = np.sum(normals[: len(boundary)] * self.nodes[inside], axis=1)
            normals[: len(boundary)][side < 0.0] = -normals[: len(boundary)][side < 0.0]
        return _Mesh(triangulation, held, edges, normals, bounds)

    def interpolation(self, directions: npt.ArrayLike) -> tuple[IntArray, FloatArray, FloatArray]:
        """Nodes and weights of linear interpolation, and the distance to the support.

        Parameters
        ----------
        directions : (m, 3) float
            Unit vectors.

        Returns
        -------
        nodes : (m, 3) int
            Three nodes of each direction; the last is repeated on an edge.
        weights : (m, 3) float
            Their weights, which sum to one.
        distance : (m,) float
            Zero inside, else the angle to the nearest supported direction, whose
            weights are then given. [rad]
        """
        d = np.asarray(directions, dtype=np.float64)
        nodes = np.zeros((len(d), 3), dtype=np.int64)
        weights = np.zeros((len(d), 3))
        distance = np.zeros(len(d))
        point = _project(d)
        found = self._triangles_at(point)
        inside = found >= 0
        if inside.any():
            triangulation, simplex = self._mesh.triangulation, found[inside]
            transform = triangulation.transform[simplex]
            first = np.einsum("nij,nj->ni", transform[:, :2], point[inside] - transform[:, 2])
            weights[inside] = np.concatenate([first, 1.0 - first.sum(axis=1, keepdims=True)], 1)
            nodes[inside] = triangulation.simplices[simplex]
        rows = np.flatnonzero(~inside)
        for start in range(0, len(rows), _CHUNK):
            chunk = rows[start : start + _CHUNK]
            nodes[chunk], weights[chunk], distance[chunk] = self._nearest_on_edges(d[chunk])
        return nodes, weights, distance

    def _triangles_at(self, points: FloatArray) -> IntArray:
        """The supporting triangle that contains each point of the plane, (m,); -1: none does."""
        mesh = self._mesh
        found = np.full(len(points), -1, dtype=np.int64)
        if mesh.triangulation is not None and mesh.triangle_held.any():
            if isinstance(mesh.triangulation, _FewTriangles):
                found = mesh.triangulation.find_simplex(points)
            else:
                order = _neighbours_in_turn(points)
                found[order] = mesh.triangulation.find_simplex(points[order])
            found[~mesh.triangle_held[np.maximum(found, 0)]] = -1
        return found

    @cached_property
    def _arcs(self) -> _Arcs:
        """The edges as arcs of great circles."""
        mesh = self._mesh
        start, end = self.nodes[mesh.edges[:, 0]], self.nodes[mesh.edges[:, 1]]
        length = np.arctan2(
            np.linalg.norm(np.cross(start, end), axis=1), np.sum(start * end, axis=1)
        )
        across = np.cross(mesh.edge_normals, start)
        backwards = np.sum(across * end, axis=1) < 0.0
        return _Arcs(start, end, np.where(backwards[:, None], -across, across), length)

    def _nearest_on_edges(self, directions: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """The nearest point of all edges, from those whose middles are nearest where that is sure.

        The middle of an edge is at most half of its length from any of its points.
        """
        edges, lengths = self._mesh.edges, self._arcs.length
        if len(edges) <= 4 * _NEAREST:
            return self._nearest_among(directions, np.arange(len(edges))[None, :])
        from scipy.spatial import cKDTree

        middle = 0.5 * (self._arcs.start + self._arcs.end)
        apart, nearest = (np.asarray(f) for f in cKDTree(middle).query(directions, k=_NEAREST))
        nodes, weights, distance = self._nearest_among(directions, nearest)
        # Chords and arcs: a middle lies inside the sphere, by less than half of the length.
        sure = 2.0 * np.sin(0.5 * distance) <= apart[:, -1] - lengths.max()
        rows, step = np.flatnonzero(~sure), max(_PAIRS // len(edges), 1)
        for first in range(0, len(rows), step):
            part = rows[first : first + step]
            found = self._nearest_among(directions[part], np.arange(len(edges))[None, :])
            nodes[part], weights[part], distance[part] = found
        return nodes, weights, distance

    def _nearest_among(
        self, directions: FloatArray, candidates: IntArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """The nearest point of candidate edges: (m, c) for each direction, or (1, c) for all."""
        mesh, arcs = self._mesh, self._arcs
        length = arcs.length[candidates]

        def along_each(vectors: FloatArray) -> FloatArray:
            if len(candidates) == 1:
                return np.asarray(directions @ vectors[candidates[0]].T)
            return np.asarray(np.einsum("mi,mci->mc", directions, vectors[candidates]))

        to_start, to_end = along_each(arcs.start), along_each(arcs.end)
        along = np.arctan2(along_each(arcs.across), to_start)
        height = along_each(mesh.edge_normals)
        on_arc = (along >= 0.0) & (along <= length) & (length > 0.0)
        to_start = np.arccos(np.clip(to_start, -1.0, 1.0))
        to_end = np.arccos(np.clip(to_end, -1.0, 1.0))
        distance = np.where(
            on_arc, np.abs(np.arcsin(np.clip(height, -1.0, 1.0))), np.minimum(to_start, to_end)
        )
        place = np.argmin(distance, axis=1)
        rows = np.arange(len(directions))
        nearest = candidates[rows if len(candidates) > 1 else 0, place]
        t = np.clip(along[rows, place] / np.maximum(arcs.length[nearest], 1e-300), 0.0, 1.0)
        t = np.where(on_arc[rows, place], t, 1.0 * (to_end < to_start)[rows, place])
        # The chords of the flat triangles cut off the area between chord and arc.
        cut_off = on_arc[rows, place] & mesh.edge_bounds[nearest] & (height[rows, place] >= 0.0)
        chosen = mesh.edges[nearest]
        return (
            np.concatenate([chosen, chosen[:, 1:]], axis=1),
            np.stack([1.0 - t, t, np.zeros_like(t)], axis=1),
            np.where(cut_off, 0.0, distance[rows, place]),
        )

    def distance(self, directions: npt.ArrayLike) -> FloatArray:
        """The angle to the nearest supported direction, (m,); zero inside. [rad]

        Parameters
        ----------
        directions : (m, 3) float
            Unit vectors.
        """
        d = np.asarray(directions, dtype=np.float64)
        distance = np.zeros(len(d))
        rows = np.flatnonzero(self._triangles_at(_project(d)) < 0)
        for start in range(0, len(rows), _CHUNK):
            chunk = rows[start : start + _CHUNK]
            distance[chunk] = self._nearest_on_edges(d[chunk])[2]
        return distance

    @cached_property
    def spread(self) -> FloatArray:
        """Directions spread over all that is supported, (n, 3): nodes first, some of very many."""
        polar = float(polar_angle(self.nodes).max())
        around = from_angles(polar, np.linspace(0.0, 2.0 * np.pi, 360))
        candidates = np.concatenate([fibonacci_cap(800, polar), around])
        supported = candidates[self.supports(candidates)]
        return frozen(np.concatenate([some_directions(self.nodes), supported]))

    def supports(self, directions: npt.ArrayLike, margin: float = MARGIN) -> BoolArray:
        """Whether each direction lies among the nodes, or within a margin of them.

        Parameters
        ----------
        directions : (m, 3) float
            Unit vectors.
        margin : float
            [rad]

        Returns
        -------
        (m,) bool
        """
        return np.asarray(self.distance(directions) <= margin)


def some_directions(directions: FloatArray) -> FloatArray:
    """Directions at which a map is looked at: all of up to `MOST_LOOKED_AT`, else so many drawn.

    Parameters
    ----------
    directions : (n, 3) float

    Returns
    -------
    (m, 3) float
    """
    if len(directions) <= MOST_LOOKED_AT:
        return directions
    drawn = np.random.default_rng(0).permutation(len(directions))[:MOST_LOOKED_AT]
    return np.asarray(directions[np.sort(drawn)])
