"""Obstacles on the machine's table, and the moves of a probe that they block.

The probe axis is the machine's z. Tip, stem and body of the probe are a ball and two cylinders.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pretravel.base import (
    COORDINATE,
    DISTANCE,
    BoolArray,
    FloatArray,
    IntArray,
    check_numbers,
    checked_values,
)
from pretravel.design import StylusOutline, first_obstacle, stylus_obstacle
from pretravel.files import Machine
from pretravel.surface import Part

log = logging.getLogger(__name__)

_EDGES = 0.05
"""Resolution of a face's edges when distances from the face are computed. [mm]"""
_STEP = 0.25
"""Distance between the places at which a move is checked. [mm]"""
_BODY_HEIGHT = 200.0
"""Assumed height of the probe's body, with the spindle behind it. [mm]"""
_UP = np.array([0.0, 0.0, 1.0])


class Obstacle(Protocol):
    """An object that moves must not run into, in work coordinates."""

    @property
    def words(self) -> str:
        """The obstacle in words, for the head of a program."""
        ...

    @property
    def top(self) -> float:
        """Height of the obstacle's highest point. [mm]"""
        ...

    def off(self, points: FloatArray) -> FloatArray:
        """Distance of points from the obstacle's surface, (n,). [mm]"""
        ...

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        """Whether the obstacle blocks tip, stem or body on moves from (n, 3) to (n, 3), (n,)."""
        ...

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        """The same for moves that end with the tip on the obstacle; only the end may meet it."""
        ...


@dataclass(frozen=True, eq=False)
class SphereObstacle:
    """A reference sphere, with or without a shank below it.

    Attributes
    ----------
    center : (3,) float
        [mm]
    radius : float
        [mm]
    shank_diameter : float
        Diameter of a shank straight down; 0 where it is unknown. [mm]
    """

    center: FloatArray
    radius: float
    shank_diameter: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, radius=DISTANCE, shank_diameter=DISTANCE)
        checked_values(self.center, "the sphere's centre", COORDINATE)

    @property
    def words(self) -> str:
        """See `Obstacle`."""
        if not self.shank_diameter:
            return "the sphere. Its shank was not given, and is not checked"
        return f"the sphere with a vertical shank of {self.shank_diameter:g} mm below it"

    @property
    def top(self) -> float:
        """Height of the obstacle's highest point. [mm]"""
        return float(self.center[2] + self.radius)

    def off(self, points: FloatArray) -> FloatArray:
        """See `Obstacle`."""
        return np.asarray(np.abs(np.linalg.norm(points - self.center, axis=1) - self.radius))

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        """See `Obstacle`."""
        return self._met(machine, start, end, touching=False)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        """See `Obstacle`."""
        return self._met(machine, start, contact, touching=True)

    def _met(
        self, machine: Machine, start: FloatArray, end: FloatArray, *, touching: bool
    ) -> BoolArray:
        longest = float(np.max(np.linalg.norm(end - start, axis=1)))
        share = np.linspace(0.0, 1.0, int(np.ceil(longest / _STEP)) + 2)
        # The sphere's centre relative to the tip: along the axis, and across it.
        tip = start + share[:, None, None] * (end - start)
        seen = self.center - tip
        up, across = seen[..., 2], np.hypot(seen[..., 0], seen[..., 1])
        # A ball that moves straight to the sphere meets it at the target.
        ball = np.where(touching, np.inf, np.linalg.norm(seen, axis=-1) - machine.tip_radius)
        stem = np.hypot(across, _outside(up, 0.0, machine.stylus_length))
        stem = stem - 0.5 * machine.stem_diameter
        body = np.hypot(
            np.maximum(across - 0.5 * machine.body_diameter, 0.0),
            _outside(up, machine.stylus_length, machine.stylus_length + _BODY_HEIGHT),
        )
        margin = self.radius + (0.0 if touching else machine.clearance)
        free = np.minimum(np.minimum(ball, stem), body) - margin
        if self.shank_diameter > 0.0:
            gap = across - 0.5 * self.shank_diameter - machine.tip_radius
            gap = gap - (0.0 if touching else machine.clearance)
            free = np.minimum(free, np.where(up > -machine.tip_radius, gap, np.inf))
        return np.asarray((free < 0.0).any(axis=0))


