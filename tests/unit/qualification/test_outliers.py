"""Gross errors of a series: repeats that disagree, directions that the others do not predict."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import describe, fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind, fit_harmonic
from pretravel.maps.observation import Observation, Scatter
from pretravel.qualification.outliers import (
    Outlier,
    _confirmed,
    _left_out_distance,
    _most_suspect,
    direction_outliers,
    median_of_groups,
    repeat_outliers,
)
from pretravel.qualification.within_directions import centred_within, dof_of_tails, tail_kurtosis
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.gum import outlier_factor

# Touches far from those of their direction: limits by hand from both sides.


S = 3e-4  # mm
NORMALS = fibonacci_cap(25, 1.5)
TRIPLES = np.repeat(np.arange(25), 3)
EVEN = np.tile([-S, 0.0, S], 25)  # the variance S² in each direction


def _repeats(values: FloatArray, groups: IntArray, step: float = 0.0) -> list[Outlier]:
    normals = NORMALS[groups]
    positions = normals * (15.5 - 0.008 - values)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    return repeat_outliers(seen, Touches(positions, normals).where, step)


def _limit(count: int, dof: int, step: float = 0.0) -> float:
    """One of a hundred sets exceeds it by Bonferroni, times 1.2; the noise from the median of
    variances with `dof` degrees of freedom, and the variance of rounding."""
    noise = math.hypot(S / math.sqrt(stats.chi2.median(dof) / dof), step / math.sqrt(12.0))
    return 1.2 * float(stats.norm.ppf(1.0 - 0.005 / count)) * noise


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("step", [0.0, 5e-4, 1e-2])
def test_a_touch_of_three_beyond_the_limit_is_named(sign: float, step: float) -> None:
    limit = max(_limit(75, 2, step), 2.0 * step)
    for factor, number in ((0.999, 0), (1.001, 1)):
        values = EVEN.copy()
        values[31 if sign > 0.0 else 30] = 0.0
        row = 32 if sign > 0.0 else 31
        values[row] = sign * factor * limit
        values[30 if sign > 0.0 else 32] = -sign * S
        found = _repeats(values, TRIPLES, step)
        assert len(found) == number
    (outlier,) = found
    assert outlier.rows == (row,)
    assert outlier.distance == pytest.approx(1.001 * sign * limit, rel=1e-6)
    assert outlier.limit == pytest.approx(limit, rel=1e-6)
    assert outlier.left_out
    assert outlier.message == (
        f"touch {row + 1} at {describe(NORMALS[10])} triggered {1001.0 * limit:.1f} µm "
        f"{'later' if sign > 0.0 else 'earlier'} than the median of the 3 touches "
        f"of its direction; repeatability explains {1e3 * limit:.1f} µm"
    )


def test_both_of_a_pair_are_named() -> None:
    """The difference of two touches scatters by the root of two times more than one."""
    groups = np.repeat(np.arange(25), 2)
    limit = math.sqrt(2.0) * _limit(50, 1)
    for factor, number in ((0.999, 0), (1.001, 1)):
        values = np.tile([-S, S], 25) / math.sqrt(2.0)
        values[8:10] = [0.0, factor * limit]
        found = _repeats(values, groups)
        assert len(found) == number
    (outlier,) = found
    assert outlier.rows == (8, 9)
    assert abs(outlier.distance) == pytest.approx(1.001 * limit, rel=1e-6)
    assert outlier.limit == pytest.approx(limit, rel=1e-6)
    assert f"lie {1001.0 * limit:.1f} µm apart" in outlier.message
    assert f"repeatability explains {1e3 * limit:.1f} µm" in outlier.message


@pytest.mark.parametrize(("repeated", "number"), [(2, 0), (3, 1)])
def test_three_repeated_directions_tell_the_scatter(repeated: int, number: int) -> None:
    groups = np.concatenate([np.repeat(np.arange(repeated), 5), np.arange(repeated, 20)])
    values = np.where(np.arange(len(groups)) % 2, S, -S)
    values[2] = 1.0
    assert len(_repeats(values, groups)) == number


def test_equal_repeats_differ_by_rounding() -> None:
    assert _repeats(np.zeros(75), TRIPLES) == []


def test_several_touches_in_any_order_are_named() -> None:
    """The rows of the touches, whatever the order in which the directions were touched."""
    order = np.random.default_rng(2).permutation(75)
    values = EVEN.copy()
    values[[5, 6, 71]] += [0.1, -0.1, 0.2]
    wrong = {int(np.flatnonzero(order == row)[0]) for row in (5, 6, 71)}
    new = np.unique(TRIPLES[order], return_inverse=True)[1]
    found = _repeats(values[order], new)
    assert {outlier.rows[0] for outlier in found} == wrong
    assert all(len(outlier.rows) == 1 for outlier in found)


def test_the_limit_has_the_tails_of_student_where_repeats_have() -> None:
    assert outlier_factor(40) == pytest.approx(1.2 * stats.norm.ppf(1.0 - 0.005 / 40), rel=1e-9)
    assert outlier_factor(40, 6.0) == pytest.approx(1.2 * stats.t.ppf(1.0 - 0.005 / 40, 6.0))
    heavy = np.random.default_rng(6).standard_t(3, 75)
    heavy[40] = 1000.0  # a gross error shows nothing of the others' tails
    rest = np.arange(75) != 40
    tails = tail_kurtosis(heavy[rest], TRIPLES[rest])
    assert tails.p_value < 0.05
    assert dof_of_tails(heavy, TRIPLES, centred_within(heavy, TRIPLES)) == tails.student_dof < 30.0
    even = np.random.default_rng(1).standard_normal(75)
    assert tail_kurtosis(even, TRIPLES).p_value > 0.1
    even[40] = 1000.0
    assert dof_of_tails(even, TRIPLES, centred_within(even, TRIPLES)) == math.inf


def test_medians_are_those_of_each_group() -> None:
    rng = np.random.default_rng(0)
    groups = np.concatenate([np.arange(6), rng.integers(0, 6, 30)])
    values = rng.standard_normal(36)
    expected = [np.median(values[groups == g]) for g in range(6)]
    assert median_of_groups(values, groups) == pytest.approx(expected, rel=1e-12)


# Which direction is suspected.


NOISE = 3e-4  # mm


def _suspect(means: list[float], counts: list[int], leverage: list[float], fixed: float) -> Any:
    """The suspect of residuals that are equal within each direction, in units of the noise."""
    groups = np.repeat(np.arange(len(counts)), counts)
    fit: Any = SimpleNamespace(
        residuals=NOISE * np.array(means)[groups],
        smoothing=SimpleNamespace(leverage=np.array(leverage)),
        noise=NOISE,
        fixed_scatter=0.6 * fixed * NOISE,
    )
    observation: Any = SimpleNamespace(groups=groups)
    return _most_suspect(observation, fit, 0.8 * fixed * NOISE)


@pytest.mark.parametrize(
    ("means", "counts", "leverage", "fixed", "suspect"),
    [
        ([2.4, 2.3, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 0.0, None),  # 2.4 and 2.3
        ([2.6, 2.3, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 0.0, 0),  # 2.6 and 2.3
        ([2.6, 2.3, 0.0], [1, 1, 1], [0.0, 0.5, 0.0], 0.0, 1),  # 2.6 and 2.3 / √0.5 = 3.3
        ([2.6, 1.6, 0.0], [1, 4, 1], [0.0, 0.0, 0.0], 0.0, 1),  # 2.6 and 1.6 / √(1/4) = 3.2
        ([3.0, 0.0, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 1.0, None),  # 3.0 / √2 = 2.1
    ],
)
def test_the_suspect_has_the_largest_studentised_residual(
    means: list[float], counts: list[int], leverage: list[float], fixed: float, suspect: int | None
) -> None:
    """The mean residual of n touches with the leverage h has the variance (σ²/n + f²)(1 - h), f
    being what touches of a direction have in common; 2.5 standard deviations are suspect."""
    assert _suspect(means, counts, leverage, fixed) == suspect


def test_a_gross_error_is_suspect_beside_a_large_variation() -> None:
    """30 times the noise, where the scatter in common would explain it."""
    assert _suspect([0.0, 30.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0], 100.0) == 1
    assert _suspect([0.0, 15.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0], 100.0) is None


# Directions that the others predict.


UM = 1e-3
N = sphere_pattern_25()


class _Kind:
    """A kind of map that is given."""

    def __init__(self, fit: Any, centered: Any) -> None:
        self._fit, self._centered = fit, centered

    def fit(self, others: Observation, repeats: Scatter) -> Any:
        assert repeats.dof >= 0.0
        if self._fit is None:
            raise PretravelError("too few")
        assert len(others.groups)
        return self._fit

    def centered(self, fit: Any, axial: float | None) -> Any:
        assert fit is self._fit
        assert axial is None
        return self._centered


def _predicted() -> tuple[Any, Any, Observation, FloatArray]:
    """A fit about a centre of its own with a tip that it determined, and three touches."""
    rng = np.random.default_rng(6)
    basis = HarmonicBasis(np.array([[0, 0], [2, 0], [3, 3]]))
    root = rng.normal(0.0, UM, (3, 3))
    centered = SimpleNamespace(
        center=np.array([0.02, -0.01, 0.03]), coefficients=np.array([9.0, -2.0, 1.0]) * UM,
        covariance=Covariance.full(root @ root.T),
    )  # fmt: skip
    fit = SimpleNamespace(
        basis=basis, tip_radius=3.004, observation=SimpleNamespace(tip_radius=3.0),
        fixed_scatter=0.3 * UM, noise=0.5 * UM,
    )  # fmt: skip
    n = N[[8, 8, 8]] + 1e-4 * rng.normal(size=(3, 3))
    positions = n * np.array([15.47, 15.48, 15.472])[:, None]
    wrong = Observation(positions, np.zeros(3, dtype=int), np.zeros(3), 12.5, 3.0, ring=False)
    return fit, centered, wrong, positions


@pytest.mark.parametrize("tip", [3.004, None])
def test_the_distance_from_a_prediction_has_the_u_of_all_its_parts(tip: float | None) -> None:
    """About the centre of the others: map, scatter that repeats share, step, and noise over three
    touches. A tip that is larger by 4 µm makes the observed pretravel larger by that."""
    fit, centered, wrong, positions = _predicted()
    fit.tip_radius = tip
    found, u = _left_out_distance(
        _Kind(fit, centered),  # type: ignore[arg-type]
        fit, wrong, UM * math.hypot(0.7, 2.0 / math.sqrt(12.0)),
    )  # fmt: skip
    away = positions - centered.center
    distance = np.linalg.norm(away, axis=1)
    functions = fit.basis.design(away / distance[:, None])
    seen = 12.5 + (tip or 3.0) - distance - functions @ centered.coefficients
    assert found == pytest.approx(float(seen.mean()), rel=1e-9)
    variance = float(np.mean(np.diag(functions @ centered.covariance.matrix @ functions.T)))
    variance += UM**2 * (0.3**2 + 0.7**2 + 4.0 / 12.0 + 0.5**2 / 3.0)
    assert u == pytest.approx(math.sqrt(variance), rel=1e-9)


def _factor(directions: int) -> float:
    """One of a hundred sets by Bonferroni; 1.2 of an estimated scale, 1.4 of kinks."""
    return 1.4 * 1.2 * float(stats.norm.ppf(1.0 - 0.005 / directions))


def test_another_kind_confirms_by_its_own_limit() -> None:
    """Of the others and one direction more; a kind that cannot tell says nothing."""
    fit, centered, wrong, _ = _predicted()
    others = Observation(15.5 * N[:12], np.arange(12), np.zeros(3), 12.5, 3.0, ring=False)
    kind: Any = _Kind(fit, centered)
    distance, u = _left_out_distance(kind, fit, wrong, 0.0)
    found = _confirmed(kind, others, wrong, 0.0)
    assert found == pytest.approx(distance / (_factor(13) * u), rel=1e-9)
    silent: Any = _Kind(None, centered)
    assert _confirmed(silent, others, wrong, 0.0) is None
    fit.basis = SimpleNamespace(follows_probe=False)
    assert _confirmed(kind, others, wrong, 0.0) is None


def _seen(n: FloatArray, repeats: int = 3, seed: int = 1) -> tuple[Touches, Observation]:
    """A probe with one radius about the centre zero, noise of 0.3 µm."""
    normals = np.repeat(n, repeats, axis=0)
    rng = np.random.default_rng(seed)
    positions = normals * (15.49 + 0.3 * UM * rng.standard_normal(len(normals)))[:, None]
    groups = np.repeat(np.arange(len(n)), repeats)
    return Touches(positions, normals), Observation(
        positions, groups, np.zeros(3), 12.5, 3.0, ring=False
    )


def _off(pair: tuple[Touches, Observation], rows: Any, size: float) -> tuple[Touches, Observation]:
    touches, seen = pair
    positions = touches.positions.copy()
    positions[rows] -= size * touches.normals[rows]
    return replace(touches, positions=positions), replace(seen, positions=positions)


def _found(
    pair: tuple[Touches, Observation], named: list[int] | None = None, confirm: Any = None,
    fixed: float = 0.0,
) -> tuple[list[Outlier], Any]:  # fmt: skip
    return direction_outliers(pair[1], pair[0].where, named or [], confirm, fixed_scatter=fixed)


@pytest.mark.parametrize(("repeats", "sign"), [(1, -1.0), (3, 1.0)])
def test_a_direction_is_named_beyond_its_limit(repeats: int, sign: float) -> None:
    """The others do not depend on it: its distance grows as it moves, its limit does not. It is
    the prediction's u with the factors of noise and kinks."""
    pair = _seen(N, repeats)
    wrong = slice(10 * repeats, 11 * repeats)
    ((one,), detail) = _found(_off(pair, wrong, sign * 0.03))
    assert one.rows == tuple(range(10 * repeats, 11 * repeats))
    others = np.ones(25 * repeats, dtype=bool)
    others[wrong] = False
    alone = fit_harmonic(pair[1].take(others))
    moved = _off(pair, wrong, sign * 0.03)[1].take(~others)
    distance, u = _left_out_distance(HarmonicKind(), alone, moved, 0.0)
    assert one.distance == pytest.approx(distance, abs=0.05 * UM)
    assert one.limit == pytest.approx(_factor(25) * u, rel=0.02)
    assert len(detail.observation.values) == 24 * repeats
    first = 10 * repeats + 1
    names = f"touch {first}" + (f" to touch {first + 2} at" if repeats == 3 else " at")
    assert one.message == (
        f"{names} {describe(N[10])} triggered {abs(one.distance) / UM:.1f} µm "
        f"{'later' if one.distance > 0.0 else 'earlier'} than the other directions "
        f"predict; noise and kinks explain {one.limit / UM:.1f} µm"
    )
    for factor, number in ((0.97, 0), (1.03, 1)):
        size = sign * 0.03 + sign * factor * one.limit - one.distance
        found, detail = _found(_off(pair, wrong, size))
        assert len(found) == number
        assert len(detail.observation.values) == (25 - number) * repeats
    # Scatter of the machine that is larger than the distance explains it.
    assert _found(_off(pair, wrong, 0.006), fixed=0.01)[0] == []


