"""Readings of a multi-step test from CSV files, and separations and plans as columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, InputError, PretravelError, from_angles
from pretravel.files import (
    CsvTable,
    comments_not_read,
    read_csv_table,
    refuse_other_comments,
    shortened,
)
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.plan import SeparationPlan
from pretravel.laboratory.separation.separation import Separation
from pretravel.touches import copied_rows_warnings, quantisation_step, rows_in_a_row_warnings

_LARGEST = 10_000.0  # µm
_SMALLEST = 0.02
"""Range of all readings. [µm]"""
_LARGEST_INDEX = 1_000_000
_SAME_ANGLE = 0.5  # °
_OF_PLANS = ("orientation_deg", "machine_azimuth_deg", "nx", "ny", "nz", "spindle_deg")


def read_multi_step_readings(path: str | Path) -> MultiStepReadings:
    """Read the readings of a multi-step test: columns machine_index, probe_index, error_um.

    Rows with an empty error_um are combinations that were not measured.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    MultiStepReadings

    Raises
    ------
    InputError
        A file without these columns; indices that are not whole numbers; angles that contradict
        them.
    """
    return _readings(read_csv_table(path))


def _readings(table: CsvTable) -> MultiStepReadings:
    path = table.path
    refuse_other_comments(table, "µm")
    table.require("machine_index", "probe_index", "error_um", what="multi-step readings")
    blank = [not cell.strip() for cell in table.columns["error_um"]]
    if any(blank):
        kept = [row for row, empty in enumerate(blank) if not empty]
        if not kept:
            raise InputError("no row has a reading yet (error_um is empty in all)", path=path)
        table = CsvTable(
            table.path,
            {name: tuple(cells[row] for row in kept) for name, cells in table.columns.items()},
            tuple(table.lines[row] for row in kept),
            table.header_line,
        )
    errors = table.numbers("error_um")[:, 0]
    if 0.0 < np.ptp(errors) < _SMALLEST:
        raise InputError(
            f"error_um differs by {np.ptp(errors):.2g} over the readings, less than any machine "
            "and probe: is it in µm, not in mm?",
            path=path,
            line=table.header_line,
        )
    if np.max(np.abs(errors)) > _LARGEST:
        row = int(np.argmax(np.abs(errors)))
        raise InputError(
            f"error_um is {errors[row]:g}; is it in µm?", path=path, line=table.lines[row]
        )
    try:
        found = MultiStepReadings(
            machine=_indices(table, "machine_index"),
            probe=_indices(table, "probe_index"),
            errors=errors * MICROMETRE,
            step=quantisation_step(errors[:, None] * MICROMETRE),
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    _check_angles(table, found)
    return found


def _check_angles(table: CsvTable, readings: MultiStepReadings) -> None:
    """Refuse angles of a plan that are not those of its indices."""
    if not readings.turn:
        return
    step = 360.0 / readings.turn
    turned = step * (readings.machine - readings.probe)
    around = step * (readings.machine - 1)
    for name, meant in (
        ("orientation_deg", turned), ("spindle_deg", turned), ("machine_azimuth_deg", around),
    ):  # fmt: skip
        if not any(table.columns.get(name, ())):
            continue
        stated = table.numbers(name)[:, 0]
        off = np.flatnonzero(np.abs(np.mod(stated - meant + 180.0, 360.0) - 180.0) > _SAME_ANGLE)
        if len(off):
            row = int(off[0])
            raise InputError(
                f"{name} is {stated[row]:g}, and machine_index {readings.machine[row]} with "
                f"probe_index {readings.probe[row]} of {readings.turn} means "
                f"{np.mod(meant[row], 360.0):g}: angles count counter-clockwise about the probe's "
                "+z, direction 1 is +x. Correct the column, or leave it out",
                path=table.path,
                line=table.lines[row],
            )


def read_multi_step_test(
    paths: Sequence[Path] | Path | str,
    *,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    spindle: Sequence[float] | None = None,
) -> tuple[MultiStepReadings, tuple[str, ...], tuple[str, ...]]:
    """Read a multi-step test: its readings, or the touches of the reference that they follow from.

    Parameters
    ----------
    paths : Path, str or sequence of Path
        Columns machine_index, probe_index, error_um; or touches of any format with the orientation
        of the probe, spindle_deg: one file, or one for each setup.
    axis : (3,) float
        The probe's +z in the machine frame.
    spindle : sequence of float, optional
        Orientation of the probe in each file, where the files do not state it. [rad]

    Returns
    -------
    readings : MultiStepReadings
    notes : tuple of str
        On what touches do not determine.
    warnings : tuple of str
        Of the reader of touches.

    Raises
    ------
    InputError
        As `read_multi_step_readings`, `read_series` and `readings_of_touches`.
    """
    from pretravel.files import read_series
    from pretravel.laboratory.separation.multi_step_touches import readings_of_touches

    given = [Path(paths)] if isinstance(paths, Path | str) else list(paths)
    if len(given) == 1 and spindle is None and not _has_touches(given[0]):
        if not np.array_equal(axis, (0.0, 0.0, 1.0)):
            raise InputError(
                "readings by indices have no directions: an axis of the probe is not used, leave "
                "it out",
                path=given[0],
                inputs=("axis",),
            )
        table = read_csv_table(given[0])
        readings = _readings(table)
        said = (*comments_not_read(table), *_not_read(table), *_copies(readings))
        return readings, (), said
    try:
        read = read_series(given, spindle=spindle)
        found = readings_of_touches(read.touches, axis=axis)
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=given[0]) from None
    return found.readings, found.notes, tuple(read.notes())


def _not_read(table: CsvTable) -> tuple[str, ...]:
    """Columns that differ over the readings, such as the feed: they are not in the model."""
    others = table.others("machine_index", "probe_index", "error_um", *_OF_PLANS)
    for name in {*others} & {"unit", "units", "einheit"}:
        if wrong := {*table.columns[name]} - {"um", "µm", "μm"}:
            raise InputError(
                f"{name} is '{shortened(min(wrong))}', and error_um is in µm: correct the one that "
                "is wrong",
                path=table.path,
                line=table.header_line,
            )
    changing = [name for name in others if len({*table.columns[name]}) > 1]
    if not changing:
        return ()
    names = ", ".join(map(shortened, changing))
    return (f"not read, although it differs over the readings: {names}",)


def _copies(readings: MultiStepReadings) -> list[str]:
    rows = np.column_stack([readings.machine, readings.probe, readings.errors])
    return [
        *copied_rows_warnings(rows, lambda row: f"reading {row + 1}"),
        *rows_in_a_row_warnings(rows),
    ]


def _has_touches(path: Path) -> bool:
    """Whether a file has touches with the orientation of the probe, not readings by indices."""
    try:
        columns = set(read_csv_table(path).columns)
    except InputError:
        return False
    if "x_mm" not in columns and columns & {"machine_index", "probe_index", "error_um"}:
        return False
    return any("spindle" in name.lower() or "spindel" in name.lower() for name in columns)


def _indices(table: CsvTable, name: str) -> npt.NDArray[np.int64]:
    values = table.numbers(name)[:, 0]
    odd = np.flatnonzero((values != np.round(values)) | (np.abs(values) > _LARGEST_INDEX))
    if len(odd):
        row = int(odd[0])
        raise InputError(
            f"{name} is {values[row]:g}; an index is a whole number, at most {_LARGEST_INDEX}",
            path=table.path,
            line=table.lines[row],
        )
    return np.asarray(values, dtype=np.int64)


def separation_table(result: Separation) -> dict[str, npt.ArrayLike]:
    """A separation as columns, machine directions first.

    Returns
    -------
    mapping of str to values
        kind, index, systematic_um, u_systematic_um, variance_um2, u_variance_um2, azimuth_deg.
    """
    square = MICROMETRE**2
    machines, probes = len(result.machines), len(result.probes)
    return {
        "kind": ["machine"] * machines + ["probe"] * probes,
        "index": np.concatenate([result.machines, result.probes]),
        "systematic_um": np.concatenate([result.machine_error, result.probe_error]) / MICROMETRE,
        "u_systematic_um": np.concatenate([result.u_machine_error, result.u_probe_error])
        / MICROMETRE,
        "variance_um2": np.concatenate([result.machine_variance, result.probe_variance]) / square,
        "u_variance_um2": np.concatenate([result.u_machine_variance, result.u_probe_variance])
        / square,
        "azimuth_deg": np.concatenate([result.machine_azimuth, result.probe_azimuth]) / DEGREE,
    }


def separation_plan_table(plan: SeparationPlan) -> dict[str, npt.ArrayLike]:
    """A plan as columns: one row for each reading in order, without its error.

    Returns
    -------
    mapping of str to values
        orientation_deg (of the probe), machine_azimuth_deg, machine_index, probe_index, the normal
        nx, ny, nz of the touch and spindle_deg (the orientation again, as touches state it),
        error_um (empty).
    """
    machine, probe = plan.pairs()
    step = 360.0 / plan.directions
    per_orientation = plan.directions * plan.repeats
    orientation = np.repeat(np.array(plan.steps) * step, per_orientation)
    azimuth = (machine - 1) * step
    normals = from_angles(np.full(len(azimuth), 0.5 * math.pi), azimuth * DEGREE)
    return {
        "orientation_deg": orientation,
        "machine_azimuth_deg": azimuth,
        "machine_index": machine,
        "probe_index": probe,
        **{f"n{axis}": np.round(normals[:, i], 9) for i, axis in enumerate("xyz")},
        "spindle_deg": orientation,
        "error_um": [""] * len(machine),
    }
