"""Rotations between the probe's frame and the machine's.

Probe frame: +z from the tip up to the spindle. A rotation is a (3, 3) matrix R
whose columns are the probe's axes in machine coordinates: v_machine = R v_probe,
for rows of an (n, 3) array ``rows_machine = rows_probe @ R.T``.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.directions import checked_unit


def probe_rotation(axis: npt.ArrayLike = (0.0, 0.0, 1.0), rotation: float = 0.0) -> FloatArray:
    """Rotation from probe to machine frame.

    The probe is first turned by `rotation` about its own axis, then tilted
    along the shortest way so that its axis points along `axis`.

    Parameters
    ----------
    axis : (3,) float
        Direction of the probe's +z (tip to spindle) in the machine; unit vector.
    rotation : float
        Turn about the probe axis, counter-clockwise seen from the spindle's
        side looking down the -z direction. [rad]

    Returns
    -------
    (3, 3) float
        Orthonormal, determinant +1.

    >>> probe_rotation((1.0, 0.0, 0.0)).round(12).tolist()
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    """
    a = checked_unit(np.atleast_2d(np.asarray(axis, dtype=np.float64)), "probe axis")[0]
    cosine, sine = math.cos(rotation), math.sin(rotation)
    about_axis = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    across = math.hypot(a[0], a[1])
    # The plane of the tilt; upside down the shortest way is not unique: over x.
    x, y = (a[0] / across, a[1] / across) if across > 0.0 else (1.0, 0.0)
    to_plane = np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]])
    length = math.hypot(across, a[2])
    c, s = a[2] / length, across / length
    tilt = to_plane @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ to_plane.T
    return np.asarray(tilt @ about_axis)
