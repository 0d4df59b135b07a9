"""What the screen of the engineer computes: a look at the file, the fit, the files of a control."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pretravel.app import Inputs, Job, ShownResult
from pretravel.base import InputError, PretravelError
from pretravel.controls.screen.settings import CONTROL, MAP_NAME, QUALIFICATION, EngineerSettings

if TYPE_CHECKING:
    from pretravel.base import BoolArray, FloatArray
    from pretravel.controls.control import ExportedFiles
    from pretravel.controls.screen.shown_file import ColumnsOfTable
    from pretravel.controls.screen.touch_sphere_chart import TouchesInSpace
    from pretravel.controls.tasks.compare.task import ComparedMap
    from pretravel.controls.tasks.export.task import ExportedMap
    from pretravel.files import FileReadings
    from pretravel.show import Document, PlotlyFigure, WorkRecord
    from pretravel.task import LookedAt
    from pretravel.tasks.compensate import CompensatedTouches
    from pretravel.tasks.qualify import QualifiedProbe

QUESTIONS = ("units", "decimal", "columns")
"""What a file can lack that one click on the page states."""
_ROUND = 0.01
"""Largest share of its radius by which touches on a sphere deviate from it."""


@dataclass(frozen=True, eq=False)
class TouchesPicture:
    """Touches in space, drawn."""

    touches: TouchesInSpace
    figure: PlotlyFigure


@dataclass(frozen=True, eq=False)
class LookResult:
    """What was understood of the file.

    Attributes
    ----------
    name : str
    found : LookedAt or None
        None where a question is open.
    question : str
        What is not clear, in the words of the library; empty where all is.
    asked : tuple of str
        Of `QUESTIONS`.
    lines : tuple of str
        First lines of the file as they are.
    columns : ColumnsOfTable or None
    picture : TouchesPicture or None
        About the sphere that fits them best; None where they lie on none.
    """

    name: str
    found: LookedAt | None
    question: str
    asked: tuple[str, ...]
    lines: tuple[str, ...]
    columns: ColumnsOfTable | None
    picture: TouchesPicture | None


@dataclass(frozen=True, eq=False)
class FitResult:
    """A qualification with all touches of the file, those too that were unticked.

    Attributes
    ----------
    name : str
        Of the file.
    settings : EngineerSettings
    qualified : QualifiedProbe
    names : tuple of str
        By which each touch of the file can be left out.
    directions : (n, 3) float
        From the centre to each touch.
    picture : TouchesPicture
        All touches of the file.
    report : Document
        Of the qualification, as the command makes it.
    compared : ComparedMap or None
    costs : Document or None
        Of the comparison.
    problem : str
        Why there is no comparison.
    record : WorkRecord
    """

    name: str
    settings: EngineerSettings
    qualified: QualifiedProbe
    names: tuple[str, ...]
    directions: FloatArray
    picture: TouchesPicture
    report: Document
    compared: ComparedMap | None
    costs: Document | None
    problem: str
    record: WorkRecord

    @property
    def touches(self) -> TouchesInSpace:
        """All touches of the file."""
        return self.picture.touches


def _settings_of(inputs: Inputs) -> EngineerSettings:
    return EngineerSettings.of(inputs.settings, inputs.file("touches").read_bytes())


def look(inputs: Inputs) -> LookResult:
    """Look at the file of touches."""
    from pretravel.controls.screen.shown_file import columns_of_table, first_lines
    from pretravel.task import look_at_touches

    path, options = inputs.file("touches"), _settings_of(inputs).looking()
    found: LookedAt | None = None
    question, asked = "", tuple[str, ...]()
    try:
        found = look_at_touches(path, options)
    except InputError as error:
        asked = tuple(name for name in QUESTIONS if name in error.inputs)
        if not asked:
            raise
        question = str(error).replace(str(path), path.name)
    if found is not None and not found.unit_known:
        asked = ("units",)
    return LookResult(
        path.name,
        found,
        question,
        asked,
        first_lines(path),
        columns_of_table(path, options),
        None if found is None else _about_best_sphere(found),
    )


def _drawn(touches: TouchesInSpace, title: str, unit: str = "mm") -> TouchesPicture:
    from pretravel.controls.screen.touch_sphere_chart import touches_chart
    from pretravel.show import plotly_figure

    chart = touches_chart(touches, title, unit=unit)
    return TouchesPicture(touches, plotly_figure(chart))


def _about_best_sphere(found: LookedAt) -> TouchesPicture | None:
    from pretravel.base import MICROMETRE
    from pretravel.controls.screen.touch_sphere_chart import TouchesInSpace
    from pretravel.uncertainty import fit_sphere

    positions = found.positions
    try:
        fit = fit_sphere(positions)
    except PretravelError:
        return None
    off = fit.radius - np.linalg.norm(positions - fit.center, axis=1)
    if np.max(np.abs(off)) > _ROUND * fit.radius:
        return None
    none = np.zeros(len(positions), dtype=bool)
    labels = tuple(str(row + 1) for row in range(len(positions)))
    return _drawn(
        TouchesInSpace(positions, fit.center, fit.radius, off / MICROMETRE, none, none, labels),
        "Touches on the sphere that fits them best",
        "mm" if found.unit_known else "unit of the file",
    )


def fit(inputs: Inputs) -> FitResult | None:
    """Qualify the probe; None while the reference is not stated or the file has a question."""
    from pretravel.controls.tasks.compare.task import Compare
    from pretravel.show import input_file, record_now

    path, settings = inputs.file("touches"), _settings_of(inputs)
    if settings["diameter"] is None or inputs.results["look"].question:
        return None
    left_out = settings.left_out
    task = replace(settings.qualify(path, left_out), output=None)
    whole = settings.qualify(path).read()
    qualified = task.qualified(task.read() if left_out else whole)
    names = touch_names(path, whole)
    compared, problem = None, ""
    try:
        compared = Compare(map_file=MAP_NAME).compared(qualified.pretravel_map)
    except PretravelError as error:  # a map that does not hold all around
        problem = str(error)
    touches = _touches_of(qualified, whole, np.isin(names, left_out), names)
    report = qualified.page()
    assert report is not None  # of every qualification
    costs = None if compared is None else compared.document()
    for document in (report, costs):
        for picture in () if document is None else document.pictures:
            _ = picture.charts  # made here, because the page must not wait
    return FitResult(
        path.name,
        settings,
        qualified,
        names,
        whole.touches.normals,
        _drawn(touches, "Touches, coloured by residual"),
        report,
        compared,
        costs,
        problem,
        record_now(
            settings.qualify(Path(path.name), left_out).command_line(),
            [replace(input_file(path, "TOUCHES"), name=path.name)],
        ),
    )


def touch_names(path: Path, readings: FileReadings) -> tuple[str, ...]:
    """By which each touch can be left out: file and line, or its label or number."""
    touches = readings.touches
    if touches.lines is not None:
        return tuple(f"{path.name}:{line}" for line in touches.lines)
    if touches.labels is not None and len(set(touches.labels)) == len(touches.labels):
        return touches.labels
    return tuple(str(row + 1) for row in range(len(touches)))


def _touches_of(
    qualified: QualifiedProbe, whole: FileReadings, out: BoolArray, names: tuple[str, ...]
) -> TouchesInSpace:
    """All touches of the file, with what the map leaves of them."""
    from pretravel.base import MICROMETRE
    from pretravel.controls.screen.touch_sphere_chart import TouchesInSpace
    from pretravel.measurement import distances_from_reference

    made, touches = qualified.qualification, whole.touches
    kept = ~out
    if int(kept.sum()) != len(made.residuals):
        raise PretravelError("a touch that was unticked is not in this file: use all touches again")
    distance, _ = distances_from_reference(made, touches)
    residuals = distance if made.setup.ring else -distance
    residuals[kept] = made.residuals
    named = np.zeros(len(kept), dtype=bool)
    rows = [row for outlier in made.outliers for row in outlier.rows]
    named[np.flatnonzero(kept)[rows]] = True
    radius = float(np.mean(np.linalg.norm(touches.positions - made.center, axis=1)))
    labels = touches.labels or tuple(
        f"line {name.rpartition(':')[2]}" if ":" in name else name for name in names
    )
    return TouchesInSpace(
        touches.positions,
        made.center,
        radius,
        residuals / MICROMETRE,
        named,
        ~kept,
        labels,
        made.setup.ring,
    )


@dataclass(frozen=True, eq=False)
class ExportResult:
    """The files of a control.

    Attributes
    ----------
    settings : EngineerSettings
        Its map was made with them.
    made : ExportedMap
    """

    settings: EngineerSettings
    made: ExportedMap

    @property
    def files(self) -> ExportedFiles:
        """The texts and what they state."""
        return self.made.files

    @property
    def to(self) -> str:
        """The control."""
        return str(self.settings.control)


def export(inputs: Inputs) -> ExportResult | None:
    """Files for the control that is chosen; None without one, or without a map."""
    settings, made = _settings_of(inputs), inputs.results["fit"]
    if settings.control is None or made is None:
        return None
    return ExportResult(settings, settings.export().exported(made.qualified.pretravel_map))


def compensate(inputs: Inputs) -> ShownResult[CompensatedTouches] | None:
    """Compensate the touches of a part with the map; None without a map."""
    from pretravel.tasks.compensate import Compensate

    made = inputs.results["fit"]
    if made is None:
        return None
    pretravel_map, part = made.qualified.pretravel_map, inputs.file("part")
    task = Compensate(
        touches=(part,), map_file=MAP_NAME, output=Path("points.csv"), units=made.settings["units"]
    )
    readings = task.read_touches(tip_diameter=2.0 * pretravel_map.tip_radius)
    found = task.compensated(readings, pretravel_map)
    return ShownResult(found, found.document())


_OF_FIT = (*QUALIFICATION.stored, "answers", "left_out")
LOOK = Job("look", look, "Reading", settings=("answers",), files=("touches",), needs=("touches",))
FIT = Job(
    "fit",
    fit,
    "Qualifying",
    settings=_OF_FIT,
    files=("touches",),
    needs=("touches",),
    after=(LOOK,),
    report=lambda result: result.report,
)
EXPORT = Job(
    "export",
    export,
    "Making the files of the control",
    settings=(*_OF_FIT, *CONTROL.stored),
    files=("touches",),
    needs=("touches",),
    after=(FIT,),
)
PART = Job(
    "part",
    compensate,
    "Compensating",
    settings=_OF_FIT,
    files=("touches", "part"),
    needs=("touches", "part"),
    after=(FIT,),
)
