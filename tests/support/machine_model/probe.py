"""The signal of a touch-trigger probe, with its faults.

A healthy probe closes where the ball, were the stylus straight, would be as deep in the surface as
the pretravel, and opens where it is less deep by the hysteresis. Faults change that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from tests.support.machine_model.modes import Vector
from tests.support.machine_model.world import FINE, Path, World

FaultKind = Literal[
    "dead", "tripped", "stuck", "early", "false_trip", "late", "bounce", "spike",
]  # fmt: skip


@dataclass(frozen=True)
class Fault:
    """What is wrong with a probe.

    Attributes
    ----------
    kind : str
        - dead: contact `touch` and all later ones give no signal;
        - tripped: closed from the start, for ever;
        - stuck: after contact `touch` it stays closed;
        - early: a false trip `distance` before contact `touch`; it stays closed for 0.3 mm;
        - spike: as early, but it is open again 0.02 mm later;
        - false_trip: a trip within `distance` of the place `place`, once, 0.3 mm long;
        - late: contact `touch` is signalled `distance` later;
        - bounce: after contact `touch` it opens and closes again on the way back.
    touch : int
        Number of the contact, from 1 on.
    distance : float
        [mm]
    place : tuple or None
        Of the tip, in machine coordinates. [mm]
    """

    kind: FaultKind
    touch: int = 1
    distance: float = 0.0
    place: Vector | None = None


@dataclass(frozen=True)
class Edge:
    """A change of the signal at a place of a move. [mm]"""

    way: float
    closed: bool


def constant(pretravel: float) -> Callable[[Vector], float]:
    """The same pretravel in all directions."""
    return lambda normal: pretravel


class Probe:
    """A probe and its signal.

    Parameters
    ----------
    pretravel : function
        From the unit normal to the pretravel. [mm]
    hysteresis : float
        The probe opens by so much less deep than it closes. [mm]
    delay : float
        The control sees the signal so much later. [s]
    faults : tuple of Fault
    """

    def __init__(
        self,
        pretravel: Callable[[Vector], float] = constant(0.005),
        *,
        hysteresis: float = 0.0005,
        delay: float = 0.0,
        faults: tuple[Fault, ...] = (),
    ) -> None:
        self.pretravel = pretravel
        self.hysteresis = hysteresis
        self.delay = delay
        self.faults = faults
        self.contacts = 0
        self.deflected = False
        self.closed = any(f.kind == "tripped" for f in faults)
        self._happened: set[Fault] = set()
        self._bounce: Fault | None = None

    def _deeper(self, world: World, place: Vector) -> float:
        gap, normal = world.contact(place)
        return -gap - self.pretravel(normal)

    def _touches(self, world: World, path: Path) -> list[Edge]:
        """Where a healthy probe would close and open along a move."""
        edges: list[Edge] = []
        way, deflected = 0.0, self.deflected
        while True:
            if deflected:
                found = path.first(
                    lambda s: -self._deeper(world, path.at(s)) - self.hysteresis, way
                )
            else:
                found = path.first(lambda s: self._deeper(world, path.at(s)), way)
            if found is None:
                return edges
            deflected = not deflected
            edges.append(Edge(found, deflected))
            way = found + FINE

    def edges(self, world: World, path: Path) -> list[Edge]:
        """All changes of the signal along a move, if it is made whole."""
        touches = self._touches(world, path)
        if any(f.kind == "tripped" for f in self.faults):
            return []
        intervals = self._intervals(touches, path)
        return _as_edges(intervals, self.closed, path.length)

    def _intervals(self, touches: list[Edge], path: Path) -> list[tuple[float, float]]:
        """Where the signal is closed."""
        intervals: list[tuple[float, float]] = []
        count, since, deflected = self.contacts, 0.0, self.deflected
        number = count
        for edge in [*touches, Edge(math.inf, False)]:
            if edge.closed:
                since, deflected = edge.way, True
                number += 1
            elif deflected:
                intervals += self._signal(number, since, edge.way)
                deflected = False
        for fault in self.faults:
            if fault.kind == "stuck" and self.contacts >= fault.touch:
                return [(0.0, math.inf)]
            if fault.kind in ("early", "spike") and fault not in self._happened:
                intervals += self._before(fault, touches)
            if fault.kind == "false_trip" and fault not in self._happened:
                intervals += _at_place(fault, path)
        if self._bounce is not None and intervals:
            end = intervals[0][1]
            if end < math.inf:
                intervals += [(end + 0.05, end + 0.15), (end + 0.25, end + 0.3)]
        return intervals

    def _signal(self, number: int, since: float, until: float) -> list[tuple[float, float]]:
        """Where a contact is signalled."""
        for fault in self.faults:
            if fault.kind == "dead" and number >= fault.touch:
                return []
            if fault.kind == "late" and number == fault.touch:
                if since == 0.0 and self.deflected:
                    # On the way back it is not pressed deeper.
                    return [(since, until)] if self.closed else []
                later = since + fault.distance
                return [(later, until)] if later < until else []
            if fault.kind == "stuck" and number >= fault.touch:
                return [(since, math.inf)]
        return [(since, until)]

    def _before(self, fault: Fault, touches: list[Edge]) -> list[tuple[float, float]]:
        """The false trip before a contact, where this move makes that contact."""
        number = self.contacts
        for edge in touches:
            number += edge.closed
            if edge.closed and number == fault.touch:
                way = max(edge.way - fault.distance, FINE)
                return [(way, way + (0.3 if fault.kind == "early" else 0.02))]
        return []

    def commit(self, world: World, path: Path, made: float) -> None:
        """Take over that a part of a move was made: its way from the start."""
        touches = self._touches(world, path)
        edges = self.edges(world, path)
        for fault in self.faults:
            if fault.kind in ("early", "spike"):
                before = self._before(fault, touches)
            else:
                before = _at_place(fault, path) if fault.kind == "false_trip" else []
            if before and before[0][0] <= made:
                self._happened.add(fault)
        for edge in touches:
            if edge.way > made:
                break
            self.deflected = edge.closed
            self.contacts += edge.closed
            self._bounce = next(
                (f for f in self.faults
                 if f.kind == "bounce" and edge.closed and f.touch == self.contacts), None,
            )  # fmt: skip
        for edge in edges:
            if edge.way <= made:
                self.closed = edge.closed


def _at_place(fault: Fault, path: Path) -> list[tuple[float, float]]:
    """The false trip where a move comes near to a place."""
    if fault.place is None:
        return []
    p, d, target = path.start, path.direction, fault.place
    way = sum((target[i] - p[i]) * d[i] for i in range(3))
    way = min(max(way, 0.0), path.length)
    if math.dist(path.at(way), target) > max(fault.distance, 1e-6) or path.length == 0.0:
        return []
    return [(max(way, FINE), way + 0.3)]


def _as_edges(intervals: list[tuple[float, float]], closed: bool, length: float) -> list[Edge]:
    """The changes of a signal that is closed in some intervals."""
    places = sorted({0.0, *(a for a, _ in intervals), *(b for _, b in intervals)})
    edges = []
    for place in places:
        if place > length:
            break
        now = any(a <= place < b for a, b in intervals)
        if now != closed:
            edges.append(Edge(place, now))
            closed = now
    return edges
