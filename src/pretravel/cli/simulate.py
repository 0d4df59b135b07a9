from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import PICTURES, check_files, unit_vector, working
from pretravel.cli.options import Frame, Gravity, Picture, Place, Workpiece


def simulate(
    probe: Annotated[
        str,
        typer.Argument(help="Catalogue name, path of a TOML description, or a map (.nc, .csv)."),
    ],
    surface: Annotated[
        str,
        typer.Option(
            help="plane:polar=40, sphere:radius=12.5, cylinder:…, cone:…, torus:…, ellipsoid:…, "
            "convex, part.step, part.step#face."
        ),
    ],
    targets: Annotated[
        Path, typer.Option(help="CSV of targets: nx,ny,nz, with x_mm,y_mm,z_mm where needed.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Touches: .csv.")],
    model: Annotated[str, typer.Option(help="analytic, fem or shen.")] = "analytic",
    approach: Annotated[
        str, typer.Option(help="normal: along -n; file: columns ax,ay,az of the targets.")
    ] = "normal",
    friction: Annotated[
        float, typer.Option(help="Coulomb's coefficient at the tip: 0 slides freely, inf sticks.")
    ] = 0.0,
    feed: Annotated[float | None, typer.Option(help="Feed rate, mm/min.")] = None,
    delay: Annotated[float, typer.Option(help="Delay of the trigger signal, ms.")] = 0.0,
    noise: Annotated[float, typer.Option(help="Repeatability, standard deviation in µm.")] = 0.0,
    seed: Annotated[int | None, typer.Option(help="Of the noise, to get the same again.")] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    clearance: Annotated[
        float, typer.Option(help="Way before the contact on which nothing else may be met, mm.")
    ] = 2.0,
    stem: Annotated[
        bool, typer.Option("--stem", help="The stylus, too, must not run into the part.")
    ] = False,
    leave_out: Annotated[
        bool,
        typer.Option(
            "--leave-out", help="Write the touches that succeed; targets that fail are named."
        ),
    ] = False,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="With a map: also outside its directions.")
    ] = False,
    place: Place = None,
    frame: Frame = "part",
    plot: Picture = None,
) -> None:
    """Simulate touches on any surface, as a machine would report them.

    Example: pretravel simulate omp40-2 --surface part.step#1 --targets plan.csv
    --noise 0.3 --seed 1 -o touches.csv
    """
    import numpy as np

    from pretravel.errors import PretravelError
    from pretravel.formats.map_file import read_map
    from pretravel.formats.touches_csv import read_targets, write_touches
    from pretravel.frames import parse_placement
    from pretravel.probe.catalogue import load_probe
    from pretravel.probe.materials import material
    from pretravel.probing import simulation
    from pretravel.probing.touching import describe_failures
    from pretravel.surface.cad.part import Part
    from pretravel.surface.specification import parse_surface, source_file
    from pretravel.touches import moved
    from pretravel.units import MICROMETRE

    check_files([(output, (".csv",)), (plot, PICTURES)], [probe, targets, *source_file(surface)])
    part_in_machine = parse_placement(place, frame)
    measured = Path(probe).suffix.lower() in (".nc", ".csv")
    if measured and (model != "analytic" or friction or stem or gravity is not None):
        raise PretravelError(
            f"{probe} is a map: it has no --model, and no forces for --friction, --gravity or "
            "--stem; describe the probe instead (pretravel probes)"
        )
    known = read_map(Path(probe)) if measured else load_probe(probe)
    shape = parse_surface(surface)
    wanted = read_targets(targets, shape, approach=approach)
    with working(f"touching {len(wanted)} targets"):
        simulated = simulation.simulate_some(
            known,
            shape,
            wanted,
            model=model,
            workpiece=material(workpiece),
            gravity=None if gravity is None else unit_vector(gravity, "--gravity"),
            friction=friction,
            clearance=clearance,
            stem=stem,
            feed=feed,
            delay=delay * 1e-3,
            noise=noise * MICROMETRE,
            seed=seed,
            placement=part_in_machine,
            extrapolate=extrapolate,
        )
    failures = describe_failures(simulated.happened, wanted, shape)
    if failures and not (leave_out and simulated.touches):
        simulation.refuse(simulated.happened, wanted, shape)
    touches = simulated.touches
    assert touches is not None  # none at all was refused above
    write_touches(output, moved(touches, part_in_machine) if frame == "machine" else touches)
    unreadable = shape.unreadable if isinstance(shape, Part) else {}
    for warning in [
        *(
            f"face {number} cannot be used ({reason}): it is not in the way of anything"
            for number, reason in unreadable.items()
        ),
        *(f"left out: {sentence}" for sentence in failures),
        *simulation.target_warnings(wanted, simulated.happened),
    ]:
        typer.echo(f"Warning: {warning}", err=True)
    travel = simulation.travel_since_contact(touches, simulated.tip_radius)
    slide = simulated.happened.slide
    typer.echo(
        f"{len(touches)} touches: travel since first contact "
        f"{np.min(travel) / MICROMETRE:.2f} to {np.max(travel) / MICROMETRE:.2f} µm, "
        f"slide along the surface up to {np.nanmax(slide) / MICROMETRE:.2f} µm"
    )
    if plot is not None:
        from pretravel.report.plotting import plot_touches, save

        name = known.name if hasattr(known, "name") else probe
        save(plot_touches(touches, travel, f"{name} on {surface}"), plot)
