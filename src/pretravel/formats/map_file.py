"""PretravelMaps on disk: NetCDF whole, CSV and JSON as tables."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, fibonacci_cap, from_angles, grid, polar_angle
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.formats.netcdf import write_dataset
from pretravel.frames import probe_rotation
from pretravel.maps.bases import (
    HarmonicBasis,
    MapBasis,
    MeanBasis,
    SectorBasis,
    TabulatedBasis,
    WozniakBasis,
)
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.probe.catalogue import load_probe
from pretravel.trigger.compliance.base import compliance_model
from pretravel.trigger.predict import Trigger, predict, predicted_map
from pretravel.trigger.response import (
    ProbeResponse,
    ResponseBasis,
    probe_response,
    response_map,
)
from pretravel.trigger.six_seats import PARAMETERS, SixSeatBasis
from pretravel.units import DEGREE, MICROMETRE
from pretravel.whole_file import whole_file

if TYPE_CHECKING:
    import xarray as xr

FORMAT = "pretravel map, version 1"
_LARGEST = 0.5  # of a table's pretravel, mm


def trigger_table(trigger: Trigger) -> dict[str, npt.ArrayLike]:
    """A prediction as the columns of the contract, one row per direction.

    Returns
    -------
    mapping of str to (n,) values
        polar_deg, azimuth_deg, trigger_force_N, sensing_distance_um, pretravel_um,
        seat, and one share_*_um for each compliance; shares add up to pretravel.
    """
    # Angles back from unit vectors, rounded to what double precision keeps of them.
    columns: dict[str, npt.ArrayLike] = {
        "polar_deg": np.round(polar_angle(trigger.directions) / DEGREE, 10),
        "azimuth_deg": np.mod(np.round(azimuth_angle(trigger.directions) / DEGREE, 10), 360.0),
        "trigger_force_N": trigger.force,
        "sensing_distance_um": trigger.sensing_distance / MICROMETRE,
        "pretravel_um": trigger.pretravel / MICROMETRE,
        "seat": trigger.seat_names,
    }
    return columns | {
        f"share_{name}_um": share / MICROMETRE for name, share in trigger.shares.items()
    }


def map_grid(
    pretravel_map: PretravelMap, polar_step: float = 5.0, azimuth_step: float = 10.0
) -> dict[str, Any]:
    """A map on a regular grid of angles, nan where it is not supported.

    Parameters
    ----------
    pretravel_map : PretravelMap
    polar_step, azimuth_step : float
        [deg]

    Returns
    -------
    mapping
        polar_deg (p,), azimuth_deg (a,), pretravel_um (p, a), u_um (p, a); angles in
        the probe frame.
    """
    largest = math.degrees(float(polar_angle(pretravel_map.support.nodes).max()))
    largest = min(largest, 165.0)
    polar = np.arange(0.0, largest + 1e-9, polar_step)
    if largest - polar[-1] > 0.01:
        polar = np.append(polar, largest)
    azimuth = np.arange(0.0, 360.0, azimuth_step)
    directions = grid(polar * DEGREE, azimuth * DEGREE)
    normals = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
    u = pretravel_map.standard_uncertainty(normals) / MICROMETRE
    outside = ~pretravel_map.support.supports(directions)
    value[outside] = np.nan
    u[outside] = np.nan
    shape = (len(polar), len(azimuth))
    return {
        "polar_deg": polar,
        "azimuth_deg": azimuth,
        "pretravel_um": value.reshape(shape),
        "u_um": u.reshape(shape),
    }


def effective_radius_table(
    pretravel_map: PretravelMap, travel: float = 0.0
) -> dict[str, npt.ArrayLike]:
    """A map as effective radii over polar angle and azimuth, where it is supported.

    Parameters
    ----------
    pretravel_map : PretravelMap
    travel : float
        Of the machine in the signal's delay, where the map is one of the probe at rest. [mm]

    Returns
    -------
    mapping of str to (n,) values
        polar_deg, azimuth_deg (probe frame), effective_radius_mm, pretravel_um, u_um.
    """
    values = map_grid(pretravel_map)
    polar, azimuth = np.meshgrid(values["polar_deg"], values["azimuth_deg"], indexing="ij")
    held = np.isfinite(values["pretravel_um"])
    pretravel = values["pretravel_um"][held] + travel / MICROMETRE
    return {
        "polar_deg": polar[held],
        "azimuth_deg": azimuth[held],
        "effective_radius_mm": pretravel_map.tip_radius - pretravel * MICROMETRE,
        "pretravel_um": pretravel,
        "u_um": values["u_um"][held],
    }


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
    covariance_axes = ("coefficient", "other_coefficient")[: pretravel_map.covariance.ndim]
    data: dict[str, Any] = {
        "coefficients": ("coefficient", pretravel_map.coefficients, {"units": "mm"}),
        "covariance": (covariance_axes, pretravel_map.covariance, {"units": "mm2"}),
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
    if isinstance(pretravel_map.basis, HarmonicBasis):
        data["degree"] = ("coefficient", pretravel_map.basis.terms[:, 0])
        data["order"] = ("coefficient", pretravel_map.basis.terms[:, 1])
    if pretravel_map.delay_effect is not None:
        data["delay_effect"] = ("coefficient", pretravel_map.delay_effect, {"units": "mm"})
    if isinstance(pretravel_map.basis, SixSeatBasis):
        names = [parameter.name for parameter in PARAMETERS]
        data["six_seat_values"] = ("parameter", pretravel_map.basis.values)
        data["parameter"] = ("parameter", names)
    if isinstance(pretravel_map.basis, ResponseBasis):
        data |= _response_variables(pretravel_map.basis.response)
    for name, values in (table or {}).items():
        array = np.asarray(values)
        unit = name.rsplit("_", 1)[-1] if "_" in name else ""
        data[f"predicted_{name}"] = ("direction", array, {"units": unit})
    attributes: dict[str, Any] = {
        "format": FORMAT,
        "kind": pretravel_map.kind,
        "tip_radius_mm": pretravel_map.tip_radius,
        "u_tip_radius_mm": pretravel_map.u_tip_radius,
        "repeatability_mm": pretravel_map.repeatability,
        "repeatability_dof": pretravel_map.repeatability_dof,
        "provenance": json.dumps(dict(pretravel_map.provenance)),
        "checksum": _checksum(pretravel_map),
    }
    if isinstance(pretravel_map.basis, ResponseBasis):
        attributes["criterion"] = pretravel_map.basis.response.criterion
    if isinstance(pretravel_map.basis, WozniakBasis):
        attributes["lobe_azimuth_rad"] = pretravel_map.basis.lobe_azimuth
        attributes["transducer"] = pretravel_map.basis.transducer
    if pretravel_map.feed is not None:
        attributes["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        attributes["delay_s"] = pretravel_map.delay
        attributes["u_delay_s"] = pretravel_map.u_delay
    return xr.Dataset(
        data,
        coords={
            "polar": ("polar", grid_values["polar_deg"], {"units": "degree"}),
            "azimuth": ("azimuth", grid_values["azimuth_deg"], {"units": "degree"}),
        },
        attrs=attributes,
    )


_RESPONSE_ARRAYS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "reaction_change": (("seat", "axis"), "1"),
    "rest_reactions": (("seat",), "N"),
    "compliance": (("axis", "other_axis"), "mm/N"),
    "seat_motion": (("axis", "seat"), "1"),
    "threshold": ((), "N"),
    "seat_coefficient": ((), "mm/N^(2/3)"),
    "tip_coefficient": ((), "mm/N^(2/3)"),
    "tip_radius": ((), "mm"),
}


def _response_variables(response: ProbeResponse) -> dict[str, Any]:
    return {
        f"response_{name}": (axes, getattr(response, name), {"units": units})
        for name, (axes, units) in _RESPONSE_ARRAYS.items()
    }


def _response_basis(dataset: xr.Dataset) -> ResponseBasis:
    values = {name: np.asarray(dataset[f"response_{name}"].values) for name in _RESPONSE_ARRAYS}
    numbers = {
        name: float(value) if _RESPONSE_ARRAYS[name][0] == () else value
        for name, value in values.items()
    }
    criterion = str(dataset.attrs["criterion"])
    return ResponseBasis(ProbeResponse(criterion=criterion, **numbers))  # type: ignore[arg-type]


def _checksum(pretravel_map: PretravelMap) -> str:
    """Of the numbers that make the map, so that damage on disk is noticed."""
    digest = hashlib.sha256()
    for values in (
        pretravel_map.coefficients,
        pretravel_map.covariance,
        pretravel_map.support.nodes,
        pretravel_map.rotation,
        np.array([pretravel_map.tip_radius, pretravel_map.u_tip_radius]),
        np.array([pretravel_map.repeatability, pretravel_map.repeatability_dof]),
        *_told_apart(pretravel_map),
        *(
            [getattr(pretravel_map.basis.response, name) for name in _RESPONSE_ARRAYS]
            if isinstance(pretravel_map.basis, ResponseBasis)
            else []
        ),
    ):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


def _told_apart(pretravel_map: PretravelMap) -> list[FloatArray]:
    """Numbers that only some maps have."""
    found = []
    if pretravel_map.delay is not None:
        found.append(np.array([pretravel_map.delay, pretravel_map.u_delay]))
    if pretravel_map.delay_effect is not None:
        found.append(pretravel_map.delay_effect)
    if isinstance(pretravel_map.basis, SixSeatBasis):
        found.append(pretravel_map.basis.values)
    if isinstance(pretravel_map.basis, WozniakBasis):
        found.append(np.array([pretravel_map.basis.lobe_azimuth]))
    return found


def map_from_dataset(dataset: xr.Dataset) -> PretravelMap:
    """The map that `map_dataset` wrote.

    Raises
    ------
    PretravelError
        Not such a dataset.
    """
    if dataset.attrs.get("format") != FORMAT:
        raise PretravelError(
            "this is not a pretravel map (no matching 'format' attribute); "
            "pretravel qualify and pretravel predict write them"
        )
    support = DirectionSupport(np.asarray(dataset["support"].values))
    kind = str(dataset.attrs["kind"])
    bases: Mapping[str, MapBasis] = {
        "mean": MeanBasis(),
        "sectors": SectorBasis(),
        "tabulated": TabulatedBasis(support),
    }
    if kind == "harmonic":
        basis: MapBasis = HarmonicBasis(
            np.stack([dataset["degree"].values, dataset["order"].values], axis=1).astype(np.int64)
        )
    elif kind == "physical" and "six_seat_values" in dataset:
        if [str(name) for name in dataset["parameter"].values] != [p.name for p in PARAMETERS]:
            raise PretravelError("this physical map has other numbers than this version knows")
        basis = SixSeatBasis(
            np.asarray(dataset["six_seat_values"].values), float(dataset.attrs["tip_radius_mm"])
        )
    elif kind == "physical":
        basis = _response_basis(dataset)
    elif kind == "wozniak":
        basis = WozniakBasis(
            float(dataset.attrs["lobe_azimuth_rad"]), str(dataset.attrs["transducer"])
        )
    elif kind in bases:
        basis = bases[kind]
    else:
        raise PretravelError(f"maps of kind '{kind}' are not known to this version")
    feed, delay = dataset.attrs.get("feed_mm_min"), dataset.attrs.get("delay_s")
    found = PretravelMap(
        basis=basis,
        coefficients=np.asarray(dataset["coefficients"].values),
        covariance=np.asarray(dataset["covariance"].values),
        support=support,
        tip_radius=float(dataset.attrs["tip_radius_mm"]),
        u_tip_radius=float(dataset.attrs["u_tip_radius_mm"]),
        repeatability=float(dataset.attrs["repeatability_mm"]),
        repeatability_dof=float(dataset.attrs["repeatability_dof"]),
        rotation=np.asarray(dataset["rotation"].values),
        feed=None if feed is None else float(feed),
        delay=None if delay is None else float(delay),
        u_delay=float(dataset.attrs.get("u_delay_s", 0.0)),
        delay_effect=np.asarray(dataset["delay_effect"].values)
        if "delay_effect" in dataset
        else None,
        provenance=json.loads(dataset.attrs["provenance"]),
    )
    if _checksum(found) != dataset.attrs.get("checksum"):
        raise PretravelError(
            "this map was damaged or edited after it was written (its checksum does not fit); "
            "qualify or predict again"
        )
    return found


def write_map(
    path: str | Path,
    pretravel_map: PretravelMap,
    *,
    table: Mapping[str, npt.ArrayLike] | None = None,
) -> None:
    """Write a map in the format of the path's ending.

    ``.nc`` keeps everything; ``.csv`` and ``.json`` are a table over directions: the
    prediction's where there is one, else a grid with uncertainties.

    Parameters
    ----------
    path : str or Path
    pretravel_map : PretravelMap
    table : mapping of str to (n,) values, optional
        A prediction's columns.

    Raises
    ------
    PretravelError
        Another ending.
    """
    ending = Path(path).suffix.lower()
    if ending == ".nc":
        write_dataset(path, map_dataset(pretravel_map, table))
        return
    if ending not in (".csv", ".json"):
        raise PretravelError(
            f"a map cannot be written to '{path}': the ending must be .nc, .csv or .json"
        )
    columns = dict(table) if table is not None else _grid_table(pretravel_map)
    if ending == ".csv":
        rows = len(np.asarray(columns["polar_deg"]))
        constants = _table_constants(pretravel_map)
        columns |= {name: np.full(rows, value) for name, value in constants.items()}
        write_csv_table(path, columns)
    else:
        content = {
            "kind": pretravel_map.kind,
            "tip_radius_mm": pretravel_map.tip_radius,
            "repeatability_um": pretravel_map.repeatability / MICROMETRE,
            "provenance": dict(pretravel_map.provenance),
            **{name: np.asarray(values).tolist() for name, values in columns.items()},
        }
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")


def _table_constants(pretravel_map: PretravelMap) -> dict[str, float]:
    """What a table must say beside its values, a column of one number each, to be used as a
    map. The axis is left out where it is +z.
    """
    constants = {
        "tip_radius_mm": pretravel_map.tip_radius,
        "u_tip_radius_um": pretravel_map.u_tip_radius / MICROMETRE,
    }
    if pretravel_map.repeatability:
        constants["repeatability_um"] = pretravel_map.repeatability / MICROMETRE
    if pretravel_map.feed is not None:
        constants["feed_mm_min"] = pretravel_map.feed
    if pretravel_map.delay is not None:
        constants["delay_ms"] = pretravel_map.delay * 1e3
        constants["u_delay_ms"] = pretravel_map.u_delay * 1e3
    rotation = pretravel_map.rotation
    if not np.allclose(rotation, np.eye(3), atol=1e-12):
        axis = rotation[:, 2]
        about = probe_rotation(axis).T @ rotation
        turn = math.degrees(math.atan2(about[1, 0], about[0, 0]))
        constants |= {f"probe_axis_{name}": float(v) for name, v in zip("xyz", axis, strict=True)}
        constants["probe_rotation_deg"] = turn
    return constants


def _grid_table(pretravel_map: PretravelMap) -> dict[str, npt.ArrayLike]:
    # Fine enough for linear interpolation between: 0.1 µm where harmonics reach degree 24.
    values = map_grid(pretravel_map, polar_step=2.5, azimuth_step=2.5)
    polar, azimuth = np.meshgrid(values["polar_deg"], values["azimuth_deg"], indexing="ij")
    supported = np.isfinite(values["pretravel_um"])
    return {
        "polar_deg": polar[supported],
        "azimuth_deg": azimuth[supported],
        "pretravel_um": values["pretravel_um"][supported],
        "u_um": values["u_um"][supported],
    }


def read_map(path: str | Path, *, tip_diameter: float | None = None) -> PretravelMap:
    """A map from disk.

    Parameters
    ----------
    path : str or Path
        ``.nc`` as written by `write_map`, or a CSV with polar_deg, azimuth_deg,
        pretravel_um and perhaps u_um (probe axis +z), interpolated linearly.
    tip_diameter : float, optional
        Of the tip in use, where a predicted map's was another, or a table does not say. A
        qualified map is good only with its own. [mm]

    Returns
    -------
    PretravelMap

    Raises
    ------
    InputError
        No such file, or not a map.
    """
    place = Path(path)
    if not place.is_file():
        what = "this is a folder" if place.is_dir() else "there is no such file"
        raise InputError(what, path=path)
    if place.suffix.lower() == ".json":
        raise InputError("a map is read from .nc, or from a .csv table, not from .json", path=path)
    if tip_diameter is not None and not 0.0 < tip_diameter < 100.0:
        raise PretravelError(f"the tip diameter is {tip_diameter:g} mm")
    if place.suffix.lower() == ".csv":
        found = _read_csv_map(place, tip_diameter)
    else:
        found = _read_netcdf_map(place)
    if tip_diameter is None or math.isclose(found.tip_radius, 0.5 * tip_diameter, abs_tol=1e-6):
        return found
    if not str(found.provenance.get("source", "")).startswith("predicted"):
        raise PretravelError(
            f"{path}: this map was qualified with a tip of {2.0 * found.tip_radius:.6g} mm "
            f"diameter and is good only with it, not with {tip_diameter:g} mm; leave "
            "--tip-diameter out"
        )
    return replace(found, tip_radius=0.5 * tip_diameter)


def map_or_prediction(
    name: str, model: str = "analytic", *, tip_diameter: float | None = None
) -> PretravelMap:
    """A map from its file, or the prediction of a probe.

    Parameters
    ----------
    name : str
        Path of a map (.nc, .csv, .json), or of a description (.toml), or a catalogue name.
    model : str
        Of the prediction.
    tip_diameter : float, optional
        If not the map's. [mm]

    Raises
    ------
    PretravelError
        Neither a map nor a probe.
    """
    ending = Path(name).suffix.lower()
    if ending in (".nc", ".csv", ".json"):
        return read_map(name, tip_diameter=tip_diameter)
    if ending not in (".toml", ""):
        raise PretravelError(
            f"{name}: neither a map (.nc, .csv) nor a probe (.toml, or a name of pretravel probes)"
        )
    return described_map(name, model, tip_diameter=tip_diameter)


def described_map(
    probe: str | Path, model: str = "analytic", *, tip_diameter: float | None = None
) -> PretravelMap:
    """The map that a described probe is predicted to have, exact in every direction.

    Parameters
    ----------
    probe : str or Path
        Catalogue name, or path of a TOML description.
    model : str
        See `pretravel.trigger.compliance.MODELS`.
    tip_diameter : float, optional
        Instead of the description's. [mm]

    Returns
    -------
    PretravelMap
        Over the half sphere that a probe from above can touch.

    >>> described_map("omp40-2").kind
    'physical'
    """
    description = load_probe(probe)
    trigger = predict(description, fibonacci_cap(400), model)
    if compliance_model(model).has_response:
        found = response_map(description, probe_response(description, model), trigger)
    else:
        found = predicted_map(description, trigger)
    return found if tip_diameter is None else replace(found, tip_radius=0.5 * tip_diameter)


def _read_netcdf_map(path: Path) -> PretravelMap:
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            return map_from_dataset(dataset.load())
    except PretravelError as error:
        raise InputError(str(error), path=path) from error
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            "this is not a map that can be read (a NetCDF file written by pretravel, or a CSV "
            f"table); {type(error).__name__}: {error}",
            path=path,
        ) from error


def _read_csv_map(path: Path, tip_diameter: float | None) -> PretravelMap:
    table = read_csv_table(path)
    table.require("polar_deg", "azimuth_deg", "pretravel_um", what="a map")
    angles = table.numbers("polar_deg", "azimuth_deg") * DEGREE
    value = table.numbers("pretravel_um")[:, 0] * MICROMETRE
    u = table.numbers("u_um")[:, 0] * MICROMETRE if table.has("u_um") else np.zeros(len(value))
    directions = from_angles(angles[:, 0], angles[:, 1])
    _, first, inverse = np.unique(
        np.round(directions, 9), axis=0, return_index=True, return_inverse=True
    )
    repeated = value[first][inverse.ravel()]
    clash = np.flatnonzero(np.abs(repeated - value) > 1e-9)
    if len(clash):
        raise InputError(
            "this direction is there twice, with different values",
            path=path,
            line=table.lines[int(clash[0])],
        )
    if np.max(np.abs(value)) > _LARGEST:
        row = int(np.argmax(np.abs(value)))
        raise InputError(
            f"pretravel_um is {value[row] / MICROMETRE:g}; probes give by 1 to 80 µm",
            path=path,
            line=table.lines[row],
        )
    radius = _constant(table, "tip_radius_mm")
    if radius is None and tip_diameter is None:
        raise InputError("this table has no column tip_radius_mm; give --tip-diameter", path=path)
    delay_ms = _constant(table, "delay_ms")
    axis = [_constant(table, f"probe_axis_{name}") for name in "xyz"]
    turn = _constant(table, "probe_rotation_deg") or 0.0
    rotation = probe_rotation([v or 0.0 for v in axis], turn * DEGREE) if any(axis) else np.eye(3)
    keep = np.sort(first)
    support = DirectionSupport(directions[keep])
    return PretravelMap(
        basis=TabulatedBasis(support),
        coefficients=value[keep],
        covariance=u[keep] ** 2,
        support=support,
        tip_radius=radius if radius is not None else 0.5 * (tip_diameter or 0.0),
        u_tip_radius=(_constant(table, "u_tip_radius_um") or 0.0) * MICROMETRE,
        repeatability=(_constant(table, "repeatability_um") or 0.0) * MICROMETRE,
        rotation=rotation,
        feed=_constant(table, "feed_mm_min"),
        delay=None if delay_ms is None else delay_ms * 1e-3,
        u_delay=(_constant(table, "u_delay_ms") or 0.0) * 1e-3,
        provenance={
            "source": f"{'qualified' if table.has('u_um') else 'predicted'}, table {path.name}"
        },
    )


def _constant(table: CsvTable, name: str) -> float | None:
    """The number that fills a column; None without the column."""
    if not table.has(name):
        return None
    values = table.numbers(name)[:, 0]
    other = np.flatnonzero(values != values[0])
    if len(other):
        row = int(other[0])
        raise InputError(
            f"{name} is {values[row]:g}, but {values[0]:g} in the rows above; it must be the same",
            path=table.path,
            line=table.lines[row],
        )
    return float(values[0])
