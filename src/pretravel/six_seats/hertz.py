"""Hertz contact: two elastic bodies that press on each other over a small ellipse."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError


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
        raise PretravelError("a Hertz contact carries no tension: the force must not be negative")
    return np.asarray(np.cbrt(9.0 * f**2 / (16.0 * radius * modulus**2)))


def ellipticity(curvature_ratio: npt.ArrayLike) -> FloatArray:
    """Ratio b/a of the contact ellipse's half-axes.

    Parameters
    ----------
    curvature_ratio : (n,) float
        Larger over smaller relative principal curvature, at least 1.

    Returns
    -------
    (n,) float
        In (0, 1]; 1 for equal curvatures.

    References
    ----------
    Johnson, equations 4.25 and 4.26: ratio = [(a/b)² E - K] / [K - E] with the
    complete elliptic integrals of modulus e² = 1 - (b/a)².

    >>> ellipticity(1.0).tolist()
    1.0
    """
    from scipy.special import ellipe, ellipk

    ratios = np.asarray(curvature_ratio, dtype=np.float64)
    if not np.all((ratios >= 1.0 - 1e-12) & (ratios < 1e6)):
        raise PretravelError(
            f"relative curvatures in the ratio {np.max(ratios):g}: "
            "Hertz's ellipse needs a ratio between 1 and a million"
        )

    def mismatch(log_axis_ratio: FloatArray, log_curvature_ratio: FloatArray) -> FloatArray:
        ratio = np.exp(log_axis_ratio)
        k, e = ellipk(1.0 - ratio**2), ellipe(1.0 - ratio**2)
        return np.asarray(np.log((e / ratio**2 - k) / (k - e)) - log_curvature_ratio)

    round_enough = ratios - 1.0 < 1e-5
    # Below that, b/a = ratio^(-2/3) within 1e-10; the difference of the integrals is noise there.
    result = np.maximum(ratios, 1.0) ** (-2.0 / 3.0)
    if not np.all(round_enough):
        from scipy.optimize.elementwise import find_root  # as long to load as a short command

        wanted = np.where(round_enough, 2.0, ratios)
        bracket = (np.full(ratios.shape, math.log(1e-6)), np.full(ratios.shape, -1e-6))
        found = find_root(
            mismatch, bracket, args=(np.log(wanted),), tolerances={"xatol": 1e-14, "xrtol": 1e-14}
        )
        result = np.where(round_enough, result, np.exp(found.x))
    return np.asarray(result)


def approach_coefficient(
    larger_radius: npt.ArrayLike, smaller_radius: npt.ArrayLike, modulus: float
) -> FloatArray:
    r"""The c in delta = c N^(2/3) for an elliptical contact.

    Parameters
    ----------
    larger_radius, smaller_radius : (n,) float
        Relative principal radii of curvature R' and R'', 1/R = 1/R1 + 1/R2 in
        each principal direction. [mm]
    modulus : float
        Contact modulus E*. [MPa]

    Returns
    -------
    (n,) float
        [mm/N^(2/3)]

    References
    ----------
    Johnson, equations 4.26a to 4.26c.

    >>> c = approach_coefficient(2.0, 2.0, 3.2e5)  # a ball of 2 mm on a flat
    >>> bool(abs(c - ball_on_flat(1.0, 2.0, 3.2e5)) < 1e-15)
    True
    """
    from scipy.special import ellipk

    larger = np.asarray(larger_radius, dtype=np.float64)
    smaller = np.asarray(smaller_radius, dtype=np.float64)
    if not (np.all(larger >= smaller * (1.0 - 1e-12)) and np.all(smaller > 0.0)):
        raise PretravelError(
            f"relative radii {np.min(larger):g} and {np.min(smaller):g} mm: "
            "both must be positive, the larger one first"
        )
    base = np.cbrt(9.0 / (16.0 * np.sqrt(larger * smaller) * modulus**2))
    ratio = ellipticity(np.maximum(larger / smaller, 1.0))
    circle = ratio > _CIRCULAR
    ratio = np.where(circle, 0.5, ratio)
    shape = (2.0 / math.pi) * np.sqrt(ratio) * ellipk(1.0 - ratio**2) / _size_factor(ratio)
    return np.asarray(base * np.where(circle, 1.0, shape))


_CIRCULAR = 1.0 - 1e-5
"""An ellipse that is a circle within 1e-5 has the circle's coefficient within 1e-11."""


def _size_factor(ratio: FloatArray) -> FloatArray:
    """Johnson's F1 of the ratio b/a: half-axes over those of the circle."""
    from scipy.special import ellipe, ellipk

    square = 1.0 - ratio**2
    k, e = ellipk(square), ellipe(square)
    first = np.cbrt(4.0 / (math.pi * square)) * np.sqrt(ratio)
    return np.asarray(first * ((e / ratio**2 - k) * (k - e)) ** (1.0 / 6.0))


def contact_area(
    force: npt.ArrayLike, larger_radius: float, smaller_radius: float, modulus: float
) -> FloatArray:
    """Product a b of the half-axes of the contact's ellipse.

    Parameters
    ----------
    force : (n,) float
        [N]
    larger_radius, smaller_radius : float
        As in `approach_coefficient`. [mm]
    modulus : float
        Contact modulus E*. [MPa]

    Returns
    -------
    (n,) float
        [mm²]

    References
    ----------
    Johnson, equations 4.22 and 4.26.

    >>> float(contact_area(1.0, 3.0, 3.0, 1.5e5).round(6))  # (3 F R / 4 E*)^(2/3)
    0.000608
    """
    ratio = ellipticity(np.maximum(larger_radius / smaller_radius, 1.0))
    factor = np.where(ratio > _CIRCULAR, 1.0, _size_factor(np.where(ratio > _CIRCULAR, 0.5, ratio)))
    radius = math.sqrt(larger_radius * smaller_radius)
    f = np.asarray(force, dtype=np.float64)
    return np.asarray((factor * np.cbrt(0.75 * f * radius / modulus)) ** 2)


def curved_part_factor(ball_radius: float, curvatures: FloatArray) -> FloatArray:
    """Approach of a ball and a curved part, relative to that of the ball and a flat.

    Parameters
    ----------
    ball_radius : float
        [mm]
    curvatures : (n, 2) float
        The part's principal curvatures, convex positive, smaller one first. [1/mm]

    Returns
    -------
    (n,) float
        1 on a flat, more on convex parts; not a number where the ball does not fit
        into a hollow.

    >>> curved_part_factor(3.0, np.array([[0.0, 0.0], [1 / 12.5, 1 / 12.5]])).round(4).tolist()
    [1.0, 1.0743]
    """
    relative = 1.0 / ball_radius + np.asarray(curvatures, dtype=np.float64)
    fits = np.all(np.isfinite(relative), axis=1) & (relative[:, 0] > 0.0)
    factor = np.full(len(relative), np.nan)
    if np.any(fits):
        larger, smaller = 1.0 / relative[fits].T
        # Beyond this, the contact is a line and follows another law.
        larger = np.minimum(larger, 1e5 * smaller)
        factor[fits] = approach_coefficient(larger, smaller, 1.0) / approach_coefficient(
            ball_radius, ball_radius, 1.0
        )
    return factor


@lru_cache(maxsize=1024)
def rod_on_ball_coefficient(rod_radius: float, ball_radius: float, modulus: float) -> float:
    """The c in delta = c N^(2/3) for a cylindrical rod that rests on a ball: one seat.

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
    smaller = ball_radius * rod_radius / (ball_radius + rod_radius)
    return float(approach_coefficient(ball_radius, smaller, modulus))
