"""Ratios against the plain loop over points.

The loop is the simplest program: it evaluates the formulas of the same public functions in
scalar form, one direction at a time. It runs on a part of the points, and its time is scaled
up. The results of both are compared, so that a fast wrong result is detected.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from benchmarks.commands import PRETRAVEL, spent
from benchmarks.results import Figures, Row, memory_text
from benchmarks.sizes import Sizes
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.elasticity import finite_element_model
from pretravel.design.fem.geometry import probe_solids
from pretravel.design.fem.mesh import mesh_solids
from pretravel.design.probing.tip import LateralTip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.laboratory.measured_spheres import measured_sphere
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.prediction.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.seats import SeatStatics, seat_statics
from pretravel.prediction.trigger import predict
from pretravel.qualification.qualifying import qualify
from pretravel.six_seats.hertz import rod_on_ball_coefficient
from pretravel.six_seats.six_seat_slopes import six_seat_slopes
from pretravel.six_seats.uneven_seats import PARAMETERS, six_seat_response
from pretravel.surface.cad.step_part import read_step_part
from pretravel.touches import Touches
from pretravel.touches.targets import Targets
from pretravel.uncertainty.sphere_fit import fit_sphere
from tests.support.errors_by_trials import points_by_trials, sphere_by_trials
from tests.support.monte_carlo import MonteCarlo


def _best(function: Callable[[], object], repeats: int) -> float:
    """The shortest of some runs. [s]"""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


class LoopedProbe:
    """The analytic model for one direction at a time; its constants are computed once."""

    def __init__(self, probe: Probe) -> None:
        steel = material("steel")
        self.statics: SeatStatics = seat_statics(probe)
        self.inverse = np.linalg.inv(self.statics.wrenches)
        self.seat = rod_on_ball_coefficient(
            probe.tripod.rod_radius,
            probe.seats.ball_radius,
            probe.tripod.material.contact_modulus(probe.seats.material),
        )
        self.lateral = bending_compliance(probe.stylus) + shear_compliance(probe.stylus)
        self.axial = axial_compliance(probe.stylus)
        self.tip = (
            9.0 / (16.0 * probe.tip.radius * probe.tip.material.contact_modulus(steel) ** 2)
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
    touches = Touches(n * distance[:, None], n)
    return qualify(touches, 25.0, kind="harmonic", tip_diameter=6.0).pretravel_map


PLAIN_LOOP = "plain loop"


def _one(
    what: str, count: int, ours: float, alternative: str, theirs: float, note: str = ""
) -> Figures:
    return Figures((Row(what, f"{count:,}", ours, alternative, theirs, note),))


def directions(sizes: Sizes) -> Figures:
    count, part = sizes.directions, sizes.looped
    probe = load_probe("omp40-2")
    n = fibonacci_cap(count, math.radians(95.0))
    looped = LoopedProbe(probe)
    answers = np.array([looped.pretravel(row) for row in n[:part]])
    assert np.allclose(answers, predict(probe, n).pretravel[:part], rtol=0.0, atol=1e-12)
    times = min(sizes.repeats, 3)
    ours = _best(lambda: predict(probe, n).pretravel, times)
    loop = _best(lambda: [looped.pretravel(row) for row in n[:part]], times) * count / part
    return _one("directions predicted, analytic", count, ours, PLAIN_LOOP, loop)


def touches(sizes: Sizes) -> Figures:
    count, part = sizes.touches, sizes.looped
    pretravel_map = _example_map()
    n = fibonacci_cap(count, math.radians(89.0))
    many = Touches(50.0 * n, n)
    basis = pretravel_map.basis
    assert isinstance(basis, HarmonicBasis)
    coefficients, covariance = pretravel_map.coefficients, pretravel_map.covariance.matrix
    radius = pretravel_map.tip_radius
    variance = pretravel_map.single_touch**2 + pretravel_map.u_tip_radius**2

    def one(row: int) -> tuple[np.ndarray, float]:
        normal = n[row]
        design = basis.design(normal[None])[0]
        pretravel = float(design @ coefficients)
        point = many.positions[row] - (radius - pretravel) * normal
        return point, math.sqrt(variance + float(design @ covariance @ design))

    whole = apply(many, pretravel_map)
    for row in range(0, part, 7):
        point, u = one(row)
        assert np.allclose(point, whole.positions[row], rtol=0.0, atol=1e-12)
        assert math.isclose(u, whole.standard_uncertainty[row], rel_tol=1e-9)
    ours = _best(lambda: apply(many, pretravel_map).standard_uncertainty, min(sizes.repeats, 2))
    loop = _best(lambda: [one(row) for row in range(part)], min(sizes.repeats, 3)) * count / part
    note = "the loop calls the same compiled Legendre functions, which take most of the time"
    what = "touches compensated with covariance, harmonic"
    return _one(what, count, ours, PLAIN_LOOP, loop, note)


class ThesisTouch:
    """One touch by the method of section 3.4, in twenty steps.

    In each step `least_squares` solves the six equations 3.20 to 3.22 and 3.33 to 3.35 for u1,
    v1, u2, v2, lambda, t. The surface is evaluated by the CAD kernel, which is the fastest way
    for one point at a time.
    """

    def __init__(self, path: Path, tip: LateralTip) -> None:
        from netgen.occ import OCCGeometry

        self.shape = OCCGeometry(str(path)).shape
        self.surface = self.shape.faces[0].surf
        self.tip = tip

    def _at(self, u: float, v: float) -> tuple[np.ndarray, np.ndarray]:
        point, du, dv = self.surface.D1(u, v)
        normal = np.cross([du.x, du.y, du.z], [dv.x, dv.y, dv.z])
        return np.array([point.x, point.y, point.z]), normal

    def travel(
        self, u: float, v: float, step: float, method: str = "trf", steps: int = 20
    ) -> float:
        """Feed at the trigger, mm, interpolated linearly between two steps.

        All steps are made, as in Table 4.10.
        """
        r = self.tip.radius
        point, normal = self._at(u, v)
        into = -normal / np.linalg.norm(normal)
        start = point - r * into
        polar, azimuth = math.acos(-into[2]), math.atan2(-into[1], -into[0])
        unknown = np.array([u, v, azimuth, polar, np.linalg.norm(normal) / r**2, 0.0])
        before, missing, found = -into, 0.0, math.nan
        for k in range(1, steps + 1):
            spindle = start + k * step * into
            ray = np.array([before[0], before[1], 0.0]) / math.hypot(before[0], before[1])

            def equations(
                x: np.ndarray, spindle: np.ndarray = spindle, ray: np.ndarray = ray
            ) -> np.ndarray:
                surface, normal = self._at(x[0], x[1])
                outward = np.array(
                    [
                        math.cos(x[2]) * math.sin(x[3]),
                        math.sin(x[2]) * math.sin(x[3]),
                        math.cos(x[3]),
                    ]
                )
                center = spindle + x[5] * ray
                return np.concatenate(
                    [surface + r * outward - center, normal - x[4] * r**2 * outward]
                )  # fmt: skip

            solved = least_squares(
                equations, unknown, xtol=1e-13, ftol=1e-15, gtol=1e-15, method=method
            )
            unknown = solved.x
            limit = float(np.linalg.norm(self.tip.state(before[None]).deflection))
            beyond = float(unknown[5]) - limit
            if beyond >= 0.0 and math.isnan(found):
                last = missing if k > 1 else -limit
                found = step * (k - 1 + last / (last - beyond))
            missing = beyond
            _, normal = self._at(unknown[0], unknown[1])
            before = normal / np.linalg.norm(normal)
        return found


def surface_touches(sizes: Sizes) -> Figures:
    """A hundred thousand touches on a freeform face, all at once and by the thesis's method."""
    count, part = sizes.surface_touches, sizes.stepped
    path = Path(__file__).parents[1] / "examples/data/part.step"
    part_surface = read_step_part(path)
    tip = predicted_tip(load_probe("omp40-2"))
    face = part_surface.faces[0]
    low, high = face.box
    uv = np.random.default_rng(0).uniform(low + 3.0, high - 3.0, (count, 2))
    local = face.local(uv)
    targets = Targets(local.point, local.normal)
    lateral = LateralTip(tip)
    at_once = touch(lateral, part_surface, targets)
    assert np.all(at_once.converged)
    assert np.nanmax(at_once.residual) < 1e-9
    stepped = ThesisTouch(path, lateral)
    # Twenty steps of a quarter of a micrometre reach the trigger of every touch here.
    rows = range(part)
    thesis = np.array([stepped.travel(*uv[row], 0.00025) for row in rows])
    assert np.abs(thesis - at_once.pretravel[:part]).max() < 1e-6
    times = min(sizes.repeats, 3)
    ours = _best(lambda: touch(lateral, part_surface, targets), times)
    full = _best(lambda: touch(tip, part_surface, targets), times)
    found: list[Row] = []
    for method in ("trf", "lm"):
        loop = _best(lambda m=method: [stepped.travel(*uv[row], 0.00025, m) for row in rows], 1)
        loop *= count / part
        other = f"twenty steps of least_squares, {method}, with the CAD kernel"
        for how, seconds in (("sideways", ours), ("all displacements of the model", full)):
            what = f"touches on a bicubic STEP face, {how}"
            found.append(Row(what, f"{count:,}", seconds, other, loop))
    return Figures(tuple(found))


