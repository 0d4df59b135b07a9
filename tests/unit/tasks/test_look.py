"""A look at a file says what is understood, and what there is to choose from."""

from __future__ import annotations

from pathlib import Path

from pretravel.files.file_format import ReadingOptions
from pretravel.tasks.look import columns_of_table, first_lines, look_at_touches


def test_what_a_table_lacks_is_no_fault(tmp_path: Path) -> None:
    path = tmp_path / "shop.csv"
    path.write_text("X;Y;Z\n1;2;3\n4;5;6,5\n")
    found = look_at_touches(path)
    assert (found.positions.tolist(), found.unit_known) == ([[1, 2, 3], [4, 5, 6.5]], False)
    assert "unit of length not stated" in found.understood
    assert look_at_touches(path, ReadingOptions(units="inch")).positions[0, 0] == 25.4
    assert first_lines(path) == ("X;Y;Z", "1;2;3", "4;5;6,5")


def test_columns_that_a_name_does_not_tell_apart_are_numbered(tmp_path: Path) -> None:
    path = tmp_path / "twice.csv"
    path.write_text("X;a,b;Y;Z;temp;temp\n1;0;2;3;20;21\n4;0;5;6;20;21\n")
    columns = columns_of_table(path, ReadingOptions())
    assert columns is not None
    assert columns.titles == ("X", "2", "Y", "Z", "5", "6")
    assert columns.roles == {"x": "X", "y": "Y", "z": "Z"}
    stated = columns_of_table(path, ReadingOptions(columns={"z": "5"}))
    assert stated is not None
    assert stated.roles["z"] == "5"


def test_a_binary_file_has_no_lines_to_show(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1\0\0\1")
    assert first_lines(path) == ()
