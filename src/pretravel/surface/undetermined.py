"""Places of a surface where the contact with a ball is not determined: apexes and tight hollows."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import FloatArray
from pretravel.surface.local_geometry import Surface

LEAST_PLAY = 0.06
"""Smallest difference between the radius of a hollow and that of the ball. At this one, 1 µm across
the normal (of the deflection, of the form of the part) turns the contact by 1°. [mm]"""
_SAMPLES = 9
_COINCIDENT = 1e-7
"""Size of a line of the parameters that is one point, relative to its coordinates."""
_BESIDE = 1e-4
"""Distance from the end of the parameters, as a share of their range, at which normals differ at an
apex; at the pole of a smooth surface they differ by less than 0.1° there."""
_TURN = math.radians(1.0)


def play_of_ball(radius: float, curvatures: FloatArray) -> FloatArray:
    """Radius of the hollow less that of the ball; infinite where the surface is not hollow.

    Parameters
    ----------
    radius : float
        Of the ball. [mm]
    curvatures : (n, 2) float
        Principal curvatures of the surface, convex positive, smaller one first. [1/mm]

    Returns
    -------
    (n,) float
        Negative where the ball does not fit. [mm]

    >>> play_of_ball(3.0, np.array([[-0.25, 0.0], [0.0, 0.5]])).tolist()
    [1.0, inf]
    """
    hollow = np.maximum(-curvatures[:, 0], 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / hollow - radius)


def apexes(surface: Surface, low: FloatArray, high: FloatArray) -> FloatArray:
    """Points in which a whole side of the parameters ends, and that have no normal.

    Parameters
    ----------
    surface : Surface
    low, high : (2,) float
        Range of the parameters; sides without an end have no apex.

    Returns
    -------
    (k, 3) float
        The tips of cones, for example; the poles of a sphere have a normal. [mm]

    >>> from pretravel.surface.shapes_of_revolution import Cone
    >>> cone = Cone([0.0, 0.0, 0.0], 5.0, -math.pi / 4)
    >>> apexes(cone, np.array(cone.domain.lower), np.array(cone.domain.upper)).round(6).tolist()
    [[0.0, 0.0, 5.0]]
    """
    found = []
    for axis, other in ((1, 0), (0, 1)):
        if not np.isfinite([low[other], high[other]]).all():
            continue
        range_ = high[axis] - low[axis]
        step = _BESIDE * (range_ if math.isfinite(range_) else 1.0)
        for end, inwards in ((low[axis], step), (high[axis], -step)):
            if not math.isfinite(end):
                continue
            line = np.empty((_SAMPLES, 2))
            line[:, axis] = end
            line[:, other] = np.linspace(low[other], high[other], _SAMPLES)
            points = surface.derivatives(line)[0]
            size = float(np.ptp(points, axis=0).max())
            if not size <= _COINCIDENT * max(1.0, float(np.abs(points).max())):
                continue
            line[:, axis] += inwards
            normals = surface.local(line).normal
            if float(np.nanmin(normals @ normals.T)) < math.cos(_TURN):
                found.append(points.mean(axis=0))
    return np.array(found).reshape(-1, 3)


def distance_from_apexes(points: FloatArray, places: FloatArray) -> FloatArray:
    """Distance of points (n, 3) from the nearest of (k, 3) places; infinite without any. [mm]

    >>> distance_from_apexes(np.zeros((1, 3)), np.array([[3.0, 4.0, 0.0]])).tolist()
    [5.0]
    """
    apart = np.linalg.norm(points[:, None] - places[None], axis=2)
    return np.asarray(apart.min(axis=1, initial=np.inf))
