"""What the screen Part computes; nothing here touches a page."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.app.own_description import own_map
from pretravel.app.tasks import Inputs
from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.base.whole_file import temporary_folder
from pretravel.files.file_format import ReadingOptions
from pretravel.files.points_reading import read_points
from pretravel.files.several_files import read_series
from pretravel.measurement.contact_slide import contact_slide
from pretravel.measurement.point_budget import point_budget
from pretravel.measurement.tolerances import FeatureTolerances
from pretravel.prediction.catalogue import catalogue_names
from pretravel.show.document import Document
from pretravel.surface.cad.part_file import read_part
from pretravel.tasks.compensate import (
    CompensatedTouches,
    CompensationSetup,
    compensate_readings,
)
from pretravel.tasks.map_argument import map_or_prediction
from pretravel.tasks.measure import FeatureWish, MeasuredFeatures, measure_features
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
    touches_name, map_name, part_name : str
        Of the files; `part_name` is empty without a part.
    options : tuple of str
        Of the command that does the same, beside the files.
    """

    compensated: CompensatedTouches
    document: Document
    slide: FloatArray | None
    touches_name: str
    map_name: str
    part_name: str
    options: tuple[str, ...]

    def budget(self, row: int) -> Budget:
        """The uncertainty budget of a point. [mm]"""
        return point_budget(self.compensated.errors, row)

    def command(self, output: str = "points.csv") -> str:
        """The command that writes the same points."""
        nominal = ("--nominal", self.part_name) if self.part_name else ()
        words = ("pretravel", "compensate", self.touches_name, "--map", self.map_name, *nominal)
        return shlex.join([*words, *self.options, "-o", output])

    def python(self) -> str:
        """The lines of Python that compute the same points."""
        found = self.compensated
        reading = f"tip_radius={found.pretravel_map.tip_radius!r}"
        if "--units" in self.options:
            reading += f", units={self.options[self.options.index('--units') + 1]!r}"
        setup = f"read_part({self.part_name!r})" if self.part_name else "None"
        setup += f", extrapolate={found.setup.extrapolate}, feed={found.setup.feed!r}"
        return "\n".join(
            (
                "from pathlib import Path",
                "from pretravel.files.file_format import ReadingOptions",
                "from pretravel.files.several_files import read_series",
                "from pretravel.tasks.compensate import CompensationSetup, compensate_readings",
                "from pretravel.tasks.map_argument import map_or_prediction",
                "from pretravel.surface.cad.part_file import read_part",
                "",
                f"probe_map = map_or_prediction({self.map_name!r})",
                f"options = ReadingOptions({reading})",
                f"readings = read_series([Path({self.touches_name!r})], options)",
                f"setup = CompensationSetup({setup})",
                "points = compensate_readings(readings, probe_map, setup).points",
                "print(points.positions, points.standard_uncertainty)",
            )
        )


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
    pretravel_map = map_or_prediction(probe) if map_file is None else own_map(map_file)
    units = settings.get("units") or None
    touches = inputs.file("touches")
    options = ReadingOptions(units=units, tip_radius=pretravel_map.tip_radius)
    readings = read_series([touches], options)
    setup = CompensationSetup(
        None if part is None else read_part(part),
        bool(settings.get("extrapolate", False)),
        feed=settings.get("feed"),
    )
    found = compensate_readings(readings, pretravel_map, setup)
    slide = None
    if part is not None:
        seen = pretravel_map.seen_from(readings.placement)
        slide = np.linalg.norm(contact_slide(found.touches, found.points, seen), axis=1)
    return PartResult(
        found,
        found.document(touches.name),
        slide,
        touches.name,
        probe if map_file is None else map_file.name,
        "" if part is None else part.name,
        _options(settings),
    )


def _options(settings: object) -> tuple[str, ...]:
    assert hasattr(settings, "get")
    found: list[str] = []
    if settings.get("units"):
        found += ["--units", str(settings.get("units"))]
    if settings.get("feed") is not None:
        found += ["--feed", f"{settings.get('feed'):.12g}"]
    if settings.get("extrapolate"):
        found.append("--extrapolate")
    return tuple(found)


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
        size = (-math.inf if lower is None else lower, math.inf if upper is None else upper)
        if not size[0] < size[1]:
            raise PretravelError(
                f"the tolerance {lower:g} to {upper:g} mm is empty: the lower limit is below the "
                "upper limit"
            )
    form = get("form_tolerance")
    u_machine = float(get("u_machine_um", 0.0) or 0.0)
    by_prefix = bool(get("by_prefix", False))
    wish = FeatureWish(
        kind,
        labels,
        by_prefix,
        u_machine=u_machine * MICROMETRE,
        tolerances=FeatureTolerances(size, None, form),
    )
    # The points as a file of them has them, so that the command finds the same last digit.
    with temporary_folder() as folder:
        result.compensated.write(folder / "points.csv", result.touches_name, result.map_name)
        points = read_points(folder / "points.csv")
    found = measure_features(points, wish)
    words = ["pretravel", "measure", "points.csv", "--feature", kind]
    for label in labels:
        words += ["--select", label]
    words += ["--group"] if by_prefix else []
    if size is not None:
        ends = ("" if end is None else f"{end:.12g}" for end in (lower, upper))
        words += ["--tolerance", "..".join(ends)]
    words += [] if form is None else ["--form-tolerance", f"{form:.12g}"]
    words += ["--u-machine", f"{u_machine:.12g}"] if u_machine else []
    document = found.document(result.touches_name)
    return PartFeatures(found, document, shlex.join([*words, "-o", "features.csv"]))


def example_map(folder: Path) -> tuple[str, bytes]:
    """Name and content of the map of the probe that touched the example part."""
    from pretravel.files.map_file import write_map
    from pretravel.maps.provenance import QualificationSetup
    from pretravel.tasks.qualify import KindWish, qualify_probe

    readings = read_series([folder / "sphere_touches.csv"], ReadingOptions(tip_radius=3.0))
    setup = QualificationSetup(24.9987, tip_diameter=6.0)
    made = qualify_probe(readings.in_machine_axes(), setup, KindWish("physical"))
    with temporary_folder() as place:
        write_map(place / "example_map.json", made.pretravel_map)
        return "example_map.json", (place / "example_map.json").read_bytes()
