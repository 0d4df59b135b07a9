"""Charts as Plotly's JSON, for pages and the workbench: to turn, to zoom, to read off.

A figure is a plain mapping that `json` can write. Colours in it are names such as ``@after``;
`coloured` replaces them, and a page does so itself when its reader changes to dark.
"""

from __future__ import annotations

import gzip
import math
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.show.chart import (
    Axis,
    Chart,
    PlaneChart,
    PolarChart,
    Scale,
    SpaceChart,
    TopView,
    title_and_frame,
)
from pretravel.show.chart_marks import (
    Area,
    Bars,
    Contours,
    Dots,
    LineMark,
    Note,
    Rule,
)
from pretravel.show.colours import DARK, LIGHT, scale_colours, transparent
from pretravel.show.plotly_directions import polar_figure, top_view_figure
from pretravel.show.plotly_parts import (
    COLOUR_SCALES,
    SMALL,
    PlotlyFigure,
    area_style,
    colour_bar,
    escaped,
    flat_trace,
    legend_entry,
    line_style,
    plain_numbers,
    point_style,
)
from pretravel.show.plotly_space import space_figure

_LEGEND_SIGNS, _LEGEND_ROW = 60, 20
"""Signs of the names in a row of a legend, about; height of a row in pixels."""


_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"


FIT_SCRIPT = Path(__file__).parent / "templates" / "fit.js"
"""The script that fits the words and the camera of a figure to its place: ``fitted``."""


def plotly_figure(chart: Chart) -> PlotlyFigure:
    """A chart as data and layout for Plotly.

    Returns
    -------
    dict
        Colours are names with @. The row of a point is its ``customdata``, so that a click on it
        can be followed.

    >>> line = LineMark(np.arange(3.0), np.arange(3.0), "force <b>")
    >>> figure = plotly_figure(PlaneChart("", Axis("time", "s"), Axis("force", "N"), (line,)))
    >>> figure["data"][0]["name"], figure["layout"]["xaxis"]["title"]["text"]
    ('force &lt;b&gt;', 'time / s')
    """
    figure = _figure(chart)
    named = sum(bool(trace.get("showlegend")) for trace in figure["data"])
    layout = {
        "title": {
            "text": escaped(_heading(chart)),
            "font": {"size": 15},
            "x": 0.5,
            "xanchor": "center",
            "y": 1.0,
            "yref": "container",
            "yanchor": "top",
            "pad": {"t": 26},
        },
        "font": {"family": _FONT, "size": 13, "color": "@ink"},
        "paper_bgcolor": "@paper",
        "plot_bgcolor": "@paper",
        "margin": {"l": 64, "r": 24, "t": 80, "b": 56},
        "showlegend": named > 0,
        "legend": {
            "orientation": "h",
            "x": 0.5,
            "xanchor": "center",
            "y": 0,
            "yref": "container",
            "yanchor": "bottom",
        },
        "hoverlabel": {"font": {"family": _FONT, "size": 13}},
        "uirevision": "kept",
        "autosize": True,
    }
    figure["layout"] = layout | figure["layout"]
    if chart.note:
        _add_note(figure["layout"], chart.note)
    names = [str(trace["name"]) for trace in figure["data"] if trace.get("showlegend")]
    rows = math.ceil(sum(len(name) + 8 for name in names) / _LEGEND_SIGNS)
    bottom = figure["layout"]["margin"]["b"] + _LEGEND_ROW * max(rows - 1, 0)
    figure["layout"]["margin"] = figure["layout"]["margin"] | {"b": bottom}
    return figure


def colour_names(*, dark: bool = False) -> dict[str, str]:
    """The colours behind the names with @; a name with ~18 at the end has an opacity of 18 %."""
    colours = DARK if dark else LIGHT
    whole = {str(name): value for name, value in colours.items()} | scale_colours(dark=dark)
    return {f"@{name}": value for name, value in whole.items()} | {
        f"@{name}~{percent}": transparent(value, percent / 100.0)
        for name, value in colours.items()
        for percent in range(5, 65)
    }


def plotly_script() -> bytes:
    """The script of Plotly (MIT licence)."""
    return gzip.decompress(plotly_script_gzip())


