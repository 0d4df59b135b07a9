"""The record of a slide: the state at each step, from first contact to the trigger."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray, frozen
from pretravel.design.probing.tip import PredictedTip
from pretravel.surface import LocalGeometry


@dataclass(frozen=True, eq=False)
class SlideHistory:
    """The state at each of k steps.

    Attributes
    ----------
    step : (k,) int
        From 1; in a golden section search the number of the trial.
    feed : (k,) float
        Travel of the spindle along the approach since first contact. [mm]
    deflection : (k,) float
        Of the stylus; with lateral kinematics perpendicular to the probe axis. [mm]
    spindle : (k, 3) float
        P, the place of the tip's centre with a straight stylus. [mm]
    center : (k, 3) float
        C, the tip's centre. [mm]
    contact : (k, 3) float
        T, the touching point. [mm]
    normal : (k, 3) float
        Of the surface at T.
    force : (k,) float
        Not a number after the trigger, where a seat is open. [N]
    reactions : (k, 6) float
        Of the seats; not numbers after the trigger. [N]
    penetration : (k, 6) float
        Approach of rod and ball of each seat, by Hertz's law; zero for rigid seats, not numbers
        after the trigger. [mm]
    open_seat : (k,) int
        Of six the seat that is open; -1 before the trigger, where all are closed.
    triggered : (k,) bool
    trigger_feed : float
        Feed at the trigger, between two steps, or at the end of the search; not a number where
        the probe does not trigger. [mm]
    start : (3,) float
        Point of first contact. [mm]
    search : str
        ``steps`` or ``golden``.
    applied : (k,) float
        On an inclined face the force that was applied or tried, after the trigger too; not numbers
        where the deflection or the feed is raised. [N]
    """

    step: IntArray
    feed: FloatArray
    deflection: FloatArray
    spindle: FloatArray
    center: FloatArray
    contact: FloatArray
    normal: FloatArray
    force: FloatArray
    reactions: FloatArray
    penetration: FloatArray
    open_seat: IntArray
    triggered: BoolArray
    trigger_feed: float
    start: FloatArray
    search: str
    applied: FloatArray

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray) and value.dtype == np.float64:
                object.__setattr__(self, entry.name, frozen(value))

    def __len__(self) -> int:
        return len(self.step)


@dataclass(frozen=True, eq=False)
class SlideStep:
    """One step; the meaning of the values is that of `SlideHistory`.

    Attributes
    ----------
    feed, deflection, force : float
    spindle, center : (3,) float
    local : LocalGeometry
        Of the surface at the contact, one row.
    triggered : bool
    applied : float
    """

    feed: float
    deflection: float
    spindle: FloatArray
    center: FloatArray
    local: LocalGeometry
    force: float
    triggered: bool
    applied: float = math.nan


def slide_history(
    tip: PredictedTip,
    steps: list[SlideStep],
    first: LocalGeometry,
    trigger_feed: float,
    search: str = "steps",
) -> SlideHistory:
    """The history of a slide from its steps.

    Parameters
    ----------
    tip : PredictedTip
    steps : list of SlideStep
    first : LocalGeometry
        Of the surface at first contact, one row.
    trigger_feed, search
        As in `SlideHistory`.
    """
    normal = np.concatenate([step.local.normal for step in steps])
    force = np.array([step.force for step in steps])
    # The force of a step is along the normal of the step before.
    direction = np.concatenate([first.normal, normal[:-1]])
    triggered = np.array([step.triggered for step in steps])
    reactions = tip.response.reactions(direction @ tip.rotation, force)
    _, opens = tip.response.force(direction @ tip.rotation)
    return SlideHistory(
        step=np.arange(1, len(steps) + 1),
        feed=np.array([step.feed for step in steps]),
        deflection=np.array([step.deflection for step in steps]),
        spindle=np.array([step.spindle for step in steps]),
        center=np.array([step.center for step in steps]),
        contact=np.concatenate([step.local.point for step in steps]),
        normal=normal,
        force=force,
        reactions=reactions,
        # Johnson, equations 4.26; a seat that carries nothing is not pressed in.
        penetration=tip.response.seat_coefficient * np.cbrt(np.maximum(reactions, 0.0) ** 2),
        open_seat=np.where(triggered, opens, -1),
        triggered=triggered,
        trigger_feed=trigger_feed,
        start=first.point[0],
        search=search,
        applied=np.array([step.applied for step in steps]),
    )
