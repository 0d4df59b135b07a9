"""Geometry of the six seats: their points, and the directions in which they push."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, frozen
from pretravel.prediction import Probe

SEAT_NAMES = ("A-left", "A-right", "B-left", "B-right", "C-left", "C-right")
"""Rods A, B, C in the description's order; left is the counter-clockwise side of the
rod, as seen from the spindle, looking outward along the rod."""


SEAT_SIDES = np.array([-1.0, 1.0] * 3)
"""Sign of each seat's horizontal push, counter-clockwise being positive."""


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

    @property
    def wrenches(self) -> FloatArray:
        """Columns: force and moment about the origin of a unit reaction of each seat, (6, 6)."""
        moments = np.cross(self.points, self.normals)
        return np.concatenate([self.normals, moments], axis=1).T


def seat_frame(probe: Probe) -> SeatFrame:
    """The seats of a probe.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> frame = seat_frame(load_probe("omp40-2"))
    >>> frame.points[0].tolist(), frame.normals[0].round(3).tolist()
    ([16.34, 0.0, 0.0], [0.0, -0.889, 0.458])
    """
    tripod, seats = probe.tripod, probe.seats
    radii = tripod.radius + np.array(tripod.radius_deviations)
    angles = seats.support_angle + 0.5 * seats.right_less_left * SEAT_SIDES
    return seat_triads(tripod.rod_azimuths, radii, angles)


def seat_triads(
    rod_azimuths: npt.ArrayLike, radii: npt.ArrayLike, support_angles: npt.ArrayLike
) -> SeatFrame:
    """The seats of rods that may differ in place and in angle.

    Parameters
    ----------
    rod_azimuths : (3,) float
        [rad]
    radii : float or (3,) float
        From the probe axis to the points where the rods rest. [mm]
    support_angles : float or (6,) float
        Of the seats' normals from the horizontal. [rad]

    Returns
    -------
    SeatFrame
    """
    azimuths = np.repeat(np.asarray(rod_azimuths, dtype=np.float64), 2)
    radial = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(6)], axis=1)
    tangential = np.stack([-np.sin(azimuths), np.cos(azimuths), np.zeros(6)], axis=1)
    # A seat on the counter-clockwise side (left) pushes the rod clockwise and up.
    side = SEAT_SIDES[:, None]
    angle = np.broadcast_to(np.asarray(support_angles, dtype=np.float64), 6)[:, None]
    normals = side * np.cos(angle) * tangential + np.sin(angle) * np.array([0.0, 0.0, 1.0])
    distance = np.repeat(np.broadcast_to(np.asarray(radii, dtype=np.float64), 3), 2)[:, None]
    return SeatFrame(
        points=frozen(distance * radial),
        normals=frozen(normals),
        along=frozen(radial),
        around=frozen(np.cross(normals, radial)),
    )


def tip_wrenches(tip: FloatArray) -> FloatArray:
    """Columns: force and moment about the origin of a unit force on the tip, (6, 3)."""
    return np.concatenate([np.eye(3), np.cross(tip, np.eye(3)).T])


def seat_wrenches(azimuths: FloatArray, radii: FloatArray, angles: FloatArray) -> FloatArray:
    """Wrenches of the six seats of uneven rods, as `SeatFrame.wrenches`, in closed form.

    Parameters
    ----------
    azimuths, radii : (3,) float
        Of the rods. [rad], [mm]
    angles : (6,) float
        Of the seats' normals from the horizontal. [rad]

    Returns
    -------
    (6, 6) float
        Columns: force and moment about the origin of a unit reaction.

    >>> places = np.radians([0.0, 120.0, 240.0]), np.ones(3), np.full(6, 0.6)
    >>> bool(np.allclose(seat_wrenches(*places), seat_triads(*places).wrenches, atol=1e-15))
    True
    """
    azimuth, radius = np.repeat(azimuths, 2), np.repeat(radii, 2)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    flat, steep = SEAT_SIDES * np.cos(angles), np.sin(angles)
    # The normal is flat t + steep z, t tangential; its moment is radius (flat z - steep t).
    lever = radius * steep
    return np.array(
        [-flat * sine, flat * cosine, steep, lever * sine, -lever * cosine, radius * flat]
    )
