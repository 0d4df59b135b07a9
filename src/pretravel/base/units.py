"""Units: mm, N, MPa and rad inside the library; factors for other units.

Files, command line and pictures use micrometres and degrees, with the unit in their column names.
All other code uses millimetres and radians.

>>> 12.5 * MICROMETRE
0.0125
>>> round(90 * DEGREE, 6)
1.570796
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, overload

if TYPE_CHECKING:
    from pretravel.base.arrays import FloatArray

MICROMETRE: Final = 1e-3
"""One micrometre in mm."""

DEGREE: Final = math.pi / 180.0
"""One degree in rad."""

INCH: Final = 25.4
"""One inch in mm."""

GIGAPASCAL: Final = 1e3
"""One gigapascal in MPa."""

STANDARD_GRAVITY: Final = 9.80665
"""Standard acceleration of free fall (CGPM 1901): the weight of 1 kg. [N]"""

SECONDS_PER_MINUTE: Final = 60.0

LARGEST_NUMBER: Final = 1e15
"""Larger numbers, in any unit, are no measured values; files that contain them are refused."""

USUAL_DELAY: Final = 2e-3
"""Standard uncertainty of a signal delay that was not determined: optical and radio transmission
take up to some milliseconds. [s]"""

USUAL_FEED: Final = 100.0
"""Of touches whose feed is not stated: slow touches have 30 to 300 mm/min. [mm/min]"""

SLOWEST_USUAL_FEED: Final = 10.0
"""Numbers below it are feeds in mm/s or m/min, perhaps. [mm/min]"""


def range_text(low: float, high: float) -> str:
    """Words for a range, one number where both ends are the same.

    >>> range_text(50.0, 300.0), range_text(50.0, 50.0)
    ('50 to 300', '50')
    """
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


@overload
def delay_travel(feed: float, delay: float) -> float: ...
@overload
def delay_travel(feed: FloatArray, delay: float) -> FloatArray: ...
def delay_travel(feed: float | FloatArray, delay: float) -> float | FloatArray:
    """Travel of a moving machine during the delay of the trigger signal.

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
    Rodrigues 2021, section 2.9.2: 14.5 ms at 50 mm/min give 12.08 µm.

    >>> round(delay_travel(50.0, 14.5e-3) / MICROMETRE, 2)
    12.08
    """
    return feed / SECONDS_PER_MINUTE * delay
