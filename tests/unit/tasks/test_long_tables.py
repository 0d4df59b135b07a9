"""Long tables part by part: touches and points of the whole file, in constant memory."""

from __future__ import annotations

import csv
import logging
import sys
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import InputError, PretravelError
from pretravel.files import long_tables as files_long_table
from pretravel.files import many_numbers, number_tables
from pretravel.files.csv_table import csv_table_text
from pretravel.files.file_format import ReadingOptions
from pretravel.files.long_tables import LongTable, long_table
from pretravel.files.many_numbers import listed_rows
from pretravel.files.points_writing import listed_numbers
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply
from pretravel.tasks.compensate import Compensate, compensate_long_table
from pretravel.tasks.compensate import task as compensate
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import both_outputs

COUNT = 1000


@pytest.fixture(autouse=True)
def _short_tables_are_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files_long_table, "LONG_TABLE", 200)
    monkeypatch.setattr(number_tables, "_HEAD_BYTES", 3000)
    monkeypatch.setattr(number_tables, "_HEAD_ROWS", 20)
    usual = LongTable.readings
    monkeypatch.setattr(LongTable, "readings", lambda table, rows=90: usual(table, rows))
    monkeypatch.setattr(compensate, "_DRAWN", 50)


@pytest.fixture(scope="module")
def made() -> PretravelMap:
    basis = HarmonicBasis(degrees_and_orders(2))
    rng = np.random.default_rng(5)
    values = np.concatenate([[0.02], rng.normal(0.0, 1e-3, basis.size - 1)])
    return PretravelMap(
        basis,
        values,
        Covariance.independent(np.full(basis.size, 4e-8)),
        DirectionSupport(fibonacci_cap(200, 1.6)),
        tip_radius=3.0,
        repeatability=3e-4,
    )


def _touches(count: int = COUNT, *, labels: bool = False) -> Touches:
    normals = fibonacci_cap(count, 1.5)
    noise = np.random.default_rng(2).normal(0.0, 3e-4, (count, 3))
    return Touches(
        15.5 * normals + noise,
        normals,
        feeds=np.full(count, 60.0),
        labels=tuple(f"bore {i // 50}-{i % 50}" for i in range(count)) if labels else None,
        nominal_points=12.5 * normals,
    )


def _table(path: Path, options: ReadingOptions | None = None) -> LongTable:
    found = long_table(path, options)
    assert found is not None
    return found


def _parts(table: LongTable) -> Iterator[Touches]:
    for readings in table.readings():
        yield readings.touches


def _equal(touches: list[Touches], whole: Touches) -> None:
    for name in ("positions", "normals", "approaches", "feeds", "nominal_points"):
        parts = [getattr(part, name) for part in touches]
        expected = getattr(whole, name)
        if expected is None:
            assert all(found is None for found in parts)
        else:
            assert np.array_equal(np.concatenate(parts), expected)  # every bit
    assert [line for part in touches for line in part.lines or ()] == list(whole.lines or ())
    if whole.labels is not None:
        assert tuple(label for part in touches for label in part.labels or ()) == whole.labels
    numbers = [part.numbered_from for part in touches]
    assert numbers == [1 + sum(map(len, touches[:i])) for i in range(len(touches))]


def test_a_short_line_is_noticed_where_its_last_column_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    rows = ["x_mm,y_mm,z_mm,nx,ny,nz,remark", *["1.0,2.0,3.0,0,0,1,good"] * COUNT]
    rows[800] = "1.0,2.0,3.0,0,0,1"
    path.write_text("\n".join(rows))
    with pytest.raises(InputError, match=r"line 801: Expected 7 columns, got 6"):
        list(_parts(_table(path)))


@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_parts_of_our_own_tables_are_the_whole(tmp_path: Path, ending: str, labels: bool) -> None:
    path = tmp_path / f"touches.{ending}"
    write_touches(path, _touches(labels=labels))
    parts = list(_parts(_table(path)))
    assert len(parts) > 5
    _equal(parts, read_touches(path))


def _in_shop_form(path: Path, touches: Touches, *, first: str = "") -> None:
    """Semicolons, decimal commas, two decimals of the normals, a comment before the header."""
    rows = np.column_stack([touches.positions, touches.normals])
    lines = [";".join(f"{v:.5f}" for v in row[:3]) + ";" + ";".join(f"{v:.2f}" for v in row[3:])
             for row in rows]  # fmt: skip
    text = f"# CMM 7, units: mm\nX;Y;Z;I;J;K\n{first}" + "\n".join(lines)
    path.write_text(text.replace(".", ","), encoding="utf-8")


