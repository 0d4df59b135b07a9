"""Programs that touch: free ways, refusals, G-code."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_program import linuxcnc_program
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup import Lookup
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.machine import Machine, work_placement
from pretravel.controls.program import ProbingProgram, plan_program
from pretravel.controls.program_log import TOUCH_COLUMNS
from pretravel.controls.surroundings import PartObstacle, SphereObstacle
from pretravel.maps.provenance import Provenance
from pretravel.probing.inspection import InspectionRegion, plan_inspection
from pretravel.probing.targets import Targets
from pretravel.surface.cad.step_part import read_step_part
from tests.support.example_maps import mean_map
from tests.support.examples import ROOT

PART = ROOT / "examples" / "linuxcnc" / "part.step"
MACHINE = Machine()


def sphere_targets(normals: np.ndarray, radius: float = 12.5) -> Targets:
    return Targets(radius * normals, normals, labels=tuple(f"s{i}" for i in range(len(normals))))


def places(program: ProbingProgram) -> list[tuple[np.ndarray, np.ndarray]]:
    """Every straight positioning move of a program, from start to end."""
    moves = []
    at = program.ways[0][0]
    for way, start in zip(program.ways, program.starts, strict=True):
        for place in [*way, start]:
            moves.append((at, place))
            at = place
    return [*moves, *((a, b) for a, b in zip([at], program.leave[:1], strict=True))]


class TestWays:
    def test_no_move_meets_the_sphere(self) -> None:
        """By brute force: ball, stem and body on every 0.1 mm of every move."""
        normals = fibonacci_cap(60, 110.0 * DEGREE)
        machine = replace(MACHINE, stem_diameter=2.0)
        obstacle = SphereObstacle(np.zeros(3), 12.5, 6.0)
        program = plan_program(sphere_targets(normals), machine, title="s", obstacles=[obstacle])
        height = np.linspace(0.0, machine.stylus_length, 201)
        for start, end in places(program):
            count = max(int(np.linalg.norm(end - start) / 0.1), 1) + 1
            for tip in start + np.linspace(0, 1, count)[:, None] * (end - start):
                # A sphere that is displaced by up to the clearance is not met.
                assert np.linalg.norm(tip) > 12.5 + 3.0 + 0.99
                stem = np.hypot(np.hypot(*tip[:2]), tip[2] + height)
                assert stem.min() > 12.5 + 1.0 + 0.99
                if tip[2] + 3.0 < 0.0:  # beside the shank
                    assert np.hypot(*tip[:2]) > 3.0 + 3.0

    def test_straight_between_neighbours_and_over_the_top_to_the_other_side(self) -> None:
        equator = from_angles(np.pi / 2, np.array([0.0, 15.0, 195.0]) * DEGREE)
        sphere = SphereObstacle(np.zeros(3), 12.5)
        program = plan_program(sphere_targets(equator), MACHINE, title="s", obstacles=[sphere])
        assert [len(way) for way in program.ways] == [1, 0, 2]
        assert program.ways[2][:, 2].tolist() == [50.0, 50.0]
        blind = plan_program(sphere_targets(equator), MACHINE, title="s")
        assert [len(way) for way in blind.ways] == [1, 2, 2]
        assert "not given" in " ".join(blind.unchecked)

    def test_starts_and_ends_lie_on_the_approach(self) -> None:
        normal = np.array([[0.6, 0.0, 0.8]])
        approach = np.array([[0.0, 0.0, -1.0]])
        program = plan_program(Targets([[1.0, 2, 3]], normal, approach), MACHINE, title="o")
        contact = np.array([1.0, 2, 3]) + 3.0 * normal[0]
        assert program.starts[0] == pytest.approx(contact + np.array([0, 0, 2.0]))
        assert program.ends[0] == pytest.approx(contact - np.array([0, 0, 2.0]))

    def test_no_move_meets_the_part(self) -> None:
        """Against the part's own solid: a box and a ball, whose distances are closed forms."""
        part = read_step_part(str(PART))
        targets = Targets.of(
            plan_inspection(part, spacing=20.0, region=InspectionRegion(margin=4.0))
        )
        program = plan_program(
            targets, MACHINE, title="p", obstacles=[PartObstacle(part)], repeats=2
        )
        assert len(program) == 2 * len(targets)

        def clearance(point: np.ndarray) -> float:
            beyond = np.maximum(np.abs(point - [0, 0, -10]) - [40, 30, 10], 0.0)
            ball = float(np.linalg.norm(point - [20, 0, -4])) - 16.0
            return min(float(np.linalg.norm(beyond)), ball)

        for start, end in places(program):
            count = max(int(np.linalg.norm(end - start) / 0.5), 1) + 1
            for tip in start + np.linspace(0, 1, count)[:, None] * (end - start):
                assert clearance(tip) > 3.0 + 0.9
                stem = [clearance(tip + np.array([0.0, 0.0, up])) for up in (5.0, 15.0, 30.0)]
                assert min(stem) > 2.25 + 0.9

    def test_duration_counts_measuring_and_moving(self) -> None:
        one = plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]]), MACHINE, title="o")
        # 2 mm at 50 mm/min, 45 mm down and 2 mm back at 1000 mm/min.
        assert one.duration == pytest.approx(60 * (2 / 50 + 47 / 1000))
        # A second touch 10 mm beside it: 45 mm up, 10 mm over, 45 mm down, and its 2 mm back.
        two = plan_program(
            Targets([[0.0, 0, 0], [10, 0, 0]], [[0.0, 0, 1]] * 2), MACHINE, title="t"
        )
        assert two.duration == pytest.approx(60 * (4 / 50 + (47 + 102) / 1000))

    def test_the_body_above_the_stylus_meets_a_part_beside_it(self, tmp_path: Path) -> None:
        """A beam 12 mm beside the tip's axis, outside the stem (radius 10 mm) and inside the body
        (radius 20 mm), which reaches from 50 mm to 250 mm above the ball's centre; its end is taken
        for round, 16 mm higher at 12 mm from the axis."""
        from netgen.occ import Box

        start, end = np.array([[0.0, -3.0, 0.0]]), np.array([[0.0, 3.0, 0.0]])
        thick = replace(MACHINE, tip_diameter=22.0, stem_diameter=20.0)
        heights = {45.0: False, 150.0: True, 240.0: True, 270.0: False}
        for height, blocked in heights.items():
            file = tmp_path / f"beam{height:g}.step"
            Box((12, -20, height), (16, 20, height + 1)).WriteStep(str(file))
            beam = PartObstacle(read_step_part(str(file)))
            assert beam.blocks(thick, start, end).tolist() == [blocked], height

    @pytest.mark.parametrize(
        ("across", "height", "shank", "blocked"),
        [
            # Ball of 3 mm, clearance 1 mm, sphere of 12.5 mm: 16.5 mm from centre to centre.
            (16.4, 0.0, 0.0, True),
            (16.6, 0.0, 0.0, False),
            # The stem of 2 mm radius, 50 mm long, begins at the ball's centre: 15.5 mm.
            (15.4, -30.0, 0.0, True),
            (15.6, -30.0, 0.0, False),
            # The body of 20 mm radius, 50 to 250 mm above the ball's centre: 33.5 mm.
            (33.4, -60.0, 0.0, True),
            (33.6, -60.0, 0.0, False),
            (0.0, -62.0 + 50.0 - 240.0, 0.0, True),
            (21.0, -264.0, 0.0, False),
            # A shank of 8 mm below the centre: 4 + 3 + 1 mm.
            (7.9, -100.0, 8.0, True),
            (60.0, -20.0, 8.0, False),
        ],
    )
    def test_a_sphere_blocks_what_comes_near(
        self, across: float, height: float, shank: float, blocked: bool
    ) -> None:
        """The tip moves past it, `across` beside its axis and `height` above its centre."""
        machine = replace(
            MACHINE, tip_diameter=6.0, stem_diameter=4.0, stylus_length=50.0, body_diameter=40.0,
            clearance=1.0,
        )  # fmt: skip
        ball = SphereObstacle(np.array([1.0, 2.0, 3.0]), 12.5, shank)
        middle = np.array([[1.0 + across, 2.0, 3.0 + height]])
        way = np.array([[0.0, 4.0, 0.0]])
        assert ball.blocks(machine, middle - way, middle + way).tolist() == [blocked]

    def test_every_side_of_a_part_blocks_the_stem(self, tmp_path: Path) -> None:
        """The ball passes below a block, and its stem runs into each of the four sides."""
        from netgen.occ import Box

        file = tmp_path / "block.step"
        Box((-5, -5, 20), (5, 5, 30)).WriteStep(str(file))
        block = PartObstacle(read_step_part(str(file)))
        for way in np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]]):
            start, far, near = -20.0 * way[None], -11.0 * way[None], -6.0 * way[None]
            assert block.blocks(MACHINE, start, far).tolist() == [False]
            assert block.blocks(MACHINE, start, near).tolist() == [True]


