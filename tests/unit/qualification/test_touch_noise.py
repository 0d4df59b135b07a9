"""Noise of touches against distributions of scipy and examples by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap
from pretravel.maps.observation import Observation, Scatter
from pretravel.qualification.touch_noise import TouchNoise, fixed_part, touch_noise

ASSUMED = Scatter(4e-4, 50.0)
UM = 1e-3  # mm


def _noise(readings: list[list[float]], step: float = 0.0) -> TouchNoise:
    """Of readings along the directions [µm], a list for each direction."""
    groups = np.repeat(np.arange(len(readings)), [len(own) for own in readings])
    normals = fibonacci_cap(max(len(readings), 4))[groups]
    positions = normals * (15.5 + UM * np.concatenate(readings))[:, None]
    return touch_noise(Observation(positions, groups, np.zeros(3), 12.5, 3.0, False), ASSUMED, step)


def _of_variances(variances: FloatArray, dof: list[int]) -> list[list[float]]:
    """Readings with given variances [µm²] among dof + 1 touches, or one touch for zero."""
    found = []
    for variance, free in zip(variances, dof, strict=True):
        shape = np.arange(free + 1.0) - 0.5 * free
        size = math.sqrt(variance * free / float(shape @ shape)) if free else 0.0
        found.append((size * shape).tolist())
    return found


def test_few_repeated_directions_share_one_variance() -> None:
    """Sums of squares 2, 8 and 2 µm² of triples and a pair, with five degrees of freedom.

    A variance from d degrees of freedom has the relative variance 2/d; tails of 0.2 add
    0.2 (1 + 2/d). Shares 2/5, 2/5 and 1/5: (2 · 4 · 1.4 + 2.6) / 25 = 13.8 / 25, of which two over
    it are 50 / 13.8 degrees of freedom.
    """
    noise = _noise([[-1.0, 0.0, 1.0], [-2.0, 0.0, 2.0], [-1.0, 1.0], [0.3]], 1e-5)
    assert noise.scatter.deviation == pytest.approx(UM * math.sqrt(12.0 / 5.0), rel=1e-9)
    assert noise.scatter.dof == pytest.approx(50.0 / 13.8, rel=1e-9)
    assert noise.variances == pytest.approx(np.full(4, 2.4e-6), rel=1e-9)
    assert noise.raw_variances == pytest.approx(np.full(4, 2.4e-6), rel=1e-9)
    assert noise.trimmed == pytest.approx(noise.scatter.deviation, rel=1e-12)
    assert noise.spreads.tolist() == [0.0] * 4
    assert noise.relative.tolist() == [1.0] * 4
    assert noise.counts.tolist() == [3.0, 3.0, 2.0, 1.0]
    assert noise.of_means == pytest.approx(2.4e-6 / noise.counts, rel=1e-9)


def test_single_touches_have_the_assumed_scatter() -> None:
    noise = _noise([[0.0]] * 5, 1e-2)
    assert (noise.scatter.deviation, noise.scatter.dof, noise.trimmed) == (0.0, 0.0, 0.0)
    assert noise.variances.tolist() == noise.raw_variances.tolist() == [1.6e-7] * 5
    assert noise.spreads.tolist() == [0.0] * 5
    assert noise.counts.tolist() == [1.0] * 5
    assert noise.fixed_variance == pytest.approx(fixed_part(4e-4, 1e-2), rel=1e-12)
    assert noise.fixed_variance > 0.0


DOF = [2, 2, 1, 1, 3, 2, 1, 0]
VARIANCES = np.array([0.05, 0.3, 9.0, 0.1, 4.0, 0.2, 0.4, 0.0])  # µm²


def test_variances_are_those_of_bayes_theorem() -> None:
    """The prior is an inverse gamma distribution; the posterior is integrated on a grid."""
    noise = _noise(_of_variances(VARIANCES, DOF))
    dof = np.array(DOF)
    pooled = float(VARIANCES @ dof) / 12.0
    assert noise.scatter.deviation == pytest.approx(UM * math.sqrt(pooled), rel=1e-9)
    # A direction that was touched once shows the prior.
    spread = float(noise.spreads[-1])
    seen = dof > 0
    ratio, d, n = VARIANCES[seen] / pooled, dof[seen], 7.0
    surplus = d * ((ratio - 1.0) ** 2 * n / (n - 1.0) - 2.0 / d - spread * (1.0 + 2.0 / d))
    assert surplus.sum() == pytest.approx(0.0, abs=1e-9)
    assert spread > 0.5
    shape = 2.0 + 1.0 / spread
    log = np.linspace(-14.0, 16.0, 60_001)
    truth = np.exp(log)
    weight = stats.invgamma.pdf(truth, shape, scale=(shape - 1.0) * pooled) * truth
    for direction, free in enumerate(DOF):
        like = weight.copy()
        if free:
            like *= stats.chi2.pdf(free * VARIANCES[direction] / truth, free) / truth
        mean = float(like @ truth / like.sum())
        square = float(like @ truth**2 / like.sum())
        assert noise.variances[direction] == pytest.approx(1e-6 * mean, rel=1e-4)
        if free:  # the variance of the prior itself converges slowly
            assert noise.spreads[direction] == pytest.approx(square / mean**2 - 1.0, rel=1e-3)
    assert noise.raw_variances[:-1] == pytest.approx(1e-6 * VARIANCES[:-1], rel=1e-9)
    assert noise.raw_variances[-1] == pytest.approx(1e-6 * pooled, rel=1e-9)
    tails = spread + 0.2
    chance = 2.0 / d
    relative = float(np.sum((d / 12.0) ** 2 * (chance + tails * (1.0 + chance))))
    assert noise.scatter.dof == pytest.approx(2.0 / relative, rel=1e-9)
    assert noise.relative == pytest.approx(
        np.maximum(noise.variances / noise.variances.mean(), 1.0), rel=1e-12
    )


@pytest.mark.parametrize("repeated", [3, 4])
def test_four_repeated_directions_show_whether_they_differ(repeated: int) -> None:
    readings = [[-9.0, 9.0], *[[-0.1, 0.1]] * (repeated - 1)]
    noise = _noise(readings)
    assert bool(noise.variances[0] > 1.5 * noise.variances[1]) is (repeated == 4)


def test_the_trimmed_scatter_is_that_of_a_cut_chi_square() -> None:
    """Of 20 directions the two that are most improbable are left out; the others have the mean of
    a chi-square below its 90 % point. A pair is more improbable than a triple of equal variance."""
    dof = [1, 2, 4, 2] * 5
    rng = np.random.default_rng(3)
    variances = np.array([rng.chisquare(d) / d for d in dof])
    noise = _noise(_of_variances(variances, dof))
    pooled = float(variances @ dof) / sum(dof)
    beyond = [stats.chi2.sf(d * v / pooled, d) for v, d in zip(variances, dof, strict=True)]
    kept = np.argsort(beyond)[2:]
    total = sum(dof[k] * variances[k] for k in kept)
    below = {
        free: stats.chi2(free).expect(ub=stats.chi2.ppf(0.9, free), conditional=True)
        for free in (1, 2, 4)
    }
    expected = sum(below[dof[k]] for k in kept)
    assert noise.trimmed == pytest.approx(UM * math.sqrt(total / expected), rel=1e-6)


def test_what_a_step_adds_goes_with_its_square() -> None:
    """In another unit; and nothing of it without a step, or beyond all scatters looked up."""
    for ratio in (0.0, 0.05, 0.2, 0.4):
        one = fixed_part(ratio, 1.0)
        assert one > 1e-4
        assert fixed_part(0.01 * ratio, 0.01) == pytest.approx(1e-4 * one, rel=1e-9)
    assert fixed_part(0.0, 0.004) == pytest.approx(0.004**2 / 12.0, rel=1e-9)
    assert fixed_part(0.3, 0.0) == 0.0
    assert fixed_part(0.3, -1.0) == 0.0
    # Far above a step, q²/12 is in the scatter among repeats: nothing beside a thousandth of it.
    for ratio in (1.0, 2.0, 4.0, 5.0, 50.0):
        assert fixed_part(ratio, 1.0) == pytest.approx(0.0, abs=1e-3 * min(ratio, 5.0) ** 2)


@pytest.mark.parametrize("scatter", [0.02, 0.08, 0.15, 0.27, 0.45, 0.7, 0.99, 1.3])
def test_what_rounding_leaves_in_the_mean_is_a_series_of_harmonics(scatter: float) -> None:
    """The k-th harmonic of a rounding error at a uniform place, averaged by normal noise: the mean
    keeps exp(-(2 π k σ)²) / (2 π² k²) of its square, and repeats show the rest of σ² + 1/12."""
    k = np.arange(1.0, 400.0)
    turns = 2.0 * math.pi * k
    shared = float(np.sum(2.0 * np.exp(-((turns * scatter) ** 2)) / turns**2))
    within = scatter**2 + 1.0 / 12.0 - shared
    assert fixed_part(3.0 * math.sqrt(within), 3.0) == pytest.approx(9.0 * shared, abs=9e-5)


def _axis_touches(readings: list[list[float]]) -> TouchNoise:
    """Exact readings in steps of 1/8 along the six half axes and others, without rounding."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    groups = np.repeat(np.arange(len(readings)), [len(own) for own in readings])
    positions = axes[groups] * (16.0 + np.concatenate(readings))[:, None]
    return touch_noise(Observation(positions, groups, np.zeros(3), 12.5, 3.0, False), ASSUMED, 0.0)


