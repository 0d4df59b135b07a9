"""Charts as Plotly's JSON, for pages and the workbench: to turn, to zoom, to read off.

A figure is a plain mapping that `json` can write. Colours in it are names such as ``@after``;
`coloured` replaces them, and a page does so itself when its reader changes to dark.
"""

from __future__ import annotations

import gzip
import html
import math
from functools import cache
from importlib import resources
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.report.chart import (
    COMPASS,
    Area,
    Axis,
    Bars,
    Chart,
    Dots,
    LineMark,
    Note,
    PlaneChart,
    PolarChart,
    Rule,
    Scale,
    SpaceArrow,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
    TopView,
    box_of,
    compass_of,
    rings_to,
    title_and_frame,
)
from pretravel.report.colours import DARK, LIGHT, transparent
from pretravel.units import DEGREE

PlotlyFigure: TypeAlias = dict[str, Any]

_SYMBOLS = {"dot": "circle", "ring": "circle-open", "cross": "x", "diamond": "diamond"}
_SIGNED = (
    "#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7",
    "#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f",
)  # fmt: skip
"""RdBu of ColorBrewer from blue to red, as in files: Plotly's own scale of that name is another."""
_COLOUR_SCALES = {
    False: "Viridis",
    True: [[place / 10.0, colour] for place, colour in enumerate(_SIGNED)],
}
_LEGEND_SIGNS, _LEGEND_ROW = 60, 20
"""Signs of the names in a row of a legend, about; height of a row in pixels."""
_FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"


def plotly_figure(chart: Chart) -> PlotlyFigure:
    """A chart as data and layout for Plotly.

    Parameters
    ----------
    chart : Chart

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
            "text": _text(_heading(chart)),
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


def coloured(figure: PlotlyFigure, *, dark: bool = False) -> PlotlyFigure:
    """A figure in which the names of colours are replaced by colours.

    Parameters
    ----------
    figure : dict
        From `plotly_figure`; it is not changed.
    dark : bool

    Returns
    -------
    dict

    >>> coloured({"data": [{"line": {"color": "@after"}}]})["data"][0]["line"]
    {'color': '#0072b2'}
    """
    names = colour_names(dark=dark)

    def replaced(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: replaced(part) for key, part in value.items()}
        if isinstance(value, list):
            return value if value and isinstance(value[0], float) else [*map(replaced, value)]
        return names.get(value, value) if isinstance(value, str) else value

    return {key: replaced(part) for key, part in figure.items()}


def colour_names(*, dark: bool = False) -> dict[str, str]:
    """The colours behind the names with @; a name with ~18 at the end has an opacity of 18 %."""
    colours = DARK if dark else LIGHT
    return {f"@{name}": value for name, value in colours.items()} | {
        f"@{name}~{percent}": transparent(value, percent / 100.0)
        for name, value in colours.items()
        for percent in range(5, 65)
    }


def plotly_script() -> bytes:
    """The script of Plotly (MIT licence), from its Python package."""
    return resources.files("plotly").joinpath("package_data/plotly.min.js").read_bytes()


@cache
def plotly_script_gzip() -> bytes:
    """The script of Plotly, compressed."""
    return gzip.compress(plotly_script(), compresslevel=9, mtime=0)


SMALL = ("<span style='font-size:12px'>", "</span>")
"""The HTML around the note of a chart."""


def _text(text: str) -> str:
    """Text that Plotly shows as it is: it reads some HTML."""
    return html.escape(text, quote=False).replace("\n", "<br>")


def _add_note(layout: dict[str, Any], note: str) -> None:
    """A line of smaller words below the title, with room for it."""
    small = f"{SMALL[0]}{_text(note)}{SMALL[1]}"
    layout["title"] = layout["title"] | {"text": f"{layout['title']['text']}<br>{small}"}
    layout["margin"] = layout["margin"] | {"t": layout["margin"]["t"] + 14}


def _heading(chart: Chart) -> str:
    heading = title_and_frame(chart)
    return f"{heading}, radius: {chart.radius.text}" if isinstance(chart, PolarChart) else heading


def _numbers(values: npt.ArrayLike) -> list[Any]:
    """Numbers with six digits; null where there is none."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1:
        return [_numbers(row) for row in array]
    return [float(f"{v:.6g}") if math.isfinite(v) else None for v in array.tolist()]


