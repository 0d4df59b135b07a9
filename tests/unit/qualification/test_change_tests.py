"""Tests of change against generalised least squares, Fisher's F and maps whose laws are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, optimize, stats

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification import change_tests
from pretravel.qualification.change_tests import (
    Change,
    TouchesAndMap,
    _covariance_of_map,
    _scatter_ratio,
    _spread_of_statistic,
    changes_of,
    covariance_if_turned,
    separable_columns,
    touches_and_map,
    turned_value,
    without_center,
)
from pretravel.qualification.touch_noise import TouchNoise
from pretravel.uncertainty.covariance import Covariance
from tests.support.lobed_map import COEFFICIENTS, TERMS, UM, N, lobed_map

ROTATION = probe_rotation(np.array([0.36, 0.48, 0.8]), 0.3)
ROOT = 0.05 * UM * np.random.default_rng(4).standard_normal((4, 4))


def made_map(**changes: object) -> PretravelMap:
    """On a tilted probe, with errors that are correlated."""
    tilted = lobed_map(covariance=Covariance.full(ROOT @ ROOT.T), rotation=ROTATION)
    return replace(tilted, **changes)  # type: ignore[arg-type]


def design_of(n: np.ndarray) -> np.ndarray:
    return HarmonicBasis(TERMS).design(n)


def turned(n: np.ndarray, angle: float) -> np.ndarray:
    """Directions as a probe sees them that is turned about its axis by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    return n @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]).T


def observed(
    n: np.ndarray, repeats: int, deviation: float, change: float = 0.0, *, ring: bool = False
) -> Observation:
    """Repeats about the centre, whose scatter in each direction is the same to the last digit."""
    each = np.linspace(-1.0, 1.0, repeats) if repeats > 1 else np.zeros(1)
    each *= deviation / (np.std(each, ddof=1) if repeats > 1 else 1.0)
    pretravel = np.repeat(design_of(n) @ COEFFICIENTS, repeats) + np.tile(each, len(n)) + change
    groups = np.repeat(np.arange(len(n)), repeats)
    if ring:
        return Observation(
            -n[groups] * (12.5 - 3.0 + pretravel)[:, None], groups, np.zeros(3), 12.5, 3.0, True
        )
    return Observation(
        n[groups] * (15.5 - pretravel)[:, None], groups, np.zeros(3), 12.5, 3.0, False
    )


def test_touches_beside_a_map_of_a_tilted_probe() -> None:
    """Equal scatter of three repeats in each direction, 0.36 µm against 0.3 µm of the map with 50
    degrees of freedom each: one scatter, by Fisher's F. Every array in closed form."""
    made = made_map(fixed_scatter=0.1 * UM)
    seen = observed(N, 3, 0.36 * UM, 0.5 * UM)
    found = touches_and_map(seen, made, 0.0)
    value = design_of(N) @ COEFFICIENTS
    assert found.observation is seen
    assert found.step == 0.0
    assert found.value == pytest.approx(value, rel=1e-12)
    assert found.differences == pytest.approx(np.full(25, 0.5 * UM), rel=1e-9)
    assert found.center == pytest.approx(N)
    # The slope is that between the map as it is and turned by 0.5°: that in the middle.
    ahead, behind = (design_of(turned(N, a)) @ COEFFICIENTS for a in (0.26 * DEGREE, 0.24 * DEGREE))
    expected = np.column_stack(
        [N, np.ones(25), value - value.mean(), (ahead - behind) / (0.02 * DEGREE)]
    )
    # 9/6 of the square of 0.25°: a turn by 120° is the same.
    assert found.design == pytest.approx(expected, abs=1e-4 * np.abs(expected[:, 5]).max())
    for angle in (0.2, -0.3):
        assert turned_value(seen, made, angle) == pytest.approx(
            design_of(turned(N, angle)) @ COEFFICIENTS, rel=1e-9
        )
    assert found.scatter_of_touches.deviation == pytest.approx(0.36 * UM, rel=1e-9)
    dof = found.scatter_of_touches.dof
    both = found.noise.scatter
    assert both.dof == pytest.approx(dof + 50.0)
    variance = (dof * 0.36**2 + 50.0 * 0.3**2) / (dof + 50.0) * UM**2
    assert both.deviation**2 == pytest.approx(variance, rel=1e-9)
    assert found.scatter_of_map == Scatter(0.3 * UM, 50.0)
    ratio = (0.36 / 0.3) ** 2
    assert found.scatter_ratio == pytest.approx(math.log(ratio), rel=1e-9)
    assert found.u_scatter_ratio == pytest.approx(math.sqrt(4.0 / dof), rel=1e-9)
    # The map's degrees of freedom are as many fewer where the tails of touches are heavy; nine of
    # ten false alarms say that scatter is larger.
    larger = stats.f(dof, dof).sf(ratio) / 0.9
    assert found.p_repeatability == pytest.approx(larger, rel=1e-6)
    of_means = variance / 3.0 + (0.1 * UM) ** 2
    of_map = design_of(N) @ ROOT @ ROOT.T @ design_of(N).T
    assert found.of_map == pytest.approx(of_map, rel=1e-9, abs=1e-18)
    assert found.covariance == pytest.approx(of_map + of_means * np.eye(25), rel=1e-9, abs=1e-18)
    change = covariance_if_turned(found, made, 0.2) - found.covariance
    there = design_of(turned(N, 0.2))
    expected = there @ ROOT @ ROOT.T @ there.T - design_of(N) @ ROOT @ ROOT.T @ design_of(N).T
    assert change == pytest.approx(expected, rel=1e-6, abs=1e-15)
    assert found.weights == pytest.approx(without_center(found.covariance, N), rel=1e-9)


