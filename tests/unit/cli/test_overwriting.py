"""A command replaces its own files; those of other commands and of people it does not."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

from pretravel.files.map_file import write_map
from tests.support.commands import run
from tests.support.examples import SPHERE
from tests.unit.qualification.test_verification import old_map

PATTERN = ("pattern", "iso10360-5", "--diameter", 25)
PLAN = ("plan", "sphere:radius=12", "--grid", "3x3")


@pytest.fixture(autouse=True)
def _own_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path / "kept"))
    monkeypatch.chdir(tmp_path)


def test_a_command_runs_again_over_its_own_output() -> None:
    run(*PATTERN, "-o", "targets.csv")
    before = Path("targets.csv").read_bytes()
    run(*PATTERN, "--turn", 10, "-o", "targets.csv")
    assert Path("targets.csv").read_bytes() != before
    shutil.move("targets.csv", "moved.csv")  # the content is known, wherever it is
    run(*PATTERN, "-o", "moved.csv")


def test_a_file_of_another_command_stays() -> None:
    run(*PATTERN, "-o", "targets.csv")
    before = Path("targets.csv").read_bytes()
    told = run(*PLAN, "-o", "targets.csv", code=2)
    assert "cannot write targets.csv: the file exists, and pretravel pattern made it" in told
    assert "--force (-f)" in told
    assert Path("targets.csv").read_bytes() == before


@pytest.mark.parametrize("option", ["--force", "-f"])
def test_force_replaces_it(option: str) -> None:
    run(*PATTERN, "-o", "targets.csv")
    before = Path("targets.csv").read_bytes()
    run(*PLAN, "-o", "targets.csv", option)
    assert Path("targets.csv").read_bytes() != before
    run(*PLAN, "-o", "targets.csv")  # now it is its own


def test_touches_of_a_machine_stay_though_a_command_could_have_made_them() -> None:
    """The table of a machine has the columns of the tables that `convert` writes."""
    shutil.copy(SPHERE, "touches.csv")
    told = run("convert", SPHERE, "-o", "touches.csv", code=2)
    assert "A person, another program or another computer wrote or changed it" in told
    assert Path("touches.csv").read_bytes() == SPHERE.read_bytes()


def test_a_file_that_was_edited_stays() -> None:
    run(*PATTERN, "-o", "targets.csv")
    edited = Path("targets.csv").read_text() + "\n"
    Path("targets.csv").write_text(edited)
    run(*PATTERN, "-o", "targets.csv", code=2)
    assert Path("targets.csv").read_text() == edited


def test_a_description_that_was_printed_stays() -> None:
    """The file comes from a redirection of the shell, so that it counts as written by hand."""
    Path("mine.toml").write_text(run("probes", "omp40-2"))
    run("machine", "-o", "mine.toml", code=2)


def test_an_empty_file_and_a_device_have_nothing_to_lose() -> None:
    Path("targets.csv").touch()
    run(*PATTERN, "-o", "targets.csv")
    run(*PATTERN, "-o", "/dev/null")


def test_pictures_and_pages_too() -> None:
    run("predict", "omp40-2", "--azimuth", "0:330:30", "--polar", 90, "--plot", "a.png")
    run("predict", "omp40-2", "--azimuth", "0:330:30", "--polar", 90, "--plot", "a.png")
    assert "pretravel predict" in run(*PLAN, "-o", "targets.csv", "--plot", "a.png", code=2)
    assert not Path("targets.csv").exists()


def test_subroutines_of_a_folder() -> None:
    """`export` writes pretravel_sphere as `program mdi` does: the same text is nobody's loss."""
    write_map("map.json", old_map())
    run("program", "mdi", "-o", "subroutines")
    run("export", "map.json", "--to", "linuxcnc", "-o", "subroutines")
    run("export", "map.json", "--to", "linuxcnc", "-o", "subroutines")
    edited = Path("subroutines/pretravel_compensate.ngc")
    edited.write_text("(mine)")
    told = run("export", "map.json", "--to", "linuxcnc", "-o", "subroutines", code=2)
    assert "subroutines/pretravel_compensate.ngc" in told
    assert edited.read_text() == "(mine)"


def test_nothing_is_read_from_a_list_that_others_can_write() -> None:
    run(*PATTERN, "-o", "targets.csv")
    Path("kept/made-files.txt").chmod(0o666)
    run(*PATTERN, "-o", "targets.csv", code=2)


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of Unix")
def test_a_group_that_may_write_to_the_folders_of_a_user_is_usual(tmp_path: Path) -> None:
    """With the umask 002 of several distributions, a cache folder is open to the user's group."""
    before = os.umask(0o002)
    try:
        tmp_path.chmod(0o775)
        run(*PATTERN, "-o", "targets.csv")
        run(*PATTERN, "-o", "targets.csv")
    finally:
        os.umask(before)


def test_a_long_list_forgets_its_older_half(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pretravel.base.made_files._LARGEST", 1000)
    for turn in range(20):
        run(*PATTERN, "--turn", turn, "-o", f"{turn}.csv")
    assert Path("kept/made-files.txt").stat().st_size < 1200
    run(*PATTERN, "--turn", 19, "-o", "19.csv")
    run(*PATTERN, "-o", "0.csv", code=2)
