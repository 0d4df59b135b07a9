"""One touch on the Abbé rig: the recorded trace and the results of its evaluation."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, PretravelError, frozen
from pretravel.touches import step_of_readings

REFERENCE_TEMPERATURE = 20.0
"""Of dimensions (ISO 1). [°C]"""
LEAST_TRAVEL = 20.0 * MICROMETRE
"""A push rod that moves less than this does not make a touch. [mm]"""


@dataclass(frozen=True, eq=False)
class RigTrace:
    """The sampled signals of one touch on the calibration rig.

    Parameters
    ----------
    time : (n,) float
        [s]
    ruler : (n,) float
        Position of the push rod. [mm]
    laser : (n,) float
        Displacement of the tip. [mm]
    contact, trigger : (n,) bool
        Logic levels, True = high; both are high at rest.
    name : str
        Of the file, without its ending.
    comments : tuple of line and text
        Of the file.

    Raises
    ------
    PretravelError
        Too few samples, time that does not go forward, values that are not finite, a rod that
        does not move.
    """

    time: FloatArray
    ruler: FloatArray
    laser: FloatArray
    contact: BoolArray
    trigger: BoolArray
    name: str = "trace"
    comments: tuple[tuple[int, str], ...] = ()

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
        if np.ptp(self.ruler) < LEAST_TRAVEL:
            raise PretravelError(
                f"{self.name}: the push rod moves by {np.ptp(self.ruler) / MICROMETRE:.2f} µm "
                "only; is ruler_mm in mm?"
            )

    @property
    def interval(self) -> float:
        """Median time between samples. [s]"""
        return float(np.median(np.diff(self.time)))

    @cached_property
    def step(self) -> float:
        """The step in which the ruler is read; zero where none is seen. [mm]"""
        return step_of_readings(self.ruler)


@dataclass(frozen=True)
class RigTouch:
    """The results of one trace; nan for events that it does not show.

    Attributes
    ----------
    trace : str
    r0, r1, r2, r3 : float
        Ruler at first contact, at the trigger, where the rod stopped, and where contact
        was lost on the way back. [mm]
    u_r0, u_r1, u_r3 : float
        Standard uncertainties from sampling and the ruler's noise. [mm]
    tip_displacement : float
        By the laser, from rest to the trigger. [mm]
    zero_shift : float
        Laser at rest after the touch less before it: the shift of the tip's rest position. [mm]
    feed : float
        Speed of the rod at contact. [mm/min]
    notes : tuple of str
        Irregularities of the signals, as sentences.
    step : float
        Of the ruler, where the line through an edge can lie within one; otherwise zero. [mm]
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
    step: float = 0.0

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
        """Travel of the rod less that of the tip, up to the trigger: compression at their contact.

        In mm.
        """
        return self.pretravel - self.tip_displacement

    @property
    def u_pretravel(self) -> float:
        """Standard uncertainty of the pretravel. [mm]"""
        return math.hypot(self.u_r0, self.u_r1)


_NAMED = 3
OTHER_FEED = 0.1
"""Relative difference of speeds from traces that is none of their scatter."""


def usual_feed(touches: Iterable[RigTouch]) -> float:
    """The feed of most traces; nan where none shows one. [mm/min]

    One of two halves, not the value between them.
    """
    known = sorted(touch.feed for touch in touches if math.isfinite(touch.feed))
    return known[len(known) // 2] if known else math.nan


def notes_of_touches(touches: Iterable[RigTouch]) -> list[str]:
    """The irregularities of touches, each with its traces: one sentence for those that are alike.

    Parameters
    ----------
    touches : iterable of RigTouch
        One at another feed than most is irregular, too.
    """
    touches = list(touches)
    usual = usual_feed(touches)
    traces: dict[str, list[str]] = {}
    for touch in touches:
        for note in touch.notes:
            traces.setdefault(note, []).append(touch.trace)
        if abs(touch.feed - usual) > OTHER_FEED * usual:
            note = (
                f"touched at {touch.feed:.3g} mm/min, most traces at {usual:.3g}: feed × "
                "signal delay is in the pretravel, and looks like scatter or like a direction's own"
            )
            traces.setdefault(note, []).append(touch.trace)
    return [
        f"{', '.join(names[:_NAMED])}"
        + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
        + f": {note}"
        for note, names in traces.items()
    ]


def at_reference_temperature(trace: RigTrace, temperature: float, expansion: float) -> RigTrace:
    """The trace with the ruler readings that correspond to 20 °C.

    Parameters
    ----------
    trace : RigTrace
    temperature : float
        Of the ruler. [°C]
    expansion : float
        Coefficient of thermal expansion of the ruler. [1/K]

    Notes
    -----
    The paper subtracts alpha ΔT L0. But an expanded ruler shows too few divisions, so that
    the length is L0 (1 + alpha ΔT). The difference is 0.08 nm for 5 µm at 1 K.

    References
    ----------
    Ren 2020, equation 16, its sign corrected.
    """
    expanded = 1.0 + expansion * (temperature - REFERENCE_TEMPERATURE)
    return trace if expanded == 1.0 else replace(trace, ruler=trace.ruler * expanded)


_ROOM = (5.0, 45.0)
"""Temperatures of a rig. [°C]"""
_SMALLEST_EXPANSION = 1e-3
"""Of a ruler that expands: Zerodur has 0.01. [1e-6/K]"""


def doubts_of_ruler(temperature: float, expansion: float) -> tuple[str, ...]:
    """Sentences on a temperature [°C] and an expansion [1e-6/K] of the ruler of another unit.

    >>> doubts_of_ruler(68.0, 8.0)
    ('the ruler is taken to be at 68 °C: was 68 °F, 20 °C, meant?',)
    """
    found = []
    if not _ROOM[0] <= temperature <= _ROOM[1]:
        celsius = (temperature - 32.0) / 1.8
        meant = f": was {temperature:g} °F, {celsius:.3g} °C, meant?"
        unit = meant if _ROOM[0] <= celsius <= _ROOM[1] else ", which no room has"
        found.append(f"the ruler is taken to be at {temperature:g} °C{unit}")
    if 0.0 < expansion < _SMALLEST_EXPANSION:
        found.append(
            f"the expansion of the ruler is taken as {expansion:g} · 1e-6/K, and that of glass is "
            "8 · 1e-6/K: was 1/K meant?"
        )
    return tuple(found)
