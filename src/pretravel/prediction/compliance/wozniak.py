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
from pretravel.prediction.description import PIEZO_STAGE, Probe
from pretravel.prediction.loading import Loading, loaded_to_trigger


@dataclass(frozen=True)
class Wozniak(ComplianceModel):
    """His full model where the description states the transducer; otherwise his simple map.

    The description states it by ``opening_um``, 0 too, or the criterion ``piezo_stage``. Shares of
    the full model: ``stylus_bending`` (the stem, as one cantilever of the stylus's length) and
    ``tip_on_part``; `pretravel.prediction.trigger.predict` adds ``opening``. The seats are rigid.

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
        return _states_transducer(probe) and not probe.opening

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
    lateral = loading.directions * np.array([1.0, 1.0, 0.0])
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

    def __post_init__(self) -> None:
        for name in ("spring_force", "seat_distance", "stylus_length", "stylus_diameter",
                     "tip_diameter", "stylus_modulus", "tip_modulus", "part_modulus"):  # fmt: skip
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise PretravelError(f"{name} is {value:g}; it must be positive")
        for name in ("axis_distance", "opening", "sensor_force"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PretravelError(f"{name} is {value:g}; it cannot be negative")

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
    """Pretravel of Woźniak's full model, without friction.

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
    third = 2.0 * math.pi / 3.0
    psi = np.mod(azimuth_angle(d) - probe.arm_azimuth + 0.5 * third, third) - 0.5 * third
    # The path of the normal, per turn about the line through the two other seats.
    arm = lever * across * np.cos(psi) + 0.5 * radius * along
    if probe.sensor_force > 0.0:
        force, switching = np.full(len(d), probe.sensor_force), np.zeros(len(d))
    else:
        with np.errstate(divide="ignore"):
            force = np.where(arm > 0.0, 0.5 * probe.spring_force * radius / arm, math.inf)
        switching = probe.opening / (1.5 * radius) * arm
    bending = cantilever_compliance(
        probe.stylus_length, probe.stylus_diameter, probe.stylus_modulus
    )
    modulus = 1.0 / (1.0 / probe.tip_modulus + 1.0 / probe.part_modulus)
    hertz = (9.0 / 16.0 / (modulus**2 * 0.5 * probe.tip_diameter)) ** (1.0 / 3.0)
    return WozniakPretravel(
        force=np.asarray(force),
        bending=np.asarray(bending * force * across**2),
        contact=np.asarray(hertz * np.cbrt(force**2)),
        switching=np.asarray(switching),
    )
