"""The Abbé rig: from traces of push rod, laser and signals to what happened in one touch."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.errors import PretravelError
from pretravel.units import MICROMETRE

SETTLED = 10e-3
"""A signal that keeps its level for this long has settled; shorter changes are bounce or
interference. [s]"""
REFERENCE_TEMPERATURE = 20.0
"""Of dimensions (ISO 1). [°C]"""
_LINE = 15
"""Samples on either side of an edge through which the ruler's line is laid."""
_LEAST_TRAVEL = 20.0 * MICROMETRE
"""A push rod that moves less than this does not make a touch. [mm]"""
AGREEMENT = 0.3 * MICROMETRE
"""Contact signal and laser may place a contact this far apart before it is said. [mm]"""
_KINK = 3.0 * MICROMETRE
"""Of the laser's travel, from where its line is drawn back to the start of its motion. [mm]"""


@dataclass(frozen=True, eq=False)
class RigTrace:
    """One touch on the calibration rig, sampled.

    Parameters
    ----------
    time : (n,) float
        [s]
    ruler : (n,) float
        Push rod. [mm]
    laser : (n,) float
        Displacement of the tip. [mm]
    contact, trigger : (n,) bool
        Logic levels, True = high; both high at rest.
    name : str

    Raises
    ------
    PretravelError
        Too short, time that does not go forward, values that are not finite, a rod that
        does not go out and back.
    """

    time: FloatArray
    ruler: FloatArray
    laser: FloatArray
    contact: BoolArray
    trigger: BoolArray
    name: str = "trace"

    def __post_init__(self) -> None:
        for key in ("time", "ruler", "laser"):
            values = frozen(getattr(self, key))
            if not np.all(np.isfinite(values)):
                raise PretravelError(f"{self.name}: {key} is not finite in every row")
            object.__setattr__(self, key, values)
        for key in ("contact", "trigger"):
            object.__setattr__(self, key, np.array(getattr(self, key), dtype=bool))
        if len(self.time) < 100:
            raise PretravelError(
                f"{self.name}: {len(self.time)} samples are too few for a touch on the rig"
            )
        if np.any(np.diff(self.time) <= 0.0):
            row = int(np.argmax(np.diff(self.time) <= 0.0)) + 1
            raise PretravelError(
                f"{self.name}: time does not go forward at sample {row + 1} "
                f"({self.time[row]:g} s after {self.time[row - 1]:g} s)"
            )
        if np.ptp(self.ruler) < _LEAST_TRAVEL:
            raise PretravelError(
                f"{self.name}: the push rod moves {np.ptp(self.ruler) / MICROMETRE:.2f} µm in all; "
                "is ruler_mm in mm?"
            )

    @property
    def interval(self) -> float:
        """Usual time between samples. [s]"""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True)
class RigTouch:
    """What one trace says; nan where it does not.

    Attributes
    ----------
    trace : str
    r0, r1, r2, r3 : float
        Ruler at first contact, at the trigger, where the rod stopped, and where contact
        was lost on the way back. [mm]
    u_r0, u_r1, u_r3 : float
        Standard uncertainties from sampling and the ruler's noise. [mm]
    tip_displacement : float
        Laser, from before contact to the trigger. [mm]
    zero_shift : float
        Laser after the touch less before: where the tip came to rest. [mm]
    feed : float
        Speed of the rod at contact. [mm/min]
    notes : tuple of str
        What was odd, as sentences.
    """

    trace: str
    r0: float
    r1: float
    r2: float
    r3: float
    u_r0: float
    u_r1: float
    u_r3: float
    tip_displacement: float
    zero_shift: float
    feed: float
    notes: tuple[str, ...]

    @property
    def pretravel(self) -> float:
        """R1 - r0 (Ren 2020, equation 2). [mm]"""
        return self.r1 - self.r0

    @property
    def hysteresis(self) -> float:
        """R3 - r0, drift of the zero position (Ren 2020, equation 3). [mm]"""
        return self.r3 - self.r0

    @property
    def tip_compression(self) -> float:
        """Rod's travel less the tip's, up to the trigger: what their contact gave. [mm]"""
        return self.pretravel - self.tip_displacement

    @property
    def u_pretravel(self) -> float:
        """[mm]"""
        return math.hypot(self.u_r0, self.u_r1)


@dataclass(frozen=True)
class _Change:
    """A change of level, its bounce included: samples before the first and after the last edge."""

    first: int
    last: int
    edges: tuple[int, ...]  # indices of all samples that start a run in between


