"""Charts drawn by matplotlib, for files and paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.base import DEGREE, FEW_PLACES, BoolArray, FloatArray, IntArray
from pretravel.show.chart import (
    COMPASS,
    Axis,
    Chart,
    PlaneChart,
    PolarChart,
    Scale,
    SpaceChart,
    TopView,
    View,
    box_of,
    compass_of,
    corners_of,
    rings_to,
    title_and_frame,
)
from pretravel.show.chart_marks import (
    Area,
    Bars,
    Contours,
    Dots,
    LineMark,
    Mark,
    Note,
    Rule,
    SpaceArrow,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
)
from pretravel.show.colours import LIGHT, SEQUENTIAL, SIGNED
from pretravel.show.space_notes import NoteInSpace, draw_notes
from pretravel.show.style import new_figure, some_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from matplotlib.projections.polar import PolarAxes
    from mpl_toolkits.mplot3d import Axes3D

_LEGEND_SIGNS = 66
_BARE = 1.1
"""Zoom of a chart without axes, whose numbers need no room."""
_WHOLE_PAGE = (7.4, 6.8)
"""Inches of a body alone: what is empty above and below it is left out of an image."""
_NEAR = 5e-3
"""Of the size of a body: what is nearer to its surface lies on it, and is not hidden by it."""
_PIECES = 24
"""About as many signs are as wide as a chart."""
_ABOVE_COMPASS = 32.0
"""Points from a polar chart to its title. Titles have a height: to find a free one, matplotlib
places all numbers of the axes once more in each of three turns."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SYMBOLS = {"dot": "o", "ring": "o", "cross": "x", "diamond": "D"}


def drawn_figure(view: View, *, interactive: bool = False) -> Figure:
    """A view as a matplotlib figure.

    Parameters
    ----------
    view : View
    interactive : bool
        A figure of pyplot, which notebooks show and ``plt.show()`` opens.

    Returns
    -------
    matplotlib.figure.Figure

    >>> line = LineMark(np.arange(3.0), np.arange(3.0), "force")
    >>> chart = PlaneChart("Force", Axis("time", "s"), Axis("force", "N"), (line,))
    >>> drawn_figure(View("Touch", (chart,))).axes[0].get_xlabel()
    'time / s'
    """
    columns = min(view.columns, len(view.charts))
    rows = math.ceil(len(view.charts) / columns)
    width, height = max(4.6 * columns, 6.0), 4.7 * rows + 0.2
    if view.is_bare:
        width, height = _WHOLE_PAGE
    alike = [chart.title for chart in view.charts] == [view.title]
    figure = new_figure(width, height, "" if alike else view.title, interactive=interactive)
    for index, chart in enumerate(view.charts, start=1):
        _draw(chart, figure, (rows, columns, index))
    return figure


def _draw(chart: Chart, figure: Figure, cell: tuple[int, int, int]) -> None:
    match chart:
        case PlaneChart():
            _plane(chart, figure, cell)
        case PolarChart():
            _polar(chart, figure, cell)
        case TopView():
            _top_view(chart, figure, cell)
        case SpaceChart():
            _space(chart, figure, cell)


def _plane(chart: PlaneChart, figure: Figure, cell: tuple[int, int, int]) -> None:
    axes = figure.add_subplot(*cell)
    for mark in chart.marks:
        _draw_mark(mark, axes, chart.scale)
    _set_axis(axes, chart.x, "x")
    _set_axis(axes, chart.y, "y")
    if chart.equal:
        fixed = None not in (chart.x.low, chart.x.high, chart.y.low, chart.y.high)
        axes.set_aspect("equal", adjustable="box" if fixed else "datalim")
    axes.grid(color=LIGHT["grid"], lw=0.6)
    axes.set_axisbelow(True)
    axes.set_title(chart.title, fontsize=11, y=1.0)
    _legend_and_note(axes, chart.note, below=0.16)