def test_repeats_that_are_exactly_equal_are_alike() -> None:
    noise = _axis_touches([[0.125 * k] * 3 for k in range(6)])
    # No residual is smaller than 0.01 nm, so that weights are finite.
    assert noise.scatter.deviation <= 1e-8
    assert (noise.trimmed, noise.fixed_variance) == (0.0, 0.0)
    assert max(*noise.variances, *noise.raw_variances) <= 1.0001e-16
    assert noise.spreads.tolist() == [0.0] * 6
    assert np.isfinite(noise.scatter.dof)


def test_directions_that_scatter_alike_differ_by_nothing() -> None:
    """Equal variances differ by less than chance: each direction has that of all."""
    noise = _axis_touches([[0.125 * k, 0.125 * k + 0.25] for k in range(6)])
    assert noise.spreads.tolist() == [0.0] * 6
    assert noise.variances == pytest.approx(np.full(6, 0.03125), rel=1e-12)
    assert noise.raw_variances == pytest.approx(np.full(6, 0.03125), rel=1e-12)
    # Six directions: the one that is left out has the trimmed mean of a cut chi-square.
    law = stats.chi2(1)
    below = law.expect(ub=law.ppf(5.0 / 6.0), conditional=True)
    assert noise.trimmed == pytest.approx(math.sqrt(0.03125 / below), rel=1e-6)


