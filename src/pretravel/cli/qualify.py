from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import (
    MAPS,
    PICTURES,
    check_files,
    number,
    unit_vector,
    working,
)
from pretravel.cli.options import Picture


def qualify(
    touches: Annotated[Path, typer.Argument(help="CSV: x_mm,y_mm,z_mm,nx,ny,nz.")],
    diameter: Annotated[
        float, typer.Option(help="Calibrated diameter of the sphere (or ring), mm.")
    ],
    tip_diameter: Annotated[
        float | None,
        typer.Option(help="Diameter of the tip, mm; without it the map is relative to its mean."),
    ] = None,
    kind: Annotated[
        str, typer.Option(help="Kind of map: harmonic, mean (one radius) or sectors (a table).")
    ] = "harmonic",
    ring: Annotated[bool, typer.Option("--ring", help="The reference is a ring gauge.")] = False,
    u_diameter: Annotated[
        float, typer.Option("--u-diameter", help="Standard uncertainty of the diameter, µm.")
    ] = 0.0,
    axial_pretravel: Annotated[
        str,
        typer.Option(
            help="Pretravel along the axis, µm, to tell the sphere's height from the map's (kind "
            "harmonic); 'none': least-squares centre."
        ),
    ] = "1.0",
    axis: Annotated[
        str, typer.Option(help="Probe axis x,y,z, tip to spindle, in the machine's frame.")
    ] = "0,0,1",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Map: .nc (to use), .csv or .json; or a page, .html."),
    ] = None,
    plot: Picture = None,
) -> None:
    """Qualify a probe on a reference sphere or ring: centre, radius, map, uncertainty.

    Example: pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.nc
    """
    from pretravel.errors import PretravelError
    from pretravel.formats.map_file import write_map
    from pretravel.formats.touches_csv import read_touches
    from pretravel.metrology import qualification
    from pretravel.report import qualification_report
    from pretravel.units import MICROMETRE

    check_files([(output, MAPS), (plot, PICTURES)], [touches])
    if not 0.0 <= u_diameter <= 1000.0:
        raise PretravelError(f"--u-diameter {u_diameter:g}: it lies between 0 and 1000 µm")
    if axial_pretravel.lower() == "none":
        axial = None
    else:
        axial = number(axial_pretravel, "--axial-pretravel") * MICROMETRE
        if not 0.0 <= axial <= 0.1:
            raise PretravelError(
                f"--axial-pretravel {axial_pretravel}: it lies between 0 and 100 µm"
            )
    measured = read_touches(touches)
    with working(f"qualifying on {len(measured)} touches"):
        result = qualification.qualify(
            measured,
            diameter,
            kind=kind,  # type: ignore[arg-type]  # checked there, with a message
            ring=ring,
            tip_diameter=tip_diameter,
            u_diameter=u_diameter * MICROMETRE,
            axial_pretravel=axial,
            axis=unit_vector(axis, "--axis"),
        )
    report = qualification_report(result)
    if output is not None and output.suffix.lower() == ".html":
        from pretravel.page import write_page
        from pretravel.plotting import plot_qualification

        sections = [("Result", report), *(("", f"Warning: {w}") for w in result.warnings)]
        write_page(
            output,
            f"pretravel qualify: {touches.name}",
            sections,
            {f"Map kind {kind}": plot_qualification(result)},
        )
    elif output is not None:
        write_map(output, result.pretravel_map)
    if plot is not None:
        from pretravel.plotting import plot_qualification, save

        save(plot_qualification(result, f"{touches.name}, map kind {kind}"), plot)
    typer.echo(report)
    for warning in result.warnings:
        typer.echo(f"Warning: {warning}", err=True)
