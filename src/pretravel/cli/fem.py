from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, number, working
from pretravel.cli.options import Picture, ProbeName


def fem(
    probe: ProbeName,
    azimuth: Annotated[str, typer.Option(help="Of the surface normal, degrees.")] = "0",
    polar: Annotated[str, typer.Option(help="Of the surface normal, degrees; 90: a wall.")] = "90",
    refinement: Annotated[
        float, typer.Option(help="Divides all element sizes; 2 is about four times the work.")
    ] = 1.0,
    solver: Annotated[
        str, typer.Option(help="auto, cholmod (scikit-sparse), pardiso (pypardiso) or superlu.")
    ] = "auto",
    vtu: Annotated[
        Path | None, typer.Option(help="Mesh, displacement, stress, forces, for ParaView: .vtu.")
    ] = None,
    step: Annotated[
        Path | None, typer.Option(help="The solids that were meshed, for CAD: .step.")
    ] = None,
    plot: Picture = None,
) -> None:
    """Build the finite-element model of a probe and look at it at the trigger.

    Example: pretravel fem omp40-2 --vtu omp40.vtu --plot omp40.png
    """
    import math

    from pretravel.directions import from_angles
    from pretravel.errors import PretravelError
    from pretravel.formats.vtu import write_vtu
    from pretravel.model.fem.geometry import write_step
    from pretravel.model.fem.linear_solvers import check_solver
    from pretravel.model.fem.mesh import MeshSettings
    from pretravel.model.fem.reduction_cache import reduced_model
    from pretravel.probe.catalogue import load_probe
    from pretravel.report.words import fem_report
    from pretravel.trigger.elastic_field import field_at_trigger
    from pretravel.trigger.predict import predict

    check_files([(vtu, (".vtu",)), (step, (".step", ".stp")), (plot, PICTURES)], [probe])
    description = load_probe(probe)
    polar_deg, azimuth_deg = number(polar, "--polar"), number(azimuth, "--azimuth")
    if not 0.0 <= polar_deg <= 180.0:
        raise PretravelError(f"--polar {polar}: polar angles lie between 0 and 180 degrees")
    if not 0.1 <= refinement <= 5.0:
        raise PretravelError(f"--refinement {refinement:g}: it lies between 0.1 and 5")
    check_solver(solver)
    direction = from_angles(math.radians(polar_deg), math.radians(azimuth_deg))[0]
    predict(description, direction.reshape(1, 3), "shen")  # where it never triggers, say so now
    if step is not None:
        write_step(step, description)
    settings = MeshSettings(refinement=refinement)
    with working("building the finite-element model"):
        reduced = reduced_model(description, settings, solver)
        field = field_at_trigger(description, direction, reduced)
        if vtu is not None:
            write_vtu(vtu, field)
    if plot is not None:
        from pretravel.report.plotting import plot_trigger_field, save

        save(plot_trigger_field(field, description.name), plot)
    typer.echo(fem_report(reduced, field, description.name))
