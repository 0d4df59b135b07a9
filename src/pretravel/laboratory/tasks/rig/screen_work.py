"""What the screen Laboratory computes; nothing here touches a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.app import Inputs, ShownResult, TaskForm, laboratory_file, with_file_names
from pretravel.base import temporary_folder
from pretravel.laboratory.rig.marks import MARKS
from pretravel.laboratory.rig.moved_marks import MovedMark
from pretravel.laboratory.rig.trace import RigTouch, RigTrace
from pretravel.laboratory.tasks.rig.task import FOREIGN_BUDGET, CalibratedRig, Rig
from pretravel.laboratory.tasks.separate.task import Separate, SeparatedErrors
from pretravel.show import Document

RIG_FORM = TaskForm(Rig, without=("tip_diameter",))
"""The diameter of the tip is for a map, which the screen does not write."""
SEPARATION_FORM = TaskForm(Separate, prefix="separate_")


@dataclass(frozen=True, eq=False)
class RigResult:
    """A calibration with its report and certificate.

    Attributes
    ----------
    rig : CalibratedRig
    document, certificate : Document
    same : Rig
        As the user can do it.
    """

    rig: CalibratedRig
    document: Document
    certificate: Document
    same: Rig

    def trace(self, name: str) -> tuple[RigTrace, RigTouch]:
        """A trace and its touch; the first ones where there is none of this name."""
        names = [trace.name for trace in self.rig.traces]
        row = names.index(name) if name in names else 0
        return self.rig.traces[row], self.rig.touches[row]


def calibrate_rig_traces(inputs: Inputs) -> RigResult:
    """Calibrate a probe from the traces of a rig.

    Raises
    ------
    PretravelError
        What the files are refused for; too few traces.
    """
    paths = sorted(inputs.files["traces"], key=lambda path: path.stem)
    budget = inputs.optional_file("budget")
    names = {path.stem for path in paths}
    given = RIG_FORM.given(inputs.settings)
    # Of traces that were taken away again nothing counts.
    given["exclude"] = [name for name in given.get("exclude", ()) if name in names]
    given["mark"] = [mark for mark in given.get("mark", ()) if MovedMark.parse(mark).trace in names]
    with temporary_folder() as folder:
        lab = laboratory_file(inputs.settings, folder)
        task = Rig(traces=tuple(paths), budget=budget, lab=lab, **given)
        found = task.run()
    warnings = [] if budget is not None else [FOREIGN_BUDGET]
    return RigResult(
        found,
        found.with_warnings(warnings),
        found.certificate(warnings),
        with_file_names(task, output=Path("rig.json")),
    )


def moved_marks(marks: Sequence[str], trace: str, event: str, place: float) -> list[str]:
    """The marks after one of them was moved, as `Rig.mark` has them.

    >>> moved_marks(["rig_000_1:r0=1.25", "rig_000_1:r1=1.5"], "rig_000_1", "r0", 1.75)
    ['rig_000_1:r1=1.5', 'rig_000_1:r0=1.75']
    """
    others = [mark for mark in marks if MovedMark.parse(mark)[:2] != (trace, event)]
    return [*others, str(MovedMark(trace, event, place))]


def shown_events(touch: RigTouch) -> list[str]:
    """The events that a trace has, in the order of their lines in its chart."""
    return [name for name in MARKS if np.isfinite(getattr(touch, name))]


def separate_readings(inputs: Inputs) -> ShownResult[SeparatedErrors]:
    """Separate the errors and variances of machine and probe.

    Raises
    ------
    PretravelError
        What the file is refused for.
    """
    given = SEPARATION_FORM.given(inputs.settings)
    with temporary_folder() as folder:
        lab = laboratory_file(inputs.settings, folder)
        task = Separate(readings=(inputs.file("readings"),), lab=lab, **given)
        found = task.run()
    same = with_file_names(task, output=Path("separation.json"))
    return ShownResult(found, replace(found, task=same).document(), same)
