"""Noise of touches by direction: steps, tails, directions that scatter more."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.maps.observation import Observation, Scatter
from pretravel.qualification.touch_noise import TouchNoise, fixed_part, touch_noise

REPEATS = 3


def noise_of(errors: np.ndarray, step: float = 0.0) -> TouchNoise:
    directions = np.repeat(sphere_pattern_25(), REPEATS, axis=0)
    positions = directions * (15.0 + errors)[:, None]
    groups = np.repeat(np.arange(25), REPEATS)
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    return touch_noise(seen, Scatter(0.0003, 50.0), step)


@pytest.mark.parametrize("scatter", [0.05, 0.1, 0.3, 0.7, 1.5])
def test_a_step_leaves_in_the_mean_what_repeats_share(scatter: float) -> None:
    """Rounded touches at random phases: the variance of the mean of three, in steps.

    400 000 draws: the variance of the mean scatters by sqrt(2 / 400000) = 0.2 %; the integral over
    kinks is right to 1 %.
    """
    rng = np.random.default_rng(1)
    place = rng.uniform(0.0, 1.0, (400_000, 1))
    error = np.round(place + scatter * rng.standard_normal((400_000, 3))) - place
    within = float(np.mean(np.var(error, axis=1, ddof=1)))
    expected = fixed_part(np.sqrt(within), 1.0) + within / 3.0
    assert np.var(error.mean(axis=1)) == pytest.approx(expected, rel=0.02)


def test_equal_directions_are_nearly_alike_and_others_are_not() -> None:
    rng = np.random.default_rng(2)
    errors = 3e-4 * rng.standard_normal(75)
    alike = noise_of(errors)
    assert np.max(alike.relative) < 2.0
    assert np.sqrt(np.mean(alike.variances)) == pytest.approx(3e-4, rel=0.2)
    loud = np.arange(75) // REPEATS % 5 == 0
    uneven = noise_of(np.where(loud, 6.0, 1.0) * errors)
    # Two degrees of freedom of their own count as much as what all directions say.
    assert np.mean(uneven.variances[::5]) > 1.7 * np.mean(uneven.variances[1::5])
    assert uneven.scatter.dof < 0.8 * alike.scatter.dof


def test_one_bad_touch_hardly_moves_the_trimmed_scatter() -> None:
    errors = 3e-4 * np.random.default_rng(3).standard_normal(75)
    good = noise_of(errors)
    errors[10] += 0.01
    bad = noise_of(errors)
    assert bad.scatter.deviation > 3.0 * good.scatter.deviation
    assert bad.trimmed == pytest.approx(good.trimmed, rel=0.2)
    # Of normal noise the trimmed scatter is the whole one: 4 % over 25 sets of 50 degrees.
    many = [noise_of(3e-4 * np.random.default_rng(s).standard_normal(75)) for s in range(25)]
    assert np.mean([n.trimmed**2 for n in many]) == pytest.approx(9e-8, rel=0.12)


def test_other_touches_change_all_directions_alike() -> None:
    """As many degrees of freedom with twice the deviation: a mean square of 5/2."""
    noise = noise_of(3e-4 * np.random.default_rng(4).standard_normal(75))
    own, dof = noise.scatter.deviation, noise.scatter.dof
    pooled = noise.pooled_with(Scatter(2.0 * own, dof))
    assert (pooled.scatter.deviation, pooled.scatter.dof) == pytest.approx(
        (math.sqrt(2.5) * own, 2.0 * dof), rel=1e-12
    )
    assert pooled.variances == pytest.approx(2.5 * noise.variances, rel=1e-12)
    assert pooled.raw_variances == pytest.approx(2.5 * noise.raw_variances, rel=1e-12)


def test_without_own_scatter_every_direction_has_that_of_other_touches() -> None:
    zero = np.zeros(3)
    noise = TouchNoise(Scatter(0.0, 0.0), 0.0, zero, zero, zero, np.ones(3), 0.0)
    pooled = noise.pooled_with(Scatter(2e-3, 5.0))
    assert pooled.variances == pytest.approx(np.full(3, 4e-6), rel=1e-12)
    assert pooled.raw_variances == pytest.approx(np.full(3, 4e-6), rel=1e-12)


def test_directions_without_repeats_have_the_pooled_variance() -> None:
    """Beside directions that scatter differently, a single touch tells nothing of its own."""
    directions = sphere_pattern_25()
    groups = np.concatenate([np.repeat(np.arange(20), 3), np.arange(20, 25)])
    rng = np.random.default_rng(5)
    loud = np.where(groups % 4 == 0, 8.0, 1.0)
    errors = 3e-4 * loud * rng.standard_normal(len(groups))
    positions = directions[groups] * (15.0 + errors)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    found = touch_noise(seen, Scatter(0.0003, 50.0), 0.0)
    means = [errors[groups == g].mean() for g in range(25)]
    squares = (errors - np.array(means)[groups]) ** 2
    pooled = squares.sum() / 40.0
    assert found.scatter.deviation == pytest.approx(math.sqrt(pooled), rel=1e-9)
    assert found.raw_variances[20:] == pytest.approx(np.full(5, pooled), rel=1e-9)
    assert found.variances[20:] == pytest.approx(np.full(5, pooled), rel=1e-9)
    own = [squares[groups == g].sum() / 2.0 for g in range(20)]
    assert found.raw_variances[:20] == pytest.approx(own, rel=1e-9)
    assert found.counts.tolist() == [3.0] * 20 + [1.0] * 5
