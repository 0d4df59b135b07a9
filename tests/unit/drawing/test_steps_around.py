"""Unequal steps around a bore, against what lobes do to its circle of least squares."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.drawing.steps_around import steps_around


def _largest_movement(azimuth: FloatArray) -> float:
    """Of diameter, x or y by 2 to 12 lobes of unit amplitude and any phase."""
    columns = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.ones(len(azimuth))])
    rows = np.diag([1.0, 1.0, 2.0]) @ np.linalg.pinv(columns)
    moved = [
        rows @ np.column_stack([np.cos(k * azimuth), np.sin(k * azimuth)]) for k in range(2, 13)
    ]
    return float(max(np.linalg.norm(each, axis=1).max() for each in moved))


@pytest.mark.parametrize("count", range(4, 30))
def test_no_lobes_look_like_another_size_or_place(count: int) -> None:
    """As many lobes as equal touches move the diameter by twice their amplitude.

    Unequal ones let no lobes move it by more than errors of single touches do (2 sqrt(1/n), with a
    reserve of a quarter).
    """
    azimuth = steps_around(count)
    assert np.all(np.diff(azimuth) > 0.0)
    assert azimuth[-1] < 2.0 * np.pi
    assert _largest_movement(azimuth) < 1.25 * 2.0 / np.sqrt(count)
    if count < 13:
        equal = 2.0 * np.pi * np.arange(count) / count
        assert _largest_movement(equal) == pytest.approx(2.0)
