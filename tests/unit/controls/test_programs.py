"""Programs that touch: free ways, order and duration of touches, refusals, G-code."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from pretravel.base.arrays import BoolArray, FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_programs import check_line_lengths, linuxcnc_program
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup import Lookup
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.program import ProbingProgram, plan_program
from pretravel.controls.program_log import TOUCH_COLUMNS
from pretravel.controls.surroundings import SphereObstacle, Surroundings
from pretravel.controls.ways import check_limits, touch_moves, ways_between, ways_down
from pretravel.files.machine import Machine, work_placement
from pretravel.maps.provenance import Provenance
from pretravel.touches.targets import Targets
from tests.support.example_maps import mean_map

MACHINE = Machine()
UP = np.array([[0.0, 0.0, 1.0]])
ONE = Targets([[0.0, 0, 0]], UP)
BALL = SphereObstacle(np.zeros(3), 12.5)


def _planned(targets: Targets = ONE, machine: Machine = MACHINE, **others: Any) -> ProbingProgram:
    return plan_program(targets, machine, **({"title": "t"} | others))


def _on_ball(normals: FloatArray) -> Targets:
    return Targets(12.5 * normals, normals, labels=tuple(f"s{i}" for i in range(len(normals))))


@dataclass(frozen=True)
class _Wall:
    """An obstacle that blocks moves as a function says."""

    blocked: Callable[[FloatArray, FloatArray], BoolArray]
    words: str = "a wall"
    top: float = 0.0

    def off(self, points: FloatArray) -> FloatArray:
        return np.zeros(len(points))

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        return self.blocked(start, end)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        return np.zeros(len(start), dtype=bool)


def _vertical(start: FloatArray, end: FloatArray) -> BoolArray:
    return np.asarray(np.abs(end - start)[:, 0] < 1e-9)


SIDE = Targets([[10.0, 5.0, 0.0], [10.0, 9.0, 0.0]], [[1.0, 0.0, 0.0]] * 2)
"""Their starts lie at x = 10 + 3 + 2 mm."""


def _places(program: ProbingProgram) -> list[tuple[FloatArray, FloatArray]]:
    """Every straight positioning move of a program, from start to end."""
    moves = []
    at = program.ways[0][0]
    for way, start in zip(program.ways, program.starts, strict=True):
        for place in [*way, start]:
            moves.append((at, place))
            at = place
    return [*moves, (at, program.leave[0])]


class TestWays:
    def test_no_move_meets_the_sphere(self) -> None:
        """By brute force: ball and stem on every 0.1 mm of every move. Programs on a part are
        judged in tests/laws/test_program_safety.py."""
        machine = replace(MACHINE, stem_diameter=2.0)
        ball = replace(BALL, shank_diameter=6.0)
        targets = _on_ball(fibonacci_cap(40, 110.0 * DEGREE))
        height = np.linspace(0.0, machine.stylus_length, 201)
        for start, end in _places(_planned(targets, machine, obstacles=[ball])):
            count = max(int(np.linalg.norm(end - start) / 0.1), 1) + 1
            tip = start + np.linspace(0, 1, count)[:, None] * (end - start)
            # A sphere that is displaced by up to the clearance is not met.
            assert np.linalg.norm(tip, axis=1).min() > 12.5 + 3.0 + 0.99
            across = np.hypot(tip[:, 0], tip[:, 1])
            assert np.hypot(across[:, None], tip[:, 2:] + height).min() > 12.5 + 1.0 + 0.99
            assert np.all(across[tip[:, 2] + 3.0 < 0.0] > 3.0 + 3.0)  # beside the shank

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
        """Above y = 7 nothing is free; normals straight up or down have no side to come from."""
        wall = _Wall(lambda start, end: start[:, 1] > 7.0)
        ways = ways_down(touch_moves(SIDE, MACHINE), Surroundings(MACHINE, (wall,)))
        assert [way is None for way in ways] == [False, True]
        vertical = Targets([[0.0, 0.0, 0.0]] * 2, [[0.0, 0.0, 1.0], [9e-4, 0.0, -1.0]])
        roof = Surroundings(MACHINE, (_Wall(lambda start, end: start[:, 0] < 1.0),))
        assert ways_down(touch_moves(vertical, MACHINE), roof) == [None, None]

    def test_the_way_in_is_from_the_side_to_which_a_normal_points(self) -> None:
        """Of a normal of (0, -0.6, -0.8): 3 and 2 mm along it, and 2 mm along -y."""
        wall = _Wall(lambda start, end: _vertical(start, end) & (start[:, 1] > -3.1))
        down = touch_moves(Targets([[0.0, 0.0, 0.0]], [[0.0, -0.6, -0.8]]), MACHINE)
        (way,) = ways_down(down, Surroundings(MACHINE, (wall,)))
        assert way == pytest.approx(np.array([[0.0, -5.0, 50.0], [0.0, -5.0, -4.0]]))

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
        _planned(targets, replace(MACHINE, safe_height=height), obstacles=obstacles)
        low = replace(MACHINE, safe_height=height - 1e-3)
        with pytest.raises(PretravelError, match=f"must be at {height:.3f} mm at least"):
            _planned(targets, low, obstacles=obstacles)

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
        assert "does not give the place" in check_limits(moves, way, replace(inside, work=None))


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
        assert "the origin of G54" in unchecked
        assert "its geometry was not given" in unchecked
        # 8 touches, each 2 mm there and 2 mm back; down 45 mm, and over: 45 + 10 + 44 mm.
        measuring = 4 * 2.0 / 50.0 + 4 * 2.0 / 100.0
        assert made.duration == pytest.approx(
            60.0 * (measuring + (8 * 2.0 + 45.0 + 45.0 + 10.0 + 44.0) / 1000.0)
        )

    def test_starts_and_ends_lie_on_the_approach(self) -> None:
        made = _planned(Targets([[1.0, 2, 3]], [[0.6, 0.0, 0.8]], -UP))
        contact = np.array([1.0, 2, 3]) + 3.0 * np.array([0.6, 0.0, 0.8])
        assert made.starts[0] == pytest.approx(contact + 2.0 * UP[0])
        assert made.ends[0] == pytest.approx(contact - 2.0 * UP[0])

    def test_the_duration_of_ways_with_corners(self) -> None:
        """Three touches of 2 mm, there at 50, 100 and 200 mm/min, and back. Ways: from (0, 0, 50)
        45 mm down and 7 to the side; straight, 5 mm; by three corners 8 + 10 + 6 + 12 mm."""
        made = _planned(repeats=3)
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
        wall = _Wall(lambda start, end: _vertical(start, end) & (start[:, 0] < 16.0))
        made = _planned(Targets(points, [[1.0, 0.0, 0.0]] * 3), obstacles=[wall])
        assert made.leave.tolist() == [[17.0, 14.0, 0.0], [17.0, 14.0, 50.0]]
        assert made.labels == ("1", "2", "3")

    def test_what_is_checked_is_said(self) -> None:
        limits = np.array([[-500.0, 500.0]] * 3)
        machine = replace(MACHINE, work=work_placement(0, 0, 0), limits=limits)
        made = _planned(Targets(12.5 * UP, UP), machine, obstacles=[BALL])
        sphere = (
            "the moves do not hit the sphere. Its shank was not given, and is not checked. "
            "Other obstacles are not checked"
        )
        assert made.checked == ("the machine's limits", sphere)
        assert made.unchecked == ()
        text = linuxcnc_program(made, "a_log.ngc")
        for line in ("the machine's limits", sphere):
            assert f"(checked: {line})" in text.splitlines()
        assert text.endswith("M2\n")
        assert not re.search(r"^[ \t]|\n\n\n", text, re.M)


class TestRefusals:
    @pytest.mark.parametrize(
        ("numbers", "words"),
        [
            ({"repeats": 0}, "0 repeats: it must lie between 1 and"),
            ({"repeats": 1001}, "1001 repeats: it must lie between 1 and"),
            ({"feeds": [50, 0.0]}, "measuring feed"), ({"feeds": [np.nan]}, "measuring feed"),
            ({"feeds": [50, 99999.0]}, "measuring feed"),
            ({"feeds": [50, 50]}, "a feed occurs twice"),
            # At 50 mm/s² it needs more than 10 mm to stop; these feeds replace the machine's own.
            ({"feeds": [50.0, 1338.0]}, "measuring feed 1338 mm/min: after a contact"),
        ],
    )  # fmt: skip
    def test_numbers_of_touches(self, numbers: dict[str, Any], words: str) -> None:
        slow = replace(MACHINE, acceleration=50.0, positioning_feed=600.0, travel_feed=0.0)
        assert len(_planned(machine=slow, feeds=[1337.0], repeats=1000)) == 1000
        with pytest.raises(PretravelError, match=words):
            _planned(machine=slow, **numbers)

    @pytest.mark.parametrize(
        ("polar", "changes", "shank", "words"),
        [
            # The stem's axis is (12.5 + 3 + s) sin from that of the sphere, s mm before the
            # contact, and must be 12.5 + 2.25 from it, 1 mm more on the way. 16.23 mm at the start,
            # 2 mm before the contact, is more than 15.75, 14.37 mm at the contact less than 14.75.
            (112.0, {}, 0.0, "s0.*before the target is touched"),
            # 8.75 mm at the start is already too little.
            (150.0, {}, 0.0, "s0.*stem or body of the.*no free way from the safe height"),
            (90.0, {"stylus_length": 12.0}, 0.0, "stem or body"),
            (115.0, {"stem_diameter": 1.0}, 4.0, ""), (115.0, {"stem_diameter": 1.0}, 24.0, "s0"),
        ],
    )  # fmt: skip
    def test_what_cannot_be_reached(
        self, polar: float, changes: dict[str, float], shank: float, words: str
    ) -> None:
        machine, ball = replace(MACHINE, **changes), replace(BALL, shank_diameter=shank)
        targets = _on_ball(from_angles(np.array([polar]) * DEGREE, np.zeros(1)))
        if not words:
            assert _planned(targets, machine, obstacles=[ball]).labels == ("s0",)
            return
        for leave_out in (False, True):  # all targets cannot be left out
            with pytest.raises(PretravelError, match=words):
                _planned(targets, machine, obstacles=[ball], leave_out=leave_out)

    @pytest.mark.parametrize("count", [1, 2, 10, 11])
    def test_targets_without_a_way_are_named_up_to_ten(self, count: int) -> None:
        """Steep below the sphere, beside one target that can be reached."""
        n = from_angles(
            np.radians([0.0, *[150.0] * count]), np.radians(np.arange(count + 1) * 30.0)
        )
        names = tuple(f"t{i}" for i in range(count + 1))
        targets = Targets(12.5 * n, n, labels=names)
        with pytest.raises(PretravelError) as told:
            _planned(targets, obstacles=[BALL])
        text = str(told.value)
        assert [name for name in names if f"({name})" in text] == [
            f"t{i + 1}" for i in range(min(count, 10))
        ]
        assert ("; the same for " in text) == (count > 1)
        assert ("…" in text) == (count > 10)
        kept = plan_program(
            targets, MACHINE, title="plan", feeds=[60.0, 70.0], repeats=2, obstacles=[BALL],
            leave_out=True,
        )  # fmt: skip
        assert kept.left_out == names[1:]
        assert kept.labels == ("t0_f60.1", "t0_f60.2", "t0_f70.1", "t0_f70.2")
        assert kept.title == "plan"

    def test_targets_off_the_part(self) -> None:
        """0.1 mm at the most; the farthest is named, and how many there are."""
        n = from_angles(np.radians([0.0, 30.0, 60.0, 80.0]), np.zeros(4))
        off = np.array([0.099, 0.2, -0.3, 0.101])
        _planned(Targets((12.5 + off[:1])[:, None] * n[:1], n[:1]), obstacles=[BALL])
        with pytest.raises(PretravelError, match=r"3.* is 0\.300 mm off .*\(3 targets are more"):
            _planned(Targets((12.5 + off)[:, None] * n, n), obstacles=[BALL])

    @pytest.mark.parametrize("down", [1, 2])
    def test_targets_that_face_down(self, down: int) -> None:
        """By up to 0.02 of the normal they count as horizontal."""
        side = unit([[1.0, 0.0, -0.0199], *[[1.0, 0.0, -0.0201]] * down])
        _planned(Targets([[0.0, 0, 0]], side[:1]))
        targets = Targets(np.zeros((1 + down, 3)), side)
        more = r" \(so do 1 more\)" if down == 2 else ""
        with pytest.raises(PretravelError, match=rf"2.*normal points down{more}\. A path"):
            _planned(targets)

    def test_limits_in_turned_work_coordinates(self) -> None:
        targets = Targets([[30.0, 0, 0]], UP, labels=("far",))
        limits = np.array([[-50.0, 50.0], [-20.0, 20.0], [-100.0, 100.0]])
        machine = replace(MACHINE, work=work_placement(0, 0, 0), limits=limits)
        assert "the machine's limits" in _planned(targets, machine).checked
        turned = replace(machine, work=work_placement(0, 0, 0, 90 * DEGREE))
        with pytest.raises(PretravelError, match=r"far\): the tip would go to y = 30\.000"):
            _planned(targets, turned)
        lost = _planned(targets, replace(machine, work=None))
        assert "does not give the place" in lost.unchecked[0]

    @pytest.mark.parametrize("label", ["", "a b", "a)b", "a#1", "a,b", "ä", "x" * 41, "é²"])
    def test_labels_that_would_break_a_log(self, label: str) -> None:
        with pytest.raises(PretravelError, match="its label"):
            _planned(Targets([[0.0, 0, 0]], UP, labels=(label,)))
        with pytest.raises(PretravelError, match="two targets are called 'a'"):
            _planned(Targets([[0.0, 0, 0]] * 2, UP[[0, 0]], labels=("a", "a")))

    def test_a_map_of_another_tip_or_feed(self) -> None:
        program = _planned(feeds=[50, 60])
        with pytest.raises(PretravelError, match=r"tip of 4\.000 mm .* has one of 6\.000 mm"):
            linuxcnc_program(program, "a_log.ngc", compensated=mean_map(0.016, tip_radius=2.0))
        with pytest.raises(PretravelError, match=r"made at 50 mm/min, but .* measures at 60"):
            linuxcnc_program(program, "a_log.ngc", compensated=replace(mean_map(0.016), feed=50.0))
        known = replace(mean_map(0.016), feed=50.0, delay=0.003)
        assert "o<pretravel_identity> call" in linuxcnc_program(
            program, "a_log.ngc", compensated=known
        )

    def test_a_map_of_another_orientation(self) -> None:
        program = _planned(feeds=[50])
        made_at = Provenance(spindle_deg=350.0)
        turned = replace(mean_map(0.016), provenance=made_at)
        with pytest.raises(PretravelError, match=r"spindle at 350°, and .* turns it to 90°"):
            linuxcnc_program(program, "a_log.ngc", compensated=turned, spindle=0.5 * np.pi)
        for same in (-10.0, 350.5):
            text = linuxcnc_program(program, "a_log.ngc", compensated=turned, spindle=same * DEGREE)
            assert "M19" in text


@cache
def _mean_form() -> Lookup:
    form = exact_lookup(mean_map(0.016))
    assert form is not None
    return form


class TestText:
    def test_lines_fit_and_logs_are_whole(self) -> None:
        far = Targets([[-1234.123456789, 5.0, -3.0]], [[0.36, 0.48, 0.8]], labels=("x" * 40,))
        machine = replace(MACHINE, safe_height=999.0)
        program = _planned(far, machine, title="a (b) #1; ä", feeds=[50, 200], repeats=2)
        text = linuxcnc_program(
            program, "a_log.ngc", compensated=mean_map(0.016), allow_misses=True
        )
        assert max(map(len, text.splitlines())) <= 250
        assert text.isascii()
        logs = [line for line in text.splitlines() if line.startswith("(LOG,%.4ftouch")]
        assert len(logs) == 4
        assert program.labels[0] == "x" * 40 + "_f50.1"
        for line in logs:
            assert line.endswith(",end)")
            assert line.count(",") == len(TOUCH_COLUMNS) + 2
        assert "a _b_ _1_ _" in text.splitlines()[0]

    @pytest.mark.parametrize(
        "text",
        [
            "mill\nM3 S20000\nG0 Z-80\n", "mill\r\nG0 Z-80", "mill) G0 Z-80 (", "mill)\nG0 Z-80\n(",
            "mill\x0bG0 Z-80\x0c\x85\u2028G0 Z-80", "LOGOPEN,other.log", "PROBEOPEN other.txt",
            "mill #<_value> %", "; G0 Z-80",
        ],
    )  # fmt: skip
    def test_text_from_outside_adds_no_move(self, text: str) -> None:
        """Names of machines, plans and sources of maps; the same lines run whatever they are."""

        def lines(name: str) -> list[str]:
            program = _planned(machine=replace(MACHINE, name=name), title=name)
            pretravel_map = replace(mean_map(0.016), provenance=Provenance(source=name))
            texts = [
                linuxcnc_program(program, "a_log.ngc", compensated=pretravel_map),
                *linuxcnc_subroutines(pretravel_map, _mean_form()).values(),
            ]
            return [line for whole in texts for line in whole.splitlines()]

        hostile, usual = lines(text), lines("usual")
        assert len(hostile) == len(usual)
        different = [pair for pair in zip(hostile, usual, strict=True) if pair[0] != pair[1]]
        assert different
        for line, same in different:
            # The text is within one comment, and after its first word: no comment becomes active.
            head, _, tail = same.partition("usual")
            assert re.match(r"\((program|for|pretravel:|LOG,) ?", head)
            assert line.startswith(head)
            assert line.endswith(tail)
            assert re.fullmatch(r"[A-Za-z0-9 _.-]*", line[len(head) : len(line) - len(tail)])
        with pytest.raises(PretravelError, match="its label"):
            _planned(Targets([[0.0, 0, 0]], UP, labels=(text,)))
        with pytest.raises(PretravelError, match="log file"):
            linuxcnc_program(_planned(), text)

    def test_the_longest_line(self) -> None:
        check_line_lengths("x\n" + "y" * 250 + "\nz")
        with pytest.raises(PretravelError, match="251 characters"):
            check_line_lengths("x\n" + "y" * 251 + "\nz")
        with pytest.raises(PretravelError, match="too long for the control"):
            linuxcnc_program(_planned(title="t" * 300), "a_log.ngc")

    def test_tool_and_work_offset(self) -> None:
        """The order: up, tool change, length, offset; only then the log and the first move."""
        machine = replace(
            MACHINE, tool=99, tool_length=80.5, change_height=-2.0, work_offset="G59.1"
        )
        lines = linuxcnc_program(_planned(machine=machine), "a_log.ngc").splitlines()
        order = [
            "o<pretravel_keep> call [1]", "M5 M9", "G59.1", "G53 G0 Z-2", "T99 M6",
            "#<length> = [#<_z>-#<with_z>]", "G43", "(LOGOPEN,a_log.ngc)",
            "o<pretravel_move> call [0] [0] [#<_z>] [1000]", "o<pretravel_restore> call", "M2",
        ]  # fmt: skip
        # A line that occurs again and again: the last one counts.
        where = [len(lines) - 1 - lines[::-1].index(line) for line in order]
        assert where == sorted(where)
        asked = _planned(machine=replace(machine, change_height=None))
        assert "T99 M6\n" not in linuxcnc_program(asked, "a_log.ngc")

    def test_names_of_logs(self) -> None:
        made = _planned()
        for name in ("a_log.ngc", "1_log.ngc", "a-b_c_log.ngc", "_log.ngc"):
            assert f"(LOGOPEN,{name})" in linuxcnc_program(made, name)
        # LinuxCNC makes names of subroutines small, and would erase files of its own.
        bad = ["", "a.log", "A_log.ngc", "é_log.ngc", "a b_log.ngc", "a%_log.ngc", "٣_log.ngc"]
        for name in [*bad, "machine.ini", "tool.tbl", "linuxcnc.var", "../a_log.ngc", "sphere.ngc"]:
            with pytest.raises(PretravelError, match=r"ends with _log\.ngc.*reads the log back"):
                linuxcnc_program(made, name)

    def test_a_program_stops_at_every_fault_unless_misses_are_allowed(self) -> None:
        """A miss is fault 1; the second in a row stops in any case. The turn of the work
        coordinates is compared where the machine file states it: 0.3 rad are 17.19 degrees."""
        made = _planned()
        allowing = "[#<_pretravel_fault> EQ 1 AND #<misses> GE 1]"
        strict = linuxcnc_program(made, "a_log.ngc")
        assert "[#<_pretravel_fault> NE 0]" in strict
        assert allowing not in strict
        assert strict != linuxcnc_program(made, "a_log.ngc", allow_misses=True)
        assert allowing in linuxcnc_program(made, "a_log.ngc", allow_misses=True)
        assert linuxcnc_program(made, "a_log.ngc", allow_misses=False) == strict
        placed = replace(MACHINE, work=work_placement(1.0, 2.0, 3.0, 0.3))
        turned = replace(made, machine=placed)
        assert "17.18873" in linuxcnc_program(turned, "a_log.ngc")
        assert "17.18873" not in strict

    def test_only_between_two_places_at_the_safe_height_the_feed_is_that_of_travel(self) -> None:
        heights = [50.0, 50.0, 20.0, 50.0, 50.0, 50.0]
        way = np.array([[7.0 + i, 0.0, h] for i, h in enumerate(heights)])
        made = _planned(machine=replace(MACHINE, travel_feed=2000.0), repeats=2)
        made = replace(made, ways=(made.ways[0], way))
        moves = re.findall(
            r"o<pretravel_move> call \[(\d+)\] \[0\] \[\d+\] \[(\d+)\]",
            linuxcnc_program(made, "a_log.ngc"),
        )
        found = [(int(x), int(feed)) for x, feed in moves if int(x) >= 7]
        feeds = [1000, 2000, 1000, 1000, 2000, 2000]
        assert found == [(7 + i, feed) for i, feed in enumerate(feeds)]
