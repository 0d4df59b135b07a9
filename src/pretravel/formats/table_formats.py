"""The formats that are tables: CSV, Parquet, JSON and NetCDF."""

from __future__ import annotations

from pathlib import Path

from pretravel.compensation.points import Points
from pretravel.formats.file_format import FileFormat, FileReadings, PointsOrigin, ReadingOptions
from pretravel.formats.netcdf import write_dataset
from pretravel.formats.point_tables import points_dataset, points_table
from pretravel.formats.source_file import SourceFile
from pretravel.formats.tables import write_table
from pretravel.formats.touches_csv import read_touches, write_touches
from pretravel.touches import Touches


def _parse(file: SourceFile, _: ReadingOptions) -> FileReadings:
    return FileReadings(read_touches(file))


def _write_touches(path: Path, touches: Touches, _: float | None) -> None:
    write_touches(path, touches)


def _write_points(path: Path, points: Points, _: PointsOrigin) -> None:
    write_table(path, points_table(points))


def _write_points_dataset(path: Path, points: Points, origin: PointsOrigin) -> None:
    write_dataset(path, points_dataset(points).assign_attrs(note=origin.note))


CSV = FileFormat(
    name="csv",
    what="CSV with a header (.csv)",
    reads="touches, targets",
    writes="touches, points, maps",
    verified="round trips",
    endings=(".csv",),
    parse=_parse,
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
    keeps_approaches_and_feeds=True,
)

PARQUET = FileFormat(
    name="parquet",
    what="Parquet (.parquet)",
    reads="touches, targets",
    writes="touches, points",
    verified="round trips; pyarrow, which it needs",
    endings=(".parquet",),
    binary=True,
    parse=_parse,
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
    keeps_approaches_and_feeds=True,
)

NETCDF = FileFormat(
    name="netcdf",
    what="NetCDF (.nc)",
    reads="maps",
    writes="maps, points",
    verified="round trips; xarray",
    endings=(".nc",),
    binary=True,
    write_points=_write_points_dataset,
)

JSON = FileFormat(
    name="json",
    what="JSON, a list of rows (.json)",
    writes="points, maps, results",
    verified="round trips",
    endings=(".json",),
    write_points=_write_points,
)
