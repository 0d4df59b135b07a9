"""Noise of touches by direction: scatter that differs, heavy tails, the step of the positions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import FloatArray
from pretravel.maps import Observation, Scatter

_FEWEST_COMPARED = 4
"""Repeated directions from which their scatters are compared with each other."""
_TRIMMED = 0.1
"""Share of the directions, those that scatter most, that are left out of the trimmed scatter."""
_USUAL_TAILS = 0.2
"""Relative variance of the directions' variances that is assumed, added to the one that is seen.

It is that of three touches with the tails of Student's t with seven degrees of freedom, which 25
directions do not show."""
_LEAST_SCATTER = 1e-8
"""Rounding of numbers. [mm]"""
_LARGEST_RATIO = 1.0
"""Scatters up to this many steps are looked up; beyond them repeats share nothing of a step."""


@dataclass(frozen=True, eq=False)
class TouchNoise:
    """Noise of touches in g directions.

    Attributes
    ----------
    scatter : Scatter
        Among repeats, all directions together. Heavy tails and differences between the directions
        reduce its degrees of freedom; zero without repeats.
    trimmed : float
        Standard deviation among repeats without the directions that scatter most. [mm]
    variances : (g,) float
        Of a single touch in each direction among its repeats. [mm²]
    raw_variances : (g,) float
        The same without shrinkage: unbiased, but uncertain. [mm²]
    spreads : (g,) float
        Relative variance of each of `variances`, in addition to that of all together.
    counts : (g,) float
        Touches.
    fixed_variance : float
        What all touches of a direction have in common: a step of the positions. [mm²]
    """

    scatter: Scatter
    trimmed: float
    variances: FloatArray
    raw_variances: FloatArray
    spreads: FloatArray
    counts: FloatArray
    fixed_variance: float

    @property
    def of_means(self) -> FloatArray:
        """Variance of the mean touch of each direction, (g,). [mm²]"""
        return np.asarray(self.variances / self.counts + self.fixed_variance)

    @property
    def relative(self) -> FloatArray:
        """Variance of a touch in each direction over that of all, at least one, (g,)."""
        return np.maximum(self.variances / float(np.mean(self.variances)), 1.0)

    def pooled_with(self, other: Scatter) -> TouchNoise:
        """With the scatter of other touches of the same kind, by their degrees of freedom."""
        own, others = self.scatter.deviation**2, other.deviation**2
        share = self.scatter.dof / (self.scatter.dof + other.dof)
        pooled = share * own + (1.0 - share) * others
        alike = np.full(len(self.counts), pooled)
        return replace(
            self,
            scatter=Scatter(math.sqrt(pooled), self.scatter.dof + other.dof),
            variances=self.variances * (pooled / own) if own else alike,
            raw_variances=self.raw_variances * (pooled / own) if own else alike,
        )


def touch_noise(observation: Observation, assumed: Scatter, step: float) -> TouchNoise:
    """Noise of touches, by direction where the directions differ.

    The variance of a direction is its own, shrunk towards that of all directions. How far depends
    on how much the variances of the directions differ beyond chance (empirical Bayes: variances
    with an inverse gamma distribution, whose spread follows from moments).

    Parameters
    ----------
    observation : Observation
    assumed : Scatter
        Of a touch, used where no direction was repeated.
    step : float
        Of the positions; zero where they have none. [mm]

    References
    ----------
    G. K. Smyth, Statistical Applications in Genetics and Molecular Biology 3 (2004): shrinkage of
    variances.

    >>> touches = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 3.002]])
    >>> seen = Observation(touches, np.array([0, 0]), np.zeros(3), 1.0, 2.0, ring=False)
    >>> round(float(np.sqrt(touch_noise(seen, Scatter(0.001, 9.0), 0.0).of_means[0])), 6)
    0.001
    """
    counts = np.bincount(observation.groups).astype(np.float64)
    mean = np.bincount(observation.groups, observation.values) / counts
    apart = observation.values - mean[observation.groups]
    squares = np.asarray(np.bincount(observation.groups, apart**2), dtype=np.float64)
    free = np.asarray(counts - 1.0, dtype=np.float64)
    total = float(free.sum())
    if total == 0.0:
        alike = np.full(len(counts), assumed.deviation**2)
        return TouchNoise(
            scatter=Scatter(0.0, 0.0),
            trimmed=0.0,
            variances=alike,
            raw_variances=alike,
            spreads=np.zeros(len(counts)),
            counts=counts,
            fixed_variance=fixed_part(assumed.deviation, step),
        )
    pooled = float(squares.sum()) / total
    spread = _spread(squares, free, pooled)
    shares = free / total
    chance = 2.0 / np.maximum(free, 1.0)
    tails = spread + _USUAL_TAILS
    dof = 2.0 / float(np.sum(shares**2 * (chance + tails * (1.0 + chance))))
    # An inverse gamma distribution with this relative variance is that of so many observations.
    prior = 4.0 + 2.0 / spread if spread else math.inf
    weight = free / (prior - 2.0 + free)
    raw = np.where(free > 0.0, squares / np.maximum(free, 1.0), pooled)
    # Repeats that are all equal say that the scatter is below the digits, not that there is none.
    pooled = max(pooled, _LEAST_SCATTER**2)
    deviation = math.sqrt(pooled)
    return TouchNoise(
        scatter=Scatter(deviation, dof),
        trimmed=math.sqrt(_trimmed(squares, free, pooled)),
        variances=pooled + weight * (raw - pooled),
        raw_variances=raw if spread else np.full(len(counts), pooled),
        spreads=2.0 / (prior + free - 4.0),
        counts=counts,
        fixed_variance=fixed_part(deviation, step),
    )


def _spread(squares: FloatArray, free: FloatArray, pooled: float) -> float:
    """Relative variance of the directions' variances beyond that of chance."""
    repeated = free > 0.0
    count = int(np.sum(repeated))
    if count < _FEWEST_COMPARED or pooled == 0.0:
        return 0.0
    d = free[repeated]
    chance = 2.0 / d
    ratio = squares[repeated] / d / pooled
    observed = float(np.sum(d * (ratio - 1.0) ** 2)) * count / (count - 1.0)
    return max((observed - float(np.sum(d * chance))) / float(np.sum(d * (1.0 + chance))), 0.0)


