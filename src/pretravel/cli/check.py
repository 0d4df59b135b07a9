from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from pretravel.cli.arguments import Vector, one_of, vector
from pretravel.cli.files import PICTURES, check_files
from pretravel.cli.options import Diameter, Picture, ProbeAxis


def _standards() -> list[str]:
    from pretravel.laboratory.standards import CHECKS

    return list(CHECKS)


Standard: TypeAlias = Annotated[
    str,
    typer.Argument(
        parser=one_of(_standards),
        metavar="STANDARD",
        help="iso10360-5 (25 touches on a sphere) or iso230-10 (36 on the equator).",
    ),
]


def check(
    standard: Standard,
    touches: Annotated[
        Path, typer.Argument(help="Touches on a sphere, .csv: x_mm,y_mm,z_mm,nx,ny,nz.")
    ],
    diameter: Diameter,
    tip_diameter: Annotated[
        float | None,
        typer.Option(
            help="Effective diameter of the tip, as the machine uses it, in mm, for the size error."
        ),
    ] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map", help="Compensate with this map.")
    ] = None,
    form_limit: Annotated[
        float | None,
        typer.Option(min=0.0, max=1e6, help="Maximum permissible form error, in µm."),
    ] = None,
    size_limit: Annotated[
        float | None,
        typer.Option(min=0.0, max=1e6, help="Maximum permissible size error, in µm (iso10360-5)."),
    ] = None,
    repeat_limit: Annotated[
        float | None,
        typer.Option(
            min=0.0, max=1e6, help="Maximum permissible range of repeats, in µm (iso230-10)."
        ),
    ] = None,
    u_diameter: Annotated[
        float,
        typer.Option(
            "--u-diameter", min=0.0, max=1e6, help="Standard uncertainty of the diameter, in µm."
        ),
    ] = 0.0,
    sphere_form: Annotated[
        float, typer.Option(min=0.0, max=1e6, help="Form error of the sphere, in µm.")
    ] = 0.0,
    axis: ProbeAxis = Vector(0, 0, 1),
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Figures: .csv or .json; or .html.")
    ] = None,
    plot: Picture = None,
) -> None:
    """Determine the probing errors of a standard, from touches on a reference sphere.

    The definitions are recalled, not checked against the texts of the standards.

    Example: pretravel check iso10360-5 touches.csv --diameter 25 --tip-diameter 6 -o check.html
    """
    import json

    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.logs.detection import read_touches_of
    from pretravel.formats.map_file import read_map
    from pretravel.laboratory.standards import CHECKS, CalibratedSphere
    from pretravel.report.laboratory_pictures import plot_check
    from pretravel.report.laboratory_words import standard_report
    from pretravel.units import MICROMETRE
    from pretravel.whole_file import whole_file

    check_files(
        [(output, (".csv", ".json", ".html")), (plot, PICTURES)],
        [touches, map_file],
    )
    if standard == "iso10360-5" and repeat_limit is not None:
        raise PretravelError("--repeat-limit goes with iso230-10; iso10360-5 has no such figure")
    if standard == "iso230-10" and (size_limit is not None or u_diameter):
        raise PretravelError("--size-limit and --u-diameter go with iso10360-5, which has a size")
    if size_limit is not None and tip_diameter is None and map_file is None:
        raise PretravelError("--size-limit asks for a size error: give --tip-diameter or --map")
    measured = read_touches_of(touches, machine_axes=True).touches
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip_diameter)
    limits = {
        name: limit * MICROMETRE
        for name, limit in (
            ("form", form_limit),
            ("form2d", form_limit),
            ("form3d", form_limit),
            ("size", size_limit),
            ("repeatability", repeat_limit),
        )
        if limit is not None
    }
    result = CHECKS[standard](
        measured,
        CalibratedSphere(diameter, u_diameter * MICROMETRE, sphere_form * MICROMETRE),
        tip_diameter=tip_diameter,
        pretravel_map=pretravel_map,
        axis=axis,
        limits=limits,
    )
    report = standard_report(result)
    rows = [
        {
            "figure": figure.name,
            "value_um": figure.value / MICROMETRE,
            "u_test_um": figure.u_test / MICROMETRE,
            "limit_um": None if figure.limit is None else figure.limit / MICROMETRE,
            "verdict": figure.verdict,
            "definition": figure.status,
        }
        for figure in result.figures
    ]
    if output is not None and output.suffix.lower() == ".csv":
        columns = {
            name: ["" if row[name] is None else row[name] for row in rows] for name in rows[0]
        }
        write_csv_table(output, columns)  # type: ignore[arg-type]
    elif output is not None and output.suffix.lower() == ".json":
        document = {"standard": result.standard, "figures": rows, "notes": list(result.notes)}
        with whole_file(output) as temporary:
            temporary.write_text(json.dumps(document, indent=1), encoding="utf-8")
    elif output is not None:
        from pretravel.report.page import write_text_page

        title = f"pretravel check {standard}: {touches.name}"
        write_text_page(output, title, [("Result", report)], {"Residuals": plot_check(result)})
    if plot is not None:
        from pretravel.report.style import save

        save(plot_check(result, f"{touches.name}: {result.standard}"), plot)
    if pretravel_map is not None:
        from pretravel.compensation.compensation import apply
        from pretravel.compensation.point_errors import measured_sphere
        from pretravel.report.laboratory_words import sphere_report

        points = apply(measured, pretravel_map)
        report += "\n\nThe sphere through all touches, compensated\n"
        report += sphere_report(measured_sphere(measured, points, pretravel_map))
    typer.echo(report)
    if limits and not (u_diameter or sphere_form):
        typer.echo(
            "Warning: without --u-diameter and --sphere-form the reference counts as perfect, and "
            "verdicts have no uncertainty zone",
            err=True,
        )


