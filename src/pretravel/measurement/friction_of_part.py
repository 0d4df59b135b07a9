"""What a friction of the part that differs from that of the reference moves at each point."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray
from pretravel.maps import PretravelMap

USUAL_FRICTION_OF_TIP = 0.2
"""Coefficient of ruby on steel, about which a difference is looked at."""


def movement_by_friction(
    pretravel_map: PretravelMap, normals: FloatArray, approaches: FloatArray, difference: float
) -> FloatArray:
    """Change of the pretravel along the normals by a larger friction of the part.

    The tip slides along the part while the probe deflects, and friction turns the force from the
    normal against this slide, at most until the tip sticks. The displacement of the tip for the
    turned force is that of the map in its direction.

    Parameters
    ----------
    pretravel_map : PretravelMap
    normals, approaches : (n, 3) float
        Unit vectors, machine frame.
    difference : float
        Of the coefficients of friction: half of the change between a friction that is smaller by
        it than the usual one, and one that is larger by it.

    Returns
    -------
    (n,) float
        [mm]

    References
    ----------
    Rodrigues 2021, section 3.4, for the slide; Coulomb's law.

    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> inclined = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(inclined), tip_radius=3.0)
    >>> movement_by_friction(mean, inclined, -inclined, 0.1).round(4).tolist()
    [0.0, 0.0018]
    """
    moved = pretravel_map.tip_displacement(normals, extrapolate=True)
    slide = _along_surface(moved, normals, approaches)
    size = np.linalg.norm(slide, axis=1)
    against = slide / np.maximum(size, 1e-12)[:, None]

    def displaced(friction: FloatArray) -> FloatArray:
        force = normals - friction[:, None] * against
        force /= np.linalg.norm(force, axis=1)[:, None]
        return pretravel_map.tip_displacement(force, extrapolate=True)

    def pretravel(coefficient: float) -> FloatArray:
        full = np.full(len(normals), coefficient)
        left = _along_surface(displaced(full), normals, approaches)
        held = size - np.sum(left * against, axis=1)
        # Where friction would turn the slide round, the tip sticks with less than all of it.
        share = np.clip(size / np.maximum(held, 1e-12), 0.0, 1.0)
        share = np.where(held > 0.0, share, 1.0)
        return np.asarray(np.sum(displaced(share * full) * normals, axis=1))

    lower = max(USUAL_FRICTION_OF_TIP - difference, 0.0)
    upper = USUAL_FRICTION_OF_TIP + difference
    change = pretravel(upper) - pretravel(lower)
    return np.asarray(change * difference / (upper - lower))


def _along_surface(moved: FloatArray, normals: FloatArray, approaches: FloatArray) -> FloatArray:
    """Slide of the tip on a plane whose normal displacement is taken up by the travel."""
    inward = np.sum(moved * normals, axis=1)
    travel = -inward / np.sum(approaches * normals, axis=1)
    return np.asarray(moved + travel[:, None] * approaches)
