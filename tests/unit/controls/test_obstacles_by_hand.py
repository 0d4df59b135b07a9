"""Obstacles: what is asked about a part for each move, and a sphere that is touched."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pretravel.base.arrays import BoolArray, FloatArray, IntArray
from pretravel.base.errors import PretravelError
from pretravel.controls import surroundings
from pretravel.controls.machine import Machine
from pretravel.controls.surroundings import Obstacle, PartObstacle, SphereObstacle, Surroundings
from pretravel.probing.obstacles import StylusOutline

MACHINE = Machine(
    tip_diameter=8.0, stem_diameter=3.0, stylus_length=60.0, body_diameter=30.0, clearance=0.75
)
START = np.array(
    [[1.0, 2.0, 3.0], [4.0, 0.0, 1.0], [7.0, 7.0, 7.0], [0.0, 0.0, 9.0], [5.0, 5.0, 5]]
)
WAY = np.array([[3.2, 0.0, 0.0], [0.0, 0.3, -0.4], [0.0, 0.0, 0.0], [2.0, -3.0, 1.5], [0, 0, -3.0]])
END = START + WAY
LENGTH = np.array([3.2, 0.5, 0.0, math.sqrt(15.25), 3.0])


@dataclass
class _Asked:
    """Stands for the search of obstacles: keeps each question, and meets the ends that it knows."""

    balls: FloatArray
    styluses: FloatArray
    asked: list[tuple[str, FloatArray, FloatArray, IntArray, Any, float]] = field(
        default_factory=list
    )

    def ball(
        self, part: object, end: FloatArray, to: FloatArray, face: IntArray, radius: float,
        reach: float,
    ) -> IntArray:  # fmt: skip
        self.asked.append(("ball", end, to, face, radius, reach))
        return self._faces(end, self.balls)

    def stylus(
        self, part: object, end: FloatArray, to: FloatArray, outline: StylusOutline, reach: float
    ) -> IntArray:
        self.asked.append(("stylus", end, to, np.zeros(0, int), outline, reach))
        return self._faces(end, self.styluses)

    def _faces(self, end: FloatArray, known: FloatArray) -> IntArray:
        """Face 0 is a face."""
        known = np.reshape(known, (-1, 3))
        return np.where((np.abs(end[:, None] - known).max(axis=2) < 1e-9).any(axis=1), 0, -1)


def _searched(monkeypatch: pytest.MonkeyPatch, balls: FloatArray, styluses: FloatArray) -> _Asked:
    asked = _Asked(balls, styluses)
    monkeypatch.setattr(surroundings, "first_obstacle", asked.ball)
    monkeypatch.setattr(surroundings, "stylus_obstacle", asked.stylus)
    return asked


@dataclass
class _Cloud:
    tree: cKDTree
    face: IntArray


@dataclass
class _Part:
    """Points of a part: one a tip's radius beyond each contact, and others about it."""

    points: FloatArray
    face: IntArray
    box: tuple[FloatArray, FloatArray] = (np.array([1.0, 2.0, 3.0]), np.array([5.0, 6.0, 7.0]))

    def cloud_of_spacing(self, spacing: float) -> _Cloud:
        assert 0.2 * MACHINE.tip_radius <= spacing <= MACHINE.tip_radius
        return _Cloud(cKDTree(self.points), self.face)


def _obstacle(points: FloatArray, face: IntArray) -> PartObstacle:
    return PartObstacle(cast("Any", _Part(points, face)))


