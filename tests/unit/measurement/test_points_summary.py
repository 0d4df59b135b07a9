"""Summaries of blocks make the summary of all."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.measurement.points_summary import Moments, TouchSummary


def test_moments_of_blocks_are_those_of_all_values() -> None:
    """Against NumPy; the values lie far from zero, where a sum of squares loses its digits."""
    values = 1e3 + np.random.default_rng(3).normal(0.0, 1e-3, 1000)
    joined = Moments.of(values[:1])
    for begin, end in ((1, 17), (17, 600), (600, 1000)):
        joined = joined.joined(Moments.of(values[begin:end]))
    assert (joined.count, joined.low, joined.high) == (1000, values.min(), values.max())
    assert joined.mean == pytest.approx(values.mean(), abs=1e-12)  # the last digits of 1e3
    assert joined.spread == pytest.approx(values.std(), rel=1e-9)


def test_shifted_moments_keep_their_spread() -> None:
    moved = Moments.of(np.array([-3.0, 1.0])).shifted(1.0)
    assert (moved.low, moved.high, moved.mean, moved.spread) == (-2.0, 2.0, 0.0, 2.0)
    assert Moments.of(np.array([-3.0, 1.0])).largest == 3.0


def test_touches_of_blocks_are_counted_together() -> None:
    one = TouchSummary(1, 0.9, (60.0, 80.0), 0.5, 1)
    other = TouchSummary(3, 0.8, (50.0, 70.0), 0.1, 2)
    assert one.joined(other) == TouchSummary(4, 0.8, (50.0, 80.0), pytest.approx(0.2), 3)
    assert one.joined(TouchSummary(1, 1.0)).feeds is None