@pytest.mark.long
def test_three_directions_at_most_are_named_and_named_touches_do_not_count() -> None:
    pair = _seen(fibonacci_cap(60, 1.5))
    for row, size in ((12, -0.3), (24, 0.06), (36, -0.02), (48, 0.008)):
        pair = _off(pair, slice(3 * row, 3 * row + 3), size)
    found, detail = _found(pair)
    assert {one.rows[0] for one in found} == {36, 72, 108}
    assert len(detail.observation.values) == 180 - 9
    # Those of one direction are named already: the numbers of the others move by one.
    found, detail = _found(pair, named=[36, 37, 38])
    assert {one.rows[0] for one in found} == {72, 108, 144}
    assert len(detail.observation.values) == 180 - 12


@pytest.mark.parametrize(("directions", "named"), [(9, 1), (8, 0)])
def test_eight_other_directions_are_needed(directions: int, named: int) -> None:
    """The pole amid seven or eight directions around it."""
    azimuth = np.arange(directions - 1) * (2.0 * np.pi / (directions - 1))
    polar = np.where(np.arange(directions - 1) % 2, 1.5, 0.6)
    n = np.column_stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    pair = _off(_seen(np.vstack([[[0.0, 0.0, 1.0]], n]), 5), slice(0, 5), 0.4)
    found, detail = _found(pair)
    assert len(found) == named
    assert len(detail.observation.values) == 5 * (directions - named)


