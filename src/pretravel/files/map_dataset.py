"""Maps as labelled datasets: everything that is needed to use a map, for NetCDF files."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.files.netcdf import StoredDataset, content_digest
from pretravel.maps.basis import StoredArray, StoredBasis
from pretravel.maps.grid import map_grid
from pretravel.maps.kinds import restored_basis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Correlation, Covariance

if TYPE_CHECKING:
    import xarray as xr

MAP_FORMAT = "pretravel map, version 2"
_VERSION_1 = "pretravel map, version 1"
_DIGEST = "content_sha256"
"""Attribute with the digest of all that the file contains."""


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
    found = xr.Dataset(
        _variables(pretravel_map, grid_values) | _predicted_variables(table or {}),
        coords={
            "polar": ("polar", grid_values["polar_deg"], {"units": "degree"}),
            "azimuth": ("azimuth", grid_values["azimuth_deg"], {"units": "degree"}),
        },
        attrs=_attributes(pretravel_map),
    )
    for variable in found.variables.values():
        # xarray would add marks of gaps when it writes a file, and the digest would not fit.
        variable.encoding["_FillValue"] = None
    return found.assign_attrs({_DIGEST: content_digest(found, without=_DIGEST)})


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
        **pretravel_map.basis.attributes(),
    }
    if pretravel_map.feed is not None:
        attributes["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        attributes["delay_s"] = pretravel_map.delay
        attributes["u_delay_s"] = pretravel_map.u_delay
    return attributes


def map_from_dataset(dataset: StoredDataset) -> PretravelMap:
    """The map that `map_dataset` wrote.

    Raises
    ------
    PretravelError
        Not such a dataset; one that was changed after it was written.
    """
    stated = dataset.attrs.get("format")
    if stated not in (MAP_FORMAT, _VERSION_1):
        raise PretravelError(
            "this is not a pretravel map (no matching 'format' attribute); "
            "pretravel qualify and pretravel predict write them"
        )
    if stated == MAP_FORMAT and content_digest(dataset, without=_DIGEST) != dataset.attrs.get(
        _DIGEST
    ):
        raise PretravelError(_DAMAGED)
    found = _restored(dataset)
    if stated == _VERSION_1 and _checksum_of_version_1(found) != dataset.attrs.get("checksum"):
        raise PretravelError(_DAMAGED)
    return found


def covered_in_part(dataset: StoredDataset) -> bool:
    """Whether the checksum covers a part of the content alone, as in maps of version 1."""
    return dataset.attrs.get("format") == _VERSION_1


_DAMAGED = (
    "this map was damaged or edited after it was written (its checksum does not fit); "
    "qualify or predict again"
)


def _restored(dataset: StoredDataset) -> PretravelMap:
    attributes = dataset.attrs
    support = DirectionSupport(_array(dataset, "support", 2))
    has_effect = "delay_effect" in dataset.variables
    return PretravelMap(
        basis=restored_basis(str(attributes["kind"]), _stored_basis(dataset, support)),
        coefficients=_array(dataset, "coefficients", 1),
        covariance=_covariance(dataset),
        support=support,
        tip_radius=_number(attributes, "tip_radius_mm"),
        u_tip_radius=_number(attributes, "u_tip_radius_mm"),
        repeatability=_number(attributes, "repeatability_mm"),
        repeatability_dof=_number(attributes, "repeatability_dof", infinite=True),
        fixed_scatter=_number(attributes, "fixed_scatter_mm", 0.0),
        rotation=_array(dataset, "rotation", 2),
        feed=_number(attributes, "feed_mm_min") if "feed_mm_min" in attributes else None,
        delay=_number(attributes, "delay_s") if "delay_s" in attributes else None,
        u_delay=_number(attributes, "u_delay_s", 0.0),
        delay_effect=_array(dataset, "delay_effect", 1) if has_effect else None,
        provenance=_provenance(attributes),
    )


def _number(
    attributes: Mapping[str, Any],
    name: str,
    usual: float | None = None,
    *,
    infinite: bool = False,
) -> float:
    """One number of the attributes, not negative."""
    value = attributes.get(name, usual)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PretravelError(f"the attribute {name} must be one number, not {value!r:.60}")
    if not 0.0 <= value < math.inf and not (infinite and value == math.inf):
        raise PretravelError(f"the attribute {name} is {value:g}; it must be finite and positive")
    return float(value)


def _array(dataset: StoredDataset, name: str, axes: int) -> FloatArray:
    if name not in dataset.variables:
        raise PretravelError(f"the array {name} is missing")
    values = dataset.variables[name].values
    if values.dtype.kind not in "fiu" or values.ndim != axes:
        raise PretravelError(
            f"the array {name} must have {axes} axes and contain numbers; "
            f"it has the shape {values.shape} and the type {values.dtype}"
        )
    return np.asarray(values, dtype=np.float64)


def _provenance(attributes: Mapping[str, Any]) -> Provenance:
    stated = attributes.get("provenance")
    if not isinstance(stated, str):
        raise PretravelError("the attribute provenance must be a text (JSON)")
    try:
        values = json.loads(stated)
        found = Provenance.from_dict(values)
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise PretravelError(
            f"the attribute provenance does not state how a map is made: {error}"
        ) from None
    for entry in fields(Provenance):
        usual, value = getattr(Provenance(), entry.name), getattr(found, entry.name)
        if entry.name != "setup" and not isinstance(value, type(usual)):
            raise PretravelError(
                f"the attribute provenance: {entry.name} must be of the type "
                f"{type(usual).__name__}, not {value!r:.60}"
            )
    return found


def _checksum_of_version_1(pretravel_map: PretravelMap) -> str:
    """Of the numbers that make the map, except the degrees and orders of a harmonic map."""
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


def _stored_basis(dataset: StoredDataset, support: DirectionSupport) -> StoredBasis:
    arrays = {
        name: StoredArray(variable.dims, variable.values)
        for name, variable in dataset.variables.items()
    }
    tip_radius = _number(dataset.attrs, "tip_radius_mm")
    return StoredBasis(support, tip_radius, arrays, dict(dataset.attrs))


def _covariance(dataset: StoredDataset) -> Covariance:
    """Files of earlier versions do not name the form: variances alone were fully shared."""
    axes = 1 if dataset.variables["covariance"].values.ndim == 1 else 2
    values = _array(dataset, "covariance", axes)
    by_shape = Correlation.FULL if values.ndim == 2 else Correlation.FULLY_SHARED
    form = Correlation(dataset.attrs.get("covariance_form", by_shape.value))
    return Covariance.full(values) if form is Correlation.FULL else Covariance(form, values)
