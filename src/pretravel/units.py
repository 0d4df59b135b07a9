"""The one unit system inside (mm, N, MPa, rad) and the way to its edges.

Files, command line and pictures speak micrometres and degrees, and say so in
their column names; everything between speaks millimetres and radians.

>>> 12.5 * MICROMETRE
0.0125
>>> round(90 * DEGREE, 6)
1.570796
"""

from __future__ import annotations

import math
from typing import Final, overload

from pretravel.arrays import FloatArray

MICROMETRE: Final = 1e-3
"""One micrometre in mm."""

DEGREE: Final = math.pi / 180.0
"""One degree in rad."""

INCH: Final = 25.4
"""One inch in mm."""

GIGAPASCAL: Final = 1e3
"""One gigapascal in MPa."""

STANDARD_GRAVITY: Final = 9.80665
"""Standard acceleration of free fall (CGPM 1901): the weight of one kg in N."""

SECONDS_PER_MINUTE: Final = 60.0


@overload
def delay_travel(feed: float, delay: float) -> float: ...
@overload
def delay_travel(feed: FloatArray, delay: float) -> FloatArray: ...
def delay_travel(feed: float | FloatArray, delay: float) -> float | FloatArray:
    """Travel of a moving machine while the trigger signal is on its way.

    Parameters
    ----------
    feed : float or (n,) float
        Feed rate. [mm/min]
    delay : float
        Signal delay. [s]

    Returns
    -------
    float or (n,) float
        Delay travel. [mm]

    References
    ----------
    Rodrigues 2021, section 2.9.2: 14.5 ms at 50 mm/min is 12.08 um.

    >>> round(delay_travel(50.0, 14.5e-3) / MICROMETRE, 2)
    12.08
    """
    return feed / SECONDS_PER_MINUTE * delay
