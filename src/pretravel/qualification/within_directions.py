"""What differences among touches of one direction show: effects of time and of order.

A map, the reference's size and its centre are the same for all touches of a direction. Differences
within directions are free of them, and of every error of their models.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import BoolArray, FloatArray, IntArray

_LEAST_INFORMATION = 1e-6
"""Of a column's variation, the share within directions below which it is rounding."""
_LEAST_SINGULAR = 1e-3
"""Of columns of length one: smaller singular values belong to what is not determined."""
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
