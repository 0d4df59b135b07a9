"""Probe descriptions as TOML: the catalogue that comes along, and files of one's own."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

from pretravel.errors import DescriptionError, InputError
from pretravel.probe.description import (
    Hub,
    Moving,
    Orientation,
    Probe,
    Seats,
    StepGeometry,
    StylusSegment,
    Tip,
    Tripod,
)
from pretravel.probe.materials import Material, material, material_from_table
from pretravel.units import DEGREE, MICROMETRE

_TABLES: Mapping[str, tuple[frozenset[str], frozenset[str]]] = {
    # table: (needed keys, optional keys)
    "tripod": (
        frozenset({"radius_mm", "rod_azimuths_deg", "rod_radius_mm", "material"}),
        frozenset(),
    ),
    "seats": (
        frozenset({"support_angle_deg", "ball_radius_mm", "material"}),
        frozenset({"contact"}),
    ),
    "spring": (frozenset({"preload_N"}), frozenset()),
    "hub": (
        frozenset({"offset_mm"}),
        frozenset({"radius_mm", "height_mm", "holder_diameter_mm", "material"}),
    ),
    "geometry": (
        frozenset({"step", "tripod", "stylus", "tip"}),
        frozenset({"materials"}),
    ),
    "stylus": (frozenset({"length_mm", "diameter_mm", "material"}), frozenset()),
    "tip": (frozenset({"radius_mm", "material"}), frozenset({"u_radius_um"})),
    "moving": (frozenset({"mass_g", "height_mm"}), frozenset()),
    "orientation": (frozenset(), frozenset({"axis", "rotation_deg"})),
    "trigger": (frozenset(), frozenset({"criterion", "threshold_N"})),
    "materials": (frozenset(), frozenset()),
    "sources": (frozenset(), frozenset()),
}
_NEEDED_TABLES = ("tripod", "seats", "spring", "hub", "stylus", "tip")


def catalogue_names() -> list[str]:
    """Names of the probes that come with the package.

    >>> "omp40-2" in catalogue_names()
    True
    """
    folder = files("pretravel.probe").joinpath("data/probes")
    return sorted(entry.name[: -len(".toml")] for entry in folder.iterdir())


def description_text(name: str) -> str:
    """The TOML text of a catalogue probe, to print and edit.

    >>> description_text("omp40-2").splitlines()[0]
    'name = "OMP40-2 with 50 mm ceramic stylus"'
    """
    if name not in catalogue_names():
        raise DescriptionError(
            f"there is no probe '{name}' in the catalogue; there are {', '.join(catalogue_names())}"
        )
    entry = files("pretravel.probe").joinpath(f"data/probes/{name}.toml")
    return entry.read_text(encoding="utf-8")


def load_probe(probe: str | Path) -> Probe:
    """A probe by catalogue name, or from a TOML file.

    Parameters
    ----------
    probe : str or Path
        ``omp40-2``, or the path of a description.

    Raises
    ------
    DescriptionError
        Neither a known name nor a file; impossible geometry.
    InputError
        A file that is not a description.

    >>> load_probe("omp40-2-100mm").stylus_length
    100.0
    """
    text_name = str(probe)
    if text_name in catalogue_names():
        return parse_probe(description_text(text_name), f"catalogue probe {text_name}")
    path = Path(probe)
    if not path.is_file():
        raise DescriptionError(
            f"'{text_name}' is neither a probe of the catalogue "
            f"({', '.join(catalogue_names())}) nor a file; "
            "pretravel probes NAME > mine.toml writes one to edit"
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("not a text file, so not a probe description", path=path) from error
    return parse_probe(text, str(path), path.parent)


def parse_probe(text: str, place: str = "description", folder: Path = Path()) -> Probe:
    """A probe from TOML text; lengths, forces and angles in the units the keys name.

    Parameters
    ----------
    text : str
    place : str
        What to call the text in messages.
    folder : Path
        Where a STEP file is looked for.

    Returns
    -------
    Probe

    Raises
    ------
    InputError
        Not TOML; tables or keys missing, unknown, or of the wrong type.
    DescriptionError
        Impossible geometry, unknown material.

    >>> parse_probe("[tripod]", "mine.toml")
    Traceback (most recent call last):
    ...
    pretravel.errors.InputError: mine.toml: the tables [seats], [spring], [hub], [stylus], \
