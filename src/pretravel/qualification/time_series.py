"""A quantity that is determined again and again: its scatter, its random walk, its trend.

Value i is the state at time i with an error of its own. The state is a level, a straight trend and
a random walk; the errors are independent, of the stated uncertainty and a scatter between days that
it does not contain. What is common to all values, such as the error of a calibrated diameter, is in
the level: it is neither drift nor scatter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, PretravelError, frozen

FEWEST_VALUES = 3
"""A line through two values leaves nothing that tells its uncertainty."""
_TINY = 1e-12
"""Of the variances of a series: an uncertainty below the square root of this does not matter."""


@dataclass(frozen=True, eq=False)
class TimeSeries:
    """Values of one quantity in the order of their times.

    Attributes
    ----------
    times : (n,) float
        Not decreasing. [days]
    values : (n,) float
        In any unit.
    u : (n,) float
        Standard uncertainty of each, of errors that the others do not share.

    Raises
    ------
    PretravelError
        Arrays of different lengths; values that are not finite; an uncertainty that is not
        positive; times that decrease.
    """

    times: FloatArray
    values: FloatArray
    u: FloatArray

    def __post_init__(self) -> None:
        for name in ("times", "values", "u"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        if not len(self.times) == len(self.values) == len(self.u):
            raise PretravelError(
                f"{len(self.times)} times, {len(self.values)} values and {len(self.u)} "
                "uncertainties: each value has one time and one uncertainty"
            )
        if not (np.isfinite(self.times).all() and np.isfinite(self.values).all()):
            raise PretravelError("a time or a value of a series is not a finite number")
        if not (np.isfinite(self.u) & (self.u > 0.0)).all():
            raise PretravelError(
                "an uncertainty of a series is not positive; give the standard uncertainty of "
                "each value"
            )
        if np.any(np.diff(self.times) < 0.0):
            raise PretravelError("the times of a series decrease; put the values in their order")

    def __len__(self) -> int:
        return len(self.times)

    def take(self, kept: BoolArray) -> TimeSeries:
        """The values of a mask."""
        return TimeSeries(self.times[kept], self.values[kept], self.u[kept])

    def determined_noise(self, columns: FloatArray, *, walk: bool = True) -> SeriesNoise:
        """Scatter and random walk by restricted maximum likelihood.

        Parameters
        ----------
        columns : (n, p) float
            What else moves the values, such as a trend; n is above p + 1.
        walk : bool
            Whether there may be a random walk.

        Returns
        -------
        SeriesNoise
            Zero where the stated uncertainties explain the values.

        References
        ----------
        H. D. Patterson and R. Thompson, Biometrika 58 (1971) 545: restricted maximum likelihood.

        >>> still = TimeSeries(np.arange(5.0), [0.1, -0.1, 0.1, -0.1, 0.1], np.full(5, 0.2))
        >>> still.determined_noise(np.empty((5, 0))).scatter
        0.0
        """
        from scipy.optimize import minimize

        size = variance_about(self, columns)
        length = max(float(np.ptp(self.times)), _TINY)
        units = np.array([size, size / length * len(self)])
        smallest = TimeSeries(self.times, self.values, np.maximum(self.u, math.sqrt(_TINY * size)))

        def cost(shares: FloatArray) -> float:
            s2, q = np.maximum(shares, 0.0) * units
            return -column_fit(smallest, columns, scatter=math.sqrt(s2), walk=q).log_likelihood

        top = 10.0 if walk else 0.0
        starts = [(1e-3, 0.0), (0.5, 0.0), *(((1e-6, 0.3), (0.1, 0.05)) if walk else ())]
        best, least = np.zeros(2), cost(np.zeros(2))
        for start in starts:
            found = minimize(cost, start, method="L-BFGS-B", bounds=[(0.0, 10.0), (0.0, top)])
            if found.fun < least - 1e-9:
                best, least = np.asarray(found.x), float(found.fun)
        return SeriesNoise(math.sqrt(best[0] * units[0]), float(best[1] * units[1]), -least)


def series_of(times: npt.ArrayLike, values: npt.ArrayLike, u: npt.ArrayLike) -> TimeSeries:
    """A series of what is known: values and uncertainties that are not numbers are left out.

    >>> len(series_of([0.0, 1.0], [2.0, np.nan], [0.1, 0.1]))
    1
    """
    t, y, own = (np.asarray(part, dtype=np.float64) for part in (times, values, u))
    known = np.isfinite(y) & np.isfinite(own)
    return TimeSeries(t[known], y[known], own[known])


@dataclass(frozen=True)
class SeriesNoise:
    """What moves the values of a series in addition to a trend.

    Attributes
    ----------
    scatter : float
        Standard deviation between days beyond the stated uncertainties.
    walk : float
        Variance of the random walk in a day. [unit²/day]
    log_likelihood : float
        Restricted: of the values with level and trend integrated out, less a constant.
    """

    scatter: float
    walk: float
    log_likelihood: float = math.nan


@dataclass(frozen=True, eq=False)
class Whitened:
    """The differences of neighbouring values, with their covariance factored.

    Differences do not contain the level. Their covariance has one diagonal next to the main one.

    Attributes
    ----------
    pivots : (n - 1,) float
        D of the covariance L D Lᵀ.
    factors : (n - 2,) float
        Below the diagonal of L.
    """

    pivots: FloatArray
    factors: FloatArray

    @staticmethod
    def of(series: TimeSeries, scatter: float, walk: float) -> Whitened:
        """Of the errors of a series: (n - 1) differences."""
        from scipy.linalg.lapack import dpttrf

        own = series.u**2 + scatter**2
        main = own[:-1] + own[1:] + walk * (series.times[1:] - series.times[:-1])
        pivots, beside, fault = dpttrf(main, _at_least_one(-own[1:-1]))
        if fault:
            raise np.linalg.LinAlgError("the covariance of differences is not positive definite")
        return Whitened(pivots, beside[: len(main) - 1])

    def solved(self, columns: FloatArray) -> FloatArray:
        """Inverse of the covariance times columns, (n - 1, p)."""
        from scipy.linalg.lapack import dpttrs

        return np.asarray(dpttrs(self.pivots, _at_least_one(self.factors), columns)[0])

    @property
    def log_determinant(self) -> float:
        """Of the covariance."""
        return float(np.log(self.pivots).sum())

    def inverse_bands(self) -> tuple[FloatArray, FloatArray]:
        """Main diagonal (n - 1,) and the one next to it (n - 2,) of the inverse."""
        main = np.empty(len(self.pivots))
        main[-1] = 1.0 / self.pivots[-1]
        for i in range(len(main) - 2, -1, -1):
            main[i] = 1.0 / self.pivots[i] + self.factors[i] ** 2 * main[i + 1]
        return main, -self.factors * main[1:]


def _at_least_one(beside: FloatArray) -> FloatArray:
    """LAPACK's functions take one value next to the diagonal of a single row, and ignore it."""
    return beside if len(beside) else np.zeros(1)


