"""Coordinates: the machine's own, and those of the active work offset. All in mm."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tests.support.machine_model.modes import ZERO, Vector

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")


@dataclass(frozen=True)
class WorkOffset:
    """An origin in machine coordinates, and a turn about z in degrees."""

    origin: Vector = ZERO
    turn_deg: float = 0.0


def turned(place: Vector, degrees: float) -> Vector:
    """A vector turned about z."""
    if degrees == 0.0:
        return place
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y, z = place
    return (c * x - s * y, s * x + c * y, z)


@dataclass(frozen=True)
class Frame:
    """The coordinates of a program: work offset, G92 and length of the tool."""

    offset: WorkOffset = WorkOffset()
    shift: Vector = ZERO
    tool: Vector = ZERO

    def to_machine(self, place: Vector) -> Vector:
        moved = (place[0] + self.shift[0], place[1] + self.shift[1], place[2] + self.shift[2])
        x, y, z = turned(moved, self.offset.turn_deg)
        o, t = self.offset.origin, self.tool
        return (x + o[0] + t[0], y + o[1] + t[1], z + o[2] + t[2])

    def to_work(self, place: Vector) -> Vector:
        o, t = self.offset.origin, self.tool
        moved = (place[0] - o[0] - t[0], place[1] - o[1] - t[1], place[2] - o[2] - t[2])
        x, y, z = turned(moved, -self.offset.turn_deg)
        return (x - self.shift[0], y - self.shift[1], z - self.shift[2])
