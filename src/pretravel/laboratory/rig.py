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
    noise: float  # of the ruler, mm


def _motion(trace: RigTrace) -> _Motion:
    from scipy.ndimage import median_filter

    # Levels, not velocities, tell the phases: at rest noise is all the velocity there is.
    ruler = median_filter(trace.ruler, 5)
    # Second differences know neither place nor speed.
    noise = 1.4826 * float(np.median(np.abs(np.diff(trace.ruler, 2)))) / math.sqrt(6.0)
    top = float(np.max(median_filter(trace.ruler, 9)))
    peak = int(np.argmax(ruler >= top - 1e-12))
    bottom = float(np.min(ruler[: peak + 1]))
    if top - bottom < _LEAST_TRAVEL:
        raise PretravelError(
            f"{trace.name}: the push rod does not go forward (it is farthest out at sample "
            f"{peak + 1} of {len(ruler)}); ruler_mm must grow towards the probe"
        )
    # Speed from displacement, over the middle of the way out.
    low, high = (bottom + share * (top - bottom) for share in (0.2, 0.8))
    left = int(np.flatnonzero(ruler[: peak + 1] <= low)[-1])
    right = left + int(np.argmax(ruler[left : peak + 1] >= high))
    speed = (ruler[right] - ruler[left]) / (trace.time[right] - trace.time[left])
    near = 4.0 * noise + speed * trace.interval
    first, last = _around(ruler >= top - near, peak)
    started = int(np.flatnonzero(ruler[: first + 1] <= bottom + near)[-1])
    after = ruler[last + 1 :]
    settled = float(np.min(after)) if len(after) else top
    ended = np.flatnonzero(after <= settled + near)
    stop = last + 1 + (int(ended[0]) if len(ended) else 0)
    return _Motion(
        slice(started, first), slice(first, last + 1), slice(last + 1, stop), float(speed), noise
    )


def _around(inside: BoolArray, place: int) -> tuple[int, int]:
    """First and last sample of the run of True that holds a place, short gaps bridged."""
    from scipy.ndimage import binary_closing

    closed = binary_closing(inside, np.ones(7, dtype=bool), border_value=0) | inside
    outside = np.flatnonzero(~closed)
    before, after = outside[outside < place], outside[outside > place]
    return (
        int(before[-1]) + 1 if len(before) else 0,
        int(after[0]) - 1 if len(after) else len(inside) - 1,
    )


def _at_edge(trace: RigTrace, edge: int, moving: slice, noise: float) -> tuple[float, float]:
    """Ruler between the samples where a level changed, and its standard uncertainty."""
    gap_time = float(trace.time[edge] - trace.time[edge - 1])
    low, high = max(edge - _LINE, moving.start), min(edge + _LINE, moving.stop)
    if edge - low < 3 or high - edge < 3:
        # Where the rod starts, stops or stands: the samples themselves.
        near = trace.ruler[max(edge - 2, 0) : edge + 2]
        step = abs(float(trace.ruler[edge] - trace.ruler[edge - 1]))
        return float(np.median(near)), math.sqrt(noise**2 / len(near) + step**2 / 12.0)
    when = 0.5 * (trace.time[edge - 1] + trace.time[edge])
    t, r = trace.time[low:high] - when, trace.ruler[low:high]
    kept = _on_a_line(t, r, noise)
    t, r = t[kept], r[kept]
    design = np.stack([np.ones_like(t), t], axis=1)
    solution = np.linalg.lstsq(design, r, rcond=None)[0]
    dof = max(len(t) - 2, 1)
    scatter = max(float(np.sum((r - design @ solution) ** 2)) / dof, noise**2)
    cofactor = float(np.linalg.inv(design.T @ design)[0, 0])
    # The edge lies anywhere between its two samples: a rectangle.
    gap = abs(float(solution[1])) * gap_time
    return float(solution[0]), math.sqrt(scatter * cofactor + gap**2 / 12.0)


