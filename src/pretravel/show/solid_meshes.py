"""Triangles of the simple solids that probes are drawn from."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray, grid
from pretravel.show.direction_charts import grid_triangles

_AROUND = 36


def cylinder_mesh(
    start: npt.ArrayLike, end: npt.ArrayLike, radius: float
) -> tuple[FloatArray, IntArray]:
    """A closed cylinder.

    Parameters
    ----------
    start, end : (3,) float
        Centres of its ends. [mm]
    radius : float
        [mm]

    Returns
    -------
    vertices : (n, 3) float
    triangles : (t, 3) int
        Counter-clockwise as seen from outside; none is much longer than wide, so that they can be
        sorted by depth.

    >>> vertices, triangles = cylinder_mesh([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], 1.0)
    >>> float(vertices[:, 2].max()), float(np.hypot(*vertices[:, :2].T).max().round(9))
    (2.0, 1.0)
    """
    first, last = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    length = float(np.linalg.norm(last - first))
    axis = (last - first) / length
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)[:, None]
    circle = np.cos(turn) * across + np.sin(turn) * np.cross(axis, across)
    # A ring in the middle of each end closes it.
    pieces = max(math.ceil(length / max(radius, 1e-9)), 1)
    along = np.concatenate([[0.0], np.linspace(0.0, length, min(pieces, 60) + 1), [length]])
    wide = np.full(len(along), radius)
    wide[[0, -1]] = 0.0
    vertices = first + along[:, None, None] * axis + wide[:, None, None] * circle
    return vertices.reshape(-1, 3), grid_triangles(len(along), _AROUND)[:, ::-1]


def sphere_mesh(
    center: npt.ArrayLike, radius: float, rings: int = 13, sectors: int = 24
) -> tuple[FloatArray, IntArray]:
    """A sphere.

    Parameters
    ----------
    center : (3,) float
        [mm]
    radius : float
        [mm]
    rings, sectors : int
        Vertices from pole to pole, and around.

    Returns
    -------
    vertices : (n, 3) float
    triangles : (t, 3) int
        Counter-clockwise as seen from outside.

    >>> vertices, _ = sphere_mesh([0.0, 0.0, 5.0], 2.0)
    >>> bool(np.allclose(np.linalg.norm(vertices - [0.0, 0.0, 5.0], axis=1), 2.0))
    True
    """
    around = np.linspace(0.0, 2.0 * np.pi, sectors, endpoint=False)
    normals = grid(np.linspace(0.0, np.pi, rings), around)
    return np.asarray(center, dtype=np.float64) + radius * normals, grid_triangles(rings, sectors)


def joined(parts: list[tuple[FloatArray, IntArray]]) -> tuple[FloatArray, IntArray]:
    """Several meshes as one.

    >>> ball = sphere_mesh([0.0, 0.0, 0.0], 1.0)
    >>> len(joined([ball, ball])[0]) == 2 * len(ball[0])
    True
    """
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(
        [triangles + start for (_, triangles), start in zip(parts, starts, strict=False)]
    )
