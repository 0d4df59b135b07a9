"""Errors of compensated points, of their budgets and of spheres: by hand, and against trials."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25, unit
from pretravel.base.frames import probe_rotation
from pretravel.drawing.tasks.measure.features_of_points import not_in_u
from pretravel.files.touches_csv import read_touches
from pretravel.laboratory.measured_spheres import measured_sphere
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement import point_errors
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import (
    PointErrors,
    budget_of_variances,
    errors_of_points,
    point_sources,
    total_covariance,
    unknown_delay_travel,
)
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.errors_by_trials import points_by_trials, sphere_radii
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES

TRIALS = 20_000
# Four standard errors of a deviation from 20 000 trials: 2 %.
NEAR = 0.02
SPHERE = read_touches(EXAMPLES / "sphere_touches.csv")


@pytest.fixture(
    scope="module",
    params=[
        "harmonic",
        "physical",
        pytest.param("mean", marks=pytest.mark.slow),
        pytest.param("wozniak", marks=pytest.mark.slow),
    ],
)
def made(request: pytest.FixtureRequest) -> PretravelMap:
    return qualify(
        SPHERE, 24.9987, tip_diameter=6.0, u_diameter=1e-4, kind=request.param,
        search_outliers=False,
    ).pretravel_map  # fmt: skip


class TestAgainstTrials:
    def test_points_and_what_they_share(self, made: PretravelMap) -> None:
        """Oblique approaches, so that all nine elements of each point matter."""
        n = sphere_pattern_25()
        touches = Touches(n * 15.49, n, approaches=unit(-n + 0.3 * np.roll(n, 1, axis=1)))
        points = apply(touches, made)
        trials = points_by_trials(touches, points, made, trials=TRIALS)
        for i in (0, 7, 20):
            found = np.cov(trials[:, i], rowvar=False)
            scale = np.trace(points.covariance[i])
            assert found == pytest.approx(points.covariance[i], abs=0.03 * scale)
        stated = total_covariance(point_sources(touches, points, made)).matrix
        along = np.einsum("tni,ni->tn", trials - points.positions, n)
        found = np.cov(along, rowvar=False)
        assert found == pytest.approx(stated, abs=0.04 * np.diag(stated).max())

    def test_sphere(self, made: PretravelMap) -> None:
        """A sphere is nearly linear in its points, so that the law of propagation holds."""
        n = sphere_pattern_25()
        touches = Touches(n * 15.49, n)
        points = apply(touches, made)
        ball = measured_sphere(touches, points, made)
        along = total_covariance(ball.sources).errors(np.random.default_rng(1), TRIALS)
        radii = sphere_radii(points.positions + along[:, :, None] * n, ball.fit)
        assert 2.0 * radii.std() == pytest.approx(ball.budget.combined, rel=NEAR)
        assert 2.0 * radii.mean() == pytest.approx(ball.diameter, abs=0.04 * ball.budget.combined)


N = from_angles(np.radians([15.0, 40.0, 65.0]), np.radians([10.0, 130.0, 220.0]))
A = unit(-N + [[0.5, 0.0, 0.1], [0.0, -0.4, 0.0], [0.1, 0.2, -0.3]])
CLOSING = -np.sum(A * N, axis=1)
FEEDS = np.array([60.0, 300.0, 120.0])
TOUCHES = Touches(15.0 * N, N, A, feeds=FEEDS)
BASIS = HarmonicBasis(np.array([[0, 0], [1, 0], [3, 3], [3, -3]]))
RICH = PretravelMap(
    BASIS, np.array([0.05, 4e-3, 6e-3, -2e-3]),
    Covariance.independent(np.array([1.6, 0.2, 0.3, 0.5]) * 1e-5),
    DirectionSupport(fibonacci_cap(200, 2.5)), tip_radius=3.0, u_tip_radius=7e-4,
    rotation=probe_rotation(from_angles(0.4, 1.1)[0], rotation=0.7),
    repeatability=6e-4, repeatability_dof=17.0, fixed_scatter=5e-4, feed=60.0, delay=0.002,
    u_delay=3e-4, delay_effect=np.array([-1.2e-3, 3e-4, -2e-4, 4e-4]),
)  # fmt: skip
"""Every source of error, each about as large as the others; the probe is turned."""


def _by_hand() -> dict[str, FloatArray]:
    """Covariance of the travel along the approaches, source by source, without the radius.

    The delay moves a point by feed times its uncertainty, and by the map's change, over the cosine.
    """
    weights = BASIS.design(N @ RICH.rotation) / CLOSING[:, None]
    assert RICH.delay_effect is not None
    delay = FEEDS / 60.0 * 3e-4 + weights @ RICH.delay_effect
    return {
        "repeatability": (36e-8 + 25e-8) * np.eye(3),
        "map": weights @ RICH.covariance.matrix @ weights.T,
        "signal delay": np.outer(delay, delay),
    }


class TestByHand:
    def test_sources_along_normals(self) -> None:
        errors = errors_of_points(TOUCHES, N, RICH)
        found = {name: part.matrix for name, part in errors.along_normals().items()}
        expected = {n: m * np.outer(CLOSING, CLOSING) for n, m in _by_hand().items()}
        expected["tip radius"] = np.full((3, 3), 49e-8)
        assert found.keys() == expected.keys()
        for name, matrix in expected.items():
            assert found[name] == pytest.approx(matrix, rel=1e-9, abs=1e-16), name

    def test_covariances_of_single_points(self) -> None:
        travel = np.diagonal(sum(_by_hand().values()))
        points = apply(TOUCHES, RICH)
        for row in range(3):
            own = travel[row] * np.outer(A[row], A[row]) + 49e-8 * np.outer(N[row], N[row])
            assert points.covariance[row] == pytest.approx(own, rel=1e-9, abs=1e-16)
        variance = travel * CLOSING**2 + 49e-8
        assert points.standard_uncertainty == pytest.approx(np.sqrt(variance))

    @pytest.mark.parametrize(
        ("row", "which"), [(None, "rms of 3 points"), (1, "point 2"), (0, "point 1")]
    )
    def test_budget_of_one_point_and_of_all(self, row: int | None, which: str) -> None:
        errors = errors_of_points(TOUCHES, N, RICH)
        parts = {name: np.diagonal(m) * CLOSING**2 for name, m in _by_hand().items()}
        by_hand = {
            "repeatability": 36e-8 * CLOSING**2,
            "fixed scatter": 25e-8 * CLOSING**2,
            "map": parts["map"],
            "tip radius": np.full(3, 49e-8),
            "signal delay": parts["signal delay"],
        }
        found = errors.variances_along_normals
        assert list(found) == list(by_hand)
        for name, own in by_hand.items():
            assert found[name] == pytest.approx(own, rel=1e-9), name
        budget = errors.budget(row)
        every = np.array(list(by_hand.values()))
        variances = every.mean(axis=1) if row is None else every[:, row]
        assert budget.result == f"a point along its normal, {which}"
        assert [c.name for c in budget.components] == list(by_hand)
        assert [c.evaluation for c in budget.components] == ["A", "B", "B", "B", "B"]
        stated = [c.standard_uncertainty for c in budget.components]
        assert stated == pytest.approx(np.sqrt(variances))
        assert [c.dof for c in budget.components] == [17.0, *[math.inf] * 4]
        assert budget.combined == pytest.approx(math.sqrt(variances.sum()))

    @pytest.mark.parametrize("dof", [0.0, 1.0, 24.0])
    def test_unknown_degrees_of_freedom_are_infinite(self, dof: float) -> None:
        (noise, made) = budget_of_variances({"repeatability": 1.0, "map": 1.0}, dof, "x").components
        assert (noise.dof, made.dof) == (dof or math.inf, math.inf)

    def test_errors_of_some_points_are_their_rows(self) -> None:
        errors = errors_of_points(TOUCHES, N, RICH)
        some = errors.at(np.array([2, 0]))
        for name in ("normals", "approaches", "closing", "by_delay", "delay_along_approach"):
            assert np.array_equal(getattr(some, name), getattr(errors, name)[[2, 0]]), name
        assert some.pretravel_map is errors.pretravel_map

    def test_a_sphere(self) -> None:
        """Against the design matrix: an error along n moves centre and radius by the least squares
        of n and one. Errors common to all points move the radius alone."""
        n = fibonacci_cap(6, 0.5 * np.pi)
        made = replace(
            mean_map(0.010), covariance=Covariance.independent([1e-8]), repeatability=3e-4,
            u_tip_radius=2e-4, repeatability_dof=50.0,
        )  # fmt: skip
        touches = Touches(np.array([5.0, 6.0, 7.0]) + 15.49 * n, n)
        points = apply(touches, made)
        ball = measured_sphere(touches, points, made)
        assert ball.center == pytest.approx([5.0, 6.0, 7.0])
        assert ball.diameter == pytest.approx(25.0)
        assert ball.points is points
        assert list(ball.sources) == ["repeatability", "map", "tip radius"]
        design = np.column_stack([n, np.ones(6)])
        expected = 9e-8 * np.linalg.inv(design.T @ design)
        expected[3, 3] += 1e-8 + 4e-8
        assert ball.covariance == pytest.approx(expected, abs=1e-13)
        assert ball.budget.combined == pytest.approx(2.0 * math.sqrt(expected[3, 3]))
        stated = [(c.evaluation, c.sensitivity, c.dof) for c in ball.budget.components]
        assert stated == [("A", 2.0, 50.0), ("B", 2.0, math.inf), ("B", 2.0, math.inf)]
        assert ball.budget.result == "diameter of the sphere, compensated"


class TestDelay:
    @pytest.mark.parametrize(
        ("made_at", "feeds", "uncertain", "travel"),
        [
            (60.0, [60.0, 120.0, 30.0], True, [0.0, 2.0, 1.0]),
            (60.0, [60.5, 59.5, 61.0], True, [0.0, 0.0, pytest.approx(1.0 / 30.0)]),
            (None, [60.0, 120.0, 30.0], True, [4.0, 8.0, 2.0]),
            (60.0, None, True, [4.0] * 3),
            (None, None, True, [0.0] * 3),
            (60.0, [60.0, 120.0, 30.0], False, [0.0] * 3),
        ],
    )
    def test_an_unknown_delay_travels_the_difference_of_the_feeds(
        self, made_at: float | None, feeds: list[float] | None, uncertain: bool, travel: list[float]
    ) -> None:
        """2 ms at 60 mm/min, 1 mm/s, are 2 µm; feeds within a per cent are the same.

        An unknown feed within a factor of three differs by at most twice the known one.
        """
        variance = Covariance.independent([1e-8]) if uncertain else Covariance.none(1)
        made = replace(mean_map(0.01), covariance=variance, feed=made_at)
        n = np.array([[0.0, 0.0, 1.0]] * 3)
        found = unknown_delay_travel(Touches(2.99 * n, n, feeds=feeds), made)
        assert (1e3 * found).round(9).tolist() == travel
        points = apply(Touches(2.99 * n, n, feeds=feeds), made)
        told = not_in_u(points)
        one_unknown = uncertain and (made_at is None) != (feeds is None)
        assert bool(told) == one_unknown
        assert not told or f"contains {max(travel):.1f} µm" in told[0]

    def test_the_sign_of_an_unknown_delay_is_that_of_its_travel(self) -> None:
        """240 mm/min of difference for 2 ms: 8 µm. Where feeds agree, nothing moves."""
        expected = [0.0, 8e-3, 2e-3]
        errors = errors_of_points(TOUCHES, N, replace(RICH, delay=None, delay_effect=None))
        assert errors.delay_along_approach == pytest.approx(expected)
        assert errors.by_delay.tolist() == [0.0, 0.0, 0.0]
        moved = np.array(expected) * CLOSING
        sources = errors.along_normals()
        assert sources["signal delay"].matrix == pytest.approx(np.outer(moved, moved))
        shared = errors.shared_along_normals()
        assert shared is not None
        assert shared["signal delay"] == pytest.approx(moved)

    def test_a_delay_that_moves_no_point_is_no_shared_error(self) -> None:
        """A delay that is known exactly, as is its effect in the map."""
        errors = errors_of_points(TOUCHES, N, replace(RICH, u_delay=0.0, delay_effect=None))
        assert "signal delay" in errors.along_normals()
        shared = errors.shared_along_normals()
        assert shared is not None
        assert "signal delay" not in shared

    def test_an_effect_above_the_map_s_own_uncertainty_leaves_none(self) -> None:
        """Rounding, or a stated uncertainty that is too small, makes no negative variance."""
        made = replace(
            mean_map(0.01), covariance=Covariance.independent([1e-8]), repeatability=3e-4
        )
        errors = PointErrors(
            made, N[:1], -N[:1], np.ones(1), np.array([2e-4]), np.zeros(1),
            known_u_map=np.array([1e-4]),
        )  # fmt: skip
        expected = 9e-8 * np.outer(N[0], N[0])
        assert errors.covariance[0] == pytest.approx(expected)
        assert errors.variances_along_normals["map"].tolist() == [0.0]


def _unequal_points(seed: int) -> PointErrors:
    """Six points of very unequal variances, under a map of 16 numbers of very unequal variances."""
    rng = np.random.default_rng(seed)
    terms = [[order, k] for order in range(4) for k in range(-order, order + 1)]
    normals = from_angles(rng.uniform(0.1, 1.5, 6), rng.uniform(0.0, 6.2, 6))
    approaches = unit(-normals + 0.9 * rng.uniform(-1.0, 1.0, (6, 3)))
    made = PretravelMap(
        HarmonicBasis(np.array(terms)), np.full(16, 1e-3),
        Covariance.independent(1e-6 * np.exp(rng.uniform(-9.0, 0.0, 16))),
        DirectionSupport(normals), tip_radius=3.0, u_tip_radius=1e-4, fixed_scatter=1e-4,
        rotation=probe_rotation(rotation=rng.uniform(0.2, 1.0)), repeatability=4e-4, delay=1e-3,
    )  # fmt: skip
    closing = -np.sum(approaches * normals, axis=1)
    delays = 1e-3 * np.exp(rng.uniform(-5.0, 0.5, 6))
    return PointErrors(made, normals, approaches, closing, np.zeros(6), delays)


class TestSharedErrors:
    @pytest.mark.parametrize("seed", range(12))
    def test_a_map_s_factors_leave_a_fiftieth_of_no_point_s_variance(self, seed: int) -> None:
        """The principal components of the map's covariance at the points, the largest first: so
        many that nowhere more than a fiftieth of the variance is left, and no more than needed."""
        errors = _unequal_points(seed)
        shared = errors.shared_along_normals()
        assert shared is not None
        sources = errors.along_normals()
        total = sum(np.diagonal(part.matrix) for part in sources.values())
        sizes, vectors = np.linalg.eigh(sources["map"].matrix)
        parts = (vectors * np.sqrt(np.maximum(sizes, 0.0)))[:, ::-1]
        left = [np.sum(parts[:, k:] ** 2, axis=1) for k in range(7)]
        needed = next(k for k in range(1, 7) if np.all(left[k] <= 0.02 * total))
        names = [f"map {k}" for k in range(1, needed + 1)]
        assert list(shared) == ["tip radius", "fixed scatter", "signal delay", *names]
        assert shared["tip radius"].tolist() == [1e-4] * 6
        assert shared["fixed scatter"] == pytest.approx(1e-4 * errors.closing)
        moved = errors.delay_along_approach * errors.closing
        assert shared["signal delay"] == pytest.approx(moved)
        for k, name in enumerate(names):
            assert np.outer(shared[name], shared[name]) == pytest.approx(
                np.outer(parts[:, k], parts[:, k]), abs=1e-9 * total.max()
            )

    @pytest.mark.parametrize(("most", "found"), [(96, True), (95, False)])
    def test_very_many_numbers_and_touches_have_no_factors(
        self, most: int, found: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Here of 16 numbers and six touches."""
        monkeypatch.setattr(point_errors, "_MOST_FACTOR_VALUES", most)
        assert (_unequal_points(0).shared_along_normals() is not None) == found
