"""The behaviour of a probe's tip at the trigger, in the machine's frame: predicted or measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, PretravelError, frozen
from pretravel.maps import CondensedProbe, PretravelMap
from pretravel.prediction import (
    ComplianceModel,
    Material,
    Probe,
    lifted_tip_motion,
    load_probe,
    probe_response,
)


@dataclass(frozen=True, eq=False)
class TipState:
    """The state of the tip at the trigger, for n directions of the force on it.

    Attributes
    ----------
    force : (n,) float
        Infinite where the probe never triggers; not a number where forces are unknown. [N]
    deflection : (n, 3) float
        C - P: from the tip's place with a straight stylus to the tip's centre. [mm]
    compression : (n,) float
        Of the ball and a flat part, for a force along the normal. [mm]
    """

    force: FloatArray
    deflection: FloatArray
    compression: FloatArray


class TipBehaviour(Protocol):
    """A probe at the contact: how the tip moves, and at which force the probe triggers."""

    @property
    def radius(self) -> float:
        """Of the ball. [mm]"""
        ...

    @property
    def shear_ratio(self) -> float:
        """Displacement along the contact when it slips, over friction times compression."""
        ...

    @property
    def has_forces(self) -> bool:
        """Whether the forces at the trigger are known."""
        ...

    def state(self, directions: FloatArray) -> TipState:
        """The tip at the trigger, for (n, 3) directions of the force on it."""
        ...

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """Distance of the trigger's criterion from zero under given forces, (n,). [N]"""
        ...

    def supports(self, directions: FloatArray) -> BoolArray:
        """In which (n, 3) directions the behaviour is known, (n,)."""
        ...

    def turned(self, rotation: FloatArray) -> TipBehaviour:
        """The same tip in another frame: x_there = rotation x_here."""
        ...


@dataclass(frozen=True, eq=False)
class PredictedTip:
    """The tip of a described probe; see `predicted_tip`."""

    response: CondensedProbe
    rotation: FloatArray
    radius: float
    shear_ratio: float

    @property
    def has_forces(self) -> bool:
        return True

    def state(self, directions: FloatArray) -> TipState:
        own = directions @ self.rotation
        force, _ = self.response.force(own)
        reached = np.isfinite(force)
        safe = np.where(reached, force, 0.0)
        deflection = self.response.deflection(own, safe) @ self.rotation.T
        return TipState(
            force=force,
            deflection=np.where(reached[:, None], deflection, np.nan),
            compression=np.where(reached, self.response.tip_approach(safe), np.nan),
        )

    def deflection(self, direction: FloatArray, force: float) -> FloatArray:
        """C - P under one force along one direction, (1, 3). [mm]"""
        own = direction @ self.rotation
        return np.asarray(self.response.deflection(own, np.array([force])) @ self.rotation.T)

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        return self.response.excess(directions @ self.rotation, forces)

    def supports(self, directions: FloatArray) -> BoolArray:
        return np.ones(len(directions), dtype=bool)

    def turned(self, rotation: FloatArray) -> PredictedTip:
        return replace(self, rotation=frozen(rotation @ self.rotation))


def predicted_tip(
    probe: Probe,
    model: str | ComplianceModel = "analytic",
    *,
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
) -> PredictedTip:
    """Predict how the tip of a described probe behaves, by a model.

    Parameters
    ----------
    probe, model, workpiece, gravity
        As for `pretravel.prediction.trigger.predict`.

    Returns
    -------
    PredictedTip

    >>> from pretravel.prediction.catalogue import load_probe
    >>> tip = predicted_tip(load_probe("omp40-2"))
    >>> float(tip.state(np.array([[1.0, 0.0, 0.0]])).force[0].round(3))
    0.75
    """
    part = probe.part_material(workpiece)
    ball = probe.tip.material
    # Johnson, equation 7.42b: the whole contact begins to slip at a displacement of
    # 3 mu N Lambda / (16 a), which with a² = R delta and N = 4 E* a³ / (3 R) is
    # mu delta E* Lambda / 4.
    shear = (2.0 - ball.poissons_ratio) / ball.shear_modulus + (
        2.0 - part.poissons_ratio
    ) / part.shear_modulus
    return PredictedTip(
        response=probe_response(probe, model, workpiece=part, gravity=gravity),
        rotation=probe.orientation.matrix,
        radius=probe.tip.radius,
        shear_ratio=0.25 * ball.contact_modulus(part) * shear,
    )


