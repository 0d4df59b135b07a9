"""A probing program: the start and end of each touch, and free ways between the touches."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    FEED,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    checked,
    describe,
    frozen,
)
from pretravel.controls.surroundings import Obstacle, Surroundings
from pretravel.controls.ways import (
    TouchMoves,
    check_height,
    check_limits,
    touch_moves,
    ways_between,
    ways_down,
)
from pretravel.files import Machine
from pretravel.touches import Targets

_DOWNWARD = 0.02
"""Normals with a larger part downwards are not touched from above."""
_OFF_THE_PART = 0.1
"""Targets further than this from the part's surface do not belong to it. [mm]"""


@dataclass(frozen=True, eq=False)
class TableTurns:
    """Turns of a rotary axis between the touches of a program.

    Attributes
    ----------
    letter : str
        A, B or C.
    feed : float
        [deg/min]
    before : mapping of int to (float, (k, 3) float)
        By the row of the touch before which the axis turns: the angle [rad], and the way up to the
        safe height before it [mm].
    straight : bool
        The moves hold only where the work coordinates are not turned about z.
    """

    letter: str
    feed: float
    before: Mapping[int, tuple[float, FloatArray]]
    straight: bool = False


@dataclass(frozen=True, eq=False)
class ProbingProgram:
    """Touches in order, with the way to each touch, in work coordinates.

    Attributes
    ----------
    title : str
    machine : Machine
    labels : tuple of str
    points, normals, approaches : (n, 3) float
        Nominal surface points, outward normals, directions of travel. [mm]
    starts, ends : (n, 3) float
        Places of the tip's centre where a touch starts, and where it counts as missed. [mm]
    feeds : (n,) float
        [mm/min]
    ways : tuple of (k, 3) float
        Places to pass between the start of the previous touch and that of each touch; none
        where the tip moves straight. The first way comes from the safe height. [mm]
    leave : (k, 3) float
        The way up from the last start to the safe height. [mm]
    checked, unchecked : tuple of str
        The checks that were made, and those that were not possible, as texts for users.
    left_out : tuple of str
        Labels of the targets that the probe cannot reach.
    turns : TableTurns or None
        Of a rotary axis.
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
    turns: TableTurns | None = None

    def __len__(self) -> int:
        return len(self.labels)

    @property
    def duration(self) -> float:
        """Approximate duration, without the machine's accelerations. [s]"""
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
    """Plan collision-free paths to targets, for each target at every feed and with repeats.

    Parameters
    ----------
    targets : Targets
        Work coordinates.
    machine : Machine
    title : str
    feeds : sequence of float
        Measuring feeds; an empty sequence means the machine's measuring feed. [mm/min]
    repeats : int
        Number of touches of each target at each feed.
    obstacles : sequence of Obstacle
        All objects that the moves must not meet.
    leave_out : bool
        Leave out targets that the probe cannot reach, instead of refusing them.

    Returns
    -------
    ProbingProgram

    Raises
    ------
    PretravelError
        The safe height is too low; tip, stem or body cannot reach a touch; targets do not lie
        on the obstacles, or face down without any obstacles; moves go beyond the machine's
        limits; feeds or repeats are not positive.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> program = plan_program(up, Machine(), title="one", repeats=2)
    >>> program.labels, program.starts[0].tolist(), program.ways[0].tolist()
    (('top.1', 'top.2'), [0.0, 0.0, 5.0], [[0.0, 0.0, 50.0]])
    """
    feeds = tuple(feeds)
    _check_numbers(feeds, repeats)
    for feed in feeds:
        replace(machine, measuring_feed=feed)  # refused where the machine cannot use it
    surroundings = Surroundings(machine, tuple(obstacles))
    _check_targets(targets, surroundings)
    touches = touch_moves(targets, machine)
    check_height(touches, surroundings)
    down = ways_down(touches, surroundings)
    free = [way for way in down if way is not None]
    blocked = _blocked_touches(touches, down, surroundings)
    unreached = np.flatnonzero(blocked)
    if leave_out and 0 < len(unreached) < len(targets):
        kept = _selected(targets, np.flatnonzero(~blocked))
        rest = plan_program(
            kept, machine, title=title, feeds=feeds, repeats=repeats, obstacles=obstacles
        )
        return replace(rest, left_out=tuple(_names(targets)[i] for i in unreached))
    if len(unreached):
        raise _unreached_error(targets, unreached, no_way=down[unreached[0]] is None)
    reason = check_limits(touches, free, machine)
    sequence = _sequence(_checked_labels(targets), feeds or (machine.measuring_feed,), repeats)
    rows = [step.row for step in sequence]
    ways = ways_between(touches, free, surroundings)
    checked, unchecked = _checks(reason, surroundings)
    return ProbingProgram(
        title=title,
        machine=machine,
        labels=tuple(step.label for step in sequence),
        points=frozen(targets.points[rows]),
        normals=frozen(targets.normals[rows]),
        approaches=frozen(touches.approaches[rows]),
        starts=frozen(touches.starts[rows]),
        ends=frozen(touches.ends[rows]),
        feeds=frozen([step.feed for step in sequence]),
        ways=tuple(ways[step.row] if step.first else np.empty((0, 3)) for step in sequence),
        leave=frozen(free[-1][::-1]),
        checked=checked,
        unchecked=unchecked,
    )


def _check_numbers(feeds: Sequence[float], repeats: int) -> None:
    if not 1 <= repeats <= 1000:
        raise PretravelError(
            f"{repeats} repeats: it must lie between 1 and 1000", inputs=("repeats",)
        )
    for feed in feeds:
        checked(feed, "the measuring feed", FEED, inputs=("feeds",))
    if len(set(feeds)) < len(feeds):
        raise PretravelError(
            "a feed occurs twice; give the number of repeats instead",
            inputs=("feeds", "repeats"),
        )


