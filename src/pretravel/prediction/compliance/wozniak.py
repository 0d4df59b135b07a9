"""Woźniak's simple map of a described probe: the one that five touches would determine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import five_point_pattern
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.prediction.compliance import analytic
from pretravel.prediction.compliance.base import ComplianceModel
from pretravel.prediction.loading import Loading, loaded_to_trigger


@dataclass(frozen=True)
class Wozniak(ComplianceModel):
    """Pretravel A cos²γ / cos of the folded azimuth, along the normal; no force enters.

    A is that of the paper's five-point qualification (equator at 0, 90, 180, 270°, and the
    pole) of this probe under the model ``analytic``; the lobes lie opposite the first rod.
    Share: ``wozniak``.

    References
    ----------
    Woźniak, equations 4 and 9.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.predict import predict
    >>> predict(load_probe("omp40-2"), [[0.0, 0.0, 1.0]], "wozniak").pretravel.tolist()
    [0.0]
    """

    name = "wozniak"

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        five = five_point_pattern()
        touches, _ = loaded_to_trigger(loading.probe, loading.statics, five, loading.workpiece)
        moved = sum(analytic.MODEL.displacements(touches).values())
        basis = WozniakBasis(loading.probe.tripod.rod_azimuths[0] + math.pi)
        constant = float(np.sum(moved * five)) / float(basis.design(five)[:, 0].sum())
        pretravel = constant * basis.design(loading.directions)[:, 0]
        return {"wozniak": pretravel[:, None] * loading.directions}


MODEL = Wozniak()
