"""Compensated points, read from the files that `write_points` writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import (
    MICROMETRE,
    FloatArray,
    IntArray,
    PretravelError,
    checked_unit,
    frozen,
    needed,
    parsed_json,
)
from pretravel.files.csv_table import CsvTable, read_csv_table
from pretravel.files.file_format import ALL, ReadingOptions
from pretravel.files.points_writing import (
    FILES,
    MAP_USED,
    NO_CAUSE,
    SHARED,
    UNCOMPENSATED,
    listed_numbers,
)
from pretravel.files.source_file import Source, SourceFile, opened, shortened
from pretravel.measurement import Points
from pretravel.touches import (
    copied_rows_warnings,
    length_of_run,
    refuse_several_runs,
    rows_in_a_row_warnings,
)

if TYPE_CHECKING:
    from pretravel.files.netcdf import StoredVariable
    from pretravel.files.touch_columns import TouchColumns

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
    return points_and_notes(source, ReadingOptions(units=units))[0]


def points_and_notes(
    source: Source, options: ReadingOptions = ReadingOptions()
) -> tuple[Points, tuple[str, ...]]:
    """Read points as `read_points` does, and what is to be said of them.

    Parameters
    ----------
    source : str, Path or SourceFile
    options : ReadingOptions
        Unit, tip and series of a table that another program wrote; the radius of its tip, where its
        points are tip centres.

    Returns
    -------
    Points
    tuple of str
        Readings that were missed.

    Raises
    ------
    InputError
        As `read_points`; points of several parts or tips, and none is chosen; points that are
        tip centres, by their nominal points, and the tip is not stated.
    """
    file = opened(source)
    found, notes, has_series = _read(file, options)
    notes += tuple(
        copied_rows_warnings(found.positions, lambda row: f"row {row + 1} ({found.labels[row]})")
        + rows_in_a_row_warnings(found.positions)
    )
    if ALL in options.series:
        return found, notes
    length = length_of_run(found.labels, found.positions)
    numbers = [name for name in options.series if name.isdecimal()]
    if length and len(numbers) == 1 and 1 <= int(numbers[0]) <= len(found) // length:
        begin = (int(numbers[0]) - 1) * length
        return found[np.arange(begin, begin + length)], notes
    if options.series and not has_series:
        raise file.error(
            f"the points have no series {', '.join(options.series)} to choose: leave it out, or "
            "choose the points by their labels",
            inputs=("series",),
        )
    with file.named_in_errors():
        refuse_several_runs(found.labels, found.positions)
    return found, notes


def _read(file: SourceFile, options: ReadingOptions) -> tuple[Points, tuple[str, ...], bool]:
    """The points of a file of any of the formats, what is said, and whether a series was chosen."""
    if file.ending in _TABLES and _COMPENSATED not in file.content[:_HEAD]:
        return _plain_points(file, options)
    table = _parquet_table(file) if file.ending == ".parquet" else None
    if table is not None and _is_plain(table):
        return _plain_points(file, options)
    if options.units == "inch":
        raise file.error("the file is in mm, but inch was given", inputs=("units",))
    if file.ending == ".nc":
        return *_from_dataset(file), False
    if file.ending == ".json":
        rows = _json_table(file)
        return points_of_table(file, rows), _beside_points(file, rows, None), False
    if table is not None:
        return points_of_table(file, table), _beside_points(file, table, options), False
    if file.ending in _TABLES:
        written = read_csv_table(file)
        return points_of_table(file, written), _beside_points(file, written, options), False
    raise file.error(
        f"points with their uncertainties are read from .csv, .parquet, .json and .nc, not from "
        f"{file.ending}; write them in one of these formats when the touches are compensated"
    )


def _plain_points(
    file: SourceFile, options: ReadingOptions
) -> tuple[Points, tuple[str, ...], bool]:
    from pretravel.files.plain_points import plain_points  # with all that reads touches

    return plain_points(file, options)


def _parquet_table(file: SourceFile) -> CsvTable:
    from pretravel.files.tables import read_parquet_table

    return read_parquet_table(file)


def _is_plain(table: CsvTable) -> bool:
    return not table.has("u_um")


_OWN = {
    *("label", "face", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "pretravel_um", "u_um"),
    *("deviation_um", *UNCOMPENSATED, MAP_USED, FILES),
}


def _beside_points(
    file: SourceFile, table: CsvTable, options: ReadingOptions | None
) -> tuple[str, ...]:
    """What a table gives in addition to the columns of `write_points`: it is not read.

    Without options its columns are not judged as those of touches.

    Raises
    ------
    InputError
        Rows of several parts, or that could not be used together as touches.
    """
    others = [name for name in table.columns if name not in _OWN and not name.startswith(SHARED)]
    if not others and b"#" not in file.content:
        return ()
    found = None if options is None else _touch_columns(file, options)
    parts = (table if found is None else found.table).columns.get("part", ())
    series = () if options is None else options.series
    if ALL not in series and (other := set(parts) - {*parts[:1]}):
        row = min(map(parts.index, other))
        raise file.error(
            f"the points are of part {parts[0]} and of part {parts[row]}, and would be used as "
            "one: split the file, or use all, if they are the same",
            table.lines[row],
            inputs=("series",),
        )
    told = (f"not read: {', '.join(others)}",) if others else ()
    return told if found is None else (*told, *found.notes)


def _touch_columns(file: SourceFile, options: ReadingOptions) -> TouchColumns:
    from pretravel.files.stated_normals import one_normal
    from pretravel.files.touch_columns import read_touch_columns

    return read_touch_columns(file, replace(options, normals_from=one_normal([0.0, 0.0, 1.0])))


def points_of_table(file: SourceFile, table: CsvTable) -> Points:
    """Make points of a table with the columns that `write_points` writes.

    Parameters
    ----------
    file : SourceFile
        For messages.
    table : CsvTable

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
    shared: dict[str, FloatArray] = {}
    for name in names:
        cells = table.columns[name]
        if cells and cells[0].startswith("["):
            rows = listed_numbers(cells)
            if rows is None:
                raise file.error(f"{name} has lists of different lengths, or no lists of numbers")
            shared |= {f"{_cause(name)} {k}": frozen(row * MICROMETRE)
                       for k, row in enumerate(rows, start=1)}  # fmt: skip
        else:
            shared[_cause(name)] = frozen(column(name))
    maps = _maps(table.columns.get(MAP_USED, ()))
    if MAPS_APART in maps:
        names = []  # which errors two maps have in common is not known
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
            face=_faces(file, table),
            map_used=maps,
            files=_maps(table.columns.get(FILES, ())),
        ),
    )


