"""A point that lies apart from the feature of the others: dirt, a chip, a false trigger."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import MICROMETRE, FloatArray

_CHANCE = 1e-3
"""Probability that any point of a feature with a normally distributed roughness is named."""
_FEWEST = 4
"""Degrees of freedom of the others that show their scatter."""
_LEAST = 2.0 * MICROMETRE
"""A nearer point is not named. [mm]"""


def odd_point(
    residuals: FloatArray, jacobian: FloatArray, own: FloatArray
) -> tuple[int, float, float] | None:
    """The point farthest from the feature of the others, if roughness does not explain it.

    Each residual is divided by its standard deviation from the other points (externally
    studentised; Cook and Weisberg, Residuals and Influence in Regression, 1982, section 2.2.1).

    Parameters
    ----------
    residuals, own : (n,) float
        Of the feature of least squares, and the standard uncertainty of each point by errors of
        its own. [mm]
    jacobian : (n, k) float
        Derivatives of the residuals by the parameters.

    Returns
    -------
    tuple of int, float, float, or None
        Its row, its distance from the feature of the others, and their scatter. [mm]

    >>> line = np.column_stack([np.ones(9), np.arange(9.0)])
    >>> off = 1e-4 * np.array([3, -2, 1, -3, 150, 2, -1, 3, -2.0])
    >>> left = off - line @ np.linalg.lstsq(line, off, rcond=None)[0]
    >>> row, far, scatter = odd_point(left, line, np.full(9, 2e-4))
    >>> row, round(far, 4), round(scatter, 4)
    (4, 0.015, 0.0003)
    """
    from scipy.special import stdtrit

    basis, size, _ = np.linalg.svd(jacobian, full_matrices=False)
    basis = basis[:, size > 1e-9 * size.max(initial=0.0)]
    count, dof = len(residuals), len(residuals) - basis.shape[1] - 1
    free = 1.0 - np.sum(basis**2, axis=1)
    if dof < _FEWEST or not free.min() > 1e-6:
        return None
    off = residuals / free
    others = np.maximum(residuals @ residuals - residuals * off, 0.0) / dof
    scatter = np.sqrt(np.maximum(others, np.mean(own**2)))
    row = int(np.argmax(np.abs(off) * np.sqrt(free) / scatter))
    size_of_it = abs(off[row]) * math.sqrt(free[row]) / scatter[row]
    if abs(off[row]) < _LEAST or size_of_it < stdtrit(dof, 1.0 - 0.5 * _CHANCE / count):
        return None
    return row, float(off[row]), float(scatter[row])
