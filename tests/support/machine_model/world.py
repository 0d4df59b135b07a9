"""What is on the table, and the probe as a ball and two upright cylinders.

All axes of the things here are upright: distances have closed forms. Along a straight move they
change by no more than the way (their Lipschitz constant is 1); therefore contacts and the deepest
place are found without steps that could miss something. Lengths are in mm, in machine coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from tests.support.machine_model.modes import Vector

FINE = 1e-7
"""Places along a move are found to this. [mm]"""
COARSE = 1e-3
"""Steps near to a surface. [mm]"""


class Thing(Protocol):
    """Something on the table."""

    def distance(self, place: Vector) -> tuple[float, Vector]:
        """Signed distance of a point from the surface, and the outward unit normal."""

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        """Signed distance from an upright cylinder, given by the middle of its lower end."""


def _upright(across: float, above: float) -> float:
    """Distance of two upright bodies by their gaps across and along the axis."""
    if across > 0.0 and above > 0.0:
        return math.hypot(across, above)
    return max(across, above)


def _unit(vector: Vector) -> Vector:
    size = math.hypot(*vector)
    return (0.0, 0.0, 1.0) if size == 0.0 else tuple(v / size for v in vector)  # type: ignore[return-value]


@dataclass(frozen=True)
class Ball:
    """A sphere on the table."""

    center: Vector
    radius: float

    def distance(self, place: Vector) -> tuple[float, Vector]:
        away = (
            place[0] - self.center[0],
            place[1] - self.center[1],
            place[2] - self.center[2],
        )
        size = math.sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2])
        if size == 0.0:
            return -self.radius, (0.0, 0.0, 1.0)
        return size - self.radius, (away[0] / size, away[1] / size, away[2] / size)

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        x, y, z = self.center
        across = math.hypot(x - foot[0], y - foot[1]) - radius
        return _upright(across, max(foot[2] - z, z - foot[2] - height)) - self.radius


@dataclass(frozen=True)
class Box:
    """A block, turned about z."""

    center: Vector
    half: Vector
    turn_deg: float = 0.0

    @cached_property
    def _turn(self) -> tuple[float, float]:
        return math.cos(math.radians(self.turn_deg)), math.sin(math.radians(self.turn_deg))

    def _local(self, x: float, y: float) -> tuple[float, float]:
        c, s = self._turn
        dx, dy = x - self.center[0], y - self.center[1]
        return c * dx + s * dy, -s * dx + c * dy

    def distance(self, place: Vector) -> tuple[float, Vector]:
        u, v = self._local(place[0], place[1])
        w, half = place[2] - self.center[2], self.half
        over_u, over_v, over_w = abs(u) - half[0], abs(v) - half[1], abs(w) - half[2]
        size = max(over_u, over_v, over_w)
        x = y = z = 0.0  # the normal, not turned
        if size > 0.0:
            size = math.hypot(max(over_u, 0.0), max(over_v, 0.0), max(over_w, 0.0))
            x = math.copysign(max(over_u, 0.0) / size, u)
            y = math.copysign(max(over_v, 0.0) / size, v)
            z = math.copysign(max(over_w, 0.0) / size, w)
        elif size == over_u:
            x = math.copysign(1.0, u)
        elif size == over_v:
            y = math.copysign(1.0, v)
        else:
            z = math.copysign(1.0, w)
        c, s = self._turn
        return size, (c * x - s * y, s * x + c * y, z)

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        u, v = self._local(foot[0], foot[1])
        across = _upright(abs(u) - self.half[0], abs(v) - self.half[1]) - radius
        low, high = self.center[2] - self.half[2], self.center[2] + self.half[2]
        return _upright(across, max(foot[2] - high, low - foot[2] - height))


@dataclass(frozen=True)
class Ring:
    """A torus with an upright axis: the radius of its circle, and of its tube."""

    center: Vector
    radius: float
    tube: float

    def distance(self, place: Vector) -> tuple[float, Vector]:
        dx, dy, dz = (place[i] - self.center[i] for i in range(3))
        rho = math.hypot(dx, dy)
        gap = rho - self.radius
        size = math.hypot(gap, dz)
        if rho == 0.0 or size == 0.0:
            return size - self.tube, (0.0, 0.0, 1.0)
        return size - self.tube, (gap / size * dx / rho, gap / size * dy / rho, dz / size)

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        rho = math.hypot(foot[0] - self.center[0], foot[1] - self.center[1])
        across = abs(rho - self.radius) - radius
        z = self.center[2]
        return _upright(across, max(foot[2] - z, z - foot[2] - height)) - self.tube


@dataclass(frozen=True)
class Table:
    """All that is below a height."""

    height: float

    def distance(self, place: Vector) -> tuple[float, Vector]:
        return place[2] - self.height, (0.0, 0.0, 1.0)

    def cylinder_distance(self, foot: Vector, radius: float, height: float) -> float:
        return foot[2] - self.height


@dataclass(frozen=True)
class Stylus:
    """The probe: its ball, and above it the stem and the body.

    Attributes
    ----------
    length : float
        From the spindle's reference point down to the ball's center.
    stem_length : float
        From the ball's center up to the body.
    """

    tip_radius: float = 3.0
    stem_radius: float = 2.25
    stem_length: float = 50.0
    body_radius: float = 20.0
    body_height: float = 60.0
    length: float = 0.0

    def tip(self, spindle: Vector) -> Vector:
        """The ball's center for a place of the spindle."""
        return (spindle[0], spindle[1], spindle[2] - self.length)


