"""A drift of the reference is found in passes, and not reported without one."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.qualification.touch_order import (
    drift_columns,
    drift_is_separable,
    estimated_drift,
    relative_times,
)

PASSES, IN_A_ROW = np.tile(np.arange(25), 3), np.repeat(np.arange(25), 3)
TIMES = np.arange(75.0)


def _values(
    rng: np.random.Generator, groups: IntArray, drift: FloatArray, noise: float = 0.0003
) -> tuple[FloatArray, FloatArray]:
    directions = sphere_pattern_25()[groups]
    each = 0.003 * rng.standard_normal(25)
    moved = drift_columns(directions, TIMES) @ drift
    return each[groups] + moved + noise * rng.standard_normal(75), directions


def test_passes_separate_a_drift_and_repeats_in_a_row_do_not() -> None:
    assert drift_is_separable(PASSES, TIMES)
    assert drift_is_separable(np.tile(np.arange(25), 2), TIMES[:50])
    assert not drift_is_separable(IN_A_ROW, TIMES)
    assert not drift_is_separable(np.arange(75), TIMES)
    # One direction touched again at the end is not enough.
    assert not drift_is_separable(np.append(np.arange(25), [0, 0]), TIMES[:27])


def test_the_estimate_and_its_covariance_agree() -> None:
    """(error)' C^-1 (error) / 3 of 500 sets is F(3, 47): mean 47/45, standard error 0.04."""
    drift = np.array([0.0015, -0.001, 0.0005])
    statistic = np.empty(500)
    for seed in range(len(statistic)):
        values, directions = _values(np.random.default_rng(seed), PASSES, drift)
        fit = estimated_drift(values, directions, PASSES, TIMES)
        error = fit.value - drift
        statistic[seed] = error @ np.linalg.solve(fit.covariance, error) / 3.0
        assert fit.determined.all()
        assert fit.dof == 47
    assert statistic.mean() == pytest.approx(47 / 45, abs=4 * 0.04)


def test_false_alarms_and_power() -> None:
    """300 sets at 5 %: 15 ± 3.8. A drift of 1 µm at noise 0.3 µm is found nearly always."""
    alarms, found, in_a_row = 0, 0, 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        values, directions = _values(rng, PASSES, np.zeros(3))
        alarms += estimated_drift(values, directions, PASSES, TIMES).p_value <= 0.05
        values, directions = _values(rng, PASSES, np.array([0.001, 0.0, 0.0]))
        found += estimated_drift(values, directions, PASSES, TIMES).p_value <= 0.05
        values, directions = _values(rng, IN_A_ROW, np.array([0.001, 0.0, 0.0]))
        in_a_row += estimated_drift(values, directions, IN_A_ROW, TIMES).p_value <= 0.05
    assert 2 <= alarms <= 28
    # Non-centrality 75/3 · 1/12 · 0.89 · (1/0.3)² = 20: the power of F(3, 47) is 0.96.
    assert found >= 270
    assert in_a_row <= 30


def test_a_ring_has_no_drift_along_its_axis() -> None:
    azimuth = np.arange(8) * np.pi / 4
    groups = np.tile(np.arange(8), 3)
    directions = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(8)])[groups]
    noise = 0.0001 * np.random.default_rng(0).standard_normal(24)
    values = directions[:, 0] * 0.002 * relative_times(np.arange(24)) + noise
    fit = estimated_drift(values, directions, groups, np.arange(24))
    assert fit.determined.tolist() == [True, True, False]
    assert fit.value == pytest.approx([0.002, 0.0, 0.0], abs=4 * 0.0001 / np.sqrt(24 / 2 / 12))
    assert fit.dof == 24 - 8 - 2


def test_without_repeats_nothing_is_determined() -> None:
    directions = sphere_pattern_25()
    fit = estimated_drift(np.zeros(25), directions, np.arange(25), np.arange(25))
    assert not fit.determined.any()
    assert np.isnan(fit.p_value)
    assert np.all(fit.value == 0.0)
