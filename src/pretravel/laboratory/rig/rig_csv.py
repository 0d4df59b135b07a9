"""Traces and budgets of a calibration rig from CSV files, and its results as columns."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import LARGEST_NUMBER, MICROMETRE, FloatArray, InputError, PretravelError
from pretravel.files import (
    CsvTable,
    files_meant,
    read_csv_table,
    refuse_other_comments,
    shortened,
)
from pretravel.laboratory.rig.budget import LengthComponent
from pretravel.laboratory.rig.calibration import angles_of
from pretravel.laboratory.rig.scale import ScaleCheck, check_scale
from pretravel.laboratory.rig.trace import RigTouch, RigTrace

OWN_REPEATABILITY = "repeatability at"
"""Names of sources in a budget that begin so are a repeatability, which a calibration replaces."""
OWN_TEMPERATURE = ("temperature measurement", "thermal expansion")
"""Names of sources that begin so are replaced where both uncertainties are stated."""
BUDGET_COLUMNS = ("source", "type", "uncertainty_um", "per_metre_um")
MORE_BUDGET_COLUMNS = ("dof", "remark")
_RESULTS = re.compile(
    r"\W*(?:(?:combined|expanded|total|kombiniert\w*|erweitert\w*)(?: standard)?"
    r"(?: (?:uncertainty|(?:mess)?unsicherheit|u))?|sum|u\(y\)|uc|result|coverage(?: factor)?)"
    r"(?: ?\([^)]{0,20}\)|[ ,:]*\bk ?= ?[\d.,]+)?\W*"
)
"""The last lines of a budget."""
_HEAD = 4096
"""Bytes at the beginning of a file in which the names of its columns are looked for."""
COLUMNS = ("time_s", "ruler_mm", "laser_mm", "contact", "trigger")


def rig_traces(places: Sequence[Path | str]) -> list[Path]:
    """Return the files of traces that are meant; of a folder those with the columns of a trace.

    Parameters
    ----------
    places : sequence of Path or str
        Files, folders, names with wildcards.

    Raises
    ------
    InputError
        As `pretravel.files.several_files.files_meant`.
    """

    def is_trace(path: Path) -> bool:
        return path.suffix.lower() == ".csv" and (
            math.isfinite(angles_of(path.stem)[0]) or _begins_as_trace(path)
        )

    return files_meant(places, is_trace, "traces (rig_AZIMUTH_REPEAT.csv)")


def _begins_as_trace(path: Path) -> bool:
    """Whether the columns of a trace are among the first lines of a file."""
    with path.open("rb") as stream:
        head = stream.read(_HEAD).decode("utf-8", "replace").lower()
    lines = [line for line in head.splitlines() if line.strip() and not line.startswith("#")]
    return bool(lines) and all(name in lines[0] for name in COLUMNS)


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
        The file lacks a column or has another one, a value is not a number, or contact or trigger
        is not 0 or 1.
    """
    table = read_csv_table(path)
    table.require(*COLUMNS, what="a rig trace")
    table.refuse_others(*COLUMNS, what="a rig trace")
    refuse_other_comments(table, "mm")
    values = table.numbers("time_s", "ruler_mm", "laser_mm")
    try:
        return RigTrace(
            time=values[:, 0],
            ruler=values[:, 1],
            laser=values[:, 2],
            contact=_logic(table, "contact") > 0.5,
            trigger=_logic(table, "trigger") > 0.5,
            name=Path(path).stem,
            comments=table.comments,
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


def rig_table(
    touches: Sequence[RigTouch],
    not_used: Mapping[str, str] | None = None,
    forces: Sequence[float] | None = None,
) -> dict[str, npt.ArrayLike]:
    """Touches on the rig as columns, one row each; nan where a trace does not show the value.

    Parameters
    ----------
    touches : sequence of RigTouch
    not_used : mapping of str to str, optional
        Reasons for traces that are not in the results of a calibration, for the column left_out.
    forces : n floats, optional
        Trigger forces, for the column force_N. [N]

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
        "azimuth_deg": [math.degrees(angles_of(touch.trace)[0]) for touch in touches],
        "polar_deg": [math.degrees(angles_of(touch.trace)[1]) for touch in touches],
        **({} if forces is None else {"force_N": list(forces)}),
        "feed_mm_min": [touch.feed if math.isfinite(touch.feed) else math.nan for touch in touches],
        "left_out": [(not_used or {}).get(touch.trace, "") for touch in touches],
        "note": ["; ".join(touch.notes) for touch in touches],
    }


def read_budget(path: str | Path) -> tuple[LengthComponent, ...]:
    """Read the budget of a rig: source, type (A or B), uncertainty_um, per_metre_um.

    Empty cells are zero. A column ``dof`` states degrees of freedom, infinite where it is empty; a
    column ``remark`` is for people.

    Raises
    ------
    InputError
        Missing columns, columns that a budget does not have (a divisor or a k would otherwise be
        lost), values that are not numbers, types that are not A or B, a source that is given twice.
    """
    return budget_of(read_csv_table(path))


def budget_of(table: CsvTable) -> tuple[LengthComponent, ...]:
    """The budget of a rig in a table, as `read_budget`."""
    refuse_other_comments(table, "µm")
    table.require(*BUDGET_COLUMNS, what="a budget")
    hint = ": give standard uncertainties (k = 1)"
    table.refuse_others(*BUDGET_COLUMNS, "dof", what="a budget", hint=hint)
    found = tuple(_budget_source(table, row, table.path) for row in range(len(table)))
    names = [each.source.casefold() for each in found]
    for row, name in enumerate(names):
        if (first := names.index(name)) < row:
            raise InputError(
                f"the source '{found[row].source}' is given a second time (first in line "
                f"{table.lines[first]}) and would count twice: leave one out, or name both",
                path=table.path,
                line=table.lines[row],
            )
    return found


def read_scale_check(path: str | Path) -> ScaleCheck:
    """Read a scale next to a reference, and compare them: scale_mm, reference_mm, run.

    Parameters
    ----------
    path : str or Path
        ``run`` may be left out: one run.

    Raises
    ------
    InputError
        Missing columns, values that are not numbers, runs that are not whole; as `check_scale`.
    """
    return scale_check_of(read_csv_table(path))


def scale_check_of(table: CsvTable) -> ScaleCheck:
    """The check of a scale in a table, as `read_scale_check`."""
    path = table.path
    refuse_other_comments(table, "mm")
    table.require("scale_mm", "reference_mm", what="a check of a scale")
    table.refuse_others("scale_mm", "reference_mm", "run", what="a check of a scale")
    values = table.numbers("scale_mm", "reference_mm")
    runs = table.numbers("run")[:, 0] if table.has("run") else np.zeros(len(values))
    odd = np.flatnonzero((runs != np.round(runs)) | (np.abs(runs) > 1e6))
    if len(odd):
        row = int(odd[0])
        raise InputError(
            f"run is {runs[row]:g}; it is a whole number", path=path, line=table.lines[row]
        )
    try:
        return check_scale(values[:, 0], values[:, 1], runs.astype(np.int64))
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def _budget_source(table: CsvTable, row: int, path: str | Path) -> LengthComponent:
    """One row of a budget."""
    line = table.lines[row]
    kind = table.columns["type"][row].strip().upper()
    if kind not in ("A", "B"):
        raise InputError(f"type is '{kind}'; it is A or B", path=path, line=line)
    source = table.columns["source"][row].strip()
    if not source:
        raise InputError("a source of uncertainty needs a name", path=path, line=line)
    if _RESULTS.fullmatch(source.casefold()):
        raise InputError(
            f"'{source}' is a result of the budget, no source: it would count twice. Leave it out",
            path=path,
            line=line,
        )
    values = []
    for name in ("uncertainty_um", "per_metre_um"):
        cell = table.columns[name][row].strip()
        values.append(_number_or(cell, 0.0))
        if not abs(values[-1]) <= LARGEST_NUMBER:
            raise InputError(
                f"{name} is '{shortened(cell)}'; it must be a finite number, or empty",
                path=path,
                line=line,
            )
    if min(values) < 0.0:
        raise InputError("an uncertainty is negative", path=path, line=line)
    cell = table.columns["dof"][row].strip() if table.has("dof") else ""
    dof = _number_or(cell, math.inf)
    if not dof > 0.0:
        raise InputError(
            f"dof is '{shortened(cell)}'; it must be a positive number, or empty for infinite",
            path=path,
            line=line,
        )
    return LengthComponent(
        source,
        kind,
        values[0] * MICROMETRE,
        values[1] * 1e-6,
        dof,
        repeatability=source.casefold().startswith(OWN_REPEATABILITY),
        thermal=source.casefold().startswith(OWN_TEMPERATURE),
        remark=table.columns["remark"][row].strip() if table.has("remark") else "",
    )


def _number_or(cell: str, empty: float) -> float:
    """The number in a cell; `empty` for an empty one, nan for words."""
    try:
        return float(cell) if cell else empty
    except ValueError:
        return math.nan
