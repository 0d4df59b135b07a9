"""Pretravel that a probe can have: one rule for touches, maps and tables."""

from __future__ import annotations

from pretravel.base import MICROMETRE, delay_travel

IMPLAUSIBLE_PRETRAVEL = 0.1
"""A map that rises above this is warned about: probes deflect by 1 to 80 um. [mm]"""
LARGEST_PRETRAVEL = 0.15
"""A pretravel above this is refused: a diameter or a unit is wrong. [mm]"""
LONGEST_DELAY = 0.03
"""Signal delay whose travel is accepted on top, where the feed is stated. [s]"""
SMALLEST_PRETRAVEL = -0.02
"""A mean pretravel below this is impossible: no probe triggers before contact. [mm]"""
BEFORE_CONTACT = 2.0 * MICROMETRE
"""A map that falls further below zero than this, and three u, is warned about. [mm]"""


def largest_plausible(feed: float | None) -> float:
    """The largest pretravel that is accepted at a feed.

    Parameters
    ----------
    feed : float or None
        None: not stated. [mm/min]

    Returns
    -------
    float
        [mm]

    >>> largest_plausible(None), largest_plausible(60.0)
    (0.15, 0.18)
    """
    return LARGEST_PRETRAVEL + (0.0 if feed is None else delay_travel(feed, LONGEST_DELAY))
