"""Shares of machine and probe, and the stated uncertainties against trials."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.laboratory.multi_step_readings import (
    MultiStepReadings,
    RepeatedPair,
    multi_step_design,
    weighted_residuals,
)
from pretravel.laboratory.separation import METHODS, Method, separate
from pretravel.laboratory.separation_noise import (
    TAILS,
    ReadingScale,
    noise_tails,
    student_weight,
)
from pretravel.laboratory.separation_plan import (
    best_steps,
    error_factor,
    plan_separation,
    variance_factor,
)
from pretravel.laboratory.separation_variances import (
    _shrunk,
    _student_scales,
    equally_shared,
    likelihood_information,
    noise_of_readings,
)
from tests.support.separation_trials import separation_by_trials

TRIALS = 20_000


def test_separation() -> None:
    i, j = np.divmod(np.arange(12 * 12), 12)
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(144) * np.sqrt(0.2 + 0.1 * np.cos(j))
    readings = MultiStepReadings(i, j, 1e-3 * (np.sin(i) - np.cos(j) + noise))
    result = separate(readings, method="least-squares")
    errors, variances = separation_by_trials(readings, result, trials=TRIALS)
    stated = np.sqrt(np.diag(result.error_covariance))
    # Four standard errors of a deviation from 20 000 trials: 2 %. A pair whose variance least
    # squares finds negative has none in trials, which changes less than that here.
    assert errors.std(axis=0) == pytest.approx(stated, rel=0.02)
    assert errors.mean(axis=0) == pytest.approx(
        np.concatenate([result.machine_error, result.probe_error]), abs=5e-6
    )
    stated = np.diag(result.variance_covariance)
    # The trials have normal noise; u contains that the readings may have another one.
    dof = np.maximum(1.0 / np.maximum(TAILS, 1e-9), 4.5)
    wider = noise_of_readings(multi_step_design(readings), readings.errors).of_tails @ (
        1.0 + 3.0 / (dof - 4.0)
    )
    assert 1.0 < wider < 1.5
    assert variances.std(axis=0) == pytest.approx(np.sqrt(stated / wider), rel=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_variances_are_shared_half_and_half_on_average(method: Method) -> None:
    """No reading determines the share; the stated one has equal means, and pairs do not change
    with it. All pairs of twelve directions sixteen times, so that no variance comes near zero."""
    i, j = np.divmod(np.arange(16 * 144) % 144, 12)
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(len(i)) * np.sqrt(0.9 + 0.2 * np.cos(j) + 0.1 * np.sin(i))
    readings = MultiStepReadings(i, j, 1e-3 * noise)
    result = separate(readings, method=method, search_outliers=False)
    assert result.movable.min() > 0.1e-6
    machine, probe = result.machine_variance.mean(), result.probe_variance.mean()
    assert machine == pytest.approx(probe, rel=1e-12)
    # Together 0.9 µm²: from 2304 readings a variance has 3 %; four of these.
    assert machine + probe == pytest.approx(0.9e-6, rel=0.12)


def test_equal_shares_leave_the_sums_of_pairs() -> None:
    i, j = np.divmod(np.arange(6), 3)
    design = multi_step_design(MultiStepReadings(i, j, np.zeros(6)))
    shared = equally_shared(design, np.array([5.0, 7.0, 1.0, 2.0, 3.0]))
    assert shared == pytest.approx([3.0, 5.0, 3.0, 4.0, 5.0], abs=1e-15)


@pytest.mark.parametrize(("scatter", "share"), [(0.0, 1.0), (2.0, 0.5), (4.0, 0.0)])
def test_variances_are_shrunk_by_the_part_of_their_spread_that_is_scatter(
    scatter: float, share: float
) -> None:
    """The variances 5, 7, 9 spread by the variance 4, the others by 1 with a quarter of the
    scatter: of each spread the share 1 - scatter / 4 is that of the directions."""
    i, j = np.divmod(np.arange(9), 3)
    design = multi_step_design(MultiStepReadings(i, j, np.zeros(9)))
    machine, probe = np.array([-2.0, 0.0, 2.0]), np.array([1.0, 0.0, -1.0])
    covariance = scatter * np.diag([1.0, 1.0, 1.0, 0.25, 0.25, 0.25])
    shrunk = _shrunk(design, np.concatenate([7.0 + machine, 6.0 + probe]), covariance, 13.0)
    expected = np.concatenate([7.0 + share * machine, 6.0 + share * probe])
    assert shrunk == pytest.approx(expected, abs=1e-12)


def test_variances_without_spread_stay() -> None:
    """Equal variances, and the single variance of one direction, are their own mean."""
    i, j = np.divmod(np.arange(6), 6)
    design = multi_step_design(MultiStepReadings(i, j, np.zeros(6)))
    values = np.array([3.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0])
    assert _shrunk(design, values, np.eye(7), 5.0) == pytest.approx(values, abs=1e-15)


@pytest.mark.parametrize(
    ("directions", "u_error", "u_variance"),
    [(5, None, 0.35), (6, None, 0.2), (4, 0.3e-3, 0.5), (6, 0.25e-3, None), (4, 0.2e-3, 0.3)],
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


@pytest.mark.parametrize("method", METHODS)
def test_a_repeated_pair_is_stated_in_square_micrometres(method: Method) -> None:
    """0.36 um² of 20 repeats, beside readings with 1 um²."""
    i, j = np.divmod(np.arange(64), 8)
    rng = np.random.default_rng(3)
    readings = MultiStepReadings(i, j, 1e-3 * rng.standard_normal(64))
    pair = RepeatedPair(2, 3, 0.36e-6, 20)
    found = separate(readings, method=method, repeated=pair)
    note = next(note for note in found.notes if "repeated configuration (2, 3)" in note)
    assert "has the variance 0.36 µm² from 20 repeats" in note
    stated = float(note.rpartition("has ")[2].split()[0])
    assert stated == pytest.approx(1e6 * found.pair_variance(2, 3)[0], rel=0.01)
    assert 0.2 < stated < 0.8


@pytest.mark.parametrize("tails", [0.0, 1.0 / 3.0])
def test_scales_of_directions_solve_their_equations(tails: float) -> None:
    """At the end of the iteration the residuals are those of the weighted least squares.

    Within 3 %: eight rounds with each scale, which is not the same path to both ends.
    """
    i, j = np.divmod(np.arange(100), 10)
    rng = np.random.default_rng(5)
    errors = 1e-3 * rng.standard_t(4.0, 100) * (1.0 + 0.5 * (i % 2))
    design = multi_step_design(MultiStepReadings(i, j, errors))
    information = likelihood_information(design, np.full(100, 1e-6))
    squared = np.full(design.size, 0.5e-6)
    for _ in range(20):
        squared = _student_scales(design, errors, information, information.inverse, tails, squared)
    total = np.maximum(design.incidence @ squared, 0.1 * np.mean(design.incidence @ squared))
    free = np.maximum(1.0 - information.leverage, 1e-6)
    residuals = weighted_residuals(design, errors, information.weights)
    for _ in range(200 if tails else 1):
        factor = student_weight(tails, residuals**2 / (free * total))
        if tails:
            residuals = weighted_residuals(design, errors, information.weights * factor)
    sums = design.incidence.T @ (information.weights**2 * factor * residuals**2)
    assert squared == pytest.approx(information.inverse @ (0.5 * sums), rel=0.03, abs=5e-9)


@pytest.mark.parametrize("gross", [False, True])
def test_the_level_of_the_scales_does_not_matter_for_the_tails(gross: bool) -> None:
    """Scales a hundred times as large have a level of a hundredth, and the same probabilities."""
    i, j = np.divmod(np.arange(144), 12)
    errors = 1e-3 * np.random.default_rng(5).standard_t(4.0, 144)
    design = multi_step_design(MultiStepReadings(i, j, errors))
    leverage = np.full(144, 23.0 / 144.0)
    own, other = (
        noise_tails(design, errors, ReadingScale(np.full(144, size), leverage), gross=gross)
        for size in (1e-6, 1e-4)
    )
    assert other.probability == pytest.approx(own.probability, rel=1e-5, abs=1e-9)
    assert 100.0 * other.levels == pytest.approx(own.levels, rel=1e-5)
    assert 0.1 < own.mean_tail < 0.35
