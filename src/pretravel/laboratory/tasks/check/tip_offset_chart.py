"""Picture of a tip's offset from the axis of the spindle: centres of a circle that turn with it."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE
from pretravel.laboratory.standards.tip_offset import TipOffset
from pretravel.show import Axis, Dots, LineMark, Note, PlaneChart


def tip_offset_chart(found: TipOffset) -> PlaneChart:
    """The tip off the axis of the spindle, as each orientation shows it.

    Parameters
    ----------
    found : TipOffset

    Returns
    -------
    PlaneChart
        Across the probe's axis, seen from the spindle, which is at zero.
    """
    tips = (found.place - found.centers) / MICROMETRE
    names = tuple(f"spindle at {angle / DEGREE:g}°" for angle in found.angles)
    size = found.size / MICROMETRE
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = size * np.cos(around), size * np.sin(around)
    x, y = found.offset / MICROMETRE
    edge = 1.25 * max(float(np.abs(tips).max()), size, 1e-3)
    return PlaneChart(
        f"offset of the tip from the spindle axis: {size:.2f} µm",
        Axis("x of the probe at 0°", "µm", -edge, edge),
        Axis("y of the probe at 0°", "µm", -edge, edge),
        (
            LineMark(*circle, "offset that turns", "reference"),
            LineMark(np.array([0.0, x]), np.array([0.0, y]), "offset at 0°", "ink"),
            Dots(tips[:, 0], tips[:, 1], "tip as touched", size=7.0, labels=names),
            *(Note(float(tip[0]), float(tip[1]), name.removeprefix("spindle at "))
              for tip, name in zip(tips, names, strict=True)),
        ),
        equal=True,
        note="the axis of the spindle is at 0, 0",
    )  # fmt: skip
