"""Picture of a plan of few touches: u of the map today and with the touches."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.qualification import TouchPlan
from pretravel.show import (
    Axis,
    Colour,
    Dots,
    LineMark,
    PlaneChart,
    Scale,
    View,
    angles_deg,
    azimuth_axis,
    direction_words,
    is_ring,
    scattered_top_view,
)


def touch_plan_view(plan: TouchPlan, title: str = "") -> View:
    """Standard uncertainty of the map today and with the touches, in the same colours."""
    highest = float(plan.u_before.max()) / MICROMETRE
    scale = Scale("u of the map", "µm", 0.0, highest)
    planned: dict[str, Any] = dict(
        zip(("node_polar_deg", "node_azimuth_deg"), angles_deg(plan.directions), strict=True),
        node_name="planned touches, in their order",
        node_labels=tuple(direction_words(plan.directions)),
        numbered=True,
    )
    if is_ring(plan.places):
        return View(title or "Plan of touches", (_ring_chart(plan),))
    today = scattered_top_view("u today", plan.places, plan.u_before / MICROMETRE, scale)
    then = scattered_top_view("u with the touches", plan.places, plan.u_after / MICROMETRE, scale)
    return View(title or "Plan of touches", (today, replace(then, **planned)), 2)


def _ring_chart(plan: TouchPlan) -> PlaneChart:
    """The same over the azimuth, where the map is one of a ring."""
    azimuth = angles_deg(plan.places)[1]
    order = np.argsort(azimuth)
    states: tuple[tuple[str, Colour, FloatArray], ...] = (
        ("today", "before", plan.u_before),
        ("with the touches", "after", plan.u_after),
    )
    lines = [
        LineMark(azimuth[order], u[order] / MICROMETRE, name, colour) for name, colour, u in states
    ]
    at = angles_deg(plan.directions)[1]
    labels = tuple(direction_words(plan.directions))
    touches = Dots(at, np.zeros(len(at)), "planned touches", "ink", symbol="diamond", labels=labels)
    return PlaneChart("u of the map", azimuth_axis(), Axis("u of the map", "µm", low=0.0),
                      (*lines, touches))  # fmt: skip
