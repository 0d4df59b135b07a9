"""The formats that are tables: CSV, Parquet, JSON and NetCDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.files.file_format import FileFormat, PointsOrigin
from pretravel.files.row_statements import RowStatement
from pretravel.files.tables import write_table
from pretravel.files.touches_csv import read_table_of_touches, write_touches
from pretravel.touches import Touches

if TYPE_CHECKING:
    from pretravel.measurement import Points


def _write_touches(path: Path, touches: Touches, _: float | None) -> None:
    write_touches(path, touches)


def _write_points(path: Path, points: Points, _: PointsOrigin) -> None:
    from pretravel.files.points_writing import points_table

    write_table(path, points_table(points))


def _write_points_dataset(path: Path, points: Points, origin: PointsOrigin) -> None:
    from pretravel.files.netcdf import write_dataset
    from pretravel.files.points_writing import points_dataset

    write_dataset(path, points_dataset(points).assign_attrs(note=origin.note))


_COLUMNS = (
    RowStatement(
        "columns tip, stylus, sensor, probe, tool, tip diameter, T (numbers) …",
        "", "tip", "carried",
    ),
    RowStatement("columns part, planid, partnb, serial, set, series …", "", "part", "carried"),
    RowStatement("columns run, cycle, operation that count no rows", "", "part", "carried"),
    RowStatement("column pass", "", "pass", "carried"),
    RowStatement("columns orientation, head angle, probe A, probe B", "", "orientation", "carried"),
    RowStatement(
        "columns WCS, work offset, frame, alignment, table angle that change",
        "", "frame", "refused",
    ),
    RowStatement("columns A, B, C that move", "", "frame", "refused"),
    RowStatement(
        "columns and first lines that give the tip or the reference another diameter than is used",
        "", "tip", "refused",
    ),
    RowStatement("column compensated, radius comp … that says yes", "", "radius", "refused"),
    RowStatement(
        "comments among the rows that give or change a tip, part, unit, offset, rotation …",
        "", "frame", "refused",
    ),
)  # fmt: skip

CSV = FileFormat(
    name="csv",
    takes=("decimal",),
    what="table as text (.csv, .txt, .xyz, .asc)",
    reads="touches, positions, targets",
    writes="touches, points, maps",
    needs="units, plan, where the table does not give units or normals",
    verified="round trips; files of these forms, written by hand",
    endings=(".csv",),
    parse=read_table_of_touches,
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
    keeps_approaches_and_feeds=True,
    columns=_COLUMNS,
    other_lines="refused",
)

PARQUET = FileFormat(
    name="parquet",
    takes=("decimal",),
    what="Parquet (.parquet)",
    reads="touches, targets",
    writes="touches, points",
    verified="round trips; pyarrow, which it needs",
    endings=(".parquet",),
    binary=True,
    parse=read_table_of_touches,
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
    keeps_approaches_and_feeds=True,
)

NETCDF = FileFormat(
    name="netcdf",
    what="NetCDF (.nc)",
    writes="points, predictions, studies",
    verified="round trips; xarray",
    endings=(".nc",),
    binary=True,
    begins=(b"CDF", b"\x89HDF"),
    write_points=_write_points_dataset,
)

JSON = FileFormat(
    name="json",
    what="JSON (.json): a map; points as a list of rows; a result as its report",
    reads="maps",
    writes="maps, points, results",
    verified="round trips",
    endings=(".json",),
    write_points=_write_points,
)
