"""Which directions a set of nodes supports, and linear interpolation between them.

The sphere is laid flat by stereographic projection from -z (the direction in
which no probe is touched), which keeps circles and angles: a Delaunay
triangulation of the plane is then one of the sphere. There is no seam in azimuth
and no pole: +z is the plane's origin, a point like any other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, IntArray, frozen
from pretravel.directions import checked_unit
from pretravel.errors import PretravelError
from pretravel.units import DEGREE

LARGEST_HOLE = 60.0 * DEGREE
"""Triangles whose empty circle is wider than this are holes, not support. [rad]

An octant, as in the five-point sphere qualification (four touches on the
equator, one at the pole), has 54.7° and is the coarsest pattern in use.
"""

MARGIN = 5.0 * DEGREE
"""How far outside the triangles a direction may lie and still be supported. [rad]"""

_SOUTH_LIMIT = -0.985  # polar 170°: beyond it the projection runs away
_CHUNK = 16384


def _project(directions: FloatArray) -> FloatArray:
    # Radius tan(polar / 2); -z itself, where there is no azimuth, goes far out along x.
    across = np.hypot(directions[:, 0], directions[:, 1])
    radius = np.minimum(across / np.maximum(1.0 + directions[:, 2], 1e-12), 1e6)
    radius = np.where((across == 0.0) & (directions[:, 2] < 0.0), 1e6, radius)
    along = np.where(
        across[:, None] > 0.0,
        directions[:, :2] / np.maximum(across, 1e-300)[:, None],
        np.array([1.0, 0.0]),
    )
    return np.asarray(radius[:, None] * along)


def _unproject(plane: FloatArray) -> FloatArray:
    square = np.sum(plane**2, axis=-1, keepdims=True)
    return np.asarray(np.concatenate([2.0 * plane, 1.0 - square], axis=-1) / (1.0 + square))


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Triangles that hold, and the edges along which a near miss is judged."""

    triangulation: Any  # scipy.spatial.Delaunay, or None when the nodes are in a row
    triangle_held: BoolArray
    edges: IntArray


@dataclass(frozen=True, eq=False)
class DirectionSupport:
    """A set of unit directions that were touched or predicted.

    Parameters
    ----------
    nodes : (n, 3) float
        Unit vectors, all with polar angle below 170°.

    >>> from pretravel.directions import grid
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
        if np.any(nodes[:, 2] < _SOUTH_LIMIT):
            raise PretravelError(
                "directions with a polar angle above 170° cannot be mapped: "
                "there the part would pull the stylus out of the probe"
            )
        object.__setattr__(self, "nodes", frozen(nodes))
        object.__setattr__(self, "_plane", frozen(_project(nodes)))

    @cached_property
    def _mesh(self) -> _Mesh:
        from scipy.spatial import Delaunay, QhullError

        plane = self._plane
        try:
            triangulation = Delaunay(plane)
        except (QhullError, ValueError):  # fewer than three nodes, or all in a row
            spread = plane - plane.mean(axis=0)
            along = spread @ np.linalg.svd(spread, full_matrices=False)[2][0]
            order = np.argsort(along, kind="stable")
            edges = np.stack([order, np.roll(order, -1)], axis=1)[: max(len(order) - 1, 1)]
            return _Mesh(None, np.zeros(0, dtype=bool), edges.astype(np.int64))
        triangles = np.sort(triangulation.simplices, axis=1).astype(np.int64)
        a, b, c = (self.nodes[triangles[:, i]] for i in range(3))
        # The plane through three nodes cuts the sphere in their circle; its
        # normal, on the side away from -z, points to the circle's centre.
        normal = np.cross(b - a, c - a)
        normal *= np.where(np.sum(normal * a, axis=1) < 0.0, -1.0, 1.0)[:, None]
        length = np.linalg.norm(normal, axis=1)
        radius = np.arccos(
            np.clip(np.sum(normal * a, axis=1) / np.maximum(length, 1e-300), -1.0, 1.0)
        )
        held = (radius <= LARGEST_HOLE) & (length > 1e-14)
        pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
        pair_held = np.tile(held, 3)
        edges, inverse = np.unique(pairs, axis=0, return_inverse=True)
        held_count = np.bincount(inverse.ravel(), weights=pair_held, minlength=len(edges))
        boundary = edges[held_count == 1]
        loose = edges[held_count == 0]
        # Of the edges without a triangle, keep those between true neighbours:
        # no other node in the circle that has the edge as diameter (Gabriel).
        if len(loose):
            middle = 0.5 * (plane[loose[:, 0]] + plane[loose[:, 1]])
            half = 0.5 * np.linalg.norm(plane[loose[:, 0]] - plane[loose[:, 1]], axis=1)
            nearest = np.array(
                [np.partition(np.linalg.norm(plane - m, axis=1), 2)[2] for m in middle]
            )
            angle = np.arccos(
                np.clip(np.sum(self.nodes[loose[:, 0]] * self.nodes[loose[:, 1]], axis=1), -1, 1)
            )
            loose = loose[(nearest >= half * (1.0 - 1e-9)) & (angle <= 2.0 * LARGEST_HOLE)]
        return _Mesh(triangulation, held, np.concatenate([boundary, loose]))

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
        point = _project(d)
        mesh = self._mesh
        nodes = np.zeros((len(d), 3), dtype=np.int64)
        weights = np.zeros((len(d), 3))
        distance = np.zeros(len(d))
        outside = np.ones(len(d), dtype=bool)
        if mesh.triangulation is not None and mesh.triangle_held.any():
            found = mesh.triangulation.find_simplex(point)
            inside = (found >= 0) & mesh.triangle_held[np.maximum(found, 0)]
            simplex = found[inside]
            transform = mesh.triangulation.transform[simplex]
            first = np.einsum("nij,nj->ni", transform[:, :2], point[inside] - transform[:, 2])
            weights[inside] = np.concatenate([first, 1.0 - first.sum(axis=1, keepdims=True)], 1)
            nodes[inside] = mesh.triangulation.simplices[simplex]
            outside = ~inside
        rows = np.flatnonzero(outside)
        for start in range(0, len(rows), _CHUNK):
            chunk = rows[start : start + _CHUNK]
            nodes[chunk], weights[chunk], distance[chunk] = self._nearest_on_edges(
                point[chunk], d[chunk], mesh.edges
            )
        return nodes, weights, distance

    def _nearest_on_edges(
        self, point: FloatArray, directions: FloatArray, edges: IntArray
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        start = self._plane[edges[:, 0]]
        vector = self._plane[edges[:, 1]] - start
        square = np.maximum(np.sum(vector**2, axis=1), 1e-300)
        offset = point[:, None, :] - start[None]
        parameter = np.clip(np.einsum("nej,ej->ne", offset, vector) / square, 0.0, 1.0)
        miss = np.sum((offset - parameter[:, :, None] * vector) ** 2, axis=2)
        nearest = np.argmin(miss, axis=1)
        t = parameter[np.arange(len(point)), nearest]
        foot = _unproject(start[nearest] + t[:, None] * vector[nearest])
        cross = np.linalg.norm(np.cross(foot, directions), axis=1)
        distance = np.arctan2(cross, np.sum(foot * directions, axis=1))
        chosen = edges[nearest]
        return (
            np.concatenate([chosen, chosen[:, 1:]], axis=1),
            np.stack([1.0 - t, t, np.zeros_like(t)], axis=1),
            distance,
        )

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
        return np.asarray(self.interpolation(directions)[2] <= margin)
