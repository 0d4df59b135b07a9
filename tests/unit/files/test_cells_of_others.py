"""Cells and rows of tables as spreadsheets and reports have them."""

from __future__ import annotations

import pytest

from pretravel.base import InputError
from pretravel.files import ReadingOptions, SourceFile, read_readings

_MM = ReadingOptions(units="mm")


def _file(text: str) -> SourceFile:
    return SourceFile("a.csv", text.encode())


def test_a_unit_behind_the_numbers_is_that_of_the_column() -> None:
    text = "Name;X;Y;Z;I;J;K\np1;10,0 mm;1in;-0,2mm;0;0;1\np2;20,0 mm;2in;0,1mm;0;0;1\n"
    with pytest.raises(InputError, match=r"inch|units"):
        read_readings(_file(text))
    found = read_readings(_file(text.replace("in;", "mm;")))
    assert found.touches.positions.tolist() == [[10.0, 1.0, -0.2], [20.0, 2.0, 0.1]]


def test_rows_of_two_units_are_refused() -> None:
    text = "X;Y;Z;I;J;K\n1 mm;2 mm;3 mm;0;0;1\n0.1 in;2 mm;3 mm;0;0;1\n"
    with pytest.raises(InputError, match="line 3: this row has another unit"):
        read_readings(_file(text))


def test_a_sign_behind_the_number_is_its_sign() -> None:
    found = read_readings(_file("X,Y,Z,I,J,K\n1.5-,2.0,0.0108-,0,0,1\n2,3-,0.01+,0,0,1\n"), _MM)
    assert found.touches.positions.tolist() == [[-1.5, 2.0, -0.0108], [2.0, -3.0, 0.01]]


def test_rows_that_are_computed_from_the_others_are_no_touches() -> None:
    rows = "Name,X,Y,Z,I,J,K\np1,0,0,3,0,0,1\np2,1,0,3,0,0,1\n"
    found = read_readings(_file(rows + "Mean,0.5,0,3,0,0,1\nStd. dev.,0.5,0,0,,,\n"), _MM)
    assert len(found.touches) == 2
    assert any("line 4 'Mean,0.5" in note for note in found.notes())


def test_points_may_have_such_names() -> None:
    found = read_readings(_file("Name,X,Y,Z,I,J,K\nmin,0,0,3,0,0,1\nmax,1,0,3,0,0,1\n"), _MM)
    assert found.touches.labels == ("min", "max")