class TestRefusals:
    @pytest.mark.parametrize(
        ("machine", "targets", "words"),
        [
            (replace(MACHINE, safe_height=12.0), fibonacci_cap(5), "must be at 16.500 mm at least"),
            # 60° below the equator the stem would pass through the sphere.
            (MACHINE, from_angles(150 * DEGREE, 0.0), "s0.*stem or body of the"),
            (replace(MACHINE, stylus_length=10.0), from_angles(np.pi / 2, 0.0), "stem or body"),
        ],
    )
    def test_what_cannot_be_reached(
        self, machine: Machine, targets: np.ndarray, words: str
    ) -> None:
        with pytest.raises(PretravelError, match=words):
            plan_program(
                sphere_targets(targets), machine, title="s",
                obstacles=[SphereObstacle(np.zeros(3), 12.5)],
            )  # fmt: skip

    def test_the_reason_is_the_way_or_the_touch(self) -> None:
        """The stem's axis is (12.5 + 3 + s) sin from that of the sphere, s mm before the contact,
        and must be 12.5 + 2.25 from it, 1 mm more on the way. 112 degrees: 16.23 mm at the start,
        2 mm before the contact, is more than 15.75, but 14.37 mm at the contact is less than 14.75.
        150 degrees: 8.75 mm at the start is already too little."""
        reasons = {112.0: "before the target is touched", 150.0: "no free way from the safe height"}
        for polar, reason in reasons.items():
            with pytest.raises(PretravelError, match=reason):
                plan_program(
                    sphere_targets(from_angles(polar * DEGREE, 0.0)), MACHINE, title="s",
                    obstacles=[SphereObstacle(np.zeros(3), 12.5)],
                )  # fmt: skip

    def test_shank_in_the_way(self) -> None:
        low = sphere_targets(from_angles(115 * DEGREE, 0.0))
        machine = replace(MACHINE, stem_diameter=1.0)
        plan_program(low, machine, title="s", obstacles=[SphereObstacle(np.zeros(3), 12.5, 4.0)])
        with pytest.raises(PretravelError, match="s0"):
            plan_program(
                low, machine, title="s", obstacles=[SphereObstacle(np.zeros(3), 12.5, 24.0)]
            )

    def test_limits_in_turned_work_coordinates(self) -> None:
        targets = Targets([[30.0, 0, 0]], [[0.0, 0, 1]], labels=("far",))
        limits = np.array([[-50.0, 50.0], [-20.0, 20.0], [-100.0, 100.0]])
        machine = replace(MACHINE, work=work_placement(0, 0, 0), limits=limits)
        assert "the machine's limits" in plan_program(targets, machine, title="t").checked
        turned = replace(machine, work=work_placement(0, 0, 0, 90 * DEGREE))
        with pytest.raises(PretravelError, match=r"far\): the tip would go to y = 30\.000"):
            plan_program(targets, turned, title="t")
        lost = plan_program(targets, replace(machine, work=None), title="t")
        assert "does not state the place" in lost.unchecked[0]

    @pytest.mark.parametrize("label", ["", "a b", "a)b", "a#1", "a,b", "ä", "x" * 41, "é²"])
    def test_labels_that_would_break_a_log(self, label: str) -> None:
        with pytest.raises(PretravelError, match="its label"):
            plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]], labels=(label,)), MACHINE, title="t")

    def test_labels_twice(self) -> None:
        twice = Targets([[0.0, 0, 0]] * 2, [[0.0, 0, 1]] * 2, labels=("a", "a"))
        with pytest.raises(PretravelError, match="two targets are called 'a'"):
            plan_program(twice, MACHINE, title="t")

    def test_a_feed_from_which_the_machine_cannot_stop(self) -> None:
        """At 50 mm/s² 1898 mm/min need more than 10 mm; the feeds of a program replace the own."""
        slow = replace(MACHINE, acceleration=50.0, positioning_feed=900.0, travel_feed=0.0)
        one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]])
        plan_program(one, slow, title="t", feeds=[1897.0])
        with pytest.raises(PretravelError, match="measuring feed 1898 mm/min: after a contact"):
            plan_program(one, slow, title="t", feeds=[50.0, 1898.0])


