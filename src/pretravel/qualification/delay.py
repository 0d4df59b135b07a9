"""Separates the signal delay from the pretravel at rest, from touches at two or more feeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import MICROMETRE, SECONDS_PER_MINUTE, FloatArray, PretravelError
from pretravel.maps import HarmonicMapFit, Observation, Scatter, fit_harmonic
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


def separated_delay(
    touches: Touches, observation: Observation, rotation: FloatArray
) -> tuple[SignalDelay | None, list[str]]:
    """The signal delay by iteration: each step removes the delay found so far and fits the rest.

    Parameters
    ----------
    touches : Touches
    observation : Observation
        Of these touches.
    rotation : (3, 3) float
        Probe to machine frame.

    Returns
    -------
    SignalDelay or None
        None for touches at one feed, and where a delay would cost more than `COSTLY`.
    list of str
        Warnings.

    Raises
    ------
    PretravelError
        A signal before its trigger.
    """
    if not several_feeds(touches):
        return None, []
    travel = float(np.mean(travel_per_second(touches)))
    total, current = 0.0, observation
    for _ in range(6):
        found = signal_delay(touches, fit_harmonic(current), current.repeats)
        total += found.delay
        if math.isinf(found.u_delay) or abs(found.delay) < 0.01 * found.u_delay:
            break
        current = replace(observation, positions=touches.at_rest(total).positions @ rotation)
    delay = replace(found, delay=total)
    if delay.u_delay * travel > COSTLY:
        warning = (
            f"the touches were made at {delay.slowest:g} to {delay.fastest:g} mm/min, which does "
            "not determine the signal delay well enough (the feeds differ little, or change with "
            "the directions): delay travel is spread over the map. Touch the same directions at "
            "two quite different feeds, or all at one"
        )
        return None, [warning]
    if delay.delay < -3.0 * delay.u_delay:
        raise PretravelError(
            f"the touches give a signal delay of {delay.delay * 1e3:.3f} ms (u = "
            f"{delay.u_delay * 1e3:.3f}): a signal cannot come before its trigger. Are the "
            "feeds those of the touches, and does something else change with them?"
        )
    return delay, []
