from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from pretravel.cli.arguments import Vector, one_of, vector
from pretravel.cli.command import ANSWER
from pretravel.cli.files import PAGES, PICTURES, check_files
from pretravel.cli.laboratory_option import (
    LaboratoryFile,
    laboratory_statements,
    statements_left_out,
)
from pretravel.cli.options import Diameter, PictureFile, ProbeAxis, Verbose
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.cli.touch_files import (
    DecimalSign,
    Exclude,
    FileUnits,
    RunPlan,
    TableColumns,
    TouchFiles,
    files_of_touches,
    read_and_show,
    reading_options,
    with_reading,
)
from pretravel.quantities import ANGLE, TIP_BALL, limits
from pretravel.units import DEGREE

if TYPE_CHECKING:
    from pretravel.laboratory.standard_check import StandardCheck
    from pretravel.report.document import Document


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
    touches: TouchFiles,
    diameter: Diameter,
    tip_diameter: Annotated[
        float | None,
        typer.Option(
            **limits(TIP_BALL),
            help="Effective diameter of the tip, as the machine uses it, in mm, for the size "
            "error.",
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
        float | None,
        typer.Option(
            "--u-diameter", min=0.0, max=1e6, help="Standard uncertainty of the diameter, in µm."
        ),
    ] = None,
    sphere_form: Annotated[
        float | None, typer.Option(min=0.0, max=1e6, help="Form error of the sphere, in µm.")
    ] = None,
    exclude: Exclude = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    plan: RunPlan = None,
    axis: ProbeAxis = Vector(0, 0, 1),
    lab: LaboratoryFile = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Figures: .csv or .json; or a page, .html or .pdf."),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Determine the probing errors of a standard, from touches on a reference sphere.

    The definitions are recalled, not checked against the texts of the standards: this is no
    statement of conformity. Exit code 3: a figure exceeds its limit.

    Example: pretravel check iso10360-5 touches.csv --diameter 25 --tip-diameter 6 -o check.html
    """
    from pretravel.formats.map_file import read_map
    from pretravel.jobs.check import CheckSetup, check_probe
    from pretravel.laboratory.standard_check import CalibratedSphere, LimitOutcome
    from pretravel.units import MICROMETRE

    files, name = files_of_touches(touches)
    inputs = [*files, map_file, plan, lab]
    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], inputs)
    statements = laboratory_statements(lab)
    sphere = CalibratedSphere(
        diameter,
        None if u_diameter is None else u_diameter * MICROMETRE,
        None if sphere_form is None else sphere_form * MICROMETRE,
    )
    limits = _limits(form_limit, size_limit, repeat_limit)
    setup = CheckSetup(standard, sphere, tip_diameter, axis, limits)
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        exclude=exclude,
        plan=plan,
        tip_diameter=tip_diameter,
        reference_diameter=diameter,
    )
    readings = read_and_show(files, options).in_machine_axes()
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip_diameter)
    found = check_probe(readings, setup, pretravel_map)
    lacking = _not_stated(found.result)
    left_out = statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = found.document(name, warnings=[*lacking, *left_out], statements=statements)
    values = found.values(warnings=lacking, statements=statements)
    if output is not None:
        _write(output, found.result, with_reading(report, readings), values)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if any(figure.outcome is LimitOutcome.EXCEEDS for figure in found.result.figures):
        raise typer.Exit(ANSWER)


def _not_stated(result: StandardCheck) -> list[str]:
    """A warning where figures have a limit and the reference has no uncertainty for them."""
    from pretravel.laboratory.standard_check import DIAMETER_OF_REFERENCE, FORM_OF_REFERENCE

    options = {DIAMETER_OF_REFERENCE: "--u-diameter", FORM_OF_REFERENCE: "--sphere-form"}
    lacking = {f.u_source for f in result.figures if f.limit is not None and f.u_test is None}
    needed = " and ".join(option for source, option in options.items() if source in lacking)
    if not needed:
        return []
    what = "the values are compared with their limits without an uncertainty zone"
    return [f"{what}: state that of the reference with {needed}"]


def _limits(
    form_um: float | None, size_um: float | None, repeat_um: float | None
) -> dict[str, float]:
    """The maximum permissible errors that are stated, by figure. [mm]"""
    from pretravel.units import MICROMETRE

    limits = {
        "form": form_um,
        "form2d": form_um,
        "form3d": form_um,
        "size": size_um,
        "repeatability": repeat_um,
    }
    return {name: limit * MICROMETRE for name, limit in limits.items() if limit is not None}


def _write(output: Path, result: StandardCheck, report: Document, values: dict[str, Any]) -> None:
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.standard_figures import standard_table
    from pretravel.whole_file import write_json

    ending = output.suffix.lower()
    if ending == ".csv":
        write_csv_table(output, standard_table(result))
    elif ending == ".json":
        write_json(output, values)
    else:
        save_page(report, output)


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
        float,
        typer.Option(
            **limits(ANGLE, DEGREE),
            help="Rotation of the pattern about the probe axis, in degrees.",
        ),
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
