"""Steps of a latch are found where they are, and not where they are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import (
    five_point_pattern,
    from_angles,
    ring_pattern,
    sphere_pattern_25,
    unit,
)
from pretravel.touches.quantisation import (
    _USUAL_STEPS,
    _common_divisor,
    quantisation_step,
    repeat_step,
)

CENTRE = np.array([412.33371, -87.41922, -301.20517])


def _touches(
    rng: np.random.Generator, directions: FloatArray, repeats: int, noise: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, readings along the normal and directions' numbers, on a sphere of 25 mm."""
    groups = np.repeat(np.arange(len(directions)), repeats)
    normals = directions[groups]
    pretravel = 0.008 + 0.003 * rng.standard_normal(len(directions))
    values = 15.5 - pretravel[groups] + noise * rng.standard_normal(len(groups))
    return CENTRE + rng.random(3) + values[:, None] * normals, values, groups


def _rounded(values: FloatArray, step: float) -> FloatArray:
    return step * np.round(values / step)


@pytest.mark.parametrize("step", [1e-5, 1e-4, 5e-4, 1e-3, 1.25e-3, 5e-3, 0.020 / 4096, 0.00037])
@pytest.mark.parametrize("noise", [0.0001, 0.0003])
def test_a_step_of_the_axes_is_found_in_12_touches(step: float, noise: float) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        directions = unit(rng.standard_normal((12, 3)) * [1, 1, 0.5] + [0, 0, 0.5])
        positions = _touches(rng, directions, 1, noise)[0]
        found = quantisation_step(_rounded(positions, step) + rng.random(3))
        if step < 1e-5 * 0.99:
            assert found == 0.0
        else:
            assert found == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("step", [1e-6, 1e-5, 1e-4])
def test_a_file_in_inches_has_a_step_in_inches(step: float) -> None:
    rng = np.random.default_rng(3)
    positions = _touches(rng, sphere_pattern_25(), 1, 0.0003)[0]
    text = [[f"{value:.{round(-np.log10(step))}f}" for value in row] for row in positions / 25.4]
    found = quantisation_step(25.4 * np.array(text, dtype=float))
    assert found == pytest.approx(25.4 * step, rel=1e-6)


def test_the_latch_is_found_behind_finer_digits() -> None:
    """Latched with 1 µm, the origin shifted, printed with 0.1 µm or with 1e-6 inches."""
    rng = np.random.default_rng(4)
    positions = _rounded(_touches(rng, sphere_pattern_25(), 3, 0.0003)[0], 1e-3)
    shifted = positions + np.array([0.000372, 0.000528, 0.000109])
    for digit in (1e-4, 25.4e-6):
        assert quantisation_step(_rounded(shifted, digit)) == pytest.approx(1e-3, rel=1e-6)


def test_continuous_positions_have_no_step() -> None:
    """180 sets with a level of 1e-4: one false step in 55 such tests."""
    patterns = (
        sphere_pattern_25(),
        unit(np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])),
        from_angles(np.pi / 2, np.arange(24) * np.pi / 12),
    )
    for seed in range(60):
        for directions in patterns:
            rng = np.random.default_rng(seed)
            noise = 10.0 ** rng.uniform(-5.0, -2.5)
            positions, values, groups = _touches(rng, directions, 1 + seed % 4, noise)
            assert quantisation_step(positions) == 0.0
            assert repeat_step(values, groups) == 0.0


def test_patterns_without_noise_have_no_step() -> None:
    for radius in (13.0, 15.492, np.pi):
        positions = radius * sphere_pattern_25()
        assert quantisation_step(positions) == 0.0
        assert quantisation_step(np.repeat(positions, 3, axis=0) + CENTRE) == 0.0
        assert repeat_step(np.full(75, radius), np.repeat(np.arange(25), 3)) == 0.0
    assert quantisation_step([[1.0, 2.0, 3.0]]) == 0.0