def test_touches_without_repeats_take_the_scatter_of_others_alone() -> None:
    single = _noise([[0.0]] * 5)
    pooled = single.pooled_with(Scatter(3e-4, math.inf))
    assert (pooled.scatter.deviation, pooled.scatter.dof) == (pytest.approx(3e-4), math.inf)
    assert pooled.variances == pytest.approx(np.full(5, 9e-8), rel=1e-12)
    assert pooled.raw_variances == pytest.approx(np.full(5, 9e-8), rel=1e-12)


def test_pooled_scatter_is_that_of_all_degrees_of_freedom() -> None:
    """3 of 4 µm² and 1 of 8 µm²: 5 µm²; variances that shrinkage changed keep their ratios."""
    own = np.array([2.0, 4.0, 9.0])
    noise = TouchNoise(Scatter(2.0, 3.0), 1.0, own, 0.5 * own, own, np.full(3, 2.0), 0.7)
    pooled = noise.pooled_with(Scatter(math.sqrt(8.0), 1.0))
    assert pooled.scatter == Scatter(pytest.approx(math.sqrt(5.0)), 4.0)
    assert pooled.variances == pytest.approx(1.25 * own, rel=1e-12)
    assert pooled.raw_variances == pytest.approx(0.625 * own, rel=1e-12)
    assert pooled.of_means == pytest.approx(0.625 * own + 0.7, rel=1e-12)
    assert pooled.relative == pytest.approx([1.0, 1.0, 1.8], rel=1e-12)
