"""What a task states about its outputs holds in Python as in the command."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.files.map_file import write_map
from pretravel.files.points_writing import point_endings
from pretravel.task.task import Task
from pretravel.tasks.compensate import Compensate
from pretravel.tasks.verify import Verify
from tests.support.commands import run
from tests.support.example_maps import example_map
from tests.support.examples import PART
from tests.support.touches_of_days import day_of


def test_points_are_written_in_every_format_that_has_them(tmp_path: Path) -> None:
    told = run("compensate", PART, "--map", "omp40-2", "-o", tmp_path / "points.xyz", code=2)
    assert f"the ending must be {' or '.join(point_endings())} or .html" in told


def _lines_are_run(task: Task) -> None:
    exec(task.python_lines(), {})


def test_the_lines_of_python_write_the_points(tmp_path: Path) -> None:
    out = tmp_path / "points.csv"
    _lines_are_run(Compensate(touches=(PART,), map_file="omp40-2", output=out, exclude=("3",)))
    assert len(out.read_text().splitlines()) == 140


@pytest.mark.parametrize("accepts", [True, False])
def test_the_lines_of_python_write_an_accepted_map_once(tmp_path: Path, accepts: bool) -> None:
    old, new = tmp_path / "old.json", tmp_path / "new.json"
    write_map(old, example_map("harmonic"))
    task = Verify(
        touches=(day_of(tmp_path, 1),),
        map_file=old,
        diameter=24.9987,
        accept=new if accepts else None,
    )
    assert "result.write" not in task.python_lines()
    _lines_are_run(task)
    assert new.exists() == accepts
