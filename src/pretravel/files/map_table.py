"""Maps as tables over directions, in CSV."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    InputError,
    IntArray,
    from_angles,
    probe_rotation,
)
from pretravel.files.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.files.source_file import opened
from pretravel.maps import (
    DirectionSupport,
    Origin,
    PretravelMap,
    Provenance,
    TabulatedBasis,
    largest_plausible,
    map_grid,
)
from pretravel.uncertainty import Covariance

Columns = Mapping[str, npt.ArrayLike]

_VALUES = ("polar_deg", "azimuth_deg", "pretravel_um", "u_um")
_CONSTANTS = (
    "tip_radius_mm", "u_tip_radius_um", "repeatability_um", "fixed_scatter_um", "feed_mm_min",
    "delay_ms", "u_delay_ms", "probe_axis_x", "probe_axis_y", "probe_axis_z", "probe_rotation_deg",
)  # fmt: skip
_OF_PREDICTIONS = ("trigger_force_N", "sensing_distance_um", "seat")
"""Columns of a prediction that a map does not need (and share_…_um)."""
_COARSE = 500
"""Rows of a table up to which straight lines between them can miss lobes."""
_LEAST = 0.05 * MICROMETRE
"""The largest pretravel of a table is more than this, except of one that is all zero. [mm]"""


def write_csv_map(path: str | Path, pretravel_map: PretravelMap, table: Columns | None) -> None:
    """Write a map as CSV: the columns of a prediction where there are some, else a grid.

    Parameters
    ----------
    path : str or Path
    pretravel_map : PretravelMap
    table : mapping of str to (n,) values or None
        Columns of a prediction.
    """
    columns = dict(table) if table is not None else _grid_table(pretravel_map)
    rows = len(np.asarray(columns["polar_deg"]))
    constants = _table_constants(pretravel_map)
    columns |= {name: np.full(rows, value) for name, value in constants.items()}
    write_csv_table(path, columns)


def _table_constants(pretravel_map: PretravelMap) -> dict[str, float]:
    """Constants that a table needs to be used as a map, a column each.

    The axis is left out where it is +z.
    """
    constants = {
        "tip_radius_mm": pretravel_map.tip_radius,
        "u_tip_radius_um": pretravel_map.u_tip_radius / MICROMETRE,
    }
    if pretravel_map.repeatability:
        constants["repeatability_um"] = pretravel_map.repeatability / MICROMETRE
    if pretravel_map.fixed_scatter:
        constants["fixed_scatter_um"] = pretravel_map.fixed_scatter / MICROMETRE
    if pretravel_map.feed is not None:
        constants["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        constants["delay_ms"] = pretravel_map.delay * 1e3
        constants["u_delay_ms"] = pretravel_map.u_delay * 1e3
    rotation = pretravel_map.rotation
    if not np.allclose(rotation, np.eye(3), atol=1e-12):
        axis = rotation[:, 2]
        about = probe_rotation(axis).T @ rotation
        turn = math.degrees(math.atan2(about[1, 0], about[0, 0]))
        constants |= {f"probe_axis_{name}": float(v) for name, v in zip("xyz", axis, strict=True)}
        constants["probe_rotation_deg"] = turn
    return constants


def _grid_table(pretravel_map: PretravelMap) -> dict[str, npt.ArrayLike]:
    # Fine enough for linear interpolation between: 0.1 µm where harmonics reach degree 24.
    values = map_grid(pretravel_map, polar_step=2.5, azimuth_step=2.5)
    polar, azimuth = np.meshgrid(values["polar_deg"], values["azimuth_deg"], indexing="ij")
    supported = np.isfinite(values["pretravel_um"])
    return {
        "polar_deg": polar[supported],
        "azimuth_deg": azimuth[supported],
        "pretravel_um": values["pretravel_um"][supported],
        "u_um": values["u_um"][supported],
    }


def read_csv_map(path: Path, tip_diameter: float | None) -> PretravelMap:
    """A map from a table over directions, interpolated linearly.

    The error of straight lines between few directions is part of the fixed scatter of a
    measured table.

    Parameters
    ----------
    path : Path
        CSV with polar_deg, azimuth_deg, pretravel_um, and perhaps u_um and constant columns.
    tip_diameter : float or None
        Where the table does not state it. [mm]

    Raises
    ------
    InputError
        Missing columns, columns that a map does not have (what they state would be lost),
        implausible values, a direction with two values.
    """
    file = opened(path)
    if not any(name in file.content for name in (b"polar_deg", b"pretravel_um")):
        raise file.error(
            "this is not a map: a table of a map has the columns polar_deg, azimuth_deg and "
            "pretravel_um. A map is made from touches by a qualification"
        )
    table = read_csv_table(file)
    table.require("polar_deg", "azimuth_deg", "pretravel_um", what="a map")
    _refuse_other_columns(table)
    angles = table.numbers("polar_deg", "azimuth_deg") * DEGREE
    directions = from_angles(angles[:, 0], angles[:, 1])
    value = table.numbers("pretravel_um")[:, 0] * MICROMETRE
    u = table.numbers("u_um")[:, 0] * MICROMETRE if table.has("u_um") else np.zeros(len(value))
    if np.any(u < 0.0):
        row = int(np.argmin(u))
        raise InputError(
            f"u_um is {u[row] / MICROMETRE:g}; a standard uncertainty cannot be negative",
            path=path,
            line=table.lines[row],
        )
    origin = Origin.QUALIFIED if table.has("u_um") else Origin.PREDICTED
    feed = _constant(table, "feed_mm_min")
    _refuse_implausible(table, value, feed)
    keep = _distinct(table, directions, value)
    radius = _constant(table, "tip_radius_mm")
    if radius is None:
        if tip_diameter is None:
            raise InputError(
                "this table has no column tip_radius_mm; give the tip's diameter",
                path=path,
                inputs=("tip_diameter",),
            )
        radius = 0.5 * tip_diameter
    delay_ms = _constant(table, "delay_ms")
    support = DirectionSupport(directions[keep])
    basis, covariance = TabulatedBasis(support), Covariance.fully_shared(u[keep] ** 2)
    coarse = origin is Origin.QUALIFIED and basis.size <= _COARSE
    between = basis.u_between_nodes(value[keep], covariance) if coarse else 0.0
    scatter = (_constant(table, "fixed_scatter_um") or 0.0) * MICROMETRE
    return PretravelMap(
        basis=basis,
        coefficients=value[keep],
        covariance=covariance,
        support=support,
        tip_radius=radius,
        u_tip_radius=(_constant(table, "u_tip_radius_um") or 0.0) * MICROMETRE,
        repeatability=(_constant(table, "repeatability_um") or 0.0) * MICROMETRE,
        fixed_scatter=math.hypot(scatter, between),
        rotation=_rotation(table),
        feed=feed,
        delay=None if delay_ms is None else delay_ms * 1e-3,
        u_delay=(_constant(table, "u_delay_ms") or 0.0) * 1e-3,
        provenance=Provenance(origin, f"{origin.value}, table {path.name}"),
    )


def _refuse_other_columns(table: CsvTable) -> None:
    shares = [name for name in table.columns if re.fullmatch(r"share_.+_um", name)]
    known = (*_VALUES, *_CONSTANTS, *_OF_PREDICTIONS, *shares)
    if "effective_radius_mm" in table.others(*known):
        raise InputError(
            "this is a table of radii to read (column effective_radius_mm): between its directions "
            "linear interpolation can be wrong by more than u_um, and it has no axis and no feed. "
            "Use the map from which it was made",
            path=table.path,
            line=table.header_line or None,
        )
    table.refuse_others(*known, what="a map")


def _refuse_implausible(table: CsvTable, value: FloatArray, feed: float | None) -> None:
    largest = largest_plausible(feed)
    row = int(np.argmax(np.abs(value)))
    if abs(value[row]) > largest:
        raise InputError(
            f"pretravel_um is {value[row] / MICROMETRE:g}; probes deflect by 1 to 80 µm, and up to "
            f"{largest / MICROMETRE:.0f} is accepted (more with a column feed_mm_min)",
            path=table.path,
            line=table.lines[row],
        )
    if np.all(value < 0.0):
        raise InputError(
            "pretravel_um is negative in every row; it is how far the tip moves on after the "
            "contact. Is it the deviation of the radius, with the opposite sign?",
            path=table.path,
            line=table.lines[row],
        )
    if 0.0 < abs(value[row]) < _LEAST:
        raise InputError(
            f"the largest pretravel_um is {value[row] / MICROMETRE:g}; probes deflect by 1 to 80 "
            "µm. Are the values in mm?",
            path=table.path,
            line=table.lines[row],
        )


def _distinct(table: CsvTable, directions: FloatArray, value: FloatArray) -> IntArray:
    """Rows with directions that are not in the table before; refuses contradictions."""
    _, first, inverse = np.unique(
        np.round(directions, 9), axis=0, return_index=True, return_inverse=True
    )
    contradiction = np.flatnonzero(np.abs(value[first][inverse.ravel()] - value) > 1e-9)
    if len(contradiction):
        raise InputError(
            "this direction is in the table twice, with different values",
            path=table.path,
            line=table.lines[int(contradiction[0])],
        )
    return np.asarray(np.sort(first), dtype=np.int64)


def _rotation(table: CsvTable) -> FloatArray:
    """Probe to machine frame; the axis is left out of a table where it is +z."""
    axis = [_constant(table, f"probe_axis_{name}") for name in "xyz"]
    turn = _constant(table, "probe_rotation_deg") or 0.0
    stated = [value for value in axis if value is not None]
    if not stated:
        return probe_rotation((0.0, 0.0, 1.0), turn * DEGREE)
    if len(stated) < 3 or not math.isclose(math.hypot(*stated), 1.0, abs_tol=1e-3):
        raise InputError(
            "probe_axis_x, probe_axis_y and probe_axis_z must all be there, and be a unit vector",
            path=table.path,
            line=table.header_line or None,
        )
    return probe_rotation(stated, turn * DEGREE)


def _constant(table: CsvTable, name: str) -> float | None:
    """The number that fills a column; None without the column."""
    if not table.has(name):
        return None
    values = table.numbers(name)[:, 0]
    other = np.flatnonzero(values != values[0])
    if len(other):
        row = int(other[0])
        raise InputError(
            f"{name} is {values[row]:g}, but {values[0]:g} in the rows above; it must be the same",
            path=table.path,
            line=table.lines[row],
        )
    return float(values[0])
