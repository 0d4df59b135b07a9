"""Directions that people touch a reference in: poles and rings about +z."""

from __future__ import annotations

import numpy as np


def rings(*of: tuple[float, int, float]) -> np.ndarray:
    """Unit vectors on rings of polar angle, count and first azimuth (degrees), (n, 3)."""
    found = []
    for polar, count, first in of:
        azimuth = np.radians(first + 360.0 * np.arange(count) / count)
        theta = np.radians(polar)
        across, up = np.full(count, np.sin(theta)), np.full(count, np.cos(theta))
        found.append(np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), up]))
    return np.vstack(found)


POLE = (0.0, 1, 0.0)
USUAL_25 = rings(POLE, (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, 45.0), (90.0, 8, 0.0))
THOROUGH_27 = rings(POLE, (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 6, 0.0), (90.0, 8, 10.0))
DENSE_45 = rings(POLE, (22.5, 8, 0.0), (45.0, 12, 0.0), (67.5, 8, 0.0), (90.0, 16, 0.0))
FOURTEEN = rings(POLE, (45.0, 5, 0.0), (90.0, 8, 10.0))
NINE = rings(POLE, (45.0, 4, 45.0), (90.0, 4, 0.0))
SIX = rings(POLE, (90.0, 5, 0.0))
FIVE = rings(POLE, (90.0, 4, 0.0))
FIVE_AZIMUTHS = rings(POLE, (30.0, 5, 0.0), (60.0, 5, 0.0), (90.0, 5, 0.0))
RING_24 = rings((90.0, 24, 0.0))


def spread(count: int, largest_polar: float = 90.0) -> np.ndarray:
    """Directions spread evenly over a cap, none repeated, (count, 3)."""
    lowest = np.cos(np.radians(largest_polar))
    up = 1.0 - (1.0 - lowest) * np.arange(count) / (count - 1)
    azimuth = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    across = np.sqrt(np.maximum(1.0 - up**2, 0.0))
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), up])


SPREAD_92 = spread(92, 95.0)


def scattered(count: int, generator: np.random.Generator, *, level: bool) -> np.ndarray:
    """Normals of a part's faces: anywhere on the upper half, or all horizontal, (count, 3)."""
    up = np.zeros(count) if level else generator.uniform(0.0, 1.0, count)
    azimuth = generator.uniform(0.0, 2.0 * np.pi, count)
    across = np.sqrt(1.0 - up**2)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), up])


def reachable(stem: np.ndarray, directions: np.ndarray, least: float = -0.1) -> np.ndarray:
    """Those of the directions in which a tip on a sideways stem can touch.

    `least` is the cosine of the largest angle to the stem.
    """
    if stem[2] > 0.9:
        return directions
    return np.asarray(directions[directions @ stem > least])
