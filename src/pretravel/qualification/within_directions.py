"""What differences among touches of one direction show: effects of time and of order.

A map, the reference's size and its centre are the same for all touches of a direction. Differences
within directions are free of them, and of every error of their models.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, IntArray

_LEAST_INFORMATION = 1e-6
"""Of a column's variation, the share within directions below which it is rounding."""
_LEAST_SINGULAR = 1e-3
"""Of columns of length one: smaller singular values belong to what is not determined."""
_HEAVY = 0.05  # level at which tails are taken as heavy: limits are then wider
_SETS, _NUMBERS = 999, 2_000_000
_MOST_TESTED, _TESTED_REPEATS = 10_000, 8
"""Touches with which effects are tested for, and of them in a direction at least: with more touches
the estimates are better, but a test of so many finds every effect that matters."""


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
        Probability of so large an effect without one; nan if nothing is determined.
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


def exchanged_within(values: npt.ArrayLike, groups: npt.ArrayLike) -> FloatArray:
    """Values in sets in which the touches of each direction have exchanged theirs at random.

    Without an effect of time or order all sets are equally probable, whatever the distribution of
    the noise is and however it depends on the direction.

    Parameters
    ----------
    values : (n,) float
    groups : (n,) int

    Returns
    -------
    (s, n) float
        999 sets, fewer for more than 2000 values; seeded. See `tested_touches` for many values.

    >>> sets = exchanged_within([1.0, 2.0, 5.0], [0, 0, 1])
    >>> sets.shape, np.unique(sets, axis=0).tolist()
    ((999, 3), [[1.0, 2.0, 5.0], [2.0, 1.0, 5.0]])
    """
    number = np.unique(np.asarray(groups), return_inverse=True)[1]
    touches = _exchanges(tuple(number.tolist()))
    return np.asarray(np.asarray(values, dtype=np.float64)[touches])


