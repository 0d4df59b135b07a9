"""Single touches that cannot be right, found beside a map that the probe had before."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import describe
from pretravel.base.units import MICROMETRE
from pretravel.qualification.change_tests import TouchesAndMap
from pretravel.qualification.outliers import Outlier, median_of_groups
from pretravel.touches import Touches

_LEVEL = 0.001
"""Probability that any touch is named although all are good."""
_HEAVY_TAILS = 1.5
"""Factor on the limits: touches have heavier tails than a normal distribution."""
_FEWEST_OTHERS = 3
"""Directions that remain beyond those that centre, size, amplitude and turn take."""


def gross_touch(touches: Touches, compared: TouchesAndMap, rows: IntArray) -> Outlier | None:
    """The touch that disagrees most with the others and the map, if noise does not explain it.

    A touch among three or more of its direction is compared with their median. Where a direction
    was touched once or twice, the map decides which touch is wrong, with size, amplitude and turn
    fitted to the other directions. Repeats that agree with each other are never named: that is a
    change, or dirt on the reference.

    Parameters
    ----------
    touches : Touches
    compared : TouchesAndMap
        Those of them that are beside the map.
    rows : (n,) int
        Their rows in `touches`.

    Returns
    -------
    Outlier or None
    """
    observation, step = compared.observation, compared.step
    values, groups = observation.values, observation.groups
    counts = np.bincount(groups)
    factor = _factor(len(values))
    median = median_of_groups(values, groups)
    among = values - median[groups]
    scatter = _robust_scatter(among, groups, compared)
    limit = max(factor * scatter, 1.5 * step)
    from_map, u_from_map = _left_out(compared, values, scatter)
    many, single = counts[groups] > 2, counts[groups] == 1
    pair = ~many & ~single
    map_limit = np.maximum(factor * u_from_map, 1.5 * step)
    excess = np.where(many, np.abs(among) / limit, 0.0)
    excess = np.where(single, np.abs(from_map) / map_limit, excess)
    apart = np.where(pair, 2.0 * np.abs(among) / (math.sqrt(2.0) * limit), 0.0)
    excess = np.where(pair, apart * _farther(np.abs(from_map), groups), excess)
    worst = int(np.argmax(excess))
    if excess[worst] <= 1.0:
        return None
    distance, allowed, base = from_map[worst], map_limit[worst], "the map"
    if not single[worst]:
        distance, allowed = (2.0 if pair[worst] else 1.0) * among[worst], limit
        base = (
            "the other touch"
            if pair[worst]
            else f"the median of the {counts[groups[worst]]} touches"
        )
        base += " of its direction"
    return Outlier(
        (int(rows[worst]),),
        float(distance),
        float(allowed),
        f"{touches.where(int(rows[worst]))} at {describe(observation.directions[worst])} lies "
        f"{distance / MICROMETRE:+.1f} µm from {base}; noise explains "
        f"{allowed / MICROMETRE:.1f} µm",
    )


def _factor(count: int) -> float:
    from scipy.special import ndtri

    return _HEAVY_TAILS * -float(ndtri(_LEVEL / (2.0 * count)))


def _farther(distance: FloatArray, groups: IntArray) -> FloatArray:
    """One for the touch of each direction that is farthest away, zero for the others."""
    largest = np.zeros(int(groups.max()) + 1)
    np.maximum.at(largest, groups, distance)
    return np.where(distance >= largest[groups], 1.0, 0.0)


def _robust_scatter(among: FloatArray, groups: IntArray, compared: TouchesAndMap) -> float:
    """Of a touch, from the directions' median variances; at least that of the map. [mm]"""
    from scipy.special import gammaincinv

    counts = np.bincount(groups)
    free = counts - 1
    repeated = free > 0
    known = compared.scatter_of_map.deviation
    if not np.any(repeated):
        return known
    mean = np.bincount(groups, among) / counts
    squares = np.bincount(groups, (among - mean[groups]) ** 2)[repeated]
    expected = np.median(2.0 * gammaincinv(0.5 * free[repeated], 0.5))
    return max(math.sqrt(float(np.median(squares) / expected)), known)


def _left_out(
    compared: TouchesAndMap, values: FloatArray, scatter: float
) -> tuple[FloatArray, FloatArray]:
    """Distance of each touch from the map fitted to the other directions, and its u. [mm]"""
    design, y = compared.design, compared.differences
    groups = compared.observation.groups
    apart = values - compared.value[groups]
    if len(y) < design.shape[1] + _FEWEST_OTHERS:
        return np.zeros(len(values)), np.full(len(values), math.inf)
    inverse = np.linalg.inv(compared.covariance)
    seen = inverse @ design
    weights = inverse - seen @ np.linalg.pinv(design.T @ seen, hermitian=True) @ seen.T
    own = np.diagonal(weights)
    usable = own > 1e-6 * np.diagonal(inverse)
    safe = np.where(usable, own, 1.0)
    expected = y - weights @ y / safe
    variance = np.where(usable, 1.0 / safe, math.inf)
    noise = compared.noise.variances / compared.noise.counts
    single = np.maximum(variance - noise, 0.0) + scatter**2
    return apart - expected[groups], np.sqrt(single)[groups]
