"""Hysteresis by the touch before: estimates, levels, and what an order does not show."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import sphere_pattern_25
from pretravel.maps.observation import Observation
from pretravel.qualification.machine_effects import machine_effects
from pretravel.qualification.touch_order import (
    between_predecessors,
    estimated_hysteresis,
    hysteresis_columns,
    predecessors,
    previous_directions,
    relative_times,
)

NORMALS = sphere_pattern_25()
TIMES = np.arange(75.0)
IN_A_ROW = np.repeat(np.arange(25), 3)
PASSES = np.tile(np.arange(25), 3)


def _mixed_passes(rng: np.random.Generator, passes: int = 3) -> IntArray:
    return np.concatenate([rng.permutation(25) for _ in range(passes)])


def _memory(groups: IntArray, lateral: float, axial: float = 0.0) -> FloatArray:
    """The tip stays at rest where the push before left it: h m · n, summed by hand."""
    value = np.zeros(len(groups))
    for row in range(1, len(groups)):
        n, m = NORMALS[groups[row]], NORMALS[groups[row - 1]]
        value[row] = lateral * (n[0] * m[0] + n[1] * m[1]) + axial * n[2] * m[2]
    return value


def test_the_touch_before_is_that_in_time() -> None:
    order = np.random.default_rng(0).permutation(75)
    before = predecessors(order)
    assert (before == -1).sum() == 1
    assert np.all(order[before[order > 0]] == order[order > 0] - 1)
    m = previous_directions(NORMALS[PASSES], predecessors(TIMES))
    columns = hysteresis_columns(NORMALS[PASSES], m)
    assert columns[:, :2] @ [0.3, 0.7] == pytest.approx(_memory(PASSES, 0.3, 0.7))


@pytest.mark.parametrize("in_a_row", [True, False])
def test_a_memory_is_estimated_with_its_covariance(in_a_row: bool) -> None:
    """(error)' C^-1 (error) / 2 of 300 sets is F(2, 45 or 48): mean 1.045, error 0.063."""
    truth = np.array([0.001, 0.0004])
    statistic, found = np.empty(300), 0
    for seed in range(len(statistic)):
        rng = np.random.default_rng(seed)
        groups = IN_A_ROW if in_a_row else _mixed_passes(rng)
        values = 0.003 * rng.standard_normal(25)[groups] + _memory(groups, *truth)
        values += 0.0003 * rng.standard_normal(75)
        fit = estimated_hysteresis(values, NORMALS[groups], groups, TIMES)
        error = fit.value - truth
        statistic[seed] = error @ np.linalg.solve(fit.covariance, error) / 2.0
        found += fit.p_value < 0.01
    assert statistic.mean() == pytest.approx(1.045, abs=4 * 0.063)
    assert found > 0.9 * 300


def test_no_memory_gives_no_alarm() -> None:
    """250 sets at 5 %: 12.5 ± 3.4, for both tests."""
    linear, between = 0, 0
    for seed in range(250):
        rng = np.random.default_rng(seed)
        order = rng.permutation(25)
        groups = np.concatenate([order, order, _mixed_passes(rng, 1), order])
        values = 0.003 * rng.standard_normal(25)[groups] + 0.0003 * rng.standard_normal(100)
        linear += estimated_hysteresis(values, NORMALS[groups], groups, range(100)).p_value <= 0.05
        between += between_predecessors(values, groups, range(100)).p_value <= 0.05
    assert 2 <= linear <= 24
    assert 2 <= between <= 24


def test_the_variance_between_predecessors_is_unbiased() -> None:
    """An effect of 0.5 µm drawn for each pair of directions, noise 0.3 µm."""
    found = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        first, second = rng.permutation(25), rng.permutation(25)
        groups = np.concatenate([first, first, second, second, first])
        effect = 0.0005 * rng.standard_normal((25, 25))
        values = effect[groups, np.append(groups[0], groups[:-1])]
        values = values + 0.003 * rng.standard_normal(25)[groups]
        seen = between_predecessors(
            values + 0.0003 * rng.standard_normal(125), groups, np.arange(125)
        )
        assert seen.warning == ""
        found.append((seen.variance, seen.u_variance, seen.p_value))
    variance, u, p = np.transpose(found)
    assert variance.mean() == pytest.approx(0.25e-6, abs=4 * variance.std() / np.sqrt(300))
    assert np.mean(u) == pytest.approx(variance.std(), rel=0.25)
    assert np.mean(p < 0.01) > 0.95


def test_one_gross_error_is_no_hysteresis() -> None:
    """An F test reports it in 30 % of such sets. 200 sets at 5 %: 10 ± 3.1."""
    linear, between = 0, 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        values = 0.0003 * rng.standard_normal(75)
        values[rng.integers(75)] += 0.035
        linear += estimated_hysteresis(values, NORMALS[IN_A_ROW], IN_A_ROW, TIMES).p_value <= 0.05
        between += between_predecessors(values, IN_A_ROW, TIMES).p_value <= 0.05
    assert linear <= 10 + 3.5 * 3.1
    assert between <= 10 + 3.5 * 3.1


