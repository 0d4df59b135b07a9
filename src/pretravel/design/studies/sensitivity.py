"""How much of an output's variance each factor explains, with confidence intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.design.studies.results import StudyResults

CONFIDENCE = 0.95
_QUANTILES = (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE)
_RESAMPLES = 500
_LEAST_SAMPLES = 8
_SEED = 1
_DEGREE = 2
"""Of the polynomials through the samples of a Latin hypercube."""


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Shares of the factors in the variance of one output.

    Attributes
    ----------
    output : str
    factors : k str
    first, total : (k,) float
        Share of a factor alone, and together with others; nan where the plan does not separate it.
    first_interval, total_interval : (k, 2) float
        Of about 95 %; not a number where the plan has no chance in it.
    samples : int
        Designs, or base samples, that were used.
    """

    output: str
    factors: tuple[str, ...]
    first: FloatArray
    total: FloatArray
    first_interval: FloatArray
    total_interval: FloatArray
    samples: int

    @property
    def shares(self) -> FloatArray:
        """Together with others where the plan tells it, else alone, (k,)."""
        return self.first if np.isnan(self.total).all() else self.total


def sensitivity(results: StudyResults, output: str) -> Sensitivity | None:
    """The shares of the factors in the variance of an output.

    Of a Sobol' plan: Sobol' indices, see `sobol_shares`, with intervals by resampling. Of a Latin
    hypercube: shares of a sum of one polynomial of the second degree for each factor (of texts: of
    one mean for each), with intervals by resampling. Of a full-factorial plan: the main effects,
    which are exact.

    Returns
    -------
    Sensitivity or None
        None: the plan varies one factor at a time, the output does not vary, or too few designs
        have it.
    """
    values = results.numbers[output]
    good = np.isfinite(values)
    if not _varies(values[good]):
        return None
    if results.plan == "sobol":
        return _sobol(results, output)
    if results.plan == "full-factorial":
        first = np.array(
            [_main_effect(column[good], values[good]) for column in results.factors.values()]
        )
        return _alone(results, output, first, int(good.sum()))
    if results.plan == "latin-hypercube":
        return _additive(results, [output]).get(output)
    return None


def sensitivities(results: StudyResults) -> list[Sensitivity]:
    """The shares of the factors in the variance of each output that has them, see `sensitivity`.

    Outputs that the same designs have are resampled together, which takes the time of one.

    Returns
    -------
    list of Sensitivity
        In the order of the outputs.
    """
    if results.plan != "latin-hypercube":
        each = [sensitivity(results, name) for name in results.numbers]
        return [one for one in each if one is not None]
    together: dict[bytes, list[str]] = {}
    for name, values in results.numbers.items():
        good = np.isfinite(values)
        if _varies(values[good]):
            together.setdefault(good.tobytes(), []).append(name)
    found: dict[str, Sensitivity] = {}
    for names in together.values():
        found |= _additive(results, names)
    return [found[name] for name in results.numbers if name in found]


def _varies(values: FloatArray) -> bool:
    return len(values) >= 2 and bool(np.ptp(values) > 1e-12 * np.abs(values).max())


def _alone(
    results: StudyResults, output: str, first: FloatArray, samples: int,
    interval: FloatArray | None = None,
) -> Sensitivity:  # fmt: skip
    unknown = np.full((len(first), 2), np.nan)
    return Sensitivity(
        output=output,
        factors=tuple(results.factors),
        first=first,
        total=np.full(len(first), np.nan),
        first_interval=unknown if interval is None else interval,
        total_interval=unknown,
        samples=samples,
    )


def _main_effect(column: npt.NDArray[Any], values: FloatArray) -> float:
    """Variance of the means of the levels over the whole variance."""
    _, level = np.unique(column.astype(str), return_inverse=True)
    mean = np.bincount(level, values) / np.bincount(level)
    return float(np.mean((mean[level] - values.mean()) ** 2) / np.var(values))


