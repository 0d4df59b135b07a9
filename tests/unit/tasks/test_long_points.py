"""Features of long tables of points are those of the whole table, in bounded memory."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.files import table_blocks
from pretravel.files.point_blocks import LongPoints, long_points
from pretravel.files.point_files import write_points
from pretravel.files.points_reading import read_points
from pretravel.measurement.points import Points
from pretravel.measurement.selection import points_of_features
from pretravel.tasks import measure
from pretravel.tasks.measure import Measure, measure_long_points
from tests.support.commands import run


@pytest.fixture(autouse=True)
def _short_tables_are_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_blocks, "LONG_TABLE", 200)
    monkeypatch.setattr(table_blocks, "_HEAD_BYTES", 3000)
    monkeypatch.setattr(table_blocks, "_HEAD_ROWS", 20)
    usual = LongPoints.blocks
    monkeypatch.setattr(LongPoints, "blocks", lambda table, rows=90: usual(table, rows))


def _bores(count: int, *, mixed: bool = False, each: int = 12) -> Points:
    """Bores of 20 mm with points around, one after the other, or point by point in turn."""
    angle = np.tile(np.arange(each) * 2.0 * np.pi / each, count)
    bore = np.repeat(np.arange(count), each)
    number = np.tile(np.arange(1, each + 1), count)
    order = np.argsort(number, kind="stable") if mixed else np.arange(each * count)
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])[order]
    noise = np.random.default_rng(4).normal(0.0, 3e-4, each * count)
    center = np.column_stack([30.0 * bore, 0.0 * bore, 0.0 * bore])[order]
    positions = center + (10.0 + noise)[:, None] * outward
    u = np.full(each * count, 4e-4)
    return Points(
        positions,
        -outward,
        np.full(each * count, 0.01),
        u[:, None, None] ** 2 * outward[:, :, None] * outward[:, None, :],
        None,
        tuple(f"bore{b + 1}-{n}" for b, n in zip(bore[order], number[order], strict=True)),
        shared={"map 1": np.full(each * count, 2e-4)},
        uncompensated=positions + 0.01 * outward,
    )


def _bores_of(**settings: Any) -> Measure:
    return Measure(points=Path("points.csv"), feature="bore", **settings)


def _table(path: Path) -> LongPoints:
    found = long_points(path)
    assert found is not None
    return found


@pytest.mark.parametrize("mixed", [pytest.param(False, marks=pytest.mark.slow), True])
@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize(
    "task",
    [
        _bores_of(by_prefix=True),
        _bores_of(select=("bore7-*", "bore2-*")),
        _bores_of(select=("bore4*", "bore1-*"), by_prefix=True),
    ],
)
def test_features_are_those_of_the_whole(
    tmp_path: Path, ending: str, task: Measure, mixed: bool
) -> None:
    path = tmp_path / f"points.{ending}"
    write_points(path, _bores(45, mixed=mixed))
    blocks, whole = (
        measure_long_points(_table(path), task),
        task.measured(read_points(path)),
    )
    assert blocks.values() == whole.values()


def test_a_pattern_without_points_has_the_usual_message(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    write_points(path, _bores(45))
    for task in (
        _bores_of(select=("pin*",)),
        _bores_of(at="0,0,0", by_prefix=True),
    ):
        with pytest.raises(PretravelError) as of_whole:
            task.measured(read_points(path))
        with pytest.raises(PretravelError) as of_blocks:
            measure_long_points(_table(path), task)
        assert str(of_blocks.value) == str(of_whole.value)


def test_a_damaged_line_has_the_usual_message(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    write_points(path, _bores(45))
    lines = path.read_text().splitlines()
    lines[400] = lines[400].replace("-", "x")
    path.write_text("\n".join(lines))
    with pytest.raises(InputError) as of_whole:
        read_points(path)
    with pytest.raises(InputError, match="line 401") as of_blocks:
        measure_long_points(_table(path), _bores_of(by_prefix=True))
    assert str(of_blocks.value) == str(of_whole.value)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_points(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Results of features are kept, their points are not; here 30 features, and no results."""
    nothing = SimpleNamespace(verdict=None)
    monkeypatch.setattr(measure, "_measured", lambda *_: nothing)
    peaks = []
    for each in (40, 40, 320):
        path = tmp_path / f"{each}.csv"
        write_points(path, _bores(30, each=each))
        table = _table(path)
        tracemalloc.start()
        measure_long_points(table, _bores_of(by_prefix=True))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # 8 times where all points are kept; 280 more of the open feature are 60 kB.
    assert peaks[2] < 2.0 * peaks[1]


def test_the_command_measures_long_tables(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    write_points(path, _bores(45))
    told = run("measure", path, "--feature", "bore", "--group")
    assert "bore45" in told


def test_rows_of_a_feature_keep_their_order() -> None:
    """Patterns that overlap; a group is one feature whichever pattern finds it."""
    points = _bores(3)
    found = points_of_features(points, ["*-3", "bore2-*"])
    assert [mine.labels[0] for mine in found.values()] == ["bore1-3", "bore2-1"]
    assert [len(mine) for mine in found.values()] == [3, 12]
    assert list(points_of_features(points, ["bore2-*", "*-3"])) == ["bore2-*", "*-3"]
    grouped = points_of_features(points, ["bore2-*", "*-3"], by_prefix=True)
    assert {name: len(mine) for name, mine in grouped.items()} == {
        "bore2": 12,
        "bore1": 1,
        "bore3": 1,
    }
