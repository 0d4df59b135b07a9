"""The laws of safety for a probing program: what a trace breaks, as sentences.

Each law is a function of a `Trace` and of the `Plan`, and returns the violations; none means that
the law holds. The laws are about the machine, not about the way in which a program is written.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tests.support.machine_model.coordinates import Frame, WorkOffset
from tests.support.machine_model.machine import Move, Trace
from tests.support.machine_model.modes import Vector, after_program_end, differences

_SAME = 2e-3
"""Places of a program have three decimals or more. [mm]"""
_STATE = ("units", "distance", "plane", "work_offset", "feed_mode", "feed", "path", "feed_override",
          "speed_override", "adaptive_feed", "feed_hold", "shift")  # fmt: skip


@dataclass(frozen=True)
class PlannedTouch:
    """One touch, by places of the ball's middle in work coordinates. [mm]"""

    label: str
    start: Vector
    contact: Vector
    end: Vector


@dataclass(frozen=True)
class Plan:
    """What a program may do.

    Attributes
    ----------
    touches : tuple of PlannedTouch
    segments : tuple of pairs
        All straight ways of the ball's middle below the safe height, those of touches too.
    safe_height : float
    offset : WorkOffset
        Where the work coordinates really are.
    overtravel : float
        Depth in the surface that a missed touch may reach.
    stopping : float
        The machine's way to stand still at the measuring feed, and at the positioning feed.
    clearance : float
        A touch off by more than this must stop the program.
    positioning_feed : float
        The highest feed below the safe height. [mm/min]
    """

    touches: tuple[PlannedTouch, ...]
    segments: tuple[tuple[Vector, Vector], ...]
    safe_height: float
    offset: WorkOffset = field(default_factory=WorkOffset)
    overtravel: float = 2.0
    stopping: float = 0.2
    clearance: float = 1.0
    positioning_feed: float = 1000.0

    def work(self, tip: Vector) -> Vector:
        """A place of the ball's middle in work coordinates."""
        return Frame(self.offset).to_work(tip)

    def machine(self, place: Vector) -> Vector:
        """A place of the ball's middle in machine coordinates, from work coordinates."""
        return Frame(self.offset).to_machine(place)

    def touch_of(self, move: Move) -> PlannedTouch | None:
        """The touch that a measuring move makes; None for other moves."""
        if move.kind != "probe" or move.code not in ("G38.2", "G38.3"):
            return None
        end = self.work(move.tip_planned)
        near = (t for t in self.touches if math.dist(t.end, end) < _SAME)
        return next(near, None)


Law = Callable[[Trace, Plan], list[str]]


def _named(move: Move) -> str:
    x, y, z = move.reached
    return f"{move.file}:{move.line} {move.code} to ({x:.3f}, {y:.3f}, {z:.3f})"


def no_rapid_move_with_a_tripped_probe(trace: Trace, plan: Plan) -> list[str]:
    """A rapid move begins with an open probe."""
    return [
        f"{_named(m)}: a rapid move of {m.length:.1f} mm while the probe is tripped"
        for m in trace.moves
        if m.kind == "rapid" and m.tripped_at_start and m.length > _SAME
    ]


def no_rapid_move_with_an_unknown_probe(trace: Trace, plan: Plan) -> list[str]:
    """Before a rapid move the program has seen that the probe is open, since the last touch.

    It sees it by a probe move away that ended with the probe open, or by one towards that met
    nothing.
    """
    found, known = [], False
    for move in trace.moves:
        if move.kind == "probe":
            away = move.code in ("G38.4", "G38.5")
            known = bool(move.touched) == away
        elif move.kind == "rapid" and not known and move.length > _SAME:
            found.append(f"{_named(move)}: a rapid move; the probe was not seen open before it")
    return found


def no_long_way_with_a_tripped_probe(trace: Trace, plan: Plan) -> list[str]:
    """With a tripped probe the machine goes no further than from a touch back to its start."""
    longest = max((math.dist(t.start, t.end) for t in plan.touches), default=0.0) + plan.stopping
    found, way = [], 0.0
    for move in trace.moves:
        way = way + move.length if move.tripped_at_start and move.tripped_at_end else 0.0
        if way > longest + _SAME:
            found.append(f"{_named(move)}: {way:.1f} mm of way with a probe that stays tripped")
            break
    return found


