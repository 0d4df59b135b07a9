from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.laboratory_option import (
    LaboratoryFile,
    laboratory_statements,
    statements_left_out,
)
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.errors import PretravelError

if TYPE_CHECKING:
    from pretravel.laboratory.certificate import CalibrationCertificate
    from pretravel.laboratory.rig import RigTrace

_RESULTS = (".csv", ".json", *PAGES)
_REN_SOURCE = "Ren 2020, Table 2: the paper's rig, NOT this laboratory's"


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
        typer.Option("--map", help="Map of the mean pretravel, for compensation: .nc or .csv."),
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
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Evaluate traces of a calibration rig: pretravel, hysteresis, repeatability, uncertainty.

    Example: pretravel rig rig_*.csv --lab lab.toml -o certificate.html
    """
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.laboratory_file import with_laboratory_values
    from pretravel.formats.map_file import write_map
    from pretravel.formats.rig_csv import read_budget, rig_json, rig_table, rig_traces
    from pretravel.laboratory.certificate import LaboratoryStatements, calibration_certificate
    from pretravel.laboratory.rig_budget import REN_BUDGET, calibration_budget, length_budget
    from pretravel.laboratory.rig_calibration import calibrate_rig
    from pretravel.laboratory.rig_events import rig_touch
    from pretravel.laboratory.rig_map import rig_map
    from pretravel.report.laboratory_report import with_laboratory
    from pretravel.report.rig_report import rig_document
    from pretravel.whole_file import write_json

    ending = "" if output is None else output.suffix.lower()
    traces = rig_traces(traces)
    check_files(
        [(output, _RESULTS), (map_file, (".nc", ".csv")), (plot, PICTURES)], [*traces, lab, budget]
    )
    _check_traces(traces)
    if map_file is not None and tip_diameter is None:
        raise PretravelError("--map needs the diameter of the tip: --tip-diameter, in mm")
    statements = laboratory_statements(lab)
    components = REN_BUDGET if budget is None else read_budget(budget)
    with working(f"reading {len(traces)} traces"):
        read = _read_traces(traces, temperature, expansion)
        touches = [rig_touch(trace) for trace in read]
    if output is not None and ending == ".csv":  # single touches need no calibration
        write_csv_table(output, rig_table(touches))
    calibration = calibrate_rig(touches, exclude=exclude or ())
    if output is not None and ending == ".csv" and calibration.not_used:
        write_csv_table(output, rig_table(touches, calibration.not_used))
    own = length_budget(calibration_budget(calibration, components), abs(calibration.pretravel))
    if output is not None and ending == ".json":
        write_json(output, with_laboratory_values(rig_json(calibration, own), statements))
    elif output is not None and is_page(output):
        source = _REN_SOURCE if budget is None else budget.name
        certificate = calibration_certificate(
            calibration,
            components,
            statements or LaboratoryStatements(),
            budget_source=source,
            temperature=temperature,
        )
        _write_certificate(output, certificate, read)
    if map_file is not None:
        write_map(map_file, rig_map(calibration, components, 0.5 * (tip_diameter or 0.0)))
    notes = [f"{touch.trace}: {note}" for touch in touches for note in touch.notes]
    missing = (statements or LaboratoryStatements()).missing if is_page(output) else 0
    warnings = [*notes, *_missing_information(missing, own_budget=budget is not None)]
    warnings += statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = rig_document(calibration, own, read, warnings=warnings)
    report = with_laboratory(report, statements)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _check_traces(traces: Sequence[Path]) -> None:
    names = [path.stem for path in traces]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise PretravelError(f"trace {repeated[0]} is given twice; each file is one touch")


def _read_traces(paths: Sequence[Path], temperature: float, expansion: float) -> list[RigTrace]:
    """Traces, with the ruler at its reference temperature."""
    from pretravel.formats.rig_csv import read_rig_trace
    from pretravel.laboratory.rig import at_reference_temperature

    return [
        at_reference_temperature(read_rig_trace(path), temperature, expansion * 1e-6)
        for path in paths
    ]


def _write_certificate(
    output: Path, certificate: CalibrationCertificate, traces: Sequence[RigTrace]
) -> None:
    from pretravel.report.certificate_report import TEMPLATE, certificate_document

    save_page(certificate_document(certificate, traces), output, template=TEMPLATE)


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
