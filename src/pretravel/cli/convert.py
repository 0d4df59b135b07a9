from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pretravel.base.quantities import DISTANCE, FEED, TIP_BALL, limits
from pretravel.cli.arguments import Vector, one_of, vector
from pretravel.cli.files import PAGES, check_files, is_page
from pretravel.cli.showing import save_page, show
from pretravel.cli.touch_files import (
    DecimalSign,
    Exclude,
    FileUnits,
    TableColumns,
    TouchFiles,
    files_of_touches,
    read_and_show,
    run_plan,
)

if TYPE_CHECKING:
    from pretravel.controls.machine import Machine
    from pretravel.files.file_format import (
        FeatureResult,
        FileReadings,
        ReadingOptions,
    )
    from pretravel.touches import Touches


def _formats() -> list[str]:
    from pretravel.files.format_registry import FORMATS

    return list(FORMATS)


def convert(
    readings: TouchFiles,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Touches: .csv, .parquet, .qif; .msr or .txt for Fusion. Without it, a preview; "
            "which is also a page, .html or .pdf.",
        ),
    ] = None,
    file_format: Annotated[
        str | None,
        typer.Option(
            "--from",
            parser=one_of(_formats),
            metavar="FORMAT",
            help="Format of the file (pretravel formats lists them); the default is detected.",
        ),
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(
            help="The targets that were touched, .csv, for files that contain positions only."
        ),
    ] = None,
    machine: Annotated[
        Path | None,
        typer.Option(
            help="Machine file: tip diameter, and the overtravel, which identifies misses."
        ),
    ] = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    exclude: Exclude = None,
    tip_diameter: Annotated[
        float | None, typer.Option(**limits(TIP_BALL), help="Diameter of the tip, in mm.")
    ] = None,
    offset: Annotated[
        Vector | None,
        typer.Option(
            parser=vector,
            metavar="X,Y,Z",
            help="Origin of the work coordinates in machine coordinates, in mm, for grbl logs.",
        ),
    ] = None,
    radius_taken_off: Annotated[
        float | None,
        typer.Option(
            **limits(DISTANCE),
            help="DMIS: tip radius that was subtracted from its points, in mm; 0: tip centres.",
        ),
    ] = None,
    frame: Annotated[
        Literal["work", "machine"] | None,
        typer.Option(help="Axes of the touches, where the work coordinates were rotated."),
    ] = None,
    feed: Annotated[
        float | None,
        typer.Option(
            **limits(FEED), help="Feed of the touches, in mm/min, where the file states none."
        ),
    ] = None,
) -> None:
    """Read a table or a file of a control, CMM or CAM system, and write touches.

    Without -o it shows how the file is understood: its first rows, and what is missing.

    Positions without normals are joined with the plan by geometry: each position lies on the
    line of a target.

    Example: pretravel convert probe.txt --units mm --plan plan.csv --machine mill.toml -o t.csv
    """
    from pretravel.base.errors import PretravelError
    from pretravel.files.file_format import ReadingOptions
    from pretravel.files.machine_file import read_machine
    from pretravel.files.readings import touch_endings
    from pretravel.files.source_file import opened
    from pretravel.tasks.look import format_of_touches

    files, _ = files_of_touches(readings)
    check_files([(output, (*touch_endings(), *PAGES))], [*files, plan, machine])
    known_machine = None if machine is None else read_machine(machine)
    if tip_diameter is None and known_machine is not None:
        tip_diameter = known_machine.tip_diameter
    options = ReadingOptions(
        plan=None if plan is None else run_plan(plan, units),
        units=units,
        tip_radius=None if tip_diameter is None else 0.5 * tip_diameter,
        overtravel=None if known_machine is None else known_machine.overtravel,
        offset=offset,
        radius_taken_off=radius_taken_off,
        rotation=_work_rotation(known_machine),
        columns=columns,
        decimal=decimal,
        exclude=tuple(exclude or ()),
    )
    if output is None or is_page(output):
        _preview(files, options, file_format, output)
        return
    file = opened(files[0])
    known = format_of_touches(file, options, file_format=file_format)
    if known.parse_features is not None:
        if output.suffix.lower() != ".csv":
            raise PretravelError("a print-out is converted to a table of features: -o features.csv")
        features = known.parse_features(file, options)
        _write_features(features, output)
        typer.echo(f"{len(features)} results of features (mm, degrees): no touches to compensate")
        return
    found = read_and_show(files, options, file_format=known.name if columns else file_format)
    _write(found, output, frame, feed, tip_diameter)
    typer.echo(f"{len(found.touches)} touches ({known.name})")
    for note in found.notes():
        typer.echo(f"Warning: {note}", err=True)


