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
    from pretravel.model.fem.linear_solvers import SOLVERS

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
    import math

    from pretravel.directions import from_angles
    from pretravel.formats.vtu import write_vtu
    from pretravel.model.fem.geometry import write_step
    from pretravel.model.fem.linear_solvers import check_solver
    from pretravel.model.fem.mesh import MeshSettings
    from pretravel.model.fem.reduction_cache import reduced_model
    from pretravel.probe.catalogue import load_probe
    from pretravel.report.finite_elements_report import finite_elements_document
    from pretravel.trigger.elastic_field import field_at_trigger
    from pretravel.trigger.predict import predict

    check_files(
        [(output, PAGES), (vtu, (".vtu",)), (step, (".step", ".stp")), (plot, PICTURES)], [probe]
    )
    description = load_probe(probe)
    check_solver(solver)
    direction = from_angles(math.radians(polar), math.radians(azimuth))[0]
    predict(description, direction.reshape(1, 3), "shen")  # refuses a direction without a trigger
    if step is not None:
        write_step(step, description)
    settings = MeshSettings(refinement=refinement)
    with working("building the finite-element model"):
        reduced = reduced_model(description, settings, solver)
        field = field_at_trigger(description, direction, reduced)
        if vtu is not None:
            write_vtu(vtu, field)
    report = finite_elements_document(reduced, field, description.name)
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
