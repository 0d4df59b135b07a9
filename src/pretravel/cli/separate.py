from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import NOISE, VARIANCE, limits
from pretravel.base.units import MICROMETRE
from pretravel.cli.arguments import Indices, indices
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.laboratory_option import (
    LaboratoryFile,
    laboratory_statements,
    statements_left_out,
)
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show

if TYPE_CHECKING:
    from pretravel.laboratory.certificate import LaboratoryStatements
    from pretravel.laboratory.separation import Separation
    from pretravel.show.document import Document


def separate(
    readings: Annotated[Path, typer.Argument(help="CSV: machine_index,probe_index,error_um.")],
    repeat_variance: Annotated[
        float | None,
        typer.Option(
            **limits(VARIANCE, MICROMETRE**2),
            help="Variance of one configuration, measured by repeats, in µm².",
        ),
    ] = None,
    repeat_pair: Annotated[
        Indices | None,
        typer.Option(
            parser=indices, metavar="MACHINE,PROBE", help="Indices of that configuration."
        ),
    ] = None,
    repeat_count: Annotated[
        int,
        typer.Option(
            min=2, max=1_000_000, help="Number of repeats from which that variance was estimated."
        ),
    ] = 10,
    method: Annotated[
        Literal["reml", "least-squares"],
        typer.Option(help="Restricted maximum likelihood, or the paper's least squares."),
    ] = "reml",
    pair_of: Annotated[
        list[Indices] | None,
        typer.Option(
            "--pair",
            parser=indices,
            metavar="MACHINE,PROBE",
            help="Print the variance of this pair too.",
        ),
    ] = None,
    exclude: Annotated[
        list[Indices] | None,
        typer.Option(
            parser=indices,
            metavar="MACHINE,PROBE",
            help="Leave the readings of this pair out; may be repeated.",
        ),
    ] = None,
    lab: LaboratoryFile = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Result: .csv or .json, or a page, .html or .pdf."),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Separate the errors and variances of machine and probe, from multi-step readings.

    A reading is the error of the machine minus that of the probe, for one pair of directions.

    Example: pretravel separate readings.csv --repeat-variance 0.8 --repeat-pair 1,1 -o s.csv
    """
    from pretravel.files.separation_csv import read_multi_step_readings
    from pretravel.laboratory.multi_step_readings import RepeatedPair
    from pretravel.laboratory.separation import separate as separated
    from pretravel.tasks.reports.laboratory_report import with_laboratory
    from pretravel.tasks.reports.separation_report import separation_document

    check_files([(output, (".csv", ".json", *PAGES)), (plot, PICTURES)], [readings, lab])
    statements = laboratory_statements(lab)
    repeated = None
    if repeat_variance is not None and repeat_pair is not None:
        repeated = RepeatedPair(*repeat_pair, repeat_variance * MICROMETRE**2, count=repeat_count)
    elif repeat_variance is not None or repeat_pair is not None:
        raise PretravelError("give --repeat-variance and --repeat-pair together, or neither")
    measured = read_multi_step_readings(readings)
    with working(f"separating {len(measured)} readings"):
        result = separated(measured, method=method, repeated=repeated, exclude=exclude or ())
    left_out = statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = separation_document(
        result, readings_name=readings.name, pairs=pair_of or [], warnings=left_out
    )
    report = with_laboratory(report, statements)
    if output is not None:
        _write(output, result, report, statements)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _write(
    output: Path, result: Separation, report: Document, statements: LaboratoryStatements | None
) -> None:
    from pretravel.base.whole_file import write_json
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.laboratory_file import with_laboratory_values
    from pretravel.files.separation_csv import separation_json, separation_table

    ending = output.suffix.lower()
    if ending == ".csv":
        write_csv_table(output, separation_table(result))
    elif ending == ".json":
        write_json(output, with_laboratory_values(separation_json(result), statements))
    else:
        save_page(report, output)


def separation_plan(
    directions: Annotated[
        int, typer.Option(min=2, max=3600, help="Directions of machine and probe, equally spaced.")
    ] = 24,
    variance: Annotated[
        float,
        typer.Option(
            **limits(VARIANCE, MICROMETRE**2),
            help="Expected variance of a touch, machine and probe together, in µm².",
        ),
    ] = 0.5,
    u_systematic: Annotated[
        float | None,
        typer.Option(
            "--u-systematic",
            **limits(NOISE, MICROMETRE),
            help="Standard uncertainty to reach for each error, in µm.",
        ),
    ] = None,
    u_variance: Annotated[
        float | None,
        typer.Option(
            "--u-variance",
            min=0.001,
            max=1000.0,
            help="Relative standard uncertainty to reach for each direction's variance, in %.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Form with all touches in order, to fill in: .csv; or a page, .html or .pdf.",
        ),
    ] = None,
) -> None:
    """Plan a multi-step test: orientations and repeats for a required uncertainty.

    Example: pretravel separation-plan --directions 24 --variance 0.4 --u-systematic 0.2 -o form.csv
    """
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.separation_csv import separation_plan_table
    from pretravel.laboratory.separation_plan import plan_separation
    from pretravel.tasks.reports.separation_report import separation_plan_document

    check_files([(output, (".csv", *PAGES))])
    with working("planning"):
        plan = plan_separation(
            directions,
            variance * MICROMETRE**2,
            u_error=None if u_systematic is None else u_systematic * MICROMETRE,
            u_variance=None if u_variance is None else u_variance / 100.0,
        )
    report = separation_plan_document(plan)
    if output is not None and not is_page(output):
        write_csv_table(output, separation_plan_table(plan))
    save_page(report, output)
    show(report, verbose=False)
