"""Touches with seat friction as a table: one row per step."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, azimuth_angle, polar_angle
from pretravel.design.friction.seat_friction import FrictionCycle
from pretravel.six_seats import SEAT_NAMES


def friction_table(cycle: FrictionCycle) -> dict[str, npt.ArrayLike]:
    """Return every step of every cycle as columns, for one direction after the other.

    Returns
    -------
    mapping of str to values
        polar_deg, azimuth_deg, cycle, loading (1 during loading, 0 during unloading),
        deflection_um, force_N; displacement of the tip x_um, y_um, z_um; for each seat
        ``reaction_*_N`` and ``friction_*_N``.
    """
    n, t = cycle.force.shape
    polar = np.round(polar_angle(cycle.directions) / DEGREE, 10)
    azimuth = np.mod(np.round(azimuth_angle(cycle.directions) / DEGREE, 10), 360.0)
    columns: dict[str, npt.ArrayLike] = {
        "polar_deg": np.repeat(polar, t),
        "azimuth_deg": np.repeat(azimuth, t),
        "cycle": np.tile(cycle.cycle + 1, n),
        "loading": np.tile(cycle.loading.astype(int), n),
        "deflection_um": cycle.deflection.ravel() / MICROMETRE,
        "force_N": cycle.force.ravel(),
    }
    for axis, name in enumerate("xyz"):
        columns[f"{name}_um"] = cycle.displacement[:, :, axis].ravel() / MICROMETRE
    for seat, name in enumerate(SEAT_NAMES):
        columns[f"reaction_{name}_N"] = cycle.reactions[:, :, seat].ravel()
        columns[f"friction_{name}_N"] = np.linalg.norm(cycle.tangential[:, :, seat], axis=2).ravel()
    return columns
