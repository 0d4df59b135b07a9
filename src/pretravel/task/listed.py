"""What pretravel does for people, a folder a task: settings, run, report, screen.

`GROUPS` lists the tasks as the help does; `task_named` imports one. The command line and the
workbench are made from the descriptions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pretravel.base import object_at

if TYPE_CHECKING:
    from pretravel.task.task import Task

GROUPS: dict[str, dict[str, str]] = {
    "Start": {"demo": "demo:Demo"},
    "Qualify": {
        "qualify": "tasks.qualify:Qualify",
        "verify": "tasks.verify:Verify",
        "history": "tasks.history:History",
        "plan-touches": "tasks.plan_touches:PlanTouches",
        "check-budget": "drawing.tasks.check_budget:CheckBudget",
        "repeat": "laboratory.tasks.repeat:Repeat",
    },
    "Measure": {
        "align": "drawing.tasks.align:Align",
        "axis": "controls.tasks.axis:FindAxis",
        "compensate": "tasks.compensate:Compensate",
        "measure": "drawing.tasks.measure:Measure",
        "compare": "controls.tasks.compare:Compare",
        "reversal": "laboratory.tasks.reversal:Reversal",
        "drawing": "drawing.tasks.drawing:ReadDrawing",
        "faces": "drawing.tasks.faces:Faces",
        "plan": "drawing.tasks.plan:PlanForDrawing",
    },
    "Control": {
        "export": "controls.tasks.export:Export",
        "machine": "controls.tasks.machine:MachineFile",
        "program sphere": "controls.tasks.program:ProgramSphere",
        "program axis": "controls.tasks.program:ProgramAxis",
        "program part": "controls.tasks.program:ProgramPart",
        "program mdi": "controls.tasks.program:ProgramMdi",
    },
    "Predict": {
        "probes": "design.tasks.probes:Probes",
        "predict": "design.tasks.predict:Predict",
        "simulate": "design.tasks.simulate:Simulate",
        "slide": "design.tasks.slide:Slide",
        "fem": "design.tasks.fem:Fem",
        "hysteresis": "design.tasks.hysteresis:Hysteresis",
        "identify": "design.tasks.identify:Identify",
        "orientation": "design.tasks.orientation:MapInOrientation",
        "study": "design.tasks.study:RunStudy",
        "studies": "design.tasks.study:Studies",
        "design": "design.tasks.design:Design",
        "wishes": "design.tasks.design:Wishes",
    },
    "Laboratory": {
        "rig": "laboratory.tasks.rig:Rig",
        "laboratory": "laboratory.tasks.laboratory:Laboratory",
        "separate": "laboratory.tasks.separate:Separate",
        "separation-plan": "laboratory.tasks.separate:PlanSeparation",
        "check": "laboratory.tasks.check:Check",
        "pattern": "laboratory.tasks.check:Pattern",
    },
    "Files": {
        "convert": "tasks.convert:Convert",
        "bundle": "tasks.bundle:Bundle",
        "formats": "tasks.convert:Formats",
        "report": "tasks.report:Report",
    },
}
"""Module and type of each task by its command; each group begins with what is needed first."""
SUBCOMMANDS = {"program": "Write a probing program for LinuxCNC that logs every touch."}
"""The help of commands that begin with the same word."""
PLACES = {name: place for tasks in GROUPS.values() for name, place in tasks.items()}
"""Module and type of each task by its command."""


def task_named(name: str) -> type[Task]:
    """The type of a task.

    Parameters
    ----------
    name : str
        Of the command: ``plan-touches``.

    >>> task_named("qualify").example.split()[:2]
    ['pretravel', 'qualify']
    """
    return object_at(f"pretravel.{PLACES[name]}")  # type: ignore[no-any-return]