def stops_at_a_miss(trace: Trace, plan: Plan) -> list[str]:
    """After a touch that met nothing comes the way back, no other touch, and no normal end."""
    for row, move in enumerate(trace.moves):
        touch = plan.touch_of(move)
        if touch is None or move.touched is not False:
            continue
        later = [plan.touch_of(m) for m in trace.moves[row + 1 :]]
        more = sum(t is not None for t in later)
        if more:
            return [f"{_named(move)}: '{touch.label}' was missed, and {more} touches follow"]
        if trace.ended == "end":
            return [f"{_named(move)}: '{touch.label}' was missed, and the program ends normally"]
    return []


def no_way_into_the_part_after_a_miss(trace: Trace, plan: Plan) -> list[str]:
    """After a miss no move has a component along the direction of that touch, near the part."""
    found = []
    for row, move in enumerate(trace.moves):
        touch = plan.touch_of(move)
        if touch is None or move.touched is not False:
            continue
        into = _direction(touch.start, touch.end)
        for later in trace.moves[row + 1 :]:
            if later.depths_at_start.ball < -plan.clearance:
                break
            start, end = plan.work(later.tip_start), plan.work(later.tip_reached)
            step = sum((e - s) * d for s, e, d in zip(start, end, into, strict=True))
            if step > _SAME:
                found.append(f"{_named(later)}: {step:.3f} mm into the part, after a miss")
    return found


def first_motion_is_not_downward(trace: Trace, plan: Plan) -> list[str]:
    """First up; across only where the machine stands at the safe height or above."""
    for move in trace.moves:
        if move.length < _SAME and math.dist(move.start, move.planned) < _SAME:
            continue
        down = move.start[2] - move.planned[2]
        across = math.dist(move.start[:2], move.planned[:2])
        if down > _SAME:
            return [f"{_named(move)}: the first motion goes {down:.3f} mm down"]
        if across > _SAME and plan.work(move.tip_start)[2] < plan.safe_height - _SAME:
            return [f"{_named(move)}: the first motion goes across, below the safe height"]
        return []
    return []


def only_planned_ways_below_the_safe_height(trace: Trace, plan: Plan) -> list[str]:
    """Below the safe height the ball is on a planned way, or rises from its first place."""
    found: list[str] = []
    begun = False
    for move in trace.moves:
        start, end = plan.work(move.tip_start), plan.work(move.tip_reached)
        rises = math.dist(start[:2], end[:2]) < _SAME and end[2] >= start[2]
        if not begun and rises:
            continue
        begun = True
        steps = max(int(math.dist(start, end) / 0.5), 1)
        part = np.linspace(0.0, 1.0, steps + 1)[:, None]
        places = np.array(start) + part * (np.array(end) - np.array(start))
        low = places[places[:, 2] < plan.safe_height - _SAME]
        off = low[_from_ways(low, plan) > plan.stopping + _SAME] if len(low) else low
        if len(off):
            x, y, z = off[0]
            found.append(f"{_named(move)}: at ({x:.2f}, {y:.2f}, {z:.2f}) it is on no planned way")
    return found


def no_fast_move_below_the_safe_height(trace: Trace, plan: Plan) -> list[str]:
    """Below the safe height no move is rapid, and none is faster than the positioning feed."""
    found = []
    for move in trace.moves:
        low = min(plan.work(move.tip_start)[2], plan.work(move.tip_planned)[2])
        if low < plan.safe_height - _SAME and (
            move.kind == "rapid" or move.feed > plan.positioning_feed + _SAME
        ):
            pace = "rapidly" if move.kind == "rapid" else f"at {move.feed:g} mm/min"
            found.append(f"{_named(move)}: {pace} at a height of {low:.3f} mm")
    return found


def _from_ways(places: np.ndarray, plan: Plan) -> np.ndarray:
    """Distance of places (n, 3) from the nearest planned way, (n,)."""
    ways = np.array(plan.segments)
    first, along = ways[:, 0], ways[:, 1] - ways[:, 0]
    length2 = np.maximum(np.sum(along**2, axis=1), 1e-12)
    away = places[:, None, :] - first
    part = np.clip(np.sum(away * along, axis=2) / length2, 0.0, 1.0)
    off = np.linalg.norm(away - part[:, :, None] * along, axis=2)
    return np.asarray(off.min(axis=1))


