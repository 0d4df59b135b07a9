"""A probing program: where each touch starts and ends, and free ways between them.

The probe axis is the machine's z. Between touches the tip goes straight where that is known to be
free; else up to the safe height, across, and down again. Where the way down is not free it comes in
from the side that the normal points to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray, frozen
from pretravel.controls.machine import Machine
from pretravel.directions import describe
from pretravel.errors import PretravelError
from pretravel.probing.obstacles import StylusOutline, first_obstacle, stem_obstacle
from pretravel.probing.targets import Targets
from pretravel.surface.cad.part import Part

_EDGES = 0.05
"""Resolution of a face's edges when distances from it are worked out. [mm]"""
_STEP = 0.25
"""Between places of a move that are looked at. [mm]"""
_BODY_HEIGHT = 200.0
"""How far up the body of the probe, and the spindle behind it, are thought to reach. [mm]"""
_SIDEWAYS = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0)
"""How far out along the normal's horizontal part a way down is looked for. [mm]"""
_DOWNWARD = 0.02
"""Normals with more than this part downwards are not touched from above."""
_OFF_THE_PART = 0.1
"""Targets further than this from the part's surface do not belong to it. [mm]"""
_UP = np.array([0.0, 0.0, 1.0])


class Obstacle(Protocol):
    """Something around that moves must not run into, in work coordinates."""

    @property
    def top(self) -> float:
        """Its highest point. [mm]"""
        ...

    def off(self, points: FloatArray) -> FloatArray:
        """How far points that are meant to be on its surface are from it, (n,). [mm]"""
        ...

    def blocks(self, machine: Machine, start: FloatArray, end: FloatArray) -> BoolArray:
        """Whether tip, stem or body meet it on straight moves (n, 3) to (n, 3), (n,)."""
        ...

    def blocks_touch(self, machine: Machine, start: FloatArray, contact: FloatArray) -> BoolArray:
        """The same for moves that end with the tip on it: it may be met there, not before."""
        ...


@dataclass(frozen=True, eq=False)
class SphereObstacle:
    """A reference sphere, on a shank below it where that is told.

    Attributes
    ----------
    center : (3,) float
        [mm]
    radius : float
        [mm]
    shank_diameter : float
        Of a shank straight down; 0: not known. [mm]
    """

    center: FloatArray
    radius: float
    shank_diameter: float = 0.0

    @property
    def top(self) -> float:
        """Its highest point. [mm]"""
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
        # The sphere's centre seen from the tip: along the axis, and across it.
        tip = start + share[:, None, None] * (end - start)
        seen = self.center - tip
        up, across = seen[..., 2], np.hypot(seen[..., 0], seen[..., 1])
        # A ball that comes straight to the sphere meets it where it should.
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
    """A part, all its faces.

    Attributes
    ----------
    part : Part
        In work coordinates. [mm]
    """

    part: Part

    @property
    def top(self) -> float:
        """Its highest point. [mm]"""
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
        # Moves of like length go together; what is asked for is the whole of the longest.
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
            met[rows] |= stem_obstacle(self.part, end[rows], direction, outline, reach) >= 0
        return met


@dataclass(frozen=True, eq=False)
class ProbingProgram:
    """Touches in order, with the way to each, in work coordinates.

    Attributes
    ----------
    title : str
    machine : Machine
    labels : tuple of str
    points, normals, approaches : (n, 3) float
        Nominal surface points, outward normals, directions of travel. [mm]
    starts, ends : (n, 3) float
        Of the tip's centre: where a touch starts, and where it counts as missed. [mm]
    feeds : (n,) float
        [mm/min]
    ways : tuple of (k, 3) float
        Places to pass between the start of the touch before and that of each; none where it
        goes straight. The first comes from the safe height. [mm]
    leave : (k, 3) float
        Up from the last start to the safe height. [mm]
    checked, unchecked : tuple of str
        What was and what could not be looked at, for people.
    left_out : tuple of str
        Targets that the probe cannot get to.
    """

    title: str
    machine: Machine
    labels: tuple[str, ...]
    points: FloatArray
    normals: FloatArray
    approaches: FloatArray
    starts: FloatArray
    ends: FloatArray
    feeds: FloatArray
    ways: tuple[FloatArray, ...]
    leave: FloatArray
    checked: tuple[str, ...]
    unchecked: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def duration(self) -> float:
        """About how long it takes, without the machine's accelerations. [s]"""
        measuring = float(np.sum(self.machine.start_distance / self.feeds))
        length = len(self) * self.machine.start_distance
        for row, way in enumerate(self.ways):
            before = self.starts[row - 1 : row] if row else way[:1]
            places = np.vstack([before, way, self.starts[row : row + 1]])
            length += float(np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)))
        return 60.0 * (measuring + length / self.machine.positioning_feed)


