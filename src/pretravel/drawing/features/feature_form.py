"""The form of a surface at its touched points: what is left of residuals without the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from pretravel.base import FloatArray, frozen
from pretravel.drawing.features.feature_uncertainty import FeatureErrors
from pretravel.uncertainty import COVERAGE_FACTOR, EXPANDED_COVERAGE

_SEED = 1
_STEPS = 2000  # of probability: the ends of an interval of 95 % are 45 of them
_NOISE_DOF = 50  # of the repeatability: 25 directions touched three times, as is usual
_PAIRED = 200  # largest and smallest residuals of which pairs are compared, …
_MOST_CHANGES = 4_000_000  # … fewer of very many points


@dataclass(frozen=True, eq=False)
class FormResult:
    """The form of a surface at its touched points, and the range that was measured.

    Attributes
    ----------
    measured : float
        Range of the residuals: largest less smallest. The noise of the points enlarges it. [mm]
    value : float
        Form of the surface at the touched points: this range less its enlargement. [mm]
    quantiles : (q,) float
        Of that form, ascending, at the middles of equal steps of probability. [mm]
    noise : float
        Mean range that the errors of the points produce on a perfect feature. [mm]
    most_noise : float
        Range that they exceed in 5 of 100 cases. [mm]

    >>> equal_steps = np.linspace(1e-3, 2e-3, 1001)
    >>> form = FormResult(2.2e-3, 1.8e-3, equal_steps, 3e-4, 5e-4)
    >>> [round(end, 6) for end in form.interval], round(form.expanded_u, 6)
    ([0.001022, 0.001978], 0.000778)
    """

    measured: float
    value: float
    quantiles: FloatArray
    noise: float
    most_noise: float

    def at_most(self, probability: float) -> float:
        """The bound below which the form lies with a probability. [mm]"""
        steps = (np.arange(len(self.quantiles)) + 0.5) / len(self.quantiles)
        return float(np.interp(probability, steps, self.quantiles))

    def probability_of(self, tolerance: float) -> float:
        """The probability that the form is not larger than a tolerance."""
        return float(np.mean(self.quantiles <= tolerance))

    @property
    def interval(self) -> tuple[float, float]:
        """Where the form lies with 95 %; from zero where only an upper bound is known. [mm]"""
        outside = 1.0 - EXPANDED_COVERAGE
        low = self.at_most(0.5 * outside)
        return low, self.at_most(1.0 - (0.5 * outside if low > 0.0 else outside))

    @property
    def expanded_u(self) -> float:
        """U: the value plus and minus U contains the interval. [mm]"""
        low, high = self.interval
        return max(self.value - low, high - self.value)

    @property
    def u(self) -> float:
        """Half of U. [mm]"""
        return self.expanded_u / COVERAGE_FACTOR


def form_result(errors: FeatureErrors) -> FormResult:
    """The form of a surface at its touched points, from the residuals of a feature.

    Parameters
    ----------
    errors : FeatureErrors

    Returns
    -------
    FormResult

    Notes
    -----
    The range of n points of a perfect surface is not zero, but the range of their noise. Two bounds
    hold for a surface of any shape. Its form is not smaller than the measured range less the range
    of the noise, since the range of a sum is not larger than the sum of the ranges. It is not
    larger than the largest difference of two residuals plus the uncertainty of this difference,
    since one of these pairs has the true extremes. The noise is drawn from the covariance of the
    points' errors after the fit.

    The value is the measured range less the mean enlargement of a range by noise, on a surface of
    the shape of the residuals whose variance is theirs less that of the noise.
    """
    residuals = errors.association.residuals
    measured = float(np.ptp(residuals))
    generator = np.random.default_rng(_SEED)
    noise = errors.noise_trials(generator)
    alone = np.ptp(noise, axis=1)
    # How large the noise is was found with few touches itself.
    scale = np.sqrt(_NOISE_DOF / generator.chisquare(_NOISE_DOF, len(noise)))
    shape = _without_noise(residuals, noise)
    return bounded_form(
        measured,
        scale * _enlargement(residuals, noise, alone),
        lambda factors: _largest_difference(errors, factors),
        bias=float(np.mean(np.ptp(shape + noise, axis=1))) - float(np.ptp(shape)),
        noise=alone,
        u_machine=errors.machine,
        generator=generator,
    )


def bounded_form(
    measured: float,
    enlarged: FloatArray,
    largest: Callable[[FloatArray], FloatArray],
    *,
    bias: float,
    noise: FloatArray,
    u_machine: float,
    generator: np.random.Generator,
) -> FormResult:
    """A form, or another extent of a zone, between the bounds that hold for any surface.

    Parameters
    ----------
    measured : float
        Extent of the zone that contains the points. [mm]
    enlarged : (t,) float
        By which errors may have enlarged it, drawn: it is not smaller than `measured` less this.
    largest : callable
        From factors of standard uncertainties (q,) to the extents that it does not exceed, (q,).
    bias : float
        By which errors enlarge it on average. [mm]
    noise : (t,) float
        Extents that errors alone produce, drawn. [mm]
    u_machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    generator : Generator

    Returns
    -------
    FormResult
    """
    probability = (np.arange(_STEPS) + 0.5) / _STEPS
    enlarged = np.sort(enlarged)
    drawn = (np.arange(len(enlarged)) + 0.5) / len(enlarged)
    least = measured - np.interp(1.0 - probability, drawn, enlarged)
    most = largest(np.maximum(ndtri(probability), 0.0))
    quantiles = np.where(probability < 0.5, np.maximum(least, 0.0), most)
    if u_machine > 0.0:
        quantiles = _widened(quantiles, u_machine, generator)
    return FormResult(
        measured=measured,
        value=min(max(measured - bias, 0.0), float(quantiles[-1])),
        quantiles=frozen(quantiles),
        noise=float(noise.mean()),
        most_noise=float(np.quantile(noise, 0.95)),
    )


def _enlargement(residuals: FloatArray, noise: FloatArray, alone: FloatArray) -> FloatArray:
    """Largest enlargement of the range by noise, drawn: by points that may be extreme. [mm]

    A point is so only if its residual is nearer to the extreme one than twice the noise's range.
    """
    near = 2.0 * float(np.quantile(alone, 0.999))
    high = residuals >= residuals.max() - near
    low = residuals <= residuals.min() + near
    return np.asarray(noise[:, high].max(axis=1) - noise[:, low].min(axis=1))


def _largest_difference(errors: FeatureErrors, factors: FloatArray) -> FloatArray:
    """Largest difference of two residuals plus factors of its standard uncertainty. [mm]"""
    residuals = errors.association.residuals
    order = np.argsort(residuals)
    paired = min(_PAIRED, max(_MOST_CHANGES // len(order), 10))
    rows = np.unique(np.concatenate([order[:paired], order[-paired:]]))
    u = errors.u_of_differences(rows)
    difference = residuals[rows][:, None] - residuals[rows]
    # Only pairs that are largest for some factor: on the way from small to large u.
    ordered = np.lexsort((-difference.ravel(), -u.ravel()))
    difference, u = difference.ravel()[ordered], u.ravel()[ordered]
    better = np.concatenate([[True], difference[1:] > np.maximum.accumulate(difference)[:-1]])
    difference, u = difference[better], u[better]
    return np.asarray(np.max(difference + factors[:, None] * u, axis=1))


def _widened(quantiles: FloatArray, u: float, generator: np.random.Generator) -> FloatArray:
    """Quantiles of a form whose lengths have a further standard uncertainty."""
    drawn = np.repeat(quantiles, 10)
    drawn = np.sort(np.maximum(drawn + u * generator.standard_normal(len(drawn)), 0.0))
    return np.asarray(np.mean(drawn.reshape(-1, 10), axis=1))


def _without_noise(residuals: FloatArray, noise: FloatArray) -> FloatArray:
    """The residuals, made smaller so that their variance is less by that of the noise."""
    observed = float(np.sum(residuals**2))
    expected = float(np.mean(np.sum(noise**2, axis=1)))
    return np.asarray(residuals * np.sqrt(max(1.0 - expected / max(observed, 1e-300), 0.0)))
