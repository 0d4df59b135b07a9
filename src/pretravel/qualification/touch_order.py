"""Hysteresis: the error of a touch depends on the direction of the touch before.

After a touch the tip does not return to quite the same place: seats and cables hold a part of the
last push. Touches of one direction after touches of different directions show it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray
from pretravel.maps import ReferenceDrift
from pretravel.qualification.within_directions import (
    WithinDirections,
    centred_within,
    exchange_probability,
    exchanged_within,
    fit_within_directions,
    tested_touches,
)

FIRST = -1
"""In the place of a predecessor: there was no touch before."""
_FEWEST_CONTRASTS = 3


@dataclass(frozen=True)
class BetweenPredecessors:
    """Scatter between touches of one direction after different directions.

    Attributes
    ----------
    variance : float
        Of the effect of the predecessor, without that of a touch: zero if the estimate is negative,
        nan if the touches do not show it. [mm²]
    u_variance : float
        Standard uncertainty of the variance, nan likewise. [mm²]
    p_value : float
        Probability of so large a variance without an effect; nan likewise.
    dof_between, dof_within : int
        Different predecessors in all directions, and repeats of the same predecessor.
    warning : str
        What the order of the touches does not show; empty without such a limit.
    """

    variance: float
    u_variance: float
    p_value: float
    dof_between: int
    dof_within: int
    warning: str


def predecessors(order: npt.ArrayLike) -> IntArray:
    """The row of the touch before each touch.

    Parameters
    ----------
    order : (n,) int or float
        Times or numbers of the touches, all different.

    Returns
    -------
    (n,) int
        `FIRST` for the first touch.

    >>> predecessors([10.0, 30.0, 20.0]).tolist()
    [-1, 2, 0]
    """
    sequence = np.argsort(np.asarray(order), kind="stable")
    before = np.full(len(sequence), FIRST, dtype=np.int64)
    before[sequence[1:]] = sequence[:-1]
    return before


def previous_directions(directions: npt.ArrayLike, before: npt.ArrayLike) -> FloatArray:
    """Contact normals of the touches before; zeros for the first touch.

    Parameters
    ----------
    directions : (n, 3) float
    before : (n,) int
        From `predecessors`.

    Returns
    -------
    (n, 3) float

    >>> previous_directions([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [-1, 0]).tolist()
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    """
    normals = np.asarray(directions, dtype=np.float64)
    row = np.asarray(before, dtype=np.int64)
    return np.where((row == FIRST)[:, None], 0.0, normals[row])


def hysteresis_columns(directions: npt.ArrayLike, previous: npt.ArrayLike) -> FloatArray:
    """Columns of a memory of the push before: lateral, axial, and reversal.

    Parameters
    ----------
    directions, previous : (n, 3) float
        Contact normals n of the touches, and m of the touches before, probe frame; m is zero for
        the first touch.

    Returns
    -------
    (n, 3) float
        m_x n_x + m_y n_y and m_z n_z: the rest position of the tip stays moved along m, by a length
        that is the coefficient, and the pretravel is larger by its part along n. Last: one where
        the lateral push is the reverse of that before (angle above 90°), else zero.

    >>> hysteresis_columns([[1.0, 0.0, 0.0]], [[-0.6, 0.0, 0.8]]).tolist()
    [[-0.6, 0.0, 1.0]]
    """
    normals = np.asarray(directions, dtype=np.float64)
    products = normals * np.asarray(previous, dtype=np.float64)
    lateral = products[:, 0] + products[:, 1]
    # Touches at right angles are neither the one nor the other, to rounding of their normals.
    reversal = np.where(lateral < -1e-6, 1.0, 0.0)
    return np.column_stack([lateral, products[:, 2], reversal])


def estimated_hysteresis(
    values: npt.ArrayLike,
    directions: npt.ArrayLike,
    groups: npt.ArrayLike,
    order: npt.ArrayLike,
    beside: npt.ArrayLike | None = None,
) -> WithinDirections:
    """A lateral and an axial memory of the push before, from repeats alone.

    Parameters
    ----------
    values : (n,) float
        Pretravel. [mm]
    directions : (n, 3) float
        Contact normals, probe frame.
    groups : (n,) int
        Number of the direction of each touch.
    order : (n,) float
        Times or numbers of the touches.
    beside : (n, b) float, optional
        Columns of other effects, estimated together with these.

    Returns
    -------
    WithinDirections
        Coefficients of the first two of `hysteresis_columns`: movement of the tip's rest position
        by the push before, lateral and axial. A drift is estimated together with them if it is
        separable. [mm]

    >>> normals = np.tile(np.vstack([np.eye(3), -np.eye(3)]), (2, 1))
    >>> groups, order = np.tile(np.arange(6), 2), np.array([0, 1, 2, 3, 4, 5, 9, 11, 8, 10, 7, 6])
    >>> before = previous_directions(normals, predecessors(order))
    >>> memory = hysteresis_columns(normals, before) @ [0.001, 0.002, 0.0]
    >>> estimated_hysteresis(groups + memory, normals, groups, order).value.round(9).tolist()
    [0.001, 0.002]
    """
    before = previous_directions(directions, predecessors(order))
    columns = hysteresis_columns(directions, before)[:, :2]
    others = np.zeros((len(columns), 0)) if beside is None else np.asarray(beside)
    if drift_is_separable(groups, order):
        others = np.hstack([others, drift_columns(directions, order)])
    return fit_within_directions(values, columns, groups, others if others.shape[1] else None)


def between_predecessors(
    values: npt.ArrayLike, groups: npt.ArrayLike, order: npt.ArrayLike
) -> BetweenPredecessors:
    """Whether touches of one direction scatter more after different directions than after one.

    Parameters
    ----------
    values : (n,) float
        [mm]
    groups : (n,) int
        Number of the direction of each touch.
    order : (n,) float
        Times or numbers of the touches.

    Notes
    -----
    Analysis of variance: touches within predecessors within directions. The estimate of the
    variance is unbiased before negative ones are set to zero. The test exchanges the touches of
    each direction at random: it holds its level for noise of any distribution. A drift, or feeds
    that differ, must be subtracted before.

    >>> seen = between_predecessors([0.1, 0.2, 0.3, 0.4], [0, 0, 1, 1], range(4))
    >>> seen.p_value, seen.warning[:36]
    (nan, 'all repeats were made in a row, so h')
    """
    value = np.asarray(values, dtype=np.float64)
    group = np.unique(np.asarray(groups), return_inverse=True)[1]
    before = predecessors(order)
    after = np.where(before == FIRST, FIRST, group[before])
    cell = np.unique(np.stack([group, after]), axis=1, return_inverse=True)[1].ravel()
    in_cell, in_group = np.bincount(cell), np.bincount(group)
    of_cell = np.zeros(len(in_cell), dtype=np.int64)
    of_cell[cell] = group
    dof_between = len(in_cell) - len(in_group)
    dof_within = len(value) - len(in_cell)
    warning = _limit_of_order(group, after, dof_between, dof_within)
    if dof_between < _FEWEST_CONTRASTS or dof_within == 0:
        return BetweenPredecessors(np.nan, np.nan, np.nan, dof_between, dof_within, warning)
    value = centred_within(value, group)
    mean_cell = np.bincount(cell, value) / in_cell
    square_within = float(np.sum((value - mean_cell[cell]) ** 2)) / dof_within
    square_between = float(np.sum(in_cell * mean_cell**2)) / dof_between
    effective = (len(value) - float(np.sum(in_cell**2 / in_group[of_cell]))) / dof_between
    spread = 2.0 * (square_between**2 / dof_between + square_within**2 / dof_within)
    return BetweenPredecessors(
        variance=max((square_between - square_within) / effective, 0.0),
        u_variance=float(np.sqrt(spread)) / effective,
        p_value=_probability_between(value, group, cell),
        dof_between=dof_between,
        dof_within=dof_within,
        warning=warning,
    )


def _probability_between(value: FloatArray, group: IntArray, cell: IntArray) -> float:
    """Of so large a sum of squares between cells, when touches of a direction are exchanged."""
    tested = tested_touches(group)
    part, groups = value[tested], group[tested]
    number = np.unique(cell[tested], return_inverse=True)[1].ravel()
    count = np.bincount(number)
    by_cell, starts = np.argsort(number, kind="stable"), np.cumsum(count) - count
    sets = np.concatenate([part[None], exchanged_within(part, groups)])[:, by_cell]
    between = np.sum(np.add.reduceat(sets, starts, axis=1) ** 2 / count, axis=1)
    return exchange_probability(float(between[0]), between[1:])


def _limit_of_order(group: IntArray, after: IntArray, dof_between: int, dof_within: int) -> str:
    if dof_between + dof_within == 0:
        return "no direction was touched twice, so hysteresis is not seen: touch in several passes"
    arrivals = np.bincount(group[after != group], minlength=int(group.max()) + 1)
    if np.all(arrivals <= 1):
        return (
            "all repeats were made in a row, so hysteresis is seen only once for each direction: "
            "repeat in passes, each in another order"
        )
    if dof_between < _FEWEST_CONTRASTS:
        return (
            "each direction was touched after the same direction every time, so hysteresis is part "
            "of the map: take another order in each pass"
        )
    if dof_within == 0:
        return (
            "no direction was touched twice after the same direction, so hysteresis is part of the "
            "repeatability"
        )
    return ""


LEAST_TIME_WITHIN = 0.2
"""Share of the variance of time within directions from which a drift is separable.

Three passes have 0.89, two have 0.75; three repeats in a row have 0.001 of 25 directions."""
_FEWEST_REPEATS = 6


def relative_times(times: npt.ArrayLike) -> FloatArray:
    """Times as a share of the run, from -1/2 at its start to 1/2 at its end.

    Parameters
    ----------
    times : (n,) float
        In any unit.

    Returns
    -------
    (n,) float
        Zeros if all times are the same.

    >>> relative_times([10.0, 20.0, 30.0]).tolist()
    [-0.5, 0.0, 0.5]
    """
    time = np.asarray(times, dtype=np.float64)
    length = float(np.ptp(time)) or 1.0
    return np.asarray((time - 0.5 * (time.max() + time.min())) / length)


def drift_columns(
    directions: npt.ArrayLike, times: npt.ArrayLike, *, slows: bool = False
) -> FloatArray:
    """Columns n_x t, n_y t and n_z t of a drift, with t of `relative_times`.

    Parameters
    ----------
    directions : (n, 3) float
        Contact normals.
    times : (n,) float
    slows : bool
        The drift slows down (`ReferenceDrift.course`); else it is linear.

    Returns
    -------
    (n, 3) float
        The coefficients are the drift over the whole run. Pretravel is smaller where the reference
        comes towards the tip: for values of pretravel the reference moves by the negative
        coefficients, as with the shift of a centre. A ring gauge has a column of zeros.

    >>> drift_columns([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 1.0]).tolist()
    [[-0.5, -0.0, -0.0], [0.0, 0.0, 0.5]]
    """
    normals = np.asarray(directions, dtype=np.float64)
    course = ReferenceDrift.course(relative_times(times), slows=slows)
    return np.asarray(normals * course[:, None])


def time_within_directions(groups: npt.ArrayLike, times: npt.ArrayLike) -> float:
    """Share of the variance of the times that lies within directions.

    Parameters
    ----------
    groups : (n,) int
        Number of the direction of each touch.
    times : (n,) float

    Returns
    -------
    float
        From 0.0 (no repeats, or all at one time) towards 1.0 (many passes).

    >>> round(time_within_directions([0, 1, 2, 0, 1, 2], np.arange(6)), 2)
    0.77
    >>> round(time_within_directions([0, 0, 1, 1, 2, 2], np.arange(6)), 2)
    0.09
    """
    time = relative_times(times)
    total = float(np.sum((time - time.mean()) ** 2))
    return float(np.sum(centred_within(time, groups) ** 2)) / total if total > 0.0 else 0.0


def drift_is_separable(groups: npt.ArrayLike, times: npt.ArrayLike) -> bool:
    """Whether repeats are spread over the run enough to separate a drift from a map.

    Parameters
    ----------
    groups : (n,) int
        Number of the direction of each touch.
    times : (n,) float

    Returns
    -------
    bool
        At least six repeats, and `LEAST_TIME_WITHIN` of the variance of time within directions:
        then the uncertainty of a drift is at most twice that of the best order.

    >>> passes, in_a_row = np.tile(np.arange(9), 3), np.repeat(np.arange(9), 3)
    >>> drift_is_separable(passes, np.arange(27)), drift_is_separable(in_a_row, np.arange(27))
    (True, False)
    """
    number = np.asarray(groups)
    repeats = len(number) - len(np.unique(number))
    return repeats >= _FEWEST_REPEATS and time_within_directions(number, times) >= LEAST_TIME_WITHIN


def estimated_drift(
    values: npt.ArrayLike,
    directions: npt.ArrayLike,
    groups: npt.ArrayLike,
    times: npt.ArrayLike,
) -> WithinDirections:
    """Linear drift of the reference over the run, from repeats alone.

    Parameters
    ----------
    values : (n,) float
        Pretravel, or readings along the normal. [mm]
    directions : (n, 3) float
        Contact normals.
    groups : (n,) int
        Number of the direction of each touch.
    times : (n,) float
        In any unit, or the order.

    Returns
    -------
    WithinDirections
        Coefficients of `drift_columns`: for pretravel, the reference moves by the negative.
        Compare with `drift_is_separable`: with repeats in a row the covariance is large.

    >>> normals = np.tile(np.vstack([np.eye(3), -np.eye(3)]), (3, 1))
    >>> groups, times = np.tile(np.arange(6), 3), np.arange(18)
    >>> moved = normals @ [0.002, 0.0, -0.001] * relative_times(times)
    >>> estimated_drift(groups + moved, normals, groups, times).value.round(9).tolist()
    [0.002, 0.0, -0.001]
    """
    return fit_within_directions(values, drift_columns(directions, times), groups)
