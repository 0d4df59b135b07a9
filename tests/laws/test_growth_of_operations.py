"""What is called grows with the touches, features and days, not with their pairs.

Calls of functions at two sizes, as an exponent: a sum over arrays is one call, a loop over rows is
many. Times are measured in `benchmarks/`, memory in `test_growth_of_memory.py`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from datetime import datetime, timedelta

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.drawing.features.between_features import relations_between
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.measurement.points import Points
from pretravel.qualification.drifts import DailyQuantity, drift_over_time
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

LINEAR = 1.1
"""Exponent with room for a logarithm."""
AT_ONCE = 0.2
"""Of what is done with arrays, in a few blocks."""


def _calls(job: Callable[[], object]) -> int:
    count = 0

    def seen(_frame: object, event: str, _argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(seen)
    try:
        job()
    finally:
        sys.setprofile(None)
    return count


def _exponent(job: Callable[[int], Callable[[], object]], small: int, large: int) -> float:
    job(small)()  # what is imported and kept for the next call is no growth
    few, many = _calls(job(small)), _calls(job(large))
    return math.log(many / few) / math.log(large / small)


def _touches(directions: np.ndarray) -> Touches:
    noise = np.random.default_rng(7).normal(0.0, 3e-4, len(directions))
    distance = 15.5 - 0.003 - 0.006 * (1.0 - directions[:, 2] ** 2) + noise
    return Touches(directions * distance[:, None], directions)


def _map() -> PretravelMap:
    return qualify(
        _touches(np.repeat(sphere_pattern_25(), 2, axis=0)), 25.0, tip_diameter=6.0, kind="harmonic"
    ).pretravel_map


def test_compensation_calls_as_much_for_many_touches_as_for_few() -> None:
    made = _map()

    def job(count: int) -> Callable[[], object]:
        touches = _touches(fibonacci_cap(count, 1.4))
        return lambda: apply(touches, made, extrapolate=True)

    assert _exponent(job, 200, 6400) < AT_ONCE


@pytest.mark.long
def test_features_and_what_lies_between_them_are_measured_one_after_the_other() -> None:
    """Of more than six features, neighbours alone are compared."""
    angle = np.arange(8) * np.pi / 4.0
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(8)])

    def bore(number: int) -> Points:
        return Points(
            positions=10.0 * outward + [30.0 * number, 0.0, 0.0],
            normals=-outward,
            pretravel=np.zeros(8),
            covariance=np.tile(1e-8 * np.eye(3), (8, 1, 1)),
            labels=tuple(f"bore{number}.{i}" for i in range(8)),
            deviation=None,
            shared={"tip radius": np.full(8, 1e-4)},
        )

    def job(count: int) -> Callable[[], object]:
        points = [bore(number) for number in range(count)]

        def measured() -> None:
            features = [measure_feature(each, "bore", label=each.labels[0]) for each in points]
            relations_between(features)

        return measured

    assert _exponent(job, 7, 28) < LINEAR


@pytest.mark.long
def test_a_drift_is_found_in_proportion_to_its_days() -> None:
    def job(count: int) -> Callable[[], object]:
        rng = np.random.default_rng(3)
        start = datetime(2026, 1, 1)
        moments = [start + timedelta(days=day) for day in range(count)]
        values = 1e-5 * np.arange(count) + rng.normal(0.0, 1e-4, count)
        size = DailyQuantity("size", "mm", values, np.full(count, 1e-4), 1.0)
        return lambda: drift_over_time(moments, [size], 5e-3)

    assert _exponent(job, 60, 480) < LINEAR
