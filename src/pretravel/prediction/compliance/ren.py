"""The closed form of the Abbé paper (Ren 2020): for a described probe, and for the paper's rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.prediction.beam import cantilever_compliance
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel
from pretravel.prediction.loading import Loading
from pretravel.prediction.seats import seat_coefficient

LEVER_TO_SEATS = 1.5
"""The height of the seats' triangle over its circumradius: from a rod to the line of the others."""


@dataclass(frozen=True)
class Ren(ComplianceModel):
    """A tilt from the recovery of one seat, bending of the stem, contact of tip and part.

    Shares: ``seat_tilt``, ``stylus_bending``, ``tip_on_part``.

    Notes
    -----
    L_c is Hertz's indentation of one seat under the whole trigger force, magnified by lever
    over the height of the seats' triangle; L_p is the stem as one cantilever of the stylus's
    length; both act across the axis, where the paper has its forces. L_k adds to the spindle's
    travel; the paper subtracts it, since its laser measures the tip (`ren_pretravel` is the
    paper's own sum).

    References
    ----------
    Ren 2020, equations 5 to 12.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.predict import predict
    >>> sorted(predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]], "ren").shares)
    ['seat_tilt', 'stylus_bending', 'tip_on_part']
    """

    name = "ren"

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        probe, stem = loading.probe, loading.probe.stem
        lateral = loading.directions * np.array([1.0, 1.0, 0.0])
        across = np.linalg.norm(lateral, axis=1)
        toward = lateral / np.maximum(across, 1e-300)[:, None]
        force = loading.force * across
        ratio = probe.lever / (LEVER_TO_SEATS * probe.tripod.radius)
        rigid = probe.seats.contact == "rigid"
        recovery = 0.0 if rigid else seat_coefficient(probe) * np.cbrt(force**2)
        bending = cantilever_compliance(
            probe.stylus_length, stem.diameter, stem.material.youngs_modulus
        )
        return {
            "seat_tilt": (ratio * recovery * np.ones_like(force))[:, None] * toward,
            "stylus_bending": (bending * force)[:, None] * toward,
            TIP_ON_PART: loading.tip_approach,
        }


MODEL = Ren()


@dataclass(frozen=True, kw_only=True)
class RenProbe:
    """The probe of the paper, with the paper's quantities.

    Parameters
    ----------
    lever, lever_ratio : float
        L [mm] and L / L_a.
    stylus_diameter, stylus_modulus : float
        d [mm] and E of the stylus [MPa].
    contact_coefficient : float
        n_delta.
    seat_radii, seat_moduli : two floats each
        R1, R2 [mm] and E1, E2 [MPa] of ball and rod.
    tip_radius, tip_modulus, part_modulus : float
        r [mm], E3 and E4 [MPa]. The paper calls r the ball's diameter and uses 4 mm; Hertz's
        formula has the radius there.
    poissons_ratios : four floats
        mu1 to mu4: ball, rod, tip, part.
    """

    lever: float
    lever_ratio: float
    stylus_diameter: float
    stylus_modulus: float
    contact_coefficient: float
    seat_radii: tuple[float, float]
    seat_moduli: tuple[float, float]
    tip_radius: float
    tip_modulus: float
    part_modulus: float
    poissons_ratios: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class RenPretravel:
    """The three terms of Ren 2020, equation 12. [mm]

    Attributes
    ----------
    rigid : (n,) float
        L_c: rigid rotation of the stylus from one seat's elastic recovery.
    bending : (n,) float
        L_p: bending of the stylus.
    compression : (n,) float
        L_k: tip on part; the laser on the tip does not see it, so it is subtracted.
    """

    rigid: FloatArray
    bending: FloatArray
    compression: FloatArray

    @property
    def pretravel(self) -> FloatArray:
        """L_c + L_p - L_k, equation 5. [mm]"""
        return self.rigid + self.bending - self.compression


def ren_pretravel(force: npt.ArrayLike, probe: RenProbe) -> RenPretravel:
    """Pretravel that the Abbé rig measures, in closed form.

    Parameters
    ----------
    force : (n,) float
        Trigger force. [N]
    probe : RenProbe

    Returns
    -------
    RenPretravel

    References
    ----------
    Ren 2020, equations 6 to 12. Equation 13 prints the two Hertz terms ten times
    too small; the bending term is right.

    >>> probe = RenProbe(lever=18.0, lever_ratio=1.5, stylus_diameter=2.0,
    ...     stylus_modulus=200e3, contact_coefficient=0.9744, seat_radii=(1.0, 1.0),
    ...     seat_moduli=(200e3, 200e3), tip_radius=4.0, tip_modulus=620e3,
    ...     part_modulus=200e3)
    >>> terms = ren_pretravel(1.0, probe)
    >>> [f"{float(term):.3g}" for term in (terms.rigid, terms.bending, terms.compression)]
    ['0.000641', '0.0124', '0.000183']
    """
    f = np.asarray(force, dtype=np.float64)
    compliances = [
        (1.0 - nu**2) / modulus
        for nu, modulus in zip(
            probe.poissons_ratios,
            (*probe.seat_moduli, probe.tip_modulus, probe.part_modulus),
            strict=True,
        )
    ]
    first, second = probe.seat_radii
    seat = (compliances[0] + compliances[1]) ** 2 * (2.0 * second + first) / (second * first)
    recovery = 0.655 * probe.contact_coefficient * np.cbrt(seat * f**2)
    tip = (compliances[2] + compliances[3]) ** 2 / probe.tip_radius
    bending = cantilever_compliance(probe.lever, probe.stylus_diameter, probe.stylus_modulus)
    return RenPretravel(
        rigid=np.asarray(probe.lever_ratio * recovery),
        bending=np.asarray(bending * f),
        compression=np.asarray(0.8255 * np.cbrt(tip * f**2)),
    )
