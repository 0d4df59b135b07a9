"""Gross errors and heavy tails among multi-step readings: what is named, and what is covered.

The simulator is apart from the package: numpy only. A three-lobed probe whose scatter follows its
lobes, 24 x 24 readings as in the example data, variances of pairs from 0.14 to 0.56 µm².
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from pretravel.laboratory.separation import outliers
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepReadings,
    multi_step_design,
    weighted_fit,
)
from pretravel.laboratory.separation.noise import TAILS, ReadingScale, noise_tails
from pretravel.laboratory.separation.outliers import (
    ReadingOutlier,
    _judged,
    outlying_readings,
)
from pretravel.laboratory.separation.separation import Method, separate
from pretravel.laboratory.separation.variances import likelihood_information, squared_scales

UM = 1e-3
COUNT = 24
ROW, COLUMN = np.divmod(np.arange(COUNT**2), COUNT)
ANGLE = 2.0 * np.pi * np.arange(COUNT) / COUNT
PAIRS = (0.10 + 0.06 * np.cos(ANGLE))[:, None] + (0.25 + 0.15 * np.cos(3.0 * ANGLE))
PLACES = [(i, j) for i in range(0, COUNT, 3) for j in range(0, COUNT, 2)]


def _simulated(rng: np.random.Generator, noise: str) -> tuple[MultiStepReadings, set[int]]:
    """Readings, and the rows with dirt: 2 % of them are off by 5 to 20 standard deviations."""
    dof = {"t3": 3.0, "t5": 5.0}.get(noise)
    if dof is None:
        standard = rng.standard_normal(COUNT**2)
    else:
        standard = rng.standard_t(dof, COUNT**2) / math.sqrt(dof / (dof - 2.0))
    errors = (
        np.sqrt(PAIRS[ROW, COLUMN]) * standard + np.sin(ANGLE)[ROW] - 2.5 * np.cos(ANGLE)[COLUMN]
    )
    dirty = rng.choice(COUNT**2, round(0.02 * COUNT**2), replace=False)
    if noise != "dirt":
        return MultiStepReadings(ROW + 1, COLUMN + 1, UM * errors), set()
    size = rng.uniform(5.0, 20.0, len(dirty)) * rng.choice([-1.0, 1.0], len(dirty))
    errors[dirty] += math.sqrt(PAIRS.mean()) * size
    return MultiStepReadings(ROW + 1, COLUMN + 1, UM * errors), set(dirty.tolist())


def _coverage(
    noise: str, sets: int, seed: int, method: Method = "reml"
) -> tuple[float, float, float]:
    """Share of pairs' variances within their 95 % intervals, of sets with a good reading named,
    and of dirt found."""
    rng = np.random.default_rng(seed)
    inside, false, found = [], [], []
    for _ in range(sets):
        readings, dirty = _simulated(rng, noise)
        result = separate(readings, method=method)
        named = {outlier.row for outlier in result.outliers}
        false.append(bool(named - dirty))
        found.append(len(named & dirty) / max(len(dirty), 1))
        for i, j in PLACES:
            low, high = result.pair_interval(i + 1, j + 1)
            inside.append(low <= 1e-6 * PAIRS[i, j] <= high)
    return float(np.mean(inside)), float(np.mean(false)), float(np.mean(found))


@pytest.mark.long
@pytest.mark.parametrize("noise", ["t3", "dirt"])
def test_intervals_of_variances_cover_short(noise: str) -> None:
    """Six sets; the level of a set is common to its pairs, so that 80 % is what they can show."""
    covered, _, found = _coverage(noise, 6, 1)
    assert covered > 0.80
    if noise == "dirt":
        assert found > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("noise", ["normal", "t5", "t3", "dirt"])
def test_intervals_of_variances_cover(noise: str) -> None:
    """200 sets; a good reading is named in at most 1 % of them, within three standard errors. t₃
    has no fourth moment: its few largest readings decide the variance (89.9 % cover)."""
    covered, false, _ = _coverage(noise, 200, 2)
    assert (0.88 if noise == "t3" else 0.90) <= covered < 0.99
    assert false <= 0.01 + 3.0 * math.sqrt(0.01 / 200)


@pytest.mark.long
def test_heavy_tails_widen_least_squares() -> None:
    """Six sets of t₃; their 95 % intervals contained 79 % of the pairs' variances."""
    assert _coverage("t3", 6, 8, "least-squares")[0] > 0.90


def test_a_noisy_direction_is_not_dirt() -> None:
    """One machine direction with nine times the variance of the others: its readings stay."""
    rng = np.random.default_rng(6)
    for _ in range(3):
        scale = np.where(ROW == 3, 3.0, 1.0)
        errors = 0.5 * UM * scale * rng.standard_normal(COUNT**2)
        assert separate(MultiStepReadings(ROW, COLUMN, errors)).outliers == ()