def test_parts_of_a_shops_table_are_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "shop.txt"
    _in_shop_form(path, _touches())
    table = _table(path)
    parts = list(_parts(table))
    whole = read_touches(path)
    _equal(parts, whole)
    assert whole.reading == f"{COUNT} touches; {table.understood}"


def test_quoted_labels_and_empty_lines(tmp_path: Path) -> None:
    """Far behind the head."""
    path = tmp_path / "touches.csv"
    write_touches(path, _touches(labels=True))
    lines = path.read_text().splitlines()
    lines[500] = lines[500].replace("bore 9-49", '" bore 9, last"')
    lines[600] = lines[600].replace("bore 11-49", "'=1+1")
    path.write_text("\n".join([*lines[:800], "", *lines[800:], ""]) + "\n", encoding="utf-8")
    parts, whole = list(_parts(_table(path))), read_touches(path)
    assert np.array_equal(np.vstack([part.positions for part in parts]), whole.positions)
    labels = [label for part in parts for label in part.labels or ()]
    assert labels == list(whole.labels or ())
    assert (labels[499], labels[599]) == ("bore 9, last", "=1+1")


@pytest.mark.parametrize(
    ("line", "text", "told"),
    [
        (900, "1.0,2.0,3.0,0,0,one", "invalid value 'one'"),
        (901, "1.0,2.0,3.0,0,0", "Expected 6 columns, got 5"),
        (902, "1.0,2.0,3.0,0,0,1,7", "Expected 6 columns, got 7"),
        (903, "1.0,2.0,,0,0,1", "invalid value ''"),
        (904, "1.0,2.0,nan,0,0,1", "z_mm is not a number of this size"),
        (905, "1.0,2.0,1e300,0,0,1", "z_mm is not a number of this size"),
        (906, "1.0,2.0,3.0,0,0,2", "unit"),
        (907, "# a new shift", "no comments behind its header"),
    ],
)
def test_a_damaged_line_is_named(tmp_path: Path, line: int, text: str, told: str) -> None:
    path = tmp_path / "touches.csv"
    plain = Touches(_touches().positions, _touches().normals)
    rows = np.column_stack([plain.positions, plain.normals])
    body = ["x_mm,y_mm,z_mm,nx,ny,nz", *(",".join(map(repr, row.tolist())) for row in rows)]
    body[line - 1] = text
    path.write_text("\n".join(body))
    with pytest.raises(InputError, match=f"touches.csv, line {line}: .*{told}"):
        list(_parts(_table(path)))


