"""What the designer's screen computes: two designs over all directions, and finite elements."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.app.jobs import Job
from pretravel.app.project import Inputs
from pretravel.app.screens.designer_form import (
    changes_of,
    designed_probe,
    designed_text,
    setting_names,
)
from pretravel.app.task_form import TaskForm
from pretravel.base.errors import PretravelError
from pretravel.tasks.slide import Slide

if TYPE_CHECKING:
    from pretravel.prediction.description import Probe
    from pretravel.prediction.fem.condensation import ReducedModel
    from pretravel.show.document import Document
    from pretravel.tasks.predict import PredictedProbe
    from pretravel.tasks.slide import FollowedSlide

FIRST_START = "omp40-2"
DESIGN_FILE = "design.toml"
THE_START = "start"
"""The other design is the unchanged start."""


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
    other_name : str
        Of the other design: in the catalogue, or of a file.
    """

    other: PredictedProbe
    design: PredictedProbe
    start: str
    changes: Mapping[str, float | str]
    name: str
    other_name: str

    def text(self) -> str:
        """The description of the design."""
        return designed_text(self.start, self.changes, self.name)

    def document(self) -> Document:
        """The report that ``pretravel compare A design.toml`` makes."""
        from pretravel.tasks.compare_designs import DesignComparison

        pair = (self.other.probe, self.design.probe), (self.other.trigger, self.design.trigger)
        return DesignComparison(*pair).document((self.other_name, DESIGN_FILE))


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
    """

    made: FollowedSlide
    document: Document


@dataclass(frozen=True, eq=False)
class FiniteElementDesign:
    """A design by finite elements.

    Attributes
    ----------
    predicted : PredictedProbe
    reduced : ReducedModel
        With its mesh.
    """

    predicted: PredictedProbe
    reduced: ReducedModel


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
        A file that is no description of a probe, or that names another file.
    """
    from pretravel.app.own_description import own_description
    from pretravel.base.toml_file import read_toml
    from pretravel.prediction.catalogue import description_text

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
    from pretravel.prediction.catalogue import parse_probe
    from pretravel.tasks.predict import Predict

    return Predict(probe=DESIGN_FILE).predicted(parse_probe(text))


def compare_designs(inputs: Inputs) -> ComparedDesigns:
    """Predict a design and the one that it is compared with."""
    from pretravel.tasks.predict import Predict

    settings = inputs.settings
    file = inputs.optional_file("description")
    start, changes = start_and_changes(settings, file)
    other, other_name = start, settings.get("start", FIRST_START) if file is None else file.name
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
        other_name=other_name,
    )


def probe_figure(probe: Probe) -> dict[str, Any]:
    """A probe in space, as Plotly's figure."""
    from pretravel.show.chart_plotly import plotly_figure
    from pretravel.tasks.reports.probe_view import space_chart

    return plotly_figure(space_chart(probe, "Your design"))


def compute_finite_elements(inputs: Inputs) -> FiniteElementDesign:
    """Build the finite-element model of a design, and predict with it; in a process of its own."""
    from pretravel.prediction.fem.reduction_cache import model_in_memory
    from pretravel.tasks.predict import Predict

    start, changes = start_and_changes(inputs.settings, inputs.optional_file("description"))
    probe = designed_probe(start, changes)
    reduced = model_in_memory(probe)
    return FiniteElementDesign(Predict(probe=DESIGN_FILE, model="fem").predicted(probe), reduced)


def follow_slide(inputs: Inputs) -> SlideOfDesign:
    """Follow a touch of the design, by the curved process of the thesis."""
    settings = inputs.settings
    surface = settings.get(SURFACE, "convex")
    if surface not in SURFACES:  # a project that was sent can state anything, such as a script
        raise PretravelError("choose a surface of the list", inputs=(SURFACE,))
    start, changes = start_and_changes(settings, inputs.optional_file("description"))
    task = Slide(probe=DESIGN_FILE, surface=surface, **SLIDE_FORM.given(settings))
    made = task.followed(designed_probe(start, changes))
    return SlideOfDesign(made, made.document())


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
    "Finite elements",
    settings=_SETTINGS,
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