@pytest.mark.parametrize(("p", "pooled"), [(0.055, True), (0.045, False)])
@pytest.mark.parametrize("larger", [True, False])
def test_a_scatter_that_is_by_chance_in_one_of_twenty_is_one(
    p: float, pooled: bool, larger: bool
) -> None:
    """Else the scatter of the touches counts alone."""

    def compared_with(scatter: float) -> TouchesAndMap:
        return touches_and_map(observed(N, 3, scatter * UM), made_map(), 0.0)

    scatter = optimize.brentq(
        lambda x: compared_with(x).p_repeatability - p, *((0.31, 0.6) if larger else (0.1, 0.26))
    )
    found = compared_with(scatter)
    assert (found.noise.scatter.dof > found.scatter_of_touches.dof) == pooled


def test_a_turned_map_is_also_looked_up_beside_its_touches() -> None:
    """Touches on one half: turned by a radian some are on the other, which it does not know."""
    half = N[N[:, 1] >= 0.0]
    made = made_map(support=DirectionSupport(half))
    seen = observed(half, 2, 0.3 * UM)
    assert turned_value(seen, made, 1.0) == pytest.approx(
        design_of(turned(half, 1.0)) @ COEFFICIENTS, rel=1e-9
    )
    with pytest.raises(ExtrapolationError):
        touches_and_map(observed(turned(half, 1.0), 2, 0.3 * UM), made, 0.0)


def test_the_scatter_of_touches_without_repeats_is_the_map_s() -> None:
    """And a repeatability below the last digit of a reading, 0.02 µm, is that digit."""
    found = touches_and_map(observed(N, 1, 0.0), made_map(repeatability=1e-6), 0.0)
    assert found.scatter_of_map == Scatter(2e-5, 50.0)
    assert found.noise.variances == pytest.approx(np.full(25, 4e-10), rel=1e-12)
    assert found.scatter_of_touches == Scatter(0.0, 0.0)
    assert np.isnan([found.scatter_ratio, found.u_scatter_ratio, found.p_repeatability]).all()
    assert np.isnan(changes_of(found, 0.01).p_repeatability)


def test_directions_are_neither_too_few_nor_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """The centre and one more than a change needs; on a ring the centre takes two."""
    monkeypatch.setattr(change_tests, "MOST_VERIFIED", 9)
    azimuth = np.linspace(0.0, 2.0 * math.pi, 4, endpoint=False)
    around = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(4)])
    for count in (5, 9):
        touches_and_map(observed(N[-count:], 1, 0.0), made_map(), 0.0)
    touches_and_map(observed(around, 1, 0.0, ring=True), made_map(), 0.0)
    with pytest.raises(PretravelError, match="4 directions: the centre takes 3, and at least 5"):
        touches_and_map(observed(N[:4], 1, 0.0), made_map(), 0.0)
    with pytest.raises(PretravelError, match="3 directions: the centre takes 2, and at least 4"):
        touches_and_map(observed(around[:3], 1, 0.0, ring=True), made_map(), 0.0)
    with pytest.raises(PretravelError, match=r"10 directions: .* of 9 directions at most"):
        touches_and_map(observed(N[:10], 1, 0.0), made_map(), 0.0)
    with pytest.raises(ExtrapolationError):
        touches_and_map(observed(np.vstack([N[:6], [[0.6, 0.0, -0.8]]]), 1, 0.0), made_map(), 0.0)


