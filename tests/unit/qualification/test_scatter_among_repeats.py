"""Tails of repeats, against all outcomes and likelihoods."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import optimize, stats

from pretravel.base.arrays import FloatArray
from pretravel.qualification.within_directions import tail_kurtosis, tested_touches

SIZES = (2, 3, 4)
GROUPS = np.repeat(np.arange(3), SIZES)


def _sums(values: FloatArray, sizes: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """Sum of fourth powers, and square of the pooled variance, of each row of values."""
    fourth, square = np.zeros(len(values)), np.zeros(len(values))
    for part in np.split(values, np.cumsum(sizes)[:-1], axis=1):
        apart = part - part.mean(axis=1, keepdims=True)
        fourth += np.sum(apart**4, axis=1)
        square += np.sum(apart**2, axis=1)
    return fourth, (square / (sum(sizes) - len(sizes))) ** 2


def _expectations(points: tuple[float, ...]) -> tuple[float, float]:
    """Of both sums over all outcomes of nine touches, each of equally probable values."""
    outcomes = np.array(list(itertools.product(points, repeat=9)))
    fourth, squared = _sums(outcomes, SIZES)
    return float(fourth.mean()), float(squared.mean())


def test_kurtosis_has_the_expectations_of_all_outcomes() -> None:
    """Both expectations are linear in σ⁴ and the fourth cumulant; two distributions tell how."""
    known, expected = [], []
    for points in ((-1.0, 1.0), (-1.0, 0.0, 1.0)):
        values = np.array(points)
        variance = float(np.mean(values**2))
        known.append([variance**2, float(np.mean(values**4)) - 3.0 * variance**2])
        expected.append(_expectations(points))
    matrix = np.linalg.solve(np.array(known), np.array(expected)).T
    compared = 0
    for seed in range(8):
        draw = np.random.default_rng(seed).standard_t(3, 9)
        fourth, squared = _sums(draw[None, :], SIZES)
        sigma, cumulant = np.linalg.solve(matrix, [fourth[0], squared[0]])
        if sigma <= 0.0:
            continue  # nine touches can show tails without a normal part
        compared += 1
        found = tail_kurtosis(1e-3 * draw + 7.0 * GROUPS, GROUPS)
        assert found.kurtosis == pytest.approx(cumulant / sigma, rel=1e-6)
        # Single touches, other numbers of the directions and another order tell the same.
        order = np.random.default_rng(seed).permutation(10)
        again = tail_kurtosis(np.append(draw, 5.0)[order], np.append(3 - GROUPS, 9)[order])
        assert again.kurtosis == pytest.approx(found.kurtosis, rel=1e-6)
        if found.kurtosis > 0.1:
            student = stats.t(found.student_dof).stats("k")
            assert float(student) == pytest.approx(found.kurtosis, rel=1e-9)
        elif found.kurtosis < 0.0:
            assert found.student_dof == np.inf
    assert compared >= 4


def test_probability_of_a_kurtosis_is_that_of_normal_draws() -> None:
    """20 000 draws of other numbers; a share of 1000 scatters by sqrt(p (1 - p) / 1000)."""
    draw = np.random.default_rng(0).standard_t(4, 9)
    found = tail_kurtosis(draw, GROUPS)

    def ratio(values: FloatArray) -> FloatArray:
        fourth, squared = _sums(values, SIZES)
        return np.asarray(fourth / squared)  # the kurtosis grows with it, in these groups

    normal = ratio(np.random.default_rng(1).standard_normal((20_000, 9)))
    p = float(np.mean(normal >= ratio(draw[None, :])[0]))
    assert 0.05 < p < 0.95
    assert found.p_value == pytest.approx(p, abs=4.0 * np.sqrt(p * (1.0 - p) / 1000.0))


def test_one_of_a_thousand_is_the_least_probability() -> None:
    values = np.tile([1.0, -1.0], 50)
    values[0] = 1e4
    found = tail_kurtosis(values, np.repeat(np.arange(50), 2))
    assert found.p_value == pytest.approx(1e-3, rel=1e-12)
    # The lightest of all tails: each normal set has a larger kurtosis.
    lightest = tail_kurtosis(np.tile([1.0, -1.0], 50), np.repeat(np.arange(50), 2))
    assert lightest.p_value == 1.0
    # Of very many touches fewer sets are drawn: two million numbers in all.
    many = np.tile([1.0, -1.0], 2500)
    many[0] = 1e4
    assert tail_kurtosis(many, np.repeat(np.arange(2500), 2)).p_value == pytest.approx(1.0 / 401.0)


@pytest.mark.parametrize(
    ("values", "groups", "known"),
    [
        ([1.0, 2.0, 3.0, 5.0], [0, 0, 1, 1], True),
        ([1.0, 2.0, 3.0, 7.0], [0, 0, 0, 0], True),
        ([1.0, 2.0, 3.0], [0, 0, 1], False),
        ([1.1, 2.7, 4.4], [0, 0, 0], False),
        ([1.1, 2.7, 4.4, 9.0], [3, 3, 3, 1], False),
        ([1.0, 2.0, 3.0, 5.0], [0, 1, 2, 3], False),
        ([0.0, 0.0, 0.0, 0.0], [0, 0, 1, 1], False),
    ],
)
def test_four_repeated_touches_are_the_fewest(
    values: list[float], groups: list[int], known: bool
) -> None:
    """Differences x, y and -x - y of three touches from their mean have 2 Σ d⁴ = (Σ d²)², whatever
    they are: they show nothing of tails."""
    found = tail_kurtosis(values, groups)
    assert known or found.student_dof == np.inf
    assert bool(np.isfinite(found.kurtosis)) is known
    assert bool(np.isfinite(found.p_value)) is known


@pytest.mark.parametrize("dof", [203.0, 205.0])
def test_tails_are_normal_from_204_degrees_of_freedom(dof: float) -> None:
    """Student's kurtosis is 6/(ν - 4): that of a limit of 6/200 is 204."""
    draw = np.random.default_rng(3).standard_normal(200)
    groups = np.repeat(np.arange(50), 4)

    def heavier(power: float) -> FloatArray:
        return np.asarray(np.sign(draw) * np.abs(draw) ** power)

    power = optimize.brentq(
        lambda x: tail_kurtosis(heavier(x), groups).kurtosis - 6.0 / (dof - 4.0), 0.7, 1.5
    )
    found = tail_kurtosis(heavier(power), groups).student_dof
    assert found == (pytest.approx(dof, rel=1e-6) if dof < 204.0 else np.inf)


def test_of_more_than_ten_thousand_touches_a_part_is_tested() -> None:
    """A gross error in half of them is beyond all sets: one of as many as their number allows."""
    groups = np.arange(12_000) // 3
    values = np.random.default_rng(1).standard_normal(12_000)
    values[::6] *= 1e4
    number = int(tested_touches(groups).sum())
    assert number < 12_000
    found = tail_kurtosis(values, groups)
    assert found.p_value == pytest.approx(1.0 / (2_000_000 // number + 1.0), rel=1e-12)
