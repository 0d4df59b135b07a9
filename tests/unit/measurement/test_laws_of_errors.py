"""One model of the errors of points, in all its forms: covariances, factors, trials."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply
from pretravel.measurement.measured_sphere import measured_sphere
from pretravel.measurement.point_errors import PointErrors, errors_of_points, unknown_delay_travel
from pretravel.measurement.points import Points
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.errors_by_trials import (
    errors_by_trials,
    map_by_trials,
    points_by_trials,
    sphere_by_trials,
)
from tests.support.example_maps import mean_map
from tests.support.monte_carlo import MonteCarlo

BASIS = HarmonicBasis(np.array([[0, 0], [1, 0], [3, 3], [3, -3]]))
N = from_angles(np.radians([15.0, 40.0, 65.0]), np.radians([10.0, 130.0, 220.0]))
A = unit(-N + [[0.5, 0.0, 0.1], [0.0, -0.4, 0.0], [0.1, 0.2, -0.3]])
CLOSING = -np.sum(A * N, axis=1)
FEEDS = np.array([60.0, 300.0, 120.0])


def _rich() -> PretravelMap:
    """Every source of error, each about as large as the others; the probe is turned."""
    return PretravelMap(
        BASIS, np.array([0.05, 4e-3, 6e-3, -2e-3]),
        Covariance.independent(np.array([1.6, 0.2, 0.3, 0.5]) * 1e-5),
        DirectionSupport(fibonacci_cap(200, 2.5)), tip_radius=3.0, u_tip_radius=7e-4,
        rotation=probe_rotation(from_angles(0.4, 1.1)[0], rotation=0.7),
        repeatability=6e-4, fixed_scatter=5e-4, feed=60.0, delay=0.002, u_delay=3e-4,
        delay_effect=np.array([-1.2e-3, 3e-4, -2e-4, 4e-4]),
    )  # fmt: skip


def _touches() -> Touches:
    return Touches(15.0 * N, N, A, feeds=FEEDS)


def _by_hand() -> dict[str, FloatArray]:
    """Covariance of the travel along the approaches, source by source, and of the radius.

    The delay moves a point by feed times its uncertainty, and by the map's change, over the cosine.
    """
    made = _rich()
    design = BASIS.design(N @ made.rotation)
    weights = design / CLOSING[:, None]
    assert made.delay_effect is not None
    delay = FEEDS / 60.0 * 3e-4 + weights @ made.delay_effect
    return {
        "repeatability": (36e-8 + 25e-8) * np.eye(3),
        "map": weights @ made.covariance.matrix @ weights.T,
        "signal delay": np.outer(delay, delay),
    }


def _whole(travel: FloatArray) -> FloatArray:
    """(9, 9) covariance of three points: travels along the approaches, the radius along normals."""
    found = travel[:, None, :, None] * (A[:, :, None, None] * A[None, None])
    found = found + 49e-8 * (N[:, :, None, None] * N[None, None])
    return np.asarray(found.reshape(9, 9))


def test_sources_along_normals_are_those_by_hand() -> None:
    errors = errors_of_points(_touches(), N, _rich())
    found = {name: part.matrix for name, part in errors.along_normals().items()}
    expected = {n: m * np.outer(CLOSING, CLOSING) for n, m in _by_hand().items()}
    expected["tip radius"] = np.full((3, 3), 49e-8)
    assert found.keys() == expected.keys()
    for name, matrix in expected.items():
        assert found[name] == pytest.approx(matrix, rel=1e-9, abs=1e-16), name


def test_single_points_trials_and_sources_have_one_covariance() -> None:
    """Nine coordinates by hand; 40 000 trials know a covariance to 0.005 of the variances' size."""
    made, touches = _rich(), _touches()
    travel = np.asarray(sum(_by_hand().values()))
    expected = _whole(travel)
    points = apply(touches, made)
    for row in range(3):
        own = expected[3 * row : 3 * row + 3, 3 * row : 3 * row + 3]
        assert points.covariance[row] == pytest.approx(own, rel=1e-9, abs=1e-16)
    variance = np.diagonal(travel) * CLOSING**2 + 49e-8
    assert points.standard_uncertainty == pytest.approx(np.sqrt(variance))
    trials = points_by_trials(touches, points, made, trials=40_000, seed=5)
    off = (trials - points.positions).reshape(-1, 9)
    size = np.sqrt(np.diagonal(expected))
    assert off.mean(axis=0) / size == pytest.approx(np.zeros(9), abs=5.0 / 200.0)
    near = np.cov(off, rowvar=False) / np.outer(size, size)
    assert near == pytest.approx(expected / np.outer(size, size), abs=0.03)


