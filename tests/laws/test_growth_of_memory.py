"""What is kept in memory grows with the data, not with its square.

Peaks of allocated memory at two sizes, as an exponent: 1 is linear, 2 is a matrix of all pairs. The
limit leaves room for nothing but a logarithm. Times are measured in `benchmarks/`.
"""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.errors import PretravelError
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification import within_directions
from pretravel.qualification.change_tests import touches_and_map
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import repeat_outliers
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

LARGEST_EXPONENT = 1.2


def _touches(count: int, directions: int) -> Touches:
    """Passes over all directions of a sphere of 25 mm, each in another order."""
    rng = np.random.default_rng(7)
    passes = [rng.permutation(directions) for _ in range(count // directions)]
    normals = fibonacci_cap(directions, 1.7)[np.concatenate(passes)]
    pretravel = 0.003 + 0.006 * (normals[:, 0] ** 2 + normals[:, 1] ** 2)
    noise = rng.normal(0.0, 3e-4, len(normals))
    return Touches(normals * (15.5 - pretravel + noise)[:, None], normals)


def _peak(job: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        job()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _exponent(job: Callable[[int], Callable[[], object]], small: int, large: int) -> float:
    job(small)()  # what is imported and kept for the next call is no growth
    return math.log(_peak(job(large)) / _peak(job(small))) / math.log(large / small)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["harmonic", pytest.param("physical", marks=pytest.mark.slow)])
def test_a_qualification_needs_memory_in_proportion_to_its_touches(kind):
    def job(count: int) -> Callable[[], object]:
        touches = _touches(count, count // 5)

        def qualified() -> None:
            within_directions._exchanges.cache_clear()  # what is kept counts for both sizes
            qualify(touches, 25.0, tip_diameter=6.0, kind=kind, search_outliers=False)

        return qualified

    assert _exponent(job, 250, 1000) < LARGEST_EXPONENT


def test_many_repeats_of_few_directions_need_memory_in_proportion():
    setup = QualificationSetup(25.0, tip_diameter=6.0)

    def job(count: int) -> Callable[[], object]:
        touches = _touches(count, 25)
        return lambda: repeat_outliers(observe(touches, setup, np.eye(3)), touches.where)

    assert _exponent(job, 10_000, 40_000) < LARGEST_EXPONENT


def test_directions_beside_a_long_edge_need_memory_in_proportion():
    def job(count: int) -> Callable[[], object]:
        around = np.linspace(0.0, 2.0 * math.pi, count // 2, endpoint=False)
        rings = [from_angles(np.radians(polar), around) for polar in (80.0, 90.0)]
        support = DirectionSupport(np.concatenate(rings))
        outside = from_angles(np.radians(91.0), np.linspace(0.0, 6.0, count))
        return lambda: support.interpolation(outside)

    assert _exponent(job, 1000, 4000) < LARGEST_EXPONENT


def test_comparisons_of_all_pairs_refuse_more_than_memory_holds():
    touches, setup = _touches(3000, 3000), QualificationSetup(25.0, tip_diameter=6.0)
    old = qualify(_touches(75, 25), 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map
    with pytest.raises(PretravelError, match="3000 directions: a verification compares every pair"):
        touches_and_map(observe(touches, setup, np.eye(3)), old, 0.0)
    with pytest.raises(PretravelError, match="3000 touches: an old map is brought up to date"):
        update_map(touches, old, 25.0)
