"""Closed forms against numerical integration of the equations that they solve."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad, quad

from pretravel.base.errors import PretravelError
from pretravel.prediction.beam import (
    axial_compliance,
    bending_compliance,
    shear_compliance,
)
from pretravel.prediction.description import StylusSegment
from pretravel.prediction.materials import Material
from pretravel.six_seats.hertz import approach_coefficient, ball_on_flat, ellipticity

MODULUS = 2.0e5


def _surface_displacement(a: float, b: float, load: float, x: float, y: float) -> float:
    """Displacement of a half-space under Hertz's pressure over an ellipse, by Boussinesq.

    Polar coordinates about (x, y) remove the singularity 1/distance.
    """
    peak = 3.0 * load / (2.0 * np.pi * a * b)

    def integrand(s: float, phi: float) -> float:
        u, v = x + s * np.cos(phi), y + s * np.sin(phi)
        return float(np.sqrt(max(1.0 - (u / a) ** 2 - (v / b) ** 2, 0.0)))

    def reach(phi: float) -> float:
        c, s = np.cos(phi), np.sin(phi)
        p = (c / a) ** 2 + (s / b) ** 2
        q = x * c / a**2 + y * s / b**2
        r = (x / a) ** 2 + (y / b) ** 2 - 1.0
        return float((-q + np.sqrt(q**2 - p * r)) / p)

    total, _ = dblquad(integrand, 0.0, 2.0 * np.pi, 0.0, reach, epsabs=1e-7, epsrel=1e-7)
    return peak * total / (np.pi * MODULUS)


@pytest.mark.parametrize("ratio", [1.0, 1.75, 2.3333333333, 6.0])
def test_elliptical_contact_is_hertz_s(ratio: float) -> None:
    """The pressure ellipse that the formula implies bends the half-space to the bodies' shape:
    u(x, y) = delta - x²/2R' - y²/2R'' at the centre and at two points inside."""
    larger, smaller, load = 2.0, 2.0 / ratio, 3.0
    delta = approach_coefficient(larger, smaller, MODULUS) * load ** (2.0 / 3.0)
    axis_ratio = ellipticity(ratio)
    # Half-axes from force and approach: delta = 3 F K(e) / (2 pi E* a).
    from scipy.special import ellipk

    a = 3.0 * load * float(ellipk(1.0 - axis_ratio**2)) / (2.0 * np.pi * MODULUS * delta)
    b = axis_ratio * a
    for x, y in ((0.0, 0.0), (0.5 * a, 0.0), (0.0, 0.5 * b)):
        shape = delta - x**2 / (2.0 * larger) - y**2 / (2.0 * smaller)
        assert _surface_displacement(a, b, load, x, y) == pytest.approx(shape, rel=1e-5)


def test_contact_bears_no_tension() -> None:
    with pytest.raises(PretravelError, match="no tension"):
        ball_on_flat([-1.0], 3.0, MODULUS)
    with pytest.raises(PretravelError, match="no tension"):
        ball_on_flat([1.0, -1.0], 3.0, MODULUS)


@given(st.floats(0.01, 10.0))
def test_approach_grows_with_force_to_two_thirds(force: float) -> None:
    assert ball_on_flat(8.0 * force, 3.0, MODULUS) == pytest.approx(
        4.0 * ball_on_flat(force, 3.0, MODULUS), rel=1e-12
    )


STEEL = Material("s", 2.0e5, 0.3, 7.8e-6)
CARBIDE = Material("c", 6.0e5, 0.22, 1.5e-5)
STEPPED = [
    StylusSegment(9.0, 7.0, STEEL),
    StylusSegment(20.0, 4.5, CARBIDE),
    StylusSegment(12.0, 3.0, STEEL),
]


def test_stepped_bending_by_integrating_curvature() -> None:
    """Unit load theorem: integral of moment² / EI along the beam."""
    total, edges = 0.0, np.cumsum([0.0, *(s.length for s in STEPPED)])
    for segment, start, end in zip(STEPPED, edges, edges[1:], strict=False):
        rigidity = segment.material.youngs_modulus * np.pi * segment.diameter**4 / 64.0
        total += quad(lambda x, r=rigidity: (edges[-1] - x) ** 2 / r, start, end)[0]
    assert bending_compliance(STEPPED) == pytest.approx(total, rel=1e-12)


def test_axial_and_shear_by_hand() -> None:
    one = [StylusSegment(10.0, 2.0, STEEL)]
    area = np.pi
    assert axial_compliance(one) == pytest.approx(10.0 / (2.0e5 * area), rel=1e-12)
    shear_modulus = 2.0e5 / 2.6
    cowper = 6.0 * 1.3 / (7.0 + 6.0 * 0.3)
    assert shear_compliance(one) == pytest.approx(10.0 / (cowper * shear_modulus * area), rel=1e-12)


def test_segments_in_series_add_up() -> None:
    split = [StylusSegment(4.0, 7.0, STEEL), StylusSegment(5.0, 7.0, STEEL), *STEPPED[1:]]
    for compliance in (bending_compliance, shear_compliance, axial_compliance):
        assert compliance(split) == pytest.approx(compliance(STEPPED), rel=1e-12)
