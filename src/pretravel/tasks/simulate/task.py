"""Simulate touches on any surface, as a machine would report them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import (
    DELAY,
    DISTANCE,
    FEED,
    FRICTION,
    MICROMETRE,
    NOISE,
    PretravelError,
    limits,
)
from pretravel.task import (
    PAGES,
    SILENT,
    Approach,
    ContactModel,
    Field,
    Gravity,
    PlacedPart,
    Progress,
    Reported,
    Result,
    Workpiece,
    existing,
    output,
    surface_files,
)

if TYPE_CHECKING:
    from pretravel.base import Placement
    from pretravel.prediction import Probe
    from pretravel.probing import SimulationResult, SurfaceTouches, TipBehaviour
    from pretravel.show import Document
    from pretravel.surface import Part, Surface
    from pretravel.touches import Targets, Touches

_DELAYS = limits(DELAY, 1e-3)


class Simulate(PlacedPart, Reported):
    """Simulate touches on any surface, as a machine would report them."""

    name = "simulate"
    group = "Predict"
    example = (
        "pretravel simulate omp40-2 --surface part.step#1 --targets plan.csv\n"
        "--noise 0.3 --seed 1 -o touches.csv"
    )

    probe: Annotated[
        str,
        Field(
            help="Catalogue name, TOML description, or map (.json, .csv).",
            positional=True,
            reads=existing,
        ),
    ]
    surface: Annotated[
        str,
        Field(
            help="plane:polar=40, sphere:radius=12.5, cylinder:…, cone:…, torus:…, ellipsoid:…, "
            "convex, part.step, part.step#face.",
            reads=surface_files,
        ),
    ]
    targets: Annotated[
        Path,
        Field(
            help="Targets, .csv: nx,ny,nz, and x_mm,y_mm,z_mm where they are needed.", reads=True
        ),
    ]
    output: Annotated[Path, output("Touches: .csv; or a page, .html or .pdf.", ".csv", *PAGES)]
    model: ContactModel = "analytic"
    approach: Approach = "normal"
    friction: Annotated[
        float,
        Field(
            help="Coulomb's coefficient of friction at the tip: with 0 the tip slides freely, with "
            "1000 it sticks.",
            range=FRICTION,
        ),
    ] = 0.0
    feed: Annotated[float | None, Field(help="Feed rate, in mm/min.", range=FEED)] = None
    delay: Annotated[
        float,
        Field(
            help="Delay of the trigger signal, in ms.",
            range=(_DELAYS["min"], _DELAYS["max"]),
            unit="ms",
        ),
    ] = 0.0
    noise_um: Annotated[
        float, Field(help="Repeatability, as a standard deviation in µm.", range=NOISE)
    ] = 0.0
    seed: Annotated[
        int | None,
        Field(
            help="Seed of the noise: the same seed gives the same touches.", range=(0, 2**63 - 1)
        ),
    ] = None
    workpiece: Workpiece = "steel"
    gravity: Gravity = None
    clearance: Annotated[
        float,
        Field(
            help="Distance before the contact on which the tip may not touch anything else, in mm.",
            range=DISTANCE,
        ),
    ] = 2.0
    stem: Annotated[bool, Field(help="Check that the stylus, too, does not touch the part.")] = (
        False
    )
    leave_out: Annotated[
        bool, Field(help="Write the touches that succeed, and list the targets that fail.")
    ] = False
    extrapolate: Annotated[bool, Field(help="With a map: allow directions outside it.")] = False

    def run(self, progress: Progress = SILENT) -> SimulatedPart:
        """Touch the targets."""
        from pretravel.files import read_targets
        from pretravel.prediction import material
        from pretravel.probing import describe_failures, simulation
        from pretravel.surface import parse_surface

        placement = self.placement()
        known, name = self._known()
        shape = parse_surface(self.surface)
        wanted = read_targets(self.targets, shape, approach=self.approach)
        setup = simulation.PartSetup(
            material=material(self.workpiece),
            friction=self.friction,
            clearance=self.clearance,
            check_stylus=self.stem,
            placement=placement,
        )
        latch = simulation.Latch(
            self.feed, self.delay * 1e-3, self.noise_um * MICROMETRE, self.seed
        )
        with progress.working(f"touching {len(wanted)} targets"):
            simulated = simulation.simulate_some(
                known,
                shape,
                wanted,
                model=self.model,
                gravity=self.gravity,
                setup=setup,
                latch=latch,
            )
        failures = describe_failures(simulated.outcomes, wanted, shape)
        if simulated.touches is None or (failures and not self.leave_out):
            simulation.refuse_failures(simulated.outcomes, wanted, shape)
        assert simulated.touches is not None  # otherwise refused
        warnings = _warnings(shape, wanted, simulated.outcomes, failures)
        return SimulatedPart(
            self, f"{name} on {self.surface}", shape, simulated, placement, tuple(warnings)
        )

    def _known(self) -> tuple[Probe | TipBehaviour, str]:
        """A description, or the tip that a map represents (without forces); and its name."""
        from pretravel.files import FORMER_MAP_ENDINGS, MAP_ENDINGS, read_map
        from pretravel.prediction import load_probe
        from pretravel.probing import mapped_tip

        if Path(self.probe).suffix.lower() in (*MAP_ENDINGS, *FORMER_MAP_ENDINGS):
            names = ("model", "friction", "gravity", "stem")
            forces = tuple(name for name in names if self.stated(name))
            if forces:
                raise PretravelError(
                    f"{self.probe} is a map: it contains no model of the probe and no forces for "
                    "a model, friction, weight or the stem; use a description of the probe "
                    "(pretravel probes)",
                    inputs=forces,
                )
            return mapped_tip(read_map(Path(self.probe)), extrapolate=self.extrapolate), self.probe
        description = load_probe(self.probe)
        return description, description.name


@dataclass(frozen=True, eq=False)
class SimulatedPart(Result):
    """Simulated touches on a surface.

    Attributes
    ----------
    task : Simulate
    title : str
    shape : Surface or Part
    simulated : SimulationResult
    placement : Placement
    warnings : tuple of str
    """

    task: Simulate
    title: str
    shape: Surface | Part
    simulated: SimulationResult
    placement: Placement
    warnings: tuple[str, ...]

    @property
    def touches(self) -> Touches:
        """In the frame of the part."""
        assert self.simulated.touches is not None
        return self.simulated.touches

    def document(self) -> Document:
        """The report."""
        from pretravel.probing import travel_since_contact
        from pretravel.tasks.compensate import simulation_document

        return simulation_document(
            self.touches,
            travel_since_contact(self.touches, self.simulated.tip_radius),
            self.simulated.outcomes.slide,
            title=self.title,
            surface=self.shape,
            warnings=self.warnings,
        )

    def write(self, output: str, path: Path) -> None:
        """Write the touches, in the frame that is asked for."""
        del output
        from pretravel.files import write_touches
        from pretravel.touches import moved

        in_machine = self.task.in_machine
        write_touches(path, moved(self.touches, self.placement) if in_machine else self.touches)


def _warnings(
    shape: Surface | Part, targets: Targets, outcomes: SurfaceTouches, failures: list[str]
) -> list[str]:
    """Warnings of faces that cannot be used, of targets that fail, and of doubtful targets."""
    from pretravel.probing import target_warnings
    from pretravel.surface import Part

    unreadable = shape.unreadable if isinstance(shape, Part) else {}
    return [
        *(
            f"face {number} cannot be used ({reason}): it is neglected as an obstacle"
            for number, reason in unreadable.items()
        ),
        *(f"left out: {sentence}" for sentence in failures),
        *target_warnings(targets, outcomes),
    ]