@pytest.mark.parametrize("fixed", [0.0, 0.2])
def test_a_step_that_repeats_do_not_reduce_is_in_the_map_that_follows_it(fixed: float) -> None:
    """A map by least squares has the covariance of its mean touches times the hat matrix. Where
    three repeats are rounded alike, in steps of 1 µm, q²/12 adds to the variance of the means, as
    far as the map did not know it yet: to both in proportion."""
    design = design_of(N)
    hat = design @ np.linalg.pinv(design)
    sigma = 1e-4 * UM
    of_map = Scatter(sigma, 50.0)
    by_touches = np.linalg.inv(design.T @ design) * sigma**2 / 3.0
    made = made_map(
        covariance=Covariance.full(by_touches), repeatability=sigma, fixed_scatter=fixed * UM
    )
    same = np.full(25, sigma**2)
    noise = TouchNoise(of_map, sigma, same, same, 0.0 * same, np.full(25, 3.0), 0.0)
    found = _covariance_of_map(made, N @ ROTATION.T, noise, of_map, 1.0 * UM)
    more = max(UM**2 / 12.0 - (fixed * UM) ** 2, 0.0)
    assert found == pytest.approx((sigma**2 / 3.0 + more) * hat, rel=1e-5, abs=1e-5 * UM**2)
    # Given without touches of its own, the map's variance is not reduced by repeats.
    given = Scatter(sigma, math.inf)
    alone = replace(made, covariance=Covariance.full(3.0 * by_touches), fixed_scatter=0.0)
    found = _covariance_of_map(alone, N @ ROTATION.T, noise, given, 1.0 * UM)
    assert found == pytest.approx((sigma**2 + UM**2 / 12.0) * hat, rel=1e-5, abs=1e-5 * UM**2)
    # A map known better than its touches follows a part of the step; none without a step.
    better = replace(alone, covariance=Covariance.full(by_touches))
    found = _covariance_of_map(better, N @ ROTATION.T, noise, given, 1.0 * UM)
    assert found == pytest.approx((sigma**2 + UM**2 / 12.0) / 3.0 * hat, rel=1e-5, abs=1e-5 * UM**2)
    # One known worse does not follow more than all of it.
    worse = replace(alone, covariance=Covariance.full(6.0 * by_touches))
    found = _covariance_of_map(worse, N @ ROTATION.T, noise, given, 1.0 * UM)
    whole = 2.0 * sigma**2 + UM**2 / 12.0
    assert found == pytest.approx(whole * hat, rel=1e-5, abs=1e-5 * UM**2)
    found = _covariance_of_map(better, N @ ROTATION.T, noise, given, 0.0)
    assert found == pytest.approx(sigma**2 / 3.0 * hat, rel=1e-9, abs=1e-20)


def test_a_larger_noise_of_some_directions_was_the_map_s_too() -> None:
    """Where touches scatter twice as much as on average, the map's u is larger by the root of it;
    where they scatter less, it is as stated."""
    variances = np.where(np.arange(25) < 5, 3.0, 0.5) * (0.3 * UM) ** 2
    noise = TouchNoise(
        Scatter(0.3 * UM, 50.0), 0.3 * UM, variances, variances, 0.0 * variances, np.full(25, 3.0),
        0.0,
    )  # fmt: skip
    found = _covariance_of_map(made_map(), N @ ROTATION.T, noise, noise.scatter, 0.0)
    u = np.sqrt(np.diag(design_of(N) @ ROOT @ ROOT.T @ design_of(N).T))
    assert np.sqrt(np.diag(found)) == pytest.approx(
        u * np.where(np.arange(25) < 5, math.sqrt(3.0), 1.0)
    )
    correlation = found / np.sqrt(np.outer(np.diag(found), np.diag(found)))
    stated = design_of(N) @ ROOT @ ROOT.T @ design_of(N).T
    assert correlation == pytest.approx(stated / np.outer(u, u), rel=1e-9)


