"""A datum by targets (ISO 5459): the plane on the touches at them, whatever its face is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pretravel
from pretravel.base import FloatArray
from pretravel.drawing import InspectionRegion
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.plan.needed import ReachingStylus, needed_touches
from pretravel.drawing.tolerances.datum_system import DatumSystem
from pretravel.drawing.tolerances.tolerance_frame import DatumWord, PlacedFeature, frame_of
from pretravel.measurement.points import Points, joined_points
from pretravel.surface import read_part
from tests.support.examples import EXAMPLES
from tests.support.feature_points import feature_points

PLACES = ((0.0, 0.0, 0.0, 0.0), (40.0, 0.0, 0.0, 6.0), (0.0, 40.0, 0.0, 0.0))
NO_TURN = np.zeros(6)
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


def _planned(*places: tuple[float, ...], lines: tuple[tuple[float, ...], ...] = ()) -> FloatArray:
    """Touches of the top of the bracket, which is datum A by targets."""
    part = read_part(EXAMPLES / "bracket.step")
    top = pretravel.DrawnFeature("plane", label="A", faces=(3,), targets=places, target_lines=lines)  # type: ignore[arg-type]
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


def test_the_plan_touches_a_line_three_times() -> None:
    there = _planned((10.0, 45.0, 20.0, 0.0), lines=((10.0, 5.0, 20.0, 60.0, 5.0, 20.0),))
    assert sorted(there[:, 0].round(6).tolist()) == [10.0, 12.5, 35.0, 57.5]
    assert sorted(there[:, 1].round(6).tolist()) == [5.0, 5.0, 5.0, 45.0]


# Three, two and one: a block with x, y, z from 0, and a bore at x = 30, y = 20
PLANES = {"A": (0.0, 0.0, -1.0), "B": (0.0, -1.0, 0.0), "C": (-1.0, 0.0, 0.0)}
TOUCHED = {
    "A": [(5.0, 5.0, 0.0), (55.0, 5.0, 0.0), (30.0, 35.0, 0.0)],
    "B": [(5.0, 0.0, 10.0), (55.0, 0.0, 10.0)],
    "C": [(0.0, 20.0, 10.0)],
}


def _touched(letter: str, off: FloatArray, turn: FloatArray = NO_TURN) -> Points:
    """Touches at the targets, off by amounts along the normal, on a part turned by little."""
    at, normal = np.array(TOUCHED[letter]), np.array(PLANES[letter])
    return _of_face(letter, at + np.outer(off, normal), np.tile(normal, (len(at), 1)), at, turn)


def _of_face(
    letter: str, at: FloatArray, normals: FloatArray, nominal: FloatArray, turn: FloatArray
) -> Points:
    moved, count = at + turn[:3] + np.cross(turn[3:], at), len(at)
    made = feature_points(moved, normals, shared={"map 1": np.full(count, 1e-4)})
    away = np.sum((moved - nominal) * normals, axis=1)
    return replace(made, face=np.full(count, ord(letter)), deviation=away)


def _bore(turn: FloatArray) -> Points:
    angle = np.arange(16) * np.pi / 4.0
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    at = (
        np.array([30.0, 20.0, 0.0]) + 6.0 * outward + np.outer(np.repeat([5.0, 15.0], 8), [0, 0, 1])
    )
    return _of_face("H", at, -outward, at, turn)


def _drawing(b: pretravel.DrawnFeature) -> pretravel.Drawing:
    a, c = (
        pretravel.DrawnFeature(
            kind, label=letter, faces=(ord(letter),), association="tangent",
            targets=tuple((*each, 0.0) for each in TOUCHED[letter]),
        )
        for letter, kind in (("A", "plane"), ("C", "surface"))
    )  # fmt: skip
    hole = pretravel.DrawnFeature(
        "cylinder", label="H", faces=(ord("H"),), at=(30.0, 20.0, 10.0), axis=(0.0, 0.0, 1.0),
        geometric=(pretravel.GeometricTolerance("position", 0.02, ("A", "B", "C")),),
    )  # fmt: skip
    a = replace(a, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, -1.0))
    return pretravel.Drawing((a, b, c, hole))


B = pretravel.DrawnFeature(
    "surface", label="B", faces=(ord("B"),), association="tangent",
    targets=tuple((*each, 0.0) for each in TOUCHED["B"]),
)  # fmt: skip


def test_three_two_and_one_point_make_the_frame() -> None:
    """A part that lies off by 0.1 mm and 1 mrad, and whose bore is right: its position is 0."""
    turn = np.array([0.1, -0.05, 0.02, 4e-4, -3e-4, 1e-3])
    points = [_touched(letter, np.zeros(len(TOUCHED[letter])), turn) for letter in "ABC"]
    together = joined_points([*points, _bore(turn)])
    (line,) = pretravel.measure_drawing(together, _drawing(B), u_machine=1e-4).lines
    assert line.characteristic.endswith("A|B|C")
    assert line.value < 1e-3  # 2 x 60 mm x (1 mrad)²/2 and less: turns are not exactly small
    assert line.verdict.value == "conforms"
    off = joined_points([points[0], _touched("B", np.array([0.03, 0.03]), turn), points[2],
                           _bore(turn)])  # fmt: skip
    (line,) = pretravel.measure_drawing(off, _drawing(B), u_machine=1e-4).lines
    assert line.value == pytest.approx(0.06, abs=1e-3)  # twice what the side is too far outside


def _system(off: FloatArray) -> DatumSystem:
    words = []
    for k, letter in enumerate("ABC"):
        mine = off[[0, 1, 2]] if k == 0 else off[[3, 4]] if k == 1 else off[[5]]
        feature = measure_feature(_touched(letter, mine), "surface", label=letter,
                                  association="tangent")  # fmt: skip
        words.append(DatumWord((PlacedFeature(feature),), at_maximum=False))
    hole = measure_feature(_bore(NO_TURN), "cylinder", label="H", axis=[0.0, 0.0, 1.0])
    placed = PlacedFeature(hole, np.array([30.0, 20.0, 10.0]), np.array([0.0, 0.0, 1.0]))
    wanted = pretravel.GeometricTolerance("position", 0.02, ("A", "B", "C"))
    return frame_of(placed, wanted, words).system


def test_the_errors_of_the_touches_move_the_frame_as_is_said() -> None:
    before, step = _system(np.zeros(6)), 1e-3
    assert before.free.shape[1] == 0
    rows = np.hstack(before.by_parameters)
    for touch in range(6):
        after = _system(np.where(np.arange(6) == touch, step, 0.0))
        moved = after.placement.points(np.eye(3) * 50.0) - before.placement.points(np.eye(3) * 50.0)
        motion = step * rows[:, touch]
        expected = motion[:3] + np.cross(motion[3:], np.eye(3) * 50.0)
        # Of a movement of 1 µm, its square by 50 mm: some 1e-8 mm
        assert moved == pytest.approx(expected, abs=1e-7)


def test_a_line_rests_on_its_highest_touches() -> None:
    """Seven touches along B, bowed by 20 µm: the frame is at its top, not in its middle."""
    x = np.linspace(5.0, 55.0, 7)
    at = np.column_stack([x, 0.0 * x, 0.0 * x + 10.0])
    bow = 0.02 * (1.0 - ((x - 30.0) / 25.0) ** 2) - 0.02
    bow[2] = bow[3] = bow[4] = 0.0  # flat on top
    normal = np.tile(PLANES["B"], (7, 1))
    side = _of_face("B", at + bow[:, None] * normal, normal, at, NO_TURN)
    line = replace(B, targets=(), target_lines=((5.0, 0.0, 10.0, 55.0, 0.0, 10.0),))
    points = [_touched("A", np.zeros(3)), side, _touched("C", np.zeros(1)), _bore(NO_TURN)]
    (found,) = pretravel.measure_drawing(
        joined_points(points), _drawing(line), u_machine=1e-4
    ).lines
    assert found.value < 1e-3
    (found,) = pretravel.measure_drawing(
        joined_points(points), _drawing(replace(line, association=None)), u_machine=1e-4
    ).lines
    assert found.value == pytest.approx(2.0 * abs(bow.mean()), abs=1e-3)  # of least squares
    far = replace(line, target_lines=((5.0, 0.0, 15.0, 55.0, 0.0, 15.0),))
    (found,) = pretravel.measure_drawing(joined_points(points), _drawing(far), u_machine=1e-4).lines
    assert "0 touches are on its target line 1, within 1 mm" in found.words
