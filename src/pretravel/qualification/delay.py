"""Signal delay told apart from pretravel at rest: touches at two or more feeds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.qualification.map_fit import HarmonicMapFit
from pretravel.touches import Touches
from pretravel.units import MICROMETRE, SECONDS_PER_MINUTE

SAME_FEED = 0.01
"""Feeds that differ by less than this, relatively, are one feed."""
_WELL_KNOWN = 10.0  # degrees of freedom among repeats from which these give the noise
_USUAL_NOISE, _USUAL_DOF = 0.3 * MICROMETRE, 4.0  # what is held usual, and how firmly
COSTLY = 0.5 * MICROMETRE
"""A delay whose uncertainty moves the map by more than this is not told apart. [mm]"""


@dataclass(frozen=True)
class SignalDelay:
    """Time between the trigger and the latched position.

    Attributes
    ----------
    delay, u_delay : float
        [s]
    slowest, fastest : float
        Feeds it was told from. [mm/min]
    """

    delay: float
    u_delay: float
    slowest: float
    fastest: float


def several_feeds(touches: Touches) -> bool:
    """Whether the feeds differ enough to tell a delay apart.

    >>> several_feeds(Touches([[0, 0, 1], [0, 0, 1]], [[0, 0, 1], [0, 0, 1]], feeds=[50, 100]))
    True
    """
    if touches.feeds is None:
        return False
    return bool(np.ptp(touches.feeds) > SAME_FEED * touches.feeds.max())


def travel_per_second(touches: Touches) -> FloatArray:
    """What one second of delay adds to the observed pretravel of each touch, (n,). [mm/s]"""
    assert touches.feeds is not None  # callers ask `several_feeds` first
    closing = -np.sum(touches.approach_directions * touches.normals, axis=1)
    return np.asarray(touches.feeds / SECONDS_PER_MINUTE * closing)


def signal_delay(
    touches: Touches, fit: HarmonicMapFit, noise: float, noise_dof: float
) -> SignalDelay:
    """The delay that best explains what feeds change.

    Parameters
    ----------
    touches : Touches
        At several feeds.
    fit : HarmonicMapFit
        Of the same touches, the delay's travel still in them.
    noise, noise_dof : float
        Standard deviation among repeats [mm] and its degrees of freedom.

    Returns
    -------
    SignalDelay
        With an infinite uncertainty where feeds go with the directions, so that map and delay
        look alike.

    Notes
    -----
    With M = 1 - H, H the hat matrix of the map's regression, the estimate is
    f M y / f M f: generalised least squares with the map integrated out.
    """
    assert touches.feeds is not None
    f = travel_per_second(touches)
    observed = fit.residuals  # M y
    left = f - fit.hat @ f  # M f
    information = float(f @ left)
    slowest, fastest = float(touches.feeds.min()), float(touches.feeds.max())
    if not information > 1e-3 * float(np.sum((f - f.mean()) ** 2)):
        return SignalDelay(0.0, math.inf, slowest, fastest)
    delay = float(f @ observed) / information
    sigma = noise
    if noise_dof < _WELL_KNOWN:
        # Few repeats: what the map left, which may be next to nothing, beside what is usual.
        left_over = float(np.sum((observed - left * delay) ** 2)) + noise_dof * noise**2
        dof = max(fit.dof - 1.0, 1.0) + noise_dof
        sigma = math.sqrt((left_over + _USUAL_DOF * _USUAL_NOISE**2) / (dof + _USUAL_DOF))
    return SignalDelay(delay, sigma / math.sqrt(information), slowest, fastest)
