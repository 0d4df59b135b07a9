"""Trigger force, deflection and pretravel of a described probe in any direction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.directions import checked_unit, describe
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.bases import TabulatedBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.probe.description import Probe, default_workpiece
from pretravel.probe.materials import Material
from pretravel.probe.seat_frame import SEAT_NAMES
from pretravel.trigger.compliance import analytic, ren, shen, wozniak
from pretravel.trigger.event import trigger_force
from pretravel.trigger.seats import SeatStatics, seat_statics

TIP_ON_PART = "tip_on_part"
"""The one share that moves the tip into the part and not against the spindle."""


class Displacements(Protocol):
    """What a model is: displacement of the tip under given forces, by compliance."""

    def __call__(
        self,
        probe: Probe,
        statics: SeatStatics,
        directions: FloatArray,
        forces: FloatArray,
        workpiece: Material,
    ) -> Mapping[str, FloatArray]: ...


def _finite_elements(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    forces: FloatArray,
    workpiece: Material,
) -> Mapping[str, FloatArray]:
    """`fem.displacements`, imported when first asked for: CAD kernel and solver come with it."""
    from pretravel.trigger.compliance import fem

    return fem.displacements(probe, statics, directions, forces, workpiece)


MODELS: Mapping[str, Displacements] = {
    "analytic": analytic.displacements,
    "fem": _finite_elements,
    "ren": ren.displacements,
    "shen": shen.displacements,
    "wozniak": wozniak.displacements,
}
"""Models by name. All have the same statics; they differ in what gives."""


@dataclass(frozen=True, eq=False)
class Trigger:
    """The state of a probe at the trigger, for each of n directions, probe frame.

    Attributes
    ----------
    directions : (n, 3) float
        Outward surface normals.
    force : (n,) float
        Trigger force. [N]
    seat : (n,) int
        Which seat opened; see `seat_names`.
    reactions : (n, 6) float
        Seat reactions at the trigger. [N]
    displacements : mapping of str to (n, 3) float
        By compliance. [mm]
    model : str
    """

    directions: FloatArray
    force: FloatArray
    seat: IntArray
    reactions: FloatArray
    displacements: Mapping[str, FloatArray]
    model: str

    @property
    def deflection(self) -> FloatArray:
        """C - P: tip centre against where it were with everything rigid, (n, 3). [mm]"""
        return np.asarray(
            sum(
                (vector for name, vector in self.displacements.items() if name != TIP_ON_PART),
                start=np.zeros_like(self.directions),
            )
        )

    @property
    def tip_approach(self) -> FloatArray:
        """Approach of tip centre and part by local compression, (n,). [mm]"""
        if TIP_ON_PART not in self.displacements:
            return np.zeros(len(self.force))
        return np.asarray(np.sum(self.displacements[TIP_ON_PART] * self.directions, axis=1))

    @property
    def sensing_distance(self) -> FloatArray:
        """Length of the deflection's part across the probe axis, (n,). [mm]"""
        return np.asarray(np.linalg.norm(self.deflection[:, :2], axis=1))

    @property
    def pretravel(self) -> FloatArray:
        """Travel from first contact to trigger for approach along -n, (n,). [mm]"""
        return np.asarray(np.sum(self.deflection * self.directions, axis=1) + self.tip_approach)

    @property
    def shares(self) -> Mapping[str, FloatArray]:
        """Each compliance's part of the pretravel, (n,) each; they add up to it. [mm]"""
        return {
            name: np.asarray(np.sum(vector * self.directions, axis=1))
            for name, vector in self.displacements.items()
        }

    @property
    def seat_names(self) -> list[str]:
        """Names of the seats that opened."""
        return [SEAT_NAMES[index] for index in self.seat]


