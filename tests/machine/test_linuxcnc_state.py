"""On the real LinuxCNC: modes, logs that cannot be written, the way to stop, one false trip."""

from __future__ import annotations

import re
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from pretravel.files.machine import Machine
from tests.machine.conftest import run_program, simulated
from tests.machine.modal_groups import GROUPS, PAGE, groups_of_the_control, rows
from tests.machine.test_linuxcnc import hal
from tests.machine.test_linuxcnc_aborts import aborted, installed
from tests.machine.test_linuxcnc_faults import HOME, SPIKE, depth_of, program_text
from tests.support.linuxcnc_interpreter import interpret

PAGE_SIZE = resource.getpagesize()
RING = {
    "kind-0": 3, "x-0": 100.0, "y-0": 50.0, "z-0": -30.0, "a-0": 25.0, "b-0": 5.0, "kind-1": 0,
    "kind-2": 0,
}  # fmt: skip
"""A bore of 40 mm at the origin of G54."""


def bored(folder: Path, call: str, **probe: float) -> tuple[str, float]:
    """What the control says of a call in the bore, and where X of G54 is after it."""
    folder.mkdir()
    installed(folder)
    text = f"G21 G90 G94 G54\n{HOME}G0 Z60\nG0 X0.2 Y-0.1\nG0 Z0\n{call}\nM2\n"
    (folder / "bore.ngc").write_text(text)
    simulated(folder / "bore.ngc", hal(folder / "ring.hal", **RING, **probe))
    variables = (folder / ".machine" / "machine.var").read_text()
    offset = re.search(r"^5221\s+(\S+)", variables, re.M)
    assert offset
    return (folder / ".machine" / "linuxcnc.log").read_text(), float(offset[1])


class TestOneFalseTrip:
    CALL = "o<pretravel_bore> call [40] [100] [8] [1] [6000] [1]"

    def test_no_result_and_no_origin(self, tmp_path: Path) -> None:
        """0.6 mm early at touch 10 of 12: 39.852 mm and an origin 0.15 mm off were the result.

        A chip stands for the false trip: in the direction of that touch alone, 225 degrees.
        """
        place = -20.4 * 0.5**0.5
        chip = {"kind_3": 1, "x_3": 100 + place, "y_3": 50 + place, "z_3": -30.0, "a_3": 1.0}
        said, origin = bored(tmp_path / "a", self.CALL, **chip)
        assert "a false trip, dirt, or a form error. Nothing is set" in said
        assert origin == 100.0

    def test_a_wall_is_touched_twice(self, tmp_path: Path) -> None:
        """A signal of 2 ms, 0.6 mm before the wall: one touch alone would set the origin there."""
        call = "o<pretravel_edge> call [0] [16.8] [100] [1] [6000] [1]"
        spike = {"fault": SPIKE, "fault_after": 0, "fault_size": 0.6}
        said, origin = bored(tmp_path / "a", call, **spike)
        assert "two touches of the same place differ by 0." in said
        assert origin == 100.0

    def test_without_it_the_origin_is_set(self, tmp_path: Path) -> None:
        said, origin = bored(tmp_path / "a", self.CALL)
        assert re.search(r"diameter 40\.000\d\d, not compensated 40\.0\d+, scatter 0\.000", said)
        assert origin == pytest.approx(100.0, abs=2e-4)


class TestCorrection:
    """A bore of 40.000 mm: the tool has cut it 14 µm too small or so, as the nominal size says."""

    BORE = "o<pretravel_bore> call [40] [100] [8] [1] [6000]\n"

    @pytest.mark.parametrize(
        ("nominal", "limit", "words", "diameter"),
        [
            (40.014, 0.05, "the radius of T2 is now 4.993", 9.986),
            (40.002, 0.05, "is within its uncertainty, T2 is not changed", 10.0),
            pytest.param(40.1, 0.05, "nothing is changed", 10.0, marks=pytest.mark.slow),
        ],
    )
    def test_the_tool_table(
        self, tmp_path: Path, nominal: float, limit: float, words: str, diameter: float
    ) -> None:
        call = f"o<pretravel_correct> call [1] [{nominal}] [0.003] [{limit}] [2] [10]"
        said, _ = bored(tmp_path / "a", self.BORE + call)
        assert words in said
        table = (tmp_path / "a" / ".machine" / "machine.tbl").read_text()
        cutter = re.search(r"^T2 .*D\+?(\S+)", table, re.M)
        assert cutter
        # The map of the cycle is that of the probe up to 0.1 µm.
        assert float(cutter[1]) == pytest.approx(diameter, abs=4e-4)

    def test_a_result_is_used_once(self, tmp_path: Path) -> None:
        call = "o<pretravel_correct> call [1] [40.014] [0.003] [0.05] [2] [10]"
        said, _ = bored(tmp_path / "a", f"{self.BORE}{call}\n{call}")
        assert "no cycle has measured this since the last correction" in said