def _colour_bar(scale: Scale) -> dict[str, Any]:
    title = {"text": _text(scale.text), "side": "right"}
    bar: dict[str, Any] = {"title": title, "thickness": 14, "outlinewidth": 0}
    if scale.logarithmic:
        ends = math.log10(scale.low), math.log10(scale.high)
        marked = [
            (power + math.log10(digit), f"{digit * 10.0**power:g}")
            for power in range(math.floor(ends[0]), math.ceil(ends[1]) + 1)
            for digit in (1, 2, 5)
            if ends[0] <= power + math.log10(digit) <= ends[1]
        ]
        bar |= {"tickmode": "array", "tickvals": [place for place, _ in marked]}
        bar["ticktext"] = [text for _, text in marked]
    return bar


def _marker(mark: Dots | SpacePoints, scale: Scale | None) -> dict[str, Any]:
    marker: dict[str, Any] = {"size": mark.size + 1.0, "symbol": _SYMBOLS[mark.symbol]}
    if mark.values is None or scale is None:
        return marker | {"color": f"@{mark.colour}"}
    marker["line"] = {"color": "@reference", "width": 0.6}  # the middle of a scale is pale
    return marker | _in_colours(mark.values, scale, "color")


def _in_colours(values: FloatArray, scale: Scale, key: str) -> dict[str, Any]:
    """Values in the colours of a scale, of a marker or (key intensity) of a surface."""
    low, high = scale.low, scale.high
    if scale.logarithmic:
        values = np.log10(np.clip(values, low, high))
        low, high = math.log10(low), math.log10(high)
    return {
        key: _numbers(values),
        "colorscale": _COLOUR_SCALES[scale.signed],
        "cmin": low,
        "cmax": high,
        "showscale": True,
        "colorbar": _colour_bar(scale),
    }


def _legend(name: str) -> dict[str, Any]:
    return {"name": _text(name), "showlegend": bool(name)}


def _figure(chart: Chart) -> PlotlyFigure:
    match chart:
        case PlaneChart():
            return _plane(chart)
        case PolarChart():
            return _polar(chart)
        case TopView():
            return _top_view(chart)
        case SpaceChart():
            return _space(chart)


def _axis(axis: Axis) -> dict[str, Any]:
    result: dict[str, Any] = {
        "title": {"text": _text(axis.text)}, "gridcolor": "@grid", "zerolinecolor": "@grid",
        "linecolor": "@ink", "ticks": "outside", "automargin": True, "exponentformat": "power",
    }  # fmt: skip
    if axis.logarithmic:
        result["type"] = "log"
    if axis.categories:
        result |= {"tickmode": "array", "tickvals": [*range(len(axis.categories))]}
        result["ticktext"] = [_text(name) for name in axis.categories]
    if axis.ticks:
        result |= {"tickmode": "array", "tickvals": [*axis.ticks]}
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
            if mark.name:  # a shape has no place in the legend
                data.append({"type": "scatter", "mode": "lines", "x": [None], "y": [None],
                             "line": line, **_legend(mark.name)})  # fmt: skip
        elif isinstance(mark, Note):
            notes.append({"x": mark.x, "y": mark.y, "text": _text(mark.text), "showarrow": False,
                          "xanchor": "left", "font": {"color": f"@{mark.colour}"}})  # fmt: skip
        else:
            data += _plane_traces(mark, chart)
    if any(isinstance(mark, Bars) and mark.horizontal for mark in chart.marks):
        layout["yaxis"]["autorange"] = "reversed"
    layout |= {"shapes": shapes, "annotations": notes, "barmode": "overlay"}
    return {"data": data, "layout": layout}


def _plane_traces(mark: LineMark | Dots | Area | Bars, chart: PlaneChart) -> list[dict[str, Any]]:
    match mark:
        case LineMark():
            return [_flat(mark.x, mark.y) | _line_style(mark)]
        case Dots():
            trace = _flat(mark.x, mark.y)
            if mark.u is not None:
                colour = mark.colour if mark.values is None else "reference"
                trace["error_y"] = {
                    "type": "data",
                    "array": _numbers(mark.u),
                    "thickness": 1,
                    "color": f"@{colour}",
                }
            return [trace | _point_style(mark, chart.scale, "%{x:.5g}, %{y:.5g}")]
        case Area():
            x, y = np.append(mark.x, mark.x[::-1]), np.append(mark.high, mark.low[::-1])
            return [_flat(x, y) | _area_style(mark)]
        case Bars():
            return _bar_traces(mark)


