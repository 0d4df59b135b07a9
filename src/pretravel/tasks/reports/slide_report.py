"""Report and picture of a tip that slides on a surface while it is deflected."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base.arrays import BoolArray, FloatArray
from pretravel.base.units import MICROMETRE
from pretravel.probing.slide_history import SlideHistory
from pretravel.show.chart import Axis, Chart, PlaneChart, SpaceChart, View
from pretravel.show.chart_marks import (
    LineMark,
    Rule,
    SpaceArrow,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpacePoints,
)
from pretravel.show.colours import Colour
from pretravel.show.document import Document, KeyFigure, Picture
from pretravel.show.formatting import decimals, value_text
from pretravel.surface.local_geometry import Surface, tangent_basis


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
        pictures=(Picture("The contact slides", lambda: slide_view(history, surface, title)),),
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


def slide_view(history: SlideHistory, surface: Surface, title: str = "") -> View:
    """A tip that slides: its contact on the surface in space, deflection and force over feed.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
        That it slid on.
    title : str

    Returns
    -------
    View
    """
    charts: tuple[Chart, ...] = (slide_chart(history, surface), *_curves(history))
    return View(title or "A tip slides", charts)


def _curves(history: SlideHistory) -> list[PlaneChart]:
    """Deflection and force over the feed."""
    order = np.argsort(history.feed)  # a golden section search goes to and fro
    feed = _from_zero(history.feed[order] / MICROMETRE)
    axis = Axis("feed since first contact", "µm", 0.0)
    trigger: tuple[Rule, ...] = ()
    if np.isfinite(history.trigger_feed):
        at = history.trigger_feed / MICROMETRE
        trigger = (Rule(at, f"trigger, {value_text(at, 'µm')}", "limit", upright=True),)
    deflection = LineMark(feed, _from_zero(history.deflection[order] / MICROMETRE), "deflection",
                          marked=True)  # fmt: skip
    itself = LineMark(feed, feed, "feed itself", "reference", dashed=True)
    charts = [
        PlaneChart("deflection of the stylus", axis, Axis("deflection", "µm", 0.0),
                   (itself, deflection, *trigger))
    ]  # fmt: skip
    known = order[np.isfinite(history.force[order])]
    if len(known):
        fed = _from_zero(history.feed[known] / MICROMETRE)
        force = LineMark(fed, _from_zero(history.force[known]), "force", "series2", marked=True)
        charts.append(PlaneChart("contact force", axis, Axis("force", "N", 0.0), (force, *trigger)))
    return charts


def _from_zero(values: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], values])


def slide_chart(history: SlideHistory, surface: Surface, title: str = "") -> SpaceChart:
    """The path of the contact on a patch of the surface, in µm from its first point.

    Parameters
    ----------
    history : SlideHistory
    surface : Surface
    title : str

    Returns
    -------
    SpaceChart
    """
    way = (history.contact - history.start) / MICROMETRE
    reach = 0.8 * max(float(np.linalg.norm(way, axis=1).max()), 2.0)
    patch = _patch(history, surface, way, reach)
    rows = np.arange(patch.shape[0] * patch.shape[1]).reshape(patch.shape[:2])
    first, second = rows[:-1, :-1].ravel(), rows[:-1, 1:].ravel()
    third, fourth = rows[1:, 1:].ravel(), rows[1:, :-1].ravel()
    triangles = np.concatenate(
        [np.stack([first, second, third], axis=1), np.stack([first, third, fourth], axis=1)]
    )
    path = np.concatenate([np.zeros((1, 3)), way])
    late = history.triggered
    labels = tuple(
        f"step {step}: feed {feed / MICROMETRE:.2f} µm"
        for step, feed in zip(history.step.tolist(), history.feed.tolist(), strict=True)
    )
    marks: list[SpaceMark] = [
        SpaceMesh(patch.reshape(-1, 3), triangles, "surface", opacity=0.6),
        SpaceLines(path[:-1], path[1:], "path of the contact", "reference", 1.2),
        SpacePoints(np.zeros((1, 3)), "first contact", "ink", None, "cross", 7.0),
    ]
    stages: tuple[tuple[BoolArray, Colour, str], ...]
    stages = ((~late, "series1", "until the trigger"), (late, "limit", "after the trigger"))
    for which, colour, name in stages:
        if which.any():
            own = tuple(label for label, shown in zip(labels, which, strict=True) if shown)
            marks.append(SpacePoints(way[which], name, colour, None, "dot", 4.0, own))
    marks.append(SpaceArrow(way[0], 0.5 * reach * history.normal[0], "normal", "series2"))
    heading = title or "contact on the surface, from its first point"
    return SpaceChart(heading, tuple(marks), "part", "µm")


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
