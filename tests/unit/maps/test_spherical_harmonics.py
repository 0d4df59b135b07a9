"""Spherical harmonics of maps: their terms, values, and means over the touches of a direction."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import sph_harm_y

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.maps import spherical_harmonics
from pretravel.maps.observation import Observation, Places
from pretravel.maps.spherical_harmonics import (
    DirectionMeans,
    Smoothing,
    checked_terms,
    degrees_and_orders,
    real_spherical_harmonics,
    sphere_terms,
)


def test_degrees_and_orders_that_a_map_has() -> None:
    given = [[0, 0], [60, -60], [60, 60], [7, -3]]
    found = checked_terms(given)
    assert found.tolist() == given
    assert not found.flags.writeable
    assert checked_terms(np.zeros((0, 2), dtype=int)).shape == (0, 2)
    assert checked_terms(np.array([[3, 1]], dtype=np.uint8)).tolist() == [[3, 1]]


@pytest.mark.parametrize(
    "terms",
    [
        [[61, 0]], [[-1, 0]], [[3, 4]], [[3, -4]], [[3, 1], [2, 0], [3, 1]], [[0.5, 0.0]],
        [[1, 0, 0]], [1, 0], [[[1, 0]]], [[True, False]], [],
    ],
)  # fmt: skip
def test_terms_that_no_map_has(terms: list[object]) -> None:
    with pytest.raises(PretravelError, match=r"degrees 0 to 60 and orders from -degree.*each once"):
        checked_terms(np.array(terms))


def test_harmonics_are_those_of_scipy() -> None:
    """Without the Condon-Shortley phase, real parts of mean square one; others are zero."""
    directions = np.concatenate([fibonacci_cap(200, 3.1), np.eye(3), -np.eye(3)])
    polar = np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2])
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    terms = [(0, 0), (1, 2), (3, 3), (24, 24), (24, 21), (0, -1), (15, -6), (30, 0), (8, -7)]
    found = real_spherical_harmonics(directions, terms)
    for row, (degree, order) in enumerate(terms):
        value = np.sqrt(4.0 * np.pi) * sph_harm_y(degree, abs(order), polar, azimuth)
        if order:
            value = value * (-1.0) ** order * np.sqrt(2.0)
        expected = value.imag if order < 0 else value.real
        assert np.allclose(found[:, row], expected * (abs(order) <= degree), rtol=0.0, atol=1e-12)


def test_harmonics_in_blocks_are_those_of_single_directions():
    directions = fibonacci_cap(9000, 3.0)
    terms = sphere_terms(1000)
    whole = real_spherical_harmonics(directions, terms)
    rows = [0, 4095, 4096, 8999]
    each = np.concatenate([real_spherical_harmonics(directions[r : r + 1], terms) for r in rows])
    assert np.array_equal(whole[rows], each)


def test_blocks_of_directions_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Means, values, weighted sums, leverages and fits of 40 directions with 1 to 3 touches, which
    share their place."""
    n = fibonacci_cap(40, 1.6)
    groups = np.random.default_rng(1).permutation(
        np.repeat(np.arange(40), np.resize([2, 1, 3], 40))
    )
    terms = degrees_and_orders(2)
    rows = real_spherical_harmonics(n, terms)
    monkeypatch.setattr(spherical_harmonics, "_BLOCK", 11)
    means = DirectionMeans(Places(n, np.arange(40), groups), terms)
    count = np.bincount(groups).astype(np.float64)
    assert means.rows() == pytest.approx(rows, abs=1e-12)
    coefficients = np.sin(np.arange(9.0))
    assert means.values(coefficients) == pytest.approx(rows[groups] @ coefficients, abs=1e-12)
    weights = np.cos(np.arange(3.0 * len(groups))).reshape(3, -1)
    assert means.weighted(weights) == pytest.approx(weights @ rows[groups], abs=1e-12)
    half = np.random.default_rng(2).normal(size=(2, 9, 9))
    gains = half @ half.transpose(0, 2, 1)
    classes = (count > 1.0).astype(np.int64)
    smoothing = Smoothing(means, count, gains, classes)
    # Fitted values: the functions times gain times the functions, of each touch's own class.
    leverage = [count[g] * rows[g] @ gains[classes[g]] @ rows[g] for g in range(40)]
    assert smoothing.leverage == pytest.approx(leverage, rel=1e-9)
    values = np.sin(np.arange(float(len(groups))))
    total = np.bincount(groups, values)
    solution = sum(gains[classes[g]] @ rows[g] * total[g] for g in range(40))
    assert smoothing.fitted(values, groups) == pytest.approx(rows[groups] @ solution, rel=1e-9)


@pytest.mark.parametrize("repeats", [[1], [3, 1, 2], [5000, 2], [2, 9000], [4096, 4097]])
def test_means_over_the_touches_of_a_direction(repeats: list[int]) -> None:
    """More touches of one direction than are evaluated together, with normals of their own."""
    generator = np.random.default_rng(3)
    groups = np.repeat(np.arange(len(repeats)), repeats)
    directions = fibonacci_cap(len(repeats), 1.2)[groups] + 0.2 * generator.random((len(groups), 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    seen = Observation(15.49 * directions, groups, np.zeros(3), 12.5, 3.0, ring=False)
    terms = np.array([[0, 0], [2, 1], [3, -3]])
    rows = real_spherical_harmonics(directions, terms)
    expected = np.stack([rows[groups == g].mean(axis=0) for g in range(len(repeats))])
    assert DirectionMeans(seen.places, terms).rows() == pytest.approx(expected, abs=1e-12)
