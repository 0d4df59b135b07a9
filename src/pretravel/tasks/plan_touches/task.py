"""Plan the few touches on the reference that keep an old map good."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import REFERENCE_DIAMETER, PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    InModes,
    Progress,
    Reported,
    Result,
    SphereCenter,
    StartClearance,
    Vector,
    output,
)
from pretravel.tasks.qualify import Lengths

if TYPE_CHECKING:
    from pretravel.maps import PretravelMap
    from pretravel.qualification import BlockPlan, TouchPlan
    from pretravel.show import Document


class PlanTouches(Reported):
    """Choose the few touches that bring an old map up to date, or the touches on a block.

    Make these touches, and update the map with pretravel qualify --prior. With --block, the
    touches on a gauge block separate scale, squareness and backlash of the machine from the
    pretravel: evaluate them with pretravel qualify --block.
    """

    name = "plan-touches"
    example = "pretravel plan-touches --map map.json --count 9 -o targets.csv"

    map_file: Annotated[
        Path | None,
        Field(
            help="Map of pretravel qualify, .json.",
            option="--map",
            label="Map",
            reads=True,
            without=("block",),
        ),
    ] = None
    count: Annotated[
        int,
        Field(
            help="Number of touches, each in its own direction.",
            range=(1, 100_000),
            without=("block",),
        ),
    ] = 9
    normals: Annotated[
        Path | None,
        Field(
            help="Directions for which the map is needed: touches or targets of a part, .csv with "
            "nx,ny,nz. Without it, all directions of the map.",
            reads=True,
            without=("block",),
        ),
    ] = None
    history: Annotated[
        Path | None,
        Field(
            help="History of the probe, .jsonl (see pretravel verify): how much it drifts. "
            "Without it, a usual drift is assumed.",
            reads=True,
            without=("block",),
        ),
    ] = None
    diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the sphere, in mm; the default is that of the qualification.",
            range=REFERENCE_DIAMETER,
            without=("block",),
        ),
    ] = None
    center: SphereCenter = Vector(0, 0, 0)
    clearance: Annotated[StartClearance, InModes(without=("block",))] = 5.0
    block: Annotated[
        Lengths | None,
        Field(
            help="Plan touches on a block with these lengths in mm: 50.8 for a cube, or the "
            "lengths along x, y and z before the block is turned, such as 25.4,50.8,76.2. The "
            "middle of the block is at --center, about which it is turned to 0, 90, 30 and 180 "
            "degrees.",
            metavar="L or X,Y,Z",
        ),
    ] = None
    output: Annotated[
        Path | None, output("Targets: .csv; or a page, .html or .pdf.", ".csv", *PAGES)
    ] = None

    def run(self, progress: Progress = SILENT) -> PlannedTouches | PlannedBlock:
        """Choose the directions.

        Raises
        ------
        PretravelError
            A map of a ring; a count of touches that do not determine it.
        """
        del progress
        if self.block is None and self.map_file is None:
            raise PretravelError(
                "touches are planned for an old map, or for a block: give one of them",
                inputs=("map_file", "block"),
            )
        if self.block is not None:
            from pretravel.qualification import plan_block

            return PlannedBlock(self, plan_block(self.block))
        assert self.map_file is not None
        from pretravel.files import read_map
        from pretravel.qualification import ProbeDrift, plan_touches

        old_map = read_map(self.map_file)
        _refuse_ring(old_map)
        drift, wanted = ProbeDrift(), None
        if self.history is not None:
            from pretravel.files import drift_of_history, read_history

            drift = drift_of_history(read_history(self.history))
        if self.normals is not None:
            from pretravel.files import read_normals

            wanted = read_normals(self.normals)
        plan = plan_touches(old_map, self.count, normals=wanted, drift=drift)
        return PlannedTouches(self, old_map, plan)


@dataclass(frozen=True, eq=False)
class PlannedTouches(Result):
    """A plan of touches with the map that it is for."""

    task: PlanTouches
    old_map: PretravelMap
    plan: TouchPlan

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.plan_touches.report import touch_plan_document

        assert self.task.map_file is not None
        return touch_plan_document(self.plan, map_name=self.task.map_file.name)

    def write(self, output: str, path: Path) -> None:
        """Write the targets.

        Raises
        ------
        PretravelError
            Nothing states the diameter of the reference.
        """
        del output
        from pretravel.files import pattern_table, write_csv_table

        retreat = self.old_map.tip_radius + self.task.clearance
        radius = 0.5 * self._diameter()
        center = self.task.center
        write_csv_table(path, pattern_table(self.plan.normals, center, radius, retreat))

    def _diameter(self) -> float:
        setup = self.old_map.provenance.setup
        if self.task.diameter is not None:
            return self.task.diameter
        if setup is None:
            raise PretravelError(
                "the map does not give the diameter of its reference; give it",
                inputs=("diameter",),
            )
        return setup.diameter


@dataclass(frozen=True, eq=False)
class PlannedBlock(Result):
    """A plan of touches on a block."""

    task: PlanTouches
    plan: BlockPlan

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.plan_touches.block_report import block_plan_document

        assert self.task.block is not None
        return block_plan_document(self.plan, tuple(self.task.block))

    def write(self, output: str, path: Path) -> None:
        """Write the targets."""
        del output
        from pretravel.files import block_table, write_csv_table

        write_csv_table(path, block_table(self.plan, self.task.center))


def _refuse_ring(old_map: PretravelMap) -> None:
    setup = old_map.provenance.setup
    if setup is not None and setup.ring:
        raise PretravelError(
            "this map was made in a ring gauge. Its few directions need no plan: touch evenly "
            "around, and qualify with the map as prior"
        )
