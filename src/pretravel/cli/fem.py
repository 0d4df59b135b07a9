from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import one_of
from pretravel.cli.files import PAGES, PICTURES, check_files
from pretravel.cli.options import PictureFile, ProbeName, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def _solvers() -> list[str]:
    from pretravel.prediction.fem.linear_solvers import SOLVERS

    return ["auto", *SOLVERS]


def fem(
    probe: ProbeName,
    azimuth: Annotated[
        float,
        typer.Option(min=-360.0, max=360.0, help="Azimuth of the surface normal, in degrees."),
    ] = 0.0,
    polar: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=180.0,
            help="Polar angle of the surface normal, in degrees; 90 is a vertical wall.",
        ),
    ] = 90.0,
    refinement: Annotated[
        float,
        typer.Option(
            min=0.1, max=5.0, help="Divides all element sizes; 2 needs about four times the time."
        ),
    ] = 1.0,
    solver: Annotated[
        str,
        typer.Option(
            parser=one_of(_solvers),
            metavar="SOLVER",
            help="auto, cholmod (scikit-sparse), pardiso (pypardiso) or superlu.",
        ),
    ] = "auto",
    vtu: Annotated[
        Path | None,
        typer.Option(help="Mesh, displacements, stresses and forces for ParaView: .vtu."),
    ] = None,
    step: Annotated[
        Path | None, typer.Option(help="The solids of the mesh, for CAD: .step.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A page, .html or .pdf.")
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Build the finite-element model of a probe and show its state at the trigger.

    Example: pretravel fem omp40-2 --vtu omp40.vtu --plot omp40.png
    """
    from pretravel.files.vtu import write_vtu
    from pretravel.prediction.catalogue import load_probe
    from pretravel.prediction.fem.geometry import write_step
    from pretravel.prediction.fem.linear_solvers import check_solver
    from pretravel.prediction.fem.mesh import MeshSettings
    from pretravel.tasks.fem import TouchDirection, build_model, check_touch, state_at_trigger

    check_files(
        [(output, PAGES), (vtu, (".vtu",)), (step, (".step", ".stp")), (plot, PICTURES)], [probe]
    )
    description = load_probe(probe)
    check_solver(solver)
    touch = TouchDirection(polar, azimuth)
    check_touch(description, touch)
    if step is not None:
        write_step(step, description)
    with working("finite elements"):
        reduced = build_model(description, MeshSettings(refinement=refinement), solver)
        state = state_at_trigger(description, reduced, touch)
        if vtu is not None:
            write_vtu(vtu, state.field)
    report = state.document()
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
