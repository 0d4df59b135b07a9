"""Our programs on the model of a machine, with every fault of the probe at every touch.

The model and the laws are in `tests/support/machine_model`; they know nothing of the templates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from pretravel.base.directions import from_angles
from pretravel.base.units import DEGREE
from tests.support.judged_programs import (
    MACHINE,
    PRETRAVEL,
    TOOL_LENGTH,
    Judged,
    called_points,
    moved,
    part_program,
    sphere_program,
    touches_on_sphere,
)
from tests.support.machine_model.control import Tool
from tests.support.machine_model.judgement import (
    LAWS,
    no_long_way_with_a_tripped_probe,
    state_is_restored,
    stops_at_a_miss,
    violations,
)
from tests.support.machine_model.machine import Machine, Trace, run
from tests.support.machine_model.modes import Modes, Vector
from tests.support.machine_model.probe import Fault, FaultKind, Probe, constant

pytestmark = pytest.mark.long  # a program under each fault

PROGRAMS: dict[str, Callable[[], Judged]] = {
    "sphere": sphere_program,
    "part": part_program,
    "compensated": lambda: part_program(compensated=True),
    "points": called_points,
}
# The user's own program around the calls is not ours: how it comes and goes.
_NOT_OURS = (no_long_way_with_a_tripped_probe, state_is_restored)


def laws_of(name: str) -> list[object]:
    return [law for law in LAWS if name != "points" or law not in _NOT_OURS]


def broken(name: str, judged: Judged, trace: Trace) -> list[str]:
    return violations(trace, judged.plan, laws_of(name))  # type: ignore[arg-type]


def every_touch(kind: FaultKind, judged: Judged, distance: float = 0.0) -> Iterator[Fault]:
    for number in range(1, len(judged.plan.touches) + 1):
        yield Fault(kind, number, distance)


@pytest.fixture(params=PROGRAMS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


class TestHealthyProbe:
    def test_all_touches_and_no_law_broken(self, name: str) -> None:
        judged = PROGRAMS[name]()
        trace = judged.run()
        assert trace.ended == "end", trace.error
        assert trace.contacts == len(judged.plan.touches)
        assert broken(name, judged, trace) == []
        # Each touch is 8 µm deep, and the machine needs its way to stop.
        deepest = max(move.depths.ball for move in trace.moves)
        assert PRETRAVEL < deepest < PRETRAVEL + judged.plan.stopping

    def test_from_below_and_beside(self, name: str) -> None:
        """The first motion is up, wherever the tip stands."""
        if name == "points":
            return
        judged = PROGRAMS[name]()
        x, y, z = judged.machine.position
        for place in ((x, y, z - 60.0), (x + 30.0, y, z - 45.0), (x, y + 30.0, z)):
            trace = judged.run(machine=judged.changed(position=place))
            assert trace.ended == "end", trace.error
            assert broken(name, judged, trace) == []


class TestGeneratedPrograms:
    """Any touches, heights and feeds; the law of feeds is the one that needs many of them."""

    # A failure is reported as it was found: making it smaller would run hundreds of programs.
    @settings(max_examples=12, phases=[Phase.generate])
    @given(
        polar=st.lists(st.floats(0.0, 95.0), min_size=1, max_size=4),
        turn=st.floats(0.0, 360.0),
        height=st.floats(17.5, 70.0),
        positioning=st.floats(300.0, 1500.0),
        travel=st.floats(1.0, 2000.0),
    )
    def test_all_laws_hold(
        self, polar: list[float], turn: float, height: float, positioning: float, travel: float
    ) -> None:
        azimuth = turn + 100.0 * np.arange(len(polar))
        judged = touches_on_sphere(
            from_angles(np.array(polar) * DEGREE, azimuth * DEGREE),
            replace(
                MACHINE, stem_diameter=1.0, safe_height=height, positioning_feed=positioning,
                travel_feed=travel,
            ),
        )  # fmt: skip
        trace = judged.run()
        assert trace.ended == "end", trace.error
        assert violations(trace, judged.plan) == []
        # Across at the safe height it goes at the feed of travels.
        across = [
            m.feed for m in trace.moves
            if math.dist(m.tip_start[:2], m.tip_planned[:2]) > 1e-3
            and min(judged.plan.work(m.tip_start)[2], judged.plan.work(m.tip_planned)[2])
            > height - 1e-3
        ]  # fmt: skip
        assert across == pytest.approx([travel] * len(across), abs=1e-3)


class TestFaultsAtEveryTouch:
    @pytest.mark.parametrize(
        ("kind", "distance", "stops"),
        [
            ("dead", 0.0, True),
            ("stuck", 0.0, True),
            ("early", 1.6, True),
            ("early", 0.4, False),
            ("spike", 1.6, True),
            ("late", 1.6, True),
            ("late", 0.4, False),
            ("bounce", 0.0, False),
        ],
    )
    def test_no_law_is_broken(
        self, name: str, kind: FaultKind, distance: float, stops: bool
    ) -> None:
        """A fault within the clearance is not seen by the control, but does no harm."""
        judged = PROGRAMS[name]()
        for number, fault in enumerate(every_touch(kind, judged, distance), start=1):
            trace = judged.run(fault)
            assert broken(name, judged, trace) == [], fault
            assert trace.ended == ("abort" if stops else "end"), (fault, trace.error)
            if stops:
                # The message names the touch.
                label = judged.plan.touches[number - 1].label
                assert (label if name != "points" else f"point {number}") in trace.error, fault

    def test_false_trip_on_the_way(self, name: str) -> None:
        judged = PROGRAMS[name]()
        for corner in judged.corners:
            trace = judged.run(Fault("false_trip", place=corner, distance=0.01))
            assert broken(name, judged, trace) == []
            # Where two ways are the same, the first one meets the fault; it always stops.
            assert trace.ended == "abort" or name == "points", trace.error

    def test_tripped_from_the_start(self, name: str) -> None:
        judged = PROGRAMS[name]()
        trace = judged.run(Fault("tripped"))
        assert trace.ended != "end"
        assert broken(name, judged, trace) == []

    def test_false_trip_on_each_straight_way(self, name: str) -> None:
        judged = PROGRAMS[name]()
        for first, last in judged.plan.segments:
            middle = [0.5 * (a + b) for a, b in zip(first, last, strict=True)]
            place = judged.plan.machine((middle[0], middle[1], middle[2]))
            trace = judged.run(Fault("false_trip", place=place, distance=0.01))
            assert broken(name, judged, trace) == [], place

    def test_two_faults(self, name: str) -> None:
        """A bounce and then nothing more; an early trip of a probe that then stays closed."""
        judged = PROGRAMS[name]()
        for faults in (
            (Fault("bounce", 1), Fault("dead", 2)),
            (Fault("early", 2, 1.6), Fault("stuck", 1)),
            (Fault("spike", 3, 1.6), Fault("dead", 3)),
        ):
            trace = judged.run(*faults)
            assert trace.ended == "abort", trace.error
            assert broken(name, judged, trace) == []


class TestMissesThatAreAllowed:
    """A program that leaves out points without contact; not the first one, nor two in a row."""

    LAWS = tuple(law for law in LAWS if law is not stops_at_a_miss)

    def test_one_miss_is_left_out(self) -> None:
        judged = part_program(allow_misses=True)
        for number in range(2, len(judged.plan.touches) + 1):
            trace = judged.run(Fault("late", number, 5.0))
            assert trace.ended == "end", trace.error
            assert violations(trace, judged.plan, self.LAWS) == []
            touched = [
                line.split(",")[-2] for line in trace.logs["part_log.ngc"] if "touch," in line
            ]
            assert touched.count("0.0000") == 1
            assert touched[number - 1] == "0.0000"

    def test_a_dead_probe_stops_at_the_second(self) -> None:
        judged = part_program(allow_misses=True)
        for number in range(1, len(judged.plan.touches)):
            trace = judged.run(Fault("dead", number))
            assert trace.ended == "abort"
            assert violations(trace, judged.plan, self.LAWS) == []
            missed = [m for m in trace.moves if judged.plan.touch_of(m) and not m.touched]
            assert len(missed) == (1 if number == 1 else 2)


class TestSurroundings:
    @pytest.mark.parametrize("way", [(4.0, 0.0, 0.0), (0.0, -4.0, 0.0), (0.0, 0.0, 6.0)])
    def test_the_part_is_elsewhere(self, name: str, way: tuple[float, float, float]) -> None:
        """By more than all distances of the plan: it stops at the first contact."""
        judged = PROGRAMS[name]()
        trace = judged.run(machine=moved(judged, way))
        assert trace.ended != "end"
        assert broken(name, judged, trace) == []

    @pytest.mark.parametrize("tool", [0, 1])
    def test_another_tool(self, tool: int) -> None:
        judged = sphere_program()
        trace = judged.run(machine=judged.changed(tool=tool))
        assert trace.ended == "abort"
        assert not trace.moves
        assert "load the probe" in trace.error
        assert broken("sphere", judged, trace) == []

    def test_another_length_in_the_tool_table(self) -> None:
        judged = sphere_program()
        for length in (0.0, 53.0, 57.0, -55.0):
            trace = judged.run(machine=judged.changed(tools={7: Tool(length, 6.0)}))
            assert trace.ended == "abort"
            assert not trace.moves
            assert "tool length" in trace.error
            assert broken("sphere", judged, trace) == []

    def test_missing_subroutines(self) -> None:
        judged = part_program(compensated=True)
        for missing in judged.subroutines:
            texts = {name: text for name, text in judged.subroutines.items() if name != missing}
            trace = replace(judged, subroutines=texts).run()
            needed = ("lookup", "compensate", "identity")
            if any(word in missing for word in needed):
                assert trace.ended == "error"
                assert not trace.moves, missing
            assert broken("compensated", judged, trace) == []

    def test_soft_limits(self) -> None:
        """The control refuses a move beyond them; nothing else happens."""
        judged = sphere_program()
        x, y, z = judged.machine.offsets["G54"].origin
        low, high = (x - 5.0, y - 300.0, z - 300.0), (x + 300.0, y + 300.0, z + 300.0)
        trace = judged.run(machine=judged.changed(limits=(low, high)))
        assert "would exceed X's negative limit" in trace.error
        assert broken("sphere", judged, trace) == []


class TestModes:
    MODES = (
        Modes(),
        Modes(units="G20", distance="G91", motion="G38.3", feed=100.0),
        Modes(plane="G18", feed_mode="G93", path="G64 P0.01", work_offset="G56"),
        Modes(feed_override=False, adaptive_feed=True, feed_hold=False, path="G61.1"),
        Modes(tool_offset=(0.0, 0.0, TOOL_LENGTH), spindle="M3", speed=500.0, flood=True),
    )

    @pytest.mark.parametrize("modes", MODES)
    @pytest.mark.parametrize("fault", [None, Fault("dead", 2), Fault("tripped")])
    def test_modes_are_restored_and_do_not_matter(self, modes: Modes, fault: Fault | None) -> None:
        for name in ("sphere", "compensated"):
            judged = PROGRAMS[name]()
            trace = judged.run(*([fault] if fault else []), machine=judged.changed(modes=modes))
            assert broken(name, judged, trace) == []
            assert (trace.ended == "end") == (fault is None), trace.error
            assert trace.after.spindle == "M5"

    @pytest.mark.parametrize("fault", [None, Fault("dead", 2), Fault("tripped")])
    @pytest.mark.parametrize("length", [(0.0, 0.0, 100.0), (0.5, -0.25, 43.0), (0.0, 0.0, 0.0)])
    def test_another_length_that_was_active_comes_back_whole(
        self, length: Vector, fault: Fault | None
    ) -> None:
        """G43 H6, G43.1 and G43.2: M72 would give the length of the tool in the spindle, and the
        next move would go deeper while the screen shows G43."""
        for judged in (sphere_program(), part_program()):  # part: turned work coordinates
            modes = Modes(tool_offset=length, units="G20")
            trace = judged.run(*([fault] if fault else []), machine=judged.changed(modes=modes))
            assert (trace.ended == "end") == (fault is None), trace.error
            assert trace.after.tool_offset == pytest.approx(length, abs=1e-9)

    def test_esc_at_any_move_leaves_nothing_behind(self) -> None:
        """The control discards what is left; its handler gives back what was active."""
        modes = Modes(units="G20", distance="G91", feed=100.0, adaptive_feed=True)
        for name in ("sphere", "compensated", "points"):
            judged = PROGRAMS[name]()
            moves = len(judged.run().moves)
            for number in range(0, moves, 3):
                own = judged.machine.modes if name == "points" else modes
                machine = judged.changed(modes=own, aborted_at=number)
                trace = judged.run(machine=machine)
                assert trace.error == "Esc"
                assert broken(name, judged, trace) == []
                assert trace.after.feed_override
                assert trace.after.adaptive_feed == own.adaptive_feed

    def test_without_the_handler_nothing_moves(self) -> None:
        for name, make in PROGRAMS.items():
            judged = make()
            trace = judged.run(machine=judged.changed(calls_on_abort=False))
            assert "write ON_ABORT_COMMAND = O <pretravel_restore> call into" in trace.error
            # The calls of points have moves of their own around them.
            assert all(move.kind != "probe" for move in trace.moves), name

    def test_in_the_diameter_mode_of_lathes_nothing_moves(self) -> None:
        """There X is a diameter, and #5061 the radius (see findings)."""
        for name, make in PROGRAMS.items():
            judged = make()
            modes = replace(judged.machine.modes, lathe="G7")
            trace = judged.run(machine=judged.changed(modes=modes))
            assert "G8 first" in trace.error, name
            assert all(move.kind != "probe" for move in trace.moves), name

    def test_a_log_that_cannot_be_written_stops_before_the_first_move(self) -> None:
        """The control says nothing; a log of yesterday would be read as that of today."""
        judged = sphere_program()
        whole = judged.run()
        assert whole.logs["sphere_log.ngc"][-3] == "done,10,end"
        assert whole.logs["sphere_log.ngc"][3].startswith("run,1,")
        for logs in ({}, whole.logs):
            trace = judged.run(machine=judged.changed(disk_full=True, logs=logs))
            assert trace.moves == ()
            lost = "the control cannot write sphere_log.ngc"
            assert (lost if logs else "seeking o-word: o<sphere_log>") in trace.error
        again = judged.run(machine=judged.changed(logs=whole.logs))
        assert again.ended == "end"

    def test_an_active_length_stops_a_program_for_a_probe_without_one(self) -> None:
        """It was cancelled in silence, and the tip went lower by that length."""
        judged = touches_on_sphere(
            np.array([[0.0, 0.0, 1.0]]), replace(MACHINE, tool=None, tool_length=0.0)
        )
        trace = judged.run(machine=judged.changed(modes=Modes(tool_offset=(0.0, 0.0, 43.0))))
        assert "a tool length is active, of T7, but the machine file has tool none" in trace.error
        assert trace.moves == ()
        assert trace.after.tool_offset == (0.0, 0.0, 43.0)

    def test_overrides_of_the_operator_do_not_change_a_touch(self) -> None:
        judged = sphere_program()
        for override, adaptive in ((0.3, 1.0), (1.2, 1.0), (1.0, 0.5)):
            modes = Modes(adaptive_feed=adaptive != 1.0)
            machine = judged.changed(override=override, adaptive=adaptive, modes=modes)
            trace = judged.run(machine=machine)
            assert broken("sphere", judged, trace) == []
            measuring = [m.speed for m in trace.moves if judged.plan.touch_of(m)]
            assert measuring == pytest.approx([1.0] * len(judged.plan.touches))  # 60 mm/min