def _sobol(results: StudyResults, output: str) -> Sensitivity | None:
    count, n = len(results.factors), results.base_samples
    values = results.numbers[output].reshape(count + 2, n)
    # A sample without one of its designs is left out whole.
    values = values[:, np.isfinite(values).all(axis=0)]
    n = values.shape[1]
    if n < _LEAST_SAMPLES:
        return None
    rows = np.random.default_rng(_SEED).integers(0, n, (_RESAMPLES, n))
    again = np.array([sobol_shares(values[:, row]) for row in rows])
    low, high = np.quantile(again, _QUANTILES, axis=0)
    first, total = sobol_shares(values)
    return Sensitivity(
        output=output,
        factors=tuple(results.factors),
        first=first,
        total=total,
        first_interval=np.column_stack([low[0], high[0]]),
        total_interval=np.column_stack([low[1], high[1]]),
        samples=n,
    )


def sobol_shares(values: FloatArray) -> FloatArray:
    """Sobol' indices of the first order and total ones.

    scipy.stats.sobol_indices has the same estimators, but takes powers of two only and gives other
    intervals at each call.

    Parameters
    ----------
    values : (k + 2, n) float
        In the samples A, in B, and in A with the column of each of k factors from B.

    Returns
    -------
    (2, k) float

    References
    ----------
    Saltelli et al. 2010, Table 2, (b) and (f), doi 10.1016/j.cpc.2009.09.018.
    """
    # The estimators lose less to rounding and chance without the common mean.
    a, b, *mixed = values - values[:2].mean()
    variance = np.var(values[:2])
    both = np.array(mixed)
    first = np.mean(b * (both - a), axis=1)
    total = 0.5 * np.mean((a - both) ** 2, axis=1)
    return np.asarray(np.array([first, total]) / variance)


def _additive(results: StudyResults, outputs: Sequence[str]) -> dict[str, Sensitivity]:
    """Of outputs that the same designs have."""
    good = np.isfinite(results.numbers[outputs[0]])
    columns = [_polynomial(column[good]) for column in results.factors.values()]
    values = np.column_stack([results.numbers[name][good] for name in outputs])
    count, widths = len(values), [part.shape[1] for part in columns]
    if count < 2 * sum(widths) + _LEAST_SAMPLES:
        return {}
    table = np.column_stack([*columns, values])
    rows = np.vstack([np.ones(count), (table - table.mean(axis=0)).T])
    generator = np.random.default_rng(_SEED)
    chance = np.full(count, 1.0 / count)
    again = np.array(
        [_shares(rows, widths, generator.multinomial(count, chance)) for _ in range(_RESAMPLES)]
    )
    low, high = np.quantile(again, _QUANTILES, axis=0)
    first = _shares(rows, widths, np.ones(count))
    return {
        name: _alone(results, name, first[i], count, np.column_stack([low[i], high[i]]))
        for i, name in enumerate(outputs)
    }


def _polynomial(column: npt.NDArray[Any]) -> FloatArray:
    """Columns of one factor without a constant, (n, p)."""
    if column.dtype == object:
        texts = np.unique(column.astype(str))
        return np.asarray((column.astype(str)[:, None] == texts[1:]).astype(np.float64))
    spread = np.ptp(column) or 1.0
    scaled = 2.0 * (np.asarray(column, np.float64) - column.min()) / spread - 1.0
    return np.asarray(np.column_stack([scaled**power for power in range(1, _DEGREE + 1)]))


def _shares(rows: FloatArray, widths: Sequence[int], weights: npt.NDArray[Any]) -> FloatArray:
    """Variance of each part of the least-squares sum over that of the values, (outputs, factors).

    Both follow from the covariance of columns and values: a resample costs one product.

    Parameters
    ----------
    rows : (1 + p + outputs, n) float
        Ones, then the p columns of all factors and the values, each about its mean.
    widths : sequence of int
        Columns of each factor.
    weights : (n,) float
    """
    products = (rows * weights) @ rows.T / weights.sum()
    covariance = products[1:, 1:] - np.outer(products[0, 1:], products[0, 1:])
    ends = np.cumsum([0, *widths])
    last = ends[-1]
    to_columns = covariance[:last]
    coefficients = np.linalg.lstsq(to_columns[:, :last], to_columns[:, last:], rcond=None)[0]
    explained = [
        np.sum(coefficients[p] * (covariance[p, p] @ coefficients[p]), axis=0)
        for p in (slice(begin, end) for begin, end in pairwise(ends))
    ]
    return np.asarray(np.array(explained).T / np.diag(covariance)[last:, None])
