"""Distances that noise enlarges: values and intervals against drawn errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.drawing.features.largest_distance import largest_distance
from pretravel.uncertainty import EXPANDED_COVERAGE


@pytest.mark.long
@pytest.mark.parametrize("true", [0.0, 2.0, 6.0])
@pytest.mark.parametrize("places", [1, 2])
@pytest.mark.parametrize("sets", [40, pytest.param(200, marks=pytest.mark.slow)])
def test_the_interval_covers_what_is_true(true: float, places: int, sets: int) -> None:
    """Errors of 1 µm in two directions: of all sets 95 %, within four deviations of their count.

    At a true zero the interval is a bound, which is kept in 95 % or more.
    """
    rng = np.random.default_rng(50)
    located = np.zeros((places, 2))
    located[-1, 0] = 0.5e-3 * true
    covered, off, raw = [], [], []
    for _ in range(sets):
        measured = located + 1e-3 * rng.standard_normal((places, 2))
        found = largest_distance(measured, 1e-6 * np.eye(2 * places), math.inf)
        covered.append(found.ends[0] <= 1e-3 * true <= found.ends[1])
        raw.append(2.0 * np.linalg.norm(measured, axis=1).max())
        off.append(found.value - 1e-3 * true)
    assert np.mean(covered) >= 0.95 - 4.0 * math.sqrt(0.05 * 0.95 / sets)
    if true == 0.0:  # of a value that is never negative, some is left
        assert np.mean(off) < 0.6 * np.mean(raw)
    if true == 6.0 and places == 1:  # half of what errors across this distance add, 0.17 µm
        assert abs(np.mean(off)) < 4.0 * np.std(off) / math.sqrt(sets) + 0.08e-3


def test_the_bound_is_no_smaller_than_errors_where_hardly_anything_is_measured() -> None:
    """Rayleigh's distribution: a place that is known to 1 µm is within 2.45 µm with 95 %."""
    found = largest_distance(np.array([[1e-8, 0.0]]), 1e-6 * np.eye(2), math.inf)
    rayleigh = math.sqrt(-2.0 * math.log(1.0 - EXPANDED_COVERAGE))
    assert found.ends[0] == 0.0
    assert found.ends[1] == pytest.approx(2e-3 * rayleigh, rel=0.02)  # a quantile of 8,000 draws


def test_far_from_zero_it_is_the_distance_with_its_linear_uncertainty() -> None:
    for size, near in ((1.0, 1e-9), (0.05, 0.05)):  # in closed form; by quantiles of 8,000 draws
        found = largest_distance(size * np.array([[0.3, 0.4]]), np.diag([1e-6, 4e-6]), math.inf)
        assert found.value == pytest.approx(size, abs=4e-3 * near)
        along = 2.0 * math.sqrt(0.6**2 * 1e-6 + 0.8**2 * 4e-6)
        assert found.u == pytest.approx(along, rel=near)


def test_without_errors_it_is_what_was_measured() -> None:
    found = largest_distance(np.array([[0.3, 0.4]]), np.zeros((2, 2)), math.inf)
    assert (found.value, found.u) == (1.0, 0.0)


@pytest.mark.long
def test_one_of_many_places_is_long_by_chance() -> None:
    """Of 24 places, all 0.2 mm off with an error of 1 µm each, the lower end of the largest was
    above the truth in 45 % of sets; 2.5 % are meant: more than 4 of 24 have a chance of 1 in 5000.
    """
    rng = np.random.default_rng(7)
    above = sum(
        largest_distance(0.1 + 1e-3 * rng.standard_normal((24, 1)), 1e-6 * np.eye(24), np.inf).ends[
            0
        ]
        > 0.2
        for _ in range(24)
    )
    assert above <= 4
