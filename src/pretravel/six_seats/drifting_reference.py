"""A reference that drifts while a six-seat probe is qualified: an explanation of its residuals.

Repeats in a row do not show a drift. The forms that a six-seat probe can have do: directions that
were touched later are then moved against the earlier ones, as no tripod moves them.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.maps import Observation, ReferenceDrift
from pretravel.six_seats.six_seat_fit import PriorScales, SixSeatProblem, modes

_USUAL = 5.0 * MICROMETRE
"""Standard deviation in advance of each component of a drift."""
_ASYMMETRIES = (0.3, 1.0, 3.0)
"""Scales that are compared, where nothing but the drift differs from a six-seat probe."""
_NO_CORRECTION = 0.05 * MICROMETRE
_BETTER = 3.0
"""Logarithm of the odds from which a drift is the explanation: 6 µm have 10 to 16, lobes that are
not of six seats less than -200."""


class _Drifting(SixSeatProblem):
    """The unknowns of a six-seat probe, and after centre and tip a drift of the reference."""

    def __init__(self, observation: Observation, times: FloatArray) -> None:
        super().__init__(observation)
        self.still = SixSeatProblem(observation)
        self._times = np.bincount(observation.groups, times) / self.count
        self.drift = slice(self.extra, self.extra + self.axes)
        self.extra += self.axes
        self.size += self.axes
        self.azimuth += self.axes

    def slopes_and_misses(self, x: FloatArray) -> FloatArray:
        values, slopes = self.still.misses(np.delete(x, self.drift, axis=-1))
        # A centre moved by s adds n·s; the drift is that of pretravel, which is smaller then.
        later = -slopes[..., : self.axes] * self._times[:, None]
        values = values + np.einsum("...ga,...a->...g", later, x[..., self.drift])
        at = self.drift.start
        parts = [slopes[..., :at], later, slopes[..., at:], values[..., None]]
        return np.concatenate(parts, axis=-1)


def drift_beside_seats(
    observation: Observation, times: FloatArray, x: FloatArray, scales: PriorScales
) -> ReferenceDrift | None:
    """The drift that explains touches better than a form which six seats do not represent.

    The more probable one of a steady drift and one that slows down.

    Parameters
    ----------
    observation : Observation
    times : (n,) float
        Of the touches, from -1/2 to 1/2.
    x : (u,) float
        Unknowns of the fit without a drift.
    scales : PriorScales
        Of that fit.

    Returns
    -------
    ReferenceDrift or None
    """
    still = SixSeatProblem(observation)
    needed = float(modes(still, [scales], x[None]).evidence[0]) + _BETTER
    drift = None
    for slows in (False, True):
        drifting = _Drifting(observation, ReferenceDrift.course(times, slows=slows))
        evidence, found, covariance = _most_probable(drifting, x, scales)
        if evidence > needed:
            needed, drift = evidence, ReferenceDrift(found, covariance, slows)
    return drift


def _most_probable(
    drifting: _Drifting, x: FloatArray, scales: PriorScales
) -> tuple[float, FloatArray, FloatArray]:
    """Logarithm of the evidence of a drift, its value, and its covariance."""
    tried = [
        replace(scales, asymmetry=size, correction=_NO_CORRECTION, fixed_scatter=0.0)
        for size in _ASYMMETRIES
    ]
    start = np.insert(x, [drifting.drift.start] * drifting.axes, 0.0)
    found = modes(drifting, tried, np.tile(start, (len(tried), 1)))
    value = found.x[:, drifting.drift]
    in_advance = -0.5 * np.sum((value / _USUAL) ** 2, axis=1) - drifting.axes * math.log(_USUAL)
    evidence = found.evidence + in_advance
    best = int(np.argmax(evidence))
    covariance = drifting.covariance_at(found.x[best], tried[best])
    return float(evidence[best]), value[best], covariance[drifting.drift, drifting.drift]
