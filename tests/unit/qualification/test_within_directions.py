"""Effects from differences within directions: least squares with a constant for each direction."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pretravel.qualification.within_directions import (
    centred_within,
    exchange_probability,
    exchanged_within,
    fit_within_directions,
    tested_touches,
)

GROUPS = np.array([4, 4, 4, 0, 0, 0, 0, 7, 7, 9])  # the last one is touched once
RNG = np.random.default_rng(3)
COLUMNS = RNG.standard_normal((10, 2)) * [1.0, 5.0]
BESIDE = RNG.standard_normal((10, 1))
VALUES = RNG.standard_normal(10) + 2.0 * COLUMNS[:, 0]


@pytest.mark.parametrize("beside", [False, True])
def test_coefficients_are_those_of_least_squares_with_constants(beside: bool) -> None:
    constants = (GROUPS[:, None] == np.unique(GROUPS)).astype(float)
    design = np.hstack([COLUMNS, BESIDE, constants] if beside else [COLUMNS, constants])
    coefficients, rest, rank, _ = np.linalg.lstsq(design, VALUES, rcond=None)
    dof = 10 - rank
    fit = fit_within_directions(VALUES, COLUMNS, GROUPS, BESIDE if beside else None)
    assert fit.value == pytest.approx(coefficients[:2], rel=1e-9)
    assert fit.dof == dof == (3 if beside else 4)
    assert fit.noise == pytest.approx(np.sqrt(float(rest[0]) / dof), rel=1e-9)
    covariance = float(rest[0]) / dof * np.linalg.inv(design.T @ design)
    assert fit.covariance == pytest.approx(covariance[:2, :2], rel=1e-9)
    assert fit.determined.tolist() == [True, True]


def test_a_column_that_is_constant_within_directions_is_not_determined() -> None:
    same = np.array([1.0, 5.0, -2.0, 0.5])[np.unique(GROUPS, return_inverse=True)[1]]
    alone = fit_within_directions(VALUES, COLUMNS[:, :1], GROUPS)
    fit = fit_within_directions(VALUES, np.column_stack([same, COLUMNS[:, 0]]), GROUPS)
    assert fit.determined.tolist() == [False, True]
    assert fit.value == pytest.approx([0.0, alone.value[0]], rel=1e-9)
    assert fit.covariance == pytest.approx(np.diag([0.0, alone.covariance[0, 0]]), rel=1e-9)
    assert (fit.dof, fit.p_value) == (alone.dof, alone.p_value)
    nothing = fit_within_directions(VALUES, same[:, None], GROUPS)
    assert nothing.determined.tolist() == [False]
    assert np.isnan(nothing.p_value)
    assert nothing.dof == 6
    square = centred_within(VALUES, GROUPS)
    assert nothing.noise == pytest.approx(np.sqrt(square @ square / 6.0), rel=1e-12)


def test_without_degrees_of_freedom_nothing_is_tested() -> None:
    fit = fit_within_directions([1.0, 2.0], [[0.0], [1.0]], [0, 0])
    assert fit.value == pytest.approx([1.0])
    assert fit.dof == 0.0
    assert np.isnan([fit.p_value, fit.noise, fit.covariance[0, 0]]).all()


def test_the_probability_is_that_of_all_exchanges() -> None:
    """3! · 4! · 2! = 288 arrangements; a share of 999 scatters by sqrt(p (1 - p) / 999)."""
    weak = 1e-3 * (VALUES - 1.6 * COLUMNS[:, 0])
    fit = fit_within_directions(weak, COLUMNS, GROUPS)
    base = np.linalg.qr(centred_within(COLUMNS, GROUPS))[0]
    reading, rows = centred_within(weak, GROUPS), [np.flatnonzero(g == GROUPS) for g in (4, 0, 7)]
    explained = []
    for orders in itertools.product(*[itertools.permutations(own) for own in rows]):
        exchanged = reading.copy()
        for own, order in zip(rows, orders, strict=True):
            exchanged[own] = reading[list(order)]
        explained.append(np.sum((base.T @ exchanged) ** 2))
    p = float(np.mean(np.array(explained) >= explained[0] * (1.0 - 1e-9)))
    assert 0.02 < p < 0.9
    assert fit.p_value == pytest.approx(p, abs=4.0 * np.sqrt(p * (1.0 - p) / 999.0))


def test_each_arrangement_within_directions_is_as_probable() -> None:
    """A triple has six; of 999 sets each is in 166.5 ± 11.8. Other directions keep theirs."""
    sets = exchanged_within([1.0, 10.0, 2.0, 3.0], [5, 0, 5, 5])
    assert sets.shape == (999, 4)
    assert np.all(sets[:, 1] == 10.0)
    arrangements, number = np.unique(sets[:, [0, 2, 3]], axis=0, return_counts=True)
    assert len(arrangements) == 6
    assert np.abs(number - 166.5).max() < 4.0 * 11.8
    # Two million numbers in all, at least 199 sets.
    assert len(exchanged_within(np.zeros(4000), np.arange(4000) // 2)) == 500
    assert len(exchanged_within(np.zeros(11_000), np.arange(11_000) // 2)) == 199


def test_a_set_as_large_as_that_seen_counts() -> None:
    assert exchange_probability(2.0, np.array([2.0, 2.0 - 1e-10, 1.9, 0.0])) == pytest.approx(0.6)
    assert exchange_probability(9.0, np.zeros(999)) == pytest.approx(1e-3)
    assert exchange_probability(0.0, np.zeros(9)) == 1.0


def test_a_test_takes_about_ten_thousand_touches() -> None:
    """Few directions with many touches: a part of each. Many directions: whole ones."""
    assert tested_touches(np.zeros(10_000, dtype=int)).all()
    one_more = tested_touches(np.zeros(10_001, dtype=int))
    assert 9_990 <= one_more.sum() <= 10_001
    few = np.arange(200_000) % 20
    share = np.bincount(few[tested_touches(few)], minlength=20)
    assert np.abs(share - 500.0).max() < 4.5 * np.sqrt(500.0)
    # Of 2500 directions with 80 touches, eight of each are 20 000: too many, so 11 000 / 8 of them.
    many = np.arange(200_000) // 80
    tested = tested_touches(many)
    assert 10_900 <= tested.sum() <= 11_000
    number = np.bincount(many[tested], minlength=2500)
    assert number[number > 0].mean() == pytest.approx(8.0, abs=0.35)
    assert np.count_nonzero(number) == pytest.approx(11_000 / 8, rel=0.05)
    whole = np.bincount((np.arange(50_000) // 4)[tested_touches(np.arange(50_000) // 4)])
    assert set(whole.tolist()) == {0, 4}
    assert whole.sum() == 11_000
    # Also where the last direction, with one touch, is not drawn.
    drawn = set()
    for last in range(1, 9):
        groups = np.append(np.zeros(20_000, dtype=int), np.arange(1, last + 1))
        tested = tested_touches(groups)
        assert tested.sum() == pytest.approx(10_000, abs=4.5 * np.sqrt(5000.0))
        drawn.add(bool(tested[-1]))
    assert drawn == {False, True}


def test_a_constant_and_a_unit_of_a_column_change_nothing() -> None:
    """Within directions a constant is zero, and a coefficient goes with one over the unit."""
    fit = fit_within_directions(VALUES, COLUMNS, GROUPS, BESIDE)
    other = fit_within_directions(VALUES, COLUMNS * [1.0, 1e4] + [2e4, 0.0], GROUPS, BESIDE)
    assert other.determined.all()
    assert other.value * [1.0, 1e4] == pytest.approx(fit.value, rel=1e-6)
    assert other.p_value == fit.p_value


@pytest.mark.parametrize(("share", "determined"), [(0.9e-6, False), (1.1e-6, True)])
@pytest.mark.parametrize("size", [1.0, 100.0])
def test_a_millionth_of_a_variation_is_determined(
    share: float, determined: bool, size: float
) -> None:
    """Of the sum of squares about the mean, the part within directions; that of a column as small
    as a thirtieth counts as a thousandth."""
    same = size * np.array([1.0, -3.0, 2.0, 0.5])[np.unique(GROUPS, return_inverse=True)[1]]
    inner = centred_within(COLUMNS[:, 0], GROUPS)
    whole = float(np.sum((same - same.mean()) ** 2))
    column = 7.0 + same + inner * np.sqrt(share * whole / float(inner @ inner))
    assert fit_within_directions(VALUES, column[:, None], GROUPS).determined[0] == determined
    tiny = inner * np.sqrt(share * 1e-3 / float(inner @ inner))
    assert fit_within_directions(VALUES, tiny[:, None], GROUPS).determined[0] == determined


def test_two_combinations_that_are_not_determined_leave_the_others() -> None:
    """Two pairs of columns that say the same; the fifth is determined as if alone with one of
    each."""
    rng = np.random.default_rng(9)
    one, two, own = rng.standard_normal((3, 10))
    columns = np.column_stack([one, own, 3.0 * one, two, -two])
    fit = fit_within_directions(VALUES, columns, GROUPS)
    assert fit.determined.tolist() == [False, True, False, False, False]
    few = fit_within_directions(VALUES, np.column_stack([one, two, own]), GROUPS)
    assert fit.value[1] == pytest.approx(few.value[2], rel=1e-9)
    assert fit.covariance[1, 1] == pytest.approx(few.covariance[2, 2], rel=1e-9)
    assert np.count_nonzero(fit.covariance) == 1
    assert fit.dof == few.dof == 3
    assert fit.noise == pytest.approx(few.noise, rel=1e-9)
    # An effect beside that says the same leaves nothing to determine.
    hidden = fit_within_directions(VALUES, columns[:, :1], GROUPS, -3.0 * columns[:, :1])
    assert hidden.determined.tolist() == [False]
    assert np.isnan(hidden.p_value)


def test_effects_beside_that_say_the_same_count_once() -> None:
    same = np.array([1.0, 5.0, -2.0, 0.5])[np.unique(GROUPS, return_inverse=True)[1]]
    beside = np.column_stack([BESIDE, -2.0 * BESIDE, same])
    fit = fit_within_directions(VALUES, COLUMNS, GROUPS, beside)
    alone = fit_within_directions(VALUES, COLUMNS, GROUPS, BESIDE)
    assert fit.value == pytest.approx(alone.value, rel=1e-9)
    assert fit.dof == alone.dof == 3
    assert fit.noise == pytest.approx(alone.noise, rel=1e-9)


def test_a_perfect_fit_has_no_noise() -> None:
    for seed in range(20):
        columns = np.random.default_rng(seed).standard_normal((10, 2))
        values = columns @ [0.3, -0.7] + np.sqrt(GROUPS)
        fit = fit_within_directions(values, columns, GROUPS)
        assert fit.value == pytest.approx([0.3, -0.7], rel=1e-9)
        assert fit.noise == pytest.approx(0.0, abs=1e-7)


def test_an_effect_of_many_touches_is_tested_with_a_part_of_them() -> None:
    """An effect beyond all sets is one of as many as the tested touches allow, 199 at least."""
    groups = np.random.default_rng(4).permutation(np.arange(12_000) // 3)
    time = np.linspace(-1.0, 1.0, 12_000)
    number = int(tested_touches(groups).sum())
    assert number < 12_000
    fit = fit_within_directions(5.0 * time + np.cos(groups), time[:, None], groups)
    assert fit.value == pytest.approx([5.0], rel=1e-9)
    assert fit.p_value == pytest.approx(1.0 / (max(2_000_000 // number, 199) + 1.0), rel=1e-9)