def _polar(chart: PolarChart, figure: Figure, cell: tuple[int, int, int]) -> None:
    axes = _polar_axes(figure, cell, title_and_frame(chart), compass_of(*chart.directions))
    for mark in chart.marks:
        _draw_mark(mark, axes, chart.scale)
    axes.set_ylim(chart.radius.low, chart.radius.high)
    axes.set_rlabel_position(112.0)
    if chart.radius.ticks:
        axes.set_yticks(chart.radius.ticks)
    _on_paper(axes)
    axes.grid(color=LIGHT["grid"], lw=0.6)
    axes.text(0.5, -0.15, f"radius: {chart.radius.text}", transform=axes.transAxes, ha="center",
              fontsize=8, color=LIGHT["ink"])  # fmt: skip
    _legend_and_note(axes, chart.note, below=0.17)


def _top_view(chart: TopView, figure: Figure, cell: tuple[int, int, int]) -> None:
    axes = _polar_axes(figure, cell, title_and_frame(chart))
    azimuth = np.append(chart.azimuth_deg, chart.azimuth_deg[0] + 360.0) * DEGREE
    values = np.hstack([chart.values, chart.values[:, :1]])
    mesh = axes.pcolormesh(azimuth, chart.polar_deg, values, shading="gouraud",
                           **_colouring(chart.scale))  # fmt: skip
    if chart.node_azimuth_deg is not None and chart.node_polar_deg is not None:
        axes.plot(chart.node_azimuth_deg * DEGREE, chart.node_polar_deg, "o", mfc="w", mec="k",
                  ms=11 if chart.numbered else 3, mew=0.4, clip_on=False, zorder=6,
                  ls="", label=_named(chart.node_name))  # fmt: skip
        places = zip(chart.node_azimuth_deg * DEGREE, chart.node_polar_deg, strict=True)
        for number, place in enumerate(places if chart.numbered else (), start=1):
            axes.annotate(str(number), place, ha="center", va="center", fontsize=7, zorder=7,
                          annotation_clip=False)  # fmt: skip
    axes.set_ylim(0.0, float(chart.polar_deg.max()))
    axes.set_axisbelow(False)
    rings = rings_to(float(chart.polar_deg.max()))
    axes.set_yticks(rings, [f"{ring:.3g}°" for ring in rings])
    axes.set_rlabel_position(112.0)
    _on_paper(axes)
    axes.grid(color="w", alpha=0.35, lw=0.5)
    figure.colorbar(mesh, ax=axes, shrink=0.75, pad=0.12, label=chart.scale.text)
    _legend_and_note(axes, chart.note, below=0.1)


def _on_paper(axes: PolarAxes) -> None:
    """The numbers of the rings stand on a light background: no mark and no colour hides them."""
    for label in axes.get_yticklabels():
        label.set_bbox({"facecolor": "w", "alpha": 0.75, "edgecolor": "none", "pad": 0.8})
        label.set_zorder(5)


def _space(chart: SpaceChart, figure: Figure, cell: tuple[int, int, int]) -> None:
    # Marks are drawn in their order above all meshes, whose triangles are sorted by depth.
    axes: Axes3D = figure.add_subplot(*cell, projection="3d", computed_zorder=False)
    if chart.bare:
        axes.set_proj_type("ortho")
    axes.view_init(elev=chart.elevation, azim=chart.azimuth)
    _space_meshes(chart, axes)
    for mark in chart.marks:
        _draw_space(mark, axes, chart)
    middle, sides = box_of(chart)
    for name, center, side in zip("xyz", middle.tolist(), sides.tolist(), strict=True):
        getattr(axes, f"set_{name}lim")(center - 0.53 * side, center + 0.53 * side)
        getattr(axes, f"set_{name}label")(f"{name.upper()} / {chart.unit}", fontsize=8)
        getattr(axes, f"{name}axis").set_major_locator(_few_ticks(side, float(sides.max())))
    axes.set_box_aspect(tuple(sides.tolist()), zoom=1.0)
    axes.set_box_aspect(tuple(sides.tolist()), zoom=_filling(axes, chart) * _room(chart))
    if chart.bare:
        axes.set_axis_off()
    draw_notes(_notes_in_sight(chart), axes)
    axes.tick_params(labelsize=7)
    axes.set_title(chart.title if chart.bare else title_and_frame(chart), fontsize=11, y=1.0)
    if chart.scale is not None:
        from matplotlib.cm import ScalarMappable

        mappable = ScalarMappable(**_colouring(chart.scale))
        # A bare body has no numbers of axes between it and its scale.
        shrink, pad, fraction = (0.5, 0.0, 0.08) if chart.bare else (0.65, 0.14, 0.15)
        figure.colorbar(
            mappable, ax=axes, label=chart.scale.text, shrink=shrink, pad=pad, fraction=fraction
        )
    _legend_and_note(
        axes, chart.note, below=0.02 if chart.bare else 0.18, meshes=_mesh_patches(chart)
    )