def test_what_is_missing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the package that reads parts is not installed."""
    path = tmp_path / "touches.csv"
    write_touches(path, _touches())
    monkeypatch.setitem(sys.modules, "pyarrow.csv", None)
    with pytest.raises(PretravelError, match=r'pip install "pretravel\[tables\]"'):
        long_table(path)
    write_touches(path, _touches(50))
    assert long_table(path) is None


def test_empty_cells_of_parquet_have_the_number_of_their_row(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    path = tmp_path / "touches.parquet"
    write_touches(path, _touches())
    table = parquet.read_table(path)
    values = table.column("y_mm").to_pylist()
    values[777] = None
    parquet.write_table(table.set_column(1, "y_mm", pa.array(values)), path)
    with pytest.raises(InputError, match="line 778: y_mm is empty"):
        list(_parts(_table(path)))


def test_what_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    write_touches(path, _touches())
    for options in (ReadingOptions(exclude=("7",)), ReadingOptions(reference_diameter=25.0)):
        assert long_table(path, options) is None
    write_touches(path, _touches(50))
    assert long_table(path) is None
    path.write_text("x_mm,y_mm,z_mm\n" + "1.0,2.0,3.0\n" * 500)
    assert long_table(path) is None  # positions, which need their targets
    assert long_table(tmp_path / "absent.csv") is None  # the usual reader says so
    path.write_text("X;Y;Z;I;J;K\n" + "1,250;2,500;3,000;0;0;1\n" * 500)
    assert long_table(path, ReadingOptions(units="mm")) is None  # thousands, or three decimals?
    path.write_text("a letter\n" * 500)
    assert long_table(path) is None


def _without_shared(text: str) -> list[list[str]]:
    rows = list(csv.reader(text.splitlines()))
    kept = [i for i, name in enumerate(rows[0]) if not name.startswith("shared_")]
    return [[row[i] for i in kept] for row in rows]


def test_points_and_report_are_those_of_the_whole(tmp_path: Path, made: PretravelMap) -> None:
    """All but the shared errors, which a long table does not state, and the pictures."""
    path, long, short = (tmp_path / name for name in ("touches.csv", "long.csv", "short.csv"))
    write_touches(path, _touches(labels=True))
    task = Compensate(touches=(path,), map_file="", output=long)
    found = compensate_long_table(_table(path), made, task)
    from pretravel.files.readings import read_readings

    whole = task.compensated(read_readings(path), made)
    whole.write("output", short)
    assert _without_shared(long.read_text()) == _without_shared(short.read_text())
    report, expected = found.document(), whole.document()
    assert report.verdict == expected.verdict
    assert report.warnings == expected.warnings
    assert [terminal_text_of(table) for table in report.tables] == [
        terminal_text_of(table) for table in expected.tables
    ]
    assert [figure.name for figure in report.figures] == [f.name for f in expected.figures]
    (budget,), (of_all,) = report.budgets, expected.budgets
    assert budget.combined == pytest.approx(of_all.combined, rel=0.05)  # of 50 of 1000 points


def terminal_text_of(table: object) -> str:
    from pretravel.show.terminal import table_text

    return table_text(table)  # type: ignore[arg-type]


def test_numbers_and_labels_go_on_from_part_to_part(tmp_path: Path, made: PretravelMap) -> None:
    path, out = tmp_path / "touches.parquet", tmp_path / "points.parquet"
    write_touches(path, _touches())
    task = Compensate(touches=(path,), map_file="", output=out)
    compensate_long_table(_table(path), made, task)
    from pyarrow import parquet

    table = parquet.read_table(out)
    assert table.column("label").to_pylist() == [str(i + 1) for i in range(COUNT)]
    expected = apply(read_touches(path), made).positions[:, 0]
    assert np.array_equal(table.column("x_mm").to_numpy(), expected)


def test_a_fault_leaves_no_output(tmp_path: Path, made: PretravelMap) -> None:
    """A normal outside the map, in the last part."""
    touches = _touches()
    normals = touches.normals.copy()
    normals[-1] = [0.0, 0.6, -0.8]
    path, out = tmp_path / "touches.csv", tmp_path / "points.csv"
    write_touches(path, Touches(touches.positions, normals))
    task = Compensate(touches=(path,), map_file="", output=out)
    with pytest.raises(PretravelError, match="lie outside the map"):
        compensate_long_table(_table(path), made, task)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["touches.csv"]


def test_the_command_reads_long_tables(tmp_path: Path) -> None:
    """It says how the file was understood."""
    path = tmp_path / "shop.txt"
    _in_shop_form(path, _touches())
    told, warned = both_outputs(
        "compensate", path, "--map", "omp40-2", "--feed", 60, "-o", tmp_path / "p.csv"
    )
    assert f"read: {COUNT} touches; separator ';', decimal comma, mm (given in the file)" in told
    assert f"{COUNT} points" in told
    assert "a predicted map contains no signal delay" in warned


@pytest.mark.slow
def test_memory_does_not_grow_with_the_table(
    tmp_path: Path, made: PretravelMap, caplog: pytest.LogCaptureFixture
) -> None:
    """Four times as many touches: what is kept are 50 points for pictures, and numbers."""
    caplog.set_level(logging.WARNING, "pretravel")  # each part is a message, which pytest keeps
    peaks = []
    for count in (5000, 5000, 20_000):
        path = tmp_path / f"{count}.csv"
        write_touches(path, _touches(count))
        table = _table(path)
        task = Compensate(touches=(path,), map_file="", output=tmp_path / "points.csv")
        tracemalloc.start()
        compensate_long_table(table, made, task)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.3 * peaks[1]  # 4 times where all is kept; the first one imports


def test_memory_of_arrow_does_not_grow_with_the_table(tmp_path: Path) -> None:
    """A file of 40 groups of rows: a quarter of it at most is in memory."""
    import pyarrow as pa
    from pyarrow import parquet

    path = tmp_path / "touches.parquet"
    columns = np.tile([1.0, 2.0, 3.0, 0.0, 0.0, 1.0], (5000, 1)) + 1e-9 * np.arange(5000)[:, None]
    group = pa.table(dict(zip(("x_mm", "y_mm", "z_mm", "nx", "ny", "nz"), columns.T, strict=True)))
    with parquet.ParquetWriter(path, group.schema) as writer:
        for _ in range(40):
            writer.write_table(group)
    table, pool = _table(path), pa.default_memory_pool()
    before = pool.bytes_allocated()
    kept = [pool.bytes_allocated() - before for _ in table.readings(5000)]
    assert len(kept) == 40
    assert max(kept) < 0.25 * 40 * group.nbytes  # groups as they are and as they are stored


def test_rows_of_plain_cells_have_the_text_of_the_writer_of_csv() -> None:
    """The short way and the usual way; labels with signs that need quotes take the usual one."""
    columns = {"label": ["a1", "b 2"], "x": [1e-7, -123456789.123456789], "n": [0.1, -0.0]}
    assert csv_table_text(columns) == "label,x,n\na1,1e-07,0.1\nb 2,-123456789.123,-0\n"
    odd = {"label": ['a"1', "=1+1"], "x": [0.5, np.nan]}
    assert csv_table_text(odd) == 'label,x\n"a""1",0.5\n\'=1+1,\n'


def test_many_numbers_are_written_as_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """By pyarrow as by Python: numbers of all sizes, in columns and in lists of one cell."""
    rng = np.random.default_rng(5)
    numbers = rng.normal(size=(3, 400)) * 10.0 ** rng.integers(-7, 11, (3, 400))
    numbers[0, :2] = 0.0, 25.0
    lists = {}
    for many in (1, 10**9):
        monkeypatch.setattr(many_numbers, "_MANY", many)
        rows = listed_rows(list(numbers))
        text = csv_table_text({"label": [f"P{i}" for i in range(400)], "x": numbers[0], "l": rows})
        lists[many] = [line.split(",") for line in text.splitlines()[1:]]
    for few, much in zip(lists[10**9], lists[1], strict=True):
        assert few[0] == much[0]
        # The last of twelve digits may be rounded to the other side.
        assert float(few[1]) == pytest.approx(float(much[1]), rel=2e-11)
        assert listed_numbers(few[2:]) == pytest.approx(listed_numbers(much[2:]), rel=2e-11)
        for word in much[2].strip("[]").split():
            digits = word.partition("e")[0].replace(".", "").lstrip("-0")
            assert len(digits) <= 12, word


def test_small_numbers_in_lists_have_twelve_decimals(monkeypatch: pytest.MonkeyPatch) -> None:
    """With carries, zeros of both signs, and numbers that round to zero or to the next digit."""
    odd = [0.0, -0.0, 9.4999999999999, -9.4, 0.9999999999996, -0.9999999999996, -4e-13, 6e-13]
    rng = np.random.default_rng(6)
    numbers = np.array([[*odd, *rng.uniform(-9.4, 9.4, 2492)], rng.uniform(-0.1, 0.1, 2500)])
    monkeypatch.setattr(many_numbers, "_MANY", 1)
    rows = listed_rows(list(numbers)).to_pylist()
    assert np.abs(listed_numbers(rows) - numbers).max() <= 0.501e-12  # and the last bit of both
    assert {len(row) for row in rows} == {33}


def test_numbers_of_text_are_read_with_every_bit(tmp_path: Path) -> None:
    """Against Python's own reading, for printed forms of 3 to 17 digits."""
    rng = np.random.default_rng(1)
    sizes = rng.normal(size=20_000) * 10.0 ** rng.integers(-9, 5, 20_000)
    cells = [f"{v:.{d}g}" for v, d in zip(sizes, rng.integers(3, 18, 20_000), strict=True)]
    path = tmp_path / "touches.csv"
    body = "".join(f"{cell},0.5,-1.5,0,0,1\n" for cell in cells)
    path.write_text(f"x_mm,y_mm,z_mm,nx,ny,nz\n{body}")
    found = np.concatenate([part.positions[:, 0] for part in _parts(_table(path))])
    assert np.array_equal(found, [float(cell) for cell in cells])
