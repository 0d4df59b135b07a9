"""What the screen Part computes; nothing here touches a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import lru_cache
from itertools import takewhile
from pathlib import Path

import numpy as np

from pretravel.app import (
    Inputs,
    Job,
    ScreenState,
    ShownResult,
    StoredFile,
    TaskForm,
    own_map,
    with_file_names,
)
from pretravel.base import FloatArray, IntArray, PretravelError, temporary_folder
from pretravel.drawing.features.contact_slides import contact_slide
from pretravel.drawing.pmi.model import read_drawing, read_model_drawing
from pretravel.drawing.screen.rows import ToleranceRow, drawing_of, restored, rows_of
from pretravel.drawing.tasks.align.task import Align, AlignedPart
from pretravel.drawing.tasks.measure.task import Measure, MeasuredFeatures
from pretravel.drawing.tolerances.features_file import Drawing
from pretravel.drawing.tolerances.plan_features import PLAN_ENDINGS, read_plan_features
from pretravel.files import read_points
from pretravel.maps import PretravelMap
from pretravel.prediction import catalogue_names
from pretravel.show import Chart, Document, Scale, SpaceChart, SpacePoints
from pretravel.surface import Part, feet_on_faces, read_part
from pretravel.task import SILENT, Task
from pretravel.tasks.compensate import Compensate, CompensatedTouches
from pretravel.touches import label_prefix
from pretravel.uncertainty import Budget

PART_FORM = TaskForm(Compensate, shared=("units", "feed"))
ALIGN_FORM = TaskForm(Align, without=("tip_diameter", "extrapolate"), prefix="align_")
FEATURE_FORM = TaskForm(Measure, start={"feature": "plane"}, without=("annex",), prefix="measure_")
TOLERANCES = "tolerances"
"""Setting with the rows of the table of tolerances."""
_OF_DRAWING = ("association", "probability", "u_machine_um")
"""Settings that go with a drawing, which states the others for each feature."""
_MEASURED_FACES = ("plane", "cylinder", "cone", "sphere", "torus")


@dataclass(frozen=True)
class PartResult:
    """The compensated touches of a part.

    Attributes
    ----------
    compensated : CompensatedTouches
    document : Document
    slide : (n,) float or None
        How far the contact slides before the trigger; None without a nominal part in its own
        frame. [mm]
    same : tuple of Task
        As the user can do it: align where the part was found, and compensate.
    aligned : AlignedPart or None
        Where the part lies; None where its touches are in its own frame.
    face : (n,) int or None
        Index of the face that each point lies on; None without a part.
    """

    compensated: CompensatedTouches
    document: Document
    slide: FloatArray | None
    same: tuple[Task, ...]
    aligned: AlignedPart | None = None
    face: IntArray | None = None

    def budget(self, row: int) -> Budget:
        """The uncertainty budget of a point. [mm]"""
        return self.compensated.errors.budget(row)

    @property
    def part(self) -> Part | None:
        """The part from its CAD file."""
        nominal = self.compensated.nominal
        return nominal if isinstance(nominal, Part) else None

    def face_at(self, place: FloatArray) -> int | None:
        """Index of the face nearest to a place of the picture, (3,); None without a part. [mm]"""
        if self.part is None:
            return None
        return int(feet_on_faces(self.part, np.reshape(place, (1, 3))).face[0])

    def write_points(self, path: Path) -> None:
        """Write the points, in the frame of the part."""
        if self.aligned is None:
            self.compensated.write("output", path)
        else:
            self.aligned.write("points", path)


def lacking_for_points(state: ScreenState) -> str:
    """What is still needed in addition to the touches: a map, or a probe of the catalogue."""
    # Not a path on this computer.
    if not state.files["map"] and state.settings.get("probe", "") not in catalogue_names():
        return (
            "Next: a map of the probe. Drop the map that “Qualify a probe” makes, or choose a "
            "probe of the catalogue."
        )
    if not states_no_normals(state):
        return ""
    if not state.files["part"]:
        return "Next: the part as a STEP file. The touches have no normals; its faces give them."
    if asks_where(state):
        return "Next: press “Find the part”, or say that the touches are in the frame of the part."
    return ""


_LARGEST_LOOK = 2_000_000
"""A file that is looked into for its normals while the page is built. [bytes]"""


def states_no_normals(state: ScreenState) -> bool:
    """Whether the touches are coordinates alone, so that their normals are those of the part."""
    stored = next(iter(state.files["touches"]), None)
    if stored is None or len(stored.content) > _LARGEST_LOOK or PART_FORM.given(state.settings):
        return False  # settings say how the file is read
    return _lacks_normals(stored.name, stored.content)


def asks_where(state: ScreenState) -> bool:
    """Whether nobody has said if touches without normals are in the frame of the part."""
    unsaid = state.settings.get("aligned") is None
    return unsaid and bool(state.files["part"]) and states_no_normals(state)


@lru_cache(maxsize=8)
def _lacks_normals(name: str, content: bytes) -> bool:
    with temporary_folder() as folder:
        (folder / name).write_bytes(content)
        look = Compensate(touches=(folder / name,), map_file="", output=Path("points.csv"))
        try:
            look.read_with(look.reading_options())
        except PretravelError as error:
            return "normal" in error.inputs and "nominal" in error.inputs
    return False


def with_own_scale(chart: Chart) -> Chart:
    """Deviations after compensation in their own colours: next to those before, all look alike.

    Parameters
    ----------
    chart : Chart
        Of a picture of compensated points.
    """
    if not isinstance(chart, SpaceChart) or not chart.title.startswith("after:"):
        return chart
    values = [mark.values for mark in chart.marks
              if isinstance(mark, SpacePoints) and mark.values is not None]  # fmt: skip
    if not values:
        return chart
    return replace(chart, scale=Scale.of("deviation", "µm", np.concatenate(values), signed=True))


def compensate_part(inputs: Inputs) -> PartResult:
    """Compensate the touches of a part.

    Raises
    ------
    PretravelError
        What the files are refused for.
    """
    settings = inputs.settings
    map_file, part = inputs.optional_file("map"), inputs.optional_file("part")
    probe = str(settings.get("probe", ""))
    if map_file is None and probe not in catalogue_names():  # not a path on this computer
        raise PretravelError("choose a probe of the catalogue", inputs=("probe",))
    task = Compensate(
        touches=(inputs.file("touches"),),
        map_file=str(map_file or probe),
        output=Path("points.csv"),
        nominal=None if part is None else str(part),
        **PART_FORM.given(settings),
    )
    if map_file is None:
        pretravel_map = task.pretravel_map()
    else:
        pretravel_map = own_map(map_file, task.model, tip_diameter=task.tip_diameter)
    # Not parse_surface: it executes Python files.
    nominal = None if part is None else read_part(part)
    if settings.get("aligned"):
        return _aligned(inputs, task, pretravel_map, nominal)
    readings = task.read_on(nominal, pretravel_map, SILENT)
    found = task.compensated(readings, pretravel_map, nominal)
    slide, face = None, None
    if nominal is not None:
        seen = pretravel_map.seen_from(readings.placement)
        slide = np.linalg.norm(contact_slide(found.touches, found.points, seen), axis=1)
        face = feet_on_faces(nominal, found.points.positions).face
    same = (with_file_names(task),)
    return PartResult(found, found.document(), slide, same, face=face)


def _aligned(
    inputs: Inputs, task: Compensate, pretravel_map: PretravelMap, part: Part | None
) -> PartResult:
    """Find where the part lies, and compensate its touches there."""
    if part is None:
        raise PretravelError(
            "the part is needed to find where it lies: drop its STEP file", inputs=("part",)
        )
    align = Align(
        touches=task.touches,
        part=inputs.file("part"),
        map_file=task.map_file,
        tip_diameter=task.tip_diameter,
        extrapolate=task.extrapolate,
        points=Path("points.csv"),
        output=Path("place.json"),
        **{name: getattr(task, name) for name in PART_FORM.shared},
        **ALIGN_FORM.given(inputs.settings),
    )
    aligned = align.aligned(align.readings(SILENT, pretravel_map), part, pretravel_map)
    with temporary_folder() as folder:
        aligned.write("output", folder / "place.json")
        placed = replace(task, place=str(folder / "place.json"))
        readings = placed.read_on(part, pretravel_map, SILENT)
        found = placed.compensated(readings, pretravel_map, part)
        document = aligned.document()
        section = found.document().as_section("The compensated points")
    same = (with_file_names(align), with_file_names(placed, output=Path("machine_points.csv")))
    document = replace(document, sections=(*document.sections, section))
    return PartResult(found, document, None, same, aligned, aligned.alignment.feet.face)


def groups_of(labels: Sequence[str]) -> dict[str, tuple[int, str]]:
    """Groups of labels that differ in the number at the end: how many points, and their pattern.

    Returns
    -------
    dict of str to pair of int and str
        Groups that no pattern chooses alone are left out.

    >>> groups_of(["bore1-1", "bore1-2", "top-1", "12"])
    {'bore1': (2, 'bore1-*'), 'top': (1, 'top-1*')}
    """
    rows: dict[str, list[int]] = {}
    for row, label in enumerate(labels):
        if label_prefix(label) != label:
            rows.setdefault(label_prefix(label), []).append(row)
    found = {name: _pattern(labels, np.array(mine)) for name, mine in rows.items()}
    return {name: (len(rows[name]), pattern[0]) for name, pattern in found.items() if pattern}


def measure_part(result: PartResult, inputs: Inputs) -> ShownResult[MeasuredFeatures]:
    """Measure features of compensated points.

    Raises
    ------
    PretravelError
        Points that do not determine the features; limits in the wrong order.
    """
    drawing = inputs.optional_file("drawing")
    given = FEATURE_FORM.given(inputs.settings)
    rows = restored(str(inputs.settings.get(TOLERANCES) or ""))
    if rows:
        given = {name: given[name] for name in _OF_DRAWING if name in given}
        given |= {"drawing": Path("drawing.toml"), "part": inputs.optional_file("part")}
        task = Measure(points=Path("points.csv"), output=_FEATURES, **given)
        return _measured(result, task, drawing=drawing_of(rows))
    if drawing is not None:
        given = {name: given[name] for name in _OF_DRAWING if name in given}
        given |= {"drawing": drawing, "part": inputs.optional_file("part")}
    return _measured(result, Measure(points=Path("points.csv"), output=_FEATURES, **given))


def measure_face(result: PartResult, index: int) -> ShownResult[MeasuredFeatures]:
    """Measure the feature of one face, from the touches on it.

    Raises
    ------
    PretravelError
        Too few touches on the face; a face that is not a plane, cylinder, cone, sphere or torus.
    """
    if result.part is None or result.face is None or not 0 <= index < len(result.part.faces):
        raise PretravelError("this face is not one of the part: click another one")
    face, rows = result.part.faces[index], np.flatnonzero(result.face == index)
    if not len(rows):
        raise PretravelError(f"no touch lies on face {face.number}: click another one")
    if face.kind not in _MEASURED_FACES:
        raise PretravelError(
            f"face {face.number} is not a plane, cylinder, cone, sphere or torus: it has no size. "
            "Its deviations are in the picture"
        )
    task = Measure(
        points=Path("points.csv"),
        output=_FEATURES,
        feature=face.kind,
        select=_pattern(result.compensated.points.labels, rows),
    )
    return _measured(result, task, rows, f"face {face.number}")


def _pattern(labels: Sequence[str], rows: IntArray) -> tuple[str, ...]:
    """What chooses the labels of these rows and no others; nothing where no pattern does."""
    words = sorted(labels[row] for row in rows)
    same = takewhile(lambda pair: pair[0] == pair[1], zip(words[0], words[-1], strict=False))
    pattern = "".join(letter for letter, _ in same) + "*"
    chosen = [row for row, label in enumerate(labels) if fnmatchcase(label, pattern)]
    return (pattern,) if chosen == rows.tolist() else ()


def _measured(
    result: PartResult,
    task: Measure,
    rows: IntArray | None = None,
    label: str = "",
    drawing: Drawing | None = None,
) -> ShownResult[MeasuredFeatures]:
    # The points as a file of them has them, so that the command finds the same last digit.
    with temporary_folder() as folder:
        result.write_points(folder / "points.csv")
        points = read_points(folder / "points.csv")
    if result.part is not None and result.face is not None:
        numbers = np.array([face.number for face in result.part.faces], dtype=np.int64)
        points = replace(points, face=numbers[result.face])
    if rows is not None:
        points = replace(points[rows], labels=(label,) * len(rows))
        found = replace(task, select=(label,)).measured(points)
    elif drawing is not None:
        found = task.measured(points, task.wanted_of(drawing, part=result.part), result.part)
    else:
        found = task.measured(points, part=result.part if task.part is not None else None)
    same = with_file_names(task) if rows is None or task.select else None
    return ShownResult(found, found.document(), same)


_FEATURES = Path("features.csv")


def filled_rows(part: StoredFile | None, drawing: StoredFile | None) -> list[ToleranceRow]:
    """The rows of a drawing; without one, those of the model's own tolerances (PMI).

    Raises
    ------
    PretravelError
        Neither a drawing nor a model is there, or one that cannot be read.
    """
    with temporary_folder() as folder:
        if drawing is not None:
            path = folder / drawing.name
            path.write_bytes(drawing.content)
            if path.suffix.lower() in PLAN_ENDINGS:
                return rows_of(read_plan_features(path)[0])
            return rows_of(read_drawing(path))
        if part is None or not part.name.lower().endswith((".step", ".stp")):
            raise PretravelError("drop the STEP file of the part, or the file of its drawing")
        path = folder / part.name
        path.write_bytes(part.content)
        model = read_model_drawing(path)
        if not model.has_pmi:
            raise PretravelError(
                f"{part.name} has no tolerances (semantic PMI of AP242): take a row for each "
                "touched face, and type them"
            )
        return rows_of(model.drawn.drawing)


def example_map(folder: Path) -> tuple[str, bytes]:
    """Name and content of the map of the probe that touched the example part."""
    from pretravel.files import write_map
    from pretravel.tasks.qualify import Qualify

    touches = (folder / "sphere_touches.csv",)
    task = Qualify(touches=touches, diameter=24.9987, tip_diameter=6.0, kind="physical")
    made = task.qualified(task.read())
    with temporary_folder() as place:
        write_map(place / "example_map.json", made.pretravel_map)
        return "example_map.json", (place / "example_map.json").read_bytes()


COMPENSATION = Job(
    "compensate",
    compensate_part,
    "Compensating the touches",
    settings=("probe", "aligned", *PART_FORM.stored, *ALIGN_FORM.stored),
    files=("touches", "map", "part"),
    needs=("touches",),
    lacks=lacking_for_points,
    own_process=True,
)
"""The points of the part."""


def measure_newest(inputs: Inputs) -> ShownResult[MeasuredFeatures]:
    """Measure the features of the newest points."""
    return measure_part(inputs.results[COMPENSATION.name], inputs)


FEATURES = Job(
    "features",
    measure_newest,
    "Measuring the features",
    settings=(*FEATURE_FORM.stored, TOLERANCES),
    files=("drawing", "part"),
    needs=("touches",),
    after=(COMPENSATION,),
    automatic=False,
)
"""What is measured of the points."""


def measure_clicked(inputs: Inputs) -> ShownResult[MeasuredFeatures]:
    """Measure the feature of the face that was clicked."""
    return measure_face(inputs.results[COMPENSATION.name], int(str(inputs.settings["face"])))


FACE = Job(
    "face",
    measure_clicked,
    "Measuring the face",
    settings=("face",),
    needs=("touches", "part"),
    lacks=lambda state: "" if isinstance(state.settings.get("face"), int) else "Click a face.",
    after=(COMPENSATION,),
)
"""The feature of the face that was clicked."""