def _room(chart: SpaceChart) -> float:
    """How much larger a body is drawn where no axes need room."""
    return _BARE if chart.bare else 1.0


def _filling(axes: Axes3D, chart: SpaceChart) -> float:
    """Zoom with which the box fills its panel, as it is seen, with room for the numbers.

    A bare chart has no box: its marks fill the panel.
    """
    from itertools import product

    from mpl_toolkits.mplot3d.proj3d import proj_transform

    limits = axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()
    corners = corners_of(chart).T if chart.bare else np.array(list(product(*limits))).T
    across, up, _ = proj_transform(*corners, axes.get_proj())
    panel = np.abs([*axes.viewLim.intervalx, *axes.viewLim.intervaly]).min()
    return float(_OF_THE_PANEL * panel / np.abs([across, up]).max())


_OF_THE_PANEL = 0.88
"""Share that a box takes of its panel; numbers and names of the axes stand next to it."""


def _few_ticks(side: float, longest: float) -> Any:
    """Numbers that do not touch each other along a short side."""
    from matplotlib.ticker import MaxNLocator

    count = max(1, round(5.0 * side / longest))
    return MaxNLocator(count, steps=[1, 2, 5, 10], min_n_ticks=min(count, 2))


def _polar_axes(
    figure: Figure, cell: tuple[int, int, int], title: str, compass: Sequence[str] = COMPASS
) -> PolarAxes:
    from matplotlib.projections.polar import PolarAxes

    axes = figure.add_subplot(*cell, projection="polar")
    assert isinstance(axes, PolarAxes)
    axes.set_title(title, fontsize=11, y=1.0, pad=_ABOVE_COMPASS)
    axes.tick_params(labelsize=8)
    axes.set_thetagrids(np.arange(0.0, 360.0, 45.0), compass)
    axes.set_axisbelow(True)
    return axes


def _set_axis(axes: Axes, axis: Axis, name: str) -> None:
    getattr(axes, f"set_{name}label")(axis.text)
    if axis.logarithmic:
        getattr(axes, f"set_{name}scale")("log")
    if axis.categories:
        getattr(axes, f"set_{name}ticks")(range(len(axis.categories)), axis.categories)
        axes.tick_params(axis=name, labelsize=8)  # type: ignore[arg-type]
    if axis.ticks:
        getattr(axes, f"set_{name}ticks")(axis.ticks, axis.tick_names or None)
    if axis.tick_names:
        axes.tick_params(axis=name, labelsize=8)  # type: ignore[arg-type]
    if (axis.low, axis.high) != (None, None):  # which would end the automatic limits
        getattr(axes, f"set_{name}lim")(axis.low, axis.high)
    if axis.logarithmic and not axis.ticks:
        _plain_numbers(axes, name)  # by the limits that are drawn


