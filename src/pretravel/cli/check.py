from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from pretravel.base.quantities import ANGLE, TIP_BALL, limits
from pretravel.base.units import DEGREE
from pretravel.cli.arguments import Angles, Vector, angles, one_of, vector
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
from pretravel.tasks.task import ANSWER


def _standards() -> list[str]:
    from pretravel.laboratory.standards import CHECKS

    return list(CHECKS)


def _patterns() -> list[str]:
    from pretravel.laboratory.standards import PATTERNS

    return list(PATTERNS)


Standard: TypeAlias = Annotated[
    str,
    typer.Argument(
        parser=one_of(_standards),
        metavar="STANDARD",
        help="iso10360-5 (25 touches on a sphere), iso230-10 (36 on the equator) or "
        "iso230-10-tip-offset (a circle at two or more orientations of the spindle).",
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
            min=0.0, max=1e6, help="Maximum permissible range of repeats, in µm (iso230-10…)."
        ),
    ] = None,
    offset_limit: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1e6,
            help="Maximum permissible offset of the tip, in µm (iso230-10-tip-offset).",
        ),
    ] = None,
    spindle: Annotated[
        Angles | None,
        typer.Option(
            parser=angles,
            metavar="ANGLES",
            help="Orientation of the spindle in each file, in degrees, such as 0,180, where the "
            "files have no column spindle_deg (iso230-10-tip-offset).",
        ),
    ] = None,
    ring: Annotated[
        bool, typer.Option("--ring", help="The reference is a ring (iso230-10-tip-offset).")
    ] = False,
    u_diameter: Annotated[
        float | None,
        typer.Option(
            "--u-diameter",
            min=0.0,
            max=1e6,
            help="Standard uncertainty of the diameter, in µm: U of the certificate, divided by "
            "its k.",
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
    from pretravel.base.whole_file import write_json
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.map_file import read_map
    from pretravel.files.standard_figures import standard_table
    from pretravel.laboratory.standard_check import CalibratedSphere, LimitOutcome
    from pretravel.tasks.check import CheckSetup, check_probe, not_stated, stated_limits

    files, name = files_of_touches(touches)
    inputs = [*files, map_file, plan, lab]
    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], inputs)
    statements = laboratory_statements(lab)
    sphere = CalibratedSphere(diameter, _millimetres(u_diameter), _millimetres(sphere_form))
    limits = stated_limits(
        form=_millimetres(form_limit),
        size=_millimetres(size_limit),
        repeatability=_millimetres(repeat_limit),
        offset=_millimetres(offset_limit),
    )
    setup = CheckSetup(standard, sphere, tip_diameter, axis, limits)
    given = {"map": map_file is not None, "spindle": spindle is not None, "ring": ring}
    setup.check_inputs([name for name, there in given.items() if there])
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        exclude=exclude,
        plan=plan,
        tip_diameter=tip_diameter,
        reference_diameter=diameter,
        ring=ring,
    )
    turns = None if spindle is None else [angle * DEGREE for angle in spindle.degrees]
    readings = read_and_show(files, options, spindle=turns).in_machine_axes()
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip_diameter)
    found = check_probe(readings, setup, pretravel_map)
    lacking = not_stated(found.result, _reference_options())
    left_out = statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = found.document(name, warnings=[*lacking, *left_out], statements=statements)
    if output is not None and output.suffix.lower() == ".csv":
        write_csv_table(output, standard_table(found.result))
    elif output is not None and output.suffix.lower() == ".json":
        write_json(output, found.values(warnings=lacking, statements=statements))
    elif output is not None:
        save_page(with_reading(report, readings), output)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if any(figure.outcome is LimitOutcome.EXCEEDS for figure in found.result.figures):
        raise typer.Exit(ANSWER)


def _millimetres(micrometres: float | None) -> float | None:
    from pretravel.base.units import MICROMETRE

    return None if micrometres is None else micrometres * MICROMETRE


def _reference_options() -> dict[str, str]:
    """What states each source of uncertainty of the reference, as options."""
    from pretravel.laboratory.standard_check import DIAMETER_OF_REFERENCE, FORM_OF_REFERENCE

    return {DIAMETER_OF_REFERENCE: "--u-diameter", FORM_OF_REFERENCE: "--sphere-form"}


def pattern(
    standard: Annotated[
        str,
        typer.Argument(
            parser=one_of(_patterns),
            metavar="STANDARD",
            help="iso10360-5 (25 touches on a sphere; iso10360-5-cumulative: with each ring turned "
            "further, see docs/laboratory.md) or iso230-10 (36 on the equator).",
        ),
    ],
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
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.plan_csv import pattern_table
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