@dataclass(frozen=True, eq=False)
class OpeningTip:
    """The tip of a probe whose contact opens a little after the force of the trigger is reached.

    Parameters
    ----------
    tip : PredictedTip
        Without the opening.
    motion : (3, 3) float
        Displacement of the tip until the contact of each rod is open, probe frame. [mm]
    """

    tip: PredictedTip
    motion: FloatArray

    @property
    def radius(self) -> float:
        return self.tip.radius

    @property
    def shear_ratio(self) -> float:
        return self.tip.shear_ratio

    @property
    def has_forces(self) -> bool:
        return True

    def state(self, directions: FloatArray) -> TipState:
        state, rotation = self.tip.state(directions), self.tip.rotation
        _, seat = self.tip.response.force(directions @ rotation)
        return replace(state, deflection=state.deflection + self.motion[seat // 2] @ rotation.T)

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        return self.tip.excess(directions, forces)

    def supports(self, directions: FloatArray) -> BoolArray:
        return self.tip.supports(directions)

    def turned(self, rotation: FloatArray) -> OpeningTip:
        return replace(self, tip=self.tip.turned(rotation))


@dataclass(frozen=True, eq=False)
class MeasuredTip:
    """The tip of a probe of which only a map is known.

    A map states the travel along the normal. The displacement of the tip along the surface
    follows from `PretravelMap.tip_displacement`. Forces are unknown.

    Parameters
    ----------
    pretravel_map : PretravelMap
    extrapolate : bool
        Whether the map is used outside its directions too.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> mean = PretravelMap(MeanBasis(), np.array([0.01]), Covariance.independent([0.0]),
    ...                     DirectionSupport(np.eye(3)[2:]), tip_radius=3.0)
    >>> MeasuredTip(mean).state(np.eye(3)[2:]).deflection.tolist()
    [[0.0, 0.0, 0.01]]
    """

    pretravel_map: PretravelMap
    extrapolate: bool = False

    @property
    def radius(self) -> float:
        return self.pretravel_map.tip_radius

    @property
    def shear_ratio(self) -> float:
        return 0.0

    @property
    def has_forces(self) -> bool:
        return False

    def state(self, directions: FloatArray) -> TipState:
        # Iterations may leave the map; the caller checks the result by `supports`.
        moved = self.pretravel_map.tip_displacement(directions, extrapolate=True)
        n = len(directions)
        return TipState(np.full(n, np.nan), moved, np.zeros(n))

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        del forces  # unknown: there is nothing to compare
        return np.zeros(len(directions))

    def supports(self, directions: FloatArray) -> BoolArray:
        if self.extrapolate or len(directions) == 0:
            return np.ones(len(directions), dtype=bool)
        return self.pretravel_map.supports(directions)

    def turned(self, rotation: FloatArray) -> MeasuredTip:
        turned = rotation @ self.pretravel_map.rotation
        return replace(self, pretravel_map=replace(self.pretravel_map, rotation=turned))


def mapped_tip(pretravel_map: PretravelMap, *, extrapolate: bool = False) -> TipBehaviour:
    """The tip of a probe of which a map is known; a predicted map contains the forces too.

    Parameters
    ----------
    pretravel_map : PretravelMap
    extrapolate : bool
        Whether the map is used outside its directions too; a predicted map holds everywhere.
    """
    probe = pretravel_map.basis.condensed_probe
    if probe is not None:
        return PredictedTip(probe, pretravel_map.rotation, pretravel_map.tip_radius, 0.0)
    return MeasuredTip(pretravel_map, extrapolate)


@dataclass(frozen=True, eq=False)
class LateralTip:
    """The tip of the thesis: it is stiff along the probe axis and not compressed.

    The deflection is the model's sensing distance, in the direction of the force's
    projection across the axis.

    References
    ----------
    Rodrigues 2021, sections 3.3 and 3.4.
    """

    tip: PredictedTip

    @property
    def radius(self) -> float:
        return self.tip.radius

    @property
    def shear_ratio(self) -> float:
        return 0.0

    @property
    def has_forces(self) -> bool:
        return True

    @property
    def axis(self) -> FloatArray:
        """The probe's axis in the machine, (3,)."""
        return frozen(self.tip.rotation[:, 2])

    def sideways(self, vectors: FloatArray) -> FloatArray:
        """Projections of (n, 3) vectors onto the plane perpendicular to the axis."""
        return np.asarray(vectors - (vectors @ self.axis)[:, None] * self.axis)

    def across(self, directions: FloatArray) -> FloatArray:
        """Unit vectors along `sideways`; zero where that is zero."""
        lateral = self.sideways(directions)
        length = np.linalg.norm(lateral, axis=1, keepdims=True)
        return np.asarray(np.where(length > 1e-12, lateral / np.maximum(length, 1e-12), 0.0))

    def state(self, directions: FloatArray) -> TipState:
        full = self.tip.state(directions)
        distance = np.linalg.norm(self.sideways(full.deflection), axis=1, keepdims=True)
        return TipState(full.force, distance * self.across(directions), 0.0 * full.compression)

    def deflection(self, direction: FloatArray, force: float) -> FloatArray:
        """Sideways part of the model's deflection under one force, (1, 3). [mm]"""
        return self.sideways(self.tip.deflection(direction, force))

    def force_at(self, direction: FloatArray, deflection: float) -> float:
        """The force along a direction that causes a deflection, below that at the trigger.

        Parameters
        ----------
        direction : (1, 3) float
        deflection : float
            [mm]

        Returns
        -------
        float
            [N]
        """
        from scipy.optimize import brentq

        limit = float(self.tip.state(direction).force[0])

        def error(force: float) -> float:
            return float(np.linalg.norm(self.deflection(direction, force))) - deflection

        return float(brentq(error, 0.0, limit, xtol=1e-14 * limit, rtol=1e-14))

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        return self.tip.excess(directions, forces)

    def supports(self, directions: FloatArray) -> BoolArray:
        return self.tip.supports(directions)

    def turned(self, rotation: FloatArray) -> LateralTip:
        return LateralTip(self.tip.turned(rotation))


def tip_of(
    probe: Probe | PretravelMap | TipBehaviour | str,
    model: str = "analytic",
    *,
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
) -> TipBehaviour:
    """The tip of a description, of a probe in the catalogue or of a map; or the tip itself.

    Parameters
    ----------
    probe : Probe, PretravelMap, TipBehaviour or str
    model, workpiece, gravity
        For a description: as for `predicted_tip`.

    Raises
    ------
    PretravelError
        An object of another type.

    >>> tip_of("omp40-2").radius
    3.0
    """
    if isinstance(probe, str):
        probe = load_probe(probe)
    if isinstance(probe, Probe):
        closed = replace(probe, opening=0.0) if probe.opening else probe
        tip = predicted_tip(closed, model, workpiece=workpiece, gravity=gravity)
        if not probe.opening:
            return tip
        return OpeningTip(tip, frozen(probe.opening * lifted_tip_motion(probe)))
    if isinstance(probe, PretravelMap):
        return mapped_tip(probe)
    if all(
        hasattr(probe, name) for name in ("state", "radius", "has_forces", "supports", "turned")
    ):
        return probe
    raise PretravelError(
        f"a probe is needed, not a {type(probe).__name__}: load_probe('omp40-2'), a map, or a tip "
        "(predicted_tip)"
    )
