from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import Angles, one_of
from pretravel.cli.files import MAPS, PICTURES, check_files, is_page
from pretravel.cli.options import (
    Azimuths,
    Gravity,
    PictureFile,
    Polars,
    ProbeName,
    Verbose,
    Workpiece,
    models,
)
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.quantities import STEP, limits
from pretravel.trigger.compliance import MODELS


def predict(
    probe: ProbeName,
    model: Annotated[
        str,
        typer.Option(
            parser=one_of(models),
            metavar="MODEL",
            help="; ".join(f"{name}: {meaning}" for name, meaning in MODELS.items()) + ".",
        ),
    ] = "analytic",
    azimuth: Azimuths = Angles.of("0:355:5"),
    polar: Polars = Angles.of("0:90:5"),
    lever: Annotated[
        float | None,
        typer.Option(
            **limits(STEP),
            help="Distance from the tip centre to the plane of the rods, in mm; the hub offset is "
            "changed to it.",
        ),
    ] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Map: .csv, .nc or .json; or a page, .html or .pdf."),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Predict trigger force, sensing distance and pretravel over directions.

    Example: pretravel predict omp40-2 --azimuth 0:350:10 --polar 90 -o map.csv --plot map.png
    """
    import numpy as np

    from pretravel.directions import grid
    from pretravel.formats.map_file import write_map
    from pretravel.formats.prediction_table import trigger_table
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.materials import material
    from pretravel.report.prediction_report import prediction_document
    from pretravel.trigger import predict as prediction
    from pretravel.trigger.compliance.base import compliance_model
    from pretravel.trigger.response import probe_response, response_map

    check_files([(output, MAPS), (plot, PICTURES)], [probe])
    description = load_probe(probe)
    if lever is not None:
        description = description.with_lever(lever, shorten=compliance_model(model).uses_lever_only)
    directions = grid(np.radians(polar.degrees), np.radians(azimuth.degrees))
    with working(f"predicting {len(directions)} directions"):
        part = material(workpiece)
        trigger = prediction.predict(
            description, directions, model, workpiece=part, gravity=gravity
        )
    table = trigger_table(trigger)
    # The angles as given: a direction at the pole no longer contains its azimuth.
    table["polar_deg"] = np.repeat(polar.degrees, len(azimuth.degrees))
    table["azimuth_deg"] = np.tile(azimuth.degrees, len(polar.degrees))
    report = prediction_document(trigger, description)
    save_page(report, output)
    if output is not None and not is_page(output):
        if output.suffix.lower() == ".nc" and compliance_model(model).has_response:  # else a table
            response = probe_response(description, model, workpiece=part, gravity=gravity)
            predicted = response_map(description, response, trigger)
        else:
            predicted = prediction.predicted_map(description, trigger)
        write_map(output, predicted, table=table)
    save_picture(report, plot)
    show(report, verbose=verbose)
