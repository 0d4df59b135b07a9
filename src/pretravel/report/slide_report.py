"""Report and picture of a tip that slides on a surface while it is deflected."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.probing.slide_history import SlideHistory
from pretravel.report.document import Document, KeyFigure, Picture
from pretravel.report.formatting import decimals, value_text
from pretravel.report.style import COLOURS, new_figure, proportions
from pretravel.surface.local_geometry import Surface, tangent_basis
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def slide_document(
    history: SlideHistory,
    surface: Surface,
    *,
    title: str,
    lateral_pretravel: float = math.nan,
    pretravel: float = math.nan,
) -> Document:
    """The report of one touch, step by step.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That the tip slid on.
    title : str
        The probe, the surface and the place.
    lateral_pretravel, pretravel : float
        Of the same touch solved without steps: with the lateral deflection alone, and with
        every elastic part; not a number where there is no solution. [mm]

    Returns
    -------
    Document
    """
    last = int(np.argmax(history.feed))
    figures = [
        KeyFigure("feed", history.feed[last] / MICROMETRE, "µm", decimals(3)),
        KeyFigure("deflection", history.deflection[last] / MICROMETRE, "µm", decimals(3)),
        KeyFigure(
            "slide",
            float(np.linalg.norm(history.contact[last] - history.start)) / MICROMETRE,
            "µm",
            decimals(3),
            remark="of the contact, from its first point",
        ),
    ]
    if history.triggered.any():
        feed = KeyFigure("pretravel", history.trigger_feed / MICROMETRE, "µm", decimals(3),
                         remark="feed from first contact to trigger, step by step")  # fmt: skip
        figures.insert(0, feed)
    for name, value, parts in (
        ("solved at once", lateral_pretravel, "lateral deflection only"),
        ("solved at once", pretravel, "every elastic part"),
    ):
        if not math.isnan(value):
            figures.append(KeyFigure(name, value / MICROMETRE, "µm", decimals(3), remark=parts))
    return Document(
        title=title,
        verdict=f"{title}: {_outcome(history)}",
        figures=tuple(figures),
        pictures=(Picture("The contact slides", lambda: plot_slide(history, surface, title)),),
        notes=_notes(history),
    )


def _outcome(history: SlideHistory) -> str:
    if history.search == "golden":
        found = "triggers" if history.triggered.any() else "no trigger"
        return f"{len(history)} trials of a golden section, {found}"
    if not history.triggered.any():
        return f"{len(history)} steps, no trigger"
    first = int(np.argmax(history.triggered))
    return f"{len(history)} steps, triggers in step {history.step[first]}"


def _notes(history: SlideHistory) -> tuple[str, ...]:
    if not history.triggered.any():
        return ("there is no trigger within these steps; take more or larger ones",)
    if history.search != "golden" and history.triggered[0]:
        return ("the first step goes beyond the trigger; smaller steps show the way to it",)
    return ()


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
    figure = new_figure(11.0, 4.8, title or "A tip slides")
    draw_slide(figure.add_subplot(1, 2, 1, projection="3d"), history, surface)
    _draw_curve(figure.add_subplot(1, 2, 2), history)
    return figure


def _draw_curve(axes: Axes, history: SlideHistory) -> None:
    """Deflection and force over the feed."""
    order = np.argsort(history.feed)  # a golden section search goes to and fro
    feed = _from_zero(history.feed[order] / MICROMETRE)
    deflection = _from_zero(history.deflection[order] / MICROMETRE)
    axes.plot(feed, deflection, "o-", ms=3.5, color=COLOURS[0], label="deflection")
    axes.plot(feed, feed, ":", color=COLOURS[5], label="feed itself")
    axes.set_xlabel("feed since first contact / µm")
    axes.set_ylabel("deflection / µm")
    axes.grid(alpha=0.3)
    if np.isfinite(history.trigger_feed):
        at = history.trigger_feed / MICROMETRE
        axes.axvline(at, color=COLOURS[3], lw=1.0)
        side = "right" if at > 0.6 * feed.max() else "left"
        text = f" trigger \n {value_text(at, 'µm')} "
        axes.annotate(text, (at, deflection.max()), va="top", ha=side, color=COLOURS[3])
    known = order[np.isfinite(history.force[order])]
    if len(known):
        force = axes.twinx()
        force.plot(_from_zero(history.feed[known] / MICROMETRE), _from_zero(history.force[known]),
                   "s-", ms=3.0, color=COLOURS[1], label="force")  # fmt: skip
        force.set_ylabel("force / N", color=COLOURS[1])
        force.set_ylim(bottom=0.0)
    axes.legend(fontsize=8, loc="lower right")


def _from_zero(values: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], values])


def draw_slide(axes: Any, history: SlideHistory, surface: Surface) -> None:
    """The path of the contact on a patch of the surface, in µm from its first point.

    Parameters
    ----------
    axes : matplotlib axes in three dimensions
    history : SlideHistory
    surface : Surface
    """
    from matplotlib.ticker import MaxNLocator

    start = history.start
    way = (history.contact - start) / MICROMETRE
    reach = 0.8 * max(float(np.linalg.norm(way, axis=1).max()), 2.0)
    patch = _patch(history, surface, way, reach)
    x, y, z = np.moveaxis(patch, -1, 0)
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
    axes.set_box_aspect(proportions(np.concatenate([patch.reshape(-1, 3), way])))
    axes.legend(fontsize=7, loc="upper left")


def _patch(history: SlideHistory, surface: Surface, way: FloatArray, reach: float) -> FloatArray:
    """Points of the surface around the path of the contact, in µm from its first point."""
    furthest = way[np.argmax(np.linalg.norm(way, axis=1))]
    middle = history.start + 0.5 * furthest * MICROMETRE
    tangents = tangent_basis(history.normal[:1])[0]
    side = np.linspace(-reach, reach, 13) * MICROMETRE
    p, q = np.meshgrid(side, side)
    flat = middle + p.ravel()[:, None] * tangents[0] + q.ravel()[:, None] * tangents[1]
    found = surface.local(surface.nearest(flat)).point
    return np.asarray((found - history.start) / MICROMETRE).reshape(*p.shape, 3)
