"""Law of all CSV files: a spreadsheet executes no cell, and reading returns the same labels."""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pretravel.files.csv_table import read_csv_table, write_csv_table
from pretravel.files.points_reading import read_points
from pretravel.files.points_writing import write_points
from pretravel.files.readings import read_readings
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches
from tests.support.example_maps import lobes

EXECUTED = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
"""Begin of cells that spreadsheets execute: OWASP, "CSV Injection"."""
FORMULAS = ("=1+1", "=HYPERLINK(\"http://a\",\"b\")", "+1+1", "-1+1", "@SUM(A1)", "'=1+1", "''@a",
            "'quoted'", "-1.5", "+5", "'-1.5", "P1", "=", "'", "-", "＝1+1",
            "a;=1+1", "a;'=1+1", "=a;=b", "a;-1.5")  # fmt: skip


def _executes(cell: str) -> bool:
    """A number with its sign is a number for a spreadsheet too."""
    if not cell.startswith(EXECUTED):
        return False
    try:
        float(cell)
    except ValueError:
        return True
    return False


def _cells(path: Path) -> list[str]:
    with path.open(newline="", encoding="utf-8") as file:
        lines = file.readlines()
    # In some languages a sheet splits lines at semicolons: what follows one is a cell, too.
    by_semicolons = (row[1:] for row in csv.reader(lines, delimiter=";"))
    return [cell for row in (*csv.reader(lines), *by_semicolons) for cell in row]


def _touches(labels: tuple[str, ...]) -> Touches:
    count = len(labels)
    return Touches(
        np.arange(3.0 * count).reshape(count, 3), np.tile([0.0, 0.0, 1.0], (count, 1)),
        labels=labels,
    )  # fmt: skip


def test_touches(tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    write_touches(path, _touches(FORMULAS))
    assert not [cell for cell in _cells(path) if _executes(cell)]
    assert read_touches(path).labels == FORMULAS
    assert read_readings(path).touches.labels == FORMULAS


def test_points(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    write_points(path, apply(_touches(FORMULAS), lobes(3)))
    assert not [cell for cell in _cells(path) if _executes(cell)]
    assert read_points(path).labels == FORMULAS


@pytest.mark.parametrize("begin", EXECUTED)
def test_every_begin_is_marked_as_text(tmp_path: Path, begin: str) -> None:
    path = tmp_path / "a.csv"
    write_csv_table(path, {begin + "name": [begin + "cmd|' /C calc'!A0"], "n": [1.0]})
    assert not [cell for cell in _cells(path) if _executes(cell)]


@given(st.text(st.sampled_from("'=+-@a1. "), min_size=1).map(str.strip).filter(bool))
@example("'-1")
def test_the_same_text_comes_back(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        write_csv_table(path, {"label": [text], "x_mm": [1.0]})
        assert not [cell for cell in _cells(path) if _executes(cell)]
        assert read_csv_table(path).columns["label"] == (text,)