def test_a_direction_outside_the_others_is_not_predicted() -> None:
    """A cap of 40° and one direction at 100°."""
    n = np.vstack([fibonacci_cap(30, 0.7), [[math.sin(1.745), 0.0, math.cos(1.745)]]])
    found, detail = _found(_off(_seen(n), slice(90, 93), 0.3))
    assert found == []
    assert len(detail.observation.values) == 93


@pytest.mark.parametrize("rests", [True, False])
def test_a_kind_that_explains_a_direction_keeps_it(rests: bool) -> None:
    """A second kind of map, with a harmonic fit of its own: one that has seen the wrong touches
    explains them, one of the others does not."""
    pair = _seen(N)
    wrong = np.zeros(75, dtype=bool)
    wrong[30:33] = True
    bad = _off(pair, slice(30, 33), 0.012)
    fit = fit_harmonic(pair[1])
    if rests:
        fit = replace(fit, coefficients=fit.coefficients, noise=0.01)
    kind: Any = _Kind(fit, HarmonicKind().centered(fit, None))
    kind.fits_harmonics = False
    found, detail = _found(bad, confirm=kind)
    assert len(found) == (0 if rests else 1)
    assert len(detail.observation.values) == (75 if rests else 72)
    kind.fits_harmonics = True  # which is no other kind
    assert len(_found(bad, confirm=kind)[0]) == 1
