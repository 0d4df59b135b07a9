"""Probing screens with the effective radius of the control, on the real LinuxCNC."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from pretravel.base.directions import ring_pattern
from pretravel.base.units import DEGREE, INCH, MICROMETRE
from pretravel.controls.control import ExportSettings
from pretravel.controls.exports import CONTROLS
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.program_log import FAULTS
from pretravel.files.machine import work_placement
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualifying import qualify
from tests.machine.conftest import SIMULATOR, run_program
from tests.support.simulated_probe import simulated_map, simulated_pretravel

DELAY, FEED, TURN = 0.004, 300.0, 30.0
TRAVEL = FEED / 60.0 * DELAY
# The control's radius against the map, and an edge against the wall: rounding of nine decimals.
EXACT = 1e-6
NORMALS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0.6, 0, 0.8]])

# A routine of the form that Probe Basic has, with the line of docs/how-to/linuxcnc-screens.md.
EDGE = """
o<screen_x_plus> sub
#<slow_fr> = #2
#<fast_fr> = #3
#<traverse_fr> = #4
#<max_distance> = #5
#<clearance> = #6
o<pretravel_radius> call [-1] [0] [0] [#<slow_fr>+#<fast_fr>*[#<slow_fr> LE 0]]
#<center_offset> = #<_value>
G91
F[#<fast_fr>]
G38.2 X[#<max_distance>]
#<probed> = #5061
G90
G1 F[#<traverse_fr>] X[#<probed>-#<clearance>]
o120 if [#<slow_fr> GT 0]
G91
F[#<slow_fr>]
G38.2 X[#<clearance>*2]
#<probed> = #5061
G90
G1 F[#<traverse_fr>] X[#<probed>-#<clearance>]
o120 endif
#<edge> = [#<probed>+#<center_offset>]
o<screen_x_plus> endsub [#<edge>]
"""

# Of the form of NativeCAM: a way as three arguments, one feed, a half tip diameter at the end.
WAY = """
o<screen_probe> sub
#<long> = SQRT[#1*#1+#2*#2+#3*#3]
o<pretravel_radius> call [0-#1/#<long>] [0-#2/#<long>] [0-#3/#<long>] [#<_screen_feed>]
#<radius> = #<_value>
G91
G38.2 F#<_screen_feed> X#1 Y#2 Z#3
G90
o<screen_probe> endsub [#<radius>]
"""


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[float]]:
    """One run of the control with all calls: the numbers of each line of its log, by name."""
    folder = tmp_path_factory.mktemp("screens")
    files = CONTROLS["linuxcnc"].files(simulated_map(DELAY), ExportSettings())
    for name, text in files.texts.items():
        (folder / name).write_text(text)
    # The block is turned in the machine like the work coordinates of G55.
    turned = (SIMULATOR / "probe.hal").read_text() + f"\nsetp pretravel-probe.0.turn-1 {TURN}\n"
    turned += "setp pretravel-probe.0.kind-2 0\n"
    (folder / "turned.hal").write_text(turned)
    lines = ["G21 G90 G61", "T1 M6", f"G10 L2 P2 X-80 Y20 Z-60 R{TURN}", "G55"]
    lines += ["(LOGOPEN,screens.log)"]
    for unit, scale in (("G21", 1.0), ("G20", INCH)):
        for i, normal in enumerate(NORMALS):
            where = " ".join(f"[{value:.12f}]" for value in normal)
            call = f"o<pretravel_radius> call {where} [{FEED / scale:.12f}]"
            lines += [unit, call, f"(LOG,%.9fradius {unit} {i},#<_value>)"]
    # What the caller had, is there afterwards.
    lines += ["o<caller> sub", "#<mine> = 8", "G20 G91 F77 G18"]
    lines += ["o<pretravel_radius> call [1] [0] [0] [10]"]
    lines += ["(LOG,%.9fcaller,#1,#<mine>,#<_metric>,#<_absolute>,#<_feed>,#<_plane>)"]
    lines += ["o<caller> endsub", "o<caller> call [5]", "G17 G21 G90"]
    lines += [EDGE, WAY, "G0 Z20", "G0 X-50 Y0", "G1 Z-6 F6000"]
    for name, slow in (("slow", 300), ("fast", 0)):
        call = f"o<screen_x_plus> call [1] [{slow}] [600] [6000] [12] [1] [0]"
        lines += [call, f"(LOG,%.9fedge {name},#<_value>)", "G1 X-50 F6000"]
    lines += ["#<_screen_feed> = 300", "o<screen_probe> call [12] [0] [0]"]
    lines += ["#100 = [#5061+#<_value>]", "(LOG,%.9fedge way,#100)", "G1 X-50 F6000"]
    lines += ["G0 Z20", "(LOGCLOSE)", "M2"]
    (folder / "screens.ngc").write_text("\n".join(lines) + "\n")
    run_program(folder / "screens.ngc", folder / "turned.hal")
    found = {}
    for line in (folder / "screens.log").read_text().splitlines():
        name, *values = line.split(",")
        found[name] = [float(value) for value in values]
    return found


class TestRadius:
    @pytest.mark.parametrize(("unit", "scale"), [("G21", 1.0), ("G20", INCH)])
    def test_tip_radius_less_pretravel_less_delay_travel(
        self, logged: dict[str, list[float]], unit: str, scale: float
    ) -> None:
        """In turned work coordinates, in both units."""
        machine = work_placement(0, 0, 0, TURN * DEGREE).vectors(NORMALS)
        true = 3.0 - simulated_map().pretravel(machine) - TRAVEL
        found = [logged[f"radius {unit} {i}"][0] * scale for i in range(len(NORMALS))]
        assert found == pytest.approx(true, abs=EXACT)

    def test_parameters_and_modes_of_the_caller_are_untouched(
        self, logged: dict[str, list[float]]
    ) -> None:
        argument, mine, metric, absolute, feed, plane = logged["caller"]
        assert (argument, mine) == (5.0, 8.0)
        # G20, G91, F77, G18.
        assert (metric, absolute, feed, plane) == (0.0, 0.0, 77.0, 180.0)


class TestRoutinesOfScreens:
    @pytest.mark.parametrize(("name", "feed"), [("slow", 300.0), ("fast", 600.0), ("way", 300.0)])
    def test_an_edge_is_where_the_wall_is(
        self, logged: dict[str, list[float]], name: str, feed: float
    ) -> None:
        """The simulated signal has no delay: with that of the map the edge is off by its travel."""
        assert logged[f"edge {name}"][0] == pytest.approx(-40.0 - feed / 60.0 * DELAY, abs=EXACT)


QTVCP = Path("/usr/lib/python3/dist-packages/qtvcp/widgets/probe_routines.py")
"""The routines of VersaProbe and BasicProbe, the probing pages of QtDragon."""


class _Bore:
    """A machine in the middle of a bore of 40 mm: it takes the MDI lines of QtVCP's routines."""

    def __init__(self) -> None:
        self.place = np.zeros(3)
        self.latched = np.zeros(3)
        self.relative = False

    def take(self, code: str, _: float = 0.0) -> int:
        for line in code.split("\n"):
            words = line.split()
            if "G91" in words or "G90" in words:
                self.relative = "G91" in words
            ways = {word[0]: float(word[1:]) for word in words if word[0] in "XYZ"}
            for axis, value in ways.items():
                i = "XYZ".index(axis)
                if "G38.2" in words:
                    normal = np.zeros((1, 3))
                    normal[0, i] = -np.sign(value)
                    reach = 20.0 - 3.0 + simulated_map().pretravel(normal)[0]
                    self.place[i] = np.sign(value) * reach
                    self.latched = self.place.copy()
                else:
                    self.place[i] = value + self.relative * self.place[i]
        return 0


class TestQtVcp:
    def test_one_line_in_probe(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """The recipe for QtDragon, made in the published file; Qt and the control are replaced."""
        if not QTVCP.is_file():
            pytest.skip(f"{QTVCP} is not installed")
        radii = tmp_path / "radii.json"
        radii.write_text(CONTROLS["radii"].files(simulated_map(), ExportSettings()).texts[""])
        bore = _Bore()
        parts = {"linuxcnc": SimpleNamespace(RCS_ERROR=2), "qtvcp": ModuleType("qtvcp")}
        parts["qtvcp"].logger = SimpleNamespace(getLogger=lambda _: MagicMock())
        status = MagicMock()
        status.get_probed_position_with_offsets = lambda: bore.latched
        parts["qtvcp.core"] = SimpleNamespace(Status=lambda: status, Action=MagicMock)
        for name, part in parts.items():
            monkeypatch.setitem(sys.modules, name, part)
        text = QTVCP.read_text()
        read = f'json.loads(pathlib.Path("{radii}").read_text())'
        head = f'import json, pathlib\nRADII = {read}["travel"]\n'
        where = "    def probe(self, name):\n"
        assert text.count(where) == 1
        line = '        sign = "+" if name.endswith("plus") else "-"\n'
        line += '        self.data_probe_diam = RADII[name[0] + sign]["diameter_mm"]\n'
        space: dict[str, Any] = {}
        exec(head + text.replace(where, where + line), space)
        screen = space["ProbeRoutines"]()
        for name, value in {
            "rapid_vel": 1000, "search_vel": 300, "probe_vel": 50, "max_travel": 30,
            "latch_return_dist": 1, "z_clearance": 5, "side_edge_length": 15, "xy_clearance": 3,
            "probe_diam": 6,
        }.items():  # fmt: skip
            setattr(screen, f"data_{name}", value)
        screen.allow_auto_zero = False
        screen.CALL_MDI_WAIT = bore.take
        assert screen.probe_xy_hole() == 1
        # The file has eight decimals.
        assert screen.status_d == pytest.approx(40.0, abs=4e-8)
        assert (screen.status_xc, screen.status_yc) == pytest.approx((0.0, 0.0), abs=4e-8)


MACROS = Path("/usr/share/linuxcnc/ncfiles/probe/basic_probe/macros")
"""The published routines that Probe Basic descends from; Debian's LinuxCNC brings them."""
CALLS = {"x_plus": (-1, 0), "x_minus": (1, 0), "y_plus": (0, -1), "y_minus": (0, 1)}


class TestPublishedRoutines:
    """The recipe of docs/how-to/linuxcnc-screens.md, made in the routines as they are published."""

    def test_a_bore(self, tmp_path: Path) -> None:
        if not MACROS.is_dir():
            pytest.skip(f"{MACROS} is not installed")
        files = CONTROLS["linuxcnc"].files(simulated_map(), ExportSettings())
        for name, text in files.texts.items():
            (tmp_path / name).write_text(text)
        for name, (nx, ny) in CALLS.items():
            text = (MACROS / f"probe_{name}.ngc").read_text()
            text, changed = re.subn(
                r"#<probe_center_offset> = .*",
                f"o<pretravel_radius> call [{nx}] [{ny}] [0] "
                "[#<probe_slow_fr>+#<probe_fast_fr>*[#<probe_slow_fr> LE 0]]\n"
                "#<probe_center_offset> = #<_value>",
                text,
            )
            assert changed == 1
            (tmp_path / f"probe_{name}.ngc").write_text(_without_display(text))
        text = (MACROS / "probe_round_pocket.ngc").read_text()
        (tmp_path / "plain.ngc").write_text(
            _without_display(text.replace("probe_round_pocket", "plain"))
            .replace("o<plain> endsub", _LOG_BORE.format(name="plain"))
        )  # fmt: skip
        text, changed = re.subn(r"(_probed> =) #506[12]", r"\1 #<_value>", text)
        assert changed == 4
        text, changed = re.subn(r"(#<probe_diameter_offset> =) .*", r"\1 0", text)
        assert changed == 1
        text = text.replace("probe_round_pocket", "changed")
        (tmp_path / "changed.ngc").write_text(
            _without_display(text).replace("o<changed> endsub", _LOG_BORE.format(name="changed"))
        )
        # A ring of 40 mm, its narrowest place in the plane of the ball.
        probe = (SIMULATOR / "probe.hal").read_text()
        probe += "\n".join(f"setp pretravel-probe.0.kind-{i} 0" for i in (1, 2))
        probe += "\n" + "\n".join(
            f"setp pretravel-probe.0.{name} {value}"
            for name, value in {
                "kind-0": 3, "x-0": 100, "y-0": 50, "z-0": -30, "a-0": 25, "b-0": 5,
            }.items()
        )  # fmt: skip
        (tmp_path / "ring.hal").write_text(probe + "\n")
        call = " ".join(
            # tool, z, xy, clearance, z clearance, step off, depth, slow, fast, offset, hints, mode
            f"[{value}]" for value in (1, 5, 6, 1, 1, 8, 2, 1500, 3000, 0, 0, 0, 40, 0, 1)
        )  # fmt: skip
        lines = ["G21 G90 G61", "T1 M6", "G10 L2 P1 X100 Y50 Z-30 R0", "G54", "G0 Z9", "G0 X0 Y0"]
        # z clearance, tip diameter and extra depth: the routine moves 9 mm down.
        lines += ["(LOGOPEN,bore.log)"]
        for name in ("plain", "changed"):
            lines += ["G90", "G0 X0 Y0 Z9", f"o<{name}> call {call}"]
        (tmp_path / "bore.ngc").write_text("\n".join([*lines, "(LOGCLOSE)", "M2\n"]))
        run_program(tmp_path / "bore.ngc", tmp_path / "ring.hal")
        found = {
            name: [float(value) for value in values]
            for name, *values in (
                line.split(",") for line in (tmp_path / "bore.log").read_text().splitlines()
            )
        }
        # Center, widths. The walls of a bore are touched off the centre by a micrometre at most.
        assert found["changed"] == pytest.approx([0.0, 0.0, 40.0, 40.0], abs=EXACT)
        assert abs(found["plain"][2] - 40.0) > 0.010


_LOG_BORE = (
    "(LOG,%.9f{name},#<x_center_probed>,#<y_center_probed>,#<x_probed_width>,#<y_probed_width>)\n"
    "o<{name}> endsub"
)


def _without_display(text: str) -> str:
    """Without the lines that show a value on the screen, which is not there, and the end."""
    return re.sub(r"^\s*M68 .*$|^M2 .*$", "", text, flags=re.M)


# A ring of 40 mm, the block of the guide turned by 30°, and a sphere of 25 mm.
SHAPES = {
    "kind-0": 3, "x-0": 100, "y-0": 50, "z-0": -30, "a-0": 25, "b-0": 5, "turn-1": 30,
    "kind-2": 1, "x-2": 0, "y-2": -100, "z-2": -40, "a-2": 12.5,
}  # fmt: skip
CYCLES = """
G21 G90 G94 G61
T1 M6
G10 L2 P1 X100 Y50 Z-30 R30
G10 L2 P2 X-80 Y20 Z-60 R30
G10 L2 P3 X0 Y-100 Z-40 R-20
G54
(LOGOPEN,bore.log)
o<pretravel_head> call
G0 X0.4 Y-0.3
G0 Z0
o<pretravel_bore> call [40.1] [1500] [0] [0] [6000]
#101=#<_pretravel_center_x>
#102=#<_pretravel_center_y>
#103=#<_pretravel_diameter>
#104=#<_pretravel_raw_diameter>
(LOGCLOSE)
G0 X0 Y0
o<pretravel_pocket> call [40] [0] [1500] [0] [6000]
#105=#<_pretravel_center_x>
#106=#<_pretravel_width_x>
#107=#<_pretravel_width_y>
G20
F3
o<pretravel_bore> call [40/25.4] [1500/25.4] [5] [0] [6000/25.4]
#108=[#<_pretravel_diameter>*25.4]
#109=[#<_feed>+10*#<_metric>]
G21 G0 Z60
G55 G0 X0.5 Y-0.5
G0 Z6
o<pretravel_web> call [80] [60] [12] [1500] [0] [6000]
#110=#<_pretravel_center_x>
#111=#<_pretravel_center_y>
#112=#<_pretravel_width_x>
#113=#<_pretravel_width_y>
G0 Z20
G0 X-48 Y3
G1 Z-6 F6000
o<pretravel_edge> call [0] [5.2] [1500] [0] [6000]
#114=#<_pretravel_edge>
#115=#<_pretravel_raw_edge>
o<pretravel_angle> call [0] [5.2] [10] [1500] [0] [6000]
#120=#<_pretravel_angle>
G0 Z20
G0 X3 Y-7
G0 Z7
o<pretravel_surface> call [4.1] [1500] [0] [6000]
#119=#<_pretravel_surface>
G10 L2 P4 X-80 Y20 Z-60 R30
G0 Z20
G57 G0 X-39.5 Y29.6
G0 Z8
o<pretravel_corner> call [1] [-1] [8] [14] [1500] [0] [6000] [1]
#121=#<_pretravel_corner_x>
#122=#<_pretravel_corner_y>
#123=#5281
#124=#5282
G0 Z60
G56 G0 X0.2 Y0.1
o<pretravel_boss> call [25.1] [#<_z>] [1500] [6] [0] [6000]
#116=#<_pretravel_center_x>
#117=#<_pretravel_center_y>
#118=#<_pretravel_diameter>
o<pretravel_sphere> call [0.3] [0.2] [0.1] [25] [6] [1500] [12] [5] [0] [6000]
(LOGOPEN,results.log)
"""


@pytest.fixture(scope="module")
def cycles_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cycles")
    files = CONTROLS["linuxcnc"].files(simulated_map(), ExportSettings())
    for name, text in files.texts.items():
        (folder / name).write_text(text)
    probe = (SIMULATOR / "probe.hal").read_text()
    probe += "".join(f"setp pretravel-probe.0.{n} {v}\n" for n, v in SHAPES.items())
    (folder / "table.hal").write_text(probe)
    lines = [f"(LOG,%.9f#{number})" for number in range(101, 125)]
    (folder / "cycles.ngc").write_text("\n".join([CYCLES, *lines, "(LOGCLOSE)", "M2\n"]))
    run_program(folder / "cycles.ngc", folder / "table.hal")
    return folder


@pytest.mark.slow
class TestCycles:
    """All cycles in one run, in turned work coordinates, mm and inch."""

    def test_sizes_and_places_are_those_of_the_parts(self, cycles_folder: Path) -> None:
        found = [float(value) for value in (cycles_folder / "results.log").read_text().split()]
        bore, pocket, inch, web, edge, boss = (
            found[0:4], found[4:7], found[7:9], found[9:13], found[13:15], found[15:18],
        )  # fmt: skip
        assert bore[:3] == pytest.approx([0.0, 0.0, 40.0], abs=EXACT)
        # With the tip radius alone, two pretravels are missing: 8 µm and more on each side.
        assert bore[3] > 40.016
        assert pocket == pytest.approx([0.0, 40.0, 0.0], abs=EXACT)
        # F3 of the caller is there again, and G20.
        assert inch == pytest.approx([40.0, 3.0], abs=EXACT)
        assert web == pytest.approx([0.0, 0.0, 80.0, 60.0], abs=EXACT)
        assert edge[0] == pytest.approx(-40.0, abs=EXACT)
        assert edge[1] - edge[0] > 0.005
        assert boss == pytest.approx([0.0, 0.0, 25.0], abs=EXACT)
        # The tip of the simulated map is known along its axis too; degrees of 10 mm.
        assert found[18:20] == pytest.approx([0.0, 0.0], abs=1e-5)
        assert found[20:22] == pytest.approx([-40.0, 30.0], abs=EXACT)
        cosine, sine = np.cos(TURN * DEGREE), np.sin(TURN * DEGREE)
        corner = [-80.0 - 40.0 * cosine - 30.0 * sine, 20.0 - 40.0 * sine + 30.0 * cosine]
        assert found[22:24] == pytest.approx(corner, abs=2.0 * EXACT)

    def test_the_log_has_the_points_that_python_computes(self, cycles_folder: Path) -> None:
        log = read_own_log(cycles_folder / "bore.log")
        assert log.rotation == pytest.approx(TURN * DEGREE, abs=1e-9)
        assert len(log.touches) == 4 + 8
        points = apply(log.touches, simulated_map().seen_from(log.placement))
        for label, position in zip(points.labels, points.positions, strict=True):
            # The last digit of a log is 1e-4 µm; three of them make a point.
            assert position == pytest.approx(log.compensated[label], abs=5e-7)

    def test_qualify_reads_the_sphere(self, cycles_folder: Path) -> None:
        log = read_own_log(cycles_folder / "pretravel_sphere_log.ngc")
        assert log.warnings == ()
        # The pole, and 12 on the equator: 5, 8, 11 on the rings at 22.5, 45, 67.5°.
        assert len(log.touches) == 1 + 5 + 8 + 11 + 12
        found = qualify(log.touches.moved(log.placement), 25.0, tip_diameter=6.0, kind="harmonic")
        directions = ring_pattern(np.array([30.0, 60.0, 90.0]) * DEGREE, 20)
        off = found.pretravel_map.pretravel(directions) - simulated_pretravel(directions)
        # Of so few touches: what the map shows beyond that is not the log's.
        assert np.max(np.abs(off)) < 1.0 * MICROMETRE


FAULTY = """
G21 G90 G94 G61
T1 M6
G10 L2 P1 X100 Y50 Z-30 R0
G54 G0 X0.2 Y-0.1
G0 Z0
o<pretravel_bore> call [40] [1500] [4] [0] [3000]
M2
"""


@pytest.mark.slow
class TestFaultsOfCycles:
    """A bore with each fault of the simulated probe; all faults at all contacts: tests/laws."""

    @pytest.mark.parametrize(
        ("fault", "after", "cause"),
        [(1, 5, 1), (2, 2, 4), (3, 0, 2), (4, 0, 6), (6, 1, 1), (7, 0, 2)],
    )
    def test_ends_in_a_message(self, tmp_path: Path, fault: int, after: int, cause: int) -> None:
        files = CONTROLS["linuxcnc"].files(simulated_map(), ExportSettings())
        for name, text in files.texts.items():
            (tmp_path / name).write_text(text)
        values = SHAPES | {"fault": fault, "fault-after": after, "fault-size": 1.7}
        probe = (SIMULATOR / "probe.hal").read_text()
        probe += "".join(f"setp pretravel-probe.0.{n} {v}\n" for n, v in values.items())
        (tmp_path / "faulty.hal").write_text(probe)
        (tmp_path / "faulty.ngc").write_text(FAULTY)
        output = run_program(tmp_path / "faulty.ngc", tmp_path / "faulty.hal", code=1)
        assert f"stopped with cause {cause}, {FAULTS[cause - 1]}" in output
        # 1.2 mm beyond the wall, 0.2 mm of the middle, and the way to stop.
        deepest = re.search(r"largest depth of the straight tip: (\S+) mm", output)
        assert deepest is not None
        assert float(deepest[1]) < 1.5
