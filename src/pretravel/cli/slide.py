from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, pair, working
from pretravel.cli.options import Picture, ProbeName, Workpiece


def slide(
    probe: ProbeName,
    surface: Annotated[
        str,
        typer.Option(
            help="plane:polar=40, ellipsoid:a=10,c=6, convex, part.step#face … (as for simulate)."
        ),
    ],
    at: Annotated[
        str,
        typer.Option(help="Parameters u,v of the first contact; radians where they are angles."),
    ],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Every step: .csv.")] = None,
    step: Annotated[
        float | None,
        typer.Option(
            help="Feed of a step, mm (vertical: deflection, mm; inclined: force, N); if not given "
            "0.001, inclined 0.1."
        ),
    ] = None,
    steps: Annotated[int, typer.Option(help="How many.")] = 20,
    process: Annotated[
        str, typer.Option(help="curved (any surface), vertical or inclined: the thesis's three.")
    ] = "curved",
    search: Annotated[
        str, typer.Option(help="steps; or golden, for vertical and inclined.")
    ] = "steps",
    kinematics: Annotated[
        str,
        typer.Option(
            help="lateral: the stylus gives across its axis only, as in the thesis; full: all that "
            "the model gives."
        ),
    ] = "lateral",
    model: Annotated[str, typer.Option(help="analytic, fem or shen.")] = "analytic",
    workpiece: Workpiece = "steel",
    plot: Picture = None,
) -> None:
    """Follow one touch step by step: how the tip slides from first contact to the trigger.

    The CSV has, in mm, P where the tip centre were with the stylus straight, C where it is, T the
    contact, and n the normal there; forces end at the trigger.

    Example: pretravel slide omp40-2 --surface convex --at 0.5,0.5 --steps 20 -o slide.csv
    """
    import numpy as np

    from pretravel.formats.csv_table import write_csv_table
    from pretravel.formats.slide_table import slide_table
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.materials import material
    from pretravel.probing.slide import slide as step_by_step
    from pretravel.probing.targets import Targets
    from pretravel.probing.tip import LateralTip, predicted_tip
    from pretravel.probing.touching import touch
    from pretravel.report.words import slide_report
    from pretravel.surface.specification import face_of, source_file
    from pretravel.units import MICROMETRE

    check_files([(output, (".csv",)), (plot, PICTURES)], [probe, *source_file(surface)])
    where = pair(at, "--at")
    description = load_probe(probe)
    shape = face_of(surface)
    with working("sliding"):
        tip = predicted_tip(description, model, workpiece=material(workpiece))
        local = shape.local(np.array([where]))
        target = Targets(local.point, local.normal)
        history = step_by_step(
            tip,
            shape,
            where,
            step=step,
            steps=steps,
            process=process,
            search=search,
            kinematics=kinematics,
        )
    if output is not None:
        write_csv_table(output, slide_table(history))
    if plot is not None:
        from pretravel.report.plotting import save
        from pretravel.report.surface_pictures import plot_slide

        title = f"{description.name} on {surface} at u, v = {at}"
        save(plot_slide(history, shape, title), plot)
    typer.echo(slide_report(history, description.name, f"{surface} at {at}"))
    at_once = {
        "sideways only": touch(LateralTip(tip), shape, target),
        "all that gives": touch(tip, shape, target),
    }
    for name, found in at_once.items():
        if found.converged[0]:
            typer.echo(f"  at once, {name}: {found.pretravel[0] / MICROMETRE:.3f} µm")
