"""Law of all tasks that read touches: those of several tips, parts, passes are no one series."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.files.map_json import json_of_map
from pretravel.task.fields import TouchTables
from pretravel.task.listed import PLACES, task_named
from tests.support.commands import both_outputs
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES

WORDS = {"tip": ("A", "B"), "part": ("1", "2"), "pass": ("fast", "slow"),
         "orientation": ("A0B0", "A90B0")}  # fmt: skip
"""A column that changes what rows mean, with what two of them state."""
REFUSED = {
    "tip": "2 tips", "part": "2 parts or series", "pass": "2 passes",
    "orientation": "2 orientations",
}  # fmt: skip
COMMANDS = {
    "qualify": "qualify {touches} --diameter 25 --tip-diameter 6",
    "verify": "verify {touches} --map {map} --diameter 25",
    "check-budget": "check-budget {touches} --diameter 25 --tip-diameter 6",
    "history": "history {touches} --diameter 25 --tip-diameter 6",
    "check": "check iso10360-5 {touches} --map {map} --diameter 25",
    "compensate": "compensate {touches} --map {map} -o {out}.csv",
    "align": f"align {{touches}} --map {{map}} --part {EXAMPLES.parent / 'linuxcnc' / 'part.step'}",
    "reversal": "reversal {spindle} -o {out}.csv",
    "axis": "axis {angles} --axis A",
    "measure": "measure {positions} --feature sphere --tip-diameter 6",
}
"""Each takes all its touches as those of one tip, part, pass and orientation."""
CARRIED = {"convert", "bundle"}
"""They write the column, as it is."""
TOLD_APART = {"repeat"}
"""It evaluates each series, and names it."""


def _spherical(folder: Path, column: str) -> dict[str, Path]:
    rng = np.random.default_rng(2)
    away = rng.standard_normal((40, 3))
    away[:, 2] = np.abs(away[:, 2])
    away /= np.linalg.norm(away, axis=1)[:, None]
    places = 15.495 * away + 1e-3 * rng.standard_normal((40, 3))
    tables = {
        "touches": ("", lambda row: ""),
        "spindle": ("spindle_deg,", lambda row: f"{180 * (row % 2)},"),
        "angles": ("label,", lambda row: f"at{row // 10 * 30}_s{row % 10},"),
        "positions": ("", lambda row: ""),
    }
    paths = {}
    for name, (head, extra) in tables.items():
        lines = [f"{column},{head}x_mm,y_mm,z_mm" + ",nx,ny,nz" * (name != "positions")]
        for row in range(40):
            place = row - row % 2 if name == "spindle" else row
            numbers = [*places[place], *(() if name == "positions" else away[place])]
            word = WORDS[column][row // 20]
            lines.append(f"{word},{extra(row)}" + ",".join(f"{v:.6f}" for v in numbers))
        paths[name] = folder / f"{name}.csv"
        paths[name].write_text("\n".join(lines) + "\n")
    return paths


@pytest.mark.parametrize("column", WORDS)
@pytest.mark.parametrize("task", COMMANDS)
def test_several_of_a_kind_are_refused_by_name(task: str, column: str, tmp_path: Path) -> None:
    files = {**_spherical(tmp_path, column), "map": tmp_path / "map.json", "out": tmp_path / "o"}
    files["map"].write_bytes(json_of_map(mean_map(0.005)))
    _, err = both_outputs(*COMMANDS[task].format(**files).split(), code=2)
    assert REFUSED[column] in err
    assert not (tmp_path / "o.csv").exists()


def test_every_task_that_reads_touches_is_here() -> None:
    reading = {name for name in PLACES if issubclass(task_named(name), TouchTables)}
    assert reading <= set(COMMANDS) | CARRIED | TOLD_APART, reading
    assert set(COMMANDS) | CARRIED | TOLD_APART <= set(PLACES)