@dataclass(frozen=True, eq=False)
class ColumnFit:
    """Generalised least squares of a series on columns, its level free.

    Attributes
    ----------
    coefficients, u : (p,) float
    log_likelihood : float
        Restricted, less a constant.
    """

    coefficients: FloatArray
    u: FloatArray
    log_likelihood: float


def column_fit(
    series: TimeSeries, columns: FloatArray, *, scatter: float = 0.0, walk: float = 0.0
) -> ColumnFit:
    """Fit columns to a series with a given noise.

    Parameters
    ----------
    series : TimeSeries
    columns : (n, p) float
        Functions of time; p may be zero.
    scatter, walk : float
        As in `SeriesNoise`.
    """
    whitened = Whitened.of(series, scatter, walk)
    both = np.concatenate([series.values[:, None], columns], axis=1)
    both = both[1:] - both[:-1]
    y, x, seen = both[:, 0], both[:, 1:], whitened.solved(both)
    logs = whitened.log_determinant
    rest = float(y @ seen[:, 0])
    if not x.shape[1]:
        return ColumnFit(np.empty(0), np.empty(0), -0.5 * (logs + rest))
    information, push = x.T @ seen[:, 1:], x.T @ seen[:, 0]
    covariance = np.linalg.inv(information)
    found = covariance @ push
    logs += float(np.linalg.slogdet(information)[1])
    rest -= float(push @ found)
    return ColumnFit(found, np.sqrt(np.diagonal(covariance)), -0.5 * (logs + rest))


