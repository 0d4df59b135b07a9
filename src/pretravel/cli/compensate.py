from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.quantities import TIP_BALL, limits
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import Frame, ModelName, PictureFile, Place, Verbose, part_in_machine
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.cli.touch_files import (
    DecimalSign,
    Exclude,
    FeedOfTouches,
    FileUnits,
    RunPlan,
    TableColumns,
    TouchFiles,
    files_of_touches,
    read_and_show,
    reading_options,
    table_in_parts,
    with_reading,
)

if TYPE_CHECKING:
    from pretravel.files.long_table import LongTable
    from pretravel.maps.pretravel_map import PretravelMap
    from pretravel.show.document import Document
    from pretravel.tasks.compensate import CompensationSetup


def compensate(
    touches: TouchFiles,
    map_file: Annotated[
        str,
        typer.Option(
            "--map",
            help="Map from qualify or predict: .json, or a .csv table; or a probe (catalogue name or "
            ".toml), whose map is predicted.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help="Surface points: .csv, .parquet, .nc, .json, .qif, .msr (Fusion); or a "
            "page, .html or .pdf.",
        ),
    ],
    nominal: Annotated[
        str | None,
        typer.Option(
            help="Nominal surface: part.step, part.step#face, plane:…, sphere:… (as in simulate); "
            "the contact is computed on it. Without it, the normals are those of the touches, and "
            "deviations refer to the columns nominal_x_mm…, where these exist."
        ),
    ] = None,
    tip_diameter: Annotated[
        float | None,
        typer.Option(
            **limits(TIP_BALL),
            help="Diameter of the tip, in mm; the default is that of the map.",
        ),
    ] = None,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="Allow directions outside the map.")
    ] = False,
    model: ModelName = "analytic",
    feed: FeedOfTouches = None,
    exclude: Exclude = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    plan: RunPlan = None,
    place: Place = None,
    frame: Frame = "part",
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Compensate touches to surface points with uncertainties.

    Example: pretravel compensate part.csv --map map.json --nominal part.step -o points.csv
    --plot points.png
    """
    from pretravel.files.point_files import point_endings
    from pretravel.surface.specification import parse_surface, source_file
    from pretravel.tasks.compensate import CompensationSetup, compensate_readings
    from pretravel.tasks.map_argument import map_or_prediction

    files, name = files_of_touches(touches)
    surfaces = [] if nominal is None else source_file(nominal)
    check_files(
        [(output, (*point_endings(), *PAGES)), (plot, PICTURES)],
        [*files, map_file, plan, *surfaces],
    )
    placement = part_in_machine(place, frame)
    pretravel_map = map_or_prediction(map_file, model, tip_diameter=tip_diameter)
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        exclude=exclude,
        plan=plan,
        tip_diameter=2.0 * pretravel_map.tip_radius,
    )
    setup = CompensationSetup(
        None if nominal is None else parse_surface(nominal),
        extrapolate,
        # Without --place, a log states the rotation of its work coordinates.
        None if place is None else placement,
        frame,
        feed,
    )
    table = table_in_parts(files, options, output)
    if table is not None:
        report = _long_table_compensated(table, pretravel_map, setup, output)
    else:
        readings = read_and_show(files, options)
        with working(f"compensating {len(readings.touches)} touches"):
            result = compensate_readings(readings, pretravel_map, setup)
        report = result.document(name)
        save_page(with_reading(report, readings), output)
        if not is_page(output):
            result.write(output, name, Path(map_file).name)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _long_table_compensated(
    table: LongTable, pretravel_map: PretravelMap, setup: CompensationSetup, output: Path
) -> Document:
    """Compensate a long table; the points are in the output."""
    from pretravel.tasks.long_tables import compensate_long_table

    with working(f"compensating about {table.count:,} touches"):
        result = compensate_long_table(table, pretravel_map, setup, output)
    if result.reading:
        typer.echo(f"read: {result.reading}")
    return result.document(table.path.name)
