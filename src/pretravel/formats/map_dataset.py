"""Maps as labelled datasets: everything that is needed to use a map, for NetCDF files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.identification.kind_registry import restored_basis
from pretravel.maps.basis import StoredArray, StoredBasis
from pretravel.maps.grid import map_grid
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Correlation, Covariance

if TYPE_CHECKING:
    import xarray as xr

MAP_FORMAT = "pretravel map, version 1"


def map_dataset(
    pretravel_map: PretravelMap, table: Mapping[str, npt.ArrayLike] | None = None
) -> xr.Dataset:
    """A map as a labelled dataset: all that is needed to use it, and a grid to look at.

    Parameters
    ----------
    pretravel_map : PretravelMap
    table : mapping of str to (n,) values, optional
        A prediction's columns, kept beside the map along ``direction``.

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
        "format": MAP_FORMAT,
        "kind": pretravel_map.kind,
        "covariance_form": pretravel_map.covariance.correlation.value,
        "tip_radius_mm": pretravel_map.tip_radius,
        "u_tip_radius_mm": pretravel_map.u_tip_radius,
        "repeatability_mm": pretravel_map.repeatability,
        "repeatability_dof": pretravel_map.repeatability_dof,
        "fixed_scatter_mm": pretravel_map.fixed_scatter,
        "provenance": json.dumps(pretravel_map.provenance.as_dict()),
        "checksum": _checksum(pretravel_map),
        **pretravel_map.basis.attributes(),
    }
    if pretravel_map.feed is not None:
        attributes["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        attributes["delay_s"] = pretravel_map.delay
        attributes["u_delay_s"] = pretravel_map.u_delay
    return attributes


def _checksum(pretravel_map: PretravelMap) -> str:
    """Of the numbers that make the map, so that damage on disk is detected."""
    numbers: list[npt.ArrayLike] = [
        pretravel_map.coefficients,
        pretravel_map.covariance.values,
        pretravel_map.support.nodes,
        pretravel_map.rotation,
        [pretravel_map.tip_radius, pretravel_map.u_tip_radius],
        [pretravel_map.repeatability, pretravel_map.repeatability_dof],
    ]
    if pretravel_map.fixed_scatter:
        numbers.append([pretravel_map.fixed_scatter])
    if pretravel_map.delay is not None:
        numbers.append([pretravel_map.delay, pretravel_map.u_delay])
    if pretravel_map.delay_effect is not None:
        numbers.append(pretravel_map.delay_effect)
    numbers += pretravel_map.basis.checksummed()
    digest = hashlib.sha256()
    for values in numbers:
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


def map_from_dataset(dataset: xr.Dataset) -> PretravelMap:
    """The map that `map_dataset` wrote.

    Raises
    ------
    PretravelError
        Not such a dataset.
    """
    attributes = dataset.attrs
    if attributes.get("format") != MAP_FORMAT:
        raise PretravelError(
            "this is not a pretravel map (no matching 'format' attribute); "
            "pretravel qualify and pretravel predict write them"
        )
    support = DirectionSupport(np.asarray(dataset["support"].values))
    feed, delay = attributes.get("feed_mm_min"), attributes.get("delay_s")
    effect = dataset["delay_effect"].values if "delay_effect" in dataset else None
    found = PretravelMap(
        basis=restored_basis(str(attributes["kind"]), _stored_basis(dataset, support)),
        coefficients=np.asarray(dataset["coefficients"].values),
        covariance=_covariance(dataset),
        support=support,
        tip_radius=float(attributes["tip_radius_mm"]),
        u_tip_radius=float(attributes["u_tip_radius_mm"]),
        repeatability=float(attributes["repeatability_mm"]),
        repeatability_dof=float(attributes["repeatability_dof"]),
        fixed_scatter=float(attributes.get("fixed_scatter_mm", 0.0)),
        rotation=np.asarray(dataset["rotation"].values),
        feed=None if feed is None else float(feed),
        delay=None if delay is None else float(delay),
        u_delay=float(attributes.get("u_delay_s", 0.0)),
        delay_effect=None if effect is None else np.asarray(effect),
        provenance=Provenance.from_dict(json.loads(attributes["provenance"])),
    )
    if _checksum(found) != attributes.get("checksum"):
        raise PretravelError(
            "this map was damaged or edited after it was written (its checksum does not fit); "
            "qualify or predict again"
        )
    return found


def _stored_basis(dataset: xr.Dataset, support: DirectionSupport) -> StoredBasis:
    arrays = {
        str(name): StoredArray(tuple(map(str, values.dims)), values.values)
        for name, values in dataset.data_vars.items()
    } | {
        str(name): StoredArray(tuple(map(str, values.dims)), values.values)
        for name, values in dataset.coords.items()
    }
    return StoredBasis(support, float(dataset.attrs["tip_radius_mm"]), arrays, dict(dataset.attrs))


def _covariance(dataset: xr.Dataset) -> Covariance:
    """Files of earlier versions do not name the form: variances alone were fully shared."""
    values: FloatArray = np.asarray(dataset["covariance"].values)
    by_shape = Correlation.FULL if values.ndim == 2 else Correlation.FULLY_SHARED
    return Covariance(Correlation(dataset.attrs.get("covariance_form", by_shape.value)), values)
