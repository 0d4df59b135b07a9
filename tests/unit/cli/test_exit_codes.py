"""Exit codes: 0 done, 2 a fault of any kind, 3 an answer that a script must notice."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pretravel.cli import derived, main
from pretravel.files.map_file import write_map
from pretravel.files.probe_history import add_verification
from pretravel.files.touches_csv import write_touches
from tests.support.commands import run
from tests.support.examples import SPHERE
from tests.unit.qualification.test_verification import check, old_map, touches

COMMAND = [sys.executable, "-c", "from pretravel.cli.main import run; run()"]
INTERNAL = "an internal error of pretravel; please report it"
YESTERDAY = b'{"map": "of yesterday"}'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map, touches of the same probe, and of one with a bent stylus."""
    place = tmp_path_factory.mktemp("verify")
    write_map(place / "map.json", old_map())
    write_touches(place / "same.csv", touches(11))
    write_touches(place / "bent.csv", touches(12, size=0.002))
    return place


def _arguments(folder: Path, name: str = "same.csv") -> list[object]:
    return ["verify", folder / name, "--map", folder / "map.json", "--diameter", 25]


class TestVerify:
    def test_changed_has_a_code_of_its_own(self, folder: Path) -> None:
        run(*_arguments(folder))
        run(*_arguments(folder, "bent.csv"), code=3)

    @pytest.mark.parametrize("cut", [0.1, 0.5, 0.9])
    def test_a_damaged_map_is_a_fault(self, folder: Path, tmp_path: Path, cut: float) -> None:
        content = (folder / "map.json").read_bytes()
        (tmp_path / "map.json").write_bytes(content[: int(cut * len(content))])
        run("verify", folder / "same.csv", "--map", tmp_path / "map.json", "--diameter", 25, code=2)

    @pytest.mark.parametrize(
        ("error", "words"),
        [
            (KeyError("not foreseen"), ("KeyError: 'not foreseen'", INTERNAL)),
            (ModuleNotFoundError(name="pretravel.gone"), ("ModuleNotFoundError", INTERNAL)),
            (ModuleNotFoundError(name="numpy"), ("'numpy' is missing: pip install numpy",)),
        ],
    )
    def test_a_flaw_of_pretravel_is_a_fault_that_is_shown(
        self,
        folder: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
        error: Exception,
        words: tuple[str, ...],
    ) -> None:
        def fails(*_: object, **__: object) -> None:
            raise error

        monkeypatch.setattr(derived, "check_files", fails)
        monkeypatch.setattr(sys, "argv", ["pretravel", *map(str, _arguments(folder))])
        with pytest.raises(SystemExit) as stop:
            main.run()
        assert stop.value.code == 2
        shown = capsys.readouterr().err
        assert all(word in shown for word in words)
        assert ("pip install" in shown) != (INTERNAL in shown)


class TestWhoReadsTheOutput:
    @pytest.mark.skipif(sys.platform == "win32", reason="redirections of a POSIX shell")
    @pytest.mark.parametrize("closed", [">&-", "2>&-"])
    def test_no_output_at_all_is_no_fault(self, closed: str) -> None:
        """Of services and programs without a terminal: Python has no such stream then."""
        command = shlex.join([*COMMAND, "formats"])
        done = subprocess.run(["sh", "-c", f"{command} {closed}"], capture_output=True, check=False)
        assert (done.returncode, done.stderr) == (0, b"")

    @pytest.mark.long
    def test_a_reader_of_the_result_that_has_enough_gets_no_message(self) -> None:
        """``-o /dev/stdout | head``: as for what is printed, the exit code alone tells it."""
        plan = ("plan", "sphere:radius=12", "--grid", "5x5", "-o", "/dev/stdout")
        read, write = os.pipe()
        os.close(read)
        with os.fdopen(write, "wb") as closed:
            done = subprocess.run(
                [*COMMAND, *plan],
                stdout=closed,
                stderr=subprocess.PIPE,
                text=True,
                check=False,
            )
        assert (done.returncode, "Error" in done.stderr) == (2, False), done.stderr

    def test_a_closed_pipe_is_a_fault(self) -> None:
        read, write = os.pipe()
        os.close(read)
        done = subprocess.run(
            [*COMMAND, "formats"], stdout=write, stderr=subprocess.PIPE, text=True, check=False
        )
        os.close(write)
        assert (done.returncode, done.stderr) == (2, "")

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
    def test_a_full_disk_is_a_fault(self) -> None:
        with Path("/dev/full").open("w") as full:
            done = subprocess.run(
                [*COMMAND, "formats"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
            )
        assert done.returncode == 2
        assert done.stderr == "Error: No space left on device\n"


class TestAcceptedMaps:
    @pytest.mark.parametrize("damage", ["no history", "rows", "another tip"])
    def test_a_bad_history_leaves_the_old_map(
        self, folder: Path, tmp_path: Path, damage: str
    ) -> None:
        history, accepted = tmp_path / "probe.jsonl", tmp_path / "new.json"
        accepted.write_bytes(YESTERDAY)
        if damage == "no history":
            history.write_text("this is not a history at all, whatever its ending says\n" * 30)
        else:
            tip = 3.0 if damage == "rows" else 2.0
            add_verification(
                history, check(touches(1)), pretravel_map=replace(old_map(), tip_radius=tip),
                map_name="m", touches_name="t", decision="kept",
            )  # fmt: skip
        if damage == "rows":
            history.write_text(history.read_text().replace('"p_form"', '"p_face"'))
        before = history.read_bytes()
        given = ("--history", history, "--accept", accepted)
        assert "probe.jsonl" in run(*_arguments(folder), *given, code=2)
        assert accepted.read_bytes() == YESTERDAY
        assert history.read_bytes() == before
        assert sorted(file.name for file in tmp_path.iterdir()) == ["new.json", "probe.jsonl"]

    def test_a_map_that_cannot_be_written_leaves_the_history(
        self, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def full(*_: object) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("pretravel.files.write_map", full)
        monkeypatch.setattr(
            "pretravel.qualification.qualify_like",
            lambda *_, **__: SimpleNamespace(pretravel_map=old_map()),
        )
        history = tmp_path / "probe.jsonl"
        told = run(*_arguments(folder), "--history", history, "--accept", tmp_path / "new.json",
                   code=2)  # fmt: skip
        assert "No space left on device" in told
        assert list(tmp_path.iterdir()) == []


def test_check_has_the_code_of_an_answer_where_a_limit_is_exceeded(tmp_path: Path) -> None:
    """The touches are those of a bare tip: each radius is wrong by the pretravel, about 10 µm."""
    common = ["check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6]
    run(*common, "--form-limit", 1000, "--size-limit", 1000)
    run(*common, "--form-limit", 0.1, "--size-limit", 1000, code=3)


def test_help_states_the_codes() -> None:
    text = " ".join(run("--help").split())
    assert "Exit codes: 0: done. 2: a fault, with a message. 3: a result that a script must" in text
    assert "Exit code 0: no; 3: yes." in " ".join(run("verify", "--help").split())
