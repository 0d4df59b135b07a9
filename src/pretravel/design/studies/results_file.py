"""Results of a study as one labelled NetCDF file, which xarray opens."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import PretravelError, needed, whole_file
from pretravel.design.studies.definition import Study
from pretravel.design.studies.outputs import Outcome, OutputMeaning
from pretravel.design.studies.results import StudyResults
from pretravel.files import opened, read_dataset

RESULTS_FORMAT = "pretravel study, version 1"
_DIRECTIONS = {
    "trigger_force": ("N", "force"),
    "sensing_distance": ("um", "sensing_distance"),
    "pretravel": ("um", "pretravel"),
}
_IN_MEMORY = 200_000_000
"""Content that is made in memory first: HDF5 ends the process when a disk is full. [bytes]"""
_BLOCK = 256
"""Designs that are written at a time."""


def write_results(
    path: Path, results: StudyResults, study: Study, outcomes: Iterable[tuple[int, Outcome]]
) -> None:
    """Write the results. An error leaves no partial file.

    Parameters
    ----------
    path : Path
    results : StudyResults
    study : Study
    outcomes : iterable of number and Outcome
        By number; with the values over directions, where they are kept.

    Raises
    ------
    PretravelError
        The disk has not enough space.
    """
    grid = len(study.directions.polar) * len(study.directions.azimuth)
    values = len(results.numbers) + len(results.factors) + 8
    values += len(_DIRECTIONS) * grid if study.keep_directions else 0
    size = 8 * len(results) * values + 1_000_000
    with whole_file(path) as temporary:
        if size <= _IN_MEMORY:
            content = io.BytesIO()
            _write(content, results, study, outcomes)
            temporary.write_bytes(content.getbuffer())
            return
        free = shutil.disk_usage(path.parent).free
        if free < size:
            raise PretravelError(
                f"cannot write {path}: it needs {size / 1e6:.0f} MB, and the disk has "
                f"{free / 1e6:.0f} MB. What was computed is kept; run the command again"
            )
        _write(temporary, results, study, outcomes)


def _write(
    target: Path | io.BytesIO, results: StudyResults, study: Study,
    outcomes: Iterable[tuple[int, Outcome]],
) -> None:  # fmt: skip
    import h5netcdf

    with h5netcdf.File(target, "w") as file:
        file.dimensions = {"design": len(results)}
        file.attrs.update(_attributes(results))
        for key, values in results.factors.items():
            is_text = values.dtype == object
            variable = file.create_variable(
                _factor_name(key), ("design",), _text() if is_text else "f8"
            )
            variable[...] = values
            variable.attrs["long_name"] = key
        for name, numbers in results.numbers.items():
            variable = file.create_variable(name, ("design",), "f8")
            variable[...] = numbers
            variable.attrs.update(
                units=results.meanings[name].unit,
                long_name=results.meanings[name].text,
                # xarray selects and groups by them: CF conventions, section 5.
                coordinates=" ".join(map(_factor_name, results.factors)),
            )
        reasons = file.create_variable("reason", ("design",), _text())
        reasons[...] = np.array(results.reasons, dtype=object)
        reasons.attrs["long_name"] = "why a design failed; empty: it did not"
        if study.keep_directions:
            _write_directions(file, study, len(results), outcomes)


def _factor_name(key: str) -> str:
    return f"factor_{key.replace('.', '_')}"


def _text() -> Any:
    import h5py

    return h5py.string_dtype()


def _attributes(results: StudyResults) -> dict[str, Any]:
    return {
        "format": RESULTS_FORMAT,
        "name": results.name,
        "probe": results.probe,
        "plan": results.plan,
        "base_samples": results.base_samples,
        "factors": json.dumps(list(results.factors)),
        "outputs": json.dumps(list(results.numbers)),
    }


def _write_directions(
    file: Any, study: Study, count: int, outcomes: Iterable[tuple[int, Outcome]]
) -> None:
    angles = {"polar": study.directions.polar, "azimuth": study.directions.azimuth}
    for name, values in angles.items():
        file.dimensions[name] = len(values)
        variable = file.create_variable(name, (name,), "f8")
        variable[...] = np.round(np.degrees(values), 9)
        variable.attrs["units"] = "degree"
    shape = tuple(len(values) for values in angles.values())
    variables = {}
    for name, (unit, _) in _DIRECTIONS.items():
        variables[name] = file.create_variable(name, ("design", "polar", "azimuth"), "f8")
        variables[name].attrs["units"] = unit
    waiting = iter(outcomes)
    for start in range(0, count, _BLOCK):
        block = [outcome for _, outcome in islice(waiting, _BLOCK)]
        for name, (_, field) in _DIRECTIONS.items():
            kept = [getattr(outcome, field) for outcome in block]
            variables[name][start : start + len(block)] = np.array(
                [np.full(shape, np.nan) if values is None else values for values in kept]
            )


def read_results(path: str | Path) -> StudyResults:
    """The results that `write_results` wrote, of the values over directions those on walls.

    Raises
    ------
    InputError
        No NetCDF file, or no results of a study.
    """
    file = opened(path)
    needed("h5netcdf", "scale")
    stored = read_dataset(file)
    if stored.attrs.get("format") != RESULTS_FORMAT:
        raise file.error("these are not results of a study; pretravel study STUDY -o study.nc "
                         "writes them")  # fmt: skip
    try:
        names = json.loads(str(stored.attrs["outputs"]))
        keys = json.loads(str(stored.attrs["factors"]))
        columns = {key: stored.variables[_factor_name(key)].values for key in keys}
        found = {name: stored.variables[name] for name in names}
        return StudyResults(
            name=str(stored.attrs["name"]),
            probe=str(stored.attrs["probe"]),
            plan=str(stored.attrs["plan"]),
            base_samples=int(stored.attrs["base_samples"]),
            factors=columns,
            numbers={name: np.asarray(v.values, np.float64) for name, v in found.items()},
            meanings={
                name: OutputMeaning(str(v.attrs["units"]), str(v.attrs["long_name"]))
                for name, v in found.items()
            },
            reasons=tuple(str(reason) for reason in stored.variables["reason"].values),
            **_on_walls(stored),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise file.error(f"incomplete results of a study ({error})") from None


_MOST_CURVES = 1000
"""Designs of which the values over directions are read again, for pictures."""


def _on_walls(stored: Any) -> dict[str, Any]:
    """Azimuths and values at the largest polar angle, where they were kept and are few."""
    variables = stored.variables
    if "azimuth" not in variables or len(variables["reason"].values) > _MOST_CURVES:
        return {}
    largest = int(np.argmax(variables["polar"].values))
    return {
        "azimuth": np.radians(np.asarray(variables["azimuth"].values, np.float64)),
        "on_walls": {
            name: np.asarray(variables[name].values, np.float64)[:, largest] for name in _DIRECTIONS
        },
    }
