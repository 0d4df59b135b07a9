"""Gross errors among the touches of a rig: named, left out, and no good set loses a touch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig import RigTouch
from pretravel.laboratory.rig_calibration import calibrate_rig
from pretravel.laboratory.rig_left_out import left_out_sentences
from pretravel.laboratory.rig_outliers import FALSE_ALARM_LEVEL, outlying_rows

UM = 1e-3
SCATTER = 0.03 * UM
BLANK = RigTouch("", 0, 0, 0, 0, 1e-6, 1e-6, 1e-6, 0, 0, 3.0, ())


def _azimuths(directions: int, repeats: int) -> np.ndarray:
    return np.repeat(2.0 * np.pi * np.arange(directions) / directions, repeats)


def _lobes(azimuth: np.ndarray) -> np.ndarray:
    """Three lobes with kinks between them, as of a tripod: 1 / cos of the folded azimuth."""
    folded = np.mod(azimuth + np.pi / 3.0, 2.0 * np.pi / 3.0) - np.pi / 3.0
    return 3.0 * UM / np.cos(folded)


def _values(rng: np.random.Generator, directions: int, repeats: int) -> np.ndarray:
    azimuth = _azimuths(directions, repeats)
    return np.asarray(_lobes(azimuth) + rng.normal(0.0, SCATTER, len(azimuth)))


def _touches(values: np.ndarray, directions: int, repeats: int) -> list[RigTouch]:
    names = [
        f"rig_{360.0 / directions * d:g}_{k + 1}" for d in range(directions) for k in range(repeats)
    ]
    return [
        replace(BLANK, trace=name, r0=0.08, r1=0.08 + value, r3=0.0803)
        for name, value in zip(names, values, strict=True)
    ]


@pytest.mark.parametrize(
    ("directions", "repeats", "noise"),
    [
        (12, 5, "normal"), (12, 5, "uniform"), (3, 2, "normal"), (8, 3, "normal"),
        (12, 2, "normal"), (24, 1, "normal"), (13, 1, "normal"), (1, 5, "normal"),
    ],
)  # fmt: skip
def test_good_sets_lose_no_touch(directions: int, repeats: int, noise: str) -> None:
    """In at most 1 % of good sets a touch is named, within three standard errors."""
    rng = np.random.default_rng(directions + 100 * repeats)
    azimuth = _azimuths(directions, repeats)
    groups = np.repeat(np.arange(directions), repeats)
    named, sets = 0, 1000 if repeats == 5 else 400
    for _ in range(sets):
        if noise == "normal":
            values = _values(rng, directions, repeats)
        else:  # edges between samples
            values = _lobes(azimuth) + rng.uniform(-SCATTER, SCATTER, len(azimuth))
        named += bool(outlying_rows(values, groups, azimuth, floor=1e-7))
    assert named / sets < FALSE_ALARM_LEVEL + 3.0 * math.sqrt(FALSE_ALARM_LEVEL / sets)
    if (directions, repeats, noise) == (12, 5, "normal"):  # the test is not blunt
        assert named / sets > 0.002


def test_one_bad_trace_of_sixty() -> None:
    """Without the bad trace, all results are those of the 59 others."""
    values = _values(np.random.default_rng(1), 12, 5)
    good = calibrate_rig([t for k, t in enumerate(_touches(values, 12, 5)) if k != 17])
    values[17] += 4.5 * UM
    found = calibrate_rig(_touches(values, 12, 5))
    assert [outlier.trace for outlier in found.outliers] == ["rig_90_3"]
    assert found.outliers[0].distance == pytest.approx(4.5 * UM, abs=5 * SCATTER)
    assert abs(found.outliers[0].distance) > found.outliers[0].limit > 4.0 * SCATTER
    assert "rig_90_3" in found.outliers[0].message
    assert found.repeatability == good.repeatability
    assert found.directions == good.directions
    # One of five touches 4.5 um off: s² = 0.8 · 4.5² / 48 more.
    assert found.with_outliers is not None
    worse = math.hypot(SCATTER, 4.5 * UM * math.sqrt(0.8 / 48.0))
    assert found.with_outliers.repeatability.value == pytest.approx(worse, rel=0.02)
    assert found.repeatability.value == pytest.approx(SCATTER, rel=0.4)
    one, effect = left_out_sentences(found)
    assert one == found.outliers[0].message
    for calibration in (found, found.with_outliers):
        assert f"{calibration.repeatability.value / UM:.3g} µm" in effect


@pytest.mark.parametrize("size", [0.4, 4.0])
def test_several_bad_traces_do_not_hide_each_other(size: float) -> None:
    """Of 60; two are in one direction."""
    values = _values(np.random.default_rng(2), 12, 5)
    bad = [3, 17, 18, 40]
    values[bad] += np.array([size, size, -size, size]) * UM
    found = outlying_rows(values, np.repeat(np.arange(12), 5), _azimuths(12, 5), 1e-7)
    assert sorted(row for outlier in found for row in outlier.rows) == bad


class TestPairs:
    def test_the_fitted_map_tells_which_of_two_is_wrong(self) -> None:
        for row in (8, 9):
            values = _values(np.random.default_rng(3), 12, 2)
            values[row] += 8.0 * UM
            found = outlying_rows(values, np.repeat(np.arange(12), 2), _azimuths(12, 2), 1e-7)
            assert [outlier.rows for outlier in found] == [(row,)]

    def test_both_are_left_out_where_no_map_can_tell(self) -> None:
        values = np.array([3.0, 3.02, 3.1, 3.08, 2.9, 2.93, 3.05, 3.01, 3.0, 9.0]) * UM
        touches = [
            replace(BLANK, trace=f"side{k // 2}_{k % 2}", r1=value)
            for k, value in enumerate(values)
        ]
        found = calibrate_rig(touches)
        assert [outlier.trace for outlier in found.outliers] == ["side4_0", "side4_1"]
        assert "touch the direction again" in found.outliers[0].message
        assert [d.name for d in found.directions] == ["side0", "side1", "side2", "side3"]


def test_single_touches_against_the_map() -> None:
    values = _values(np.random.default_rng(4), 24, 1)
    values[5] += 6.0 * UM
    found = calibrate_rig(_touches(values, 24, 1))
    assert [outlier.trace for outlier in found.outliers] == ["rig_75_1"]
    assert found.outliers[0].distance == pytest.approx(6.0 * UM, rel=0.15)
    assert "from the map" in found.outliers[0].message


class TestExclude:
    def test_a_trace_is_left_out_for_good(self) -> None:
        touches = _touches(_values(np.random.default_rng(1), 12, 5), 12, 5)
        found = calibrate_rig(touches, exclude=["rig_90_3", "rig_0_1.csv"])
        assert found.excluded == ("rig_0_1", "rig_90_3")
        assert (
            found.directions
            == calibrate_rig([t for t in touches if t.trace not in found.excluded]).directions
        )

    def test_an_implausible_trace_can_be_excluded(self) -> None:
        touches = _touches(_values(np.random.default_rng(1), 12, 5), 12, 5)
        touches[7] = replace(touches[7], r1=touches[7].r1 + 1.0)
        with pytest.raises(PretravelError, match="rig_30_3: pretravel") as caught:
            calibrate_rig(touches)
        assert caught.value.inputs == ("exclude",)
        assert calibrate_rig(touches, exclude=["rig_30_3"]).excluded == ("rig_30_3",)

    def test_unknown_labels_and_nothing_left(self) -> None:
        touches = _touches(_values(np.random.default_rng(1), 3, 2), 3, 2)
        with pytest.raises(PretravelError, match="no trace 'rig_5_1'"):
            calibrate_rig(touches, exclude=["rig_5_1"])
        with pytest.raises(PretravelError, match="no trace is left"):
            calibrate_rig(touches, exclude=[t.trace for t in touches])