@lru_cache(maxsize=2)
def _exchanges(number: tuple[int, ...]) -> IntArray:
    """Of each set: the touch whose value each touch gets, (s, n).

    Kept, because several tests of a qualification exchange the values of the same directions.
    """
    each = np.array(number)
    order = np.argsort(each, kind="stable")
    sets = max(199, min(_SETS, _NUMBERS // len(order)))
    keys = each[order] + np.random.default_rng(0).random((sets, len(order)))
    found = np.empty(keys.shape, dtype=np.int64)
    found[:, order] = order[np.argsort(keys, axis=1)]
    return found


def tested_touches(groups: npt.ArrayLike) -> BoolArray:
    """Touches of which a test by exchange uses sets: at most about 10000.

    Parameters
    ----------
    groups : (n,) int
        Number of the direction of each touch, from zero.

    Returns
    -------
    (n,) bool
        All where there are few. Of directions with many touches each, a part of their touches; of
        many directions whole ones. They are drawn at random (seeded).

    >>> bool(tested_touches([0, 0, 1]).all()), int(tested_touches(np.arange(50_000) // 4).sum())
    (True, 11000)
    """
    number = np.asarray(groups, dtype=np.int64)
    if len(number) <= _MOST_TESTED:
        return np.ones(len(number), dtype=bool)
    generator = np.random.default_rng(0)
    directions = int(number.max()) + 1
    share = max(_MOST_TESTED, _TESTED_REPEATS * directions) / len(number)
    found = np.asarray(generator.random(len(number)) < share)
    count = np.bincount(number[found], minlength=directions)
    drawn = generator.permutation(directions)
    chosen = np.zeros(directions, dtype=bool)
    chosen[drawn[np.cumsum(count[drawn]) <= 1.1 * _MOST_TESTED]] = True
    return np.asarray(found & chosen[number])


def exchange_probability(seen: float, exchanged: FloatArray) -> float:
    """Probability of a statistic at least as large as that seen, among exchanged sets.

    Parameters
    ----------
    seen : float
    exchanged : (s,) float
        Of the sets of `exchanged_within`.

    Returns
    -------
    float
        At least 1/(s + 1).

    >>> exchange_probability(2.0, np.array([1.0, 2.0, 3.0]))
    0.75
    """
    # Sums in another order differ by rounding.
    least = seen * (1.0 - 1e-9)
    return (1.0 + float(np.count_nonzero(exchanged >= least))) / (len(exchanged) + 1.0)


def fit_within_directions(
    values: npt.ArrayLike,
    columns: npt.ArrayLike,
    groups: npt.ArrayLike,
    beside: npt.ArrayLike | None = None,
) -> WithinDirections:
    """Least squares of values on columns, with a free constant for each direction.

    Parameters
    ----------
    values : (n,) float
        [mm]
    columns : (n, k) float
        Functions of time or order, of about unit size; their coefficients are wanted.
    groups : (n,) int
        Number of the direction of each touch.
    beside : (n, b) float, optional
        Columns of other effects, estimated together with these.

    Returns
    -------
    WithinDirections
        The test compares the part that the columns explain with that in `exchanged_within` sets:
        it holds its level for noise of any distribution (with `beside` nearly: Freedman and Lane
        1983). Its least p value is 0.001.

    >>> time = np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0])
    >>> fit = fit_within_directions(5.0 + time**2, time[:, None], [0, 0, 0, 1, 1, 1])
    >>> fit.value.round(9).tolist(), fit.dof
    ([2.0], 3.0)
    """
    design = np.asarray(columns, dtype=np.float64)
    reading = centred_within(values, groups)
    within = centred_within(design, groups)
    others = np.zeros((len(reading), 0))
    if beside is not None:
        left, singular, _ = np.linalg.svd(centred_within(beside, groups), full_matrices=False)
        others = left[:, singular > 1e-6 * np.sqrt(len(reading))]
        reading = reading - others @ (others.T @ reading)
        within = within - others @ (others.T @ within)
    size = np.sum((design - design.mean(axis=0)) ** 2, axis=0)
    information = np.sum(within**2, axis=0)
    determined = information > _LEAST_INFORMATION * np.maximum(size, 1e-3)
    scale = np.where(determined, np.sqrt(information), np.inf)
    left, singular, right = np.linalg.svd(within / scale, full_matrices=False)
    kept = singular > _LEAST_SINGULAR
    # A combination that is not determined takes the coefficients of which it consists with it.
    determined = determined & ~np.any(np.abs(right[~kept]) > 1e-6, axis=0)
    along = left[:, kept].T @ reading
    rank = int(np.count_nonzero(kept))
    directions = len(np.unique(np.asarray(groups)))
    dof = float(len(reading) - directions - rank - others.shape[1])
    rest = max(float(np.sum(reading**2) - np.sum(along**2)), 0.0)
    variance = rest / dof if dof > 0.0 else np.nan
    p_value = np.nan
    if rank and dof > 0.0:
        tested = tested_touches(groups)
        part, base = reading[tested], left[tested][:, kept]
        sets = exchanged_within(part, np.asarray(groups)[tested])
        explained = np.sum((sets @ base) ** 2, axis=1)
        p_value = exchange_probability(float(np.sum((base.T @ part) ** 2)), explained)
    mask = np.where(determined, 1.0, 0.0) / scale
    inverse = right[kept].T / singular[kept]
    return WithinDirections(
        value=(inverse @ along) * mask,
        covariance=variance * (inverse @ inverse.T) * np.outer(mask, mask),
        determined=determined,
        p_value=p_value,
        noise=float(np.sqrt(variance)),
        dof=dof,
    )


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


def dof_of_tails(values: FloatArray, groups: IntArray, within: FloatArray) -> float:
    """Student's degrees of freedom of the scatter; infinite unless its tails are heavy.

    Without the touch that lies furthest from its direction, which may be a gross error.

    Parameters
    ----------
    values : (n,) float
    groups : (n,) int
    within : (n,) float
        From `centred_within`.
    """
    kept = np.arange(len(values)) != int(np.argmax(np.abs(within)))
    tails = tail_kurtosis(values[kept], groups[kept])
    return tails.student_dof if tails.p_value < _HEAVY else np.inf


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
