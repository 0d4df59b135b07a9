"""What grows in proportion to the touches stays so: counted in calls and memory, not in time."""

from __future__ import annotations

import sys
import tracemalloc
from collections.abc import Callable, Sequence
from types import FrameType

import numpy as np
import pytest

from pretravel import Targets, Touches, apply, load_probe, qualify, simulate
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.surface.shapes import Plane
from tests.support.example_maps import example_map
from tests.support.touched_bracket import bracket, random_targets

NOISE = np.random.default_rng(11)
LINEAR = 1.1
"""Largest slope of log(work) over log(size): n log n from 1000 to 16,000 has 1.12 at its largest
part, and sorting is never that."""


def _calls(action: Callable[[], object]) -> int:
    """Calls of functions, of Python's and of compiled ones: loops over points show here."""
    count = 0

    def counted(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        del frame, argument
        count += event in ("call", "c_call")

    sys.setprofile(counted)
    try:
        action()
    finally:
        sys.setprofile(None)
    return count


def _memory(action: Callable[[], object]) -> int:
    """Largest memory: a matrix of all pairs shows here, which one call can compute."""
    tracemalloc.start()
    try:
        action()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _slopes(made: Callable[[int], Callable[[], object]], sizes: Sequence[int]) -> dict[str, float]:
    actions = [made(size) for size in sizes]
    actions[0]()  # what is imported and kept once is not work
    found = {}
    for name, work in (("calls", _calls), ("memory", _memory)):
        amounts = np.log([work(action) for action in actions])
        found[name] = float(np.max(np.diff(amounts) / np.diff(np.log(sizes))))
    return found


def _compensated(size: int) -> Callable[[], object]:
    old, n = example_map("physical"), fibonacci_cap(size)
    touches = Touches(n * 20.0, n)
    return lambda: apply(touches, old, extrapolate=True, shared=False)


def _simulated(size: int) -> Callable[[], object]:
    plane = Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
    at = np.column_stack([np.linspace(-9.0, 9.0, size), np.zeros(size), np.zeros(size)])
    targets = Targets(at, np.tile([0.0, 0.0, 1.0], (size, 1)))
    probe = load_probe("omp40-2")
    return lambda: simulate(probe, plane, targets)


def _aligned(size: int) -> Callable[[], object]:
    part, old = bracket(), example_map("physical")
    points, normals, _ = random_targets(part, 4 * size, np.random.default_rng(2), old.tip_radius)
    above = np.flatnonzero(normals[:, 2] > -0.05)[:size]  # where the probe can touch
    assert len(above) == size
    tips = TipCentres((points + normals * (old.tip_radius - 0.008))[above])
    return lambda: align(tips, part, old, Placement(), extrapolate=True)


def _qualified(size: int) -> Callable[[], object]:
    """More repeats of the same directions: the series of directions are not longer."""
    n = np.repeat(sphere_pattern_25(), size // 25, axis=0)
    touches = Touches(n * (15.49 + NOISE.normal(0.0, 3e-4, (len(n), 1))), n)
    return lambda: qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic")


@pytest.mark.long
@pytest.mark.parametrize(
    ("made", "sizes"),
    [
        (_compensated, (1000, 4000, 16000)),
        (_simulated, (200, 800, 3200)),
        (_aligned, (30, 90)),
        (_qualified, (250, 2000)),
    ],
)
def test_work_is_linear(made: Callable[[int], Callable[[], object]], sizes: Sequence[int]) -> None:
    slopes = _slopes(made, sizes)
    assert max(slopes.values()) < LINEAR, slopes


def test_a_matrix_of_all_pairs_and_a_loop_are_seen() -> None:
    def pairs(size: int) -> Callable[[], object]:
        return lambda: np.add.outer(np.ones(size), np.ones(size)).sum()

    def loop(size: int) -> Callable[[], object]:
        return lambda: [abs(i - j) for i in range(size) for j in range(size)]

    assert _slopes(pairs, (1000, 4000))["memory"] > 1.5
    assert _slopes(loop, (50, 200))["calls"] > 1.5
