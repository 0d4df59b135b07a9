"""Variances of a separation where the noise has heavy tails or gross errors.

The simulator is apart from the package: numpy only. A three-lobed probe whose scatter follows its
lobes, 24 x 24 readings as in the example data, variances of pairs from 0.14 to 0.56 µm².
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation import separate

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
        return MultiStepReadings(ROW + 1, COLUMN + 1, 1e-3 * errors), set()
    size = rng.uniform(5.0, 20.0, len(dirty)) * rng.choice([-1.0, 1.0], len(dirty))
    errors[dirty] += math.sqrt(PAIRS.mean()) * size
    return MultiStepReadings(ROW + 1, COLUMN + 1, 1e-3 * errors), set(dirty.tolist())


def _coverage(noise: str, sets: int, seed: int) -> tuple[float, float, float]:
    """Share of pairs' variances within their 95 % intervals, of sets with a good reading named,
    and of dirt found."""
    rng = np.random.default_rng(seed)
    inside, false, found = [], [], []
    for _ in range(sets):
        readings, dirty = _simulated(rng, noise)
        result = separate(readings)
        named = {outlier.row for outlier in result.outliers}
        false.append(bool(named - dirty))
        found.append(len(named & dirty) / max(len(dirty), 1))
        for i, j in PLACES:
            low, high = result.pair_interval(i + 1, j + 1)
            inside.append(low <= 1e-6 * PAIRS[i, j] <= high)
    return float(np.mean(inside)), float(np.mean(false)), float(np.mean(found))


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
    """200 sets; a good reading is named in at most 1 % of them, within three standard errors."""
    covered, false, _ = _coverage(noise, 200, 2)
    assert 0.90 <= covered < 0.99
    assert false <= 0.01 + 3.0 * math.sqrt(0.01 / 200)


def test_a_gross_error_is_named_with_its_size() -> None:
    readings, _ = _simulated(np.random.default_rng(4), "normal")
    errors = readings.errors.copy()
    errors[[100, 101]] += np.array([30e-3, -12e-3])
    dirty = MultiStepReadings(readings.machine, readings.probe, errors)
    result = separate(dirty)
    assert [outlier.row for outlier in result.outliers] == [100, 101]
    assert result.outliers[0].distance == pytest.approx(30e-3, abs=2.5e-3)
    assert "machine 5 with probe 5" in result.outliers[0].message
    assert len(result.residuals) == COUNT**2 - 2
    without = separate(readings, exclude=[(5, 5), (5, 6)])
    assert without.excluded == (100, 101)
    assert np.allclose(result.machine_error, without.machine_error)
    assert np.allclose(result.probe_variance, without.probe_variance)


def test_a_reading_that_is_left_out_is_judged_where_few_directions_scatter() -> None:
    """Six directions each: the shrunk scales of two of them add up to less than zero, and the only
    reading of both is the one that is off. Its limit was not a number."""
    i, j = np.divmod(np.arange(36), 6)
    rng = np.random.default_rng([5, 30])
    noise = rng.standard_normal(36)
    noise[3] += 20.0
    errors = 1e-3 * (2.0 * np.sin(i) - 1.5 * np.cos(2 * j) + 0.4 * noise)
    found = separate(MultiStepReadings(i, j, errors))
    assert [outlier.row for outlier in found.outliers] == [3]
    assert found.outliers[0].distance == pytest.approx(8e-3, abs=2e-3)


def test_heavy_tails_widen_least_squares() -> None:
    """Six sets of t₃; their 95 % intervals contained 79 % of the pairs' variances."""
    rng = np.random.default_rng(8)
    inside = []
    for _ in range(6):
        result = separate(_simulated(rng, "t3")[0], method="least-squares")
        for i, j in PLACES:
            low, high = result.pair_interval(i + 1, j + 1)
            inside.append(low <= 1e-6 * PAIRS[i, j] <= high)
    assert np.mean(inside) > 0.90


def test_a_noisy_direction_is_not_dirt() -> None:
    """One machine direction with nine times the variance of the others: its readings stay."""
    rng = np.random.default_rng(6)
    named = 0
    for _ in range(5):
        scale = np.where(ROW == 3, 3.0, 1.0)
        errors = 0.5e-3 * scale * rng.standard_normal(COUNT**2)
        named += len(separate(MultiStepReadings(ROW, COLUMN, errors)).outliers)
    assert named == 0


def test_an_excluded_pair_must_be_there() -> None:
    readings, _ = _simulated(np.random.default_rng(4), "normal")
    with pytest.raises(PretravelError, match="machine 25 with probe 1") as caught:
        separate(readings, exclude=[(25, 1)])
    assert caught.value.inputs == ("exclude",)
