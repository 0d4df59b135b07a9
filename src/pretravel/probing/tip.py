"""What a probe's tip does at the trigger, in the machine's frame: predicted or measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.model.hertz import contact_modulus
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe, default_workpiece
from pretravel.probe.materials import Material, material
from pretravel.trigger.predict import Displacements
from pretravel.trigger.response import ProbeResponse, ResponseBasis, probe_response


@dataclass(frozen=True, eq=False)
class TipState:
    """The tip at the trigger, for n directions of the force on it.

    Attributes
    ----------
    force : (n,) float
        Infinite where the probe never triggers, not a number where forces are not known. [N]
    deflection : (n, 3) float
        C - P: tip centre against where it were with the stylus straight. [mm]
    approach : (n,) float
        Of the tip's centre and a flat part, were the force along the normal. [mm]
    """

    force: FloatArray
    deflection: FloatArray
    approach: FloatArray


class Tip(Protocol):
    """A probe as a part sees it."""

    @property
    def radius(self) -> float:
        """Of the ball. [mm]"""
        ...

    @property
    def shear_ratio(self) -> float:
        """Displacement along the contact when it slips, over friction times approach."""
        ...

    def state(self, directions: FloatArray) -> TipState:
        """At the trigger, for (n, 3) directions of the force on the tip."""
        ...

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """How far the trigger's criterion is from being met under given forces, (n,). [N]"""
        ...

    def supports(self, directions: FloatArray) -> BoolArray:
        """In which (n, 3) directions the tip is known, (n,)."""
        ...

    def turned(self, rotation: FloatArray) -> Tip:
        """The same tip seen from another frame: x_there = rotation x_here."""
        ...


@dataclass(frozen=True, eq=False)
class PredictedTip:
    """The tip of a described probe; see `predicted_tip`."""

    response: ProbeResponse
    rotation: FloatArray
    radius: float
    shear_ratio: float

    def state(self, directions: FloatArray) -> TipState:
        own = directions @ self.rotation
        force, _ = self.response.force(own)
        reached = np.isfinite(force)
        safe = np.where(reached, force, 0.0)
        deflection = self.response.deflection(own, safe) @ self.rotation.T
        return TipState(
            force=force,
            deflection=np.where(reached[:, None], deflection, np.nan),
            approach=np.where(reached, self.response.tip_approach(safe), np.nan),
        )

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        return self.response.excess(directions @ self.rotation, forces)

    def supports(self, directions: FloatArray) -> BoolArray:
        return np.ones(len(directions), dtype=bool)

    def turned(self, rotation: FloatArray) -> PredictedTip:
        return replace(self, rotation=frozen(rotation @ self.rotation))


def predicted_tip(
    probe: Probe,
    model: str | Displacements = "analytic",
    *,
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
) -> PredictedTip:
    """The tip of a described probe under a model.

    Parameters
    ----------
    probe, model, workpiece, gravity
        As for `pretravel.trigger.predict.predict`.

    Returns
    -------
    PredictedTip

    >>> from pretravel.probe.catalogue import load_probe
    >>> tip = predicted_tip(load_probe("omp40-2"))
    >>> float(tip.state(np.array([[1.0, 0.0, 0.0]])).force[0].round(3))
    0.75
    """
    named = material(workpiece) if isinstance(workpiece, str) else workpiece
    part = named or default_workpiece()
    ball = probe.tip.material
    # Johnson, equation 7.42b: slip over the whole contact begins at a displacement of
    # 3 mu N Lambda / (16 a), which with a² = R delta and N = 4 E* a³ / (3 R) is
    # mu delta E* Lambda / 4.
    shear = (2.0 - ball.poissons_ratio) / ball.shear_modulus + (
        2.0 - part.poissons_ratio
    ) / part.shear_modulus
    return PredictedTip(
        response=probe_response(probe, model, workpiece=part, gravity=gravity),
        rotation=probe_rotation(probe.orientation.axis, probe.orientation.rotation),
        radius=probe.tip.radius,
        shear_ratio=0.25 * contact_modulus(ball, part) * shear,
    )


