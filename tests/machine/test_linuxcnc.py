"""On the real LinuxCNC: other probes, subroutines, points, logs."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, ring_pattern
from pretravel.base.errors import InputError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.controls.control_table import TableSettings
from pretravel.controls.fanuc import FANUC
from pretravel.controls.linuxcnc_files import read_tool, read_work_offset
from pretravel.controls.linuxcnc_programs import linuxcnc_program
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.logs.log_lines import read_log_positions
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.logs.probeopen import read_probeopen
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.lookup_table import lookup_table
from pretravel.controls.macro_b import macro_programs
from pretravel.controls.program import plan_program
from pretravel.controls.renishaw import renishaw_variables
from pretravel.controls.surroundings import SphereObstacle
from pretravel.files.logs.joining import join
from pretravel.files.machine import Machine, work_placement
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualifying import qualify
from pretravel.touches.targets import Targets
from tests.machine.conftest import SIMULATOR, run_program, run_together
from tests.support.linuxcnc_interpreter import interpret

DIAMETER = 24.9987
# The last digit of a log is 1e-4 µm; three of them make a point.
SAME = 5e-7
QUICK = Machine(
    measuring_feed=3000.0, positioning_feed=24000.0, acceleration=100000.0, safe_height=36.0
)
OFFSETS = "G21\nG10 L2 P1 X100 Y50 Z-30 R0\nG10 L2 P2 X-80 Y20 Z-60 R{turn}\n"


def hal(path: Path, **changes: float) -> Path:
    """A probe.hal with other parameters: the last setp of each counts."""
    lines = [(SIMULATOR / "probe.hal").read_text()]
    lines += [
        f"setp pretravel-probe.0.{name.replace('_', '-')} {value}"
        for name, value in changes.items()
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def interpreted(program: Path) -> tuple[np.ndarray, str]:
    """Numbers that a program logs, and all output, of LinuxCNC's interpreter without a machine."""
    done = interpret(program)
    values = re.findall(r'LOG\("(-?[\d.]+)"\)', done.stdout)
    return np.array([float(value) for value in values]), done.stdout + done.stderr


def numbers(path: Path) -> np.ndarray:
    return np.array([[float(c) for c in line.split(",")] for line in path.read_text().split()])


class TestOtherProbes:
    """Probes with maps that the software does not contain; a part in turned work coordinates."""

    PART = Targets(
        np.array([[-30.0, -20, 0], [-20, 15, 0], [-40, 10, -6], [-40, -15, -6], [-25, 30, -5],
                  [-10, -30, -7], [20, 0, 12]]),
        np.array([[0.0, 0, 1], [0, 0, 1], [-1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0],
                  [0, 0, 1]]),
        labels=("t1", "t2", "w1", "w2", "n1", "s1", "dome"),
    )  # fmt: skip

    @pytest.mark.parametrize(
        "turn",
        [pytest.param(0.0, marks=pytest.mark.slow), 30.0],
    )
    def test_part_after_our_own_calibration(self, tmp_path: Path, turn: float) -> None:
        probe = hal(
            tmp_path / "other.hal",
            across=0.014, lobe=0.006, lobe_azimuth=71.0, second=0.0012, oval=0.0011,
            oval_azimuth=-20.0, axial=0.001,
            # The block is turned in the machine like the work coordinates.
            turn_1=turn, x_2=-80.0 + 20.0 * np.cos(turn * DEGREE),
            y_2=20.0 + 20.0 * np.sin(turn * DEGREE),
        )  # fmt: skip
        normals = ring_pattern(np.array([0.0, 25.0, 50.0, 70.0, 90.0]) * DEGREE, 16)
        sphere = Targets(12.5 * normals, normals)
        program = plan_program(
            sphere, QUICK, title="sphere", obstacles=[SphereObstacle(np.zeros(3), 12.5)]
        )
        (tmp_path / "sphere.ngc").write_text(
            OFFSETS.format(turn=turn) + linuxcnc_program(program, "sphere_log.ngc")
        )
        run_program(tmp_path / "sphere.ngc", probe)
        readings = read_own_log(tmp_path / "sphere_log.ngc")
        pretravel_map = qualify(readings.touches, DIAMETER, tip_diameter=6.0).pretravel_map
        form = exact_lookup(pretravel_map)
        for name, text in linuxcnc_subroutines(pretravel_map, form).items():
            (tmp_path / name).write_text(text)
        part_machine = replace(QUICK, work_offset="G55")
        part = plan_program(self.PART, part_machine, title="part")
        text = linuxcnc_program(part, "part_log.ngc", compensated=pretravel_map)
        (tmp_path / "part.ngc").write_text(text)
        run_program(tmp_path / "part.ngc", probe)
        log = read_own_log(tmp_path / "part_log.ngc")
        assert log.rotation == pytest.approx(turn * DEGREE, abs=1e-9)
        points = apply(log.touches, pretravel_map.seen_from(log.placement))
        for label, position in zip(points.labels, points.positions, strict=True):
            assert position == pytest.approx(log.compensated[label], abs=SAME)
        assert points.deviation is not None
        # The latch is exact: the remaining error is that of the map between its 51 directions.
        assert np.max(np.abs(points.deviation)) < 0.3 * MICROMETRE
        # Without the rotation the map is evaluated in wrong directions: several micrometres.
        if turn:
            wrong = apply(log.touches, pretravel_map)
            assert wrong.deviation is not None
            assert np.max(np.abs(wrong.deviation)) > 3.0 * MICROMETRE


