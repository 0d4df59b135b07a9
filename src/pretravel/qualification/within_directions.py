"""What differences among touches of one direction show: effects of time and of order.

A map, the reference's size and its centre are the same for all touches of a direction. Differences
within directions are free of them, and of every error of their models.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray

_LEAST_INFORMATION = 1e-9
"""Of a column's variation, the share within directions below which it is rounding."""


@dataclass(frozen=True, eq=False)
class WithinDirections:
    """Coefficients of columns, from differences within directions alone.

    Attributes
    ----------
    value : (k,) float
        Zero where the touches do not determine it. [mm for columns without unit]
    covariance : (k, k) float
        Zero where the touches do not determine it. [mm²]
    determined : (k,) bool
        Whether the touches determine each coefficient.
    p_value : float
        Probability of so large an effect without one (F test); nan if nothing is determined.
    noise : float
        Standard deviation of a touch that remains. [mm]
    dof : float
        Of the noise: touches less directions and coefficients.
    """

    value: FloatArray
    covariance: FloatArray
    determined: BoolArray
    p_value: float
    noise: float
    dof: float


def centred_within(values: npt.ArrayLike, groups: npt.ArrayLike) -> FloatArray:
    """Values less the mean of their group.

    Parameters
    ----------
    values : (n,) or (n, k) float
    groups : (n,) int

    Returns
    -------
    the same shape

    >>> centred_within([1.0, 3.0, 7.0], [0, 0, 1]).tolist()
    [-1.0, 1.0, 0.0]
    """
    given = np.asarray(values, dtype=np.float64)
    number = np.unique(np.asarray(groups), return_inverse=True)[1]
    count = np.bincount(number)
    ordered = given[np.argsort(number, kind="stable")]
    total = np.add.reduceat(ordered, np.cumsum(count) - count, axis=0)
    count = count.reshape(-1, *(1,) * (given.ndim - 1))
    return np.asarray(given - (total / count)[number])


def fit_within_directions(
    values: npt.ArrayLike, columns: npt.ArrayLike, groups: npt.ArrayLike
) -> WithinDirections:
    """Least squares of values on columns, with a free constant for each direction.

    Parameters
    ----------
    values : (n,) float
        [mm]
    columns : (n, k) float
        Functions of time or order; their coefficients are wanted.
    groups : (n,) int
        Number of the direction of each touch.

    Returns
    -------
    WithinDirections
        The F test holds its level for normal noise of one size. It has as many degrees of freedom
        as coefficients that are determined, and those of the noise.

    >>> time = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
    >>> fit = fit_within_directions(5.0 + time**2, time[:, None], [0, 0, 0, 1, 1, 1])
    >>> fit.value.round(9).tolist(), fit.dof
    ([2.0], 3.0)
    """
    from scipy.stats import f

    design = np.asarray(columns, dtype=np.float64)
    within = centred_within(design, groups)
    reading = centred_within(values, groups)
    size = np.sum((design - design.mean(axis=0)) ** 2, axis=0)
    information = np.sum(within**2, axis=0)
    determined = information > _LEAST_INFORMATION * np.maximum(size, 1e-300)
    scale = np.where(determined, np.sqrt(np.where(determined, information, 1.0)), np.inf)
    scaled = within / scale
    left, singular, right = np.linalg.svd(scaled, full_matrices=False)
    kept = singular > 1e-6 * max(float(np.max(singular, initial=0.0)), 1e-300)
    kept &= singular > 1e-12
    # A combination that is not determined takes the coefficients of which it consists with it.
    lost = np.any(np.abs(right[~kept]) > 1e-6, axis=0)
    determined = determined & ~lost
    inverse = right[kept].T / singular[kept]
    along = left[:, kept].T @ reading
    rank = int(np.count_nonzero(kept))
    dof = float(len(reading) - (int(np.max(np.unique(groups, return_inverse=True)[1])) + 1) - rank)
    rest = float(np.sum(reading**2) - np.sum(along**2))
    variance = max(rest, 0.0) / dof if dof > 0.0 else np.nan
    p_value = np.nan
    if rank and dof > 0.0:
        mean_square = float(np.sum(along**2)) / rank
        ratio = mean_square / variance if variance > 0.0 else np.inf
        p_value = float(f.sf(ratio, rank, dof)) if mean_square > 0.0 else 1.0
    mask = np.where(determined, 1.0, 0.0) / scale
    return WithinDirections(
        value=(inverse @ along) * mask,
        covariance=variance * (inverse @ inverse.T) * np.outer(mask, mask),
        determined=determined,
        p_value=p_value,
        noise=float(np.sqrt(variance)),
        dof=dof,
    )
