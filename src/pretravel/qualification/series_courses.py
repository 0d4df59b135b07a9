"""The course of a quantity over time: drift, random walk or scatter, and when it is too far."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.qualification.time_series import (
    FEWEST_VALUES,
    SeriesNoise,
    States,
    TimeSeries,
    column_fit,
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
_SCATTERS = np.concatenate([[0.0], np.geomspace(0.03, 300.0, 9)])
"""Variances of scatter that are weighed, in the variance of the values about their line."""
_WALKS = np.concatenate([[0.0], np.geomspace(0.1, 100.0, 10)])
"""Variances of the walk over the whole series that are weighed, in the same unit."""
_LEAST_WEIGHT = 1e-4
_WALK_SHARE = 0.003
"""Probability, before the values are seen, that a quantity walks at random about its trend."""
_EXACT_SHARE = 0.5
"""Probability that the stated uncertainties are all that days without a walk scatter by."""
_CLEAR_WALK = 4.0
"""Least of `_WALKS` of a quantity that walks at random; a smaller walk hardly moves a slope."""


def _even_noises(*, scattering: bool, walking: bool) -> FloatArray:
    """The noises with or without scatter and walk, all alike, (scatters, walks)."""
    scatters = (_SCATTERS > 0.0) == scattering
    walks = _WALKS >= _CLEAR_WALK if walking else _WALKS == 0.0
    found = np.outer(scatters, walks).astype(np.float64)
    return np.asarray(found / found.sum())


_ANY: FloatArray = frozen(
    np.full((len(_SCATTERS), len(_WALKS)), 1.0 / (len(_SCATTERS) * len(_WALKS)))
)
"""Any noise: what a trend or a break must not be mistaken for."""
_OF_WALKS: FloatArray = frozen(
    0.5
    * (_even_noises(scattering=False, walking=True) + _even_noises(scattering=True, walking=True))
)
"""Of a quantity that walks at random about its trend."""
_OF_LINES: FloatArray = frozen(
    _EXACT_SHARE * _even_noises(scattering=False, walking=False)
    + (1.0 - _EXACT_SHARE) * _even_noises(scattering=True, walking=False)
)
"""Of a straight trend: errors of the stated uncertainties, or with scatter next to them."""
OF_TOUCHES: FloatArray = frozen(0.9 * _OF_LINES + 0.1 * _OF_WALKS)
"""Of touches of one point, one after the other: a walk is rarer than independent errors."""
_USUAL: FloatArray = frozen((1.0 - _WALK_SHARE) * _OF_LINES + _WALK_SHARE * _OF_WALKS)


@dataclass(frozen=True, eq=False)
class FittedNoise:
    """Columns that were fitted to a series with one noise.

    Attributes
    ----------
    noise : SeriesNoise
    coefficients, u : (p,) float
        Of the columns, and their standard uncertainty for this noise.
    """

    noise: SeriesNoise
    coefficients: FloatArray
    u: FloatArray


def fitted_noises(series: TimeSeries, columns: FloatArray) -> list[FittedNoise]:
    """Every noise that the values of a series may have, with the columns fitted.

    Parameters
    ----------
    series : TimeSeries
    columns : (n, p) float
        What else moves the values, with unknown coefficients; n is above p + 1.

    Returns
    -------
    list of FittedNoise
        Scatters in turn, of each all walks.
    """
    span = max(float(np.ptp(series.times)), 1e-9)
    size = variance_about(series, columns)
    found = []
    for scatter in np.sqrt(size * _SCATTERS):
        for walk in size / span * _WALKS:
            fit = column_fit(series, columns, scatter=float(scatter), walk=float(walk))
            noise = SeriesNoise(float(scatter), float(walk), fit.log_likelihood)
            found.append(FittedNoise(noise, fit.coefficients, fit.u))
    return found


def weighed_noises(
    fitted: Sequence[FittedNoise], prior: FloatArray = _ANY
) -> Iterator[tuple[float, FittedNoise]]:
    """The noises that are possible, with their probability.

    Parameters
    ----------
    fitted : sequence of FittedNoise
    prior : (scatters, walks) float
        Probability before the values are seen. By default logarithms of scatter and walk are as
        probable as others; each is zero with the probability of one step of the logarithm.

    Yields
    ------
    float
        They add up to one.
    FittedNoise

    Notes
    -----
    One noise, the most probable one, would make a random walk a trend too often: the likelihood
    of a short walk is often largest without any walk.
    """
    weights = _probabilities(fitted, prior)
    kept = weights > _LEAST_WEIGHT
    share = float(weights[kept].sum())
    for row in np.flatnonzero(kept).tolist():
        yield float(weights[row]) / share, fitted[row]


def _probabilities(fitted: Sequence[FittedNoise], prior: FloatArray) -> FloatArray:
    logs = np.array([one.noise.log_likelihood for one in fitted])
    known = prior.ravel() > 0.0
    weights = np.zeros(len(logs))
    weights[known] = prior.ravel()[known] * np.exp(logs[known] - logs[known].max())
    return np.asarray(weights / weights.sum())


@dataclass(frozen=True, eq=False)
class PossibleStates:
    """The states of a quantity with each noise that its values may have.

    Attributes
    ----------
    weights : tuple of float
        Probability of each noise.
    states : tuple of States
    """

    weights: tuple[float, ...]
    states: tuple[States, ...] = field(repr=False)

    @staticmethod
    def of(
        series: TimeSeries, weighed: Sequence[tuple[float, FittedNoise]], *, trend: bool
    ) -> PossibleStates:
        """Of noises and their probabilities, with a trend or without."""
        states = tuple(states_of(series, one.noise, trend=trend) for _, one in weighed)
        return PossibleStates(tuple(weight for weight, _ in weighed), states)

    @property
    def slope(self) -> tuple[float, float]:
        """The trend and its standard uncertainty; zero without one. [unit/day]"""
        mean, u = self._moments(
            [(np.array([s.slope]), np.array([s.u_slope**2])) for s in self.states]
        )
        return float(mean[0]), float(u[0])

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
        return mean, np.sqrt(np.sum(weights * (variances + (means - mean) ** 2), axis=0))

    def probability_beyond(
        self, limit: float, times: npt.ArrayLike, start: float = 0.0
    ) -> FloatArray:
        """Probability that the state is farther than the limit from a start, either side, (n,).

        Parameters
        ----------
        limit, start : float
            In the unit of the quantity.
        times : (n,) float
            After the last value. [days]
        """
        from scipy.special import ndtr

        found = np.zeros(np.shape(np.atleast_1d(times)))
        for weight, states in zip(self.weights, self.states, strict=True):
            mean, variance = states.later(np.atleast_1d(times))
            u = np.sqrt(np.maximum(variance, 1e-300))
            beyond = ndtr((mean - start - limit) / u) + ndtr((start - limit - mean) / u)
            found += weight * beyond
        return found


@dataclass(frozen=True, eq=False)
class Course:
    """How a quantity moves.

    Attributes
    ----------
    kind : str
        drift: a trend that is not chance; random walk: none, but steps that add up; scatter:
        neither.
    series : TimeSeries
    p_slope : float
        Probability that the trend has the other sign, twice, whatever the noise: a random walk
        may look like a trend.
    noise : SeriesNoise
        The most probable scatter and walk; without a trend where the kind is not drift.
    p_walk : float
        Probability of values that look as much like a walk, where there is none.
    expected : PossibleStates
        Of a random walk without a trend.
    allowed : PossibleStates
        With a trend, whatever the kind: one that the values do not show, but allow. Its slope is
        the one that is stated. The errors of the days are independent, unless the values show a
        walk; of a random walk the noise is any.
    walking : PossibleStates
        The same if the quantity walks at random about its trend, which few days do not tell.
    walk_share : float
        Probability that it does, where both are alike before the values are seen.
    """

    kind: CourseKind
    series: TimeSeries
    p_slope: float
    noise: SeriesNoise
    p_walk: float
    expected: PossibleStates
    allowed: PossibleStates
    walking: PossibleStates
    walk_share: float

    @property
    def slope(self) -> float:
        """Of the trend, whatever the kind. [unit/day]"""
        return self.allowed.slope[0]

    @property
    def u_slope(self) -> float:
        """Standard uncertainty of the trend. [unit/day]"""
        return self.allowed.slope[1]

    @property
    def walking_or_not(self) -> PossibleStates:
        """`allowed` and `walking`, with the probability of each."""
        parts = ((1.0 - self.walk_share, self.allowed), (self.walk_share, self.walking))
        return PossibleStates(
            tuple(share * weight for share, part in parts for weight in part.weights),
            tuple(state for _, part in parts for state in part.states),
        )

    @property
    def may_walk(self) -> bool:
        """Whether the values leave open that the quantity walks at random."""
        return self.walk_share > EARLY


def course_of(series: TimeSeries) -> Course:
    """Decide whether a quantity drifts, walks at random, or only scatters.

    Parameters
    ----------
    series : TimeSeries
        At least `FEWEST_VALUES` values at different times.

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

    No interval of a slope from five to ten days is right for both, errors of the days that are
    independent and a random walk: the days do not distinguish them, and with a walk the slope is
    two to four times less certain. The one that is stated, `Course.allowed`, is that of independent
    errors, unless a walk explains the values three hundred times as well; that of a walk is
    `Course.walking`.

    >>> days = np.arange(12.0)
    >>> rise = course_of(TimeSeries(days, 0.1 * days, np.full(12, 0.01)))
    >>> rise.kind, round(rise.slope, 6)
    ('drift', 0.1)
    """
    from scipy.special import chdtrc, ndtr

    if len(series) < FEWEST_VALUES or not np.ptp(series.times) > 0.0:
        raise PretravelError(
            f"{len(series)} values of a quantity: at least {FEWEST_VALUES} at different times are "
            "needed to distinguish drift from scatter"
        )
    time, level = series.times[:, None], np.empty((len(series), 0))
    fitted = fitted_noises(series, time)
    up = sum(w * ndtr(np.array([1.0, -1.0]) * one.coefficients[0] / one.u[0])
             for w, one in weighed_noises(fitted))  # fmt: skip
    p_slope = min(2.0 * float(np.min(up)), 1.0)
    walking = series.determined_noise(level)
    still = series.determined_noise(level, walk=False)
    ratio = 2.0 * max(walking.log_likelihood - still.log_likelihood, 0.0)
    p_walk = 0.5 * float(chdtrc(1.0, ratio)) if ratio > 0.0 else 1.0
    kind: CourseKind = "scatter"
    if p_slope < CERTAIN:
        kind = "drift"
    elif p_walk < CERTAIN:
        kind = "random walk"
    allowed = _with_trend(series, fitted, _ANY if kind == "random walk" else _USUAL)
    expected = allowed
    if kind == "random walk":
        weighed = list(weighed_noises(fitted_noises(series, level)))
        expected = PossibleStates.of(series, weighed, trend=False)
    noise = series.determined_noise(time) if kind == "drift" else walking
    either = _probabilities(fitted, 0.5 * (_OF_LINES + _OF_WALKS))
    return Course(
        kind=kind,
        series=series,
        p_slope=p_slope,
        noise=still if kind == "scatter" else noise,
        p_walk=p_walk,
        expected=expected,
        allowed=allowed,
        walking=_with_trend(series, fitted, _OF_WALKS),
        walk_share=float(either[_OF_WALKS.ravel() > 0.0].sum()),
    )


def _with_trend(
    series: TimeSeries, fitted: Sequence[FittedNoise], prior: FloatArray
) -> PossibleStates:
    return PossibleStates.of(series, list(weighed_noises(fitted, prior)), trend=True)


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
        not show but allow, and a random walk, with the probability that the values leave it: with
        errors of the days alone a quantity that walks passed it in 12 to 30 % of simulated
        series of 10 and 20 days, now in 3 to 10 %. [days]
    early_if_walking : float
        The same if the quantity walks at random about its trend; not after `early`, and equal to
        it where the values exclude such a walk. [days]
    """

    limit: float
    due: float
    early: float
    early_if_walking: float


