"""Reversal: the same touches at 0° and 180° of the spindle; what their mean is rid of.

The probe turns with the spindle. With the tip beside the spindle's axis by e, and a pretravel
d(n) that is fixed to the probe, a touch along -n on a wall reads ``s + r - d(n) - n·e`` at 0° and
``s + r - d(-n) + n·e`` at 180°. Half of the sum has no run-out e, and of d the even part about the
axis only: its mean and its lobes of order two, four, …. Half of the difference has the rest: the
run-out and the odd lobes, three of them first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import DEGREE, FloatArray, IntArray, PretravelError, azimuth_angle, frozen
from pretravel.touches import Touches
from pretravel.uncertainty import coverage_factor

ORDERS = (1, 3, 5)
"""Lobes that half of the difference is fitted with: the run-out is in the first."""
_SAME_PLACE = 1.0
"""Touches of one target at both orientations are closer than that. [mm]"""
_SAME_NORMAL = math.cos(1.0 * DEGREE)
_OPPOSITE = 1.0 * DEGREE
_FEWEST = 8
"""Directions for the lobes: six numbers and a noise."""


@dataclass(frozen=True, eq=False)
class ReversedPairs:
    """Means and differences of touches at two opposite orientations of the spindle.

    Attributes
    ----------
    means : Touches
        A touch for each target, at no orientation.
    half_differences : (n,) float
        Along the normals: reading at the first orientation less that at the other, halved. [mm]
    amplitudes, u : (3,) float
        Of the lobes of `ORDERS`, and their standard uncertainty; not numbers where too few
        directions were touched. [mm]
    runout : (2,) float
        Along x and y, together with the lobe of order one of the pretravel: a tip beside the axis
        and such a lobe are the same. [mm]
    noise : float
        Standard deviation of a single touch. [mm]
    dof : float
    """

    means: Touches
    half_differences: FloatArray
    amplitudes: FloatArray
    u: float
    runout: FloatArray
    noise: float
    dof: float

    @property
    def u_mean(self) -> float:
        """Standard uncertainty of a mean by the noise. [mm]"""
        return self.noise / math.sqrt(2.0)

    @property
    def factor(self) -> float:
        """K of U."""
        return coverage_factor(self.dof) if self.dof >= 1.0 else math.nan

    @property
    def removed(self) -> float:
        """Root mean square of what the means are rid of. [mm]"""
        return float(np.sqrt(np.mean(self.half_differences**2)))


def reversed_touches(touches: Touches) -> ReversedPairs:
    """Pair touches at two opposite orientations of the spindle.

    Parameters
    ----------
    touches : Touches
        With `Touches.spindle`; the spindle's axis is the z axis. Targets may be touched in any
        order, each as often at both orientations.

    Returns
    -------
    ReversedPairs

    Raises
    ------
    PretravelError
        No orientations, or others than two opposite ones; a touch without its counterpart.

    >>> n = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> both = Touches(np.vstack([n * 15.49, n * 15.47]), np.vstack([n, n]),
    ...                spindle=[0.0, 0.0, np.pi, np.pi])
    >>> found = reversed_touches(both)
    >>> found.means.positions[0].tolist(), found.half_differences.round(6).tolist()
    ([15.48, 0.0, 0.0], [0.01, 0.01])
    """
    first, second = _orientations(touches)
    partners = _partners(touches, first, second)
    one, other = touches.take(first), touches.take(partners)
    difference = one.positions - other.positions
    half = 0.5 * np.sum(one.normals * difference, axis=1)
    means = replace(
        one,
        positions=0.5 * (one.positions + other.positions),
        spindle=None,
        feeds=None if one.feeds is None or other.feeds is None else 0.5 * (one.feeds + other.feeds),
        lines=None,
        source=f"{touches.source or 'touches'}, means of both orientations",
    )
    return _with_lobes(means, np.asarray(half))


def _orientations(touches: Touches) -> tuple[IntArray, IntArray]:
    if touches.spindle is None:
        raise PretravelError(
            "the touches do not state the orientation of the spindle: a column spindle_deg is "
            "needed, or the orientation of each file",
            inputs=("spindle",),
        )
    turn = np.mod(touches.spindle - touches.spindle[0] + math.pi, 2.0 * math.pi) - math.pi
    at_first = np.abs(turn) < _OPPOSITE
    opposite = np.abs(np.abs(turn) - math.pi) < _OPPOSITE
    if not np.all(at_first | opposite) or not opposite.any():
        stated = sorted({f"{angle / DEGREE:.4g}°" for angle in touches.spindle})
        raise PretravelError(
            f"the orientations of the spindle are {', '.join(stated[:6])}; a reversal needs two "
            "that are 180° apart",
            inputs=("spindle",),
        )
    return np.flatnonzero(at_first), np.flatnonzero(opposite)


def _partners(touches: Touches, first: IntArray, second: IntArray) -> IntArray:
    """The row at the other orientation of each touch: the nearest that is free."""
    free = np.ones(len(second), dtype=bool)
    found = []
    for row in first:
        apart = np.linalg.norm(touches.positions[second] - touches.positions[row], axis=1)
        alike = touches.normals[second] @ touches.normals[row] > _SAME_NORMAL
        apart[~(free & alike)] = math.inf
        nearest = int(np.argmin(apart))
        if not apart[nearest] < _SAME_PLACE:
            raise PretravelError(
                f"{touches.where(int(row))} has no touch at the other orientation of the spindle "
                f"within {_SAME_PLACE:g} mm and with its normal: touch the same targets at both"
            )
        free[nearest] = False
        found.append(int(second[nearest]))
    if free.any():
        row = int(second[int(np.argmax(free))])
        raise PretravelError(
            f"{touches.where(row)} has no touch at the first orientation of the spindle: touch the "
            "same targets at both"
        )
    return np.array(found)


def _with_lobes(means: Touches, half: FloatArray) -> ReversedPairs:
    level = np.abs(means.normals[:, 2]) < 0.1
    azimuth = azimuth_angle(means.normals[level])
    nothing = np.full(len(ORDERS), math.nan)
    if len(np.unique(np.round(azimuth / DEGREE))) < _FEWEST:
        return ReversedPairs(means, frozen(half), nothing, math.nan, nothing[:2], math.nan, 0.0)
    columns = np.hstack([
        np.stack([np.cos(order * azimuth), np.sin(order * azimuth)], axis=1) for order in ORDERS
    ])  # fmt: skip
    found, *_ = np.linalg.lstsq(columns, half[level], rcond=None)
    dof = float(len(azimuth) - columns.shape[1])
    left = half[level] - columns @ found
    of_half = math.sqrt(float(left @ left) / dof)
    u = of_half * math.sqrt(float(np.linalg.inv(columns.T @ columns)[2, 2]))
    pairs = found.reshape(-1, 2)
    return ReversedPairs(
        means,
        frozen(half),
        frozen(np.hypot(pairs[:, 0], pairs[:, 1])),
        u,
        frozen(-pairs[0]),
        math.sqrt(2.0) * of_half,
        dof,
    )