@pytest.mark.parametrize("step", [0.0, 1.0])
@pytest.mark.parametrize("sizes", [(0.5, 0.4), (0.5, 0.6), (0.15, 0.15), (0.3, 0.3), (1e-3, 1e-3)])
def test_the_scatter_is_tested_by_fisher_s_f(sizes: tuple[float, float], step: float) -> None:
    """Ten directions of three: 20 degrees of freedom, of which heavy tails leave 12, and 24 of the
    map's 40 in the same proportion. One touch across a step, q²/3 over the directions, counts on
    both sides; scatters below 0.02 µm are those of the last digit."""
    new, trimmed = (max(size, 0.02) for size in sizes)
    same = np.full(10, (sizes[0] * UM) ** 2)
    noise = TouchNoise(
        Scatter(sizes[0] * UM, 12.0), sizes[1] * UM, same, same, 0.0 * same, np.full(10, 3.0), 0.0
    )
    found = _scatter_ratio(noise, Scatter(0.3 * UM, 40.0), step * UM)
    crossing = step**2 / 30.0
    old = 0.09 + crossing
    law = stats.f(12.0, 24.0)
    larger = law.sf((min(new, trimmed) ** 2 + crossing) / old) / 0.9
    smaller = law.cdf((new**2 + crossing) / old) / 0.1
    assert found[2] == pytest.approx(min(larger, smaller, 1.0), rel=1e-9)
    assert found[0] == pytest.approx(math.log((new**2 + crossing) / old), rel=1e-9, abs=1e-12)
    assert found[1] == pytest.approx(math.sqrt(2.0 / 12.0 + 2.0 / 24.0), rel=1e-12)


def compared(*, spread: float = 0.0, scale: float = 1.0, seed: int = 1) -> TouchesAndMap:
    """17 directions with noise that differs, beside a map with errors of its own."""
    rng = np.random.default_rng(seed)
    n = fibonacci_cap(17, 1.5)
    variances = (0.3 * UM) ** 2 * rng.uniform(0.5, 2.0, 17)
    raw = variances * rng.uniform(0.3, 2.5, 17)
    root = 0.1 * UM * rng.standard_normal((17, 17))
    counts = np.where(np.arange(17) % 2, 2.0, 3.0)
    noise = TouchNoise(
        Scatter(0.3 * UM, 14.0), 0.3 * UM, variances, raw, np.full(17, spread), counts,
        (0.1 * UM) ** 2,
    )  # fmt: skip
    design = np.column_stack([n, np.ones(17), 3.0 * UM * rng.standard_normal((17, 2))])
    of_map = root @ root.T
    return TouchesAndMap(
        observation=Observation(15.5 * n, np.arange(17), np.zeros(3), 12.5, 3.0, ring=False),
        noise=noise, scatter_of_touches=noise.scatter, step=0.0, value=np.zeros(17),
        differences=scale * UM * rng.standard_normal(17) + n @ [3e-3, -2e-3, 1e-3], design=design,
        of_map=of_map, covariance=of_map + np.diag(noise.of_means),
        scatter_of_map=Scatter(0.3 * UM, 40.0), scatter_ratio=0.1, u_scatter_ratio=0.3,
        p_repeatability=0.4,
    )  # fmt: skip


def whitened(found: TouchesAndMap) -> tuple[np.ndarray, np.ndarray]:
    inverse = linalg.sqrtm(np.linalg.inv(found.covariance / UM**2)).real / UM
    return inverse @ found.design, inverse @ found.differences


