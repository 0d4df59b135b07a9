"""Ten million touches: the command `compensate`, against pandas.

pandas reads the same file and writes it again, without any computation. Both are processes of their
own. The file is made in pieces, and the results are compared in pieces.
"""

from __future__ import annotations

import csv
import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.commands import PRETRAVEL, Spent, python_file, spent
from benchmarks.results import Figures, Row, memory_text
from benchmarks.sizes import Sizes
from pretravel.base.directions import sphere_pattern_25
from pretravel.files.map_file import read_map
from pretravel.files.touches_csv import write_touches
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.touches import Touches

_COLUMNS = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
_PIECE = 250_000
_LOOKED_AT = 500
"""Rows that are compared."""
_LIMIT = math.radians(85.0)
"""Polar angle of the touches, within the map's."""


def _made_map(folder: Path) -> Path:
    """The map of a qualification with 75 touches, kind auto."""
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    noise = np.random.default_rng(0).normal(0.0, 3e-4, len(n))
    distance = 15.5 - predict(load_probe("omp40-2-100mm"), n).pretravel + noise
    sphere, made = folder / "sphere.csv", folder / "map.json"
    write_touches(sphere, Touches(n * distance[:, None], n))
    options = ("--diameter", "25", "--tip-diameter", "6", "-o", str(made))
    spent([*PRETRAVEL, "qualify", str(sphere), *options])
    return made


def _pieces(count: int) -> Iterator[np.ndarray]:
    """Touches of a sphere at random, as rows of `_COLUMNS`, rounded as controls write them."""
    generator = np.random.default_rng(1)
    for start in range(0, count, _PIECE):
        size = min(_PIECE, count - start)
        z = generator.uniform(math.cos(_LIMIT), 1.0, size)
        azimuth = generator.uniform(0.0, 2.0 * math.pi, size)
        across = np.sqrt(1.0 - z**2)
        n = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), z])
        distance = 50.0 + generator.normal(0.0, 3e-4, size)
        yield np.hstack([np.round(n * distance[:, None], 5), np.round(n, 7)])


def write_table(count: int, table: Path) -> None:
    """Write touches of a sphere at random, in pieces."""
    import pyarrow as pa
    import pyarrow.csv

    schema = pa.schema([(name, pa.float64()) for name in _COLUMNS])
    with pa.csv.CSVWriter(table, schema) as rows:
        for piece in _pieces(count):
            rows.write_table(pa.table(dict(zip(_COLUMNS, piece.T, strict=True))))


def _some(table: Path, count: int, columns: Sequence[str]) -> np.ndarray:
    """These columns of some rows of a CSV file, read line by line, with the number of its rows."""
    apart = max(count // _LOOKED_AT, 1)
    with table.open(encoding="utf-8", newline="") as lines:
        rows = csv.DictReader(
            line for k, line in enumerate(lines) if k == 0 or (k - 1) % apart == 0
        )
        return np.array([[float(row[name]) for name in columns] for row in rows])


def _rows_of(table: Path) -> int:
    with table.open("rb") as file:
        return sum(part.count(b"\n") for part in iter(lambda: file.read(1 << 20), b"")) - 1


def compare_points(touches: Path, points: Path, made: Path, count: int) -> None:
    """Whether the points are those of `apply`, in the order of the touches."""
    assert _rows_of(points) == count, f"{_rows_of(points)} points of {count} touches"
    given = _some(touches, count, _COLUMNS)
    found = _some(points, count, _COLUMNS[:3])
    n = given[:, 3:] / np.linalg.norm(given[:, 3:], axis=1, keepdims=True)
    expected = apply(Touches(given[:, :3], n), read_map(made), extrapolate=True)
    # Files are written with at least 1e-7 mm.
    assert np.allclose(found, expected.positions, rtol=0.0, atol=2e-7)


def _note(ours: Spent, theirs: Spent) -> str:
    return (
        f"{ours.seconds / theirs.seconds:.2g} times the time of pandas; at most "
        f"{memory_text(ours.largest)} in one process, {memory_text(ours.together)} in all "
        f"({os.cpu_count()} cores); pandas {memory_text(theirs.together)}"
    )


def long_tables(sizes: Sizes) -> Figures:
    count = sizes.long_touches
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = _made_map(folder)
        table = folder / "touches.csv"
        write_table(count, table)
        points, copy = folder / "points.csv", folder / "copy.csv"
        command = [*PRETRAVEL, "compensate", str(table), "--map", str(made), "--extrapolate"]
        ours = spent([*command, "-o", str(points)])
        compare_points(table, points, made, count)
        points.unlink()
        text = f"import pandas\npandas.read_csv({str(table)!r}).to_csv({str(copy)!r}, index=False)"
        theirs = spent(python_file(folder, "read_csv.py", text))
        copy.unlink()
        rows = [
            Row(
                "touches compensated, CSV to CSV, kind auto, command and all", f"{count:,}",
                ours.seconds, "pandas read_csv and to_csv of the same file", theirs.seconds,
                _note(ours, theirs),
            )
        ]  # fmt: skip
    return Figures(tuple(rows))
