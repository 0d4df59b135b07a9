"""Programs for 0° and 180° of the spindle, on the model of a machine: they show the run-out."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.controls.linuxcnc_programs import linuxcnc_program
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.program import plan_program
from pretravel.files.touches_csv import read_touches
from pretravel.touches.targets import Targets
from pretravel.uncertainty.sphere_fit import fit_sphere
from tests.support.commands import run
from tests.support.judged_programs import ERROR, MACHINE, touches_on_sphere
from tests.support.machine_model.judgement import violations

EQUATOR = from_angles(np.pi / 2, np.arange(0.0, 360.0, 30.0) * DEGREE)
RUNOUT = np.array([0.012, -0.005])


def _logs(folder: Path) -> list[Path]:
    """Of both programs, as the machine writes them."""
    paths = []
    for turn in (0.0, np.pi):
        side = np.cos(turn)
        beside = (side * RUNOUT[0], side * RUNOUT[1], 0.0)
        judged = touches_on_sphere(EQUATOR, MACHINE, spindle=turn, beside=beside)
        trace = judged.run()
        assert trace.ended == "end", trace.messages
        assert violations(trace, judged.plan) == []
        path = folder / f"at_{turn / DEGREE:.0f}.log"
        path.write_text("\n".join(trace.logs["sphere_log.ngc"]) + "\n")
        paths.append(path)
    return paths


def test_run_out_is_found_from_the_logs_of_two_programs(tmp_path: Path) -> None:
    logs = _logs(tmp_path)
    assert [float(read_own_log(path).touches.spindle[0]) for path in logs] == [0.0, np.pi]  # type: ignore[index]
    shown = run("reversal", *logs, "-o", tmp_path / "means.csv", "--verbose")
    assert "12 means of two orientations" in shown
    told = re.search(r"tip offset +\((.+), (.+)\) µm, u = \((.+?), (.+?)\)", shown)
    assert told
    x, y, u_x, u_y = (float(cell) * MICROMETRE for cell in told.groups())
    assert abs(x - RUNOUT[0]) < 2 * u_x < 0.001
    assert abs(y - RUNOUT[1]) < 2 * u_y < 0.001
    both = [read_own_log(path).touches for path in logs]
    # The sphere is not where the work offset says: its true normals are turned by that.
    turned = float(np.linalg.norm(ERROR)) / 15.5
    half = 0.5 * np.sum((both[0].positions - both[1].positions)[:, :2] * EQUATOR[:, :2], axis=1)
    allowed = turned * float(np.linalg.norm(RUNOUT))
    np.testing.assert_allclose(half, -EQUATOR[:, :2] @ RUNOUT, atol=allowed)
    means = read_touches(tmp_path / "means.csv")
    radius = fit_sphere(means.positions[:, :2]).radius
    assert radius == pytest.approx(12.5 + 3.0 - 0.008, abs=0.5 * turned**2 * 15.5)


def test_the_spindle_turns_once_at_the_safe_height_and_the_log_says_where() -> None:
    up = Targets(np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), labels=("top",))
    program = plan_program(up, MACHINE, title="one")
    text = linuxcnc_program(program, "one_log.ngc", spindle=np.pi)
    lines = text.splitlines()
    (turns,) = (n for n, line in enumerate(lines) if line.startswith("M19"))
    assert lines[turns] == "M19 R180 Q10"  # without Q it would wait for ever
    first_way = next(n for n, line in enumerate(lines) if line.startswith("(touch top"))
    up_first = next(n for n, line in enumerate(lines) if line.startswith("o<pretravel_up> endif"))
    assert up_first < turns < first_way
    assert "(LOG,spindle,180,end)" in lines
    assert "M19" not in linuxcnc_program(program, "one_log.ngc")
    by_hand = linuxcnc_program(program, "one_log.ngc", spindle=np.pi, by_hand=True).splitlines()
    (waits,) = (n for n, line in enumerate(by_hand) if line == "M0")
    assert "turn the spindle to 180 degrees by hand" in by_hand[waits - 1]
    assert not any(line.startswith("M19") for line in by_hand)


def test_nothing_releases_the_oriented_spindle_before_the_end() -> None:
    """LinuxCNC clears the pins orient and locked with M3, M4 and M5 (its manual page motion)."""
    program = plan_program(
        Targets(np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]])), MACHINE, title="one"
    )
    lines = linuxcnc_program(program, "one_log.ngc", spindle=np.pi).splitlines()
    starts_or_stops = [
        n for n, line in enumerate(lines) if line.split()[:1] in (["M3"], ["M4"], ["M5"])
    ]
    assert [lines[n] for n in starts_or_stops] == ["M5 M9"]
    assert starts_or_stops[0] < lines.index("M19 R180 Q10")
    assert "M5" in linuxcnc_program(program, "one_log.ngc").splitlines()  # of each guarded move


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mill.toml").write_text(run("machine"))
    run("program", "sphere", "mill.toml", "--diameter", 25, "--spindle", 180, "-o", "at_180.ngc")
    assert "M19 R180 Q10" in Path("at_180.ngc").read_text()
    refused = run("program", "sphere", "mill.toml", "--diameter", 25, "--by-hand", "-o", "a.ngc",
                  code=2)  # fmt: skip
    assert "by hand is only for spindle" in refused