@pytest.mark.parametrize("noise", [0.0001, 0.0003, 0.001])
@pytest.mark.parametrize("digits", [1e-12, 1e-4])
def test_a_step_along_the_approach_is_found_in_repeats(noise: float, digits: float) -> None:
    """The latch rounds the travel; positions may be printed with 0.1 µm after it.

    With a scatter of a tenth of the step, a phase of the rounding crosses an edge in about four of
    25 directions: of 20 sets, 1.2 have fewer than two (binomial). A step behind a finer digit needs
    about ten pairs of neighbours that differ, which only a larger scatter has.
    """
    found, false = 0, 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        directions = sphere_pattern_25()
        _, values, groups = _touches(rng, directions, 3, noise)
        travel = _rounded(values, 1e-3)[:, None] * directions[groups]
        positions = _rounded(CENTRE + travel, digits)
        step = repeat_step(np.sum(positions * directions[groups], axis=1), groups)
        found += step == pytest.approx(1e-3, rel=1e-6)
        false += step > 1.01e-3
        if digits < 1e-6:
            assert quantisation_step(positions) == 0.0
    assert false == 0
    assert found >= (17 if digits < 1e-6 or noise > 0.0002 else 0)


def test_twice_the_step_is_no_step() -> None:
    """Behind the last digit 0.1 µm, 1 µm is the largest step; with 2 µm the phases fill an arc."""
    rng = np.random.default_rng(6)
    directions = unit(rng.standard_normal((150, 3)))
    positions = _rounded(_touches(rng, directions, 1, 0.0003)[0], 1e-3) + 0.000341
    assert quantisation_step(_rounded(positions, 1e-4)) == pytest.approx(1e-3, rel=1e-6)


def test_an_unusual_step_is_not_taken_for_a_usual_one_near_it() -> None:
    """All multiples of 1.15 µm up to two lie within 0.16 of a multiple of 1.25 µm."""
    rng = np.random.default_rng(7)
    _, values, groups = _touches(rng, sphere_pattern_25(), 3, 0.0005)
    assert repeat_step(_rounded(values, 0.00115), groups) == pytest.approx(0.00115, rel=1e-6)


@pytest.mark.parametrize("unit_of_display", [1.0, 25.4])
@pytest.mark.parametrize("digit", [1.0, 1.25, 2.0, 2.5, 5.0])
def test_usual_steps_of_scales_are_looked_for(unit_of_display: float, digit: float) -> None:
    """1, 1.25, 2, 2.5 and 5 times powers of ten of mm and inches, from 0.01 um to 5 um."""
    powers = 10.0 ** np.arange(-9, 3)
    wanted = [p for p in unit_of_display * digit * powers if 0.999e-5 <= p <= 5.005e-3]
    assert len(wanted) >= 2
    assert all(min(abs(step / p - 1.0) for step in _USUAL_STEPS) < 1e-9 for p in wanted)
    assert min(_USUAL_STEPS) >= 0.999e-5
    assert max(_USUAL_STEPS) <= 5.005e-3
    assert list(_USUAL_STEPS) == sorted(_USUAL_STEPS, reverse=True)


def test_a_step_above_five_micrometres_is_found_where_it_is_exact() -> None:
    """Displays in hundredths of a millimetre, thousandths of an inch, or what an axis has."""
    rng = np.random.default_rng(8)
    directions = sphere_pattern_25()
    positions = _touches(rng, directions, 1, 0.0003)[0]
    assert quantisation_step(_rounded(positions, 0.005)) == pytest.approx(0.005, rel=1e-6)
    for step in (0.006, 0.012, 0.0254, 0.1):
        assert quantisation_step(_rounded(positions, step)) == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize("step", [0.001, 0.005, 0.01, 0.0254, 0.1])
def test_five_touches_show_the_step_by_their_numbers(step: float) -> None:
    """On an even pattern all differences are those of the radius, which show no step."""
    rng = np.random.default_rng(4)
    touches = 15.4917 * five_point_pattern() + rng.uniform(-400.0, 400.0, 3)
    assert quantisation_step(touches) == 0.0
    assert quantisation_step(_rounded(touches, step)) >= 0.999 * step


