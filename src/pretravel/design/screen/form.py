"""The description of a probe as fields of a form, and the form as a description."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from pretravel.base import PretravelError, TomlDocument
from pretravel.prediction import CONTACTS, Probe, described_probe, known_materials
from pretravel.six_seats import CRITERIA

PREFIX = "design."
"""Before the place of a value in its description, in the names of settings."""
MOST_SEGMENTS = 8
"""Of a stylus that the form shows."""
Path = tuple[str | int, ...]


@dataclass(frozen=True)
class DesignField:
    """A value of a description, in a form.

    Attributes
    ----------
    path : tuple of str and int
        Its place in the description.
    label, unit : str
    ends : (float, float)
        Of the slider.
    step : float
    factor : float
        Of the number in the form to the one in the description.
    choices : tuple of str
        Of words; empty for a number.
    whole : bool
        Whether it is the length of the whole stylus, of which this segment takes what the others
        leave.
    """

    path: Path
    label: str
    unit: str = ""
    ends: tuple[float, float] = (0.0, 1.0)
    step: float = 0.1
    factor: float = 1.0
    choices: tuple[str, ...] = ()
    whole: bool = False

    @property
    def name(self) -> str:
        """Of the setting."""
        return PREFIX + ".".join(map(str, self.path))

    def value(self, tables: Mapping[str, Any]) -> float | str:
        """The value of a description.

        Parameters
        ----------
        tables : mapping
            As `tomllib` reads them.
        """
        found: Any = tables
        for key in self.path:
            found = found[key]
        if self.choices:
            return str(found)
        others = _others(tables, self.path) if self.whole else 0.0
        return float(f"{self.factor * found + others:.12g}")

    def set(self, tables: Any, value: float | str) -> None:
        """Change the value of a description."""
        *above, key = self.path
        place = tables
        for part in above:
            place = place[part]
        if isinstance(value, str):
            place[key] = value
            return
        others = _others(tables, self.path) if self.whole else 0.0
        place[key] = float(f"{(value - others) / self.factor:.12g}")


def _others(tables: Mapping[str, Any], path: Path) -> float:
    """Length of the segments of the stylus without the one of a path."""
    return math.fsum(
        float(segment["length_mm"])
        for index, segment in enumerate(tables["stylus"])
        if index != path[1]
    )


@dataclass(frozen=True)
class FieldGroup:
    """Fields under a heading.

    Attributes
    ----------
    heading : str
    fields : tuple of DesignField
    opened : bool
        Whether they are shown without a click.
    remark : str
        Below the heading.
    """

    heading: str
    fields: tuple[DesignField, ...]
    opened: bool = False
    remark: str = ""


@lru_cache(maxsize=16)
def form_groups(text: str) -> tuple[FieldGroup, ...]:
    """The fields that a description has.

    Parameters
    ----------
    text : str
        A valid description.

    >>> from pretravel.prediction.catalogue import description_text
    >>> [group.heading for group in form_groups(description_text("omp40-2"))]
    ['Stylus', 'Spring and trigger', 'Head of the stylus', 'Tripod', 'Seats', 'Hub']
    """
    tables = tomllib.loads(text)
    materials = tuple(sorted({*known_materials(), *tables.get("materials", {})}))
    stylus, heads = _stylus_groups(tables, materials)
    found = (
        FieldGroup(
            "Stylus",
            stylus,
            opened=True,
            remark="A stylus is stiffer when it is shorter, when its stem is thicker, or when the "
            "modulus E of its material is larger.",
        ),
        FieldGroup(
            "Spring and trigger",
            (
                DesignField(
                    ("spring", "preload_N"), "Preload of the spring", "N", (0.5, 20.0), 0.01
                ),
                DesignField(("trigger", "criterion"), "Trigger criterion", choices=CRITERIA),
                DesignField(("trigger", "threshold_N"), "Trigger threshold", "N", (0.0, 1.0), 0.01),
                DesignField(
                    ("trigger", "opening_um"), "Contact opening, arm lift", "µm", (0.0, 5.0), 0.01
                ),
            ),
            opened=True,
        ),
        *heads,
        FieldGroup("Tripod", _tripod_fields(materials)),
        FieldGroup("Seats", _seat_fields(materials)),
        FieldGroup("Hub", _hub_fields(materials)),
    )
    present = (
        replace(group, fields=tuple(f for f in group.fields if _has(tables, f))) for group in found
    )
    return tuple(group for group in present if group.fields)


def _has(tables: Mapping[str, Any], field: DesignField) -> bool:
    try:
        field.value(tables)
    except (LookupError, TypeError, ValueError):
        return field.path in _DEFAULTS
    return True


def _stylus_groups(
    tables: Mapping[str, Any], materials: tuple[str, ...]
) -> tuple[tuple[DesignField, ...], list[FieldGroup]]:
    """Fields of the stem and the tip, and a group for each other segment."""
    segments = tables["stylus"][:MOST_SEGMENTS]
    stem = max(range(len(segments)), key=lambda i: float(segments[i]["length_mm"]))
    place = ("stylus", stem)
    fields = (
        DesignField(
            (*place, "length_mm"),
            "Stylus length to the tip centre",
            "mm",
            (10.0, 200.0),
            0.5,
            whole=True,
        ),
        DesignField((*place, "diameter_mm"), "Stem diameter", "mm", (0.5, 12.0), 0.1),
        DesignField((*place, "material"), "Stem material", choices=materials),
        DesignField(("tip", "radius_mm"), "Tip ball diameter", "mm", (0.5, 12.0), 0.1, factor=2.0),
        DesignField(("tip", "material"), "Tip ball material", choices=materials),
    )
    others = [i for i in range(len(segments)) if i != stem]
    groups = []
    for i in others:
        heading = "Head of the stylus" if i == 0 and i < stem else f"Part {i + 1} of the stylus"
        part = "Head" if i == 0 and i < stem else f"Part {i + 1}"
        groups.append(
            FieldGroup(
                heading,
                (
                    DesignField(
                        ("stylus", i, "length_mm"), f"{part} length", "mm", (1.0, 60.0), 0.5
                    ),
                    DesignField(
                        ("stylus", i, "diameter_mm"), f"{part} diameter", "mm", (0.5, 20.0), 0.1
                    ),
                    DesignField(("stylus", i, "material"), f"{part} material", choices=materials),
                ),
            )
        )
    return fields, groups


def _tripod_fields(materials: tuple[str, ...]) -> tuple[DesignField, ...]:
    azimuths = (
        DesignField(
            ("tripod", "rod_azimuths_deg", i), f"Azimuth of rod {rod}", "°", (0.0, 360.0), 1.0
        )
        for i, rod in enumerate("ABC")
    )
    return (
        DesignField(("tripod", "radius_mm"), "Tripod radius", "mm", (5.0, 40.0), 0.1),
        DesignField(("tripod", "rod_radius_mm"), "Rod radius", "mm", (0.5, 6.0), 0.05),
        DesignField(("tripod", "material"), "Material of the rods", choices=materials),
        *azimuths,
    )


def _seat_fields(materials: tuple[str, ...]) -> tuple[DesignField, ...]:
    return (
        DesignField(("seats", "support_angle_deg"), "Support angle", "°", (5.0, 85.0), 0.5),
        DesignField(("seats", "ball_radius_mm"), "Seat ball radius", "mm", (0.5, 8.0), 0.05),
        DesignField(("seats", "material"), "Material of the seat balls", choices=materials),
        DesignField(("seats", "contact"), "Seat contact", choices=CONTACTS),
    )


def _hub_fields(materials: tuple[str, ...]) -> tuple[DesignField, ...]:
    return (
        DesignField(("hub", "offset_mm"), "Hub offset", "mm", (0.0, 60.0), 0.1),
        DesignField(("hub", "radius_mm"), "Hub radius", "mm", (2.0, 30.0), 0.1),
        DesignField(("hub", "height_mm"), "Hub height", "mm", (1.0, 40.0), 0.1),
        DesignField(("hub", "holder_diameter_mm"), "Holder diameter", "mm", (1.0, 30.0), 0.1),
        DesignField(("hub", "material"), "Material of the hub", choices=materials),
    )


_DEFAULTS: Mapping[Path, float | str] = {
    ("trigger", "criterion"): CRITERIA[0],
    ("trigger", "threshold_N"): 0.0,
    ("seats", "contact"): CONTACTS[0],
}


@lru_cache(maxsize=16)
def start_values(text: str) -> Mapping[str, float | str]:
    """The values of all fields of a description, by the names of their settings."""
    tables = tomllib.loads(text)
    values: dict[str, float | str] = {}
    for field in all_fields(text):
        try:
            values[field.name] = field.value(tables)
        except LookupError:
            values[field.name] = _DEFAULTS[field.path]
    return MappingProxyType(values)


def all_fields(text: str) -> tuple[DesignField, ...]:
    """The fields of all groups."""
    return tuple(field for group in form_groups(text) for field in group.fields)


def setting_names() -> tuple[str, ...]:
    """The names of all settings that a form can have."""
    keys = {"stylus": ("length_mm", "diameter_mm", "material")}
    fixed = ["tip.radius_mm", "tip.material", "spring.preload_N"]
    fixed += [f"trigger.{key}" for key in ("criterion", "threshold_N", "opening_um")]
    fixed += [f"tripod.{key}" for key in ("radius_mm", "rod_radius_mm", "material")]
    fixed += [f"tripod.rod_azimuths_deg.{i}" for i in range(3)]
    fixed += [f"seats.{k}" for k in ("support_angle_deg", "ball_radius_mm", "material", "contact")]
    hub = ("offset_mm", "radius_mm", "height_mm", "holder_diameter_mm", "material")
    fixed += [f"hub.{key}" for key in hub]
    fixed += [f"stylus.{i}.{key}" for i in range(MOST_SEGMENTS) for key in keys["stylus"]]
    return tuple(PREFIX + name for name in fixed)


def changes_of(text: str, settings: Mapping[str, Any]) -> dict[str, float | str]:
    """The settings that differ from a description."""
    start = start_values(text)
    return {
        name: settings[name]
        for name, value in start.items()
        if name in settings and settings[name] != value
    }


def designed_text(text: str, changes: Mapping[str, float | str], name: str = "") -> str:
    """A description with changed values; its other values and its comments stay.

    Parameters
    ----------
    text : str
        The description from which the design starts.
    changes : mapping of str to value
        By the names of settings.
    name : str
        Of the design; empty: that of the start, with "changed".

    Returns
    -------
    str
        The sources of changed values say so.

    >>> from pretravel.prediction.catalogue import description_text, parse_probe
    >>> changed = designed_text(description_text("omp40-2"), {"design.spring.preload_N": 4.0})
    >>> parse_probe(changed).preload, parse_probe(changed).name
    (4.0, 'OMP40-2 with 50 mm ceramic stylus, changed')
    """
    import tomlkit

    if not changes and not name:
        return text
    tables = tomlkit.parse(text)
    before = start_values(text)
    for field in _changed(tables, text, changes, name):
        if "sources" in tables:
            sources: Any = tables["sources"]
            sources[_source_name(field.path)] = _source(field, before[field.name])
    return tomlkit.dumps(tables)


def _changed(
    tables: Any, text: str, changes: Mapping[str, float | str], name: str
) -> list[DesignField]:
    """Change values in tables of a description; the fields that were changed."""
    fields = [field for field in all_fields(text) if field.name in changes]
    fields.sort(key=lambda field: field.whole)  # the whole length takes what is left
    for field in fields:
        tables.setdefault(field.path[0], {})
        field.set(tables, changes[field.name])
    if changes or name:
        tables["name"] = name or f"{tables.get('name', 'unnamed probe')}, changed"
    return fields


def _source_name(path: Path) -> str:
    """As the descriptions of the catalogue name sources: segments count from 1."""
    if path[0] == "stylus":
        return f"stylus.{int(path[1]) + 1}.{path[2]}"
    return f"{path[0]}.{path[1]}"


def _source(field: DesignField, before: float | str) -> str:
    value = before if isinstance(before, str) else f"{before:g} {field.unit}".strip()
    return f"designed; {field.label} was {value}"


def designed_probe(text: str, changes: Mapping[str, float | str], name: str = "") -> Probe:
    """The probe of a design.

    Parameters
    ----------
    text, changes, name
        As those of `designed_text`.

    Raises
    ------
    PretravelError
        It cannot exist as described; its inputs are the names of the settings each of which,
        back at its start, makes the design possible.

    >>> from pretravel.prediction.catalogue import description_text
    >>> designed_probe(description_text("omp40-2"), {"design.tip.radius_mm": 4.0})
    Traceback (most recent call last):
    ...
    pretravel.base.errors.DescriptionError: a tip of 4 mm diameter is smaller than the stem ...
    """
    try:
        return _possible(text, changes, name)
    except PretravelError as error:
        error.inputs = culprits(text, changes)
        raise


def _possible(text: str, changes: Mapping[str, float | str], name: str = "") -> Probe:
    tables = tomllib.loads(text)
    _changed(tables, text, changes, name)
    # Without its text, messages speak of no line, which the user of the form does not see.
    return described_probe(TomlDocument(tables, "", ""))


def culprits(text: str, changes: Mapping[str, float | str]) -> tuple[str, ...]:
    """The changes each of which, taken back alone, makes an impossible design possible."""
    found = []
    for name in changes:
        others = {key: value for key, value in changes.items() if key != name}
        try:
            _possible(text, others)
        except PretravelError:
            continue
        found.append(name)
    return tuple(found)