@pytest.mark.parametrize("scale", [0.2, 0.45, 2.0])
def test_all_directions_are_tested_by_generalised_least_squares(scale: float) -> None:
    """The centre by least squares of whitened values; the sum of squares that is left is F with
    the spread and the degrees of freedom that the noise has."""
    given = compared(scale=scale)
    x, y = whitened(given)
    shift = np.linalg.lstsq(x[:, :3], y, rcond=None)[0]
    left = float(np.sum((y - x[:, :3] @ shift) ** 2))
    found = changes_of(given, 0.03)
    differences = given.differences - given.center @ shift
    assert found.differences == pytest.approx(differences, rel=1e-7, abs=1e-12)
    assert found.largest == pytest.approx(np.abs(differences).max(), rel=1e-9)
    spread, dof = _spread_of_statistic(given, 14.0)
    assert found.p_map == pytest.approx(stats.f(2.0 / spread, dof).sf(left / 14.0), rel=1e-6)
    b = np.linalg.lstsq(x, y, rcond=None)[0][3:]
    c = np.linalg.inv(x.T @ x)[3:, 3:]
    ratio = float(b @ np.linalg.inv(c) @ b) / 3.0
    assert found.p_form == pytest.approx(stats.f(3.0, dof).sf(ratio), rel=1e-6)
    limit = stats.chi2(3).isf(0.01)
    for change, value, variance in zip(
        (found.size, found.amplitude, found.turn), b, np.diag(c), strict=True
    ):
        assert change.value == pytest.approx(value, rel=1e-6)
        assert change.u == pytest.approx(math.sqrt(variance), rel=1e-6)
        power = stats.ncx2(3, (change.detectable / change.u) ** 2).sf(limit)
        assert power == pytest.approx(0.95, rel=1e-6)
    assert found.p_repeatability == 0.4
    assert found.false_alarm_rate == 0.03
    assert found.changed == (min(found.p_form, found.p_map, 0.4) < 0.01)
    for p, changed in ((0.0101, False), (0.0099, True)):
        quiet = replace(given, differences=0.0 * given.differences, p_repeatability=p)
        assert changes_of(quiet, 0.03).changed == changed


def test_the_scale_of_the_statistic_is_as_uncertain_as_its_parts() -> None:
    """By hand: the traces of the touches' and the map's share of the expectation, freedom 14, and
    the excess kurtosis 3 c of directions whose variance is uncertain."""
    given = compared(spread=0.25)
    weights = without_center(given.covariance, given.center)
    of_touches = np.trace(weights @ np.diag(given.noise.variances / given.noise.counts)) / 14.0
    spread, dof = _spread_of_statistic(given, 14.0)
    assert 2.0 / dof == pytest.approx(
        2.0 * of_touches**2 / 14.0 + 2.0 * (1.0 - of_touches) ** 2 / 40.0, rel=1e-9
    )
    squares = np.diag(weights) * np.diag(given.covariance)
    assert spread == pytest.approx(2.0 / 14.0 + 3.0 * 0.25 * np.sum(squares**2) / 14.0**2, rel=1e-9)
    known = replace(given, scatter_of_map=Scatter(0.3 * UM, math.inf))
    assert _spread_of_statistic(known, 14.0)[1] == pytest.approx(14.0 / of_touches**2, rel=1e-9)
    single = replace(known.noise, scatter=Scatter(0.0, 0.0))
    certain = replace(known, noise=single)
    spread, dof = _spread_of_statistic(certain, 14.0)
    assert dof == math.inf
    left = float(given.differences @ weights @ given.differences)
    expected = stats.chi2(2.0 / spread).sf(left / 14.0 * 2.0 / spread)
    assert changes_of(certain, 0.03).p_map == pytest.approx(expected, rel=1e-6)
    # Touches without repeats have the scatter of the map, which is all that is known of both.
    dof = _spread_of_statistic(replace(given, noise=single), 14.0)[1]
    assert 2.0 / dof == pytest.approx(2.0 * (of_touches**2 + (1.0 - of_touches) ** 2) / 40.0)


