"""Parquet files of touches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.errors import InputError
from pretravel.formats.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.commands import rows, run
from tests.support.control_logs import (
    written,
)
from tests.support.examples import EXAMPLES


def example_touches() -> Touches:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    return replace(touches, labels=tuple(f"p{i + 1}" for i in range(len(touches))))


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