@pytest.fixture(scope="module")
def example_map() -> PretravelMap:
    return _example_map()


@cache
def _example_map(kind: str = "harmonic") -> PretravelMap:
    from pretravel.files.touches_csv import read_touches
    from tests.support.examples import EXAMPLES

    touches = read_touches(EXAMPLES / "sphere_touches.csv")
    return qualify(touches, DIAMETER, tip_diameter=6.0, kind=kind).pretravel_map


class TestSubroutines:
    """Exported subroutines, evaluated by the interpreter of the control."""

    DIRECTIONS = fibonacci_cap(60, 94.0 * DEGREE)

    def evaluated(self, tmp_path: Path, calls: list[str], before: str = "") -> np.ndarray:
        lines = ["G21 G54", before, "(LOGOPEN,values.log)"]
        for call in calls:
            lines += [call, "(LOG,%.9f#<_value>)"]
        program = tmp_path / "values.ngc"
        program.write_text("\n".join([*lines, "(LOGCLOSE)", "M2\n"]))
        found, _ = interpreted(program)
        return found

    @pytest.mark.parametrize(
        ("kind", "form", "turn"),
        [
            pytest.param("harmonic", "formula", 0.0, marks=pytest.mark.slow),
            ("harmonic", "formula", -50.0),
            ("harmonic", "table", -50.0),
            ("physical", "formula", 20.0),
            pytest.param("physical", "table", 0.0, marks=pytest.mark.slow),
        ],
    )
    def test_lookup_gives_what_its_header_promises(
        self, tmp_path: Path, kind: str, form: str, turn: float
    ) -> None:
        example_map = _example_map(kind)
        chosen = (
            exact_lookup(example_map)
            if form == "formula"
            else lookup_table(example_map, tolerance=2e-5, most_values=1900)
        )
        assert chosen is not None
        for name, text in linuxcnc_subroutines(example_map, chosen).items():
            (tmp_path / name).write_text(text)
        calls = [
            "o<pretravel_lookup> call " + " ".join(f"[{value:.15f}]" for value in n)
            for n in self.DIRECTIONS
        ]
        found = self.evaluated(tmp_path, calls, f"G10 L2 P1 R{turn}")
        # Normals are in work coordinates, the map is in those of the machine.
        machine = work_placement(0, 0, 0, turn * DEGREE).vectors(self.DIRECTIONS)
        assert found == pytest.approx(chosen.value(machine), abs=2e-9)  # nine decimals
        truth = example_map.pretravel(machine)
        promised = chosen.largest_error + 2e-9
        assert np.max(np.abs(found - truth)) <= promised
        header = (tmp_path / "pretravel_lookup.ngc").read_text().splitlines()[2]
        told = float(re.search(r"map ([\d.]+) um", header)[1])  # type: ignore[index]
        assert told == pytest.approx(chosen.largest_error / MICROMETRE, abs=5.1e-4)

    def test_outside_the_map_it_stops(self, tmp_path: Path, example_map: PretravelMap) -> None:
        for name, text in linuxcnc_subroutines(example_map, exact_lookup(example_map)).items():
            (tmp_path / name).write_text(text)
        program = tmp_path / "outside.ngc"
        program.write_text("G21\no<pretravel_lookup> call [0] [0] [-1]\nM2\n")
        assert "the map does not hold 180" in run_program(program, code=1)

    def test_macro_b_in_another_interpreter(
        self, tmp_path: Path, example_map: PretravelMap
    ) -> None:
        """Macro B of Fanuc with the words of LinuxCNC and unchanged arithmetic."""
        table = lookup_table(example_map, tolerance=2e-5, most_values=399)
        made = macro_programs(example_map, table, dialect=FANUC)
        load, look = (text.splitlines()[2:] for text in made.values())
        label = iter(range(100, 1000))
        loops: list[int] = []

        def translated(body: list[str]) -> list[str]:
            lines = []
            for line in body:
                if line == "M99":
                    break
                if found := re.fullmatch(r"IF (\[.*\]) THEN (.*)", line):
                    name = next(label)
                    left, _, right = found[2].partition("=")
                    lines += [f"o{name} if {found[1]}", f"{left}=[{right}]", f"o{name} endif"]
                elif found := re.fullmatch(r"IF (\[.*\]) GOTO (9\d)", line):
                    name = next(label)
                    alarm = f"(ABORT,alarm {found[2]})"
                    lines += [f"o{name} if {found[1]}", alarm, f"o{name} endif"]
                elif found := re.fullmatch(r"WHILE (\[.*\]) DO1", line):
                    loops.append(next(label))
                    lines.append(f"o{loops[-1]} while {found[1]}")
                elif line == "END1":
                    lines.append(f"o{loops[-1]} endwhile")
                elif line == "#100=#0":
                    lines.append("#100=0")
                elif line.startswith("#"):
                    left, _, right = line.partition("=")
                    lines.append(f"{left}=[{right}]")
                else:
                    assert line.startswith("("), line
            return lines

        # #4006 contains the unit on Fanuc; here it is a parameter like others.
        lines = ["G21", "#4006=21", *translated(load), "(LOGOPEN,values.log)"]
        # A sub keeps #1 to #30 for itself, Fanuc #1 to #33.
        lines += ["o<macro> sub", "#4=#1", "#5=#2", "#6=#3", *translated(look), "o<macro> endsub"]
        for n in self.DIRECTIONS:
            lines += [
                "o<macro> call " + " ".join(f"[{value:.15f}]" for value in n),
                "(LOG,%.9f#100)",
            ]
        program = tmp_path / "macro.ngc"
        program.write_text("\n".join([*lines, "(LOGCLOSE)", "M2\n"]))
        found, output = interpreted(program)
        assert "alarm" not in output
        # Seven decimals of the table's nodes.
        assert found == pytest.approx(table.value(self.DIRECTIONS), abs=2e-7)
        beyond = tmp_path / "beyond.ngc"
        beyond.write_text("\n".join([*lines, "o<macro> call [0] [0] [-1]", "M2\n"]))
        assert "alarm 94" in interpreted(beyond)[1]

    def test_vector_radii_by_nearest_sector(
        self, tmp_path: Path, example_map: PretravelMap
    ) -> None:
        """The residual of the header, by a lookup in O-words after the definition of the table."""
        text = renishaw_variables(example_map, TableSettings(base=600))
        told = float(re.search(r"([\d.]+) UM AT MOST", text)[1])  # type: ignore[index]
        lines = ["G21", *(line for line in text.splitlines() if line.startswith("#"))]
        # Sectors every 30°: X, 30, 60, Y, 120, 150, X, 210, 240, Y, 300, 330.
        order = [600, 610, 611, 601, 612, 613, 600, 614, 615, 601, 616, 617]
        lines += [f"#{700 + i}=#{variable}" for i, variable in enumerate(order)]
        lines += ["(LOGOPEN,values.log)"]
        azimuth = np.arange(0.25, 360.0, 5.0)
        for angle in azimuth:
            lines += [f"#1=[FIX[[{angle}+15]/30] MOD 12]", "#2=#[700+#1]", "(LOG,%.7f#2)"]
        program = tmp_path / "sectors.ngc"
        program.write_text("\n".join([*lines, "(LOGCLOSE)", "M2\n"]))
        radius, _ = interpreted(program)
        from pretravel.base.directions import from_angles

        truth = example_map.tip_radius - example_map.pretravel(
            from_angles(np.pi / 2, azimuth * DEGREE)
        )
        off = np.max(np.abs(radius - truth)) / MICROMETRE
        assert told * 0.9 < off <= told + 0.02