def test_limits_are_those_of_dense_predictions() -> None:
    """Beside its directions' scale s a reading that does not take part has s² + x' (X'WX)⁺ x, one
    that does s² less this, times the quantile of the noise whose tails on both sides are a
    hundredth over 80 readings. It is as far from what the part predicts with the weights
    (1 + t) / (1 + t r² / s²)."""
    rng = np.random.default_rng(2)
    i, j = np.divmod(np.arange(80), 8)
    errors = UM * (np.sin(i) - np.cos(j) + 0.3 * (1.0 + (i % 2)) * rng.standard_normal(80))
    out = np.array([7, 33, 61])
    errors[out] += np.array([20.0, -24.0, 17.0]) * UM
    design = multi_step_design(MultiStepReadings(i, j, errors))
    named = outlying_readings(design, errors)
    found = [(one.row, one.machine, one.probe) for one in named]
    assert found == [(33, 4, 1), (7, 0, 7), (61, 7, 5)]
    rows = np.setdiff1d(np.arange(80), out)
    part = multi_step_design(MultiStepReadings(i[rows], j[rows], errors[rows]))
    signed = np.hstack([np.eye(10)[i], -np.eye(8)[j]])
    total = np.abs(signed) @ squared_scales(part, errors[rows])
    leverage = likelihood_information(design, total).leverage
    tails = noise_tails(design, errors, ReadingScale(total, leverage), gross=True)
    level = float(tails.of_tails @ tails.levels)
    factor = np.ones(len(rows))
    for _ in range(50):
        root = np.sqrt(factor / total[rows])
        solution = np.linalg.lstsq(signed[rows] * root[:, None], errors[rows] * root, rcond=None)[0]
        left = errors - signed @ solution
        share = tails.mean_tail * left[rows] ** 2 / (total[rows] * level)
        factor = (1.0 + tails.mean_tail) / (1.0 + share)
    cofactor = np.linalg.pinv(
        signed[rows].T @ np.diag(1.0 / total[rows]) @ signed[rows], rcond=1e-9
    )
    distance, limits = _judged(design, part, errors, rows)
    assert distance == pytest.approx(left, rel=1e-3, abs=1e-3 * UM)
    beside = np.einsum("ni,ij,nj->n", signed, cofactor, signed)
    sizes = limits / np.sqrt(total + np.where(np.isin(np.arange(80), out), beside, -beside))
    size = sizes[0]
    assert sizes == pytest.approx(size, rel=1e-6)
    z = size / np.sqrt(tails.levels)
    beyond = [stats.norm.sf(z[0]), *stats.t.sf(z[1:], 1.0 / TAILS[1:])]
    assert 2.0 * tails.of_tails @ beyond == pytest.approx(0.01 / 80.0, rel=1e-5)
    for one in named:
        assert (one.distance, one.limit) == pytest.approx(
            (left[one.row], limits[one.row]), rel=1e-3
        )


def test_a_direction_keeps_two_readings() -> None:
    """Of a direction with three readings one is named; of one with two none, nor two of three; and
    nothing is named where what is left falls apart."""
    i, j = np.divmod(np.arange(60), 6)
    clean = UM * (np.sin(i) - np.cos(j) + 0.1 * np.random.default_rng(1).standard_normal(60))
    errors = clean + 10.0 * UM * (np.arange(60) == 2)
    for kept, rows in (([2, 3, *range(5, 60)], [0]), ([2, *range(5, 60)], [])):
        design = multi_step_design(MultiStepReadings(i[kept], j[kept], errors[kept]))
        assert [one.row for one in outlying_readings(design, errors[kept])] == rows
    errors[3] -= 10.0 * UM
    design = multi_step_design(MultiStepReadings(i[2:], j[2:], errors[2:]))
    assert {one.row for one in outlying_readings(design, errors[2:])} == {0, 1}
    kept = np.array([2, 3, *range(5, 60)])
    design = multi_step_design(MultiStepReadings(i[kept], j[kept], errors[kept]))
    assert outlying_readings(design, errors[kept]) == []
    two = np.isin(6 * i + j, [4, 11])  # the only ones between two halves; both are suspected
    errors = clean + 10.0 * UM * (np.arange(60) == 4)
    kept = np.flatnonzero(((i < 5) == (j < 3)) | two)
    design = multi_step_design(MultiStepReadings(i[kept], j[kept], errors[kept]))
    assert outlying_readings(design, errors[kept]) == []


def test_a_reading_that_is_left_out_is_judged_where_few_directions_scatter() -> None:
    """Six directions each: the shrunk scales of two of them add up to less than zero, and the only
    reading of both is the one that is off. Its limit was not a number."""
    i, j = np.divmod(np.arange(36), 6)
    rng = np.random.default_rng([5, 30])
    noise = rng.standard_normal(36)
    noise[3] += 20.0
    errors = UM * (2.0 * np.sin(i) - 1.5 * np.cos(2 * j) + 0.4 * noise)
    found = separate(MultiStepReadings(i, j, errors))
    assert [outlier.row for outlier in found.outliers] == [3]
    assert found.outliers[0].distance == pytest.approx(8.0 * UM, abs=2.0 * UM)


def test_a_part_without_scales_names_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few readings of four setups, five of them suspected, had scales below zero: an error of the
    search for a root."""
    i, j = np.divmod(np.arange(36), 6)
    errors = UM * np.random.default_rng(4).standard_normal(36)
    design = multi_step_design(MultiStepReadings(i, j, errors))
    monkeypatch.setattr(outliers, "squared_scales", lambda *_: np.full(12, -1e-6))
    assert outlying_readings(design, errors) == []


def test_readings_of_which_most_agree_are_no_traceback() -> None:
    """Weights of no size left a singular matrix, a scale below zero a logarithm without a value."""
    i, j = np.divmod(np.arange(36), 6)
    errors = UM * np.random.default_rng(4).standard_normal(36)
    design = multi_step_design(MultiStepReadings(i, j, errors))
    assert np.isfinite(weighted_fit(design, errors, np.where(j == 2, 0.0, 1.0))).all()
    squared = np.where(np.arange(36) < 3, -1e-7, 1e-6)
    tails = noise_tails(design, errors, ReadingScale(squared, np.full(36, 11 / 36)), gross=True)
    assert np.isfinite(tails.levels).all()


def test_an_outlier_is_told_with_its_size() -> None:
    told = ReadingOutlier(4, 7, 9, -12.5 * UM, 2.25 * UM).message
    assert told == (
        "reading 5, machine 7 with probe 9, lies -12.5 µm from what the others predict; noise "
        "explains 2.25 µm. It is left out"
    )