def _flat(x: FloatArray, y: FloatArray) -> dict[str, Any]:
    return {"type": "scatter", "x": _numbers(x), "y": _numbers(y)}


def _bar_traces(mark: Bars) -> list[dict[str, Any]]:
    along, across = ("x", "y") if mark.horizontal else ("y", "x")
    trace: dict[str, Any] = {
        "type": "bar",
        across: _numbers(mark.places),
        along: _numbers(mark.values),
        "orientation": "h" if mark.horizontal else "v",
        "width": mark.width,
        "marker": {"color": f"@{mark.colour}"},
    } | _legend(mark.name)
    if mark.base is not None:
        trace["base"] = _numbers(mark.base)
    if mark.u is not None:
        trace[f"error_{along}"] = {"type": "data", "array": _numbers(mark.u), "color": "@ink"}
    if not mark.texts:
        return [trace]
    ends = mark.values + (0.0 if mark.base is None else mark.base)
    words = {
        "type": "scatter",
        "mode": "text",
        across: _numbers(mark.places),
        along: _numbers(ends + (0.0 if mark.u is None else mark.u)),
        "text": [f" {_text(text)}" for text in mark.texts],
        "textposition": "middle right" if mark.horizontal else "top center",
        "cliponaxis": False,
        "hoverinfo": "skip",
        "showlegend": False,
    }
    return [trace, words]


def _line_style(mark: LineMark) -> dict[str, Any]:
    line = {"color": f"@{mark.colour}", "width": mark.width + 0.4}
    if mark.dashed:
        line["dash"] = "dash"
    mode = "lines+markers" if mark.marked else "lines"
    return {"mode": mode, "line": line, "marker": {"size": 5}} | _legend(mark.name)


def _point_style(mark: Dots, scale: Scale | None, place: str) -> dict[str, Any]:
    style = {"mode": "markers", "marker": _marker(mark, scale)} | _legend(mark.name)
    return style | _hover(mark, scale, place)


def _hover(mark: Dots | SpacePoints, scale: Scale | None, place: str) -> dict[str, Any]:
    """What is shown beside a point, and its row for a click."""
    rows = len(mark.positions if isinstance(mark, SpacePoints) else mark.x)
    template = place
    if mark.values is not None and scale is not None:
        shown = "10^%{marker.color:.4g}" if scale.logarithmic else "%{marker.color:.4g}"
        template += f"<br>{_text(scale.label)} {shown} {_text(scale.unit)}"
    if mark.labels:
        template = "%{text}<br>" + template
    style: dict[str, Any] = {"hovertemplate": template + "<extra></extra>"}
    style["customdata"] = [*range(rows)]
    if mark.labels:
        style["text"] = [*map(_text, mark.labels)]
    return style


def _area_style(mark: Area) -> dict[str, Any]:
    return {
        "mode": "lines",
        "line": {"width": 0},
        "fill": "toself",
        "fillcolor": f"@{mark.colour}~{round(100.0 * min(max(mark.opacity, 0.05), 0.64))}",
        "hoverinfo": "skip",
    } | _legend(mark.name)


