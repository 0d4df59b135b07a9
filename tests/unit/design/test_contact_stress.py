"""Pressure and shear at seats and tip, against Hertz in closed form and integrals over the load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from pretravel.base.errors import PretravelError
from pretravel.design.contact_stress import (
    contact_stress,
    highest_shear,
    seat_stress,
    shear_below,
    tip_stress,
)
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import Material, material
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict
from pretravel.six_seats.hertz import approach_coefficient, ellipticity


def _integrated_shear(depth: float, ratio: float, nu: float) -> float:
    """Half of the difference of the principal stresses below the middle of the ellipse, by
    integrating Boussinesq's point loads (Johnson, equation 3.19) over Hertz's pressure; b = 1."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    s, ws = 0.5 * (nodes + 1.0), 0.5 * weights
    s, ws = s**2, 2.0 * s * ws  # denser in the middle
    turns = np.arange(400) * 2.0 * np.pi / 400
    # p = sqrt(1 - s²) at (s cos, s sin) of the unit circle; area a b s ds dturn.
    x = np.outer(s, np.cos(turns)) / ratio
    y = np.outer(s, np.sin(turns))
    load = (np.sqrt(1.0 - s**2) * s * ws)[:, None] / ratio * (2.0 * np.pi / 400)
    r2 = x**2 + y**2
    rho = np.sqrt(r2 + depth**2)
    plane = (1.0 - 2.0 * nu) / r2
    of_z = -3.0 * depth**3 / rho**5
    of_x = plane * ((1.0 - depth / rho) * (x**2 - y**2) / r2 + depth * y**2 / rho**3)
    of_y = plane * ((1.0 - depth / rho) * (y**2 - x**2) / r2 + depth * x**2 / rho**3)
    of_x = of_x - 3.0 * depth * x**2 / rho**5
    of_y = of_y - 3.0 * depth * y**2 / rho**5
    stresses = [float(np.sum(load * each)) / (2.0 * np.pi) for each in (of_x, of_y, of_z)]
    return 0.5 * float(np.ptp(stresses))


@pytest.mark.parametrize("ratio", [1.0, 0.8, 0.35])
@pytest.mark.parametrize("nu", [0.22, 0.3])
def test_shear_below_is_that_of_the_integrated_pressure(ratio: float, nu: float) -> None:
    """The quadrature has four digits."""
    for depth in (0.3, 0.6, 1.1):
        expected = _integrated_shear(depth, ratio, nu)
        assert shear_below(depth, ratio, nu) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(("ratio", "depth", "shear"), [(1e-4, 0.786, 0.300), (1.0, 0.48, 0.310)])
def test_line_and_circle_of_johnson(ratio: float, depth: float, shear: float) -> None:
    """Sections 4.2a and 4.2b, Poisson's ratio 0.3: the printed digits."""
    found = highest_shear(ratio, 0.3)
    assert found[0] == pytest.approx(shear, abs=6e-4)
    assert found[1] == pytest.approx(depth, abs=1e-3)


def test_circle_and_ellipse_join() -> None:
    """Near the circle the terms of the ellipse vanish against each other: the shear changes there
    by 0.03 of the change of the ratio."""
    assert highest_shear(0.99989, 0.3)[0] == pytest.approx(highest_shear(1.0, 0.3)[0], abs=1e-5)


def test_pressure_of_a_ball_in_closed_form() -> None:
    """p0 = (6 F E*² / (π³ R²))^(1/3), 0.48 radii below at ν = 0.3."""
    steel = material("steel")
    force = np.array([0.3, 1.0, 4.0])
    found = contact_stress(force, (3.0, 3.0), (steel, steel))
    modulus = steel.contact_modulus(steel)
    expected = np.cbrt(6.0 * force * modulus**2 / (np.pi**3 * 9.0))
    assert found.pressure == pytest.approx(expected, rel=1e-12)
    radius = np.cbrt(0.75 * force * 3.0 / modulus)
    assert found.depth == pytest.approx(0.4809 * radius, rel=1e-3)
    assert found.shear == pytest.approx(0.3100 * expected, rel=1e-3)
    # Steel of 2 GPa yields at a shear of 2 / 5.6 GPa.
    assert found.share_of_limit == pytest.approx(found.shear * 5.6 / 2000.0, rel=1e-12)


def test_pressure_of_an_ellipse_from_its_approach() -> None:
    """Johnson, equation 4.24: δ = p0 b K(e) / E*, with the δ of `approach_coefficient`."""
    carbide, force = material("tungsten carbide"), 3.3
    larger, smaller = 3.5, 3.5 * 2.75 / 6.25
    modulus = carbide.contact_modulus(carbide)
    found = contact_stress(force, (larger, smaller), (carbide, carbide))
    ratio = float(ellipticity(larger / smaller))
    delta = approach_coefficient(larger, smaller, modulus) * force ** (2 / 3)
    half_axis = (
        1.5
        * force
        / (np.pi * found.pressure)
        / np.sqrt(1.5 * force / (np.pi * found.pressure) / ratio)
    )  # b = ab / a
    expected = found.pressure * half_axis * ellipk(1.0 - ratio**2) / modulus
    assert float(delta) == pytest.approx(float(expected), rel=1e-9)


def test_seats_of_an_omp40() -> None:
    """2.2 GPa at rest, 3.0 GPa at the trigger, beside 12 MPa in the bodies."""
    probe = load_probe("omp40-2")
    rest = seat_stress(probe, seat_statics(probe).rest_reactions)
    assert rest.pressure == pytest.approx(np.full(6, 2200.0), rel=0.01)
    trigger = predict(probe, [[np.cos(a), np.sin(a), 0.0] for a in np.radians([0, 30, 60])])
    touched = seat_stress(probe, trigger.reactions)
    assert touched.pressure.shape == (3, 6)
    assert touched.pressure.max() == pytest.approx(3000.0, rel=0.02)
    assert touched.weaker is probe.tripod.material


def test_the_softer_body_limits_and_the_unknown_does_not() -> None:
    probe = load_probe("omp40-2")
    soft = tip_stress(probe, [1.0], material("aluminium"))
    assert soft.weaker == material("aluminium")
    unknown = Material("x", 70e3, 0.33, 2.7e-6)
    assert tip_stress(probe, [1.0], unknown).weaker is probe.tip.material
    probe = replace(probe, tip=replace(probe.tip, material=unknown))
    nothing = tip_stress(probe, [1.0], unknown)
    assert nothing.weaker is None
    assert np.isnan(nothing.share_of_limit[0])
    with pytest.raises(PretravelError, match="no tension"):
        tip_stress(probe, [-1.0], unknown)
