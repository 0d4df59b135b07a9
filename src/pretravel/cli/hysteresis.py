from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pretravel.base.quantities import FRICTION, STEP, limits
from pretravel.base.units import MICROMETRE
from pretravel.cli.arguments import Angles
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import Azimuths, PictureFile, Polars, ProbeName, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def hysteresis(
    probe: ProbeName,
    friction: Annotated[
        float | None,
        typer.Option(
            **limits(FRICTION),
            help="Coulomb's coefficient of friction at the seats, below tan(support angle); the "
            "default is that of the description, or 0.2 where it has none.",
        ),
    ] = None,
    azimuth: Azimuths = Angles.of("0:330:30"),
    polar: Polars = Angles.of("90"),
    cycles: Annotated[
        int, typer.Option(min=1, max=1000, help="Number of touches, one after the other.")
    ] = 3,
    overtravel: Annotated[
        float | None,
        typer.Option(
            **limits(STEP, MICROMETRE),
            help="Deflection beyond that of the frictionless trigger, in µm; the default is 10, "
            "or twice the deflection at the trigger.",
        ),
    ] = None,
    steps: Annotated[
        int, typer.Option(min=1, max=10_000, help="Steps of each loading and of each return.")
    ] = 100,
    model: Annotated[
        Literal["fem", "analytic", "rigid"],
        typer.Option(
            help="Body of the probe: finite elements (elastic), analytic (only the stylus bends), "
            "or rigid."
        ),
    ] = "fem",
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Every step of every cycle: .csv; or a page, .html or .pdf."
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Load and unload a probe with friction at the seats: hysteresis, reseat error, zero drift.

    Example: pretravel hysteresis omp40-2 --friction 0.1 --cycles 3 -o cycles.csv --plot cycles.png
    """
    import numpy as np

    from pretravel.base.directions import grid
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.friction_table import friction_table
    from pretravel.prediction.catalogue import load_probe
    from pretravel.prediction.fem.reduction_cache import reduced_model
    from pretravel.prediction.friction import USUAL_FRICTION, check_conditions, friction_cycle
    from pretravel.tasks.reports.friction_report import friction_document

    check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], [probe])
    description = load_probe(probe)
    directions = grid(np.radians(polar.degrees), np.radians(azimuth.degrees))
    beyond = None if overtravel is None else overtravel * MICROMETRE
    if friction is None:
        friction = description.seats.friction or USUAL_FRICTION
    check_conditions(description, friction, beyond, cycles, steps, len(directions))
    with working(f"{cycles} touches in {len(directions)} directions"):
        result = friction_cycle(
            description,
            directions,
            friction,
            body=reduced_model(description) if model == "fem" else model,
            overtravel=beyond,
            cycles=cycles,
            steps=steps,
        )
    if output is not None and not is_page(output):
        write_csv_table(output, friction_table(result))
    report = friction_document(result, description.name)
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
