"""Touches around a bore or boss at steps that separate 2 to 12 lobes from its size."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, FloatArray

_UNEQUAL_DEG = {
    4: (0, 75, 194, 292),
    5: (0, 81, 141, 239, 315),
    6: (0, 54, 128, 193, 214, 313),
    7: (0, 20, 102, 147, 213, 266, 289),
    8: (0, 45, 75, 124, 179, 237, 262, 338),
    9: (0, 53, 71, 135, 152, 199, 249, 276, 316),
    10: (0, 28, 84, 111, 132, 191, 213, 255, 285, 337),
    11: (0, 35, 54, 103, 127, 148, 202, 225, 249, 285, 335),
    12: (0, 35, 51, 98, 118, 137, 185, 220, 244, 265, 293, 341),
    13: (0, 24, 51, 78, 101, 126, 152, 202, 228, 254, 275, 299, 318),
}
"""Azimuths by the number of touches, from a random search: the largest movement of diameter, x or y
by one of 2 to 12 lobes is least. Of 13 or fewer equal steps some lobes look like another diameter
(as many lobes as touches, or twice as many), or like another place (one more or less)."""


def steps_around(count: int) -> FloatArray:
    """Azimuths of touches around an axis.

    Returns
    -------
    (count,) float
        From zero: unequal of 4 to 13 touches, else equal. [rad]

    >>> (steps_around(4) / DEGREE).round(6).tolist()
    [0.0, 75.0, 194.0, 292.0]
    >>> (steps_around(3) / DEGREE).round(6).tolist()
    [0.0, 120.0, 240.0]
    """
    unequal = _UNEQUAL_DEG.get(count)
    if unequal is not None:
        return np.array(unequal) * DEGREE
    return np.asarray(2.0 * np.pi * np.arange(count) / count)
