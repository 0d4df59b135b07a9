"""Angles, frames, harmonics and supports have no seam and no pole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pretravel.base.directions import (
    azimuth_angle,
    checked_unit,
    fibonacci_cap,
    from_angles,
    grid,
    polar_angle,
    sphere_pattern_25,
    unit,
)
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics
from pretravel.maps.support import DirectionSupport

angles = st.floats(0.0, 2.0 * np.pi, exclude_max=True)


@given(st.floats(1e-9, np.pi - 1e-9), angles)
def test_angles_round_trip(polar: float, azimuth: float) -> None:
    direction = from_angles(polar, azimuth)
    assert polar_angle(direction)[0] == pytest.approx(polar, abs=1e-15 / np.sin(polar) + 1e-15)
    difference = np.mod(azimuth_angle(direction)[0] - azimuth + np.pi, 2.0 * np.pi) - np.pi
    assert abs(difference) < 1e-14


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1), angles)
def test_rotations_are_rotations(axis: tuple[float, float, float], turn: float) -> None:
    a = unit(axis)
    rotation = probe_rotation(a, turn)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(rotation @ [0.0, 0.0, 1.0], a, atol=1e-12)


def test_a_turn_is_counter_clockwise_about_the_axis() -> None:
    assert np.allclose(probe_rotation((0, 0, 1), np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize("tilt", [1e-3, 1e-5, 2e-6, 1e-9])
def test_nearly_upside_down_keeps_its_digits(tilt: float) -> None:
    rotation = probe_rotation(unit([tilt, 0.3 * tilt, -1.0]), 0.4)
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)


def test_upside_down_is_a_rotation_too() -> None:
    rotation = probe_rotation((0.0, 0.0, -1.0))
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert np.allclose(rotation @ [0.0, 0.0, 1.0], [0.0, 0.0, -1.0])


def test_harmonics_are_orthonormal_over_the_sphere() -> None:
    """Gauss-Legendre in z and equal steps in azimuth integrate degree 30 exactly."""
    z, weight = np.polynomial.legendre.leggauss(16)
    directions = grid(np.arccos(z), np.arange(40) * np.pi / 20.0)
    weights = np.repeat(weight, 40) / 80.0
    design = real_spherical_harmonics(directions, degrees_and_orders(12))
    assert np.allclose((design * weights[:, None]).T @ design, np.eye(169), atol=1e-12)


def test_first_harmonics_are_the_coordinates() -> None:
    """Holds also at the poles, where the angles end."""
    d = np.concatenate([fibonacci_cap(50, np.pi), [[0, 0, 1.0], [0, 0, -1.0]]])
    design = real_spherical_harmonics(d, [(1, 1), (1, -1), (1, 0)])
    assert np.allclose(design, np.sqrt(3.0) * d, atol=1e-14)


class TestSupport:
    def test_pattern_of_25_supports_the_hemisphere(self) -> None:
        support = DirectionSupport(sphere_pattern_25())
        inside = fibonacci_cap(2000, np.radians(90.0))
        outside = grid(np.radians([96.0, 120.0, 179.0, 180.0]), np.radians(range(0, 360, 9)))
        assert support.supports(inside).all()
        assert not support.supports(outside).any()

    def test_the_equator_belongs_to_it_between_the_touches_too(self) -> None:
        """Holds also four degrees below: the margin is five degrees everywhere along the edge."""
        support = DirectionSupport(sphere_pattern_25())
        for polar in (90.0, 94.0):
            assert support.supports(grid(np.radians(polar), np.radians(range(360)))).all()

    def test_a_sixth_of_the_circle_does_not_support_the_rest(self) -> None:
        support = DirectionSupport(
            grid(np.radians(np.arange(10, 91, 10)), np.radians(np.arange(0, 61, 10)))
        )
        supported = support.supports(
            from_angles(np.radians([90, 45, 45, 90]), np.radians([35, 30, 70, 200]))
        )
        assert supported.tolist() == [True, True, False, False]

    def test_a_ring_does_not_support_the_pole(self) -> None:
        support = DirectionSupport(grid(np.pi / 2, np.radians(range(0, 360, 30))))
        supported = support.supports(grid(np.radians([90, 86, 80, 0]), [0.26]))
        assert supported.tolist() == [True, True, False, False]

    def test_a_wide_hole_is_a_hole(self) -> None:
        """Three directions up to 60° from their centre support it: a circle through them."""
        for polar, expected in ((60.5, False), (59.5, True)):
            support = DirectionSupport(grid(np.radians(polar), np.radians([0.0, 120.0, 240.0])))
            assert support.supports([[0.0, 0.0, 1.0]])[0] == expected

    @pytest.mark.long
    @given(st.floats(0.0, 90.0), st.floats(0.0, 360.0), st.floats(0.0, 6.3))
    def test_interpolation_has_no_seam(self, polar: float, azimuth: float, way: float) -> None:
        """Two directions a microradian apart get values a microradian's slope apart; nodes
        every 5° of a function with slope below 3."""
        nodes = grid(np.radians(np.arange(0, 91, 5)), np.radians(np.arange(0, 360, 5)))
        nodes = np.unique(nodes.round(12), axis=0)
        basis = TabulatedBasis(DirectionSupport(nodes))
        values = nodes[:, 0] ** 2 + nodes[:, 1] * nodes[:, 2] - nodes[:, 2]
        here = from_angles(np.radians(polar), np.radians(azimuth))
        across = np.cross(here, unit([np.cos(way), np.sin(way), 0.3]))
        there = unit(here + 1e-6 * across)
        a, b = (basis.design(d) @ values for d in (here, there))
        assert abs(a[0] - b[0]) < 1e-5

    def test_interpolation_error_falls_with_the_square_of_the_spacing(self) -> None:
        check = fibonacci_cap(3000, np.radians(89.0))

        def f(d: np.ndarray) -> np.ndarray:
            return d[:, 0] ** 3 + d[:, 1] * d[:, 2]

        errors = []
        for step in (10, 5, 2.5):
            nodes = grid(np.radians(np.arange(0, 90.1, step)), np.radians(np.arange(0, 360, step)))
            nodes = np.unique(nodes.round(12), axis=0)
            basis = TabulatedBasis(DirectionSupport(nodes))
            found, weights, _ = basis.support.interpolation(check)
            error = np.sum(f(nodes)[found] * weights, axis=1) - f(check)
            errors.append(np.sqrt(np.mean(error**2)))
        rates = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all(rates > 1.8), rates


def test_lengths_are_checked() -> None:
    with pytest.raises(PretravelError, match="row 2 has length 0"):
        checked_unit([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    with pytest.raises(PretravelError, match="shape"):
        checked_unit([0.0, 0.0, 1.0])
    with pytest.raises(PretravelError, match="length nan"):
        checked_unit([[np.nan, 0.0, 1.0]])
