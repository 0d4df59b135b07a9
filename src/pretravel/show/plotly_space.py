"""Charts in space as Plotly's JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pretravel.base import FloatArray
from pretravel.show.chart import (
    Scale,
    SpaceChart,
    box_of,
)
from pretravel.show.chart_marks import (
    SpaceArrow,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
)
from pretravel.show.plotly_parts import (
    PlotlyFigure,
    escaped,
    hover_style,
    in_colours,
    legend_entry,
    marker_style,
    plain_numbers,
)


def space_figure(chart: SpaceChart) -> PlotlyFigure:
    """A chart in space."""
    data = [trace for mark in chart.marks for trace in _space_traces(mark, chart)]
    axis: dict[str, Any] = {"backgroundcolor": "@paper", "gridcolor": "@grid"}
    axis |= {"zerolinecolor": "@grid", "showspikes": False}
    middle, sides = box_of(chart)
    scene: dict[str, Any] = {}
    for name, center, side in zip("xyz", middle.tolist(), sides.tolist(), strict=True):
        title = {"text": f"{name.upper()} / {escaped(chart.unit)}", "font": {"size": 12}}
        ends = [center - 0.53 * side, center + 0.53 * side]
        count = max(2, round(6.0 * side / float(sides.max())))
        own = {"title": title, "tickfont": {"size": 10}, "range": ends, "nticks": count}
        scene[f"{name}axis"] = axis | own
    turn, rise = math.radians(chart.azimuth), math.radians(chart.elevation)
    # Plotly's own "data" makes the sides' product one: a long part would leave the picture.
    ratio = sides / float(np.linalg.norm(sides)) * 1.7
    far = 2.3 * max(1.0, float(ratio[2]) / 1.25)  # the titles below a high body need room
    eye = {"x": far * math.cos(turn) * math.cos(rise), "y": far * math.sin(turn) * math.cos(rise)}
    eye["z"] = far * math.sin(rise)
    scene |= {"aspectmode": "manual", "aspectratio": dict(zip("xyz", ratio.tolist(), strict=True))}
    said = (mark for mark in chart.marks if isinstance(mark, SpaceNotes))
    scene["annotations"] = [note for mark in said for note in _notes(mark)]
    scene |= {"camera": {"eye": eye, "center": {"x": 0, "y": 0, "z": -0.12}}}
    if chart.bare:
        for name in "xyz":
            scene[f"{name}axis"] |= {"visible": False}
        scene["camera"] = {
            "eye": {k: 0.75 * v for k, v in eye.items()},
            "center": {"x": 0, "y": 0, "z": 0},
        }
    return {"data": data, "layout": {"scene": scene, "margin": {"l": 0, "r": 0, "t": 64, "b": 8}}}


def _space_traces(mark: SpaceMark, chart: SpaceChart) -> list[dict[str, Any]]:
    match mark:
        case SpacePoints():
            marker = marker_style(mark, chart.scale)
            if mark.symbol == "cross":  # in space a letter of a font, which ✖ is not in
                marker["symbol"] = "cross"
            style = {"mode": "markers", "marker": marker} | legend_entry(mark.name)
            place = f"%{{x:.4f}}, %{{y:.4f}}, %{{z:.4f}} {escaped(chart.unit)}"
            return [_scattered(mark.positions) | style | hover_style(mark, chart.scale, place)]
        case SpaceLines():
            gaps = np.full_like(mark.starts, np.nan)
            path = np.stack([mark.starts, mark.ends, gaps], axis=1).reshape(-1, 3)
            line = {"color": f"@{mark.colour}", "width": 1.5 * mark.width}
            style = {"mode": "lines", "line": line, "hoverinfo": "skip"} | legend_entry(mark.name)
            return [_scattered(path) | style]
        case SpaceMesh():
            return [_mesh_trace(mark, chart.scale)]
        case SpaceNotes():
            return []  # annotations of the scene
        case SpaceArrow():
            end = mark.start + mark.vector
            u, v, w = (0.3 * mark.vector).tolist()
            style = {"mode": "lines+text", "line": {"color": f"@{mark.colour}", "width": 6},
                     **_arrow_name(mark, chart), "textfont": {"color": f"@{mark.colour}"},
                     "hoverinfo": "skip", "showlegend": False}  # fmt: skip
            head = {"type": "cone", "u": [u], "v": [v], "w": [w], "anchor": "tip",
                    "sizemode": "raw", "showscale": False, "hoverinfo": "skip",
                    "colorscale": [[0, f"@{mark.colour}"], [1, f"@{mark.colour}"]]}  # fmt: skip
            x, y, z = ([value] for value in plain_numbers(end))
            return [
                _scattered(np.stack([mark.start, end])) | style,
                head | {"x": x, "y": y, "z": z},
            ]


def _notes(mark: SpaceNotes) -> list[dict[str, Any]]:
    """Words with lines to their places; `fitted` moves them so that none covers another one."""
    style = {"ax": 0, "ay": 0, "arrowhead": 0, "arrowwidth": 1, "arrowcolor": f"@{mark.colour}",
             "bgcolor": "@paper", "bordercolor": f"@{mark.colour}", "borderwidth": 0.5,
             "opacity": 0.9, "font": {"size": 12, "color": f"@{mark.colour}"}}  # fmt: skip
    places = (plain_numbers(row) for row in mark.positions)
    return [
        {**dict(zip("xyz", place, strict=True)), "text": escaped(text.strip()), **style}
        for place, text in zip(places, mark.texts, strict=True)
    ]


def _arrow_name(arrow: SpaceArrow, chart: SpaceChart) -> dict[str, Any]:
    """The name next to an arrow: at the upper end, or behind the tail of a level one."""
    x, y, z = arrow.vector.tolist()
    names = [escaped(arrow.name), ""]
    if abs(z) >= 0.5 * math.hypot(x, y, z):
        return {"text": names[::-1] if z > 0.0 else names, "textposition": "middle right"}
    turn = math.radians(chart.azimuth)
    to_right = y * math.cos(turn) - x * math.sin(turn) > 0.0
    return {"text": names, "textposition": "top left" if to_right else "top right"}


def _scattered(positions: FloatArray) -> dict[str, Any]:
    x, y, z = (plain_numbers(column) for column in positions.T)
    return {"type": "scatter3d", "x": x, "y": y, "z": z}


_EVERY_NORMAL = {"facenormalsepsilon": 0.0, "vertexnormalsepsilon": 0.0}
"""By its defaults Plotly gives small triangles, 0.0005 of its scene's unit of area, no normal: they
are dark on a bright surface."""


def _mesh_trace(mark: SpaceMesh, scale: Scale | None) -> dict[str, Any]:
    x, y, z = (plain_numbers(column) for column in mark.vertices.T)
    i, j, k = (column.tolist() for column in np.asarray(mark.triangles, dtype=np.int64).T)
    trace: dict[str, Any] = {"type": "mesh3d", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k}
    # Much light from everywhere: strong shadows would change the colours of values.
    trace["lighting"] = {"ambient": 0.75, "diffuse": 0.35, "specular": 0.05, **_EVERY_NORMAL}
    trace |= {"opacity": mark.opacity, "flatshading": mark.values is None} | legend_entry(mark.name)
    if mark.values is None or scale is None:
        return trace | {"color": f"@{mark.colour}", "hoverinfo": "skip"}
    trace |= in_colours(mark.values, scale, "intensity")
    shown = "%{intensity:.4g}"
    if scale.logarithmic:
        shown, trace["text"] = "%{text}", [f"{value:.4g}" for value in mark.values.tolist()]
    return trace | {
        "hovertemplate": f"{escaped(scale.label)} {shown} {escaped(scale.unit)}<extra></extra>"
    }
