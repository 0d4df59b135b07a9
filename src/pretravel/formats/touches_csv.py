"""Touches and targets as CSV: the columns of the contract."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.directions import UNIT_TOLERANCE
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable
from pretravel.formats.tables import read_table, write_table
from pretravel.probing.targets import Targets
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches, glancing_rows

_POSITION = ("x_mm", "y_mm", "z_mm")
_NORMAL = ("nx", "ny", "nz")
_APPROACH = ("ax", "ay", "az")
_NOMINAL = ("nominal_x_mm", "nominal_y_mm", "nominal_z_mm")


def read_touches(path: str | Path) -> Touches:
    r"""Touches from a CSV file.

    Columns ``x_mm, y_mm, z_mm, nx, ny, nz``; optional ``ax, ay, az``,
    ``feed_mm_min``, ``label``, ``nominal_x_mm, nominal_y_mm, nominal_z_mm``. Other
    columns are left alone.

    Parameters
    ----------
    path : str or Path
        CSV, or Parquet by its ending.

    Returns
    -------
    Touches

    Raises
    ------
    InputError
        Missing columns, cells that are no finite numbers, normals that are zero or
        not of unit length: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "touches.csv"
    >>> _ = file.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,3,0,0,1\n")
    >>> len(read_touches(file))
    1
    """
    table = read_table(path)
    table.require(*_POSITION, *_NORMAL, what="touches")
    approaches = _optional_vectors(table, _APPROACH, "approach", unit=True)
    try:
        return Touches(
            positions=table.numbers(*_POSITION),
            normals=_unit_vectors(table, _NORMAL, "normal"),
            approaches=approaches,
            feeds=table.numbers("feed_mm_min")[:, 0] if table.has("feed_mm_min") else None,
            labels=table.columns["label"] if table.has("label") else None,
            nominal_points=_optional_vectors(table, _NOMINAL, "nominal point", unit=False),
            source=Path(path).name,
            lines=table.lines,
        )
    except InputError:
        raise
    except PretravelError as error:
        raise InputError(str(error), path=path) from None


def read_targets(path: str | Path, surface: Surface | Part, *, approach: str = "normal") -> Targets:
    """Targets of a simulation from a CSV file.

    A target is a point of the surface (``nominal_x_mm…``, or else ``x_mm, y_mm, z_mm``)
    with its outward normal ``nx, ny, nz``. The tip comes along the approach through
    the place above the point, so a file of touches serves as targets too: it leads
    along the same lines. Without points the normals must be those of a surface that
    has every normal once: of a sphere.

    Parameters
    ----------
    path : str or Path
    surface : Surface or Part
        Gives points where the file has none.
    approach : str
        ``normal``: along -n; ``file``: the columns ax, ay, az.

    Returns
    -------
    Targets

    Raises
    ------
    InputError
        As `read_touches`.
    """
    table = read_table(path)
    table.require(*_NORMAL, what="targets")
    normals = _unit_vectors(table, _NORMAL, "normal")
    approaches = None
    if approach == "file":
        table.require(*_APPROACH, what="targets with --approach file")
        approaches = _unit_vectors(table, _APPROACH, "approach")
    elif approach != "normal":
        raise PretravelError(f"approach '{approach}' is not known; there are normal and file")
    if table.has(*_NOMINAL):
        points = table.numbers(*_NOMINAL)
    elif table.has(*_POSITION):
        points = table.numbers(*_POSITION)
    elif isinstance(surface, Sphere):
        points = np.asarray(surface.center) + surface.radius * normals
    else:
        table.require(*_POSITION, what="targets")
        raise AssertionError("require() raises")
    glancing = glancing_rows(-normals if approaches is None else approaches, normals)
    if len(glancing):
        raise InputError(
            "the approach moves away from the surface or along it; it must point against the "
            "normal",
            path=path,
            line=table.lines[int(glancing[0])],
        )
    return Targets(
        points=points,
        normals=normals,
        approaches=approaches,
        labels=table.columns["label"] if table.has("label") else None,
    )


def read_normals(path: str | Path) -> FloatArray:
    """The columns nx, ny, nz of touches or targets, (n, 3).

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        As `read_touches`.
    """
    table = read_table(path)
    table.require(*_NORMAL, what="directions")
    return _unit_vectors(table, _NORMAL, "normal")


def read_plan(path: str | Path) -> Targets:
    """Targets that were run, all told by the file: points, normals, approaches where it has them.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Targets

    Raises
    ------
    InputError
        As `read_targets`; a file without points.
    """
    table = read_table(path)
    table.require(*(_NOMINAL if table.has(*_NOMINAL) else _POSITION), what="a plan")
    # A plane is not asked for points: they are there.
    return read_targets(
        path, Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        approach="file" if table.has(*_APPROACH) else "normal",
    )  # fmt: skip


def write_touches(path: str | Path, touches: Touches) -> None:
    """Write touches as CSV or Parquet, by the ending, with all the columns they have.

    Parameters
    ----------
    path : str or Path
    touches : Touches
    """
    columns: dict[str, npt.ArrayLike] = {}
    if touches.labels is not None:
        columns["label"] = list(touches.labels)
    vectors: list[tuple[tuple[str, str, str], FloatArray]] = [
        (_POSITION, touches.positions),
        (_NORMAL, touches.normals),
        (_APPROACH, touches.approach_directions),
    ]
    for names, values in vectors:
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    if touches.feeds is not None:
        columns["feed_mm_min"] = touches.feeds
    if touches.nominal_points is not None:
        columns |= {name: touches.nominal_points[:, i] for i, name in enumerate(_NOMINAL)}
    write_table(path, columns)


def _unit_vectors(table: CsvTable, names: tuple[str, ...], what: str) -> FloatArray:
    vectors = table.numbers(*names)
    length = np.linalg.norm(vectors, axis=1)
    bad = np.flatnonzero(np.abs(length - 1.0) > UNIT_TOLERANCE)
    if len(bad):
        row = int(bad[0])
        zero = length[row] == 0.0
        raise InputError(
            f"the {what} ({', '.join(table.columns[n][row] for n in names)}) "
            + ("is zero" if zero else f"has length {length[row]:.6g}")
            + f"; {', '.join(names)} must be a unit vector"
            + (f" ({len(bad)} rows are not)" if len(bad) > 1 else ""),
            path=table.path,
            line=table.lines[row],
        )
    return vectors


def _optional_vectors(
    table: CsvTable, names: tuple[str, ...], what: str, *, unit: bool
) -> FloatArray | None:
    there = [name for name in names if table.has(name)]
    if not there:
        return None
    table.require(*names, what=f"touches with {there[0]}")
    return _unit_vectors(table, names, what) if unit else table.numbers(*names)
