"""Work grows with touches, features and days, not with their pairs: in calls and memory.

Each as an exponent over two sizes. A sum over arrays is one call, and a loop over rows is many; a
matrix of all pairs shows in the memory. Times are measured in `benchmarks/`.
"""

from __future__ import annotations

import math
import sys
import tracemalloc
from collections.abc import Callable
from datetime import datetime, timedelta

import numpy as np
import pytest

from pretravel import Targets, Touches, apply, load_probe, qualify, simulate
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.features.between_features import relations_between
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.points import Points
from pretravel.qualification import within_directions
from pretravel.qualification.change_tests import touches_and_map
from pretravel.qualification.drifts import DailyQuantity, drift_over_time
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import repeat_outliers
from pretravel.qualification.prior_update import update_map
from pretravel.surface.shapes import Plane
from tests.support.example_maps import example_map
from tests.support.touched_bracket import bracket, random_targets

LINEAR = 1.1
"""Exponent with room for a logarithm: that of n log n is below 1.12 from 1,000 on, and sorting is
never all of the work."""
OF_MEMORY = 1.2
AT_ONCE = 0.2
"""Of the calls where arrays are worked on in a few blocks."""

Job = Callable[[], object]
Work = Callable[[Job], int]


def calls(job: Job) -> int:
    """Of functions, of Python's and of compiled ones."""
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


def memory(job: Job) -> int:
    """The peak. [bytes]"""
    tracemalloc.start()
    try:
        job()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _exponent(work: Work, job: Callable[[int], Job], small: int, large: int) -> float:
    job(small)()  # what is imported and kept for the next call is no growth
    return math.log(work(job(large)) / work(job(small))) / math.log(large / small)


def _touches(directions: np.ndarray) -> Touches:
    noise = np.random.default_rng(7).normal(0.0, 3e-4, len(directions))
    distance = 15.5 - 0.003 - 0.006 * (1.0 - directions[:, 2] ** 2) + noise
    return Touches(directions * distance[:, None], directions)


