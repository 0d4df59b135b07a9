"""Touches of one point: the interval of the next touch by simulation; series of public threads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.repeat_series import judged_repeats, step_of_repeats

NOISE = 0.002
"""Standard deviation of a touch: a switch of a printer. [mm]"""
STEP = 0.0025
"""Of the Klipper logs of these threads. [mm]"""
SERIES = 200
FEWER = pytest.param(10, 0.138)
"""Series of every day, and twice the standard deviation of a share of 0.95 among them."""
MANY = pytest.param(SERIES, 0.031, marks=pytest.mark.slow)
Make = Callable[[np.random.Generator, int], FloatArray]


def _white(rng: np.random.Generator, count: int) -> FloatArray:
    return rng.normal(0.0, NOISE, count)


def _drifting(rng: np.random.Generator, count: int) -> FloatArray:
    return _white(rng, count) + 0.3 * NOISE * np.arange(count)


def _first_off(rng: np.random.Generator, count: int) -> FloatArray:
    return _white(rng, count) - 8.0 * NOISE * (np.arange(count) == 0)


def _quantised(rng: np.random.Generator, count: int) -> FloatArray:
    return STEP * np.round((_white(rng, count) + rng.uniform(0.0, STEP)) / STEP)


def _held(make: Make, series: int, count: int = 10) -> float:
    """Share of the series whose next touch lies in the interval that was stated before it."""
    rng = np.random.default_rng(20)
    held = 0
    for _ in range(series):
        touches = make(rng, count + 1)
        found = judged_repeats(touches[:count])
        held += bool(abs(touches[count] - found.expected) <= found.reach + 1e-9)
    return held / series


@pytest.mark.long
@pytest.mark.parametrize(("series", "chance"), [FEWER, MANY])
@pytest.mark.parametrize(
    "make",
    [_drifting, *(pytest.param(each, marks=pytest.mark.slow) for each in (_white, _first_off))],
)
def test_the_next_touch_lies_in_its_interval(make: Make, series: int, chance: float) -> None:
    assert _held(make, series) == pytest.approx(0.95, abs=chance)


@pytest.mark.parametrize(("series", "chance"), [MANY])
def test_the_next_quantised_touch_lies_in_its_interval(series: int, chance: float) -> None:
    """Positions jump from step to step: with 2 steps or 3 within, the share is above 95 % or below.

    At least 95 % less chance; above 95 % is a rounding to the safe side.
    """
    assert 0.95 - chance <= _held(_quantised, series) <= 1.0


def _plain_held(make: Make, count: int = 10) -> float:
    rng = np.random.default_rng(20)
    held = 0
    for _ in range(SERIES):
        touches = make(rng, count + 1)
        seen = touches[:count]
        held += bool(abs(touches[count] - seen.mean()) <= 2.0 * seen.std(ddof=1))
    return held / SERIES


def test_the_plain_deviation_misleads() -> None:
    """Twice the standard deviation of all: too short under drift, too long after a first touch.

    Under this drift the mean lies 5.5 touches, 1.65 noises, behind the next touch.
    """
    assert _plain_held(_drifting) < 0.88
    seen = _first_off(np.random.default_rng(1), 10)
    assert seen.std(ddof=1) > 2.0 * judged_repeats(seen).noise


@pytest.mark.slow
def test_false_alarms_are_rare() -> None:
    """5 % for the drift, 1 % each for the first touch and for outliers or jumps: 7 of 100.

    14 or more of 100 have a probability of 1 % where each has 7 %.
    """
    rng = np.random.default_rng(3)
    alarms = 0
    for _ in range(100):
        found = judged_repeats(_white(rng, 12))
        alarms += found.first.apart or found.drifts or bool(found.outliers or found.jumps)
    assert alarms < 14


def test_outlier_and_jump_are_named() -> None:
    """Of 20 and 30 times the noise: far beyond chance in 20 touches."""
    touches = _white(np.random.default_rng(5), 20)
    touches[7] += 20.0 * NOISE
    found = judged_repeats(touches)
    assert [one.day for one in found.outliers] == [7]
    assert not found.kept[7]
    touches = _white(np.random.default_rng(6), 20)
    touches[9:] += 30.0 * NOISE
    found = judged_repeats(touches)
    assert [one.day for one in found.jumps] == [9]
    assert found.jumps[0].size == pytest.approx(30.0 * NOISE, abs=4.0 * NOISE)
    # After the jump: its touches scatter about 30 noises, the mean of 11 of them by 0.3.
    assert found.expected == pytest.approx(30.0 * NOISE, abs=3.0 * NOISE)


def test_rising_heights_are_a_drift() -> None:
    """Klipper issue 3196: heights rise from 0.145 to 2.8875 mm in ten touches.

    Its author: the values keep rising, while the position looks constant.
    """
    found = judged_repeats(
        [0.145, 0.3025, 0.4525, 0.6925, 0.9275, 1.2825, 1.7725, 2.14, 2.45, 2.8875]
    )
    assert found.drifts
    assert not found.first.apart
    # The end less the start, over nine steps.
    assert found.drift == pytest.approx((2.8875 - 0.145) / 9.0, abs=found.drift_u95)
    assert found.expected > 2.8875
    # The firmware printed 0.912504, of all n and not of n - 1.
    assert found.plain_deviation == pytest.approx(0.912504 * np.sqrt(10 / 9), abs=1e-6)


def test_always_higher() -> None:
    """Klipper issue 2509: "it almost always returns a higher z height".

    Ten heights in steps of 2.5 µm; the firmware printed a standard deviation of 2.75 µm.
    """
    found = judged_repeats([2.3625, 2.3625, 2.365, 2.365, 2.3675, 2.3675, 2.37, 2.3675, 2.37, 2.37])
    assert found.drifts
    assert found.drift > 2.0 * found.noise / 10.0 > 0.0
    # From 2.3625 to 2.37 in nine steps.
    assert found.drift == pytest.approx(0.0075 / 9.0, abs=found.drift_u95)
    assert found.plain_deviation > 2.0 * found.noise
    # The next series of the thread began at 2.37 and went on to 2.3775.
    assert abs(2.37 - found.expected) < found.reach


def test_a_first_touch_that_is_off() -> None:
    """Klipper pull request 5969: "the first probe after moving back … is off in comparison"."""
    first = [-0.711875, -0.70875, -0.70875, -0.708125, -0.708125, -0.708125, *[-0.70875] * 4]
    found = judged_repeats(first)
    assert found.first.apart
    # The others are at -0.70875 or a step of 0.000625 above.
    assert found.first.size == pytest.approx(-0.711875 + 0.70854, abs=0.0007)
    assert found.step == pytest.approx(0.000625, abs=1e-9)
    assert not found.drifts


def test_scattering_touches_without_drift() -> None:
    """Klipper issue 2509, another printer: 26 heights of a series of 100, in steps of 2.5 µm."""
    heights = (
        "1.32 1.3175 1.325 1.32 1.3025 1.315 1.315 1.3225 1.315 1.3125 1.2975 1.305 1.3125 1.3125 "
        "1.31 1.3225 1.325 1.32 1.3175 1.32 1.33 1.32 1.3175 1.3275 1.315 1.33"
    )
    found = judged_repeats([float(height) for height in heights.split()])
    assert found.step == pytest.approx(STEP, abs=1e-9)
    assert not found.first.apart
    # The noise is the scatter of neighbours: differences have √2 of it.
    neighbours = float(np.std(np.diff(found.values))) / np.sqrt(2.0)
    assert found.noise == pytest.approx(neighbours, rel=0.5)


def test_touches_that_are_equal() -> None:
    """Klipper pull request 3828: ten heights of 4.7 mm, an inductive sensor.

    They say only that the noise is below the step, which they do not show.
    """
    found = judged_repeats([4.7] * 10)
    assert np.isnan(found.reach)
    assert found.step == 0.0
    assert judged_repeats([4.7] * 10, step=0.0125).reach == 0.0125


def test_a_first_touch_one_step_off_is_not_proven() -> None:
    """The second series there, 4.6375 and then 4.65: one in ten by chance, if one step is 12.5 µm.

    With a known step of 2.5 µm it is five steps, and apart, as its author found.
    """
    heights = [4.6375, *[4.65] * 9]
    assert step_of_repeats([heights]) == pytest.approx(0.0125, abs=1e-9)
    assert not judged_repeats(heights).first.apart
    assert judged_repeats(heights, step=STEP).first.apart


@pytest.mark.parametrize(
    ("values", "message"),
    [([1.0] * 4, "4 touches of a point; at least 5"), ([1.0] * 5 + [np.nan], "not a finite")],
)
def test_what_cannot_be_judged(values: list[float], message: str) -> None:
    with pytest.raises(PretravelError, match=message):
        judged_repeats(values)
