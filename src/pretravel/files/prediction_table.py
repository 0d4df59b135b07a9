"""A prediction over directions: the columns of the command line, and a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, FloatArray, azimuth_angle, needed, polar_angle
from pretravel.prediction import Trigger
from pretravel.six_seats import SEAT_NAMES

if TYPE_CHECKING:
    import xarray as xr


def trigger_table(trigger: Trigger) -> dict[str, npt.ArrayLike]:
    """A prediction as the columns of the contract, one row per direction.

    Returns
    -------
    mapping of str to (n,) values
        polar_deg, azimuth_deg, trigger_force_N, sensing_distance_um, pretravel_um,
        seat, and one share_*_um for each compliance; shares add up to pretravel.
    """
    polar, azimuth = _angles(trigger)
    columns: dict[str, npt.ArrayLike] = {
        "polar_deg": polar,
        "azimuth_deg": azimuth,
        "trigger_force_N": trigger.force,
        "sensing_distance_um": trigger.sensing_distance / MICROMETRE,
        "pretravel_um": trigger.pretravel / MICROMETRE,
        "seat": trigger.seat_names,
    }
    return columns | {
        f"share_{name}_um": share / MICROMETRE for name, share in trigger.shares.items()
    }


def trigger_dataset(trigger: Trigger) -> xr.Dataset:
    """A prediction as a labelled dataset.

    Returns
    -------
    xarray.Dataset
        Dimensions direction, axis, seat, compliance; units in the attributes. Shares add up to
        pretravel along compliance.
    """
    needed("xarray", "tables")
    import xarray as xr

    polar, azimuth = _angles(trigger)
    length, force = {"units": "mm"}, {"units": "N"}
    shares = np.array(list(trigger.shares.values())).reshape(-1, len(polar))
    variables: dict[str, Any] = {
        "normal": (("direction", "axis"), trigger.directions, {"units": "1"}),
        "trigger_force": ("direction", trigger.force, force),
        "sensing_distance": ("direction", trigger.sensing_distance, length),
        "pretravel": ("direction", trigger.pretravel, length),
        "deflection": (("direction", "axis"), trigger.deflection, length),
        "share": (("compliance", "direction"), shares, length),
        "reaction": (("direction", "seat"), trigger.reactions, force),
        "opened_seat": ("direction", np.array(trigger.seat_names, dtype=str)),
    }
    return xr.Dataset(
        variables,
        coords={
            "polar": ("direction", polar, {"units": "degree"}),
            "azimuth": ("direction", azimuth, {"units": "degree"}),
            "axis": list("xyz"),
            "seat": list(SEAT_NAMES),
            "compliance": np.array(list(trigger.shares), dtype=str),
        },
        attrs={"title": "a probe at the trigger, predicted", "model": trigger.model},
    )


def _angles(trigger: Trigger) -> tuple[FloatArray, FloatArray]:
    """Polar angles and azimuths in degrees, rounded to the digits that double precision keeps."""
    polar = np.round(polar_angle(trigger.directions) / DEGREE, 10)
    return polar, np.mod(np.round(azimuth_angle(trigger.directions) / DEGREE, 10), 360.0)
