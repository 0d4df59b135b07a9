from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.arguments import Vector, vector
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.showing import save_page, save_picture, show

if TYPE_CHECKING:
    from pretravel.maps.pretravel_map import PretravelMap


def plan_touches(
    map_file: Annotated[Path, typer.Option("--map", help="Map of pretravel qualify, .json.")],
    count: Annotated[
        int, typer.Option(min=1, max=100_000, help="Number of touches, each in its own direction.")
    ] = 9,
    normals: Annotated[
        Path | None,
        typer.Option(
            help="Directions for which the map is needed: touches or targets of a part, .csv with "
            "nx,ny,nz. Without it, all directions of the map."
        ),
    ] = None,
    history: Annotated[
        Path | None,
        typer.Option(
            help="History of the probe, .sqlite (see pretravel verify): how much it drifts. "
            "Without it, a usual drift is assumed."
        ),
    ] = None,
    diameter: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=10000.0,
            help="Diameter of the sphere, in mm; that of the map's qualification by default.",
        ),
    ] = None,
    center: Annotated[
        Vector,
        typer.Option(
            parser=vector,
            metavar="X,Y,Z",
            help="Centre of the sphere in the machine's frame, in mm.",
        ),
    ] = Vector(0, 0, 0),
    clearance: Annotated[
        float,
        typer.Option(
            min=0.0, max=10000.0, help="Distance of tip and sphere where a touch starts, in mm."
        ),
    ] = 5.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Targets: .csv; or a page, .html or .pdf.")
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Choose the few touches on the reference that keep an old map good.

    Give the touches to pretravel qualify --prior.

    Example: pretravel plan-touches --map map.json --count 9 -o targets.csv
    """
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.history_drift import drift_of_history
    from pretravel.files.map_file import read_map
    from pretravel.files.plan_csv import pattern_table
    from pretravel.files.probe_history import read_history
    from pretravel.files.touches_csv import read_normals
    from pretravel.qualification.probe_drift import ProbeDrift
    from pretravel.qualification.touch_plan import plan_touches as chosen_touches
    from pretravel.tasks.reports.touch_plan_report import touch_plan_document

    check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], [map_file, normals, history])
    old_map = read_map(map_file)
    _refuse_ring(old_map)
    drift = ProbeDrift() if history is None else drift_of_history(read_history(history))
    plan = chosen_touches(
        old_map, count, normals=None if normals is None else read_normals(normals), drift=drift
    )
    report = touch_plan_document(plan, map_name=map_file.name)
    save_page(report, output)
    if output is not None and not is_page(output):
        retreat = old_map.tip_radius + clearance
        radius = 0.5 * _diameter(old_map, diameter)
        write_csv_table(output, pattern_table(plan.normals, center, radius, retreat))
    save_picture(report, plot)
    show(report, verbose=verbose)


def _refuse_ring(old_map: PretravelMap) -> None:
    setup = old_map.provenance.setup
    if setup is not None and setup.ring:
        raise PretravelError(
            "this map was made in a ring gauge: its few directions are best touched evenly around; "
            "qualify with a prior takes them"
        )


def _diameter(old_map: PretravelMap, diameter: float | None) -> float:
    setup = old_map.provenance.setup
    if diameter is not None:
        return diameter
    if setup is None:
        raise PretravelError(
            "the map does not state the diameter of its reference; give it", inputs=("diameter",)
        )
    return setup.diameter