@cache
def plotly_script_gzip() -> bytes:
    """The script of Plotly, compressed; the build takes it from its Python package."""
    return resources.files("pretravel.show").joinpath("scripts/plotly.min.js.gz").read_bytes()


def _add_note(layout: dict[str, Any], note: str) -> None:
    """A line of smaller words below the title, with room for it."""
    small = f"{SMALL[0]}{escaped(note)}{SMALL[1]}"
    layout["title"] = layout["title"] | {"text": f"{layout['title']['text']}<br>{small}"}
    layout["margin"] = layout["margin"] | {"t": layout["margin"]["t"] + 14}


def _heading(chart: Chart) -> str:
    heading = title_and_frame(chart)
    if not isinstance(chart, PolarChart):
        return heading
    # A line of its own: a phone, and three pictures next to each other, show no long line.
    return f"{heading}\nradius: {chart.radius.text}"


def _figure(chart: Chart) -> PlotlyFigure:
    match chart:
        case PlaneChart():
            return _plane(chart)
        case PolarChart():
            return polar_figure(chart)
        case TopView():
            return top_view_figure(chart)
        case SpaceChart():
            return space_figure(chart)


def _axis(axis: Axis) -> dict[str, Any]:
    result: dict[str, Any] = {
        "title": {"text": escaped(axis.text), "standoff": 8},
        "gridcolor": "@grid", "zerolinecolor": "@grid", "linecolor": "@ink",
        "ticks": "outside", "automargin": True, "exponentformat": "power",
    }  # fmt: skip
    if axis.logarithmic:
        result |= {"type": "log", "tickformat": "~g"}  # 0.01, no power of ten
    if axis.categories:
        result |= {"tickmode": "array", "tickvals": [*range(len(axis.categories))]}
        result["ticktext"] = [escaped(name) for name in axis.categories]
        result["range"] = [-0.5, len(axis.categories) - 0.5]  # all names have the same room
    if axis.ticks:
        result |= {"tickmode": "array", "tickvals": [*axis.ticks]}
    if axis.tick_names:
        result["ticktext"] = [escaped(name) for name in axis.tick_names]
    if axis.low is not None and axis.high is not None:
        ends = [axis.low, axis.high]
        result["range"] = [*map(math.log10, ends)] if axis.logarithmic else ends
    elif axis.low == 0.0 and not axis.logarithmic:
        result["rangemode"] = "tozero"
    return result


def _plane(chart: PlaneChart) -> PlotlyFigure:
    layout: dict[str, Any] = {"xaxis": _axis(chart.x), "yaxis": _axis(chart.y)}
    if chart.equal:
        layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    data: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    for mark in chart.marks:
        if isinstance(mark, Rule):
            along = {"xref": "paper", "x0": 0, "x1": 1, "y0": mark.value, "y1": mark.value}
            up = {"yref": "paper", "y0": 0, "y1": 1, "x0": mark.value, "x1": mark.value}
            line = {"color": f"@{mark.colour}", "width": 1.5, "dash": "dash"}
            shapes.append({"type": "line", "line": line} | (up if mark.upright else along))
            data.append({"type": "scatter", "mode": "lines", "hoverinfo": "skip", "line": line,
                         **_point_of(mark, chart), **legend_entry(mark.name)})  # fmt: skip
        elif isinstance(mark, Note):
            notes.append({"x": mark.x, "y": mark.y, "text": escaped(mark.text), "showarrow": False,
                          "xanchor": "left", "font": {"color": f"@{mark.colour}"}})  # fmt: skip
        else:
            data += _plane_traces(mark, chart)
    if any(isinstance(mark, Rule) and mark.upright for mark in chart.marks):
        notes = [note | {"bgcolor": "@paper"} for note in notes]  # no rule goes through words
    if any(isinstance(mark, Bars) and mark.horizontal for mark in chart.marks):
        layout["yaxis"]["autorange"] = "reversed"
    layout |= {"shapes": shapes, "annotations": notes, "barmode": "overlay"}
    if chart.moments:
        layout["sliders"] = [_slider(chart)]
    return {"data": data, "layout": layout}


