"""Parts of Plotly's JSON that several kinds of chart have."""

from __future__ import annotations

import html
import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.show.chart import (
    Scale,
)
from pretravel.show.chart_marks import (
    Area,
    Dots,
    LineMark,
    SpacePoints,
)

PlotlyFigure: TypeAlias = dict[str, Any]


_SYMBOLS = {"dot": "circle", "ring": "circle-open", "cross": "x", "diamond": "diamond"}


COLOUR_SCALES = {
    signed: [[place / 10.0, f"@{name}{place}"] for place in range(11)]
    for signed, name in ((False, "low"), (True, "signed"))
}
"""Names of `scale_colours`."""


SMALL = ("<span style='font-size:12px'>", "</span>")
"""The HTML around the note of a chart."""


def escaped(text: str) -> str:
    """Text that Plotly shows as it is: it reads some HTML."""
    return html.escape(text, quote=False).replace("\n", "<br>")


def plain_numbers(values: npt.ArrayLike) -> list[Any]:
    """Numbers with six digits; null where there is none, as in masked places."""
    # Plotly draws what a mask hides: NetCDF's fill value, 1e37.
    array = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
    if array.ndim > 1:
        return [plain_numbers(row) for row in array]
    return [float(f"{v:.6g}") if math.isfinite(v) else None for v in array.tolist()]


def colour_bar(scale: Scale) -> dict[str, Any]:
    """The bar that explains the colours of a scale."""
    title = {"text": escaped(scale.text), "side": "right"}
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


def marker_style(mark: Dots | SpacePoints, scale: Scale | None) -> dict[str, Any]:
    """The marker of points: one colour, or the colours of a scale."""
    marker: dict[str, Any] = {"size": mark.size + 1.0, "symbol": _SYMBOLS[mark.symbol]}
    if mark.values is None or scale is None:
        return marker | {"color": f"@{mark.colour}"}
    marker["line"] = {"color": "@reference", "width": 0.6}  # the middle of a scale is pale
    return marker | in_colours(mark.values, scale, "color")


def in_colours(values: FloatArray, scale: Scale, key: str) -> dict[str, Any]:
    """Values in the colours of a scale, of a marker or (key intensity) of a surface."""
    low, high = scale.low, scale.high
    if scale.logarithmic:
        values = np.log10(np.clip(values, low, high))
        low, high = math.log10(low), math.log10(high)
    return {
        key: plain_numbers(values),
        "colorscale": COLOUR_SCALES[scale.signed],
        "cmin": low,
        "cmax": high,
        "showscale": True,
        "colorbar": colour_bar(scale),
    }


def legend_entry(name: str) -> dict[str, Any]:
    """The name of a trace, which stands in the legend unless it is empty."""
    return {"name": escaped(name), "showlegend": bool(name)}


def flat_trace(x: FloatArray, y: FloatArray) -> dict[str, Any]:
    """A trace over straight axes."""
    return {"type": "scatter", "x": plain_numbers(x), "y": plain_numbers(y)}


def line_style(mark: LineMark) -> dict[str, Any]:
    """How a line is drawn."""
    line = {"color": f"@{mark.colour}", "width": mark.width + 0.4}
    if mark.dashed:
        line["dash"] = "dash"
    mode = "lines+markers" if mark.marked else "lines"
    return {"mode": mode, "line": line, "marker": {"size": 5}} | legend_entry(mark.name)


def point_style(mark: Dots, scale: Scale | None, place: str) -> dict[str, Any]:
    """How points are drawn, and what is shown next to them."""
    style = {"mode": "markers", "marker": marker_style(mark, scale)} | legend_entry(mark.name)
    return style | hover_style(mark, scale, place)


def hover_style(mark: Dots | SpacePoints, scale: Scale | None, place: str) -> dict[str, Any]:
    """What is shown next to a point, and its row for a click."""
    rows = len(mark.positions if isinstance(mark, SpacePoints) else mark.x)
    template = place
    if mark.values is not None and scale is not None:
        shown = "10^%{marker.color:.4g}" if scale.logarithmic else "%{marker.color:.4g}"
        template += f"<br>{escaped(scale.label)} {shown} {escaped(scale.unit)}"
    if mark.labels:
        template = "%{text}<br>" + template
    style: dict[str, Any] = {"hovertemplate": template + "<extra></extra>"}
    style["customdata"] = [*range(rows)]
    if mark.labels:
        style["text"] = [*map(escaped, mark.labels)]
    return style


def area_style(mark: Area) -> dict[str, Any]:
    """How an area is drawn."""
    return {
        "mode": "lines",
        "line": {"width": 0},
        "fill": "toself",
        "fillcolor": f"@{mark.colour}~{round(100.0 * min(max(mark.opacity, 0.05), 0.64))}",
        "hoverinfo": "skip",
    } | legend_entry(mark.name)
