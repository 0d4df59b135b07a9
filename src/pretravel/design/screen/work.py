"""What the designer's screen computes: two designs over all directions, and finite elements."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.app import Inputs, Job, TaskForm
from pretravel.base import PretravelError
from pretravel.design.screen.form import (
    changes_of,
    designed_probe,
    designed_text,
    setting_names,
)
from pretravel.design.tasks.slide.task import Slide

if TYPE_CHECKING:
    from pretravel.design.fem.condensation import ReducedModel
    from pretravel.design.fem.elastic_field import StressByDirection
    from pretravel.design.tasks.predict.task import PredictedProbe
    from pretravel.design.tasks.slide.task import FollowedSlide
    from pretravel.prediction import Probe
    from pretravel.show import Document

_log = logging.getLogger(__name__)

FIRST_START = "omp40-2"
DESIGN_FILE = "design.toml"
THE_START = "start"
"""The other design is the unchanged start."""
_AZIMUTHS = range(0, 360, 30)
"""At which the stress on walls is computed. [deg]"""


@dataclass(frozen=True, eq=False)
class ComparedDesigns:
    """A design and the one that it is compared with.

    Attributes
    ----------
    other, design : PredictedProbe
    start : str
        The description from which the design starts.
    changes : mapping of str to value
    name : str
        That the user gave the design; empty without one.
    start_name, other_name : str
        Of the start and of the other design: in the catalogue, or of a file.
    """

    other: PredictedProbe
    design: PredictedProbe
    start: str
    changes: Mapping[str, float | str]
    name: str
    start_name: str
    other_name: str

    @property
    def source(self) -> str:
        """The probe in a command: that of the start while it is unchanged, else a file to save."""
        return DESIGN_FILE if self.changes or self.name else self.start_name

    @property
    def names(self) -> tuple[str, str]:
        """Of both designs in reports; a file that nobody has saved is none of them."""
        changed = f"{self.start_name} (changed)" if self.changes else self.start_name
        return self.other_name, self.name or changed

    def text(self) -> str:
        """The description of the design."""
        return designed_text(self.start, self.changes, self.name)

    def digest(self) -> str:
        """Of the design, whatever name the user gave it."""
        return digest_of(designed_text(self.start, self.changes))

    def document(self) -> Document:
        """The report that ``pretravel compare A B`` makes."""
        from pretravel.design.tasks.compare.designs import DesignComparison

        pair = (self.other.probe, self.design.probe), (self.other.trigger, self.design.trigger)
        return DesignComparison(*pair).document(self.names)


SLIDE_FORM = TaskForm(
    Slide,
    without=("process", "search", "model", "workpiece"),
    prefix="slide_",
    start={"at": "0.5,0.5", "step": 0.0002},
)
SURFACE = "slide_surface"
SURFACES: Mapping[str, str] = {
    "convex": "the convex surface of the thesis",
    "ellipsoid:a=10,c=6": "ellipsoid, semi-axes 10 and 6 mm",
    "sphere:radius=12.5": "sphere of 25 mm diameter",
    "cylinder:radius=10": "cylinder of 20 mm diameter",
    "plane:polar=40": "plane at 40° to the horizontal",
    "plane:polar=90": "vertical wall",
}
"""Surfaces that the screen offers; a name of a file is none of them."""


@dataclass(frozen=True, eq=False)
class SlideOfDesign:
    """A touch of a design, step by step.

    Attributes
    ----------
    made : FollowedSlide
    document : Document
        Its report, which takes longer than a page may wait.
    digest : str
        As that of `ComparedDesigns`.
    """

    made: FollowedSlide
    document: Document
    digest: str


@dataclass(frozen=True, eq=False)
class FiniteElementDesign:
    """A design by finite elements.

    Attributes
    ----------
    predicted : PredictedProbe
    reduced : ReducedModel
        With its mesh.
    stresses : StressByDirection
        On walls.
    """

    predicted: PredictedProbe
    reduced: ReducedModel
    stresses: StressByDirection


@dataclass(frozen=True, eq=False)
class FiniteElementDesigns:
    """Two designs by finite elements.

    Attributes
    ----------
    compared : ComparedDesigns
        The same designs by the model analytic.
    other, design : FiniteElementDesign
    """

    compared: ComparedDesigns
    other: FiniteElementDesign
    design: FiniteElementDesign

    def document(self) -> Document:
        """The report: the verdict of finite elements, and both models next to each other."""
        from pretravel.design.tasks.compare.designs import DesignComparison
        from pretravel.design.tasks.compare.designs_report import elements_comparison_table

        compared = self.compared
        triggers = self.other.predicted.trigger, self.design.predicted.trigger
        probes = compared.other.probe, compared.design.probe
        report = DesignComparison(probes, triggers).document(compared.names)
        table = elements_comparison_table(
            (compared.other.trigger, compared.design.trigger),
            triggers,
            (self.other.stresses.figures, self.design.stresses.figures),
        )
        meshes = "; ".join(
            f"{letter}: {one.reduced.summary['unknowns']}"
            for letter, one in zip("AB", (self.other, self.design), strict=True)
        )
        remark = (
            f"Unknowns of the meshes: {meshes}. The stress is that of von Mises, preload included, "
            f"every {_AZIMUTHS.step}° on walls; it is the mean over an element, so that at edges "
            "and seats it depends on the mesh."
        )
        return replace(
            report,
            title=f"By finite elements, {report.title}",
            verdict=f"By finite elements, {report.verdict}",
            tables=(table,),
            notes=(*report.notes, remark),
        )


def start_text(name: str, file: Path | None) -> str:
    """The description from which a design starts: a dropped file, else a probe of the catalogue.

    Parameters
    ----------
    name : str
        In the catalogue.
    file : Path or None

    Raises
    ------
    PretravelError
        A file that is not a description of a probe, or that names another file.
    """
    from pretravel.app import own_description
    from pretravel.base import read_toml
    from pretravel.prediction import description_text

    if file is None:
        return description_text(name)
    own_description(file)
    return read_toml(file, "probe description").text


def digest_of(text: str) -> str:
    """A short digest, by which a form knows the description that it was made for."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def start_and_changes(
    settings: Mapping[str, Any], file: Path | None
) -> tuple[str, dict[str, float | str]]:
    """The text of the start, and the changes to it; those to an earlier start do not count."""
    start = start_text(settings.get("start", FIRST_START), file)
    if settings.get("form_of") != digest_of(start):
        return start, {}
    return start, changes_of(start, settings)


