"""Runs of levels, bridged gaps and spikes of the ruler, from both sides of each limit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.laboratory.rig_signals import (
    LevelChange,
    _forward_speed,
    _run_around,
    _without_spikes,
    level_changes,
)

TIME = 1e-3 * np.arange(200.0)


def _level(*edges: int, start: bool = True) -> np.ndarray:
    level = np.full(200, start)
    for edge in edges:
        level[edge:] = ~level[edge:]
    return level


@pytest.mark.parametrize(
    ("edges", "changes", "excursions"),
    [
        # The first and the last run of the record count however short they are.
        ((3,), [(3,)], 0), ((197,), [(197,)], 0), ((3, 197), [(3,), (197,)], 0),
        # Two that are settled, and a short one between them.
        ((50, 100), [(50,), (100,)], 0), ((50, 100, 104), [(50,)], 1),
        # Three short runs before the change are its bounce.
        ((50, 52, 55, 120), [(50, 52, 55), (120,)], 0),
        # Two short excursions, one of them with a bounce of its own, and a change.
        ((30, 33, 60, 62, 64, 66, 150), [(150,)], 3),
    ],
)  # fmt: skip
@pytest.mark.parametrize("start", [True, False])
def test_changes_of_a_level(
    edges: tuple[int, ...], changes: list[tuple[int, ...]], excursions: int, start: bool
) -> None:
    found, ignored = level_changes(_level(*edges, start=start), TIME)
    assert found == [LevelChange(c[0], c[-1], c) for c in changes]
    assert ignored == excursions
    assert [change.bounced for change in found] == [len(c) > 1 for c in changes]


@pytest.mark.parametrize(
    ("gaps", "place", "run"),
    [
        ([], 50, (0, 99)),
        ([(0, 10), (90, 100)], 50, (10, 89)),
        ([(0, 10), (40, 46), (90, 100)], 30, (10, 89)),  # six samples are bridged
        ([(0, 10), (40, 47), (90, 100)], 30, (10, 39)),  # seven are not
        ([(0, 10), (40, 47), (90, 100)], 60, (47, 89)),
        ([(40, 47)], 60, (47, 99)),
        ([(40, 47)], 20, (0, 39)),
    ],
)
def test_a_run_bridges_gaps_of_six_samples(
    gaps: list[tuple[int, int]], place: int, run: tuple[int, int]
) -> None:
    inside = np.ones(100, dtype=bool)
    for first, beyond in gaps:
        inside[first:beyond] = False
    assert _run_around(inside, place) == run


@pytest.mark.parametrize(("deviations", "kept"), [(5.9, True), (6.1, False), (-5.9, True)])
def test_a_spike_is_six_deviations_off(deviations: float, kept: bool) -> None:
    """Of the ruler's noise; or, where it is more, of 1.4826 times the median distance from the
    line, which is the size of the waves here."""
    t = np.arange(31.0) - 15.0
    ruler = 3.0 + 0.5 * t
    ruler[8] += deviations * 0.02
    expected = np.ones(31, dtype=bool)
    expected[8] = kept
    assert np.array_equal(_without_spikes(t, ruler, 0.02), expected)
    # As many above the line as below it, one on it: the line is that of zero.
    waves = 0.01 * np.where(np.arange(31) % 2, 1.0, -1.0) * np.sign(t)
    place = int(np.flatnonzero(np.sign(waves) == np.sign(deviations))[3])
    waves[place] *= (0.9 if kept else 1.1) * 6.0 * 1.4826
    assert _without_spikes(t, waves, 0.0)[place] == kept
    assert _without_spikes(t, 3.0 + 0.0 * t, 0.0).all()


def test_the_speed_is_that_from_a_fifth_to_four_fifths_of_the_way() -> None:
    """Of a rod that speeds up evenly from rest, y = 3 + 5 t²: from 0.40 s, the last sample that is
    not above 4 mm, to 0.90 s, the first one that is not below 7 mm, (4.05 - 0.8) / 0.5 mm/s. It
    waits before and after."""
    wait, t = np.zeros(50), 0.05 * np.arange(21)
    time = np.concatenate([np.linspace(-1.0, -0.02, 50), t, 1.0 + np.arange(1, 51)])
    ruler = 3.0 + 5.0 * np.concatenate([wait, t**2, wait + 1.0])
    trace = cast("Any", SimpleNamespace(time=time))
    assert _forward_speed(trace, ruler, 3.0, 8.0) == pytest.approx(6.5, rel=1e-12)
