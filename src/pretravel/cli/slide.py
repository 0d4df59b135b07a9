from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pretravel.base.quantities import STEP, limits
from pretravel.cli.arguments import Pair, pair
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import ContactModel, PictureFile, ProbeName, Verbose, Workpiece
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def slide(
    probe: ProbeName,
    surface: Annotated[
        str,
        typer.Option(
            help="plane:polar=40, ellipsoid:a=10,c=6, convex, part.step#face, … (as in simulate)."
        ),
    ],
    at: Annotated[
        Pair,
        typer.Option(
            parser=pair,
            metavar="U,V",
            help="Surface parameters of the first contact, in radians where they are angles.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Every step: .csv; or a page, .html or .pdf."),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            **limits(STEP),
            help="Travel of a step, in mm (vertical: deflection, in mm; inclined: force, in N); "
            "the default is 0.001; for inclined it is 0.1.",
        ),
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=100_000, help="Number of steps.")] = 20,
    process: Annotated[
        Literal["curved", "inclined", "vertical"],
        typer.Option(
            help="Process of the thesis: curved (any surface), or that for inclined or vertical "
            "planes."
        ),
    ] = "curved",
    search: Annotated[
        Literal["steps", "golden"],
        typer.Option(help="Search for the trigger: equal steps, or golden section (planes only)."),
    ] = "steps",
    kinematics: Annotated[
        Literal["lateral", "full"],
        typer.Option(
            help="lateral: the tip deflects across the probe axis only, as in the thesis; full: in "
            "all directions."
        ),
    ] = "lateral",
    model: ContactModel = "analytic",
    workpiece: Workpiece = "steel",
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Follow one touch step by step: how the tip slides from first contact to the trigger.

    The CSV contains, in mm, the spindle point P (the tip centre of an undeflected stylus), the tip
    centre C, the contact T and the surface normal n there. Forces end at the trigger.

    Example: pretravel slide omp40-2 --surface convex --at 0.5,0.5 --steps 20 -o slide.csv
    """
    import math

    import numpy as np

    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.slide_table import slide_table
    from pretravel.prediction.catalogue import load_probe
    from pretravel.prediction.materials import material
    from pretravel.probing.slide import SlideSettings
    from pretravel.probing.slide import slide as step_by_step
    from pretravel.probing.targets import Targets
    from pretravel.probing.tip import LateralTip, predicted_tip
    from pretravel.probing.touching import touch
    from pretravel.surface.specification import face_of, source_file
    from pretravel.tasks.reports.slide_report import slide_document

    check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], [probe, *source_file(surface)])
    description = load_probe(probe)
    shape = face_of(surface)
    with working("sliding"):
        tip = predicted_tip(description, model, workpiece=material(workpiece))
        local = shape.local(np.array([at]))
        target = Targets(local.point, local.normal)
        history = step_by_step(
            tip,
            shape,
            at,
            SlideSettings(
                step=step, steps=steps, process=process, search=search, kinematics=kinematics
            ),
        )
    if output is not None and not is_page(output):
        write_csv_table(output, slide_table(history))
    lateral, whole = touch(LateralTip(tip), shape, target), touch(tip, shape, target)
    report = slide_document(
        history,
        shape,
        title=f"{description.name} on {surface} at {at.first:g},{at.second:g}",
        lateral_pretravel=float(lateral.pretravel[0]) if lateral.converged[0] else math.nan,
        pretravel=float(whole.pretravel[0]) if whole.converged[0] else math.nan,
    )
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
