"""What the screen Part computes; nothing here touches a page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.app.own_description import own_map
from pretravel.app.tasks import Inputs
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
from pretravel.tasks.task import command_line, python_lines
from pretravel.tasks.values import ToleranceText
from pretravel.uncertainty.gum import Budget

PART_SETTINGS = ("probe", "units", "feed", "extrapolate")
FEATURE_SETTINGS = (
    "feature", "labels", "by_prefix", "lower", "upper", "form_tolerance", "u_machine_um",
)  # fmt: skip


@dataclass(frozen=True)
class PartResult:
    """The compensated touches of a part.

    Attributes
    ----------
    compensated : CompensatedTouches
    document : Document
    slide : (n,) float or None
        How far the contact slides before the trigger; None without a nominal part. [mm]
    touches_name, map_name : str
        Of the files.
    """

    compensated: CompensatedTouches
    document: Document
    slide: FloatArray | None
    touches_name: str
    map_name: str

    def budget(self, row: int) -> Budget:
        """The uncertainty budget of a point. [mm]"""
        return point_budget(self.compensated.errors, row)

    def shown(self) -> Compensate:
        """The task with the names of the files, which are elsewhere for the user."""
        task = self.compensated.task
        nominal = None if task.nominal is None else Path(task.nominal).name
        return replace(
            task, touches=(Path(self.touches_name),), map_file=self.map_name, nominal=nominal
        )

    def command(self) -> str:
        """The command that writes the same points."""
        return command_line(self.shown())

    def python(self) -> str:
        """The lines of Python that compute the same points."""
        return python_lines(self.shown())


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
    touches = inputs.file("touches")
    task = Compensate(
        touches=(touches,),
        map_file=str(map_file or probe),
        output=Path("points.csv"),
        nominal=None if part is None else str(part),
        extrapolate=bool(settings.get("extrapolate", False)),
        units=settings.get("units") or None,
        feed=settings.get("feed"),
    )
    pretravel_map = task.pretravel_map() if map_file is None else own_map(map_file)
    readings = task.read_touches(tip_diameter=2.0 * pretravel_map.tip_radius)
    # Not parse_surface: it executes Python files.
    nominal = None if part is None else read_part(part)
    found = task.compensated(readings, pretravel_map, nominal)
    slide = None
    if part is not None:
        seen = pretravel_map.seen_from(readings.placement)
        slide = np.linalg.norm(contact_slide(found.touches, found.points, seen), axis=1)
    map_name = probe if map_file is None else map_file.name
    return PartResult(found, found.document(), slide, touches.name, map_name)


@dataclass(frozen=True)
class PartFeatures:
    """Measured features, and the command that does the same.

    Attributes
    ----------
    features : MeasuredFeatures
    document : Document
    command : str
    """

    features: MeasuredFeatures
    document: Document
    command: str


def measure_part(result: PartResult, inputs: Inputs) -> PartFeatures:
    """Measure features of compensated points.

    Raises
    ------
    PretravelError
        Points that do not determine the features; limits in the wrong order.
    """
    get = inputs.settings.get
    kind = str(get("feature", "plane"))
    labels = tuple(str(get("labels", "")).split())
    lower, upper = get("lower"), get("upper")
    size = None
    if lower is not None or upper is not None:
        size = ToleranceText(lower, upper, are_limits=True)
        if lower is not None and upper is not None and not lower < upper:
            raise PretravelError(
                f"the tolerance {lower:g} to {upper:g} mm is empty: the lower limit is below the "
                "upper limit"
            )
    task = Measure(
        points=Path(result.touches_name),
        feature=kind,
        select=labels,
        by_prefix=bool(get("by_prefix", False)),
        size_tolerance=size,
        form_tolerance=get("form_tolerance"),
        u_machine_um=float(get("u_machine_um", 0.0) or 0.0),
        output=Path("features.csv"),
    )
    # The points as a file of them has them, so that the command finds the same last digit.
    with temporary_folder() as folder:
        result.compensated.write("output", folder / "points.csv")
        points = read_points(folder / "points.csv")
    found = task.measured(points)
    return PartFeatures(
        found, found.document(), command_line(replace(task, points=Path("points.csv")))
    )


def example_map(folder: Path) -> tuple[str, bytes]:
    """Name and content of the map of the probe that touched the example part."""
    from pretravel.files.map_file import write_map
    from pretravel.tasks.qualify import Qualify

    touches = (folder / "sphere_touches.csv",)
    made = Qualify(touches=touches, diameter=24.9987, tip_diameter=6.0, kind="physical").run()
    with temporary_folder() as place:
        write_map(place / "example_map.json", made.pretravel_map)
        return "example_map.json", (place / "example_map.json").read_bytes()
