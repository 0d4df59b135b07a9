from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pretravel.cli.arguments import Vector, one_of, vector
from pretravel.cli.files import check_files
from pretravel.cli.options import Units

if TYPE_CHECKING:
    from pretravel.formats.logs.joining import FileReadings

_OUTPUTS = (".csv", ".parquet", ".qif", ".msr", ".txt")


def _formats() -> list[str]:
    from pretravel.formats.logs.detection import FORMATS

    return [entry.name for entry in FORMATS]


def convert(
    readings: Annotated[
        Path, typer.Argument(help="Log or results of a control, CMM or CAM: see pretravel formats.")
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="Touches: .csv, .parquet, .qif; .msr or .txt for Fusion."
        ),
    ],
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
    units: Annotated[
        Units | None, typer.Option(help="Unit of length, for files that do not state it.")
    ] = None,
    tip_diameter: Annotated[float | None, typer.Option(help="Diameter of the tip, in mm.")] = None,
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
            help="DMIS: tip radius that was subtracted from its points, in mm; 0: tip centres."
        ),
    ] = None,
    frame: Annotated[
        Literal["work", "machine"] | None,
        typer.Option(help="Axes of the touches, where the work coordinates were rotated."),
    ] = None,
    feed: Annotated[
        float | None,
        typer.Option(help="Feed of the touches, in mm/min, where the file states none."),
    ] = None,
) -> None:
    """Read a file of a control, CMM or CAM system, and write touches.

    Positions without normals are joined with the plan by geometry: each position lies on the
    line of a target.

    Example: pretravel convert probe.txt --units mm --plan plan.csv --machine mill.toml -o t.csv
    """
    from pretravel.controls.machine import work_turn
    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.logs.detection import format_of, read_readings
    from pretravel.formats.logs.print_file import read_print_file
    from pretravel.formats.machine_file import read_machine
    from pretravel.formats.touches_csv import read_plan

    inputs = [readings, *([plan] if plan else []), *([machine] if machine else [])]
    check_files([(output, _OUTPUTS)], inputs)
    known = None if machine is None else read_machine(machine)
    if tip_diameter is None and known is not None:
        tip_diameter = known.tip_diameter
    kind = file_format or format_of(readings)
    if kind == "print":
        if output.suffix.lower() != ".csv":
            raise PretravelError("a print-out becomes a table of features: -o features.csv")
        features = read_print_file(readings, units)
        write_csv_table(
            output,
            {
                "component": [f.component for f in features],
                "feature": [f.feature for f in features],
                "quantity": [f.quantity for f in features],
                "nominal": [f.nominal for f in features],
                "actual": [f.actual for f in features],
                "deviation": [f.deviation for f in features],
            },
        )
        typer.echo(f"{len(features)} results of features (mm, degrees): no touches to compensate")
        return
    found = read_readings(
        readings,
        kind,
        plan=None if plan is None else read_plan(plan),
        units=units,
        tip_radius=None if tip_diameter is None else 0.5 * tip_diameter,
        overtravel=None if known is None else known.overtravel,
        offset=offset,
        taken_off=radius_taken_off,
        rotation=None if known is None or known.work is None else work_turn(known.work),
    )
    _write(found, output, frame, feed, tip_diameter)
    typer.echo(f"{len(found.touches)} touches ({kind})")
    for note in found.notes():
        typer.echo(f"Warning: {note}", err=True)


def _write(
    found: FileReadings,
    output: Path,
    frame: str | None,
    feed: float | None,
    tip_diameter: float | None,
) -> None:
    import math

    import numpy as np

    from pretravel.errors import PretravelError
    from pretravel.formats.logs.fusion import write_fusion
    from pretravel.formats.logs.qif import write_qif
    from pretravel.formats.touches_csv import write_touches
    from pretravel.touches import moved, with_feed

    touches = found.touches
    if abs(found.rotation) > 1e-9:
        turn = math.degrees(found.rotation)
        if frame is None:
            raise PretravelError(
                f"the work coordinates were turned by {turn:g}°, and a table cannot say so: "
                "--frame machine turns the touches into the machine's axes (to qualify), --frame "
                f"work leaves them (then: pretravel compensate --place 0,0,0,0,0,{turn:g})"
            )
        if frame == "machine":
            touches = moved(touches, found.placement)
    touches = with_feed(touches, feed)
    labels = touches.labels or tuple(str(i + 1) for i in range(len(touches)))
    ending = output.suffix.lower()
    if ending in (".csv", ".parquet"):
        write_touches(output, touches)
        return
    lost = []
    if np.max(np.abs(touches.approach_directions + touches.normals)) > 1e-6:
        lost.append("approaches that are not along the normal")
    if touches.feeds is not None:
        lost.append("feeds")
    if lost:
        typer.echo(
            f"Warning: {ending} has no place for {' and '.join(lost)}; they are not in it", err=True
        )
    radius = found.tip_radius if tip_diameter is None else 0.5 * tip_diameter
    if ending == ".qif":
        write_qif(
            output, touches.positions, touches.normals, labels, compensated=False, tip_radius=radius
        )
        return
    if radius is None:
        raise PretravelError("a Fusion results file tells the tip's radius: give --tip-diameter")
    write_fusion(
        output, touches.positions, touches.normals, touches.nominal_points, labels, radius,
        name=output.stem,
    )  # fmt: skip


def formats() -> None:
    """List the file formats, and how reading and writing of each was verified.

    Example: pretravel formats
    """
    import textwrap

    from pretravel.formats.logs.detection import FORMATS

    for entry in FORMATS:
        typer.echo(f"{entry.name:11s}{entry.what}")
        told = [
            ("read as", entry.reads),
            ("written from", entry.writes),
            ("must be told", entry.needs),
            ("verified against", entry.verified),
        ]
        for name, text in told:
            if text:
                lines = textwrap.wrap(f"{name}: {text}", 85)
                typer.echo("\n".join(f"{'':11s}{line}" for line in lines))
