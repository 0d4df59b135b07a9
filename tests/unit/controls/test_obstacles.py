"""Obstacles: a sphere against the distances of its parts, and what is asked about a part."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pretravel.base.arrays import BoolArray, FloatArray
from pretravel.base.errors import PretravelError
from pretravel.controls import surroundings
from pretravel.controls.surroundings import Obstacle, PartObstacle, SphereObstacle, Surroundings
from pretravel.files.machine import Machine

MACHINE = Machine(
    tip_diameter=8.0, stem_diameter=3.0, stylus_length=60.0, body_diameter=30.0, clearance=0.75
)
START = np.array(
    [[1.0, 2.0, 3.0], [4.0, 0.0, 1.0], [7.0, 7.0, 7.0], [0.0, 0.0, 9.0], [5.0, 5.0, 5]]
)
WAY = np.array([[3.2, 0.0, 0.0], [0.0, 0.3, -0.4], [0.0, 0.0, 0.0], [2.0, -3.0, 1.5], [0, 0, -3.0]])
END = START + WAY
LENGTH = np.array([3.2, 0.5, 0.0, math.sqrt(15.25), 3.0])


class TestPart:
    @pytest.mark.parametrize("touching", [False, True])
    def test_each_move_is_searched_over_its_own_length(
        self, touching: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """With ball, stem and body, and the clearance where nothing is to be touched; moves are
        searched together that end up to 1 mm earlier. A move of no length meets nothing. The face
        that is touched is that of the nearest point, a tip's radius beyond the end."""
        asked: list[tuple[Any, ...]] = []

        def search(kind: str, known: FloatArray) -> Any:
            def found(part: object, end: FloatArray, to: FloatArray, *rest: Any) -> FloatArray:
                asked.append((kind, end, to, *rest))
                # Face 0 is a face.
                return np.where(np.abs(end - known).max(axis=1) < 1e-9, 0, -1)

            return found

        monkeypatch.setattr(surroundings, "first_obstacle", search("ball", END[0]))
        monkeypatch.setattr(surroundings, "stylus_obstacle", search("stylus", END[3]))
        beyond = 4.0 * WAY / np.maximum(LENGTH, 1e-9)[:, None]
        cloud = SimpleNamespace(
            tree=cKDTree(np.vstack([END + beyond, END - beyond])),
            face=np.array([10, 11, 12, 13, 14, 20, 21, 22, 23, 24]),
        )
        spacings: list[float] = []

        def cloud_of_spacing(spacing: float) -> object:
            spacings.append(spacing)
            return cloud

        part = PartObstacle(cast("Any", SimpleNamespace(cloud_of_spacing=cloud_of_spacing)))
        rows = [0, 1, 3, 4] if touching else [0, 1, 2, 3, 4]
        found = (part.blocks_touch if touching else part.blocks)(MACHINE, START[rows], END[rows])
        assert found.tolist() == [row in (0, 3) for row in rows]
        assert all(0.8 <= spacing <= 4.0 for spacing in spacings)
        margin = 0.0 if touching else 0.75
        seen: dict[str, list[int]] = {"ball": [], "stylus": []}
        for kind, ends, to, *shape, reach in asked:
            for number, end in enumerate(ends):
                row = int(np.argmin(np.linalg.norm(END - end, axis=1)))
                seen[kind].append(row)
                assert to[number] == pytest.approx(WAY[row] / LENGTH[row])
                assert LENGTH[row] <= reach + 1e-9 < LENGTH[row] + 1.0
                if kind == "ball":
                    assert (shape[0][number], shape[1]) == (
                        10 + row if touching else -1,
                        4 + margin,
                    )
            if kind == "stylus":
                assert shape[0].axis.tolist() == [0.0, 0.0, 1.0]
                assert shape[0].above.tolist() == [[0.0, 60.0], [60.0, 260.0]]
                assert shape[0].radii.tolist() == [1.5 + margin, 15.0 + margin]
        assert sorted(seen["ball"]) == sorted(seen["stylus"]) == [0, 1, 3, 4]

    def test_its_top_and_its_distance(self) -> None:
        """The nearest of its faces: planes at heights of 3 and 10."""
        faces = [
            SimpleNamespace(distance=lambda points, _, at=at: np.abs(points[:, 2] - at))
            for at in (3.0, 10.0)
        ]
        box = np.array([1.0, 2.0, 3.0]), np.array([5.0, 6.0, 7.0])
        part = PartObstacle(cast("Any", SimpleNamespace(faces=faces, box=box)))
        assert part.top == 7.0
        assert part.off(np.array([[0.0, 0, 1.0], [0, 0, 4.0], [0, 0, 9.0]])).tolist() == [2, 1, 1]
        assert part.words == "the part (2 faces, all checked)"


