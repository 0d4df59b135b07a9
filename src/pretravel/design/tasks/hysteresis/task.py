"""Load and unload a probe with friction at the seats: hysteresis, reseat error, zero drift."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import FRICTION, MICROMETRE, STEP
from pretravel.design.tasks.described_probe import Azimuths, Polars, ProbeName
from pretravel.task import (
    PAGES,
    SILENT,
    Angles,
    Field,
    PolarAngles,
    Progress,
    Reported,
    Result,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.friction.seat_friction import FrictionCycle
    from pretravel.show import Document


class Hysteresis(Reported):
    """Load and unload a probe with friction at the seats: hysteresis, reseat error, zero drift."""

    name = "hysteresis"
    example = (
        "pretravel hysteresis omp40-2 --friction 0.1 --cycles 3 -o cycles.csv --plot cycles.png"
    )

    probe: ProbeName
    friction: Annotated[
        float | None,
        Field(
            help="Coulomb's coefficient of friction at the seats, below tan(support angle); "
            "default: that of the description if above 0, else 0.2.",
            range=FRICTION,
        ),
    ] = None
    azimuth: Azimuths = Angles("0:330:30")
    polar: Polars = PolarAngles("90")
    cycles: Annotated[
        int, Field(help="Number of touches, one after the other.", range=(1, 1000))
    ] = 3
    overtravel_um: Annotated[
        float | None,
        Field(
            help="How far the tip is deflected beyond the point at which the probe would trigger "
            "without friction, in µm; default: the larger of 10 and twice the deflection at that "
            "point.",
            range=STEP,
        ),
    ] = None
    steps: Annotated[
        int, Field(help="Steps of each loading and of each return.", range=(1, 10_000))
    ] = 100
    model: Annotated[
        Literal["fem", "analytic", "rigid"],
        Field(help="Body of the probe: elastic (fem), only the stylus bends (analytic), or rigid."),
    ] = "fem"
    output: Annotated[
        Path | None,
        output("Every step of every cycle: .csv; or a page, .html or .pdf.", ".csv", *PAGES),
    ] = None

    def run(self, progress: Progress = SILENT) -> LoadedAndUnloaded:
        """Load and unload the probe."""
        import numpy as np

        from pretravel.base import grid
        from pretravel.design.fem.reduction_cache import reduced_model
        from pretravel.design.friction.seat_friction import (
            USUAL_FRICTION,
            check_conditions,
            friction_cycle,
        )
        from pretravel.prediction import load_probe

        probe = load_probe(self.probe)
        directions = grid(np.radians(self.polar.degrees), np.radians(self.azimuth.degrees))
        beyond = None if self.overtravel_um is None else self.overtravel_um * MICROMETRE
        friction = self.friction
        if friction is None:
            friction = probe.seats.friction or USUAL_FRICTION
        check_conditions(probe, friction, beyond, self.cycles, self.steps, len(directions))
        with progress.working(f"{self.cycles} touches in {len(directions)} directions"):
            found = friction_cycle(
                probe,
                directions,
                friction,
                body=reduced_model(probe) if self.model == "fem" else self.model,
                overtravel=beyond,
                cycles=self.cycles,
                steps=self.steps,
            )
        assumed = self.friction is None and not probe.seats.friction
        return LoadedAndUnloaded(probe.name, found, assumed)


@dataclass(frozen=True, eq=False)
class LoadedAndUnloaded(Result):
    """Cycles of a probe.

    Attributes
    ----------
    probe_name : str
    cycles : FrictionCycle
    friction_assumed : bool
        Neither the user nor the description gives a friction.
    """

    probe_name: str
    cycles: FrictionCycle
    friction_assumed: bool = False

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.hysteresis.report import friction_document

        return friction_document(self.cycles, self.probe_name, assumed=self.friction_assumed)

    def write(self, output: str, path: Path) -> None:
        """Write every step of every cycle."""
        del output
        from pretravel.design.friction.friction_table import friction_table
        from pretravel.files import write_csv_table

        write_csv_table(path, friction_table(self.cycles))
