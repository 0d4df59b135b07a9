"""A point that lies apart from the feature of the others is named; rough and lobed ones are not."""

from __future__ import annotations

import numpy as np

from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.features.odd_point import odd_point
from pretravel.measurement.points import Points

AZIMUTH = 2.0 * np.pi * np.arange(12) / 12
CIRCLE = np.column_stack([np.ones(12), np.cos(AZIMUTH), np.sin(AZIMUTH)])
OWN = np.full(12, 3e-4)


def _left(off: np.ndarray) -> np.ndarray:
    return np.asarray(off - CIRCLE @ np.linalg.lstsq(CIRCLE, off, rcond=None)[0])


def test_a_point_apart_is_named() -> None:
    radius = 25.0 + np.random.default_rng(1).normal(0.0, 5e-4, 12)
    radius[4] += 0.015
    around = np.column_stack([np.cos(AZIMUTH), np.sin(AZIMUTH), np.zeros(12)])
    points = Points.plain(radius[:, None] * around, tuple(f"p{i}" for i in range(12)))
    said = measure_feature(points, "circle").warnings[0]
    # The distance from the circle of the others is 15 µm within four standard deviations.
    assert said.startswith("point p4 lies +1")
    assert abs(float(said.split()[3]) - 15.0) < 4.0 * 0.5 / np.sqrt(1.0 - 3.0 / 12.0)


def test_roughness_and_lobes_have_no_such_point() -> None:
    """Of normally distributed roughness in one of 1,000: in 1,000 sets at most six (99.9 %)."""
    rng = np.random.default_rng(2)
    rough = [odd_point(_left(rng.normal(0.0, 3e-3, 12)), CIRCLE, OWN) for _ in range(1000)]
    assert sum(found is not None for found in rough) <= 6
    for lobes in range(2, 6):
        form = 5e-3 * np.cos(lobes * AZIMUTH + rng.uniform(0.0, 6.0))
        assert odd_point(_left(form + rng.normal(0.0, 3e-4, 12)), CIRCLE, OWN) is None
