"""Uneven repeatability is found where it is strong, and not in even noise of any kind."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, sphere_pattern_25
from pretravel.qualification.within_directions import (
    repeatability_by_direction,
    scatter_functions,
)

NORMALS = sphere_pattern_25()


def _at_rods(directions: FloatArray) -> FloatArray:
    """Three times larger at three rods, falling to once at 60° from them and at the pole."""
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    toward = np.cos(azimuth[:, None] - np.radians([20.0, 140.0, 260.0])).max(axis=1)
    level = np.hypot(directions[:, 0], directions[:, 1])
    return 1.0 + 2.0 * level * np.clip(2.0 * toward - 1.0, 0.0, 1.0)


@pytest.mark.parametrize("kind", ["normal", "heavy tails", "quantised", "unequal repeats"])
def test_even_noise_is_rarely_uneven(kind: str) -> None:
    """300 sets at 1 %: 3 ± 1.7."""
    alarms = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        count = rng.integers(1, 5, 25) if kind == "unequal repeats" else np.full(25, 3)
        groups = np.repeat(np.arange(25), count)
        size = len(groups)
        noise = rng.standard_t(3, size) if kind == "heavy tails" else rng.standard_normal(size)
        if kind == "quantised":
            noise = 10.0 * np.round(0.1 * noise + rng.random(25)[groups])
        found = repeatability_by_direction(0.0003 * noise, groups, NORMALS[groups])
        alarms += found.uneven
        if not found.uneven:
            assert found.at(NORMALS) == pytest.approx(np.full(25, found.constant))
    assert alarms <= 3 + 3.5 * 1.7


@pytest.mark.parametrize(("repeats", "least"), [(3, 0.2), (5, 0.45), (10, 0.8)])
def test_three_times_larger_noise_at_the_rods_is_found(repeats: int, least: float) -> None:
    """Found in 29, 59 and 91 % of sets; then the estimate is nearer than an even scatter."""
    groups = np.repeat(np.arange(25), repeats)
    grid = from_angles(np.pi / 2, np.linspace(0.0, 2.0 * np.pi, 73)[:-1])
    fitted = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        noise = 0.0003 * _at_rods(NORMALS[groups]) * rng.standard_normal(len(groups))
        found = repeatability_by_direction(noise, groups, NORMALS[groups])
        if found.uneven:
            fitted.append(np.log(found.at(grid) / (0.0003 * _at_rods(grid))))
    share = len(fitted) / 150
    assert share >= least
    # The best even scatter is 0.308 off (rms of the logarithm over the ring).
    assert np.sqrt(np.mean(np.square(fitted))) < 0.3


def test_coefficients_are_those_of_the_noise() -> None:
    """100 000 touches in 1000 directions: the standard error is 0.02 (0.3 % of the variance)."""
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((1000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    groups = np.repeat(np.arange(1000), 100)
    truth = np.array([np.log(1e-7), 0.8, -0.5, 0.6])
    scatter = np.exp(0.5 * scatter_functions(directions) @ truth)
    values = scatter[groups] * rng.standard_normal(len(groups))
    found = repeatability_by_direction(values, groups, directions[groups])
    assert found.coefficients == pytest.approx(truth, abs=0.08)
    assert found.at(directions) == pytest.approx(scatter, rel=0.04)


def test_too_few_repeats_give_a_constant() -> None:
    single = repeatability_by_direction(np.zeros(25), np.arange(25), NORMALS)
    assert np.isnan(single.constant)
    assert not single.uneven
    groups = np.append(np.arange(25), [0, 1])
    rng = np.random.default_rng(0)
    few = repeatability_by_direction(rng.standard_normal(27), groups, NORMALS[groups])
    assert few.dof == 2
    assert np.isnan(few.p_value)
    assert few.at(NORMALS[:2]) == pytest.approx(np.full(2, few.constant))
    equal = repeatability_by_direction(
        np.zeros(50), np.repeat(np.arange(25), 2), NORMALS.repeat(2, 0)
    )
    assert equal.constant == 0.0
    assert not equal.uneven