def _polar(chart: PolarChart) -> PlotlyFigure:
    data: list[dict[str, Any]] = []
    for mark in chart.marks:
        match mark:
            case Rule():
                circle = np.linspace(0.0, 2.0 * np.pi, 181)
                line = LineMark(
                    circle, np.full(181, mark.value), mark.name, mark.colour, dashed=True
                )
                data.append(_around(line.x, line.y) | _line_style(line))
            case LineMark():
                data.append(_around(mark.x, mark.y) | _line_style(mark))
            case Dots():
                place = "azimuth %{theta:.1f}°, %{r:.4g} " + _text(chart.radius.unit)
                data.append(_around(mark.x, mark.y) | _point_style(mark, chart.scale, place))
            case Area():
                x, y = np.append(mark.x, mark.x[::-1]), np.append(mark.high, mark.low[::-1])
                seen = np.isfinite(y)
                data.append(_around(x[seen], y[seen]) | _area_style(mark))
    radial: dict[str, Any] = {
        "angle": 112,
        "tickangle": 112,
        "gridcolor": "@grid",
        "linecolor": "@grid",
    }
    if chart.radius.ticks:
        radial |= {"tickmode": "array", "tickvals": [*chart.radius.ticks]}
    if chart.radius.low is not None and chart.radius.high is not None:
        radial["range"] = [chart.radius.low, chart.radius.high]
    elif chart.radius.low == 0.0:
        radial["rangemode"] = "tozero"
    names = [*map(_text, compass_of(*chart.directions))]
    around = {"tickmode": "array", "tickvals": [*range(0, 360, 45)], "ticktext": names,
              "gridcolor": "@grid", "linecolor": "@ink"}  # fmt: skip
    polar = {"bgcolor": "@paper", "radialaxis": radial, "angularaxis": around}
    margin = {"l": 48, "r": 48, "t": 100, "b": 84}
    return {"data": data, "layout": {"polar": polar, "margin": margin}}


def _around(azimuth: FloatArray, radius: FloatArray) -> dict[str, Any]:
    theta = _numbers(np.asarray(azimuth) / DEGREE)
    return {"type": "scatterpolar", "theta": theta, "r": _numbers(radius)}


def _top_view(chart: TopView) -> PlotlyFigure:
    largest = float(chart.polar_deg.max())
    side = np.linspace(-largest, largest, 91)
    x, y = np.meshgrid(side, side)
    polar, azimuth = np.hypot(x, y), np.arctan2(y, x) / DEGREE % 360.0
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": _numbers(side),
            "y": _numbers(side),
            "z": _numbers(_on_directions(chart, polar, azimuth)),
            "customdata": np.round(np.dstack([polar, azimuth]), 1).tolist(),
            "hovertemplate": f"{_text(chart.scale.label)} %{{z:.4g}} {_text(chart.scale.unit)}<br>"
            "polar %{customdata[0]}°, azimuth %{customdata[1]}°<extra></extra>",
            "colorscale": _COLOUR_SCALES[chart.scale.signed],
            "zmin": chart.scale.low,
            "zmax": chart.scale.high,
            "zsmooth": False,
            "colorbar": _colour_bar(chart.scale),
        }
    ]
    if chart.node_polar_deg is not None and chart.node_azimuth_deg is not None:
        turn = chart.node_azimuth_deg * DEGREE
        nodes = Dots(chart.node_polar_deg * np.cos(turn), chart.node_polar_deg * np.sin(turn),
                       chart.node_name, "ink", symbol="ring", size=4.0,
                       labels=chart.node_labels)  # fmt: skip
        trace = _flat(nodes.x, nodes.y) | _point_style(nodes, None, chart.node_name)
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
    """Values between the directions of the grid; not a number outside."""
    from scipy.interpolate import RegularGridInterpolator

    around = np.append(chart.azimuth_deg, chart.azimuth_deg[0] + 360.0)
    values = np.hstack([chart.values, chart.values[:, :1]])
    inside = RegularGridInterpolator(
        (chart.polar_deg, around), values, bounds_error=False, fill_value=np.nan
    )
    azimuth = (azimuth - chart.azimuth_deg[0]) % 360.0 + chart.azimuth_deg[0]
    return np.asarray(inside(np.dstack([polar, azimuth])))


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


