"""Parquet files of touches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from pretravel.base.errors import InputError
from pretravel.files.many_numbers import arrow_column, numbers_of_arrow
from pretravel.files.tables import read_parquet_table
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.commands import rows, run
from tests.support.control_logs import (
    written,
)
from tests.support.examples import EXAMPLES


def example_touches() -> Touches:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    return replace(touches, labels=tuple(f"p{i + 1}" for i in range(len(touches))))


def parquet_file(path: Path, **columns: object) -> Path:
    """The example touches, with other columns."""
    import pyarrow as pa
    from pyarrow import parquet

    n = example_touches().normals[:4]
    names = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
    touches = dict(zip(names, np.hstack([15.0 * n, n]).T, strict=True))
    parquet.write_table(pa.table(touches | columns), path)
    return path


class TestColumnsOfOtherPrograms:
    @pytest.mark.parametrize("values", ["dates", "zone", "no zone", "bytes", "list", "decimal"])
    def test_those_that_nobody_uses_may_contain_anything(self, tmp_path: Path, values: str) -> None:
        import pyarrow as pa

        kinds = {
            "dates": pa.array([1, -800_000, 9_000_000, None], pa.date32()),
            "zone": pa.array([1, 2, 3, -(2**60)], pa.timestamp("us", "Europe/Berlin")),
            "no zone": pa.array([1, 2, 3, 2**60], pa.timestamp("us", "No/Zone")),
            "bytes": pa.array([b"\xff\x00"] * 4),
            "list": pa.array([[1], [2], [], [3]]),
            "decimal": pa.array([None] * 4, pa.decimal128(5, 2)),
        }
        path = parquet_file(tmp_path / "t.parquet", other=kinds[values])
        assert len(read_touches(path)) == 4

    def test_labels_of_bytes_and_numbers_of_bytes(self, tmp_path: Path) -> None:
        path = parquet_file(tmp_path / "t.parquet", label=[b"a", b"b", b"c", b"\xc3\xa9"])
        assert read_touches(path).labels == ("a", "b", "c", "é")
        path = parquet_file(tmp_path / "t.parquet", z_mm=[b"\xff"] * 4)
        with pytest.raises(InputError, match="'-'"):
            read_touches(path)

    def test_a_column_twice(self, tmp_path: Path) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        table = pa.table([pa.array([1.0])] * 2, names=["x_mm", "x_mm"])
        parquet.write_table(table, tmp_path / "t.parquet")
        with pytest.raises(InputError, match="column x_mm is in the file 2 times"):
            read_touches(tmp_path / "t.parquet")

    def test_more_rows_than_anybody_touches(self, tmp_path: Path) -> None:
        """Thirty million equal rows take 120 kB."""
        import pyarrow as pa
        from pyarrow import parquet

        value = pa.array([1.0]).dictionary_encode()
        rows = pa.DictionaryArray.from_arrays(pa.array(np.zeros(10**7, np.int8)), value.dictionary)
        table = pa.chunked_array([rows] * 3)
        parquet.write_table(pa.table({"x_mm": table}), tmp_path / "t.parquet", row_group_size=10**8)
        assert (tmp_path / "t.parquet").stat().st_size < 200_000
        with pytest.raises(InputError, match="declares 30,000,000 rows"):
            read_touches(tmp_path / "t.parquet")


class TestParquet:
    def test_touches_out_and_in_again(self, tmp_path: Path) -> None:
        touches = example_touches()
        write_touches(tmp_path / "t.parquet", touches)
        again = read_touches(tmp_path / "t.parquet")
        assert np.array_equal(again.positions, touches.positions)
        assert again.labels == touches.labels

    def test_read_by_another_program(self, tmp_path: Path) -> None:
        import pyarrow.parquet as pq

        run("convert", EXAMPLES / "part_touches.csv", "-o", tmp_path / "t.parquet")
        table = pq.read_table(str(tmp_path / "t.parquet"))
        assert str(table.schema.field("x_mm").type) == "double"
        assert table.num_rows == len(rows(EXAMPLES / "part_touches.csv"))

    def test_not_a_parquet_file(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="not a Parquet file"):
            read_touches(written(tmp_path, "hello", "t.parquet"))


class TestColumnsByTheirBuffers:
    def test_they_are_those_of_pyarrow(self) -> None:
        """Texts of several bytes a letter, empty ones, strided and single numbers, whole ones."""
        strided = np.arange(12.0).reshape(4, 3)[:, 1]
        for values in (["µm", "", "a", "€ 1"], strided, np.array([0.5], np.float32), [1, 2]):
            own, theirs = arrow_column(values), pa.array(np.asarray(values).tolist())
            assert own.type == theirs.type
            assert own.equals(theirs)

    def test_numbers_come_back_in_their_order(self) -> None:
        chunked = pa.chunked_array([[1.0, 2.0], [], [3.0]], pa.float64())
        assert numbers_of_arrow(chunked).tolist() == [1.0, 2.0, 3.0]
        assert numbers_of_arrow(pa.array([1.0, 2.0, 3.0])[1:]).tolist() == [2.0, 3.0]
        assert np.isnan(numbers_of_arrow(pa.array([1.0, None]))).tolist() == [False, True]


class TestFewBytesThatDeclareMuch:
    """Files below 1 kB whose content would take gigabytes."""

    def test_equal_long_texts_are_one(self, tmp_path: Path) -> None:
        """3000 texts of a million signs."""
        import pyarrow as pa

        text = pa.array(["x" * 1_000_000])
        many = pa.DictionaryArray.from_arrays(pa.array([0] * 3000, pa.int32()), text)
        path = stored(
            tmp_path, x_mm=many, other=pa.ListArray.from_arrays([0] * 3000 + [3000], many)
        )
        (first, *rest) = read_parquet_table(path).columns["x_mm"]
        assert len(first) == 1_000_000
        assert all(cell is first for cell in rest)

    @pytest.mark.slow
    def test_long_lists_and_texts_are_refused(self, tmp_path: Path) -> None:
        import pyarrow as pa

        zeros = pa.array(np.zeros(20_000_000, np.int8))
        path = stored(tmp_path, x_mm=pa.ListArray.from_arrays([0, len(zeros)], zeros))
        with pytest.raises(InputError, match="so many are not read"):
            read_parquet_table(path)
        path = stored(tmp_path, plain=True, x_mm=pa.array(["x" * 210_000_000]))
        with pytest.raises(InputError, match=r"declares 210,000,0\d\d bytes of content"):
            read_parquet_table(path)


def stored(folder: Path, *, plain: bool = False, **columns: object) -> Path:
    import pyarrow as pa
    from pyarrow import parquet

    path = folder / "t.parquet"
    parquet.write_table(pa.table(columns), path, compression="zstd", use_dictionary=not plain)
    assert path.stat().st_size < 10_000
    return path