def _point_of(rule: Rule, chart: PlaneChart) -> dict[str, list[float | None]]:
    """A point on a rule, where there are others: a line of one point is not drawn.

    A shape has no place in a legend, and stands at the edge where it is the largest value.
    """
    drawn = (mark for mark in chart.marks if isinstance(mark, (LineMark, Dots, Area)))
    along, across = ("y", "x") if rule.upright else ("x", "y")
    others = [getattr(mark, along, ()) for mark in drawn]
    there = next((float(value) for each in others for value in each if np.isfinite(value)), None)
    return {along: [there], across: [None if there is None else rule.value]}


def _slider(chart: PlaneChart) -> dict[str, Any]:
    """A slider that gives the traces the values of each moment."""
    steps = []
    for moment in chart.moments:
        traces = _plane(replace(chart, marks=moment.marks, moments=()))["data"]
        changed = {
            key: [trace.get(key) for trace in traces]
            for key in ("x", "y", "text")
            if any(key in trace for trace in traces)
        }
        steps.append({"method": "restyle", "label": moment.name, "args": [changed]})
    return {
        "steps": steps,
        "active": 0,
        "currentvalue": {"visible": True, "prefix": "", "font": {"color": "@ink"}},
        "font": {"color": "rgba(0,0,0,0)"},  # names below the slider would cover each other
        "ticklen": 0,
        "minorticklen": 0,
        "pad": {"t": 40},
    }


def _contour_trace(mark: Contours, scale: Scale) -> dict[str, Any]:
    lines = {"start": scale.low, "end": scale.high, "size": mark.step, "showlabels": True}
    return {
        "type": "contour",
        "x": plain_numbers(mark.x),
        "y": plain_numbers(mark.y),
        "z": plain_numbers(mark.values),
        "zmin": scale.low,
        "zmax": scale.high,
        "colorscale": COLOUR_SCALES[scale.signed],
        "contours": lines | {"labelfont": {"size": 11}},
        "line": {"width": 0.8},
        "colorbar": colour_bar(scale),
        "hovertemplate": f"%{{x:.5g}}, %{{y:.5g}}: %{{z:.4g}} {escaped(scale.unit)}<extra></extra>",
    }


def _plane_traces(
    mark: LineMark | Dots | Area | Bars | Contours, chart: PlaneChart
) -> list[dict[str, Any]]:
    match mark:
        case LineMark():
            return [flat_trace(mark.x, mark.y) | line_style(mark)]
        case Dots():
            trace = flat_trace(mark.x, mark.y)
            if mark.u is not None:
                colour = mark.colour if mark.values is None else "reference"
                trace["error_y"] = {
                    "type": "data",
                    "array": plain_numbers(mark.u),
                    "thickness": 1,
                    "color": f"@{colour}",
                }
            return [trace | point_style(mark, chart.scale, "%{x:.5g}, %{y:.5g}")]
        case Area():
            x, y = np.append(mark.x, mark.x[::-1]), np.append(mark.high, mark.low[::-1])
            return [flat_trace(x, y) | area_style(mark)]
        case Bars():
            return _bar_traces(mark)
        case Contours():
            assert chart.scale is not None
            return [_contour_trace(mark, chart.scale)]


def _bar_traces(mark: Bars) -> list[dict[str, Any]]:
    along, across = ("x", "y") if mark.horizontal else ("y", "x")
    trace: dict[str, Any] = {
        "type": "bar",
        across: plain_numbers(mark.places),
        along: plain_numbers(mark.values),
        "orientation": "h" if mark.horizontal else "v",
        "width": mark.width,
        "marker": {"color": f"@{mark.colour}"},
    } | legend_entry(mark.name)
    if mark.base is not None:
        trace["base"] = plain_numbers(mark.base)
    if mark.u is not None:
        trace[f"error_{along}"] = {"type": "data", "array": plain_numbers(mark.u), "color": "@ink"}
    if not mark.texts:
        return [trace]
    ends = mark.values + (0.0 if mark.base is None else mark.base)
    words = {
        "type": "scatter",
        "mode": "text",
        across: plain_numbers(mark.places),
        along: plain_numbers(ends + (0.0 if mark.u is None else mark.u)),
        "text": [f" {escaped(text)}" for text in mark.texts],
        "textposition": "middle right" if mark.horizontal else "top center",
        "cliponaxis": False,
        "hoverinfo": "skip",
        "showlegend": False,
    }
    return [trace, words]
