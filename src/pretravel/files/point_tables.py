"""Compensated points as columns, and as a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, needed
from pretravel.measurement import Points

if TYPE_CHECKING:
    import xarray as xr

UNCOMPENSATED = tuple(f"uncompensated_{axis}_mm" for axis in "xyz")
"""Columns of `Points.uncompensated`."""
NO_CAUSE = "nothing"
"""The cause in the one column, of zeros, of points that have no errors in common."""
SHARED = "shared_"
"""The start of the names of columns of `Points.shared`."""


def points_table(points: Points) -> dict[str, npt.ArrayLike]:
    """Return compensated points as columns, one row per touch.

    Returns
    -------
    mapping of str to (n,) values
        label, face where it is known, x_mm, y_mm, z_mm, nx, ny, nz, pretravel_um, u_um;
        deviation_um where there is a nominal surface; uncompensated_x_mm,…; a column
        shared_…_um for each of `Points.shared`.
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
        columns |= {shared_column(k): v / MICROMETRE for k, v in points.shared.items()}
        if not points.shared:
            columns[shared_column(NO_CAUSE)] = np.zeros(len(points))
    return columns


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
        attrs={"title": "surface points, compensated by pretravel"},
    )
