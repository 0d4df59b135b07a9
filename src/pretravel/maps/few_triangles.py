"""Triangles between a few directions, without the import of a library for many.

A Delaunay triangulation of the stereographic plane from -z is a part of the convex hull of the
directions and -z: the faces that -z is no corner of. Of a few directions, all threes are looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import combinations

import numpy as np

from pretravel.base import FloatArray, IntArray

FEW_NODES = 50
"""So many directions have 20,000 threes, which take less time than an import."""
_ON_CIRCLE = 1e-10
"""Distance from the plane of a circle up to which a direction lies on it."""
_INSIDE = 1e-12
"""Share of a triangle by which a point on its edge may lie outside."""
_BLOCK = 2048


@dataclass(frozen=True, eq=False)
class FewTriangles:
    """Delaunay triangles of some points of a plane, with what is used of SciPy's.

    Attributes
    ----------
    points : (n, 2) float
    simplices : (t, 3) int
    """

    points: FloatArray
    simplices: IntArray

    @cached_property
    def transform(self) -> FloatArray:
        """As of `scipy.spatial.Delaunay`, (t, 3, 2)."""
        corners = self.points[self.simplices]
        last = corners[:, 2]
        sides = np.swapaxes(corners[:, :2] - last[:, None], 1, 2)
        return np.concatenate([np.linalg.inv(sides), last[:, None]], axis=1)

    def find_simplex(self, points: FloatArray) -> IntArray:
        """The triangle of each of (m, 2) points, (m,); -1 outside all."""
        matrices, last = self.transform[:, :2], self.transform[:, 2]
        begin = np.einsum("tij,tj->ti", matrices, last)
        found = np.full(len(points), -1, dtype=np.int64)
        for start in range(0, len(points), _BLOCK):
            block = points[start : start + _BLOCK]
            first = block @ matrices[:, 0].T - begin[:, 0]
            second = block @ matrices[:, 1].T - begin[:, 1]
            least = np.minimum(np.minimum(first, second), 1.0 - first - second)
            best = np.argmax(least, axis=1)
            inside = least[np.arange(len(block)), best] >= -_INSIDE
            found[start : start + _BLOCK][inside] = best[inside]
        return found


def few_triangles(nodes: FloatArray, plane: FloatArray) -> FewTriangles | None:
    """Triangles of up to `FEW_NODES` directions; None where all lie on one line of the plane.

    Parameters
    ----------
    nodes : (n, 3) float
        Unit vectors.
    plane : (n, 2) float
        Their stereographic projection from -z.

    >>> from pretravel.base import grid
    >>> square = grid(0.5, np.radians([0.0, 90.0, 180.0, 270.0]))
    >>> few_triangles(square, square[:, :2]).simplices.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    if len(nodes) < 3:
        return None
    threes = _threes(len(nodes))
    a, b, c = (nodes[threes[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    threes, a, normal = (f[length > 1e-14] for f in (threes, a, normal))
    normal /= length[length > 1e-14][:, None]
    height = np.sum(normal * a, axis=1)
    south = -normal[:, 2] - height
    sign = np.where(south > 0.0, -1.0, 1.0)
    above = sign[:, None] * (normal @ nodes.T - height[:, None])
    faces = (np.abs(south) > _ON_CIRCLE) & (above.max(axis=1, initial=-1.0) <= _ON_CIRCLE)
    on_circle = np.unique(above[faces] >= -_ON_CIRCLE, axis=0)
    counts = on_circle.sum(axis=1)
    triangles = [np.nonzero(on_circle[counts == 3])[1].reshape(-1, 3)]
    # More directions on one circle: their polygon, in triangles from its first corner.
    for row in on_circle[counts > 3]:
        corners = _around(np.flatnonzero(row), plane)
        first = np.full(len(corners) - 2, corners[0])
        triangles.append(np.column_stack([first, corners[1:-1], corners[2:]]))
    found = np.concatenate(triangles)
    return FewTriangles(plane, found) if len(found) else None


@lru_cache(maxsize=4)
def _threes(count: int) -> IntArray:
    """All threes of so many, (t, 3)."""
    return np.array(list(combinations(range(count), 3)))


def _around(corners: IntArray, plane: FloatArray) -> IntArray:
    """Corners of a convex polygon in their order around it, from the first one."""
    away = plane[corners] - plane[corners].mean(axis=0)
    order = np.argsort(np.arctan2(away[:, 1], away[:, 0]))
    return np.asarray(np.roll(corners[order], -int(np.argmin(corners[order]))))
