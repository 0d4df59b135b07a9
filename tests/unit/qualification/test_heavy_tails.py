"""Kurtosis of repeats, without the bias of small groups."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.qualification.within_directions import tail_kurtosis

GROUPS = np.repeat(np.arange(25), 3)


@pytest.mark.parametrize("repeats", [2, 3, 10])
def test_the_kurtosis_of_known_distributions(repeats: int) -> None:
    """Normal 0, uniform -1.2, Laplace 3.

    15 000 touches: standard errors of 0.08 (pairs, normal) to 0.25 (Laplace).
    """
    rng = np.random.default_rng(0)
    groups = np.repeat(np.arange(15_000 // repeats), repeats)
    offset = rng.standard_normal(groups[-1] + 1)[groups]
    draws = (
        (rng.standard_normal(len(groups)), 0.0),
        (rng.uniform(-1.0, 1.0, len(groups)), -1.2),
        (rng.laplace(size=len(groups)), 3.0),
    )
    for values, kurtosis in draws:
        found = tail_kurtosis(10.0 * offset + values, groups)
        assert found.kurtosis == pytest.approx(kurtosis, abs=0.32 if kurtosis < 1.0 else 1.0)


def test_groups_of_different_size_and_single_touches() -> None:
    rng = np.random.default_rng(1)
    groups = rng.permutation(np.repeat(np.arange(5_000), rng.integers(1, 6, 5_000)))
    found = tail_kurtosis(rng.laplace(size=len(groups)), groups)
    assert found.kurtosis == pytest.approx(3.0, abs=1.0)
    assert found.student_dof == pytest.approx(6.0, abs=0.9)
    assert found.p_value < 0.01


def test_false_alarms_and_power_for_25_directions_of_three() -> None:
    """Normal: 200 sets at 5 %, 10 ± 3.1. Student's t with three degrees: 60 % are found."""
    alarms, found = 0, 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        alarms += tail_kurtosis(rng.standard_normal(75), GROUPS).p_value <= 0.05
        found += tail_kurtosis(rng.standard_t(3, 75), GROUPS).p_value <= 0.05
    assert 1 <= alarms <= 21
    assert found >= 100


def test_without_repeats_nothing_is_known() -> None:
    for values, groups in ((np.arange(5.0), np.arange(5)), (np.zeros(6), np.arange(6) // 2)):
        tails = tail_kurtosis(values, groups)
        assert np.isnan(tails.kurtosis)
        assert np.isnan(tails.p_value)
        assert tails.student_dof == np.inf
