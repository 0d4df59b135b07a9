"""Ratios against the plain loop over points, and start-up times. Run: make benchmark.

The loop is what one would write first: one direction at a time through the same public
functions' formulas in scalar form. It runs on a part of the points and is scaled up;
answers are compared, so that a fast wrong answer does not count.
"""

from __future__ import annotations

import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np

from pretravel.directions import fibonacci_cap, sphere_pattern_25
from pretravel.metrology.compensation import apply
from pretravel.metrology.qualification import qualify
from pretravel.model.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.model.condensation import condense
from pretravel.model.elasticity import finite_element_model
from pretravel.model.geometry import probe_solids
from pretravel.model.hertz import contact_modulus, rod_on_ball_coefficient
from pretravel.model.mesh import mesh_solids
from pretravel.pretravel_map import HarmonicBasis, PretravelMap
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe
from pretravel.probe.materials import material
from pretravel.touches import Touches
from pretravel.trigger.predict import predict
from pretravel.trigger.seats import SeatStatics, seat_statics

DIRECTIONS = 100_000
TOUCHES = 1_000_000
LOOPED = 2_000


def _best(function: Callable[[], object], repeats: int = 3) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


class LoopedProbe:
    """The analytic model one direction at a time, constants worked out once."""

    def __init__(self, probe: Probe) -> None:
        steel = material("steel")
        self.statics: SeatStatics = seat_statics(probe)
        self.inverse = np.linalg.inv(self.statics.wrenches)
        self.seat = rod_on_ball_coefficient(
            probe.tripod.rod_radius,
            probe.seats.ball_radius,
            contact_modulus(probe.tripod.material, probe.seats.material),
        )
        self.lateral = bending_compliance(probe.stylus) + shear_compliance(probe.stylus)
        self.axial = axial_compliance(probe.stylus)
        self.tip = (
            9.0 / (16.0 * probe.tip.radius * contact_modulus(probe.tip.material, steel) ** 2)
        ) ** (1.0 / 3.0)

    def pretravel(self, n: np.ndarray) -> float:
        statics = self.statics
        wrench = np.concatenate([n, np.cross(statics.tip, n)])
        unit_reactions = -self.inverse @ wrench
        force = min(
            rest / -unit
            for rest, unit in zip(statics.rest_reactions, unit_reactions, strict=True)
            if unit < -1e-12
        )
        reactions = statics.rest_reactions + force * unit_reactions
        sunk = np.array(
            [
                self.seat * (max(now, 0.0) ** (2 / 3) - rest ** (2 / 3))
                for now, rest in zip(reactions, statics.rest_reactions, strict=True)
            ]
        )
        motion = -self.inverse.T @ sunk
        tip = motion[:3] + np.cross(motion[3:], statics.tip)
        across = n[0] ** 2 + n[1] ** 2
        bend = force * (self.lateral * across + self.axial * n[2] ** 2)
        return float(tip @ n + bend + self.tip * force ** (2 / 3))


def _example_map() -> PretravelMap:
    probe = load_probe("omp40-2-100mm")
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    noise = np.random.default_rng(0).normal(0.0, 3e-4, 75)
    distance = 15.5 - predict(probe, n).pretravel + noise
    return qualify(Touches(n * distance[:, None], n), 25.0, tip_diameter=6.0).pretravel_map


def _row(name: str, ours: float, loop: float) -> None:
    print(f"{name:58s} {ours:8.2f} s {loop:10.1f} s {loop / ours:8.0f} x")


def directions() -> None:
    probe = load_probe("omp40-2")
    n = fibonacci_cap(DIRECTIONS, math.radians(95.0))
    looped = LoopedProbe(probe)
    answers = np.array([looped.pretravel(row) for row in n[:LOOPED]])
    assert np.allclose(answers, predict(probe, n).pretravel[:LOOPED], atol=1e-12)
    ours = _best(lambda: predict(probe, n).pretravel)
    loop = _best(lambda: [looped.pretravel(row) for row in n[:LOOPED]]) * DIRECTIONS / LOOPED
    _row(f"{DIRECTIONS:,} directions predicted, analytic", ours, loop)


def touches() -> None:
    pretravel_map = _example_map()
    n = fibonacci_cap(TOUCHES, math.radians(89.0))
    many = Touches(50.0 * n, n)
    basis = pretravel_map.basis
    assert isinstance(basis, HarmonicBasis)
    coefficients, covariance = pretravel_map.coefficients, pretravel_map.covariance
    radius, variance = pretravel_map.tip_radius, pretravel_map.repeatability**2

    def one(row: int) -> tuple[np.ndarray, float]:
        normal = n[row]
        design = basis.design(normal[None])[0]
        pretravel = float(design @ coefficients)
        point = many.positions[row] - (radius - pretravel) * normal
        return point, math.sqrt(variance + float(design @ covariance @ design))

    whole = apply(many, pretravel_map)
    for row in range(0, LOOPED, 7):
        point, u = one(row)
        assert np.allclose(point, whole.positions[row], atol=1e-12)
        assert math.isclose(u, whole.standard_uncertainty[row], rel_tol=1e-9)
    ours = _best(lambda: apply(many, pretravel_map).standard_uncertainty, repeats=2)
    loop = _best(lambda: [one(row) for row in range(LOOPED)]) * TOUCHES / LOOPED
    _row(f"{TOUCHES:,} touches compensated with covariance, harmonic", ours, loop)


def finite_elements() -> None:
    """The 36 x 9 map as a user runs it, and one factorisation a direction instead of one."""
    command = [
        sys.executable, "-m", "pretravel", "predict", "omp40-2", "--model", "fem",
        "--azimuth", "0:350:10", "--polar", "10:90:10",
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PRETRAVEL_CACHE": folder}

        def run() -> None:
            subprocess.run(command, capture_output=True, check=True, env=environment)

        empty = _best(run, 1)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
        kept = _best(run, 3)
    probe = load_probe("omp40-2")
    solids = probe_solids(probe)
    model = finite_element_model(probe, solids, mesh_solids(solids))
    once = _best(lambda: condense(model), 1)
    _row("36 x 9 map, finite elements, empty cache, process and all", empty, 324 * once)
    print(f"{'':58s} {peak:8.2f} GB at most; the loop: one factorisation a direction")
    print(f"{'36 x 9 map, finite elements, from the cache':58s} {kept:8.2f} s")


def start_up() -> None:
    """Beside a bare interpreter, in the same run."""
    commands = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "import pretravel": [sys.executable, "-c", "import pretravel"],
        "pretravel --help": [sys.executable, "-m", "pretravel", "--help"],
    }
    for name, command in commands.items():
        seconds = _best(lambda c=command: subprocess.run(c, capture_output=True, check=True), 5)
        print(f"{name:58s} {seconds:8.2f} s")


if __name__ == "__main__":
    print(f"{'':58s} {'pretravel':>10s} {'plain loop':>12s} {'ratio':>10s}")
    directions()
    touches()
    finite_elements()
    start_up()
