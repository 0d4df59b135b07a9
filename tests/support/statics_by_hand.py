"""Six-seat statics of the OMP40-2 in numpy alone, beside the tests of publications."""

from __future__ import annotations

import numpy as np

RADIUS, SEAT_ANGLE, PRELOAD = 16.34, np.radians(27.266), 5.91  # Rodrigues 2021, Table 3.1


def direction(polar_deg: float, azimuth_deg: float) -> np.ndarray:
    """A unit vector from its angles."""
    polar, azimuth = np.radians([polar_deg, azimuth_deg])
    across = np.sin(polar)
    return np.array([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(polar)])


def first_contact_force(normal: np.ndarray, lever: float) -> float:
    """Force along a normal at which the first of six frictionless reactions is zero. [N]"""
    columns = []
    for rod in np.radians([0.0, 120.0, 240.0]):
        place = RADIUS * np.array([np.cos(rod), np.sin(rod), 0.0])
        along = np.array([-np.sin(rod), np.cos(rod), 0.0])
        for side in (1.0, -1.0):
            push = side * np.cos(SEAT_ANGLE) * along + [0.0, 0.0, np.sin(SEAT_ANGLE)]
            columns.append(np.concatenate([push, np.cross(place, push)]))
    seats = np.array(columns).T
    tip = np.array([0.0, 0.0, -lever])
    rest = np.linalg.solve(seats, [0.0, 0.0, PRELOAD, 0.0, 0.0, 0.0])
    added = np.linalg.solve(seats, -np.concatenate([normal, np.cross(tip, normal)]))
    falling = added < 0.0
    return float(np.min(rest[falling] / -added[falling]))
