"""Does U contain the error of a point where a machine reports positions in coarse steps?

python benchmarks/coarse_positions.py --sets 100

A random six-seat probe of `benchmarks/departures` is qualified on a sphere at a random place, with
5, 9 and 25 directions, once each or three times. The positions are rounded along the axes, those of
200 points on the sphere too, which are compensated with the map. A point is covered where its
distance from the sphere about the centre that was found is at most U = k u. Sets are refused, or
warned of by the name of the step.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


from benchmarks.departures.probes import six_seats
from benchmarks.departures.tripod import Tripod
from benchmarks.few_touches import DIAMETER, EVEN, NOISE, NORMALS, TIP_DIAMETER
from pretravel.base.errors import PretravelError
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import errors_of_points
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches

STEPS = (0.0, 0.0001, 0.001, 0.002, 0.005, 0.01, 0.0254, 0.05, 0.1)
"""Of the positions. [mm]"""
DIRECTIONS = (5, 9, 25)


def touched(
    probe: Tripod, place: np.ndarray, normals: np.ndarray, step: float, rng: np.random.Generator
) -> Touches:
    """Touches on the reference, with noise, as the machine reports them."""
    travel = probe.pretravel(normals, 2.0 / DIAMETER) + rng.normal(0.0, NOISE, len(normals))
    positions = place + normals * (0.5 * (DIAMETER + TIP_DIAMETER) - travel)[:, None]
    return Touches(positions if not step else step * np.round(positions / step), normals)


def one_set(number: int, directions: int, repeats: int, step: float) -> tuple[str, float, float]:
    """Refused, warned or plain; the share of points within U; their mean U. [µm]"""
    rng = np.random.default_rng([51, number])
    probe, place = six_seats(rng), rng.uniform(-400.0, 400.0, 3)
    normals = np.repeat(EVEN[directions], repeats, axis=0)
    try:
        made = qualify(
            touched(probe, place, normals, step, rng), DIAMETER, tip_diameter=TIP_DIAMETER
        )
    except PretravelError as error:
        return ("refused" if "step" in str(error) else f"refused: {error}"), np.nan, np.nan
    touches = touched(probe, place, NORMALS, step, rng)
    points = apply(touches, made.pretravel_map, extrapolate=True)
    away = np.sum((points.positions - made.center) * NORMALS, axis=1) - 0.5 * DIAMETER
    # As `compensate` states U: k of the budget, which few touches have made larger than 2.
    sources = errors_of_points(touches, points.normals, made.pretravel_map)
    expanded = sources.budget().coverage_factor() * points.standard_uncertainty
    warned = any("step" in warning for warning in made.warnings)
    covered = float(np.mean(np.abs(away) <= expanded))
    return "warned" if warned else "plain", covered, 1e3 * float(np.mean(expanded))


def row(directions: int, repeats: int, step: float, sets: int) -> dict[str, float]:
    """A line of the table."""
    found = [one_set(number, directions, repeats, step) for number in range(sets)]
    says = Counter(each[0] for each in found)
    for reason in says:
        if reason.startswith("refused:"):
            print(reason, file=sys.stderr)
    kept = np.array([each[1:] for each in found])
    some = not np.isnan(kept[:, 0]).all()
    return {
        "covered": 100.0 * float(np.nanmean(kept[:, 0])) if some else np.nan,
        "U": float(np.nanmean(kept[:, 1])) if some else np.nan,
        "refused": 100.0 * (1.0 - (says["plain"] + says["warned"]) / sets),
        "warned": 100.0 * says["warned"] / sets,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--steps", default=",".join(map(str, STEPS)))
    parser.add_argument("--directions", default=",".join(map(str, DIRECTIONS)))
    parser.add_argument("--repeats", default="1,3")
    given = parser.parse_args()
    print("| step [µm] | directions | touches of each | points within U [%] | mean U [µm] | "
          "refused [%] | warned [%] |\n| --- | --- | --- | --- | --- | --- | --- |")  # fmt: skip
    for step in map(float, given.steps.split(",")):
        for directions in map(int, given.directions.split(",")):
            for repeats in map(int, given.repeats.split(",")):
                found = row(directions, repeats, step, given.sets)
                print(f"| {1e3 * step:g} | {directions} | {repeats} | {found['covered']:.1f} | "
                      f"{found['U']:.2f} | {found['refused']:.0f} | {found['warned']:.0f} |",
                      flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
