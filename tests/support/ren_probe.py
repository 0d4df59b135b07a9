"""The probe of Ren 2020, section 4."""

from __future__ import annotations

import numpy.typing as npt

from pretravel.prediction.compliance.ren import RenPretravel, RenProbe, ren_pretravel

SECTION_4 = RenProbe(
    lever=18.0,
    lever_ratio=1.5,
    stylus_diameter=2.0,
    stylus_modulus=200e3,
    contact_coefficient=0.9744,
    seat_radii=(1.0, 1.0),
    seat_moduli=(200e3, 200e3),
    tip_radius=4.0,
    tip_modulus=620e3,
    part_modulus=200e3,
)
"""n_delta 0.9744, E 200 and 620 kN/mm², R1 = R2 = 1 mm, r = 4 mm, L = 18 mm, L/La = 1.5, d = 2 mm,
Poisson's ratios 0."""


def ren_terms(force: npt.ArrayLike) -> RenPretravel:
    """Equation 12 with section 4's numbers."""
    return ren_pretravel(force, SECTION_4)
