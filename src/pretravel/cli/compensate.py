from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, POINTS, check_files, working
from pretravel.cli.options import Picture


def compensate(
    touches: Annotated[Path, typer.Argument(help="CSV: x_mm,y_mm,z_mm,nx,ny,nz.")],
    map_file: Annotated[
        Path, typer.Option("--map", help="Map from qualify or predict: .nc, or a .csv table.")
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="Surface points: .csv, .nc or .json; or a page, .html."
        ),
    ],
    nominal: Annotated[
        str | None,
        typer.Option(
            help="Nominal surface, plane:… or sphere:…, for deviations; "
            "else the columns nominal_x_mm…, where there are any."
        ),
    ] = None,
    tip_diameter: Annotated[
        float | None, typer.Option(help="Diameter of the tip, mm, if not the map's.")
    ] = None,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="Also for directions outside the map.")
    ] = False,
    plot: Picture = None,
) -> None:
    """Compensate touches: surface points with uncertainties.

    Example: pretravel compensate part.csv --map map.nc -o points.csv --plot points.png
    """
    from pretravel.formats.map_file import read_map
    from pretravel.formats.points import write_points
    from pretravel.formats.touches_csv import read_touches
    from pretravel.metrology.compensation import apply, compensation_warnings
    from pretravel.report import points_report
    from pretravel.surface.specification import parse_surface

    check_files([(output, POINTS), (plot, PICTURES)], [touches, map_file])
    surface = None if nominal is None else parse_surface(nominal)
    measured = read_touches(touches)
    pretravel_map = read_map(map_file, tip_diameter=tip_diameter)
    with working(f"compensating {len(measured)} touches"):
        points = apply(measured, pretravel_map, nominal=surface, extrapolate=extrapolate)
    report = points_report(points)
    warnings = compensation_warnings(measured, points, pretravel_map)
    if output.suffix.lower() == ".html":
        from pretravel.page import write_page
        from pretravel.plotting import plot_points

        title = f"pretravel compensate: {touches.name}"
        sections = [("Result", report), *(("", f"Warning: {w}") for w in warnings)]
        write_page(output, title, sections, {"Compensated points": plot_points(points)})
    else:
        write_points(
            output,
            points,
            f"{touches.name} compensated with {map_file.name} ({pretravel_map.kind}; "
            f"{pretravel_map.provenance.get('source', 'unknown')})",
        )
    if plot is not None:
        from pretravel.plotting import plot_points, save

        save(plot_points(points, f"{touches.name}, compensated"), plot)
    typer.echo(report)
    for warning in warnings:
        typer.echo(f"Warning: {warning}", err=True)
