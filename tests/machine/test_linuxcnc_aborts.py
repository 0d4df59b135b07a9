"""On the real LinuxCNC: what an abort, an emergency stop and a power-off leave behind."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup_formula import exact_lookup
from tests.machine.conftest import SIMULATOR, environment
from tests.machine.test_linuxcnc_faults import QUICK, depth_of, program_text
from tests.support.simulated_probe import simulated_map

INTERFACE = Path(__file__).parent / "interface_of_aborts.py"
HOWS = ("abort", "estop", "off", "error")


def random_states(random: np.random.Generator) -> list[str]:
    """MDI lines for modes, before the start of a program.

    After Esc within a probing move LinuxCNC itself gives back the G64 P of the last move that was
    no probing move, whatever has been set since; so the moves come after it here.
    """
    lines = [
        f"G64 P{random.uniform(0.001, 0.1):.4f}",
        "G53 G0 X0 Y0",
        "G53 G0 X1",
        f"G{random.integers(20, 22)}",
        f"G{random.integers(17, 20)} G{random.integers(90, 92)} G{random.integers(54, 60)}",
        f"G{random.choice([94, 94, 95])} F{random.uniform(1.0, 900.0):.4f}",
        f"M52 P{random.integers(0, 2)}",
    ]
    length = random.choice(["none", "own", "table", "typed"])
    if length == "own":
        lines += ["T1 M6", "G43"]
    elif length == "table":
        lines += ["T1 M6", "G43 H2"]
    elif length == "typed":
        lines += ["T1 M6", f"G43.1 X0.5 Y-0.25 Z{random.uniform(0.1, 3.0):.4f}"]
    return lines


def aborted(program: Path, runs: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], str]:
    """Abort a program in each of the runs; the states before and after, and the output."""
    states = program.parent / "states.json"
    given = environment(
        PRETRAVEL_INTERFACE=str(INTERFACE),
        PRETRAVEL_ABORTS=json.dumps(runs),
        PRETRAVEL_STATES=str(states),
    )
    command = [str(SIMULATOR / "simulate"), str(program), str(program.parent / "long.hal")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=given)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(states.read_text()), done.stdout + done.stderr


def installed(folder: Path, tool: int | None = None) -> None:
    """All subroutines of a map, and a tool table with a second length."""
    pretravel_map = simulated_map()
    form = exact_lookup(pretravel_map)
    assert form is not None
    for name, text in linuxcnc_subroutines(pretravel_map, form, tool=tool).items():
        (folder / name).write_text(text)
    probe = (SIMULATOR / "probe.hal").read_text()
    (folder / "long.hal").write_text(f"{probe}\nsetp pretravel-probe.0.length 40\n")
    (folder / ".machine").mkdir(exist_ok=True)
    table = "T1 P1 Z40 D6 ; probe\nT2 P2 Z43 D10 ; cutter\n"
    (folder / ".machine" / "machine.tbl").write_text(table)


PLACES = ["G10 L2 P1 X100 Y50 Z-30 R0", "G10 L2 P2 X7 Y8 Z9 R30"]
PROBE = replace(QUICK, tool=1, tool_length=40.0)
OVERTRAVEL = QUICK.overtravel + 0.1
"""The sphere lies 0.03 mm off."""


def checked(folder: Path, runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """All states come back, and nothing goes deep; the runs in which something was aborted."""
    states, output = aborted(folder / "program.ngc", runs)
    assert len(states) == len(runs)
    for run, state in zip(runs, states, strict=True):
        assert state["after"] == near(state["before"]), (run, state["said"])
        assert state["after"]["feed_override"]
    assert depth_of(output) < OVERTRAVEL
    return [state for state in states if state["ran"]]


def near(state: dict[str, Any]) -> dict[str, Any]:
    """The state, with numbers to compare up to the last digits."""
    numbers = {"feed", "tolerance", "tool_offset", "work_origin", "turn"}
    return {k: pytest.approx(v, abs=1e-7) if k in numbers else v for k, v in state.items()}


def random_runs(seed: int, count: int, longest: float, fixed: tuple[str, ...] = ()) -> list[Any]:
    random = np.random.default_rng(seed)
    return [
        {
            "before": [*PLACES, *random_states(random), *fixed],
            "how": HOWS[int(random.integers(len(HOWS)))],
            "after_s": float(random.uniform(0.05, longest)),
        }
        for _ in range(count)
    ]


class TestAborts:
    @pytest.mark.parametrize(
        ("seed", "count"), [(1, 4), pytest.param(2, 50, marks=pytest.mark.slow)]
    )
    def test_a_program_gives_back_all_that_was_active(
        self, tmp_path: Path, seed: int, count: int
    ) -> None:
        installed(tmp_path)
        (tmp_path / "program.ngc").write_text(program_text(PROBE))
        stopped = checked(tmp_path, random_runs(seed, count, 6.0))
        assert len(stopped) > 0.7 * count
        # The worst moment: the overrides are off.
        assert any(state["measuring"] for state in stopped)

    @pytest.mark.parametrize(
        ("seed", "count"), [(3, 4), pytest.param(4, 50, marks=pytest.mark.slow)]
    )
    def test_a_cycle_gives_back_the_modes_of_its_caller(
        self, tmp_path: Path, seed: int, count: int
    ) -> None:
        installed(tmp_path, tool=1)
        sizes = "[25/{0}] [6/{0}] [600/{0}] [8] [4] [0] [12000/{0}]"
        mm, inch = (
            f"o<pretravel_sphere> call [0] [0] [0] {sizes.format(unit)}" for unit in (1, 25.4)
        )
        text = f"o1 if [#<_metric> EQ 1]\n{mm}\no1 else\n{inch}\no1 endif\nM2\n"
        (tmp_path / "program.ngc").write_text(text)
        needed = ("G54 G90 G94 F12", "T1 M6", "G43")
        assert len(checked(tmp_path, random_runs(seed, count, 6.0, needed))) > 0.7 * count

    @pytest.mark.parametrize(
        ("seed", "count"), [(5, 3), pytest.param(6, 20, marks=pytest.mark.slow)]
    )
    def test_a_cycle_that_is_called_by_mdi(self, tmp_path: Path, seed: int, count: int) -> None:
        installed(tmp_path, tool=1)
        (tmp_path / "program.ngc").write_text("M2\n")
        needed = ("G21 G54 G90 G94 F12", "T1 M6", "G43")
        runs = random_runs(seed, count, 6.0, needed)
        for run in runs:
            run["mdi"] = "o<pretravel_sphere> call [0] [0] [0] [25] [6] [600] [8] [4] [0] [12000]"
        assert len(checked(tmp_path, runs)) > 0.7 * count