class TestPart:
    @pytest.mark.parametrize("touching", [False, True])
    def test_each_move_is_searched_over_its_own_length(
        self, touching: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """With ball, stem and body, and the clearance where nothing is to be touched; moves are
        searched together that end up to 1 mm earlier. A move of no length meets nothing."""
        asked = _searched(monkeypatch, END[[0]], END[[3]])
        contacts = END + 4.0 * WAY / np.maximum(LENGTH, 1e-9)[:, None]
        points = np.vstack([contacts, END - 4.0 * WAY / np.maximum(LENGTH, 1e-9)[:, None]])
        part = _obstacle(points, np.array([10, 11, 12, 13, 14, 20, 21, 22, 23, 24]))
        rows = [0, 1, 3, 4] if touching else [0, 1, 2, 3, 4]
        moves = START[rows], END[rows]
        found = (part.blocks_touch if touching else part.blocks)(MACHINE, *moves)
        assert found.tolist() == [row in (0, 3) for row in rows]
        margin = 0.0 if touching else 0.75
        for kind in ("ball", "stylus"):
            questions = [question for question in asked.asked if question[0] == kind]
            seen = []
            for _, ends, to, faces, shape, reach in questions:
                for number, end in enumerate(ends):
                    row = int(np.argmin(np.linalg.norm(END - end, axis=1)))
                    seen.append(row)
                    assert to[number] == pytest.approx(WAY[row] / LENGTH[row])
                    assert LENGTH[row] <= reach + 1e-9 < LENGTH[row] + 1.0
                    if kind == "ball":
                        assert faces[number] == (10 + row if touching else -1)
                        assert shape == 4.0 + margin
                        continue
                    assert shape.axis.tolist() == [0.0, 0.0, 1.0]
                    assert shape.above.tolist() == [[0.0, 60.0], [60.0, 260.0]]
                    assert shape.radii.tolist() == [1.5 + margin, 15.0 + margin]
            assert sorted(seen) == [0, 1, 3, 4]

    def test_its_top_and_its_distance(self) -> None:
        """The nearest of its faces: planes at heights of 3 and 10."""

        @dataclass
        class _Plane:
            height: float

            def distance(self, points: FloatArray, edges: float) -> FloatArray:
                return np.abs(points[:, 2] - self.height)

        part = _obstacle(START, np.zeros(5, int))
        assert part.top == 7.0
        cast("Any", part.part).faces = [_Plane(3.0), _Plane(10.0)]
        assert part.off(np.array([[0.0, 0, 1.0], [0, 0, 4.0], [0, 0, 9.0]])).tolist() == [2, 1, 1]
        assert part.words == "all 2 faces of the part"


class TestSphere:
    @pytest.mark.parametrize(
        ("across", "height", "shank", "blocked"),
        [
            # The sphere of 10 mm; the ball of 4 mm itself may come as near as it likes.
            (10.5, 8.0, 0.0, False),
            # The stem: 10 + 1.5 mm without a clearance.
            (11.45, -30.0, 0.0, True), (11.55, -30.0, 0.0, False),
            # The body above 60 mm: 10 + 15 mm.
            (24.95, -70.0, 0.0, True), (25.05, -70.0, 0.0, False),
            # Just below the body, beside the stem; just above its end, 260 mm above the ball.
            (13.0, -50.05, 0.0, True), (13.0, -49.95, 0.0, False),
            (0.0, -269.97, 0.0, True), (0.0, -270.03, 0.0, False),
            # The shank of 0.8 mm below the middle: 0.4 + 4 mm.
            (4.35, -90.0, 0.8, True), (26.0, -90.0, 0.8, False), (26.0, -90.0, 44.2, True),
            (26.0, -90.0, 43.8, False),
            # Just not below the middle: the lowest point of the ball is higher.
            (20.0, 4.05, 44.2, False), (20.0, 3.95, 44.2, True),
        ],
    )  # fmt: skip
    def test_at_a_touch_nothing_is_kept_clear(
        self, across: float, height: float, shank: float, blocked: bool
    ) -> None:
        """The tip moves past it, `across` beside its middle and `height` above it."""
        ball = SphereObstacle(np.array([-1.0, 2.0, 3.0]), 10.0, shank)
        middle = np.array([[across - 1.0, 2.0, 3.0 + height]])
        way = np.array([[0.0, 0.5, 0.0]])
        assert ball.blocks_touch(MACHINE, middle - way, middle + way).tolist() == [blocked]

    @pytest.mark.parametrize(("across", "blocked"), [(5.1, True), (5.2, False)])
    def test_a_thin_shank_is_kept_clear(self, across: float, blocked: bool) -> None:
        """0.4 mm of radius, a ball of 4 mm, 0.75 mm; the tip is below all but the body's end."""
        ball = SphereObstacle(np.zeros(3), 10.0, 0.8)
        at = np.array([[0.0, across, -280.0], [60.0, 0.0, 0.0]])
        assert ball.blocks(MACHINE, at, at).tolist() == [blocked, False]

    def test_every_move_of_several_is_decided_by_itself(self) -> None:
        """A long one through the sphere, a short one beside it, one that ends at its edge."""
        ball = SphereObstacle(np.array([5.0, 0.0, 0.0]), 10.0)
        start = np.array([[-60.0, 0.0, 0.0], [60.0, 60.0, 0.0], [5.0, 80.0, 0.0], [5.0, 80.0, 0.0]])
        end = np.array([[70.0, 1.0, 0.0], [60.0, 61.0, 0.0], [5.0, 14.8, 0.0], [5.0, 14.7, 0.0]])
        assert ball.blocks(MACHINE, start, end).tolist() == [True, False, False, True]

    @pytest.mark.parametrize(
        "wrong",
        [{"radius": -1.0}, {"radius": math.nan}, {"shank_diameter": math.inf},
         {"center": np.array([0.0, math.nan, 0.0])}],
    )  # fmt: skip
    def test_numbers_that_no_sphere_has(self, wrong: dict[str, Any]) -> None:
        good = SphereObstacle(np.zeros(3), 10.0, 4.0)
        with pytest.raises(PretravelError):
            replace(good, **wrong)


@dataclass(frozen=True)
class _Met:
    """An obstacle that some moves meet."""

    moves: tuple[bool, ...]
    touches: tuple[bool, ...]
    words: str = "an obstacle"
    top: float = 0.0

    def off(self, points: FloatArray) -> FloatArray:
        return np.zeros(len(points))

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        assert len(start)
        return np.array(self.moves)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        assert len(start)
        return np.array(self.touches)


def test_a_move_is_blocked_by_any_obstacle() -> None:
    two: tuple[Obstacle, ...] = (
        _Met((True, False, False), (False, False, True)),
        _Met((False, False, True), (True, False, False)),
    )
    around = Surroundings(MACHINE, two)
    assert around.block(START[:3], END[:3]).tolist() == [True, False, True]
    assert around.block_touch(START[:3], END[:3]).tolist() == [True, False, True]
    assert around.block_touch(START[:0], END[:0]).tolist() == []
    assert Surroundings(MACHINE).block_touch(START, END).tolist() == [False] * 5
