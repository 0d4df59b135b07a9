"""How good a map is after few touches, with an old map as prior and without.

python benchmarks/few_touches.py --sets 40 --kind physical

A random six-seat probe of `benchmarks/departures` is qualified with 25 directions three times. Then
it drifts: preload 1 %, level 0.3 µm, turn about the axis 0.3°, the spring beside the axis by 0.2 %
of the seats' radius (standard deviations). New touches have 0.3 µm of
noise. Errors are root mean squares over 200 directions after the best translation.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.probes import six_seats
from benchmarks.departures.tripod import Tripod
from pretravel.base.directions import (
    fibonacci_cap,
    five_point_pattern,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.touch_plan import plan_touches
from pretravel.touches import Touches

NOISE = 0.3e-3
DIAMETER, TIP_DIAMETER = 25.0, 6.0
COUNTS = (5, 9, 15, 25)
DEGREE = np.pi / 180.0
FRESH = np.repeat(sphere_pattern_25(), 3, axis=0)
EVEN = {
    5: five_point_pattern(),
    9: ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, 4),
    15: np.concatenate([ring_pattern(np.array([0.0, 40.0, 90.0]) * DEGREE, 9)])[:15],
    25: sphere_pattern_25(),
}
NORMALS = fibonacci_cap(200)
PLACE = np.array([212.3447, -87.9123, -301.4561])


@dataclass(frozen=True)
class Drifted:
    """A probe after a drift: its truth on a flat part and on the reference."""

    probe: Tripod
    level: float

    def pretravel(self, normals: np.ndarray, curvature: float = 0.0) -> np.ndarray:
        return np.asarray(self.probe.pretravel(normals, curvature) + self.level)


def drifted(probe: Tripod, generator: np.random.Generator, share: float = 1.0) -> Drifted:
    """The probe some days later."""
    turn = share * generator.normal(0.0, 0.3) * DEGREE
    c, s = np.cos(turn), np.sin(turn)
    about_axis = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    later = replace(
        probe,
        preload=probe.preload * (1.0 + share * generator.normal(0.0, 0.01)),
        spring=probe.spring + share * generator.normal(0.0, 0.002, 2) * probe.seat_radius,
        rotation=probe.rotation @ about_axis,
    )
    return Drifted(later, share * generator.normal(0.0, NOISE))


def touched(probe: Drifted, normals: np.ndarray, generator: np.random.Generator) -> Touches:
    """Touches on the reference at `PLACE`."""
    travel = probe.pretravel(normals, 2.0 / DIAMETER) + generator.normal(0.0, NOISE, len(normals))
    radius = 0.5 * (DIAMETER + TIP_DIAMETER)
    return Touches(PLACE + normals * (radius - travel)[:, None], normals)


@dataclass(frozen=True)
class Judged:
    """Errors over the directions, µm: `error` after the best translation, `from_center` from the
    centre of the reference that was found; u as it is stated; mean (error / u)² of points of a
    part that are measured from this centre.
    """

    error: float
    from_center: float
    u: float
    chi_squared: float


def judged(pretravel_map: PretravelMap, center: np.ndarray, probe: Drifted) -> Judged:
    """A map and the centre of the reference that came with it, against the truth."""
    value, u = pretravel_map.pretravel_and_uncertainty(NORMALS, extrapolate=True)
    error = value - probe.pretravel(NORMALS)
    along = error - NORMALS @ (center - PLACE)
    moved = error - NORMALS @ np.linalg.lstsq(NORMALS, error, rcond=None)[0]
    points = (along**2 + NOISE**2) / (u**2 + pretravel_map.repeatability**2)
    rms = [1e3 * float(np.sqrt(np.mean(values**2))) for values in (moved, along, u)]
    return Judged(*rms, float(np.mean(points)))


def one_set(number: int, kind: str, counts: tuple[int, ...] = COUNTS) -> dict[str, Judged]:
    """What one probe gives, by the name of the line of the table."""
    generator = np.random.default_rng([14, number])
    before = Drifted(six_seats(generator), 0.0)
    now = drifted(before.probe, generator)

    def qualified(normals: np.ndarray, probe: Drifted, own: str) -> Qualification:
        touches = touched(probe, normals, generator)
        return qualify(touches, DIAMETER, tip_diameter=TIP_DIAMETER, kind=own)

    def without(normals: np.ndarray, own: str) -> Judged:
        result = qualified(normals, now, own)
        return judged(result.pretravel_map, result.center, now)

    before_drift = qualified(FRESH, before, kind)
    old = before_drift.pretravel_map
    found = {
        "old map": judged(old, before_drift.center, now),
        "75 without": without(FRESH, kind),
    }
    for count in counts:
        plan = plan_touches(old, count)
        updated = update_map(touched(now, plan.normals, generator), old, DIAMETER)
        found[f"{count} with prior"] = judged(updated.pretravel_map, updated.center, now)
        if count in EVEN:
            found[f"{count} without"] = without(EVEN[count], kind if count > 8 else "harmonic")
    return found


def point_error(sets: list[dict[str, Judged]], name: str) -> float:
    """Root mean square error of a point: of the map over all sets, and one touch. µm"""
    return float(np.sqrt(np.mean([one[name].error ** 2 for one in sets]) + (1e3 * NOISE) ** 2))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", default="physical")
    parser.add_argument("--counts", default=",".join(map(str, COUNTS)))
    given = parser.parse_args()
    counts = tuple(int(count) for count in given.counts.split(","))
    sets = []
    for number in range(given.first, given.first + given.sets):
        sets.append(one_set(number, given.kind, counts))
        print(number, {k: round(v.error, 3) for k, v in sets[-1].items()}, file=sys.stderr)
    print(f"{'':16} {'map':>6} {'point':>6} {'from':>6} {'u':>6} {'chi2':>6}   {len(sets)} sets")
    for name in sets[0]:
        columns = np.array([astuple(one[name]) for one in sets]).T
        error, along, u = np.sqrt(np.mean(columns[:3] ** 2, axis=1))
        print(f"{name:16} {error:6.3f} {point_error(sets, name):6.3f} {along:6.3f} {u:6.3f} "
              f"{np.mean(columns[3]):6.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
