"""Plans of multi-step tests against dense equations and a trial of all numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings, multi_step_design
from pretravel.laboratory.separation.multi_step_touches import readings_of_touches
from pretravel.laboratory.separation.plan import (
    best_steps,
    error_factor,
    plan_separation,
    turned_pairs,
    variance_factor,
)
from pretravel.laboratory.separation.separation import separate
from pretravel.laboratory.separation.variances import (
    direction_variance_uncertainty,
    likelihood_information,
)
from pretravel.touches import Touches


@pytest.mark.parametrize(
    ("directions", "steps"), [(5, (0, 1, 3)), (6, (0, 1)), (7, (0, 2, 3, 6)), (4, (0, 1, 2, 3))]
)
def test_u_of_errors_is_that_of_dense_equations(directions: int, steps: tuple[int, ...]) -> None:
    """About their mean: errors of the machine that add up to zero."""
    machine, probe = turned_pairs(directions, steps)
    index = np.arange(1, directions + 1)
    signed = np.hstack([(machine[:, None] == index) * 1.0, (probe[:, None] == index) * -1.0])
    own = np.linalg.pinv(signed.T @ signed)[:directions, :directions]
    centred = np.eye(directions) - 1.0 / directions
    u = np.sqrt(np.diag(centred @ own @ centred))
    assert error_factor(directions, steps) == pytest.approx(u[0], rel=1e-9)


def test_orientations_that_connect_nothing() -> None:
    assert math.isinf(error_factor(6, (0, 2)))
    assert math.isinf(error_factor(6, (0, 3)))
    assert math.isfinite(error_factor(6, (0, 5)))


@pytest.mark.parametrize("repeats", [2, 5])
def test_repeats_count_as_readings_of_their_own(repeats: int) -> None:
    """Half of the pair's variance is that of a direction; the share is fixed."""
    machine, probe = turned_pairs(5, (0, 1, 3))
    readings = MultiStepReadings(machine[1:], probe[1:], np.zeros(14))
    whole = MultiStepReadings(
        np.tile(machine[1:], repeats), np.tile(probe[1:], repeats), np.zeros(14 * repeats)
    )
    information = likelihood_information(multi_step_design(whole), np.ones(len(whole)))
    u = math.sqrt(np.linalg.pinv(information.matrix, rcond=1e-9).diagonal().max())
    assert direction_variance_uncertainty(whole) == pytest.approx(2.0 * u, rel=1e-9)
    assert direction_variance_uncertainty(readings, repeats) == pytest.approx(2.0 * u, rel=1e-9)


def test_variances_that_readings_do_not_determine_are_infinite() -> None:
    """A ring of six readings has one degree of freedom; for repeats it has seven."""
    ring = MultiStepReadings(*turned_pairs(3, (0, 1)), np.zeros(6))
    assert math.isinf(direction_variance_uncertainty(ring))
    assert math.isfinite(direction_variance_uncertainty(ring, 2))


def test_each_orientation_is_the_best_beside_those_before() -> None:
    for directions in (5, 8):
        assert best_steps(directions, 2) == (0, 1)
        before = {0, 1}
        for count in range(3, directions + 1):
            steps = best_steps(directions, count)
            assert before < set(steps)
            assert list(steps) == sorted(steps)
            rest = set(range(directions)) - before
            least = min(error_factor(directions, (*before, step)) for step in rest)
            assert error_factor(directions, steps) == pytest.approx(least, rel=1e-9)
            before = set(steps)


def test_pairs_of_a_plan() -> None:
    """In orientation s machine direction i meets probe direction i - s; repeats in a row."""
    plan = replace(plan_separation(4, 1e-6, u_error=0.9e-3), steps=(0, 3), repeats=2)
    machine, probe = plan.pairs()
    assert machine.tolist() == [1, 1, 2, 2, 3, 3, 4, 4] * 2
    assert probe.tolist() == [1, 1, 2, 2, 3, 3, 4, 4, 2, 2, 3, 3, 4, 4, 1, 1]
    assert plan.readings == len(machine) == 16


