"""The finite-element probe: condensed elasticity, Hertz seats, Hertz contact at the tip."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.model.fem.condensation import ReducedModel
from pretravel.model.fem.elasticity import INTERFACE, SEATS, TIP_FORCE
from pretravel.model.fem.geometry import part_name
from pretravel.model.fem.reduction_cache import reduced_model
from pretravel.model.hertz import ball_on_flat, contact_modulus
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.trigger.seats import SeatStatics, hertz_indentations

_AGREEMENT = 1e-6
"""Seats on the mesh and seats of the description: the same to this relative difference."""


def displacements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """Tip displacement against the spindle under given forces, by compliance.

    The reduced model comes from the cache, or is made (about ten seconds).

    Parameters
    ----------
    probe : Probe
    statics : SeatStatics
    directions : (n, 3) float
        Unit directions of the force on the tip, probe frame.
    forces : (n,) float
        [N]
    workpiece : Material

    Returns
    -------
    mapping of str to (n, 3) float
        One for each part of the body (``stylus``, ``holder``, ``hub``, ``rods``, ``tip``;
        with a STEP file ``tripod``, ``stylus``, ``tip``), ``seats`` and ``tip_on_part``. [mm]

    References
    ----------
    Rodrigues 2021, chapter 2, with the contact mesh replaced by Hertz's law.
    """
    return condensed(reduced_model(probe))(probe, statics, directions, forces, workpiece)


def condensed(reduced: ReducedModel) -> Callable[..., Mapping[str, FloatArray]]:
    """`displacements` with a reduced model at hand, for `predict(probe, directions, model)`."""

    def fem(
        probe: Probe,
        statics: SeatStatics,
        directions: FloatArray,
        forces: FloatArray,
        workpiece: Material,
    ) -> Mapping[str, FloatArray]:
        return condensed_displacements(reduced, probe, statics, directions, forces, workpiece)

    return fem


def condensed_displacements(
    reduced: ReducedModel,
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """As `displacements`, with a reduced model at hand.

    Notes
    -----
    The reactions are statics'. The body's part is linear: virtual work with the tip's
    three unit forces and the reactions that balance them gives a 3 x 3 compliance
    for each region; that of the region under the seats is less what the half-space
    under the patches gave. The seats' part is Hertz's approach, with balls that end;
    the tripod follows as a rigid body.
    """
    check_seats(reduced, statics)
    unit = balanced_tip_forces(statics)
    shares: dict[str, FloatArray] = {}
    for region, flexibility in reduced.flexibility_by_region.items():
        name = part_name(region)
        compliance = unit @ flexibility @ unit.T
        moved = forces[:, None] * (directions @ compliance)
        shares[name] = shares[name] + moved if name in shares else moved
    change = forces[:, None] * statics.unit_reactions(directions)
    # What the half-space under the patches gave is Hertz's, not the rods'.
    name = reduced.seat_part
    shares[name] = shares[name] - statics.tip_displacement(reduced.patch_compliance * change)
    indentations = hertz_indentations(probe, statics, directions, forces)
    indentations = indentations + reduced.ball_correction * change
    approach = ball_on_flat(
        forces, probe.tip.radius, contact_modulus(probe.tip.material, workpiece)
    )
    return {
        **shares,
        "seats": statics.tip_displacement(indentations),
        "tip_on_part": approach[:, None] * directions,
    }


def seat_closure(
    reduced: ReducedModel,
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    change: FloatArray,
) -> FloatArray:
    """Rigid motion that keeps rods and balls together under a change of interface forces.

    Parameters
    ----------
    reduced, probe, statics
    directions : (1, 3) float
    forces : (1,) float
        [N]
    change : (22,) float
        Interface forces less those at rest. [N]

    Returns
    -------
    (6,) float
        Three translations [mm], three rotations [rad].
    """
    indentations = hertz_indentations(probe, statics, directions, forces)[0]
    indentations = indentations + reduced.seat_correction * change[SEATS]
    elastic = reduced.flexibility[SEATS] @ change
    return np.asarray(-np.linalg.solve(reduced.resultants[:, SEATS].T, elastic + indentations))


def balanced_tip_forces(statics: SeatStatics) -> FloatArray:
    """Unit forces on the tip along x, y, z with the reactions that balance them, (3, 22). [N]"""
    forces = np.zeros((3, len(INTERFACE)))
    forces[:, SEATS] = statics.unit_reactions(np.eye(3))
    forces[:, TIP_FORCE] = np.eye(3)
    return forces


def check_seats(reduced: ReducedModel, statics: SeatStatics) -> None:
    """Refuse a reduced model whose seats or tip are not where the description has them.

    Raises
    ------
    PretravelError
    """
    meshed = reduced.resultants[:, :9]
    described = np.concatenate([statics.wrenches, statics.tip_wrenches], axis=1)
    scale = np.linalg.norm(statics.tip)
    off = float(np.abs(meshed - described).max() / scale)
    if off > _AGREEMENT:
        raise PretravelError(
            f"the mesh's seats and tip differ from the description's by {off:.1e} of the lever; "
            f"more than {_AGREEMENT:.0e} would make reactions differ from statics"
        )
