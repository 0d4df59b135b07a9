"""PretravelMaps on disk: NetCDF whole, CSV and JSON as tables."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy.typing as npt

from pretravel.base.errors import InputError, PretravelError
from pretravel.base.quantities import TIP_BALL, checked
from pretravel.files.map_dataset import covered_in_part, map_dataset, map_from_dataset
from pretravel.files.map_table import read_csv_map, write_csv_map, write_json_map
from pretravel.files.netcdf import read_dataset, write_dataset
from pretravel.files.source_file import opened
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Origin


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
    if ending == ".csv":
        write_csv_map(path, pretravel_map, table)
    else:
        write_json_map(path, pretravel_map, table)


def read_map(path: str | Path, *, tip_diameter: float | None = None) -> PretravelMap:
    """A map from disk.

    Parameters
    ----------
    path : str or Path
        ``.nc`` as written by `write_map`, or a CSV with polar_deg, azimuth_deg,
        pretravel_um and perhaps u_um (probe axis +z), interpolated linearly.
    tip_diameter : float, optional
        Of the tip in use, where a predicted map has another one, or a table states none. A
        qualified map is good only with its own tip. [mm]

    Returns
    -------
    PretravelMap

    Raises
    ------
    InputError
        No such file, or not a map; one that was changed after it was written.

    Warns
    -----
    UserWarning
        A NetCDF file of an earlier version, whose checksum covers less.
    """
    place = Path(path)
    if not place.is_file():
        what = "this is a folder" if place.is_dir() else "there is no such file"
        raise InputError(what, path=path)
    if place.suffix.lower() == ".json":
        raise InputError("a map is read from .nc, or from a .csv table, not from .json", path=path)
    if tip_diameter is not None:
        checked(tip_diameter, "the tip's diameter", TIP_BALL, inputs=("tip_diameter",))
    if tip_diameter is not None and not 0.0 < tip_diameter < 100.0:
        raise PretravelError(
            f"the tip's diameter is {tip_diameter:g} mm; it lies between 0 and 100",
            inputs=("tip_diameter",),
        )
    if place.suffix.lower() == ".csv":
        found = read_csv_map(place, tip_diameter)
    else:
        found = _read_netcdf_map(place)
    if tip_diameter is None or math.isclose(found.tip_radius, 0.5 * tip_diameter, abs_tol=1e-6):
        return found
    if found.provenance.origin is not Origin.PREDICTED:
        raise PretravelError(
            f"{path}: this map was qualified with a tip of {2.0 * found.tip_radius:.6g} mm "
            f"diameter and is good only with it, not with {tip_diameter:g} mm; do not give a tip "
            "diameter",
            inputs=("tip_diameter",),
        )
    return replace(found, tip_radius=0.5 * tip_diameter)


def _read_netcdf_map(path: Path) -> PretravelMap:
    file = opened(path)
    dataset = read_dataset(file)
    try:
        with file.named_in_errors():
            found = map_from_dataset(dataset)
    # Content that no map has: a missing name, another type, sizes that do not fit.
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        if isinstance(error, PretravelError):
            raise
        raise file.error(
            "this is not a map that can be read (a NetCDF file written by pretravel, or a CSV "
            f"table); {type(error).__name__}: {error}"
        ) from error
    if covered_in_part(dataset):
        warnings.warn(
            f"{path}: an earlier version wrote this map; its checksum does not cover the degrees "
            "of harmonics, the feed and how the map was made, so damage there is not noticed. "
            "Qualify or predict again",
            stacklevel=3,
        )
    return found
