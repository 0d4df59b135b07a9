"""Jumps in series of several quantities (a crash, a new stylus), and single days that lie apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.qualification.series_courses import fitted_noises, weighed_noises
from pretravel.qualification.time_series import (
    SeriesNoise,
    TimeSeries,
    Whitened,
    series_of,
)

FALSE_BREAKS = 0.01
"""Probability that any break is reported of series without one, all quantities together."""
_FEWEST = 5
"""Values that level, trend and break leave degrees of freedom of."""
_OPTIMISM = 5.0
"""By so much probabilities of series that walk at random are too small at most, in simulations."""


@dataclass(frozen=True)
class Break:
    """A day that does not continue those before it.

    Attributes
    ----------
    day : int
        Row of the first day after a jump, or of the one that lies apart.
    quantity : str
        That shows it most clearly.
    size, u : float
        In its unit.
    p_value : float
        Probability of such a break anywhere in any quantity by chance.
    apart : bool
        The day alone lies apart: the days after it continue those before.
    """

    day: int
    quantity: str
    size: float
    u: float
    p_value: float
    apart: bool = False


def breaks_of(
    times: FloatArray,
    quantities: Mapping[str, tuple[FloatArray, FloatArray]],
    starts: frozenset[int] = frozenset(),
) -> tuple[Break, ...]:
    """Find the breaks of quantities that were determined on the same days.

    Parameters
    ----------
    times : (n,) float
        [days]
    quantities : mapping of str to pair of (n,) float
        Values and standard uncertainties; not a number where not known.
    starts : frozenset of int
        Rows at which new series begin in any case.

    Returns
    -------
    tuple of Break
        In the order of the days.

    Notes
    -----
    The clearest break is found first, then those before and after it (binary segmentation). Its
    probability is the mean over the noises that the values may have, with the break and a trend
    fitted, times the number of possible breaks and of quantities (Bonferroni).
    """
    found: list[Break] = []
    edges = [0, *sorted(starts), len(times)]
    parts = [np.arange(first, last) for first, last in pairwise(edges)]
    while parts:
        rows = parts.pop()
        clearest = _clearest(times, quantities, rows)
        if clearest is None:
            continue
        found.append(clearest)
        if clearest.apart:
            parts.append(rows[rows != clearest.day])
        else:
            parts += [rows[rows < clearest.day], rows[rows >= clearest.day]]
    return tuple(sorted(found, key=lambda one: one.day))


def _clearest(
    times: FloatArray, quantities: Mapping[str, tuple[FloatArray, FloatArray]], rows: IntArray
) -> Break | None:
    best: Break | None = None
    for name, (values, u) in quantities.items():
        known = rows[np.isfinite(values[rows]) & np.isfinite(u[rows])]
        if len(known) < _FEWEST:
            continue
        series = series_of(times[known], values[known], u[known])
        for place, apart in _candidates(series):
            size, own, p_value = break_at(series, place, apart=apart)
            possible = len(quantities) * 2.0 * (len(known) - 1)
            p_value *= _OPTIMISM * possible
            if p_value < FALSE_BREAKS and (best is None or p_value < best.p_value):
                best = Break(int(known[place]), name, size, own, p_value, apart)
    return best


def _candidates(series: TimeSeries) -> set[tuple[int, bool]]:
    """Places whose break is the clearest for one of three noises, from independent to walking."""
    shortest = float(np.ptp(series.times)) / len(series)
    large = float(np.var(series.values)) + float(np.max(series.u**2))
    likely = series.determined_noise(series.times[:, None])
    noises = (SeriesNoise(0.0, 0.0), likely, SeriesNoise(0.0, 100.0 * large / max(shortest, 1e-9)))
    found: set[tuple[int, bool]] = set()
    for noise in noises:
        jump, apart = _scores(series, noise)
        found.add((int(np.argmax(jump)) + 1, False))
        found.add((int(np.argmax(apart)) + 1, True))
    return found


def _scores(series: TimeSeries, noise: SeriesNoise) -> tuple[FloatArray, FloatArray]:
    """|estimate / u| of a jump before each value but the first, and of each inner value apart.

    In the differences of neighbours a jump is one value, and a value apart is two, of opposite
    signs. A trend is fitted in addition to each.
    """
    whitened = Whitened.of(series, noise.scatter, noise.walk)
    y, t = np.diff(series.values), np.diff(series.times)
    seen = whitened.solved(np.column_stack([y, t]))
    information = float(t @ seen[:, 1]) or 1.0
    push = seen[:, 0] - seen[:, 1] * (float(t @ seen[:, 0]) / information)
    main, beside = whitened.inverse_bands()
    own = main - seen[:, 1] ** 2 / information
    both = beside - seen[:-1, 1] * seen[1:, 1] / information
    jump = np.abs(push) / np.sqrt(np.maximum(own, 1e-12 * main))
    spread = np.maximum(own[:-1] + own[1:] - 2.0 * both, 1e-12 * (main[:-1] + main[1:]))
    return np.asarray(jump), np.asarray(np.abs(push[:-1] - push[1:]) / np.sqrt(spread))


def break_at(series: TimeSeries, place: int, *, apart: bool) -> tuple[float, float, float]:
    """Size of a break at a given place, its standard uncertainty and its probability by chance.

    Parameters
    ----------
    series : TimeSeries
    place : int
        Row of the first value after the jump, or of the one that lies apart.
    apart : bool
        The value alone lies apart; else the values from there on.

    Returns
    -------
    float
        Size.
    float
        Its standard uncertainty.
    float
        Probability of such a break at this place by chance, for a place that was not chosen.

    >>> values = np.array([5.0, 0.1, -0.1, 0.1, -0.1, 0.1])
    >>> size, u, p_value = break_at(TimeSeries(np.arange(6.0), values, np.full(6, 0.1)), 0,
    ...     apart=True)
    >>> round(size), p_value < 0.01
    (5, True)
    """
    from scipy.special import ndtr

    rows = np.arange(len(series))
    shape: BoolArray = rows == place if apart else rows >= place
    columns = np.column_stack([shape.astype(np.float64), series.times])
    weighed = list(weighed_noises(fitted_noises(series, columns)))
    weights = np.array([weight for weight, _ in weighed])
    sizes = np.array([one.coefficients[0] for _, one in weighed])
    own = np.array([one.u[0] for _, one in weighed])
    size = float(weights @ sizes)
    p_value = 2.0 * min(float(weights @ ndtr(sizes / own)), float(weights @ ndtr(-sizes / own)))
    return size, float(np.sqrt(weights @ (own**2 + (sizes - size) ** 2))), p_value