def plan_program(
    targets: Targets,
    machine: Machine,
    *,
    title: str,
    feeds: Sequence[float] = (),
    repeats: int = 1,
    obstacles: Sequence[Obstacle] = (),
    leave_out: bool = False,
) -> ProbingProgram:
    """Free ways to touch targets, each at every feed, each so many times.

    Parameters
    ----------
    targets : Targets
        Work coordinates.
    machine : Machine
    title : str
    feeds : sequence of float
        None: the machine's measuring feed. [mm/min]
    repeats : int
    obstacles : sequence of Obstacle
        All that is known to stand around.
    leave_out : bool
        Targets that the probe cannot get to, instead of refusing.

    Returns
    -------
    ProbingProgram

    Raises
    ------
    PretravelError
        A safe height that is not safe; touches that tip, stem or body cannot come to; targets
        off the surfaces told, or facing down without any; moves beyond the machine's limits;
        feeds or repeats that are not positive.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> program = plan_program(up, Machine(), title="one", repeats=2)
    >>> program.labels, program.starts[0].tolist(), program.ways[0].tolist()
    (('top.1', 'top.2'), [0.0, 0.0, 5.0], [[0.0, 0.0, 50.0]])
    """
    if not 1 <= repeats <= 1000:
        raise PretravelError(f"{repeats} repeats: it lies between 1 and 1000")
    feeds = tuple(feeds) or (machine.measuring_feed,)
    if len(set(feeds)) < len(feeds):
        raise PretravelError("a feed is there twice; repeats are told by --repeats")
    for feed in feeds:
        if not 0.0 < feed <= 1e5:
            raise PretravelError(f"feed {feed:g} mm/min: it must be positive")
    approaches = np.asarray(targets.approaches)
    downward = np.flatnonzero(targets.normals[:, 2] < -_DOWNWARD)
    if len(downward) and not obstacles:
        raise PretravelError(
            f"{targets.name(int(downward[0]))}: its normal points down"
            f"{f', as of {len(downward) - 1} more' if len(downward) > 1 else ''}, and the way to "
            "it can only be found with the part's geometry: --surface part.step"
        )
    contacts = targets.points + machine.tip_radius * targets.normals
    starts = contacts - machine.start_distance * approaches
    ends = contacts + machine.overtravel * approaches
    if obstacles:
        off = np.min([obstacle.off(targets.points) for obstacle in obstacles], axis=0)
        if off.max() > _OFF_THE_PART:
            row = int(np.argmax(off))
            raise PretravelError(
                f"{targets.name(row)} is {off[row]:.3f} mm off the surface that was told "
                f"({int(np.sum(off > _OFF_THE_PART))} targets are more than {_OFF_THE_PART:g} mm "
                "off): are both in the same work coordinates, and in mm?"
            )
    _check_height(targets, starts, machine, obstacles)
    down = _ways_down(targets, starts, machine, obstacles)
    blocked = np.array([way is None for way in down])
    met = np.zeros(len(starts), dtype=bool)
    for obstacle in obstacles:
        free = np.flatnonzero(~blocked)
        if len(free):
            met[free] |= obstacle.blocks_touch(machine, starts[free], contacts[free])
    unreached = np.flatnonzero(blocked | met)
    if len(unreached) and leave_out and len(unreached) < len(targets):
        kept = np.setdiff1d(np.arange(len(targets)), unreached)
        names = targets.labels or tuple(str(i + 1) for i in range(len(targets)))
        rest = plan_program(
            Targets(targets.points[kept], targets.normals[kept], approaches[kept],
                    tuple(names[i] for i in kept)),
            machine, title=title, feeds=feeds, repeats=repeats, obstacles=obstacles,
        )  # fmt: skip
        return replace(rest, left_out=tuple(names[i] for i in unreached))
    if len(unreached):
        row = int(unreached[0])
        why = (
            "no free way from the safe height to where it starts"
            if blocked[row]
            else "it would run into something before the target is touched"
        )
        names_ = ", ".join(targets.name(int(i)) for i in unreached[1:10])
        more = f"; the same for {names_}{'…' if len(unreached) > 10 else ''}" if names_ else ""
        raise PretravelError(
            f"{targets.name(row)} ({describe(targets.normals[row])}): tip, stem or body of the "
            f"probe cannot get there: {why}{more}. Leave them out (--leave-out), or use a longer "
            "or thinner stylus ([probe] in the machine file)"
        )
    free_ways = [way for way in down if way is not None]
    checked, unchecked = _check_limits(free_ways, starts, ends, targets, machine)
    ways = _ways_between(free_ways, starts, machine, obstacles)
    if obstacles:
        checked.append("moves against what was told to stand around")
    else:
        unchecked.append("moves against the part: its geometry was not told")
    plain = len(feeds) == 1
    labels, rows, every_feed, every_way = [], [], [], []
    names = _checked_labels(targets)
    for row, name in enumerate(names):
        for number, feed in enumerate(feeds):
            for repeat in range(repeats):
                label = name if plain else f"{name}@{feed:g}"
                labels.append(f"{label}.{repeat + 1}" if repeats > 1 else label)
                rows.append(row)
                every_feed.append(feed)
                every_way.append(ways[row] if number == repeat == 0 else np.empty((0, 3)))
    return ProbingProgram(
        title=title,
        machine=machine,
        labels=tuple(labels),
        points=frozen(targets.points[rows]),
        normals=frozen(targets.normals[rows]),
        approaches=frozen(approaches[rows]),
        starts=frozen(starts[rows]),
        ends=frozen(ends[rows]),
        feeds=frozen(every_feed),
        ways=tuple(every_way),
        leave=frozen(free_ways[-1][::-1]),
        checked=tuple(checked),
        unchecked=tuple(unchecked),
    )


