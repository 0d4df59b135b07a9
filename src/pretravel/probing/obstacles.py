"""What a moving ball and stylus meet on their way, found on points all over the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.probe.description import Probe
from pretravel.surface.cad.part import Cloud, Part
from pretravel.surface.local_geometry import Surface

_CLOSE = 1e-4
"""Deeper than this a ball is in the way of a face: CAD faces do not join better. [mm]"""
_LEAST_STEP = 0.02
"""Of a ball along its way, as a share of its radius."""
_EDGE_RESOLUTION = 0.02
"""Of edges, as a share of the ball's radius: their distance is right to 5e-5 of it."""
_NEAR_FACES = 32
"""Points around a ball by which the faces near it are found."""
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
    part: Part,
    centers: FloatArray,
    approach: FloatArray,
    touched: IntArray,
    radius: float,
    clearance: float,
) -> IntArray:
    """Faces that balls meet before they arrive, on the last piece of their way, or where they do.

    Parameters
    ----------
    part : Part
    centers : (n, 3) float
        Of the balls where they arrive. [mm]
    approach : (n, 3) float
        Unit directions of travel.
    touched : (n,) int
        Faces that they touch there.
    radius, clearance : float
        Of the balls; length of the piece. [mm]

    Returns
    -------
    (n,) int
        Index of the face, -1 where the way is free.

    Notes
    -----
    Points of the part tell how far a ball is from it at least; it is moved on by that. Where they
    do not tell enough the distance to the faces themselves is taken. Only the last bit of the way,
    on which the points cannot tell the face to touch from others, is looked at where it ends.
    """
    cloud = part.cloud_of_spacing(0.5 * radius)
    # Every point of a face has one of its samples within this, seen past its curvature.
    bends = np.array([face.largest_convex_curvature for face in part.faces])
    slack = float(np.max(cloud.gaps * np.sqrt(1.0 + radius * np.minimum(bends, 4.0 / radius))))
    least = _LEAST_STEP * radius
    last = min(slack**2 / radius + least, 0.5 * radius)
    met = np.full(len(centers), -1)
    to_go = np.full(len(centers), float(clearance))
    active = np.flatnonzero(to_go > last)
    while len(active):
        at = centers[active] - to_go[active, None] * approach[active]
        distance, nearest = cloud.tree.query(at, workers=-1)
        inside = distance < radius - _CLOSE
        met[active[inside]] = cloud.face[nearest[inside]]
        free = np.sqrt(np.maximum(distance**2 - slack**2, 0.0)) - radius
        doubtful = np.flatnonzero(~inside & (free < least))
        if len(doubtful):
            exact, face = _distance(part, at[doubtful], cloud, radius, slack, None)
            hit = exact < radius - _CLOSE
            met[active[doubtful[hit]]] = face[hit]
            inside[doubtful[hit]] = True
            # Where no face was near enough to be asked, the ball has at least a step to go.
            free[doubtful] = np.minimum(exact - radius, least)
        to_go[active] -= np.maximum(free, least)
        active = active[~inside & (to_go[active] > last)]
    left = np.flatnonzero(met < 0)
    distance, nearest = cloud.tree.query(centers[left], workers=-1)
    inside = distance < radius - _CLOSE
    met[left[inside]] = cloud.face[nearest[inside]]
    left = left[~inside]
    exact, face = _distance(part, centers[left], cloud, radius, slack, touched[left])
    hit = exact < radius - _CLOSE
    met[left[hit]] = face[hit]
    return met


def _distance(
    part: Part,
    centers: FloatArray,
    cloud: Cloud,
    radius: float,
    slack: float,
    but: IntArray | None,
) -> tuple[FloatArray, IntArray]:
    """Distance of balls' centres from the nearest face, and which; infinite where none is within
    the radius. One face of each ball can be left out.
    """
    within = float(np.hypot((1.0 + _LEAST_STEP) * radius, slack)) + _CLOSE
    count = min(_NEAR_FACES, len(cloud.points))
    _, at = cloud.tree.query(centers, k=count, distance_upper_bound=within, workers=-1)
    at = at.reshape(len(centers), count)
    faces = np.where(at < len(cloud.points), cloud.face[np.minimum(at, len(cloud.points) - 1)], -1)
    if but is not None:
        faces = np.where(faces == but[:, None], -1, faces)
    nearest, which = np.full(len(centers), np.inf), np.full(len(centers), -1)
    for index in np.unique(faces[faces >= 0]):
        rows = np.flatnonzero((faces == index).any(axis=1))
        distance = part.faces[index].distance(centers[rows], _EDGE_RESOLUTION * radius)
        closer = distance < nearest[rows]
        nearest[rows[closer]], which[rows[closer]] = distance[closer], index
    return nearest, which


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

    Notes
    -----
    A ball of each cylinder's radius goes down along its axis; what only its rim would meet is found
    by points of the part.
    """
    from scipy.spatial import cKDTree

    cloud = part.cloud_of_spacing(0.5 * float(stylus.radii.min()))
    axis = stylus.axis
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first = first / np.linalg.norm(first)
    frame = np.stack([first, np.cross(axis, first), axis])
    flat = cloud.points @ frame.T
    tree = cKDTree(flat[:, :2])
    met = np.full(len(spindle), -1)
    nothing = np.full(len(spindle), -1)
    steps = max(int(np.ceil(clearance / max(float(stylus.radii.min()), 0.1))), 1)
    for back in np.linspace(0.0, clearance, steps + 1):
        for (low, high), radius in zip(stylus.above, stylus.radii, strict=True):
            # The lowest cylinder begins within the ball at the tip, the others with a rim.
            start = low if low == 0.0 else low + radius
            free = np.flatnonzero(met < 0)
            if start < high and len(free):
                foot = (spindle - back * approach + start * axis)[free]
                down = np.repeat(-axis[None], len(free), axis=0)
                met[free] = first_obstacle(
                    part, foot, down, nothing[free], float(radius), float(high - start)
                )
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

    For what is said of a touch that failed only: points tell, a tenth of the radius near enough.

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
    cloud, low, high = surface.cloud_of_chosen, *surface.box
    # As far as the part and the ball reach, to both sides.
    far = float(np.linalg.norm(high - low)) + 2.0 * radius
    far += float(np.max(np.abs(start - 0.5 * (low + high))))
    along = np.full(len(start), -far)
    active = np.arange(len(start))
    while len(active):
        at = start[active] + along[active, None] * approach[active]
        distance, _ = cloud.tree.query(at, workers=-1)
        meets[active] = distance < radius
        along[active] += np.maximum(distance - radius, 0.1 * radius)
        active = active[~meets[active] & (along[active] < far)]
    return meets
