"""The probability of touches for many scales of the priors at once."""

from __future__ import annotations

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.uncertainty.reduced_rows import ReducedRows, classes_of, reduced_rows

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
        shared = np.einsum("gk,vk,hk->vgh", columns, prior, columns, optimize=True)
        parts.append(_log_likelihood(shared, own, values))
    return np.concatenate(parts)


def _log_likelihood(shared: FloatArray, own: FloatArray, values: FloatArray) -> FloatArray:
    """Of values with each shared covariance (c, g, g) and own variances (o, g): (c o,)."""
    if np.ptp(own, axis=1).max() == 0.0:  # equal repeats: own variances move all eigenvalues alike
        eigenvalues, vectors = np.linalg.eigh(shared)
        turned = np.einsum("cij,i->cj", vectors, values)
        total = np.maximum(eigenvalues, 0.0)[:, None, :] + own[None, :, :1]
        terms = np.log(total) + turned[:, None, :] ** 2 / total
        return np.asarray(-0.5 * terms.sum(axis=-1).ravel())
    total = np.repeat(shared[:, None], len(own), axis=1)
    diagonal = np.arange(len(values))
    total[..., diagonal, diagonal] += own
    factor = np.linalg.cholesky(total)
    whitened = np.linalg.solve(factor, values[:, None])[..., 0]
    logarithms = np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
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