class TestWayToStop:
    @pytest.mark.parametrize("mode", ["G64", pytest.param("G61", marks=pytest.mark.slow)])
    def test_it_is_within_what_is_planned(self, tmp_path: Path, mode: str) -> None:
        """From 600 mm/s with 100000 mm/s²: 1.8 mm were planned, and the tip travelled 5.1."""
        program = tmp_path / "down.ngc"
        program.write_text(f"G21 G90 {mode}\nG0 X100.032 Y50.041 Z20\nG38.3 Z-60 F36000\nM2\n")
        depth = depth_of(run_program(program))
        fast = Machine(acceleration=1e5, positioning_feed=1e4, measuring_feed=50.0)
        planned = fast.stopping_distance(36000.0)
        assert depth < planned
        assert mode == "G61" or depth > 0.9 * planned


@contextmanager
def _disk(folder: Path) -> Iterator[Path]:
    """A disk of one page, on which the log of the program in the folder is."""
    disk = folder / "disk"
    disk.mkdir()
    mounted = ["mount", "-t", "tmpfs", "-o", f"size={PAGE_SIZE}", "tmpfs", str(disk)]
    if subprocess.run(mounted, check=False, capture_output=True).returncode:
        pytest.skip("NOT TESTED: a disk of one page needs the rights of root")
    try:
        (folder / "sphere_log.ngc").symlink_to(disk / "sphere_log.ngc")
        yield disk
    finally:
        subprocess.run(["umount", str(disk)], check=True)


class TestLog:
    @pytest.mark.parametrize("obstacle", ["folder", "link"])
    def test_where_the_file_cannot_be_written_nothing_moves(
        self, tmp_path: Path, obstacle: str
    ) -> None:
        """The control says nothing; the log of yesterday was read as that of today."""
        log = tmp_path / "sphere_log.ngc"
        if obstacle == "folder":
            log.mkdir()
        else:
            log.symlink_to(tmp_path / "nowhere" / "sphere_log.ngc")
        (tmp_path / "sphere.ngc").write_text("G21\n" + HOME + program_text())
        said = run_program(tmp_path / "sphere.ngc", code=1)
        assert "sphere_log" in said
        assert depth_of(said) < -50.0
        assert "touches are in" not in said

    def test_a_log_of_yesterday_that_is_read_only(self, tmp_path: Path) -> None:
        """It is read in place of what was written, and has the number that comes first."""
        old = "o<sphere_log> sub\no<sphere_log> endsub [1000001]\n"
        with _disk(tmp_path) as disk:
            (disk / "sphere_log.ngc").write_text(old)
            subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            (tmp_path / "sphere.ngc").write_text("G21\n" + HOME + program_text())
            said = run_program(tmp_path / "sphere.ngc", code=1)
        assert "the control cannot write sphere_log.ngc" in said
        assert depth_of(said) < -50.0
        assert "touches are in" not in said

    def test_a_disk_that_becomes_full_on_the_way(self, tmp_path: Path) -> None:
        """A disk of one page: the program begins, and its touches do not fit."""
        with _disk(tmp_path):
            (tmp_path / "sphere.ngc").write_text("G21\n" + HOME + program_text(count=24))
            said = run_program(tmp_path / "sphere.ngc", code=1)
        # What it reads back ends in the middle: the interpreter stops before our message.
        assert "File ended with no percent sign or program end" in said
        assert "touches are in" not in said


