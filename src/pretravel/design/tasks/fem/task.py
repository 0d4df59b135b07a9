"""The finite-element model of a described probe, and its state at the trigger in a direction."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.design.tasks.described_probe import ProbeName
from pretravel.task import PAGES, SILENT, Field, Progress, Reported, Result, output

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pretravel.base import FloatArray
    from pretravel.design.fem.condensation import ReducedModel
    from pretravel.design.fem.elastic_field import StressByDirection, TriggerField
    from pretravel.prediction import Probe
    from pretravel.show import Document

_AZIMUTHS = range(0, 360, 30)
"""At which the stress of the parts is compared. [deg]"""


def _solvers() -> list[str]:
    from pretravel.design.fem.linear_solvers import SOLVERS

    return ["auto", *SOLVERS]


class Fem(Reported):
    """Build the finite elements of a probe, with its state at the trigger."""

    name = "fem"
    example = "pretravel fem omp40-2 --vtu omp40.vtu --plot omp40.png"

    probe: ProbeName
    azimuth_deg: Annotated[
        float, Field(help="Azimuth of the surface normal, in degrees.", range=(-360.0, 360.0))
    ] = 0.0
    polar_deg: Annotated[
        float,
        Field(
            help="Polar angle of the surface normal, in degrees; 90 is a vertical wall.",
            range=(0.0, 180.0),
        ),
    ] = 90.0
    refinement: Annotated[
        float,
        Field(
            help="Divides all element sizes; 2 needs about four times the time.", range=(0.1, 5.0)
        ),
    ] = 1.0
    solver: Annotated[
        str,
        Field(
            help="auto, pardiso (pypardiso), cholmod (cvxopt) or superlu.",
            names=_solvers,
            metavar="SOLVER",
        ),
    ] = "auto"
    vtu: Annotated[
        Path | None,
        Field(
            help="Mesh, displacements, stresses and forces for ParaView: .vtu.", writes=(".vtu",)
        ),
    ] = None
    step: Annotated[
        Path | None,
        Field(help="The solids of the mesh, for CAD: .step.", writes=(".step", ".stp")),
    ] = None
    output: Annotated[Path | None, output("A page, .html or .pdf.", *PAGES)] = None

    def run(self, progress: Progress = SILENT) -> FiniteElementState:
        """Build the model and determine its state."""
        import numpy as np

        from pretravel.design.fem.elastic_field import (
            field_at_trigger,
            refuse_what_no_field_shows,
            stress_by_direction,
        )
        from pretravel.design.fem.geometry import write_step
        from pretravel.design.fem.linear_solvers import check_solver
        from pretravel.design.fem.mesh import MeshSettings
        from pretravel.design.fem.reduction_cache import model_in_memory
        from pretravel.prediction import load_probe, predict

        probe = load_probe(self.probe)
        check_solver(self.solver)
        refuse_what_no_field_shows(probe)
        normal = _normal(self.polar_deg, self.azimuth_deg)
        predict(probe, normal.reshape(1, 3), "shen")  # a direction without a trigger is refused now
        if self.step is not None:  # without the model, which needs much longer
            write_step(self.step, probe)
        with progress.working("finite elements"):
            settings = MeshSettings(refinement=self.refinement)
            reduced = model_in_memory(probe, settings, self.solver)
            field = field_at_trigger(probe, normal, reduced)
            around = np.array(list(self._triggering(probe)))
            stresses = stress_by_direction(probe, around, reduced, field)
            return FiniteElementState(probe, reduced, field, stresses)

    def _triggering(self, probe: Probe) -> Iterator[FloatArray]:
        """The direction of the touch, then those at its polar angle in which the probe triggers."""
        import math

        from pretravel.base import PretravelError
        from pretravel.prediction import predict

        own = _normal(self.polar_deg, self.azimuth_deg)
        yield own
        if math.hypot(*own[:2]) <= 1e-9:  # along the axis there is one direction only
            return
        for azimuth in _AZIMUTHS:
            normal = _normal(self.polar_deg, float(azimuth))
            try:
                predict(probe, normal.reshape(1, 3), "shen")
            except PretravelError:
                continue
            yield normal


def _normal(polar_deg: float, azimuth_deg: float) -> FloatArray:
    """Outward unit normal, (3,)."""
    import math

    import numpy as np

    from pretravel.base import from_angles

    return np.asarray(from_angles(math.radians(polar_deg), math.radians(azimuth_deg))[0])


@dataclass(frozen=True, eq=False)
class FiniteElementState(Result):
    """A probe's finite-element model with its state at the trigger.

    Attributes
    ----------
    probe : Probe
    reduced : ReducedModel
    field : TriggerField
        In one direction.
    stresses : StressByDirection
        In that direction first, then all around at its polar angle.
    """

    probe: Probe
    reduced: ReducedModel
    field: TriggerField
    stresses: StressByDirection

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.fem.report import finite_elements_document

        return finite_elements_document(
            self.reduced, self.field, self.stresses, probe_name=self.probe.name
        )

    def write(self, output: str, path: Path) -> None:
        """Write the mesh with its fields; the solids have been written before."""
        from pretravel.design.fem.vtu import write_vtu

        if output == "vtu":
            write_vtu(path, self.field)