class TestTargetsAndParts:
    def test_off_the_part(self) -> None:
        part = PartObstacle(read_step_part(str(PART)))
        far = Targets([[0.0, 0, 0], [0, 0, 9.0]], [[0.0, 0, 1]] * 2, labels=("on", "far"))
        with pytest.raises(PretravelError, match=r"far\) is .* off the surface"):
            plan_program(far, MACHINE, title="p", obstacles=[part])

    def test_downward_targets_want_the_part(self) -> None:
        below = Targets([[0.0, 0, -20]], [[0.0, 0, -1]], labels=("below",))
        with pytest.raises(PretravelError, match=r"below\): its normal points down"):
            plan_program(below, MACHINE, title="p")

    def test_left_out_by_name(self) -> None:
        part = PartObstacle(read_step_part(str(PART)))
        both = Targets([[-30.0, 0, 0], [0, 0, -20]], [[0.0, 0, 1], [0, 0, -1]], labels=("a", "b"))
        program = plan_program(both, MACHINE, title="p", obstacles=[part], leave_out=True)
        assert program.labels == ("a",)
        assert program.left_out == ("b",)
        alone = Targets([[-30.0, 0, 0]], [[0.0, 0, 1]], labels=("a",))
        assert program.checked == plan_program(alone, MACHINE, title="p", obstacles=[part]).checked
        with pytest.raises(PretravelError, match=r"b\) .*cannot get there.*Leave these"):
            plan_program(both, MACHINE, title="p", obstacles=[part])

    @pytest.mark.parametrize("feed", [0.0, -1.0, 99999.0, float("nan"), float("inf")])
    def test_feeds_that_the_machine_cannot_use(self, feed: float) -> None:
        one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]])
        with pytest.raises(PretravelError, match="measuring feed"):
            plan_program(one, MACHINE, title="p", feeds=[50, feed])

    def test_a_map_of_another_tip_or_feed(self) -> None:
        one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]])
        program = plan_program(one, MACHINE, title="p", feeds=[50, 60])
        with pytest.raises(PretravelError, match=r"tip of 4\.000 mm .* has one of 6\.000 mm"):
            linuxcnc_program(program, "a.log", compensated=mean_map(0.016, tip_radius=2.0))
        with pytest.raises(PretravelError, match=r"made at 50 mm/min, but .* measures at 60"):
            linuxcnc_program(program, "a.log", compensated=replace(mean_map(0.016), feed=50.0))
        known = replace(mean_map(0.016), feed=50.0, delay=0.003)
        assert "o<pretravel_identity> call" in linuxcnc_program(program, "a.log", compensated=known)

    def test_a_feed_twice(self) -> None:
        one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]])
        with pytest.raises(PretravelError, match="a feed occurs twice"):
            plan_program(one, MACHINE, title="p", feeds=[50, 50])


