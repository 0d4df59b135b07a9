"""Events in the signals of a rig trace: changes of level, phases of motion, kinks of the laser."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, PretravelError
from pretravel.laboratory.rig.trace import LEAST_TRAVEL, RigTrace

SETTLED = 10e-3
"""A signal that keeps its level for this long has settled; shorter changes are bounce or
interference. [s]"""
AGREEMENT = 0.3 * MICROMETRE
"""Largest distance between a contact by its signal and by the laser, without a note. [mm]"""
_EDGE_SAMPLES = 15  # on either side of an edge, for the line through the ruler readings
_KINK_TRAVEL = 3.0 * MICROMETRE  # of the laser, for the line back to the start of its motion
LARGEST_RATIO = 3.0
"""Of the laser's travel and the rod's after the contact."""
LEAST_PUSH = 3.0 * MICROMETRE
"""Travel of the rod after the contact that shows their ratio. [mm]"""
_NORMAL = 1.4826  # standard deviation over median absolute deviation of a normal distribution


@dataclass(frozen=True)
class RulerPosition:
    """A position of the rod; nan where it is unknown.

    Attributes
    ----------
    value : float
        [mm]
    u : float
        Standard uncertainty. [mm]
    """

    value: float
    u: float


UNKNOWN_POSITION = RulerPosition(math.nan, math.nan)


@dataclass(frozen=True)
class LevelChange:
    """A change of level with its bounce.

    Attributes
    ----------
    first, last : int
        Samples after the first and after the last edge.
    edges : tuple of int
        Samples after all edges in between, both included.
    """

    first: int
    last: int
    edges: tuple[int, ...]

    @property
    def bounced(self) -> bool:
        """Whether there is more than one edge."""
        return self.first != self.last


def level_changes(level: BoolArray, time: FloatArray) -> tuple[list[LevelChange], int]:
    """Settled changes of a signal in order, and the number of ignored short excursions.

    >>> time = np.arange(100) * 1e-3
    >>> changes, ignored = level_changes(time < 0.05, time)
    >>> changes[0].first, ignored
    (50, 0)
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(level)) + 1])
    ends = np.concatenate([starts[1:], [len(level)]])
    step = float(np.median(np.diff(time)))
    settled = time[ends - 1] + step - time[starts] >= SETTLED - 1e-9
    # The record cuts off its first and last run; their true length is unknown.
    settled[[0, -1]] = True
    changes, excursions, previous = [], 0, 0
    for run in np.flatnonzero(settled)[1:].tolist():
        if level[starts[run]] != level[starts[previous]]:
            edges = tuple(int(s) for s in starts[previous + 1 : run + 1])
            changes.append(LevelChange(edges[0], edges[-1], edges))
        else:
            excursions += (run - previous) // 2
        previous = run
    return changes, excursions


@dataclass(frozen=True, eq=False)
class RodMotion:
    """The phases of the rod's motion.

    Attributes
    ----------
    forward, standing, back : slice
        Of samples.
    speed : float
        Forward. [mm/s]
    noise : float
        Standard deviation of the ruler readings. [mm]
    """

    forward: slice
    standing: slice
    back: slice
    speed: float
    noise: float


def rod_motion(trace: RigTrace) -> RodMotion:
    """The phases of the rod's motion, from the levels of the ruler readings.

    Velocities do not show them: at rest they consist of noise.

    Raises
    ------
    PretravelError
        A rod that does not go forward.
    """
    from scipy.ndimage import median_filter

    ruler = median_filter(trace.ruler, 5)
    # Second differences do not depend on position and speed.
    noise = _NORMAL * float(np.median(np.abs(np.diff(trace.ruler, 2)))) / math.sqrt(6.0)
    top = float(np.max(median_filter(trace.ruler, 9)))
    peak = int(np.argmax(ruler >= top - 1e-12))
    bottom = float(np.min(ruler[: peak + 1]))
    if top - bottom < LEAST_TRAVEL:
        raise PretravelError(
            f"{trace.name}: the push rod does not go forward (by {(top - bottom) / MICROMETRE:.3g} "
            f"µm only, and is farthest out at sample {peak + 1} of {len(ruler)}); the trace must "
            "begin before the contact, and ruler_mm must grow towards the probe"
        )
    speed = _forward_speed(trace, ruler[: peak + 1], bottom, top)
    near = 4.0 * noise + speed * trace.interval
    first, last = _run_around(ruler >= top - near, peak)
    started = int(np.flatnonzero(ruler[: first + 1] <= bottom + near)[-1])
    after = ruler[last + 1 :]
    lowest = float(np.min(after)) if len(after) else top
    ended = np.flatnonzero(after <= lowest + near)
    stop = last + 1 + (int(ended[0]) if len(ended) else 0)
    return RodMotion(
        slice(started, first), slice(first, last + 1), slice(last + 1, stop), speed, noise
    )


def _forward_speed(trace: RigTrace, ruler: FloatArray, bottom: float, top: float) -> float:
    """Speed over the middle of the way out. [mm/s]"""
    low, high = (bottom + share * (top - bottom) for share in (0.2, 0.8))
    left = int(np.flatnonzero(ruler <= low)[-1])
    right = left + int(np.argmax(ruler[left:] >= high))
    return float((ruler[right] - ruler[left]) / (trace.time[right] - trace.time[left]))


