"""Another friction of the part than of the reference: what it moves, in U where it is given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.departures import patterns, probes
from benchmarks.departures.tripod import TIP_RADIUS
from pretravel.base.directions import fibonacci_cap
from pretravel.maps import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.measurement.friction_of_part import movement_by_friction
from pretravel.measurement.points_summary import TouchSummary
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

NOISE = 3e-4


def test_points_of_a_part_with_another_friction_are_within_u_that_is_given() -> None:
    """A tripod with friction 0.2 on the sphere and 0.4 on the part: χ² was 3 to 4."""
    rng = np.random.default_rng(5)
    chi: dict[float, list[float]] = {0.0: [], 0.2: []}
    for number in range(2):
        probe = probes.six_seats(np.random.default_rng([9, number]), friction=0.2)
        sphere = np.repeat(patterns.USUAL_25, 3, axis=0)
        travel = probe.pretravel(sphere, 2.0 / 25.0) + NOISE * rng.standard_normal(75)
        at = (12.5 + TIP_RADIUS - travel[:, None]) * sphere
        found = qualify(Touches(at, sphere), 25.0, tip_diameter=2.0 * TIP_RADIUS, kind="harmonic")
        part = replace(probe, friction=0.4)
        normals = patterns.scattered(200, rng, level=False)
        travel = part.pretravel(normals) + NOISE * rng.standard_normal(200)
        touches = Touches((50.0 + TIP_RADIUS - travel[:, None]) * normals, normals)
        for u, kept in chi.items():
            points = apply(touches, found.pretravel_map, u_friction=u)
            error = np.sum(points.positions * normals, axis=1) - 50.0 - normals @ found.center
            kept.append(float(np.mean((error / points.standard_uncertainty) ** 2)))
            assert ("friction of the part" in (points.shared or {})) == (u > 0.0)
            summary = TouchSummary.of(touches, points, found.pretravel_map)
            said = " ".join(summary.notes(found.pretravel_map))
            assert ("coefficient of friction" in said) == (u == 0.0)
    # In simulation of 15 probes: 3.1 and 1.0; single sets scatter by a third.
    assert np.mean(chi[0.0]) > 2.0
    assert 0.6 < np.mean(chi[0.2]) < 1.5


def _uneven() -> PretravelMap:
    """10 µm, a third of a period of which more across x, and a different one along z."""
    around = fibonacci_cap(60, 1.6)
    travel = 0.010 + 0.002 * around[:, 0] ** 2 - 0.003 * around[:, 2] + 0.001 * around[:, 1]
    touches = Touches((12.5 + 3.0 - travel[:, None]) * around, around)
    return qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map


def _by_bisection(
    pretravel_map: PretravelMap, normals: np.ndarray, approaches: np.ndarray, coefficient: float
) -> np.ndarray:
    """Movement against the normals with this friction: the tip slides on, or sticks with as much
    of the friction as stops it."""

    def turned(share: np.ndarray) -> np.ndarray:
        force = normals - coefficient * share[:, None] * against
        force /= np.linalg.norm(force, axis=1, keepdims=True)
        return pretravel_map.tip_displacement(force, extrapolate=True)

    def slide(share: np.ndarray) -> np.ndarray:
        moved = turned(share)
        travel = np.sum(moved * normals, axis=1) / np.sum(approaches * normals, axis=1)
        return np.asarray(moved - travel[:, None] * approaches)

    against = 0.0 * normals
    free = slide(np.zeros(len(normals)))
    against = free / np.linalg.norm(free, axis=1, keepdims=True)
    low, high = np.zeros(len(normals)), np.ones(len(normals))
    low[np.sum(slide(high) * against, axis=1) >= 0.0] = 1.0
    for _ in range(25):
        middle = 0.5 * (low + high)
        on = np.sum(slide(middle) * against, axis=1) > 0.0
        low, high = np.where(on, middle, low), np.where(on, high, middle)
    return np.asarray(np.sum(turned(low) * normals, axis=1))


@pytest.mark.parametrize("difference", [0.05, 0.2, 0.3])
def test_the_movement_is_that_of_coulombs_law(difference: float) -> None:
    """Touches along normals and 20° off them; from 0 to the larger friction where the smaller one
    would be negative."""
    pretravel_map = _uneven()
    normals = fibonacci_cap(40, 1.5)
    beside = np.cross(normals, [0.3, -0.5, 0.8])
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    for angle in (0.0, np.radians(20.0)):
        approaches = -np.cos(angle) * normals + np.sin(angle) * beside
        found = movement_by_friction(pretravel_map, normals, approaches, difference)
        low, high = max(0.2 - difference, 0.0), 0.2 + difference
        more, less = (
            _by_bisection(pretravel_map, normals, approaches, each) for each in (high, low)
        )
        expected = (more - less) * difference / (high - low)
        assert np.abs(found).max() > 2e-4
        # Where the tip sticks, the share of friction is taken as in proportion to the slide.
        np.testing.assert_allclose(found, expected, atol=0.1 * float(np.abs(expected).max()))
        assert np.median(np.abs(found - expected)) < 1e-9
