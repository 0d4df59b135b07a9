"""Faces that a moving ball or stylus meets on its way, found by points on the part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.prediction import Probe
from pretravel.surface import Cloud, Face, Part, Surface

_CLOSE = 1e-4
"""Depth above which a ball is considered to meet a face: CAD faces join no better. [mm]"""
_LEAST_STEP = 0.02
"""Smallest step of a ball along its way, as a share of its radius."""
_STEP = 0.25
"""Its step, as a share of its radius, where the distance to the faces is computed."""
_EDGE_RESOLUTION = 0.02
"""Distance between samples of edges, as a share of the ball's radius: the error of the
distance from an edge is below 5e-5 of the radius."""
_CHUNK = 2_000
"""Touches whose styluses are checked together."""


@dataclass(frozen=True, eq=False)
class StylusOutline:
    """The stylus as cylinders on the probe axis, above the ball.

    Attributes
    ----------
    axis : (3,) float
        From the tip up to the spindle, machine frame.
    above : (k, 2) float
        Start and end of each cylinder above the tip's centre. [mm]
    radii : (k,) float
        [mm]
    """

    axis: FloatArray
    above: FloatArray
    radii: FloatArray


def stylus_outline(probe: Probe, axis: FloatArray) -> StylusOutline:
    """The stylus of a description, from the ball to its root, with the hub if there is one.

    Parameters
    ----------
    probe : Probe
    axis : (3,) float
        Machine frame.

    >>> from pretravel.prediction.catalogue import load_probe
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
    """Faces that balls meet on the last piece of their way or at its end.

    Parameters
    ----------
    part : Part
    centers : (n, 3) float
        Of the balls at the end of their way. [mm]
    approach : (n, 3) float
        Unit directions of travel.
    touched : (n,) int
        Index of the face that each ball touches there.
    radius, clearance : float
        Radius of the balls; length of the piece. [mm]

    Returns
    -------
    (n,) int
        Index of the face, -1 where the way is free.

    Notes
    -----
    The points of the part give a lower bound of a ball's distance from the part; the ball is moved
    on by this distance. Where the bound is too small, the distance to the faces themselves is
    computed. On the last bit of the way the points do not distinguish the touched face from
    others: there only the end is checked.
    """
    cloud = part.cloud_of_spacing(0.5 * radius)
    slack = float(np.max(cloud.slacks(radius)))
    least, ahead = _LEAST_STEP * radius, _STEP * radius
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
            exact, face = _distance(part, cloud, at[doubtful], radius, None, ahead)
            hit = exact < radius - _CLOSE
            met[active[doubtful[hit]]] = face[hit]
            inside[doubtful[hit]] = True
            # Faces farther away than the ball and this step were not looked at.
            free[doubtful] = np.minimum(exact - radius, ahead)
        to_go[active] -= np.maximum(free, least)
        active = active[~inside & (to_go[active] > last)]
    left = np.flatnonzero(met < 0)
    distance, nearest = cloud.tree.query(centers[left], workers=-1)
    inside = distance < radius - _CLOSE
    met[left[inside]] = cloud.face[nearest[inside]]
    left = left[~inside]
    exact, face = _distance(part, cloud, centers[left], radius, touched[left])
    hit = exact < radius - _CLOSE
    met[left[hit]] = face[hit]
    return met


def _distance(
    part: Part,
    cloud: Cloud,
    centers: FloatArray,
    radius: float,
    excluded: IntArray | None,
    ahead: float = 0.0,
) -> tuple[FloatArray, IntArray]:
    """Distance of the balls' centres from the nearest face, and the index of this face.

    The distance is infinite where no face is within the radius and a piece ahead of it. One face
    can be excluded for each ball.
    """
    within = np.full(len(centers), radius + max(ahead, _LEAST_STEP * radius) + _CLOSE)
    pairs, faces = part.near(centers, within, cloud, part.boxes)
    nearest, which = np.full(len(centers), np.inf), np.full(len(centers), -1)
    for index in np.unique(faces):
        rows = pairs[faces == index]
        if excluded is not None:
            rows = rows[excluded[rows] != index]
        if len(rows) == 0:
            continue
        distance = part.faces[index].distance(centers[rows], _EDGE_RESOLUTION * radius)
        closer = distance < nearest[rows]
        nearest[rows[closer]], which[rows[closer]] = distance[closer], index
    return nearest, which


def stylus_obstacle(
    part: Part,
    spindle: FloatArray,
    approach: FloatArray,
    stylus: StylusOutline,
    clearance: float,
) -> IntArray:
    """Faces that a stylus meets at the trigger or on the last piece of its way.

    Parameters
    ----------
    part : Part
    spindle : (n, 3) float
        Spindle points at the trigger. [mm]
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
    A ball with the radius of each cylinder is moved along the cylinder's axis. Faces that only the
    rim of the cylinder meets are found by points of the part.
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
            # The lowest cylinder starts within the ball of the tip, the others with a rim.
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
    """Whether balls meet a face to touch, edges included, anywhere on their line.

    Only for the message about a failed touch. Contacts within the edges were found before, so
    that only those with edges are left; these are found to a tenth of the radius.

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
        Always False for a surface without edges.
    """
    meets = np.zeros(len(start), dtype=bool)
    if not isinstance(surface, Part) or len(start) == 0:
        return meets
    reach = np.full(len(start), radius)
    pairs, faces = surface.boxes_of_chosen.along(start, approach, reach)
    for index in np.unique(faces):
        rows = pairs[faces == index]
        rows = rows[~meets[rows]]
        if len(rows):
            face = surface.faces[index]
            meets[rows] = _meets_edges(face, start[rows], approach[rows], radius)
    return meets


def _meets_edges(face: Face, start: FloatArray, approach: FloatArray, radius: float) -> BoolArray:
    """Whether balls on lines meet the edges of a face, or points all over a face without edges."""
    from scipy.spatial import cKDTree

    uv = face.edge_samples(0.2 * radius) if face.borders else face.samples(0.2 * radius)
    points = face.derivatives(uv)[0]
    tree = cKDTree(points[np.isfinite(points).all(axis=1)])
    # From where the face begins along the line to where it ends.
    middle, half = face.bounds.mean(axis=0), 0.5 * np.linalg.norm(np.diff(face.bounds, axis=0))
    along = np.sum((middle - start) * approach, axis=1) - half - radius
    end = along + 2.0 * (half + radius)
    meets = np.zeros(len(start), dtype=bool)
    active = np.arange(len(start))
    while len(active):
        at = start[active] + along[active, None] * approach[active]
        distance, _ = tree.query(at, workers=-1)
        meets[active] = distance < radius
        along[active] += np.maximum(distance - radius, 0.1 * radius)
        active = active[~meets[active] & (along[active] < end[active])]
    return meets
