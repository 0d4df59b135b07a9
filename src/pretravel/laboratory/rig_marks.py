"""Events of a rig trace that a person has moved."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from pretravel.errors import PretravelError
from pretravel.laboratory.rig import RigTouch
from pretravel.laboratory.rig_signals import AGREEMENT
from pretravel.units import MICROMETRE

MARKS = ("r0", "r1", "r2", "r3")
"""The events: contact made, trigger, rod stopped, contact lost."""


def with_marks(touch: RigTouch, marks: Mapping[str, float]) -> RigTouch:
    """A touch with events where a person sees them.

    Parameters
    ----------
    touch : RigTouch
    marks : mapping of str to float
        Ruler at r0, r1, r2 or r3; others stay as they were determined. [mm]

    Returns
    -------
    RigTouch
        The standard uncertainty of a moved event covers the old and the new position, as where
        contact signal and laser differ; of one that the trace does not show it is that of their
        agreement. Its notes state each event that was moved.

    Raises
    ------
    PretravelError
        An event of another name; a position that is not finite.

    >>> touch = RigTouch("rig_000_1", 1.0, 1.01, 1.02, 1.0, 1e-5, 1e-5, 1e-5, 0.01, 0.0, 1.0, ())
    >>> moved = with_marks(touch, {"r0": 1.002})
    >>> round(moved.pretravel, 6), moved.notes
    (0.008, ('r0 was moved by hand by +2.00 µm; its u covers both positions',))
    """
    changes: dict[str, float] = {}
    notes = list(touch.notes)
    for name, place in marks.items():
        if name not in MARKS or not math.isfinite(place):
            raise PretravelError(
                f"{touch.trace}: a mark is {', '.join(MARKS)} with a position in mm, not "
                f"{name} = {place}",
                inputs=("mark",),
            )
        old = float(getattr(touch, name))
        if place == old:
            continue
        changes[name] = place
        known = math.isfinite(old)
        moved = (place - old) / MICROMETRE
        notes.append(
            f"{name} was moved by hand by {moved:+.2f} µm; its u covers both positions"
            if known
            else f"{name} was set by hand"
        )
        if name == "r2":
            continue
        distance = abs(place - old) if known else AGREEMENT
        before = float(getattr(touch, f"u_{name}")) if known else 0.0
        changes[f"u_{name}"] = math.hypot(before, distance / math.sqrt(3.0))
    return replace(touch, **changes, notes=tuple(notes))  # type: ignore[arg-type]