def due_date(course: Course, limit: float, start: float = 0.0) -> DueDate:
    """When the state of a quantity is beyond a limit.

    Parameters
    ----------
    course : Course
    limit : float
        Positive; distance from the start to both sides, in the unit of the quantity.
    start : float
        Value that the distance is from.

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
            f"the limit of a drift is {limit:g}; it must be positive", inputs=("limit",)
        )
    last, beyond = float(course.series.times[-1]), (limit, start)
    due = math.inf
    if course.kind != "scatter":
        due = _first_beyond(course.expected, last, beyond, _EVEN)
    early = min(_first_beyond(course.walking_or_not, last, beyond, EARLY), due)
    walking = early
    if course.may_walk:
        walking = min(_first_beyond(course.walking, last, beyond, EARLY), early)
    return DueDate(limit, due, early, walking)


def _first_beyond(
    possible: PossibleStates, last: float, beyond: tuple[float, float], probability: float
) -> float:
    """First time, not before the last value, at which the probability is reached. [days]

    `beyond` has the limit, and the start that it counts from.
    """
    from scipy.optimize import brentq

    limit, start = beyond
    after = np.concatenate([[0.0], np.geomspace(1e-3, HORIZON, 600)])
    reached = possible.probability_beyond(limit, last + after, start) >= probability
    if not reached.any():
        return math.inf
    first = int(np.argmax(reached))
    if first == 0:
        return last

    def lacking(time: float) -> float:
        return float(possible.probability_beyond(limit, last + time, start)[0]) - probability

    return last + float(brentq(lacking, after[first - 1], after[first], xtol=1e-6))
