"""Repeatability by direction against likelihoods of scipy and all arrangements of directions."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import optimize, stats

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap
from pretravel.qualification.within_directions import (
    repeatability_by_direction,
    scatter_functions,
)


def _readings(deviations: FloatArray, dof: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Readings with given standard deviations in each direction, and their groups."""
    values = []
    for deviation, free in zip(deviations, dof, strict=True):
        shape = np.arange(free + 1.0)
        values.append(deviation * shape / max(np.std(shape, ddof=1), 1e-9) if free else [0.5])
    return np.concatenate(values), np.repeat(np.arange(len(dof)), dof + 1)


def test_functions_are_powers_of_the_normal() -> None:
    """sin θ cos 3φ and sin θ sin 3φ are the parts of (x + iy)³ over ρ²."""
    normals = fibonacci_cap(40)[1:]
    x, y, z = normals.T
    third = (x + 1j * y) ** 3 / (x**2 + y**2)
    expected = np.column_stack([np.ones(39), z**2, third.real, third.imag])
    assert scatter_functions(normals) == pytest.approx(expected, abs=1e-9)


def test_the_estimate_maximises_gamma_likelihood_times_prior() -> None:
    """By minimisation of densities of scipy, with different numbers of repeats."""
    normals = fibonacci_cap(30, math.pi / 2)
    dof = np.array([1, 2, 5] * 10)
    rng = np.random.default_rng(5)
    functions = scatter_functions(normals)
    true = np.exp(0.5 * functions @ [math.log(1e-7), -2.5, 1.5, -1.0])
    seen = true * np.sqrt(rng.chisquare(dof) / dof)
    values, groups = _readings(seen, dof)
    order = rng.permutation(len(values))
    found = repeatability_by_direction(values[order], groups[order], normals[groups][order])
    assert found.uneven
    assert found.dof == dof.sum()
    assert found.constant == pytest.approx(np.sqrt(dof @ seen**2 / dof.sum()), rel=1e-9)
    mean = found.constant**2

    def minus_log(coefficients: FloatArray) -> float:
        scale = np.exp(functions @ coefficients) * 2.0 / dof
        of_data = stats.gamma.logpdf(seen**2 / mean, 0.5 * dof, scale=scale).sum()
        return -float(of_data + stats.norm.logpdf(coefficients[1:]).sum())

    best = optimize.minimize(minus_log, np.zeros(4), method="BFGS", tol=1e-10).x
    best[0] += math.log(mean)
    assert found.coefficients == pytest.approx(best, abs=1e-4)
    assert found.at(normals) == pytest.approx(np.exp(0.5 * functions @ best), rel=1e-4)


@pytest.mark.parametrize("seed", [1, 3, 6])
def test_the_probability_is_that_of_all_arrangements(seed: int) -> None:
    """Five triples and four pairs, which have other mean deviations: 5! · 4! arrangements.

    The part that the functions explain beside a constant, by weighted least squares. A share of
    1000 scatters by sqrt(p (1 - p) / 1000).
    """
    rng = np.random.default_rng(seed)
    dof = np.array([2, 1, 2, 1, 2, 1, 2, 1, 2])
    normals = fibonacci_cap(9, math.pi / 2)
    deviation = np.where(dof == 1, 5.0, 1.0) * (1.0 + rng.random(9))
    values, groups = _readings(deviation, dof)
    found = repeatability_by_direction(values, groups, normals[groups])
    level = np.where(dof == 1, deviation[dof == 1].mean(), deviation[dof == 2].mean())
    root, full = np.sqrt(dof), scatter_functions(normals)
    whole = np.linalg.qr(full * root[:, None])[0]
    constant = root / np.linalg.norm(root)
    triples, pairs = np.flatnonzero(dof == 2), np.flatnonzero(dof == 1)
    explained = []
    for first in itertools.permutations(triples):
        for second in itertools.permutations(pairs):
            arranged = np.zeros(9)
            arranged[triples] = (deviation - level)[list(first)]
            arranged[pairs] = (deviation - level)[list(second)]
            weighted = arranged * root
            explained.append(np.sum((whole.T @ weighted) ** 2) - (constant @ weighted) ** 2)
    p = float(np.mean(np.array(explained) >= explained[0] * (1.0 - 1e-9)))
    assert found.p_value == pytest.approx(p, abs=4.0 * math.sqrt(p * (1.0 - p) / 1000.0))


def test_the_least_probability_is_one_of_a_thousand() -> None:
    normals = fibonacci_cap(40, math.pi / 2)
    dof = np.full(40, 3)
    values, groups = _readings(np.exp(-4.0 * normals[:, 2] ** 2), dof)
    found = repeatability_by_direction(values, groups, normals[groups])
    assert found.p_value == 1e-3
    assert found.uneven


@pytest.mark.parametrize(("directions", "tested"), [(7, False), (8, True)])
def test_eight_repeated_directions_are_the_fewest(directions: int, tested: bool) -> None:
    normals = fibonacci_cap(12, math.pi / 2)
    dof = np.array([1] * directions + [0] * (12 - directions))
    values, groups = _readings(np.linspace(1e-4, 3e-4, 12), dof)
    found = repeatability_by_direction(values, groups, normals[groups])
    assert bool(np.isfinite(found.p_value)) is tested
    assert found.dof == directions
    expected = math.sqrt(np.mean(np.linspace(1e-4, 3e-4, 12)[:directions] ** 2))
    assert found.constant == pytest.approx(expected, rel=1e-9)
    if not found.uneven:
        assert found.coefficients == pytest.approx([2.0 * math.log(expected), 0, 0, 0], rel=1e-9)


def test_nothing_can_be_uneven_in_one_direction_or_without_scatter() -> None:
    pole = np.tile([0.0, 0.0, 1.0], (10, 1))
    values, groups = _readings(np.linspace(1.0, 2.0, 10), np.full(10, 1))
    assert math.isnan(repeatability_by_direction(values, groups, pole[groups]).p_value)
    equal = repeatability_by_direction(0.0 * values, groups, fibonacci_cap(10)[groups])
    assert equal.coefficients.tolist() == [-math.inf, 0.0, 0.0, 0.0]
    assert math.isnan(equal.p_value)


def test_scatter_is_uneven_below_one_in_a_hundred() -> None:
    """Ten of a thousand arrangements are too many, nine are not; all are counted in thousandths."""
    normals = fibonacci_cap(12, math.pi / 2)
    dof = np.full(12, 2)
    other = np.random.default_rng(2).random(12)
    seen = set()
    for size in np.linspace(0.5, 2.0, 60):
        values, groups = _readings(1.0 + other + size * normals[:, 2] ** 2, dof)
        found = repeatability_by_direction(values, groups, normals[groups])
        thousandths = round(1000.0 * found.p_value)
        assert found.p_value == pytest.approx(1e-3 * thousandths, rel=1e-12)
        assert found.uneven == (thousandths < 10)
        seen.add(thousandths)
    assert {8, 9, 10, 11} <= seen


def test_equal_scatter_in_all_directions_is_even() -> None:
    """Each arrangement of equal deviations explains as much: nothing."""
    values, groups = _readings(np.full(8, 0.25), np.full(8, 1))
    found = repeatability_by_direction(values, groups, fibonacci_cap(8, 1.5)[groups])
    assert found.p_value == 1.0
    assert not found.uneven
