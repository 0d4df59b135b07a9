from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.base.quantities import FRICTION, STEP, limits
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
from pretravel.prediction.compliance import MODELS


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
    friction: Annotated[
        float | None,
        typer.Option(
            **limits(FRICTION),
            help="Coulomb's coefficient of friction at the seats (likely 0.1 to 0.3): the third "
            "of three equal touches is predicted, by the models analytic and fem; the default is "
            "that of the description, 0 in the catalogue.",
        ),
    ] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Map: .json; table: .csv, .nc; or a page, .html or .pdf."
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Predict trigger force, sensing distance and pretravel over directions.

    Example: pretravel predict omp40-2 --azimuth 0:350:10 --polar 90 -o map.csv --plot map.png
    """
    from pretravel.prediction.catalogue import load_probe
    from pretravel.prediction.materials import material
    from pretravel.tasks.predict import (
        PredictionWish,
        predict_probe,
        with_friction,
        with_lever,
        write_prediction,
    )

    check_files([(output, (*MAPS, ".nc")), (plot, PICTURES)], [probe])
    description = with_friction(with_lever(load_probe(probe), lever, model), friction)
    wish = PredictionWish(
        model, polar.degrees, azimuth.degrees, workpiece=material(workpiece), gravity=gravity
    )
    with working(f"predicting {len(wish.directions)} directions"):
        predicted = predict_probe(description, wish)
    report = predicted.document()
    save_page(report, output)
    if output is not None and not is_page(output):
        write_prediction(output, predicted)
    save_picture(report, plot)
    show(report, verbose=verbose)
