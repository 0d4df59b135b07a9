"""Files of touches: read, or refused with the line and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.csv_table import read_csv_table
from pretravel.files.touches_csv import read_touches

HEADER = "x_mm,y_mm,z_mm,nx,ny,nz\n"
GOOD = "0,0,3,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", None, "empty"),
        ("# only a comment\n\n", None, "empty"),
        (HEADER, 1, "no rows"),
        ("1,2,3,0,0,1\n" + GOOD, None, "does not give its unit"),
        ("x_mm,y_mm,z_mm\n0,0,3\n", 1, "need the columns nx, ny, nz"),
        (HEADER + GOOD + "0,0,nan,0,0,1\n", 3, "z_mm is 'nan'"),
        (HEADER + "# note\n" + GOOD + "\n0,0,,0,0,1\n", 5, "z_mm is empty"),
        (HEADER + "0,0,inf,0,0,1\n", 2, "not a finite number"),
        (HEADER + "0,0,3km,0,0,1\n", 2, "z_mm is '3km'"),
        (HEADER + GOOD + "0,0,3,0,0,0\n", 3, "is zero"),
        (HEADER + GOOD + "0,0,3,0,0,0.7\n", 3, "has length 0.7"),
        (HEADER + GOOD + "0,0,3,0,0\n", 3, "5 values, but the header names 6"),
        ("x_mm,x_mm,z_mm,nx,ny,nz\n" + GOOD, 1, "occurs twice"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,ax\n0,0,3,0,0,1,0\n", 1, "ay, az"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,ax,ay,az\n0,0,3,0,0,1,0,0,1\n", None, "line 2"),
    ],
)
def test_touches_file(text: str, line: int | None, words: str, tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_touches(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)
    if line is not None:
        assert f"line {line}:" in str(error.value)


def test_other_things_than_text(tmp_path: Path) -> None:
    binary = tmp_path / "a.csv"
    binary.write_bytes(bytes(range(256)))
    for path, words in (
        (binary, "not a text file"),
        (tmp_path, "cannot be read"),
        (tmp_path / "none.csv", "no such file"),
    ):
        with pytest.raises(InputError, match=words):
            read_csv_table(path)


def test_windows_files_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(("\ufeff" + HEADER + GOOD + '"1",2,3,0,0,1\n').replace("\n", "\r\n").encode())
    assert read_touches(path).positions.tolist() == [[0, 0, 3], [1, 2, 3]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("polar_deg;azimuth_deg\n0;0\n", "semicolons"),
        ("polar_deg\tazimuth_deg\n0\t0\n", "tabs"),
        ("1,2\n3,4\n", "first line holds numbers"),
    ],
)
def test_other_tables_have_one_form(text: str, words: str, tmp_path: Path) -> None:
    """Tables of maps, rigs and separations are those that this package writes."""
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_csv_table(path)
