"""A first touch of each direction that differs from the touches after it in the same direction.

The carriage comes from another place, and slides, seats and cables settle with the first touch. All
directions then differ alike, which no memory of the push before does: that depends on the angle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.qualification.touch_order import (
    drift_columns,
    hysteresis_columns,
    predecessors,
    previous_directions,
)
from pretravel.qualification.two_states import logarithm_of_columns
from pretravel.qualification.within_directions import fit_within_directions

_FEWEST = 5
"""Directions with touches in a row."""
_BETTER = 4.0
"""Logarithm of the odds against other causes, as for two states."""


@dataclass(frozen=True, eq=False)
class FirstTouches:
    """First touches that differ from those after them.

    Attributes
    ----------
    first : (n,) bool
        Touches after one in another direction, and the first of all.
    apart : float
        Their pretravel less that of the touches after them. [mm]
    u : float
        Standard uncertainty. [mm]
    """

    first: FloatArray
    apart: float
    u: float

    @property
    def u_in_common(self) -> float:
        """Standard uncertainty of a map half way between both, of which a part has either. [mm]"""
        return math.hypot(0.5 * self.apart, self.u)

    @property
    def change(self) -> FloatArray:
        """What brings all touches half way between both, (n,), to be subtracted. [mm]"""
        return np.asarray(self.apart * (self.first - 0.5))


def first_touches(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> FirstTouches | None:
    """First touches that are apart, where this explains repeats better than other causes.

    Parameters
    ----------
    values : (n,) float
        Pretravel, in the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int

    Returns
    -------
    FirstTouches or None
        None where too few directions were touched in a row.

    >>> groups = np.repeat(np.arange(8), 3)
    >>> n = np.random.default_rng(1).standard_normal((8, 3))[groups]
    >>> n /= np.linalg.norm(n, axis=1, keepdims=True)
    >>> later = 0.002 * (np.arange(24) % 3 > 0) + 1e-5 * np.cos(np.arange(24) ** 2)
    >>> round(first_touches(later, n, groups).apart, 4)
    -0.002
    """
    first = np.append(1.0, groups[1:] != groups[:-1])
    # Each direction with touches of both sorts shows the difference once.
    count = np.bincount(groups)
    arrived = np.bincount(groups, first)
    if int(np.sum((arrived > 0.0) & (arrived < count))) < _FEWEST:
        return None
    column, order = first[:, None], np.arange(len(values), dtype=np.float64)
    drift = drift_columns(directions, order)
    before = previous_directions(directions, predecessors(order))
    memory = hysteresis_columns(directions, before)[:, :2]

    def logarithm(*columns: FloatArray) -> float:
        return logarithm_of_columns(values, np.hstack([memory[:, :0], *columns]), groups)

    own = max(logarithm(column), logarithm(column, drift))
    others = max(logarithm(), logarithm(memory), logarithm(drift), logarithm(memory, drift))
    if own < others + _BETTER:
        return None
    found = fit_within_directions(values, column, groups)
    return FirstTouches(first, float(found.value[0]), math.sqrt(float(found.covariance[0, 0])))
