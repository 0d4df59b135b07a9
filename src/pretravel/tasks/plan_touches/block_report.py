"""Report and picture of the touches on a block, seen from above."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, BoolArray
from pretravel.qualification import BlockPlan
from pretravel.show import (
    Axis,
    Colour,
    Column,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Picture,
    PlaneChart,
    Table,
    View,
    decimals,
)

_SHOWN = 4.0
"""Length of an approach in the picture. [mm]"""


def block_plan_document(plan: BlockPlan, lengths: tuple[float, ...]) -> Document:
    """The report of a plan of touches on a block.

    Parameters
    ----------
    plan : BlockPlan
    lengths : tuple of float
        [mm]
    """
    turns = list(dict.fromkeys(np.round(plan.turns / DEGREE, 6).tolist()))
    size = " × ".join(f"{length:g}" for length in lengths)
    rows = [np.round(plan.turns / DEGREE, 6) == turn for turn in turns]
    return Document(
        title=f"Touches on a block of {size} mm",
        verdict=f"{len(plan.points)} touches at {len(turns)} turns of the block: "
        + ", ".join(f"{turn:g}°" for turn in turns),
        figures=(
            KeyFigure("0°, 90°", "lengths along both axes; squareness of x and y (the turn by 90° "
                      "reverses the block's own error)"),
            KeyFigure("30°", "backlash: each contact once along the normal, and twice along the "
                      "nearest machine axis, with the other axis arriving from + and from −"),
            KeyFigure("180°", "squareness to z (the turn by 180° reverses the block's own error)"),
            KeyFigure("plate", "next to the block; with the top of the block, the scale of z"),
            KeyFigure("place", "at each turn some millimetres elsewhere along each axis: this "
                      "shows errors that a screw repeats with each revolution"),
        ),
        tables=(
            Table(
                (
                    Column.of("turn", turns, "°", decimals(0)),
                    Column.of("touches", [float(np.sum(own)) for own in rows], "", decimals(0)),
                ),
                "At each turn, in this order:",
            ),
        ),
        pictures=(Picture("Touches at each turn, from above", lambda: block_plan_view(plan)),),
        notes=(
            ("The turns may be off by some degrees, because the fit determines them. At 0° the "
            "block is parallel to the axes of the machine within 5 degrees."),
        ),
    )  # fmt: skip


def block_plan_view(plan: BlockPlan) -> View:
    """The touches at each turn from above, with their approaches."""
    charts = []
    turns = np.round(plan.turns / DEGREE, 6)
    for turn in dict.fromkeys(turns.tolist()):
        own = turns == turn
        plate = own & np.array([name.startswith("plate") for name in plan.references])
        level = own & (np.abs(plan.normals[:, 2]) < 0.5)
        ways = [
            LineMark(np.array([p[0] - _SHOWN * a[0], p[0]]), np.array([p[1] - _SHOWN * a[1], p[1]]),
                     "", "series2")
            for p, a in zip(plan.points[level], plan.approaches[level], strict=True)
        ]  # fmt: skip
        kinds: tuple[tuple[BoolArray, str, Colour], ...] = (
            (own & ~plate, "block", "series1"),
            (plate, "plate", "series3"),
        )
        marks = [
            Dots(plan.points[rows, 0], plan.points[rows, 1], name, colour)
            for rows, name, colour in kinds
            if rows.any()
        ]
        charts.append(
            PlaneChart(
                f"turn {turn:g}°", Axis("x", "mm"), Axis("y", "mm"), (*ways, *marks), equal=True
            )
        )
    return View("Touches on a block", tuple(charts), 2)
