"""Variances of machine and probe directions: least squares and restricted likelihood."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    RepeatedPair,
    direction_sums,
    multi_step_design,
    normal_matrix,
    weighted_residuals,
)
from pretravel.laboratory.separation.noise import (
    TAILS,
    NoiseTails,
    ReadingScale,
    noise_tails,
    student_weight,
)

_ROUNDS = 8
"""Weights of Student's distribution and scales are determined in turn."""
_SHAPE_ROUNDS = 3
_MEDIAN_ROUNDS = 10
ROBUST_TAIL = 0.25
"""Reciprocal degrees of freedom for scales that gross errors must not move."""
_NORMAL = 1.4826  # standard deviation over median absolute deviation of a normal distribution
_LEAST_PROBABLE = 1e-3  # distributions of the noise with less are left out of the mean
_LEAST_FREE = 1e-6
_HEAVIEST_SQUARES = 4.5
"""Degrees of freedom of Student's distribution whose squares scatter most of those counted."""
_SMALLEST_WEIGHED = 0.1
"""Ratio to the mean variance: no pair gets the weight of a smaller variance than this."""


@dataclass(frozen=True)
class PairVariance:
    """A measured variance of one pair, in terms of a design.

    Attributes
    ----------
    machine, probe : int
        Places of the two directions among all directions of the design.
    variance : float
        [mm²]
    dof : float
        Degrees of freedom of the variance.
    """

    machine: int
    probe: int
    variance: float
    dof: float


def pair_variance_of(design: MultiStepDesign, repeated: RepeatedPair) -> PairVariance:
    """A repeated configuration in terms of a design."""
    return PairVariance(
        design.machine_place(repeated.machine),
        design.probe_place(repeated.probe),
        repeated.variance,
        float(repeated.count - 1),
    )


@dataclass(frozen=True, eq=False)
class DirectionVariances:
    """Estimated variances of all directions, the machine's first.

    Attributes
    ----------
    values : (m + p,) float
        How much of them is the machine's and how much the probe's is arbitrary. [mm²]
    covariance : (m + p, m + p) float
        [mm⁴]
    of_readings : (n,) float
        Variance of each reading, for the covariance of the errors. [mm²]
    """

    values: FloatArray
    covariance: FloatArray
    of_readings: FloatArray


def least_squares_variances(
    design: MultiStepDesign, errors: FloatArray, repeated: PairVariance | None
) -> DirectionVariances:
    """Variances from sums of squared residuals; they may be negative.

    The expectation of a squared residual is E[r²] = (M ∘ M) (vm_i + vp_j) with M = 1 - H. So the
    sums of squared residuals over a machine (or probe) direction are linear in the variances, for
    any design.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]
    repeated : PairVariance or None

    Raises
    ------
    PretravelError
        Too few readings of a direction.

    References
    ----------
    After Nafi and Mayer 2011, equations 7 and 8, with the squared residuals of a direction in the
    place of equation 5 (see `literal_variances`), and with the degrees of freedom that the fit
    takes from each residual.
    """
    values, covariance = _from_squared_residuals(design, errors)
    covariance = covariance * _scatter_of_squares(noise_of_readings(design, errors))
    if repeated is not None:
        values, covariance = _updated(values, covariance, repeated)
    return DirectionVariances(values, covariance, design.incidence @ values)


