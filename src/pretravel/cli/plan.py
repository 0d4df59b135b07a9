from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, pair, unit_vector, working
from pretravel.cli.options import Picture


def plan(
    surface: Annotated[
        str, typer.Argument(help="part.step#face, part.step for all faces, sphere:…, convex, …")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Targets: .csv.")],
    grid: Annotated[
        str | None, typer.Option(help="Points along u and v of each face: 10x8.")
    ] = None,
    spacing: Annotated[
        float | None, typer.Option(help="Largest distance of neighbours, mm.")
    ] = None,
    curvature: Annotated[
        float | None,
        typer.Option(help="Closer where it is curved: largest height over a chord, µm."),
    ] = None,
    margin: Annotated[float, typer.Option(help="Distance kept from edges, mm.")] = 1.0,
    u: Annotated[str | None, typer.Option(help="Range of u, from,to.")] = None,
    v: Annotated[str | None, typer.Option(help="Range of v, from,to.")] = None,
    max_polar: Annotated[
        float, typer.Option(help="Normals further than this from the probe axis are left out, °.")
    ] = 90.0,
    axis: Annotated[
        str, typer.Option(help="Direction x,y,z of the probe axis, up to the spindle.")
    ] = "0,0,1",
    plot: Picture = None,
) -> None:
    """Choose points of a surface to touch: targets for simulate, or for a machine.

    Example: pretravel plan part.step#1 --spacing 3 -o plan.csv --plot plan.png
    """
    import math

    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.plan_csv import plan_table
    from pretravel.probing.inspection import plan_inspection
    from pretravel.surface.specification import parse_surface, source_file
    from pretravel.units import DEGREE, MICROMETRE

    check_files([(output, (".csv",)), (plot, PICTURES)], source_file(surface))
    counts = None
    if grid is not None:
        words = grid.lower().split("x")
        if len(words) != 2 or not all(word.strip().isdigit() for word in words):
            raise PretravelError(f"--grid {grid}: expected points along u x points along v, 10x8")
        counts = (int(words[0]), int(words[1]))
    if not 0.0 < max_polar <= 180.0:
        raise PretravelError(f"--max-polar {max_polar:g}: it lies between 0 and 180 degrees")
    shape = parse_surface(surface)
    with working(f"planning on {surface}"):
        chosen = plan_inspection(
            shape,
            grid=counts,
            spacing=spacing,
            curvature=None if curvature is None else curvature * MICROMETRE,
            margin=margin,
            u_range=None if u is None else pair(u, "--u"),
            v_range=None if v is None else pair(v, "--v"),
            largest_polar=max_polar * DEGREE,
            axis=unit_vector(axis, "--axis"),
        )
    write_csv_table(output, plan_table(chosen))
    if plot is not None:
        from pretravel.report.plotting import save
        from pretravel.report.surface_pictures import plot_plan

        save(plot_plan(chosen, shape, f"Targets on {surface}"), plot)
    steepest = math.degrees(math.acos(float(min(max(chosen.normal[:, 2].min(), -1.0), 1.0))))
    typer.echo(f"{len(chosen)} targets, normals up to {steepest:.1f}° from z")
    if len(set(chosen.face.tolist())) > 1:
        typer.echo("Which of them can be reached: pretravel simulate … --stem --leave-out")
    for reason, count in chosen.left_out.items():
        typer.echo(f"Warning: {count} points left out: {reason}", err=True)