def _plain_numbers(axes: Axes, name: str) -> None:
    """0.5, 1, 2 along a logarithmic axis of two decades or less, 10⁻³, 10⁻² along others.

    matplotlib has 5·10⁻¹ and 10⁰ for the first; for both it sets formulas, whose grammar takes as
    long as a chart.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = getattr(axes, f"get_{name}lim")()
    along = getattr(axes, f"{name}axis")
    along.set_minor_formatter(NullFormatter())
    if high > 300.0 * low:
        along.set_major_formatter(FuncFormatter(_decade))
        return
    along.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    along.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _decade(value: float, _: int) -> str:
    return f"10{str(round(math.log10(value))).translate(_RAISED)}"


def _legend_and_note(axes: Axes, note: str, below: float, meshes: Sequence[Patch] = ()) -> None:
    handles, labels = axes.get_legend_handles_labels()
    handles, labels = [*meshes, *handles], [*(str(m.get_label()) for m in meshes), *labels]
    widest = max((len(label) for label in labels), default=1)
    columns = int(np.clip(_LEGEND_SIGNS // (widest + 6), 1, 3))
    if handles:
        axes.legend(handles, labels, loc="upper center", bbox_to_anchor=(0.5, -below),
                    fontsize=7, ncols=min(len(labels), columns), frameon=False)  # fmt: skip
    if note:
        lines = math.ceil(len(labels) / columns)
        axes.annotate(note, (0.5, -below), (0.0, -6.0 - 12.0 * lines), ha="center",
                      xycoords="axes fraction", textcoords="offset points", va="top",
                      fontsize=7, color=LIGHT["reference"], annotation_clip=False)  # fmt: skip


def _colouring(scale: Scale) -> dict[str, Any]:
    """The scale of colours, and how values are placed on it."""
    from matplotlib.colors import LogNorm, Normalize

    kind = LogNorm if scale.logarithmic else Normalize
    norm = kind(scale.low, scale.high, clip=True)
    return {"cmap": SIGNED if scale.signed else SEQUENTIAL, "norm": norm}


def _named(name: str) -> str | None:
    """A name for the legend; matplotlib leaves a name with a leading underscore out."""
    return name.lstrip("_") or None


def _draw_mark(mark: Mark, axes: Axes, scale: Scale | None) -> None:
    match mark:
        case LineMark():
            _line(mark, axes)
        case Dots():
            _points(mark, axes, scale)
        case Area():
            _band(mark, axes)
        case Bars():
            _bars(mark, axes)
        case Rule():
            _rule(mark, axes)
        case Contours():
            assert scale is not None
            _contours(mark, axes, scale)
        case Note():
            axes.annotate(mark.text, (mark.x, mark.y), fontsize=8, color=LIGHT[mark.colour])


def _line(mark: LineMark, axes: Axes) -> None:
    axes.plot(mark.x, mark.y, color=LIGHT[mark.colour], lw=mark.width, label=_named(mark.name),
              ls="--" if mark.dashed else "-", marker="." if mark.marked else "")  # fmt: skip


def _points(mark: Dots, axes: Axes, scale: Scale | None) -> None:
    rows = some_rows(np.arange(len(mark.x)))
    colour: dict[str, Any] = {"c": LIGHT[mark.colour]}
    if mark.symbol == "ring":
        colour = {"facecolors": "none", "edgecolors": LIGHT[mark.colour]}
    elif mark.values is not None and scale is not None:
        colour = {"c": mark.values[rows], **_colouring(scale), "edgecolors": "0.3",
                  "linewidths": 0.3}  # fmt: skip
    if mark.u is not None:
        axes.errorbar(mark.x[rows], mark.y[rows], mark.u[rows], fmt="none", capsize=2, lw=0.8,
                      ecolor=LIGHT[mark.colour])  # fmt: skip
    drawn = axes.scatter(mark.x[rows], mark.y[rows], s=mark.size**2, label=_named(mark.name),
                         marker=_SYMBOLS[mark.symbol], zorder=3, **colour)  # fmt: skip
    if mark.values is not None and scale is not None:
        figure = axes.get_figure()
        assert figure is not None
        figure.colorbar(drawn, ax=axes, shrink=0.8, pad=0.1, label=scale.text)


def _contours(mark: Contours, axes: Axes, scale: Scale) -> None:
    levels = np.arange(scale.low, scale.high + 0.5 * mark.step, mark.step)
    values = np.ma.masked_invalid(mark.values)
    filled = axes.contourf(mark.x, mark.y, values, levels, **_colouring(scale))
    lines = axes.contour(mark.x, mark.y, values, levels, colors=LIGHT["ink"], linewidths=0.6)
    for label in axes.clabel(lines, fontsize=7, fmt="%.4g"):
        label.set_bbox({"facecolor": "w", "alpha": 0.75, "edgecolor": "none", "pad": 0.6})
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(filled, ax=axes, shrink=0.9, pad=0.04, label=scale.text)


def _band(mark: Area, axes: Axes) -> None:
    axes.fill_between(mark.x, mark.low, mark.high, color=LIGHT[mark.colour], alpha=mark.opacity,
                      lw=0.0, label=_named(mark.name))  # fmt: skip


def _bars(mark: Bars, axes: Axes) -> None:
    base = np.zeros(len(mark.values)) if mark.base is None else mark.base
    ends = base + mark.values
    style: dict[str, Any] = {"color": LIGHT[mark.colour], "label": _named(mark.name)}
    whisker: dict[str, Any] = {"fmt": "none", "ecolor": LIGHT["ink"], "capsize": 3, "lw": 1.0}
    if mark.horizontal:
        axes.barh(mark.places, mark.values, mark.width, left=base, **style)
        if mark.u is not None:
            axes.errorbar(ends, mark.places, xerr=mark.u, **whisker)
        if not axes.yaxis_inverted():
            axes.invert_yaxis()
    else:
        axes.bar(mark.places, mark.values, mark.width, bottom=base, **style)
        if mark.u is not None:
            axes.errorbar(mark.places, ends, mark.u, **whisker)
    beyond = np.zeros(len(ends)) if mark.u is None else mark.u
    for place, end, text in zip(mark.places, ends + beyond, mark.texts, strict=False):
        at = (end, place) if mark.horizontal else (place, end)
        shift, across = ((3, 0), "left") if mark.horizontal else ((0, 3), "center")
        axes.annotate(text, at, shift, textcoords="offset points", fontsize=7, ha=across,
                      va="center" if mark.horizontal else "bottom")  # fmt: skip
    if mark.texts:
        axes.margins(x=0.15 if mark.horizontal else None, y=None if mark.horizontal else 0.12)


def _rule(mark: Rule, axes: Axes) -> None:
    style: dict[str, Any] = {"color": LIGHT[mark.colour], "lw": 1.2, "ls": "--"}
    style["label"] = _named(mark.name)
    if axes.name == "polar":
        circle = np.linspace(0.0, 2.0 * np.pi, 181)
        axes.plot(circle, np.full(181, mark.value), **style)
    elif mark.upright:
        axes.axvline(mark.value, **style)
    else:
        axes.axhline(mark.value, **style)


def _draw_space(mark: SpaceMark, axes: Axes3D, chart: SpaceChart) -> None:
    match mark:
        case SpacePoints():
            _space_points(mark, axes, chart)
        case SpaceLines():
            _space_lines(mark, axes, chart)
        case SpaceArrow():
            _space_arrow(mark, axes)
        case SpaceNotes():
            pass  # `draw_notes`, when all else has its place


def _notes_in_sight(chart: SpaceChart) -> list[NoteInSpace]:
    return [
        (place, text.strip(), LIGHT[mark.colour])
        for mark in chart.marks
        if isinstance(mark, SpaceNotes)
        for place, text, covered in zip(
            mark.positions, mark.texts, _covered(mark.positions, chart), strict=True
        )
        if not covered
    ]


def _space_points(mark: SpacePoints, axes: Axes3D, chart: SpaceChart) -> None:
    front = _in_front(mark.positions, chart)
    rows = some_rows(front[~_covered(mark.positions[front], chart)])
    colour: dict[str, Any] = {"c": LIGHT[mark.colour]}
    if mark.symbol == "ring":
        colour = {"facecolors": "none", "edgecolors": LIGHT[mark.colour]}
    elif mark.values is not None and chart.scale is not None:
        # The colour of zero is that of the paper.
        edge = {"edgecolors": "0.3", "linewidths": 0.4}
        colour = {"c": mark.values[rows], **_colouring(chart.scale), **edge}
    axes.scatter(*mark.positions[rows].T, s=mark.size**2, marker=_SYMBOLS[mark.symbol],
                 depthshade=False, label=_named(mark.name), zorder=2.0, **colour)  # fmt: skip


def _in_front(positions: FloatArray, chart: SpaceChart) -> IntArray:
    """Rows of points at a side of the meshes that is seen: matplotlib hides no point itself."""
    meshes = [mark for mark in chart.marks if isinstance(mark, SpaceMesh) and mark.outwards]
    if not meshes or not len(positions):
        return np.arange(len(positions))
    corners = np.concatenate([mesh.vertices[_triangles(mesh)] for mesh in meshes])
    outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turn, rise = chart.azimuth * DEGREE, chart.elevation * DEGREE
    eye = np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    nearest = _nearest(corners.mean(axis=1), positions)
    return np.flatnonzero(outwards[nearest] @ eye >= 0.0)


def _nearest(places: FloatArray, positions: FloatArray) -> IntArray:
    """The number of the place that is nearest to each position."""
    if len(positions) <= FEW_PLACES:
        apart = [np.sum((places - position) ** 2, axis=1) for position in positions]
        return np.asarray(np.argmin(apart, axis=1))
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query(positions)[1])


def _triangles(mesh: SpaceMesh) -> IntArray:
    return np.asarray(mesh.triangles, dtype=np.int64)


def _covered(positions: FloatArray, chart: SpaceChart) -> BoolArray:
    """Whether a body without transparency is between a place and the eye, on a bare chart."""
    covered = np.zeros(len(positions), dtype=np.bool_)
    meshes = [m for m in chart.marks if isinstance(m, SpaceMesh) and m.opacity >= 1.0]
    if not (chart.bare and meshes and len(positions)):
        return covered
    corners = np.concatenate([mesh.vertices[_triangles(mesh)] for mesh in meshes])
    turn, rise = chart.azimuth * DEGREE, chart.elevation * DEGREE
    eye = np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
    first = np.array([-np.sin(turn), np.cos(turn), 0.0])
    basis = np.column_stack([first, np.cross(eye, first), eye])  # across, up, towards the eye
    flat, places = corners @ basis, positions @ basis
    room = _NEAR * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    a, b, c = flat[:, 0], flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    seen = np.abs(area) > 0.0
    a, b, c, area = a[seen], b[seen], c[seen], area[seen]
    row, own = _in_boxes(places[:, :2], flat[seen, :, :2])
    off, a, b, c, area = places[row] - a[own], a[own], b[own], c[own], area[own]
    s = (off[:, 0] * c[:, 1] - off[:, 1] * c[:, 0]) / area
    t = (b[:, 0] * off[:, 1] - b[:, 1] * off[:, 0]) / area
    inside = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
    height = a[:, 2] + s * b[:, 2] + t * c[:, 2]
    covered[row[inside & (height > places[row, 2] + room)]] = True
    return covered


def _in_boxes(places: FloatArray, triangles: FloatArray) -> tuple[IntArray, IntArray]:
    """Rows of places, (n, 2), and of the triangles, (t, 3, 2), in whose boxes they lie."""
    from shapely import STRtree, box, points

    low, high = triangles.min(axis=1), triangles.max(axis=1)
    row, own = STRtree(box(*low.T, *high.T)).query(points(places))
    return row, own


def _space_lines(mark: SpaceLines, axes: Axes3D, chart: SpaceChart) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    starts, ends = (mark.starts, mark.ends)
    if chart.bare:
        starts, ends = _in_pieces(starts, ends)
        seen = ~_covered(0.5 * (starts + ends), chart)
        starts, ends = starts[seen], ends[seen]
    if len(starts) == 0:  # matplotlib refuses a collection without lines
        return
    rows = some_rows(np.arange(len(starts)))
    segments = np.stack([starts[rows], ends[rows]], axis=1)
    axes.add_collection3d(
        Line3DCollection(segments, colors=LIGHT[mark.colour], linewidths=mark.width,
                         label=_named(mark.name) or "_", zorder=1.0)
    )  # fmt: skip


def _in_pieces(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Long lines in short pieces, each of which is seen or hidden as a whole."""
    length = np.linalg.norm(ends - starts, axis=1)
    step = max(float(length.max(initial=0.0)) / _PIECES, 1e-9)
    counts = np.maximum(np.ceil(length / step).astype(np.int64), 1)
    rows = np.repeat(np.arange(len(starts)), counts)
    place = np.concatenate([np.arange(count) / count for count in counts.tolist()] or [np.zeros(0)])
    way = (ends - starts)[rows]
    begin = starts[rows] + place[:, None] * way
    return begin, begin + way / counts[rows, None]


