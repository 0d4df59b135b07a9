"""Cycles of LinuxCNC on the model of the machine: results, refusals, and every fault of a probe."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.controls.linuxcnc_cycles import sphere_subroutines
from pretravel.controls.linuxcnc_subroutines import NO_RESULT, linuxcnc_subroutines
from pretravel.controls.lookup_formula import exact_lookup
from tests.support.commands import run as run_command
from tests.support.machine_model.control import Tool
from tests.support.machine_model.coordinates import Frame, WorkOffset
from tests.support.machine_model.judgement import Plan, state_is_restored
from tests.support.machine_model.machine import Machine, Trace, run
from tests.support.machine_model.modes import Modes, Vector
from tests.support.machine_model.probe import Fault, Probe
from tests.support.machine_model.world import Ball, Box, Ring, Thing, World
from tests.support.simulated_probe import simulated_map, simulated_pretravel

pytestmark = pytest.mark.long  # a cycle under each fault

# Call, place of the tip before it, what is on the table, number of contacts.
LARGEST = 1.0
CYCLES: dict[str, tuple[str, Vector, Thing, int]] = {
    "bore": ("[40.2] [100] [5] [1]", (0.4, -0.3, 0.0), Ring((0.0, 0.0, 0.0), 25.0, 5.0), 9),
    "boss": ("[25] [30] [100] [5] [1]", (0.2, 0.1, 30.0), Ball((0.0, 0.0, 0.0), 12.5), 9),
    "pocket": ("[40] [40] [100] [1]", (0.0, 0.0, 0.0), Ring((0.0, 0.0, 0.0), 25.0, 5.0), 8),
    "web": ("[80] [60] [14] [100] [1]", (0.5, -0.5, 8.0), Box((0, 0, -10), (40, 30, 10)), 8),
    "edge": ("[90] [3.7] [100] [1]", (3.0, -37.0, -6.0), Box((0, 0, -10), (40, 30, 10)), 2),
    "surface": ("[3.8] [100] [1]", (3.0, -7.0, 7.0), Box((0, 0, -10), (40, 30, 10)), 2),
    "angle": ("[90] [3.7] [-10] [100] [1]", (3.0, -37.0, -6.0), Box((0, 0, -10), (40, 30, 10)), 4),
    "corner": ("[1] [-1] [8] [14] [100] [1]", (-39.5, 29.6, 8.0),
               Box((0, 0, -10), (40, 30, 10)), 4),
    "sphere": ("[0.3] [0] [0] [25] [6] [100] [6] [3] [1]", (9.0, 2.0, 50.0),
               Ball((0.0, 0.0, 0.0), 12.5), 11),
}  # fmt: skip
RESULTS = ("_x", "_y", "_diameter", "_edge", "_surface", "_angle")
FAULTS = ("dead", "stuck", "early", "late")


@cache
def subroutines() -> dict[str, str]:
    pretravel_map = simulated_map()
    form = exact_lookup(pretravel_map)
    assert form is not None
    return linuxcnc_subroutines(pretravel_map, form)


@lru_cache(maxsize=1000)
def pretravel_along(normal: Vector) -> float:
    """The machine asks for it at every place of a move, along a wall for the same normal."""
    return float(simulated_pretravel(np.array([normal]))[0])


def made(name: str, *faults: Fault, before: str = "", after: str = "", call: str = "") -> Trace:
    """One call on the model, from the place where the cycle expects the tip."""
    arguments, place, thing, _ = CYCLES[name]
    machine = Machine(World((thing,)), position=place, acceleration=2000.0)
    probe = Probe(pretravel_along, faults=faults)
    text = f"G21 G90 G94 G54\n{before}\no<pretravel_{name}> call {call or arguments}\n{after}\nM2\n"
    return run(machine, text, probe=probe, subroutines=subroutines())


def check_harmless(trace: Trace, name: str) -> None:
    """No rapid move, nothing deep in the part, the state as before."""
    assert not [move for move in trace.moves if move.kind == "rapid"]
    deepest = max((move.depths.ball for move in trace.moves), default=0.0)
    # A missed touch goes 1.2 times the largest error beyond the expected wall. The calls are off
    # by 0.6 mm at the most; with a feed of 100 mm/min the machine stops at once.
    assert deepest < 1.2 * LARGEST + 0.6
    assert state_is_restored(trace, Plan((), (), safe_height=0.0)) == []


class TestHealthy:
    @pytest.mark.parametrize("name", CYCLES)
    def test_ends_normally_with_all_its_contacts(self, name: str) -> None:
        trace = made(name, before="F77.125", after="(PRINT,%.3f#<_feed>)")
        assert trace.error == ""
        assert trace.printed == ("77.125",)
        assert trace.contacts == CYCLES[name][3]
        check_harmless(trace, name)

    @pytest.mark.parametrize("name", CYCLES)
    def test_a_bouncing_probe_does_no_harm(self, name: str) -> None:
        trace = made(name, Fault("bounce", 1))
        assert trace.error == ""
        check_harmless(trace, name)


class TestResults:
    """Places, an angle, and the work offset that an argument sets."""

    OFFSET = WorkOffset((100.0, -50.0, 20.0), 30.0)

    def measured(self, name: str, call: str, thing: Box, place: Vector, unit: float = 1.0) -> Trace:
        """In turned work coordinates; places are those of the work coordinates."""
        frame = Frame(self.OFFSET)
        moved = replace(
            thing, center=frame.to_machine(thing.center), turn_deg=thing.turn_deg + 30.0
        )
        machine = Machine(
            World((moved,)), position=frame.to_machine(place), acceleration=2000.0,
            offsets={"G54": self.OFFSET}, modes=Modes(units="G20" if unit > 1.0 else "G21"),
        )  # fmt: skip
        text = f"G90 G94 G54\no<pretravel_{name}> call {call}\nM2\n"
        probe = Probe(lambda normal: pretravel_along(normal))
        trace = run(machine, text, probe=probe, subroutines=subroutines())
        assert trace.error == ""
        return trace

    BLOCK = Box((0.3, -0.2, -10.1), (40.0, 30.0, 10.0))

    @pytest.mark.parametrize("zero", [0, 1])
    @pytest.mark.parametrize("unit", [1.0, 25.4])
    def test_a_face(self, zero: int, unit: float) -> None:
        call = f"[3.8/{unit}] [100/{unit}] [0] [0] [{zero}]"
        trace = self.measured("surface", call, self.BLOCK, (3.0, -7.0, 7.0), unit)
        assert trace.parameters["_pretravel_surface"] * unit == pytest.approx(-0.1, abs=3e-6)
        raw = trace.parameters["_pretravel_raw_surface"] * unit
        assert raw == pytest.approx(-0.1 - pretravel_along((0.0, 0.0, 1.0)), abs=3e-6)
        height = trace.offsets_after["G54"].origin[2] - 20.0
        assert height == pytest.approx(-0.1 * zero, abs=3e-6)

    @pytest.mark.parametrize("zero", [0, 1])
    @pytest.mark.parametrize(("x", "y"), [(1, 1), (-1, 1), (1, -1), (-1, -1)])
    def test_a_corner(self, x: int, y: int, zero: int) -> None:
        """The part lies on that side of the corner."""
        there = (0.3 - 40.0 * x, -0.2 - 30.0 * y)
        place = (there[0] + 0.4, there[1] - 0.3, 8.0)
        call = f"[{x}] [{y}] [8] [14] [100] [0] [0] [{zero}]"
        trace = self.measured("corner", call, self.BLOCK, place)
        found = [trace.parameters[f"_pretravel_corner_{axis}"] for axis in "xy"]
        assert found == pytest.approx(there, abs=3e-6)
        frame = Frame(trace.offsets_after["G54"])
        origin = Frame(self.OFFSET).to_work(frame.to_machine((0.0, 0.0, 0.0)))
        assert origin == pytest.approx((*there, 0.0) if zero else (0.0, 0.0, 0.0), abs=3e-6)

    @pytest.mark.parametrize(("way", "zero"), [(-10, 0), (10, 1)])
    @pytest.mark.parametrize("turn", [0.0, 1.5, -0.7])
    def test_an_angle(self, turn: float, way: int, zero: int) -> None:
        block = replace(self.BLOCK, turn_deg=turn)
        call = f"[90] [3.7] [{way}] [100] [0] [0] [{zero}]"
        trace = self.measured("angle", call, block, (3.0, -37.0, -6.0))
        # The map's normal is the expected one: the pretravel of two walls differs in the second
        # order of the turn.
        assert trace.parameters["_pretravel_angle"] == pytest.approx(turn, abs=2e-3)
        turned = trace.offsets_after["G54"].turn_deg
        assert turned == pytest.approx(30.0 + turn * zero, abs=2e-3)

    @pytest.mark.parametrize(
        ("name", "call", "place", "moved"),
        [
            ("web", "[80] [60] [14] [100] [0] [0] [1]", (0.5, -0.5, 8.0), (0.3, -0.2, 0.0)),
            ("web", "[80] [0] [14] [100] [0] [0] [1]", (0.5, -0.5, 8.0), (0.3, 0.0, 0.0)),
            ("edge", "[90] [3.7] [100] [0] [0] [1]", (3.0, -37.0, -6.0), (0.0, -30.2, 0.0)),
            ("edge", "[180] [3.7] [100] [0] [0] [1]", (47.0, 3.0, -6.0), (40.3, 0.0, 0.0)),
        ],
    )
    def test_the_origin_goes_to_what_was_measured(
        self, name: str, call: str, place: Vector, moved: Vector
    ) -> None:
        trace = self.measured(name, call, self.BLOCK, place)
        frame = Frame(trace.offsets_after["G54"])
        origin = Frame(self.OFFSET).to_work(frame.to_machine((0.0, 0.0, 0.0)))
        assert origin == pytest.approx(moved, abs=3e-6)


class TestFaults:
    @pytest.mark.parametrize("kind", FAULTS)
    @pytest.mark.parametrize("name", CYCLES)
    def test_every_contact_in_turn_ends_in_a_message(self, name: str, kind: str) -> None:
        for contact in range(1, CYCLES[name][3] + 1):
            trace = made(name, Fault(kind, contact, 1.8))  # type: ignore[arg-type]
            assert trace.ended == "abort", f"contact {contact}: {trace.ended} {trace.error}"
            assert "cause" in trace.error
            assert trace.contacts <= contact + (kind == "stuck")
            check_harmless(trace, name)

    @pytest.mark.parametrize("distance", [0.05, 0.6])
    @pytest.mark.parametrize("name", [name for name in CYCLES if name != "sphere"])
    def test_a_false_trip_within_the_clearance_sets_nothing(
        self, name: str, distance: float
    ) -> None:
        """A bore of 40.000 came out as 39.852, and the origin went there, by one false trip."""
        search = 4 if name in ("bore", "boss") else 0
        healthy = made(name).parameters
        for contact in range(1, CYCLES[name][3] + 1):
            trace = made(name, Fault("early", contact, distance))
            if contact > search or trace.ended == "abort":
                assert trace.ended == "abort", f"contact {contact}"
                # With the error of the place, 0.6 mm can be beyond the clearance.
                beyond = distance > 0.5 and "contact too early" in trace.error
                assert "a false trip" in trace.error or beyond
                check_harmless(trace, name)
            else:  # The search only says where the second pass touches.
                for key in ("center_x", "center_y", "diameter"):
                    found = trace.parameters[f"_pretravel_{key}"]
                    # 0.3 mm off, the normals turn by t = 0.3 / 15.5 for a boss: the tip radius
                    # along them is wrong by 3 mm · t² / 2 = 0.6 µm; the map adds 0.2 µm.
                    assert found == pytest.approx(healthy[f"_pretravel_{key}"], abs=1e-3)

    @pytest.mark.parametrize("name", [name for name in CYCLES if name != "sphere"])
    def test_no_result_of_an_earlier_call_is_left(self, name: str) -> None:
        """A program that goes on after a stop must not take the last diameter for this one."""
        results = made(name).parameters
        mine = [key for key in results if key.startswith("_pretravel_") and key.endswith(RESULTS)]
        assert len(mine) >= 4
        stale = "\n".join(f"#<{key}> = {results[key]:.6f}" for key in mine)
        for contact in range(1, CYCLES[name][3] + 1):
            left = made(name, Fault("dead", contact), before=stale).parameters
            assert {left[key] for key in mine} == {NO_RESULT}, f"contact {contact}"

    @pytest.mark.parametrize("name", CYCLES)
    def test_tripped_before_the_first_move(self, name: str) -> None:
        trace = made(name, Fault("tripped"))
        assert trace.ended == "abort"
        assert "cause 6" in trace.error
        assert sum(move.length for move in trace.moves) < 0.1

    def test_something_above_a_boss(self) -> None:
        """The way across meets it; the tip goes back and the cycle stops."""
        _, place, thing, _ = CYCLES["boss"]
        clamp = Ball((12.0, 0.0, 28.0), 4.0)
        machine = Machine(World((thing, clamp)), position=place, acceleration=2000.0)
        text = "G21 G90 G94\no<pretravel_boss> call [25] [30] [100]\nM2\n"
        trace = run(machine, text, subroutines=subroutines())
        assert trace.ended == "abort"
        assert "cause 5" in trace.error
        # The way to stop at 1000 mm/min and 2000 mm/s² is 0.07 mm along an oblique way.
        assert max(move.depths.ball for move in trace.moves) < 0.15
        # One way across, and back: no second trial from elsewhere.
        assert [move.code for move in trace.moves] == ["G38.3", "G38.5"]

    def test_a_false_trip_on_the_way_up(self) -> None:
        """The tip does not go on to the next side from below the top."""
        _, place, thing, _ = CYCLES["web"]
        # Half way up beside the first wall, at the start of its touch.
        fault = Fault("false_trip", 1, 0.05, place=(-44.5, -0.5, 2.0))
        machine = Machine(World((thing,)), position=place, acceleration=2000.0)
        text = "G21 G90 G94\no<pretravel_web> call [80] [60] [14] [100] [1]\nM2\n"
        trace = run(machine, text, probe=Probe(faults=(fault,)), subroutines=subroutines())
        assert trace.ended == "abort"
        assert "cause 5" in trace.error
        assert trace.contacts <= 1

    def test_a_sphere_that_was_stopped_says_where_in_its_log(self) -> None:
        trace = made("sphere", Fault("dead", 4))
        log = trace.logs["pretravel_sphere_log.ngc"]
        assert log[-1].startswith("stopped,s4,1")
        assert sum(line.startswith("touch,") for line in log) == 3


class TestRefusals:
    @pytest.mark.parametrize("name", CYCLES)
    @pytest.mark.parametrize(
        ("before", "words"),
        [
            ("G91", "G90"),
            ("G93 F1", "G94"),
            ("G7", "G8 first"),
            ("M3 S100", "spindle"),
            ("", "missing"),
        ],
    )
    def test_before_the_first_move(self, name: str, before: str, words: str) -> None:
        trace = made(name, before=before, call="" if before else "[20]")
        assert trace.ended == "abort"
        assert words in trace.error
        assert trace.moves == ()

    @pytest.mark.parametrize(
        ("name", "call", "words"),
        [
            ("bore", "[5] [100]", "no room"),
            ("bore", "[40] [100] [2.5]", "number of touches"),
            ("bore", "[40] [100] [3]", "three cannot show a false trip"),
            ("bore", "[0] [100]", "diameter is missing"),
            # 9 mm of 10 are allowed as an error: the touch would end 10.8 mm behind the face.
            ("surface", "[10] [100] [9]", "10.800 mm behind the expected surface"),
            ("edge", "[90] [10] [100] [9]", "10.800 mm behind the expected surface"),
            ("sphere", "[0] [0] [0] [45] [6] [100] [0] [0] [9]", "10.800 mm behind"),
            # 500 mm/s², at 200 %: (2 · 36 mm/s)² / 500 mm/s² + 3 ms · 72 mm/s.
            ("edge", "[90] [3.7] [100] [1] [2160]", "travel 10.584 mm further"),
            ("edge", "[90] [3.7] [100] [1] [2160] [0] [0]", "travel 10.584 mm further"),
            ("boss", "[25] [0] [100]", "depth"),
            ("pocket", "[0] [0] [100]", "width is missing"),
            ("pocket", "[40] [6] [100]", "no room"),
            ("web", "[80] [60] [-1] [100]", "depth"),
            ("edge", "[0] [0] [100]", "distance"),
            ("surface", "[0] [100]", "distance"),
            ("angle", "[90] [3.7] [0.5] [100]", "way between the places"),
            ("corner", "[1] [0] [8] [14] [100]", "sides of the part"),
            ("corner", "[1] [1] [3] [14] [100]", "farther from the corner"),
            ("edge", "[45] [3.7] [100] [0] [0] [1]", "along an axis"),
            ("bore", "[40.2] [100] [5] [1] [0] [2]", "the argument for the zero is 1"),
            ("sphere", "[0] [0] [0] [25] [0] [100]", "diameters"),
            ("sphere", "[0] [0] [0] [25] [6] [100] [2]", "at least 4"),
        ],
    )
    def test_arguments(self, name: str, call: str, words: str) -> None:
        trace = made(name, call=call)
        assert trace.ended == "abort"
        assert words in trace.error
        assert trace.moves == ()


class TestTool:
    """The tool in the spindle and its active length, before the first move of every cycle."""

    @pytest.mark.parametrize(
        "name",
        [
            "point",
            *(pytest.param(n, marks=() if n == "bore" else pytest.mark.slow) for n in CYCLES),
        ],
    )
    @pytest.mark.parametrize(
        ("tool", "here", "length", "words"),
        [
            (None, 3, 43.0, "the length of T3 is active"),
            (7, 3, 43.0, "T3 is in the spindle, but the probe is T7"),
            (7, 7, 0.0, "the active tool length is not that of T7: G43 first"),
            (7, 7, 43.0, "the active tool length is not that of T7: G43 first"),
            (7, 7, 55.0, ""),
            (None, 3, 0.0, ""),
        ],
    )
    def test_it_is_that_of_the_probe(
        self, name: str, tool: int | None, here: int, length: float, words: str
    ) -> None:
        call = CYCLES["bore" if name == "point" else name][0]
        if name == "point":
            call = "[0] [0] [0] [0] [0] [1] [100] [1]"
        modes = Modes(tool_offset=(0.0, 0.0, length))
        machine = Machine(tools={3: Tool(43.0), 7: Tool(55.0)}, tool=here, modes=modes)
        form = exact_lookup(simulated_map())
        assert form is not None
        text = f"G21 G90 G94\no<pretravel_{name}> call {call}\nM2\n"
        files = linuxcnc_subroutines(simulated_map(), form, tool=tool)
        trace = run(machine, text, subroutines=files)
        if not words:  # Nothing is there to be touched.
            assert "stopped with cause 1" in trace.error
            return
        assert words in trace.error
        assert trace.moves == ()
        assert trace.after == replace(modes, motion=trace.after.motion)


class TestRadius:
    @pytest.mark.parametrize(("unit", "scale"), [("G21", 1.0), ("G20", 25.4)])
    def test_tip_radius_less_pretravel_less_delay_travel(self, unit: str, scale: float) -> None:
        """4 ms at 300 mm/min, in both units; the normal is turned with the work coordinates."""
        pretravel_map = simulated_map(delay=0.004)
        form = exact_lookup(pretravel_map)
        assert form is not None
        text = f"{unit} G54\no<pretravel_radius> call [0.6] [0] [0.8] [{300 / scale:.12f}]\n"
        trace = run(
            Machine(offsets={"G54": WorkOffset((1.0, 2.0, 3.0), 30.0)}),
            text + "(PRINT,%.9f#<_value>)\nM2\n",
            subroutines=linuxcnc_subroutines(pretravel_map, form),
        )
        turned = [0.6 * np.cos(np.pi / 6), 0.6 * np.sin(np.pi / 6), 0.8]
        true = 3.0 - pretravel_map.pretravel([turned])[0] - 300 / 60 * 0.004
        # Nine decimals of an inch.
        assert float(trace.printed[0]) * scale == pytest.approx(true, abs=2e-8)
        assert trace.moves == ()


class TestFiles:
    @pytest.mark.parametrize("name", ["bore", "web", "edge", "radius"])
    def test_files_of_two_exports_are_noticed_before_a_move(self, name: str) -> None:
        other = replace(simulated_map(), tip_radius=2.0)
        form = exact_lookup(other)
        assert form is not None
        file = f"pretravel_{name}.ngc"
        mixed = subroutines() | {file: linuxcnc_subroutines(other, form)[file]}
        call = CYCLES.get(name, ("[1] [0] [0] [100]",))[0]
        text = f"G21 G90 G94\no<pretravel_{name}> call {call}\nM2\n"
        trace = run(Machine(), text, subroutines=mixed)
        assert trace.ended == "abort"
        assert "different maps" in trace.error
        assert trace.moves == ()

    def test_the_sphere_needs_no_map(self, tmp_path: Path) -> None:
        """The subroutines for a machine without a map are those of an export."""
        assert sphere_subroutines().items() <= subroutines().items()
        assert "pretravel_sphere.ngc" in run_command("program", "mdi", "-o", tmp_path / "subs")
        written = {path.name: path.read_text() for path in (tmp_path / "subs").iterdir()}
        assert written == sphere_subroutines()
        assert "a folder is needed" in run_command("program", "mdi", "-o", "x.ngc", code=2)
        arguments, place, thing, contacts = CYCLES["sphere"]
        machine = Machine(World((thing,)), position=place, acceleration=2000.0)
        text = f"G21 G90 G94\no<pretravel_sphere> call {arguments}\nM2\n"
        trace = run(machine, text, subroutines=sphere_subroutines())
        assert trace.error == ""
        assert trace.contacts == contacts