def _check_targets(targets: Targets, surroundings: Surroundings) -> None:
    """Targets must lie on the obstacles; without obstacles none may face down."""
    if not surroundings.known:
        downward = np.flatnonzero(targets.normals[:, 2] < -_DOWNWARD)
        if len(downward):
            more = f" (so do {len(downward) - 1} more)" if len(downward) > 1 else ""
            raise PretravelError(
                f"{targets.name(int(downward[0]))}: its normal points down{more}. A "
                "path to it without collision can be planned only with the geometry of the part "
                "(part.step)",
                inputs=("surface",),
            )
        return
    off = surroundings.off(targets.points)
    if off.max() > _OFF_THE_PART:
        row = int(np.argmax(off))
        raise PretravelError(
            f"{targets.name(row)} is {off[row]:.3f} mm off the surface "
            f"({int(np.sum(off > _OFF_THE_PART))} targets are more than {_OFF_THE_PART:g} mm "
            "off): are both in the same work coordinates, and in mm?"
        )


def unreached_targets(
    targets: Targets, machine: Machine, obstacles: Sequence[Obstacle]
) -> BoolArray:
    """Which targets tip, stem or body of the probe cannot get to, (n,).

    Parameters
    ----------
    targets : Targets
        Work coordinates.
    machine : Machine
    obstacles : sequence of Obstacle
    """
    surroundings = Surroundings(machine, tuple(obstacles))
    touches = touch_moves(targets, machine)
    return _blocked_touches(touches, ways_down(touches, surroundings), surroundings)


def _blocked_touches(
    touches: TouchMoves, down: Sequence[FloatArray | None], surroundings: Surroundings
) -> BoolArray:
    """Targets without a way to the start of the touch, or from there to the contact, (n,)."""
    blocked = np.array([way is None for way in down])
    free = np.flatnonzero(~blocked)
    blocked[free] = surroundings.block_touch(touches.starts[free], touches.contacts[free])
    return blocked


def _unreached_error(targets: Targets, unreached: IntArray, *, no_way: bool) -> PretravelError:
    row = int(unreached[0])
    reason = (
        "there is no free way from the safe height to the start of the touch"
        if no_way
        else "it would run into something before the target is touched"
    )
    others = ", ".join(targets.name(int(i)) for i in unreached[1:10])
    more = f"; the same for {others}{'…' if len(unreached) > 10 else ''}" if others else ""
    return PretravelError(
        f"{targets.name(row)} ({describe(targets.normals[row])}): tip, stem or body of the probe "
        f"cannot get there: {reason}{more}. Leave these targets out, or use a longer or thinner "
        "stylus ([probe] in the machine file)",
        inputs=("leave_out",),
    )


def _names(targets: Targets) -> tuple[str, ...]:
    return targets.labels or tuple(str(i + 1) for i in range(len(targets)))


def _selected(targets: Targets, rows: IntArray) -> Targets:
    """Some of the targets, with the names that they have among all."""
    names = _names(targets)
    return Targets(
        targets.points[rows],
        targets.normals[rows],
        np.asarray(targets.approaches)[rows],
        tuple(names[i] for i in rows),
    )


def _checked_labels(targets: Targets) -> tuple[str, ...]:
    """Labels that a G-code comment and a CSV cell can contain as they are."""
    names = _names(targets)
    for row, name in enumerate(names):
        if (
            not name
            or len(name) > 40
            or not all(c.isascii() and (c.isalnum() or c in "-_.") for c in name)
        ):
            raise PretravelError(
                f"target {row + 1}: its label '{name}' cannot be written in a program; a label "
                "has up "
                "to 40 letters, digits and the characters -_."
            )
    if len(set(names)) < len(names):
        twice = Counter(names).most_common(1)[0][0]
        raise PretravelError(
            f"two targets are called '{twice}'; readings are assigned to targets by their labels"
        )
    return names


@dataclass(frozen=True)
class _Step:
    """One touch of the sequence: its target's row; whether it is the first of that target."""

    row: int
    label: str
    feed: float
    first: bool


def _sequence(names: Sequence[str], feeds: Sequence[float], repeats: int) -> list[_Step]:
    """Each target at every feed, each so many times."""
    steps = []
    for row, name in enumerate(names):
        for number, feed in enumerate(feeds):
            at_feed = name if len(feeds) == 1 else f"{name}_f{feed:g}"
            for repeat in range(repeats):
                label = f"{at_feed}.{repeat + 1}" if repeats > 1 else at_feed
                steps.append(_Step(row, label, feed, first=number == repeat == 0))
    return steps


def _checks(
    limits_unchecked: str, surroundings: Surroundings
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The checks that were made, and those that were not possible."""
    checked, unchecked = [], []
    if limits_unchecked:
        unchecked.append(f"the machine's limits, because {limits_unchecked}")
    else:
        checked.append("the machine's limits")
    machine = surroundings.machine
    if machine.work is None:
        unchecked.append(
            f"the origin of {machine.work_offset}, because the section [work] of the machine "
            "file has no x_mm, y_mm and z_mm"
        )
    if surroundings.known:
        known = ", ".join(obstacle.words for obstacle in surroundings.obstacles)
        checked.append(f"the moves do not hit {known}. Other obstacles are not checked")
    else:
        unchecked.append("moves against the part, because its geometry was not given")
    return tuple(checked), tuple(unchecked)
