"""The simulated machine of examples/linuxcnc: what its exit code and its last words mean."""

from __future__ import annotations

import fcntl
import re
import subprocess
import time
from pathlib import Path

import pytest

from tests.machine.conftest import SIMULATOR, environment, run_program


@pytest.mark.parametrize("text", ["G21\nM2\n", "%\nG21\nG0 X1\n%\n"])
def test_a_program_that_is_over_before_it_is_seen_has_run(tmp_path: Path, text: str) -> None:
    program = tmp_path / "short.ngc"
    program.write_text(text.replace("G21", "G21\n(LOGOPEN,short.log)\n(LOG,ran)"))
    run_program(program)
    assert (tmp_path / "short.log").read_text() == "ran\n"


@pytest.fixture
def failing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A program, beside a linuxcnc that says something and ends before its display begins."""
    fake = tmp_path / "bin" / "linuxcnc"
    fake.parent.mkdir()
    fake.write_text("#!/bin/sh\necho 'Realtime system did not load'\nexit 0\n")
    fake.chmod(0o755)
    monkeypatch.setenv("FIRST_ON_PATH", str(fake.parent))
    program = tmp_path / "program.ngc"
    program.write_text("G21\nM2\n")
    return program


def test_a_machine_that_does_not_start_is_started_once_more_and_then_it_is_a_fault(
    failing: Path,
) -> None:
    said = run_program(failing, code=2)
    assert said.count("starting it again, once") == 1
    assert "the program did not run to its end: the simulated machine failed" in said
    assert "Realtime system did not load" in said
    assert "It was tried 2 times" in said


def test_a_machine_that_starts_at_the_second_time_runs_the_program_and_says_so(
    failing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake = failing.parent / "bin" / "linuxcnc"
    fake.write_text(f'#!/bin/sh\nrm "{fake}"\nexit 0\n')
    said = run_program(failing)
    assert "starting it again, once" in said
    assert "modes at the end: " in said


def waits_for(lock: Path, kind: str) -> bool:
    """Whether a process waits for a lock on the file, as the kernel lists it."""
    wanted = re.compile(rf"-> FLOCK\s+ADVISORY\s+{kind} .*:{lock.stat().st_ino} ")
    return bool(wanted.search(Path("/proc/locks").read_text()))


@pytest.mark.parametrize(
    ("namespaces", "held", "kind"), [(True, fcntl.LOCK_EX, "READ"), (False, fcntl.LOCK_SH, "WRITE")]
)
def test_a_machine_without_namespaces_runs_alone(
    failing: Path, monkeypatch: pytest.MonkeyPatch, namespaces: bool, held: int, kind: str
) -> None:
    """At its end LinuxCNC ends every task that it sees, those of runs in namespaces too."""
    lock = failing.parent / "lock"
    lock.touch()
    monkeypatch.setenv("PRETRAVEL_LOCK", str(lock))
    if not namespaces:
        without = failing.parent / "bin" / "unshare"
        without.write_text("#!/bin/sh\nexit 1\n")
        without.chmod(0o755)
    command = [str(SIMULATOR / "simulate"), str(failing)]
    with lock.open() as other, subprocess.Popen(command, env=environment()) as waiting:
        fcntl.flock(other, held)
        while not waits_for(lock, kind):
            assert waiting.poll() is None
            time.sleep(0.05)
        fcntl.flock(other, fcntl.LOCK_UN)
    assert waiting.returncode == 2  # it did run


def test_machines_in_namespaces_run_at_the_same_time(
    failing: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    apart = ["unshare", "--ipc", "--net", "--pid", "--mount-proc", "--fork", "true"]
    if subprocess.run(apart, check=False, capture_output=True).returncode:
        pytest.skip("this computer gives no namespaces: machines run one after the other")
    lock = failing.parent / "lock"
    lock.touch()
    monkeypatch.setenv("PRETRAVEL_LOCK", str(lock))
    with lock.open() as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        run_program(failing, code=2)
