from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import (
    MAPS,
    PICTURES,
    angle_range,
    check_files,
    unit_vector,
    working,
)
from pretravel.cli.options import Gravity, Picture, ProbeName, Workpiece


def predict(
    probe: ProbeName,
    model: Annotated[
        str,
        typer.Option(
            help="analytic: stylus as a beam, seats; fem: finite elements; shen: one cantilever; "
            "ren: the Abbé paper's closed form; wozniak: one constant, as five touches would find."
        ),
    ] = "analytic",
    azimuth: Annotated[
        str, typer.Option(help="Azimuths in degrees: start:stop:step, a,b,c or one.")
    ] = "0:355:5",
    polar: Annotated[
        str, typer.Option(help="Polar angles in degrees; 90 is a vertical wall.")
    ] = "0:90:5",
    lever: Annotated[
        float | None,
        typer.Option(help="Tip centre to the plane of the rods, mm; the hub offset follows."),
    ] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Map: .csv, .nc or .json; or a page, .html."),
    ] = None,
    plot: Picture = None,
) -> None:
    """Predict trigger force, sensing distance and pretravel over directions.

    Example: pretravel predict omp40-2 --azimuth 0:350:10 --polar 90 -o map.csv --plot map.png
    """
    import numpy as np

    from pretravel.directions import grid
    from pretravel.errors import PretravelError
    from pretravel.formats.map_file import trigger_table, write_map
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.materials import material
    from pretravel.report.words import prediction_report
    from pretravel.trigger import predict as prediction
    from pretravel.trigger.response import OF_RESPONSE_FORM, probe_response, response_map

    check_files([(output, MAPS), (plot, PICTURES)], [probe])
    description = load_probe(probe)
    if lever is not None:
        description = description.with_lever(lever, shorten=model == "shen")
    polar_deg, azimuth_deg = angle_range(polar, "--polar"), angle_range(azimuth, "--azimuth")
    if min(polar_deg) < 0.0 or max(polar_deg) > 180.0:
        raise PretravelError(f"--polar {polar}: polar angles lie between 0 and 180 degrees")
    directions = grid(np.radians(polar_deg), np.radians(azimuth_deg))
    with working(f"predicting {len(directions)} directions"):
        part = material(workpiece)
        weight = None if gravity is None else unit_vector(gravity, "--gravity")
        trigger = prediction.predict(description, directions, model, workpiece=part, gravity=weight)
    table = trigger_table(trigger)
    # The angles that were asked for; at the pole a direction has lost its azimuth.
    table["polar_deg"] = np.repeat(polar_deg, len(azimuth_deg))
    table["azimuth_deg"] = np.tile(azimuth_deg, len(polar_deg))
    report = prediction_report(trigger, description.name)
    if output is not None and output.suffix.lower() == ".html":
        from pretravel.report.page import write_text_page
        from pretravel.report.plotting import plot_prediction, plot_probe

        pictures = {"Prediction": plot_prediction(trigger), "The probe": plot_probe(description)}
        write_text_page(
            output, f"pretravel predict: {description.name}", [("Result", report)], pictures
        )
    elif output is not None:
        if output.suffix.lower() == ".nc" and model in OF_RESPONSE_FORM:  # else a table
            response = probe_response(description, model, workpiece=part, gravity=weight)
            predicted = response_map(description, response, trigger)
        else:
            predicted = prediction.predicted_map(description, trigger)
        write_map(output, predicted, table=table)
    if plot is not None:
        from pretravel.report.plotting import plot_prediction, save

        save(plot_prediction(trigger, f"{description.name}, model {model}"), plot)
    typer.echo(report)
