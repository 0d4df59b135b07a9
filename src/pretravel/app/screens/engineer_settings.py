"""What the engineer typed and chose, and the command and Python lines that mean the same."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.tasks import task

if TYPE_CHECKING:
    from pretravel.files.file_format import ReadingOptions
    from pretravel.maps.provenance import QualificationSetup
    from pretravel.tasks.export import Export
    from pretravel.tasks.qualify import KindWish

DEFAULTS: Mapping[str, Any] = {
    "diameter": None,
    "tip_diameter": None,
    "ring": False,
    "kind": "auto",
    "u_diameter_um": 0.2,
    "u_temperature": 0.2,
    "sphere_form_um": 0.13,
    "axial_pretravel_um": 1.0,
    "axis": "0,0,1",
    "lobe_azimuth_deg": None,
    "transducer": "contact",
}
"""Settings of a qualification, with what applies where nothing is stored."""
OF_FILE: Mapping[str, Any] = {"units": None, "decimal": None, "columns": {}, "left_out": []}
"""What is stated about one file, and does not hold for the next one."""
EXPORT_DEFAULTS: Mapping[str, Any] = {
    "control": None,
    "export_units": "mm",
    "export_tolerance_um": 0.02,
    "export_base": None,
    "export_program": None,
    "export_feed": None,
    "export_azimuth_deg": None,
    "export_angles": "normals",
    "export_criterion": "max",
    "export_form": "auto",
}
_USUAL = {**DEFAULTS, **EXPORT_DEFAULTS}
MAP_NAME = "map.json"


def file_mark(content: bytes) -> str:
    """What tells a file from others: the beginning of its checksum.

    >>> file_mark(b"")
    'e3b0c44298fc1c14'
    """
    return hashlib.sha256(content).hexdigest()[:16]


@dataclass(frozen=True)
class EngineerSettings:
    """Settings of the screen; `given` has those that differ from their defaults.

    Attributes
    ----------
    values : mapping of str to value
        All settings of `DEFAULTS`, `EXPORT_DEFAULTS` and `OF_FILE`.
    """

    values: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(stored: Mapping[str, Any], content: bytes = b"") -> EngineerSettings:
        """Stored settings, and defaults for the others.

        Parameters
        ----------
        stored : mapping of str to value
        content : bytes
            Of the file of touches; what is stated about another file does not hold.
        """
        about = {name: stored.get(name, {}) for name in ("answers", "left_out")}
        mark = file_mark(content)
        stated = {
            key: value
            for one in about.values()
            if one.get("file") == mark
            for key, value in one.items()
        }
        return EngineerSettings(
            {name: stored.get(name, value) for name, value in _USUAL.items()}
            | {name: stated.get(name, value) for name, value in OF_FILE.items()}
        )

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the touches that were unticked."""
        return tuple(self["left_out"])

    @property
    def axis(self) -> tuple[float, float, float]:
        """The probe's axis, tip to spindle, in the machine frame."""
        x, y, z = (float(part) for part in self["axis"].split(","))
        return x, y, z

    def stated(self, name: str) -> Any:
        """A setting, or None where it is the default."""
        return None if self[name] == {**_USUAL, **OF_FILE}[name] else self[name]

    def looking(self) -> ReadingOptions:
        """How the file is looked at."""
        from pretravel.files.file_format import ReadingOptions

        return ReadingOptions(
            units=self["units"], decimal=self["decimal"], columns=self["columns"] or None
        )

    def reading(self, exclude: tuple[str, ...] = ()) -> ReadingOptions:
        """How the file is read for a qualification."""
        from pretravel.files.file_format import ReadingOptions

        tip = self["tip_diameter"]
        return ReadingOptions(
            units=self["units"],
            decimal=self["decimal"],
            columns=self["columns"] or None,
            tip_radius=None if tip is None else 0.5 * tip,
            exclude=exclude,
            reference_diameter=self["diameter"],
            ring=self["ring"],
        )

    def setup(self) -> QualificationSetup:
        """Reference, tip and conventions."""
        from pretravel.maps.provenance import QualificationSetup

        u_diameter = self.stated("u_diameter_um")
        return QualificationSetup(
            self["diameter"],
            tip_diameter=self["tip_diameter"],
            ring=self["ring"],
            u_diameter=None if u_diameter is None else u_diameter * MICROMETRE,
            u_temperature=self["u_temperature"],
            sphere_form=self["sphere_form_um"] * MICROMETRE,
            axial_pretravel=self["axial_pretravel_um"] * MICROMETRE,
            axis=self.axis,
        )

    def kind(self) -> KindWish:
        """The kind of map."""
        from pretravel.tasks.qualify import KindWish

        if self["kind"] != "wozniak":  # no other kind has these settings
            return KindWish(self["kind"])
        lobe = self["lobe_azimuth_deg"]
        return KindWish("wozniak", None if lobe is None else lobe * DEGREE, self["transducer"])

    def export(self) -> Export:
        """Settings of the control; those that it does not use are left out."""
        from pretravel.tasks.export import Export, settings_used, takes_feed

        to = self["control"]
        used = settings_used(to)

        def value(name: str, setting: str) -> Any:
            return self.stated(setting) if name in used else None

        return Export(
            map_file=Path(MAP_NAME),
            to=to,
            output=Path(export_name(to)),
            base=_whole(value("base", "export_base")),
            program=_whole(value("program", "export_program")),
            units=value("units", "export_units"),
            angles=value("angles", "export_angles"),
            criterion=value("criterion", "export_criterion"),
            form=value("form", "export_form"),
            tolerance_um=value("tolerance", "export_tolerance_um"),
            azimuth_deg=value("azimuth", "export_azimuth_deg"),
            feed=self["export_feed"] if takes_feed(to) else None,
        )