def test_trials_of_a_map_contain_its_delay() -> None:
    """Values at three normals: the covariance of the coefficients, and the effect of the delay."""
    made = _rich()
    trials = map_by_trials(made, N, trials=40_000, seed=6)
    expected = made.value_covariance(N)
    size = np.sqrt(np.diagonal(expected))
    near = np.cov(trials, rowvar=False) / np.outer(size, size)
    assert near == pytest.approx(expected / np.outer(size, size), abs=0.03)
    assert (trials.mean(axis=0) - made.pretravel(N)) / size == pytest.approx(0.0, abs=0.025)


def test_trials_lie_beyond_points_of_which_too_much_was_subtracted() -> None:
    """50 µm more than the map's value: over the cosine, the contact lies further along the way."""
    made, touches = _rich(), _touches()
    points = apply(touches, made)
    more = replace(points, pretravel=points.pretravel + 0.05)
    off = points_by_trials(touches, more, made, trials=400, seed=2).mean(axis=0) - points.positions
    assert off == pytest.approx(0.05 / CLOSING[:, None] * A, abs=2e-3)


def test_the_sign_of_an_unknown_delay_is_that_of_its_travel() -> None:
    """240 mm/min of difference for 2 ms: 8 µm. Where feeds agree, nothing moves."""
    made = replace(_rich(), delay=None, delay_effect=None)
    expected = [0.0, 8e-3, 2e-3]
    assert unknown_delay_travel(_touches(), made) == pytest.approx(expected)
    errors = errors_of_points(_touches(), N, made)
    assert errors.delay_along_approach == pytest.approx(expected)
    assert errors.by_delay.tolist() == [0.0, 0.0, 0.0]
    moved = np.array(expected) * CLOSING
    sources = errors.along_normals()
    assert sources["signal delay"].matrix == pytest.approx(np.outer(moved, moved))
    shared = errors.shared_along_normals()
    assert shared is not None
    assert shared["signal delay"] == pytest.approx(moved)
    assert shared["fixed scatter"] == pytest.approx(5e-4 * CLOSING)
    # Along the approach: the delay, the scatter of a touch, the map, and the radius' part in it.
    drawn = errors_by_trials(errors, made.pretravel(N), 20_000, np.random.default_rng(1))
    spread = np.sum(drawn * A, axis=2).std(axis=0)
    variance = np.diagonal(_by_hand()["map"]) + 61e-8 + 49e-8 * CLOSING**2
    assert spread == pytest.approx(np.sqrt(variance + np.array(expected) ** 2), rel=0.03)


def test_a_delay_that_moves_no_point_is_no_shared_error() -> None:
    """A delay that is known exactly, as is its effect in the map."""
    made = replace(_rich(), u_delay=0.0, delay_effect=None)
    errors = errors_of_points(_touches(), N, made)
    assert "signal delay" in errors.along_normals()
    shared = errors.shared_along_normals()
    assert shared is not None
    assert "signal delay" not in shared


def test_an_effect_of_the_delay_above_the_map_s_own_uncertainty_leaves_none() -> None:
    """Rounding, or a stated uncertainty that is too small, makes no negative variance."""
    made = replace(mean_map(0.01), covariance=Covariance.independent([1e-8]), repeatability=3e-4)
    errors = PointErrors(made, N[:1], -N[:1], np.ones(1), np.array([2e-4]), np.zeros(1))
    expected = 9e-8 * np.outer(N[0], N[0])
    assert errors.covariance(np.array([1e-4]))[0] == pytest.approx(expected)


def test_a_variance_that_is_negative_by_rounding_is_none() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    flat = Points(up, up, np.zeros(1), np.diag([1.0, 1.0, -1e-24])[None], None, ("a",))
    assert flat.standard_uncertainty.tolist() == [0.0]


def _some_points(seed: int) -> PointErrors:
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


