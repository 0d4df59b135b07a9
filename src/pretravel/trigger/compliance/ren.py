"""The closed form of the Abbé paper, fed from a description: one seat, one lever, one beam."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.model.beam import cantilever_compliance
from pretravel.model.hertz import ball_on_flat, contact_modulus
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.trigger.seats import SeatStatics, seat_coefficient

LEVER_TO_SEATS = 1.5
"""The height of the seats' triangle over its circumradius: from a rod to the line of the others."""


def displacements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """Tip displacement under given forces: a tilt from one seat's recovery, bending, contact.

    Parameters
    ----------
    probe : Probe
    statics : SeatStatics
        Not used beside the trigger force.
    directions : (n, 3) float
        Unit directions of the force on the tip, probe frame.
    forces : (n,) float
        [N]
    workpiece : Material

    Returns
    -------
    mapping of str to (n, 3) float
        ``seat_tilt``, ``stylus_bending``, ``tip_on_part``. [mm]

    Notes
    -----
    L_c is Hertz's indentation of one seat under the whole trigger force, magnified by lever
    over the height of the seats' triangle; L_p is the stem as one cantilever of the stylus's
    length; both act across the axis, where the paper has its forces. L_k adds to the spindle's
    travel; the paper subtracts it, since its laser looks at the tip
    (`pretravel.trigger.compliance.closed_form.ren_pretravel` is the paper's own).

    References
    ----------
    Ren 2020, equations 5 to 12.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probe.materials import material
    >>> from pretravel.trigger.seats import seat_statics
    >>> probe = load_probe("omp40-2")
    >>> shares = displacements(probe, seat_statics(probe), np.array([[1.0, 0.0, 0.0]]),
    ...                        np.array([0.75]), material("steel"))
    >>> sorted(shares)
    ['seat_tilt', 'stylus_bending', 'tip_on_part']
    """
    del statics
    stem = probe.stem
    lateral = directions * np.array([1.0, 1.0, 0.0])
    across = np.linalg.norm(lateral, axis=1)
    toward = lateral / np.maximum(across, 1e-300)[:, None]
    force = forces * across
    ratio = probe.lever / (LEVER_TO_SEATS * probe.tripod.radius)
    rigid = probe.seats.contact == "rigid"
    recovery = 0.0 if rigid else seat_coefficient(probe) * np.cbrt(force**2)
    bending = cantilever_compliance(
        probe.stylus_length, stem.diameter, stem.material.youngs_modulus
    )
    approach = ball_on_flat(
        forces, probe.tip.radius, contact_modulus(probe.tip.material, workpiece)
    )
    return {
        "seat_tilt": (ratio * recovery * np.ones_like(force))[:, None] * toward,
        "stylus_bending": (bending * force)[:, None] * toward,
        "tip_on_part": approach[:, None] * directions,
    }
