"""Calibration-rig traces read from CSV, and their touches written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable, read_csv_table
from pretravel.metrology.rig import RigTouch, RigTrace
from pretravel.units import MICROMETRE

COLUMNS = ("time_s", "ruler_mm", "laser_mm", "contact", "trigger")


def read_rig_trace(path: str | Path) -> RigTrace:
    """A trace with the columns time_s, ruler_mm, laser_mm, contact, trigger (1 = high).

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    RigTrace
        Named after the file.

    Raises
    ------
    InputError
        Not such a file; values that are not numbers, logic that is neither 0 nor 1.
    """
    table = read_csv_table(path)
    table.require(*COLUMNS, what="a rig trace")
    values = table.numbers("time_s", "ruler_mm", "laser_mm")
    try:
        return RigTrace(
            time=values[:, 0],
            ruler=values[:, 1],
            laser=values[:, 2],
            contact=_logic(table, "contact") > 0.5,
            trigger=_logic(table, "trigger") > 0.5,
            name=Path(path).stem,
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def _logic(table: CsvTable, name: str) -> FloatArray:
    values = table.numbers(name)[:, 0]
    odd = np.flatnonzero((values != 0.0) & (values != 1.0))
    if len(odd):
        row = int(odd[0])
        raise InputError(
            f"{name} is {values[row]:g}; a logic level is 0 (low) or 1 (high)",
            path=table.path,
            line=table.lines[row],
        )
    return values


def rig_table(touches: Sequence[RigTouch]) -> dict[str, npt.ArrayLike]:
    """Touches on the rig as columns, one row each; nan where a trace does not tell.

    Parameters
    ----------
    touches : sequence of RigTouch

    Returns
    -------
    mapping of str to values
    """
    lengths = {f"r{i}_mm": [getattr(t, f"r{i}") for t in touches] for i in range(4)}
    small = {
        "pretravel": "pretravel_um",
        "hysteresis": "hysteresis_um",
        "u_r0": "u_r0_um",
        "u_r1": "u_r1_um",
        "u_r3": "u_r3_um",
        "tip_displacement": "tip_displacement_um",
        "tip_compression": "tip_compression_um",
        "zero_shift": "zero_shift_um",
    }
    return {
        "trace": [touch.trace for touch in touches],
        **lengths,
        **{
            column: [getattr(touch, name) / MICROMETRE for touch in touches]
            for name, column in small.items()
        },
        "feed_mm_min": [touch.feed if math.isfinite(touch.feed) else math.nan for touch in touches],
        "note": ["; ".join(touch.notes) for touch in touches],
    }