def _gaps(ball: SphereObstacle, tip: FloatArray, *, touching: bool) -> FloatArray:
    """Of ball, stem (to 60 mm), body (to 260 mm) from the sphere, and of the ball from the shank,
    where it is below the middle; less the clearance, where nothing is touched, (4, n)."""
    apart = ball.center - tip
    up, across = apart[:, 2], np.hypot(apart[:, 0], apart[:, 1])
    stem = np.hypot(across, up - np.clip(up, 0.0, 60.0)) - 1.5
    body = np.hypot(np.maximum(across - 15.0, 0.0), up - np.clip(up, 60.0, 260.0))
    shank = np.where(tip[:, 2] - 4.0 < ball.center[2], across - 0.5 * ball.shank_diameter - 4.0, 99)
    found = np.stack([np.linalg.norm(apart, axis=1) - 4.0, stem, body, shank])
    found[:3] -= ball.radius
    if touching:  # a ball that moves straight to the sphere meets it at the target
        found[0] = 99.0
    if not ball.shank_diameter:
        found[3] = 99.0
    return found - (0.0 if touching else MACHINE.clearance)


class TestSphere:
    @pytest.mark.parametrize("touching", [False, True])
    @pytest.mark.parametrize("shank", [0.0, 0.8, 44.0])
    def test_it_blocks_what_its_distances_say(self, touching: bool, shank: float) -> None:
        """Places about it, among them some within 0.1 mm of the limit of each part; beside a shank
        of 44 mm stem and body are free."""
        rng = np.random.default_rng(7)
        ball = SphereObstacle(np.array([-1.0, 2.0, 3.0]), 10.0, shank)
        tip = rng.uniform([-32.0, -30.0, -275.0], [30.0, 32.0, 20.0], (150_000, 3))
        gaps = _gaps(ball, tip, touching=touching)
        found = (ball.blocks_touch if touching else ball.blocks)(MACHINE, tip, tip)
        assert np.array_equal(found, gaps.min(axis=0) < 0.0)
        for part in () if shank == 44.0 else range(touching, 4 if shank else 3):
            alone = gaps[part] < np.delete(gaps, part, axis=0).min(axis=0)
            near = alone & (np.abs(gaps[part]) < 0.1)
            assert found[near].any()
            assert not found[near].all()

    def test_every_move_of_several_is_decided_by_itself(self) -> None:
        """A long one through the sphere, one that meets it on 0.8 of 120 mm, a short one beside
        it, one that ends at its edge."""
        ball = SphereObstacle(np.array([5.0, 0.0, 0.0]), 10.0)
        start = np.array([[-60.0, 0, 0], [-60.0, 14.745, 0], [60.0, 60, 0], [5, 80, 0], [5, 80, 0]])
        end = np.array([[70.0, 1, 0], [60.0, 14.745, 0], [60.0, 61, 0], [5, 14.8, 0], [5, 14.7, 0]])
        assert ball.blocks(MACHINE, start, end).tolist() == [True, True, False, False, True]

    @pytest.mark.parametrize(
        "wrong",
        [{"radius": -1.0}, {"radius": math.nan}, {"shank_diameter": math.inf},
         {"center": np.array([0.0, math.nan, 0.0])}],
    )  # fmt: skip
    def test_numbers_that_no_sphere_has(self, wrong: dict[str, Any]) -> None:
        with pytest.raises(PretravelError):
            replace(SphereObstacle(np.zeros(3), 10.0, 4.0), **wrong)


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
        return np.array(self.moves)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        assert len(start)
        return np.array(self.touches)


def test_surroundings_are_all_obstacles() -> None:
    two: tuple[Obstacle, ...] = (
        _Met((True, False, False), (False, False, True)),
        _Met((False, False, True), (True, False, False)),
    )
    around = Surroundings(MACHINE, two)
    assert around.block(START[:3], END[:3]).tolist() == [True, False, True]
    assert around.block_touch(START[:3], END[:3]).tolist() == [True, False, True]
    assert around.block_touch(START[:0], END[:0]).tolist() == []
    low, high = SphereObstacle(np.zeros(3), 5.0), SphereObstacle(np.array([40.0, 0, 10.0]), 8.0)
    both = Surroundings(MACHINE, (low, high))
    assert both.known
    assert both.lowest_travel == pytest.approx(10.0 + 8.0 + 4.0 + 0.75)
    points = np.array([[0.0, 0.0, 6.0], [40.0, 0.0, 21.0], [0.0, 4.0, 0.0]])
    assert both.off(points) == pytest.approx([1.0, 3.0, 1.0])
    nothing = Surroundings(MACHINE)
    assert (nothing.known, nothing.lowest_travel) == (False, -math.inf)
    assert nothing.block(START, END).tolist() == [False] * 5
    assert nothing.block_touch(START, END).tolist() == [False] * 5
    assert "shank was not given" in low.words
    assert "a vertical shank of 8 mm below" in replace(low, shank_diameter=8.0).words
