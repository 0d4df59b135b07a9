"""Stated uncertainties of maps, points and spheres against trials."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import sphere_pattern_25, unit
from pretravel.files.touches_csv import read_touches
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.measurement.measured_sphere import measured_sphere
from pretravel.measurement.point_errors import (
    PointErrors,
    point_sources,
    total_covariance,
    unknown_delay_travel,
)
from pretravel.qualification.qualify import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.errors_by_trials import (
    errors_by_trials,
    map_by_trials,
    points_by_trials,
    sphere_by_trials,
)
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES
from tests.support.made_up_probes import PATTERN, made_up_response, touches_of

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


def test_map(made: PretravelMap) -> None:
    n = sphere_pattern_25()
    trials = map_by_trials(made, n, trials=TRIALS)
    standard_error = made.standard_uncertainty(n).max() / np.sqrt(TRIALS)
    assert trials.mean(axis=0) == pytest.approx(made.pretravel(n), abs=4.0 * standard_error)
    assert trials.std(axis=0) == pytest.approx(made.standard_uncertainty(n), rel=NEAR, abs=1e-9)


def test_points_with_their_covariance(made: PretravelMap) -> None:
    """Oblique approaches, so that all nine elements matter."""
    n = sphere_pattern_25()
    a = unit(-n + 0.3 * np.roll(n, 1, axis=1))
    touches = Touches(n * 15.49, n, approaches=a)
    points = apply(touches, made)
    trials = points_by_trials(touches, points, made, trials=TRIALS)
    for i in (0, 7, 20):
        found = np.cov(trials[:, i], rowvar=False)
        scale = np.trace(points.covariance[i])
        assert found == pytest.approx(points.covariance[i], abs=0.03 * scale)


def test_points_share_what_they_share(made: PretravelMap) -> None:
    n = sphere_pattern_25()
    touches = Touches(n * 15.49, n)
    points = apply(touches, made)
    stated = total_covariance(point_sources(touches, points, made)).matrix
    trials = points_by_trials(touches, points, made, trials=TRIALS)
    along = np.einsum("tni,ni->tn", trials - points.positions, n)
    assert np.cov(along, rowvar=False) == pytest.approx(stated, abs=0.04 * np.diag(stated).max())


def test_sphere_by_both(made: PretravelMap) -> None:
    """A sphere is nearly linear in its points: the GUM is validated."""
    n = sphere_pattern_25()
    touches = Touches(n * 15.49, n)
    points = apply(touches, made)
    ball = measured_sphere(touches, points, made)
    trials, judged = sphere_by_trials(ball, digits=1, most_trials=60_000)
    # GUM Supplement 1, 7.9.2: half a unit of the digit of u; a fifth of it (8.2) settles trials.
    unit_of_digit = 10.0 ** np.floor(np.log10(trials.standard_uncertainty))
    assert trials.tolerance == pytest.approx(0.2 * 0.5 * unit_of_digit)
    assert trials.standard_uncertainty[0] == pytest.approx(ball.budget.combined, rel=NEAR)
    assert trials.value[0] == pytest.approx(ball.diameter, abs=0.02 * ball.budget.combined)
    assert judged.valid[0]
    assert {c.name for c in ball.budget.components} == {"repeatability", "map", "tip radius"}


@pytest.mark.parametrize("draws", [15, pytest.param(40, marks=pytest.mark.slow)])
def test_sphere_errors_are_as_stated(draws: int) -> None:
    """The complete chain, many times: a known simulated probe is qualified on one sphere, of exact
    diameter, and measures another. Errors of the diameter over u have a deviation of one and the
    mean zero: within what so many draws show with all but one in ten thousand."""
    z = []
    response = made_up_response(np.random.default_rng(0), 0.0)
    n = sphere_pattern_25()
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        made = qualify(
            touches_of(response, PATTERN, rng), 25.0, tip_diameter=6.0, kind="harmonic",
            search_outliers=False, u_diameter=0.0, u_temperature=0.0,
        ).pretravel_map  # fmt: skip
        distance = 13.0 - response.pretravel(n) + rng.normal(0.0, 0.3e-3, len(n))
        touches = Touches(n * distance[:, None], n)
        ball = measured_sphere(touches, apply(touches, made), made)
        z.append((ball.diameter - 20.0) / ball.budget.combined)
    least, most = stats.chi2(draws - 1).ppf([0.5e-4, 1.0 - 0.5e-4])
    assert least < (draws - 1) * np.var(z, ddof=1) < most
    assert abs(np.mean(z)) < stats.norm.ppf(1.0 - 0.5e-4) / np.sqrt(draws)


def _fed(made_at: float | None, feeds: list[float] | None, uncertain: bool = True) -> list[float]:
    """Travel, in um, of an unknown delay in three touches."""
    variance = Covariance.independent([1e-8]) if uncertain else Covariance.none(1)
    made = replace(mean_map(0.01), covariance=variance, feed=made_at)
    n = np.array([[0.0, 0.0, 1.0]] * 3)
    found = unknown_delay_travel(Touches(2.99 * n, n, feeds=feeds), made)
    return (1e3 * found).round(9).tolist()


def test_an_unknown_delay_travels_the_difference_of_the_feeds() -> None:
    """2 ms at 60 mm/min, 1 mm/s, are 2 um; feeds within a per cent are the same."""
    assert _fed(60.0, [60.0, 120.0, 30.0]) == [0.0, 2.0, 1.0]
    assert _fed(60.0, [60.5, 59.5, 61.0]) == [0.0, 0.0, pytest.approx(1.0 / 30.0)]
    assert _fed(None, [60.0, 120.0, 30.0]) == [2.0, 4.0, 1.0]
    assert _fed(60.0, None) == [2.0] * 3
    assert _fed(None, None) == [0.0] * 3
    assert _fed(60.0, [60.0, 120.0, 30.0], uncertain=False) == [0.0] * 3


def test_errors_of_a_point_by_hand() -> None:
    """Oblique by 60°: repeatability and delay along the approach, the map over the cosine, the tip
    along the normal; along the normal, their parts in it."""
    normal, approach = np.array([[0.0, 0.0, 1.0]]), np.array([[math.sqrt(0.75), 0.0, -0.5]])
    made = replace(
        mean_map(0.01), covariance=Covariance.independent([4e-8]), repeatability=3e-4,
        u_tip_radius=5e-4, fixed_scatter=4e-4,
    )  # fmt: skip
    errors = PointErrors(
        made, normal, approach, np.array([0.5]), np.array([1e-4]), np.array([6e-4])
    )
    along = (3e-4**2 + 4e-4**2) + (4e-8 - 1e-8) / 0.25 + 6e-4**2
    expected = along * np.outer(approach, approach) + 5e-4**2 * np.outer(normal, normal)
    assert errors.covariance(np.array([2e-4]))[0] == pytest.approx(expected, rel=1e-9)
    variances = {name: part.matrix[0, 0] for name, part in errors.along_normals().items()}
    assert variances == {
        "repeatability": pytest.approx(25e-8 * 0.25),
        "map": pytest.approx(3e-8),
        "tip radius": pytest.approx(25e-8),
        "signal delay": pytest.approx(36e-8 * 0.25),
    }
    shared = errors.shared_along_normals()
    assert shared is not None
    assert shared["tip radius"].tolist() == [5e-4]
    assert shared["signal delay"] == pytest.approx([3e-4])
    # With many trials, the same covariance: 3 % of 20,000.
    drawn = errors_by_trials(errors, np.array([0.01]), 20_000, np.random.default_rng(2))[:, 0]
    assert drawn.mean(axis=0) == pytest.approx(np.zeros(3), abs=3e-5)
    whole = (3e-4**2 + 4e-4**2) + 4e-8 / 0.25 + 6e-4**2
    expected = whole * np.outer(approach, approach) + 5e-4**2 * np.outer(normal, normal)
    assert np.cov(drawn.T) == pytest.approx(expected, abs=0.04 * np.abs(expected).max())
