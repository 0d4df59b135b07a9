"""The picture of a value by matplotlib: `plot()` of touches, points, maps, qualifications, …"""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, object_at, polar_angle
from pretravel.maps import PretravelMap
from pretravel.show import (
    Axis,
    PolarChart,
    Scale,
    SpaceChart,
    SpacePoints,
    View,
    around_marks,
    drawn_figure,
    map_body,
    map_top_view,
    series,
    some_rows,
)
from pretravel.touches import Touches

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST = 3000
"""Touches that are drawn."""
_HEIGHTS = (90.0, 45.0)
"""Polar angles of the curves of a map. [deg]"""


def plotted(value: object) -> tuple[Axes, ...]:
    """The axes of the picture of a value, in a figure of pyplot.

    Parameters
    ----------
    value : Touches, Points, PretravelMap, Trigger, Qualification, Separation or a feature

    Returns
    -------
    tuple of matplotlib.axes.Axes

    Raises
    ------
    TypeError
        The value is none of these.
    """
    return tuple(drawn_figure(plot_view(value), interactive=True).axes)


VIEWS = {
    "Points": "pretravel.tasks.compensate:points_view",
    "Trigger": "pretravel.design.tasks.predict:prediction_view",
    "Qualification": "pretravel.tasks.qualify:qualification_view",
    "Separation": "pretravel.laboratory:separation_view",
    "MeasuredFeature": "pretravel.drawing:feature_view",
}
"""What draws the results of tasks, by their types: pictures of their reports."""


@singledispatch
def plot_view(value: object) -> View:
    """The charts of a value; see `plotted`."""
    place = VIEWS.get(type(value).__name__)
    if place is None:
        raise TypeError(f"a {type(value).__name__} has no picture")
    view: View = object_at(place)(value)
    return view


@plot_view.register
def _touches(touches: Touches) -> View:
    rows = some_rows(np.arange(len(touches)), _MOST)
    polar = polar_angle(touches.normals[rows]) / DEGREE
    labels = tuple(touches.where(int(row)) for row in rows)
    dots = SpacePoints(touches.positions[rows], values=polar, size=6.0, labels=labels)
    scale = Scale("polar angle of the normal", "°", 0.0, max(float(polar.max()), 90.0))
    note = (
        f"{len(rows):,} of {len(touches):,} touches are drawn" if len(rows) < len(touches) else ""
    )
    chart = SpaceChart("places of the tip", (dots,), "machine", scale=scale, note=note)
    return View(touches.source or "Touches", (chart,))


@plot_view.register
def _map(pretravel_map: PretravelMap) -> View:
    curves = [
        mark
        for height, colour in zip(_HEIGHTS, (series(0), series(1)), strict=True)
        for mark in around_marks(pretravel_map, height, colour, f"polar {height:g}°")
    ]
    note = "Lines: map, bands: ± 2 u of the map."
    around = PolarChart("pretravel over azimuth", Axis("pretravel", "µm"), tuple(curves), note=note)
    charts = (map_top_view(pretravel_map), *((around,) if curves else ()), map_body(pretravel_map))
    return View(f"Map, kind {pretravel_map.kind}", charts, columns=2)
