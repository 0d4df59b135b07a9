"""Pictures of parts, plans and sliding tips, in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.probing.inspection import InspectionPlan
from pretravel.probing.slide_history import SlideHistory
from pretravel.report.style import COLOURS, new_figure
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface, tangent_basis
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_LABELS = 60
_MESH = 25


def plot_slide(history: SlideHistory, surface: Surface, title: str = "") -> Figure:
    """A tip that slides: its contact on the surface in space, deflection and force over feed.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That it slid on.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.8)
    figure.suptitle(title or "A tip slides")
    draw_slide(figure.add_subplot(1, 2, 1, projection="3d"), history, surface)
    curve = figure.add_subplot(1, 2, 2)
    order = np.argsort(history.feed)  # of a golden section search the trials go to and fro
    feed = np.concatenate([[0.0], history.feed[order]]) / MICROMETRE
    deflection = np.concatenate([[0.0], history.deflection[order]]) / MICROMETRE
    curve.plot(feed, deflection, "o-", ms=3.5, color=COLOURS[0], label="deflection")
    curve.plot(feed, feed, ":", color=COLOURS[5], label="feed itself")
    curve.set_xlabel("feed since first contact / µm")
    curve.set_ylabel("deflection / µm")
    curve.grid(alpha=0.3)
    if np.isfinite(history.trigger_feed):
        at = history.trigger_feed / MICROMETRE
        curve.axvline(at, color=COLOURS[3], lw=1.0)
        late = at > 0.6 * feed.max()
        curve.annotate(
            f" trigger \n {at:.2f} µm ",
            (at, deflection.max()),
            va="top",
            ha="right" if late else "left",
            color=COLOURS[3],
        )
    known = order[np.isfinite(history.force[order])]
    if len(known):
        force = curve.twinx()
        force.plot(
            np.concatenate([[0.0], history.feed[known]]) / MICROMETRE,
            np.concatenate([[0.0], history.force[known]]),
            "s-",
            ms=3.0,
            color=COLOURS[1],
            label="force",
        )
        force.set_ylabel("force / N", color=COLOURS[1])
        force.set_ylim(bottom=0.0)
    curve.legend(fontsize=8, loc="lower right")
    return figure


def draw_slide(axes: Any, history: SlideHistory, surface: Surface) -> None:
    """The contact's way on a patch of the surface, in µm from its beginning."""
    from matplotlib.ticker import MaxNLocator

    start = history.start
    way = (history.contact - start) / MICROMETRE
    reach = 0.8 * max(float(np.linalg.norm(way, axis=1).max()), 2.0)
    furthest = way[np.argmax(np.linalg.norm(way, axis=1))]
    middle = start + 0.5 * furthest * MICROMETRE
    tangents = tangent_basis(history.normal[:1])[0]
    side = np.linspace(-reach, reach, 13) * MICROMETRE
    p, q = np.meshgrid(side, side)
    flat = middle + p.ravel()[:, None] * tangents[0] + q.ravel()[:, None] * tangents[1]
    patch = (surface.local(surface.nearest(flat)).point - start) / MICROMETRE
    x, y, z = (patch[:, i].reshape(p.shape) for i in range(3))
    axes.plot_surface(x, y, z, alpha=0.35, color=COLOURS[2], lw=0.2, edgecolor="#00000033")
    axes.plot(*way.T, "-", color=COLOURS[5], lw=0.8)
    late = history.triggered
    for which, colour, name in (
        (~late, COLOURS[0], "before the trigger"),
        (late, COLOURS[3], "after it"),
    ):
        if which.any():
            axes.scatter(*way[which].T, s=14, color=colour, depthshade=False, label=name)
    axes.scatter(0.0, 0.0, 0.0, s=30, marker="x", color="k", label="first contact")
    arrow = 0.5 * reach * history.normal[[0, -1]]
    axes.quiver(*way[[0, -1]].T, *arrow.T, color=COLOURS[1], lw=1.2)
    axes.set_xlabel("x / µm")
    axes.set_ylabel("y / µm")
    axes.set_zlabel("z / µm")
    axes.zaxis.set_major_locator(MaxNLocator(4))
    axes.set_title("contact on the surface, from its first point", fontsize=9)
    axes.set_box_aspect(_spans(np.concatenate([patch, way])))
    axes.legend(fontsize=7, loc="upper left")


def plot_plan(plan: InspectionPlan, surface: Surface | Part, title: str = "") -> Figure:
    """Targets on their surface, with their normals.

    Parameters
    ----------
    plan : InspectionPlan
    surface : Surface or Part
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(8.0, 6.5)
    axes = figure.add_subplot(1, 1, 1, projection="3d")
    size = float(np.linalg.norm(np.ptp(plan.point, axis=0))) or 1.0
    cloud = plan.point
    if isinstance(surface, Part):
        for index in surface.chosen:
            _draw_face(axes, surface.faces[index], "#9fb7c7", 0.35)
        cloud = np.concatenate([surface.box, plan.point])
    axes.scatter(*plan.point.T, s=9, color=COLOURS[3], depthshade=False)
    axes.quiver(*plan.point.T, *(0.05 * size * plan.normal).T, color=COLOURS[1], lw=0.7)
    _label(axes, cloud)
    axes.set_title(f"{title or 'Targets'}: {len(plan)} points")
    return figure


def plot_part(part: Part, title: str = "") -> Figure:
    """A part's faces in colours, with their numbers.

    Parameters
    ----------
    part : Part
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(8.5, 7.0)
    axes = figure.add_subplot(1, 1, 1, projection="3d")
    for i, face in enumerate(part.faces):
        colour = COLOURS[i % len(COLOURS)]
        points = _draw_face(axes, face, colour, 0.45)
        if len(part.faces) <= _MOST_LABELS and len(points):
            middle = points[np.argmin(np.sum((points - points.mean(axis=0)) ** 2, axis=1))]
            axes.text(*middle, str(face.number), fontsize=8, weight="bold", zorder=10)
    _label(axes, part.box)
    crowded = "" if len(part.faces) <= _MOST_LABELS else " (too many for their numbers)"
    axes.set_title(f"{title or part.name}: {len(part.faces)} faces{crowded}")
    return figure


def _draw_face(axes: Any, face: Face, colour: str, alpha: float) -> FloatArray:
    """Triangles of a face between points of its parameters; returns points inside it."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    low, high = face.box
    u, v = np.meshgrid(*(np.linspace(low[k], high[k], _MESH) for k in (0, 1)))
    uv = np.column_stack([u.ravel(), v.ravel()])
    points = face.derivatives(uv)[0]
    inside = face.inside(uv)
    index = np.arange(_MESH * _MESH).reshape(_MESH, _MESH)
    corners = np.stack(
        [index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    whole = inside[corners].all(axis=1)
    if whole.any():
        quads = Poly3DCollection(
            list(points[corners[whole]]), facecolor=colour, alpha=alpha, edgecolor="none"
        )
        axes.add_collection3d(quads)
    for ring in face.edge_lines(np.inf):
        axes.plot(*face.derivatives(ring)[0].T, color="#333333", lw=0.6)
    return np.asarray(points[inside])


def _label(axes: Any, points: FloatArray) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    for set_limits, a, b in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), low, high, strict=True
    ):
        set_limits(a, b if b > a else a + 1e-6)
    axes.set_box_aspect(_spans(points))
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    axes.set_zlabel("z / mm")


def _spans(points: FloatArray) -> tuple[float, ...]:
    spans = np.ptp(points, axis=0)
    return tuple(np.maximum(spans, 0.15 * max(float(spans.max()), 1e-9)))
