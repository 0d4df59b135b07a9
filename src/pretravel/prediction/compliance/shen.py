"""The "existing method" of the thesis: rigid seats and a uniform cantilever."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray
from pretravel.prediction.beam import cantilever_compliance
from pretravel.prediction.compliance.base import ComplianceModel
from pretravel.prediction.loading import Loading


@dataclass(frozen=True)
class Shen(ComplianceModel):
    """The stylus as one cantilever; seats and contact are rigid.

    The model uses a single length, from the tip to the plane of the rods: the lever of the
    statics is also the length of the cantilever. Diameter and material are those of the
    stylus's longest segment. Share: ``stylus_bending``.

    References
    ----------
    Shen & Zhang 1997 as reported by Rodrigues 2021: d = F sin(polar) L³ / (3 E I).

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.trigger import predict
    >>> probe = load_probe("omp40-2").with_lever(50.0)
    >>> trigger = predict(probe, [[1.0, 0.0, 0.0]], "shen")
    >>> (trigger.deflection / trigger.force * 1e3).round(3).tolist()
    [[5.012, 0.0, 0.0]]
    """

    name = "shen"
    has_response = True
    uses_lever_only = True

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        stem = loading.probe.stem
        compliance = cantilever_compliance(
            loading.probe.lever, stem.diameter, stem.material.youngs_modulus
        )
        lateral = loading.directions * np.array([1.0, 1.0, 0.0])
        return {"stylus_bending": compliance * loading.force[:, None] * lateral}


MODEL = Shen()
