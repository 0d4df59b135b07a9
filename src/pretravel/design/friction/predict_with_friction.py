"""The trigger of a probe whose seats rub: what `predict` returns, after some equal touches."""

from __future__ import annotations

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.reduction_cache import reduced_model
from pretravel.design.friction.seat_friction import FrictionCycle, friction_cycle
from pretravel.prediction import TIP_ON_PART, ComplianceModel, Material, Probe, loaded, seat_statics

TOUCHES = 3
"""Touches in the same direction before the trigger is read: the tangential forces have settled."""
STEPS = 25
"""Of each loading and return: trigger forces then change by less than 1 % with twice as many."""


def rubbed_trigger(
    probe: Probe,
    directions: FloatArray,
    model: ComplianceModel,
    workpiece: Material,
) -> tuple[FrictionCycle, dict[str, FloatArray]]:
    """The settled touch of each direction, and the displacements of the tip by compliance.

    Parameters
    ----------
    probe : Probe
        With a friction of its seats.
    directions : (n, 3) float
        Outward surface normals, probe frame.
    model : ComplianceModel
        ``analytic`` or ``fem``.
    workpiece : Material

    Returns
    -------
    FrictionCycle
        Of `TOUCHES` touches; the last one counts.
    displacements : dict of str to (n, 3) float
        ``body`` (everything elastic but the seats), ``seats`` and ``tip_on_part``. [mm]

    Raises
    ------
    PretravelError
        Another model; conditions of `friction_cycle`.

    Notes
    -----
    Displacements count from rest without tangential forces, so that the displacement in which
    friction leaves the tip at rest is in them. A touch in another direction before leaves other
    tangential forces: measured forces scatter by it.
    """
    cycle = friction_cycle(
        probe,
        directions,
        probe.seats.friction,
        body=_body(probe, model),
        cycles=TOUCHES,
        steps=STEPS,
    )
    seats = cycle.tripod_displacement[:, -1]
    force = cycle.trigger_force[:, -1]
    tip = loaded(probe, seat_statics(probe), directions, force, workpiece).tip_approach
    return cycle, {
        "body": frozen(cycle.trigger_displacement[:, -1] - seats),
        "seats": frozen(seats),
        TIP_ON_PART: frozen(tip),
    }


def _body(probe: Probe, model: ComplianceModel) -> ReducedModel | str:
    if model.name == "analytic":
        return "analytic"
    if isinstance(model, FiniteElements):
        return model.reduced or reduced_model(probe)
    raise PretravelError(
        f"model '{model.name}' does not contain friction at the seats; use analytic or fem, or "
        "friction 0",
        inputs=("model", "friction"),
    )
