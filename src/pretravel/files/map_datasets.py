"""Maps as labelled datasets of xarray, to look at and to plot."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.maps import PretravelMap, map_grid

if TYPE_CHECKING:
    import xarray as xr


def map_dataset(
    pretravel_map: PretravelMap, table: Mapping[str, npt.ArrayLike] | None = None
) -> xr.Dataset:
    """A map as a labelled dataset: all that it contains, and a grid to look at.

    Parameters
    ----------
    pretravel_map : PretravelMap
    table : mapping of str to (n,) values, optional
        A prediction's columns, kept in addition to the map along ``direction``.

    Returns
    -------
    xarray.Dataset
    """
    import xarray as xr

    grid_values = map_grid(pretravel_map)
    return xr.Dataset(
        _variables(pretravel_map, grid_values) | _predicted_variables(table or {}),
        coords={
            "polar": ("polar", grid_values["polar_deg"], {"units": "degree"}),
            "azimuth": ("azimuth", grid_values["azimuth_deg"], {"units": "degree"}),
        },
        attrs=_attributes(pretravel_map),
    )


def _variables(pretravel_map: PretravelMap, grid_values: Mapping[str, Any]) -> dict[str, Any]:
    covariance = pretravel_map.covariance.values
    covariance_axes = ("coefficient", "other_coefficient")[: covariance.ndim]
    data: dict[str, Any] = {
        "coefficients": ("coefficient", pretravel_map.coefficients, {"units": "mm"}),
        "covariance": (covariance_axes, covariance, {"units": "mm2"}),
        "support": (("node", "axis"), pretravel_map.support.nodes, {"units": "1"}),
        "rotation": (("machine_axis", "axis"), pretravel_map.rotation, {"units": "1"}),
        "pretravel": (
            ("polar", "azimuth"),
            grid_values["pretravel_um"],
            {"units": "um", "long_name": "pretravel on a grid, to look at"},
        ),
        "standard_uncertainty": (
            ("polar", "azimuth"),
            grid_values["u_um"],
            {"units": "um", "long_name": "of the map alone, without repeatability"},
        ),
    }
    if pretravel_map.delay_effect is not None:
        data["delay_effect"] = ("coefficient", pretravel_map.delay_effect, {"units": "mm"})
    if (machine := pretravel_map.machine) is not None:
        data["machine_terms"] = ("machine_term", machine.values, {"units": "1, rad, mm"})
        data["machine_root"] = (("machine_term", "machine_error"), machine.root, {})
    for name, array in pretravel_map.basis.arrays().items():
        data[name] = (array.axes, array.values, {"units": array.unit})
    return data


def _predicted_variables(table: Mapping[str, npt.ArrayLike]) -> dict[str, Any]:
    data = {}
    for name, values in table.items():
        unit = name.rsplit("_", 1)[-1] if "_" in name else ""
        data[f"predicted_{name}"] = ("direction", np.asarray(values), {"units": unit})
    return data


def _attributes(pretravel_map: PretravelMap) -> dict[str, Any]:
    attributes: dict[str, Any] = {
        "kind": pretravel_map.kind,
        "covariance_form": pretravel_map.covariance.correlation.value,
        "tip_radius_mm": pretravel_map.tip_radius,
        "u_tip_radius_mm": pretravel_map.u_tip_radius,
        "repeatability_mm": pretravel_map.repeatability,
        "repeatability_dof": pretravel_map.repeatability_dof,
        "fixed_scatter_mm": pretravel_map.fixed_scatter,
        "provenance": json.dumps(pretravel_map.provenance.as_dict()),
        **pretravel_map.basis.attributes(),
    }
    if pretravel_map.feed is not None:
        attributes["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        attributes["delay_s"] = pretravel_map.delay
        attributes["u_delay_s"] = pretravel_map.u_delay
    return attributes