def _whole(value: float | None) -> int | None:
    return None if value is None else round(value)


_QUALIFY_OPTIONS = {
    "diameter": "diameter",
    "tip_diameter": "tip-diameter",
    "kind": "kind",
    "u_diameter_um": "u-diameter",
    "u_temperature": "u-temperature",
    "sphere_form_um": "sphere-form",
    "axial_pretravel_um": "axial-pretravel",
    "axis": "axis",
    "units": "units",
    "decimal": "decimal",
}


def command_lines(file: str, settings: EngineerSettings) -> str:
    """The commands that do the same as the screen, one a line.

    Parameters
    ----------
    file : str
        Name of the file of touches.
    settings : EngineerSettings

    >>> print(command_lines("a b.csv", EngineerSettings.of({"diameter": 25.0, "ring": True})))
    pretravel qualify 'a b.csv' --diameter 25 --ring -o map.json
    pretravel compare map.json
    """
    words = ["pretravel", "qualify", file]
    for setting, name in _QUALIFY_OPTIONS.items():
        value = settings.stated(setting)
        if value is not None:
            words += [_option(name), _word(value)]
    if settings["kind"] == "wozniak":
        if settings["lobe_azimuth_deg"] is not None:
            words += [_option("lobe-azimuth"), _word(settings["lobe_azimuth_deg"])]
        if settings.stated("transducer"):
            words += [_option("transducer"), settings["transducer"]]
    if settings["ring"]:
        words.append(_option("ring"))
    if settings["columns"]:
        words += [_option("columns"), ",".join(f"{k}={v}" for k, v in settings["columns"].items())]
    for name in settings.left_out:
        words += [_option("exclude"), name]
    words += [_option("o"), MAP_NAME]
    lines = [shlex.join(words), shlex.join(["pretravel", "compare", MAP_NAME])]
    if settings["control"]:
        lines.append(task.command_line(settings.export()))
    return "\n".join(lines)


def export_name(to: str) -> str:
    """Name of the file or folder of an export.

    >>> export_name("fanuc"), export_name("radii"), export_name("csv")
    ('fanuc', 'radii.json', 'effective_radii.csv')
    """
    names = {
        "csv": "effective_radii.csv",
        "radii": "radii.json",
        "renishaw": "renishaw.nc",
        "heidenhain": "heidenhain.3DTC",
    }
    return names.get(to, to)


def _option(name: str) -> str:
    return "-" * (1 if len(name) == 1 else 2) + name


def _word(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def python_lines(file: str, settings: EngineerSettings) -> str:
    """The Python lines that make the same map and the same comparison.

    Parameters
    ----------
    file : str
    settings : EngineerSettings
    """
    tip = settings["tip_diameter"]
    reading = {
        "units": settings["units"],
        "decimal": settings["decimal"],
        "columns": settings["columns"] or None,
        "tip_radius": None if tip is None else 0.5 * tip,
        "exclude": settings.left_out or None,
        "ring": settings["ring"] or None,
    }
    u_diameter = settings.stated("u_diameter_um")
    setup = {
        "tip_diameter": tip,
        "ring": settings["ring"] or None,
        "u_diameter": None if u_diameter is None else u_diameter * MICROMETRE,
        "u_temperature": settings.stated("u_temperature"),
        "sphere_form": _millimetres(settings.stated("sphere_form_um")),
        "axial_pretravel": _millimetres(settings.stated("axial_pretravel_um")),
        "axis": None if settings.stated("axis") is None else settings.axis,
    }
    options = _arguments({"reference_diameter": settings["diameter"], **reading})
    made = _arguments({"kind": _kind_text(settings), **setup})
    lines = [
        "import pretravel",
        f"options = pretravel.ReadingOptions({options})",
        f"readings = pretravel.read_readings({file!r}, options).in_machine_axes()",
        f"result = pretravel.qualify(readings.touches, {settings['diameter']!r}, {made})",
        f"pretravel.write_map({MAP_NAME!r}, result.pretravel_map)",
        "comparison = pretravel.compare_corrections(result.pretravel_map)",
    ]
    if settings["control"]:
        lines.append(task.python_lines(settings.export()))
    return "\n".join(lines)


class _Code(str):
    """Text that stands as it is in Python."""

    def __repr__(self) -> str:
        return str(self)


def _kind_text(settings: EngineerSettings) -> str:
    wish = settings.kind()
    if wish.lobe_azimuth is None and wish.transducer == "contact":
        return wish.name
    lobe, transducer = wish.lobe_azimuth, wish.transducer
    return _Code(f"pretravel.WozniakKind({lobe!r}, {transducer!r})")


def _millimetres(value: float | None) -> float | None:
    return None if value is None else value * MICROMETRE


def _arguments(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in values.items() if value is not None)
