"""Where the six seats are and which way they push: geometry of the description alone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pretravel.arrays import FloatArray, frozen
from pretravel.probe.description import Probe

SEAT_NAMES = ("A-left", "A-right", "B-left", "B-right", "C-left", "C-right")
"""Rods A, B, C in the description's order; left is the counter-clockwise side of the
rod, seen from the spindle and looking outward along the rod."""


class SeatFrame(NamedTuple):
    """A right-handed triad at each seat, probe frame."""

    points: FloatArray
    """Points of the rod axes that the seats' normals pass through, (6, 3). [mm]"""
    normals: FloatArray
    """Unit directions of the seats' push on the tripod, (6, 3)."""
    along: FloatArray
    """Unit directions along the rods, outwards, (6, 3)."""
    around: FloatArray
    """normals x along: across the rod, in the contact's plane, (6, 3)."""

    def contacts(self, rod_radius: float) -> FloatArray:
        """Points where rods and balls touch, (6, 3). [mm]"""
        return np.asarray(self.points - rod_radius * self.normals)


def seat_frame(probe: Probe) -> SeatFrame:
    """The seats of a probe.

    >>> from pretravel.probe.catalogue import load_probe
    >>> frame = seat_frame(load_probe("omp40-2"))
    >>> frame.points[0].tolist(), frame.normals[0].round(3).tolist()
    ([16.34, 0.0, 0.0], [0.0, -0.889, 0.458])
    """
    azimuths = np.repeat(probe.tripod.rod_azimuths, 2)
    radial = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(6)], axis=1)
    tangential = np.stack([-np.sin(azimuths), np.cos(azimuths), np.zeros(6)], axis=1)
    # A seat on the counter-clockwise side (left) pushes the rod clockwise and up.
    side = np.array([-1.0, 1.0] * 3)[:, None]
    angle = probe.seats.support_angle
    normals = side * math.cos(angle) * tangential + np.array([0.0, 0.0, math.sin(angle)])
    return SeatFrame(
        points=frozen(probe.tripod.radius * radial),
        normals=frozen(normals),
        along=frozen(radial),
        around=frozen(np.cross(normals, radial)),
    )
