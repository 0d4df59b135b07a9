"""Law of tasks on touches: few and equal readings are evaluated or refused, without a traceback."""

from __future__ import annotations

import shlex
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.cli.derived import command_of, task_of
from pretravel.files.map_file import write_map
from pretravel.task.listed import task_named
from pretravel.task.task import Task
from tests.support.example_maps import mean_map
from tests.support.touched_bracket import write_bracket

pytestmark = pytest.mark.long  # each task with each input

COMMANDS = (
    "qualify touches.csv --diameter 25 --tip-diameter 6 --kind mean -o made.json",
    "qualify touches.csv --diameter 25 --tip-diameter 6 -o made.json",
    "verify touches.csv --map map.json --diameter 25",
    "compensate touches.csv --map map.json --extrapolate -o points.csv",
    "compensate touches.csv --map map.json --feature bore --extrapolate -o points.csv",
    "repeat touches.csv",
    "measure plain.csv --feature bore --tip-diameter 6",
    "measure plain.csv --feature plane",
    "separate touches.csv -o separated.csv",
    "align touches.csv --part part.step --map map.json -o place.json",
    "qualify touches.csv --diameter 25 --tip-diameter 6 --prior map.json -o made.json",
    "qualify touches.csv --block 25,25,25 --tip-diameter 6 -o made.json",
    "history touches.csv --diameter 25 --tip-diameter 6",
    "check-budget touches.csv --diameter 25 --tip-diameter 6 --kind mean --sets 20",
    "check iso10360-5 touches.csv --diameter 25 --tip-diameter 6",
    "compare map.json --part touches.csv",
    "reversal touches.csv touches.csv --spindle 0,180 -o means.csv",
    "axis touches.csv touches.csv --angles 0,90 --axis C --diameter 25 --map map.json",
    "convert touches.csv -o converted.csv",
    "compensate touches.csv --map map.json --feature surface --extrapolate -o points.csv",
    "measure plain.csv --feature sphere",
    "measure plain.csv --feature cylinder --axis 0,0,1",
    "rig rig_000_1.csv -o rig.csv",
    "rig rig_000_1.csv rig_000_2.csv rig_090_1.csv -o rig.json",
)


TRACES = ("rig_000_1.csv", "rig_000_2.csv", "rig_090_1.csv")


def _other_inputs(rows: list[str]) -> None:
    """The map, the part, and traces whose ruler is read in so many distinct values."""
    write_map(Path("map.json"), mean_map(0.010))
    write_bracket(Path("part.step"))
    levels = [0.1 * number for number in range(len(set(rows)))]
    ruler = [level for level in [*levels, *levels[::-1]] for _ in range(60)]
    lines = [f"{0.001 * n:.3f},{at:g},0,1,1" for n, at in enumerate(ruler)]
    for name in TRACES:
        Path(name).write_text(
            "\n".join(["time_s,ruler_mm,laser_mm,contact,trigger", *lines]) + "\n"
        )


def _parsed(command: str) -> tuple[type[Task], dict[str, Any]]:
    name, *words = shlex.split(command)
    return task_named(name), command_of(task_named(name)).make_context(name, words).params


@pytest.mark.parametrize(
    ("command", "distinct", "count"),
    [
        pytest.param(command, distinct, count, marks=[pytest.mark.slow] * (
            (command.startswith("align") and (distinct, count) == (3, 6))  # a long search
            or distinct == 2
        ))
        for command in COMMANDS for distinct in (1, 2, 3) for count in (1, 6)
    ],
)  # fmt: skip
def test_a_few_distinct_values(command: str, distinct: int, count: int, tmp_path: Path,
                               monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    """The pole and two points of the equator, each once or six times, to 0.1 mm."""
    monkeypatch.chdir(tmp_path)
    normals = np.tile(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])[:distinct], (count, 1))
    rows = [f"{15.5 * x:g},{15.5 * y:g},{15.5 * z:g},{x:g},{y:g},{z:g}" for x, y, z in normals]
    Path("touches.csv").write_text("\n".join(["x_mm,y_mm,z_mm,nx,ny,nz", *rows]) + "\n")
    plain = [",".join(row.split(",")[:3]) for row in rows]
    Path("plain.csv").write_text("\n".join(["x_mm,y_mm,z_mm", *plain]) + "\n")
    _other_inputs(rows)
    with suppress(PretravelError):  # refused by name; any other error is a fault
        task, values = _parsed(command)
        task_of(task, values).run()


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "text",
    [
        "",
        pytest.param("\n\n", marks=pytest.mark.slow),
        "x_mm,y_mm,z_mm,nx,ny,nz\n",
        pytest.param("# none\n", marks=pytest.mark.slow),
        "\0",
    ],
)
def test_empty_files_are_refused_by_name(command: str, text: str, tmp_path: Path,
                                         monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    _other_inputs([])
    for name in ("touches.csv", "plain.csv", *TRACES):
        Path(name).write_text(text)
    task, values = _parsed(command)
    with pytest.raises(PretravelError, match=r"touches|plain|rig_000"):
        task_of(task, values).run()
