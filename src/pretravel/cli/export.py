from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import ANGLE, TIP_BALL, limits
from pretravel.base.units import DEGREE
from pretravel.cli.arguments import one_of
from pretravel.cli.files import check_files


def _controls() -> list[str]:
    from pretravel.tasks.export import control_names

    return control_names()


def export(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="Map: .json, or a .csv table.")],
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

    Example: pretravel export map.json --to linuxcnc -o subroutines
    """
    from pretravel.base.units import MICROMETRE
    from pretravel.controls.heidenhain import heidenhain_template
    from pretravel.files.map_file import read_map
    from pretravel.tasks.export import (
        ExportWish,
        export_map,
        makes_folder,
        misapplied,
        write_export,
    )

    if show_template:
        typer.echo(heidenhain_template(), nl=False)
        return
    if output is None:
        raise PretravelError("no output was given: use -o FILE, or -o FOLDER for several files")
    wish = ExportWish(
        base=base,
        program=program,
        units=units,
        angles=angles,
        template=None if template is None else "",  # it is read when the options are right
        azimuth=None if azimuth is None else azimuth * DEGREE,
        form=form,
        criterion=criterion,
        tolerance=None if tolerance is None else tolerance * MICROMETRE,
        feed=feed,
    )
    if wrong := misapplied(to, wish):
        raise PretravelError(f"--{wrong}")
    _check_output(output, [map_file, template], to)
    if template is not None:
        wish = replace(wish, template=_read_template(template))
    pretravel_map = read_map(map_file, tip_diameter=tip_diameter)
    files = export_map(pretravel_map, to, wish, written=date.today().isoformat())
    write_export(output, files)
    made = f"{output}: {', '.join(sorted(files.texts))}".rstrip()
    separator = " " if len(files.remarks) == 1 and not makes_folder(to) else "\n"
    typer.echo(separator.join([made, "\n".join(files.remarks)]))
    for warning in files.warnings:
        typer.echo(f"Warning: {warning}", err=True)


def _check_output(output: Path, inputs: Sequence[Path | None], to: str) -> None:
    from pretravel.tasks.export import RADII_TABLE, makes_folder

    if not makes_folder(to):
        is_table = to == RADII_TABLE
        ending = ".csv" if is_table else output.suffix.lower()
        check_files([(output, (ending,))], inputs, programs=not is_table)
    elif output.suffix or output.is_file():
        raise PretravelError(f"-o {output}: a folder is needed, for several files")
    elif not output.parent.is_dir():
        raise PretravelError(f"cannot make {output}: the folder {output.parent} does not exist")


def _read_template(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PretravelError(f"{path}: cannot be read as text: {error}") from None