class TestModes:
    BEFORE = "G20 G91 G55 G18 G93 G61 G90.1 G99"

    def test_every_group_of_the_control_is_in_the_table(self) -> None:
        ours = {group.name for group in GROUPS if group.name.startswith("GM_")}
        assert groups_of_the_control() == ours
        told = PAGE.read_text()
        assert all(row in told for row in rows())

    def test_a_normal_end_is_as_the_page_says(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """M2 selects G17, G54, G90 and G94; all else is as before."""
        monkeypatch.setenv("PRETRAVEL_STARTUP", self.BEFORE)
        (tmp_path / "sphere.ngc").write_text(program_text(count=4))
        home = "G10 L2 P1 X[100/25.4] Y[50/25.4] Z[-30/25.4] R0\n"
        (tmp_path / "sphere.ngc").write_text(home + program_text(count=4))
        said = run_program(tmp_path / "sphere.ngc")
        modes = re.search(r"modes at the end: ([^,]*)", said)
        assert modes
        assert set(modes[1].split()) >= {
            "G17", "G20", "G40", "G54", "G61", "G90", "G90.1", "G94", "G99"
        }  # fmt: skip

    @pytest.mark.parametrize(
        ("startup", "words"),
        [("G21 G7", "G7 is active"), ("G21 G17 G41.1 D6", "cutter compensation is active")],
    )
    def test_what_a_program_refuses_by_name(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, startup: str, words: str
    ) -> None:
        """Under G7 the tip met the sphere 0.84 mm deep at 3000 mm/min."""
        monkeypatch.setenv("PRETRAVEL_STARTUP", startup)
        (tmp_path / "sphere.ngc").write_text(program_text())
        said = run_program(tmp_path / "sphere.ngc", code=1)
        assert words in said
        assert depth_of(said) < -50.0

    def test_an_error_under_cutter_compensation_is_the_only_message(self, tmp_path: Path) -> None:
        """The handler switched the overrides on, which the control refuses under G41."""
        installed(tmp_path)
        text = "G21 G17 G90 G94 F3000\nG41.1 D6\nG1 X10 Y0\nX20 Y10\nG41.1 D6\nX30\nM2\n"
        (tmp_path / "program.ngc").write_text(text)
        run = {"before": ["G21", "G53 G0 X0 Y0"], "how": "own", "after_s": 0.5}
        states, _ = aborted(tmp_path / "program.ngc", [run])
        (said,) = states[0]["said"]
        assert "cutter" in said.lower()
        assert "overrides" not in said


class TestSurprises:
    """The rows of the page's last table."""

    def test_what_the_control_does(self, tmp_path: Path) -> None:
        program = tmp_path / "told.ngc"
        program.write_text(
            "G21 G90 G54\n(LOGOPEN,told.txt)\n"
            "G0 X100.032 Y50.041 Z0\nG38.3 Z-20 F600\nG38.3 Z-20 F600\n"
            "#<start> = #<_z>\n(LOG,%.4f#5070,#5063,#<start>)\n"
            "#<small> = 0.00005\n(LOG,%.7f#<small>)\n(LOGCLOSE)\n"
            "G38.5 Z0 F600\nG0 Z0\n"
            "(PROBEOPEN first.txt)\nG38.3 Z-20 F600\n(PROBECLOSE)\nG38.5 Z0 F600\nG0 Z0\n"
            "(PROBEOPEN second.txt)\nG38.3 Z-20 F600\n(PROBECLOSE)\nG38.5 Z0 F600\nM2\n"
        )
        run_program(program)
        touch, small = (tmp_path / "told.txt").read_text().split()
        tripped, z, start = (float(value) for value in touch.split(","))
        assert tripped == 1.0
        assert z == pytest.approx(start, abs=0.02)  # where the tip stopped after the contact
        assert float(small) == 0.0
        assert (tmp_path / "first.txt").read_text().count("\n") == 1
        assert (tmp_path / "second.txt").read_text() == ""

    def test_the_interpreter_alone_is_an_inch_machine(self, tmp_path: Path) -> None:
        text = "G21\nG10 L2 P1 X25.4\n(PRINT,offset %.4f#5221)\nM2\n"
        (tmp_path / "a.ngc").write_text(text)
        assert "offset 1.0000" in interpret(tmp_path / "a.ngc").stdout
