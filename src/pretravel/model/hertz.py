"""Hertz contact: two elastic bodies pressed together over a small ellipse."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.probe.materials import Material


def contact_modulus(first: Material, second: Material) -> float:
    r"""E* = [(1 - nu1²)/E1 + (1 - nu2²)/E2]^-1. [MPa]

    >>> from pretravel.probe.materials import material
    >>> round(contact_modulus(material("ruby"), material("steel")))
    150987
    """
    return 1.0 / (first.plane_strain_compliance + second.plane_strain_compliance)


def ball_on_flat(force: npt.ArrayLike, radius: float, modulus: float) -> FloatArray:
    r"""Mutual approach of a ball and a flat under normal load.

    Parameters
    ----------
    force : (n,) float
        Compression positive. [N]
    radius : float
        Ball radius. [mm]
    modulus : float
        Contact modulus E*. [MPa]

    Returns
    -------
    (n,) float
        delta = (9 F² / (16 R E*²))^(1/3). [mm]

    References
    ----------
    K. L. Johnson, Contact Mechanics, equation 4.23.

    >>> float(ball_on_flat(1.0, radius=1.5, modulus=3.2e5).round(6))
    0.000154
    """
    f = np.asarray(force, dtype=np.float64)
    if np.any(f < 0.0):
        raise PretravelError("Hertz contact bears no tension: the force must not be negative")
    return np.asarray(np.cbrt(9.0 * f**2 / (16.0 * radius * modulus**2)))


def ellipticity(curvature_ratio: float) -> float:
    """Ratio b/a of the contact ellipse's half-axes.

    Parameters
    ----------
    curvature_ratio : float
        Larger over smaller relative principal curvature, at least 1.

    Returns
    -------
    float
        In (0, 1]; 1 for equal curvatures.

    References
    ----------
    Johnson, equations 4.25 and 4.26: ratio = [(a/b)² E - K] / [K - E] with the
    complete elliptic integrals of modulus e² = 1 - (b/a)².

    >>> ellipticity(1.0)
    1.0
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    if not 1.0 <= curvature_ratio < 1e6:
        raise PretravelError(
            f"relative curvatures in the ratio {curvature_ratio:g}: "
            "Hertz's ellipse needs a ratio between 1 and a million"
        )
    if curvature_ratio - 1.0 < 1e-9:
        return 1.0

    def mismatch(log_axis_ratio: float) -> float:
        ratio = math.exp(log_axis_ratio)
        k, e = ellipk(1.0 - ratio**2), ellipe(1.0 - ratio**2)
        return float(math.log((e / ratio**2 - k) / (k - e)) - math.log(curvature_ratio))

    return math.exp(brentq(mismatch, math.log(1e-6), -1e-6, xtol=1e-14, rtol=1e-14))


def approach_coefficient(larger_radius: float, smaller_radius: float, modulus: float) -> float:
    r"""C in delta = c N^(2/3) for an elliptical contact.

    Parameters
    ----------
    larger_radius, smaller_radius : float
        Relative principal radii of curvature R' and R'', 1/R = 1/R1 + 1/R2 in
        each principal direction. [mm]
    modulus : float
        Contact modulus E*. [MPa]

    Returns
    -------
    float
        [mm/N^(2/3)]

    References
    ----------
    Johnson, equations 4.26a to 4.26c.

    >>> c = approach_coefficient(2.0, 2.0, 3.2e5)  # a ball of 2 mm on a flat
    >>> abs(c - float(ball_on_flat(1.0, 2.0, 3.2e5))) < 1e-15
    True
    """
    from scipy.special import ellipe, ellipk

    if not larger_radius >= smaller_radius > 0.0:
        raise PretravelError(
            f"relative radii {larger_radius:g} and {smaller_radius:g} mm: "
            "both must be positive, the larger one first"
        )
    geometric_mean = math.sqrt(larger_radius * smaller_radius)
    base = (9.0 / (16.0 * geometric_mean * modulus**2)) ** (1.0 / 3.0)
    ratio = ellipticity(larger_radius / smaller_radius)
    if ratio == 1.0:
        return float(base)
    square = 1.0 - ratio**2
    k, e = float(ellipk(square)), float(ellipe(square))
    first = (4.0 / (math.pi * square)) ** (1.0 / 3.0) * math.sqrt(ratio)
    first *= ((e / ratio**2 - k) * (k - e)) ** (1.0 / 6.0)
    return float(base * (2.0 / math.pi) * math.sqrt(ratio) * k / first)


def rod_on_ball_coefficient(rod_radius: float, ball_radius: float, modulus: float) -> float:
    """C in delta = c N^(2/3) for a cylindrical rod resting on a ball: one seat.

    Parameters
    ----------
    rod_radius, ball_radius : float
        [mm]
    modulus : float
        Contact modulus E*. [MPa]

    Returns
    -------
    float
        [mm/N^(2/3)]

    >>> bool(1e-4 < rod_on_ball_coefficient(1.5, 2.0, 3.6e5) < 2e-4)
    True
    """
    return approach_coefficient(
        ball_radius, ball_radius * rod_radius / (ball_radius + rod_radius), modulus
    )
