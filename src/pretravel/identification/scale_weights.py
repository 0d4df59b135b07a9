"""Posterior weights of the scales that a six-seat fit does not know in advance.

How asymmetric is the probe, how large is the part of pretravel that a six-seat probe does not
represent, how much do directions scatter that repeats do not reduce? Touches determine these scales
badly, so none of them is chosen: the results for all of them are averaged, each with its
probability (Bayesian model averaging). The uncertainty then contains the doubt between them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.units import MICROMETRE
from pretravel.identification.scale_likelihood import log_likelihoods
from pretravel.identification.six_seat_fit import PriorScales, SixSeatProblem
from pretravel.maps.observation import Scatter
from pretravel.uncertainty.reduced_rows import classes_of, reduced_rows
from pretravel.uncertainty.shared_covariance import SharedCovariance

ASYMMETRY_SCALES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Scales of asymmetry, as multiples of the usual spreads."""
CORRECTIONS = tuple(size * MICROMETRE for size in (0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4))
"""Sizes of the part that a six-seat probe does not represent. [mm]"""
FIXED_SCATTERS = tuple(size * MICROMETRE for size in (0.02, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0))
"""Scatters of directions that repeats do not reduce. [mm]"""
_TYPICAL_ASYMMETRY, _ASYMMETRY_SPREAD = math.log(0.3), 1.2
_TYPICAL_CORRECTION = 0.15 * MICROMETRE
_TYPICAL_FIXED_SCATTER = 0.05 * MICROMETRE
_TYPICAL_NOISE, _NOISE_SPREAD = 0.3 * MICROMETRE, 1.0
_UNKNOWN_NOISES = tuple(_TYPICAL_NOISE * 1.6**step for step in range(-6, 7))
WELL_KNOWN_NOISE = 10.0
"""Degrees of freedom among repeats from which these alone determine the noise."""
LEAST_NOISE = 1e-3 * MICROMETRE
_USUAL_DOF = 4.0  # weight of the usual noise beside few repeats
_FREE = 0.05  # mm or rad: standard deviation about x of unknowns without a prior, far above theirs
_ENOUGH = 0.98  # share of the probability that is averaged over


@dataclass(frozen=True, eq=False)
class WeightedScales:
    """Scales with their posterior probabilities, about one linearisation.

    Attributes
    ----------
    scales : tuple of PriorScales
        The most probable first.
    weights : (h,) float
        They add up to one.
    evidence : float
        Logarithm of the probability of the touches, over all scales.
    """

    scales: tuple[PriorScales, ...]
    weights: FloatArray
    evidence: float

    def mean(self, name: str) -> float:
        """Root of the mean square of one of the scales."""
        squares = np.array([getattr(scales, name) ** 2 for scales in self.scales])
        return math.sqrt(float(self.weights @ squares))


