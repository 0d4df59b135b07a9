from __future__ import annotations

from collections.abc import Mapping
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
from pretravel.errors import PretravelError
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
    from pretravel.compensation.compensation import apply
    from pretravel.compensation.measured_sphere import measured_sphere
    from pretravel.formats.laboratory_file import with_laboratory_values
    from pretravel.formats.map_file import read_map
    from pretravel.formats.standard_figures import standard_json
    from pretravel.laboratory.standard_check import CalibratedSphere, LimitOutcome
    from pretravel.laboratory.standards import CHECKS
    from pretravel.qualification.own_touches import own_touches_warnings
    from pretravel.report.laboratory_report import with_laboratory
    from pretravel.report.standards_report import standards_document
    from pretravel.units import MICROMETRE

    files, name = files_of_touches(touches)
    inputs = [*files, map_file, plan, lab]
    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], inputs)
    statements = laboratory_statements(lab)
    limits = _limits(form_limit, size_limit, repeat_limit)
    _refuse_other_options(standard, limits, u_diameter)
    if "size" in limits and tip_diameter is None and map_file is None:
        raise PretravelError("--size-limit needs a size error: give --tip-diameter or --map")
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
    measured = readings.touches
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip_diameter)
    result = CHECKS[standard](
        measured,
        CalibratedSphere(
            diameter,
            None if u_diameter is None else u_diameter * MICROMETRE,
            None if sphere_form is None else sphere_form * MICROMETRE,
        ),
        tip_diameter=tip_diameter,
        pretravel_map=pretravel_map,
        axis=axis,
        limits=limits,
    )
    warnings = [*readings.notes(), *_not_stated(result)]
    sphere = None
    if pretravel_map is not None:
        sphere = measured_sphere(measured, apply(measured, pretravel_map), pretravel_map)
        warnings += own_touches_warnings(measured, pretravel_map, _ON_ITS_OWN_TOUCHES)
    left_out = statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = standards_document(
        result, touches_name=name, sphere=sphere, warnings=[*warnings, *left_out]
    )
    report = with_laboratory(report, statements)
    values = with_laboratory_values(standard_json(result, sphere, warnings), statements)
    if output is not None:
        _write(output, result, with_reading(report, readings), values)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if any(figure.outcome is LimitOutcome.EXCEEDS for figure in result.figures):
        raise typer.Exit(ANSWER)


_ON_ITS_OWN_TOUCHES = (
    "on its own touches a map looks better than it is, because it follows a part of their "
    "scatter. Check it on new touches"
)


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


def _refuse_other_options(
    standard: str, limits: Mapping[str, float], u_diameter: float | None
) -> None:
    """Refuse limits of figures that a standard does not have."""
    if standard == "iso10360-5" and "repeatability" in limits:
        raise PretravelError("--repeat-limit is only for iso230-10; iso10360-5 has no repeats")
    if standard == "iso230-10" and ("size" in limits or u_diameter is not None):
        raise PretravelError("--size-limit and --u-diameter are only for iso10360-5")


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
