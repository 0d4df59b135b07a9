"""Woźniak's simple map of a described probe: what five touches would make of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import five_point_pattern
from pretravel.maps.bases import WozniakBasis
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.trigger.compliance import analytic
from pretravel.trigger.event import trigger_force
from pretravel.trigger.seats import SeatStatics


def displacements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """Pretravel A cos²γ / cos of the folded azimuth, along the normal.

    A is that of the paper's five-point qualification (equator at 0, 90, 180, 270°, and the
    pole) of this probe under the model ``analytic``; the lobes lie opposite the first rod.

    Parameters
    ----------
    probe, statics, directions, workpiece
        As for the other models.
    forces : (n,) float
        Not used: this map knows no force.

    Returns
    -------
    mapping of str to (n, 3) float
        ``wozniak``. [mm]

    References
    ----------
    Woźniak, equations 4 and 9.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probe.materials import material
    >>> from pretravel.trigger.seats import seat_statics
    >>> probe = load_probe("omp40-2")
    >>> pole = displacements(probe, seat_statics(probe), np.array([[0.0, 0.0, 1.0]]),
    ...                      np.array([1.0]), material("steel"))["wozniak"]
    >>> pole.tolist()
    [[0.0, 0.0, 0.0]]
    """
    del forces
    five = five_point_pattern()
    force, _ = trigger_force(
        statics.rest_reactions, statics.unit_reactions(five), probe.criterion, probe.threshold
    )
    moved = sum(analytic.displacements(probe, statics, five, force, workpiece).values())
    basis = WozniakBasis(probe.tripod.rod_azimuths[0] + math.pi)
    constant = float(np.sum(moved * five)) / float(basis.design(five)[:, 0].sum())
    return {"wozniak": (constant * basis.design(directions)[:, 0])[:, None] * directions}
