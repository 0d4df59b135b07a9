"""Measured trigger forces by direction from a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pretravel.base import DEGREE, InputError, PretravelError, from_angles
from pretravel.design.identification.measured_forces import MeasuredForces
from pretravel.files import read_csv_table

_COLUMNS = ("azimuth_deg", "polar_deg", "force_N", "u_N")


def read_trigger_forces(path: str | Path) -> MeasuredForces:
    """Read measured trigger forces: azimuth_deg, force_N, u_N and, not across the axis, polar_deg.

    Raises
    ------
    InputError
        A table without these columns, or with others; forces or uncertainties that are not
        positive.
    """
    table = read_csv_table(path)
    table.require("azimuth_deg", "force_N", "u_N", what="measured trigger forces")
    table.refuse_others(*_COLUMNS, what="a table of trigger forces")
    azimuth, force, u = table.numbers("azimuth_deg", "force_N", "u_N").T
    polar = (
        table.numbers("polar_deg")[:, 0]
        if "polar_deg" in table.columns
        else np.full(len(azimuth), 90.0)
    )
    if not np.all((polar >= 0.0) & (polar <= 180.0)):
        raise InputError(
            f"polar_deg is {polar[(polar < 0.0) | (polar > 180.0)][0]:g}; polar angles lie between "
            "0 and 180 degrees",
            path=path,
        )
    try:
        return MeasuredForces(from_angles(polar * DEGREE, azimuth * DEGREE), force, u)
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