def _space(chart: SpaceChart) -> PlotlyFigure:
    data = [trace for mark in chart.marks for trace in _space_traces(mark, chart)]
    axis: dict[str, Any] = {"backgroundcolor": "@paper", "gridcolor": "@grid"}
    axis |= {"zerolinecolor": "@grid", "showspikes": False}
    middle, sides = box_of(chart)
    scene: dict[str, Any] = {}
    for name, center, side in zip("xyz", middle.tolist(), sides.tolist(), strict=True):
        title = {"text": f"{name.upper()} / {_text(chart.unit)}", "font": {"size": 12}}
        ends = [center - 0.53 * side, center + 0.53 * side]
        count = max(2, round(6.0 * side / float(sides.max())))
        own = {"title": title, "tickfont": {"size": 10}, "range": ends, "nticks": count}
        scene[f"{name}axis"] = axis | own
    turn, rise = math.radians(chart.azimuth), math.radians(chart.elevation)
    eye = {"x": 2.3 * math.cos(turn) * math.cos(rise), "y": 2.3 * math.sin(turn) * math.cos(rise)}
    eye["z"] = 2.3 * math.sin(rise)
    # Plotly's own "data" makes the sides' product one: a long part would leave the picture.
    ratio = sides / float(np.linalg.norm(sides)) * 1.7
    scene |= {"aspectmode": "manual", "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True))}
    scene |= {"camera": {"eye": eye, "center": {"x": 0, "y": 0, "z": -0.12}}}
    return {"data": data, "layout": {"scene": scene, "margin": {"l": 0, "r": 0, "t": 64, "b": 8}}}


def _space_traces(mark: SpaceMark, chart: SpaceChart) -> list[dict[str, Any]]:
    match mark:
        case SpacePoints():
            marker = _marker(mark, chart.scale)
            if mark.symbol == "cross":  # in space a letter of a font, which ✖ is not in
                marker["symbol"] = "cross"
            style = {"mode": "markers", "marker": marker} | _legend(mark.name)
            place = f"%{{x:.4f}}, %{{y:.4f}}, %{{z:.4f}} {_text(chart.unit)}"
            return [_scattered(mark.positions) | style | _hover(mark, chart.scale, place)]
        case SpaceLines():
            gaps = np.full_like(mark.starts, np.nan)
            path = np.stack([mark.starts, mark.ends, gaps], axis=1).reshape(-1, 3)
            line = {"color": f"@{mark.colour}", "width": 1.5 * mark.width}
            style = {"mode": "lines", "line": line, "hoverinfo": "skip"} | _legend(mark.name)
            return [_scattered(path) | style]
        case SpaceMesh():
            return [_mesh_trace(mark, chart.scale)]
        case SpaceNotes():
            words = {"mode": "text", "text": [*map(_text, mark.texts)], "showlegend": False,
                     "textfont": {"color": f"@{mark.colour}"}, "hoverinfo": "skip"}  # fmt: skip
            return [_scattered(mark.positions) | words]
        case SpaceArrow():
            end = mark.start + mark.vector
            u, v, w = (0.3 * mark.vector).tolist()
            style = {"mode": "lines+text", "textposition": "middle right",
                     "line": {"color": f"@{mark.colour}", "width": 6},
                     "text": [_text(mark.name), ""], "textfont": {"color": f"@{mark.colour}"},
                     "hoverinfo": "skip", "showlegend": False}  # fmt: skip
            head = {"type": "cone", "u": [u], "v": [v], "w": [w], "anchor": "tip",
                    "sizemode": "raw", "showscale": False, "hoverinfo": "skip",
                    "colorscale": [[0, f"@{mark.colour}"], [1, f"@{mark.colour}"]]}  # fmt: skip
            x, y, z = ([value] for value in _numbers(end))
            return [
                _scattered(np.stack([mark.start, end])) | style,
                head | {"x": x, "y": y, "z": z},
            ]


def _scattered(positions: FloatArray) -> dict[str, Any]:
    x, y, z = (_numbers(column) for column in positions.T)
    return {"type": "scatter3d", "x": x, "y": y, "z": z}


def _mesh_trace(mark: SpaceMesh, scale: Scale | None) -> dict[str, Any]:
    x, y, z = (_numbers(column) for column in mark.vertices.T)
    i, j, k = (column.tolist() for column in np.asarray(mark.triangles, dtype=np.int64).T)
    trace: dict[str, Any] = {"type": "mesh3d", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k}
    # Much light from everywhere: strong shadows would change the colours of values.
    trace["lighting"] = {"ambient": 0.75, "diffuse": 0.35, "specular": 0.05}
    trace |= {"opacity": mark.opacity, "flatshading": mark.values is None} | _legend(mark.name)
    if mark.values is None or scale is None:
        return trace | {"color": f"@{mark.colour}", "hoverinfo": "skip"}
    trace |= _in_colours(mark.values, scale, "intensity")
    shown = "%{intensity:.4g}"
    if scale.logarithmic:
        shown, trace["text"] = "%{text}", [f"{value:.4g}" for value in mark.values.tolist()]
    return trace | {
        "hovertemplate": f"{_text(scale.label)} {shown} {_text(scale.unit)}<extra></extra>"
    }
