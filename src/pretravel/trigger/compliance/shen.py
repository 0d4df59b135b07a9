"""The "existing method" of the thesis: rigid seats and a uniform cantilever."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.model.beam import cantilever_compliance
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.trigger.seats import SeatStatics


def displacements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """Tip displacement under given forces: bending of one cantilever, nothing else.

    The model knows a single length, from the tip to the plane of the rods: the
    lever of the statics is the cantilever's length too. Diameter and material are
    those of the stylus's longest segment.

    Parameters
    ----------
    probe : Probe
    statics : SeatStatics
        Not used: the seats are rigid.
    directions : (n, 3) float
        Unit directions of the force on the tip, probe frame.
    forces : (n,) float
        [N]
    workpiece : Material
        Not used: the contact is rigid.

    Returns
    -------
    mapping of str to (n, 3) float
        ``stylus_bending``. [mm]

    References
    ----------
    Shen & Zhang 1997 as reported by Rodrigues 2021: d = F sin(polar) L³ / (3 E I).

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probe.materials import material
    >>> from pretravel.trigger.seats import seat_statics
    >>> probe = load_probe("omp40-2").with_lever(50.0)
    >>> bending = displacements(probe, seat_statics(probe), np.array([[1.0, 0.0, 0.0]]),
    ...                         np.array([1.0]), material("steel"))["stylus_bending"]
    >>> (bending * 1e3).round(3).tolist()
    [[5.012, 0.0, 0.0]]
    """
    del statics, workpiece
    stem = probe.stem
    compliance = cantilever_compliance(probe.lever, stem.diameter, stem.material.youngs_modulus)
    lateral = directions * np.array([1.0, 1.0, 0.0])
    return {"stylus_bending": compliance * forces[:, None] * lateral}
