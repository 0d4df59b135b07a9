"""Drift and hysteresis in the order of touches: estimates, probabilities, what is not shown."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.qualification.touch_order import (
    between_predecessors,
    drift_columns,
    drift_is_separable,
    estimated_drift,
    estimated_hysteresis,
    hysteresis_columns,
    relative_times,
    time_within_directions,
)

NORMALS = sphere_pattern_25()
TIMES = np.arange(75.0)
IN_A_ROW = np.repeat(np.arange(25), 3)
PASSES = np.tile(np.arange(25), 3)
MIXED = np.concatenate([np.random.default_rng(s).permutation(25) for s in range(3)])


def _with_constants(values: FloatArray, columns: FloatArray, groups: IntArray) -> FloatArray:
    """Coefficients of the columns by least squares, beside a constant for each direction."""
    design = np.column_stack([columns, groups[:, None] == np.unique(groups)])
    return np.asarray(np.linalg.lstsq(design, values)[0][: columns.shape[1]])


@pytest.mark.parametrize(("groups", "passes"), [(IN_A_ROW, False), (MIXED, True)])
def test_memory_and_drift_are_least_squares_with_constants(groups: IntArray, passes: bool) -> None:
    """Of the memory, with the drift beside it where the order separates one; the tip stays at rest
    where the push before left it."""
    values, n = np.random.default_rng(1).standard_normal(75), NORMALS[groups]
    products = n * np.vstack([np.zeros(3), n[:-1]])
    memory = np.column_stack([products[:, 0] + products[:, 1], products[:, 2]])
    drift = n * np.linspace(-0.5, 0.5, 75)[:, None]
    assert drift_is_separable(groups, TIMES) == passes
    expected = _with_constants(values, np.hstack([memory, drift] if passes else [memory]), groups)
    # In another row, and with times in another unit.
    row = np.random.default_rng(2).permutation(75)
    fit = estimated_hysteresis(values[row], n[row], groups[row], 7.0 * TIMES[row] + 3.0)
    assert fit.value == pytest.approx(expected[:2], rel=1e-8)
    found = estimated_drift(values[row], n[row], groups[row], 7.0 * TIMES[row] + 3.0)
    assert found.value == pytest.approx(_with_constants(values, drift, groups), rel=1e-8)
    assert (found.dof, fit.dof) == (47.0, 45.0 if passes else 48.0)


@pytest.mark.parametrize("lateral", [-1e-9, 0.0, 1e-9])
def test_touches_at_right_angles_are_no_reversal(lateral: float) -> None:
    """Nor are they to the rounding of their normals; the lateral product stays as it is."""
    columns = hysteresis_columns([[1.0, 0.0, 0.0]], [[lateral, 1.0, 0.0]])
    assert columns.tolist() == [[lateral, 0.0, 0.0]]
    assert hysteresis_columns([[1.0, 0.0, 0.0]], [[-1e-3, 1.0, 0.0]])[0, 2] == 1.0


def test_passes_in_one_order_do_not_determine_a_memory() -> None:
    rng = np.random.default_rng(0)
    # Normals that were measured differ from touch to touch by rounding and scatter.
    normals = NORMALS[PASSES] + 1e-6 * rng.standard_normal((75, 3))
    fit = estimated_hysteresis(rng.standard_normal(75), normals, PASSES, TIMES)
    assert not fit.determined.any()
    assert np.all(fit.value == 0.0)


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


def test_time_within_directions_is_an_analysis_of_variance() -> None:
    rng = np.random.default_rng(3)
    groups, times = rng.integers(0, 6, 30), np.cumsum(rng.uniform(0.1, 2.0, 30))
    within = sum(len(t) * np.var(t) for t in (times[groups == group] for group in range(6)))
    assert time_within_directions(groups, times) == pytest.approx(within / (30.0 * np.var(times)))
    assert time_within_directions([0, 0, 1], [4.0, 4.0, 4.0]) == 0.0
    share = (times - times[0]) / (times[-1] - times[0]) - 0.5
    assert relative_times(times[::-1]) == pytest.approx(share[::-1], abs=1e-12)
    n = fibonacci_cap(30)
    rows = np.array([t * row for t, row in zip(share, n, strict=True)])
    assert drift_columns(n, times) == pytest.approx(rows)


def test_a_drift_needs_six_repeats_and_a_fifth_of_the_time() -> None:
    for count, known in ((6, True), (5, False)):
        groups = np.concatenate([np.arange(8), np.arange(count)])
        assert drift_is_separable(groups, np.arange(8.0 + count)) == known
    # Six pairs, d apart in each, of directions that begin at 0, 1, 2, …: 6 d²/2 within.
    groups = np.repeat(np.arange(6), 2)
    for share, known in ((0.21, True), (0.19, False)):
        begun = np.repeat(np.arange(6.0), 2)
        between = 12.0 * np.var(np.arange(6.0))
        apart = math.sqrt(share * between / (1.0 - share) / 3.0)
        times = begun + np.tile([-0.5, 0.5], 6) * apart
        assert time_within_directions(groups, times) == pytest.approx(share)
        assert drift_is_separable(groups, times) == known


# Scatter between predecessors.


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


def test_the_probability_between_predecessors_is_that_of_all_exchanges() -> None:
    """4! · 4! · 3! = 3456 arrangements within directions, of the sum of squares between cells; a
    share of 999 scatters by sqrt(p (1 - p) / 999)."""
    groups = np.array([0, 1, 2, 0, 1, 0, 2, 1, 0, 1, 2])
    before = np.append(-1, groups[:-1])
    values = np.random.default_rng(3).standard_normal(11) + 0.8 * (before == 1)
    cells = [np.flatnonzero((groups == g) & (before == b)) for g in range(3) for b in range(-1, 3)]

    def between(one: FloatArray) -> float:
        return float(sum(one[own].sum() ** 2 / len(own) for own in cells if len(own)))

    centred = values - np.array([values[groups == g].mean() for g in range(3)])[groups]
    rows, sums = [np.flatnonzero(groups == g) for g in range(3)], []
    for orders in itertools.product(*[itertools.permutations(own) for own in rows]):
        exchanged = centred.copy()
        for own, order in zip(rows, orders, strict=True):
            exchanged[own] = centred[list(order)]
        sums.append(between(exchanged))
    p = float(np.mean(np.array(sums) >= sums[0] * (1.0 - 1e-9)))
    assert 0.02 < p < 0.9
    found = between_predecessors(values, groups, np.arange(11)).p_value
    assert found == pytest.approx(p, abs=4.0 * np.sqrt(p * (1.0 - p) / 999.0))


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


@pytest.mark.parametrize(("last", "known"), [([0, 2], False), ([0, 2, 3, 1, 2], True)])
def test_three_other_predecessors_tell_of_hysteresis(last: list[int], known: bool) -> None:
    """Passes in one order, and at the end a few touches after others: two and three contrasts."""
    groups = [*[0, 1, 2, 3] * (3 if not known else 2), *last]
    pairs = set(zip(groups, [-1, *groups[:-1]], strict=True))
    count = len(groups)
    values = np.random.default_rng(1).normal(size=count)
    found = between_predecessors(values, groups, np.arange(count))
    assert found.dof_between == len(pairs) - 4 == (3 if known else 2)
    assert found.dof_within == count - len(pairs)
    assert np.isfinite(found.variance) == known
    assert ("after the same direction every time" in found.warning) != known
