"""PretravelMaps on disk: JSON whole, CSV as a table."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy.typing as npt

from pretravel.base import TIP_BALL, FloatArray, InputError, PretravelError, checked
from pretravel.files.map_json import map_from_json, numbers_of_map, write_json_map
from pretravel.files.source_file import opened

if TYPE_CHECKING:
    from pretravel.maps import MapLike, PretravelMap

MAP_ENDINGS = (".json", ".csv")
"""Of files that are maps; every other file is none, whatever it contains."""
FORMER_MAP_ENDINGS = (".nc",)
"""Of maps of earlier versions: where a map is expected, the refusal says what to do."""
_NO_NETCDF = (
    "maps are .json files, and NetCDF (.nc) maps of earlier versions are not read; qualify or "
    "predict again with -o map.json"
)


def write_map(
    path: str | Path,
    pretravel_map: MapLike,
    *,
    table: Mapping[str, npt.ArrayLike] | None = None,
) -> None:
    """Write a map in the format of the path's ending.

    ``.json`` keeps everything; ``.csv`` is a table over directions: the prediction's where there
    is one, else a grid with uncertainties.

    Parameters
    ----------
    path : str or Path
    pretravel_map : PretravelMap or Qualification
    table : mapping of str to (n,) values, optional
        A prediction's columns, for ``.csv``.

    Raises
    ------
    PretravelError
        Another ending.
    """
    from pretravel.maps import as_map

    pretravel_map = as_map(pretravel_map)
    ending = Path(path).suffix.lower()
    if ending == ".json":
        write_json_map(path, pretravel_map)
    elif ending == ".csv":
        from pretravel.files.map_table import write_csv_map

        write_csv_map(path, pretravel_map, table)
    else:
        raise PretravelError(
            f"a map cannot be written to '{path}': the ending must be .json or .csv"
        )


def read_map(path: str | Path, *, tip_diameter: float | None = None) -> PretravelMap:
    """Read a map.

    Parameters
    ----------
    path : str or Path
        ``.json`` as written by `write_map`, or a CSV with polar_deg, azimuth_deg,
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
    """
    place = Path(path)
    if not place.is_file():
        what = "this is a folder" if place.is_dir() else "there is no such file"
        raise InputError(what, path=path)
    ending = place.suffix.lower()
    if ending in FORMER_MAP_ENDINGS:
        raise InputError(_NO_NETCDF, path=path)
    if ending not in MAP_ENDINGS:
        raise InputError(
            f"a map is read from .json, or from a .csv table, not from '{ending}'", path=path
        )
    if tip_diameter is not None:
        checked(tip_diameter, "the tip's diameter", TIP_BALL, inputs=("tip_diameter",))
    if tip_diameter is not None and not 0.0 < tip_diameter < 100.0:
        raise PretravelError(
            f"the tip's diameter is {tip_diameter:g} mm; it must lie between 0 and 100",
            inputs=("tip_diameter",),
        )
    if ending == ".csv":
        from pretravel.files.map_table import read_csv_map

        found = read_csv_map(place, tip_diameter)
    else:
        found = map_from_json(opened(place))
    if tip_diameter is None or math.isclose(found.tip_radius, 0.5 * tip_diameter, abs_tol=1e-6):
        return found
    from pretravel.maps import Origin

    if found.provenance.origin is not Origin.PREDICTED:
        raise PretravelError(
            f"{path}: this map was qualified with a tip of {2.0 * found.tip_radius:.6g} mm "
            f"diameter and is good only with it, not with {tip_diameter:g} mm; do not give a tip "
            "diameter",
            inputs=("tip_diameter",),
        )
    return replace(found, tip_radius=0.5 * tip_diameter)


def map_id(pretravel_map: PretravelMap) -> str:
    """Twelve digits that identify a map."""
    return _id_of(pretravel_map.coefficients, pretravel_map.rotation)


def _id_of(coefficients: FloatArray, rotation: FloatArray) -> str:
    return hashlib.sha256(coefficients.tobytes() + rotation.tobytes()).hexdigest()[:12]


def map_word(path: str | Path, pretravel_map: PretravelMap) -> str:
    """The name of the file of a map with its identity, as points state it."""
    return f"{Path(path).name} {map_id(pretravel_map)}"


def word_of_map_file(path: str | Path) -> str:
    """The same word of the map that a file contains now.

    Raises
    ------
    PretravelError
        As `read_map`.
    """
    place = Path(path)
    if place.suffix.lower() != ".json":
        return map_word(place, read_map(place))
    return f"{place.name} {_id_of(*numbers_of_map(opened(place)))}"
