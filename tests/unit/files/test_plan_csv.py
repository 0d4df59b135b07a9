"""Tables of targets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base import InputError
from pretravel.files.plan_csv import pattern_table
from pretravel.files.source_file import SourceFile
from pretravel.files.touches_csv import read_plan, read_targets


def test_a_pattern_turns_counter_clockwise_with_the_probe() -> None:
    """A quarter turn moves +x to +y; radius 2 mm and retreat 1 mm about (10, 20, 30)."""
    table = pattern_table(
        np.array([[1.0, 0.0, 0.0]]), [10.0, 20.0, 30.0], 2.0, 1.0, turn=0.5 * math.pi
    )
    found = {name: np.ravel(np.asarray(table[name]))[0] for name in table if name != "label"}
    expected = {"x_mm": 10.0, "y_mm": 22.0, "z_mm": 30.0, "nx": 0.0, "ny": 1.0, "nz": 0.0}
    expected |= {"start_x_mm": 10.0, "start_y_mm": 23.0, "start_z_mm": 30.0}
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert abs(found[name] - value) < 1e-12, name


@pytest.mark.parametrize(
    ("title", "first", "second"),
    [
        ("Tool", "1", "2"),
        ("part", "A", "B"),
        ("feed_mm_min", "50", "100"),
        ("spindle_deg", "0", "9"),
    ],
)
def test_targets_of_two_tips_parts_or_feeds_are_refused(
    title: str, first: str, second: str
) -> None:
    rows = f"{title},x_mm,y_mm,z_mm,nx,ny,nz\n{first},0,0,5,0,0,1\n{{}},9,0,5,0,0,1\n"
    assert len(read_targets(SourceFile("t.csv", rows.format(first).encode()))) == 2
    for read in (read_targets, read_plan):
        with pytest.raises(InputError, match=rf"line 3: the column {title} changes \(from"):
            read(SourceFile("t.csv", rows.format(second).encode()))
