from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, unit_vector, working
from pretravel.cli.options import Gravity, Picture, ProbeName, Workpiece


def simulate(
    probe: ProbeName,
    surface: Annotated[
        str, typer.Option(help="plane:polar=40,azimuth=0 or sphere:radius=12.5,x=0,y=0,z=0")
    ],
    targets: Annotated[
        Path, typer.Option(help="CSV: nx,ny,nz and x_mm,y_mm,z_mm (points of the surface).")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Touches, .csv.")],
    model: Annotated[str, typer.Option(help="analytic, fem or shen.")] = "analytic",
    approach: Annotated[
        str, typer.Option(help="normal: along -n; file: columns ax,ay,az of the targets.")
    ] = "normal",
    friction: Annotated[
        float, typer.Option(help="Friction at the tip; only 0 (free sliding) so far.")
    ] = 0.0,
    feed: Annotated[float | None, typer.Option(help="Feed rate, mm/min.")] = None,
    delay: Annotated[float, typer.Option(help="Delay of the trigger signal, ms.")] = 0.0,
    noise: Annotated[float, typer.Option(help="Repeatability, standard deviation in µm.")] = 0.0,
    seed: Annotated[int | None, typer.Option(help="Of the noise, to get the same again.")] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    plot: Picture = None,
) -> None:
    """Simulate touches on a plane or sphere, as a machine would report them.

    Example: pretravel simulate omp40-2 --surface sphere:radius=12.5 --targets targets.csv
    --noise 0.3 --seed 1 -o touches.csv
    """
    import numpy as np

    from pretravel.errors import PretravelError
    from pretravel.formats.touches_csv import read_targets, write_touches
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.materials import material
    from pretravel.probing import simulation
    from pretravel.surface.specification import parse_surface
    from pretravel.units import MICROMETRE

    if friction != 0.0:
        raise PretravelError(
            f"--friction {friction:g}: friction at the tip is not modelled yet; only 0 is possible"
        )
    check_files([(output, (".csv",)), (plot, PICTURES)], [probe, targets])
    description = load_probe(probe)
    shape = parse_surface(surface)
    wanted = read_targets(targets, shape, approach=approach)
    with working(f"touching {len(wanted.points)} targets"):
        touches = simulation.simulate(
            description,
            shape,
            wanted,
            model=model,
            workpiece=material(workpiece),
            gravity=None if gravity is None else unit_vector(gravity, "--gravity"),
            feed=feed,
            delay=delay * 1e-3,
            noise=noise * MICROMETRE,
            seed=seed,
        )
    write_touches(output, touches)
    for warning in simulation.target_warnings(wanted, shape):
        typer.echo(f"Warning: {warning}", err=True)
    travel = simulation.travel_since_contact(touches, description.tip.radius)
    typer.echo(
        f"{len(touches.positions)} touches: travel since first contact "
        f"{np.min(travel) / MICROMETRE:.2f} to {np.max(travel) / MICROMETRE:.2f} µm"
    )
    if plot is not None:
        from pretravel.plotting import plot_touches, save

        save(plot_touches(touches, travel, f"{description.name} on {surface}"), plot)
