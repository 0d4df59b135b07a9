"""Woźniak's two models of a described probe, and the full one in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    FloatArray,
    PretravelError,
    as_numbers,
    azimuth_angle,
    checked_unit,
    five_point_pattern,
)
from pretravel.maps import WozniakBasis
from pretravel.prediction.beam import cantilever_compliance
from pretravel.prediction.compliance import analytic
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import Loading, loaded_to_trigger
from pretravel.six_seats import PIEZO_STAGE


@dataclass(frozen=True)
class Wozniak(ComplianceModel):
    """His full model where the description states the transducer; otherwise his simple map.

    The description states it by ``opening_um``, 0 too, or the criterion ``piezo_stage``. Shares of
    the full model: ``stylus_bending`` (the stem, as one cantilever of the stylus's length) and
    ``tip_on_part``; `pretravel.prediction.trigger.predict` adds ``opening``. The seats are rigid.
    The friction of ``[tip]`` is his mu, that of ``[seats]`` his mu_p, on rods of the diameter d_2.

    The simple map is A cos²γ / cos of the folded azimuth, along the normal; no force enters. A is
    that of the paper's five-point qualification (equator at 0, 90, 180, 270°, and the pole) of
    this probe under the model ``analytic``; the lobes lie opposite the first rod. Share:
    ``wozniak``.

    References
    ----------
    Woźniak, equations 2, 4 and 9.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.trigger import predict
    >>> predict(load_probe("omp40-2"), [[0.0, 0.0, 1.0]], "wozniak").pretravel.tolist()
    [0.0]
    """

    name = "wozniak"
    response_for = "descriptions with opening_um or the criterion piezo_stage in [trigger]"

    def condenses(self, probe: Probe) -> bool:
        rubs = probe.tip.friction > 0.0 or probe.seats.friction > 0.0
        return _states_transducer(probe) and not probe.opening and not rubs

    def contains_friction(self, probe: Probe) -> bool:
        return _states_transducer(probe)

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        if _states_transducer(loading.probe):
            return _full(loading)
        five = five_point_pattern()
        touches, _ = loaded_to_trigger(loading.probe, loading.statics, five, loading.workpiece)
        moved = sum(analytic.MODEL.displacements(touches).values())
        basis = WozniakBasis(loading.probe.tripod.rod_azimuths[0] + math.pi)
        constant = float(np.sum(moved * five)) / float(basis.design(five)[:, 0].sum())
        pretravel = constant * basis.design(loading.directions)[:, 0]
        return {"wozniak": pretravel[:, None] * loading.directions}


MODEL = Wozniak()


def _states_transducer(probe: Probe) -> bool:
    return probe.opening is not None or probe.criterion == PIEZO_STAGE


def _full(loading: Loading) -> Mapping[str, FloatArray]:
    probe, stem = loading.probe, loading.probe.stem
    probe.refuse_uneven("the model wozniak")
    bending = cantilever_compliance(
        probe.stylus_length, stem.diameter, stem.material.youngs_modulus
    )
    lateral = loading.tip_loads * np.array([1.0, 1.0, 0.0])
    return {
        "stylus_bending": bending * loading.force[:, None] * lateral,
        TIP_ON_PART: loading.tip_approach,
    }


@dataclass(frozen=True, kw_only=True)
class WozniakProbe:
    """A probe with the quantities of Woźniak's program.

    Parameters
    ----------
    spring_force : float
        F_s. [N]
    seat_distance : float
        d: between two of the three seats. [mm]
    stylus_length, stylus_diameter : float
        L and D. [mm]
    axis_distance : float
        l_1: from the root of the stylus to the plane of the seats. [mm]
    tip_diameter : float
        d_1. [mm]
    stylus_modulus, tip_modulus, part_modulus : float
        E, E_1 (over 1 - nu², as Hertz needs it) and E_2 of the part. [MPa]
    opening : float
        a: opening of the contact at which the circuit is broken. [mm]
    sensor_force : float
        Force at which a piezoelectric stage triggers in every direction; zero for a probe
        without it. [N]
    arm_azimuth : float
        Of the first arm. [rad]
    tip_friction : float
        mu, of tip and part: against the sliding of the tip down the surface.
    support_friction : float
        mu_p, of the arms in the supports on which they turn.
    arm_end_diameter : float
        d_2: of the end of an arm, on whose surface that friction acts. [mm]
    """

    spring_force: float
    seat_distance: float
    stylus_length: float
    stylus_diameter: float
    tip_diameter: float
    stylus_modulus: float
    tip_modulus: float
    part_modulus: float
    axis_distance: float = 0.0
    opening: float = 0.0
    sensor_force: float = 0.0
    arm_azimuth: float = 0.0
    tip_friction: float = 0.0
    support_friction: float = 0.0
    arm_end_diameter: float = 0.0

    def __post_init__(self) -> None:
        for name in ("spring_force", "seat_distance", "stylus_length", "stylus_diameter",
                     "tip_diameter", "stylus_modulus", "tip_modulus", "part_modulus"):  # fmt: skip
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise PretravelError(f"{name} is {value:g}; it must be positive")
        for name in ("axis_distance", "opening", "sensor_force", "tip_friction",
                     "support_friction", "arm_end_diameter"):  # fmt: skip
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PretravelError(f"{name} is {value:g}; it cannot be negative")
        if self.support_friction > 0.0 and not self.arm_end_diameter > 0.0:
            raise PretravelError(
                "friction in the supports acts on the ends of the arms: give their diameter"
            )

    @property
    def transducer(self) -> Literal["contact", "piezo"]:
        """What triggers."""
        return "piezo" if self.sensor_force > 0.0 else "contact"


@dataclass(frozen=True, eq=False)
class WozniakPretravel:
    """The terms of Woźniak's equation 2, and the trigger force.

    Attributes
    ----------
    force : (n,) float
        F_T. [N]
    bending, contact, switching : (n,) float
        Of the stylus, of tip and part, and of the transducer until it switches. [mm]
    """

    force: FloatArray
    bending: FloatArray
    contact: FloatArray
    switching: FloatArray

    @property
    def pretravel(self) -> FloatArray:
        """Equation 2. [mm]"""
        return self.bending + self.contact + self.switching


def wozniak_pretravel(directions: npt.ArrayLike, probe: WozniakProbe) -> WozniakPretravel:
    """Compute the pretravel of Woźniak's full model, with friction at tip and supports.

    Parameters
    ----------
    directions : (n, 3) float
        Outward surface normals, probe frame, unit vectors.
    probe : WozniakProbe

    Returns
    -------
    WozniakPretravel

    Notes
    -----
    His equation 3 is lost in the text at hand; this is derived. One of three arms lifts and the
    probe tips over the line through the two others, at half of the circumradius R of the seats
    from the axis. With θ between normal and axis and ψ from the middle of the arm's third:
    F_T = F_s R / (2 ((L + l_1) sin θ cos ψ + R/2 cos θ)). After it the arm opens by a, a turn of
    a / (1.5 R). A piezoelectric stage triggers before an arm lifts.

    The tip slides down the surface (on a wall it does not slide), so that friction turns the force
    by atan(mu) towards the axis: sin θ - mu cos θ across, cos θ + mu sin θ along it, times the
    normal force. The two supports that carry the probe resist its turn by mu_p d_2 / 2 times their
    reaction, the spring less the force on the tip, as vectors.

    References
    ----------
    Woźniak, equations 2 and 3, his Figure 2.

    >>> probe = WozniakProbe(spring_force=0.6, seat_distance=8.0, stylus_length=40.0,
    ...     stylus_diameter=2.0, tip_diameter=4.0, stylus_modulus=620e3, tip_modulus=400e3,
    ...     part_modulus=210e3)
    >>> found = wozniak_pretravel([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], probe)
    >>> round(float(found.force[1] / found.force[0]), 9)
    0.5
    """
    d = checked_unit(as_numbers(directions, "directions"), "directions")
    radius = probe.seat_distance / math.sqrt(3.0)
    lever = probe.stylus_length + probe.axis_distance
    across, along = np.hypot(d[:, 0], d[:, 1]), d[:, 2]
    # Of the force on the tip for one newton along the normal. Where the tip would stick (mu above
    # tan θ) friction turns the force into the axis, and no further.
    mu = np.minimum(probe.tip_friction, across / np.maximum(np.abs(along), 1e-300))
    mu = np.where(np.abs(along) > 1e-9, mu, 0.0)  # on a wall it does not slide
    sideways = across - mu * np.abs(along)
    upwards = along + mu * across * np.sign(along)
    third = 2.0 * math.pi / 3.0
    psi = np.mod(azimuth_angle(d) - probe.arm_azimuth + 0.5 * third, third) - 0.5 * third
    # The path of the normal, per turn about the line through the two other seats.
    arm = lever * across * np.cos(psi) + 0.5 * radius * along
    if probe.sensor_force > 0.0:
        force, switching = np.full(len(d), probe.sensor_force), np.zeros(len(d))
    else:
        turning = lever * sideways * np.cos(psi) + 0.5 * radius * upwards
        force = _lifting_force(probe, turning, sideways, upwards)
        switching = probe.opening / (1.5 * radius) * arm
    bending = cantilever_compliance(
        probe.stylus_length, probe.stylus_diameter, probe.stylus_modulus
    )
    modulus = 1.0 / (1.0 / probe.tip_modulus + 1.0 / probe.part_modulus)
    hertz = (9.0 / 16.0 / (modulus**2 * 0.5 * probe.tip_diameter)) ** (1.0 / 3.0)
    return WozniakPretravel(
        force=np.asarray(force),
        bending=np.asarray(bending * force * sideways * across),
        contact=np.asarray(hertz * np.cbrt(force**2)),
        switching=np.asarray(switching),
    )


def _lifting_force(
    probe: WozniakProbe, turning: FloatArray, sideways: FloatArray, upwards: FloatArray
) -> FloatArray:
    """Normal force at which an arm lifts, (n,); infinite where none does. [N]

    The friction of the supports depends on the force itself: the equation of moments is solved by
    repeated substitution, which contracts by mu_p d_2 / 2 over the lever.
    """
    held = 0.5 * probe.spring_force * probe.seat_distance / math.sqrt(3.0)
    resistance = 0.5 * probe.support_friction * probe.arm_end_diameter
    lifts = turning > 0.0
    moment = np.where(lifts, turning, 1.0)
    force = held / moment
    for _ in range(_SUBSTITUTIONS if resistance else 0):
        reaction = np.hypot(force * sideways, probe.spring_force - force * upwards)
        force = (held + resistance * reaction) / moment
    return np.asarray(np.where(lifts, force, math.inf))


_SUBSTITUTIONS = 60
