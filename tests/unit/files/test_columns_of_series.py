"""Columns that a table of others calls T, Run, Cycle, WCS: carried, refused or counts of rows."""

from __future__ import annotations

import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.laboratory.repeat_log import read_repeats

MM = ReadingOptions(units="mm")


def _table(title: str, cells: tuple[str, ...]) -> SourceFile:
    rows = [f"{cell},{5 * row},0,2.99{row},0,0,1" for row, cell in enumerate(cells)]
    return SourceFile("t.csv", "\n".join([f"{title},X,Y,Z,I,J,K", *rows]).encode())


@pytest.mark.parametrize(
    ("title", "column"),
    [("T", "tip"), ("Run", "part"), ("Cycle", "part"), ("Lauf", "part"), ("Operation", "part")],
)
def test_a_column_that_groups_rows_is_carried(title: str, column: str) -> None:
    found = read_readings(_table(title, ("1", "1", "2", "2")), MM).touches
    assert found.words == {column: ("1", "1", "2", "2")}


@pytest.mark.parametrize("title", ["WCS", "Work offset", "Nullpunkt", "Coordinate system"])
def test_a_column_of_frames_that_changes_is_refused(title: str) -> None:
    with pytest.raises(InputError, match=rf"line 4: {title} changes \(from 'G54' to 'G55'\)"):
        read_readings(_table(title, ("G54", "G54", "G55")), MM)
    assert not read_readings(_table(title, ("G54", "G54", "G54")), MM).touches.words


@pytest.mark.parametrize(
    ("title", "cells"),
    [("Run", ("1", "2", "3")), ("T", ("20.1", "20.2", "20.2")), ("T", ("0", "1", "2"))],
)
def test_counts_times_and_temperatures_are_not_series(title: str, cells: tuple[str, ...]) -> None:
    found = read_readings(_table(title, cells), MM).touches
    assert not found.words
    assert f"not read: {title}" in found.reading


def test_a_table_with_part_and_run_keeps_both() -> None:
    rows = "\n".join(f"A,{run},0,0,{run},0,0,1" for run in (1, 1, 2))
    file = SourceFile("t.csv", f"Part,Run,X,Y,Z,I,J,K\n{rows}".encode())
    assert len(set(read_readings(file, MM).touches.words["part"])) == 2


@pytest.mark.parametrize("separator", [";", "\t", ",", "  ", " "])
@pytest.mark.parametrize("title", ["Run{}Z[mm]\n", "Trial{}z_mm\n"])
def test_heights_beside_a_count_are_repeats(separator: str, title: str) -> None:
    heights = (5.001, 5.002, 5.0015, 5.0022, 5.0011)
    rows = "\n".join(f"{n}{separator}{height}" for n, height in enumerate(heights, start=1))
    file = SourceFile("r.txt", (title.format(separator) + rows).encode())
    assert read_repeats(file).series[0].values.tolist() == list(heights)


@pytest.mark.parametrize(
    ("title", "column"),
    [("Stylus dia [mm]", "tip"), ("Tip radius", "tip"), ("Probe A", "orientation")],
)
def test_sizes_of_tips_and_angles_of_the_head_are_carried(title: str, column: str) -> None:
    found = read_readings(_table(title, ("3", "3", "1")), MM).touches
    assert found.words == {column: ("3", "3", "1")}


@pytest.mark.parametrize("title", ["Alignment", "Table angle"])
def test_alignments_and_a_turned_table_are_refused(title: str) -> None:
    with pytest.raises(InputError, match=f"line 4: {title} changes"):
        read_readings(_table(title, ("A1", "A1", "A2")), MM)


@pytest.mark.parametrize(
    ("title", "cells"),
    [
        ("Contact", ("1", "1", "0")),
        ("Success", ("True", "True", "False")),
        ("Status", ("OK", "OK", "MISS")),
        ("Missed", ("no", "no", "yes")),
        ("Trip signal", ("1.0", "1.0", "0.0")),
        ("Hit", ("x", "x", "")),
        ("Remark", ("", "", "probe did not trigger")),
    ],
)
def test_a_row_that_states_a_miss_is_refused(title: str, cells: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=rf"line 4: {title} is '{cells[-1]}'.*exclude"):
        read_readings(_table(title, cells), MM)
    options = ReadingOptions(units="mm", exclude=("4",))
    assert len(read_readings(_table(title, cells), options).touches) == 2


def test_counts_and_verdicts_are_no_misses() -> None:
    assert len(read_readings(_table("Contact", ("0", "1", "2")), MM).touches) == 3
    assert len(read_readings(_table("Status", ("OK", "NOK", "OK")), MM).touches) == 3


@pytest.mark.parametrize("cells", [("mm", "mm", "in"), ("mm", "mm", "inch")])
def test_a_row_of_another_unit_is_refused(cells: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r"line 4: Unit is 'in(?:ch)?' in this row"):
        read_readings(_table("Unit", cells), MM)
    assert len(read_readings(_table("Unit", ("mm", "mm", "mm")), MM).touches) == 3