@dataclass(frozen=True, eq=False)
class MeasuredTip:
    """The tip of a probe that is known by a map alone.

    A map tells the travel along the normal, not where the tip goes sideways: that
    follows from `PretravelMap.tip_displacement`. Forces are not known.

    Parameters
    ----------
    pretravel_map : PretravelMap
    extrapolate : bool
        Also outside the map's directions.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.bases import MeanBasis
    >>> mean = PretravelMap(MeanBasis(), np.array([0.01]), np.array([0.0]),
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

    def state(self, directions: FloatArray) -> TipState:
        # Steps on the way may leave the map; where they end is asked of `supports`.
        moved = self.pretravel_map.tip_displacement(directions, extrapolate=True)
        n = len(directions)
        return TipState(np.full(n, np.nan), moved, np.zeros(n))

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        del forces  # not known, nothing to compare
        return np.zeros(len(directions))

    def supports(self, directions: FloatArray) -> BoolArray:
        if self.extrapolate or len(directions) == 0:
            return np.ones(len(directions), dtype=bool)
        return self.pretravel_map.supports(directions)

    def turned(self, rotation: FloatArray) -> MeasuredTip:
        turned = rotation @ self.pretravel_map.rotation
        return replace(self, pretravel_map=replace(self.pretravel_map, rotation=turned))


def mapped_tip(pretravel_map: PretravelMap, *, extrapolate: bool = False) -> Tip:
    """The tip of a probe known by its map; a predicted map still knows the forces.

    Parameters
    ----------
    pretravel_map : PretravelMap
    extrapolate : bool
        Also outside the map's directions; a predicted map holds there too.

    Returns
    -------
    Tip
    """
    basis = pretravel_map.basis
    if isinstance(basis, ResponseBasis):
        return PredictedTip(basis.response, pretravel_map.rotation, pretravel_map.tip_radius, 0.0)
    return MeasuredTip(pretravel_map, extrapolate)


@dataclass(frozen=True, eq=False)
class LateralTip:
    """A tip as the thesis has it: stiff along the probe axis, not compressed.

    The deflection is the model's sensing distance, in the direction of the force's
    projection across the axis.

    Parameters
    ----------
    tip : PredictedTip

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
    def axis(self) -> FloatArray:
        """The probe's axis in the machine, (3,)."""
        return frozen(self.tip.rotation[:, 2])

    def across(self, directions: FloatArray) -> FloatArray:
        """Unit vectors along the projections across the axis; zero where there is none."""
        lateral = directions - (directions @ self.axis)[:, None] * self.axis
        length = np.linalg.norm(lateral, axis=1, keepdims=True)
        return np.asarray(np.where(length > 1e-12, lateral / np.maximum(length, 1e-12), 0.0))

    def state(self, directions: FloatArray) -> TipState:
        full = self.tip.state(directions)
        sideways = full.deflection - (full.deflection @ self.axis)[:, None] * self.axis
        distance = np.linalg.norm(sideways, axis=1, keepdims=True)
        return TipState(full.force, distance * self.across(directions), 0.0 * full.approach)

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        return self.tip.excess(directions, forces)

    def supports(self, directions: FloatArray) -> BoolArray:
        return self.tip.supports(directions)

    def turned(self, rotation: FloatArray) -> LateralTip:
        return LateralTip(self.tip.turned(rotation))


def tip_of(
    probe: Probe | PretravelMap | Tip | str,
    model: str = "analytic",
    *,
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
    extrapolate: bool = False,
) -> Tip:
    """The tip of a description, of one in the catalogue, or of a map; a tip is left as it is.

    Parameters
    ----------
    probe : Probe, PretravelMap, Tip or str
    model, workpiece, gravity
        For a description: as for `predicted_tip`.
    extrapolate : bool
        For a map: also outside its directions.

    Returns
    -------
    Tip

    Raises
    ------
    PretravelError
        Something else.

    >>> tip_of("omp40-2").radius
    3.0
    """
    if isinstance(probe, str):
        probe = load_probe(probe)
    if isinstance(probe, Probe):
        return predicted_tip(probe, model, workpiece=workpiece, gravity=gravity)
    if isinstance(probe, PretravelMap):
        return mapped_tip(probe, extrapolate=extrapolate)
    if all(hasattr(probe, name) for name in ("state", "radius", "supports", "turned")):
        return probe
    raise PretravelError(
        f"a probe is needed, not a {type(probe).__name__}: load_probe('omp40-2'), a map, or a tip "
        "of them (predicted_tip)"
    )
