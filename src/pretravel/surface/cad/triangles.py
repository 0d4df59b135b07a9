"""Triangles of faces, for pictures: never for a result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.surface.cad.face import Face, lattice

_TURN = np.radians(10.0)
"""An edge has a point wherever its direction has turned by this."""
_MOST_ON_GRID = 40_000
"""Of all faces together, approximately."""


@dataclass(frozen=True, eq=False)
class FaceTriangles:
    """Triangles of a face, and its edges.

    Attributes
    ----------
    points : (n, 3) float
        [mm]
    corners : (t, 3) int
        Rows of points.
    edges : tuple of (m, 3) float
        Lines along its edges. [mm]
    middle : (3,) float
        A point of the face that is far from its edges. [mm]
    """

    points: FloatArray
    corners: IntArray
    edges: tuple[FloatArray, ...]
    middle: FloatArray


def face_triangles(face: Face, *, faces: int = 1) -> FaceTriangles:
    """Triangles that show a face.

    They connect a grid of the parameters and the edges; those outside the edges are left out.

    Parameters
    ----------
    face : Face
    faces : int
        Number of faces that are shown together: the more, the coarser.
    """
    from scipy.spatial import Delaunay, QhullError, cKDTree

    low, high = face.box
    side = int(np.clip(np.sqrt(_MOST_ON_GRID / faces), 5, 33))
    # A flat face needs points along its edges alone.
    count = 5 if face.kind == "plane" else side
    grid = lattice(low, high, np.array([count, count]))
    grid = grid[face.inside(grid)]
    spacing = float(np.linalg.norm(np.ptp(face.bounds, axis=0))) / side
    lines = [_thinned(face, line, spacing) for line in face.edge_lines(np.inf)]
    if lines and len(grid):
        # Farther from an edge than half the distance of its points, so that no triangle crosses it.
        border = cKDTree(face.derivatives(np.concatenate(lines))[0])
        grid = grid[border.query(face.derivatives(grid)[0])[0] > 0.75 * spacing]
    uv = np.concatenate([grid, *lines])
    uv = uv[np.all(np.isfinite(face.derivatives(uv)[0]), axis=1)]
    points = face.derivatives(uv)[0]
    try:
        corners = np.asarray(Delaunay((uv - low) / _lengths(face)).simplices, dtype=np.int64)
    except (QhullError, ValueError):  # all on one line
        corners = np.empty((0, 3), dtype=np.int64)
    if len(corners):
        corners = corners[face.inside(uv[corners].mean(axis=1))]
    edges = tuple(face.derivatives(line)[0] for line in lines)
    return FaceTriangles(points, corners, edges, face.derivatives(face.middle[None])[0][0])


def _lengths(face: Face) -> FloatArray:
    """Parameters per length, so that triangles have about equal sides in space. (2,)"""
    low, high = face.box
    _, du, dv = face.derivatives(lattice(low, high, np.array([5, 5])))
    speed = np.array([np.nanmedian(np.linalg.norm(d, axis=1)) for d in (du, dv)])
    speed = np.maximum(speed, 1e-6 * max(float(speed.max()), 1e-9))
    return np.asarray(1.0 / speed)


def _thinned(face: Face, line: FloatArray, spacing: float) -> FloatArray:
    """The points of an edge at its corners, at every ten degrees of a bend, and at a spacing."""
    points = face.derivatives(line)[0]
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    along = steps / np.where(length > 0.0, length, 1.0)[:, None]
    turns = np.arccos(np.clip(np.sum(along[1:] * along[:-1], axis=1), -1.0, 1.0))
    turned = np.concatenate([[0.0], np.cumsum(turns)]) // _TURN
    gone = np.concatenate([[0.0], np.cumsum(length)[:-1]]) // max(spacing, 1e-9)
    kept = np.ones(len(line), dtype=bool)
    kept[1:-1] = (np.diff(turned) != 0.0) | (np.diff(gone) != 0.0)
    return line[kept]