@pytest.mark.parametrize(
    ("directions", "u_error", "u_variance"),
    [(5, None, 0.35), (5, None, 0.25), (4, 0.3e-3, 0.5), (6, 0.25e-3, None), (4, 0.2e-3, 0.3)],
)
def test_a_plan_has_the_fewest_touches_that_reach_the_uncertainties(
    directions: int, u_error: float | None, u_variance: float | None
) -> None:
    """Against a trial of all numbers of orientations and repeats."""
    plan = plan_separation(directions, 1e-6, u_error=u_error, u_variance=u_variance)

    def reaches(orientations: int, repeats: int) -> bool:
        steps = best_steps(directions, orientations)
        error = error_factor(directions, steps) * 1e-3 / np.sqrt(repeats)
        relative = variance_factor(directions, steps, repeats)
        return (u_error is None or error <= u_error * (1.0 + 1e-9)) and (
            u_variance is None or relative <= u_variance
        )

    assert reaches(len(plan.steps), plan.repeats)
    fewest = min(
        directions * orientations * repeats
        for orientations in range(2, directions + 1)
        for repeats in range(1, plan.readings // (2 * directions) + 1)
        if reaches(orientations, repeats)
    )
    assert plan.readings == fewest
    assert plan.u_error == pytest.approx(
        error_factor(directions, plan.steps) * 1e-3 / np.sqrt(plan.repeats), rel=1e-12
    )
    assert plan.u_variance == variance_factor(directions, plan.steps, plan.repeats)


@pytest.mark.parametrize(("directions", "u_error"), [(6, 0.3e-3), (8, 0.25e-3)])
def test_touches_of_a_plan_are_separated(directions: int, u_error: float) -> None:
    """Circles take three numbers of each setup: three orientations, one touch each, were planned,
    and refused. Of so few readings of noise none is named; without repeats none is searched."""
    plan = plan_separation(directions, 0.16e-6, u_error=u_error)
    azimuth = 2.0 * np.pi / directions * (plan.pairs()[0] - 1)
    spindle = np.repeat(plan.steps, directions * plan.repeats) * 2.0 * np.pi / directions
    normals = np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])
    for seed in (1, 2):
        noise = 0.4e-3 * np.random.default_rng(seed).standard_normal(len(normals))
        touches = Touches(normals * (13.0 + noise[:, None]), normals, spindle=spindle)
        found = separate(readings_of_touches(touches).readings)
        assert found.outliers == ()
        assert ("errors were not searched" in found.notes[-1]) == (plan.repeats == 1)


@pytest.mark.parametrize(
    ("directions", "variance", "u_error", "u_variance"),
    [
        (2, 1e-6, 1e-3, None), (73, 1e-6, 1e-3, None), (5, 0.0, 1e-3, None),
        (5, 1e-6, None, None),
        (5, 1e-6, 0.0, None), (5, 1e-6, None, 0.0), (5, -1e-6, 1e-3, None),
        (5, 1e-6, -1e-3, None),
        (5, 1e-6, None, -0.1), (5, 1e-6, math.nan, None), (5, math.inf, 1e-3, None),
    ],
)  # fmt: skip
def test_requirements_are_checked(
    directions: int, variance: float, u_error: float | None, u_variance: float | None
) -> None:
    with pytest.raises(PretravelError) as refused:
        plan_separation(directions, variance, u_error=u_error, u_variance=u_variance)
    assert "no test with up to" not in str(refused.value)


def test_the_lowest_uncertainty_is_that_of_fifty_repeats() -> None:
    steps = (0, 1, 2)
    lowest = error_factor(3, steps) * 2e-3 / math.sqrt(50.0)
    plan = plan_separation(3, 4e-6, u_error=1.0001 * lowest)
    assert (len(plan.steps), plan.repeats) == (3, 50)
    relative = variance_factor(3, steps, 50)
    assert plan_separation(3, 4e-6, u_variance=1.0001 * relative).repeats == 50
    words = f"3 orientations and 50 repeats .* {1e3 * lowest:.3g} µm of errors and"
    words += f" {100.0 * relative:.0f} % of v"
    for u_error, u_variance in (
        (0.999 * lowest, None), (None, 0.999 * relative), (1.0, 0.999 * relative),
    ):  # fmt: skip
        with pytest.raises(PretravelError, match=words):
            plan_separation(3, 4e-6, u_error=u_error, u_variance=u_variance)