def _in_passes(count: int, directions: int) -> Touches:
    """Over all directions of a sphere of 25 mm, each pass in another order."""
    rng = np.random.default_rng(7)
    passes = [rng.permutation(directions) for _ in range(count // directions)]
    return _touches(fibonacci_cap(directions, 1.7)[np.concatenate(passes)])


def _simulated(size: int) -> Job:
    plane = Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
    at = np.column_stack([np.linspace(-9.0, 9.0, size), np.zeros(size), np.zeros(size)])
    targets = Targets(at, np.tile([0.0, 0.0, 1.0], (size, 1)))
    probe = load_probe("omp40-2")
    return lambda: simulate(probe, plane, targets)


def _aligned(size: int) -> Job:
    part, old = bracket(), example_map("physical")
    points, normals, _ = random_targets(part, 4 * size, np.random.default_rng(2), old.tip_radius)
    above = np.flatnonzero(normals[:, 2] > -0.05)[:size]  # where the probe can touch
    assert len(above) == size
    tips = TipCentres((points + normals * (old.tip_radius - 0.008))[above])
    return lambda: align(tips, part, old, Placement(), extrapolate=True)


def _qualified(size: int) -> Job:
    """More repeats of the same directions: the series of directions are not longer."""
    touches = _touches(np.repeat(sphere_pattern_25(), size // 25, axis=0))
    return lambda: qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic")


@pytest.mark.long
@pytest.mark.parametrize("work", [calls, memory])
@pytest.mark.parametrize(
    ("job", "small", "large"),
    [(_simulated, 800, 3200), (_aligned, 30, 90), (_qualified, 250, 2000)],
)
def test_work_is_linear(work: Work, job: Callable[[int], Job], small: int, large: int) -> None:
    assert _exponent(work, job, small, large) < LINEAR


@pytest.mark.parametrize(("work", "largest"), [(calls, AT_ONCE), (memory, LINEAR)])
def test_compensation_calls_as_much_for_many_touches_as_for_few(work: Work, largest: float) -> None:
    made = example_map("physical")

    def job(count: int) -> Job:
        touches = _touches(fibonacci_cap(count, 1.4))
        return lambda: apply(touches, made, extrapolate=True, shared=work is calls)

    assert _exponent(work, job, 1000, 8000) < largest


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

    def job(count: int) -> Job:
        points = [bore(number) for number in range(count)]

        def measured() -> None:
            features = [measure_feature(each, "bore", label=each.labels[0]) for each in points]
            relations_between(features)

        return measured

    assert _exponent(calls, job, 7, 28) < LINEAR


@pytest.mark.long
def test_a_drift_is_found_in_proportion_to_its_days() -> None:
    def job(count: int) -> Job:
        rng = np.random.default_rng(3)
        start = datetime(2026, 1, 1)
        moments = [start + timedelta(days=day) for day in range(count)]
        values = 1e-5 * np.arange(count) + rng.normal(0.0, 1e-4, count)
        size = DailyQuantity("size", "mm", values, np.full(count, 1e-4), 1.0)
        return lambda: drift_over_time(moments, [size], 5e-3)

    assert _exponent(calls, job, 60, 480) < LINEAR


@pytest.mark.long
@pytest.mark.parametrize("kind", ["harmonic", pytest.param("physical", marks=pytest.mark.slow)])
def test_a_qualification_needs_memory_in_proportion_to_its_touches(kind: str) -> None:
    def job(count: int) -> Job:
        touches = _in_passes(count, count // 5)

        def qualified() -> None:
            within_directions._exchanges.cache_clear()  # what is kept counts for both sizes
            qualify(touches, 25.0, tip_diameter=6.0, kind=kind, search_outliers=False)

        return qualified

    assert _exponent(memory, job, 250, 1000) < OF_MEMORY


def test_many_repeats_of_few_directions_need_memory_in_proportion() -> None:
    setup = QualificationSetup(25.0, tip_diameter=6.0)

    def job(count: int) -> Job:
        touches = _in_passes(count, 25)
        return lambda: repeat_outliers(observe(touches, setup, np.eye(3)), touches.where)

    assert _exponent(memory, job, 10_000, 40_000) < OF_MEMORY


def test_directions_near_a_long_edge_need_memory_in_proportion() -> None:
    def job(count: int) -> Job:
        around = np.linspace(0.0, 2.0 * math.pi, count // 2, endpoint=False)
        rings = [from_angles(np.radians(polar), around) for polar in (80.0, 90.0)]
        support = DirectionSupport(np.concatenate(rings))
        outside = from_angles(np.radians(91.0), np.linspace(0.0, 6.0, count))
        return lambda: support.interpolation(outside)

    assert _exponent(memory, job, 1000, 4000) < OF_MEMORY


def test_comparisons_of_all_pairs_refuse_more_than_memory_holds() -> None:
    touches, setup = _in_passes(3000, 3000), QualificationSetup(25.0, tip_diameter=6.0)
    old = qualify(_in_passes(75, 25), 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map
    with pytest.raises(PretravelError, match="3000 directions: a verification compares every pair"):
        touches_and_map(observe(touches, setup, np.eye(3)), old, 0.0)
    with pytest.raises(PretravelError, match="3000 touches: an old map is brought up to date"):
        update_map(touches, old, 25.0)


def test_a_matrix_of_all_pairs_and_a_loop_are_seen() -> None:
    def pairs(size: int) -> Job:
        return lambda: np.add.outer(np.ones(size), np.ones(size)).sum()

    def loop(size: int) -> Job:
        return lambda: [abs(i - j) for i in range(size) for j in range(size)]

    assert _exponent(memory, pairs, 1000, 4000) > 1.5
    assert _exponent(calls, loop, 50, 200) > 1.5
