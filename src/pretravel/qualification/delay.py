"""Separates the signal delay from the pretravel at rest, from touches at two or more feeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.units import MICROMETRE, SECONDS_PER_MINUTE
from pretravel.maps.kinds.harmonic import HarmonicMapFit
from pretravel.maps.observation import Scatter
from pretravel.touches import Touches

SAME_FEED = 0.01
"""Feeds that differ by less than this, relatively, are one feed."""
_WELL_KNOWN = 10.0  # degrees of freedom among repeats from which these determine the noise
_USUAL_NOISE, _USUAL_DOF = 0.3 * MICROMETRE, 4.0  # a usual repeatability, and its weight
COSTLY = 0.5 * MICROMETRE
"""A delay whose uncertainty moves the map by more than this is not separated. [mm]"""


@dataclass(frozen=True)
class SignalDelay:
    """Time between the trigger and the latched position.

    Attributes
    ----------
    delay, u_delay : float
        [s]
    slowest, fastest : float
        Feeds that it was determined from. [mm/min]
    """

    delay: float
    u_delay: float
    slowest: float
    fastest: float


def several_feeds(touches: Touches) -> bool:
    """Whether the feeds differ enough to separate a delay.

    >>> several_feeds(Touches([[0, 0, 1], [0, 0, 1]], [[0, 0, 1], [0, 0, 1]], feeds=[50, 100]))
    True
    """
    if touches.feeds is None:
        return False
    return bool(np.ptp(touches.feeds) > SAME_FEED * touches.feeds.max())


def travel_per_second(touches: Touches) -> FloatArray:
    """Travel that one second of delay adds to the pretravel of each touch, (n,). [mm/s]"""
    assert touches.feeds is not None  # callers ask `several_feeds` first
    closing = -np.sum(touches.approach_directions * touches.normals, axis=1)
    return np.asarray(touches.feeds / SECONDS_PER_MINUTE * closing)


def signal_delay(touches: Touches, fit: HarmonicMapFit, repeats: Scatter) -> SignalDelay:
    """The delay that best explains the change of the touches with the feed.

    Parameters
    ----------
    touches : Touches
        At several feeds.
    fit : HarmonicMapFit
        Of the same touches, which still contain the delay travel.
    repeats : Scatter
        Of repeated touches.

    Returns
    -------
    SignalDelay
        With an infinite uncertainty where the feeds change with the directions, so that map and
        delay cannot be separated.

    Notes
    -----
    With M = 1 - H, H the hat matrix of the map's regression, the estimate is
    f M y / f M f: generalised least squares with the map integrated out.
    """
    assert touches.feeds is not None
    f = travel_per_second(touches)
    observed = fit.residuals  # M y
    left = f - fit.smoothing.fitted(f, fit.observation.groups)  # M f
    information = float(f @ left)
    slowest, fastest = float(touches.feeds.min()), float(touches.feeds.max())
    if not information > 1e-3 * float(np.sum((f - f.mean()) ** 2)):
        return SignalDelay(0.0, math.inf, slowest, fastest)
    delay = float(f @ observed) / information
    sigma = repeats.deviation
    if repeats.dof < _WELL_KNOWN:
        # Few repeats: the residuals of the map, which may be very small, with a usual value.
        residual = float(np.sum((observed - left * delay) ** 2))
        left_over = residual + repeats.dof * repeats.deviation**2
        dof = max(fit.dof - 1.0, 1.0) + repeats.dof
        sigma = math.sqrt((left_over + _USUAL_DOF * _USUAL_NOISE**2) / (dof + _USUAL_DOF))
    return SignalDelay(delay, sigma / math.sqrt(information), slowest, fastest)
