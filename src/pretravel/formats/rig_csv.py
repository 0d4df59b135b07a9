"""Traces and budgets of a calibration rig from CSV files, and its results as columns or JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable, read_csv_table
from pretravel.laboratory.rig import RigTouch, RigTrace
from pretravel.laboratory.rig_budget import LengthComponent
from pretravel.laboratory.rig_calibration import RigCalibration, Spread, azimuth_of
from pretravel.uncertainty.gum import Budget
from pretravel.units import MICROMETRE

OWN_REPEATABILITY = "repeatability at"
"""Names of sources in a budget that begin so are a repeatability, which a calibration replaces."""
COLUMNS = ("time_s", "ruler_mm", "laser_mm", "contact", "trigger")


def read_rig_trace(path: str | Path) -> RigTrace:
    """Read a trace: columns time_s, ruler_mm, laser_mm, contact, trigger (1 = high).

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
        The file lacks a column, a value is not a number, or contact or trigger is not 0 or 1.
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
    """Touches on the rig as columns, one row each; nan where a trace does not show the value.

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
        "azimuth_deg": [math.degrees(azimuth_of(touch.trace)) for touch in touches],
        "feed_mm_min": [touch.feed if math.isfinite(touch.feed) else math.nan for touch in touches],
        "note": ["; ".join(touch.notes) for touch in touches],
    }


def rig_json(calibration: RigCalibration, budget: Budget) -> dict[str, Any]:
    """A calibration as a JSON document: overall, by direction, by touch, and its budget.

    Returns
    -------
    dict
        Lengths in µm, except r0 to r3; None where a value is unknown.
    """

    def um(value: float) -> float | None:
        return value / MICROMETRE if math.isfinite(value) else None

    def spread(value: Spread) -> dict[str, float | None]:
        return {"value": um(value.value), "low": um(value.low), "high": um(value.high)}

    columns = {name: np.asarray(values).tolist() for name, values in
               rig_table(calibration.touches).items()}  # fmt: skip
    touches = [
        {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in zip(columns, row, strict=True)
        }
        for row in zip(*columns.values(), strict=True)
    ]
    return {
        "pretravel_um": um(calibration.pretravel),
        "u_pretravel_um": um(calibration.u_pretravel),
        "anisotropy_um": um(calibration.anisotropy),
        "anisotropy_interval_um": [um(float(end)) for end in calibration.anisotropy_interval],
        "repeatability_um": spread(calibration.repeatability),
        "hysteresis_um": um(calibration.hysteresis),
        "largest_hysteresis_um": um(calibration.largest_hysteresis),
        "coverage_probability": calibration.probability,
        "expanded_uncertainty_um": um(budget.expanded()),
        "coverage_factor": budget.coverage_factor(),
        "directions": [
            {
                "name": d.name,
                "azimuth_deg": math.degrees(d.azimuth) if math.isfinite(d.azimuth) else None,
                "count": d.count,
                "pretravel_um": um(d.pretravel),
                "u_pretravel_um": um(d.u_pretravel),
                "repeatability_um": spread(d.repeatability),
                "pretravel_range_um": um(d.pretravel_range),
                "trigger_range_um": um(d.trigger_range),
                "hysteresis_um": um(d.hysteresis),
                "u_hysteresis_um": um(d.u_hysteresis),
            }
            for d in calibration.directions
        ],
        "budget": [
            {
                "source": row["source"],
                "type": row["evaluation"],
                "contribution_um": um(float(row["contribution"])),
                "share": row["share"],
            }
            for row in budget.rows()
        ],
        "touches": touches,
    }


def read_budget(path: str | Path) -> tuple[LengthComponent, ...]:
    """Read the budget of a rig: source, type (A or B), uncertainty_um, per_metre_um.

    Empty cells are zero.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    tuple of LengthComponent

    Raises
    ------
    InputError
        Missing columns, values that are not numbers, types that are not A or B.
    """
    table = read_csv_table(path)
    table.require("source", "type", "uncertainty_um", "per_metre_um", what="a budget")
    found = []
    for row, line in enumerate(table.lines):
        kind = table.columns["type"][row].strip().upper()
        if kind not in ("A", "B"):
            raise InputError(f"type is '{kind}'; it is A or B", path=path, line=line)
        source = table.columns["source"][row].strip()
        if not source:
            raise InputError("a source of uncertainty needs a name", path=path, line=line)
        values = []
        for name in ("uncertainty_um", "per_metre_um"):
            cell = table.columns[name][row].strip()
            try:
                values.append(float(cell or "0"))
            except ValueError:
                raise InputError(
                    f"{name} is '{cell}'; it must be a number, or empty", path=path, line=line
                ) from None
        if min(values) < 0.0:
            raise InputError("an uncertainty is negative", path=path, line=line)
        found.append(
            LengthComponent(
                source,
                kind,
                values[0] * MICROMETRE,
                values[1] * 1e-6,
                repeatability=source.startswith(OWN_REPEATABILITY),
            )
        )
    return tuple(found)
