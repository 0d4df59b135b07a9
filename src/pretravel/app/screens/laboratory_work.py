"""What the screen Laboratory computes; nothing here touches a page."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.app.components.statements import stated
from pretravel.app.project import SettingValue
from pretravel.app.tasks import Inputs
from pretravel.files.separation_csv import read_multi_step_readings
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.laboratory.rig import RigTouch, RigTrace
from pretravel.laboratory.rig_marks import MARKS
from pretravel.laboratory.separation import METHODS, Separation, separate
from pretravel.show.document import Document
from pretravel.tasks.reports.laboratory_report import with_laboratory
from pretravel.tasks.reports.separation_report import separation_document
from pretravel.tasks.rig import CalibratedRig, Rig
from pretravel.tasks.task import command_line, python_lines
from pretravel.tasks.values import MovedMark

RIG_SETTINGS = ("excluded", "marks", "temperature", "expansion", "statements")
SEPARATION_SETTINGS = ("method", "statements")
_FOREIGN_BUDGET = (
    "the budget is that of Ren 2020, Table 2, of another laboratory; give your own as a file"
)


@dataclass(frozen=True, eq=False)
class RigResult:
    """A calibration with its report and certificate.

    Attributes
    ----------
    rig : CalibratedRig
    document, certificate : Document
    statements : LaboratoryStatements or None
        None where nothing is stated.
    command, python : str
    """

    rig: CalibratedRig
    document: Document
    certificate: Document
    statements: LaboratoryStatements | None
    command: str
    python: str

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
    get = inputs.settings.get
    paths = sorted(inputs.files["traces"], key=lambda path: path.stem)
    budget = inputs.optional_file("budget")
    names = {path.stem for path in paths}
    task = Rig(
        traces=tuple(paths),
        budget=budget,
        temperature=float(get("temperature", 20.0)),
        expansion=float(get("expansion", 8.0)),
        exclude=tuple(name for name in get("excluded", []) if name in names),
        mark=tuple(
            MovedMark(name, event, place)
            for name, moved in get("marks", {}).items()
            if name in names
            for event, place in moved.items()
        ),
    )
    given = get("statements", {})
    statements = stated(given) if given else None
    found = replace(task.run(), statements=statements)
    same = replace(
        task,
        traces=tuple(Path(path.name) for path in paths),
        budget=None if budget is None else Path(budget.name),
        output=Path("rig.json"),
    )
    return RigResult(
        found,
        found.report([] if budget is not None else [_FOREIGN_BUDGET]),
        found.certificate(),
        statements,
        command_line(same),
        python_lines(same),
    )


def moved_marks(
    marks: Mapping[str, Mapping[str, float]], trace: str, event: str, place: float | None
) -> dict[str, SettingValue]:
    """The marks after one of them was moved; None takes the mark away.

    >>> moved_marks({}, "rig_000_1", "r0", 1.25)
    {'rig_000_1': {'r0': 1.25}}
    >>> moved_marks({"rig_000_1": {"r0": 1.25}}, "rig_000_1", "r0", None)
    {}
    """
    changed = {name: dict(events) for name, events in marks.items()}
    events = changed.setdefault(trace, {})
    if place is None:
        events.pop(event, None)
    else:
        events[event] = place
    return {name: events for name, events in changed.items() if events}


def shown_events(touch: RigTouch) -> list[str]:
    """The events that a trace has, in the order of their lines in its chart."""
    return [name for name in MARKS if np.isfinite(getattr(touch, name))]


@dataclass(frozen=True, eq=False)
class SeparationResult:
    """The separated errors of machine and probe, with their report.

    Attributes
    ----------
    separation : Separation
    document : Document
    statements : LaboratoryStatements or None
    command, python : str
    """

    separation: Separation
    document: Document
    statements: LaboratoryStatements | None
    command: str
    python: str


def separate_readings(inputs: Inputs) -> SeparationResult:
    """Separate the errors and variances of machine and probe.

    Raises
    ------
    PretravelError
        What the file is refused for.
    """
    path = inputs.file("readings")
    method = str(inputs.settings.get("method", METHODS[0]))
    found = separate(read_multi_step_readings(path), method=method)  # type: ignore[arg-type]
    given = inputs.settings.get("statements", {})
    statements = stated(given) if given else None
    document = with_laboratory(separation_document(found, readings_name=path.name), statements)
    words = ["pretravel", "separate", path.name, "--method", method, "-o", "separation.json"]
    python = "\n".join(
        (
            "from pretravel.files.separation_csv import read_multi_step_readings",
            "from pretravel.laboratory.separation import separate",
            "",
            f"readings = read_multi_step_readings({path.name!r})",
            f"found = separate(readings, method={method!r})",
            "print(found)",
        )
    )
    return SeparationResult(found, document, statements, shlex.join(words), python)