[tip] are missing; pretravel probes omp40-2 prints a whole description
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not valid TOML: {error}", path=place) from error
    _check_tables(tables, place)
    try:
        return _build(tables, place, folder)
    except DescriptionError as error:
        if str(error).startswith(place):
            raise
        raise DescriptionError(f"{place}: {error}") from None


def _check_tables(tables: Mapping[str, Any], place: str) -> None:
    missing = [name for name in _NEEDED_TABLES if name not in tables]
    if missing:
        raise InputError(
            f"the tables {', '.join(f'[{name}]' for name in missing)} are missing; "
            "pretravel probes omp40-2 prints a whole description",
            path=place,
        )
    if not isinstance(tables.get("name", ""), str):
        raise InputError(f"name must be text, got {tables['name']!r}", path=place)
    unknown = [name for name in tables if name not in _TABLES and name != "name"]
    if unknown:
        raise InputError(
            f"'{unknown[0]}' is not known here; a description has name, "
            f"{', '.join(f'[{name}]' for name in _TABLES)}",
            path=place,
        )
    if not isinstance(tables["stylus"], list):
        raise InputError(
            "the stylus is a list of segments from hub to tip: write [[stylus]] for each",
            path=place,
        )
    for name, (needed, optional) in _TABLES.items():
        if name in ("materials", "sources") or name not in tables:
            continue
        entries = tables[name] if name == "stylus" else [tables[name]]
        for table in entries:
            if not isinstance(table, dict):
                raise InputError(f"[{name}] must be a table", path=place)
            allowed = ", ".join(sorted(needed | optional))
            for key in sorted(table.keys() - needed - optional):
                raise InputError(f"[{name}] has no {key}; it has {allowed}", path=place)
            for key in sorted(needed - table.keys()):
                raise InputError(f"[{name}] needs {key}; it has {allowed}", path=place)


@contextmanager
def _table(name: str) -> Iterator[None]:
    """Say in which table of the description something was wrong."""
    try:
        yield
    except DescriptionError as error:
        raise DescriptionError(f"[{name}]: {error}") from None


def _number(table: Mapping[str, Any], key: str, default: float | None = None) -> float:
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DescriptionError(f"{key} must be a number, got {value!r}")
    return float(value)


def _numbers(table: Mapping[str, Any], key: str) -> tuple[float, float, float]:
    value = table[key]
    if (
        not isinstance(value, list)
        or len(value) != 3
        or any(isinstance(v, bool) or not isinstance(v, int | float) for v in value)
    ):
        raise DescriptionError(f"{key} must be three numbers, got {value!r}")
    return (float(value[0]), float(value[1]), float(value[2]))