def bare_routine(judged: Judged) -> str:
    """Touches as simple routines make them: no guard, no check of anything."""
    lines = ["G0 Z{0:.3f}", "M3 S100", "M5"]
    for touch in judged.plan.touches:
        (x, y, z), (a, b, c) = touch.start, touch.end
        lines += [
            f"G0 X{x:.3f} Y{y:.3f}",
            f"G1 Z{z:.3f} F1200",
            f"G38.3 X{a:.6f} Y{b:.6f} Z{c:.6f} F60",
            f"G1 X{x:.3f} Y{y:.3f} Z{z:.3f} F1200",
            "G0 Z{0:.3f}",
        ]
    text = "\n".join(["G21 G90 G54 G61 G43", *lines, "G20 M2", ""])
    return text.replace("{0:.3f}", f"{judged.plan.safe_height:.3f}")


class TestLawsAreSevere:
    """Each law is broken by a bare routine: a law that is never red judges nothing."""

    def judged(self) -> Judged:
        found = sphere_program()
        return replace(found, text=bare_routine(found))

    def laws(self, trace: Trace) -> set[str]:
        return {text.partition(":")[0] for text in violations(trace, self.judged().plan)}

    def test_each_law_is_broken_by_something(self) -> None:
        judged = self.judged()
        low = judged.changed(position=(100.0, 50.0, 0.0))
        runs = [
            judged.run(),
            judged.run(Fault("dead", 2)),
            judged.run(Fault("stuck", 1)),
            judged.run(Fault("early", 2, 1.6)),
            judged.run(machine=judged.changed(tools={7: Tool(0.0, 6.0)})),
            judged.run(machine=low),
        ]
        found = set().union(*(self.laws(trace) for trace in runs))
        into = "o<into> if [#5070 EQ 0]\nG1 Z-10 F600\no<into> endif\n"
        text = judged.text.replace("G38.3 X0", "(first)\nG38.3 X0", 1).replace(
            "G1 X0", into + "G1 X0"
        )
        found |= self.laws(replace(judged, text=text).run(Fault("dead", 1)))
        silent = replace(judged.run(Fault("tripped")), ended="abort", error="")
        found |= self.laws(silent)
        assert found == {law.__name__ for law in LAWS}

    def test_the_laws_are_right_about_a_simple_case(self) -> None:
        judged = sphere_program()
        machine = Machine(judged.machine.world, position=judged.machine.position, tool=7)
        trace = run(machine, "G21\nG0 X1\nM2\n", probe=Probe(constant(PRETRAVEL)))
        said = "a rapid move; the probe was not seen open before it"
        assert violations(trace, judged.plan) == [
            f"no_rapid_move_with_an_unknown_probe: program:2 G0 to (1.000, 0.000, 15.000): {said}"
        ]