@pytest.mark.parametrize("seed", range(12))
def test_a_map_s_factors_leave_a_fiftieth_of_no_point_s_variance(seed: int) -> None:
    """The principal components of the map's covariance at the points, the largest first: so many
    that nowhere more than a fiftieth of the variance is left, and no more than needed."""
    errors = _some_points(seed)
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
    for k, name in enumerate(names):
        assert np.outer(shared[name], shared[name]) == pytest.approx(
            np.outer(parts[:, k], parts[:, k]), abs=1e-9 * total.max()
        )


def test_very_many_numbers_and_touches_have_no_factors() -> None:
    """Up to 20 million products of both."""

    class Numbers:
        root = np.ones((1, 1))

        def __len__(self) -> int:
            return self.count

        def __init__(self, count: int) -> None:
            self.count = count

    for touches, numbers, found in ((2, 10_000_000, True), (2, 10_000_001, False)):
        made = SimpleNamespace(
            u_tip_radius=0.0, fixed_scatter=0.0, states_uncertainty=True, repeatability=0.0,
            delay=None, covariance=Numbers(numbers), probe_directions=lambda n: n,
            basis=SimpleNamespace(design=lambda n: np.ones((len(n), 1))),
        )  # fmt: skip
        ones, up = np.ones(touches), np.repeat(N[:1], touches, axis=0)
        errors = PointErrors(made, up, -up, ones, 0.0 * ones, 0.0 * ones)  # type: ignore[arg-type]
        assert (errors.shared_along_normals() is not None) == found


def test_trials_are_repeatable_and_as_many_as_stated() -> None:
    """Ten thousand without another wish, from the first seed; another seed draws others."""
    made, touches = _rich(), _touches()
    points = apply(touches, made)
    assert map_by_trials(made, N).shape == (10_000, 3)
    assert points_by_trials(touches, points, made).shape == (10_000, 3, 3)
    for trials in (
        lambda **seed: map_by_trials(made, N, trials=2, **seed),
        lambda **seed: points_by_trials(touches, points, made, trials=2, **seed),
    ):
        assert np.array_equal(trials(), trials(seed=1))
        assert not np.any(trials() == trials(seed=2))


def test_each_run_of_trials_draws_its_own_map() -> None:
    """Where a map is all that is uncertain, a hundred runs have a hundred errors."""
    made = replace(mean_map(0.01), covariance=Covariance.independent([1e-8]))
    errors = PointErrors(made, N[:1], -N[:1], np.ones(1), np.zeros(1), np.zeros(1))
    found = {
        float(errors_by_trials(errors, np.array([0.01]), 2, np.random.default_rng(seed))[0, 0, 0])
        for seed in range(100)
    }
    assert len(found) == 100


def test_trials_of_a_sphere_without_another_wish(monkeypatch: pytest.MonkeyPatch) -> None:
    """95 %, one digit, at most 100 000 trials, from the first seed; a fifth of the tolerance, as
    JCGM 101, 8.2, asks for a validation."""
    from tests.support import errors_by_trials as module

    n = fibonacci_cap(8, 1.5)
    made = replace(mean_map(0.01), covariance=Covariance.independent([4e-8]), repeatability=3e-4)
    touches = Touches(15.49 * n, n)
    ball = measured_sphere(touches, apply(touches, made), made)
    told: dict[str, Any] = {}
    real = module.monte_carlo

    def recorded(model: Any, draw: Any, **wishes: Any) -> MonteCarlo:
        told.update(wishes)
        return real(model, draw, **wishes | {"most_trials": 1})

    monkeypatch.setattr(module, "monte_carlo", recorded)
    plain, judged = sphere_by_trials(ball)
    assert told == {
        "probability": 0.95, "digits": 1, "share": 0.2, "most_trials": 100_000, "seed": 1
    }  # fmt: skip
    # By the GUM: 95 % of a normal distribution lie within 1.96 standard uncertainties.
    end = ball.diameter + 1.959964 * ball.budget.combined
    difference = abs(end - plain.symmetric_interval[0, 1])
    assert judged.difference[0, 1] == pytest.approx(difference, abs=1e-9)
    # Half of the last of one digit of u = 0.46 um.
    assert judged.tolerance == pytest.approx([5e-5])
