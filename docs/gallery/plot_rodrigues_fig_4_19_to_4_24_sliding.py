"""Rodrigues 2021, Figures 4.19, 4.23 and 4.24: slide of the tip, with Tables 4.10 and 4.11.

The spindle makes twenty steps of 1 µm along the normal: on the convex surface (u = 0.5, v = 0.5
and -0.5), on the ellipsoid (a = 10, c = 6 mm, u = 0, v = 40°) and on a plane whose normal is 40°
from the axis. The dots are the printed values. The thesis's values for the ellipsoid are 0.449 µm
too high in rows 1 to 19, but not in row 20.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure
from published import Statement, finish, sliding_tables

from pretravel.design.probing.slide_history import SlideHistory
from pretravel.design.probing.slides import slide
from pretravel.design.probing.tip import predicted_tip
from pretravel.design.tasks.slide.report import slide_chart
from pretravel.prediction.catalogue import load_probe
from pretravel.show.chart import Axis, PlaneChart, View
from pretravel.show.chart_files import drawn_figure
from pretravel.show.chart_marks import Dots, LineMark, Mark, Rule
from pretravel.surface.local_geometry import Surface
from pretravel.surface.specification import parse_surface

CASES = {
    "convex, u = 0.5, v = 0.5": ("convex", (0.5, 0.5), "deflection_mm_u0.5_v0.5", 1e3),
    "convex, u = 0.5, v = -0.5": ("convex", (0.5, -0.5), "deflection_mm_u0.5_v-0.5", 1e3),
    "ellipsoid, v = 40°": (
        "ellipsoid:a=10,c=6", (0.0, math.radians(40.0)), "deflection_um_ellipsoid", 1.0
    ),
    "inclined plane, 40°": ("plane:polar=40", (0.0, 0.0), "deflection_um_inclined", 1.0),
}  # fmt: skip


STATEMENT = Statement(
    "deflection on the convex surface (u = v = 0.5) after 20 µm of feed / µm",
    "71.825",
    "Rodrigues 2021, Table 4.10",
    71.75,
    71.90,
    "the tolerance of the solver in the thesis is 0.1 %",
)


def compute() -> dict[str, tuple[SlideHistory, Surface, np.ndarray]]:
    """For each case: history of the slide, surface, printed deflections (µm)."""
    tip = predicted_tip(load_probe("omp40-2-thesis-100mm"))
    tables = sliding_tables()
    computed = {}
    for name, (specification, at, column, to_um) in CASES.items():
        surface = parse_surface(specification)
        computed[name] = (slide(tip, surface, at), surface, to_um * tables[column])
    return computed


def stated(computed: dict[str, tuple[SlideHistory, Surface, np.ndarray]]) -> float:
    """The deflection of the last step on the convex surface."""
    history, _, _ = computed["convex, u = 0.5, v = 0.5"]
    return float(1e3 * history.deflection[19])


def draw(computed: dict[str, tuple[SlideHistory, Surface, np.ndarray]]) -> Figure:
    """The plot: path of the contact in space (top), deflection over feed (bottom)."""
    above, below = [], []
    for name, (history, surface, printed) in computed.items():
        above.append(slide_chart(history, surface, name))
        feed = 1e3 * history.feed
        marks: list[Mark] = [
            LineMark(feed, 1e3 * history.deflection, "computed"),
            Dots(feed, printed, "printed", "reference", size=3.0),
        ]
        if np.isfinite(history.trigger_feed):
            marks.append(Rule(1e3 * history.trigger_feed, "trigger", "limit", upright=True))
        axes = Axis("feed", "µm"), Axis("deflection across the axis", "µm")
        below.append(PlaneChart(name, *axes, tuple(marks)))
    title = "Rodrigues 2021, Figures 4.19, 4.23, 4.24 and Tables 4.10, 4.11"
    return drawn_figure(View(title, (*above, *below), columns=4))


if __name__ == "__main__":
    found = compute()
    finish(__file__, "rodrigues_fig_4_19_to_4_24.png", draw(found), STATEMENT, stated(found))
