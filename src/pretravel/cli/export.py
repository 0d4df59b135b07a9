from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pretravel.cli.arguments import one_of
from pretravel.cli.files import check_files, check_folder_of_texts
from pretravel.errors import PretravelError
from pretravel.quantities import ANGLE, TIP_BALL, limits
from pretravel.units import DEGREE

if TYPE_CHECKING:
    from pretravel.controls.exports import ExportedFiles
    from pretravel.maps.pretravel_map import PretravelMap

_RADII = "csv"
"""A table of effective radii, which no control reads directly."""
_TOLERANCE = 0.02
"""Of interpolated tables. [µm]"""


def _controls() -> list[str]:
    from pretravel.controls.exports import CONTROLS

    return [*CONTROLS, _RADII]


def export(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="Map: .nc, or a .csv table.")],
    to: Annotated[
        str,
        typer.Option(
            parser=one_of(_controls),
            metavar="CONTROL",
            help="linuxcnc (subroutines), renishaw (vector radii), fanuc and haas (macro "
            "programs), siemens (840D cycle), heidenhain (from a template, not verified), radii "
            "(JSON: one for each direction of travel, for probing screens), csv (a table of "
            "effective radii). linuxcnc, fanuc, haas and siemens take a folder.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="File; for several files the folder."),
    ] = None,
    form: Annotated[
        Literal["auto", "formula", "table"] | None,
        typer.Option(
            help="linuxcnc: formula (exact: harmonic, mean and physical maps), table "
            "(interpolated) or auto (default)."
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            max=1000.0,
            help="linuxcnc, fanuc, haas, siemens: largest deviation of the interpolated table from "
            "the map, in µm; 0.02 by default.",
        ),
    ] = None,
    base: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=100_000,
            help="First variable: linuxcnc 1050, renishaw 500, fanuc 600, haas 10200 (800 on "
            "controls before NGC).",
        ),
    ] = None,
    program: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=99_999,
            metavar="NUMBER",
            help="Number of the (first) program: renishaw 7799, fanuc and haas 7750.",
        ),
    ] = None,
    units: Annotated[
        Literal["mm", "inch"] | None,
        typer.Option(
            help="renishaw, fanuc, haas, siemens: the unit of the table and of the programs that "
            "use it; mm by default."
        ),
    ] = None,
    angles: Annotated[
        Literal["normals", "travel"] | None,
        typer.Option(
            help="renishaw: what the control takes the angles for, azimuths of outward normals "
            "(default) or of directions of travel."
        ),
    ] = None,
    criterion: Annotated[
        Literal["max", "rms"] | None,
        typer.Option(
            help="renishaw: the residual to minimise, the largest (max, the default) or the rms."
        ),
    ] = None,
    template: Annotated[
        Path | None, typer.Option(help="heidenhain: the template to fill in.")
    ] = None,
    show_template: Annotated[
        bool, typer.Option("--show-template", help="heidenhain: print the template to edit.")
    ] = False,
    azimuth: Annotated[
        float | None,
        typer.Option(
            **limits(ANGLE, DEGREE), help="heidenhain: azimuth of all touches, in degrees."
        ),
    ] = None,
    feed: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1e6,
            help="Measuring feed, in mm/min, for tables of a map that contains the signal delay; "
            "the subroutines for linuxcnc use the feed of each touch.",
        ),
    ] = None,
    tip_diameter: Annotated[
        float | None,
        typer.Option(
            **limits(TIP_BALL),
            help="Diameter of the tip, in mm; the default is that of the map.",
        ),
    ] = None,
) -> None:
    """Export a map as tables and macros for a control.

    Example: pretravel export map.nc --to linuxcnc -o subroutines
    """
    from pretravel.controls.exports import CONTROLS, ExportSettings, table_travel
    from pretravel.controls.heidenhain import heidenhain_template
    from pretravel.formats.map_file import read_map
    from pretravel.units import MICROMETRE

    if show_template:
        typer.echo(heidenhain_template(), nl=False)
        return
    if output is None:
        raise PretravelError("no output was given: use -o FILE, or -o FOLDER for several files")
    control = CONTROLS.get(to)
    given: dict[str, object] = {"base": base, "program": program, "units": units, "angles": angles}
    given |= {"template": template, "azimuth": azimuth, "form": form, "criterion": criterion}
    given["tolerance"] = tolerance
    _check_options(to, given)
    _check_output(output, [map_file, template], folder=control is not None and control.folder)
    pretravel_map = read_map(map_file, tip_diameter=tip_diameter)
    if control is None:
        _write_radii(output, pretravel_map, table_travel(pretravel_map, feed))
        return
    if control.uses_feed and feed is not None:
        raise PretravelError(f"the files for {to} use the feed of each touch: leave --feed out")
    settings = ExportSettings(
        base=base,
        tolerance=(_TOLERANCE if tolerance is None else tolerance) * MICROMETRE,
        form=form or "auto",
        criterion=criterion or "max",
        template=None if template is None else _read_template(template),
        azimuth=None if azimuth is None else azimuth * DEGREE,
        written=date.today().isoformat(),
        travel=0.0 if control.uses_feed else table_travel(pretravel_map, feed),
        feed=feed,
        units=units or "mm",
        angles=angles or "normals",
        program=program,
    )
    files = control.files(pretravel_map, settings)
    _write_files(output, files)
    typer.echo("\n".join(files.remarks))
    for warning in files.warnings:
        typer.echo(f"Warning: {warning}", err=True)


def _check_options(to: str, given: Mapping[str, object]) -> None:
    """Refuse options that the files of a control do not use."""
    from pretravel.controls.exports import CONTROLS

    used = CONTROLS[to].options if to in CONTROLS else frozenset()
    for name in [name for name, value in given.items() if value is not None and name not in used]:
        users = ", ".join(other for other, control in CONTROLS.items() if name in control.options)
        raise PretravelError(f"--{name} does not apply to {to}; it is for {users}")


def _check_output(output: Path, inputs: Sequence[Path | None], *, folder: bool) -> None:
    if not folder:
        check_files([(output, (output.suffix.lower(),))], inputs)
    elif output.suffix or output.is_file():
        raise PretravelError(f"-o {output}: a folder is needed, for several files")
    elif not output.parent.is_dir():
        raise PretravelError(f"cannot make {output}: the folder {output.parent} does not exist")


def _read_template(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PretravelError(f"{path}: cannot be read as text: {error}") from None


def _write_radii(output: Path, pretravel_map: PretravelMap, travel: float) -> None:
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.maps.grid import effective_radius_table

    check_files([(output, (".csv",))])
    write_csv_table(output, effective_radius_table(pretravel_map, travel))
    typer.echo(f"{output}: effective radii over the supported directions")


def _write_files(output: Path, files: ExportedFiles) -> None:
    """Write the one text to `output`, or each text to the folder `output`."""
    from pretravel.whole_file import write_text, write_texts

    if "" in files.texts:
        write_text(output, files.texts[""])
        typer.echo(f"{output}:")
        return
    check_folder_of_texts(output, files.texts, files.obsolete)
    write_texts(output, files.texts, "ascii")
    for name in files.obsolete:
        (output / name).unlink(missing_ok=True)
    typer.echo(f"{output}: {', '.join(sorted(files.texts))}")
