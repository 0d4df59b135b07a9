"""The offset of a stylus tip from the axis of the spindle, from circles at turned orientations.

A machine reports where the axis of the spindle is. A tip off that axis turns with the spindle,
so that the centre of one and the same circle is found elsewhere at each orientation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, frozen

SMALLEST_TURN = 30.0 * DEGREE
"""Largest difference between two orientations must reach this, to tell offset from place. [rad]"""


@dataclass(frozen=True, eq=False)
class TipOffset:
    """An offset that turns with the spindle, fitted to the centres of circles.

    Attributes
    ----------
    angles : (k,) float
        Orientations of the spindle, counter-clockwise about the probe's +z. [rad]
    centers : (k, 2) float
        Of the circle as it was found at each orientation. [mm]
    offset : (2,) float
        From the axis of the spindle to the tip, with the spindle at 0. [mm]
    place : (2,) float
        Of the circle, as it would be found without an offset. [mm]
    carried : (4, 2 k) float
        Derivatives of (place, offset) by the coordinates of the centres, one centre after the
        other.
    """

    angles: FloatArray
    centers: FloatArray
    offset: FloatArray
    place: FloatArray
    carried: FloatArray

    @property
    def size(self) -> float:
        """Distance of the tip from the axis of the spindle. [mm]"""
        return float(np.hypot(*self.offset))

    @property
    def residuals(self) -> FloatArray:
        """Of the centres from the offset that turns, (k, 2). [mm]"""
        design = _design(self.angles)
        found = design @ np.concatenate([self.place, self.offset])
        return np.asarray(self.centers - found.reshape(self.centers.shape))

    @property
    def dof(self) -> int:
        """Degrees of freedom of the residuals."""
        return 2 * len(self.angles) - 4

    def covariance(self, of_centers: Sequence[FloatArray]) -> FloatArray:
        """Covariance of the offset.

        Parameters
        ----------
        of_centers : k arrays (2, 2) float
            Covariance of each centre. [mm²]

        Returns
        -------
        (2, 2) float
            [mm²]
        """
        total = np.zeros((2, 2))
        for row, single in enumerate(of_centers):
            part = self.carried[2:, 2 * row : 2 * row + 2]
            total += part @ single @ part.T
        return total


def fit_tip_offset(angles: FloatArray, centers: FloatArray) -> TipOffset:
    """Fit an offset that turns with the spindle to the centres of a circle.

    Parameters
    ----------
    angles : (k,) float
        Orientations of the spindle, counter-clockwise about the probe's +z. [rad]
    centers : (k, 2) float
        Of the circle as it was found at each orientation, across the probe's axis. [mm]

    Raises
    ------
    PretravelError
        Fewer than two orientations, or none that differ by `SMALLEST_TURN`.

    Notes
    -----
    Least squares of centre(a) = place - R(a) offset, with R(a) the rotation by the angle a. Half
    of a turn apart, the offset is half the difference of the two centres.

    >>> found = fit_tip_offset(np.array([0.0, math.pi]), np.array([[4.99, 7.0], [5.01, 7.0]]))
    >>> found.offset.round(9).tolist(), found.place.round(9).tolist()
    ([0.01, 0.0], [5.0, 7.0])
    """
    apart = np.abs(np.exp(1j * angles)[:, None] - np.exp(1j * angles)[None, :])
    if float(apart.max(initial=0.0)) < 2.0 * math.sin(0.5 * SMALLEST_TURN):
        raise PretravelError(
            f"the touches were made at {len(angles)} orientation{'s' if len(angles) > 1 else ''} "
            f"of the spindle within {SMALLEST_TURN / DEGREE:.0f}°: an offset that turns with the "
            "spindle needs two different ones, best 0° and 180°",
            inputs=("spindle",),
        )
    carried = np.linalg.pinv(_design(angles))
    found = carried @ centers.ravel()
    return TipOffset(
        frozen(angles), frozen(centers), frozen(found[2:]), frozen(found[:2]), frozen(carried)
    )


def turns_the_other_way(found: TipOffset) -> bool:
    """Whether the centres fit clearly better if the angles are counted clockwise.

    Returns
    -------
    bool
        False where the orientations cannot tell: 0° and 180° alone.

    >>> angles = np.radians([0.0, 90.0, 180.0])
    >>> clockwise = -0.01 * np.array([[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]])
    >>> turns_the_other_way(fit_tip_offset(angles, clockwise))
    True
    """
    if found.dof < 1:
        return False
    other = fit_tip_offset(-found.angles, found.centers)
    squares = [float(np.sum(fit.residuals**2)) for fit in (found, other)]
    return squares[0] > _CLEARLY * squares[1] and squares[0] > (0.1 * other.size) ** 2


_CLEARLY = 9.0
"""Ratio of squared residuals that is not chance."""


def _design(angles: FloatArray) -> FloatArray:
    """Derivatives of the centres by (place, offset), (2 k, 4)."""
    rows = np.zeros((len(angles), 2, 4))
    rows[:, 0, 0] = rows[:, 1, 1] = 1.0
    c, s = np.cos(angles), np.sin(angles)
    rows[:, 0, 2], rows[:, 0, 3] = -c, s
    rows[:, 1, 2], rows[:, 1, 3] = -s, -c
    return rows.reshape(-1, 4)
