"""Tables of targets."""

from __future__ import annotations

import math

import numpy as np

from pretravel.files.plan_csv import pattern_table


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