def predict(
    probe: Probe,
    directions: npt.ArrayLike,
    model: str | Displacements = "analytic",
    *,
    workpiece: Material | None = None,
    gravity: npt.ArrayLike | None = None,
) -> Trigger:
    """The trigger in every direction, at once.

    Parameters
    ----------
    probe : Probe
    directions : (n, 3) float
        Outward surface normals, probe frame, unit vectors.
    model : str or callable
        ``analytic``, ``fem``, ``ren``, ``shen``, ``wozniak``; or a function like them.
    workpiece : Material, optional
        Steel when not given.
    gravity : (3,) float, optional
        Unit direction in which weight pulls, in the machine's frame. Not given:
        weight is left out.

    Returns
    -------
    Trigger

    Raises
    ------
    PretravelError
        Unknown model; a direction in which no seat ever opens.
    DescriptionError
        The seats do not hold the tripod at rest.

    References
    ----------
    Rodrigues 2021, sections 2.9 and 3.2; DESIGN: one event, not a search.

    >>> from pretravel.probe.catalogue import load_probe
    >>> trigger = predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]])
    >>> float(trigger.force[0].round(3)), trigger.seat_names
    (0.75, ['A-left'])
    """
    name, displacements = model_named(model)
    d = checked_unit(directions, "directions")
    if gravity is not None:
        to_machine = probe_rotation(probe.orientation.axis, probe.orientation.rotation)
        gravity = np.asarray(gravity, dtype=np.float64) @ to_machine
    statics = seat_statics(probe, gravity)
    unit_reactions = statics.unit_reactions(d)
    force, seat = trigger_force(
        statics.rest_reactions, unit_reactions, probe.criterion, probe.threshold
    )
    never = ~np.isfinite(force)
    if np.any(never):
        first = int(np.flatnonzero(never)[0])
        raise PretravelError(
            f"the probe never triggers in {int(never.sum())} of {len(d)} directions, the first "
            f"at {describe(d[first])}: a force that way presses every seat on. Polar angles "
            "well above 90° cannot be probed by this tripod."
        )
    return Trigger(
        directions=frozen(d),
        force=frozen(force),
        seat=seat,
        reactions=frozen(statics.rest_reactions + force[:, None] * unit_reactions),
        displacements={
            share: frozen(vector)
            for share, vector in displacements(
                probe, statics, d, force, workpiece or default_workpiece()
            ).items()
        },
        model=name,
    )


def model_named(model: str | Displacements) -> tuple[str, Displacements]:
    """A model with its name, from either.

    Raises
    ------
    PretravelError
        A name that is not known.

    >>> model_named("shen")[0]
    'shen'
    """
    if not isinstance(model, str):
        return getattr(model, "__name__", "own"), model
    if model not in MODELS:
        raise PretravelError(f"model '{model}' is not known; there are {', '.join(sorted(MODELS))}")
    return model, MODELS[model]


def predicted_map(probe: Probe, trigger: Trigger) -> PretravelMap:
    """The pretravel of a prediction as a table of directions: linear between them.

    `pretravel.trigger.response.response_map` is exact in between.

    Parameters
    ----------
    probe : Probe
        Gives tip radius and orientation.
    trigger : Trigger
        Predicted for at least one direction; repeated ones count once.

    Returns
    -------
    PretravelMap
        With zero covariance: how far the description is from the probe is not known
        to the prediction.

    >>> from pretravel.directions import grid
    >>> from pretravel.probe.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> ring = grid(np.pi / 2, np.radians(np.arange(0, 360, 10)))
    >>> predicted_map(probe, predict(probe, ring)).kind
    'tabulated'
    """
    _, first = np.unique(np.round(trigger.directions, 9), axis=0, return_index=True)
    keep = np.sort(first)
    support = DirectionSupport(trigger.directions[keep])
    return PretravelMap(
        basis=TabulatedBasis(support),
        coefficients=trigger.pretravel[keep],
        covariance=np.zeros(len(keep)),
        support=support,
        tip_radius=probe.tip.radius,
        u_tip_radius=probe.tip.u_radius,
        rotation=probe_rotation(probe.orientation.axis, probe.orientation.rotation),
        provenance={"source": f"predicted, model {trigger.model}", "probe": probe.name},
    )
