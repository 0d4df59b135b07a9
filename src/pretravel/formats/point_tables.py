"""Compensated points as columns, and as a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.compensation.points import Points
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    import xarray as xr


def points_table(points: Points) -> dict[str, npt.ArrayLike]:
    """Return compensated points as columns, one row per touch.

    Returns
    -------
    mapping of str to (n,) values
        label, x_mm, y_mm, z_mm, nx, ny, nz, pretravel_um, u_um; deviation_um where there is a
        nominal surface.
    """
    columns: dict[str, npt.ArrayLike] = {"label": list(points.labels)}
    columns |= {f"{axis}_mm": points.positions[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"n{axis}": points.normals[:, i] for i, axis in enumerate("xyz")}
    columns["pretravel_um"] = points.pretravel / MICROMETRE
    columns["u_um"] = points.standard_uncertainty / MICROMETRE
    if points.deviation is not None:
        columns["deviation_um"] = points.deviation / MICROMETRE
    return columns


def points_dataset(points: Points) -> xr.Dataset:
    """Return compensated points as a labelled dataset, with the 3 x 3 covariance of each point.

    Returns
    -------
    xarray.Dataset
        Dimensions point, axis, other_axis; units in the attributes.
    """
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
    return xr.Dataset(
        data,
        coords={
            "label": ("point", np.array(points.labels, dtype=str)),
            "axis": list("xyz"),
            "other_axis": list("xyz"),
        },
        attrs={"title": "surface points, compensated by pretravel"},
    )
