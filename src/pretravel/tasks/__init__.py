"""What pretravel does for people, a file a task: settings, run, report.

`GROUPS` lists the tasks as the help does; `task_named` imports one. The command line and the
workbench are made from the descriptions.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pretravel.tasks.task import Task

GROUPS: dict[str, dict[str, str]] = {
    "Start": {"demo": "demo:Demo"},
    "Qualify": {
        "qualify": "qualify:Qualify",
        "verify": "verify:Verify",
        "history": "history:History",
        "plan-touches": "plan_touches:PlanTouches",
        "check-budget": "check_budget:CheckBudget",
        "repeat": "repeat:Repeat",
    },
    "Measure": {
        "align": "align:Align",
        "axis": "axis:Axis",
        "compensate": "compensate:Compensate",
        "measure": "measure:Measure",
        "compare": "compare:Compare",
        "reversal": "reversal:Reversal",
        "faces": "faces:Faces",
        "plan": "plan:PlanTargets",
    },
    "Control": {
        "export": "export:Export",
        "machine": "machine:MachineFile",
        "program sphere": "program:ProgramSphere",
        "program part": "program:ProgramPart",
        "program mdi": "program:ProgramMdi",
    },
    "Predict": {
        "probes": "probes:Probes",
        "predict": "predict:Predict",
        "simulate": "simulate:Simulate",
        "slide": "slide:Slide",
        "fem": "fem:Fem",
        "hysteresis": "hysteresis:Hysteresis",
        "identify": "identify:Identify",
        "orientation": "orientation:MapInOrientation",
        "study": "study:RunStudy",
        "studies": "study:Studies",
        "design": "design:Design",
        "wishes": "design:Wishes",
    },
    "Laboratory": {
        "rig": "rig:Rig",
        "laboratory": "laboratory:Laboratory",
        "separate": "separate:Separate",
        "separation-plan": "separate:PlanSeparation",
        "check": "check:Check",
        "pattern": "check:Pattern",
    },
    "Files": {
        "convert": "convert:Convert",
        "bundle": "bundle:Bundle",
        "formats": "convert:Formats",
        "report": "report:Report",
    },
}
"""Module and type of each task by its command; each group begins with what is needed first."""
SUBCOMMANDS = {"program": "Write a probing program (G-code for LinuxCNC) that logs every touch."}
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
    module, _, kind = PLACES[name].partition(":")
    return getattr(import_module(f"pretravel.tasks.{module}"), kind)  # type: ignore[no-any-return]
