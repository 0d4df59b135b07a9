"""Results as cards in notebooks: key figures with their units, and a small polar picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    azimuth_angle,
    grid,
    object_at,
    polar_angle,
)
from pretravel.maps import PretravelMap
from pretravel.measurement import Points
from pretravel.prediction import Trigger
from pretravel.qualification import Qualification
from pretravel.show import (
    Axis,
    Colour,
    Document,
    Dots,
    FrameName,
    KeyFigure,
    LineMark,
    PolarChart,
    Span,
    View,
    at_the_edge,
    decimals,
    drawn_figure,
    figure_text,
    page_environment,
    some_rows,
    svg_element,
)
from pretravel.show import series as colour_of
from pretravel.touches import Touches

_AROUND = np.arange(0.0, 360.0, 5.0) * DEGREE
_HEIGHTS = (90.0, 45.0)
"""Polar angles of the curves of a map. [deg]"""
MOST_DOTS = 400
"""More dots are thinned out evenly; the picture says so."""


@dataclass(frozen=True)
class NotebookCard:
    """What a notebook shows of a value."""

    title: str
    figures: tuple[KeyFigure, ...]
    picture: PolarChart | None = None
    remarks: tuple[str, ...] = ()


def notebook_html(value: object) -> str:
    """A value as a part of an HTML page; every text in it is escaped.

    Parameters
    ----------
    value : Touches, Points, PretravelMap, Trigger, Qualification, Separation or Document

    Raises
    ------
    TypeError
        The value is none of these.

    >>> html = notebook_html(Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]], source="a<b.csv"))
    >>> "a&lt;b.csv" in html, "<svg" in html
    (True, True)
    """
    card = notebook_card(value)
    rows = [(figure.name, figure_text(figure)) for figure in card.figures]
    template = page_environment().get_template("notebook.html")
    picture = card.picture and svg_element(drawn_figure(View("", (card.picture,))))
    return template.render(card=card, rows=rows, picture=picture)


CARDS = {"Separation": "pretravel.laboratory:separation_card"}
"""What makes the cards of results of wings, by their types."""


@singledispatch
def notebook_card(value: object) -> NotebookCard:
    """The content of the card of a value; see `notebook_html`."""
    if type(value).__name__ in CARDS:
        card: NotebookCard = object_at(CARDS[type(value).__name__])(value)
        return card
    raise TypeError(f"a {type(value).__name__} has no picture for notebooks")


@notebook_card.register
def _touches(touches: Touches) -> NotebookCard:
    figures = [KeyFigure("touches", f"{len(touches):,}"), *_places(touches.positions)]
    if touches.feeds is not None:
        figures.append(range_figure("feed", touches.feeds, "mm/min", 0))
    if touches.source:
        figures.append(KeyFigure("from", touches.source))
    angle = polar_angle(touches.normals) / DEGREE
    dots = _dots(azimuth_angle(touches.normals), angle)
    picture = polar_chart("normals seen from above", Axis("polar angle", "°"), [dots])
    return NotebookCard("Touches", tuple(figures), picture)


@notebook_card.register
def _points(points: Points) -> NotebookCard:
    pretravel = points.pretravel / MICROMETRE
    figures = [
        KeyFigure("points", f"{len(points):,}"),
        *_places(points.positions),
        range_figure("pretravel", pretravel, "µm", 1),
        range_figure("standard uncertainty", points.standard_uncertainty / MICROMETRE, "µm", 2),
    ]
    if points.deviation is not None:
        figures.append(
            range_figure("deviation from the nominal", points.deviation / MICROMETRE, "µm", 1)
        )
    dots = _dots(azimuth_angle(points.normals), pretravel)
    picture = polar_chart("pretravel over the azimuth of the normals", _PRETRAVEL, [dots])
    return NotebookCard("Surface points", tuple(figures), picture)


@notebook_card.register
def _map(pretravel_map: PretravelMap) -> NotebookCard:
    curves = _curves(pretravel_map)
    figures = [
        KeyFigure("kind", pretravel_map.kind),
        KeyFigure("directions", f"{len(pretravel_map.support.nodes):,}"),
        *(range_figure(f"pretravel, {each.name}", each.y, "µm", 1) for each in curves),
        _tip_radius(pretravel_map),
        KeyFigure("repeatability", pretravel_map.repeatability / MICROMETRE, "µm"),
    ]
    if pretravel_map.provenance.source:
        figures.append(KeyFigure("made from", pretravel_map.provenance.source))
    return NotebookCard("Pretravel map", tuple(figures), _of_map(curves))


_PRETRAVEL = Axis("pretravel", "µm")


def _of_map(marks: Sequence[LineMark | Dots]) -> PolarChart | None:
    return polar_chart("pretravel over azimuth", _PRETRAVEL, marks, frame="probe")


def polar_chart(
    title: str,
    radius: Axis,
    marks: Sequence[LineMark | Dots],
    *,
    frame: FrameName = "",
    directions: tuple[str, str] = ("+X", "+Y"),
) -> PolarChart | None:
    """A chart of marks; the centre is zero, where no value is negative. None: no numbers."""
    values = np.concatenate([*(mark.y for mark in marks), np.empty(0)])
    values = values[np.isfinite(values)]
    if not values.size:
        return None
    some = tuple(_some(mark) if isinstance(mark, Dots) else mark for mark in marks)
    most = max((len(mark.x) for mark in marks if isinstance(mark, Dots)), default=0)
    note = f"{MOST_DOTS} of {most:,} dots are drawn" if most > MOST_DOTS else ""
    low = 0.0 if values.min() >= 0.0 else None
    return PolarChart(title, replace(radius, low=low), some, frame, None, note, directions)


def _some(dots: Dots) -> Dots:
    rows = some_rows(np.arange(len(dots.x)), MOST_DOTS)
    return replace(dots, x=dots.x[rows], y=dots.y[rows])


def _dots(
    azimuths: FloatArray, values: FloatArray, name: str = "", colour: Colour | None = None
) -> Dots:
    return Dots(azimuths, values, name, colour or colour_of(0), size=3.0)


def closed_curve(azimuths: FloatArray, values: FloatArray, name: str, index: int) -> LineMark:
    """A closed curve."""
    return LineMark(np.append(azimuths, azimuths[0]), np.append(values, values[0]), name,
                    colour_of(index))  # fmt: skip


def _tip_radius(pretravel_map: PretravelMap) -> KeyFigure:
    u = pretravel_map.u_tip_radius / MICROMETRE
    return KeyFigure(
        "tip radius", pretravel_map.tip_radius, "mm", decimals(4), u or None, "µm", decimals(2)
    )


def _curves(pretravel_map: PretravelMap) -> list[LineMark]:
    """The map around the axis, at the heights that it supports."""
    found: list[LineMark] = []
    for height in _HEIGHTS:
        directions = grid(height * DEGREE, _AROUND)
        normals = directions @ pretravel_map.rotation.T
        values = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
        values = np.where(pretravel_map.supports(normals), values, math.nan)
        if np.any(np.isfinite(values)):
            found.append(closed_curve(_AROUND, values, f"polar {height:.0f}°", len(found)))
    return found


@notebook_card.register
def _trigger(trigger: Trigger) -> NotebookCard:
    pretravel = trigger.pretravel / MICROMETRE
    figures = (
        KeyFigure("model", trigger.model),
        KeyFigure("directions", f"{len(trigger.directions):,}"),
        range_figure("trigger force", trigger.force, "N", 2),
        range_figure("sensing distance", trigger.sensing_distance / MICROMETRE, "µm", 1),
        range_figure("pretravel", pretravel, "µm", 1),
    )
    dots = _dots(azimuth_angle(trigger.directions), pretravel)
    return NotebookCard("Prediction", figures, _of_map([dots]))


@notebook_card.register
def _qualification(result: Qualification) -> NotebookCard:
    found = result.pretravel_map
    left_out = ~result.used
    figures = (
        KeyFigure("kind of map", found.kind),
        KeyFigure("touches", f"{len(result.used):,}", remark=f"{int(left_out.sum())} left out"),
        KeyFigure(
            "effective radius", result.effective_radius, "mm", decimals(4),
            result.u_effective_radius / MICROMETRE, "µm", decimals(2),
        ),
        KeyFigure("repeatability", result.repeatability / MICROMETRE, "µm"),
        range_figure("residuals", result.residuals[result.used] / MICROMETRE, "µm", 2),
        KeyFigure("centre", tuple(result.center.tolist()), "mm", decimals(4)),
    )  # fmt: skip
    azimuths = azimuth_angle(found.probe_directions(result.contact_normals))
    observed = result.observed / MICROMETRE
    series: list[LineMark | Dots] = [
        *_curves(found),
        _dots(azimuths[result.used], observed[result.used], "touches", "series4"),
    ]
    if np.any(left_out):
        at = at_the_edge(observed[left_out], observed[result.used])
        series.append(_dots(azimuths[left_out], at, "left out", "limit"))
    return NotebookCard("Qualification", figures, _of_map(series), result.warnings)


@notebook_card.register
def _document(document: Document) -> NotebookCard:
    figures = tuple(figure for figure in document.figures if not figure.detail)
    verdict = (document.verdict,) if document.verdict else ()
    return NotebookCard(document.title, figures, None, verdict + document.warnings)


def _places(positions: FloatArray) -> list[KeyFigure]:
    return [range_figure(axis, positions[:, index], "mm", 3) for index, axis in enumerate("xyz")]


def range_figure(name: str, values: FloatArray, unit: str, digits: int) -> KeyFigure:
    """The smallest and largest of the values that are numbers."""
    numbers = values[np.isfinite(values)]
    if not numbers.size:
        return KeyFigure(name, math.nan, unit)
    return KeyFigure(name, Span.of(numbers), unit, decimals(digits))
