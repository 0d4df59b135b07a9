"""Step, drift and memory in touches: theorems of Bayes and sums over pairs by brute force."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.observation import Observation
from pretravel.qualification.machine_effects import (
    MachineEffects,
    _memory,
    _memory_warnings,
    _scatter_by_memory,
    machine_effects,
)
from pretravel.qualification.touch_order import (
    between_predecessors,
    estimated_drift,
    estimated_hysteresis,
    relative_times,
)

NORMALS = fibonacci_cap(25, 1.5)
UM = 1e-3  # mm
PASSES = np.concatenate([np.random.default_rng(s).permutation(25) for s in range(4)])
SIZES, SHARES = (0.4 * UM, 1.0 * UM, 3.0 * UM), (0.25, 0.10, 0.02)


def _observation(errors: FloatArray, groups: IntArray) -> Observation:
    positions = NORMALS[groups] * (15.5 - 0.008 - errors)[:, None]
    return Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)


def _with_memory(lateral: float, axial: float, noise: float, seed: int = 0) -> FloatArray:
    n, m = NORMALS[PASSES], np.roll(NORMALS[PASSES], 1, axis=0)
    error = lateral * np.sum((n * m)[:, :2], axis=1) + axial * n[:, 2] * m[:, 2]
    error[0] = 0.0
    return np.asarray(error + noise * np.random.default_rng(seed).standard_normal(100))


def _own_columns(order: FloatArray | IntArray, groups: IntArray) -> FloatArray:
    """Mean columns of each direction's touches, touch by touch."""
    assert np.all(np.diff(order) > 0)
    sums, before = np.zeros((25, 2)), np.zeros(3)
    for group in groups:
        n = NORMALS[group]
        sums[group] += n[0] * before[0] + n[1] * before[1], n[2] * before[2]
        before = n
    return sums / np.bincount(groups)[:, None]


def _effects(errors: FloatArray, groups: IntArray, form: float = 0.0) -> MachineEffects:
    seen = _observation(errors, groups)
    return machine_effects(seen, seen.positions, form)


