"""A probe under a compliance model, condensed to its response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, ConvergenceError, PretravelError
from pretravel.maps import PretravelMap
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel, compliance_model
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import Loading
from pretravel.prediction.materials import Material
from pretravel.prediction.seats import seat_coefficient, statics_in_machine
from pretravel.prediction.trigger import Trigger, predict, predicted_map
from pretravel.six_seats import ProbeResponse, ResponseBasis
from pretravel.uncertainty import Covariance

_AGREEMENT = 1e-10
"""Largest difference between response and model. [mm]"""


def response_map(probe: Probe, response: ProbeResponse, trigger: Trigger) -> PretravelMap:
    """A prediction as a map that is exact in every direction within those predicted.

    Parameters
    ----------
    probe : Probe
        Its tip radius and orientation are used.
    response : ProbeResponse
    trigger : Trigger
        Its directions limit the map's support.

    Returns
    -------
    PretravelMap
        Of kind ``physical``, with zero covariance as `predicted_map` has.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> exact = response_map(probe, probe_response(probe), predict(probe, np.eye(3)))
    >>> exact.kind
    'physical'
    """
    table = predicted_map(probe, trigger)
    return replace(
        table,
        basis=ResponseBasis(response),
        coefficients=np.ones(1),
        covariance=Covariance.none(1),
    )


def probe_response(
    probe: Probe,
    model: str | ComplianceModel = "analytic",
    *,
    workpiece: Material | None = None,
    gravity: npt.ArrayLike | None = None,
) -> ProbeResponse:
    """Condense a probe under a compliance model to its response.

    Parameters
    ----------
    probe, model, workpiece, gravity
        As for `pretravel.prediction.trigger.predict`.

    Raises
    ------
    ConvergenceError
        A model that is not of this form.
    PretravelError
        Friction at the seats, or a contact that opens.

    Notes
    -----
    The compliance follows from the model's displacements under three unit forces, less Hertz's
    part. The response is then compared with the model in a spread of directions at the trigger.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> response = probe_response(load_probe("omp40-2"))
    >>> float(response.force(np.array([[1.0, 0.0, 0.0]]))[0][0].round(3))
    0.75
    """
    probe.refuse_tip_friction("touches on surfaces and maps without a table")
    if probe.seats.friction > 0.0:
        raise PretravelError(
            f"{probe.name} has friction {probe.seats.friction:g} at its seats; touches on "
            "surfaces and maps without a table follow from statics, which does not contain it. "
            "Set friction of [seats] to 0, or use a table of directions (.csv)",
            inputs=("probe",),
        )
    if probe.opening:
        raise PretravelError(
            f"the contact of {probe.name} opens by {probe.opening / MICROMETRE:g} µm after the "
            "force of the trigger is reached, which this calculation does not contain (slide, maps "
            "without a table). Set opening_um of [trigger] to 0, or use predict or simulate"
        )
    chosen = compliance_model(model)
    statics = statics_in_machine(probe, gravity)
    part = probe.part_material(workpiece)
    change = statics.unit_reactions(np.eye(3))
    # So small a force that no seat opens; everything below is divided by it again.
    small = 0.1 * float(np.min(statics.rest_reactions) / np.abs(change).max())
    loading = Loading(probe, statics, np.eye(3), np.full(3, small), change, part)
    shares = dict(chosen.displacements(loading))
    tip = shares.pop(TIP_ON_PART, np.zeros((3, 3)))
    moved = sum(shares.values(), start=np.zeros((3, 3)))
    hertz = "seats" in shares and probe.seats.contact != "rigid"
    if hertz:
        moved = moved - statics.tip_displacement(loading.seat_indentations)
    response = ProbeResponse(
        reaction_change=change.T,
        rest_reactions=statics.rest_reactions,
        criterion=probe.criterion,
        threshold=probe.threshold,
        compliance=moved.T / small,
        seat_motion=statics.tip_displacement(np.eye(6)).T,
        seat_coefficient=seat_coefficient(probe) if hertz else 0.0,
        tip_coefficient=float(tip[2, 2]) / small ** (2.0 / 3.0),
        tip_radius=probe.tip.radius,
    )
    _check(response, probe, chosen, part, gravity)
    return response


def _check(
    response: ProbeResponse,
    probe: Probe,
    model: ComplianceModel,
    workpiece: Material,
    gravity: npt.ArrayLike | None,
) -> None:
    from pretravel.base import fibonacci_cap

    trial = fibonacci_cap(64)
    expected = predict(probe, trial, model, workpiece=workpiece, gravity=gravity)
    apart = (
        response.deflection(trial, expected.force) - expected.deflection,
        response.tip_approach(expected.force) - expected.tip_approach,
    )
    off = float(np.max([np.abs(part).max() for part in apart]))  # max() can lose a nan
    if not off < _AGREEMENT:
        raise ConvergenceError(
            f"touches on surfaces need a model with a linear compliance and Hertz's law at seats "
            f"and tip; model {expected.model} differs from this form by {off:.1e} mm"
            + (f". The model has this form for {model.response_for}" if model.response_for else "")
        )
