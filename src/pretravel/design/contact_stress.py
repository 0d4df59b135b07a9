"""Pressure and shear at the contacts of seats and tip: what the bodies carry where they touch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.prediction import Material, Probe
from pretravel.six_seats import contact_area, ellipticity

_DEEPEST = 2.0
"""Depth, in the smaller half-axis, above which the shear is highest in any ellipse."""


_ROUNDING = 1e-12  # N: the reaction of a seat that opens is zero but for rounding


@dataclass(frozen=True, eq=False)
class ContactStress:
    """The stress of one Hertz contact under several forces.

    Attributes
    ----------
    force : (n,) float
        [N]
    pressure : (n,) float
        In the middle of the contact, where it is highest. [MPa]
    shear : (n,) float
        The highest shear stress, below the middle. [MPa]
    depth : (n,) float
        Where it is. [mm]
    share_of_limit : (n,) float
        The highest shear over the one at which the weaker body yields; not a number where no
        hardness is known.
    weaker : Material or None
        The body that yields first.
    """

    force: FloatArray
    pressure: FloatArray
    shear: FloatArray
    depth: FloatArray
    share_of_limit: FloatArray
    weaker: Material | None


def contact_stress(
    force: npt.ArrayLike,
    radii: tuple[float, float],
    bodies: tuple[Material, Material],
) -> ContactStress:
    """Stress of two bodies that press on each other over a small ellipse.

    Parameters
    ----------
    force : (n,) float
        Compression positive. [N]
    radii : two floats
        Relative principal radii of curvature, the larger one first. [mm]
    bodies : two Materials

    Raises
    ------
    PretravelError
        A negative force.

    Notes
    -----
    A body yields where its highest shear reaches half of its yield strength (Tresca), which is
    the hardness over 2.8 (Tabor): in a circle at a pressure of 0.57 of the hardness.

    References
    ----------
    K. L. Johnson, Contact Mechanics, equations 3.71, 4.24 to 4.26 and section 6.1.

    >>> from pretravel.prediction.materials import material
    >>> ball = contact_stress([1.0], (3.0, 3.0), (material("ruby"), material("steel")))
    >>> [round(float(part[0]), 4) for part in (ball.pressure, ball.depth)]
    [788.4598, 0.0118]
    """
    f = np.asarray(force, dtype=np.float64)
    if np.any(f < -_ROUNDING):
        raise PretravelError("a Hertz contact carries no tension: the force must not be negative")
    f = np.maximum(f, 0.0)
    larger, smaller = radii
    ratio = float(ellipticity(larger / smaller))
    area = contact_area(f, larger, smaller, bodies[0].contact_modulus(bodies[1]))
    loaded = area > 0.0
    pressure = np.where(loaded, 1.5 * f / (math.pi * np.where(loaded, area, 1.0)), 0.0)
    half_axis = np.sqrt(area * ratio)
    shears = [highest_shear(ratio, body.poissons_ratio) for body in bodies]
    worst = int(np.argmax([shear for shear, _ in shears]))
    limits = [
        (shear / body.shear_at_yield, body)
        for (shear, _), body in zip(shears, bodies, strict=True)
        if body.shear_at_yield is not None
    ]
    used, weaker = max(limits, key=lambda each: each[0]) if limits else (math.nan, None)
    return ContactStress(
        force=frozen(f),
        pressure=frozen(pressure),
        shear=frozen(shears[worst][0] * pressure),
        depth=frozen(shears[worst][1] * half_axis),
        share_of_limit=frozen(used * pressure),
        weaker=weaker,
    )


def seat_stress(probe: Probe, force: npt.ArrayLike) -> ContactStress:
    """Stress of a rod and a ball of the seats under these forces.

    Parameters
    ----------
    probe : Probe
    force : (n,) float
        Of seats. [N]

    >>> from pretravel.prediction.catalogue import load_probe
    >>> rest = seat_stress(load_probe("omp40-2"), [2.15])
    >>> bool(2000.0 < rest.pressure[0] < 2500.0)
    True
    """
    ball, rod = probe.seats.ball_radius, probe.tripod.rod_radius
    return contact_stress(
        force, (ball, ball * rod / (ball + rod)), (probe.tripod.material, probe.seats.material)
    )


def tip_stress(probe: Probe, force: npt.ArrayLike, workpiece: Material) -> ContactStress:
    """Stress of the tip and a flat part under these forces.

    Parameters
    ----------
    probe : Probe
    force : (n,) float
        On the tip. [N]
    workpiece : Material

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.materials import material
    >>> touched = tip_stress(load_probe("omp40-2"), [1.0], material("aluminium"))
    >>> touched.weaker.name
    'aluminium'
    """
    radius = probe.tip.radius
    return contact_stress(force, (radius, radius), (probe.tip.material, workpiece))


@lru_cache(maxsize=256)
def highest_shear(ratio: float, poissons_ratio: float) -> tuple[float, float]:
    """The highest shear below an elliptical contact, and its depth.

    Parameters
    ----------
    ratio : float
        b/a of the half-axes, in (0, 1].
    poissons_ratio : float

    Returns
    -------
    shear : float
        In the highest pressure.
    depth : float
        In the smaller half-axis b.

    References
    ----------
    Johnson, Table 4.1: 0.310 at 0.48 for a circle, 0.30 at 0.79 for a line (Poisson's ratio 0.3).

    >>> [round(number, 2) for number in highest_shear(1.0, 0.3)]
    [0.31, 0.48]
    """
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda depth: -shear_below(depth, ratio, poissons_ratio),
        bounds=(1e-3, _DEEPEST),
        method="bounded",
        options={"xatol": 1e-7},
    )
    return -float(found.fun), float(found.x)


def shear_below(depth: float, ratio: float, poissons_ratio: float) -> float:
    """Highest shear below the middle of an elliptical contact, in the highest pressure.

    Parameters
    ----------
    depth : float
        In the smaller half-axis b, positive.
    ratio : float
        b/a of the half-axes, in (0, 1].
    poissons_ratio : float

    References
    ----------
    Johnson, equations 3.45 (circle) and 3.71 (ellipse).
    """
    nu = poissons_ratio
    if ratio > 1.0 - 1e-4:  # where the terms of the ellipse vanish against each other
        below = 1.0 / (1.0 + depth**2)
        radial = -(1.0 + nu) * (1.0 - depth * math.atan(1.0 / depth)) + 0.5 * below
        return 0.5 * abs(radial + below)
    from scipy.special import ellipeinc, ellipkinc

    zeta, square = depth * ratio, 1.0 - ratio**2
    t = math.sqrt((ratio**2 + zeta**2) / (1.0 + zeta**2))
    angle = math.atan2(1.0, zeta)
    f, e = float(ellipkinc(angle, square)), float(ellipeinc(angle, square))
    along = zeta * (f - e)
    across = zeta * (e / ratio**2 - f)
    of_x = -0.5 * (1.0 - t) + along + nu * (1.0 - t / ratio**2 + across)
    of_y = 0.5 + 0.5 / t - t / ratio**2 + across + nu * (-1.0 + t + along)
    of_z = -0.5 * (1.0 - t**2) / t
    stresses = (2.0 * ratio / square) * np.array([of_x, of_y, of_z])
    return float(0.5 * np.ptp(stresses))
