"""On the real LinuxCNC: a rotary axis, from the program to the pins of the control."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.machine_text import machine_text
from pretravel.files.machine import Machine, work_placement
from tests.machine.conftest import SIMULATOR, run_program
from tests.support.commands import rows, run

ORIGIN = np.array([100.0, 50.0, -30.0])
"""Of G54, near the centre of the sphere of probe.hal."""
QUICK = Machine(
    measuring_feed=3000.0, positioning_feed=24000.0, acceleration=100000.0, safe_height=36.0,
    work=work_placement(*ORIGIN), limits=np.array([[-250.0, 250], [-200, 200], [-200, 200]]),
)  # fmt: skip
OFFSETS = "G21\nG10 L2 P1 X100 Y50 Z-30 R0\n"
PLACE, ALONG = np.array([40.012, 49.993, 0.0]), np.array([0.0002, -0.0003, 1.0])
"""Of the axis C: rotary.hal."""


def touched(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    *words: object,
    letter: str = "C",
    table: Path | None = None,
    probe: Path | None = None,
    code: int = 0,
    machine: Machine = QUICK,
) -> Path:
    """Write the program of a rotary axis, and run it; returns its log."""
    folder.mkdir()
    (folder / "mill.toml").write_text(machine_text(machine))
    program = folder / "axis.ngc"
    run("program", "axis", folder / "mill.toml", "--axis", letter, "--diameter", 24.9987, *words,
        "-o", program)  # fmt: skip
    program.write_text(OFFSETS + program.read_text())
    monkeypatch.setenv("PRETRAVEL_ROTARY", letter)
    if table is not None:
        monkeypatch.setenv("PRETRAVEL_ROTARY_HAL", str(table))
    (folder / "said.txt").write_text(run_program(program, probe, code))
    return folder / "axis_log.ngc"


def _labels(log: Path, beginning: str) -> list[str]:
    return [line for line in log.read_text().splitlines() if line.startswith(f"touch,{beginning}")]


def changed(path: Path, source: str, **values: float) -> Path:
    """A .hal file with other parameters: the last setp of each counts."""
    lines = [(SIMULATOR / source).read_text()]
    lines += [f"setp pretravel-probe.0.{k.replace('_', '-')} {v}" for k, v in values.items()]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def probe_map(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the simulated probe, from its touches on the sphere without a rotary axis."""
    folder = tmp_path_factory.mktemp("sphere")
    (folder / "mill.toml").write_text(machine_text(QUICK))
    run("program", "sphere", folder / "mill.toml", "--diameter", 24.9987, "-o", folder / "s.ngc")
    (folder / "s.ngc").write_text(OFFSETS + (folder / "s.ngc").read_text())
    run_program(folder / "s.ngc")
    run("qualify", folder / "s_log.ngc", "--diameter", 24.9987, "--tip-diameter", 6, "-o",
        folder / "map.json")  # fmt: skip
    return folder / "map.json"


