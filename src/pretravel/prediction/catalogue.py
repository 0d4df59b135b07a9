"""Probe descriptions as TOML: the catalogue of the package, and the user's files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from pretravel.base import (
    DescriptionError,
    TomlDocument,
    TomlStructure,
    parse_toml,
    quoted,
    read_toml,
    refuse_named_file,
)
from pretravel.prediction.description import (
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
from pretravel.prediction.materials import (
    Material,
    MaterialTable,
    material,
    material_in,
    state_keys,
)

_HINT = "pretravel probes omp40-2 prints a whole description"


@dataclass(frozen=True)
class _Spring:
    preload: float
    offset: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class _HubTable:
    """The hub's offset, and its solid where it is described: all of it or nothing."""

    offset: float
    radius: float | None = None
    height: float | None = None
    holder_diameter: float | None = None
    material: Material | None = None

    def solid(self) -> Hub | None:
        given = (self.radius, self.height, self.holder_diameter, self.material)
        if all(part is None for part in given):
            return None
        radius, height, holder_diameter, material = given
        if radius is None or height is None or holder_diameter is None or material is None:
            keys = ("radius_mm", "height_mm", "holder_diameter_mm", "material")
            missing = [key for key, part in zip(keys, given, strict=True) if part is None]
            raise DescriptionError(
                f"[hub]: {', '.join(missing)} is missing; a hub for the finite-element model has "
                f"{', '.join(keys)}"
            )
        return Hub(radius, height, holder_diameter, material)


class _Solids(tuple[str, ...]):
    """Names of solids of a STEP file: in the description one name, or a list of names."""


@dataclass(frozen=True)
class _Geometry:
    step: str
    tripod: _Solids
    stylus: _Solids
    tip: _Solids
    materials: Mapping[str, Material] = field(default_factory=dict)

    def value(self, folder: Path) -> StepGeometry:
        refuse_named_file("[geometry] takes the solids of the probe from a part, and", self.step)
        return StepGeometry(
            folder / self.step,
            tuple(self.tripod),
            tuple(self.stylus),
            tuple(self.tip),
            self.materials,
        )


@dataclass(frozen=True)
class _Trigger:
    criterion: str = "first_contact"
    threshold: float = 0.0
    opening: float | None = None


@dataclass(frozen=True)
class _Description:
    """The tables of a description's file."""

    tripod: Tripod
    seats: Seats
    spring: _Spring
    hub: _HubTable
    stylus: tuple[StylusSegment, ...]
    tip: Tip
    name: str = "unnamed probe"
    geometry: _Geometry | None = None
    moving: Moving = field(default_factory=Moving)
    orientation: Orientation = field(default_factory=Orientation)
    trigger: _Trigger = field(default_factory=_Trigger)
    materials: Mapping[str, MaterialTable] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)


def catalogue_names() -> list[str]:
    """Names of the probes that come with the package.

    >>> "omp40-2" in catalogue_names()
    True
    """
    folder = files("pretravel.prediction").joinpath("data/probes")
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
    entry = files("pretravel.prediction").joinpath(f"data/probes/{name}.toml")
    return entry.read_text(encoding="utf-8")


def source_text(probe: str | Path) -> str:
    """The TOML text of a catalogue probe or of a file.

    >>> source_text("omp40-2") == description_text("omp40-2")
    True
    """
    name = str(probe)
    if name in catalogue_names():
        return description_text(name)
    return Path(probe).read_text(encoding="utf-8-sig")


def load_probe(probe: str | Path) -> Probe:
    """Load a probe by its name in the catalogue, or from a TOML file.

    Parameters
    ----------
    probe : str or Path
        ``omp40-2``, or the path of a description.

    Raises
    ------
    DescriptionError
        Neither a name in the catalogue nor a file; impossible geometry.
    InputError
        A file that is not a description.

    >>> load_probe("omp40-2-100mm").stylus_length
    100.0
    """
    text_name = str(probe)
    if text_name in catalogue_names():
        return parse_probe(description_text(text_name), f"catalogue probe {text_name}")
    path = Path(probe)
    if not path.exists():
        raise DescriptionError(
            f"'{text_name}' is neither a probe of the catalogue "
            f"({', '.join(catalogue_names())}) nor a file; "
            "pretravel probes NAME > mine.toml writes one to edit"
        )
    return described_probe(read_toml(path, "probe description"), path.parent)


