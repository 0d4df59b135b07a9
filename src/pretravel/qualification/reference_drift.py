"""Slow drift of the reference against the machine while it is touched.

Machines warm up: a sphere moves by micrometres in the minutes of a qualification. Touches that are
repeated in passes, not in a row, show this movement.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.qualification.within_directions import (
    WithinDirections,
    centred_within,
    fit_within_directions,
)
from pretravel.touches import Touches

LEAST_TIME_WITHIN = 0.2
"""Share of the variance of time within directions from which a drift is separable.

Three passes have 0.89, two have 0.75; three repeats in a row have 0.001 of 25 directions."""
_FEWEST_REPEATS = 6


def touch_times(touches: Touches) -> FloatArray:
    """Times of touches: their order, for touches at about equal intervals.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.

    Returns
    -------
    (n,) float
        0, 1, 2, …

    >>> touch_times(Touches([[0, 0, 1], [0, 0, 1]], [[0, 0, 1], [0, 0, 1]])).tolist()
    [0.0, 1.0]
    """
    return np.arange(len(touches), dtype=np.float64)


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


def drift_columns(directions: npt.ArrayLike, times: npt.ArrayLike) -> FloatArray:
    """Columns n_x t, n_y t and n_z t of a linear drift, with t of `relative_times`.

    Parameters
    ----------
    directions : (n, 3) float
        Contact normals.
    times : (n,) float

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
    return np.asarray(normals * relative_times(times)[:, None])


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
