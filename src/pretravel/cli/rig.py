from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.arguments import MovedMark, trace_mark
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
    from pretravel.show.document import Document

_RESULTS = (".csv", ".json", *PAGES)


def rig(
    traces: Annotated[
        list[Path],
        typer.Argument(
            help="Traces rig_AZIMUTH_REPEAT.csv: time_s,ruler_mm,laser_mm,contact,trigger; files, "
            "a folder or a name with *."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Touches, .csv; the whole result, .json; or a certificate, .html or .pdf.",
        ),
    ] = None,
    lab: LaboratoryFile = None,
    budget: Annotated[
        Path | None,
        typer.Option(
            help="Uncertainty budget of the rig, .csv: source,type,uncertainty_um,per_metre_um; "
            "the default is that of Ren 2020, Table 2."
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option("--map", help="Map of the mean pretravel, for compensation: .json or .csv."),
    ] = None,
    tip_diameter: Annotated[
        float | None,
        typer.Option(min=0.001, max=100.0, help="Diameter of the tip, in mm, for --map."),
    ] = None,
    temperature: Annotated[
        float, typer.Option(min=-50.0, max=100.0, help="Temperature of the ruler, in °C.")
    ] = 20.0,
    expansion: Annotated[
        float,
        typer.Option(
            min=0.0, max=100.0, help="Thermal expansion coefficient of the ruler, in 1e-6/K."
        ),
    ] = 8.0,
    exclude: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LABEL", help="Leave this trace out (the file's name); may be repeated."
        ),
    ] = None,
    mark: Annotated[
        list[MovedMark] | None,
        typer.Option(
            parser=trace_mark,
            metavar="TRACE:r0=MM",
            help="The ruler's position at an event (r0 to r3), in mm, where you see the event in "
            "the trace. The uncertainty of a moved r0, r1 or r3 covers the old position too. May "
            "be repeated.",
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Evaluate traces of a calibration rig: pretravel, hysteresis, repeatability, uncertainty.

    Example: pretravel rig rig_*.csv --lab lab.toml -o certificate.html
    """
    from pretravel.base.whole_file import write_json
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.map_file import MAP_ENDINGS, write_map
    from pretravel.files.rig_csv import read_budget, rig_table, rig_traces
    from pretravel.laboratory.certificate import LaboratoryStatements
    from pretravel.laboratory.rig_budget import REN_BUDGET
    from pretravel.laboratory.rig_map import rig_map
    from pretravel.tasks.rig import REN_SOURCE, RigSetup, calibrate_touches, read_touches_of_rig

    ending = "" if output is None else output.suffix.lower()
    traces = rig_traces(traces)
    check_files(
        [(output, _RESULTS), (map_file, MAP_ENDINGS), (plot, PICTURES)], [*traces, lab, budget]
    )
    if map_file is not None and tip_diameter is None:
        raise PretravelError("--map needs the diameter of the tip: --tip-diameter, in mm")
    statements = laboratory_statements(lab)
    setup = RigSetup(
        REN_BUDGET if budget is None else read_budget(budget),
        REN_SOURCE if budget is None else budget.name,
        temperature,
        expansion,
        tuple(exclude or ()),
        _by_trace(mark or ()),
    )
    with working(f"reading {len(traces)} traces"):
        read, touches = read_touches_of_rig(traces, setup)
    if output is not None and ending == ".csv":  # single touches need no calibration
        write_csv_table(output, rig_table(touches))
    found = calibrate_touches(read, touches, setup)
    calibration = found.calibration
    missing = (statements or LaboratoryStatements()).missing if is_page(output) else 0
    lacking = [*_missing_information(missing, own_budget=budget is not None)]
    if output is not None and ending == ".csv" and calibration.not_used:
        write_csv_table(output, found.table())
    if output is not None and ending == ".json":
        write_json(output, found.values(statements))
    elif output is not None and is_page(output):
        _write_certificate(output, found.certificate(statements, warnings=lacking))
    if map_file is not None:
        tip_radius = 0.5 * (tip_diameter or 0.0)
        write_map(map_file, rig_map(calibration, setup.components, tip_radius))
    warnings = lacking + statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = found.document(warnings=warnings, statements=statements)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _by_trace(marks: Sequence[MovedMark]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for mark in marks:
        found.setdefault(mark.trace, {})[mark.event] = mark.position
    return found


def _write_certificate(output: Path, certificate: Document) -> None:
    from pretravel.tasks.reports.certificate_report import TEMPLATE

    save_page(certificate, output, template=TEMPLATE)


def _missing_information(fields: int, *, own_budget: bool) -> Iterator[str]:
    """Statements that the laboratory did not make, as warnings."""
    if not own_budget:
        yield (
            "the budget is that of Ren 2020, Table 2, of another laboratory; give your own with "
            "--budget"
        )
    if fields:
        yield (
            f"{fields} fields of the certificate are not stated; fill them in with --lab "
            "(pretravel laboratory > lab.toml)"
        )