@cache
def _mean_form() -> Lookup:
    form = exact_lookup(mean_map(0.016))
    assert form is not None
    return form


class TestText:
    def test_lines_fit_and_logs_are_whole(self) -> None:
        far = Targets([[-1234.123456789, 5.0, -3.0]], [[0.36, 0.48, 0.8]], labels=("x" * 40,))
        program = plan_program(
            far, replace(MACHINE, safe_height=999.0), title="a (b) #1; ä", feeds=[50, 200],
            repeats=2,
        )  # fmt: skip
        text = linuxcnc_program(program, "a.log", compensated=mean_map(0.016), allow_misses=True)
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
            "mill\nM3 S20000\nG0 Z-80\n",
            "mill\r\nG0 Z-80",
            "mill) G0 Z-80 (",
            "mill)\nG0 Z-80\n(",
            "mill\x0bG0 Z-80\x0c\x85\u2028G0 Z-80",
            "LOGOPEN,other.log",
            "PROBEOPEN other.txt",
            "mill #<_value> %",
            "; G0 Z-80",
        ],
    )
    def test_text_from_outside_adds_no_move(self, text: str) -> None:
        """Names of machines, plans and sources of maps; the same lines run whatever they are."""

        def lines(name: str) -> list[str]:
            one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]], labels=("top",))
            program = plan_program(one, replace(MACHINE, name=name), title=name)
            pretravel_map = replace(mean_map(0.016), provenance=Provenance(source=name))
            texts = [
                linuxcnc_program(program, "a.log", compensated=pretravel_map),
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
            plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]], labels=(text,)), MACHINE, title="t")
        with pytest.raises(PretravelError, match="log file"):
            linuxcnc_program(
                plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]]), MACHINE, title="t"), text
            )

    @pytest.mark.parametrize("length", [300, 1000])
    def test_a_line_that_the_control_would_refuse(self, length: int) -> None:
        one = Targets([[0.0, 0, 0]], [[0.0, 0, 1]])
        with pytest.raises(PretravelError, match="too long for the control"):
            linuxcnc_program(plan_program(one, MACHINE, title="t" * length), "a.log")

    def test_tool_and_work_offset(self) -> None:
        """The order: up, tool change, length, offset; only then the log and the first move."""
        machine = replace(
            MACHINE, tool=99, tool_length=80.5, change_height=-2.0, work_offset="G59.1"
        )
        program = plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]]), machine, title="t")
        lines = linuxcnc_program(program, "a.log").splitlines()
        order = [
            "M5 M9", "o<pretravel_keep> call [1]", "G59.1", "G53 G0 Z-2", "T99 M6",
            "#<length> = [#<_z>-#<with_z>]", "G43", "(LOGOPEN,a.log)",
            "o<pretravel_move> call [0] [0] [#<_z>] [1000]", "o<pretravel_restore> call", "M2",
        ]  # fmt: skip
        # A line that occurs again and again: the last one counts.
        where = [len(lines) - 1 - lines[::-1].index(line) for line in order]
        assert where == sorted(where)
        asked = replace(machine, change_height=None)
        program = plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]]), asked, title="t")
        assert "T99 M6\n" not in linuxcnc_program(program, "a.log")

    @pytest.mark.parametrize(
        "log", ["", "a b.log", "a).log", "a#.log", "logs/a.log", "/a.log", ".."]
    )
    def test_log_names(self, log: str) -> None:
        program = plan_program(Targets([[0.0, 0, 0]], [[0.0, 0, 1]]), MACHINE, title="t")
        with pytest.raises(PretravelError, match="log file"):
            linuxcnc_program(program, log)
