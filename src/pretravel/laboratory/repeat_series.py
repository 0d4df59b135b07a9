"""What touches of one point say of a probe: noise, drift, the first touch, outliers, the next one.

The standard deviation of all touches contains the drift and the first touch: it is too large for
the noise, and does not predict the next touch. Here they are separated with the series of
`time_series`, whose time is the number of the touch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, PretravelError, frozen
from pretravel.qualification import (
    CERTAIN,
    OF_TOUCHES,
    Break,
    PossibleStates,
    TimeSeries,
    break_at,
    breaks_of,
    course_of,
    fitted_noises,
    weighed_noises,
)
from pretravel.touches import FEWEST_REPEATS, repeat_step, tied_step

LEVEL = 0.95
"""Probability that the next touch lies in its interval."""
_STEPS_APART = 1.5
"""Touches that differ by one step may differ by rounding alone."""
_SMALL = 1e-3
"""Uncertainty of a value, in the scatter of all: it does not matter, the noise is determined."""
_EXACT = 1e-7
"""Differences below this are rounding of numbers. [mm]"""


@dataclass(frozen=True)
class FirstTouch:
    """The first touch less what the others say of it.

    Attributes
    ----------
    size, u : float
        And its standard uncertainty. [mm]
    p_value : float
        Probability of such a difference by chance.
    """

    size: float
    u: float
    p_value: float

    @property
    def apart(self) -> bool:
        """Whether it lies apart: by chance with a probability below `CERTAIN`."""
        return self.p_value < CERTAIN


@dataclass(frozen=True, eq=False)
class RepeatSeries:
    """What the touches of one point say.

    Attributes
    ----------
    values : (n,) float
        Positions along the direction of the touches, in their order. [mm]
    kept : (n,) bool
        Touches that noise and drift come from: without the first one where it is apart, without
        outliers, and after the last jump.
    step : float
        Of the positions; zero where none is seen. [mm]
    first : FirstTouch
    outliers, jumps : tuple of Break
        Their `day` is the row of the touch. [mm]
    walks : bool
        Whether the level walks at random, beyond what is chance.
    drift, drift_u95 : float
        Change from touch to touch, and half of its interval of 95 %. [mm/touch]
    noise : float
        Standard deviation of a touch without drift: its own error, and the step of a random walk
        since the touch before. [mm]
    expected, reach : float
        The next touch lies within the reach of the expected value in 95 % of the cases. Not a
        number where all touches are equal and no step is known. [mm]
    """

    values: FloatArray
    kept: BoolArray
    step: float
    first: FirstTouch
    outliers: tuple[Break, ...]
    jumps: tuple[Break, ...]
    walks: bool
    drift: float
    drift_u95: float
    noise: float
    expected: float
    reach: float

    @property
    def plain_deviation(self) -> float:
        """Standard deviation of all touches, as firmware states it. [mm]"""
        return float(np.std(self.values, ddof=1))

    @property
    def drifts(self) -> bool:
        """Whether there is a drift: zero is not in its interval."""
        return abs(self.drift) > self.drift_u95

    @property
    def line(self) -> FloatArray:
        """Level with drift at each touch, (n,). [mm]"""
        rows = np.arange(len(self.values), dtype=np.float64)
        level = float(np.mean(self.values[self.kept]))
        return np.asarray(level + self.drift * (rows - float(np.mean(rows[self.kept]))))

    @property
    def left(self) -> FloatArray:
        """Touches that are kept less level and drift, (k,). [mm]"""
        return np.asarray((self.values - self.line)[self.kept])


def judged_repeats(values: npt.ArrayLike, *, step: float = 0.0) -> RepeatSeries:
    """Judge touches of one point, in their order.

    Parameters
    ----------
    values : (n,) float
        Positions along the direction of the touches; at least `FEWEST_REPEATS`. [mm]
    step : float
        Of the positions, where it is known; else it is looked for. [mm]

    Raises
    ------
    PretravelError
        Too few touches, or values that are not finite.

    Notes
    -----
    The next touch is predicted from the touches without the first one, whether it was found apart
    or not, with level, drift and noise unknown: a drift or a first touch that the series is too
    short to show does not make the interval too narrow. The interval is that of the mean over the
    noises that the touches may have, a random walk among them, with weights by their restricted
    likelihood. It is at least a step of the positions long to either side. It holds for touches as
    those before: an outlier or a jump is not predicted.

    >>> warming = 0.002 * np.arange(12.0) + [0.03, *(0.0005 * (-1.0) ** np.arange(11))]
    >>> found = judged_repeats(warming)
    >>> found.first.apart, found.drifts, round(found.drift, 3), bool(found.noise < 0.001)
    (True, True, 0.002, True)
    >>> found.plain_deviation > 7.0 * found.noise
    True
    """
    touches = np.asarray(values, dtype=np.float64)
    if touches.ndim != 1 or len(touches) < FEWEST_REPEATS:
        raise PretravelError(
            f"{touches.size} touches of a point; at least {FEWEST_REPEATS} are needed to "
            "distinguish noise from drift and from a first touch that differs"
        )
    if not np.isfinite(touches).all():
        raise PretravelError("a position of a touch is not a finite number")
    step = step or step_of_repeats([touches])
    u = np.full(len(touches), max(_SMALL * float(np.std(touches[1:])), _EXACT))
    breaks = [one for one in _breaks(touches, u) if abs(one.size) > _STEPS_APART * step]
    outliers = tuple(one for one in breaks if one.apart)
    jumps = tuple(one for one in breaks if not one.apart)
    usual = np.ones(len(touches), dtype=np.bool_)
    usual[[one.day for one in outliers]] = False
    first = _first_touch(touches, u, usual, jumps[0].day if jumps else len(touches))
    if abs(first.size) <= _STEPS_APART * step:
        first = replace(first, p_value=1.0)
    kept = usual & (np.arange(len(touches)) >= (jumps[-1].day if jumps else 0))
    predicting = kept.copy()
    predicting[0] = False
    kept[0] &= not first.apart
    walks, noise = _noise(touches, u, kept, step)
    drift = _drift(touches, u, kept)
    expected, reach = _next_touch(touches, u, predicting)
    return RepeatSeries(
        values=frozen(touches),
        kept=kept,
        step=step,
        first=first,
        outliers=outliers,
        jumps=jumps,
        walks=walks,
        drift=drift[0],
        drift_u95=drift[1],
        noise=noise,
        expected=expected,
        reach=max(reach, step) or math.nan,
    )


def step_of_repeats(series: Sequence[npt.ArrayLike]) -> float:
    """The step of the positions of one or more series of touches.

    Parameters
    ----------
    series : sequence of (n,) float
        Touches of one point each. [mm]

    Returns
    -------
    float
        0.0 if none is seen. [mm]

    >>> round(step_of_repeats([[1.32, 1.3175, 1.325, 1.32], [1.0, 1.0025]]), 9)
    0.0025
    """
    values = np.concatenate([np.asarray(one, dtype=np.float64) for one in series])
    groups = np.repeat(np.arange(len(series)), [np.size(one) for one in series])
    return repeat_step(values, groups) or tied_step(values, groups)


def _breaks(touches: FloatArray, u: FloatArray) -> tuple[Break, ...]:
    """Outliers and jumps beyond the first touch; a jump leaves enough touches after it."""
    rows = np.arange(len(touches), dtype=np.float64)
    if np.ptp(touches[1:]) <= _EXACT:
        return ()
    values = touches.copy()
    values[0] = math.nan
    found = breaks_of(rows, {"position": (values, u)})
    last = len(touches) - (FEWEST_REPEATS - 1)
    return tuple(one for one in found if one.apart or one.day <= last)


def _first_touch(touches: FloatArray, u: FloatArray, usual: BoolArray, end: int) -> FirstTouch:
    """Compare the first touch with those before the first jump."""
    rows = np.flatnonzero(usual & (np.arange(len(touches)) < end))
    if len(rows) < FEWEST_REPEATS - 1:
        return FirstTouch(math.nan, math.nan, 1.0)
    series = TimeSeries(rows.astype(np.float64), touches[rows], u[rows])
    size, own, p_value = break_at(series, 0, apart=True)
    return FirstTouch(size, own, p_value)


def _noise(touches: FloatArray, u: FloatArray, kept: BoolArray, step: float) -> tuple[bool, float]:
    """Whether the level walks, and the standard deviation of a touch about it. [mm]"""
    rounding = step / math.sqrt(12.0)
    if np.ptp(touches[kept]) <= _EXACT:
        return False, rounding
    series = TimeSeries(np.flatnonzero(kept).astype(np.float64), touches[kept], u[kept])
    walks = course_of(series).kind == "random walk"
    found = series.determined_noise(series.times[:, None], walk=walks)
    return walks, max(math.hypot(found.scatter, math.sqrt(found.walk)), rounding)


def _drift(touches: FloatArray, u: FloatArray, kept: BoolArray) -> tuple[float, float]:
    """Drift, and half of its interval. [mm/touch]"""
    if np.ptp(touches[kept]) <= _EXACT:
        return 0.0, math.nan
    possible, _ = _possible(touches, u, kept)
    slopes = np.array([(one.slope, one.u_slope**2) for one in possible.states])
    return _interval(possible.weights, slopes[:, 0], slopes[:, 1])


def _next_touch(touches: FloatArray, u: FloatArray, kept: BoolArray) -> tuple[float, float]:
    """The next touch, and half of its interval; zero where the touches are equal. [mm]"""
    if np.ptp(touches[kept]) <= _EXACT:
        return float(np.mean(touches[kept])), 0.0
    possible, own = _possible(touches, u, kept)
    ahead = [one.later([float(len(touches))]) for one in possible.states]
    means = np.array([float(mean[0]) for mean, _ in ahead])
    variances = np.array([float(variance[0]) for _, variance in ahead])
    return _interval(possible.weights, means, variances + own)


def _possible(
    touches: FloatArray, u: FloatArray, kept: BoolArray
) -> tuple[PossibleStates, FloatArray]:
    """The courses that the touches may have, and the variance of a touch with each."""
    series = TimeSeries(np.flatnonzero(kept).astype(np.float64), touches[kept], u[kept])
    fitted = fitted_noises(series, series.times[:, None])
    weighed = list(weighed_noises(fitted, OF_TOUCHES))
    own = np.array([one.noise.scatter**2 for _, one in weighed]) + float(u[0]) ** 2
    return PossibleStates.of(series, weighed, trend=True), own


def _interval(
    weights: Sequence[float], means: FloatArray, variances: FloatArray
) -> tuple[float, float]:
    """Mean of a mixture of normal distributions, and half its interval of 95 %."""
    from scipy.optimize import brentq
    from scipy.special import ndtr

    share, deviation = np.array(weights), np.sqrt(np.maximum(variances, 1e-300))
    mean = float(share @ means)

    def lacking(half: float) -> float:
        within = ndtr((mean + half - means) / deviation) - ndtr((mean - half - means) / deviation)
        return float(share @ within) - LEVEL

    largest = 10.0 * float(np.max(deviation + np.abs(means - mean)))
    return mean, float(brentq(lacking, 0.0, largest, xtol=1e-12))


def autocorrelation(left: npt.ArrayLike) -> FloatArray:
    """Correlation of what is left with what is left some touches later.

    Parameters
    ----------
    left : (n,) float
        Touches less level and drift.

    Returns
    -------
    (m,) float
        For one touch later, two …, up to a third of the touches; of independent errors 95 % lie
        within 2/√n of zero.

    >>> autocorrelation([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]).round(2).tolist()
    [-0.83, 0.67]
    """
    rest = np.asarray(left, dtype=np.float64)
    rest = rest - np.mean(rest)
    size = float(rest @ rest)
    lags = range(1, len(rest) // 3 + 1)
    return np.array([float(rest[lag:] @ rest[:-lag]) / size if size else 0.0 for lag in lags])


def touches_before_drift(series: RepeatSeries) -> int:
    """Touches whose drift is as large as the noise of one: more of them no longer help a mean.

    Returns
    -------
    int
        At least one; zero without a drift.
    """
    if not series.drifts or not series.drift:
        return 0
    return max(int(series.noise / abs(series.drift)), 1)
