"""Noise of multi-step readings: Student's distributions, with or without gross errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, frozen
from pretravel.laboratory.separation.multi_step_readings import MultiStepDesign, weighted_residuals

TAILS: FloatArray = frozen([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.335, 0.37])
"""Reciprocal degrees of freedom of Student's distribution: normal noise first; t3 has 1/3.

Noise with still heavier tails has a variance that readings hardly determine.
"""
_NORMAL_FIRST = 5.0  # prior probability of normal noise, in those of each other distribution
_GROSS_SHARES: FloatArray = frozen([0.0, 0.005, 0.01, 0.02, 0.03, 0.05])
_GROSS_FROM, _GROSS_TO = 4.0, 50.0
"""Gross errors in scales of the noise: all magnitudes alike between these, fewer beyond."""
_FIT_BESIDE_GROSS = 0.15  # least of `TAILS` with which the errors are fitted then
_NORMAL_FACTOR = 1.4826  # standard deviation over median absolute deviation, normal distribution
_LEAST_SCALE = 1e-3  # squared, of the mean
_TAIL_ROUNDS, _GROSS_ROUNDS = 6, 12  # both converge


@dataclass(frozen=True, eq=False)
class ReadingScale:
    """Scales of readings for the test of their distribution.

    Attributes
    ----------
    squared : (n,) float
        Square of the scale of each reading. [mm²]
    leverage : (n,) float
        Share of its own error that the fit of the errors follows.
    """

    squared: FloatArray
    leverage: FloatArray


@dataclass(frozen=True, eq=False)
class NoiseTails:
    """The distribution of the noise, as far as readings determine it.

    Attributes
    ----------
    probability : (t, g) float
        Of each of `TAILS` and share of gross errors; the sum is one.
    level : (t, g) float
        Factor on the squared scales with each of them.
    """

    probability: FloatArray
    level: FloatArray

    @property
    def of_tails(self) -> FloatArray:
        """Probability of each of `TAILS`, (t,)."""
        return np.asarray(self.probability.sum(axis=1))

    @property
    def levels(self) -> FloatArray:
        """Factor on the squared scales with each of `TAILS`, (t,)."""
        return np.asarray((self.probability * self.level).sum(axis=1) / self.of_tails)

    @property
    def mean_tail(self) -> float:
        """Expected reciprocal of the degrees of freedom."""
        return float(self.of_tails @ TAILS)


def student_weight(tail: float | FloatArray, squared: FloatArray) -> FloatArray:
    """Weight of a reading by its squared residual in scales of Student's distribution.

    >>> student_weight(1.0 / 3.0, np.array([0.0, 1.0, 9.0])).round(3).tolist()
    [1.333, 1.0, 0.333]
    """
    return np.asarray((1.0 + tail) / (1.0 + tail * squared))


def noise_tails(
    design: MultiStepDesign, errors: FloatArray, scale: ReadingScale, *, gross: bool
) -> NoiseTails:
    """Determine the probability of each distribution of the noise.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]
    scale : ReadingScale
        Its common level does not matter.
    gross : bool
        Whether some of the readings may have gross errors.
    """
    # Shrunk scales of few readings, most of which agree, can add up to less than zero.
    squared_scale = np.maximum(scale.squared, _LEAST_SCALE * float(np.mean(np.abs(scale.squared))))
    own = squared_scale * np.maximum(1.0 - scale.leverage, 1e-6)
    residuals = np.empty((len(TAILS), len(errors)))
    start = np.empty(len(TAILS))
    weights = 1.0 / scale.squared
    now = weighted_residuals(design, errors, weights)
    level = _NORMAL_FACTOR**2 * float(np.median(now**2 / own))
    for k, tail in enumerate(TAILS):
        # Gross errors must not move the fit, not even that for normal noise.
        fitted = max(float(tail), _FIT_BESIDE_GROSS) if gross else float(tail)
        for _ in range(_TAIL_ROUNDS if fitted else 1):
            squared = now**2 / own
            factor = student_weight(fitted, squared / level)
            level = float(np.mean(factor * squared))
            if fitted:
                now = weighted_residuals(design, errors, weights * factor)
        residuals[k], start[k] = now, level
    squared = (residuals**2 / own)[:, None, :]
    if gross:  # all are fitted alike
        return _probabilities(squared, start, _GROSS_SHARES, np.zeros(len(errors)))
    return _probabilities(squared, start, _GROSS_SHARES[:1], scale.leverage)


def _probabilities(
    squared: FloatArray, start: FloatArray, shares: FloatArray, leverage: FloatArray
) -> NoiseTails:
    """Levels and probabilities by expectation maximisation, all distributions at once.

    The fit with heavy tails brings as many residuals to zero as it has errors to determine, which
    alone would make heavy tails probable. So the errors are integrated out (Laplace, with the
    information of the distribution): the residuals count as they are, not enlarged by the leverage.
    """
    share = shares[None, :, None]
    fitted = float(np.sum(leverage))
    by_fit = 0.5 * fitted * np.log((1.0 + TAILS) / (1.0 + 3.0 * TAILS))[:, None]
    level = np.repeat(start[:, None], len(shares), axis=1)
    logarithm = np.empty_like(level)
    for _ in range(_GROSS_ROUNDS):
        z2 = squared / level[:, :, None]
        wide = _gross_density(np.sqrt(z2))
        core = (1.0 - share) * np.exp(_log_density(z2 * (1.0 - leverage)))
        density = np.maximum(core + share * wide, 1e-300)
        logarithm = np.log(density).sum(axis=-1) - by_fit
        logarithm -= 0.5 * (z2.shape[-1] - fitted) * np.log(level)
        good = np.where(core + share * wide > 0.0, core / density, 1.0)
        factor = good * student_weight(TAILS[:, None, None], z2)
        level = level * (factor * z2).sum(axis=-1) / good.sum(axis=-1)
    prior = np.ones_like(level)
    prior[0] = _NORMAL_FIRST
    prior[:, 1:] /= max(len(shares) - 1, 1)
    probability = prior * np.exp(logarithm - logarithm.max())
    # Impossible distributions keep a level.
    probability = np.maximum(probability / probability.sum(), 1e-30)
    return NoiseTails(frozen(probability), frozen(level))


def _gross_density(size: FloatArray) -> FloatArray:
    """Of residuals with a gross error: 1 / size, then 1 / size²."""
    inside = np.maximum(size, _GROSS_FROM)
    falling = np.minimum(_GROSS_TO / inside, 1.0) / inside
    norm = 2.0 * (math.log(_GROSS_TO / _GROSS_FROM) + 1.0)
    return np.asarray(np.where(size > _GROSS_FROM, falling / norm, 0.0))


def _log_density(squared: FloatArray) -> FloatArray:
    """Of Student's distributions with `TAILS`, at squared residuals in scales, (t, ...)."""
    from scipy.special import gammaln

    result = np.empty_like(squared)
    result[0] = -0.5 * squared[0] - 0.5 * math.log(2.0 * math.pi)
    dof = 1.0 / TAILS[1:].reshape(-1, *([1] * (squared.ndim - 1)))
    constant = gammaln(0.5 * (dof + 1.0)) - gammaln(0.5 * dof) - 0.5 * np.log(dof * math.pi)
    result[1:] = constant - 0.5 * (dof + 1.0) * np.log1p(squared[1:] / dof)
    return result
