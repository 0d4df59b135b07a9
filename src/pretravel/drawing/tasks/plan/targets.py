"""Choose points of a surface to touch."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, Self

from pretravel.base import DEGREE, DISTANCE, MICROMETRE, STEP, PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    UPRIGHT,
    Field,
    Pair,
    ProbeAxis,
    Progress,
    Reported,
    Result,
    is_shape,
    output,
    surface_files,
)

if TYPE_CHECKING:
    from pretravel.drawing.inspection import InspectionPlan
    from pretravel.show import Document
    from pretravel.surface import Part, Surface


class Counts(NamedTuple):
    """Numbers of points along the parameters u and v of a face."""

    along_u: int
    along_v: int

    def __str__(self) -> str:
        return f"{self.along_u}x{self.along_v}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Points along u and along v, from ``10x8``.

        >>> Counts.parse("10x8")
        Counts(along_u=10, along_v=8)
        """
        words = text.lower().split("x")
        if len(words) != 2 or not all(re.fullmatch(r"\s*[0-9]{1,5}\s*", word) for word in words):
            raise PretravelError(
                "expected the points along u and the points along v, for example 10x8"
            )
        return cls(int(words[0]), int(words[1]))


class PlanTargets(Reported):
    """Choose points of a surface to touch, as targets for simulate or for a machine."""

    name = "plan"
    example = "pretravel plan part.step#1 --spacing 3 -o plan.csv --plot plan.png"

    surface: Annotated[
        str,
        Field(
            help="Surface: part.step#face, part.step for all faces, sphere:…, convex …",
            positional=True,
            reads=surface_files,
            word=is_shape,
        ),
    ]
    output: Annotated[Path, output("Targets: .csv; or a page, .html or .pdf.", ".csv", *PAGES)]
    grid: Annotated[
        Counts | None,
        Field(help="Points along u and v of each face: 10x8.", metavar="NUxNV"),
    ] = None
    spacing: Annotated[
        float | None, Field(help="Largest distance between neighbours, in mm.", range=STEP)
    ] = None
    curvature_um: Annotated[
        float | None,
        Field(
            help="Largest height of the surface over the chord between neighbours, in µm: points "
            "are closer where the surface is curved.",
            range=STEP,
        ),
    ] = None
    margin: Annotated[float, Field(help="Distance from the edges, in mm.", range=DISTANCE)] = 1.0
    u: Annotated[
        Pair | None,
        Field(
            help="Range of the surface parameter u.",
            label="Range of the parameter u",
            metavar="FROM,TO",
        ),
    ] = None
    v: Annotated[
        Pair | None,
        Field(
            help="Range of the surface parameter v.",
            label="Range of the parameter v",
            metavar="FROM,TO",
        ),
    ] = None
    max_polar_deg: Annotated[
        float,
        Field(
            help="Largest angle between normal and probe axis, in degrees; other points are left "
            "out.",
            range=(0.001, 180.0),
        ),
    ] = 90.0
    axis: ProbeAxis = UPRIGHT

    def run(self, progress: Progress = SILENT) -> Result:
        """Choose the points."""
        from pretravel.drawing.inspection import InspectionRegion, plan_inspection
        from pretravel.surface import parse_surface

        shape = parse_surface(self.surface)
        chord = None if self.curvature_um is None else self.curvature_um * MICROMETRE
        with progress.working(f"planning on {self.surface}"):
            chosen = plan_inspection(
                shape,
                grid=self.grid,
                spacing=self.spacing,
                chord=chord,
                region=InspectionRegion(
                    self.margin, self.u, self.v, self.max_polar_deg * DEGREE, self.axis
                ),
            )
        return PlannedPoints(self, shape, chosen)


@dataclass(frozen=True, eq=False)
class PlannedPoints(Result):
    """Points of a surface to touch."""

    task: PlanTargets
    shape: Surface | Part
    chosen: InspectionPlan

    @property
    def advice(self) -> str:
        """What to do next."""
        if len(set(self.chosen.face.tolist())) > 1:
            return "To see which can be reached: pretravel simulate … --stem --leave-out"
        return ""

    def document(self) -> Document:
        """The report."""
        from pretravel.drawing.tasks.plan.report import plan_document

        title = f"Targets on {Path(self.task.surface).name}"
        return plan_document(self.chosen, self.shape, title)

    def write(self, output: str, path: Path) -> None:
        """Write the targets."""
        del output
        from pretravel.drawing.inspection_csv import plan_table
        from pretravel.files import write_csv_table

        write_csv_table(path, plan_table(self.chosen))
