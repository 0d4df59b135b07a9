"""Posterior weights of the scales that a six-seat fit does not know in advance.

How asymmetric is the probe, how large is the part of pretravel that a six-seat probe does not
represent, how much do directions scatter that repeats do not reduce? Touches determine these scales
badly, so none of them is chosen: the results for all of them are averaged, each with its
probability (Bayesian model averaging). The uncertainty then contains the differences between them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, frozen
from pretravel.maps import Scatter
from pretravel.six_seats.six_seat_fit import PriorScales, SixSeatProblem
from pretravel.uncertainty import (
    ReducedRows,
    classes_of,
    reduced_rows,
)

ASYMMETRY_SCALES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Scales of asymmetry, as multiples of the usual spreads."""
CORRECTIONS = tuple(size * MICROMETRE for size in (0.03, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4))
"""Sizes of the part that a six-seat probe does not represent. [mm]"""
FIXED_SCATTERS = tuple(size * MICROMETRE for size in (0.02, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0))
"""Scatters of directions that repeats do not reduce. [mm]"""
_TYPICAL_ASYMMETRY, _ASYMMETRY_SPREAD = math.log(0.3), 1.2
_TYPICAL_CORRECTION = 0.1 * MICROMETRE
_TYPICAL_FIXED_SCATTER = 0.03 * MICROMETRE
_TAILS = 3.0
"""Degrees of freedom of Student's distribution of both: large ones are rare, but not excluded."""
_TYPICAL_NOISE, _NOISE_SPREAD = 0.3 * MICROMETRE, 1.0
_UNKNOWN_NOISES = tuple(_TYPICAL_NOISE * 1.6**step for step in range(-6, 7))
WELL_KNOWN_NOISE = 10.0
"""Degrees of freedom among repeats from which these alone determine the noise."""
LEAST_NOISE = 1e-3 * MICROMETRE
_USUAL_DOF = 4.0  # weight of the usual noise together with few repeats
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


def coarse_scales(usual: PriorScales) -> tuple[list[PriorScales], FloatArray]:
    """Some sizes of asymmetry and correction, and logarithms of their probabilities."""
    pairs = itertools.product(ASYMMETRY_SCALES[1:], CORRECTIONS[::2])
    scales = [replace(usual, asymmetry=asymmetry, correction=size) for asymmetry, size in pairs]
    return scales, frozen([_log_prior(each) for each in scales])


def weighted_scales(problem: SixSeatProblem, x: FloatArray, repeats: Scatter) -> WeightedScales:
    """Posterior probabilities of the scales, with the model linearised at x.

    Parameters
    ----------
    problem : SixSeatProblem
    x : (u,) float
        Unknowns, near the posterior mode.
    repeats : Scatter
        Of repeated touches.

    Notes
    -----
    Given the scales, misses are normal, and so is the linearised model's prior: the
    probability of the touches has a closed form. Priors of the scales are wide: the logarithm of
    the asymmetry is normal, correction and fixed scatter follow half of Student's distribution.
    """
    misses, slopes = problem.misses(x)
    expected = misses + slopes @ _to_prior(problem, x)
    grid, log_priors = _grid(repeats)
    unknowns = np.array([_unknown_variances(problem, size) for size in ASYMMETRY_SCALES])
    corrections = np.array([problem.correction_variances(size) for size in CORRECTIONS])
    variances = np.hstack(
        [
            np.repeat(unknowns, len(corrections), axis=0),
            np.tile(corrections, (len(unknowns), 1)),
        ]
    )
    columns = np.hstack([slopes, problem.harmonics])
    likelihood = log_likelihoods(
        columns, variances, expected, problem.count, np.array(_own_scatters(repeats)) ** 2
    )
    posterior = likelihood + log_priors
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


def correction_at(problem: SixSeatProblem, x: FloatArray, scales: PriorScales) -> FloatArray:
    """Coefficients of the correction of the probe with these unknowns.

    Parameters
    ----------
    problem : SixSeatProblem
    x : (u,) float
    scales : PriorScales

    Returns
    -------
    (k,) float
        [mm]
    """
    misses, _ = problem.misses(x)
    columns = np.column_stack([problem.harmonics, misses])
    whitened = problem.covariance(scales).whitened(columns)
    variances = problem.correction_variances(scales.correction)
    return np.asarray(variances * (whitened[:, :-1].T @ whitened[:, -1]))


