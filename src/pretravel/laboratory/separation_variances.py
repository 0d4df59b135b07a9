"""Variances of machine and probe directions: least squares and restricted likelihood."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.laboratory.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    RepeatedPair,
    multi_step_design,
)

_ROUNDS = 4
"""Weights and variances are determined in turn; they converge in two or three rounds."""
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
    Nafi and Mayer 2011, equations 7 and 8, here with the degrees of freedom that the fit takes
    from each residual.
    """
    values, covariance = _from_squared_residuals(design, errors)
    if repeated is not None:
        values, covariance = _updated(values, covariance, repeated)
    return DirectionVariances(values, covariance, design.incidence @ values)


def _from_squared_residuals(
    design: MultiStepDesign, errors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    project = np.eye(len(errors)) - design.design @ np.linalg.pinv(design.design)
    residuals = project @ errors
    squared = project**2
    matrix = design.incidence.T @ squared @ design.incidence
    _check_rank(design, matrix)
    inverse = np.linalg.pinv(matrix, rcond=1e-9)
    variances = inverse @ (design.incidence.T @ residuals**2)
    total = np.maximum(design.incidence @ variances, 0.05 * float(np.mean(residuals**2)))
    # Cov(r_a², r_b²) = 2 (M V M)_ab² for normal noise.
    scatter = 2.0 * ((project * total) @ project) ** 2
    middle = design.incidence.T @ scatter @ design.incidence
    return np.asarray(variances), np.asarray(inverse @ middle @ inverse)


def _check_rank(design: MultiStepDesign, matrix: FloatArray) -> None:
    """The variances' matrix lacks one rank always, more where directions have few readings."""
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
        f"the variances' identification matrix lacks {design.size - rank} ranks. One rank always "
        "lacks (the share of machine and probe); more means directions with too few readings"
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
    """
    from scipy.optimize import nnls

    start = _from_squared_residuals(design, errors)[0]
    level = float(np.mean(design.incidence @ start))
    if level <= 0.0:
        raise PretravelError("the readings have no scatter, so they determine no variance")
    values = start
    covariance: FloatArray = np.zeros((design.size, design.size))
    shrunk = np.full(design.size, 0.5 * level)
    for _ in range(_ROUNDS):
        matrix, right = _likelihood_equations(design, errors, shrunk, repeated)
        covariance = np.asarray(
            np.linalg.pinv(matrix, rcond=1e-9, hermitian=True), dtype=np.float64
        )
        values = covariance @ right
        shrunk = _shrunk(design, values, covariance, level)
    # The nearest variances that are not negative, in the measure of the likelihood. Where none is
    # negative they are the same, up to the share of machine and probe.
    eigenvalues, vectors = np.linalg.eigh(matrix)
    root = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T
    admissible = np.asarray(nnls(root, root @ values)[0])
    # The mean of both: shrunk variances alone are too low where the variance is highest.
    of_readings = design.incidence @ (0.5 * (admissible + shrunk))
    return DirectionVariances(admissible, covariance, of_readings)


def _likelihood_equations(
    design: MultiStepDesign,
    errors: FloatArray,
    shrunk: FloatArray,
    repeated: PairVariance | None,
) -> tuple[FloatArray, FloatArray]:
    """Fisher's information at these variances, and the observed part of the score.

    With P = V^-1 - V^-1 X (X' V^-1 X)^-1 X' V^-1 the score vanishes where
    Z'(P e)² = Z'(P ∘ P) Z x, which is unbiased for any V.
    """
    total = design.incidence @ shrunk
    weighted = design.design / total[:, None]
    inner = np.linalg.solve(design.design.T @ weighted, weighted.T)
    project = np.diag(1.0 / total) - weighted @ inner
    matrix = 0.5 * design.incidence.T @ (project**2) @ design.incidence
    right = 0.5 * design.incidence.T @ (project @ errors) ** 2
    if repeated is not None:
        pair = [repeated.machine, repeated.probe]
        weight = 0.5 * repeated.dof / (shrunk[repeated.machine] + shrunk[repeated.probe]) ** 2
        matrix[np.ix_(pair, pair)] += weight
        right[pair] += weight * repeated.variance
    return np.asarray(matrix), np.asarray(right)


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
    # No pair gets the weight of a variance far below the mean.
    lowest = float(np.min(design.incidence @ result))
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
    matrix, _ = _likelihood_equations(design, readings.errors, np.full(design.size, 0.5), None)
    # The means of repeats count as single readings; the scatter of the repeats is added.
    matrix = matrix + 0.5 * (repeats - 1) * design.incidence.T @ design.incidence
    eigenvalues, vectors = np.linalg.eigh(matrix)
    # The first combination, the share of machine and probe, is never determined.
    if eigenvalues[1] < 1e-9 * eigenvalues[-1]:
        return math.inf
    covariance = (vectors[:, 1:] / eigenvalues[1:]) @ vectors[:, 1:].T
    return float(np.sqrt(np.max(np.diag(covariance)))) / 0.5
