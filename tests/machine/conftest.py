"""The real LinuxCNC with a simulated machine; a skipped test is always reported."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from pretravel.controls.linuxcnc_state import state_subroutines

SIMULATOR = Path(__file__).parent.parent.parent / "examples" / "linuxcnc"
MODULE = "pretravel_probe.so"


def linuxcnc_is_here() -> bool:
    """LinuxCNC with the simulated probe of this project among its modules."""
    if shutil.which("linuxcnc") is None:
        return False
    return any(Path(folder, MODULE).exists() for folder in ("/usr/lib/linuxcnc/modules",))


@pytest.fixture(scope="session", autouse=True)
def control() -> None:
    if not linuxcnc_is_here():
        pytest.skip(
            "LinuxCNC is NOT INSTALLED: the real control was not tested (examples/linuxcnc/install)"
        )


def environment(**variables: str) -> dict[str, str]:
    """The environment, with the command pretravel of this Python on the path, and variables."""
    folders = (os.environ.get("FIRST_ON_PATH"), str(Path(sys.executable).parent))
    path = os.pathsep.join([*filter(None, folders), os.environ["PATH"]])
    return dict(os.environ, PATH=path, SIMULATOR=str(SIMULATOR)) | variables


def simulated(
    program: Path, probe: Path | None = None, **variables: str
) -> subprocess.CompletedProcess[str]:
    """Run G-code on the simulated machine, with the subroutines for its state beside it.

    It waits as long as `simulate` does, which gives up where no state changes any more.
    """
    for name, text in state_subroutines().items():
        (program.parent / name).write_text(text)
    command = [str(SIMULATOR / "simulate"), str(program), *([str(probe)] if probe else [])]
    given = environment(**variables)
    return subprocess.run(command, capture_output=True, text=True, check=False, env=given)


def run_program(
    program: Path, probe: Path | None = None, code: int = 0, feed_override: float = 1.0
) -> str:
    """Run G-code on the simulated machine; returns the output of the control."""
    done = simulated(program, probe, PRETRAVEL_FEED_OVERRIDE=f"{feed_override:g}")
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def run_together(
    *runs: tuple[Path, Path | None, int] | tuple[Path, Path | None, int, float],
) -> list[str]:
    """`run_program` of several programs at the same time, each in a folder of its own.

    Most of a run is waiting. Where the computer has no namespaces, they wait for each other.
    """
    assert len({program.parent for program, *_ in runs}) == len(runs)
    with ThreadPoolExecutor(len(runs)) as pool:
        return list(pool.map(lambda run: run_program(*run), runs))
