"""Touches and targets as tables, CSV of any usual form or Parquet."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, FloatArray, InputError, PretravelError, checked_unit
from pretravel.files.csv_table import CsvTable
from pretravel.files.file_format import FilePositions, FileReadings, ReadingOptions
from pretravel.files.number_tables import columns_of_numbers
from pretravel.files.source_file import Source, SourceFile, opened, shortened
from pretravel.files.stated_normals import refuse_inward, stated_normals, with_sphere_normals
from pretravel.files.tables import write_table
from pretravel.files.touch_columns import TouchColumns, read_touch_columns
from pretravel.touches import WORD_COLUMNS, Targets, Touches, word_fields

if TYPE_CHECKING:
    from pretravel.surface import Part, Surface

_POSITION = ("x_mm", "y_mm", "z_mm")
_NORMAL = ("nx", "ny", "nz")
_APPROACH = ("ax", "ay", "az")
_ALONG_THE_NORMAL = math.cos(1.0 * DEGREE)
_NOMINAL = ("nominal_x_mm", "nominal_y_mm", "nominal_z_mm")
_ONE_FOR_ALL = ("tip", "part", "pass", "orientation", "spindle_deg", "feed_mm_min")
"""Columns that targets do not keep, and which must not change among them."""
_DIRECTIONS = ReadingOptions(
    columns={f"{kind}{axis}": "none" for kind in ("", "nominal_") for axis in "xyz"}
)
"""Directions have no unit of length, so that lengths are not looked at."""


def read_touches(source: Source, options: ReadingOptions | None = None) -> Touches:
    r"""Read touches from a table: CSV in any usual form, or Parquet.

    The table needs positions and normals; on a sphere whose diameter the options state, positions
    alone: the normals are then those of the fitted sphere. Its columns are found by their names,
    such as ``x_mm``, ``X [mm]``, ``nx``, ``I`` (see docs/formats.md), or as the options state them.
    Optional are approaches, a feed, the spindle's orientation, a label and nominal points. Other
    columns are ignored.

    Parameters
    ----------
    source : str, Path or SourceFile
        Text; Parquet where its ending is .parquet.
    options : ReadingOptions, optional
        Columns, unit, decimal sign, rows to leave out, diameter of the reference.

    Returns
    -------
    Touches

    Raises
    ------
    InputError
        A column is missing or its meaning is not clear; the unit is not known; a cell is not a
        finite number; a normal is zero, not of unit length or points into the part. The message
        contains the line.

    >>> len(read_touches(SourceFile("a.csv", b"x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")))
    1
    >>> german = SourceFile("a.csv", b"X;Y;Z;I;J;K\n0,5;0;3;0;0;1\n")
    >>> read_touches(german, ReadingOptions(units="inch")).positions.round(6).tolist()
    [[12.7, 0.0, 76.2]]
    """
    file = opened(source)
    options = options or ReadingOptions()
    on_sphere = options.reference_diameter is not None and not options.ring
    columns = columns_of_table(file, options)
    if on_sphere and not any(columns.table.has(name) for name in _NORMAL):
        found = touches_or_positions(file, columns, options)
        assert isinstance(found, FilePositions)
        assert options.reference_diameter is not None
        return with_sphere_normals(found, options.reference_diameter).touches
    columns.table.require(*_POSITION, *_NORMAL, what="touches")
    return touches_of_columns(file, columns, options)[0]


def read_table_of_touches(
    file: SourceFile, options: ReadingOptions
) -> FileReadings | FilePositions:
    """Read a table of touches, or of positions where it has no normals.

    Raises
    ------
    InputError
        As `read_touches`; positions that nothing gives normals to.
    """
    return touches_or_positions(file, columns_of_table(file, options), options)


def columns_of_table(file: SourceFile, options: ReadingOptions) -> TouchColumns:
    """The columns of a table, which pyarrow reads where all are numbers.

    Raises
    ------
    InputError
        As `read_touch_columns`.
    """
    return columns_of_numbers(file, options) or read_touch_columns(file, options)


def touches_or_positions(
    file: SourceFile, columns: TouchColumns, options: ReadingOptions
) -> FileReadings | FilePositions:
    """Touches of the columns of a table, or positions where it has no normals.

    Raises
    ------
    InputError
        As `read_table_of_touches`.
    """
    table = columns.table
    if table.has(*_POSITION) and not any(table.has(name) for name in _NORMAL):
        found = FilePositions(
            file.path,
            table.numbers(*_POSITION),
            table.lines,
            labels=_labels(table),
            feeds=_feeds(table),
            spindle=_spindle(table),
            understood=_understood(columns),
            nominal_points=_optional_vectors(table, _NOMINAL),
            approaches=_optional_vectors(table, _APPROACH),
            words=_words(table),
            warnings=columns.notes,
            frame=columns.frame,
        )
        round_one = options.reference_diameter is not None or options.ring
        given = options.plan or options.normal or options.normals_from
        if not (given or round_one or options.look_only):
            raise file.error(
                "the table has positions, but no normals (columns nx, ny, nz or I, J, K). Touches "
                "in a bore, on a boss or on a sphere: compensate them with the kind of feature, "
                "which gives the normals. Others: give the plan that was run, the nominal surface, "
                "one normal for all touches (0,0,1 for heights), or the columns of the normals",
                table.header_line or table.lines[0],
                inputs=("feature", "plan", "nominal", "normal", "columns"),
            )
        return found
    table.require(*_POSITION, *_NORMAL, what="touches")
    touches, warnings = touches_of_columns(file, columns, options)
    return FileReadings(touches, warnings=warnings, frame=columns.frame)


def touches_of_columns(
    file: SourceFile, columns: TouchColumns, options: ReadingOptions
) -> tuple[Touches, tuple[str, ...]]:
    """Make touches of a table with positions and normals.

    Parameters
    ----------
    file : SourceFile
        For messages.
    columns : TouchColumns
    options : ReadingOptions

    Returns
    -------
    Touches
    tuple of str
        Warnings about them.

    Raises
    ------
    InputError
        As `read_touches`.
    """
    table = columns.table
    if "pretravel_um" in table.unread:
        raise file.error(
            "the table has the column pretravel_um: these are surface points that were "
            "compensated, not touches. To measure them, keep the column u_um",
            table.header_line or None,
        )
    positions, nominal = table.numbers(*_POSITION), _optional_vectors(table, _NOMINAL)
    normals, warnings = stated_normals(file, columns)
    refuse_inward(
        file,
        columns,
        positions,
        normals,
        nominal,
        on_sphere=options.reference_diameter is not None and not options.ring,
    )
    with file.named_in_errors(table.lines):
        touches = Touches(
            positions=positions,
            normals=normals,
            approaches=_optional_vectors(table, _APPROACH),
            feeds=_feeds(table),
            spindle=_spindle(table),
            labels=_labels(table),
            **word_fields(_words(table)),
            nominal_points=nominal,
            source=file.name,
            lines=table.lines,
            reading="" if columns.own_form else _understood(columns),
        )
    return touches, (*columns.notes, *warnings)


def _understood(columns: TouchColumns) -> str:
    count = len(columns.table)
    return f"{count} touch{'es' if count > 1 else ''}; {columns.understood}"


def _feeds(table: CsvTable) -> FloatArray | None:
    return table.numbers("feed_mm_min")[:, 0] if table.has("feed_mm_min") else None


def _spindle(table: CsvTable) -> FloatArray | None:
    return table.numbers("spindle_deg")[:, 0] if table.has("spindle_deg") else None


def read_targets(
    source: Source,
    surface: Surface | Part | None = None,
    *,
    approach: str | None = "normal",
    options: ReadingOptions | None = None,
) -> Targets:
    r"""Read targets of touches from a CSV or Parquet file.

    A target is a point of the surface (``nominal_x_mm…``, or else ``x_mm, y_mm, z_mm``) with its
    outward normal ``nx, ny, nz``. The tip approaches along the line through the point, so that a
    file of touches is also a file of targets: its touches lie on the same lines. Normals alone
    are targets on a sphere, because a sphere has each normal at one point.

    Parameters
    ----------
    source : str, Path or SourceFile
    surface : Surface or Part, optional
        A sphere, for files without points.
    approach : str
        ``normal``: along -n; ``file``: the columns ax, ay, az; None: along -n, if such columns do
        not give oblique approaches.
    options : ReadingOptions, optional
        As for `read_touches`.

    Returns
    -------
    Targets

    Raises
    ------
    InputError
        As `read_touches`; an approach moves away from the surface; oblique approaches and None.

    >>> file = SourceFile("targets.csv", b"x_mm,y_mm,z_mm,nx,ny,nz\n0,0,5,0,0,1\n")
    >>> read_targets(file).points.tolist()
    [[0.0, 0.0, 5.0]]
    """
    if approach not in ("normal", "file", None):
        raise PretravelError(f"approach '{approach}' is not known; there are normal and file")
    file = opened(source)
    found = read_touch_columns(file, options)
    table = found.table
    table.require(*_NORMAL, what="targets")
    if approach == "file":
        table.require(*_APPROACH, what="targets with their own approaches")
    if approach is None and table.has(*_APPROACH):
        stated = _targets(file, table, surface, own_approaches=True)
        _refuse_oblique(stated, table)
    targets = _targets(file, table, surface, own_approaches=approach == "file")
    return replace(targets, unused=(*_unused(found), *found.notes))


def _unused(found: TouchColumns) -> tuple[str, ...]:
    """A sentence on what all targets have, and a program or a simulation does not keep."""
    table = found.table
    stated = [
        f"{table.titles.get(name, name)} {shortened(table.columns[name][0])}"
        for name in _ONE_FOR_ALL
        if name != "feed_mm_min" and any(table.columns.get(name, ()))
    ]
    stated += [found.frame] if found.frame else []
    if not stated:
        return ()
    return (f"the targets state {', '.join(stated)}, which is not used",)


def _refuse_oblique(targets: Targets, table: CsvTable) -> None:
    """Refuse approaches of a file that nobody chose, where they matter."""
    closing = -np.sum(np.asarray(targets.approaches) * targets.normals, axis=1)
    row = int(np.argmin(closing))
    if closing[row] < _ALONG_THE_NORMAL:
        off = math.degrees(math.acos(float(np.clip(closing[row], -1.0, 1.0))))
        raise InputError(
            f"the approach (columns ax, ay, az) is {off:.1f}° off the normal: choose whether the "
            "touches go as in the file (file) or against the normals (normal)",
            path=table.path,
            line=table.lines[row],
            inputs=("approach",),
        )


def read_plan(source: Source, options: ReadingOptions | None = None) -> Targets:
    r"""Read the targets of a program that was run: points, normals, and approaches if stated.

    Parameters
    ----------
    source : str, Path or SourceFile
    options : ReadingOptions, optional
        As for `read_touches`.

    Returns
    -------
    Targets

    Raises
    ------
    InputError
        As `read_targets`; the file has no points.

    >>> file = SourceFile("plan.csv", b"x_mm,y_mm,z_mm,nx,ny,nz,ax,ay,az\n0,0,5,0,0,1,0,0,-1\n")
    >>> read_plan(file).approaches.tolist()
    [[0.0, 0.0, -1.0]]
    """
    file = opened(source)
    table = read_touch_columns(file, options).table
    table.require(*_NORMAL, *(_NOMINAL if table.has(*_NOMINAL) else _POSITION), what="a plan")
    return _targets(file, table, None, own_approaches=table.has(*_APPROACH))


def read_normals(source: Source) -> FloatArray:
    r"""Read the columns nx, ny, nz of touches or targets, (n, 3).

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        As `read_touches`.

    >>> read_normals(SourceFile("normals.csv", b"nx,ny,nz\n0,0,1\n")).tolist()
    [[0.0, 0.0, 1.0]]
    """
    file = opened(source)
    table = read_touch_columns(file, _DIRECTIONS).table
    table.require(*_NORMAL, what="directions")
    with file.named_in_errors(table.lines):
        return checked_unit(table.numbers(*_NORMAL), "normals")


def write_touches(path: str | Path, touches: Touches) -> None:
    """Write touches as CSV, or as Parquet by the ending, with all the columns they have.

    Parameters
    ----------
    path : str or Path
    touches : Touches

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "touches.csv"
    >>> write_touches(path, Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]]))
    >>> read_touches(path).positions.tolist()
    [[0.0, 0.0, 3.0]]
    """
    write_table(path, touches_table(touches))


def touches_table(touches: Touches) -> dict[str, npt.ArrayLike]:
    """Return touches as the columns that `write_touches` writes, one row per touch.

    Returns
    -------
    mapping of str to (n,) values
        label, reference, tip, part, pass, orientation, x_mm, y_mm, z_mm, nx, ny, nz, ax, ay, az,
        feed_mm_min, spindle_deg, nominal_x_mm, nominal_y_mm, nominal_z_mm: those that the touches
        have.

    >>> list(touches_table(Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])))[:4]
    ['x_mm', 'y_mm', 'z_mm', 'nx']
    """
    columns: dict[str, npt.ArrayLike] = {}
    if touches.labels is not None:
        columns["label"] = list(touches.labels)
    columns |= {name: list(words) for name, words in touches.words.items()}
    vectors: list[tuple[tuple[str, str, str], FloatArray]] = [
        (_POSITION, touches.positions),
        (_NORMAL, touches.normals),
        (_APPROACH, touches.approach_directions),
    ]
    for names, values in vectors:
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    if touches.feeds is not None:
        columns["feed_mm_min"] = touches.feeds
    if touches.spindle is not None:
        columns["spindle_deg"] = touches.spindle / DEGREE
    if touches.nominal_points is not None:
        columns |= {name: touches.nominal_points[:, i] for i, name in enumerate(_NOMINAL)}
    return columns


def _targets(
    file: SourceFile, table: CsvTable, surface: Surface | Part | None, *, own_approaches: bool
) -> Targets:
    normals = table.numbers(*_NORMAL)
    _refuse_several(file, table)
    with file.named_in_errors(table.lines):
        return Targets(
            points=_points(table, normals, surface),
            normals=normals,
            approaches=table.numbers(*_APPROACH) if own_approaches else None,
            labels=_labels(table),
            feed=None if (feeds := _feeds(table)) is None else float(feeds[0]),
        )


def _refuse_several(file: SourceFile, table: CsvTable) -> None:
    """Refuse targets that differ in what one program, or one series of touches, has once."""
    for name in _ONE_FOR_ALL:
        cells = table.columns.get(name, ())
        other = [row for row, cell in enumerate(cells) if cell != cells[0]]
        if other:
            raise file.error(
                f"the column {table.titles.get(name, name)} changes (from '{cells[0]}' to "
                f"'{cells[other[0]]}'): targets are touched in one series, by one tip, at one "
                "feed, on one part. Split the table by this column, or leave it out "
                f"({name.partition('_')[0]}=none)",
                table.lines[other[0]],
                inputs=("plan_columns", "columns"),
            )


def _points(table: CsvTable, normals: FloatArray, surface: Surface | Part | None) -> FloatArray:
    """Points of targets: nominal points, or else positions, or else those of a sphere."""
    if table.has(*_NOMINAL):
        return table.numbers(*_NOMINAL)
    if surface is not None and not table.has(*_POSITION):
        from pretravel.surface import Sphere

        if isinstance(surface, Sphere):
            return np.asarray(surface.center) + surface.radius * normals
    table.require(*_POSITION, what="targets")
    return table.numbers(*_POSITION)


def _labels(table: CsvTable) -> tuple[str, ...] | None:
    return table.columns["label"] if table.has("label") else None


def _words(table: CsvTable) -> dict[str, tuple[str, ...]]:
    return {name: table.columns[name] for name in WORD_COLUMNS if table.has(name)}


def _optional_vectors(table: CsvTable, names: tuple[str, ...]) -> FloatArray | None:
    stated = [name for name in names if table.has(name)]
    if not stated:
        return None
    table.require(*names, what=f"touches with {stated[0]}")
    return table.numbers(*names)
