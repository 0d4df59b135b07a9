"""Sizes, places and axes of features that contradict the drawing together, or one of them alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel import measure_drawing
from pretravel.base import PretravelError
from pretravel.drawing.features.measured_feature import MeasuredFeature, measure_feature
from pretravel.drawing.tolerances.compared_with_drawing import (
    far_from_places,
    other_axes,
    sizes_alike,
)
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, DrawnRelation
from pretravel.drawing.tolerances.geometric_tolerances import inspect_geometry
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance, PlacedFeature
from pretravel.drawing.tolerances.tolerances import FeatureTolerances, inspect_feature
from pretravel.measurement import Points
from tests.support.feature_points import around, feature_points

OUTWARD, _ = around(8)
GRID = np.array([[x, y, 0.0] for x in (0.0, 20.0, 40.0) for y in (0.0, 20.0)])
UP = np.tile([0.0, 0.0, 1.0], (6, 1))


def _round(kind: str, diameter: float, at: tuple[float, float] = (0.0, 0.0)) -> MeasuredFeature:
    side = -1.0 if kind == "bore" else 1.0
    places = 0.5 * diameter * OUTWARD + [*at, 0.0]
    return measure_feature(feature_points(places, side * OUTWARD), kind, label=f"{kind}{diameter}")


def _plane(height: float, tilt: float = 0.0, side: float = 1.0) -> MeasuredFeature:
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [np.tan(tilt), 0.0, 1.0]])
    places = GRID @ turn.T + [0.0, 0.0, height]
    return measure_feature(feature_points(places, side * UP), "plane", label="A")


@pytest.mark.parametrize(
    ("off", "said"),
    [
        ((0.020, 0.018, -0.022), "9.0 to 11.0 µm less material"),  # triggers 10 µm late
        ((-0.020, -0.018, 0.022), "9.0 to 11.0 µm more material"),
        ((2.000, 2.000, -2.001), "the radius of the tip"),
        ((0.020, 0.018, 0.022), ""),  # larger bores and a larger boss
        ((0.020, -0.004, -0.011), ""),  # each of its own
        ((0.003, 0.003, -0.003), ""),  # no more than U
    ],
)
def test_all_sizes_off_alike(off: tuple[float, float, float], said: str) -> None:
    sizes = [("bore", 20.0), ("bore", 12.0), ("boss", 16.0)]
    found = [
        inspect_feature(_round(kind, size + by), FeatureTolerances((size - 0.02, size + 0.02)))
        for (kind, size), by in zip(sizes, off, strict=True)
    ]
    told = sizes_alike(found)
    assert (said in told[0]) if said else told == []
    assert sizes_alike(found[:2]) == []  # bores alone are those of their drills


@pytest.mark.parametrize(
    ("off", "named"), [((0.0, 0.0, 0.01, 0.0, 0.5), "bore5"), ((0.5, 0.4, 0.3, 0.4, 0.5), "")]
)
def test_one_feature_away_from_its_place(off: tuple[float, ...], named: str) -> None:
    """Half a millimetre is an offset of one of them, or the form of all of a casting."""
    found = {f"bore{n}": _round("bore", 10.0, (by, 0.0)) for n, by in enumerate(off, start=1)}
    told = far_from_places(found, dict.fromkeys(found, (0.0, 0.0, 0.0)))
    assert len(told) == (named != "")
    assert all("lies 0.500 mm from its nominal position, the others 0.0" in each for each in told)


@pytest.mark.parametrize(
    ("tilt", "side", "said"),
    [(0.0, 1.0, ""), (0.1, 1.0, ""), (0.5, 1.0, "A by 0.5°"), (0.0, -1.0, "against the axis")],
)
def test_an_axis_that_is_not_the_measured_one(tilt: float, side: float, said: str) -> None:
    found = {"A": _plane(0.0, np.radians(tilt), side)}
    told = other_axes(found, {"A": (0.0, 0.0, 1.0)})
    assert (said in told[0]) if said else told == []


@pytest.mark.parametrize(("zone", "refused"), [(30.0, True), (4.0, False)])
def test_a_zone_in_micrometres(zone: float, refused: bool) -> None:
    """Castings have zones of 4 mm."""
    up, zero = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    top = PlacedFeature(_plane(20.0), 20.0 * up, up)
    tolerance, datums = (
        GeometricTolerance("parallelism", zone, ("A",)),
        {"A": PlacedFeature(_plane(0.0), zero, up)},
    )
    if refused:
        with pytest.raises(PretravelError, match="were 30 µm meant"):
            inspect_geometry([top], tolerance, datums, 0.95)
    else:
        inspect_geometry([top], tolerance, datums, 0.95)


def _two_planes() -> Points:
    """At heights of 0 and 20 mm."""
    places = np.vstack([GRID, GRID + 20.0 * UP])
    normals = np.vstack([-UP, UP])
    return replace(feature_points(places, normals), labels=tuple("aaaaaabbbbbb"))


@pytest.mark.parametrize(("limits", "said"), [("59.9..60.1", True), ("19.9..20.1", False)])
def test_a_distance_far_from_its_limits(limits: str, said: bool) -> None:
    drawing = Drawing(
        (
            DrawnFeature("plane", select="a", label="a"),
            DrawnFeature("plane", select="b", label="b"),
        ),
        between=(DrawnRelation(("a", "b"), limits),),
    )
    told = " ".join(measure_drawing(_two_planes(), drawing).together[0].remarks)
    assert ("39.900 mm outside its limits" in told) == said


def test_a_fault_of_a_fit_names_the_point_that_is_far() -> None:
    """A touch of another bore has the label of this one: the fit turns, and its normals are off."""
    places, normals = np.vstack([10.0 * OUTWARD] * 2), np.vstack([-OUTWARD] * 2)
    places[8:, 2] -= 8.0
    places[15] += [36.0, 8.0, 0.0]
    points = replace(feature_points(places, normals), labels=("a",) * 15 + ("b",))
    drawing = Drawing((DrawnFeature("cylinder", select="*", label="bore", axis=(0.0, 0.0, 1.0)),))
    with pytest.raises(
        PretravelError, match=r"^bore: .*\(1 point is far from the cylinder .* b \("
    ):
        measure_drawing(points, drawing)
