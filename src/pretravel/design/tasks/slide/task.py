"""Follow one touch step by step: how the tip slides from first contact to the trigger."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import STEP
from pretravel.design.tasks.described_probe import ContactModel, ProbeName, Workpiece
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    Pair,
    Progress,
    Reported,
    Result,
    is_shape,
    output,
    surface_files,
)

if TYPE_CHECKING:
    from pretravel.design.probing.slide_history import SlideHistory
    from pretravel.design.probing.tip import PredictedTip
    from pretravel.prediction import Probe
    from pretravel.show import Document
    from pretravel.surface import Surface


class Slide(Reported):
    """Follow one touch step by step: how the tip slides from first contact to the trigger.

    The CSV contains, in mm, the spindle point P (the tip centre of an undeflected stylus), the tip
    centre C, the contact T and the surface normal n there. Forces end at the trigger.
    """

    name = "slide"
    example = "pretravel slide omp40-2 --surface convex --at 0.5,0.5 --step 0.0001 -o slide.csv"

    probe: ProbeName
    surface: Annotated[
        str,
        Field(
            help="Surface to touch, such as plane:polar=40, ellipsoid:a=10,c=6, part.step#face, or "
            "convex (of Rodrigues' thesis).",
            reads=surface_files,
            word=is_shape,
        ),
    ]
    at: Annotated[
        Pair,
        Field(
            help="Surface parameters of the first contact, in radians where they are angles.",
            label="First contact: surface parameters u,v",
            hint="In mm, or in radians where they are angles",
            metavar="U,V",
        ),
    ]
    output: Annotated[
        Path | None, output("Every step: .csv; or a page, .html or .pdf.", ".csv", *PAGES)
    ] = None
    step: Annotated[
        float | None,
        Field(
            help="Travel of a step, in mm (for process vertical the deflection, in mm; for "
            "inclined the force, in N); default: 0.001, for inclined 0.1.",
            range=STEP,
        ),
    ] = None
    steps: Annotated[int, Field(help="Number of steps.", range=(1, 100_000))] = 20
    process: Annotated[
        Literal["curved", "inclined", "vertical"],
        Field(
            help="How the touch proceeds, as in Rodrigues' thesis, by equal steps of the travel "
            "(curved, any surface), of the deflection (vertical, planes) or of the force "
            "(inclined, planes)."
        ),
    ] = "curved"
    search: Annotated[
        Literal["steps", "golden"],
        Field(help="Search for the trigger: equal steps, or golden section (planes only)."),
    ] = "steps"
    kinematics: Annotated[
        Literal["lateral", "full"],
        Field(
            help="lateral: the tip deflects across the probe axis only, as in the thesis; full: in "
            "all directions."
        ),
    ] = "lateral"
    model: ContactModel = "analytic"
    workpiece: Workpiece = "steel"

    def run(self, progress: Progress = SILENT) -> FollowedSlide:
        """Follow the touch."""
        from pretravel.prediction import load_probe

        with progress.working("sliding"):
            return self.followed(load_probe(self.probe))

    def followed(self, probe: Probe) -> FollowedSlide:
        """Follow the touch of a probe that has been read.

        Raises
        ------
        PretravelError
            A surface, a process or a model that cannot be followed.
        """
        from pretravel.design.probing.slides import SlideSettings, slide
        from pretravel.design.probing.tip import predicted_tip
        from pretravel.surface import face_of

        shape = face_of(self.surface)
        tip = predicted_tip(probe, self.model, workpiece=probe.part_material(self.workpiece))
        settings = SlideSettings(
            step=self.step,
            steps=self.steps,
            process=self.process,
            search=self.search,
            kinematics=self.kinematics,
        )
        return FollowedSlide(self, probe, shape, tip, slide(tip, shape, self.at, settings))


@dataclass(frozen=True, eq=False)
class FollowedSlide(Result):
    """A touch step by step."""

    task: Slide
    probe: Probe
    shape: Surface
    tip: PredictedTip
    history: SlideHistory

    def document(self) -> Document:
        """The report, with the pretravel of the whole touch."""
        import math

        import numpy as np

        from pretravel.design.probing.tip import LateralTip
        from pretravel.design.probing.touching import touch
        from pretravel.design.tasks.slide.report import slide_document
        from pretravel.touches import Targets

        at, shape = self.task.at, self.shape
        local = shape.local(np.array([at]))
        target = Targets(local.point, local.normal)
        lateral, whole = touch(LateralTip(self.tip), shape, target), touch(self.tip, shape, target)
        return slide_document(
            self.history,
            shape,
            title=f"{self.probe.name} on {self.task.surface} at {at.first:g},{at.second:g}",
            lateral_pretravel=float(lateral.pretravel[0]) if lateral.converged[0] else math.nan,
            pretravel=float(whole.pretravel[0]) if whole.converged[0] else math.nan,
        )

    def write(self, output: str, path: Path) -> None:
        """Write every step."""
        del output
        from pretravel.design.probing.slide_tables import slide_table
        from pretravel.files import write_csv_table

        write_csv_table(path, slide_table(self.history))
