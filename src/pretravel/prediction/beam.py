"""The stylus as a stepped beam, clamped at the hub, loaded at the tip centre."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import FloatArray
from pretravel.prediction.description import StylusSegment


def second_moment(diameter: float) -> float:
    """Second moment of area of a full circle, pi d⁴ / 64. [mm⁴]

    >>> round(second_moment(4.5), 4)
    20.1289
    """
    return math.pi * diameter**4 / 64.0


def cantilever_compliance(length: float, diameter: float, youngs_modulus: float) -> float:
    """Tip deflection of a uniform cantilever per unit of lateral force.

    Parameters
    ----------
    length, diameter : float
        [mm]
    youngs_modulus : float
        [MPa]

    Returns
    -------
    float
        L³ / (3 E I). [mm/N]

    References
    ----------
    Ren 2020, equation 10; the bending of Rodrigues's "existing method".

    >>> round(cantilever_compliance(18.0, 2.0, 200e3), 6)  # Ren 2020, equation 13
    0.012376
    """
    return length**3 / (3.0 * youngs_modulus * second_moment(diameter))


def bending_compliance(segments: Sequence[StylusSegment]) -> float:
    """Lateral tip deflection per unit lateral tip force, from bending alone.

    Parameters
    ----------
    segments : StylusSegments
        From the clamped end to the tip centre.

    Returns
    -------
    float
        Sum over segments of the integral of (distance to tip)² / (E I). [mm/N]

    >>> from pretravel.prediction.materials import material
    >>> halves = [StylusSegment(25.0, 4.5, material("ceramic"))] * 2
    >>> abs(bending_compliance(halves) / cantilever_compliance(50.0, 4.5, 413e3) - 1) < 1e-14
    True
    """
    compliance, distance = 0.0, sum(segment.length for segment in segments)
    for segment in segments:
        remaining = distance - segment.length
        rigidity = segment.material.youngs_modulus * second_moment(segment.diameter)
        compliance += (distance**3 - remaining**3) / (3.0 * rigidity)
        distance = remaining
    return compliance


def shear_compliance(segments: Sequence[StylusSegment]) -> float:
    """Lateral tip deflection per unit lateral tip force, from shear alone.

    Returns
    -------
    float
        Sum of l / (kappa G A) with Cowper's kappa = 6 (1 + nu) / (7 + 6 nu) of a
        full circle. [mm/N]

    References
    ----------
    G. R. Cowper, J. Appl. Mech. 33 (1966) 335.

    >>> from pretravel.prediction.materials import material
    >>> shear_compliance([StylusSegment(50.0, 4.5, material("ceramic"))]) < 3e-5
    True
    """
    total = 0.0
    for segment in segments:
        nu = segment.material.poissons_ratio
        factor = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)
        area = 0.25 * math.pi * segment.diameter**2
        total += segment.length / (factor * segment.material.shear_modulus * area)
    return total


def axial_compliance(segments: Sequence[StylusSegment]) -> float:
    """Axial tip displacement per unit axial tip force, sum of l / (E A). [mm/N]

    >>> from pretravel.prediction.materials import material
    >>> round(axial_compliance([StylusSegment(50.0, 4.5, material("ceramic"))]) * 1e3, 5)
    0.00761
    """
    return sum(
        segment.length / (segment.material.youngs_modulus * 0.25 * math.pi * segment.diameter**2)
        for segment in segments
    )


def stylus_compliance(segments: Sequence[StylusSegment]) -> FloatArray:
    """Tip displacement per unit of tip force along x, y and z: bending and shear, axial.

    Parameters
    ----------
    segments : StylusSegments
        From the clamped end to the tip centre.

    Returns
    -------
    (3,) float
        [mm/N]

    >>> from pretravel.prediction.materials import material
    >>> x, y, z = stylus_compliance([StylusSegment(50.0, 4.5, material("ceramic"))])
    >>> bool(x == y and z < 0.01 * x)
    True
    """
    lateral = bending_compliance(segments) + shear_compliance(segments)
    return np.array([lateral, lateral, axial_compliance(segments)])
