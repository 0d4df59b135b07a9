"""Noise of readings and variances of directions against dense matrices and scipy's distributions.

S has a row for each reading: +1 at its machine direction, -1 at its probe direction. Z is |S|.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    multi_step_design,
    weighted_residuals,
)
from pretravel.laboratory.separation.noise import TAILS, ReadingScale, noise_tails
from pretravel.laboratory.separation.variances import (
    _shrunk,
    common_scale,
    likelihood_information,
    squared_scales,
)

UM = 1e-3
GRID = np.linspace(-60.0, 60.0, 24001)


def _design(machines: int, probes: int, count: int) -> tuple[MultiStepDesign, FloatArray]:
    """All pairs in turn, up to a number of readings; and S."""
    i, j = np.divmod(np.arange(count) % (machines * probes), probes)
    signed = np.hstack([np.eye(machines)[i], -np.eye(probes)[j]])
    return multi_step_design(MultiStepReadings(i, j, np.zeros(count))), signed


def test_information_is_that_of_dense_projections() -> None:
    """P = W - W S (S'WS)⁺ S'W; half of Z'(P ∘ P) Z, with unequal weights and some pairs twice."""
    design, signed = _design(5, 4, 27)
    total = np.random.default_rng(2).uniform(0.5, 3.0, 27) * 1e-6
    weights = np.diag(1.0 / total)
    hat = signed @ np.linalg.pinv(signed.T @ weights @ signed, rcond=1e-9) @ signed.T
    p = weights - weights @ hat @ weights
    found = likelihood_information(design, total)
    assert found.leverage == pytest.approx(np.diag(hat @ weights), rel=1e-7)
    assert found.weights == pytest.approx(1.0 / total)
    expected = 0.5 * np.abs(signed).T @ (p * p) @ np.abs(signed)
    assert found.matrix == pytest.approx(expected, rel=1e-6)
    inverse = np.linalg.pinv(expected, rcond=1e-9)
    assert found.inverse == pytest.approx(inverse, rel=1e-5, abs=1e-8 * np.abs(inverse).max())


def _maximum(size: FloatArray, tail: float, share: float) -> tuple[float, float]:
    """Largest log likelihood over the level, and this level, by a search.

    The density of gross errors is 1 / size between 4 and 50 scales on both sides, and 1 / size²
    beyond.
    """
    law = stats.t(1.0 / tail) if tail else stats.norm()

    def negative(log_level: float) -> float:
        z = size * math.exp(-0.5 * log_level)
        norm = 2.0 * (math.log(50.0 / 4.0) + 1.0)
        wide = np.where(z > 4.0, np.minimum(50.0 / z, 1.0) / z / norm, 0.0)
        with np.errstate(divide="ignore"):
            density = np.logaddexp(law.logpdf(z) + np.log(1.0 - share), np.log(share * wide))
        return -float(np.sum(density)) + 0.5 * len(size) * log_level

    found = optimize.minimize_scalar(negative, bracket=(-1.0, 0.5), tol=1e-10)
    return -float(found.fun), math.exp(float(found.x))


@pytest.mark.parametrize("gross", [False, True])
def test_tails_and_levels_maximise_the_likelihood(gross: bool) -> None:
    """Of each distribution and share of gross errors, with residuals by iterated weights,
    (1 + t) / (1 + t r²), to the end. Prior: normal noise five times that of each other; that of
    gross errors is shared by the five shares. Twelve rounds are within some 10 % of the end.
    Without gross errors the errors of the directions are integrated out: Laplace, by p / 2 times
    the logarithm of Fisher's information, which is the mean square of the slope of ln f."""
    design, _ = _design(12, 10, 120)
    rng = np.random.default_rng(2)
    squared, leverage = rng.uniform(0.5, 2.0, 120), rng.uniform(0.1, 0.3, 120)
    errors = np.sqrt(squared) * rng.standard_t(6.0, 120)
    errors[[17, 50]] += 23.0, -70.0
    own = squared * (1.0 - leverage)
    found = noise_tails(design, UM * errors, ReadingScale(UM**2 * squared, leverage), gross=gross)
    assert found.probability.sum() == pytest.approx(1.0)
    # Scales a hundred times as large have a level of a hundredth, and the same probabilities.
    wide = ReadingScale(100.0 * UM**2 * squared, leverage)
    other = noise_tails(design, UM * errors, wide, gross=gross)
    assert other.probability == pytest.approx(found.probability, rel=1e-5, abs=1e-9)
    assert 100.0 * other.levels == pytest.approx(found.levels, rel=1e-5)
    shares = [0.0, 0.005, 0.01, 0.02, 0.03, 0.05] if gross else [0.0]
    assert found.level.shape == (len(TAILS), len(shares))
    logarithm = np.full(found.level.shape, -np.inf)
    for k, tail in enumerate(TAILS):
        fitted = max(tail, 0.15) if gross else tail
        level, factor = 1.0, np.ones(120)
        for _ in range(60):
            now = weighted_residuals(design, errors, factor / squared)
            factor = (1.0 + fitted) / (1.0 + fitted * now**2 / own / level)
            level = float(np.mean(factor * now**2 / own))
        for g in range(len(shares)) if k in (0, 5, 8) else [0]:
            logarithm[k, g], level = _maximum(np.abs(now) / np.sqrt(own), tail, shares[g])
            assert found.level[k, g] == pytest.approx(level, rel=0.03)
        if not gross:
            law = stats.t(1.0 / tail) if tail else stats.norm()
            slope = np.gradient(law.logpdf(GRID), GRID)
            information = integrate.trapezoid(law.pdf(GRID) * slope**2, GRID)
            left = np.sum(law.logpdf(now / np.sqrt(level * squared)))
            taken = float(leverage.sum())
            left -= 0.5 * ((120.0 - taken) * math.log(level) + taken * math.log(information))
            logarithm[k, 0] = left
    prior = np.where(np.arange(len(TAILS)) == 0, 5.0, 1.0)[:, None]
    ratio = prior * np.exp(logarithm - logarithm.max())
    ratio[:, 1:] /= 5.0
    known = np.isfinite(logarithm)
    place = np.unravel_index(np.argmax(ratio), ratio.shape)
    assert found.probability[known] / found.probability[place] == pytest.approx(
        ratio[known] / ratio[place], rel=0.15, abs=1e-6
    )
    assert found.of_tails == pytest.approx(found.probability.sum(axis=1))
    assert found.mean_tail == pytest.approx(found.of_tails @ TAILS)
    mean = np.average(found.level, axis=1, weights=found.probability)
    assert found.levels == pytest.approx(mean)


def test_the_common_scale_agrees_with_its_own_weights() -> None:
    """(1.4826 median |r|)² over the share of degrees of freedom, r with weights
    1.25 / (1 + r² / (4 s²)): dense, to the end of the iteration."""
    design, signed = _design(11, 9, 99)
    rng = np.random.default_rng(9)
    i, j = np.divmod(np.arange(99), 9)
    errors = UM * (np.sin(i) + np.cos(j) + 0.3 * rng.standard_normal(99))
    errors[[4, 50]] += 8.0 * UM
    level, weights = 1.0, np.ones(99)
    for _ in range(200):
        root = np.sqrt(weights)
        solution = np.linalg.lstsq(signed * root[:, None], errors * root, rcond=None)[0]
        left = errors - signed @ solution
        level = (1.4826 * np.median(np.abs(left))) ** 2 / (1.0 - 19.0 / 99.0)
        weights = 1.25 / (1.0 + 0.25 * left**2 / level)
    found = common_scale(design, errors)
    assert found == pytest.approx(level, rel=0.01)
    # Readings without the two gross errors have 0.3 µm; of 99, a median has some 12 % of it.
    assert math.sqrt(found) == pytest.approx(0.3 * UM, rel=0.36)
    for unit in (1e-3, 40.0):
        assert common_scale(design, unit * errors) == pytest.approx(unit**2 * found)
    with pytest.raises(PretravelError, match="no scatter"):
        common_scale(design, np.sin(i) - np.cos(j))


NORMAL_SHARE = optimize.brentq(
    lambda s: stats.norm.expect(lambda z: 1.25 * z**2 / (s + 0.25 * z**2)) - 1.0, 0.3, 1.0
)
"""Student's squared scale with four degrees of freedom of normal noise, where E(w z²) = 1."""


def test_scales_are_of_what_the_fit_leaves() -> None:
    """36 readings of six by six directions, of which the fit follows 11: the mean of 80 tests has
    4 %. Without leverage it is higher by a fifth."""
    design, _ = _design(6, 6, 36)
    noise = np.random.default_rng(0).standard_normal((80, 36))
    pairs = [np.mean(design.incidence @ squared_scales(design, UM * one)) for one in noise]
    assert np.mean(pairs) / NORMAL_SHARE / UM**2 == pytest.approx(1.0, abs=0.12)


def test_scales_of_directions_follow_their_scatter() -> None:
    """Six machine directions with 120 normal readings each: a scale has some 15 %."""
    design, _ = _design(6, 40, 720)
    i = np.arange(720) % 240 // 40
    true = 0.5e-6 * (1.0 + 0.95 * np.cos(2.0 * np.pi * np.arange(6) / 6.0))
    errors = np.sqrt(true[i] + 0.05e-6) * np.random.default_rng(6).standard_normal(len(i))
    found = squared_scales(design, errors)
    pairs = (found[:6, None] + found[6:]) / NORMAL_SHARE
    expected = true[:, None] + np.full(40, 0.05e-6)
    assert np.mean(pairs) == pytest.approx(np.mean(expected), rel=0.15)
    slope = np.polyfit(expected.mean(axis=1), pairs.mean(axis=1), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.2)
    assert squared_scales(design, 7.0 * errors) == pytest.approx(49.0 * found, rel=1e-6)


def test_scales_follow_their_scatter_as_far_as_readings_show_it() -> None:
    """Machine directions with 0.7 and 1.3 in turn, and equal ones of the probe, 24 readings each: a
    variance scatters by (1 + 3/4) 2 / 23 = 0.15, its true spread is 0.09, and 0.09 / 0.24 = 0.37 of
    what is observed is the directions'. Six tests know it to some 0.05."""
    design, _ = _design(24, 24, 576)
    sign = np.where(np.arange(24) % 2, 1.0, -1.0)
    shown, beside = [], []
    for seed in range(6):
        noise = np.random.default_rng(seed).standard_normal(576)
        found = squared_scales(design, UM * np.sqrt(1.0 + 0.3 * np.repeat(sign, 24)) * noise)
        shown.append(np.mean(found[:24] * sign) / (0.3 * 2.0 * np.mean(found[:24])))
        beside.append(np.std(found[24:]) / np.mean(found[24:]))
    assert np.mean(shown) == pytest.approx(0.37, abs=0.15)
    assert np.mean(beside) < 0.05


@pytest.mark.parametrize(
    ("values", "scatter", "level", "shrunk"),
    [
        # Machine variances 5, 7, 9 spread by 4, the probe's by 1 with a quarter of the scatter: of
        # each spread the share 1 - scatter / 4 is that of the directions.
        ([5, 7, 9, 7, 6, 5], 0.0, 13.0, [5, 7, 9, 7, 6, 5]),
        ([5, 7, 9, 7, 6, 5], 2.0, 13.0, [6, 7, 8, 6.5, 6, 5.5]),
        ([5, 7, 9, 7, 6, 5], 4.0, 13.0, [7, 7, 7, 6, 6, 6]),
        ([5, 7, 9, 7, 6, 5], 5.0, 13.0, [7, 7, 7, 6, 6, 6]),
        # Equal variances are their own mean.
        ([3, 3, 3, 2, 2, 2], 1.0, 5.0, [3, 3, 3, 2, 2, 2]),
        # A single direction is its own mean.
        ([3, 2, 2, 2], 1.0, 5.0, [3, 2, 2, 2]),
        # The lowest pair has 0.2 and gets 0.4, a tenth of 4, where all move to the half, 2, by
        # 3.6 / 3.8, with equal means of 2.2 before; it has more than a tenth of 1.9.
        ([1, 7, -0.8, 1, 1], 0.0, 4.0, 2.0 + 3.6 / 3.8 * np.array([-2.8, 3.2, -1.0, 0.8, 0.8])),
        ([1, 7, -0.8, 1, 1], 0.0, 1.9, [1, 7, -0.8, 1, 1]),
    ],
)
def test_variances_are_shrunk_by_the_part_of_their_spread_that_is_scatter(
    values: list[float], scatter: float, level: float, shrunk: list[float]
) -> None:
    """Of one to three machine directions, and three of the probe."""
    machines = len(values) - 3
    covariance = scatter * np.diag([*[1.0] * machines, 0.25, 0.25, 0.25])
    design, _ = _design(machines, 3, 3 * max(machines, 2))
    found = _shrunk(design, np.array(values, dtype=float), covariance, level)
    assert found == pytest.approx(np.asarray(shrunk, dtype=float), abs=1e-12)
