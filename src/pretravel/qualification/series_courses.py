"""The course of a quantity over time: drift, random walk or scatter, and when it is too far."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.qualification.time_series import (
    FEWEST_VALUES,
    SeriesNoise,
    States,
    TimeSeries,
    column_fit,
    determined_noise,
    states_of,
    variance_about,
)

CourseKind: TypeAlias = Literal["drift", "random walk", "scatter"]
CERTAIN = 0.01
"""A trend, or a random walk, is stated where it is by chance with less than this probability."""
EARLY = 0.05
"""Probability of being beyond the limit at the early date."""
_EVEN = 0.5
HORIZON = 36525.0
"""Dates later than a century from the last value are not stated. [days]"""
_SCATTERS = np.concatenate([[0.0], np.geomspace(0.01, 30.0, 7)])
"""Variances of scatter that are weighed, in the variance of the values about their line."""
_WALKS = np.concatenate([[0.0], np.geomspace(0.1, 100.0, 10)])
"""Variances of the walk over the whole series that are weighed, in the same unit."""
_LEAST_WEIGHT = 1e-4


def weighed_noises(
    series: TimeSeries, columns: FloatArray
) -> Iterator[tuple[float, SeriesNoise, FloatArray, FloatArray]]:
    """Noises that the values of a series may have, with their probability.

    Parameters
    ----------
    series : TimeSeries
    columns : (n, p) float
        What else moves the values, with unknown coefficients; n is above p + 1.

    Yields
    ------
    float
        Probability of the noise: they add up to one. Logarithms of scatter and walk are as
        probable as others before the values are seen; each is zero with the probability of one
        step of the logarithm.
    SeriesNoise
    (p,) float each
        The coefficients for this noise, and their standard uncertainty.

    Notes
    -----
    One noise, the most probable one, would make a random walk a trend too often: the likelihood
    of a short walk is often largest without any walk.
    """
    span = max(float(np.ptp(series.times)), 1e-9)
    size = variance_about(series, columns)
    found = []
    for scatter in np.sqrt(size * _SCATTERS):
        for walk in size / span * _WALKS:
            fit = column_fit(series, columns, scatter=float(scatter), walk=float(walk))
            noise = SeriesNoise(float(scatter), float(walk), fit.log_likelihood)
            found.append((noise, fit.coefficients, fit.u))
    logs = np.array([noise.log_likelihood for noise, _, _ in found])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    kept = weights > _LEAST_WEIGHT
    share = float(weights[kept].sum())
    for row in np.flatnonzero(kept):
        yield float(weights[row]) / share, *found[row]


@dataclass(frozen=True, eq=False)
class Course:
    """How a quantity moves.

    Attributes
    ----------
    kind : str
        drift: a trend that is not chance; random walk: none, but steps that add up; scatter:
        neither.
    series : TimeSeries
    slope, u_slope : float
        Of the trend, whatever the kind. [unit/day]
    p_slope : float
        Probability that the trend has the other sign, twice.
    noise : SeriesNoise
        The most probable scatter and walk; without a trend where the kind is not drift.
    p_walk : float
        Probability of values that look as much like a walk, where there is none.
    weights : tuple of float
    states : tuple of States
        With the noises that are possible, and their probabilities; of a random walk without a
        trend.
    allowed_weights, allowed_states : tuple
        The same with a trend, whatever the kind: one that the values do not show, but allow.
    """

    kind: CourseKind
    series: TimeSeries
    slope: float
    u_slope: float
    p_slope: float
    noise: SeriesNoise
    p_walk: float
    weights: tuple[float, ...]
    states: tuple[States, ...] = field(repr=False)
    allowed_weights: tuple[float, ...]
    allowed_states: tuple[States, ...] = field(repr=False)

    @property
    def level(self) -> tuple[FloatArray, FloatArray]:
        """Expectation and standard uncertainty of the state at the times of the values, (n,)."""
        return self._moments([(s.level, s.variance) for s in self.states])

    def later(self, times: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """The same at later times. [days]"""
        return self._moments([s.later(times) for s in self.states])

    def _moments(self, parts: list[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
        weights = np.array(self.weights)[:, None]
        means = np.stack([np.atleast_1d(mean) for mean, _ in parts])
        variances = np.stack([np.atleast_1d(variance) for _, variance in parts])
        mean = np.sum(weights * means, axis=0)
        spread = np.sum(weights * (variances + (means - mean) ** 2), axis=0)
        return np.asarray(mean), np.sqrt(spread)

    def probability_beyond(
        self, limit: float, times: npt.ArrayLike, start: float = 0.0, *, allowed: bool = False
    ) -> FloatArray:
        """Probability that the state is more than a limit from a start, at later times, (m,).

        Parameters
        ----------
        limit, start : float
        times : (m,) float
            [days]
        allowed : bool
            Of a random walk: whether a trend that is not detected is taken into account.
        """
        from scipy.special import ndtr

        found = np.zeros(np.shape(np.atleast_1d(times)))
        weights, known = self.weights, self.states
        if allowed:
            weights, known = self.allowed_weights, self.allowed_states
        for weight, states in zip(weights, known, strict=True):
            mean, variance = states.later(np.atleast_1d(times))
            u = np.sqrt(np.maximum(variance, 1e-300))
            beyond = ndtr((mean - start - limit) / u) + ndtr((start - limit - mean) / u)
            found += weight * beyond
        return found


def course_of(series: TimeSeries) -> Course:
    """Decide whether a quantity drifts, walks at random, or only scatters.

    Parameters
    ----------
    series : TimeSeries
        At least `FEWEST_VALUES` values at different times.

    Returns
    -------
    Course

    Raises
    ------
    PretravelError
        Fewer values, or all at one time.

    Notes
    -----
    A trend is generalised least squares (for known uncertainties alone, the weighted line). Its
    probability is the mean over the noises that the values may have, random walks included: a walk
    looks like a trend to a line through independent errors. A random walk is stated where the
    likelihood ratio against scatter alone exceeds its limit; the walk is at its boundary there,
    so that its distribution is half that of chi-square.

    >>> days = np.arange(12.0)
    >>> rise = course_of(TimeSeries(days, 0.1 * days, np.full(12, 0.01)))
    >>> rise.kind, round(rise.slope, 6)
    ('drift', 0.1)
    """
    from scipy.special import chdtrc, ndtr

    if len(series) < FEWEST_VALUES or not np.ptp(series.times) > 0.0:
        raise PretravelError(
            f"{len(series)} values of a quantity: at least {FEWEST_VALUES} at different times are "
            "needed to tell drift from scatter"
        )
    time, level = series.times[:, None], np.empty((len(series), 0))
    weighed = list(weighed_noises(series, time))
    weights = np.array([weight for weight, *_ in weighed])
    slopes = np.array([found[0] for *_, found, _ in weighed])
    own = np.array([u[0] for *_, u in weighed])
    slope = float(weights @ slopes)
    up = float(weights @ ndtr(slopes / own))
    p_slope = min(2.0 * min(up, float(weights @ ndtr(-slopes / own))), 1.0)
    walking = determined_noise(series, level)
    still = determined_noise(series, level, walk=False)
    ratio = 2.0 * max(walking.log_likelihood - still.log_likelihood, 0.0)
    p_walk = 0.5 * float(chdtrc(1.0, ratio)) if ratio > 0.0 else 1.0
    allowed = tuple(states_of(series, noise, trend=True) for _, noise, *_ in weighed)
    kind: CourseKind = "scatter"
    if p_slope < CERTAIN:
        kind = "drift"
    elif p_walk < CERTAIN:
        kind = "random walk"
        weighed = list(weighed_noises(series, level))
    noise = determined_noise(series, time) if kind == "drift" else walking
    return Course(
        kind=kind,
        series=series,
        slope=slope,
        u_slope=math.sqrt(float(weights @ (own**2 + (slopes - slope) ** 2))),
        p_slope=p_slope,
        noise=still if kind == "scatter" else noise,
        p_walk=p_walk,
        weights=tuple(weight for weight, *_ in weighed),
        states=allowed
        if kind != "random walk"
        else tuple(states_of(series, noise, trend=False) for _, noise, *_ in weighed),
        allowed_weights=tuple(weights.tolist()),
        allowed_states=allowed,
    )


@dataclass(frozen=True)
class DueDate:
    """When a quantity is too far from where it was.

    Attributes
    ----------
    limit : float
        In the unit of the quantity.
    due : float
        Time at which it is as probably beyond the limit as within; infinite: not within
        `HORIZON`. For scatter alone always infinite. [days]
    early : float
        Time at which the probability is `EARLY`; it takes a trend into account that the values do
        not show but allow. [days]
    """

    limit: float
    due: float
    early: float


def due_date(course: Course, limit: float, start: float = 0.0) -> DueDate:
    """When the state of a quantity is beyond a limit.

    Parameters
    ----------
    course : Course
    limit : float
        Positive; distance from the start to both sides, in the unit of the quantity.
    start : float
        Value that the distance is from.

    Returns
    -------
    DueDate

    Raises
    ------
    PretravelError
        A limit that is not positive.

    >>> days = np.arange(8.0)
    >>> found = due_date(course_of(TimeSeries(days, 0.1 * days, np.full(8, 1e-6))), 1.0)
    >>> round(found.due, 3), round(found.early, 3)
    (10.0, 10.0)
    """
    if not limit > 0.0:
        raise PretravelError(
            f"the limit of a drift is {limit:g}; it is positive", inputs=("limit",)
        )
    due = math.inf if course.kind == "scatter" else _first_beyond(course, limit, start, _EVEN)
    return DueDate(limit, due, min(_first_beyond(course, limit, start, EARLY), due))


def _first_beyond(course: Course, limit: float, start: float, probability: float) -> float:
    """First time, not before the last value, at which the probability is reached. [days]"""
    from scipy.optimize import brentq

    last, allowed = float(course.series.times[-1]), probability == EARLY
    after = np.concatenate([[0.0], np.geomspace(1e-3, HORIZON, 600)])
    reached = course.probability_beyond(limit, last + after, start, allowed=allowed) >= probability
    if not reached.any():
        return math.inf
    first = int(np.argmax(reached))
    if first == 0:
        return last

    def lacking(time: float) -> float:
        beyond = course.probability_beyond(limit, last + time, start, allowed=allowed)
        return float(beyond[0]) - probability

    return last + float(brentq(lacking, after[first - 1], after[first], xtol=1e-6))
