"""Export a map: tables and programs for a control."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import date
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pretravel.base import ANGLE, DEGREE, FEED_OR_NONE, MICROMETRE, TIP_BALL, PretravelError
from pretravel.controls.tasks.fields import StylusOfSubroutines, ToolOfSubroutines, refuse_no_folder
from pretravel.task import (
    FOLDER,
    SILENT,
    Field,
    InModes,
    Progress,
    Result,
    Task,
    TextResult,
    Units,
    When,
)

if TYPE_CHECKING:
    from pretravel.controls.control import ExportedFiles, ExportSettings
    from pretravel.maps import PretravelMap

_RADII_TABLE = "csv"
"""A table of the radii in all directions, which no control reads directly."""
_TABLES = ("radii", _RADII_TABLE)
"""Exports to read, not for a control."""


def _labels() -> dict[str, str]:
    """What a form calls the controls."""
    from pretravel.controls.exports import CONTROLS

    labels = {name: control.label for name, control in CONTROLS.usable().items()}
    return {"": "Choose …", **labels, _RADII_TABLE: "Other: table of the radius in each direction"}


def _control_help() -> str:
    """The controls, each with a few words."""
    from pretravel.controls.exports import CONTROLS

    usable = CONTROLS.usable().items()
    listed = "; ".join(f"{name}, {control.label}" for name, control in usable)
    controls = ", ".join(name for name in control_names() if name not in _TABLES)
    return (
        f"A control ({controls}) or a table ({', '.join(_TABLES)}): {listed}; {_RADII_TABLE}, "
        "table of the radius in each direction."
    )


def _output_help() -> str:
    """For which controls the output is a folder."""
    from pretravel.controls.exports import CONTROLS

    folders = [name for name, control in CONTROLS.usable().items() if control.folder]
    return (
        f"Folder for {', '.join(folders[:-1])} and {folders[-1]}, file for the others "
        "(.json for radii, .csv for csv); needed, except with --show-template."
    )


def steps_at_control(to: str, files: ExportedFiles) -> tuple[str, ...]:
    """What to do with exported files at the control `to`."""
    from pretravel.controls.exports import CONTROLS

    if to == _RADII_TABLE:
        return ("The table has the radius for each direction (tip radius minus pretravel), in mm.",)
    return CONTROLS[to].steps(files.texts)


def control_names() -> Iterator[str]:
    """What a map can be exported to."""
    from pretravel.controls.exports import CONTROLS

    yield from CONTROLS
    yield _RADII_TABLE


_OF_OTHER_FILES = (
    ".step", ".stp", ".igs", ".iges", ".py", ".toml", ".jsonl", ".pretravel", ".qif",
)  # fmt: skip
"""Endings of text files that no control reads: parts, descriptions, histories, projects."""


def makes_folder(to: str) -> bool:
    """Whether an export makes several files, in a folder."""
    from pretravel.controls.exports import CONTROLS

    return to in CONTROLS and CONTROLS[to].folder


def takes_feed(to: str) -> bool:
    """Whether the files hold for one measuring feed, where the map contains the signal delay."""
    from pretravel.controls.exports import CONTROLS

    return to not in CONTROLS or not CONTROLS[to].uses_feed


def _controls(option: str) -> When:
    """The controls that have an option."""

    def names() -> list[str]:
        from pretravel.controls.exports import CONTROLS

        return [name for name, control in CONTROLS.usable().items() if option in control.options]

    return When("to", names)


def _usual(what: str, setting: str) -> str:
    """What a setting is on each control where it is not given."""
    from pretravel.controls.exports import CONTROLS

    usual = {name: control.usual.get(setting, "") for name, control in CONTROLS.usable().items()}
    return f"{what}: {', '.join(f'{name} {words}' for name, words in usual.items() if words)}."


def _controls_without_feed() -> list[str]:
    from pretravel.controls.exports import CONTROLS

    return [name for name in (*CONTROLS.usable(), _RADII_TABLE) if takes_feed(name)]


FormOnControl: TypeAlias = Literal["auto", "formula", "table"] | None
CONTROL_FORM = Field(
    help="formula (exact, for harmonic, mean and physical maps), table (interpolated) or auto: on "
    "linuxcnc the formula; on other controls a table whose error is within the tolerance (0.02 "
    "µm, or half of the map's u if that is more), otherwise the formula. A map without formula "
    "gets a table.",
    words={
        "": "Usual: automatic",
        "auto": "Automatic",
        "formula": "Formula (exact)",
        "table": "Table",
    },
)

_OF_MEANS = (
    "the map is from means at two orientations of the spindle (pretravel reversal): it corrects "
    "means alone. Single touches, as a control makes them, keep the odd lobes of the probe"
)
_WITHOUT_MACHINE = (
    "the map does not contain the scale, squareness and backlash of the machine, and these files "
    "do not correct them: switch on the machine's own compensation, or compensate with pretravel"
)


class Export(Task):
    """Export a map as tables and macros for a control."""

    name = "export"
    example = "pretravel export map.json --to linuxcnc -o subroutines"

    map_file: Annotated[
        Path,
        Field(help="Map: .json, or a .csv table.", positional=True, metavar="MAP", reads=True),
    ]
    to: Annotated[
        str,
        Field(
            help=_control_help,
            names=control_names,
            metavar="CONTROL",
            label="Your control",
            words=_labels,
        ),
    ]
    output: Annotated[
        Path | None,
        Field(
            help=_output_help,
            short="-o",
            writes=FOLDER,
        ),
    ] = None
    form: Annotated[FormOnControl, replace(CONTROL_FORM, only=(_controls("form"),))] = None
    tolerance_um: Annotated[
        float | None,
        Field(
            help="Largest deviation of the interpolated table from the map, in µm; by default "
            "0.02. With --form auto half of the map's u also suffices.",
            only=(_controls("tolerance"),),
            without=(When("form", ("formula",)),),
            range=(1e-6, 1000.0),
            label="Largest deviation from the map",
            hint="Empty: 0.02 µm, or half of the map's u if that is more",
        ),
    ] = None
    base: Annotated[
        int | None,
        Field(
            help=partial(_usual, "First variable", "base"),
            range=(0, 100_000),
            only=(_controls("base"),),
            without=(When("form", ("formula",)),),
            label="First variable",
            hint="Empty: the usual one",
        ),
    ] = None
    program: Annotated[
        int | None,
        Field(
            help=partial(_usual, "Number of the (first) program", "program"),
            only=(_controls("program"),),
            range=(1, 9_999),
            metavar="NUMBER",
            label="Number of the first program",
            hint="Empty: the usual one",
        ),
    ] = None
    tool: Annotated[ToolOfSubroutines, InModes(only=(_controls("tool"),))] = None
    stylus_length: Annotated[
        StylusOfSubroutines | None, InModes(only=(_controls("stylus_length"),))
    ] = None
    units: Annotated[
        Units | None,
        Field(
            help="Unit of the table and of the programs that use it; mm by default.",
            only=(_controls("units"),),
            label="Unit of the table",
            words={"": "Usual: millimetres", "mm": "Millimetres", "inch": "Inches"},
        ),
    ] = None
    angles: Annotated[
        Literal["normals", "travel"] | None,
        Field(
            help="Meaning of the angles on the control: azimuths of outward normals (default) or "
            "of directions of travel.",
            only=(_controls("angles"),),
            label="Angles are those of",
            words={
                "": "Usual: outward normals",
                "normals": "Outward normals",
                "travel": "Directions of travel",
            },
        ),
    ] = None
    criterion: Annotated[
        Literal["max", "rms"] | None,
        Field(
            help="The residual to minimise, the largest (max, the default) or the rms.",
            only=(_controls("criterion"),),
            label="Residual to minimise",
            words={
                "": "Usual: largest error",
                "max": "Largest error",
                "rms": "Mean square error",
            },
        ),
    ] = None
    template: Annotated[
        Path | None,
        Field(
            help="The template to fill in.",
            reads=True,
            only=(_controls("template"),),
            without=("show_template",),
        ),
    ] = None
    show_template: Annotated[
        bool, Field(help="Print the template to edit.", only=(_controls("template"),))
    ] = False
    azimuth_deg: Annotated[
        float | None,
        Field(
            help="Azimuth of all touches, in degrees; by default the mean over the azimuths.",
            only=(_controls("azimuth"),),
            without=("show_template",),
            range=ANGLE,
            label="Azimuth of all touches",
            hint="Empty: the mean over the azimuths",
        ),
    ] = None
    feed: Annotated[
        float | None,
        Field(
            help="Measuring feed, in mm/min, for tables of a map that contains the signal delay; "
            "the subroutines for linuxcnc use the feed of each touch.",
            only=(When("to", _controls_without_feed),),
            without=("show_template",),
            range=FEED_OR_NONE,
            label="Measuring feed",
            hint="Only for touches at several feeds",
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm; the default is that of the map.",
            range=TIP_BALL,
            without=("show_template",),
        ),
    ] = None

    @classmethod
    def needed_outputs(cls, stated: Mapping[str, Any]) -> tuple[str, ...]:
        """The files, unless the template alone is shown."""
        return () if stated.get("show_template") else ("output",)

    def endings(self, output: str) -> tuple[str, ...]:
        """One file has the ending that its control wants, which we do not know; or is a table."""
        from pretravel.controls.exports import CONTROLS

        if makes_folder(self.to):
            return super().endings(output)
        own = "" if self.output is None else self.output.suffix.lower()
        usual = ".csv" if self.to == _RADII_TABLE else CONTROLS[self.to].ending
        return (usual if usual in (".csv", ".json") else own,)

    def run(self, progress: Progress = SILENT) -> ExportedMap | TextResult:
        """Make the files of the map.

        Returns
        -------
        ExportedMap
            Or a text: the template.

        Raises
        ------
        PretravelError
            No output; a setting that the control does not use; a map that it cannot hold.
        """
        del progress
        from pretravel.controls.heidenhain import heidenhain_template
        from pretravel.files import read_map

        if self.show_template:
            return TextResult(heidenhain_template(), heidenhain_template())
        if self.output is None:
            raise PretravelError("no output was given: use -o FILE, or -o FOLDER for several files")
        if self.output.suffix.lower() in _OF_OTHER_FILES:
            raise PretravelError(
                f"cannot write {self.output}: {self.output.suffix} is not an ending of a file for "
                "a control; choose another name",
                inputs=("output",),
            )
        if makes_folder(self.to):
            refuse_no_folder(self.output)
        return self.exported(read_map(self.map_file, tip_diameter=self.tip_diameter))

    def exported(self, pretravel_map: PretravelMap) -> ExportedMap:
        """Make the files of a map that has been read."""
        from pretravel.controls.control import ExportedFiles
        from pretravel.controls.exports import CONTROLS, table_travel
        from pretravel.controls.map_identity import unknown_size
        from pretravel.files import csv_table_text
        from pretravel.maps import effective_radius_table, is_reversal

        control = CONTROLS.get(self.to)
        if control is not None:
            files = control.files(pretravel_map, self._settings(pretravel_map))
        else:
            table = effective_radius_table(pretravel_map, table_travel(pretravel_map, self.feed))
            files = ExportedFiles(
                {"": csv_table_text(table)}, remarks=(_remark_of_csv(pretravel_map),)
            )
        cautions = [] if pretravel_map.machine is None else [_WITHOUT_MACHINE]
        cautions += filter(None, [unknown_size(pretravel_map)])
        if is_reversal(pretravel_map.provenance.orientation):
            cautions.append(_OF_MEANS)
        return ExportedMap(self, files, _statement(self, files), (*files.warnings, *cautions))

    def _settings(self, pretravel_map: PretravelMap) -> ExportSettings:
        from pretravel.controls.control import ExportSettings
        from pretravel.controls.exports import table_travel

        tolerance, azimuth = self.tolerance_um, self.azimuth_deg
        names = (
            "form", "base", "program", "tool", "stylus_length", "units", "angles", "criterion",
            "feed",
        )  # fmt: skip
        given = {name: getattr(self, name) for name in names}
        given |= {
            "tolerance": None if tolerance is None else tolerance * MICROMETRE,
            "azimuth": None if azimuth is None else azimuth * DEGREE,
            "template": None if self.template is None else _read_template(self.template),
        }
        return ExportSettings(
            written=date.today().isoformat(),
            travel=table_travel(pretravel_map, self.feed) if takes_feed(self.to) else 0.0,
            **{name: value for name, value in given.items() if value is not None},
        )


def _remark_of_csv(pretravel_map: PretravelMap) -> str:
    """What the table holds; where its azimuths are not those of the machine, what they are."""
    import numpy as np

    said = "radii in the directions in which the map holds"
    if np.allclose(pretravel_map.rotation, np.eye(3), atol=_SAME_AXES):
        return said
    x, y, z = (
        "({:.4g}, {:.4g}, {:.4g})".format(*np.round(axis, 4) + 0.0)
        for axis in pretravel_map.rotation.T
    )
    return (
        f"{said}. Angles are those of the probe: polar 0° is {z}, at polar 90° azimuth 0° is {x} "
        f"and 90° is {y}, in axes of the machine"
    )


_SAME_AXES = 1e-3
"""Of a component of an axis of the probe."""


def _read_template(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PretravelError(f"{path}: cannot be read as text: {error}") from None


_NAMED = 4
"""Files; of more than these the first and the last are named."""


def _statement(task: Export, files: ExportedFiles) -> str:
    """Names of the files, and what they state."""
    names = sorted(files.texts)
    several = f"{len(names)} files, {names[0]} to {names[-1]}"
    made = f"{task.output or ''}: {several if len(names) > _NAMED else ', '.join(names)}".rstrip()
    separator = " " if len(files.remarks) == 1 and not makes_folder(task.to) else "\n"
    return separator.join([made, "\n".join(files.remarks)]) + "\n"


@dataclass(frozen=True, eq=False)
class ExportedMap(Result):
    """The files of a map for a control.

    Attributes
    ----------
    task : Export
    files : ExportedFiles
    text : str
        Names of the files, and what they state.
    cautions : tuple of str
    """

    task: Export
    files: ExportedFiles
    text: str
    cautions: tuple[str, ...] = ()

    def write(self, output: str, path: Path) -> None:
        """Write the one text to a file, or each text to a folder; what they replace is removed."""
        del output
        from pretravel.base import write_text, write_texts

        if "" in self.files.texts:
            write_text(path, self.files.texts[""])
            return
        write_texts(path, self.files.texts, "ascii")
        for name in self.files.obsolete:
            (path / name).unlink(missing_ok=True)
