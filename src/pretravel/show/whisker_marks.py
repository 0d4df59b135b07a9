"""Lines that show deviations, magnified along normals, and intervals of any ends."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray
from pretravel.show.chart_marks import LineMark
from pretravel.show.colours import Colour

_SHARE = 0.12
"""Of the size of what is shown: the length of the longest whisker."""


def round_number(value: float) -> float:
    """The largest of 1, 2, 5, 10, 20, … that is not above a value, such as a magnification.

    >>> round_number(730.0), round_number(4.9), round_number(0.03)
    (500.0, 2.0, 0.02)
    """
    power = 10.0 ** np.floor(np.log10(max(value, 1e-30)))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * 1.000001))


def whiskers(
    positions: FloatArray, normals: FloatArray, lengths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Starts and ends of lines along normals. (n, 3) each

    >>> starts, ends = whiskers(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.array([2.0]))
    >>> ends.tolist()
    [[0.0, 0.0, 2.0]]
    """
    return positions, positions + lengths[:, None] * normals


def magnification(positions: FloatArray, deviations: FloatArray) -> float:
    """By how much deviations are magnified, so that the largest is seen next to the part.

    Parameters
    ----------
    positions : (n, 3) float
        [mm]
    deviations : (n,) float
        [mm]

    Returns
    -------
    float
        1, 2, 5, 10, …; one where nothing deviates.

    >>> magnification(np.array([[0.0, 0, 0], [100.0, 0, 0]]), np.array([0.01, -0.02]))
    500.0
    """
    largest = float(np.abs(deviations).max(initial=0.0))
    size = float(np.linalg.norm(np.ptp(positions, axis=0))) or 1.0
    return round_number(_SHARE * size / largest) if largest > 0.0 else 1.0


def interval_lines(
    x: FloatArray, low: FloatArray, high: FloatArray, name: str = "", colour: Colour = "series1"
) -> LineMark:
    """Upright lines from low to high at places x.

    >>> interval_lines(np.array([2.0]), np.array([0.0]), np.array([3.0])).y[:2].tolist()
    [0.0, 3.0]
    """
    gap = np.full(len(x), np.nan)
    return LineMark(
        np.repeat(x, 3), np.stack([low, high, gap], axis=1).ravel(), name, colour, width=1.0
    )