def trials(sizes: Sizes) -> Figures:
    """The diameter of a sphere by Monte Carlo, against one sphere fit for each trial."""
    n = sphere_pattern_25()
    touches = Touches(n * 15.49, n)
    made = _example_map()
    points = apply(touches, made)
    ball = measured_sphere(touches, points, made)
    count, looped = sizes.trials, sizes.looped

    def ours() -> MonteCarlo:
        return sphere_by_trials(ball, digits=2, most_trials=count)[0]

    drawn = points_by_trials(touches, points, made, trials=looped)
    radii = np.array([fit_sphere(trial).radius for trial in drawn])
    found = ours()
    # Relative standard deviation of a standard deviation from n trials: 1 / sqrt(2 n).
    limit = 4.5 / math.sqrt(2.0 * looped)
    assert abs(2.0 * radii.std() / found.standard_uncertainty[0] - 1.0) < limit
    loop = _best(lambda: [fit_sphere(trial) for trial in drawn], 1) / looped * found.trials
    other = "one fit_sphere for each trial"
    what = "Monte Carlo trials of a sphere's diameter"
    return _one(what, found.trials, _best(ours, 1), other, loop)


def finite_elements(sizes: Sizes) -> Figures:
    """The 36 x 9 map as a user runs it, against one factorisation for each direction."""
    command = [
        *PRETRAVEL, "predict", "omp40-2", "--model", "fem",
        "--azimuth", "0:350:10", "--polar", "10:90:10",
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        cache = {"PRETRAVEL_CACHE": folder}
        empty = spent(command, cache)
        kept = min(spent(command, cache).seconds for _ in range(min(sizes.repeats, 3)))
    probe = load_probe("omp40-2")
    solids = probe_solids(probe)
    model = finite_element_model(probe, solids, mesh_solids(solids))
    once = _best(lambda: condense(model), 1)
    what, size = "map, finite elements, command and all", "36 × 9"
    other = "one factorisation of the whole body for each direction"
    note = f"at most {memory_text(empty.largest)}"
    return Figures(
        (
            Row(f"{what}, empty cache", size, empty.seconds, other, 324 * once, note),
            Row(f"{what}, from the cache", size, kept),
        )
    )


def qualification(sizes: Sizes) -> Figures:
    """The fit of a six-seat probe, with slopes in closed form and by central differences."""
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    truth = predict(load_probe("omp40-2-100mm"), n).pretravel
    distance = 15.5 - truth + np.random.default_rng(0).normal(0.0, 3e-4, 75)
    touches = Touches(n * distance[:, None], n)
    values = np.array([parameter.prior for parameter in PARAMETERS])
    values += np.random.default_rng(1).normal(0.0, 0.02, len(values))  # away from symmetry
    step = 1e-5

    def differences() -> np.ndarray:
        columns = []
        for unit in np.eye(len(values)):
            ends = [
                six_seat_response(values + sign * step * unit, 3.0).pretravel(n)
                for sign in (1.0, -1.0)
            ]
            columns.append((ends[0] - ends[1]) / (2.0 * step))
        return np.stack(columns, axis=1)

    closed = six_seat_slopes(values, n)
    off = np.abs(differences() - closed).max(axis=1)
    # Next to a kink the opening seat changes within the step.
    assert np.quantile(off, 0.9) < 1e-8 * np.abs(closed).max() + 1e-9
    times = min(sizes.repeats, 3)
    ours = _best(lambda: [six_seat_slopes(values, n) for _ in range(20)], times) / 20
    loop = _best(differences, times)
    rows = [Row("slopes of 75 touches, six seats", "18", ours, "central differences", loop)]
    taken = _best(lambda: qualify(touches, 25.0, tip_diameter=6.0, kind="physical"), times)
    rows.append(Row("touches qualified, kind physical", "75", taken))
    return Figures(tuple(rows))