def covariance_over_scales(
    problem: SixSeatProblem, x: FloatArray, weighted: WeightedScales
) -> FloatArray:
    """Covariance of the unknowns and of the coefficients of the correction over all scales.

    Parameters
    ----------
    problem : SixSeatProblem
    x : (u,) float
        Where the model is linearised.
    weighted : WeightedScales

    Returns
    -------
    (u + k, u + k) float
        Of the mixture about its most probable scales: it contains the differences between them.
    """
    misses, slopes = problem.misses(x)
    to_touches = np.hstack([-slopes, problem.harmonics])
    before = np.concatenate([_to_prior(problem, x), np.zeros(len(problem.terms))])
    values = misses - to_touches @ before
    rows, count = to_touches, problem.count
    if len(count) > to_touches.shape[1]:
        rows, count = _fewer_rows(to_touches, values, count)
        rows, values = rows[:, :-1], rows[:, -1]
    pairs = {(scales.asymmetry, scales.correction) for scales in weighted.scales}
    priors = {pair: _prior_variances(problem, *pair) for pair in pairs}
    means, covariance = np.empty((len(weighted.scales), len(before))), np.zeros(2 * before.shape)
    diagonal = np.arange(len(rows))
    for start in range(0, len(means), _TOGETHER):
        part = slice(start, start + _TOGETHER)
        some, weights = weighted.scales[part], weighted.weights[part]
        prior = np.array([priors[scales.asymmetry, scales.correction] for scales in some])
        carried = prior[:, :, None] * rows.T  # (h, u + k, g)
        total = rows @ carried
        total[:, diagonal, diagonal] += [
            scales.fixed_scatter**2 + scales.noise**2 / count for scales in some
        ]
        whitening = np.linalg.inv(np.linalg.cholesky(total))
        whitened = carried @ np.swapaxes(whitening, -1, -2)
        means[part] = (whitened @ (whitening @ values)[..., None])[..., 0]
        wide = np.moveaxis(whitened * np.sqrt(weights)[:, None, None], 0, 1)
        wide = wide.reshape(len(before), -1)
        covariance -= wide @ wide.T
        covariance[np.diag_indices_from(covariance)] += weights @ prior
    between = means - means[0]
    covariance += (between.T * weighted.weights) @ between
    return np.asarray(0.5 * (covariance + covariance.T))


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


@lru_cache(maxsize=32)
def _grid(repeats: Scatter) -> tuple[tuple[PriorScales, ...], FloatArray]:
    """All scales that are considered, and the logarithms of their probabilities in advance."""
    sizes = itertools.product(ASYMMETRY_SCALES, CORRECTIONS, _own_scatters(repeats))
    grid = tuple(PriorScales(asymmetry, size, *own) for asymmetry, size, own in sizes)
    return grid, frozen([_log_prior(scales) for scales in grid])


def _log_prior(scales: PriorScales) -> float:
    asymmetry = (math.log(scales.asymmetry) - _TYPICAL_ASYMMETRY) / _ASYMMETRY_SPREAD
    noise = (math.log(scales.noise / _TYPICAL_NOISE)) / _NOISE_SPREAD
    found = -0.5 * asymmetry**2 + _log_half_student(scales.correction / _TYPICAL_CORRECTION)
    if scales.fixed_scatter > 0.0:
        return found + _log_half_student(scales.fixed_scatter / _TYPICAL_FIXED_SCATTER)
    return found - 0.5 * noise**2


def _log_half_student(size: float) -> float:
    """Of the logarithm of a size: the grids have steps of about a factor two."""
    return math.log(size) - 0.5 * (_TAILS + 1.0) * math.log1p(size**2 / _TAILS)


def _unknown_variances(problem: SixSeatProblem, asymmetry: float) -> FloatArray:
    """Prior variances of the unknowns, (u,)."""
    deviations = np.concatenate([np.full(problem.extra, _FREE), problem.spread(asymmetry)])
    deviations[problem.azimuth] = _FREE
    return np.asarray(deviations**2)


def _prior_variances(problem: SixSeatProblem, asymmetry: float, correction: float) -> FloatArray:
    """Of the unknowns and of the coefficients of the correction, (u + k,)."""
    own = _unknown_variances(problem, asymmetry)
    return np.concatenate([own, problem.correction_variances(correction)])


_TOGETHER = 16  # matrices of all pairs of directions at a time


