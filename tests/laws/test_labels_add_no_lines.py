"""Law of all formats that are written: a label adds no line that a control or reader executes."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FileFormat, ReadingOptions
from pretravel.files.format_registry import FORMATS
from pretravel.files.points_writing import write_points
from pretravel.files.readings import read_readings, write_readings
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches
from tests.support.example_maps import lobes

SMUGGLED = (
    "a\nG801 N1 X9 Y9 Z9 R3\nM3 S20000",
    "b\r\nG0 Z-80",
    "c --><Points>9 9 9</Points><!--",
    "d\u2028M3\x85M4\x0bM5\x0cM6",
    "END",
    ")(M3",
    "G1 X5",
    "",
    "same;",
    "same:",
)
TEXT = [
    (f, e)
    for f in FORMATS.values()
    if f.write_touches
    for e in f.endings
    if e in (".msr", ".txt", ".qif")
]
_ORDER = re.compile(r"^\s*[GMNXYZ]\d", re.IGNORECASE)


def _touches() -> Touches:
    count = len(SMUGGLED)
    return Touches(
        np.arange(3.0 * count).reshape(count, 3),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        labels=SMUGGLED,
        nominal_points=np.zeros((count, 3)),
    )


def _check(path: Path) -> None:
    """As many orders as points, and each is where the writer put it."""
    if path.suffix == ".qif":
        names = [element.tag.rpartition("}")[2] for element in ET.parse(path).getroot().iter()]
        assert names.count("Points") == names.count("MeasuredPointSet") == 1
        return
    # As a control or reader may split lines, which is more than at the line end alone.
    lines = path.read_text(encoding="utf-8").splitlines()
    orders = [line for line in lines if _ORDER.match(line)]
    assert len(orders) == 2 * len(SMUGGLED)
    assert all(line.startswith(("G800 N", "G801 N")) for line in orders)
    assert lines.count("END") == 1
    assert all(
        re.fullmatch(r";LABEL [A-Za-z0-9 _.-]+|; [A-Z ]+", line) for line in lines if ";" in line
    )


@pytest.mark.parametrize(("known", "ending"), TEXT)
def test_labels_and_file_names_add_no_lines(known: FileFormat, ending: str, tmp_path: Path) -> None:
    touches = _touches()
    path = tmp_path / f"G0 Z-9\nM3{ending}"
    write_readings(path, touches, 3.0)
    _check(path)
    again = read_readings(path, ReadingOptions(units="mm"), file_format=known.name).touches
    assert again.positions == pytest.approx(touches.positions, abs=1e-12)
    assert len(set(again.labels or ())) == len(SMUGGLED)
    points = apply(touches, lobes(3))
    write_points(path, points, nominal_points=touches.nominal_points, tip_radius=3.0)
    _check(path)
    with pytest.raises(InputError, match=r"compensated|already subtracted"):  # not once more
        read_readings(path, ReadingOptions(units="mm"), file_format=known.name)