def test_a_drift_is_not_taken_for_hysteresis() -> None:
    """150 sets at 5 %: 7.5 ± 2.7, with a drift of 3 µm over the run."""
    linear = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        groups = _mixed_passes(rng)
        values = NORMALS[groups] @ [0.002, -0.002, 0.001] * relative_times(TIMES)
        values += 0.0003 * rng.standard_normal(75)
        linear += estimated_hysteresis(values, NORMALS[groups], groups, TIMES).p_value <= 0.05
    assert linear <= 7.5 + 3.5 * 2.7


def test_passes_in_one_order_do_not_determine_a_memory() -> None:
    rng = np.random.default_rng(0)
    # Normals that were measured differ from touch to touch by rounding and scatter.
    normals = NORMALS[PASSES] + 1e-6 * rng.standard_normal((75, 3))
    fit = estimated_hysteresis(rng.standard_normal(75), normals, PASSES, TIMES)
    assert not fit.determined.any()
    assert np.all(fit.value == 0.0)


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        (IN_A_ROW, "all repeats were made in a row"),
        (PASSES, "after the same direction every time"),
        (np.arange(25), "no direction was touched twice, so"),
        (np.append(np.arange(25), np.arange(25)[::-1]), "is part of the repeatability"),
    ],
)
def test_what_an_order_does_not_show_is_said(groups: IntArray, words: str) -> None:
    values = np.random.default_rng(0).standard_normal(len(groups))
    seen = between_predecessors(values, groups, np.arange(len(groups)))
    assert words in seen.warning
    if groups is not IN_A_ROW:
        assert np.isnan(seen.variance)
        assert np.isnan(seen.p_value)
    else:
        # The first touch of a direction against the others.
        assert (seen.dof_between, seen.dof_within) == (25, 25)


def test_variance_between_predecessors_by_hand() -> None:
    """Four directions in twelve passes: sums of squares of predecessors within directions."""
    rng = np.random.default_rng(6)
    sequence = np.concatenate([rng.permutation(4) for _ in range(12)])
    values = rng.standard_normal(48) + 2.0 * np.roll(sequence, 1)
    order = np.arange(48)
    before = np.concatenate([[-1], sequence[:-1]])
    mean = np.array([values[sequence == g].mean() for g in range(4)])
    cells = sorted(set(zip(sequence.tolist(), before.tolist(), strict=True)))
    within, between, weight = 0.0, 0.0, 0.0
    for g, b in cells:
        own = values[(sequence == g) & (before == b)]
        within += float(np.sum((own - own.mean()) ** 2))
        between += len(own) * float((own.mean() - mean[g]) ** 2)
        weight += len(own) ** 2 / 12.0
    dof_between, dof_within = len(cells) - 4, 48 - len(cells)
    found = between_predecessors(values, sequence, order)
    assert (found.dof_between, found.dof_within) == (dof_between, dof_within)
    effective = (48.0 - weight) / dof_between
    mean_between, mean_within = between / dof_between, within / dof_within
    assert found.variance == pytest.approx((mean_between - mean_within) / effective, rel=1e-9)
    spread = 2.0 * (mean_between**2 / dof_between + mean_within**2 / dof_within)
    assert found.u_variance == pytest.approx(np.sqrt(spread) / effective, rel=1e-9)
    assert found.p_value < 0.01
    assert found.warning == ""
    # An order that says the same in other numbers, of touches in another row.
    shuffled = rng.permutation(48)
    again = between_predecessors(values[shuffled], sequence[shuffled], 10.0 * order[shuffled])
    assert again.variance == pytest.approx(found.variance, rel=1e-9)


def test_what_repeats_do_not_reduce_is_in_the_fixed_scatter() -> None:
    """Each touch is off by 3 um that depend on the touch before: passes in another order each.

    The form of the sphere, 2 um between extremes, adds 2 / sqrt(12) um. The estimate from 25
    directions with several predecessors each is right to a third.
    """
    rng = np.random.default_rng(9)
    sequence = np.concatenate([rng.permutation(25) for _ in range(6)])
    off = 3e-3 * rng.standard_normal((25, 26))
    before = np.concatenate([[25], sequence[:-1]])
    again = np.tile(np.arange(len(sequence)), 2)
    groups, error = sequence[again], off[sequence, before][again]
    positions = NORMALS[groups] * (15.5 + error + 1e-4 * rng.standard_normal(300))[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    found = machine_effects(seen, positions, 2e-3)
    expected = np.hypot(3e-3, 2e-3 / np.sqrt(12.0))
    assert found.fixed_scatter == pytest.approx(expected, rel=0.33)


@pytest.mark.parametrize("lateral", [-1e-9, 0.0, 1e-9])
def test_touches_at_right_angles_are_no_reversal(lateral: float) -> None:
    """Nor are they to the rounding of their normals; the lateral product stays as it is."""
    columns = hysteresis_columns([[1.0, 0.0, 0.0]], [[lateral, 1.0, 0.0]])
    assert columns.tolist() == [[lateral, 0.0, 0.0]]
    assert hysteresis_columns([[1.0, 0.0, 0.0]], [[-1e-3, 1.0, 0.0]])[0, 2] == 1.0
