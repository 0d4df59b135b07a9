"""Another friction of the part than of the reference: what it moves, in U where it is given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.departures import patterns, probes
from benchmarks.departures.tripod import TIP_RADIUS
from pretravel.measurement.compensation import apply, conditions_notes
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
            said = " ".join(conditions_notes(summary, found.pretravel_map))
            assert ("coefficient of friction" in said) == (u == 0.0)
    # In simulation of 15 probes: 3.1 and 1.0; single sets scatter by a third.
    assert np.mean(chi[0.0]) > 2.0
    assert 0.6 < np.mean(chi[0.2]) < 1.5
