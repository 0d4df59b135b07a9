"""Gross errors among the repeats of a direction: touches far from the others of their direction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import describe
from pretravel.base.units import MICROMETRE
from pretravel.maps.observation import Observation
from pretravel.qualification.within_directions import centred_within, dof_of_tails

OUTLIER_LEVEL = 0.01
"""Probability that any touch is named although all are good (Bonferroni)."""
FEWEST_LEFT = 0.8
"""Share of the touches that must remain; else it is not single touches that are wrong."""


@dataclass(frozen=True)
class Outlier:
    """A touch or direction that does not fit the others.

    Attributes
    ----------
    rows : tuple of int
        Of the touches, from 0: one touch, or all of a direction.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        Largest distance that repeatability explains. [mm]
    message : str
        What it is and how far it lies off; `outcome` says what became of it.
    left_out : bool
        Whether the map was made without it.
    """

    rows: tuple[int, ...]
    distance: float
    limit: float
    message: str
    left_out: bool = True

    @property
    def outcome(self) -> str:
        """What became of it, as a sentence."""
        if self.left_out:
            return "Left out: touch there again"
        return "Kept, because too many touches look wrong: is it the right reference?"


def outlier_factor(count: int, dof: float = math.inf) -> float:
    """Limit of errors, in standard deviations.

    Parameters
    ----------
    count : int
        Of the errors that are judged together.
    dof : float
        Degrees of freedom of Student's distribution, that of the errors.

    >>> round(outlier_factor(75), 2)
    4.58
    """
    from scipy.special import ndtri, stdtrit

    level = OUTLIER_LEVEL / (2.0 * count)
    limit = -ndtri(level) if math.isinf(dof) else -stdtrit(dof, level)
    # 1.2 because the scales are themselves estimated from the data.
    return 1.2 * float(limit)


def repeat_outliers(
    observation: Observation, where: Callable[[int], str], step: float = 0.0
) -> list[Outlier]:
    """Touches far from the median of their direction, and pairs that lie far apart.

    Parameters
    ----------
    observation : Observation
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.
    step : float
        Of the latched positions: readings of one place can be two steps apart. [mm]
    """
    from scipy.special import gammaincinv

    values, groups = observation.values, observation.groups
    count = np.bincount(groups)
    repeated = np.flatnonzero(count >= 2)
    if len(repeated) < 3:
        return []
    median = median_of_groups(values, groups)
    within = centred_within(values, groups)
    tails = dof_of_tails(values, groups, within)
    squares = np.bincount(groups, within**2)[repeated]
    free = count[repeated] - 1
    variance = squares / free
    # A few bad touches do not move the median over directions.
    unbias = np.median(2.0 * gammaincinv(0.5 * free, 0.5) / free)
    noise = math.sqrt(float(np.median(variance) / unbias))
    noise = math.hypot(noise, step / math.sqrt(12.0))
    factor = outlier_factor(len(values), tails)
    limit = max(factor * noise, 2.0 * step, 1e-9)
    # Of two touches either may be wrong; their difference scatters by the root of two more.
    apart = (
        np.abs(values - median[groups])
        > np.where(count == 2, limit / math.sqrt(2.0), limit)[groups]
    )
    by_group, start = np.argsort(groups, kind="stable"), np.cumsum(count) - count
    found = []
    for group in np.unique(groups[apart]):
        rows = by_group[start[group] : start[group] + count[group]]
        if count[group] == 2:
            found.append(_pair_apart(observation, where, rows, math.sqrt(2.0) * limit))
            continue
        for row in rows[apart[rows]]:
            distance = float(values[row] - median[group])
            message = (
                f"{where(int(row))} at {describe(observation.directions[rows[0]])} lies "
                f"{distance / MICROMETRE:+.1f} µm from the median of the {len(rows)} touches of "
                f"its direction; repeatability explains {limit / MICROMETRE:.1f} µm"
            )
            found.append(Outlier((int(row),), distance, limit, message))
    return found


def median_of_groups(values: FloatArray, groups: IntArray) -> FloatArray:
    """Median of the values of each group, (g,).

    Parameters
    ----------
    values : (n,) float
    groups : (n,) int
        From 0 to g - 1, none without a value.

    >>> median_of_groups(np.array([1.0, 5.0, 2.0, 4.0]), np.array([0, 0, 0, 1])).tolist()
    [2.0, 4.0]
    """
    ordered = values[np.lexsort((values, groups))]
    count = np.bincount(groups)
    start = np.cumsum(count) - count
    return np.asarray(0.5 * (ordered[start + (count - 1) // 2] + ordered[start + count // 2]))


def _pair_apart(
    observation: Observation, where: Callable[[int], str], rows: IntArray, limit: float
) -> Outlier:
    first, second = int(rows[0]), int(rows[1])
    apart = float(observation.values[first] - observation.values[second])
    message = (
        f"{where(first)} and {where(second)} at "
        f"{describe(observation.directions[first])} lie {abs(apart) / MICROMETRE:.1f} µm apart; "
        f"repeatability explains {limit / MICROMETRE:.1f} µm"
    )
    return Outlier((first, second), apart, limit, message)
