"""Readings of a multi-step test from CSV files, and separations and plans as columns."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, InputError, PretravelError, parsed_json
from pretravel.files import CsvTable, opened, read_csv_table
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.plan import SeparationPlan
from pretravel.laboratory.separation.separation import Separation
from pretravel.measurement import TouchScatter

_LARGEST = 10_000.0  # µm
_LARGEST_INDEX = 1_000_000


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
        A file without these columns; indices that are not whole numbers.
    """
    table = read_csv_table(path)
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
    if np.max(np.abs(errors)) > _LARGEST:
        row = int(np.argmax(np.abs(errors)))
        raise InputError(
            f"error_um is {errors[row]:g}; is it in µm?", path=path, line=table.lines[row]
        )
    try:
        return MultiStepReadings(
            machine=_indices(table, "machine_index"),
            probe=_indices(table, "probe_index"),
            errors=errors * MICROMETRE,
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def read_multi_step_test(path: str | Path) -> tuple[MultiStepReadings, tuple[str, ...]]:
    """Read a multi-step test: its readings, or the touches of the reference that they follow from.

    Parameters
    ----------
    path : str or Path
        Columns machine_index, probe_index, error_um; or touches of any format with the orientation
        of the probe, spindle_deg.

    Returns
    -------
    readings : MultiStepReadings
    notes : tuple of str
        On what touches do not determine.

    Raises
    ------
    InputError
        As `read_multi_step_readings`, `read_readings` and `readings_of_touches`.
    """
    from pretravel.files import read_readings
    from pretravel.laboratory.separation.multi_step_touches import readings_of_touches

    try:
        columns = set(read_csv_table(path).columns)
    except InputError:
        columns = set()
    if not columns or columns & {"machine_index", "probe_index", "error_um"}:
        return read_multi_step_readings(path), ()
    if not any("spindle" in name.lower() or "spindel" in name.lower() for name in columns):
        return read_multi_step_readings(path), ()  # which says what is missing
    try:
        found = readings_of_touches(read_readings(path).touches)
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    return found.readings, found.notes


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


def read_touch_scatter(path: str | Path) -> TouchScatter:
    """Read the variances of a separation of machine and probe, by direction.

    Parameters
    ----------
    path : str or Path
        What `separate` writes: .csv, or .json with all values.

    Returns
    -------
    TouchScatter

    Raises
    ------
    InputError
        A file of something else; directions whose azimuths are not known; negative variances.
    """
    path = Path(path)
    columns = _directions_of_result(path) if path.suffix.lower() == ".json" else None
    if columns is None:
        table = read_csv_table(path)
        needed = ("kind", "variance_um2", "azimuth_deg")
        table.require(*needed, what="a separation of machine and probe")
        columns = {name: list(table.columns[name]) for name in needed}
    kinds = np.array([str(kind).strip() for kind in columns["kind"]])
    try:
        values = {
            name: np.array([_number_or_nan(cell) for cell in columns[name]])
            for name in ("azimuth_deg", "variance_um2")
        }
        azimuth, variance = values["azimuth_deg"] * DEGREE, values["variance_um2"] * MICROMETRE**2
        return TouchScatter(
            *(part[kinds == kind] for kind in ("machine", "probe") for part in (azimuth, variance))
        )
    except (TypeError, ValueError) as error:
        raise InputError(f"a variance or azimuth is no number ({error})", path=path) from None
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def _number_or_nan(cell: object) -> float:
    """A number of a table; nan for an empty cell and for the null of JSON."""
    return math.nan if cell is None or not str(cell).strip() else float(str(cell))


def _directions_of_result(path: Path) -> dict[str, list[object]]:
    """The columns of the table of directions in a result with all values."""
    hint = "it is no result of separate with all values (separate … -o separation.json)"
    try:
        content = parsed_json(opened(path).content)
        tables = content["document"]["data"]
        (directions,) = [table for table in tables if table["title"] == "Directions"]
        columns = {column["name"]: list(column["values"]) for column in directions["columns"]}
        needed = ("kind", "variance_um2", "azimuth_deg")
        if len({len(columns[name]) for name in needed}) > 1:
            raise InputError(hint, path=path)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, PretravelError):
        raise InputError(hint, path=path) from None
    return columns


def separation_plan_table(plan: SeparationPlan) -> dict[str, npt.ArrayLike]:
    """A plan as columns: one row for each reading in order, without its error.

    Returns
    -------
    mapping of str to values
        orientation_deg (of the probe), machine_azimuth_deg, machine_index, probe_index,
        error_um (empty).
    """
    machine, probe = plan.pairs()
    step = 360.0 / plan.directions
    per_orientation = plan.directions * plan.repeats
    return {
        "orientation_deg": np.repeat(np.array(plan.steps) * step, per_orientation),
        "machine_azimuth_deg": (machine - 1) * step,
        "machine_index": machine,
        "probe_index": probe,
        "error_um": [""] * len(machine),
    }