def variance_about(series: TimeSeries, columns: FloatArray) -> float:
    """Variance of values about level and columns; at least a part of that of their uncertainties.

    Parameters
    ----------
    series : TimeSeries
    columns : (n, p) float
    """
    design = np.column_stack([np.ones(len(series)), columns])
    scale = np.linalg.norm(design, axis=0)
    solved = np.linalg.lstsq(design / scale, series.values, rcond=None)[0]
    left = series.values - (design / scale) @ solved
    free = max(len(series) - design.shape[1], 1)
    return float(max(left @ left / free, 0.1 * np.mean(series.u**2)))


@dataclass(frozen=True, eq=False)
class States:
    """What a series says of its quantity at its own times and later.

    Attributes
    ----------
    times, level, variance : (n,) float
        State at each time, and the variance of it.
    slope, u_slope : float
        Of the trend, zero without one. [unit/day]
    center : float
        Time at which level and slope of the last state are not correlated; zero without a trend.
        [days]
    own : float
        Variance of the last state if the slope were known.
    walk : float
    """

    times: FloatArray
    level: FloatArray
    variance: FloatArray
    slope: float
    u_slope: float
    center: float
    own: float
    walk: float

    def later(self, times: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Expectation and variance of the state at later times. [days]"""
        t = np.asarray(times, dtype=np.float64)
        last = self.times[-1]
        mean = self.level[-1] + self.slope * (t - last)
        spread = self.own + self.walk * (t - last) + (self.u_slope * (t - self.center)) ** 2
        return np.asarray(mean), np.asarray(spread)


def states_of(series: TimeSeries, noise: SeriesNoise, *, trend: bool) -> States:
    """States of a series with a given noise (Kalman filter, Rauch-Tung-Striebel smoother).

    Parameters
    ----------
    series : TimeSeries
    noise : SeriesNoise
    trend : bool
        Whether there is one; it is estimated with the level.

    >>> line = TimeSeries(np.arange(4.0), 2.0 * np.arange(4.0), np.ones(4))
    >>> round(states_of(line, SeriesNoise(0.0, 0.0), trend=True).slope, 9)
    2.0
    """
    steps = np.diff(series.times, prepend=series.times[0])
    own = series.u**2 + noise.scatter**2
    columns = np.column_stack([series.values, series.times if trend else 0.0 * series.times])
    means, variances = np.empty_like(columns), np.empty(len(series))
    mean, variance = columns[0], own[0]
    information, push = 0.0, 0.0
    for i, column in enumerate(columns):
        if i:
            variance = variance + noise.walk * steps[i]
            expected = variance + own[i]
            innovation = column - mean
            information += innovation[1] ** 2 / expected
            push += innovation[0] * innovation[1] / expected
            gain = variance / expected
            mean, variance = mean + gain * innovation, variance * (1.0 - gain)
        means[i], variances[i] = mean, variance
    slope = push / information if information > 0.0 else 0.0
    u_slope = 1.0 / math.sqrt(information) if information > 0.0 else 0.0
    center, last = float(means[-1, 1]), float(variances[-1])
    _smooth(means, variances, noise.walk * steps)
    away = series.times - means[:, 1]
    return States(
        times=series.times,
        level=frozen(means[:, 0] + slope * away),
        variance=frozen(variances + (u_slope * away) ** 2),
        slope=float(slope),
        u_slope=float(u_slope),
        center=center,
        own=last,
        walk=noise.walk,
    )


def _smooth(means: FloatArray, variances: FloatArray, added: FloatArray) -> None:
    """Use the later values too, in place; `added` is the variance of the walk before each."""
    for i in range(len(means) - 2, -1, -1):
        ahead = variances[i] + added[i + 1]
        gain = variances[i] / ahead
        means[i] = means[i] + gain * (means[i + 1] - means[i])
        variances[i] = variances[i] + gain**2 * (variances[i + 1] - ahead)
