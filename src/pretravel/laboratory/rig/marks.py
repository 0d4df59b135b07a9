"""Events of a rig trace that a person has moved."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from pretravel.base import MICROMETRE, PretravelError
from pretravel.laboratory.rig.events import wrong_order
from pretravel.laboratory.rig.signals import AGREEMENT
from pretravel.laboratory.rig.trace import RigTouch

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
        agreement. The stop r2 has no standard uncertainty. The tip's displacement up to the
        trigger is nan where r1 was moved: the laser was read at the old trigger. The notes state
        each event that was moved, and the order of the events as it is now.

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
    moved: list[str] = []
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
        if name != "r2":
            changes[f"u_{name}"] = _u_of_both(touch, name, place)
        moved.append(_note(name, old, place))
    if "r1" in changes:
        changes["tip_displacement"] = math.nan
    before = wrong_order(touch.r0, touch.r1)
    now = wrong_order(changes.get("r0", touch.r0), changes.get("r1", touch.r1))
    notes = (*(note for note in touch.notes if note not in before), *now, *moved)
    return replace(touch, **changes, notes=notes)  # type: ignore[arg-type]


def _u_of_both(touch: RigTouch, name: str, place: float) -> float:
    """Standard uncertainty that covers the determined and the new position. [mm]"""
    old = float(getattr(touch, name))
    if not math.isfinite(old):
        return AGREEMENT / math.sqrt(3.0)
    return math.hypot(getattr(touch, f"u_{name}"), abs(place - old) / math.sqrt(3.0))


def _note(name: str, old: float, place: float) -> str:
    if not math.isfinite(old):
        return f"{name} was set by hand"
    moved = f"{name} was moved by hand by {(place - old) / MICROMETRE:+.2f} µm"
    return moved if name == "r2" else f"{moved}; its u covers both positions"
