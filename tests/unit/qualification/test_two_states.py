"""What repeats alike is named by its cause: two states, first touches, hysteresis, drift."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from benchmarks.departures.patterns import USUAL_25
from pretravel.maps.observation import Observation
from pretravel.qualification.machine_effects import machine_effects
from pretravel.qualification.touch_order import (
    hysteresis_columns,
    predecessors,
    previous_directions,
)

NOISE, APART = 3e-4, 4e-3
ROW, PASSES = np.repeat(np.arange(25), 3), np.tile(np.arange(25), 3)


def _said(cause: str, groups: np.ndarray, seed: int) -> str:
    """The warnings for a sphere of 25 mm and a pretravel of 10 µm."""
    rng = np.random.default_rng(seed)
    normals, order = USUAL_25[groups], np.arange(len(groups))
    moved = normals @ (APART * np.array([0.8, 0.5, 0.3]))
    before = previous_directions(normals, predecessors(order))
    travel = 0.010 + NOISE * rng.standard_normal(len(groups))
    if cause == "two states":
        travel += rng.integers(0, 2, len(groups)) * moved
    elif cause == "drift":
        travel += moved * order / len(groups)
    elif cause == "hysteresis":
        travel += hysteresis_columns(normals, before)[:, :2] @ np.array([APART, 0.0])
    elif cause == "first touches":
        travel += 2e-3 * np.append(True, groups[1:] != groups[:-1])
    elif cause == "heavy tails":
        travel += 1.5 * APART * NOISE / 3e-4 * (rng.random(len(groups)) < 0.05)
    positions = normals * (12.5 + 3.0 - travel)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    return " ".join(machine_effects(seen, positions).warnings)


@pytest.mark.parametrize("groups", [ROW, PASSES], ids=["in a row", "in passes"])
def test_two_states_are_named(groups: np.ndarray) -> None:
    """4 µm apart, either one by chance; nothing is subtracted for another cause."""
    said = [_said("two states", groups, seed) for seed in range(10)]
    named = [words for words in said if "one of two places" in words]
    assert len(named) >= 9
    assert not any("hysteresis of about" in words or "drifted" in words for words in named)


def test_first_touches_that_are_apart_are_named() -> None:
    """By 2 µm (25 first touches and 50 others: within four u); it was called a hysteresis."""
    u = NOISE * math.sqrt(1.0 / 25.0 + 1.0 / 50.0)
    for seed in range(6):
        said = _said("first touches", ROW, seed)
        found = re.match(r"the first touch of a direction has ([0-9.]+) µm more pretravel", said)
        assert found is not None
        assert float(found[1]) == pytest.approx(2.0, abs=4e3 * u)
        assert not re.search("touches depend on the direction|one of two places", said)


@pytest.mark.parametrize("cause", ["nothing", "drift", "hysteresis", "heavy tails", "two states"])
def test_other_causes_are_not_first_touches(cause: str) -> None:
    for seed in range(6):
        assert "first touch of a direction" not in _said(cause, ROW, seed)


@pytest.mark.parametrize("cause", ["nothing", "drift", "hysteresis", "heavy tails"])
def test_other_causes_are_not_two_states(cause: str) -> None:
    rng = np.random.default_rng(1)
    shuffled = np.concatenate([rng.permutation(25) for _ in range(3)])
    for groups in (ROW, PASSES, shuffled):
        assert not any("one of two" in _said(cause, groups, seed) for seed in range(4))