def _preview(
    files: list[Path], options: ReadingOptions, file_format: str | None, output: Path | None
) -> None:
    """Show how files are understood, and what is missing; on a page that of one file."""
    from pretravel.base.errors import PretravelError
    from pretravel.tasks.look import look_at_touches

    if output is not None and len(files) > 1:
        raise PretravelError(
            f"{output}: a page shows the preview of one file, and there are {len(files)}: name one"
        )
    for path in files:
        looked = look_at_touches(path, options, file_format=file_format)
        typer.echo(f"{path}: format {looked.known.name}, {looked.known.what}")
        report = looked.document()
        save_page(report, output)
        show(report, verbose=False)
        if not looked.unit_known:
            typer.echo(
                "\nThe unit: add --units mm or --units inch, here and to the command that uses the "
                "file"
            )


def _work_rotation(machine: Machine | None) -> float | None:
    """Rotation of the work coordinates that a machine file states. [rad]"""
    from pretravel.controls.machine import work_turn

    return None if machine is None or machine.work is None else work_turn(machine.work)


def _write_features(features: list[FeatureResult], output: Path) -> None:
    from pretravel.files.csv_table import write_csv_table

    names = ("component", "feature", "quantity", "nominal", "actual", "deviation")
    write_csv_table(output, {name: [getattr(f, name) for f in features] for name in names})


def _write(
    found: FileReadings,
    output: Path,
    frame: str | None,
    feed: float | None,
    tip_diameter: float | None,
) -> None:
    from pretravel.files.readings import write_readings, written_format
    from pretravel.touches import with_feed

    touches = with_feed(_in_frame(found, frame), feed)
    if not written_format(output).keeps_approaches_and_feeds:
        _warn_of_losses(touches, output)
    radius = found.tip_radius if tip_diameter is None else 0.5 * tip_diameter
    write_readings(output, touches, radius)


def _in_frame(found: FileReadings, frame: str | None) -> Touches:
    """The touches in the machine's axes, or in work coordinates."""
    import math

    from pretravel.base.errors import PretravelError

    if abs(found.rotation) > 1e-9 and frame is None:
        turn = math.degrees(found.rotation)
        raise PretravelError(
            f"the work coordinates were turned by {turn:g}°, which a table cannot state: --frame "
            "machine rotates the touches to the machine's axes (to qualify); --frame work keeps "
            f"them (then use: pretravel compensate --place 0,0,0,0,0,{turn:g})"
        )
    return found.in_machine_axes().touches if frame == "machine" else found.touches


def _warn_of_losses(touches: Touches, output: Path) -> None:
    """Warn of properties of the touches that the format of the output cannot contain."""
    import numpy as np

    from pretravel.files.logs.plain_labels import plain_labels

    lost = []
    if np.max(np.abs(touches.approach_directions + touches.normals)) > 1e-6:
        lost.append("approaches that are not along the normal")
    if touches.feeds is not None:
        lost.append("feeds")
    if touches.spindle is not None:
        lost.append("orientations of the spindle")
    if touches.labels is not None and plain_labels(touches.labels) != touches.labels:
        lost.append("signs of labels other than letters, digits, space, _ . -")
    if lost:
        typer.echo(
            f"Warning: {output.suffix.lower()} cannot contain {' and '.join(lost)}; the output "
            "is without them",
            err=True,
        )


def formats() -> None:
    """List the file formats, and how reading and writing of each was verified.

    Example: pretravel formats
    """
    import textwrap

    from pretravel.files.format_registry import FORMATS

    margin = 2 + max(map(len, FORMATS))
    for name, entry in FORMATS.items():
        typer.echo(f"{name:{margin}s}{entry.what}")
        properties = [
            ("read as", entry.reads),
            ("written from", entry.writes),
            ("needs", entry.needs),
            ("verified against", entry.verified),
            ("refused", entry.refusal),
        ]
        for what, text in properties:
            if text:
                lines = textwrap.wrap(f"{what}: {text}", 80)
                typer.echo("\n".join(f"{'':{margin}s}{line}" for line in lines))
