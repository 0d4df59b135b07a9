"""Trigger force, deflection and pretravel of a described probe in any direction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    MICROMETRE,
    FloatArray,
    IntArray,
    PretravelError,
    ShownInNotebooks,
    WithDataFrame,
    WithDataset,
    WithPlot,
    checked_unit,
    describe,
    extent,
    frozen,
    object_at,
)
from pretravel.maps import DirectionSupport, Origin, PretravelMap, Provenance, TabulatedBasis
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel, compliance_model
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import loaded_to_trigger
from pretravel.prediction.materials import Material
from pretravel.prediction.seats import lifted_tip_motion, statics_in_machine
from pretravel.prediction.slender import refuse_slender
from pretravel.six_seats import PIEZO_STAGE, SEAT_NAMES
from pretravel.uncertainty import Covariance


@dataclass(frozen=True, eq=False)
class Trigger(ShownInNotebooks, WithPlot, WithDataFrame, WithDataset):
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

    def __repr__(self) -> str:
        return (
            f"Trigger({len(self.directions):,} directions, model {self.model}; "
            f"force {extent(self.force, 2)} N; "
            f"pretravel {extent(self.pretravel / MICROMETRE)} µm)"
        )

    @property
    def deflection(self) -> FloatArray:
        """C - P: displacement of the tip centre against that of a rigid probe, (n, 3). [mm]"""
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
        """Length of the deflection's component across the probe axis, (n,). [mm]"""
        return np.asarray(np.linalg.norm(self.deflection[:, :2], axis=1))

    @property
    def pretravel(self) -> FloatArray:
        """Travel from first contact to trigger for approach along -n, (n,). [mm]"""
        return np.asarray(np.sum(self.deflection * self.directions, axis=1) + self.tip_approach)

    @property
    def shares(self) -> Mapping[str, FloatArray]:
        """Share of each compliance in the pretravel, (n,) each; their sum is the pretravel. [mm]"""
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
    model: str | ComplianceModel = "analytic",
    *,
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
) -> Trigger:
    """Predict the state at the trigger in each direction.

    Parameters
    ----------
    probe : Probe
    directions : (n, 3) float
        Outward surface normals, probe frame, unit vectors.
    model : str or ComplianceModel
        ``analytic``, ``fem``, ``ren``, ``shen``, ``wozniak``; or an object of the user's.
    workpiece : Material or its name, optional
        Steel when not given.
    gravity : (3,) float, optional
        Unit direction of gravity, in the machine's frame. Weight is neglected
        when not given.

    Returns
    -------
    Trigger
        A contact that opens adds the share ``opening`` to those of the model. With friction at
        the seats: of the third of three equal touches, and with two shares,
        ``body`` and ``seats``, in addition to ``tip_on_part``.

    Raises
    ------
    PretravelError
        Unknown model; a direction in which no seat ever opens; friction with a model that does
        not contain it, or with gravity.
    DescriptionError
        The seats do not hold the tripod at rest; a stylus that bends too far, or buckles.

    References
    ----------
    Rodrigues 2021, sections 2.9 and 3.2.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> trigger = predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]])
    >>> float(trigger.force[0].round(3)), trigger.seat_names
    (0.75, ['A-left'])
    """
    if not isinstance(probe, Probe):
        raise PretravelError(
            f"a described probe is needed, not a {type(probe).__name__}: load_probe('omp40-2')"
        )
    part = probe.part_material(workpiece)
    chosen = compliance_model(model)
    d = checked_unit(directions, "directions")
    rubs_in_model = chosen.contains_friction(probe)
    if not rubs_in_model:
        probe.refuse_tip_friction(f"model {chosen.name} of this description")
    if probe.seats.friction > 0.0 and not rubs_in_model:
        found = _predict_with_friction(probe, d, chosen, part, gravity)
        refuse_slender(probe, d, found.force, found.deflection)
        return found
    statics = statics_in_machine(probe, gravity)
    loading, seat = loaded_to_trigger(probe, statics, d, part)
    force = loading.force
    never = ~np.isfinite(force)
    if np.any(never):
        first = int(np.flatnonzero(never)[0])
        raise PretravelError(
            f"the probe never triggers in {int(never.sum())} of {len(d)} directions, the first "
            f"at {describe(d[first])}: {_why_never(probe)}"
        )
    displacements = dict(chosen.displacements(loading))
    if probe.opening:
        displacements["opening"] = probe.opening * lifted_tip_motion(probe)[seat // 2]
    found = Trigger(
        directions=frozen(d),
        force=frozen(force),
        seat=seat,
        reactions=frozen(loading.reactions),
        displacements={share: frozen(vector) for share, vector in displacements.items()},
        model=chosen.name,
    )
    refuse_slender(probe, d, found.force, found.deflection)
    return found


def _why_never(probe: Probe) -> str:
    if probe.criterion == PIEZO_STAGE:
        return (
            f"a rod lifts before the force is {probe.threshold:g} N, at which the piezo stage "
            "triggers. Lower threshold_N of [trigger], or raise the preload."
        )
    return (
        "a force in that direction unloads no seat. At polar angles towards 180° the part pushes "
        "the tip away from the spindle, and the tripod into its seats."
    )


def _predict_with_friction(
    probe: Probe,
    directions: FloatArray,
    model: ComplianceModel,
    workpiece: Material,
    gravity: npt.ArrayLike | None,
) -> Trigger:
    # A wing, and the libraries for finite elements take a second to load.
    rubbed_trigger = object_at("pretravel.design:rubbed_trigger")

    if gravity is not None:
        raise PretravelError(
            "friction at the seats and gravity are not predicted together; leave one of them out",
            inputs=("gravity", "friction"),
        )
    cycle, displacements = rubbed_trigger(probe, directions, model, workpiece)
    reactions = cycle.trigger_reactions[:, -1]
    return Trigger(
        directions=frozen(directions),
        force=frozen(cycle.trigger_force[:, -1]),
        seat=np.argmin(reactions, axis=1),
        reactions=frozen(reactions),
        displacements=displacements,
        model=model.name,
    )


def predicted_map(probe: Probe, trigger: Trigger) -> PretravelMap:
    """Make a map from a prediction: a table of directions, interpolated linearly.

    `pretravel.prediction.response.response_map` is exact between the directions.

    Parameters
    ----------
    probe : Probe
        Its tip radius and orientation are used.
    trigger : Trigger
        Predicted for at least one direction; repeated directions count once.

    Returns
    -------
    PretravelMap
        With zero covariance: a prediction does not contain the difference between the
        description and the real probe.

    >>> from pretravel.base.directions import grid
    >>> from pretravel.prediction.catalogue import load_probe
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
        covariance=Covariance.none(len(keep)),
        support=support,
        tip_radius=probe.tip.radius,
        u_tip_radius=probe.tip.u_radius,
        rotation=probe.orientation.matrix,
        provenance=Provenance(
            Origin.PREDICTED, f"predicted, model {trigger.model}", probe=probe.name
        ),
    )