MISLEADING = """
G21
G10 L2 P1 X100 Y50 Z-30 R25
G54 G61
G0 X0 Y0 Z40
(PROBEOPEN mm.txt)
G1 Z18 F6000
G38.3 Z12 F1500
G1 Z18 F6000
(the same again: the control writes no second row)
G38.3 Z12 F1500
G1 Z40 F6000
(in the air: a row like others, where the move ended)
G0 X60
G1 Z18 F6000
G38.3 Z13.5 F1500
G1 Z40 F6000
G0 X18
G1 Z0 F6000
G38.3 X12 F1500
G1 X18 F6000
(PROBECLOSE)
(PROBEOPEN inch.txt)
G20
G38.3 X[12/25.4] F60
G1 X[18/25.4] F240
G21
(PROBECLOSE)
(LOGOPEN,lines.txt)
(LOG,G21)
G38.3 X12 F1500
(LOG,G1 X#5061 Y#5062 Z#5063)
G1 X18 F6000
(LOGCLOSE)
G0 Z40
M2
"""


class TestPoints:
    """Whole touches by subroutine: oblique, in inches, with a signal delay, missed."""

    def test_oblique_touches_with_a_delay(self, tmp_path: Path, example_map: PretravelMap) -> None:
        # A probe tilted and turned in its holder, and a delay: the control must use all.
        pretravel_map = replace(
            example_map, delay=0.004, u_delay=1e-5, feed=None,
            rotation=probe_rotation((0.0, np.sin(0.05), np.cos(0.05)), 0.7),
        )  # fmt: skip
        for name, text in linuxcnc_subroutines(pretravel_map, exact_lookup(pretravel_map)).items():
            (tmp_path / name).write_text(text)
        normals = ring_pattern(np.array([20.0, 60.0]) * DEGREE, 6)
        tilt = np.tile([[0.3, -0.2, 0.1]], (len(normals), 1))
        approaches = -normals + tilt - np.sum(tilt * normals, axis=1)[:, None] * normals
        approaches /= np.linalg.norm(approaches, axis=1)[:, None]
        targets = Targets(12.5 * normals, normals, approaches)
        program = plan_program(targets, QUICK, title="oblique", feeds=[1200, 3000])
        (tmp_path / "o.ngc").write_text(
            OFFSETS.format(turn=0)
            + linuxcnc_program(program, "o_log.ngc", compensated=pretravel_map)
        )
        run_program(tmp_path / "o.ngc")
        log = read_own_log(tmp_path / "o_log.ngc")
        assert len(log.touches) == 2 * len(normals)
        points = apply(log.touches, pretravel_map)
        for label, position in zip(points.labels, points.positions, strict=True):
            assert position == pytest.approx(log.compensated[label], abs=SAME)

    def test_one_call_a_point_in_mm_and_inch(
        self, tmp_path: Path, example_map: PretravelMap
    ) -> None:
        for name, text in linuxcnc_subroutines(example_map, exact_lookup(example_map)).items():
            (tmp_path / name).write_text(text)
        program = tmp_path / "points.ngc"
        program.write_text(
            OFFSETS.format(turn=0)
            + """
G54 G61 G0 X0 Y0 Z30
(LOGOPEN,points.log)
o<pretravel_head> call
o<pretravel_point> call [0] [0] [12.5] [0] [0] [1] [1500] [1] [2] [2] [6000]
#100 = #<_pretravel_z>
o<pretravel_point> call [7.5] [0] [10] [0.6] [0] [0.8] [1500] [2]
o<pretravel_point> call [0] [0] [25] [0] [0] [1] [1500] [3] [0] [0] [0] [0] [1]
#101 = #<_pretravel_touched>
(LOGCLOSE)
G20
(LOGOPEN,inch.log)
o<pretravel_point> call [0] [0] [12.5/25.4] [0] [0] [1] [1500/25.4] [4]
#102=[#<_pretravel_travel>*1000]
(LOG,%.9f#100,#101,#<_pretravel_z>,#102)
(LOGCLOSE)
G21 G0 Z40
M2
"""
        )
        run_program(program)
        log = read_own_log(tmp_path / "points.log")
        assert log.touches.labels == ("p1", "p2")
        assert log.missed == ("p3",)
        points = apply(log.touches, example_map)
        for label, position in zip(points.labels, points.positions, strict=True):
            assert position == pytest.approx(log.compensated[label], abs=SAME)
        z, touched, inches, travel = numbers(tmp_path / "inch.log")[0]
        assert touched == 0.0
        assert inches * 25.4 == pytest.approx(z, abs=SAME)
        along = example_map.pretravel([[0.0, 0.0, 1.0]])[0]
        assert travel * 25.4e-3 == pytest.approx(along, abs=1e-7)
        # A value below 1e-4 would be printed as zero by the control: logs are in µm.
        assert along / 25.4 < 1e-4