MAPS_APART = " | "
"""Between the names of several maps."""


def _maps(words: Iterable[str]) -> str:
    """The maps that rows state, each once; where some rows state none, this too."""
    found = dict.fromkeys(words)
    return MAPS_APART.join(shortened(word) or "not stated" for word in found) if any(found) else ""


def _faces(file: SourceFile, table: CsvTable) -> IntArray | None:
    """The numbers of the faces, where the table has them."""
    if not table.has("face"):
        return None
    numbers = table.numbers("face")[:, 0]
    _refuse_no_face(file, numbers, table.lines)
    return numbers.astype(np.int64)


def _refuse_no_face(file: SourceFile, numbers: FloatArray, lines: Sequence[int] = ()) -> None:
    wrong = ~((numbers == np.round(numbers)) & (numbers >= 1.0) & (numbers <= 1e9))
    if wrong.any():
        line = lines[int(np.argmax(wrong))] if lines else None
        raise file.error("the face is not a number of a face, 1 or more", line)


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


_UNITS_OF_ARRAYS = {
    **dict.fromkeys(
        ("position", "pretravel", "standard_uncertainty", "deviation", "uncompensated", "shared"),
        "mm",
    ),
    "covariance": "mm2",
}
_ARRAYS = {*_UNITS_OF_ARRAYS, "normal", "face", "cause", "label", "axis", "other_axis"}


def _from_dataset(file: SourceFile) -> tuple[Points, tuple[str, ...]]:
    from pretravel.files.netcdf import read_dataset

    needed("h5netcdf", "tables")
    stored = read_dataset(file)
    data = stored.variables
    if not {"position", "normal", "covariance", "label"} <= set(data):
        raise file.error("this NetCDF file holds no compensated points (a map, perhaps)")
    for name, unit in _UNITS_OF_ARRAYS.items():
        stated = str(data[name].attrs.get("units", unit)) if name in data else unit
        if stated != unit:
            raise file.error(f"the array {name} must be in {unit}, and its units are '{stated}'")
    unread = [name for name in data if name not in _ARRAYS]
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
    pretravel, face = perhaps("pretravel"), perhaps("face")
    if face is not None:
        _refuse_no_face(file, face)
    points = Points(
        positions=positions,
        normals=frozen(normals),
        pretravel=np.full(count, np.nan) if pretravel is None else pretravel,
        covariance=covariance,
        deviation=perhaps("deviation"),
        labels=tuple(str(label) for label in data["label"].values.tolist()),
        shared=_shared_of(file, data, count),
        uncompensated=perhaps("uncompensated", 3),
        face=None if face is None else face.astype(np.int64),
        map_used=_maps([str(stored.attrs.get(MAP_USED, ""))]),
        files=_maps([str(stored.attrs.get(FILES, ""))]),
    )
    u = perhaps("standard_uncertainty")
    if u is not None and not np.allclose(u, points.standard_uncertainty, rtol=1e-6, atol=1e-12):
        raise file.error(
            "the standard_uncertainty of the points is not that of their covariance: one of them "
            "was changed"
        )
    return _checked(file, points), (f"not read: {', '.join(unread)}",) if unread else ()


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
