"""The mode of a probability by Fisher's scoring within bounds, and points spread about a mode."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pretravel.base import FloatArray

_FIRST_DAMPING, _STUCK = 1e-3, 1e12
_STEPS = 100
_LEAST_INFORMATION = 0.01
"""That damping is a share of: some unknowns have none."""
_NOTHING = 1e-9
"""Promised gain at which a search ends: the mode is found to 0.00005 of its uncertainty."""
_SOBOL = (
    (307271798, 174628328, 631746294, 307996591, 549404812, 934479949, 553954181, 14368825),
    (680168256, 833182303, 404013618, 867970132, 261199633, 201321069, 483954224, 981947520),
    (1047282702, 456927173, 874550651, 259766712, 303655366, 397374883, 1029551146, 628322504),
    (79058744, 553508978, 160692671, 781988419, 1027063387, 736335747, 8491423, 523199601),
    (182938005, 278534694, 283941116, 613480762, 837287670, 1000465337, 878683667, 761941845),
    (809335459, 727440785, 761263160, 91714241, 516499819, 132972953, 159613862, 389438444),
    (651933165, 30318603, 23831409, 967894829, 54646716, 465411671, 671529404, 146964388),
    (469870299, 974088124, 1020841909, 408382678, 745472033, 670137463, 366648329, 849242909),
)  # fmt: skip
"""A sequence of Sobol', scrambled, in steps of 2^-30: for the points that the posterior is averaged
over. `scipy.stats.qmc` gives it with ``rng=1``, but takes half a second to load."""


class CostAt(NamedTuple):
    """Minus the logarithm of a probability at some unknowns."""

    cost: float
    slopes: FloatArray
    """(u,)"""
    curvature: FloatArray
    """Second derivatives, (u, u)."""


def bounded_mode(
    at: Callable[[FloatArray], CostAt], start: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, float]:
    """The unknowns (u,) between bounds at which a cost is smallest, near a start, and the cost.

    Fisher's scoring with Levenberg's and Marquardt's damping (Nielsen 1999): some ten evaluations,
    where methods that learn the curvature need fifty, and scipy's need not be imported.

    >>> scale = np.array([1.0, 100.0])
    >>> def at(x: FloatArray) -> CostAt:
    ...     off = x - np.array([0.3, 2.0])
    ...     return CostAt(0.5 * float(scale @ off**2), scale * off, np.diag(scale))
    >>> bounded_mode(at, np.zeros(2), np.full(2, -1.0), np.full(2, 1.0))[0].round(6).tolist()
    [0.3, 1.0]
    """
    x = np.clip(start, low, high)
    now = at(x)
    damping, growth = _FIRST_DAMPING, 2.0
    for _ in range(_STEPS):
        held = ((x <= low) & (now.slopes > 0.0)) | ((x >= high) & (now.slopes < 0.0))
        free = np.flatnonzero(~held)
        if not len(free):
            break
        size, axes = np.linalg.eigh(now.curvature[np.ix_(free, free)])
        size = np.maximum(np.abs(size), _LEAST_INFORMATION)
        step = np.zeros(len(x))
        step[free] = -axes @ ((now.slopes[free] @ axes) / (size + damping))
        tried = np.clip(x + step, low, high)
        step = tried - x
        promised = -float(step @ (now.slopes + 0.5 * now.curvature @ step))
        if -0.5 * float(step @ now.slopes) < _NOTHING or damping > _STUCK:
            break
        there = at(tried)
        ratio = (now.cost - there.cost) / max(promised, _NOTHING)
        if ratio > 0.0:
            x, now = tried, there
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
            growth = 2.0
        else:
            damping *= growth
            growth *= 2.0
    return x, now.cost


@lru_cache(maxsize=1)
def spread_points() -> FloatArray:
    """Standard normal points in pairs, (p, 8), with mean zero and unit covariance.

    As many pairs as dimensions: all of them then have the same length.
    """
    from scipy.special import ndtri

    half = ndtri(np.array(_SOBOL) / 2.0**30)
    both = np.concatenate([half, -half])
    root = np.linalg.cholesky(both.T @ both / len(both))
    return np.asarray(np.linalg.solve(root, both.T).T)