def _on_a_line(t: FloatArray, r: FloatArray, noise: float) -> BoolArray:
    """Samples that lie on the line of most of them: spikes of the ruler do not."""
    from scipy.stats import theilslopes

    slope, start = theilslopes(r, t)[:2]
    off = np.abs(r - (start + slope * t))
    spread = max(1.4826 * float(np.median(off)), noise)
    return np.asarray(off <= 6.0 * spread) if spread > 0.0 else np.ones(len(t), dtype=bool)


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
    # Tip and rod are compressed least at first (Hertz), so the line misses the start a little.
    return float(solution[0]), math.sqrt(scatter * cofactor + AGREEMENT**2 / 3.0)


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

    for name, level in (("contact", trace.contact), ("trigger", trace.trigger)):
        if not level[:20].any():
            notes.append(f"the {name} signal is low at rest; high was expected: is it inverted?")
    r0, u_r0 = _contact_made(trace, motion, contact, rest, noise, notes)
    r1, u_r1, displacement = math.nan, math.nan, math.nan
    fired = [c for c in trigger if not trace.trigger[c.last] and c.first < motion.standing.stop]
    if not fired:
        what = "never changes" if not trigger else "changes only on the way back"
        notes.append(f"no trigger: the signal {what}, so r1 is unknown")
    else:
        edge = fired[0].first
        r1, u_r1 = _at_edge(trace, edge, motion.forward, motion.noise)
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
    # Interference just ahead of the contact looks like its bounce, and long enough like a
    # contact; the laser knows better.
    edges = [edge for change in made for edge in change.edges if not trace.contact[edge]]
    chosen = _agreeing(trace, edges, motion.forward, motion.noise, kink)
    if chosen != made[0].first:
        notes.append("an excursion of the contact signal before the tip moved was ignored")
    elif made[0].first != made[0].last:
        notes.append("the contact signal bounced; its first edge counts")
    return _with_laser(_at_edge(trace, chosen, motion.forward, motion.noise), kink, notes, "made")


def _contact_lost(
    trace: RigTrace,
    motion: _Motion,
    changes: list[_Change],
    after: float,
    noise: float,
    notes: list[str],
) -> tuple[float, float]:
    kink = _kink(trace, motion.back, after, noise)
    lost = [c for c in changes if trace.contact[c.last] and c.last >= motion.standing.start]
    if not lost:
        if kink is None:
            notes.append("contact is not lost within the trace, so r3 is unknown")
            return math.nan, math.nan
        notes.append("the contact signal has no edge on the way back; r3 is where the laser stops")
        return kink
    chosen = _agreeing(trace, [c.last for c in lost], motion.back, motion.noise, kink)
    if len(lost) > 1:
        which = "the first" if kink is None else "the one where the laser stops"
        notes.append(f"contact was lost more than once on the way back; {which} counts")
    elif lost[0].first != lost[0].last:
        notes.append("the contact signal bounced when it was lost; its last edge counts")
    return _with_laser(_at_edge(trace, chosen, motion.back, motion.noise), kink, notes, "lost")


def _agreeing(
    trace: RigTrace,
    edges: list[int],
    moving: slice,
    noise: float,
    kink: tuple[float, float] | None,
) -> int:
    """The first edge, unless the laser speaks against it and for a later one."""
    if kink is None:
        return edges[0]
    off = [abs(_at_edge(trace, edge, moving, noise)[0] - kink[0]) for edge in edges]
    return edges[0] if off[0] <= AGREEMENT or min(off) > AGREEMENT else edges[
        int(np.argmax(np.array(off) <= AGREEMENT))
    ]  # fmt: skip


def _with_laser(
    seen: tuple[float, float], kink: tuple[float, float] | None, notes: list[str], what: str
) -> tuple[float, float]:
    """Signal and laser held together; where they part, u spans both."""
    if kink is None:
        notes.append(f"the laser does not show where contact is {what}; the signal stands alone")
        return seen
    apart = abs(kink[0] - seen[0])
    if apart <= AGREEMENT:
        return seen
    notes.append(
        f"contact signal and laser place where contact is {what} {apart / MICROMETRE:.2f} µm "
        "apart; the signal counts, u spans both"
    )
    return seen[0], math.hypot(seen[1], apart / math.sqrt(3.0))


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