@pytest.mark.parametrize("directions", [5, 9, 25])
def test_continuous_touches_of_even_patterns_have_no_large_step(directions: int) -> None:
    """Touches whose pretravel differs by micrometres have nearly the same phases of 127 µm."""
    rng = np.random.default_rng(5)
    n = {5: five_point_pattern(), 9: ring_pattern(np.radians([0.0, 45.0, 90.0]), 4),
         25: sphere_pattern_25()}[directions]  # fmt: skip
    for _ in range(60):
        reach = 15.49 + rng.normal(0.0, 2e-3, len(n))
        assert quantisation_step(n * reach[:, None] + rng.uniform(-400.0, 400.0, 3)) == 0.0


@pytest.mark.parametrize(("reach", "found"), [(0.19, 1e-3), (0.3, 0.0)])
def test_differences_that_are_a_third_of_a_step_off_show_none(reach: float, found: float) -> None:
    """However many there are: 0.2 of a step is the most."""
    rng = np.random.default_rng(2)
    differences = 1e-3 * (rng.integers(1, 60, 400) + reach * rng.uniform(-1.0, 1.0, 400))
    values = np.column_stack([np.zeros(400), differences]).ravel()
    assert repeat_step(values, np.repeat(np.arange(400), 2)) == found


TRIALS = 29
"""Steps that are tried: 1, 1.25, 2, 2.5 and 5 times 0.01, 0.1 and 1 um; the same of 1e-6 and
1e-5 inches, half of a millionth and the two of 1e-4 that are below 5 um; and one found."""


def _spread(arc: float, count: int, seed: int) -> FloatArray:
    """Values near multiples of 1 um: their phases take the whole arc, in turns. [mm]"""
    places = np.cumsum(np.array([7, 13, 4, 11, 23, 5, 17, 3, 19, 8]))[:count]
    phases = np.append([0.0, arc], arc * np.random.default_rng(seed).random(8))[:count]
    return np.asarray(1e-3 * (places + phases))


@pytest.mark.parametrize(("count", "other"), [(10, 5), (4, 10), (7, 7)])
@pytest.mark.parametrize(("margin", "found"), [(0.997, True), (1.003, False)])
def test_chances_of_axes_multiply(count: int, other: int, margin: float, found: bool) -> None:
    """n a^(n - 1) for each axis, with n = 1 + (values - 1) / 2, times the steps tried: 1e-4.

    The second axis has half of the arc. Two values closer than half a step are one.
    """
    free, beside = 0.5 * (count - 1), 0.5 * (other - 1)
    both = (free + 1.0) * (beside + 1.0) * 0.5**beside * TRIALS
    arc = margin * (1e-4 / both) ** (1.0 / (free + beside))
    positions = np.zeros((12, 3))
    positions[:, 0] = np.resize(_spread(arc, count, 1), 12)
    positions[:, 2] = np.resize(_spread(0.5 * arc, other, 2), 12)
    # Beside the first value, and within the arc.
    positions[11, 0] = positions[0, 0] + 0.4e-3 * arc
    expected = pytest.approx(1e-3, rel=1e-9) if found else 0.0
    assert quantisation_step(positions + np.array([0.2, 0.3, 0.7])) == expected


@pytest.mark.parametrize(("reach", "found"), [(17, True), (18, False)])
def test_a_step_that_is_found_is_one_of_as_many_as_the_reach_has(reach: int, found: bool) -> None:
    """Three exact values: 2 a with an arc of rounding, 1e-7; 2e-7 · 17.24 · 29 = 1e-4."""
    positions = np.array([[0.0, 0.0, 0.0], [5e-3, 0.0, 0.0], [reach * 1e-3, 0.0, 0.0]])
    step = quantisation_step(positions + CENTRE)
    assert step == (pytest.approx(1e-3, rel=1e-6) if found else 0.0)