def _run_around(inside: BoolArray, place: int) -> tuple[int, int]:
    """First and last sample of the run of True around a place; short gaps are bridged."""
    from scipy.ndimage import binary_closing

    closed = binary_closing(inside, np.ones(7, dtype=bool), border_value=0) | inside
    outside = np.flatnonzero(~closed)
    before, after = outside[outside < place], outside[outside > place]
    return (
        int(before[-1]) + 1 if len(before) else 0,
        int(after[0]) - 1 if len(after) else len(inside) - 1,
    )


def coarse_step(trace: RigTrace, gap: float) -> float:
    """The step of the ruler where the line through an edge can lie within one; otherwise zero. [mm]

    Parameters
    ----------
    trace : RigTrace
    gap : float
        Travel between two samples. [mm]
    """
    return trace.step if trace.step > 2 * _EDGE_SAMPLES * gap else 0.0


def ruler_at_edge(trace: RigTrace, edge: int, moving: slice, noise: float) -> RulerPosition:
    """Ruler half-way between the two samples where a level changed.

    Parameters
    ----------
    trace : RigTrace
    edge : int
        The sample after the edge.
    moving : slice
        Samples between which the rod moves.
    noise : float
        Of the ruler. [mm]
    """
    low, high = max(edge - _EDGE_SAMPLES, moving.start), min(edge + _EDGE_SAMPLES, moving.stop)
    if edge - low < 3 or high - edge < 3:
        # Where the rod starts, stops or stands: the samples themselves.
        near = trace.ruler[max(edge - 2, 0) : edge + 2]
        step = abs(float(trace.ruler[edge] - trace.ruler[edge - 1]))
        step = max(step, coarse_step(trace, step))
        u = math.sqrt(noise**2 / len(near) + step**2 / 12.0)
        return RulerPosition(float(np.median(near)), u)
    when = 0.5 * (trace.time[edge - 1] + trace.time[edge])
    t, r = trace.time[low:high] - when, trace.ruler[low:high]
    kept = _without_spikes(t, r, noise)
    t, r = t[kept], r[kept]
    design = np.stack([np.ones_like(t), t], axis=1)
    solution = np.linalg.lstsq(design, r, rcond=None)[0]
    dof = max(len(t) - 2, 1)
    scatter = max(float(np.sum((r - design @ solution) ** 2)) / dof, noise**2)
    cofactor = float(np.linalg.inv(design.T @ design)[0, 0])
    # The edge lies anywhere between its two samples, or in the step of the ruler that contains the
    # line: a rectangular distribution.
    gap = abs(float(solution[1])) * float(trace.time[edge] - trace.time[edge - 1])
    gap = max(gap, coarse_step(trace, gap))
    return RulerPosition(float(solution[0]), math.sqrt(scatter * cofactor + gap**2 / 12.0))


def _without_spikes(t: FloatArray, r: FloatArray, noise: float) -> BoolArray:
    """Samples near the line through most of them; spikes of the ruler are far from it."""
    from scipy.stats import theilslopes

    slope, start = theilslopes(r, t)[:2]
    off = np.abs(r - (start + slope * t))
    spread = max(_NORMAL * float(np.median(off)), noise)
    return np.asarray(off <= 6.0 * spread) if spread > 0.0 else np.ones(len(t), dtype=bool)


def laser_at_edge(trace: RigTrace, edge: int, moving: slice) -> float:
    """Laser half-way between the two samples where a level changed. [mm]"""
    low, high = max(edge - _EDGE_SAMPLES, moving.start), min(edge + _EDGE_SAMPLES, moving.stop)
    if high - low < 4:
        return float(trace.laser[edge])
    when = 0.5 * (trace.time[edge - 1] + trace.time[edge])
    return float(np.polyfit(trace.time[low:high] - when, trace.laser[low:high], 1)[1])


def laser_kink(trace: RigTrace, moving: slice, rest: float, noise: float) -> RulerPosition | None:
    """Ruler where the laser starts (or ends) to move; None where the laser does not show it.

    Parameters
    ----------
    trace : RigTrace
    moving : slice
        Samples between which the rod moves.
    rest, noise : float
        Level of the laser at rest, and its standard deviation. [mm]
    """
    r, displacement = trace.ruler[moving], trace.laser[moving] - rest
    moved = (displacement > max(10.0 * noise, 0.1 * MICROMETRE)) & (displacement < _KINK_TRAVEL)
    if np.sum(moved) < 5:
        return None
    # The ruler by the laser, since the noise of the ruler is larger.
    design = np.stack([np.ones(int(moved.sum())), displacement[moved]], axis=1)
    solution = np.linalg.lstsq(design, r[moved], rcond=None)[0]
    if not 0.5 < solution[1] < 3.0:  # the rod pushes the tip, so that their travels are similar
        return None
    scatter = float(np.sum((r[moved] - design @ solution) ** 2)) / (len(design) - 2)
    cofactor = float(np.linalg.inv(design.T @ design)[0, 0])
    # The compression of tip and rod (Hertz) is nonlinear, so that the line misses the start by a
    # small distance.
    return RulerPosition(float(solution[0]), math.sqrt(scatter * cofactor + AGREEMENT**2 / 3.0))