class TestLogs:
    """Files that the control itself writes, in all cases that can mislead a reader."""

    def test_misses_repeats_inches_and_a_turn(self, tmp_path: Path) -> None:
        program = tmp_path / "logs.ngc"
        program.write_text(MISLEADING)
        run_program(program)
        plan = Targets(
            np.array([[0.0, 0, 12.5], [0.0, 0, 12.5], [60.0, 0, 12.5], [12.5, 0, 0]]),
            np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [1, 0, 0]]),
            labels=("pole.1", "pole.2", "air", "x"),
        )
        mm = read_probeopen(tmp_path / "mm.txt", "mm")
        assert len(mm.positions) == 3  # the repeat has no row, the miss has one
        found = join(mm, plan, 3.0, overtravel=2.0)
        assert found.touches.labels == ("pole.1", "x")
        assert found.missed == ("air",)
        assert "pole.2" in found.notes()[0]
        # Without the ends of the moves, a miss cannot be distinguished from a contact.
        assert any("air" in note and "miss" in note for note in join(mm, plan, 3.0).notes())
        inch = join(read_probeopen(tmp_path / "inch.txt", "inch"), plan, 3.0)
        assert inch.touches.positions[0] == pytest.approx(found.touches.positions[1], abs=3e-5)
        with pytest.raises(InputError, match=r"line of any target.*units"):
            join(read_probeopen(tmp_path / "inch.txt", "mm"), plan, 3.0)
        lines = join(read_log_positions(tmp_path / "lines.txt"), plan, 3.0)
        assert lines.touches.positions[0] == pytest.approx(inch.touches.positions[0], abs=3e-5)
        name, work = read_work_offset(tmp_path / ".machine" / "machine.var")
        assert name == "G54"
        assert work.shift == pytest.approx([100.0, 50.0, -30.0], abs=1e-6)
        assert work.vectors(np.array([[1.0, 0, 0]]))[0] == pytest.approx(
            [np.cos(25 * DEGREE), np.sin(25 * DEGREE), 0.0], abs=1e-9
        )
        tool = read_tool(tmp_path / ".machine" / "machine.tbl", 1)
        assert (tool.number, tool.length, tool.diameter) == (1, 0.0, 6.0)
        # In machine coordinates the touch is where the sphere is.
        there = inch.touches.moved(work)
        center = np.array([100.032, 50.041, -29.974])
        distance = float(np.linalg.norm(there.positions[0] - center))
        assert 15.49935 - 0.02 < distance < 15.49935

    def test_miss_and_obstacle_in_our_own_program(self, tmp_path: Path) -> None:
        places = [[0.0, 0, 12.5], [0, 0, 30], [0, 0, 12.5]]
        away = Targets(places, [[0.0, 0, 1]] * 3, labels=("hit", "air", "again"))
        program = plan_program(away, QUICK, title="one in the air")
        inside = Targets([[0.0, 0, 8.0]], [[0.0, 0, 1]], labels=("inside",))
        texts = {
            "miss": linuxcnc_program(program, "miss_log.ngc"),
            "allowed": linuxcnc_program(program, "allowed_log.ngc", allow_misses=True),
            "in": linuxcnc_program(plan_program(inside, QUICK, title="inside"), "in_log.ngc"),
        }
        for name, text in texts.items():
            (tmp_path / name).mkdir()
            (tmp_path / name / "a.ngc").write_text(OFFSETS.format(turn=0) + text)
        missed, _, met = run_together(
            (tmp_path / "miss" / "a.ngc", None, 1),
            (tmp_path / "allowed" / "a.ngc", None, 0),
            (tmp_path / "in" / "a.ngc", None, 1),
        )
        assert "air: stopped with cause 1, no contact" in missed
        assert "the probe stays tripped" not in missed
        log = read_own_log(tmp_path / "miss" / "miss_log.ngc")
        assert log.touches.labels == ("hit",)
        assert "(stopped at air: no contact): 1 of its 3" in log.warnings[0]
        log = read_own_log(tmp_path / "allowed" / "allowed_log.ngc")
        assert log.touches.labels == ("hit", "again")
        assert log.missed == ("air",)
        # On the way to its start the tip meets the sphere, and the program stops.
        assert "inside: stopped with cause 5" in met