def _changes(level: BoolArray, time: FloatArray) -> tuple[list[_Change], int]:
    """Settled changes of a signal in order, and how many short excursions came to nothing."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(level)) + 1])
    ends = np.concatenate([starts[1:], [len(level)]])
    step = float(np.median(np.diff(time)))
    settled = time[ends - 1] + step - time[starts] >= SETTLED - 1e-9
    # The record's first and last run are cut off; what they were cannot have been short.
    settled[[0, -1]] = True
    found, glitches, previous = [], 0, 0
    for run in np.flatnonzero(settled)[1:].tolist():
        if level[starts[run]] != level[starts[previous]]:
            edges = tuple(int(s) for s in starts[previous + 1 : run + 1])
            found.append(_Change(edges[0], edges[-1], edges))
        else:
            glitches += (run - previous) // 2
        previous = run
    return found, glitches


@dataclass(frozen=True, eq=False)
class _Motion:
    """Where the rod goes forward, stands, and goes back."""

    forward: slice
    standing: slice
    back: slice
    speed: float  # forward, mm/s


def _motion(trace: RigTrace) -> _Motion:
    from scipy.ndimage import median_filter, uniform_filter1d

    width = max(round(SETTLED / trace.interval), 5) | 1
    smooth = uniform_filter1d(median_filter(trace.ruler, 5), width)
    velocity = np.gradient(smooth, trace.time)
    top = int(np.argmax(smooth))
    rising = velocity[:top][velocity[:top] > 0.0]
    if top < width or not len(rising):
        raise PretravelError(
            f"{trace.name}: the push rod does not go forward (it is farthest out at sample "
            f"{top + 1} of {len(smooth)}); ruler_mm must grow towards the probe"
        )
    speed = float(np.median(rising))
    still = np.abs(velocity) < 0.1 * speed
    first = last = top
    while first > 0 and still[first - 1]:
        first -= 1
    while last < len(smooth) - 1 and still[last + 1]:
        last += 1
    back_end = last + 1
    while back_end < len(smooth) - 1 and velocity[back_end] < -0.1 * speed:
        back_end += 1
    forward_start = first
    while forward_start > 0 and velocity[forward_start - 1] > 0.1 * speed:
        forward_start -= 1
    return _Motion(
        slice(forward_start, first), slice(first, last + 1), slice(last + 1, back_end), speed
    )


def _at_edge(trace: RigTrace, edge: int, moving: slice) -> tuple[float, float]:
    """Ruler between the samples where a level changed, and its standard uncertainty."""
    low = max(edge - _LINE, moving.start)
    high = min(edge + _LINE, moving.stop)
    if high - low < 4:  # just where the rod starts or stops: the samples themselves
        pair = trace.ruler[edge - 1 : edge + 1]
        return float(pair.mean()), float(np.ptp(pair)) / math.sqrt(12.0)
    when = 0.5 * (trace.time[edge - 1] + trace.time[edge])
    t, r = trace.time[low:high] - when, trace.ruler[low:high]
    design = np.stack([np.ones_like(t), t], axis=1)
    solution = np.linalg.lstsq(design, r, rcond=None)[0]
    dof = max(len(t) - 2, 1)
    scatter = float(np.sum((r - design @ solution) ** 2)) / dof
    cofactor = float(np.linalg.inv(design.T @ design)[0, 0])
    # The edge lies anywhere between its two samples: a rectangle.
    gap = abs(float(solution[1])) * float(trace.time[edge] - trace.time[edge - 1])
    return float(solution[0]), math.sqrt(scatter * cofactor + gap**2 / 12.0)


def _kink(trace: RigTrace, moving: slice, rest: float, noise: float) -> tuple[float, float] | None:
    """Ruler where the laser starts (or ends) to move, from lines on either side."""
    r, away = trace.ruler[moving], trace.laser[moving] - rest
    moved = (away > max(10.0 * noise, 0.1 * MICROMETRE)) & (away < _KINK)
    if np.sum(moved) < 5:
        return None
    # Ruler against laser: the ruler's noise is the larger one.
    design = np.stack([np.ones(int(moved.sum())), away[moved]], axis=1)
    solution = np.linalg.lstsq(design, r[moved], rcond=None)[0]
    if not 0.5 < solution[1] < 3.0:  # the rod pushes the tip: their travels are alike
        return None
    scatter = float(np.sum((r[moved] - design @ solution) ** 2)) / (len(design) - 2)
    cofactor = float(np.linalg.inv(design.T @ design)[0, 0])
    return float(solution[0]), math.sqrt(scatter * cofactor)


def rig_touch(trace: RigTrace) -> RigTouch:
    """The events of one touch on the rig.

    Parameters
    ----------
    trace : RigTrace

    Returns
    -------
    RigTouch
        With nan for events that the trace does not show, and notes that say so.

    Raises
    ------
    PretravelError
        A rod that does not go forward.

    Notes
    -----
    A change of level counts once it has held for `SETTLED`; it is dated by its first
    edge (contact lost: by its last), so bounce does not shift it. Shorter excursions are
    interference and are counted in the notes. At each edge the ruler is that of a line
    through its neighbours, half-way between the two samples. The laser sees the tip start
    to move: it confirms the contact signal, and stands in for it where an edge is missing.

    References
    ----------
    Ren 2020, section 2.2 and equations 2 to 4.
    """
    motion = _motion(trace)
    notes: list[str] = []
    contact, contact_glitches = _changes(trace.contact, trace.time)
    trigger, trigger_glitches = _changes(trace.trigger, trace.time)
    for name, count in (("contact", contact_glitches), ("trigger", trigger_glitches)):
        if count:
            notes.append(f"{count} short excursion{'s' * (count > 1)} of the {name} signal ignored")
    before = trace.laser[: max(motion.forward.start + 20, 20)]
    if contact:
        before = trace.laser[: max(contact[0].first - 1, 5)]
    rest = float(np.median(before))
    noise = 1.4826 * float(np.median(np.abs(before - rest)))
    after = float(np.median(trace.laser[-max(len(trace.laser) // 20, 10) :]))

    r0, u_r0 = _contact_made(trace, motion, contact, rest, noise, notes)
    r1, u_r1, displacement = math.nan, math.nan, math.nan
    fired = [c for c in trigger if not trace.trigger[c.last] and c.first < motion.standing.stop]
    if not fired:
        level = "never changes" if not trigger else "changes only on the way back"
        notes.append(f"no trigger: the signal {level}, so r1 is unknown")
    else:
        edge = fired[0].first
        r1, u_r1 = _at_edge(trace, edge, motion.forward)
        displacement = _laser_at(trace, edge, motion.forward) - rest
        if len(fired) > 1:
            notes.append(f"the trigger signal fell {len(fired)} times on the way; the first counts")
        if fired[0].first != fired[0].last:
            notes.append("the trigger signal bounced; its first edge counts")
    r3, u_r3 = _contact_lost(trace, motion, contact, after, noise, notes)
    if r1 < r0:
        notes.append("the trigger comes before the contact: check the signals' wiring")
    return RigTouch(
        trace=trace.name,
        r0=r0,
        r1=r1,
        r2=float(np.median(trace.ruler[motion.standing])),
        r3=r3,
        u_r0=u_r0,
        u_r1=u_r1,
        u_r3=u_r3,
        tip_displacement=displacement,
        zero_shift=after - rest,
        feed=motion.speed * 60.0,
        notes=tuple(notes),
    )


def _laser_at(trace: RigTrace, edge: int, moving: slice) -> float:
    low, high = max(edge - _LINE, moving.start), min(edge + _LINE, moving.stop)
    if high - low < 4:
        return float(trace.laser[edge])
    when = 0.5 * (trace.time[edge - 1] + trace.time[edge])
    return float(np.polyfit(trace.time[low:high] - when, trace.laser[low:high], 1)[1])


def _contact_made(
    trace: RigTrace,
    motion: _Motion,
    changes: list[_Change],
    rest: float,
    noise: float,
    notes: list[str],
) -> tuple[float, float]:
    kink = _kink(trace, motion.forward, rest, noise)
    made = [c for c in changes if not trace.contact[c.last] and c.first < motion.standing.stop]
    if not made:
        if kink is None:
            notes.append("no contact: neither the signal nor the laser shows one")
            return math.nan, math.nan
        notes.append("the contact signal has no edge; r0 is where the laser starts to move")
        return kink
    change = made[0]
    if change.first != change.last:
        notes.append("the contact signal bounced; its first edge counts")
    edge = change.first
    value, u = _at_edge(trace, edge, motion.forward)
    if kink is not None and kink[0] - value > AGREEMENT and len(change.edges) > 1:
        # Interference just ahead of the contact looks like its bounce; the laser knows better.
        for later in change.edges:
            candidate = _at_edge(trace, later, motion.forward)
            if not trace.contact[later] and abs(candidate[0] - kink[0]) <= AGREEMENT:
                notes.append("an excursion of the contact signal before the tip moved was ignored")
                return candidate
    if kink is not None and abs(kink[0] - value) > AGREEMENT:
        notes.append(
            f"contact signal and laser place the contact {abs(kink[0] - value) / MICROMETRE:.2f} "
            "µm apart; the signal counts"
        )
    return value, u


def _contact_lost(
    trace: RigTrace,
    motion: _Motion,
    changes: list[_Change],
    after: float,
    noise: float,
    notes: list[str],
) -> tuple[float, float]:
    lost = [c for c in changes if trace.contact[c.last] and c.last >= motion.standing.start]
    if lost:
        if lost[-1].first != lost[-1].last:
            notes.append("the contact signal bounced when it was lost; its last edge counts")
        return _at_edge(trace, lost[-1].last, motion.back)
    kink = _kink(trace, motion.back, after, noise)
    if kink is None:
        notes.append("contact is not lost within the trace, so r3 is unknown")
        return math.nan, math.nan
    notes.append("the contact signal has no edge on the way back; r3 is where the laser stops")
    return kink


def warmed(trace: RigTrace, temperature: float, expansion: float) -> RigTrace:
    """The trace with its ruler as it would read at 20 °C.

    Parameters
    ----------
    trace : RigTrace
    temperature : float
        Of the ruler. [°C]
    expansion : float
        Its coefficient of thermal expansion. [1/K]

    Returns
    -------
    RigTrace

    Notes
    -----
    The paper takes alpha ΔT L0 off; but a ruler that has grown shows too few divisions, so
    the length measured is L0 (1 + alpha ΔT). Either is 0.04 nm on 5 um at 1 K.

    References
    ----------
    Ren 2020, equation 16, its sign corrected.
    """
    grown = 1.0 + expansion * (temperature - REFERENCE_TEMPERATURE)
    return trace if grown == 1.0 else replace(trace, ruler=trace.ruler * grown)
