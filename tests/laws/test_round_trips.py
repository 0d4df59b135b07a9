"""A noise-free qualification returns its map, in every frame."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.base.directions import fibonacci_cap, grid, sphere_pattern_25, unit
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.touches import Touches
from tests.support.plain_qualification import qualify_plainly as qualify


@pytest.mark.long
@pytest.mark.parametrize(
    ("repeats", "axis"),
    [(3, (1.0, 0.0, 0.0)), pytest.param(1, (0.0, 0.0, 1.0), marks=pytest.mark.slow)],
)
def test_noise_free_qualification_returns_a_harmonic_map(
    repeats: int, axis: tuple[float, float, float]
) -> None:
    """A band-limited map, touched without noise in more directions than it has coefficients,
    is reproduced to 1 nm: the noise floor of the regression is 0.01 nm, and the rest is due to
    the conditioning of a cap. The quantities that touches cannot determine are given: the map has
    no first harmonic across the axis, and its pretravel at the pole is stated."""
    rng = np.random.default_rng(2)
    rotation = probe_rotation(axis)
    basis = HarmonicBasis(degrees_and_orders(5))
    coefficients = rng.normal(0.0, 1e-3, basis.size) / (1.0 + basis.terms[:, 0])
    coefficients[0] = 0.020
    directions = fibonacci_cap(600, np.radians(100.0))
    for term in ((1, 1), (1, -1)):
        coefficients[(basis.terms == term).all(axis=1)] = 0.0
    n = np.repeat(directions, repeats, axis=0)
    center = np.array([300.0, -40.0, 12.0])
    distance = 15.5 - basis.design(n) @ coefficients
    touches = Touches(center + (n @ rotation.T) * distance[:, None], n @ rotation.T)
    pole = (basis.design(np.array([[0.0, 0.0, 1.0]])) @ coefficients).item()
    result = qualify(touches, 25.0, tip_diameter=6.0, axis=axis, axial_pretravel=pole)
    check = fibonacci_cap(500, np.radians(95.0))
    found = result.pretravel_map.pretravel(check @ rotation.T)
    assert np.abs(found - basis.design(check) @ coefficients).max() < 1e-6
    assert np.allclose(result.center, center, atol=1e-6)
    assert np.abs(result.residuals).max() < 1e-6


def test_noise_free_mean_returns_the_mean() -> None:
    n = sphere_pattern_25()
    touches = Touches(np.array([5.0, 6.0, 7.0]) + n * (15.5 - 0.0123), n)
    result = qualify(touches, 25.0, tip_diameter=6.0, kind="mean")
    assert np.allclose(result.center, [5.0, 6.0, 7.0], atol=1e-9)
    assert result.pretravel_map.coefficients[0] == pytest.approx(0.0123, abs=1e-9)
    assert result.effective_radius == pytest.approx(3.0 - 0.0123, abs=1e-9)


@pytest.mark.parametrize("off", [0.0, 0.009])
def test_noise_free_sectors_return_the_table(off: float) -> None:
    """A ring touched at the twelve angles of the table, centred or not. The pretravel has no
    first harmonic over the twelve touches, so the centring does not change it; an offset of 9 µm
    leaves 4 nm of second order (9² / 2·22 000)."""
    azimuth = np.radians(np.arange(0.0, 360.0, 30.0))
    n = -grid(np.pi / 2.0, azimuth)
    n[:, 2] = 0.0
    table = 0.010 + 0.002 * np.cos(2.0 * azimuth) - 0.001 * np.cos(4.0 * azimuth)
    touches = Touches([off, 0.0, 0.0] - n * (25.0 - 3.0 + table)[:, None], n)
    result = qualify(touches, 50.0, tip_diameter=6.0, kind="sectors", ring=True)
    limit = 1e-9 if off == 0.0 else 5e-6
    assert np.abs(result.pretravel_map.pretravel(n) - table).max() < limit
    assert result.center[0] == pytest.approx(off, abs=limit)


@pytest.mark.long
@settings(max_examples=8)
@given(st.integers(0, 10_000))
def test_frame_invariance_of_a_qualification(seed: int) -> None:
    """Touches and axis, turned and shifted together, give the same map and radius."""
    rng = np.random.default_rng(seed)
    n = sphere_pattern_25()
    pretravel = 0.015 + rng.normal(0.0, 1e-3, 25)
    plain = qualify(
        Touches(n * (15.5 - pretravel)[:, None], n), 25.0, tip_diameter=6.0, kind="mean"
    )
    axis = unit(rng.normal(size=3))
    rotation = probe_rotation(axis)
    shift = rng.uniform(-300.0, 300.0, 3)
    turned = Touches(shift + (n @ rotation.T) * (15.5 - pretravel)[:, None], n @ rotation.T)
    other = qualify(turned, 25.0, tip_diameter=6.0, kind="mean", axis=axis)
    assert other.effective_radius == pytest.approx(plain.effective_radius, abs=1e-9)
    assert np.allclose(other.center, shift + rotation @ plain.center, atol=1e-9)
    assert np.allclose(other.residuals, plain.residuals, atol=1e-9)
    turned_back = rotation.T @ other.center_covariance @ rotation
    assert np.allclose(turned_back, plain.center_covariance, atol=1e-15)


def test_a_ring_s_centring_is_taken_off() -> None:
    azimuth = np.radians(np.arange(0.0, 360.0, 5.0))
    n = -grid(np.pi / 2.0, azimuth)
    n[:, 2] = 0.0
    pretravel = 0.030 + 0.004 * np.cos(3.0 * (azimuth - 0.3))
    center = np.array([0.009, -0.004, 5.0])
    touches = Touches(center - n * (22.0 + pretravel)[:, None], n)
    result = qualify(touches, 50.0, tip_diameter=6.0, ring=True)
    assert np.allclose(result.center, center, atol=2e-6)  # second order: 10 um² / 22 mm
    error = result.pretravel_map.pretravel(n) - pretravel
    assert np.abs(error).max() < 5e-6


def test_a_predicted_map_returns_its_nodes() -> None:
    probe = load_probe("omp40-2")
    trigger = predict(probe, grid(np.radians(np.arange(0, 91, 15)), np.radians(range(0, 360, 15))))
    pretravel_map = predicted_map(probe, trigger)
    assert np.allclose(pretravel_map.pretravel(trigger.directions), trigger.pretravel, atol=1e-15)
