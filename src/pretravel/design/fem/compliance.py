"""The finite-element probe: condensed elasticity, Hertz seats, Hertz contact at the tip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.interface_loads import INTERFACE, SEATS, TIP_FORCE
from pretravel.design.fem.reduction_cache import reduced_model
from pretravel.design.fem.regions import part_name
from pretravel.prediction import TIP_ON_PART, ComplianceModel, Loading, SeatStatics

_AGREEMENT = 1e-6
"""Seats on the mesh and seats of the description: the same to this relative difference."""


@dataclass(frozen=True, eq=False)
class FiniteElements(ComplianceModel):
    """Condensed finite elements; seats and tip by Hertz's law.

    Shares: one for each part of the body (``stylus``, ``holder``, ``hub``, ``rods``, ``tip``;
    with a STEP file ``tripod``, ``stylus``, ``tip``), ``seats`` and ``tip_on_part``.

    Parameters
    ----------
    reduced : ReducedModel, optional
        Of the probe. When not given it comes from the cache, or is made (some seconds).

    Notes
    -----
    The reactions are those of statics. The body's part is linear: virtual work with the tip's
    three unit forces and the reactions that balance them yields a 3 x 3 compliance
    for each region. From that of the region under the seats, the compliance of the half-space
    under the patches is subtracted. The seats' part is Hertz's approach, for balls of finite
    size; the tripod follows as a rigid body.

    References
    ----------
    Rodrigues 2021, chapter 2, with the contact mesh replaced by Hertz's law.
    """

    reduced: ReducedModel | None = None

    name = "fem"
    has_response = True

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        reduced = self.reduced or reduced_model(loading.probe)
        statics = loading.statics
        check_seats(reduced, statics)
        unit = balanced_tip_forces(statics)
        shares: dict[str, FloatArray] = {}
        for region, flexibility in reduced.flexibility_by_region.items():
            name = part_name(region)
            compliance = unit @ flexibility @ unit.T
            moved = loading.force[:, None] * (loading.directions @ compliance)
            shares[name] = shares[name] + moved if name in shares else moved
        # Hertz's law already contains the half-space under the patches.
        under = reduced.seat_part
        patches = statics.tip_displacement(reduced.patch_compliance * loading.reaction_change)
        shares[under] = shares[under] - patches
        balls = reduced.ball_correction * loading.reaction_change
        return {
            **shares,
            "seats": statics.tip_displacement(loading.seat_indentations + balls),
            TIP_ON_PART: loading.tip_approach,
        }


MODEL = FiniteElements()


def seat_closure(reduced: ReducedModel, loading: Loading, change: FloatArray) -> FloatArray:
    """Rigid motion that keeps rods and balls together under a change of interface forces.

    Parameters
    ----------
    reduced : ReducedModel
    loading : Loading
        In one direction.
    change : (22,) float
        Interface forces less those at rest. [N]

    Returns
    -------
    (6,) float
        Three translations [mm], three rotations [rad].
    """
    indentations = loading.seat_indentations[0] + reduced.seat_correction * change[SEATS]
    elastic = reduced.flexibility[SEATS] @ change
    return np.asarray(-np.linalg.solve(reduced.resultants[:, SEATS].T, elastic + indentations))


def balanced_tip_forces(statics: SeatStatics) -> FloatArray:
    """Unit forces on the tip along x, y, z with the reactions that balance them, (3, 22). [N]"""
    forces = np.zeros((3, len(INTERFACE)))
    forces[:, SEATS] = statics.unit_reactions(np.eye(3))
    forces[:, TIP_FORCE] = np.eye(3)
    return forces


def check_seats(reduced: ReducedModel, statics: SeatStatics) -> None:
    """Check that seats and tip of a reduced model are where the description has them."""
    meshed = reduced.resultants[:, :9]
    described = np.concatenate([statics.wrenches, statics.tip_wrenches], axis=1)
    scale = np.linalg.norm(statics.tip)
    off = float(np.abs(meshed - described).max() / scale)
    if off > _AGREEMENT:
        raise PretravelError(
            f"the mesh's seats and tip differ from the description's by {off:.1e} of the lever; "
            f"more than {_AGREEMENT:.0e} would make reactions differ from statics"
        )
