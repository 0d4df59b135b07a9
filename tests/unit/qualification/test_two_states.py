"""What repeats alike is named by its cause: two states, first touches, hysteresis, drift."""

from __future__ import annotations

import math
import re
from itertools import product

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
from pretravel.qualification.two_states import (
    TwoStates,
    _assignments,
    _axes_of_scatter,
    logarithm_of_columns,
    two_states,
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
def test_other_causes_are_neither(cause: str) -> None:
    for seed in range(6):
        assert "first touch of a direction" not in _said(cause, ROW, seed)
    rng = np.random.default_rng(1)
    shuffled = np.concatenate([rng.permutation(25) for _ in range(3)])
    for groups in (ROW, PASSES, shuffled) if cause != "two states" else ():
        assert not any("one of two" in _said(cause, groups, seed) for seed in range(4))


MOVED = np.array([2.4e-3, -1.5e-3, 0.9e-3])


def _touched(
    share: float = 0.3, directions: int = 60, repeats: int = 4, seed: int = 3
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Touches of a tip that is in the second place with this probability, with unequal repeats."""
    rng = np.random.default_rng(seed)
    groups = np.repeat(np.arange(directions), repeats - np.arange(directions) % 2)
    normals = rng.standard_normal((directions, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True))[groups]
    later = rng.random(len(groups)) < share
    travel = 0.010 + later * (normals @ MOVED) + NOISE * rng.standard_normal(len(groups))
    return travel, normals, groups


def test_movement_share_and_noise_are_found() -> None:
    values, normals, groups = _touched()
    found = two_states(values, normals, groups)
    assert found is not None
    # From 210 touches: the movement to NOISE/sqrt(50), the share to 0.03, the noise to 6 %.
    assert min(np.abs(found.movement - sign * MOVED).max() for sign in (1.0, -1.0)) < 1.5e-4
    assert found.size == pytest.approx(float(np.linalg.norm(MOVED)), abs=1.5e-4)
    assert found.share == pytest.approx(0.3, abs=0.08)
    assert found.noise == pytest.approx(NOISE, rel=0.15)
    one = TwoStates(np.array([3e-3, 0.0, 0.0]), 0.25, 1e-3, 0.0)
    # Of one direction along the movement and one across it: 1 + 0.25 x 0.75 x 9 / 2 µm².
    assert one.variance(np.eye(3)[:2]) == pytest.approx(1.84375e-6)


def test_the_logarithm_is_that_of_all_assignments() -> None:
    """Summed one by one; without a movement it is that of columns without any."""
    values, normals, groups = _touched(directions=20, repeats=3)
    found = two_states(values, normals, groups)
    assert found is not None
    share = found.share
    free, by_assignment = 0, []
    for way in (share, 1.0 - share):  # the second state may be either
        total = 0.0
        free = 0
        for group in range(20):
            own = values[groups == group] - values[groups == group].mean()
            along = float(normals[groups == group][0] @ found.movement)
            terms = []
            for states in product((0.0, 1.0), repeat=len(own)):
                left = own - along * (np.array(states) - np.mean(states))
                later = sum(states)
                prior = way**later * (1.0 - way) ** (len(own) - later)
                terms.append(prior * np.exp(-0.5 * float(left @ left) / found.noise**2))
            total += np.log(sum(terms))
            free += len(own) - 1
        by_assignment.append(total - free * np.log(found.noise) - 2.0 * np.log(free))
    assert found.logarithm == pytest.approx(max(by_assignment), abs=0.01)
    left = np.concatenate([values[groups == g] - values[groups == g].mean() for g in range(20)])
    alone = -0.5 * free * (np.log(float(left @ left) / free) + 1.0)
    nothing = np.zeros((len(values), 0))
    assert logarithm_of_columns(values, nothing, groups) == pytest.approx(alone)
    # A column that explains a trend leaves the noise, and costs half of the logarithm.
    trend = np.arange(len(values), dtype=float)[:, None]
    plain = logarithm_of_columns(values, trend, groups)
    assert logarithm_of_columns(values + 0.5 * trend[:, 0], trend, groups) == pytest.approx(plain)
    assert logarithm_of_columns(values + 0.5 * trend[:, 0], nothing, groups) < plain - 100.0
    assert plain < alone + 3.0
    same = np.ones((len(values), 1))  # of no difference within a direction
    assert logarithm_of_columns(values, same, groups) == pytest.approx(alone - 0.5 * np.log(free))


def test_too_few_directions_and_single_touches_are_no_second_state() -> None:
    few = _touched(directions=7)
    assert two_states(*few) is None
    assert two_states(*_touched(directions=8, repeats=5)) is not None
    assert two_states(*_touched(share=0.05)) is None
    assert two_states(*_touched(directions=9, repeats=12)) is not None  # the first 8 of each


def test_the_search_starts_along_the_movement() -> None:
    axes = _axes_of_scatter(_assignments(*_touched(directions=200)))
    # The squares of 700 touches along six products of normals: 0.97 to 0.999 of 20 draws.
    assert abs(float(axes[0] @ MOVED)) > 0.95 * float(np.linalg.norm(MOVED))
