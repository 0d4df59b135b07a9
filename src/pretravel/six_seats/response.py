"""The response of a probe at the trigger, condensed to a dozen numbers and two small matrices.

Most compliance models have the same form: reactions linear in the force, a linear compliance,
Hertz's law at the seats and at the tip. The response represents them exactly in every
direction, without the description and without interpolation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, Self

import numpy as np

from pretravel.base import (
    FloatArray,
    IntArray,
    frozen,
)
from pretravel.maps import MapBasis, SixSeatForm, StoredArray, StoredBasis
from pretravel.six_seats.event import PIEZO_STAGE, trigger_force, watched_loads
from pretravel.six_seats.hertz import curved_part_factor

_MICRONEWTON = 1e-6


@dataclass(frozen=True, eq=False)
class ProbeResponse:
    """Force, deflection and local compression at the trigger, for any direction of the force.

    Attributes
    ----------
    reaction_change : (6, 3) float
        Reactions of the seats per newton on the tip along x, y, z.
    rest_reactions : (6,) float
        [N]
    criterion : str
    threshold : float
        [N]
    compliance : (3, 3) float
        Displacement of the tip per newton, without Hertz's part at the seats. [mm/N]
    seat_motion : (3, 6) float
        Displacement of the tip per indentation of each seat.
    seat_coefficient : float
        Indentation per N^(2/3). [mm/N^(2/3)]
    tip_coefficient : float
        Approach of tip and a flat part per N^(2/3). [mm/N^(2/3)]
    tip_radius : float
        [mm]
    """

    reaction_change: FloatArray
    rest_reactions: FloatArray
    criterion: str
    threshold: float
    compliance: FloatArray
    seat_motion: FloatArray
    seat_coefficient: float
    tip_coefficient: float
    tip_radius: float

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, entry.name, frozen(value))

    def force(self, directions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Trigger force and the seat that opens, for (n, 3) directions of the force.

        Infinite where no seat ever opens. [N]
        """
        return trigger_force(
            self.rest_reactions,
            directions @ self.reaction_change.T,
            self.criterion,
            self.threshold,
        )

    def reactions(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """The six reactions under given forces, (n, 6). [N]"""
        change = directions @ self.reaction_change.T
        return np.asarray(self.rest_reactions + forces[:, None] * change)

    def excess(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """Smallest watched load less the threshold, (n,): zero at the trigger. [N]

        With a piezo stage: the threshold less the force.
        """
        if self.criterion == PIEZO_STAGE:
            return np.asarray(self.threshold - forces)
        watched = watched_loads(self.reactions(directions, forces), self.criterion)
        return np.asarray(np.min(watched, axis=1) - self.threshold)

    def deflection(self, directions: FloatArray, forces: FloatArray) -> FloatArray:
        """C - P under given forces, (n, 3). [mm]"""
        with np.errstate(invalid="ignore"):  # infinite forces: directions that never trigger
            pressed = np.maximum(self.reactions(directions, forces), 0.0)
            sunk = hertz_power(pressed) - np.cbrt(self.rest_reactions**2)
            return np.asarray(
                forces[:, None] * (directions @ self.compliance.T)
                + self.seat_coefficient * (sunk @ self.seat_motion.T)
            )

    def tip_approach(self, forces: FloatArray) -> FloatArray:
        """Approach of the tip's centre and a flat part under normal forces, (n,). [mm]"""
        return np.asarray(self.tip_coefficient * np.cbrt(forces**2))

    def pretravel(self, normals: FloatArray) -> FloatArray:
        """Travel from contact to trigger on a flat, along -n, (n,). [mm]"""
        force, _ = self.force(normals)
        along = np.sum(self.deflection(normals, force) * normals, axis=1)
        with np.errstate(invalid="ignore"):
            return np.asarray(along + self.tip_approach(force))


def hertz_power(reactions: FloatArray) -> FloatArray:
    """N^(2/3) with a finite slope at zero: below a micronewton, a parabola that joins smoothly.

    The vertical tangent of N^(2/3) at a seat that opens prevents Newton's method from
    converging. The change is 0.01 nm.

    >>> hertz_power(np.array([8.0])).tolist()
    [4.0]
    """
    share = reactions / _MICRONEWTON
    low = _MICRONEWTON ** (2.0 / 3.0) * share * (4.0 - share) / 3.0
    return np.asarray(np.where(share < 1.0, low, np.cbrt(reactions**2)))


def hertz_power_and_slope(reactions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`hertz_power` and its derivative, for reactions that are not negative.

    >>> [each.round(12).tolist() for each in hertz_power_and_slope(np.array([8.0]))]
    [[4.0], [0.333333333333]]
    """
    root = np.cbrt(np.maximum(reactions, _MICRONEWTON))
    power, slope = root * root, 2.0 / 3.0 / root
    low = reactions < _MICRONEWTON
    share = reactions[low] / _MICRONEWTON
    power[low] = _MICRONEWTON ** (2.0 / 3.0) * share * (4.0 - share) / 3.0
    slope[low] = _MICRONEWTON ** (-1.0 / 3.0) * (4.0 - 2.0 * share) / 3.0
    return power, slope


@dataclass(frozen=True, eq=False)
class ResponseBasis(MapBasis):
    """Values of a map, computed from a `ProbeResponse` for every direction without interpolation.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.response import probe_response
    >>> basis = ResponseBasis(probe_response(load_probe("omp40-2")))
    >>> (basis.design(np.array([[1.0, 0.0, 0.0]])) * 1e3).round(1).tolist()
    [[3.8]]
    """

    response: ProbeResponse
    kind: ClassVar[str] = "physical"

    @property
    def size(self) -> int:
        return 1

    @property
    def constant(self) -> None:
        return None

    def design(self, directions: FloatArray) -> FloatArray:
        return self.response.pretravel(directions)[:, None]

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None = None
    ) -> FloatArray:
        force, _ = self.response.force(directions)
        approach = self.response.tip_approach(force)
        if curvatures is not None:
            factor = curved_part_factor(self.response.tip_radius, curvatures)
            approach = approach * np.where(np.isfinite(factor), factor, 1.0)
        with np.errstate(invalid="ignore"):
            return self.response.deflection(directions, force) + approach[:, None] * directions

    @property
    def condensed_probe(self) -> ProbeResponse:
        return self.response

    def form_on_control(self, coefficients: FloatArray) -> SixSeatForm | None:
        if self.response.criterion != "first_contact":
            return None
        return SixSeatForm(self.response, float(coefficients[0]), 0.0, frozen(np.zeros(3)))

    def arrays(self) -> Mapping[str, StoredArray]:
        return {
            f"response_{name}": StoredArray(axes, np.asarray(getattr(self.response, name)), unit)
            for name, (axes, unit) in _STORED.items()
        }

    def attributes(self) -> Mapping[str, str | float]:
        return {"criterion": self.response.criterion}

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self | None:
        if "response_compliance" not in stored.arrays:
            return None
        values = {
            name: np.asarray(stored.arrays[f"response_{name}"].values, dtype=np.float64)
            for name in _STORED
        }
        return cls(
            ProbeResponse(
                reaction_change=values["reaction_change"],
                rest_reactions=values["rest_reactions"],
                criterion=str(stored.attributes["criterion"]),
                threshold=float(values["threshold"]),
                compliance=values["compliance"],
                seat_motion=values["seat_motion"],
                seat_coefficient=float(values["seat_coefficient"]),
                tip_coefficient=float(values["tip_coefficient"]),
                tip_radius=float(values["tip_radius"]),
            )
        )


_STORED: Mapping[str, tuple[tuple[str, ...], str]] = {
    "reaction_change": (("seat", "axis"), "1"),
    "rest_reactions": (("seat",), "N"),
    "compliance": (("axis", "other_axis"), "mm/N"),
    "seat_motion": (("axis", "seat"), "1"),
    "threshold": ((), "N"),
    "seat_coefficient": ((), "mm/N^(2/3)"),
    "tip_coefficient": ((), "mm/N^(2/3)"),
    "tip_radius": ((), "mm"),
}
"""Axes and units of a response in files."""