def pattern(
    standard: Standard,
    diameter: Annotated[
        float, typer.Option(min=0.001, max=1000.0, help="Diameter of the sphere, in mm.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Targets: .csv.")],
    center: Annotated[
        Vector,
        typer.Option(
            parser=vector,
            metavar="X,Y,Z",
            help="Centre of the sphere in the machine's frame, in mm.",
        ),
    ] = Vector(0, 0, 0),
    tip_diameter: Annotated[
        float,
        typer.Option(
            min=0.001,
            max=1000.0,
            help="Diameter of the tip, in mm, for the positions where touches start.",
        ),
    ] = 6.0,
    clearance: Annotated[
        float,
        typer.Option(
            min=0.0, max=10000.0, help="Distance of tip and sphere where a touch starts, in mm."
        ),
    ] = 5.0,
    repeats: Annotated[
        int,
        typer.Option(min=1, max=1000, help="Touches of each direction, one after the other."),
    ] = 1,
    turn: Annotated[
        float, typer.Option(help="Rotation of the pattern about the probe axis, in degrees.")
    ] = 0.0,
    axis: ProbeAxis = Vector(0, 0, 1),
) -> None:
    """Write the touches of a standard as targets, for simulate or for a machine's program.

    Each touch starts with the tip centre at start_x_mm,… and moves along -n.

    Example: pretravel pattern iso10360-5 --diameter 25 -o targets.csv
    """
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.plan_csv import pattern_table
    from pretravel.laboratory.standards import PATTERNS
    from pretravel.units import DEGREE

    check_files([(output, (".csv",))])
    columns = pattern_table(
        PATTERNS[standard](),
        center,
        0.5 * diameter,
        0.5 * tip_diameter + clearance,
        axis=axis,
        turn=turn * DEGREE,
        repeats=repeats,
    )
    write_csv_table(output, columns)
    count = len(columns["label"])  # type: ignore[arg-type]
    typer.echo(f"{count} targets on a sphere of {diameter:g} mm (pattern recalled, not verified)")
