"""Embed and apply undo each other; a noise-free qualification returns its map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.compensation.compensation import apply, embed
from pretravel.directions import fibonacci_cap, grid, sphere_pattern_25, unit
from pretravel.formats.map_file import read_map, write_map
from pretravel.frames import probe_rotation
from pretravel.identification.kinds import qualify
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SectorBasis
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.maps.support import DirectionSupport
from pretravel.probe.catalogue import load_probe
from pretravel.touches import Touches
from pretravel.trigger.predict import predict, predicted_map
from pretravel.uncertainty.covariance import Covariance

CAP = fibonacci_cap(300, np.radians(89.0))
ROTATION = probe_rotation(unit([0.3, -0.2, 0.9]), 0.7)


def _map(kind: str) -> PretravelMap:
    rng = np.random.default_rng(11)
    support = DirectionSupport(
        grid(np.radians(np.arange(0, 91, 10)), np.radians(range(0, 360, 15)))
    )
    basis = {
        "mean": MeanBasis(),
        "sectors": SectorBasis(),
        "harmonic": HarmonicBasis(degrees_and_orders(6)),
        "tabulated": TabulatedBasis(support),
    }[kind]
    half = rng.normal(0.0, 1e-4, (basis.size, basis.size))
    return PretravelMap(
        basis,
        0.010 + rng.normal(0.0, 2e-3, basis.size),
        Covariance.full(half @ half.T),
        support,
        tip_radius=2.0,
        u_tip_radius=1e-4,
        repeatability=3e-4,
        repeatability_dof=50.0,
        rotation=ROTATION,
        feed=50.0,
        provenance=Provenance(source="made up"),
    )


@pytest.mark.parametrize("kind", ["mean", "sectors", "harmonic", "tabulated"])
class TestEveryKind:
    def test_apply_undoes_embed(self, kind: str) -> None:
        pretravel_map = _map(kind)
        rng = np.random.default_rng(3)
        normals = CAP @ ROTATION.T
        points = rng.uniform(-500.0, 500.0, normals.shape)
        approaches = unit(-normals + rng.uniform(-0.5, 0.5, normals.shape))
        for way in (None, approaches):
            touches = embed(points, normals, pretravel_map, approaches=way)
            back = apply(touches, pretravel_map).positions
            # Coordinates of 500 mm have 1e-13 mm to lose.
            assert np.abs(back - points).max() < 1e-12

    def test_saving_changes_nothing(self, kind: str, tmp_path: Path) -> None:
        pretravel_map = _map(kind)
        write_map(tmp_path / "map.nc", pretravel_map)
        back = read_map(tmp_path / "map.nc")
        assert back.kind == kind
        normals = CAP @ ROTATION.T
        assert np.array_equal(back.pretravel(normals), pretravel_map.pretravel(normals))
        assert np.array_equal(
            back.standard_uncertainty(normals), pretravel_map.standard_uncertainty(normals)
        )
        for name in ("tip_radius", "u_tip_radius", "repeatability", "repeatability_dof", "feed"):
            assert getattr(back, name) == getattr(pretravel_map, name)
        assert back.provenance == pretravel_map.provenance

    def test_uncertainty_is_the_covariance_s_diagonal(self, kind: str) -> None:
        pretravel_map = _map(kind)
        normals = CAP[:40] @ ROTATION.T
        covariance = pretravel_map.value_covariance(normals)
        u = pretravel_map.standard_uncertainty(normals)
        assert np.allclose(np.sqrt(np.diag(covariance)), u, rtol=1e-9)
        assert np.linalg.eigvalsh(covariance).min() > -1e-18

    def test_embedding_adds_up_along_the_approach(self, kind: str) -> None:
        """P = T + r n + s a, with s = pretravel / |a·n|: computed here by hand, row by row."""
        pretravel_map = _map(kind)
        normals = CAP[:20] @ ROTATION.T
        tilt = unit(-normals + 0.2)
        touches = embed(np.zeros((20, 3)), normals, pretravel_map, approaches=tilt)
        for n, a, p in zip(normals, tilt, touches.positions, strict=True):
            s = float(pretravel_map.pretravel(n[None])[0]) / abs(float(a @ n))
            assert np.allclose(p, 2.0 * n + s * a, atol=1e-14)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
@pytest.mark.parametrize("repeats", [1, 3])
def test_noise_free_qualification_returns_a_harmonic_map(
    repeats: int, axis: tuple[float, float, float]
) -> None:
    """A band-limited map, touched without noise in more directions than it has coefficients,
    comes back to 1 nm: the regression's floor of noise is 0.01 nm, a cap's conditioning does
    the rest. What touches cannot tell is given: the map has no first harmonic across the axis, and
    its pretravel at the pole is told."""
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
    first harmonic over the twelve touches, so the centring takes nothing away; 9 µm off
    centre leave 4 nm of second order (9² / 2·22 000)."""
    azimuth = np.radians(np.arange(0.0, 360.0, 30.0))
    n = -grid(np.pi / 2.0, azimuth)
    n[:, 2] = 0.0
    table = 0.010 + 0.002 * np.cos(2.0 * azimuth) - 0.001 * np.cos(4.0 * azimuth)
    touches = Touches([off, 0.0, 0.0] - n * (25.0 - 3.0 + table)[:, None], n)
    result = qualify(touches, 50.0, tip_diameter=6.0, kind="sectors", ring=True)
    limit = 1e-9 if off == 0.0 else 5e-6
    assert np.abs(result.pretravel_map.pretravel(n) - table).max() < limit
    assert result.center[0] == pytest.approx(off, abs=limit)


@settings(max_examples=8)
@given(st.integers(0, 10_000))
def test_frame_invariance_of_a_qualification(seed: int) -> None:
    """Touches, axis and all turned and shifted together give the same map and radius."""
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
