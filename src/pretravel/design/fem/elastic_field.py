"""Displacement and stress of the whole mesh at the trigger, from the reduced model."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.design.contact_stress import ContactStress, seat_stress, tip_stress
from pretravel.design.fem.compliance import FiniteElements, seat_closure
from pretravel.design.fem.condensation import ElasticField, ReducedModel
from pretravel.design.fem.elasticity import stress_of
from pretravel.design.fem.interface_loads import INTERFACE, SEATS, SPRING_FORCE, TIP_FORCE
from pretravel.prediction import (
    Probe,
    Trigger,
    loaded,
    predict,
    seat_frame,
    seat_statics,
)
from pretravel.six_seats import PIEZO_STAGE, SEAT_NAMES

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class TriggerField:
    """Displacement and stress of every element at the trigger in one direction.

    Attributes
    ----------
    elastic : ElasticField
        The mesh.
    trigger : Trigger
        In the one direction.
    displacement : (n, 3) float
        From rest (preloaded, not touched) to the trigger. [mm]
    stress : (m,) float
        Von Mises stress at the trigger, preload included. [MPa]
    rest_stress : (m,) float
        The same at rest. [MPa]
    rest_reactions : (6,) float
        [N]
    points, forces : (8, 3) float
        Points at which seats, tip and spring push, and their forces at the trigger. [mm], [N]
    seats : ContactStress
        Of the six seats at the trigger, which the stress of elements does not contain.
    seats_at_rest : ContactStress
    tip : ContactStress
        Of tip and part, one force.
    open_at : float
        Load of a seat at which it counts as open. [N]
    """

    elastic: ElasticField
    trigger: Trigger
    displacement: FloatArray
    stress: FloatArray
    rest_stress: FloatArray
    rest_reactions: FloatArray
    points: FloatArray
    forces: FloatArray
    seats: ContactStress
    seats_at_rest: ContactStress
    tip: ContactStress
    open_at: float = 0.0

    @property
    def opened(self) -> list[str]:
        """Seats without load at the trigger; more than one in a plane of symmetry, or none."""
        reactions = self.trigger.reactions[0]
        loose = reactions <= self.open_at + 1e-6 * self.rest_reactions.max()
        return [name for name, is_loose in zip(SEAT_NAMES, loose, strict=True) if is_loose]


def refuse_what_no_field_shows(probe: Probe) -> None:
    """Refuse a probe whose state at the trigger is not that of six seats that hold or open.

    Raises
    ------
    PretravelError
        Friction at the seats or at the tip; a criterion at which a seat would pull.
    """
    for place, friction in (("[seats]", probe.seats.friction), ("[tip]", probe.tip.friction)):
        if friction > 0.0:
            raise PretravelError(
                f"the state in the finite elements is that without friction, and {place} has "
                f"{friction:g}: set it to 0. A prediction with the model fem contains that of seats"
            )
    if probe.criterion == "arm_lift":
        raise PretravelError(
            "the state in the finite elements is that before a seat opens; with the criterion "
            "'arm_lift' of [trigger] one of a rod is open before: make it 'first_contact', or "
            "predict with the model fem"
        )


def field_at_trigger(probe: Probe, direction: npt.ArrayLike, reduced: ReducedModel) -> TriggerField:
    """Compute displacement and stress of the whole mesh at the trigger, from the reduced model.

    Parameters
    ----------
    probe : Probe
    direction : (3,) float
        Outward surface normal, probe frame, unit vector.
    reduced : ReducedModel
        Of this probe.

    Returns
    -------
    TriggerField

    Raises
    ------
    PretravelError
        The probe never triggers in that direction; a reduced model with other seats or another
        tip than this probe's; friction, or a criterion at which a seat would pull.
    """
    refuse_what_no_field_shows(probe)
    normal = np.reshape(np.asarray(direction, dtype=np.float64), (1, 3))
    trigger = predict(probe, normal, FiniteElements(reduced))
    statics = seat_statics(probe)
    rest, touched = _forces_at_rest(probe), _forces_at_trigger(probe, trigger, 0)
    change = touched - rest
    log.info("displacement and stress of all elements")
    loading = loaded(probe, statics, trigger.directions, trigger.force, probe.part_material())
    rigid = seat_closure(reduced, loading, change)
    elastic = reduced.elastic_field
    mesh = elastic.mesh
    stress = stress_of(mesh, elastic.materials)
    frame = seat_frame(probe)
    top = np.array([0.0, 0.0, mesh.points[np.unique(mesh.faces["spring"]), 2].max()])
    return TriggerField(
        elastic=elastic,
        trigger=trigger,
        displacement=frozen(reduced.lift(change, rigid)),
        stress=frozen(stress(reduced.lift(touched))),
        rest_stress=frozen(stress(reduced.lift(rest))),
        rest_reactions=statics.rest_reactions,
        points=frozen(
            np.concatenate([frame.contacts(probe.tripod.rod_radius), [statics.tip], [top]])
        ),
        forces=frozen(
            np.concatenate(
                [
                    touched[SEATS, None] * frame.normals,
                    touched[None, TIP_FORCE],
                    [[0.0, 0.0, -probe.preload]],
                ]
            )
        ),
        seats=seat_stress(probe, trigger.reactions[0]),
        seats_at_rest=seat_stress(probe, statics.rest_reactions),
        tip=tip_stress(probe, trigger.force, probe.part_material()),
        open_at=0.0 if probe.criterion == PIEZO_STAGE else probe.threshold,
    )


@dataclass(frozen=True, eq=False)
class StressByDirection:
    """The highest stress of each part at the trigger, for several directions.

    Attributes
    ----------
    directions : (d, 3) float
        Outward surface normals, probe frame.
    parts : tuple of str
        Names of the p solids.
    rest : (p,) float
        Highest von Mises stress at rest, by part. [MPa]
    highest : (d, p) float
        The same at the trigger. [MPa]
    places : (d, p, 3) float
        Centres of the elements that have it. [mm]
    seats : ContactStress
        Of the six seats at the trigger, (d, 6).
    """

    directions: FloatArray
    parts: tuple[str, ...]
    rest: FloatArray
    highest: FloatArray
    places: FloatArray
    seats: ContactStress

    @property
    def figures(self) -> dict[str, float]:
        """The highest of all parts, by name with unit."""
        return {
            "highest stress at rest / MPa": float(self.rest.max()),
            "highest stress at the trigger on walls / MPa": float(self.highest.max()),
            "highest pressure of a seat on walls / MPa": float(self.seats.pressure.max()),
            "highest shear of a seat, of its limit / %": 100.0
            * float(self.seats.share_of_limit.max()),
        }


def stress_by_direction(
    probe: Probe,
    directions: npt.ArrayLike,
    reduced: ReducedModel,
    first: TriggerField | None = None,
) -> StressByDirection:
    """The highest stress of each part at the trigger.

    It is the mean over an element, so that at edges and seats it depends on the mesh.

    Parameters
    ----------
    probe : Probe
    directions : (d, 3) float
        Outward surface normals, probe frame, unit vectors.
    reduced : ReducedModel
        Of this probe.
    first : TriggerField, optional
        The state in the first of the directions, where it is known: its stress is not computed
        again.

    Raises
    ------
    PretravelError
        As `field_at_trigger`.
    """
    trigger = predict(probe, directions, FiniteElements(reduced))
    elastic = reduced.elastic_field
    mesh = elastic.mesh
    log.info("stress of all elements in %d directions", len(trigger.directions))
    stress = stress_of(mesh, elastic.materials)
    rows = [np.flatnonzero(mesh.regions == index) for index in range(len(mesh.region_names))]
    centers = mesh.points[mesh.elements].mean(axis=1)
    highest, places = [], []
    for number in range(len(trigger.directions)):
        found = (
            stress(reduced.lift(_forces_at_trigger(probe, trigger, number)))
            if first is None or number > 0
            else first.stress
        )
        worst = [own[np.argmax(found[own])] for own in rows]
        highest.append(found[worst])
        places.append(centers[worst])
    rest = stress(reduced.lift(_forces_at_rest(probe))) if first is None else first.rest_stress
    return StressByDirection(
        directions=trigger.directions,
        parts=tuple(mesh.region_names),
        rest=frozen([rest[own].max() for own in rows]),
        highest=frozen(highest),
        places=frozen(places),
        seats=seat_stress(probe, trigger.reactions),
    )


def _forces_at_rest(probe: Probe) -> FloatArray:
    """On the interface, preloaded and not touched, (22,). [N]"""
    forces = np.zeros(len(INTERFACE))
    forces[SEATS] = seat_statics(probe).rest_reactions
    forces[SPRING_FORCE] = probe.preload
    return forces


def _forces_at_trigger(probe: Probe, trigger: Trigger, number: int) -> FloatArray:
    """On the interface, in one of the directions of a prediction, (22,). [N]"""
    forces = np.zeros(len(INTERFACE))
    forces[SEATS] = trigger.reactions[number]
    forces[SPRING_FORCE] = probe.preload
    forces[TIP_FORCE] = trigger.force[number] * trigger.directions[number]
    return forces