def _trimmed(squares: FloatArray, free: FloatArray, pooled: float) -> float:
    """Variance from the directions that scatter least; of normal noise it is the whole one."""
    from scipy.special import chdtr, gammaincinv

    repeated = free > 0.0
    count = int(np.sum(repeated))
    left_out = round(_TRIMMED * count)
    if left_out == 0 or pooled == 0.0:
        return pooled
    d, own = free[repeated], squares[repeated]
    kept = np.argsort(chdtr(d, own / pooled))[: count - left_out]
    level = 1.0 - left_out / count
    expected = d * chdtr(d + 2.0, 2.0 * gammaincinv(0.5 * d, level)) / level
    return float(np.sum(own[kept]) / np.sum(expected[kept]))


def fixed_part(deviation: float, step: float) -> float:
    """Variance that repeats of a direction share because positions have a step. [mm²]

    Rounding adds q²/12 to the variance of a touch. Repeats that scatter by much less than a step
    are rounded alike, and their mean keeps q²/12; with a scatter of a step or more, nothing is
    shared.

    Parameters
    ----------
    deviation : float
        Standard deviation among repeats, of rounded positions. [mm]
    step : float
        q. [mm]

    >>> 1e6 * fixed_part(0.0, 0.001) * 12.0
    1.0
    >>> bool(fixed_part(0.001, 0.001) < 1e-9)
    True
    """
    if step <= 0.0:
        return 0.0
    shared, within = _rounded_scatter()
    return float(step**2 * np.interp((deviation / step) ** 2, within, shared))


def _rounded_scatter() -> tuple[FloatArray, FloatArray]:
    """What touches share by rounding, and the variance among them after it, in squared steps.

    Two touches that lie d apart, d = k + r steps, differ after rounding by k or k + 1 steps, the
    latter with probability r: by k² + (2 k + 1) r in the square. That is d and twice the part of d
    beyond each whole number, so that its mean is a sum of normal partial moments.
    """
    from scipy.special import ndtr

    scatter = np.linspace(0.0, _LARGEST_RATIO, 251)
    apart = math.sqrt(2.0) * np.maximum(scatter, 1e-100)
    whole = np.arange(1.0, 10.0 * _LARGEST_RATIO)[:, None]
    density = np.exp(-0.5 * (whole / apart) ** 2) / math.sqrt(2.0 * math.pi)
    beyond = apart * density - whole * ndtr(-whole / apart)
    within = apart / math.sqrt(2.0 * math.pi) + 2.0 * np.sum(beyond, axis=0)
    return scatter**2 + 1.0 / 12.0 - within, within
