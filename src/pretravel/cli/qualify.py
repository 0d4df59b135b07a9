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
from pretravel.cli.options import Picture, Verbose
from pretravel.cli.showing import save_picture, show


def qualify(
    touches: Annotated[
        Path, typer.Argument(help="CSV: x_mm,y_mm,z_mm,nx,ny,nz; or a log of our programs.")
    ],
    diameter: Annotated[
        float, typer.Option(help="Calibrated diameter of the sphere (or ring), mm.")
    ],
    tip_diameter: Annotated[
        float | None,
        typer.Option(help="Diameter of the tip, mm; without it the map is relative to its mean."),
    ] = None,
    kind: Annotated[
        str,
        typer.Option(
            help="Kind of map: harmonic; physical (a six-seat probe, fitted); wozniak (one "
            "constant); mean (one radius); sectors (a table); auto: the one that predicts "
            "left-out touches best."
        ),
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
    lobe_azimuth: Annotated[
        float | None,
        typer.Option(
            help="Kind wozniak: azimuth of largest pretravel, opposite a rod, degrees; found from "
            "8 directions or more."
        ),
    ] = None,
    transducer: Annotated[
        str, typer.Option(help="Kind wozniak: contact (lobes) or piezo (none).")
    ] = "contact",
    axis: Annotated[
        str, typer.Option(help="Probe axis x,y,z, tip to spindle, in the machine's frame.")
    ] = "0,0,1",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Map: .nc (to use), .csv or .json; or a page, .html."),
    ] = None,
    plot: Picture = None,
    verbose: Verbose = False,
) -> None:
    """Qualify a probe on a reference sphere or ring: centre, radius, map, uncertainty.

    Touches at two or more feeds (column feed_mm_min) tell the signal delay apart.

    Example: pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.nc
    """
    from pretravel.errors import PretravelError
    from pretravel.formats.logs.detection import read_touches_of
    from pretravel.formats.map_file import write_map
    from pretravel.identification.kinds import choose, physical_warnings
    from pretravel.report.page import write_page
    from pretravel.report.qualification_report import qualification_document
    from pretravel.units import DEGREE, MICROMETRE

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
    if kind not in ("wozniak", "auto") and (lobe_azimuth is not None or transducer != "contact"):
        raise PretravelError("--lobe-azimuth and --transducer go with --kind wozniak")
    if lobe_azimuth is not None and transducer == "piezo":
        raise PretravelError("a piezo probe has no lobes: leave --lobe-azimuth out")
    readings = read_touches_of(touches, machine_axes=True)
    measured = readings.touches
    with working(f"qualifying on {len(measured)} touches"):
        choice = choose(
            measured,
            diameter,
            kind=kind,
            lobe_azimuth=None if lobe_azimuth is None else lobe_azimuth * DEGREE,
            transducer=transducer,
            ring=ring,
            tip_diameter=tip_diameter,
            u_diameter=u_diameter * MICROMETRE,
            axial_pretravel=axial,
            axis=unit_vector(axis, "--axis"),
        )
    result = choice.qualification
    report = qualification_document(
        result,
        touches_name=touches.name,
        scores=choice.scores,
        warnings=[*readings.notes(), *physical_warnings(result)],
    )
    if output is not None and output.suffix.lower() == ".html":
        write_page(output, report)
    elif output is not None:
        write_map(output, result.pretravel_map)
    save_picture(report, plot)
    show(report, verbose=verbose)
