"""Limits of machine data, moves of programs and obstacles, each by hand."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from pretravel.base.arrays import BoolArray, FloatArray
from pretravel.base.directions import from_angles, unit
from pretravel.base.errors import PretravelError
from pretravel.controls.linuxcnc_program import _moves, check_line_lengths, linuxcnc_program
from pretravel.controls.machine import WORK_OFFSETS, Machine, work_placement, work_turn
from pretravel.controls.program import ProbingProgram, plan_program
from pretravel.controls.surroundings import SphereObstacle, Surroundings
from pretravel.controls.ways import (
    _horizontal,
    check_limits,
    touch_moves,
    ways_between,
    ways_down,
)
from pretravel.probing.targets import Targets

MACHINE = Machine()
UP = np.array([[0.0, 0.0, 1.0]])

BOUNDS = {
    "tip_diameter": (0.05, 50.0), "stem_diameter": (0.02, 50.0), "stylus_length": (1.0, 1000.0),
    "body_diameter": (0.1, 500.0), "measuring_feed": (0.1, 3000.0),
    "positioning_feed": (1.0, 60000.0), "travel_feed": (1.0, 60000.0),
    "acceleration": (1.0, 1e6), "safe_height": (-1e4, 1e4), "start_distance": (0.01, 100.0),
    "overtravel": (0.01, 100.0), "clearance": (0.001, 100.0), "tool_length": (-2000.0, 2000.0),
    "change_height": (-1e4, 1e4),
}  # fmt: skip


def _told(**numbers: Any) -> str:
    """Why a machine is refused; empty where it is not."""
    try:
        replace(MACHINE, **numbers)
    except PretravelError as error:
        return str(error)
    return ""


class TestMachine:
    @pytest.mark.parametrize("name", BOUNDS)
    def test_bounds_of_every_number(self, name: str) -> None:
        """At a bound a number can be refused for its relation to others, but not by itself."""
        for bound, outwards in zip(BOUNDS[name], (-1.0, 1.0), strict=True):
            beyond = bound + outwards * max(1e-3 * abs(bound), 1e-6)
            assert "must lie between" not in _told(**{name: bound})
            words = f"must lie between {BOUNDS[name][0]:g} and {BOUNDS[name][1]:g}"
            assert words in _told(**{name: beyond})

    @pytest.mark.parametrize(
        ("good", "bad", "words"),
        [
            ({"stem_diameter": 5.999}, {"stem_diameter": 6.0}, "stem diameter 6 mm: it must be"),
            ({"body_diameter": 4.5}, {"body_diameter": 4.49}, "not thinner than the stem"),
            ({"clearance": 1.999}, {"clearance": 2.0}, "less than the start distance"),
            # A fifth of the stylus, and 10 mm at the most.
            ({"overtravel": 10.0}, {"overtravel": 10.01}, "stylus of 50 mm bears 10 mm at most"),
            (
                {"overtravel": 4.0, "stylus_length": 20.0},
                {"overtravel": 4.01, "stylus_length": 20.0},
                "stylus of 20 mm bears 4 mm at most",
            ),
            (
                {"overtravel": 10.0, "stylus_length": 200.0},
                {"overtravel": 10.01, "stylus_length": 200.0},
                "stylus of 200 mm bears 10 mm at most",
            ),
            # The distance to stop, v² / (2 · 50 mm/s²), is 10 mm from 31.62 mm/s, 1897.4 mm/min.
            (
                {"acceleration": 50.0, "positioning_feed": 900.0, "measuring_feed": 1897.0},
                {"acceleration": 50.0, "positioning_feed": 900.0, "measuring_feed": 1898.0},
                "measuring feed 1898 mm/min: after a contact.*override up to 100 %",
            ),
            # Other feeds can be doubled by the override.
            (
                {"acceleration": 50.0, "positioning_feed": 948.0},
                {"acceleration": 50.0, "positioning_feed": 949.0},
                "positioning feed 949 mm/min: after a contact.*override up to 200 %",
            ),
            (
                {"acceleration": 50.0, "positioning_feed": 900.0, "travel_feed": 948.0},
                {"acceleration": 50.0, "positioning_feed": 900.0, "travel_feed": 949.0},
                "travel feed 949 mm/min: after a contact",
            ),
            ({"tool": 1}, {"tool": 0}, "tool 0: the tool table numbers tools from 1"),
            ({"tool": 1, "tool_length": 80.0}, {"tool_length": 80.0}, "need the number of a tool"),
            ({"tool": 1, "change_height": 5.0}, {"change_height": 5.0}, "need the number"),
            ({"work_offset": "G59.3"}, {"work_offset": "G59.4"}, "it is one of G54, G55"),
            (
                {"limits": np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1e-3]])},
                {"limits": np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 0.0]])},
                "the first number must be below the second",
            ),
        ],
    )
    def test_relations_of_numbers(
        self, good: dict[str, Any], bad: dict[str, Any], words: str
    ) -> None:
        assert _told(**({"travel_feed": 0.0} | good)) == ""
        assert re.search(words, _told(**({"travel_feed": 0.0} | bad)))

    def test_what_is_not_stated(self) -> None:
        """A probe of 6 mm with a stylus of 50 mm, at feeds that every machine can stop from."""
        assert (MACHINE.tip_radius, MACHINE.stylus_length, MACHINE.work_offset) == (
            3.0,
            50.0,
            "G54",
        )
        lengths = MACHINE.tool_length, MACHINE.stem_diameter, MACHINE.body_diameter
        assert lengths == (0.0, 4.5, 40.0)
        feeds = MACHINE.measuring_feed, MACHINE.positioning_feed, MACHINE.acceleration
        assert feeds == (50.0, 1000.0, 500.0)
        distances = MACHINE.start_distance, MACHINE.overtravel, MACHINE.clearance
        assert (MACHINE.safe_height, *distances) == (50.0, 2.0, 2.0, 1.0)
        assert work_turn(work_placement(1.0, 2.0, 3.0)) == 0.0
        assert MACHINE.travel_feed == MACHINE.positioning_feed
        assert replace(MACHINE, travel_feed=2000.0).travel_feed == 2000.0
        assert (MACHINE.tool, MACHINE.change_height, MACHINE.work, MACHINE.limits) == (None,) * 4
        assert MACHINE.clearance < MACHINE.start_distance
        assert WORK_OFFSETS[5:7] == ("G59", "G59.1")

    @pytest.mark.parametrize("angle", [-2.5, -0.3, 0.0, 0.3, 2.5])
    def test_turns_of_work_coordinates(self, angle: float) -> None:
        placed = work_placement(1.0, 2.0, 3.0, angle)
        assert work_turn(placed) == pytest.approx(angle)
        expected = [1.0 + math.cos(angle), 2.0 + math.sin(angle), 3.0]
        assert placed.points(np.array([[1.0, 0.0, 0.0]]))[0] == pytest.approx(expected)


def _box_distance(point: FloatArray, low: FloatArray, high: FloatArray) -> float:
    return float(np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0.0)))


def _gap(machine: Machine, ball: SphereObstacle, tip: FloatArray, *, touching: bool) -> float:
    """Smallest distance of tip, stem and body from the sphere and its shank, by their axes."""
    apart = ball.center - tip
    up, across = float(apart[2]), math.hypot(apart[0], apart[1])
    clear = 0.0 if touching else machine.clearance
    gaps = [math.inf if touching else float(np.linalg.norm(apart)) - 3.0 - ball.radius - clear]
    ends = machine.stylus_length, machine.stylus_length + 200.0
    nearest = min(max(up, 0.0), ends[0])
    gaps.append(
        math.hypot(across, up - nearest) - 0.5 * machine.stem_diameter - ball.radius - clear
    )
    beside = max(across - 0.5 * machine.body_diameter, 0.0)
    along = up - min(max(up, ends[0]), ends[1])
    gaps.append(math.hypot(beside, along) - ball.radius - clear)
    if ball.shank_diameter and tip[2] - 3.0 < ball.center[2]:
        gaps.append(across - 0.5 * ball.shank_diameter - 3.0 - clear)
    return min(gaps)


@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize("shank", [0.0, 8.0])
def test_a_sphere_blocks_what_its_distances_say(touching: bool, shank: float) -> None:
    """Random moves, in steps of 0.2 mm; those that 0.2 mm decide about are left out."""
    rng = np.random.default_rng(7)
    ball = SphereObstacle(np.array([1.0, 2.0, 3.0]), 12.5, shank)
    machine = replace(MACHINE, stem_diameter=3.0, clearance=0.9)
    start = rng.uniform(-40.0, 40.0, (40, 3)) - 10.0 * UP
    end = start + rng.uniform(-15.0, 15.0, (40, 3))
    # Some beside the stem alone, which is free from 12.5 + 1.5 mm and the clearance.
    beside = rng.uniform(12.8, 16.5, 10)
    start[:10] = from_angles(0.5 * np.pi, rng.uniform(0.0, 6.0, 10)) * beside[:, None] + [1, 2, -22]
    end[:10] = start[:10] + rng.uniform(-2.0, 2.0, (10, 1)) * UP
    found = (ball.blocks_touch if touching else ball.blocks)(machine, start, end)
    decided = 0
    for row in range(40):
        gap = min(
            _gap(machine, ball, start[row] + share * (end[row] - start[row]), touching=touching)
            for share in np.linspace(0.0, 1.0, 131)
        )
        if abs(gap) > 0.2:
            decided += 1
            assert found[row] == (gap < 0.0), gap
    assert decided > 30
    assert 5 < found.sum() < 35


def test_surroundings_are_all_obstacles() -> None:
    low, high = SphereObstacle(np.zeros(3), 5.0), SphereObstacle(np.array([40.0, 0, 10.0]), 8.0)
    both = Surroundings(MACHINE, (low, high))
    assert both.known
    assert both.lowest_travel == pytest.approx(10.0 + 8.0 + 3.0 + 1.0)
    points = np.array([[0.0, 0.0, 6.0], [40.0, 0.0, 21.0], [0.0, 4.0, 0.0]])
    assert both.off(points) == pytest.approx([1.0, 3.0, 1.0])
    start = np.array([[-20.0, 0.0, 0.0], [40.0, -20.0, 10.0], [0.0, 60.0, 0.0]])
    end = -start * [1.0, 1.0, 0.0] + [[0.0, 0, 0], [80.0, 0, 10.0], [0.0, 120.0, 0.0]]
    assert both.block(start, end).tolist() == [True, True, False]
    # The tip arrives at each sphere from above; beside the other one its stem is free.
    contact = np.array([[0.0, 0.0, 8.0], [40.0, 0.0, 21.0]])
    assert both.block_touch(contact + 2.0 * UP, contact).tolist() == [False, False]
    nothing = Surroundings(MACHINE)
    assert not nothing.known
    assert nothing.lowest_travel == -math.inf
    assert nothing.block(start, end).tolist() == [False] * 3
    assert low.top == 5.0
    assert "no shank below" in low.words
    assert "a vertical shank of 8 mm below" in replace(low, shank_diameter=8.0).words


@dataclass(frozen=True)
class _Wall:
    """An obstacle that blocks moves as a function says."""

    blocked: Callable[[FloatArray, FloatArray], BoolArray]
    words: str = "a wall"
    top: float = 0.0

    def off(self, points: FloatArray) -> FloatArray:
        return np.zeros(len(points))

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        del machine
        return self.blocked(start, end)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        del machine, contact
        return np.zeros(len(start), dtype=bool)


def _vertical(start: FloatArray, end: FloatArray) -> BoolArray:
    return np.asarray(np.abs(end - start)[:, 0] < 1e-9)


SIDE = Targets([[10.0, 5.0, 0.0], [10.0, 9.0, 0.0]], [[1.0, 0.0, 0.0]] * 2)
"""Their starts lie at x = 10 + 3 + 2 mm."""


class TestWays:
    @pytest.mark.parametrize(
        ("limit", "aside"), [(14.0, 0.0), (16.0, 2.0), (17.5, 5.0), (21.0, 10.0), (26.0, 20.0),
                             (36.0, 40.0)],
    )  # fmt: skip
    def test_down_beside_what_is_above_a_start(self, limit: float, aside: float) -> None:
        """Nothing goes down where x is below a limit: the first free of 0, 2, 5, 10, 20, 40 mm."""
        wall = _Wall(lambda start, end: _vertical(start, end) & (start[:, 0] < limit))
        around = Surroundings(MACHINE, (wall,))
        for row, way in enumerate(ways_down(touch_moves(SIDE, MACHINE), around)):
            y = (5.0, 9.0)[row]
            places = [[15.0 + aside, y, 50.0], [15.0 + aside, y, 0.0]][: 2 if aside else 1]
            assert way is not None
            assert way.tolist() == places

    def test_the_way_in_must_be_free_too(self) -> None:
        """From the side, moves of less than 8 mm along x are blocked: 10 mm is the first."""
        wall = _Wall(
            lambda start, end: np.where(
                _vertical(start, end), start[:, 0] < 16.0, np.abs(end - start)[:, 0] < 8.0
            )
        )
        ways = ways_down(touch_moves(SIDE, MACHINE), Surroundings(MACHINE, (wall,)))
        assert [None if way is None else way[0, 0] for way in ways] == [25.0, 25.0]

    def test_each_start_has_its_own_way_or_none(self) -> None:
        """Above y = 7 nothing is free; a normal straight up has no side to come from."""
        wall = _Wall(lambda start, end: start[:, 1] > 7.0)
        ways = ways_down(touch_moves(SIDE, MACHINE), Surroundings(MACHINE, (wall,)))
        assert [way is None for way in ways] == [False, True]
        up = Targets([[0.0, 0.0, 0.0]], UP)
        roof = Surroundings(MACHINE, (_Wall(lambda start, end: start[:, 2] > 10.0),))
        assert ways_down(touch_moves(up, MACHINE), roof) == [None]
        with pytest.raises(PretravelError, match="no free way from the safe height"):
            plan_program(up, MACHINE, title="t", obstacles=roof.obstacles)

    def test_between_starts_straight_where_that_is_free(self) -> None:
        """Four starts along y; between the second and the third a wall at y = 14; the last two are
        the same place, where there is nothing to move."""
        y = np.array([5.0, 9.0, 19.0, 19.0])
        points = np.column_stack([np.full(4, 10.0), y, np.zeros(4)])
        moves = touch_moves(Targets(points, [[1.0, 0.0, 0.0]] * 4), MACHINE)
        wall = _Wall(lambda start, end: (start[:, 1] < 14.0) == (end[:, 1] >= 14.0))
        always = _Wall(lambda start, end: np.ones(len(start), dtype=bool))
        down = [np.array([[15.0, each, 50.0]]) for each in y]
        ways = ways_between(moves, down, Surroundings(MACHINE, (wall,)))
        assert [way.tolist() for way in ways] == [
            down[0].tolist(), [], [[15.0, 9.0, 50.0], [15.0, 19.0, 50.0]], []
        ]  # fmt: skip
        ways = ways_between(moves, down, Surroundings(MACHINE, (always,)))
        assert [len(way) for way in ways] == [1, 2, 2, 0]
        unknown = ways_between(moves, down, Surroundings(MACHINE))
        assert [len(way) for way in unknown] == [1, 2, 2, 2]
        corner = [np.array([[17.0, each, 50.0], [17.0, each, 0.0]]) for each in y]
        ways = ways_between(moves, corner, Surroundings(MACHINE))
        assert ways[1].tolist() == [
            [17.0, 5.0, 0.0], [17.0, 5.0, 50.0], [17.0, 9.0, 50.0], [17.0, 9.0, 0.0]
        ]  # fmt: skip

    @pytest.mark.parametrize(
        ("targets", "obstacles", "height"),
        [
            # Starts of upward touches: 7 + 3 + 2 mm.
            (Targets([[0.0, 0.0, 7.0]], UP), (), 12.0),
            # Beside a wall the ball and the clearance above the target: 7 + 3 + 1 mm.
            (Targets([[0.0, 0.0, 7.0]], [[1.0, 0.0, 0.0]]), (), 11.0),
            # The same for the highest of two targets: 8 + 3 + 1 mm.
            (Targets([[0.0, 0.0, 8.0], [9.0, 0.0, 7.0]], [[1.0, 0.0, 0.0]] * 2), (), 12.0),
            # An obstacle of 20 mm with the ball and the clearance.
            (
                Targets([[0.0, 0.0, 7.0]], UP),
                (_Wall(lambda start, end: np.zeros(len(start), dtype=bool), top=20.0),),
                24.0,
            ),
        ],
    )
    def test_the_lowest_safe_height(
        self, targets: Targets, obstacles: tuple[_Wall, ...], height: float
    ) -> None:
        plan_program(targets, replace(MACHINE, safe_height=height), title="t", obstacles=obstacles)
        low = replace(MACHINE, safe_height=height - 1e-3)
        with pytest.raises(PretravelError, match=f"must be at {height:.3f} mm at least"):
            plan_program(targets, low, title="t", obstacles=obstacles)

    def test_the_side_to_which_a_normal_points(self) -> None:
        """Unit vectors in the plane; a normal along z points to no side."""
        found = _horizontal(np.array([[0.6, 0.0, 0.8], [0.0, -0.1, -0.9], UP[0]]))
        assert found.tolist() == [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 0.0]]

    @pytest.mark.parametrize("axis", range(3))
    @pytest.mark.parametrize("side", [0, 1])
    def test_limits_of_each_axis(self, axis: int, side: int) -> None:
        """The tip moves from z = 50 to the end of the touch, z = 3 - 2, at x = 10, y = 20; the work
        coordinates lie at (100, 200, 300)."""
        moves = touch_moves(Targets([[10.0, 20.0, 0.0]], UP), MACHINE)
        reached = np.array([[110.0, 110.0], [220.0, 220.0], [301.0, 350.0]])
        limits = reached + np.array([-5.0, 5.0])
        limits[axis, side] = reached[axis, side]
        way = [np.array([[10.0, 20.0, 50.0]])]
        inside = replace(MACHINE, work=work_placement(100, 200, 300), limits=limits)
        assert check_limits(moves, way, inside) == ""
        narrow = limits.copy()
        narrow[axis, side] += (1e-3, -1e-3)[side]
        with pytest.raises(PretravelError, match=f"1: the tip would go to {'xyz'[axis]} = "):
            check_limits(moves, way, replace(inside, limits=narrow))
        assert "no [limits]" in check_limits(moves, way, replace(inside, limits=None))
        assert "does not state the place" in check_limits(moves, way, replace(inside, work=None))


class TestProgram:
    def test_every_field(self) -> None:
        """Two targets at two feeds, each twice: way only to the first touch of a target."""
        targets = Targets([[0.0, 0.0, 0.0], [10.0, 0.0, 1.0]], UP[[0, 0]], labels=("a", "b"))
        made = plan_program(targets, MACHINE, title="plan", feeds=[50.0, 100.0], repeats=2)
        assert made.title == "plan"
        assert made.machine is MACHINE
        each = ("_f50.1", "_f50.2", "_f100.1", "_f100.2")
        assert made.labels == tuple(name + end for name in "ab" for end in each)
        assert len(made) == 8
        rows = np.repeat([0, 1], 4)
        assert np.array_equal(made.points, targets.points[rows])
        assert np.array_equal(made.normals, targets.normals[rows])
        assert np.array_equal(made.approaches, -targets.normals[rows])
        assert made.starts == pytest.approx(targets.points[rows] + 5.0 * UP)
        assert made.ends == pytest.approx(targets.points[rows] + 1.0 * UP)
        assert made.feeds.tolist() == [50.0, 50.0, 100.0, 100.0] * 2
        assert [len(way) for way in made.ways] == [1, 0, 0, 0, 2, 0, 0, 0]
        assert made.ways[4].tolist() == [[0.0, 0.0, 50.0], [10.0, 0.0, 50.0]]
        assert made.leave.tolist() == [[10.0, 0.0, 50.0]]
        assert made.left_out == ()
        assert made.checked == ()
        unchecked = " ".join(made.unchecked)
        assert "[limits]" in unchecked
        assert "the place of G54" in unchecked
        assert "its geometry was not given" in unchecked
        # 8 touches, each 2 mm there and 2 mm back; down 45 mm, and over: 45 + 10 + 44 mm.
        measuring = 4 * 2.0 / 50.0 + 4 * 2.0 / 100.0
        assert made.duration == pytest.approx(
            60.0 * (measuring + (8 * 2.0 + 45.0 + 45.0 + 10.0 + 44.0) / 1000.0)
        )

    def test_the_duration_of_ways_with_corners(self) -> None:
        """Three touches of 2 mm, there at 50, 100 and 200 mm/min, and back. Ways: from (0, 0, 50)
        45 mm down and 7 to the side; straight, 5 mm; by three corners 8 + 10 + 6 + 12 mm."""
        made = plan_program(Targets([[0.0, 0, 0]], UP), MACHINE, title="t", repeats=3)
        ways = (
            np.array([[0.0, 0.0, 50.0], [0.0, 0.0, 5.0]]), np.empty((0, 3)),
            np.array([[7.0, 5.0, 13.0], [17.0, 5.0, 13.0], [17.0, 11.0, 13.0]]),
        )  # fmt: skip
        starts = np.array([[7.0, 0.0, 5.0], [7.0, 5.0, 5.0], [17.0, 11.0, 1.0]])
        feeds = np.array([50.0, 100.0, 200.0])
        made = replace(made, ways=ways, starts=starts, feeds=feeds)
        assert isinstance(made, ProbingProgram)
        measuring = 2.0 / 50.0 + 2.0 / 100.0 + 2.0 / 200.0
        moving = (3 * 2.0 + 52.0 + 5.0 + 36.0) / 1000.0
        assert made.duration == pytest.approx(60.0 * (measuring + moving))

    def test_the_way_up_is_the_last_way_down_backwards(self) -> None:
        """The last of three targets is left by its own corner; targets have numbers for names."""
        points = [[10.0, 5.0, 0.0], [10.0, 9.0, 0.0], [10.0, 14.0, 0.0]]
        targets = Targets(points, [[1.0, 0.0, 0.0]] * 3)
        wall = _Wall(lambda start, end: _vertical(start, end) & (start[:, 0] < 16.0))
        made = plan_program(targets, MACHINE, title="t", obstacles=[wall])
        assert made.leave.tolist() == [[17.0, 14.0, 0.0], [17.0, 14.0, 50.0]]
        assert made.labels == ("1", "2", "3")
        assert made.feeds.tolist() == [50.0] * 3

    def test_all_targets_cannot_be_left_out(self) -> None:
        ball = SphereObstacle(np.zeros(3), 12.5)
        below = from_angles(np.radians([150.0, 160.0]), np.radians([0.0, 90.0]))
        with pytest.raises(PretravelError, match="cannot get there"):
            plan_program(Targets(12.5 * below, below), MACHINE, title="t", obstacles=[ball],
                         leave_out=True)  # fmt: skip

    def test_what_is_checked_is_said(self) -> None:
        ball = SphereObstacle(np.zeros(3), 12.5)
        limits = np.array([[-500.0, 500.0]] * 3)
        machine = replace(MACHINE, work=work_placement(0, 0, 0), limits=limits)
        made = plan_program(Targets(12.5 * UP, UP), machine, title="t", obstacles=[ball])
        assert made.checked == (
            "the machine's limits", "moves against the sphere with no shank below it; nothing else"
        )  # fmt: skip
        assert made.unchecked == ()
        text = linuxcnc_program(made, "a.log")
        sphere = "moves against the sphere with no shank below it, nothing else"
        for line in ("(checked: the machine's limits)", f"(checked: {sphere})"):
            assert line in text.splitlines()
        assert text.endswith("M2\n")
        assert not re.search(r"^[ \t]|\n\n\n", text, re.M)

    @pytest.mark.parametrize("repeats", [0, 1001])
    def test_numbers_of_repeats(self, repeats: int) -> None:
        one = Targets([[0.0, 0, 0]], UP)
        with pytest.raises(PretravelError, match=f"{repeats} repeats: it must lie between 1 and"):
            plan_program(one, MACHINE, title="t", repeats=repeats)
        assert len(plan_program(one, MACHINE, title="t", repeats=1000)) == 1000

    @pytest.mark.parametrize("down", [1, 2])
    def test_targets_that_face_down(self, down: int) -> None:
        """By up to 0.02 of the normal they count as horizontal."""
        side = unit([[1.0, 0.0, -0.0199], *[[1.0, 0.0, -0.0201]] * down])
        plan_program(Targets([[0.0, 0, 0]], side[:1]), MACHINE, title="t")
        targets = Targets(np.zeros((1 + down, 3)), side)
        more = r" \(so do 1 more\)" if down == 2 else ""
        with pytest.raises(PretravelError, match=rf"2.*normal points down{more}\. A path"):
            plan_program(targets, MACHINE, title="t")

    def test_targets_off_the_part(self) -> None:
        """0.1 mm at the most; the farthest is named, and how many there are."""
        ball = SphereObstacle(np.zeros(3), 12.5)
        n = from_angles(np.radians([0.0, 30.0, 60.0, 80.0]), np.zeros(4))
        off = np.array([0.099, 0.2, -0.3, 0.101])
        plan_program(Targets((12.5 + off[:1])[:, None] * n[:1], n[:1]), MACHINE, title="t",
                     obstacles=[ball])  # fmt: skip
        with pytest.raises(PretravelError, match=r"3.* is 0\.300 mm off .*\(3 targets are more"):
            plan_program(Targets((12.5 + off)[:, None] * n, n), MACHINE, title="t",
                         obstacles=[ball])  # fmt: skip

    @pytest.mark.parametrize("count", [1, 2, 10, 11])
    def test_targets_without_a_way_are_named_up_to_ten(self, count: int) -> None:
        """Steep below the sphere, beside one target that can be reached."""
        n = from_angles(
            np.radians([0.0, *[150.0] * count]), np.radians(np.arange(count + 1) * 30.0)
        )
        names = tuple(f"t{i}" for i in range(count + 1))
        targets = Targets(12.5 * n, n, labels=names)
        ball = SphereObstacle(np.zeros(3), 12.5)
        with pytest.raises(PretravelError) as told:
            plan_program(targets, MACHINE, title="t", obstacles=[ball])
        text = str(told.value)
        assert [name for name in names if f"({name})" in text] == [
            f"t{i + 1}" for i in range(min(count, 10))
        ]
        assert ("; the same for " in text) == (count > 1)
        assert ("…" in text) == (count > 10)
        kept = plan_program(
            targets, MACHINE, title="plan", feeds=[60.0, 70.0], repeats=2, obstacles=[ball],
            leave_out=True,
        )  # fmt: skip
        assert kept.left_out == names[1:]
        assert kept.labels == ("t0_f60.1", "t0_f60.2", "t0_f70.1", "t0_f70.2")
        assert kept.title == "plan"

    def test_names_of_logs(self) -> None:
        made = plan_program(Targets([[0.0, 0, 0]], UP), MACHINE, title="t")
        for name in ("a", "1", "a-b_c.d", "A.LOG"):
            assert f"(LOGOPEN,{name})" in linuxcnc_program(made, name)
        for name in ("", ".a", "é", "a b", "a%", "٣"):
            with pytest.raises(PretravelError, match=r"letters, digits and -_\. only"):
                linuxcnc_program(made, name)

    def test_a_program_stops_at_every_fault_unless_misses_are_allowed(self) -> None:
        """A miss is fault 1; the second in a row stops in any case. The turn of the work
        coordinates is compared where the machine file states it: 0.3 rad are 17.19 degrees."""
        made = plan_program(Targets([[0.0, 0, 0]], UP), MACHINE, title="t")
        allowing = "[#<_pretravel_fault> EQ 1 AND #<misses> GE 1]"
        strict = linuxcnc_program(made, "a.log")
        assert "[#<_pretravel_fault> NE 0]" in strict
        assert allowing not in strict
        assert strict != linuxcnc_program(made, "a.log", allow_misses=True)
        assert allowing in linuxcnc_program(made, "a.log", allow_misses=True)
        assert linuxcnc_program(made, "a.log", allow_misses=False) == strict
        placed = replace(MACHINE, work=work_placement(1.0, 2.0, 3.0, 0.3))
        turned = replace(made, machine=placed)
        assert "17.18873" in linuxcnc_program(turned, "a.log")
        assert "17.18873" not in strict

    def test_only_between_two_places_at_the_safe_height_the_feed_is_that_of_travel(self) -> None:
        machine = replace(MACHINE, travel_feed=3000.0)
        heights = [50.0, 50.0, 20.0, 50.0, 50.0, 50.0]
        moves = _moves(np.array([[float(i), 0.0, h] for i, h in enumerate(heights)]), machine)
        assert [move.feed for move in moves] == [1000.0, 3000.0, 1000.0, 1000.0, 3000.0, 3000.0]
        assert [move.place[0] for move in moves] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]

    def test_the_longest_line(self) -> None:
        check_line_lengths("x\n" + "y" * 250 + "\nz")
        with pytest.raises(PretravelError, match="251 characters"):
            check_line_lengths("x\n" + "y" * 251 + "\nz")
