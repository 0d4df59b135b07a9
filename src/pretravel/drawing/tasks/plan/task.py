"""Choose points of a surface to touch, or those that the tolerances of a drawing need."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import DEGREE, MICROMETRE, TIP_BALL, PretravelError
from pretravel.drawing.tasks.plan.targets import PlanTargets
from pretravel.task import SILENT, Field, Progress, Result

if TYPE_CHECKING:
    from pretravel.drawing.tasks.plan.needed import (
        NeededTouches,
        ProbeOfMachine,
        ReachingStylus,
    )
    from pretravel.show import Document
    from pretravel.surface import Part


_TIP = 2.0
"""Diameter of a tip that is usual for parts. [mm]"""
_UP = (0.0, 0.0, 1.0)


class PlanForDrawing(PlanTargets):
    """Choose points of a surface to touch, as targets for simulate or for a machine.

    With --drawing, choose the touches that the tolerances need, in the order of touching.
    """

    drawing: Annotated[
        Path | None,
        Field(
            help="A drawing, .toml, as pretravel drawing writes it. The touches are where the "
            "stylus reaches, datums first, and as many as U = a tenth of each tolerance needs, "
            "where this is possible.",
            label="Drawing",
            reads=True,
            states="the tolerances give how many",
        ),
    ] = None
    u_touch_um: Annotated[
        float,
        Field(
            help="Standard uncertainty of one touch, in µm, from which the number of touches "
            "follows.",
            range=(1e-3, 1e3),
            label="u of one touch",
            only=("drawing",),
        ),
    ] = 1.0
    machine: Annotated[
        Path | None,
        Field(
            help="Machine file (.toml) of the probe: choose touches that a program on this machine "
            "reaches with tip, stem and body, if the work coordinates are those of the part.",
            label="Machine file",
            reads=True,
            only=("drawing",),
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm; the default is that of the machine file, or 2.",
            range=TIP_BALL,
            only=("drawing",),
        ),
    ] = None
    stem_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the stylus above the tip, in mm; the default is half the diameter of "
            "the tip.",
            range=TIP_BALL,
            label="Diameter of the stem",
            only=("drawing",),
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> Result:
        """Choose the points."""
        if self.drawing is None:
            return super().run(progress)
        from pretravel.drawing.inspection import InspectionRegion
        from pretravel.drawing.pmi.model import read_drawing
        from pretravel.drawing.tasks.plan.needed import needed_touches
        from pretravel.surface import read_part

        if self.grid or self.spacing or self.curvature_um:
            raise PretravelError(
                "the number of touches follows from the tolerances: leave out grid, spacing and "
                "curvature",
                inputs=("drawing", "grid", "spacing", "curvature"),
            )
        drawing = read_drawing(self.drawing)
        part = read_part(self.surface)
        stylus = self._stylus()
        region = InspectionRegion(
            self.margin, self.u, self.v, self.max_polar_deg * DEGREE, self.axis
        )
        with progress.working(f"planning {self.drawing.name}"):
            found = needed_touches(drawing, part, stylus, self.u_touch_um * MICROMETRE, region)
        return PlannedDrawing(self, part, found)

    def _stylus(self) -> ReachingStylus | ProbeOfMachine:
        """What must reach the touches.

        Raises
        ------
        PretravelError
            A machine file in addition to a tip, a stem or another axis than its own.
        """
        from pretravel.drawing.tasks.plan.needed import ProbeOfMachine, ReachingStylus

        if self.machine is None:
            tip = _TIP if self.tip_diameter is None else self.tip_diameter
            stem = 0.5 * tip if self.stem_diameter is None else self.stem_diameter
            return ReachingStylus(0.5 * tip, 0.5 * stem, self.axis)
        from pretravel.files import read_machine

        if self.tip_diameter is not None or self.stem_diameter is not None:
            raise PretravelError(
                "the machine file describes the probe: leave out the diameters of tip and stem",
                inputs=("machine", "tip_diameter", "stem_diameter"),
            )
        if tuple(self.axis) != _UP:
            raise PretravelError(
                "the probe of a machine file points along z of the part: leave out the axis",
                inputs=("machine", "axis"),
            )
        return ProbeOfMachine(read_machine(self.machine))


@dataclass(frozen=True)
class PlannedDrawing(Result):
    """The touches of a drawing."""

    task: PlanForDrawing
    part: Part
    found: NeededTouches

    def document(self) -> Document:
        """The report: how many touches each feature has, and the U that they give."""
        from pretravel.drawing.tasks.plan.report import plan_document
        from pretravel.show import Column, Digits, Table

        rows = self.found.rows
        table = Table(
            (
                Column.of("feature", [row[0] for row in rows]),
                Column.of("touches", [row[1] for row in rows], digits=Digits(0)),
                Column.of("U about", [row[2] / MICROMETRE for row in rows], "µm"),
                Column.of("narrowest tolerance", [row[3] for row in rows], "mm", Digits(4)),
            ),
            title="Touches of each feature",
            explanation="U of the feature from the touches alone, without form and machine.",
        )
        title = f"Touches of {self.task.drawing.name if self.task.drawing else ''}"
        document = plan_document(self.found.plan, self.part, title)
        return replace(
            document,
            tables=(table, *document.tables),
            warnings=(*document.warnings, *self.found.warnings),
        )

    def write(self, output: str, path: Path) -> None:
        """Write the targets."""
        del output
        from pretravel.drawing.inspection_csv import plan_table
        from pretravel.files import write_csv_table

        write_csv_table(path, plan_table(self.found.plan))
