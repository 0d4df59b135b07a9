"""Charts around an axis as Plotly's JSON: polar diagrams and maps seen from the spindle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pretravel.base import DEGREE, FloatArray, IntArray
from pretravel.show.chart import (
    COMPASS,
    PolarChart,
    TopView,
    compass_of,
    rings_to,
)
from pretravel.show.chart_marks import (
    Area,
    Dots,
    LineMark,
    Rule,
)
from pretravel.show.plotly_parts import (
    COLOUR_SCALES,
    PlotlyFigure,
    area_style,
    colour_bar,
    escaped,
    flat_trace,
    line_style,
    plain_numbers,
    point_style,
)


def polar_figure(chart: PolarChart) -> PlotlyFigure:
    """A chart around."""
    data: list[dict[str, Any]] = []
    for mark in chart.marks:
        match mark:
            case Rule():
                circle = np.linspace(0.0, 2.0 * np.pi, 181)
                line = LineMark(
                    circle, np.full(181, mark.value), mark.name, mark.colour, dashed=True
                )
                data.append(_around(line.x, line.y) | line_style(line))
            case LineMark():
                data.append(_around(mark.x, mark.y) | line_style(mark))
            case Dots():
                place = "azimuth %{theta:.1f}°, %{r:.4g} " + escaped(chart.radius.unit)
                data.append(_around(mark.x, mark.y) | point_style(mark, chart.scale, place))
            case Area():
                x, y = np.append(mark.x, mark.x[::-1]), np.append(mark.high, mark.low[::-1])
                seen = np.isfinite(y)
                data.append(_around(x[seen], y[seen]) | area_style(mark))
    radial: dict[str, Any] = {
        "angle": 112,
        "tickangle": 112,
        "nticks": 5,
        "ticks": "",  # a stroke before a number is read as a minus
        "gridcolor": "@grid",
        "linecolor": "@grid",
    }
    if chart.radius.ticks:
        radial |= {"tickmode": "array", "tickvals": [*chart.radius.ticks]}
    if chart.radius.low is not None and chart.radius.high is not None:
        radial["range"] = [chart.radius.low, chart.radius.high]
    elif chart.radius.low == 0.0:
        radial["rangemode"] = "tozero"
    names = [*map(escaped, compass_of(*chart.directions))]
    around = {"tickmode": "array", "tickvals": [*range(0, 360, 45)], "ticktext": names,
              "gridcolor": "@grid", "linecolor": "@ink"}  # fmt: skip
    polar = {"bgcolor": "@paper", "radialaxis": radial, "angularaxis": around}
    margin = {"l": 48, "r": 48, "t": 100, "b": 84}
    return {"data": data, "layout": {"polar": polar, "margin": margin}}


def _around(azimuth: FloatArray, radius: FloatArray) -> dict[str, Any]:
    theta = plain_numbers(np.asarray(azimuth) / DEGREE)
    return {"type": "scatterpolar", "theta": theta, "r": plain_numbers(radius)}


def top_view_figure(chart: TopView) -> PlotlyFigure:
    """A map over directions, seen from the spindle."""
    largest = float(chart.polar_deg.max())
    side = np.linspace(-largest, largest, 91)
    x, y = np.meshgrid(side, side)
    polar, azimuth = np.hypot(x, y), np.arctan2(y, x) / DEGREE % 360.0
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": plain_numbers(side),
            "y": plain_numbers(side),
            "z": plain_numbers(_on_directions(chart, polar, azimuth)),
            "customdata": np.round(np.dstack([polar, azimuth]), 1).tolist(),
            "hovertemplate": f"{escaped(chart.scale.label)} %{{z:.4g}} "
            f"{escaped(chart.scale.unit)}<br>"
            "polar %{customdata[0]}°, azimuth %{customdata[1]}°<extra></extra>",
            "colorscale": COLOUR_SCALES[chart.scale.signed],
            "zmin": chart.scale.low,
            "zmax": chart.scale.high,
            "zsmooth": False,
            "colorbar": colour_bar(chart.scale),
        }
    ]
    if chart.node_polar_deg is not None and chart.node_azimuth_deg is not None:
        turn = chart.node_azimuth_deg * DEGREE
        nodes = Dots(chart.node_polar_deg * np.cos(turn), chart.node_polar_deg * np.sin(turn),
                       chart.node_name, "ink", symbol="ring", size=4.0,
                       labels=chart.node_labels)  # fmt: skip
        trace = flat_trace(nodes.x, nodes.y) | point_style(nodes, None, chart.node_name)
        # White with a dark edge: seen on every colour of the scale.
        trace["marker"] |= {"symbol": "circle", "color": "#ffffff", "size": 5.0}
        trace["marker"]["line"] = {"color": "#1d2730", "width": 1}
        if chart.numbered:
            trace["marker"]["size"] = 17
            numbers = [str(number) for number in range(1, len(nodes.x) + 1)]
            trace |= {"mode": "markers+text", "text": numbers, "textposition": "middle center",
                      "textfont": {"size": 11, "color": "#1d2730"}}  # fmt: skip
        data.append(trace)
    hidden: dict[str, Any] = {
        "visible": False,
        "range": [-1.2 * largest, 1.2 * largest],
        "constrain": "domain",
    }
    layout = {
        "xaxis": hidden,
        "yaxis": hidden | {"scaleanchor": "x"},
        "shapes": [_circle(r) for r in rings_to(largest)],
        "annotations": _compass_notes(largest),
    }
    return {"data": data, "layout": layout}


def _on_directions(chart: TopView, polar: FloatArray, azimuth: FloatArray) -> FloatArray:
    """Values between the directions of the grid, linear in both; not a number outside.

    `scipy.interpolate` would take half a second to load.
    """
    around = np.append(chart.azimuth_deg, chart.azimuth_deg[0] + 360.0)
    values = np.hstack([chart.values, chart.values[:, :1]])
    azimuth = (azimuth - chart.azimuth_deg[0]) % 360.0 + chart.azimuth_deg[0]
    row, down = _cells(chart.polar_deg, polar)
    column, along = _cells(around, azimuth)
    upper = (1.0 - along) * values[row, column] + along * values[row, column + 1]
    lower = (1.0 - along) * values[row + 1, column] + along * values[row + 1, column + 1]
    return np.asarray((1.0 - down) * upper + down * lower)


def _cells(steps: FloatArray, places: FloatArray) -> tuple[IntArray, FloatArray]:
    """The cell of each place in a row of steps, and how far in it; not a number outside."""
    cell = np.clip(np.searchsorted(steps, places, side="right") - 1, 0, len(steps) - 2)
    share = (places - steps[cell]) / (steps[cell + 1] - steps[cell])
    outside = (places < steps[0]) | (places > steps[-1])
    return np.asarray(cell, dtype=np.int64), np.where(outside, np.nan, share)


def _circle(radius: float) -> dict[str, Any]:
    return {"type": "circle", "x0": -radius, "x1": radius, "y0": -radius, "y1": radius,
            "line": {"color": "@reference", "width": 1}}  # fmt: skip


def _compass_notes(largest: float) -> list[dict[str, Any]]:
    notes = []
    for place, name in enumerate(COMPASS):
        turn = math.radians(45.0 * place)
        x, y = 1.14 * largest * math.cos(turn), 1.14 * largest * math.sin(turn)
        notes.append({"x": x, "y": y, "text": name, "showarrow": False})
    for ring in rings_to(largest):
        turn = math.radians(112.0)
        x, y = ring * math.cos(turn), ring * math.sin(turn)
        notes.append({"x": x, "y": y, "text": f"{ring:.3g}°", "showarrow": False,
                      "bgcolor": "@paper", "opacity": 0.85, "font": {"size": 11}})  # fmt: skip
    return notes
