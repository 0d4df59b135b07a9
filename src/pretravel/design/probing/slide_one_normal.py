"""A slide with one normal throughout: on a wall, or on an inclined plane.

Deflection or force is raised in steps, or its value at the trigger is searched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import ConvergenceError, FloatArray
from pretravel.design.probing.slide_history import SlideHistory, SlideStep, slide_history
from pretravel.design.probing.tip import LateralTip, PredictedTip
from pretravel.surface import LocalGeometry

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_LARGEST_FORCE = 5.0
"""Upper bound of the thesis's golden section search. [N]"""


def stepped_slide(
    tip: PredictedTip, first: LocalGeometry, step: float, steps: int, *, by_force: bool
) -> SlideHistory:
    """Raise deflection or force in steps, by sections 3.2 and 3.3 of the thesis.

    Parameters
    ----------
    tip : PredictedTip
    first : LocalGeometry
        Of the surface at first contact, one row.
    step : float
        Of the deflection [mm] or of the force [N].
    steps : int
    by_force : bool
        Whether the force is raised.
    """
    process = _OneNormal.of(tip, first, by_force=by_force)
    values = np.asarray(step * np.arange(1, steps + 1), dtype=np.float64)
    event = process.limit * process.slope if values[-1] >= process.goal else math.nan
    return slide_history(tip, process.record(values), first, event)


def golden_section_slide(
    tip: PredictedTip, first: LocalGeometry, step: float, steps: int, *, by_force: bool
) -> SlideHistory:
    """Search the deflection or force at the trigger by golden section.

    Parameters
    ----------
    tip, first, by_force
        As for `stepped_slide`.
    step : float
        Of the deflection; the search ends at step times steps. A force is searched up to 5 N. [mm]
    steps : int
        Largest number of trials.

    Raises
    ------
    ConvergenceError
        No trigger within the range of the search.
    """
    process = _OneNormal.of(tip, first, by_force=by_force)
    highest = _LARGEST_FORCE if by_force else step * steps
    values, end = _golden_section(process.goal, highest, steps)
    # The search ends a little above the trigger: the difference is its own error.
    event = process.limit * (end / process.goal) * process.slope
    return slide_history(tip, process.record(values), first, event, search="golden")


@dataclass(frozen=True, eq=False)
class _OneNormal:
    """A slide with one normal.

    `limit` is the deflection at the trigger, `goal` the value of what is raised there, and
    `slope` the feed of the spindle over the deflection.
    """

    tip: LateralTip
    first: LocalGeometry
    by_force: bool
    limit: float
    goal: float
    slope: float

    @classmethod
    def of(cls, tip: PredictedTip, first: LocalGeometry, *, by_force: bool) -> _OneNormal:
        lateral = LateralTip(tip)
        state = lateral.state(first.normal)
        limit = float(np.linalg.norm(state.deflection))
        goal = float(state.force[0]) if by_force else limit
        # Equation 3.2: across the axis the tip moves 1/sin(polar) times as far as the spindle.
        slope = float(np.linalg.norm(lateral.sideways(first.normal)))
        return cls(lateral, first, by_force, limit, goal, slope)

    def record(self, values: FloatArray) -> list[SlideStep]:
        """The steps for values of deflection or force."""
        return [self._step(value) for value in values.tolist()]

    def _step(self, value: float) -> SlideStep:
        normal, radius = self.first.normal, self.tip.radius
        triggered = value >= self.goal
        deflection, force = self._loaded(value, triggered)
        feed = deflection * self.slope
        spindle = (self.first.point + radius * normal - feed * normal)[0]
        center = spindle + deflection * self.tip.across(normal)[0]
        local = LocalGeometry(center[None] - radius * normal, normal, self.first.curvature)
        applied = value if self.by_force else math.nan
        return SlideStep(feed, deflection, spindle, center, local, force, triggered, applied)

    def _loaded(self, value: float, triggered: bool) -> tuple[float, float]:
        """Deflection and force, of which one is given."""
        normal = self.first.normal
        if not self.by_force:
            return value, math.nan if triggered else self.tip.force_at(normal, value)
        if triggered:
            return self.limit, math.nan
        return float(np.linalg.norm(self.tip.deflection(normal, value))), value


def _golden_section(goal: float, highest: float, trials: int) -> tuple[FloatArray, float]:
    """The thesis's search for the smallest value that triggers: trials in order, and the end.

    The two inner points are tried one after the other; the interval shrinks to 0.618 of itself.
    """
    if highest < goal:
        raise ConvergenceError(
            f"the search ends at {highest:g} and the probe does not trigger there (it triggers at "
            f"{goal:.4g}); raise the step or the number of steps"
        )
    low, high = 0.0, highest
    tried: list[float] = []
    while len(tried) < trials and high - low > 1e-9 * highest:
        inner = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        tried.append(inner[0])
        if inner[0] >= goal:
            high = inner[0]
            continue
        low = inner[0]
        tried.append(inner[1])
        if inner[1] >= goal:
            high = inner[1]
        else:
            low = inner[1]
    return np.array(tried), high
