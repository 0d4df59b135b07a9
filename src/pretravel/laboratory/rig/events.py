"""Evaluation of a rig trace: contact made, trigger, contact lost."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.laboratory.rig.signals import (
    AGREEMENT,
    LARGEST_RATIO,
    LEAST_PUSH,
    SETTLED,
    UNKNOWN_POSITION,
    LevelChange,
    RodMotion,
    RulerPosition,
    coarse_step,
    laser_at_edge,
    laser_kink,
    level_changes,
    rod_motion,
    ruler_at_edge,
)
from pretravel.laboratory.rig.trace import RigTouch, RigTrace


@dataclass(frozen=True, eq=False)
class _Record:
    """A trace with the phases of its motion, its changes of level, and the laser at rest."""

    trace: RigTrace
    motion: RodMotion
    contact: list[LevelChange]
    trigger: list[LevelChange]
    excursions: dict[str, int]
    laser_before: float
    laser_after: float
    laser_noise: float


@dataclass(frozen=True)
class _Event:
    """The ruler at an event, and irregularities of the signal, as sentences."""

    position: RulerPosition
    notes: tuple[str, ...]


def rig_touch(trace: RigTrace) -> RigTouch:
    """Determine the events of one touch on the rig.

    Parameters
    ----------
    trace : RigTrace

    Returns
    -------
    RigTouch
        With nan for events that the trace does not show, and notes that state it.

    Raises
    ------
    PretravelError
        A rod that does not go forward.

    Notes
    -----
    A change of level counts once it has lasted for `SETTLED`. Its time is that of its first
    edge (of its last edge where contact is lost), so that bounce does not shift it. Shorter
    excursions are interference; the notes state their number. At each edge the ruler is that of a
    line through its neighbours, half-way between the two samples. The laser shows where the tip
    starts to move: it confirms the contact signal, and replaces it where an edge is missing.

    References
    ----------
    Ren 2020, section 2.2 and equations 2 to 4.
    """
    record = _record(trace)
    motion = record.motion
    made, lost = _contact_made(record), _contact_lost(record)
    fired, displacement = _trigger(record)
    notes = [*_signal_notes(record), *made.notes, *fired.notes, *lost.notes]
    notes += wrong_order(made.position.value, fired.position.value)
    return RigTouch(
        trace=trace.name,
        r0=made.position.value,
        r1=fired.position.value,
        r2=float(np.median(trace.ruler[motion.standing])),
        r3=lost.position.value,
        u_r0=made.position.u,
        u_r1=fired.position.u,
        u_r3=lost.position.u,
        tip_displacement=displacement,
        zero_shift=record.laser_after - record.laser_before,
        feed=motion.speed * 60.0,
        notes=tuple(notes),
        step=coarse_step(trace, motion.speed * trace.interval),
    )


def wrong_order(r0: float, r1: float) -> tuple[str, ...]:
    """The note on a trigger before the contact; none where the order is right or unknown.

    Parameters
    ----------
    r0, r1 : float
        Ruler at the contact and at the trigger. [mm]

    >>> wrong_order(1.0, 1.01), len(wrong_order(1.01, 1.0))
    ((), 1)
    """
    if r1 < r0:
        return ("the trigger comes before the contact: check the wiring of the signals",)
    return ()


def _record(trace: RigTrace) -> _Record:
    motion = rod_motion(trace)
    contact, contact_excursions = level_changes(trace.contact, trace.time)
    trigger, trigger_excursions = level_changes(trace.trigger, trace.time)
    before = trace.laser[: max(motion.forward.start + 20, 20)]
    if contact:
        before = trace.laser[: max(contact[0].first - 1, 5)]
    rest = float(np.median(before))
    return _Record(
        trace=trace,
        motion=motion,
        contact=contact,
        trigger=trigger,
        excursions={"contact": contact_excursions, "trigger": trigger_excursions},
        laser_before=rest,
        laser_after=float(np.median(trace.laser[-max(len(trace.laser) // 20, 10) :])),
        laser_noise=1.4826 * float(np.median(np.abs(before - rest))),
    )


def _signal_notes(record: _Record) -> Iterator[str]:
    """Irregularities of the logic signals themselves."""
    for name, count in record.excursions.items():
        if count:
            yield f"{count} short excursion{'s' * (count > 1)} of the {name} signal ignored"
    for name, level in (("contact", record.trace.contact), ("trigger", record.trace.trigger)):
        if not level[:20].any():
            yield f"the {name} signal is low at rest; it should be high: is it inverted?"
    if record.trace.interval > SETTLED:
        yield (
            f"the samples are {1e3 * record.trace.interval:.4g} ms apart, too far to see a signal "
            "bounce: is time_s in s?"
        )
    yield from _laser_notes(record)


def _laser_notes(record: _Record) -> Iterator[str]:
    """A laser that does not follow the rod after the contact."""
    trace, stop = record.trace, record.motion.forward.stop - 1
    made = [each.first for each in record.contact if not trace.contact[each.last]]
    if not made or made[0] >= stop:
        return
    rod, laser = (float(values[stop] - values[made[0]]) for values in (trace.ruler, trace.laser))
    shown = rod > LEAST_PUSH and abs(laser) > 10.0 * record.laser_noise + 0.1 * MICROMETRE
    if shown and not 1.0 / LARGEST_RATIO < laser / rod < LARGEST_RATIO:
        ratio = float(f"{laser / rod:.1g}")  # one note for traces that are alike
        yield (
            f"the laser moves by about {ratio:g} µm for each µm of the rod after the contact: is "
            "laser_mm in mm, and does it grow as the rod pushes?"
        )


def _trigger(record: _Record) -> tuple[_Event, float]:
    """The trigger, and the displacement of the tip up to it. [mm]"""
    trace, motion = record.trace, record.motion
    fired = [
        change
        for change in record.trigger
        if not trace.trigger[change.last] and change.first < motion.standing.stop
    ]
    if not fired:
        what = "changes only on the way back" if record.trigger else "never changes"
        note = f"no trigger: the signal {what}, so r1 is unknown"
        return _Event(UNKNOWN_POSITION, (note,)), math.nan
    notes = []
    if len(fired) > 1:
        notes.append(f"the trigger signal fell {len(fired)} times on the way; the first counts")
    if fired[0].bounced:
        notes.append("the trigger signal bounced; its first edge counts")
    edge = fired[0].first
    position = ruler_at_edge(trace, edge, motion.forward, motion.noise)
    displacement = laser_at_edge(trace, edge, motion.forward) - record.laser_before
    return _Event(position, tuple(notes)), displacement


def _contact_made(record: _Record) -> _Event:
    """The first contact of rod and tip."""
    trace, motion = record.trace, record.motion
    kink = laser_kink(trace, motion.forward, record.laser_before, record.laser_noise)
    made = [
        change
        for change in record.contact
        if not trace.contact[change.last] and change.first < motion.standing.stop
    ]
    if not made:
        if kink is None:
            note = "no contact: neither the signal nor the laser shows one"
            return _Event(UNKNOWN_POSITION, (note,))
        note = "the contact signal has no edge; r0 is where the laser starts to move"
        return _Event(kink, (note,))
    # Interference just before the contact looks like its bounce, or where it lasts long like a
    # contact; the laser distinguishes them.
    edges = [edge for change in made for edge in change.edges if not trace.contact[edge]]
    chosen, position = _confirmed_edge(record, edges, motion.forward, kink)
    notes = []
    if chosen != made[0].first:
        notes.append("an excursion of the contact signal before the tip moved was ignored")
    elif made[0].bounced:
        notes.append("the contact signal bounced; its first edge counts")
    return _compared_with_laser(position, kink, notes, "made")


def _contact_lost(record: _Record) -> _Event:
    """The loss of contact on the way back."""
    trace, motion = record.trace, record.motion
    kink = laser_kink(trace, motion.back, record.laser_after, record.laser_noise)
    lost = [
        change
        for change in record.contact
        if trace.contact[change.last] and change.last >= motion.standing.start
    ]
    if not lost:
        if kink is None:
            note = "contact is not lost within the trace, so r3 is unknown"
            return _Event(UNKNOWN_POSITION, (note,))
        note = "the contact signal has no edge on the way back; r3 is where the laser stops"
        return _Event(kink, (note,))
    _, position = _confirmed_edge(record, [change.last for change in lost], motion.back, kink)
    notes = []
    if len(lost) > 1:
        which = "the first" if kink is None else "the one where the laser stops"
        notes.append(f"contact was lost more than once on the way back; {which} counts")
    elif lost[0].bounced:
        notes.append("the contact signal bounced when it was lost; its last edge counts")
    return _compared_with_laser(position, kink, notes, "lost")


def _confirmed_edge(
    record: _Record, edges: list[int], moving: slice, kink: RulerPosition | None
) -> tuple[int, RulerPosition]:
    """The first edge that agrees with the laser; the first of all where none does."""
    positions = [ruler_at_edge(record.trace, edge, moving, record.motion.noise) for edge in edges]
    for edge, position in zip(edges, positions, strict=True):
        if kink is not None and abs(position.value - kink.value) <= AGREEMENT:
            return edge, position
    return edges[0], positions[0]


def _compared_with_laser(
    position: RulerPosition, kink: RulerPosition | None, notes: list[str], what: str
) -> _Event:
    """The position of an edge; where the laser disagrees, u covers both positions."""
    if kink is None:
        note = f"the laser does not show where contact is {what}; only the signal does"
        return _Event(position, (*notes, note))
    distance = abs(kink.value - position.value)
    if distance <= AGREEMENT:
        return _Event(position, tuple(notes))
    note = (
        f"where contact is {what}, contact signal and laser differ by "
        f"{distance / MICROMETRE:.2f} µm; the signal counts, u covers both"
    )
    u = math.hypot(position.u, distance / math.sqrt(3.0))
    return _Event(RulerPosition(position.value, u), (*notes, note))
