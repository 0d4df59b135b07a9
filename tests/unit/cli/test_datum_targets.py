"""A datum by targets (ISO 5459): the plane on the touches at them, whatever its face is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pretravel
from pretravel.base import FloatArray
from pretravel.drawing import InspectionRegion
from pretravel.drawing.tasks.plan.needed import ReachingStylus, needed_touches
from pretravel.measurement.points import Points
from pretravel.surface import read_part
from tests.support.examples import EXAMPLES
from tests.support.feature_points import feature_points

PLACES = ((0.0, 0.0, 0.0, 0.0), (40.0, 0.0, 0.0, 6.0), (0.0, 40.0, 0.0, 0.0))
FACE = pretravel.DrawnFeature("plane", label="A", faces=(1,))
LOW = pretravel.DrawnFeature(
    "plane",
    label="low",
    faces=(2,),
    geometric=(pretravel.GeometricTolerance("parallelism", 0.02, ("A",)),),
)


@pytest.fixture(scope="module")
def points() -> Points:
    """Nine places of face 1, up to 40 µm too low beside the targets, and of face 2 parallel to
    the plane through these."""
    at = np.array([[x, y, 0.0] for x in (0.0, 20.0, 40.0) for y in (0.0, 20.0, 40.0)])
    low = np.where(np.isin(np.arange(9), [0, 6, 2]), 0.0, -np.linspace(0.0, 0.04, 9))
    normals = np.tile([0.0, 0.0, 1.0], (18, 1))
    positions = np.vstack([at + low[:, None] * normals[:9], at + np.array([80.0, 0.0, -10.0])])
    return replace(
        feature_points(positions, normals, shared={"map 1": np.full(18, 1e-4)}),
        face=np.repeat([1, 2], 9),
    )


def test_the_touches_at_the_targets_alone_are_the_datum(points: Points) -> None:
    by_targets = replace(FACE, targets=PLACES, association="tangent")
    (whole,) = pretravel.measure_drawing(
        points, pretravel.Drawing((FACE, LOW)), u_machine=1e-4
    ).lines
    result = pretravel.measure_drawing(points, pretravel.Drawing((by_targets, LOW)), u_machine=1e-4)
    (line,) = result.lines
    assert whole.value > 10.0 * line.value  # mm, of a zone of 20 µm
    assert whole.verdict.value != "conforms"
    assert line.verdict.value == "conforms"
    assert result["A"].feature.points.labels == ("1", "3", "7")


def test_a_target_without_a_touch_is_named(points: Points) -> None:
    far = replace(FACE, targets=(PLACES[0], (50.0, 0.0, 0.0, 6.0), PLACES[2]))
    (line,) = pretravel.measure_drawing(points, pretravel.Drawing((far, LOW)), u_machine=1e-4).lines
    assert "no touch is at its target 2, within 3 mm of x 50, y 0, z 0" in line.words


def test_one_area_is_a_datum_by_the_touches_in_it(points: Points) -> None:
    """The four in the corner at x = y = 20 to 40, which lie on a slope."""
    area = replace(FACE, targets=((30.0, 30.0, 0.0, 29.0),), association="tangent")
    result = pretravel.measure_drawing(points, pretravel.Drawing((area, LOW)), u_machine=1e-4)
    assert result["A"].feature.points.labels == ("5", "6", "8", "9")


def _planned(*places: tuple[float, ...]) -> FloatArray:
    """Touches of the top of the bracket, which is datum A by targets."""
    part = read_part(EXAMPLES / "bracket.step")
    top = pretravel.DrawnFeature("plane", label="A", faces=(3,), targets=places)  # type: ignore[arg-type]
    side = pretravel.DrawnFeature("plane", faces=(2,), geometric=(
        pretravel.GeometricTolerance("perpendicularity", 0.05, ("A",)),))  # fmt: skip
    found = needed_touches(
        pretravel.Drawing((top, side)), part, ReachingStylus(1.5, 0.75), 1e-3, InspectionRegion()
    )
    return found.plan.point[found.plan.face == 3]


def test_the_plan_touches_each_target() -> None:
    places = ((5.0, 5.0, 20.0, 5.0), (75.0, 5.0, 20.0, 0.0), (40.0, 45.0, 20.0, 0.0))
    assert {tuple(np.round(at, 6)) for at in _planned(*places)} == {at[:3] for at in places}


def test_the_plan_touches_a_single_area_three_times() -> None:
    there = _planned((10.0, 10.0, 20.0, 12.0))
    away = np.linalg.norm(there - [10.0, 10.0, 20.0], axis=1)
    assert len(there) == 3
    assert np.all((away > 3.0) & (away < 6.0))  # mm: within the area, and far from each other
