"""The closed-form elastic probe: stepped stylus, Hertz seats, Hertz contact at the tip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray
from pretravel.prediction.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel
from pretravel.prediction.loading import Loading


@dataclass(frozen=True)
class Analytic(ComplianceModel):
    """Stylus as a stepped beam, seats and tip by Hertz's law; everything else is rigid.

    Hub, rods and stylus holder deform in the finite-element model only.

    Shares: ``stylus_bending``, ``stylus_shear``, ``stylus_axial``, ``seats``, ``tip_on_part``.
    Each seat is indented by `Loading.seat_indentations`; the tripod follows as a rigid body.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.trigger import predict
    >>> sorted(predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]], "analytic").shares)
    ['seats', 'stylus_axial', 'stylus_bending', 'stylus_shear', 'tip_on_part']
    """

    name = "analytic"
    has_response = True

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        stylus, force = loading.probe.stylus, loading.force[:, None]
        lateral = loading.directions * np.array([1.0, 1.0, 0.0])
        axial = loading.directions * np.array([0.0, 0.0, 1.0])
        return {
            "stylus_bending": bending_compliance(stylus) * force * lateral,
            "stylus_shear": shear_compliance(stylus) * force * lateral,
            "stylus_axial": axial_compliance(stylus) * force * axial,
            "seats": loading.statics.tip_displacement(loading.seat_indentations),
            TIP_ON_PART: loading.tip_approach,
        }


MODEL = Analytic()
