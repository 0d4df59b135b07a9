from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import DELAY, DISTANCE, FEED, FRICTION, NOISE, limits
from pretravel.base.units import MICROMETRE
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import (
    Approach,
    ContactModel,
    Frame,
    Gravity,
    PictureFile,
    Place,
    Verbose,
    Workpiece,
    part_in_machine,
)
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show

if TYPE_CHECKING:
    from pretravel.prediction.description import Probe
    from pretravel.probing.surface_touches import SurfaceTouches
    from pretravel.probing.targets import Targets
    from pretravel.probing.tip import TipBehaviour
    from pretravel.surface.cad.part import Part
    from pretravel.surface.local_geometry import Surface


def simulate(
    probe: Annotated[
        str,
        typer.Argument(help="Catalogue name, TOML description, or map (.json, .csv)."),
    ],
    surface: Annotated[
        str,
        typer.Option(
            help="plane:polar=40, sphere:radius=12.5, cylinder:…, cone:…, torus:…, ellipsoid:…, "
            "convex, part.step, part.step#face."
        ),
    ],
    targets: Annotated[
        Path,
        typer.Option(help="Targets, .csv: nx,ny,nz, and x_mm,y_mm,z_mm where they are needed."),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Touches: .csv; or a page, .html or .pdf.")
    ],
    model: ContactModel = "analytic",
    approach: Approach = "normal",
    friction: Annotated[
        float,
        typer.Option(
            **limits(FRICTION),
            help="Coulomb's coefficient of friction at the tip: with 0 the tip slides freely, with "
            "1000 it sticks.",
        ),
    ] = 0.0,
    feed: Annotated[
        float | None, typer.Option(**limits(FEED), help="Feed rate, in mm/min.")
    ] = None,
    delay: Annotated[
        float, typer.Option(**limits(DELAY, 1e-3), help="Delay of the trigger signal, in ms.")
    ] = 0.0,
    noise: Annotated[
        float,
        typer.Option(
            **limits(NOISE, MICROMETRE), help="Repeatability, as a standard deviation in µm."
        ),
    ] = 0.0,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, max=2**63 - 1, help="Seed of the noise: the same seed gives the same touches."
        ),
    ] = None,
    workpiece: Workpiece = "steel",
    gravity: Gravity = None,
    clearance: Annotated[
        float,
        typer.Option(
            **limits(DISTANCE),
            help="Distance before the contact on which the tip may not touch anything else, in mm.",
        ),
    ] = 2.0,
    stem: Annotated[
        bool, typer.Option("--stem", help="Check that the stylus, too, does not touch the part.")
    ] = False,
    leave_out: Annotated[
        bool,
        typer.Option(
            "--leave-out", help="Write the touches that succeed, and list the targets that fail."
        ),
    ] = False,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="With a map: allow directions outside it.")
    ] = False,
    place: Place = None,
    frame: Frame = "part",
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Simulate touches on any surface, as a machine would report them.

    Example: pretravel simulate omp40-2 --surface part.step#1 --targets plan.csv
    --noise 0.3 --seed 1 -o touches.csv
    """
    from pretravel.files.touches_csv import read_targets, write_touches
    from pretravel.prediction.materials import material
    from pretravel.probing import simulation
    from pretravel.probing.surface_touches import describe_failures
    from pretravel.surface.specification import parse_surface, source_file
    from pretravel.tasks.reports.points_report import simulation_document
    from pretravel.touches import moved

    check_files(
        [(output, (".csv", *PAGES)), (plot, PICTURES)], [probe, targets, *source_file(surface)]
    )
    placement = part_in_machine(place, frame)
    forces = model != "analytic" or friction != 0.0 or stem or gravity is not None
    known, name = _read_probe(probe, extrapolate=extrapolate, forces=forces)
    shape = parse_surface(surface)
    wanted = read_targets(targets, shape, approach=approach)
    setup = simulation.PartSetup(
        material=material(workpiece),
        friction=friction,
        clearance=clearance,
        check_stylus=stem,
        placement=placement,
    )
    latch = simulation.Latch(feed, delay * 1e-3, noise * MICROMETRE, seed)
    with working(f"touching {len(wanted)} targets"):
        simulated = simulation.simulate_some(
            known, shape, wanted, model=model, gravity=gravity, setup=setup, latch=latch
        )
    touches, failures = simulated.touches, describe_failures(simulated.outcomes, wanted, shape)
    if touches is None or (failures and not leave_out):
        simulation.refuse_failures(simulated.outcomes, wanted, shape)
    assert touches is not None  # otherwise refused
    if not is_page(output):
        write_touches(output, moved(touches, placement) if frame == "machine" else touches)
    report = simulation_document(
        touches,
        simulation.travel_since_contact(touches, simulated.tip_radius),
        simulated.outcomes.slide,
        title=f"{name} on {surface}",
        surface=shape,
        warnings=_warnings(shape, wanted, simulated.outcomes, failures),
    )
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)


def _read_probe(probe: str, *, extrapolate: bool, forces: bool) -> tuple[Probe | TipBehaviour, str]:
    """A description of a probe, or the tip that a map represents (without forces); its name."""
    from pretravel.files.map_file import FORMER_MAP_ENDINGS, MAP_ENDINGS, read_map
    from pretravel.prediction.catalogue import load_probe
    from pretravel.probing.tip import mapped_tip

    if Path(probe).suffix.lower() in (*MAP_ENDINGS, *FORMER_MAP_ENDINGS):
        if forces:
            raise PretravelError(
                f"{probe} is a map: it contains no model of the probe and no forces for --model, "
                "--friction, --gravity or --stem; use a description of the probe (pretravel probes)"
            )
        return mapped_tip(read_map(Path(probe)), extrapolate=extrapolate), probe
    description = load_probe(probe)
    return description, description.name


def _warnings(
    shape: Surface | Part, targets: Targets, outcomes: SurfaceTouches, failures: list[str]
) -> list[str]:
    """Warnings of faces that cannot be used, of targets that fail, and of doubtful targets."""
    from pretravel.probing.simulation import target_warnings
    from pretravel.surface.cad.part import Part

    unreadable = shape.unreadable if isinstance(shape, Part) else {}
    return [
        *(
            f"face {number} cannot be used ({reason}): it is neglected as an obstacle"
            for number, reason in unreadable.items()
        ),
        *(f"left out: {sentence}" for sentence in failures),
        *target_warnings(targets, outcomes),
    ]
