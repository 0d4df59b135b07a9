"""Displacement and stress of the whole mesh at the trigger, from the reduced model."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.model.fem.condensation import ElasticField, ReducedModel
from pretravel.model.fem.elasticity import von_mises
from pretravel.model.fem.interface_loads import INTERFACE, SEATS, SPRING_FORCE, TIP_FORCE
from pretravel.probe.description import Probe
from pretravel.probe.materials import default_workpiece
from pretravel.probe.seat_frame import SEAT_NAMES, seat_frame
from pretravel.trigger.compliance.fem import FiniteElements, seat_closure
from pretravel.trigger.loading import loaded
from pretravel.trigger.predict import Trigger, predict
from pretravel.trigger.seats import seat_statics

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
    """

    elastic: ElasticField
    trigger: Trigger
    displacement: FloatArray
    stress: FloatArray
    rest_stress: FloatArray
    rest_reactions: FloatArray
    points: FloatArray
    forces: FloatArray

    @property
    def opened(self) -> list[str]:
        """Seats without load at the trigger; more than one in a plane of symmetry."""
        reactions = self.trigger.reactions[0]
        loose = reactions <= reactions.min() + 1e-6 * self.rest_reactions.max()
        return [name for name, is_loose in zip(SEAT_NAMES, loose, strict=True) if is_loose]


def field_at_trigger(probe: Probe, direction: npt.ArrayLike, reduced: ReducedModel) -> TriggerField:
    """Lift the reduced model's state at the trigger back to the mesh.

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
        tip than this probe's.
    """
    normal = np.reshape(np.asarray(direction, dtype=np.float64), (1, 3))
    trigger = predict(probe, normal, FiniteElements(reduced))
    statics = seat_statics(probe)
    rest, touched = np.zeros(len(INTERFACE)), np.zeros(len(INTERFACE))
    rest[SEATS], touched[SEATS] = statics.rest_reactions, trigger.reactions[0]
    rest[SPRING_FORCE] = touched[SPRING_FORCE] = probe.preload
    touched[TIP_FORCE] = trigger.force[0] * trigger.directions[0]
    change = touched - rest
    log.info("displacement and stress of all elements")
    loading = loaded(probe, statics, trigger.directions, trigger.force, default_workpiece())
    rigid = seat_closure(reduced, loading, change)
    elastic = reduced.elastic_field
    materials, mesh = elastic.materials, elastic.mesh
    frame = seat_frame(probe)
    top = np.array([0.0, 0.0, mesh.points[np.unique(mesh.faces["spring"]), 2].max()])
    return TriggerField(
        elastic=elastic,
        trigger=trigger,
        displacement=frozen(reduced.lift(change, rigid)),
        stress=frozen(von_mises(mesh, materials, reduced.lift(touched))),
        rest_stress=frozen(von_mises(mesh, materials, reduced.lift(rest))),
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
    )