def test_uncertain_variances_widen_u_by_what_the_directions_show() -> None:
    """Least squares with given weights, of errors with another covariance: G C Gᵀ. Its trace in
    units of the stated covariance, over their number, scales the variances where it is above 1."""
    given = compared(spread=0.3)
    noise = given.noise
    stated = np.diag(noise.variances / noise.counts + noise.fixed_variance)
    own = np.diag(noise.raw_variances / noise.counts + noise.fixed_variance)
    larger = np.sqrt(
        noise.raw_variances / noise.raw_variances.mean()
        / np.maximum(noise.variances / noise.variances.mean(), 1.0)
    )  # fmt: skip
    raw = given.of_map * np.outer(larger, larger) + own
    assert given.raw_covariance == pytest.approx(raw, rel=1e-9)
    assert given.covariance == pytest.approx(given.of_map + stated, rel=1e-9)
    # A single direction whose variance is certain changes nothing of that.
    spreads = np.where(np.arange(17) == 3, 0.0, noise.spreads)
    certain = replace(noise, raw_variances=3.0 * noise.raw_variances, spreads=0.0 * spreads)
    inverse = np.linalg.inv(given.covariance)
    alone = np.linalg.inv(given.design.T @ inverse @ given.design)[3:, 3:]
    found = changes_of(replace(given, noise=certain), 0.03)
    u = [found.size.u, found.amplitude.u, found.turn.u]
    assert u == pytest.approx(np.sqrt(np.diag(alone)), rel=1e-6)
    for factor in (0.2, 3.0):
        noise_of = replace(noise, raw_variances=factor * noise.raw_variances, spreads=spreads)
        case = replace(given, noise=noise_of)
        own = np.diag(factor * noise.raw_variances / noise.counts + noise.fixed_variance)
        raw = given.of_map * np.outer(larger, larger) + own
        inverse = np.linalg.inv(case.covariance)
        covariance = np.linalg.inv(case.design.T @ inverse @ case.design)
        gain = (covariance @ case.design.T @ inverse)[3:]
        c = covariance[3:, 3:]
        scale = max(float(np.trace(np.linalg.inv(c) @ gain @ raw @ gain.T)) / 3.0, 1.0)
        assert (scale > 1.0) == (factor > 1.0)
        found = changes_of(case, 0.03)
        u = [found.size.u, found.amplitude.u, found.turn.u]
        assert u == pytest.approx(np.sqrt(scale * np.diag(c)), rel=1e-6)
        b = gain @ case.differences
        dof = _spread_of_statistic(case, 14.0)[1]
        ratio = float(b @ np.linalg.inv(scale * c) @ b) / 3.0
        assert found.p_form == pytest.approx(stats.f(3.0, dof).sf(ratio), rel=1e-6)


def test_changes_that_directions_do_not_separate_are_not_stated() -> None:
    """Size before amplitude before turn; columns that are alike to 1e-4, or weak, are left out."""
    n = fibonacci_cap(17, 1.5)
    one, other = np.random.default_rng(6).standard_normal((2, 17))
    ones = np.ones(17)

    def separable(amplitude: np.ndarray, turn: np.ndarray, size: np.ndarray = ones) -> list[int]:
        return separable_columns(np.column_stack([n, size, amplitude, turn]), 3)

    assert separable(one, other) == [3, 4, 5]
    assert separable(1e-3 * one, 1e3 * other) == [3, 4, 5]
    assert separable(0.0 * one, 0.0 * one) == [3]
    weak = 2.0 * np.linalg.norm(ones) / np.linalg.norm(one)
    assert separable(1e-6 * weak * one, other) == [3, 4, 5]
    assert separable(0.25e-6 * weak * one, other) == [3, 5]
    assert separable(one, 2.0 * one) == [3, 4]
    assert separable(n @ [1.0, 2.0, 3.0] + ones, other) == [3, 5]
    assert separable(one, other, n[:, 2]) == [4, 5]
    # Two columns of length 1 that differ by e have singular values in the ratio e / 2.
    unit = one / np.linalg.norm(one)
    across = other - unit * (unit @ other)
    across /= np.linalg.norm(across)
    for apart, both in ((4e-4, True), (1e-5, False)):
        assert (5 in separable(unit, unit + apart * across)) == both
    few = np.column_stack([n, ones, one, other])[:5]
    assert separable_columns(few, 3) == [3, 4]
    assert separable_columns(few[:4], 3) == [3]
    flat = replace(compared(), design=np.column_stack([n, ones, 0.0 * one, 0.0 * one]))
    found = changes_of(flat, 0.03)
    assert found.amplitude == found.turn == Change(0.0, math.inf, math.inf)
    assert stats.ncx2(1, (found.size.detectable / found.size.u) ** 2).sf(
        stats.chi2(1).isf(0.01)
    ) == pytest.approx(0.95, rel=1e-6)


def test_a_free_centre_is_one_without_a_prior() -> None:
    """The limit of a covariance with a centre that is known to 1 m; also where two columns of the
    centre are the same."""
    rng = np.random.default_rng(3)
    root = rng.standard_normal((8, 8))
    covariance = root @ root.T + np.eye(8)
    for center in (rng.standard_normal((8, 3)), np.ones((8, 2))):
        wide = np.linalg.inv(covariance + 1e7 * center @ center.T)
        assert without_center(covariance, center) == pytest.approx(wide, abs=1e-6)