def parse_probe(text: str, place: str = "description", folder: Path = Path()) -> Probe:
    """A probe from TOML text; lengths, forces and angles in the units the keys name.

    Parameters
    ----------
    text : str
    place : str
        The name of the text in messages.
    folder : Path
        The folder to which the path of a STEP file is relative.

    Raises
    ------
    InputError
        Text that is not TOML; tables, keys and materials that are missing, unknown or of the
        wrong type.
    DescriptionError
        Impossible geometry.

    >>> parse_probe("[tripod]", "mine.toml")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.InputError: mine.toml: the tables [seats], [spring], [hub], [stylus], \
[tip] are missing; pretravel probes omp40-2 prints a whole description
    """
    return described_probe(parse_toml(text, place), folder)


def described_probe(document: TomlDocument, folder: Path = Path()) -> Probe:
    """A probe from the tables of a description.

    Parameters
    ----------
    document : TomlDocument
    folder : Path
        The folder to which the path of a STEP file is relative.

    Raises
    ------
    PretravelError
        See `parse_probe`.

    >>> described_probe(parse_toml(description_text("omp40-2"))).preload
    5.91
    """
    own = _own_materials(document)
    description = _structure(tuple(own.items())).make(document, _Description)
    with document.located("hub"):
        hub = description.hub.solid()
    with document.located():
        return Probe(
            name=description.name,
            tripod=description.tripod,
            seats=description.seats,
            preload=description.spring.preload,
            hub_offset=description.hub.offset,
            stylus=description.stylus,
            tip=description.tip,
            hub=hub,
            step=description.geometry.value(folder) if description.geometry else None,
            moving=description.moving,
            orientation=description.orientation,
            criterion=description.trigger.criterion,
            threshold=description.trigger.threshold,
            opening=description.trigger.opening,
            spring_offset=description.spring.offset,
            materials=tuple(own.values()),
        )


@lru_cache(maxsize=16)  # what it makes values with is compiled at the first use
def _structure(own: tuple[tuple[str, Material], ...]) -> TomlStructure:
    """The keys of a description; materials go by name, those of the description first."""
    structure = TomlStructure(hint=_HINT)
    structure.table(
        Tripod,
        radius="radius_mm",
        rod_azimuths="rod_azimuths_deg",
        rod_radius="rod_radius_mm",
        radius_deviations="radius_deviations_mm",
    )
    structure.table(
        Seats,
        support_angle="support_angle_deg",
        ball_radius="ball_radius_mm",
        right_less_left="right_less_left_deg",
    )
    structure.table(_Spring, preload="preload_N", offset="offset_mm")
    structure.table(
        _HubTable,
        offset="offset_mm",
        radius="radius_mm",
        height="height_mm",
        holder_diameter="holder_diameter_mm",
    )
    structure.table(StylusSegment, length="length_mm", diameter="diameter_mm")
    structure.table(Tip, radius="radius_mm", u_radius="u_radius_um")
    structure.table(Moving, mass="mass_g", height="height_mm")
    structure.table(Orientation, rotation="rotation_deg")
    structure.table(_Trigger, threshold="threshold_N", opening="opening_um")
    state_keys(structure)
    structure.value(Material, lambda name: _named(name, dict(own)))
    structure.value(_Solids, _solids)
    return structure


def _own_materials(document: TomlDocument) -> Mapping[str, Material]:
    tables = document.tables.get("materials", {})
    if not isinstance(tables, dict):
        raise document.error("[materials] must be a table", "materials")
    return {name: material_in(document, name, "materials", name) for name in tables}


def _named(name: Any, own: Mapping[str, Material]) -> Material:
    if not isinstance(name, str):
        raise ValueError(f"must be the name of a material, got {quoted(name)}")
    return material(name, own)


def _solids(value: Any) -> _Solids:
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise ValueError(
            f'must name solids of the STEP file, as in ["hub", "#2"], got {quoted(value)}'
        )
    return _Solids(names)


def rewritten(text: str, changes: Mapping[str, tuple[float, str]]) -> str:
    """A description's text with other numbers; everything else, comments too, stays.

    Parameters
    ----------
    text : str
        TOML.
    changes : mapping of place to number and source
        Places are ``table.key``, ``table.key[i]`` for one number of a list, and
        ``stylus.key`` for the longest segment. Sources go into the table [sources].

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
            lengths = [float(segment["length_mm"]) for segment in entry]
            longest = lengths.index(max(lengths))
            entry, table_name = entry[longest], f"stylus.{longest + 1}"
        name, _, index = key.partition("[")
        if index:
            entry[name][int(index.rstrip("]"))] = value
        else:
            entry[name] = value
        if source:
            sources[f"{table_name}.{name}"] = source
    return tomlkit.dumps(document)
