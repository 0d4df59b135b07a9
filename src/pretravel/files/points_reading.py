"""Compensated points, read from the files that `write_points` writes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pretravel.base import (
    MICROMETRE,
    FloatArray,
    PretravelError,
    checked_unit,
    frozen,
    needed,
    parsed_json,
)
from pretravel.files.csv_table import CsvTable, read_csv_table
from pretravel.files.file_format import FilePositions, ReadingOptions, labels_or_numbers
from pretravel.files.netcdf import StoredVariable, read_dataset
from pretravel.files.parquet import read_parquet_table
from pretravel.files.point_tables import NO_CAUSE, SHARED, UNCOMPENSATED
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.files.stated_normals import one_normal
from pretravel.files.touches_csv import read_table_of_touches
from pretravel.measurement import Points

_WHAT = "compensated points"
_TABLES = ("", ".csv", ".txt", ".tsv", ".xyz", ".asc", ".dat")
_COMPENSATED = b"u_um"
"""Column that compensated points have."""
_HEAD = 4000  # bytes in which it must stand


def read_points(source: Source, *, units: str | None = None) -> Points:
    r"""Read the points that `write_points` wrote to CSV, Parquet, JSON or NetCDF.

    Parameters
    ----------
    source : str, Path or SourceFile
        A table needs x_mm, y_mm, z_mm, nx, ny, nz and u_um; the other columns may be missing. A
        table of any usual form with coordinates alone is read as points of another origin.
    units : str, optional
        mm or inch, of such a table that does not state its unit.

    Returns
    -------
    Points
        `Points.shared` is None where the file does not state which errors points have in common.
        A table has the uncertainty along the normal alone, and the covariance is that.

    Raises
    ------
    InputError
        No such file, another format, or values that are not points.

    >>> text = b"x_mm,y_mm,z_mm,nx,ny,nz,u_um\n1,0,0,-1,0,0,0.5\n"
    >>> points = read_points(SourceFile("points.csv", text))
    >>> (points.standard_uncertainty * 1e3).round(9).tolist(), points.shared
    ([0.5], None)
    """
    options = ReadingOptions(units=units, normals_from=one_normal([0.0, 0.0, 1.0]))
    file = opened(source)
    if file.ending == ".nc":
        return _from_dataset(file)
    if file.ending == ".json":
        return points_of_table(file, _json_table(file))
    if file.ending == ".parquet":
        table = read_parquet_table(file)
        return _plain_points(file, options) if _is_plain(table) else points_of_table(file, table)
    if file.ending in _TABLES:
        compensated = _COMPENSATED in file.content[:_HEAD]
        return (
            points_of_table(file, read_csv_table(file))
            if compensated
            else _plain_points(file, options)
        )
    raise file.error(
        f"points with their uncertainties are read from .csv, .parquet, .json and .nc, not from "
        f"{file.ending}; write them in one of these formats when the touches are compensated"
    )


def _is_plain(table: CsvTable) -> bool:
    return not table.has("u_um")


def _plain_points(file: SourceFile, options: ReadingOptions) -> Points:
    """Points of a table with coordinates alone."""
    found = read_table_of_touches(file, options)
    if not isinstance(found, FilePositions):
        raise file.error(
            "these are positions with normals, without uncertainties (no column u_um): touches, "
            "perhaps. Compensate them with a map first; points that are compensated already need "
            "no normals: leave these columns out"
        )
    return Points.plain(found.positions, labels_or_numbers(found.labels, len(found.positions)))


def points_of_table(file: SourceFile, table: CsvTable) -> Points:
    """Make points of a table with the columns that `write_points` writes.

    Parameters
    ----------
    file : SourceFile
        For messages.
    table : CsvTable

    Returns
    -------
    Points

    Raises
    ------
    InputError
        As `read_points`.
    """
    table.require("x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "u_um", what=_WHAT)
    with file.named_in_errors(table.lines):
        normals = checked_unit(table.numbers("nx", "ny", "nz"), "normals of points")
    u = table.numbers("u_um")[:, 0] * MICROMETRE
    if np.any(u < 0.0):
        raise file.error("u_um is negative", table.lines[int(np.argmin(u))])

    def column(name: str) -> FloatArray:
        return table.numbers(name)[:, 0] * MICROMETRE

    names = [name for name in table.columns if name.startswith(SHARED) and name.endswith("_um")]
    shared = {_cause(name): frozen(column(name)) for name in names}
    return _checked(
        file,
        Points(
            positions=frozen(table.numbers("x_mm", "y_mm", "z_mm")),
            normals=frozen(normals),
            pretravel=frozen(
                column("pretravel_um") if table.has("pretravel_um") else np.full(len(u), np.nan)
            ),
            covariance=frozen(u[:, None, None] ** 2 * normals[:, :, None] * normals[:, None, :]),
            deviation=frozen(column("deviation_um")) if table.has("deviation_um") else None,
            labels=table.columns.get("label") or tuple(str(i + 1) for i in range(len(u))),
            shared={k: v for k, v in shared.items() if k != NO_CAUSE} if names else None,
            uncompensated=(
                frozen(table.numbers(*UNCOMPENSATED)) if table.has(*UNCOMPENSATED) else None
            ),
        ),
    )


def _cause(column: str) -> str:
    return column.removeprefix(SHARED).removesuffix("_um").replace("_", " ")


def _checked(file: SourceFile, points: Points) -> Points:
    """Refuse shared errors that are larger than the uncertainty of their point."""
    common = np.zeros(len(points))
    for part in (points.shared or {}).values():
        with np.errstate(over="ignore"):  # infinite, and refused
            common = common + part**2
    u = points.standard_uncertainty
    wrong = np.flatnonzero(~(common <= u**2 * (1.0 + 1e-6) + 1e-18))
    if len(wrong):
        row = int(wrong[0])
        raise file.error(
            f"point {points.labels[row]}: its shared errors ({np.sqrt(common[row]) * 1e3:.4g} µm) "
            f"are larger than its standard uncertainty ({u[row] * 1e3:.4g} µm), which contains them"
        )
    return points


def _json_table(file: SourceFile) -> CsvTable:
    """The rows of a JSON file as a table of cells."""
    try:
        with file.named_in_errors():
            rows = parsed_json(file.content)
    except PretravelError:
        raise
    except ValueError as error:  # not JSON, not UTF-8, or an integer of more than 4300 digits
        raise file.error(f"not JSON that can be read: {error}") from None
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise file.error("compensated points in JSON are a list of rows; this is something else")
    names = list(rows[0])
    odd = next((i for i, row in enumerate(rows) if list(row) != names), None)
    if odd is not None:
        raise file.error(f"row {odd + 1} has other columns than the first row")
    columns = {
        name: tuple("" if row[name] is None else str(row[name]) for row in rows) for name in names
    }
    return CsvTable(file.path, columns, tuple(range(1, len(rows) + 1)), 0)


def _from_dataset(file: SourceFile) -> Points:
    needed("h5netcdf", "tables")
    data = read_dataset(file).variables
    if not {"position", "normal", "covariance", "label"} <= set(data):
        raise file.error("this NetCDF file holds no compensated points (a map, perhaps)")
    count = len(np.atleast_1d(data["label"].values))

    def values(name: str, *shape: int) -> FloatArray:
        return _array(file, name, data[name], (count, *shape))

    def perhaps(name: str, *shape: int) -> FloatArray | None:
        return values(name, *shape) if name in data else None

    positions, covariance = values("position", 3), values("covariance", 3, 3)
    for name, part in (("positions", positions), ("covariances", covariance)):
        if not np.all(np.isfinite(part)):
            raise file.error(f"the {name} of the points are not finite")
    with file.named_in_errors():
        normals = checked_unit(values("normal", 3), "normals of points")
    if np.any(np.einsum("ni,nij,nj->n", normals, covariance, normals) < 0.0):
        raise file.error("the variance of a point along its normal is negative")
    pretravel = perhaps("pretravel")
    return _checked(
        file,
        Points(
            positions=positions,
            normals=frozen(normals),
            pretravel=np.full(count, np.nan) if pretravel is None else pretravel,
            covariance=covariance,
            deviation=perhaps("deviation"),
            labels=tuple(str(label) for label in data["label"].values.tolist()),
            shared=_shared_of(file, data, count),
            uncompensated=perhaps("uncompensated", 3),
        ),
    )


def _array(
    file: SourceFile, name: str, stored: StoredVariable, shape: tuple[int, ...]
) -> FloatArray:
    if stored.values.shape != shape or stored.values.dtype.kind not in "fiu":
        raise file.error(
            f"the array {name} must contain numbers and have the shape {shape}; it has the shape "
            f"{stored.values.shape} and the type {stored.values.dtype}"
        )
    return frozen(np.asarray(stored.values, dtype=np.float64))


def _shared_of(
    file: SourceFile, data: Mapping[str, StoredVariable], count: int
) -> Mapping[str, FloatArray] | None:
    if "shared" not in data:
        return None
    if "cause" not in data:
        raise file.error("the shared errors of the points have no causes")
    causes = [str(cause) for cause in np.atleast_1d(data["cause"].values).tolist()]
    factors = _array(file, "shared", data["shared"], (len(causes), count))
    return dict(zip(causes, map(frozen, factors), strict=True))