def not_deeper_than_allowed(trace: Trace, plan: Plan) -> list[str]:
    """A measuring move goes in as far as the overtravel; any other move never goes deeper."""
    found = []
    for move in trace.moves:
        at_start, deepest = move.depths_at_start, move.depths
        for part in ("ball", "stem", "body"):
            depth, before = getattr(deepest, part), max(getattr(at_start, part), 0.0)
            measuring = plan.touch_of(move) is not None
            allowed = (plan.overtravel if measuring else before) + plan.stopping
            if move.kind == "rapid":
                allowed = before
            if depth > allowed + _SAME:
                found.append(f"{_named(move)}: the {part} is {depth:.3f} mm deep in something")
    return found


def no_spindle_start(trace: Trace, plan: Plan) -> list[str]:
    """A probe never turns."""
    return [f"line {line}: the spindle starts" for line in trace.spindle_starts]


def state_is_restored(trace: Trace, plan: Plan) -> list[str]:
    """At the end, at a stop of the program's own, and at one of the control, the modes come back.

    M2 itself sets some modes; where it ends the program these are right. So is an override that
    is on again: it is off only where a control stopped in the middle of a touch.
    """
    before = after_program_end(trace.before) if trace.ended == "end" else trace.before
    names = _STATE if trace.tool != trace.tool_before else (*_STATE, "tool_offset")
    changes = differences(before, trace.after, names)
    if before.feed_mode == "G93":  # Each move has its own F.
        changes.pop("feed", None)
    if trace.after.feed_override:
        changes.pop("feed_override", None)
    found = [f"{name}: {change}" for name, change in changes.items()]
    if trace.offsets_before != trace.offsets_after:
        found.append("a work offset was changed")
    return [f"not restored at the {trace.ended}: {text}" for text in found]


def no_override_while_measuring(trace: Trace, plan: Plan) -> list[str]:
    """The measuring feed is the programmed one: no override, no adaptive feed."""
    return [
        f"{_named(m)}: a feed override has influence on a measuring move"
        for m in trace.moves
        if m.override and plan.touch_of(m) is not None
    ]


def every_stop_has_a_message(trace: Trace, plan: Plan) -> list[str]:
    """A program that did not reach its end says why."""
    if trace.ended != "end" and not trace.error.strip():
        return ["the program stopped without a message"]
    return []


def a_wrong_touch_stops(trace: Trace, plan: Plan) -> list[str]:
    """A touch further from its nominal contact than the clearance is the last one."""
    for row, move in enumerate(trace.moves):
        touch = plan.touch_of(move)
        if touch is None or not move.touched:
            continue
        off = math.dist(plan.work(move.tip_reached), touch.contact)
        more = any(plan.touch_of(m) for m in trace.moves[row + 1 :])
        if off > plan.clearance + plan.stopping and (more or trace.ended == "end"):
            return [f"{_named(move)}: '{touch.label}' is {off:.2f} mm off, and the program goes on"]
    return []


LAWS: tuple[Law, ...] = (
    no_rapid_move_with_a_tripped_probe,
    no_rapid_move_with_an_unknown_probe,
    no_long_way_with_a_tripped_probe,
    stops_at_a_miss,
    no_way_into_the_part_after_a_miss,
    first_motion_is_not_downward,
    only_planned_ways_below_the_safe_height,
    no_fast_move_below_the_safe_height,
    not_deeper_than_allowed,
    no_spindle_start,
    state_is_restored,
    no_override_while_measuring,
    every_stop_has_a_message,
    a_wrong_touch_stops,
)


def violations(trace: Trace, plan: Plan, laws: Sequence[Law] = LAWS) -> list[str]:
    """All that a trace breaks, each sentence with the name of its law."""
    return [f"{law.__name__}: {text}" for law in laws for text in law(trace, plan)]


def _direction(first: Vector, last: Vector) -> Vector:
    length = math.dist(first, last) or 1.0
    x, y, z = ((b - a) / length for a, b in zip(first, last, strict=True))
    return (x, y, z)
