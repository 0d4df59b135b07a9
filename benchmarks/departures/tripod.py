"""A six-seat probe from its statics: three rods, each on two balls, pressed down by a spring.

Probe frame: +z from the tip to the spindle, origin in the plane of the rods. The part pushes the
tip with a force F f. Six one-sided seat forces N keep the tripod in equilibrium:

    W N + S + F T f = 0,   so   N = N0 + F G f

The probe triggers when the first N becomes zero. The tip's deflection is the derivative of the
complementary energy by the force on it: a linear part C F f, and G'(h(N) - h(N0)) of seats that
approach by h = k N^(2/3).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

FLAT = 0.0
"""Curvature of a flat part. [1/mm]"""

TIP_RADIUS = 3.0


class SimulatedProbe(Protocol):
    """What a machine needs to know of a probe."""

    @property
    def stem(self) -> np.ndarray:
        """Unit vector from the tip along its stem, machine frame: no touch comes from there."""

    @property
    def axis(self) -> np.ndarray:
        """+z of the probe in the machine frame."""

    @property
    def rods(self) -> np.ndarray:
        """Azimuths of the rods in the machine frame. [rad]"""

    def pretravel(self, normals: np.ndarray, curvature: float = FLAT) -> np.ndarray:
        """Along the normals, machine frame, (n,). [mm]"""

    def force(self, normals: np.ndarray) -> np.ndarray:
        """At the trigger, (n,). [N]"""


def _wrenches(forces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Force and moment about the origin, one column for each row of `forces`."""
    return np.vstack([forces.T, np.cross(points, forces).T])


@dataclass(frozen=True, eq=False)
class Tripod:
    """A six-seat probe.

    Lengths in mm, compliances in mm/N; `seat_approach` and `tip_approach` in mm/N^(2/3), the
    latter for a flat part. `rotation` turns probe axes into those of the machine.
    """

    rod_azimuths: np.ndarray
    support_angles: np.ndarray  # of six seats, from the horizontal
    seat_radius: float
    preload: float
    spring: np.ndarray  # where the spring presses, (2,)
    tip: np.ndarray  # (3,)
    compliance: np.ndarray  # of the tip, (3, 3), linear
    seat_approach: float
    tip_approach: float
    friction: float = 0.0
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))

    @cached_property
    def _statics(self) -> tuple[np.ndarray, np.ndarray]:
        azimuths = np.repeat(self.rod_azimuths, 2)
        sides = np.tile([1.0, -1.0], 3) * np.cos(self.support_angles)
        along = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(6)])
        seat_forces = np.column_stack(
            [-np.sin(azimuths) * sides, np.cos(azimuths) * sides, np.sin(self.support_angles)]
        )
        seats = _wrenches(seat_forces, self.seat_radius * along)
        pressed = np.array([[self.spring[0], self.spring[1], 0.0]])
        spring = _wrenches(np.array([[0.0, 0.0, -self.preload]]), pressed)[:, 0]
        tip = _wrenches(np.eye(3), np.tile(self.tip, (3, 1)))
        return -np.linalg.solve(seats, spring), -np.linalg.solve(seats, tip)

    @property
    def seats_at_rest(self) -> np.ndarray:
        """N0, (6,). [N]"""
        return self._statics[0]

    @property
    def stem(self) -> np.ndarray:
        across = np.array([-self.tip[0], -self.tip[1], 0.0])
        if np.linalg.norm(across) < 0.2 * abs(self.tip[2]):
            return self.axis
        return self.rotation @ (across / np.linalg.norm(across))

    @property
    def axis(self) -> np.ndarray:
        return self.rotation[:, 2]

    @property
    def rods(self) -> np.ndarray:
        return self.rod_azimuths + np.arctan2(self.rotation[1, 0], self.rotation[0, 0])

    def force(self, normals: np.ndarray) -> np.ndarray:
        return self._forces(np.asarray(normals) @ self.rotation)

    def _forces(self, pushes: np.ndarray) -> np.ndarray:
        rest, unit = self._statics
        change = pushes @ unit.T
        opening = change < -1e-12
        ratios = np.where(opening, rest / np.where(opening, -change, 1.0), np.inf)
        return np.asarray(ratios.min(axis=1))

    def deflection(self, pushes: np.ndarray) -> np.ndarray:
        """Of the tip at the trigger, without the contact of tip and part, probe frame, (n, 3)."""
        rest, unit = self._statics
        forces = self._forces(pushes)[:, None]
        seats = np.maximum(rest + forces * (pushes @ unit.T), 0.0)
        approach = self.seat_approach * (seats ** (2.0 / 3.0) - rest ** (2.0 / 3.0))
        return np.asarray(forces * (pushes @ self.compliance) + approach @ unit)

    def _pushes(self, normals: np.ndarray) -> np.ndarray:
        """Directions of the force: the normal, and friction against the sliding of the tip."""
        if self.friction == 0.0:
            return normals

        def sliding(pushes: np.ndarray) -> np.ndarray:
            moved = self.deflection(pushes)
            return moved - np.sum(moved * normals, axis=1)[:, None] * normals

        free = sliding(normals)
        size = np.linalg.norm(free, axis=1)[:, None]
        toward = free / np.maximum(size, 1e-12)
        held = np.sum(sliding(normals - self.friction * toward) * toward, axis=1)[:, None]
        # Where friction would turn the sliding round, the tip sticks with less than all of it.
        share = np.clip(size / np.maximum(size - held, 1e-12), 0.0, 1.0)
        return np.asarray(normals - share * self.friction * toward)

    def pretravel(self, normals: np.ndarray, curvature: float = FLAT) -> np.ndarray:
        own = np.asarray(normals) @ self.rotation
        pushes = self._pushes(own)
        bulge = (1.0 + curvature * TIP_RADIUS) ** (1.0 / 3.0)
        contact = self.tip_approach * bulge * self._forces(pushes) ** (2.0 / 3.0)
        return np.asarray(np.sum(self.deflection(pushes) * own, axis=1) + contact)


def scaled(probe: Tripod, largest: float, axial: float, shares: tuple[float, float]) -> Tripod:
    """The probe with a given largest pretravel across the axis, and one along it.

    `shares` of the pretravel along the axis come from the seats and from the contact of the tip,
    the rest from the stylus. [mm]
    """
    bare = replace(
        probe, compliance=np.zeros((3, 3)), seat_approach=0.0, tip_approach=0.0, friction=0.0
    )
    pole = probe.axis[None]
    seats = axial * shares[0] / replace(bare, seat_approach=1.0).pretravel(pole)[0]
    tip = axial * shares[1] / replace(bare, tip_approach=1.0).pretravel(pole)[0]
    along = axial * (1.0 - sum(shares)) / float(bare.force(pole)[0])
    bare = replace(bare, seat_approach=seats, tip_approach=tip)
    azimuths = np.radians(np.arange(0.0, 360.0, 2.0))
    ring = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(len(azimuths))])
    ring = ring @ probe.rotation.T
    across = float(np.min((largest - bare.pretravel(ring)) / bare.force(ring)))
    return replace(bare, compliance=np.diag([across, across, along]), friction=probe.friction)
