"""Compensated points: as columns, as a labelled dataset, in the format of the file's ending."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, TIP_RADIUS, FloatArray, PretravelError, checked, needed
from pretravel.files.file_format import PointsOrigin
from pretravel.files.many_numbers import listed_rows
from pretravel.measurement import Points

if TYPE_CHECKING:
    import xarray as xr

UNCOMPENSATED = tuple(f"uncompensated_{axis}_mm" for axis in "xyz")
"""Columns of `Points.uncompensated`."""
NO_CAUSE = "nothing"
"""The cause in the one column, of zeros, of points that have no errors in common."""
MAP_USED = "map"
"""Column of `Points.map_used`, the same in all rows."""
FILES = "files"
"""Column of `Points.files`, the same in all rows."""
SHARED = "shared_"
"""The start of the names of columns of `Points.shared`."""

_NUMBERED = re.compile(r" \d+$")


def points_table(points: Points) -> dict[str, npt.ArrayLike]:
    """Return compensated points as columns, one row per touch.

    Returns
    -------
    mapping of str to (n,) values
        label, face where it is known, x_mm, y_mm, z_mm, nx, ny, nz, pretravel_um, u_um;
        deviation_um where there is a nominal surface; uncompensated_x_mm,…; a column
        shared_…_um for each cause of `Points.shared`, whose cells are lists where a cause has
        several rows: ``[0.05 -0.03]``; map, where it is known; files, where they were several.
    """
    columns: dict[str, npt.ArrayLike] = {"label": list(points.labels)}
    if points.face is not None:
        columns["face"] = points.face
    columns |= {f"{axis}_mm": points.positions[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"n{axis}": points.normals[:, i] for i, axis in enumerate("xyz")}
    columns["pretravel_um"] = points.pretravel / MICROMETRE
    columns["u_um"] = points.standard_uncertainty / MICROMETRE
    if points.deviation is not None:
        columns["deviation_um"] = points.deviation / MICROMETRE
    if points.uncompensated is not None:
        columns |= dict(zip(UNCOMPENSATED, points.uncompensated.T, strict=True))
    if points.shared is not None:
        columns |= _shared_columns(points.shared)
        if not points.shared:
            columns[shared_column(NO_CAUSE)] = np.zeros(len(points))
    said = {MAP_USED: points.map_used, FILES: points.files}
    columns |= {name: [word] * len(points) for name, word in said.items() if word}
    return columns


def _shared_columns(shared: Mapping[str, FloatArray]) -> dict[str, npt.ArrayLike]:
    """Errors in common, [µm]: a column for a cause, however many rows it has."""
    groups: dict[str, list[str]] = {}
    for name in shared:
        groups.setdefault(_NUMBERED.sub("", name), []).append(name)
    columns: dict[str, npt.ArrayLike] = {}
    for cause, names in groups.items():
        if names != [f"{cause} {k}" for k in range(1, len(names) + 1)] or len(names) == 1:
            columns |= {shared_column(name): shared[name] / MICROMETRE for name in names}
            continue
        columns[shared_column(cause)] = listed_rows([shared[name] / MICROMETRE for name in names])
    return columns


def listed_numbers(cells: Sequence[str]) -> FloatArray | None:
    """The rows of a column of lists, (k, n); None where they are no lists of one length.

    >>> listed_numbers(["[1 -2]", "[3 4]"]).tolist()
    [[1.0, 3.0], [-2.0, 4.0]]
    """
    if not all(cell.startswith("[") and cell.endswith("]") for cell in cells):
        return None
    rows = [cell[1:-1].split() for cell in cells]
    if len({len(row) for row in rows}) != 1:
        return None
    try:
        found = np.array(rows, dtype=np.float64).T
    except ValueError:
        return None
    return found if np.isfinite(found).all() else None


def shared_column(cause: str) -> str:
    """The column of the errors that points share by a cause.

    >>> shared_column("tip radius")
    'shared_tip_radius_um'
    """
    return f"{SHARED}{cause.replace(' ', '_')}_um"


def points_dataset(points: Points) -> xr.Dataset:
    """Return compensated points as a labelled dataset, with the 3 x 3 covariance of each point.

    Returns
    -------
    xarray.Dataset
        Dimensions point, axis, other_axis; units in the attributes.
    """
    needed("xarray", "tables")
    import xarray as xr

    data = {
        "position": (("point", "axis"), points.positions, {"units": "mm"}),
        "normal": (("point", "axis"), points.normals, {"units": "1"}),
        "pretravel": ("point", points.pretravel, {"units": "mm"}),
        "covariance": (("point", "axis", "other_axis"), points.covariance, {"units": "mm2"}),
        "standard_uncertainty": ("point", points.standard_uncertainty, {"units": "mm"}),
    }
    if points.deviation is not None:
        data["deviation"] = ("point", points.deviation, {"units": "mm"})
    if points.face is not None:
        data["face"] = ("point", points.face.astype(np.float64), {"units": "1"})
    if points.uncompensated is not None:
        data["uncompensated"] = (("point", "axis"), points.uncompensated, {"units": "mm"})
    coords = {}
    if points.shared is not None:
        factors = np.array(list(points.shared.values())).reshape(len(points.shared), len(points))
        data["shared"] = (("cause", "point"), factors, {"units": "mm"})
        coords["cause"] = np.array(list(points.shared), dtype=str)
    return xr.Dataset(
        data,
        coords=coords
        | {
            "label": ("point", np.array(points.labels, dtype=str)),
            "axis": list("xyz"),
            "other_axis": list("xyz"),
        },
        attrs={"title": "surface points, compensated by pretravel"}
        | ({MAP_USED: points.map_used} if points.map_used else {})
        | ({FILES: points.files} if points.files else {}),
    )


def write_points(
    path: str | Path,
    points: Points,
    note: str = "",
    *,
    nominal_points: FloatArray | None = None,
    tip_radius: float | None = None,
) -> None:
    """Write points in the format of the path's ending, for example .csv, .nc or .qif.

    Parameters
    ----------
    path : str or Path
    points : Points
    note : str
        How the points were made, for the attributes of a NetCDF file.
    nominal_points : (n, 3) float, optional
        The targets of the touches on the nominal surface, for Fusion results. [mm]
    tip_radius : float, optional
        Of the map, for Fusion results. [mm]

    Raises
    ------
    PretravelError
        No format of points has this ending; the format needs what was not given.
    """
    if tip_radius is not None:
        checked(tip_radius, "the tip's radius", TIP_RADIUS, inputs=("tip_radius",))
    from pretravel.files.format_registry import FORMATS

    ending = Path(path).suffix.lower()
    for known in FORMATS.values():
        if known.write_points is not None and ending in known.endings:
            known.write_points(Path(path), points, PointsOrigin(note, nominal_points, tip_radius))
            return
    raise PretravelError(
        f"points cannot be written to '{path}': the ending must be {', '.join(point_endings())}"
    )


def point_endings(sought: str = "") -> tuple[str, ...]:
    """Return the endings of the files to which points can be written.

    Parameters
    ----------
    sought : str
        Only those up to this one, where points can be written to it: further formats need not be
        imported then.

    >>> point_endings(".parquet")
    ('.csv', '.parquet')
    """
    from pretravel.files.format_registry import FORMATS

    found: list[str] = []
    for known in FORMATS.values():
        found += known.endings if known.write_points else ()
        if sought in found:
            break
    return tuple(found)
