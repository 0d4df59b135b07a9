"""What a moving ball and stylus meet on their way, found on points all over the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.probe.description import Probe
from pretravel.surface.cad import Part
from pretravel.surface.local_geometry import Surface

_MOST_STEPS = 200
_CLOSE = 1e-6
"""Two surfaces that touch already: deeper than this counts as meeting. [mm]"""
_CHUNK = 2_000


@dataclass(frozen=True, eq=False)
class StylusOutline:
    """The stylus as cylinders on the probe axis, above the ball.

    Attributes
    ----------
    axis : (3,) float
        From the tip up to the spindle, machine frame.
    above : (k, 2) float
        Where each cylinder begins and ends above the tip centre. [mm]
    radii : (k,) float
        [mm]
    """

    axis: FloatArray
    above: FloatArray
    radii: FloatArray


def stylus_outline(probe: Probe, axis: FloatArray) -> StylusOutline:
    """The stylus of a description, from the ball up to its root, with the hub where it has one.

    Parameters
    ----------
    probe : Probe
    axis : (3,) float
        Machine frame.

    Returns
    -------
    StylusOutline

    >>> from pretravel.probe.catalogue import load_probe
    >>> outline = stylus_outline(load_probe("omp40-2"), np.array([0.0, 0.0, 1.0]))
    >>> float(outline.above[-1, 1]) >= 50.0
    True
    """
    above, radii, height = [], [], 0.0
    for segment in reversed(probe.stylus):
        above.append((height, height + segment.length))
        radii.append(0.5 * segment.diameter)
        height += segment.length
    if probe.hub is not None:
        above.append((height, max(probe.lever, height)))
        radii.append(0.5 * probe.hub.holder_diameter)
    return StylusOutline(np.asarray(axis), np.array(above), np.array(radii))


def first_obstacle(
    part: Part, centers: FloatArray, approach: FloatArray, radius: float, clearance: float
) -> IntArray:
    """Faces that balls meet before they arrive, on the last piece of their way.

    Parameters
    ----------
    part : Part
    centers : (n, 3) float
        Of the balls where they arrive. [mm]
    approach : (n, 3) float
        Unit directions of travel.
    radius, clearance : float
        Of the balls; length of the piece. [mm]

    Returns
    -------
    (n,) int
        Index of the face, -1 where the way is free.

    Notes
    -----
    Balls are moved on by their distance from the nearest of the part's points, so
    nothing is stepped over. Between points of spacing h a bulge of h²/(8 r) may hide.
    """
    cloud = part.cloud
    met = np.full(len(centers), -1)
    to_go = np.full(len(centers), float(clearance))
    active = np.flatnonzero(to_go > _CLOSE)
    for _ in range(_MOST_STEPS):
        if len(active) == 0:
            break
        at = centers[active] - to_go[active, None] * approach[active]
        distance, nearest = cloud.tree.query(at, workers=-1)
        gap = distance - radius
        inside = gap < -_CLOSE
        met[active[inside]] = cloud.face[nearest[inside]]
        to_go[active] -= np.maximum(gap, 0.01 * radius)
        active = active[~inside & (to_go[active] > _CLOSE)]
    return met


def stem_obstacle(
    part: Part,
    spindle: FloatArray,
    approach: FloatArray,
    stylus: StylusOutline,
    clearance: float,
) -> IntArray:
    """Faces that a stylus runs into at the trigger, or on the last piece of its way.

    Parameters
    ----------
    part : Part
    spindle : (n, 3) float
        Spindle points at the trigger (where the tip were, the stylus straight). [mm]
    approach : (n, 3) float
    stylus : StylusOutline
    clearance : float
        Length of the piece. [mm]

    Returns
    -------
    (n,) int
        Index of the face, -1 where the stylus is free.
    """
    from scipy.spatial import cKDTree

    cloud = part.cloud
    axis = stylus.axis
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first = first / np.linalg.norm(first)
    frame = np.stack([first, np.cross(axis, first), axis])
    flat = cloud.points @ frame.T
    tree = cKDTree(flat[:, :2])
    met = np.full(len(spindle), -1)
    steps = max(int(np.ceil(clearance / max(float(stylus.radii.min()), 0.1))), 1)
    for back in np.linspace(0.0, clearance, steps + 1):
        for begin in range(0, len(spindle), _CHUNK):
            rows = np.arange(begin, min(begin + _CHUNK, len(spindle)))
            rows = rows[met[rows] < 0]
            tip = (spindle[rows] - back * approach[rows]) @ frame.T
            for (low, high), radius in zip(stylus.above, stylus.radii, strict=True):
                near = tree.query_ball_point(tip[:, :2], radius - _CLOSE, workers=-1)
                counts = np.array([len(found) for found in near], dtype=np.int64)
                if counts.sum() == 0:
                    continue
                points = np.concatenate([np.asarray(f, dtype=np.int64) for f in near])
                owner = np.repeat(np.arange(len(rows)), counts)
                height = flat[points, 2] - tip[owner, 2]
                inside = (height > low) & (height < high)
                met[rows[owner[inside]]] = cloud.face[points[inside]]
    return met


def sweeps_surface(
    surface: Surface | Part, start: FloatArray, approach: FloatArray, radius: float
) -> BoolArray:
    """Whether balls meet any point of the faces to touch, edges included, on their whole line.

    Parameters
    ----------
    surface : Surface or Part
    start : (n, 3) float
        Points of the lines. [mm]
    approach : (n, 3) float
    radius : float
        [mm]

    Returns
    -------
    (n,) bool
        False throughout for a surface without edges: what is not met is missed.
    """
    meets = np.zeros(len(start), dtype=bool)
    if not isinstance(surface, Part) or len(start) == 0:
        return meets
    points = surface.cloud_of_chosen.points
    for row in range(0, len(start), _CHUNK // 20):
        rows = slice(row, row + _CHUNK // 20)
        apart = points[None, :, :] - start[rows, None, :]
        along = np.einsum("nmi,ni->nm", apart, approach[rows])
        off = np.einsum("nmi,nmi->nm", apart, apart) - along**2
        meets[rows] = np.min(off, axis=1) < radius**2
    return meets
