"""What the screen Part computes; nothing here touches a page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.app.own_description import own_map
from pretravel.app.project import Inputs
from pretravel.app.task_form import TaskForm, with_file_names
from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.whole_file import temporary_folder
from pretravel.files.points_reading import read_points
from pretravel.measurement.contact_slide import contact_slide
from pretravel.measurement.point_budget import point_budget
from pretravel.prediction.catalogue import catalogue_names
from pretravel.show.document import Document
from pretravel.surface.cad.part_file import read_part
from pretravel.tasks.compensate import Compensate, CompensatedTouches
from pretravel.tasks.measure import Measure, MeasuredFeatures
from pretravel.uncertainty.gum import Budget

PART_FORM = TaskForm(Compensate, shared=("units", "feed"))
FEATURE_FORM = TaskForm(Measure, start={"feature": "plane"})


@dataclass(frozen=True)
class PartResult:
    """The compensated touches of a part.

    Attributes
    ----------
    compensated : CompensatedTouches
    document : Document
    slide : (n,) float or None
        How far the contact slides before the trigger; None without a nominal part. [mm]
    same : Compensate
        As the user can do it.
    """

    compensated: CompensatedTouches
    document: Document
    slide: FloatArray | None
    same: Compensate

    def budget(self, row: int) -> Budget:
        """The uncertainty budget of a point. [mm]"""
        return point_budget(self.compensated.errors, row)


def compensate_part(inputs: Inputs) -> PartResult:
    """Compensate the touches of a part.

    Raises
    ------
    PretravelError
        Neither a map nor a probe is chosen; what the files are refused for.
    """
    settings = inputs.settings
    map_file, part = inputs.optional_file("map"), inputs.optional_file("part")
    probe = str(settings.get("probe", ""))
    if map_file is None and probe not in catalogue_names():  # not a path on this computer
        raise PretravelError(
            "there is no map of the probe: drop the map that Qualify a probe makes, or choose a "
            "probe of the catalogue"
        )
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
    readings = task.read_touches(tip_diameter=2.0 * pretravel_map.tip_radius)
    # Not parse_surface: it executes Python files.
    nominal = None if part is None else read_part(part)
    found = task.compensated(readings, pretravel_map, nominal)
    slide = None
    if part is not None:
        seen = pretravel_map.seen_from(readings.placement)
        slide = np.linalg.norm(contact_slide(found.touches, found.points, seen), axis=1)
    return PartResult(found, found.document(), slide, with_file_names(task))


@dataclass(frozen=True)
class PartFeatures:
    """Measured features.

    Attributes
    ----------
    features : MeasuredFeatures
    document : Document
    same : Measure
        As the user can do it, with the file of the points.
    """

    features: MeasuredFeatures
    document: Document
    same: Measure


def measure_part(result: PartResult, inputs: Inputs) -> PartFeatures:
    """Measure features of compensated points.

    Raises
    ------
    PretravelError
        Points that do not determine the features; limits in the wrong order.
    """
    task = Measure(
        points=result.same.touches[0],
        output=Path("features.csv"),
        **FEATURE_FORM.given(inputs.settings),
    )
    # The points as a file of them has them, so that the command finds the same last digit.
    with temporary_folder() as folder:
        result.compensated.write("output", folder / "points.csv")
        points = read_points(folder / "points.csv")
    found = task.measured(points)
    return PartFeatures(found, found.document(), replace(task, points=Path("points.csv")))


def example_map(folder: Path) -> tuple[str, bytes]:
    """Name and content of the map of the probe that touched the example part."""
    from pretravel.files.map_file import write_map
    from pretravel.tasks.qualify import Qualify

    touches = (folder / "sphere_touches.csv",)
    task = Qualify(touches=touches, diameter=24.9987, tip_diameter=6.0, kind="physical")
    made = task.qualified(task.read())
    with temporary_folder() as place:
        write_map(place / "example_map.json", made.pretravel_map)
        return "example_map.json", (place / "example_map.json").read_bytes()