def _from_squared_residuals(
    design: MultiStepDesign, errors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    ones = np.ones(len(errors))
    residuals = weighted_residuals(design, errors, ones)
    matrix = 2.0 * likelihood_information(design, ones).matrix
    _check_rank(design, matrix)
    inverse = np.linalg.pinv(matrix, rcond=1e-9)
    variances = inverse @ direction_sums(design, residuals**2)
    total = np.maximum(design.incidence @ variances, 0.05 * float(np.mean(residuals**2)))
    # Cov(r_a², r_b²) = 2 (M V M)_ab² for normal noise.
    scatter = _residual_covariance(design, total)
    scatter *= scatter
    sums = 2.0 * design.incidence.T @ (scatter @ design.incidence)
    return np.asarray(variances), np.asarray(inverse @ sums @ inverse)


def _residual_covariance(design: MultiStepDesign, total: FloatArray) -> FloatArray:
    """M V M of ordinary least squares, (n, n), with M = 1 - H and H = S G S'. [mm²]"""
    signed = design.columns
    cofactor = np.linalg.inv(normal_matrix(design, np.ones(len(total))))
    middle = cofactor @ (signed.T @ (total[:, None] * signed)) @ cofactor
    scatter = signed @ (middle @ signed.T)
    scatter -= (signed @ (cofactor @ signed.T)) * (total[:, None] + total)
    scatter[np.diag_indices(len(total))] += total
    return np.asarray(scatter)


def literal_variances(
    design: MultiStepDesign, errors: FloatArray, repeated: PairVariance | None
) -> DirectionVariances:
    """Variances from the paper's equations 3 to 10 as they are printed, to compare with it.

    Of one direction with readings e, predicted p + mean and residuals r = e - p - mean, the total
    less the explained sum of squares is Σr² + 2 Σ r·p. The paper takes it for Σr². The second sum
    vanishes over all readings together, but not over one direction: it is noise in proportion to
    the systematic errors of the other side, so that sums of squares become negative.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]
    repeated : PairVariance or None
        Its variance becomes that of the pair (equation 10).

    Raises
    ------
    PretravelError
        Too few readings of a direction.

    References
    ----------
    Nafi and Mayer 2011, equations 3 to 10.
    """
    honest = least_squares_variances(design, errors, None)
    residuals = weighted_residuals(design, errors, np.ones(len(errors)))
    counts = design.incidence.sum(axis=0)
    means = direction_sums(design, errors) / counts
    deviation = design.incidence * (errors[:, None] - means)
    explained = design.incidence * ((errors - residuals)[:, None] - means)
    sums = np.sum(deviation**2 - explained**2, axis=0)
    inverse = np.linalg.pinv(design.incidence.T @ design.incidence, rcond=1e-9)
    values = inverse @ sums
    scatter = _residual_covariance(design, np.maximum(honest.of_readings, 0.0))
    of_sums = 2.0 * design.incidence.T @ (scatter**2 @ design.incidence)
    of_sums += 4.0 * explained.T @ (scatter @ explained)
    covariance = inverse @ of_sums @ inverse
    if repeated is not None:
        pick = np.zeros(design.size)
        pick[[repeated.machine, repeated.probe]] = 1.0
        values = values + 0.5 * (repeated.variance - pick @ values)
        move = np.eye(design.size) - 0.5 * np.outer(np.ones(design.size), pick)
        covariance = move @ covariance @ move.T + 0.5 * repeated.variance**2 / repeated.dof
    return DirectionVariances(np.asarray(values), np.asarray(covariance), honest.of_readings)


def _check_rank(design: MultiStepDesign, matrix: FloatArray) -> None:
    """The matrix of the variances is rank deficient by one, by more where readings are few."""
    rank = int(np.linalg.matrix_rank(matrix, tol=1e-9 * float(np.linalg.norm(matrix, 2))))
    if rank >= design.size - 1:
        return
    counts = design.incidence.sum(axis=0)
    names = [
        *(f"machine {i}" for i in design.machines),
        *(f"probe {j}" for j in design.probes),
    ]
    few = [name for name, count in zip(names, counts, strict=True) if count < 3]
    raise PretravelError(
        f"the identification matrix of the variances is rank deficient by {design.size - rank}. "
        "A deficiency of one is usual (the shares of machine and probe); a larger one comes from "
        "directions with too few readings"
        + (f": {', '.join(few[:8])}" if few else "")
        + ". Each direction needs several readings, with several partners"
    )


def _updated(
    values: FloatArray, covariance: FloatArray, repeated: PairVariance
) -> tuple[FloatArray, FloatArray]:
    """Variances combined with that of a repeated pair, both weighted (a linear update)."""
    pick = np.zeros(len(values))
    pick[[repeated.machine, repeated.probe]] = 1.0
    estimate = float(pick @ values)
    shared = covariance @ pick
    own = float(pick @ shared)
    # Scatter of the repeats' variance, from the mean of both estimates.
    level = (repeated.variance * repeated.dof + max(estimate, 0.0)) / (repeated.dof + 1.0)
    gain = shared / (own + 2.0 * level**2 / repeated.dof)
    return values + gain * (repeated.variance - estimate), covariance - np.outer(gain, shared)


def restricted_likelihood_variances(
    design: MultiStepDesign, errors: FloatArray, repeated: PairVariance | None
) -> DirectionVariances:
    """Variances from the equations of the restricted likelihood; none is negative.

    The noise has Student's distribution; its degrees of freedom are not known. The variances are
    the mean over `TAILS` with their probabilities, and the covariance contains the uncertainty.
    With normal noise they are those of the normal likelihood.

    The weights, 1 / variance², are taken from variances shrunk towards their means. With weights
    from the estimates themselves, which scatter, the equations reduce single pairs to zero and
    state uncertainties half as large as they are.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]
    repeated : PairVariance or None

    Raises
    ------
    PretravelError
        Too few readings of a direction, or readings without scatter.

    References
    ----------
    Lange, Little, Taylor 1989, J. Am. Stat. Assoc. 84, 881: the likelihood of Student's noise.
    """
    from scipy.optimize import nnls

    values, covariance = _mean_over_tails(design, errors)
    if repeated is not None:
        values, covariance = _updated(values, covariance, repeated)
    # The nearest variances that are not negative, in the measure of the likelihood. Where none is
    # negative they are the same, up to the share of machine and probe.
    information = np.linalg.pinv(covariance, rcond=1e-9, hermitian=True)
    eigenvalues, vectors = np.linalg.eigh(information)
    root = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T
    admissible = np.asarray(nnls(root, root @ values)[0])
    # The mean of both: shrunk variances alone are too low where the variance is highest.
    level = float(np.mean(design.incidence @ admissible))
    shrunk = _shrunk(design, values, covariance, level)
    of_readings = design.incidence @ (0.5 * (admissible + shrunk))
    return DirectionVariances(admissible, covariance, of_readings)


def noise_of_readings(design: MultiStepDesign, errors: FloatArray) -> NoiseTails:
    """The distribution of the noise of readings without gross errors."""
    total = design.incidence @ squared_scales(design, errors)
    leverage = likelihood_information(design, total).leverage
    return noise_tails(design, errors, ReadingScale(total, leverage), gross=False)


def _scatter_of_squares(tails: NoiseTails) -> float:
    """Variance of a squared reading over that of normal noise, 1 + 3 / (dof - 4) of Student's.

    Below four degrees of freedom it has none; there the limit of `_HEAVIEST_SQUARES` counts.
    """
    dof = np.append(math.inf, 1.0 / TAILS[1:])
    return float(tails.of_tails @ (1.0 + 3.0 / (np.maximum(dof, _HEAVIEST_SQUARES) - 4.0)))


def _mean_over_tails(design: MultiStepDesign, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variances and their covariance, over the distributions that the noise may have."""
    shape = squared_scales(design, errors)
    total = design.incidence @ shape
    information = likelihood_information(design, total)
    inverse = information.inverse
    tails = noise_tails(design, errors, ReadingScale(total, information.leverage), gross=False)
    probable = np.flatnonzero(tails.of_tails > _LEAST_PROBABLE)
    probability = tails.of_tails[probable] / float(tails.of_tails[probable].sum())
    found, covariance = [], np.zeros((design.size, design.size))
    for place, share in zip(probable, probability, strict=True):
        tail, level = float(TAILS[place]), float(tails.levels[place])
        squared = _student_scales(design, errors, information, inverse, tail, level * shape)
        # Variance of Student's distribution over its squared scale; the information falls by
        # dof / (dof + 3).
        ratio = 1.0 / (1.0 - 2.0 * tail)
        found.append(equally_shared(design, ratio * squared))
        covariance += share * (ratio * level) ** 2 * (1.0 + 3.0 * tail) * inverse
    values = np.array(found)
    mean = probability @ values
    off = values - mean
    return mean, covariance + (off * probability[:, None]).T @ off


@dataclass(frozen=True, eq=False)
class LikelihoodInformation:
    """The information of normal readings on the variances of all directions.

    Attributes
    ----------
    weights : (n,) float
        [1/mm²]
    leverage : (n,) float
    matrix : (m + p, m + p) float
        Fisher's information: half of Z'(P ∘ P) Z. [1/mm⁴]
    """

    weights: FloatArray
    leverage: FloatArray
    matrix: FloatArray

    @property
    def inverse(self) -> FloatArray:
        """Covariance of the variances, up to the share of machine and probe. [mm⁴]"""
        inverse = np.linalg.pinv(self.matrix, rcond=1e-9, hermitian=True)
        return np.asarray(inverse, dtype=np.float64)


def likelihood_information(design: MultiStepDesign, total: FloatArray) -> LikelihoodInformation:
    """Fisher's information of the restricted likelihood at these variances of readings.

    With P = W - W X (X'W X)^-1 X'W the score vanishes where Z'(P e)² = Z'(P ∘ P) Z x, which is
    unbiased for any weights W.

    Parameters
    ----------
    design : MultiStepDesign
    total : (n,) float
        Variance of each reading. [mm²]
    """
    weights = 1.0 / total
    signed = design.columns
    shared = signed @ (np.linalg.inv(normal_matrix(design, weights)) @ signed.T)
    own = np.diagonal(shared).copy()
    shared *= shared
    squares = design.incidence * (weights**2)[:, None]
    diagonal = weights**2 - 2.0 * weights**3 * own
    matrix = squares.T @ (shared @ squares)
    matrix += (design.incidence * diagonal[:, None]).T @ design.incidence
    return LikelihoodInformation(weights, weights * own, 0.5 * matrix)


def _student_scales(
    design: MultiStepDesign,
    errors: FloatArray,
    information: LikelihoodInformation,
    inverse: FloatArray,
    tail: float,
    start: FloatArray,
) -> FloatArray:
    """Squared scales of all directions for one distribution of the noise. [mm²]"""
    weights = information.weights
    free = np.maximum(1.0 - information.leverage, _LEAST_FREE)
    residuals = weighted_residuals(design, errors, weights)
    squared = start
    for _ in range(_ROUNDS if tail else 1):
        factor = student_weight(tail, residuals**2 / (free * _floored(design, squared)))
        if tail:
            residuals = weighted_residuals(design, errors, weights * factor)
        sums = direction_sums(design, weights**2 * factor * residuals**2)
        squared = inverse @ (0.5 * sums)
    return np.asarray(squared)


def _floored(design: MultiStepDesign, squared: FloatArray) -> FloatArray:
    """Squared scales of readings; none is far below the mean."""
    total = design.incidence @ squared
    return np.asarray(np.maximum(total, _SMALLEST_WEIGHED * float(np.mean(total))))


def squared_scales(design: MultiStepDesign, errors: FloatArray) -> FloatArray:
    """Squared scales of all directions that gross errors do not move, shrunk to their means.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]

    Returns
    -------
    (m + p,) float
        Of Student's distribution with four degrees of freedom. [mm²]

    Raises
    ------
    PretravelError
        Too few readings of a direction, or readings without scatter.
    """
    level = common_scale(design, errors)
    squared = np.full(design.size, 0.5 * level)
    for _ in range(_SHAPE_ROUNDS):
        total = design.incidence @ squared
        information = likelihood_information(design, total)
        _check_rank(design, information.matrix)
        inverse = information.inverse
        found = _student_scales(design, errors, information, inverse, ROBUST_TAIL, squared)
        ratio = float(np.mean(design.incidence @ found) / np.mean(total))
        scatter = inverse * (1.0 + 3.0 * ROBUST_TAIL) * ratio**2
        squared = _shrunk(design, found, scatter, float(np.mean(design.incidence @ found)))
    return squared


def common_scale(design: MultiStepDesign, errors: FloatArray) -> float:
    """Squared scale of all readings, from the median of their residuals. [mm²]

    Raises
    ------
    PretravelError
        Readings without scatter.
    """
    free = 1.0 - design.rank / len(errors)
    residuals = weighted_residuals(design, errors, np.ones(len(errors)))
    level = float(np.mean(residuals**2)) / free
    if not level > 1e-24:
        raise PretravelError("the readings have no scatter, so they determine no variance")
    for _ in range(_MEDIAN_ROUNDS):
        middle = _NORMAL * float(np.median(np.abs(residuals)))
        level = max(middle**2 / free, 1e-6 * level)
        factor = student_weight(ROBUST_TAIL, residuals**2 / level)
        residuals = weighted_residuals(design, errors, factor)
    return level


def _shrunk(
    design: MultiStepDesign, values: FloatArray, covariance: FloatArray, level: float
) -> FloatArray:
    """Variances moved to the means of machine and probe in proportion to their scatter."""
    result = np.empty_like(values)
    for part in (slice(0, design.split), slice(design.split, None)):
        own, mean = values[part], float(values[part].mean())
        centred = np.eye(len(own)) - 1.0 / len(own)
        scatter = float(np.trace(centred @ covariance[part, part])) / max(len(own) - 1, 1)
        observed = float(own.var(ddof=1)) if len(own) > 1 else 0.0
        share = max(1.0 - scatter / observed, 0.0) if observed > 0.0 else 0.0
        result[part] = mean + share * (own - mean)
    # No pair gets the weight of a variance far below the mean, not even one without a reading:
    # a reading that is left out is judged with it.
    lowest = float(result[: design.split].min() + result[design.split :].min())
    if lowest < _SMALLEST_WEIGHED * level:
        factor = (level - _SMALLEST_WEIGHED * level) / (level - lowest)
        half = 0.5 * level
        result = half + factor * (equally_shared(design, result) - half)
    return result


def equally_shared(design: MultiStepDesign, values: FloatArray) -> FloatArray:
    """Variances with equal means of machine and probe; sums of pairs stay, (m + p, ...)."""
    machine, probe = values[: design.split], values[design.split :]
    excess = 0.5 * (machine.mean(axis=0) - probe.mean(axis=0))
    return np.asarray(values - np.multiply.outer(design.signs, excess))


def direction_variance_uncertainty(readings: MultiStepReadings, repeats: int = 1) -> float:
    """Relative standard uncertainty of the variance of one direction, where all are equal.

    Parameters
    ----------
    readings : MultiStepReadings
        Their errors do not matter.
    repeats : int
        Of every reading.

    Returns
    -------
    float
        The largest over the directions, for a fixed share of machine and probe; infinite where
        the readings do not determine it.

    >>> i, j = np.divmod(np.arange(144), 12)
    >>> 0.85 < direction_variance_uncertainty(MultiStepReadings(i, j, np.zeros(144))) < 1.2
    True
    """
    design = multi_step_design(readings)
    matrix = likelihood_information(design, np.ones(len(readings))).matrix
    # The means of repeats count as single readings; the scatter of the repeats is added.
    matrix = matrix + 0.5 * (repeats - 1) * design.incidence.T @ design.incidence
    eigenvalues, vectors = np.linalg.eigh(matrix)
    # The first combination, the share of machine and probe, is never determined.
    if eigenvalues[1] < 1e-9 * eigenvalues[-1]:
        return math.inf
    covariance = (vectors[:, 1:] / eigenvalues[1:]) @ vectors[:, 1:].T
    return float(np.sqrt(np.max(np.diag(covariance)))) / 0.5
