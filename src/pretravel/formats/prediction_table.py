"""A prediction as a table over directions: the columns of the command line."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.directions import azimuth_angle, polar_angle
from pretravel.trigger.predict import Trigger
from pretravel.units import DEGREE, MICROMETRE


def trigger_table(trigger: Trigger) -> dict[str, npt.ArrayLike]:
    """A prediction as the columns of the contract, one row per direction.

    Returns
    -------
    mapping of str to (n,) values
        polar_deg, azimuth_deg, trigger_force_N, sensing_distance_um, pretravel_um,
        seat, and one share_*_um for each compliance; shares add up to pretravel.
    """
    # Angles from unit vectors, rounded to the digits that double precision keeps.
    columns: dict[str, npt.ArrayLike] = {
        "polar_deg": np.round(polar_angle(trigger.directions) / DEGREE, 10),
        "azimuth_deg": np.mod(np.round(azimuth_angle(trigger.directions) / DEGREE, 10), 360.0),
        "trigger_force_N": trigger.force,
        "sensing_distance_um": trigger.sensing_distance / MICROMETRE,
        "pretravel_um": trigger.pretravel / MICROMETRE,
        "seat": trigger.seat_names,
    }
    return columns | {
        f"share_{name}_um": share / MICROMETRE for name, share in trigger.shares.items()
    }
