"""Simulate touches on any surface, as a machine would report them."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
)
from pretravel.design.tasks.described_probe import ContactModel, Gravity, Workpiece
from pretravel.task import (
    PAGES,
    SILENT,
    Approach,
    Field,
    InModes,
    PlacedPart,
    Progress,
    Reported,
    Result,
    When,
    existing,
    is_map,
    is_probe,
    is_shape,
    output,
    surface_files,
)

if TYPE_CHECKING:
    from pretravel.base import FloatArray, Placement
    from pretravel.design.probing.simulation import SimulationResult
    from pretravel.design.probing.surface_touches import SurfaceTouches
    from pretravel.design.probing.tip import TipBehaviour
    from pretravel.prediction import Probe
    from pretravel.show import Document
    from pretravel.surface import Part, Surface
    from pretravel.touches import Targets, Touches

_DELAYS = DELAY.limits(1e-3)
_A_MAP = When("probe", is_so=is_map, what="a map")
"""It contains no model of the probe and no forces."""


class Simulate(PlacedPart, Reported):
    """Simulate touches on any surface, as a machine would report them."""

    name = "simulate"
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
            word=is_probe,
        ),
    ]
    surface: Annotated[
        str,
        Field(
            help="Surface to touch, such as plane:polar=40, sphere:radius=12.5, part.step or "
            "part.step#face; also cylinder:…, cone:…, torus:…, ellipsoid:…, convex.",
            reads=surface_files,
            word=is_shape,
        ),
    ]
    targets: Annotated[
        Path,
        Field(
            help="Targets, .csv: nx,ny,nz and, where a normal does not determine the place, "
            "x_mm,y_mm,z_mm.",
            reads=True,
        ),
    ]
    output: Annotated[Path, output("Touches: .csv; or a page, .html or .pdf.", ".csv", *PAGES)]
    model: Annotated[ContactModel, InModes(without=(_A_MAP,))] = "analytic"
    approach: Approach = None
    friction: Annotated[
        float | None,
        Field(
            help="Coulomb's coefficient of friction at the tip: with 0 the tip slides freely, with "
            "1000 it sticks; the default is friction of [tip] in the description.",
            range=FRICTION,
            without=(_A_MAP,),
        ),
    ] = None
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
    machine: Annotated[
        Path | None,
        Field(
            help="Errors of machine and probe by direction, from pretravel separate: .json or "
            ".csv. The machine's errors and the scatter of both apply in the direction of each "
            "touch; --noise is then the noise along the probe axis, which separate does not give.",
            label="Separation of machine and probe",
            reads=True,
        ),
    ] = None
    seed: Annotated[
        int | None,
        Field(
            help="Seed of the noise: the same seed gives the same touches.",
            range=(0, 2**63 - 1),
            only=("noise_um", "machine"),
        ),
    ] = None
    workpiece: Annotated[Workpiece, InModes(without=(_A_MAP,))] = "steel"
    gravity: Annotated[Gravity, InModes(without=(_A_MAP,))] = None
    clearance: Annotated[
        float,
        Field(
            help="Length of the approach, in mm, in which the tip must not touch anything else.",
            range=DISTANCE,
        ),
    ] = 2.0
    stem: Annotated[
        bool,
        Field(help="Check that the stylus, too, does not touch the part.", without=(_A_MAP,)),
    ] = False
    leave_out: Annotated[
        bool, Field(help="Write the touches that succeed, and list the targets that fail.")
    ] = False
    extrapolate: Annotated[
        bool, Field(help="Allow directions outside the map.", only=(_A_MAP,))
    ] = False

    def run(self, progress: Progress = SILENT) -> SimulatedPart:
        """Touch the targets."""
        from pretravel.design.probing import simulation
        from pretravel.design.probing.surface_touches import describe_failures
        from pretravel.files import read_map, read_targets
        from pretravel.prediction import Probe, material
        from pretravel.surface import parse_surface

        placement = self.placement()
        known, name = self._known()
        known, friction = self._friction_at_the_tip(known)
        shape = parse_surface(self.surface)
        wanted = read_targets(self.targets, shape, approach=self.approach)
        setup = simulation.PartSetup(
            material=(
                known.part_material(self.workpiece)
                if isinstance(known, Probe)
                else material(self.workpiece)
            ),
            friction=friction,
            clearance=self.clearance,
            check_stylus=self.stem,
            placement=placement,
        )
        noise = self.noise_um * MICROMETRE if self.machine is None else 0.0
        latch = simulation.Latch(self._feed(wanted), self.delay * 1e-3, noise, self.seed)
        if is_map(self.probe):
            latch = simulation.latch_with_map(latch, read_map(Path(self.probe)))
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
        if simulated.touches is None or (not self.leave_out and failures):
            simulation.refuse_failures(simulated.outcomes, wanted, shape)
        assert simulated.touches is not None  # otherwise refused
        if self.machine is not None:
            touches = self._separated(simulated.touches, setup.to_part @ self._rotation(known))
            simulated = replace(simulated, touches=touches)
        axis = None if self.stem else setup.to_part @ self._rotation(known)[:, 2]
        warnings = _warnings(shape, wanted, simulated.outcomes, failures, axis)
        return SimulatedPart(
            self, f"{name} on {self.surface}", shape, simulated, placement, tuple(warnings)
        )

    def _feed(self, wanted: Targets) -> float | None:
        """That of the targets, where it is not a setting. [mm/min]"""
        if None not in (self.feed, wanted.feed) and self.feed != wanted.feed:
            raise PretravelError(
                f"feed {self.feed:g}: {self.targets.name} has {wanted.feed:g} mm/min "
                "(feed_mm_min); give one of them",
                inputs=("feed", "targets"),
            )
        return wanted.feed if self.feed is None else self.feed

    def _friction_at_the_tip(
        self, known: Probe | TipBehaviour
    ) -> tuple[Probe | TipBehaviour, float]:
        """The friction of tip and part, which the touch has; the probe without it."""
        from pretravel.prediction import Probe

        stated = self.friction
        if not isinstance(known, Probe) or known.tip.friction == 0.0:
            return known, stated or 0.0
        described = known.tip.friction
        if stated is not None and stated != described:
            raise PretravelError(
                f"friction {stated:g}: {self.probe} has {described:g} in [tip]; give one of them",
                inputs=("friction", "probe"),
            )
        return replace(known, tip=replace(known.tip, friction=0.0)), described

    def _rotation(self, known: Probe | TipBehaviour) -> FloatArray:
        """From the frame of the probe to that of the machine, (3, 3)."""
        from pretravel.files import read_map
        from pretravel.prediction import Probe

        if isinstance(known, Probe):
            return known.orientation.matrix
        return read_map(Path(self.probe)).rotation

    def _separated(self, touches: Touches, rotation: FloatArray) -> Touches:
        """The touches with the errors of a separation, along their approaches."""
        import numpy as np

        from pretravel.files import read_touch_scatter

        assert self.machine is not None
        error = (
            read_touch_scatter(self.machine)
            .seen_from(self.placement())
            .drawn(
                touches.normals,
                rotation,
                np.random.default_rng(self.seed),
                self.noise_um * MICROMETRE if self.stated("noise_um") else None,
            )
        )
        moved = touches.positions - error[:, None] * touches.approach_directions
        return replace(touches, positions=moved)

    def _known(self) -> tuple[Probe | TipBehaviour, str]:
        """A description, or the tip that a map represents (without forces); and its name."""
        from pretravel.design.probing.tip import mapped_tip
        from pretravel.files import read_map
        from pretravel.prediction import load_probe

        if is_map(self.probe):
            return mapped_tip(read_map(Path(self.probe)), extrapolate=self.extrapolate), self.probe
        description = load_probe(self.probe)
        return description, description.name


@dataclass(frozen=True, eq=False)
class SimulatedPart(Result):
    """Simulated touches on a surface."""

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
        from pretravel.design.probing.simulation import travel_since_contact
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

        in_machine = self.task.in_machine
        write_touches(path, self.touches.moved(self.placement) if in_machine else self.touches)


def _warnings(
    shape: Surface | Part,
    targets: Targets,
    outcomes: SurfaceTouches,
    failures: list[str],
    unchecked: FloatArray | None,
) -> list[str]:
    """Warnings of faces that cannot be used, of targets that fail, and of doubtful targets."""
    from pretravel.design.probing.simulation import target_warnings
    from pretravel.surface import Part

    unreadable = shape.unreadable if isinstance(shape, Part) else {}
    return [
        *(
            f"face {number} cannot be used ({reason}): it is neglected as an obstacle"
            for number, reason in unreadable.items()
        ),
        *(f"left out: {sentence}" for sentence in failures),
        *targets.unused,
        *target_warnings(targets, outcomes, unchecked),
    ]
