"""The closed-form elastic probe: stepped stylus, Hertz seats, Hertz contact at the tip."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.model.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.model.hertz import ball_on_flat, contact_modulus
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.trigger.seats import SeatStatics, hertz_indentations


def displacements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """Tip displacement against the spindle under given forces, by compliance.

    Hub, rods and stylus holder are rigid: what they add is the business of the
    finite-element model.

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
        ``stylus_bending``, ``stylus_shear``, ``stylus_axial``, ``seats`` move the
        tip; ``tip_on_part`` is the approach of tip centre and part. [mm]

    Notes
    -----
    Each seat sinks in as `hertz_indentations` says; the tripod follows as a rigid body.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probe.materials import material
    >>> from pretravel.trigger.seats import seat_statics
    >>> probe = load_probe("omp40-2")
    >>> shares = displacements(probe, seat_statics(probe), np.array([[1.0, 0.0, 0.0]]),
    ...                        np.array([0.75]), material("steel"))
    >>> sorted(shares)
    ['seats', 'stylus_axial', 'stylus_bending', 'stylus_shear', 'tip_on_part']
    """
    force = forces[:, None]
    lateral = directions * np.array([1.0, 1.0, 0.0])
    axial = directions * np.array([0.0, 0.0, 1.0])
    indentations = hertz_indentations(probe, statics, directions, forces)
    approach = ball_on_flat(
        forces, probe.tip.radius, contact_modulus(probe.tip.material, workpiece)
    )
    return {
        "stylus_bending": bending_compliance(probe.stylus) * force * lateral,
        "stylus_shear": shear_compliance(probe.stylus) * force * lateral,
        "stylus_axial": axial_compliance(probe.stylus) * force * axial,
        "seats": statics.tip_displacement(indentations),
        "tip_on_part": approach[:, None] * directions,
    }