def _checked_labels(targets: Targets) -> tuple[str, ...]:
    """Labels that go through a G-code comment and a CSV cell as they are."""
    names = targets.labels or tuple(str(i + 1) for i in range(len(targets)))
    for row, name in enumerate(names):
        if not name or len(name) > 40 or not all(c.isascii() and (c.isalnum() or c in "-_.:+/@")
                                                 for c in name):  # fmt: skip
            raise PretravelError(
                f"target {row + 1}: its label '{name}' cannot stand in a program; letters, digits "
                "and -_.:+/@ can, up to 40 of them"
            )
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise PretravelError(
            f"two targets are called '{twice}'; readings are told apart by their labels"
        )
    return names


def _check_height(
    targets: Targets, starts: FloatArray, machine: Machine, obstacles: Sequence[Obstacle]
) -> None:
    highest = max(
        float(starts[:, 2].max()),
        float(targets.points[:, 2].max()) + machine.tip_radius + machine.clearance,
        *(obstacle.top + machine.tip_radius + machine.clearance for obstacle in obstacles),
    )
    if machine.safe_height < highest:
        raise PretravelError(
            f"safe_height_mm = {machine.safe_height:g}: the tip's centre must be at "
            f"{highest:.3f} mm at least to travel over what is there (work coordinates)"
        )


def _ways_down(
    targets: Targets, starts: FloatArray, machine: Machine, obstacles: Sequence[Obstacle]
) -> list[FloatArray | None]:
    """The first of a few ways from the safe height that meets nothing: all but the start.

    None where there is none.
    """
    sideways = np.array(targets.normals)
    sideways[:, 2] = 0.0
    length = np.linalg.norm(sideways, axis=1)
    sideways = np.where((length > 1e-3)[:, None], sideways / np.maximum(length, 1e-12)[:, None], 0)
    ways: list[FloatArray | None] = [None] * len(starts)
    left = np.arange(len(starts))
    for distance in _SIDEWAYS:
        corner = starts[left] + distance * sideways[left]
        top = corner.copy()
        top[:, 2] = machine.safe_height
        blocked = np.zeros(len(left), dtype=bool)
        for obstacle in obstacles:
            blocked |= obstacle.blocks(machine, top, corner)
            if distance > 0.0:
                blocked |= obstacle.blocks(machine, corner, starts[left])
        for i in np.flatnonzero(~blocked):
            ways[int(left[i])] = frozen([top[i]] if distance == 0.0 else [top[i], corner[i]])
        left = left[blocked]
        if not len(left):
            break
    return ways


def _ways_between(
    down: Sequence[FloatArray],
    starts: FloatArray,
    machine: Machine,
    obstacles: Sequence[Obstacle],
) -> list[FloatArray]:
    """From each start to the next: straight where that is known to be free."""
    straight = np.full(max(len(starts) - 1, 0), bool(obstacles))
    moves = np.linalg.norm(np.diff(starts, axis=0), axis=1) > 0.0
    for obstacle in obstacles:
        if len(straight):
            free = ~obstacle.blocks(machine, starts[:-1], starts[1:])
            straight &= free | ~moves
    ways = [down[0]]
    for row in range(1, len(starts)):
        over = np.vstack([down[row - 1][::-1], down[row]])
        ways.append(np.empty((0, 3)) if straight[row - 1] else frozen(over))
    return ways


def _check_limits(
    down: Sequence[FloatArray],
    starts: FloatArray,
    ends: FloatArray,
    targets: Targets,
    machine: Machine,
) -> tuple[list[str], list[str]]:
    if machine.limits is None:
        return [], ["the machine's limits: the machine file has no [limits]"]
    if machine.work is None:
        return [], ["the machine's limits: [work] does not tell where the work coordinates are"]
    for row, way in enumerate(down):
        places = machine.work.points(np.vstack([way, starts[row], ends[row]]))
        outside = (places < machine.limits[:, 0]) | (places > machine.limits[:, 1])
        if outside.any():
            place, axis = np.argwhere(outside)[0]
            raise PretravelError(
                f"{targets.name(row)}: the tip would go to {'xyz'[axis]} = "
                f"{places[place, axis]:.3f} mm in machine coordinates, beyond the limits "
                f"{machine.limits[axis, 0]:g} to {machine.limits[axis, 1]:g} mm"
            )
    return ["the machine's limits"], []