def _outside(value: FloatArray, low: float, high: float) -> FloatArray:
    return np.asarray(np.maximum(np.maximum(low - value, value - high), 0.0))


@dataclass(frozen=True, eq=False)
class PartObstacle:
    """A part with all its faces.

    Attributes
    ----------
    part : Part
        In work coordinates. [mm]
    """

    part: Part

    @property
    def words(self) -> str:
        """See `Obstacle`."""
        count = len(self.part.faces)
        return f"the part ({count} face{'' if count == 1 else 's'}, all checked)"

    @property
    def top(self) -> float:
        """Height of the obstacle's highest point. [mm]"""
        return float(self.part.box[1][2])

    def off(self, points: FloatArray) -> FloatArray:
        """See `Obstacle`."""
        distances = [face.distance(points, _EDGES) for face in self.part.faces]
        return np.asarray(np.min(distances, axis=0))

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        """See `Obstacle`."""
        nothing = np.full(len(start), -1)
        return self._met(machine, start, end, nothing, machine.clearance)

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        """See `Obstacle`."""
        cloud = self.part.cloud_of_spacing(0.5 * machine.tip_radius)
        way = contact - start
        along = way / np.linalg.norm(way, axis=1, keepdims=True)
        touched = cloud.face[cloud.tree.query(contact + machine.tip_radius * along)[1]]
        return self._met(machine, start, contact, touched, 0.0)

    def _met(
        self,
        machine: Machine,
        start: FloatArray,
        end: FloatArray,
        touched: IntArray,
        margin: float,
    ) -> BoolArray:
        met = np.zeros(len(start), dtype=bool)
        length = np.linalg.norm(end - start, axis=1)
        log.info("checking %d moves against the part", len(start))
        # Moves of similar length are checked together, each over the length of the longest.
        for group in np.unique(np.ceil(length[length > 0.0])):
            rows = np.flatnonzero(np.ceil(length) == group)
            reach = float(length[rows].max())
            direction = (end[rows] - start[rows]) / length[rows, None]
            faces = first_obstacle(
                self.part, end[rows], direction, touched[rows], machine.tip_radius + margin, reach
            )
            met[rows] |= faces >= 0
            outline = StylusOutline(
                _UP,
                np.array(
                    [
                        [0.0, machine.stylus_length],
                        [machine.stylus_length, machine.stylus_length + _BODY_HEIGHT],
                    ]
                ),
                0.5 * np.array([machine.stem_diameter, machine.body_diameter]) + margin,
            )
            met[rows] |= stylus_obstacle(self.part, end[rows], direction, outline, reach) >= 0
        return met


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A machine's probe among all obstacles.

    Attributes
    ----------
    machine : Machine
    obstacles : sequence of Obstacle
        Empty where nothing is known about the surroundings.
    """

    machine: Machine
    obstacles: Sequence[Obstacle] = ()

    @property
    def known(self) -> bool:
        """Whether moves can be checked at all."""
        return len(self.obstacles) > 0

    @property
    def lowest_travel(self) -> float:
        """Height of the tip's centre that clears all obstacles; -inf without obstacles. [mm]"""
        tip, clearance = self.machine.tip_radius, self.machine.clearance
        return max((obstacle.top + tip + clearance for obstacle in self.obstacles), default=-np.inf)

    def off(self, points: FloatArray) -> FloatArray:
        """Distance of points from the nearest obstacle's surface, (n,). [mm]"""
        return np.asarray(np.min([obstacle.off(points) for obstacle in self.obstacles], axis=0))

    def block(self, start: FloatArray, end: FloatArray) -> BoolArray:
        """Whether an obstacle blocks straight moves (n, 3) to (n, 3), (n,)."""
        blocked = np.zeros(len(start), dtype=bool)
        for obstacle in self.obstacles:
            blocked |= obstacle.blocks(self.machine, start, end)
        return blocked

    def block_touch(self, start: FloatArray, contact: FloatArray) -> BoolArray:
        """Whether an obstacle blocks moves to a contact with it before the contact, (n,)."""
        blocked = np.zeros(len(start), dtype=bool)
        for obstacle in self.obstacles if len(start) else ():
            blocked |= obstacle.blocks_touch(self.machine, start, contact)
        return blocked
