"""Heavy tails of repeats: more large errors than a normal distribution has."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.qualification.within_directions import centred_within, tested_touches

_DRAWN, _DRAWN_NUMBERS = 999, 2_000_000
_FEWEST = 4
"""Repeated touches. Of three of one direction the fourth powers are half of the squared squares."""
_MOST_DOF = 200.0
"""A Student distribution with this many degrees of freedom is a normal one."""


@dataclass(frozen=True)
class Tails:
    """Shape of the distribution of repeats.

    Attributes
    ----------
    kurtosis : float
        Excess kurtosis of a touch, zero for a normal distribution; nan with fewer than
        four repeated touches.
    student_dof : float
        Degrees of freedom of the Student distribution with this kurtosis: above 4, infinite for
        tails that are normal or light.
    p_value : float
        Probability of so large a kurtosis of normal errors; nan with fewer than
        four repeated touches.
    """

    kurtosis: float
    student_dof: float
    p_value: float


def tail_kurtosis(values: npt.ArrayLike, groups: npt.ArrayLike) -> Tails:
    """Excess kurtosis of repeats, corrected for small groups.

    Parameters
    ----------
    values : (n,) float
        In any unit, all of one scatter.
    groups : (n,) int
        Number of the direction of each touch.

    Returns
    -------
    Tails

    Notes
    -----
    Differences from the mean of a group of m have the fourth moment 3 σ⁴ (1 - 1/m)² plus the
    fourth cumulant times ((1 - 1/m)⁴ + (m - 1)/m⁴). With the square of the pooled variance, which
    both enter too, this gives both without bias; the kurtosis is their ratio. The p value is
    that of 999 normal sets with the same groups (seeded; fewer for more than 2000 touches): it
    holds its level for any number of repeats.

    >>> rng = np.random.default_rng(1)
    >>> groups = np.repeat(np.arange(2000), 3)
    >>> tails = tail_kurtosis(rng.laplace(size=6000), groups)
    >>> round(tails.kurtosis), round(tails.student_dof), round(tails.p_value, 3)
    (3, 6, 0.003)
    """
    number = np.unique(np.asarray(groups), return_inverse=True)[1].astype(np.int64)
    repeated = np.bincount(number)[number] >= 2
    number = np.unique(number[repeated], return_inverse=True)[1].astype(np.int64)
    reading = np.asarray(values, dtype=np.float64)[repeated]
    residual = centred_within(reading, number) if len(reading) >= _FEWEST else np.zeros(0)
    if not np.any(residual):
        return Tails(float("nan"), float("inf"), float("nan"))
    kurtosis = float(_kurtosis(residual[:, None], number)[0])
    p_value = _probability(reading, number)
    student = 4.0 + 6.0 / kurtosis if kurtosis > 6.0 / _MOST_DOF else float("inf")
    return Tails(kurtosis, student, p_value)


def _probability(reading: FloatArray, number: IntArray) -> float:
    """Of so large a kurtosis of normal errors in the same groups."""
    tested = tested_touches(number)
    part = np.unique(number[tested], return_inverse=True)[1].astype(np.int64)
    seen = float(_kurtosis(centred_within(reading[tested], part)[:, None], part)[0])
    sets = min(_DRAWN, _DRAWN_NUMBERS // len(part))
    normal = np.random.default_rng(0).standard_normal((len(part), sets))
    drawn = _kurtosis(centred_within(normal, part), part)
    return (1.0 + float(np.count_nonzero(drawn >= seen))) / (sets + 1.0)


def _kurtosis(residuals: FloatArray, number: IntArray) -> FloatArray:
    """Excess kurtosis of each column of residuals within groups, (n, c) to (c,)."""
    m = np.bincount(number).astype(np.float64)
    dof = float(np.sum(m - 1.0))
    square = residuals**2
    fourth = np.sum(square**2, axis=0)
    squared = (np.sum(square, axis=0) / dof) ** 2
    # Expectations: fourth = 3 a σ⁴ + b κ₄, squared = (1 + 2 / dof) σ⁴ + c κ₄.
    a = float(np.sum(m * (1.0 - 1.0 / m) ** 2))
    b = float(np.sum(m * ((1.0 - 1.0 / m) ** 4 + (m - 1.0) / m**4)))
    c = float(np.sum((m - 1.0) ** 2 / m)) / dof**2
    normal = 1.0 + 2.0 / dof
    determinant = 3.0 * a * c - normal * b
    sigma = (c * fourth - b * squared) / determinant
    cumulant = (3.0 * a * squared - normal * fourth) / determinant
    return np.asarray(cumulant / np.maximum(sigma, 1e-12 * squared))
