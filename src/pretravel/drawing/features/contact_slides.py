"""How far the contact slides on the part between first contact and trigger."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray
from pretravel.maps import PretravelMap
from pretravel.measurement import Points
from pretravel.touches import Touches


def contact_slide(touches: Touches, points: Points, pretravel_map: PretravelMap) -> FloatArray:
    """The slide of the tip on the part, from first contact to the latched point.

    The tip's centre moves with the spindle, by the travel s along the approach a, and relative to
    it by its own displacement in the probe; s is that with which the tip stays on the part. Without
    friction; exact on a plane, and to first order on a curved part.

    Parameters
    ----------
    touches : Touches
    points : Points
        The same touches, compensated with the map.
    pretravel_map : PretravelMap

    Returns
    -------
    (n, 3) float
        Along the surface. [mm]

    References
    ----------
    Rodrigues 2021, section 3.4: the tip slides while stylus and mechanism deflect.

    >>> from pretravel.measurement.compensation import apply
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.none(1),
    ...                     DirectionSupport(up), tip_radius=3.0)
    >>> touches = Touches([[0.0, 0.0, 2.990]], up)
    >>> contact_slide(touches, apply(touches, mean), mean).round(6).tolist()
    [[0.0, 0.0, 0.0]]
    """
    moved = pretravel_map.tip_displacement(points.normals, extrapolate=True)
    approaches = touches.approach_directions
    inward = np.sum(moved * points.normals, axis=1)
    travel = -inward / np.sum(approaches * points.normals, axis=1)
    return np.asarray(moved + travel[:, None] * approaches)