@pytest.mark.parametrize(("reach", "found"), [(80, True), (92, False)])
def test_the_reach_is_that_of_the_longest_axis(reach: int, found: bool) -> None:
    """Two axes with three values whose phases lie in 1e-4 of a step: (2e-4)² · 29 · reach."""
    assert (4e-8 * TRIALS * reach < 1e-4) == found
    axes = [[0.0, 1.0001, reach], [0.0, 1.0, 3.0001], [0.0, 0.0, 0.0]]
    step = quantisation_step(1e-5 * np.array(axes).T)
    assert step == (pytest.approx(1e-5, rel=1e-6) if found else 0.0)


def test_the_latch_has_four_of_the_last_digit_at_least() -> None:
    """Phases 0 and 1/k of a step of 1 um, with a last digit of a k-th: three are no step behind."""
    rng = np.random.default_rng(4)
    for k, seen in ((3, 1e-3 / 3.0), (4, 1e-3), (5, 1e-3)):
        for offset in rng.random(8):
            whole = rng.integers(0, 20_000, (40, 3)) + rng.integers(0, 2, (40, 3)) / k
            found = quantisation_step(1e-3 * whole + offset)
            assert found == pytest.approx(seen, rel=1e-6), k


@pytest.mark.parametrize("differ", [2, 4, 9])
@pytest.mark.parametrize(("margin", "found"), [(0.997, True), (1.003, False)])
def test_chances_of_differences_multiply(differ: int, margin: float, found: bool) -> None:
    """(2 e)^k for k differences, times the steps tried, is 1e-4; small ones do not count."""
    largest = margin * 0.5 * (1e-4 / TRIALS) ** (1.0 / differ)
    off = largest * np.array([0.31, -1.0, 0.73, 0.17, -0.57, 0.93, -0.41, 0.23, 0.11])[:differ]
    gaps = np.array([31, 17, 5, 23, 44, 12, 37, 19, 8])[:differ] + off
    values = np.append(np.cumsum(np.append(0.0, gaps)), gaps.sum() + 0.5 * largest)
    groups = np.zeros(len(values), dtype=int)
    step = repeat_step(1e-3 * np.append(values, 777.77), np.append(groups, 1))
    assert step == (pytest.approx(1e-3, rel=1e-9) if found else 0.0)


@pytest.mark.parametrize(("largest", "found"), [(80, True), (92, False)])
def test_a_step_of_repeats_is_one_of_as_many_as_the_largest_difference_has(
    largest: int, found: bool
) -> None:
    """Two differences that are 1e-4 of a step off: (2e-4)² · 29 · largest."""
    assert (4e-8 * TRIALS * largest < 1e-4) == found
    values = 1e-5 * np.array([0.0, 1.0001, 5.0, 5.0 + largest])
    step = repeat_step(values, [0, 0, 1, 1])
    assert step == (pytest.approx(1e-5, rel=1e-6) if found else 0.0)


def test_two_differences_are_the_fewest_with_a_step() -> None:
    assert repeat_step([0.0, 3e-3, 8e-3], [0, 0, 0]) == pytest.approx(1e-3, rel=1e-9)
    assert repeat_step([0.0, 3e-3, 8e-3], [0, 0, 1]) == 0.0
    assert repeat_step([5.0, 5.0, 8e-3], [0, 0, 1]) == 0.0


def test_a_common_divisor_is_as_exact_as_the_largest_difference() -> None:
    """Of rounded differences of coordinates near 1 m: 1e-13 mm of some metres."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        step = 1e-5 * rng.uniform(1.0, 3.0)
        whole = rng.integers(1, 2_000_000, 30) * rng.integers(1, 40)
        whole = whole // math.gcd(*whole.tolist())
        differences = (step * whole + 1021.7) - 1021.7
        found = _common_divisor(differences * rng.choice([-1.0, 1.0], 30))
        assert found == pytest.approx(step, rel=1e-13 / (step * whole.max()) * 4.0 + 1e-15)