@dataclass(frozen=True)
class Depths:
    """How deep ball, stem and body are in things; below zero: how far away. [mm]"""

    ball: float
    stem: float
    body: float

    def deeper(self, other: Depths) -> Depths:
        return Depths(
            max(self.ball, other.ball), max(self.stem, other.stem), max(self.body, other.body)
        )


@dataclass(frozen=True)
class World:
    """The things on the table, and the probe that moves among them."""

    things: tuple[Thing, ...] = ()
    stylus: Stylus = Stylus()

    def contact(self, tip: Vector) -> tuple[float, Vector]:
        """Distance of the ball from the nearest surface, and the normal there."""
        nearest, normal = math.inf, (0.0, 0.0, 1.0)
        for thing in self.things:
            found, along = thing.distance(tip)
            if found < nearest:
                nearest, normal = found, along
        return nearest - self.stylus.tip_radius, normal

    def stem_distance(self, tip: Vector) -> float:
        stylus = self.stylus
        return min(
            (t.cylinder_distance(tip, stylus.stem_radius, stylus.stem_length) for t in self.things),
            default=math.inf,
        )

    def body_distance(self, tip: Vector) -> float:
        stylus = self.stylus
        foot = (tip[0], tip[1], tip[2] + stylus.stem_length)
        return min(
            (t.cylinder_distance(foot, stylus.body_radius, stylus.body_height)
             for t in self.things),
            default=math.inf,
        )  # fmt: skip

    def deepest(self, start: Vector, end: Vector) -> Depths:
        """The deepest places of ball, stem and body along a straight move of the tip."""
        path = Path(start, end)
        return Depths(
            -path.lowest(lambda s: self.contact(path.at(s))[0]),
            -path.lowest(lambda s: self.stem_distance(path.at(s))),
            -path.lowest(lambda s: self.body_distance(path.at(s))),
        )


class Path:
    """A straight move; its places are given by the way from its start. [mm]"""

    def __init__(self, start: Vector, end: Vector) -> None:
        self.start = start
        self.end = end
        self.length = math.dist(start, end)
        n = self.length or 1.0
        self.direction = _unit(
            ((end[0] - start[0]) / n, (end[1] - start[1]) / n, (end[2] - start[2]) / n)
        ) if self.length else (0.0, 0.0, 0.0)  # fmt: skip

    def at(self, way: float) -> Vector:
        if way >= self.length:
            return self.end
        p, d = self.start, self.direction
        return (p[0] + way * d[0], p[1] + way * d[1], p[2] + way * d[2])

    def lowest(self, distance: Callable[[float], float]) -> float:
        """The least distance along the move, to a micrometre; at the ends it is exact.

        Where it is positive, a lower bound suffices.
        """
        first, last = distance(0.0), distance(self.length)
        best = min(first, last)
        waiting = [(0.0, first, self.length, last)]
        while waiting:
            a, at_a, b, at_b = waiting.pop()
            bound = 0.5 * (at_a + at_b - (b - a))
            if bound > 0.0:
                best = min(best, max(bound, 0.0)) if best > 0.0 else best
                continue
            if bound >= best - COARSE or b - a < FINE:
                continue
            middle = 0.5 * (a + b)
            here = distance(middle)
            best = min(best, here)
            waiting.append((a, at_a, middle, here))
            waiting.append((middle, here, b, at_b))
        return best

    def first(self, excess: Callable[[float], float], start: float) -> float | None:
        """The first place from a start on where a function is not below zero.

        The function changes by at most 1.1 per mm. It is not below zero for a micrometre at least.
        """
        before, way = start, start
        while True:
            value = excess(way)
            if value >= 0.0:
                return self._between(excess, before, way)
            if way >= self.length:
                return None
            before, way = way, min(way + max(-value / 1.1, COARSE), self.length)

    def _between(self, excess: Callable[[float], float], low: float, high: float) -> float:
        """The place between two at which a function is not below zero any more."""
        while high - low > FINE:
            middle = 0.5 * (low + high)
            if excess(middle) >= 0.0:
                high = middle
            else:
                low = middle
        return high