@lru_cache(maxsize=8)
def predicted_text(text: str) -> PredictedProbe:
    """The prediction of a description that does not change, by the model analytic."""
    from pretravel.design.tasks.predict.task import Predict
    from pretravel.prediction import parse_probe

    return Predict(probe=DESIGN_FILE).predicted(parse_probe(text))


def compare_designs(inputs: Inputs) -> ComparedDesigns:
    """Predict a design and the one that it is compared with."""
    from pretravel.design.tasks.predict.task import Predict

    settings = inputs.settings
    file = inputs.optional_file("description")
    start, changes = start_and_changes(settings, file)
    start_name = _start_name(settings, file)
    other, other_name = start, start_name
    if settings.get("against", THE_START) != THE_START:
        other_name = settings["against"]
        other = start_text(other_name, None)
    name = settings.get("name", "")
    return ComparedDesigns(
        other=predicted_text(other),
        design=Predict(probe=DESIGN_FILE).predicted(designed_probe(start, changes, name)),
        start=start,
        changes=changes,
        name=name,
        start_name=start_name,
        other_name=other_name,
    )


def _start_name(settings: Mapping[str, Any], file: Path | None) -> str:
    return str(settings.get("start", FIRST_START)) if file is None else file.name


def probe_figure(probe: Probe) -> dict[str, Any]:
    """A probe in space, as Plotly's figure."""
    from pretravel.design.tasks.probes.view import space_chart
    from pretravel.show import plotly_figure

    # Its sizes are in the form: without axes the body fills the picture.
    return plotly_figure(replace(space_chart(probe, "Your design"), bare=True))


def compute_finite_elements(inputs: Inputs) -> FiniteElementDesigns:
    """Finite elements of both designs; in a process of its own.

    What was computed before is in the cache of reduced models, and equal designs are computed once.
    """
    compared = compare_designs(inputs)
    (a, b), probes = compared.names, (compared.other.probe, compared.design.probe)
    other = _by_finite_elements(f"A, {a}", probes[0])
    same = probes[0] == probes[1]
    design = other if same else _by_finite_elements(f"B, {b}", probes[1])
    return FiniteElementDesigns(compared, other, design)


def _by_finite_elements(name: str, probe: Probe) -> FiniteElementDesign:
    """Build the model of a design, and predict with it; progress and errors say which one it is."""
    import numpy as np

    from pretravel.base import grid
    from pretravel.design.fem.elastic_field import stress_by_direction
    from pretravel.design.fem.reduction_cache import model_in_memory
    from pretravel.design.tasks.predict.task import Predict

    walls = grid([0.5 * np.pi], np.radians(np.array(_AZIMUTHS, dtype=np.float64)))
    with _said_of(name):
        _log.info("reduced model")
        try:
            reduced = model_in_memory(probe)
            predicted = Predict(probe=DESIGN_FILE, model="fem").predicted(probe)
            stresses = stress_by_direction(probe, walls, reduced)
        except PretravelError as error:
            raise PretravelError(f"{name}: {error}", inputs=error.inputs) from error
    return FiniteElementDesign(predicted, reduced, stresses)


@contextmanager
def _said_of(name: str) -> Iterator[None]:
    """What the library says meanwhile is said of one design."""

    def name_it(record: logging.LogRecord) -> bool:
        if not record.getMessage().startswith(f"{name}: "):  # another handler has done it
            record.msg, record.args = f"{name}: {record.getMessage()}", ()
        return True

    handlers = tuple(logging.getLogger("pretravel").handlers)
    for handler in handlers:
        handler.addFilter(name_it)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(name_it)


def follow_slide(inputs: Inputs) -> SlideOfDesign:
    """Follow a touch of the design, by the curved process of the thesis."""
    settings = inputs.settings
    surface = settings.get(SURFACE, "convex")
    if surface not in SURFACES:  # a project that was sent can state anything, such as a script
        raise PretravelError("choose a surface of the list", inputs=(SURFACE,))
    file = inputs.optional_file("description")
    start, changes = start_and_changes(settings, file)
    source = DESIGN_FILE if changes else _start_name(settings, file)
    task = Slide(probe=source, surface=surface, **SLIDE_FORM.given(settings))
    made = task.followed(designed_probe(start, changes))
    return SlideOfDesign(made, made.document(), digest_of(designed_text(start, changes)))


_SETTINGS = ("start", "form_of", *setting_names())
DESIGNS = Job(
    "designs",
    compare_designs,
    "Predicting",
    settings=(*_SETTINGS, "against", "name"),
    files=("description",),
    live=True,
)
FINITE_ELEMENTS = Job(
    "finite elements",
    compute_finite_elements,
    "Finite elements of both designs",
    settings=(*_SETTINGS, "against"),
    files=("description",),
    automatic=False,
    own_process=True,
)
SLIDE = Job(
    "slide",
    follow_slide,
    "Sliding",
    settings=(*_SETTINGS, SURFACE, *SLIDE_FORM.stored),
    files=("description",),
)
