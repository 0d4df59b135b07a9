"""A reference that drifts while a six-seat probe is qualified: an explanation of its residuals.

Repeats in a row do not show a drift. The forms that a six-seat probe can have do: directions that
were touched later are then moved against the earlier ones, as no tripod moves them.
"""

from __future__ import annotations

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
    """Logarithm of the evidence of a drift, its value, and its covariance.

    Touches may not determine the drift: one along the axis, where only pole and equator were
    touched. There it stays the usual one.
    """
    tried = [
        replace(scales, asymmetry=size, correction=_NO_CORRECTION, fixed_scatter=0.0)
        for size in _ASYMMETRIES
    ]
    start = np.insert(x, [drifting.drift.start] * drifting.axes, 0.0)
    found = modes(drifting, tried, np.tile(start, (len(tried), 1)))
    value = found.x[:, drifting.drift]
    covariance = np.array(
        [
            drifting.covariance_at(x, scales)[drifting.drift, drifting.drift]
            for x, scales in zip(found.x, tried, strict=True)
        ]
    )
    with_usual = [_with_usual(own, u) for own, u in zip(value, covariance, strict=True)]
    evidence = found.evidence + [chance for chance, *_ in with_usual]
    best = int(np.argmax(evidence))
    _, drift, of_drift = with_usual[best]
    return float(evidence[best]), drift, of_drift


def _with_usual(value: FloatArray, covariance: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Logarithm of the chance of a drift in advance, and the drift with what is usual, with u.

    Normal distributions of the touches and of usual drifts, multiplied.

    Parameters
    ----------
    value : (a,) float
        By the touches alone. [mm]
    covariance : (a, a) float
        [mm²]

    >>> _, drift, u = _with_usual(np.array([0.004, 90.0]), np.diag([1e-14, 1e8]))
    >>> drift.round(6).tolist(), np.sqrt(np.diag(u)).round(6).tolist()
    ([0.004, 0.0], [0.0, 0.005])
    """
    usual = _USUAL**2 * np.eye(len(value))
    both = np.linalg.inv(covariance + usual)
    chance = -0.5 * float(value @ both @ value) + 0.5 * float(np.linalg.slogdet(both)[1])
    return chance, usual @ both @ value, usual @ both @ covariance
