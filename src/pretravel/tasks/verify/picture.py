"""Picture of a verification: differences by place and over the azimuth, and the control chart."""

from __future__ import annotations

from collections.abc import Sequence

from pretravel.base import MICROMETRE
from pretravel.files import Entry
from pretravel.qualification import Verification
from pretravel.show import (
    Axis,
    Dots,
    PlaneChart,
    Rule,
    Scale,
    View,
    angles_deg,
    azimuth_axis,
    chart_by_place,
    direction_words,
    value_text,
)
from pretravel.tasks.history import control_charts


def verification_view(result: Verification, entries: Sequence[Entry] = (), title: str = "") -> View:
    """Differences by place and over the azimuth, and the control chart where there is a history."""
    difference, u = result.differences / MICROMETRE, result.u_differences / MICROMETRE
    polar, azimuth = angles_deg(result.directions)
    labels = tuple(
        f"{words}; {value_text(value, 'µm')}, u {value_text(own, 'µm')}"
        for words, value, own in zip(
            direction_words(result.directions), difference.tolist(), u.tolist(), strict=True
        )
    )
    scale = Scale.of("change (touches − map)", "µm", difference, signed=True)
    words = "changed" if result.changed else "no change"
    by_place = chart_by_place(result.directions, difference, scale, f"{words}: from above",
                              labels=labels)  # fmt: skip
    name = "mean of a direction, ± 2 u"
    dots = Dots(azimuth, difference, name, "reference", polar, 2.0 * u, labels=labels)
    over = PlaneChart(f"{words}: over the azimuth", azimuth_axis(),
                      Axis("change (touches − map)", "µm"), (Rule(0.0, "the map"), dots),
                      Scale("polar angle", "°", 0.0, 90.0))  # fmt: skip
    charts = control_charts(entries) if entries else ()
    return View(title or "Verification", (by_place, over, *charts), 2)
