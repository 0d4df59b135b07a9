"""Tables and histories of version 1 can still be read and give the same numbers.

Maps that were qualified on a sphere of 25 mm (tip 6 mm, u of the diameter 0.25 µm, simulated
noise 0.3 µm), as tables. The axis of the harmonic map is (0.48, 0.64, 0.6). `values.csv` contains
the values that the version that wrote them computed.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.map_file import read_map
from pretravel.files.probe_history import read_history
from tests.support.commands import rows

FOLDER = Path(__file__).parent / "data" / "version_1"
MAPS = sorted(path.name for path in FOLDER.glob("*.csv") if path.name != "values.csv")


@cache
def _values() -> dict[str, np.ndarray]:
    """Of each file: nx, ny, nz, pretravel [mm], u [mm], a row for each direction."""
    found: dict[str, list[list[float]]] = {}
    for row in rows(FOLDER / "values.csv"):
        name, *numbers = row.values()
        found.setdefault(name, []).append([float(number) for number in numbers])
    return {name: np.array(numbers) for name, numbers in found.items()}


def test_every_file_has_its_values() -> None:
    assert sorted(_values()) == MAPS
    assert len(MAPS) == 4


@pytest.mark.parametrize("name", MAPS)
def test_same_pretravel_and_uncertainty(name: str) -> None:
    made = read_map(FOLDER / name)
    assert made.kind == "tabulated"
    values = _values()[name]
    pretravel, u = made.pretravel_and_uncertainty(values[:, :3])
    # Another order of summation may change the last digits of a double.
    assert pretravel == pytest.approx(values[:, 3], rel=1e-12, abs=1e-16)
    assert u == pytest.approx(values[:, 4], rel=1e-8, abs=1e-16)


def test_what_belongs_to_a_map_is_read() -> None:
    """The axis, the tip, the feed or the delay, the scatter of repeats."""
    turned = read_map(FOLDER / "harmonic.csv")
    assert turned.rotation[:, 2] == pytest.approx([0.48, 0.64, 0.6], abs=1e-9)
    assert (turned.tip_radius, turned.feed, turned.delay) == (3.0, 50.0, None)
    assert turned.repeatability == pytest.approx(3e-4, rel=0.3)
    assert turned.u_tip_radius > 0.0
    resting = read_map(FOLDER / "harmonic_with_delay.csv")
    assert resting.feed == 0.0
    assert resting.delay == pytest.approx(14.5e-3, abs=4e-4)
    assert resting.u_delay > 0.0


def test_history_of_a_probe() -> None:
    first, second = read_history(FOLDER / "history.jsonl")
    assert (first.number, second.number) == (1, 2)
    assert first["time"] == "2026-01-01T08:00:00+00:00"
    assert first["touches_file"] == "day1.csv"
    assert first["map_id"] == second["map_id"] == "c92e1614a612"
    assert (first["changed"], second["changed"]) == (0, 1)
    # The second day's pretravel was 30 % more.
    assert second["amplitude_percent"] == pytest.approx(30.0, abs=3.0)
