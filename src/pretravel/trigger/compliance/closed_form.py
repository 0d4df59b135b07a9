"""Published closed forms: baselines for users, oracles for tests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.model.beam import cantilever_compliance


class RenPretravel(NamedTuple):
    """The three terms of Ren 2020, equation 12. [mm]"""

    rigid: FloatArray
    """L_c: rigid rotation of the stylus from one seat's elastic recovery."""
    bending: FloatArray
    """L_p: bending of the stylus."""
    compression: FloatArray
    """L_k: tip on part; the laser on the tip does not see it, so it is taken off."""

    @property
    def pretravel(self) -> FloatArray:
        """L_c + L_p - L_k, equation 5. [mm]"""
        return self.rigid + self.bending - self.compression


def ren_pretravel(
    force: npt.ArrayLike,
    *,
    lever: float,
    lever_ratio: float,
    stylus_diameter: float,
    stylus_modulus: float,
    contact_coefficient: float,
    seat_radii: tuple[float, float],
    seat_moduli: tuple[float, float],
    tip_radius: float,
    tip_modulus: float,
    part_modulus: float,
    poissons_ratios: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> RenPretravel:
    r"""Pretravel as seen by the Abbé rig, in closed form.

    Parameters
    ----------
    force : (n,) float
        Trigger force. [N]
    lever, lever_ratio : float
        L [mm] and L / L_a.
    stylus_diameter, stylus_modulus : float
        d [mm] and E of the stylus [MPa].
    contact_coefficient : float
        n_delta.
    seat_radii, seat_moduli : two floats each
        R1, R2 [mm] and E1, E2 [MPa] of ball and rod.
    tip_radius, tip_modulus, part_modulus : float
        r [mm], E3 and E4 [MPa]. The paper calls r the ball's diameter and puts in
        4 mm; Hertz's formula has the radius there.
    poissons_ratios : four floats
        mu1 to mu4.

    Returns
    -------
    RenPretravel

    References
    ----------
    Ren 2020, equations 6 to 12. Equation 13 prints the two Hertz terms ten times
    too small; the bending term is right.

    >>> terms = ren_pretravel(1.0, lever=18.0, lever_ratio=1.5, stylus_diameter=2.0,
    ...     stylus_modulus=200e3, contact_coefficient=0.9744, seat_radii=(1.0, 1.0),
    ...     seat_moduli=(200e3, 200e3), tip_radius=4.0, tip_modulus=620e3,
    ...     part_modulus=200e3)
    >>> [f"{float(term):.3g}" for term in terms]
    ['0.000641', '0.0124', '0.000183']
    """
    f = np.asarray(force, dtype=np.float64)
    compliances = [
        (1.0 - nu**2) / modulus
        for nu, modulus in zip(
            poissons_ratios, (*seat_moduli, tip_modulus, part_modulus), strict=True
        )
    ]
    first, second = seat_radii
    seat = (compliances[0] + compliances[1]) ** 2 * (2.0 * second + first) / (second * first)
    recovery = 0.655 * contact_coefficient * np.cbrt(seat * f**2)
    tip = (compliances[2] + compliances[3]) ** 2 / tip_radius
    return RenPretravel(
        rigid=np.asarray(lever_ratio * recovery),
        bending=np.asarray(cantilever_compliance(lever, stylus_diameter, stylus_modulus) * f),
        compression=np.asarray(0.8255 * np.cbrt(tip * f**2)),
    )