def log_likelihoods(
    columns: FloatArray,
    variances: FloatArray,
    values: FloatArray,
    count: FloatArray,
    scatters: FloatArray,
) -> FloatArray:
    """Logarithms of the probability of mean touches, for all pairs of priors and scatters.

    Parameters
    ----------
    columns : (g, k) float
        Effect of each unknown on the mean touch of each direction.
    variances : (v, k) float
        Prior variances of the unknowns.
    values : (g,) float
        Mean touches. [mm]
    count : (g,) float
        Touches of each direction.
    scatters : (o, 2) float
        Variances of a direction that repeats do not reduce, and of a touch. [mm²]

    Returns
    -------
    (v o,) float
        Without a common constant; scatters change fastest.

    >>> one = np.ones((2, 1))
    >>> log_likelihoods(one, np.array([[1.0]]), np.zeros(2), np.ones(2), np.array([[0.0, 1.0]]))
    array([-0.54930614])
    """
    if len(values) <= columns.shape[1]:
        own = scatters[:, :1] + scatters[:, 1:] / count
        return _of_all_pairs(columns, variances, values, own)
    class_count, classes = classes_of(count)
    rows = np.column_stack([columns, values])
    reduced = reduced_rows([(rows, classes)], len(class_count))
    own = scatters[:, :1] + scatters[:, 1:] / class_count
    # What no column explains depends on the scatter alone.
    rest = np.log(own) @ reduced.dof + (1.0 / own) @ reduced.unexplained
    if len(class_count) == 1:
        small = reduced.rows
        found = _of_all_pairs(
            small[:, :-1], variances, small[:, -1], np.repeat(own, len(small), axis=1)
        )
    else:
        found = _of_columns(reduced, variances, own)
    return np.asarray(found - 0.5 * np.tile(rest, len(variances)))


def _of_all_pairs(
    columns: FloatArray, variances: FloatArray, values: FloatArray, own: FloatArray
) -> FloatArray:
    """By a matrix of all pairs of rows, for each prior."""
    parts = []
    for start in range(0, len(variances), _TOGETHER):
        prior = variances[start : start + _TOGETHER]
        half = columns * np.sqrt(prior)[:, None, :]
        shared = half @ np.swapaxes(half, -1, -2)
        parts.append(_log_likelihood(shared, own, values))
    return np.concatenate(parts)


def _log_likelihood(shared: FloatArray, own: FloatArray, values: FloatArray) -> FloatArray:
    """Of values with each shared covariance (c, g, g) and own variances (o, g): (c o,)."""
    count = len(values)
    total = np.empty((len(shared), len(own), count + 1, count + 1))
    total[..., :count, :count] = shared[:, None]
    diagonal = np.arange(count)
    total[..., diagonal, diagonal] += own
    # The values as one more row: the factor's last row is then the whitened values.
    total[..., count, :count] = total[..., :count, count] = values
    total[..., count, count] = 2.0 * float(values @ values) / own.min() + 1.0
    factor = np.linalg.cholesky(total)
    logarithms = np.log(factor[..., diagonal, diagonal]).sum(axis=-1)
    whitened = factor[..., count, :count]
    return np.asarray(-(logarithms + 0.5 * np.sum(whitened**2, axis=-1)).ravel())


def _of_columns(reduced: ReducedRows, variances: FloatArray, own: FloatArray) -> FloatArray:
    """By a matrix of all pairs of columns, where directions have different numbers of touches."""
    columns, values = reduced.rows[:, :-1], reduced.rows[:, -1]
    root = np.sqrt(variances)
    diagonal = np.arange(columns.shape[1])
    found = np.empty((len(variances), len(own)))
    for number, variance in enumerate(own):
        each = variance[reduced.classes]
        weighted = columns / each[:, None]
        inner = root[:, :, None] * (weighted.T @ columns) * root[:, None, :]
        inner[:, diagonal, diagonal] += 1.0
        size, axes = np.linalg.eigh(inner)
        size = np.maximum(size, 1.0)  # a column that others contain: one, less rounding
        along = np.einsum("vkj,vk->vj", axes, root * (weighted.T @ values)) / np.sqrt(size)
        logarithms = np.log(size).sum(axis=-1) + float(np.log(each).sum())
        squares = float(np.sum(values**2 / each)) - np.sum(along**2, axis=-1)
        found[:, number] = -0.5 * (logarithms + squares)
    return np.asarray(found.ravel())
