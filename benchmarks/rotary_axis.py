"""How often the interval of 95 % of a rotary axis contains the true one.

A table in numpy alone: a sphere of 25 mm, 81 mm from the axis, touched from above at 15 places at
each angle, with noise of the touches and wander of the axis. `python -m benchmarks.rotary_axis`
prints a row for each case: the share of place and slope, all four values of all sets.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pretravel.base.directions import ring_pattern
from pretravel.base.units import DEGREE
from pretravel.controls.rotary_axes import rotary_axis

PLACE, SLOPES = np.array([100.0, 50.0, -30.0]), np.array([2e-4, -3e-4])
FROM_THE_AXIS = np.array([40.0, 70.0, 10.0])
NORMALS = ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, 8)


@dataclass(frozen=True)
class Case:
    """Angles [deg], noise of a touch and wander of a centre along each axis [mm]."""

    name: str
    angles: Sequence[float]
    noise: float
    wander: float


ALL_AROUND = tuple(range(0, 360, 60))
CASES = (
    Case("C, six angles, no wander", ALL_AROUND, 5e-4, 0.0),
    Case("C, six angles, wander 0.3 µm", ALL_AROUND, 5e-4, 3e-4),
    Case("C, six angles, wander 2 µm", ALL_AROUND, 5e-4, 2e-3),
    Case("A tilts -60° to 60°, seven angles, wander 1 µm", tuple(range(-60, 61, 20)), 5e-4, 1e-3),
)


def covered(case: Case, sets: int, seed: int = 1) -> float:
    """The share of intervals that contain the true value, of all four values of all sets."""
    random = np.random.default_rng(seed)
    letter = case.name[0]
    axis = "ABC".index(letter)
    across = [i for i in range(3) if i != axis]
    line = np.zeros(3)
    line[across], line[axis] = SLOPES, 1.0
    unit, turns = line / np.linalg.norm(line), np.array(case.angles) * DEGREE
    inside = []
    for _ in range(sets):
        places = PLACE + Rotation.from_rotvec(-turns[:, None] * unit).apply(
            np.roll(FROM_THE_AXIS, axis)
        )
        places = places + random.normal(0.0, case.wander, places.shape)
        reach = 12.5 + random.normal(0.0, case.noise, (len(turns), len(NORMALS)))
        touched = places[:, None] + reach[..., None] * NORMALS
        found = rotary_axis(list(touched), turns.tolist(), letter)
        there = PLACE + line * (found.point[axis] - PLACE[axis])
        true = np.concatenate([there[across], SLOPES])
        inside.append(np.abs(found.values - true) < found.expanded)
    return float(np.mean(inside))


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    sets = parser.parse_args().sets
    print("| case | sets | covered % |\n| --- | --- | --- |")
    for case in CASES:
        print(f"| {case.name} | {sets} | {100.0 * covered(case, sets):.1f} |", flush=True)


if __name__ == "__main__":
    main()
