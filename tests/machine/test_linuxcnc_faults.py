"""On the real LinuxCNC: probes that misbehave, wrong tools and maps; the ball is never crushed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import ring_pattern
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_programs import linuxcnc_program
from pretravel.controls.linuxcnc_state import state_subroutines
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.program import plan_program
from pretravel.controls.program_log import FAULTS
from pretravel.controls.surroundings import SphereObstacle
from pretravel.files.machine import Machine, work_placement
from pretravel.touches.targets import Targets
from tests.machine.conftest import SIMULATOR, run_program, run_together
from tests.support.example_maps import mean_map
from tests.support.linuxcnc_interpreter import interpret

QUICK = Machine(
    measuring_feed=600.0, positioning_feed=12000.0, acceleration=20000.0, safe_height=40.0
)
NEVER, STAYS, EARLY, ALWAYS, BOUNCES, LATE, SPIKE = range(1, 8)
"""Faults of the simulated probe, as its source numbers them."""
HOME = "G10 L2 P1 X100 Y50 Z-30 R0\n"
HOME_IN_INCHES = "G10 L2 P1 X[100/25.4] Y[50/25.4] Z[-30/25.4] R0\n"
OWN_MESSAGE = re.compile(r"control: (\S+): stopped with cause (\d), ")
CONTROL_STOPS = "Probe tripped during non-probe move."
"""The control itself stops where the probe closes during a move that is no probing move."""


def program_text(machine: Machine = QUICK, count: int = 6) -> str:
    normals = ring_pattern(np.array([0.0, 50.0, 90.0]) * DEGREE, count)
    labels = tuple(f"s{i + 1}" for i in range(len(normals)))
    targets = Targets(12.5 * normals, normals, labels=labels)
    sphere = SphereObstacle(np.zeros(3), 12.5)
    program = plan_program(targets, machine, title="sphere", obstacles=[sphere])
    return linuxcnc_program(program, "sphere_log.ngc")


def faulty(path: Path, fault: int, after: int, size: float = 1.7) -> Path:
    lines = (SIMULATOR / "probe.hal").read_text().splitlines()
    values = {"fault": fault, "fault-after": after, "fault-size": size}
    lines += [f"setp pretravel-probe.0.{name} {value}" for name, value in values.items()]
    path.write_text("\n".join(lines) + "\n")
    return path


def depth_of(output: str) -> float:
    found = re.search(r"largest depth of the straight tip: (\S+) mm", output)
    assert found, output
    return float(found[1])


@pytest.fixture
def sphere(tmp_path: Path) -> Path:
    path = tmp_path / "sphere.ngc"
    path.write_text("G21\n" + HOME + program_text())
    return path


class TestProbeFaults:
    @pytest.mark.parametrize(
        ("fault", "after", "label", "cause", "deepest"),
        [
            # The end of a touch is 2 mm below the nominal surface; the sphere lies 0.03 mm off.
            (NEVER, 2, "s3", 1, 2.1),
            (SPIKE, 0, "s1", 2, -1.0),
            (ALWAYS, 0, "s1", 6, -50.0),
            pytest.param(STAYS, 2, "s3", 4, 0.1, marks=pytest.mark.slow),
            pytest.param(LATE, 2, "s3", 3, 1.8, marks=pytest.mark.slow),
        ],
    )
    def test_the_program_stops_and_names_the_touch(
        self, sphere: Path, fault: int, after: int, label: str, cause: int, deepest: float
    ) -> None:
        output = run_program(sphere, faulty(sphere.parent / "f.hal", fault, after), code=1)
        assert f"control: {label}: stopped with cause {cause}, {FAULTS[cause - 1]}\n" in output
        assert depth_of(output) < deepest
        log = sphere.with_name("sphere_log.ngc").read_text().splitlines()
        assert log[-1] == f"stopped,{label},{cause},end"
        if after:
            assert len(read_own_log(sphere.with_name("sphere_log.ngc")).touches) == after

    @pytest.mark.slow
    def test_a_probe_that_bounces_is_measured_with(self, sphere: Path) -> None:
        """It closes again for 3 ms, 5 ms after it opened, twice."""
        run_program(sphere, faulty(sphere.parent / "f.hal", BOUNCES, 2))
        assert len(read_own_log(sphere.with_name("sphere_log.ngc")).touches) == 12

    @pytest.mark.slow
    @pytest.mark.parametrize("seed", range(10))
    def test_random_faults_end_in_a_message(self, sphere: Path, seed: int) -> None:
        random = np.random.default_rng(seed)
        fault = int(random.choice([NEVER, STAYS, EARLY, ALWAYS, LATE, SPIKE]))
        # Beyond the clearance of 1 mm; nearer than that, a fault is an error of measurement.
        after, size = int(random.integers(0, 12)), float(random.uniform(1.1, 6.0))
        probe = faulty(sphere.parent / "f.hal", fault, after, size)
        output = run_program(sphere, probe, code=1)
        assert OWN_MESSAGE.search(output) or CONTROL_STOPS in output
        assert depth_of(output) < 2.1
        assert "done," not in sphere.with_name("sphere_log.ngc").read_text()


class TestStateAndTool:
    def test_modes_come_back_and_the_feed_is_as_programmed(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setenv("PRETRAVEL_STARTUP", "G20 G91 G55 G64 P0.001 G17 G94")
        # A latch by cycle shows the feed: 0.04 mm a cycle at 2400 mm/min.
        machine = replace(QUICK, measuring_feed=2400.0)
        folders = {name: tmp_path / name for name in ("slow", "fast", "stopped")}
        for folder in folders.values():
            folder.mkdir()
            (folder / "sphere.ngc").write_text(HOME_IN_INCHES + program_text(machine, count=4))
            probe = faulty(folder / "f.hal", SPIKE if folder.name == "stopped" else 0, 0)
            if folder.name != "stopped":
                probe.write_text(probe.read_text() + "setp pretravel-probe.0.hardware-latch 0\n")
        slow, _, stopped = run_together(
            *(
                (folders[name] / "sphere.ngc", folders[name] / "f.hal", code, override)
                for name, code, override in (
                    ("slow", 0, 0.5),
                    ("fast", 0, 1.0),
                    ("stopped", 1, 0.5),
                )
            )
        )
        # The end of a program (M2) itself selects G90 and G54.
        assert re.search(r"modes at the end: .*G20.*G64.*G90", slow)
        assert re.search(r"modes at the end: .*G20.*G55.*G64.*G91 ", stopped)
        places = [
            read_own_log(folders[name] / "sphere_log.ngc").touches.positions.tolist()
            for name in ("slow", "fast")
        ]
        assert places[0] == places[1]

    def test_another_length_or_map_is_noticed_before_the_first_move(self, tmp_path: Path) -> None:
        # T1 of the simulated machine has the length zero.
        machine = replace(QUICK, tool=1, tool_length=80.0, change_height=10.0)
        elsewhere = replace(QUICK, work=work_placement(100.0, 50.0, -28.0))
        one = Targets([[0.0, 0, 12.5]], [[0.0, 0, 1]], labels=("top",))
        program = plan_program(one, QUICK, title="top")
        compensated = linuxcnc_program(program, "sphere_log.ngc", compensated=mean_map(0.016))
        texts = {
            "length": program_text(machine),
            "no-tool": program_text(replace(machine, change_height=None)),
            "offset": program_text(elsewhere),
            "another-map": compensated,
            "same-map": compensated,
        }
        for name, text in texts.items():
            (tmp_path / name).mkdir()
            (tmp_path / name / "sphere.ngc").write_text("G21\n" + HOME + text)
        for name, amplitude in (("another-map", 0.017), ("same-map", 0.016)):
            own = mean_map(amplitude)
            for file, subroutine in linuxcnc_subroutines(own, exact_lookup(own)).items():
                (tmp_path / name / file).write_text(subroutine)
        said = run_together(
            *((tmp_path / name / "sphere.ngc", None, int(name != "same-map")) for name in texts)
        )
        refused = dict(zip(texts, said, strict=True))
        told = "the tool length of T1 is 0.000 mm, 0.000 mm aside, but 80 mm"
        assert told in refused["length"]
        assert depth_of(refused["length"]) < -50.0
        assert "tool 0 is in the spindle: load the probe first, T1 M6" in refused["no-tool"]
        told = "G54 is at X100.000 Y50.000 Z-30.000, turned by 0.00; the machine file"
        assert told in refused["offset"]
        assert "belong to another map" in refused["another-map"]
        logs = [name for name in texts if (tmp_path / name / "sphere_log.ngc").exists()]
        assert logs == ["same-map"]
        log = read_own_log(tmp_path / "same-map" / "sphere_log.ngc")
        assert log.touches.labels == ("top",)


def test_a_preview_shows_all_touches(tmp_path: Path) -> None:
    """No probe trips in a preview, and no tool is in the spindle; it is no error."""
    machine = replace(QUICK, tool=1, tool_length=80.0, work=work_placement(1.0, 2.0, 3.0))
    path = tmp_path / "sphere.ngc"
    path.write_text(program_text(machine))
    for name, text in state_subroutines().items():
        (tmp_path / name).write_text(text)
    shown = interpret(path)
    assert "PROGRAM_END" in shown.stdout, shown.stderr
    # The start, the touch and the way back of each of the 12 touches, and more.
    assert shown.stdout.count("STRAIGHT_PROBE") > 36


LONG = "G21 G90\no1 repeat [8]\nG1 X50 F6000\nG1 X0 F6000\no1 endrepeat\nM2\n"
"""Moves for 8 s, after 2 s in which the machine comes up."""


def task_of(folder: Path) -> int | None:
    """The process that interprets the programs of a folder."""
    found = subprocess.run(["pgrep", "-f", f"^milltask .*{folder}"], capture_output=True, text=True)
    return int(found.stdout.split()[0]) if found.stdout else None


@contextmanager
def running(program: Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The simulated machine in the middle of the program, and its task."""
    program.write_text(LONG)
    arguments = [str(SIMULATOR / "simulate"), str(program)]
    pipe = subprocess.PIPE
    with subprocess.Popen(arguments, text=True, stderr=pipe, stdout=pipe) as simulator:
        while (task := task_of(program.parent)) is None:
            assert simulator.poll() is None, simulator.communicate()
            time.sleep(0.2)
        time.sleep(3.0)
        yield simulator, task


@pytest.mark.slow
def test_a_program_is_run_again_when_the_task_of_the_control_is_killed(tmp_path: Path) -> None:
    with running(tmp_path / "back_and_forth.ngc") as (simulator, task):
        os.kill(task, signal.SIGKILL)
        output, errors = simulator.communicate(timeout=120)
    assert simulator.returncode == 0, output + errors
    assert "a fault of its own (attempt 1)" in errors


@pytest.mark.slow
def test_an_interpreter_beside_does_not_disturb(tmp_path: Path) -> None:
    """The interpreter empties a file in the home that the running control has mapped."""
    tiny = tmp_path / "tiny.ngc"
    tiny.write_text("G21\nM2\n")
    with running(tmp_path / "back_and_forth.ngc") as (simulator, _):
        while simulator.poll() is None:
            subprocess.run(["rs274", "-g", str(tiny)], capture_output=True, check=False)
        output, errors = simulator.communicate()
    assert simulator.returncode == 0, output + errors
    assert "a fault of its own" not in errors
