from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PICTURES, check_files
from pretravel.cli.options import Picture
from pretravel.cli.progress import working


def rig(
    traces: Annotated[
        list[Path],
        typer.Argument(
            help="Traces rig_AZIMUTH_REPEAT.csv: time_s,ruler_mm,laser_mm,contact,trigger."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Touches, .csv; the whole result, .json; or a calibration certificate, .html.",
        ),
    ] = None,
    lab: Annotated[
        Path | None,
        typer.Option(help="Laboratory and item, as the certificate states them: .toml."),
    ] = None,
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
    plot: Picture = None,
) -> None:
    """Evaluate traces of a calibration rig: pretravel, hysteresis, repeatability, uncertainty.

    Example: pretravel rig rig_*.csv --lab lab.toml -o certificate.html
    """
    import json

    import numpy as np

    from pretravel.errors import PretravelError
    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.map_file import write_map
    from pretravel.formats.rig_csv import read_budget, read_rig_trace, rig_json, rig_table
    from pretravel.laboratory.rig import rig_touch, warmed
    from pretravel.laboratory.rig_calibration import (
        REN_BUDGET,
        calibrate_rig,
        calibration_budget,
        length_budget,
        rig_map,
    )
    from pretravel.report.certificate import Laboratory, read_laboratory, write_certificate
    from pretravel.report.laboratory_pictures import plot_rig, plot_trace
    from pretravel.report.laboratory_words import budget_table, rig_report
    from pretravel.whole_file import whole_file

    check_files(
        [(output, (".csv", ".json", ".html")), (map_file, (".nc", ".csv")), (plot, PICTURES)],
        [*traces],
    )
    if map_file is not None and tip_diameter is None:
        raise PretravelError("--map needs the tip's diameter: --tip-diameter, mm")
    if lab is not None and (output is None or output.suffix.lower() != ".html"):
        raise PretravelError("--lab goes with a certificate: -o certificate.html")
    names = [path.stem for path in traces]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise PretravelError(f"trace {twice[0]} is given twice; each file is one touch")
    told = Laboratory({}) if lab is None else read_laboratory(lab)
    components = REN_BUDGET if budget is None else read_budget(budget)
    with working(f"reading {len(traces)} traces"):
        read = [warmed(read_rig_trace(path), temperature, expansion * 1e-6) for path in traces]
        touches = [rig_touch(trace) for trace in read]
    if output is not None and output.suffix.lower() == ".csv":
        # Before anything is concluded from them: single traces are a result of their own.
        write_csv_table(output, rig_table(touches))
    calibration = calibrate_rig(touches)
    own = length_budget(calibration_budget(calibration, components), abs(calibration.pretravel))
    notes = [f"{touch.trace}: {note}" for touch in touches for note in touch.notes]
    if output is not None and output.suffix.lower() == ".json":
        with whole_file(output) as temporary:
            temporary.write_text(json.dumps(rig_json(calibration, own), indent=1), encoding="utf-8")
    elif output is not None and output.suffix.lower() == ".html":
        middle = int(np.argsort([touch.pretravel for touch in touches])[len(touches) // 2])
        figures = {
            "Pretravel, its repeatability and hysteresis over the directions": plot_rig(
                calibration
            ),
            f"One touch: {touches[middle].trace}": plot_trace(read[middle], touches[middle]),
        }
        write_certificate(
            output,
            calibration,
            components,
            told,
            figures,
            notes=notes,
            budget_source="Ren 2020, Table 2: the paper's rig, NOT this laboratory's"
            if budget is None
            else budget.name,
            temperature=temperature,
        )
    if plot is not None:
        from pretravel.report.style import save

        picture = (
            plot_rig(calibration, f"{len(touches)} touches on the rig")
            if len(touches) > 1
            else plot_trace(read[0], touches[0])
        )
        save(picture, plot)
    typer.echo(rig_report(calibration))
    typer.echo(
        "\nUncertainty of the mean pretravel of the direction touched least often:\n"
        + budget_table(own)
    )
    for note in notes:
        typer.echo(f"Warning: {note}", err=True)
    if calibration.starts_differ:
        typer.echo(
            "Note: touches of one direction start at different places, so repeatability is that of "
            "r1 - r0, not of r1 alone."
        )
    if map_file is not None:
        write_map(map_file, rig_map(calibration, components, 0.5 * (tip_diameter or 0.0)))
    if budget is None:
        typer.echo(
            "Warning: the budget is that of Ren 2020, Table 2: another laboratory's; give your own "
            "with --budget",
            err=True,
        )
    if output is not None and output.suffix.lower() == ".html" and told.missing:
        typer.echo(
            f"Warning: {told.missing} fields of the certificate are not stated; fill them in with "
            "--lab (pretravel laboratory > lab.toml)",
            err=True,
        )