@pytest.mark.parametrize(
    ("lateral", "axial", "noise"),
    [(2.0, 0.5, 0.3), (0.3, 0.0, 0.6), (0.0, 0.0, 0.3), (0.15, 0.1, 0.5)],
)
def test_a_memory_is_the_mean_of_its_posterior(lateral: float, axial: float, noise: float) -> None:
    """Integrated on a grid: no memory with 63 %, else normal ones of three sizes."""
    seen = _observation(_with_memory(lateral * UM, axial * UM, noise * UM), PASSES)
    order = np.arange(100.0)
    found = estimated_hysteresis(seen.values, seen.directions, PASSES, order)
    expected, moments, share = _memory(seen, np.zeros(100), order)
    like = stats.multivariate_normal(found.value, found.covariance)
    spread = np.sqrt(np.diag(found.covariance))
    axes = [v + s * np.linspace(-7.0, 7.0, 281) for v, s in zip(found.value, spread, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    cell = float(np.prod([axis[1] - axis[0] for axis in axes]))
    prior = sum(
        w * stats.multivariate_normal(np.zeros(2), s**2 * np.eye(2)).pdf(grid)
        for s, w in zip(SIZES, SHARES, strict=True)
    )
    weight = prior * like.pdf(grid) * cell
    nothing = 0.63 * float(like.pdf(np.zeros(2)))
    total = nothing + float(weight.sum())
    assert share == pytest.approx(1.0 - nothing / total, rel=1e-3)
    mean = np.tensordot(weight, grid, 2) / total
    second = np.einsum("ij,ijk,ijl->kl", weight, grid, grid) / total
    assert moments == pytest.approx(second, rel=2e-3, abs=1e-12)
    # In doubt nothing is subtracted.
    assert expected == pytest.approx(mean if share > 0.95 else np.zeros(2), rel=1e-3, abs=1e-9)


def test_what_was_subtracted_is_no_memory() -> None:
    errors = _with_memory(2.0 * UM, 1.0 * UM, 0.3 * UM)
    seen = _observation(errors, PASSES)
    first = _memory(seen, np.zeros(100), np.arange(100.0))[0]
    clean = _memory(seen, _with_memory(2.0 * UM, 1.0 * UM, 0.0), np.arange(100.0))
    assert np.linalg.norm(first - [2.0 * UM, 1.0 * UM]) < 0.4 * UM
    assert clean[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("repeats", "known"), [(5, False), (6, True)])
def test_six_repeats_are_the_fewest_that_tell_of_a_memory(repeats: int, known: bool) -> None:
    groups = np.append(np.arange(25), np.arange(repeats))
    seen = _observation(np.zeros(25 + repeats), groups)
    assert (_memory(seen, np.zeros(25 + repeats), np.arange(25.0 + repeats))[2] > 0.0) is known


def test_without_another_order_a_memory_is_as_likely_as_before() -> None:
    """Passes in one order: a usual memory of 0.4 µm, whose probability is that of all sizes."""
    groups = np.tile(np.arange(25), 3)
    errors = np.tile(1e-4 * np.random.default_rng(1).standard_normal(25), 3)
    seen = _observation(errors, groups)
    expected, moments, share = _memory(seen, np.zeros(75), np.arange(75.0))
    assert expected.tolist() == [0.0, 0.0]
    assert share == pytest.approx(0.37, rel=1e-12)
    assert moments == pytest.approx(0.37 * (0.4 * UM) ** 2 * np.eye(2), rel=1e-12)
    found = _effects(errors, groups)
    assert any("after the same direction every time" in w for w in found.warnings)
    own = _own_columns(np.arange(75), groups)
    square = _scatter_by_memory(seen.group_directions, moments, own, moments)
    assert found.fixed_scatter == pytest.approx(math.sqrt(square), rel=1e-6)


def test_scatter_by_memory_is_a_mean_over_pairs() -> None:
    """Each direction after each, less what the map contains of draws of the memory."""
    rng = np.random.default_rng(2)
    memories = rng.multivariate_normal([0.5, -0.2], [[3.0, -1.0], [-1.0, 2.0]], 40)
    subtracted = memories.mean(axis=0)
    own = rng.uniform(-1.0, 1.0, (25, 2))
    total = 0.0
    for n, in_map in zip(NORMALS, own, strict=True):
        for m in NORMALS:
            columns = np.array([n[0] * m[0] + n[1] * m[1], n[2] * m[2]])
            error = memories @ columns - (memories - subtracted) @ in_map
            total += float(np.mean(error**2))
    moments = memories.T @ memories / 40.0
    left = moments - np.outer(subtracted, subtracted)
    square = _scatter_by_memory(NORMALS, moments, own, left)
    assert square == pytest.approx(total / 625.0, rel=1e-9)


def test_what_is_told_of_a_memory() -> None:
    """Above 95 % its size; above 80 % its root mean square if there is one, and its probability."""
    expected, moments = np.array([0.5, -2.0]) * UM, np.diag([1.0, 3.24]) * UM**2
    assert "hysteresis of about 2.0 µm" in _memory_warnings(0.951, expected, moments)[0]
    (doubt,) = _memory_warnings(0.81, expected, moments)
    assert "about 2.0 µm has a probability of 81%" in doubt
    assert "hysteresis of about" in _memory_warnings(0.949, expected, moments)[0]
    assert "has a probability of" in _memory_warnings(0.949, expected, moments)[0]
    assert len(_memory_warnings(0.801, expected, moments)) == 1
    assert _memory_warnings(0.799, expected, moments) == []
    assert _memory_warnings(0.8, expected, moments) == []
    assert "has a probability of 95%" in _memory_warnings(0.95, expected, moments)[0]


def test_a_sure_memory_is_subtracted_and_scatters() -> None:
    """The change is the memory's columns, zero at the first touch, which has none before it."""
    found = _effects(_with_memory(2.0 * UM, 1.0 * UM, 0.1 * UM), PASSES)
    assert found.hysteresis == pytest.approx([2.0 * UM, 1.0 * UM], abs=0.15 * UM)
    assert found.change == pytest.approx(_with_memory(*found.hysteresis, 0.0), abs=1e-9)
    assert found.drift.tolist() == [0.0, 0.0, 0.0]
    seen = _observation(np.zeros(100), PASSES)
    moments = np.outer(found.hysteresis, found.hysteresis)
    nothing = np.zeros((2, 2))
    square = _scatter_by_memory(seen.group_directions, moments, np.zeros((25, 2)), nothing)
    scatter = math.sqrt(square)
    assert found.fixed_scatter == pytest.approx(scatter, rel=0.05)
    assert [w.partition(":")[0] for w in found.warnings] == ["hysteresis of about 2.0 µm"]


def test_the_form_of_the_sphere_is_uniform_between_its_extremes() -> None:
    groups = np.arange(25)
    found = _effects(np.zeros(25), groups, form=1.2 * UM)
    assert found.fixed_scatter == pytest.approx(1.2 * UM / math.sqrt(12.0), rel=1e-9)
    assert found.change.tolist() == [0.0] * 25
    seen = _observation(np.zeros(25), groups)
    assert machine_effects(seen, seen.positions).fixed_scatter == 0.0


def test_a_step_is_averaged_out_by_noise() -> None:
    """The mean of a rounding with normal noise σ has the amplitude exp(-2 π² σ²/q²) of its first
    harmonic, and the variance goes with its square."""
    rng = np.random.default_rng(3)
    step, centre = 1.0 * UM, np.array([0.1, 0.2, 0.3])
    for noise in (0.0, 0.15 * UM, 0.6 * UM):
        seen = _observation(noise * rng.standard_normal(100), PASSES)
        positions = step * np.round((seen.positions + centre) / step)
        rounded = Observation(positions, PASSES, centre, 12.5, 3.0, False)
        found = machine_effects(rounded, positions)
        assert found.step == pytest.approx(step, rel=1e-6)
        values = rounded.values
        means = np.bincount(PASSES, values) / 4.0
        scatter = math.sqrt(np.sum((values - means[PASSES]) ** 2) / 75.0)
        amplitude = math.exp(-2.0 * (math.pi * scatter / step) ** 2)
        assert found.step_scatter == pytest.approx(amplitude * step / math.sqrt(12.0), rel=1e-6)


def test_a_drift_is_subtracted_below_one_in_a_hundred() -> None:
    """Of the thousand sets with that of the touches, nine at most have so large a drift."""
    order = np.arange(100.0)
    rng = np.random.default_rng(5)
    noise = 0.3 * UM * rng.standard_normal(100)
    drift = NORMALS[PASSES] @ [-1.0, 0.4, 0.5] * relative_times(order)
    seen = {}
    for size in UM * np.linspace(0.6, 0.8, 70):
        errors = noise + size * drift
        found = estimated_drift(errors, NORMALS[PASSES], PASSES, order)
        seen[round(1000.0 * found.p_value)] = errors, found.value
    assert {9, 10} <= set(seen)
    for thousandths in (9, 10):
        errors, value = seen[thousandths]
        expected = -value if thousandths < 10 else np.zeros(3)
        assert _effects(errors, PASSES).drift == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_scatter_between_predecessors_counts_below_one_in_a_hundred() -> None:
    """Beside that of the form and of the memory that is possible; nine of a thousand sets at most
    have as much."""
    passes = np.tile(PASSES, 2)
    order = np.arange(200)
    rng = np.random.default_rng(7)
    noise = 0.3 * UM * rng.standard_normal(200)
    effect = rng.standard_normal((25, 26))[passes, np.append(25, passes[:-1])]
    seen = {}
    for size in UM * np.linspace(0.05, 0.1, 10):
        found = between_predecessors(noise + size * effect, passes, order)
        seen[round(1000.0 * found.p_value)] = noise + size * effect, found.variance
    assert {9, 10} <= set(seen)
    for thousandths in (9, 10):
        errors, variance = seen[thousandths]
        observed = _observation(errors, passes)
        _, moments, share = _memory(observed, np.zeros(200), order.astype(float))
        assert 0.0 < share < 0.95
        own = _own_columns(order, passes)
        expected = _scatter_by_memory(NORMALS, moments, own, moments) + (1.2 * UM) ** 2 / 12.0
        found = _effects(errors, passes, form=1.2 * UM)
        assert not found.drift.any()
        if thousandths < 10:
            expected += variance
        assert found.fixed_scatter**2 == pytest.approx(expected, rel=1e-6)


def test_a_drift_and_a_memory_are_subtracted_together() -> None:
    """Each with its sign: 20 passes, in which one is hardly part of the other."""
    rng = np.random.default_rng(11)
    passes = np.concatenate([rng.permutation(25) for _ in range(20)])
    move, memory = np.array([3.0, -1.0, 2.0]) * UM, np.array([2.0, -1.2]) * UM
    drift = -(NORMALS[passes] @ move) * relative_times(np.arange(500))
    n, m = NORMALS[passes], np.roll(NORMALS[passes], 1, axis=0)
    lateral = memory[0] * np.sum((n * m)[:, :2], axis=1) + memory[1] * n[:, 2] * m[:, 2]
    lateral[0] = 0.0
    found = _effects(drift + lateral + 0.05 * UM * rng.standard_normal(500), passes)
    assert found.drift == pytest.approx(move, abs=0.5 * UM)
    assert found.hysteresis == pytest.approx(memory, abs=0.1 * UM)
    assert found.change == pytest.approx(drift + lateral, abs=0.7 * UM)
    assert [w[:12] for w in found.warnings] == ["the referenc", "hysteresis o"]


def test_of_a_memory_that_is_not_there_nothing_is_told() -> None:
    """Also of one that repeats in a row hardly show, and of touches without repeats."""
    rng = np.random.default_rng(2)
    for groups in (np.repeat(np.arange(25), 3), PASSES, np.arange(25)):
        found = _effects(0.1 * UM * rng.standard_normal(len(groups)), groups)
        assert found.warnings == ()
        assert found.hysteresis.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("lateral", "noise"), [(1.0, 0.1), (0.2, 0.4)])
def test_touches_around_a_probe_show_a_lateral_memory_alone(lateral: float, noise: float) -> None:
    """One coefficient: the posterior by sums of normal densities; nothing is known of the axis."""
    around = from_angles(0.5 * math.pi, np.arange(12) * (math.pi / 6.0))
    rng = np.random.default_rng(3)
    groups = np.concatenate([rng.permutation(12) for _ in range(6)])
    errors = lateral * UM * np.sum(around[groups] * np.roll(around[groups], 1, axis=0), axis=1)
    errors[0] = 0.0
    errors += noise * UM * rng.standard_normal(72)
    positions = around[groups] * (15.5 - errors)[:, None]
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    fit = estimated_hysteresis(seen.values, seen.directions, groups, np.arange(72.0))
    assert fit.determined.tolist() == [True, False]
    value, own = fit.value[0], fit.covariance[0, 0]
    sizes = np.array([0.0, *SIZES])
    weights = np.array([0.63, *SHARES]) * stats.norm.pdf(value, 0.0, np.sqrt(own + sizes**2))
    weights /= weights.sum()
    gain = sizes**2 / (sizes**2 + own)
    expected, moments, share = _memory(seen, np.zeros(72), np.arange(72.0))
    assert share == pytest.approx(1.0 - weights[0], rel=1e-6)
    mean = float(weights @ gain) * value
    assert expected == pytest.approx([mean if share > 0.95 else 0.0, 0.0], rel=1e-6)
    second = float(weights @ ((gain * value) ** 2 + gain * own))
    assert moments == pytest.approx(np.diag([second, 0.0]), rel=1e-6)


def test_a_step_along_the_approach_is_that_of_the_repeats() -> None:
    """The axes do not show it."""
    values = 0.5 * UM * np.random.default_rng(8).standard_normal(100)
    rounded = UM * np.round((15.5 - 0.008 - values) / UM)
    positions = NORMALS[PASSES] * rounded[:, None]
    seen = Observation(positions, PASSES, np.zeros(3), 12.5, 3.0, False)
    assert machine_effects(seen, positions).step == pytest.approx(UM, rel=1e-6)


@pytest.mark.parametrize(("level", "drift"), [(8e-3, 0.0), (0.0, 8e-3)])
def test_another_feed_in_the_last_pass_is_no_drift(level: float, drift: float) -> None:
    """All directions 8 µm later: a drift of 15 µm was said and subtracted."""
    rng = np.random.default_rng(9)
    n = np.tile(sphere_pattern_25(), (3, 1))
    reach = 15.49 - level * (np.arange(75) >= 50) + rng.normal(0.0, 3e-4, 75)
    away = np.linspace(0.0, drift, 75)[:, None] * np.array([0.5, 0.3, 0.8])
    positions = n * reach[:, None] + away
    groups = np.tile(np.arange(25), 3)
    seen = Observation(positions, groups, np.zeros(3), 12.5, 3.0, False)
    found = machine_effects(seen, positions)
    said = " ".join(found.warnings)
    assert ("the pretravel of all directions differs by +8.0 µm" in said) == (level > 0.0)
    assert ("from touch 51 of 75 on" in said) == (level > 0.0)
    assert ("the reference drifted by" in said) == (drift > 0.0)
    assert bool(np.any(found.drift)) == (drift > 0.0)
    # The map is half way between both states, of which a part has either.
    assert found.in_common == pytest.approx(0.5 * level, abs=1e-4)  # noise of the two means


COURSES = {
    "moved": lambda t: np.array([0.05, 0.02, -0.02]) * (t >= 40.0)[:, None],
    "drift": lambda t: np.array([0.02, 0.0, 0.0]) * (t / 75.0)[:, None],
    "wave": lambda t: np.array([0.01, 0.0, 0.0]) * np.sin(2.0 * np.pi * t / 75.0)[:, None],
    "warms up": lambda t: np.array([0.02, 0.0, 0.0]) * (1.0 - np.exp(-t / 12.0))[:, None],
    "two states": lambda t: np.array([0.05, 0.0, 0.0]) * (np.cos(t**2) > 0.3)[:, None],
}


@pytest.mark.parametrize("course", COURSES)
def test_a_reference_that_was_moved_is_named_with_touch_and_shift(course: str) -> None:
    """Two states of a seat explained a sphere that was moved, and `verify` a loose stylus."""
    n = np.tile(sphere_pattern_25(), (3, 1))
    noise = np.random.default_rng(7).normal(0.0, 3e-4, 75)
    at = n * (15.49 + noise)[:, None] + COURSES[course](np.arange(75.0))
    seen = Observation(at, np.tile(np.arange(25), 3), np.zeros(3), 12.5, 3.0, False)
    if course != "moved":
        machine_effects(seen, at)
        return
    with pytest.raises(PretravelError, match=r"touch 41 of 75 on, the reference lies") as error:
        machine_effects(seen, at)
    shift = [float(x) for x in re.findall(r"[-+]\d+\.\d", str(error.value))]
    assert shift == pytest.approx([50.0, 20.0, -20.0], abs=0.5)  # 0.3 µm / sqrt(75 / 6)