def _build(tables: Mapping[str, Any], place: str, folder: Path) -> Probe:
    own: dict[str, Material] = {
        name: material_from_table(name, table, place)
        for name, table in tables.get("materials", {}).items()
    }

    def named(table: Mapping[str, Any]) -> Material:
        return material(str(table["material"]), own)

    tripod, seats, tip = tables["tripod"], tables["seats"], tables["tip"]
    moving = tables.get("moving", {})
    orientation = tables.get("orientation", {})
    trigger = tables.get("trigger", {})
    with _table("tripod"):
        azimuths = _numbers(tripod, "rod_azimuths_deg")
        tripod_value = Tripod(
            radius=_number(tripod, "radius_mm"),
            rod_azimuths=(azimuths[0] * DEGREE, azimuths[1] * DEGREE, azimuths[2] * DEGREE),
            rod_radius=_number(tripod, "rod_radius_mm"),
            material=named(tripod),
        )
    with _table("seats"):
        seats_value = Seats(
            support_angle=_number(seats, "support_angle_deg") * DEGREE,
            ball_radius=_number(seats, "ball_radius_mm"),
            material=named(seats),
            contact=str(seats.get("contact", "hertz")),
        )
    stylus = []
    for number, segment in enumerate(tables["stylus"], start=1):
        with _table(f"[stylus] number {number}"):
            stylus.append(
                StylusSegment(
                    length=_number(segment, "length_mm"),
                    diameter=_number(segment, "diameter_mm"),
                    material=named(segment),
                )
            )
    with _table("tip"):
        tip_value = Tip(
            radius=_number(tip, "radius_mm"),
            material=named(tip),
            u_radius=_number(tip, "u_radius_um", 0.0) * MICROMETRE,
        )
    with _table("moving"):
        moving_value = Moving(
            mass=_number(moving, "mass_g", 0.0) * 1e-3,
            height=_number(moving, "height_mm", 0.0),
        )
    with _table("orientation"):
        orientation_value = Orientation(
            axis=_numbers({"axis": [0, 0, 1], **orientation}, "axis"),
            rotation=_number(orientation, "rotation_deg", 0.0) * DEGREE,
        )
    with _table("spring"):
        preload = _number(tables["spring"], "preload_N")
    with _table("hub"):
        hub_offset = _number(tables["hub"], "offset_mm")
        hub_value = _hub(tables["hub"], named)
    with _table("geometry"):
        step = _step(tables["geometry"], own, folder) if "geometry" in tables else None
    with _table("trigger"):
        threshold = _number(trigger, "threshold_N", 0.0)
    return Probe(
        name=str(tables.get("name", "unnamed probe")),
        tripod=tripod_value,
        seats=seats_value,
        preload=preload,
        hub_offset=hub_offset,
        stylus=tuple(stylus),
        tip=tip_value,
        hub=hub_value,
        step=step,
        moving=moving_value,
        orientation=orientation_value,
        criterion=str(trigger.get("criterion", "first_contact")),
        threshold=threshold,
    )


def _hub(table: Mapping[str, Any], named: Callable[[Mapping[str, Any]], Material]) -> Hub | None:
    """The hub's solid, where it is described; all of it or nothing."""
    keys = ("radius_mm", "height_mm", "holder_diameter_mm", "material")
    missing = [key for key in keys if key not in table]
    if len(missing) == len(keys):
        return None
    if missing:
        raise DescriptionError(
            f"{', '.join(missing)} is missing; a hub for the finite-element model has "
            f"{', '.join(keys)}"
        )
    return Hub(
        radius=_number(table, "radius_mm"),
        height=_number(table, "height_mm"),
        holder_diameter=_number(table, "holder_diameter_mm"),
        material=named(table),
    )


def _step(table: Mapping[str, Any], own: Mapping[str, Material], folder: Path) -> StepGeometry:
    def names(key: str) -> tuple[str, ...]:
        value = [table[key]] if isinstance(table[key], str) else table[key]
        if not isinstance(value, list) or not value or not all(isinstance(v, str) for v in value):
            raise DescriptionError(
                f'{key} must name solids of the STEP file, as in ["hub", "#2"], got {table[key]!r}'
            )
        return tuple(value)

    materials = table.get("materials", {})
    if not isinstance(materials, dict):
        raise DescriptionError("materials must be a table: solid = material")
    return StepGeometry(
        path=folder / str(table["step"]),
        tripod=names("tripod"),
        stylus=names("stylus"),
        tip=names("tip"),
        materials={solid: material(str(name), own) for solid, name in materials.items()},
    )


def rewritten(text: str, changes: Mapping[str, tuple[float, str]]) -> str:
    """A description's text with other numbers; everything else, comments too, stays.

    Parameters
    ----------
    text : str
        TOML.
    changes : mapping of place to number and source
        Places are ``table.key``, ``table.key[i]`` for one number of a list, and
        ``stylus.key`` for the longest segment. Sources go into the table [sources].

    Returns
    -------
    str

    >>> "preload_N = 6.5" in rewritten(description_text("omp40-2"), {"spring.preload_N": (6.5, "")})
    True
    """
    import tomlkit

    document = tomlkit.parse(text)
    sources = document.setdefault("sources", tomlkit.table())
    for place, (value, source) in changes.items():
        table_name, key = place.split(".")
        entry: Any = document.setdefault(table_name, tomlkit.table())
        if table_name == "stylus":
            entry = max(entry, key=lambda segment: float(segment["length_mm"]))
        name, _, index = key.partition("[")
        if index:
            entry[name][int(index.rstrip("]"))] = value
        else:
            entry[name] = value
        if source:
            sources[f"{table_name}.{name}"] = source
    return tomlkit.dumps(document)