def _space_meshes(chart: SpaceChart, axes: Axes3D) -> None:
    """All triangles as one collection: matplotlib sorts by depth only within a collection."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    meshes = [mark for mark in chart.marks if isinstance(mark, SpaceMesh)]
    if not meshes:
        return
    corners = np.concatenate([mesh.vertices[_triangles(mesh)] for mesh in meshes])
    faces = np.concatenate([_face_colours(mesh, chart.scale) for mesh in meshes])
    axes.add_collection3d(
        Poly3DCollection(corners, facecolors=faces, linewidths=0.0, antialiased=False)
    )


def _mesh_patches(chart: SpaceChart) -> list[Patch]:
    """What stands for the meshes in the legend."""
    from matplotlib.patches import Patch

    return [
        Patch(color=LIGHT[mark.colour], label=mark.name)
        for mark in chart.marks
        if isinstance(mark, SpaceMesh) and mark.name and mark.values is None
    ]


def _face_colours(mark: SpaceMesh, scale: Scale | None) -> FloatArray:
    """Colour and opacity of each triangle, (t, 4)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    if mark.values is not None and scale is not None:
        values = mark.values[_triangles(mark)].mean(axis=1)
        style = _colouring(scale)
        colours = colormaps[style["cmap"]](style["norm"](values))[:, :3]
    else:
        corners = mark.vertices[_triangles(mark)]
        colours = np.broadcast_to(to_rgb(LIGHT[mark.colour]), (len(corners), 3))
        colours = colours * _brightness(corners)[:, None]
    return np.column_stack([colours, np.full(len(colours), mark.opacity)])


def _brightness(corners: FloatArray) -> FloatArray:
    """Light from above, so that the shape is seen. (t,) in 0.55 to 1."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    towards = np.abs(normals @ np.array([0.36, -0.48, 0.8])) / np.where(length > 0.0, length, 1.0)
    return np.asarray(0.55 + 0.45 * towards)


def _space_arrow(mark: SpaceArrow, axes: Axes3D) -> None:
    axes.quiver(*mark.start, *mark.vector, color=LIGHT[mark.colour], lw=2.0,
                arrow_length_ratio=0.25, zorder=3.0)  # fmt: skip
    # Around the arrow's start: to its right the words would lie on what the arrow points to.
    axes.text(*(mark.start - 0.08 * mark.vector), mark.name, color=LIGHT[mark.colour], fontsize=8,
              ha="center", va="bottom")  # fmt: skip
