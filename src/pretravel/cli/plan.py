from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.base.quantities import DISTANCE, STEP, limits
from pretravel.base.units import MICROMETRE
from pretravel.cli.arguments import Counts, Pair, Vector, counts, pair
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, ProbeAxis, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def plan(
    surface: Annotated[
        str, typer.Argument(help="part.step#face, part.step for all faces, sphere:…, convex, …")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Targets: .csv; or a page, .html or .pdf.")
    ],
    grid: Annotated[
        Counts | None,
        typer.Option(
            parser=counts, metavar="NUxNV", help="Points along u and v of each face: 10x8."
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(**limits(STEP), help="Largest distance between neighbours, in mm."),
    ] = None,
    curvature: Annotated[
        float | None,
        typer.Option(
            **limits(STEP, MICROMETRE),
            help="Choose closer points where the surface is curved: the largest height of the "
            "surface over the chord between neighbours, in µm.",
        ),
    ] = None,
    margin: Annotated[
        float, typer.Option(**limits(DISTANCE), help="Distance from the edges, in mm.")
    ] = 1.0,
    u: Annotated[
        Pair | None, typer.Option(parser=pair, metavar="FROM,TO", help="Range of u.")
    ] = None,
    v: Annotated[
        Pair | None, typer.Option(parser=pair, metavar="FROM,TO", help="Range of v.")
    ] = None,
    max_polar: Annotated[
        float,
        typer.Option(
            min=0.001,
            max=180.0,
            help="Largest angle between normal and probe axis, in degrees; other points are left "
            "out.",
        ),
    ] = 90.0,
    axis: ProbeAxis = Vector(0, 0, 1),
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Choose points of a surface to touch, as targets for simulate or for a machine.

    Example: pretravel plan part.step#1 --spacing 3 -o plan.csv --plot plan.png
    """
    from pretravel.base.units import DEGREE
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.plan_csv import plan_table
    from pretravel.probing.inspection import InspectionRegion, plan_inspection
    from pretravel.surface.specification import parse_surface, source_file
    from pretravel.tasks.reports.part_report import plan_document

    check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], source_file(surface))
    shape = parse_surface(surface)
    with working(f"planning on {surface}"):
        chosen = plan_inspection(
            shape,
            grid=grid,
            spacing=spacing,
            chord=None if curvature is None else curvature * MICROMETRE,
            region=InspectionRegion(margin, u, v, max_polar * DEGREE, axis),
        )
    if not is_page(output):
        write_csv_table(output, plan_table(chosen))
    report = plan_document(chosen, shape, f"Targets on {Path(surface).name}")
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if len(set(chosen.face.tolist())) > 1:
        typer.echo("Which of them can be reached: pretravel simulate … --stem --leave-out")