def test_axis_c_from_the_program_to_the_pins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, probe_map: Path
) -> None:
    """Two radii, a map of the same probe; the truth is that of the simulated table."""
    # Stated 0.3 mm off: at 180 degrees the sphere is off by twice that, and the clearance is 1 mm.
    about = ("--about", "-60.2,0.2,0")
    log = touched(
        tmp_path / "one", monkeypatch, *about, "--angles", "0:300:60", "--center", "0,0,0"
    )
    near = changed(tmp_path / "near.hal", "probe.hal", x_0=80.0, y_0=70.0, z_0=-20.0)
    check = touched(
        tmp_path / "two", monkeypatch, *about, "--angles", "0:300:60", "--center=-20,20,10",
        probe=near,
    )  # fmt: skip
    own = read_own_log(log)
    assert own.missed == ()
    assert len(own.touches) == 6 * len(_labels(log, "at60_"))
    stated = ("--axis", "C", "--map", probe_map, "--work", "100,50,-30", "--check", check)
    said = run("axis", log, *stated, "-o", tmp_path / "axis.csv")
    assert "against the angle" in said
    assert "check at another radius" in said
    found = {row["quantity"]: row for row in rows(tmp_path / "axis.csv")}
    height = float(re.search(r"at z = (-?[\d.]+)", said)[1])  # type: ignore[index]
    there = PLACE + ALONG * height
    for i, name in enumerate("xy"):
        place, slope = found[f"place_{name}_mm"], found[f"slope_{name}_mm_per_m"]
        off = abs(float(place["value"]) - there[i])
        # The latch is exact: what is left is the error of the map, and U states it.
        assert off < float(place["expanded_uncertainty"])
        assert off < 5e-4
        off = abs(float(slope["value"]) - 1e3 * ALONG[i])
        assert off < float(slope["expanded_uncertainty"])
    run("axis", log, *stated, "-o", tmp_path / "axis.hal")
    pins = (tmp_path / "axis.hal").read_text()
    x = float(re.search(r"setp xyzac-trt-kins.x-rot-point (\S+)", pins)[1])  # type: ignore[index]
    assert x == pytest.approx(float(found["place_x_mm"]["value"]), abs=1e-6)


def test_axis_a_tilts_the_sphere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, probe_map: Path
) -> None:
    """An axis along x, 60 mm below the sphere, which turns with the angle."""
    table = changed(
        tmp_path / "a.hal", "rotary.hal", axis_x=0.0, axis_y=50.02, axis_z=-89.98, axis_i=1.0,
        axis_j=0.0004, axis_k=-0.0001, axis_sense=1,
    )  # fmt: skip
    # The sphere of probe.hal is where it is at the angle zero.
    log = touched(
        tmp_path / "a", monkeypatch, "--angles=0,-40,-20,25", "--center", "0,0,0", "--about",
        "0,0,-60", "--sense", "with", "--polar", "0,30,60", letter="A", table=table,
    )  # fmt: skip
    said = run("axis", log, "--axis", "A", "--map", probe_map, "--work", "100,50,-30", "-o",
               tmp_path / "a.csv")  # fmt: skip
    assert "with the angle" in said
    height = float(re.search(r"at x = (-?[\d.]+)", said)[1])  # type: ignore[index]
    true = {
        "place_y_mm": 50.02 + 0.0004 * height,
        # The probe has 1.3 µm along its axis, of which a sphere tells nothing: 1 is assumed.
        "place_z_mm": -89.98 - 0.0001 * height - 0.0003,
        "slope_y_mm_per_m": 0.4, "slope_z_mm_per_m": -0.1,
    }  # fmt: skip
    for row in rows(tmp_path / "a.csv"):
        off = abs(float(row["value"]) - true[row["quantity"]])
        # The latch is exact: what is left is the error of the map.
        assert off < float(row["expanded_uncertainty"]), row


def test_the_other_sense_stops_at_the_second_angle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = touched(
        tmp_path / "w", monkeypatch, "--angles", "0,60,120", "--center", "0,0,0", "--about",
        "-60,0,0", "--sense", "with", code=1,
    )  # fmt: skip
    said = (log.parent / "said.txt").read_text()
    assert "at60_s1: stopped with cause 1, no contact" in said
    assert "(stopped at at60_s1: no contact)" in read_own_log(log).warnings[0]


def test_a_turned_work_offset_is_refused_for_a(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The machine file does not state the place of G54, whose turn is 20 degrees."""
    folder = tmp_path / "t"
    unknown = replace(QUICK, work=None)
    monkeypatch.setattr("tests.machine.test_linuxcnc_axis.OFFSETS", OFFSETS.replace("R0", "R20"))
    touched(
        folder, monkeypatch, "--angles=-40,0,25", "--center", "0,0,0", "--about", "0,0,-60",
        "--polar", "0,30", letter="A", code=1, machine=unknown,
    )  # fmt: skip
    assert "G54 is turned by 20.000 degrees about Z" in (folder / "said.txt").read_text()