def usual_scales(repeats: Scatter) -> PriorScales:
    """Where a search begins: a usual asymmetry, a small correction."""
    noise = _noises(repeats)
    return PriorScales(0.3, 0.3 * MICROMETRE, 0.1 * MICROMETRE, noise[len(noise) // 2])


def weighted_scales(problem: SixSeatProblem, x: FloatArray, repeats: Scatter) -> WeightedScales:
    """Posterior probabilities of the scales, with the model linearised at x.

    Parameters
    ----------
    problem : SixSeatProblem
    x : (u,) float
        Unknowns, near the posterior mode.
    repeats : Scatter
        Of repeated touches.

    Returns
    -------
    WeightedScales

    Notes
    -----
    Given the scales, misses are normal, and so is the linearised model's prior: the
    probability of the touches has a closed form. Priors of the scales are wide: the logarithm of
    the asymmetry is normal, correction and fixed scatter are half Cauchy.
    """
    misses, slopes = problem.misses(x)
    expected = misses + slopes @ _to_prior(problem, x)
    grid = _grid(repeats)
    pairs = itertools.product(ASYMMETRY_SCALES, CORRECTIONS)
    variances = np.array([_prior_variances(problem, *pair) for pair in pairs])
    columns = np.hstack([slopes, problem.harmonics])
    likelihood = log_likelihoods(
        columns, variances, expected, problem.count, np.array(_own_scatters(repeats)) ** 2
    )
    posterior = likelihood + np.array([_log_prior(scales) for scales in grid])
    largest = float(posterior.max())
    weights = np.exp(posterior - largest)
    order = np.argsort(-weights)
    share = np.cumsum(weights[order]) / weights.sum()
    order = order[: int(np.searchsorted(share, _ENOUGH)) + 1]
    kept = weights[order]
    return WeightedScales(
        scales=tuple(grid[i] for i in order),
        weights=np.asarray(kept / kept.sum()),
        evidence=largest + math.log(float(weights.sum())),
    )


def averaged_unknowns(
    problem: SixSeatProblem, x: FloatArray, weighted: WeightedScales
) -> tuple[FloatArray, FloatArray]:
    """Unknowns and coefficients of the correction, with a covariance over all scales.

    Parameters
    ----------
    problem : SixSeatProblem
    x : (u,) float
        Where the model is linearised.
    weighted : WeightedScales

    Returns
    -------
    found : (u + k,) float
        At the most probable scales: change of the unknowns from x, then the coefficients of the
        correction. [mm and as they are]
    covariance : (u + k, u + k) float
        About these, of the mixture over the scales: it contains their differences.
    """
    misses, slopes = problem.misses(x)
    to_touches = np.hstack([-slopes, problem.harmonics])
    before = np.concatenate([_to_prior(problem, x), np.zeros(len(problem.terms))])
    values = misses - to_touches @ before
    rows, count = to_touches, problem.count
    if len(count) > to_touches.shape[1]:
        rows, count = _fewer_rows(to_touches, values, count)
        rows, values = rows[:, :-1], rows[:, -1]
    means, covariance = [], np.zeros((len(before), len(before)))
    for scales, weight in zip(weighted.scales, weighted.weights, strict=True):
        prior = _prior_variances(problem, scales.asymmetry, scales.correction)
        variances = scales.fixed_scatter**2 + scales.noise**2 / count
        total = SharedCovariance(variances, rows * np.sqrt(prior))
        whitened = total.whitened(rows * prior)
        means.append(before + whitened.T @ total.whitened(values))
        covariance -= weight * (whitened.T @ whitened)
        covariance[np.diag_indices_from(covariance)] += weight * prior
    between = np.array(means) - means[0]
    covariance += (between.T * weighted.weights) @ between
    return np.asarray(means[0]), 0.5 * (covariance + covariance.T)


def _fewer_rows(
    columns: FloatArray, values: FloatArray, count: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Columns and values reduced to as many rows as columns, and their numbers of touches."""
    class_count, classes = classes_of(count)
    blocks = [(np.column_stack([columns, values]), classes)]
    reduced = reduced_rows(blocks, len(class_count))
    return reduced.rows, class_count[reduced.classes]


def _to_prior(problem: SixSeatProblem, x: FloatArray) -> FloatArray:
    """From x to the prior means; unknowns without a prior stay where they are, (u,)."""
    found = problem.prior - x
    found[: problem.extra] = 0.0
    found[problem.azimuth] = 0.0
    return found


def _noises(repeats: Scatter) -> tuple[float, ...]:
    """Standard deviations of a touch that are considered: one where repeats determine it. [mm]"""
    if repeats.dof >= WELL_KNOWN_NOISE:
        return (max(repeats.deviation, LEAST_NOISE),)
    if repeats.dof == 0.0:
        return _UNKNOWN_NOISES
    squares = repeats.dof * repeats.deviation**2 + _USUAL_DOF * _TYPICAL_NOISE**2
    return (math.sqrt(squares / (repeats.dof + _USUAL_DOF)),)


def _own_scatters(repeats: Scatter) -> list[tuple[float, float]]:
    """Fixed scatter and noise of each direction, which single touches do not separate. [mm]"""
    fixed = FIXED_SCATTERS if repeats.dof > 0.0 else (0.0,)
    return list(itertools.product(fixed, _noises(repeats)))


def _grid(repeats: Scatter) -> list[PriorScales]:
    own = _own_scatters(repeats)
    sizes = itertools.product(ASYMMETRY_SCALES, CORRECTIONS, own)
    return [PriorScales(asymmetry, size, *scatter) for asymmetry, size, scatter in sizes]


def _log_prior(scales: PriorScales) -> float:
    asymmetry = (math.log(scales.asymmetry) - _TYPICAL_ASYMMETRY) / _ASYMMETRY_SPREAD
    noise = (math.log(scales.noise / _TYPICAL_NOISE)) / _NOISE_SPREAD
    found = -0.5 * asymmetry**2 + _log_half_cauchy(scales.correction, _TYPICAL_CORRECTION)
    if scales.fixed_scatter > 0.0:
        return found + _log_half_cauchy(scales.fixed_scatter, _TYPICAL_FIXED_SCATTER)
    return found - 0.5 * noise**2


def _log_half_cauchy(size: float, typical: float) -> float:
    """Of the logarithm of a size: the grids have steps of about a factor two."""
    return math.log(size / typical / (1.0 + (size / typical) ** 2))


def _unknown_variances(problem: SixSeatProblem, asymmetry: float) -> FloatArray:
    """Prior variances of the unknowns, (u,)."""
    deviations = np.concatenate([np.full(problem.extra, _FREE), problem.spread(asymmetry)])
    deviations[problem.azimuth] = _FREE
    return np.asarray(deviations**2)


def _prior_variances(problem: SixSeatProblem, asymmetry: float, correction: float) -> FloatArray:
    """Of the unknowns and of the coefficients of the correction, (u + k,)."""
    own = _unknown_variances(problem, asymmetry)
    return np.concatenate([own, problem.correction_variances(correction)])
