"""Results as cards in notebooks: key figures with their units, and a small polar picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import azimuth_angle, grid, polar_angle
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.laboratory.separation import Separation
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.points import Points
from pretravel.prediction.predict import Trigger
from pretravel.qualification.qualification import Qualification
from pretravel.show.colours import series as colour_of
from pretravel.show.document import Document, KeyFigure, Span
from pretravel.show.formatting import decimals, figure_text
from pretravel.show.page import page_environment
from pretravel.show.polar_picture import PolarPicture, PolarSeries, polar_picture
from pretravel.touches import Touches

_AROUND = np.arange(0.0, 360.0, 5.0) * DEGREE
_HEIGHTS = (90.0, 45.0)
"""Polar angles of the curves of a map. [deg]"""


@dataclass(frozen=True)
class NotebookCard:
    """What a notebook shows of a value."""

    title: str
    figures: tuple[KeyFigure, ...]
    picture: PolarPicture | None = None
    remarks: tuple[str, ...] = ()


def notebook_html(value: object) -> str:
    """A value as a part of an HTML page; every text in it is escaped.

    Parameters
    ----------
    value : Touches, Points, PretravelMap, Trigger, Qualification, Separation or Document

    Returns
    -------
    str

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
    return template.render(card=card, rows=rows, picture=card.picture)


@singledispatch
def notebook_card(value: object) -> NotebookCard:
    """The content of the card of a value; see `notebook_html`."""
    raise TypeError(f"a {type(value).__name__} has no picture for notebooks")


@notebook_card.register
def _touches(touches: Touches) -> NotebookCard:
    figures = [KeyFigure("touches", f"{len(touches):,}"), *_places(touches.positions)]
    if touches.feeds is not None:
        figures.append(_range("feed", touches.feeds, "mm/min", 0))
    if touches.source:
        figures.append(KeyFigure("from", touches.source))
    dots = PolarSeries(
        "",
        azimuth_angle(touches.normals),
        polar_angle(touches.normals) / DEGREE,
        colour_of(0),
    )
    return NotebookCard(
        "Touches",
        tuple(figures),
        polar_picture("normals seen from above: polar angle over azimuth", "°", [dots]),
    )


@notebook_card.register
def _points(points: Points) -> NotebookCard:
    pretravel = points.pretravel / MICROMETRE
    figures = [
        KeyFigure("points", f"{len(points):,}"),
        *_places(points.positions),
        _range("pretravel", pretravel, "µm", 1),
        _range("standard uncertainty", points.standard_uncertainty / MICROMETRE, "µm", 2),
    ]
    if points.deviation is not None:
        figures.append(_range("deviation from the nominal", points.deviation / MICROMETRE, "µm", 1))
    dots = PolarSeries("", azimuth_angle(points.normals), pretravel, colour_of(0))
    picture = polar_picture("pretravel over the azimuth of the normals", "µm", [dots])
    return NotebookCard("Surface points", tuple(figures), picture)


@notebook_card.register
def _map(pretravel_map: PretravelMap) -> NotebookCard:
    curves = _curves(pretravel_map)
    figures = [
        KeyFigure("kind", pretravel_map.kind),
        KeyFigure("directions", f"{len(pretravel_map.support.nodes):,}"),
        *(_range(f"pretravel, {each.name}", each.values, "µm", 1) for each in curves),
        _tip_radius(pretravel_map),
        KeyFigure("repeatability", pretravel_map.repeatability / MICROMETRE, "µm"),
    ]
    if pretravel_map.provenance.source:
        figures.append(KeyFigure("made from", pretravel_map.provenance.source))
    return NotebookCard("Pretravel map", tuple(figures), polar_picture(_OF_MAP, "µm", curves))


_OF_MAP = "pretravel over azimuth, probe frame"


def _tip_radius(pretravel_map: PretravelMap) -> KeyFigure:
    u = pretravel_map.u_tip_radius / MICROMETRE
    return KeyFigure(
        "tip radius", pretravel_map.tip_radius, "mm", decimals(4), u or None, "µm", decimals(2)
    )


def _curves(pretravel_map: PretravelMap) -> list[PolarSeries]:
    """The map around the axis, at the heights that it supports."""
    found: list[PolarSeries] = []
    for height in _HEIGHTS:
        directions = grid(height * DEGREE, _AROUND)
        normals = directions @ pretravel_map.rotation.T
        values = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
        values = np.where(pretravel_map.supports(normals), values, math.nan)
        if np.any(np.isfinite(values)):
            name = f"polar {height:.0f}°"
            found.append(PolarSeries(name, _AROUND, values, colour_of(len(found)), closed=True))
    return found


@notebook_card.register
def _trigger(trigger: Trigger) -> NotebookCard:
    pretravel = trigger.pretravel / MICROMETRE
    figures = (
        KeyFigure("model", trigger.model),
        KeyFigure("directions", f"{len(trigger.directions):,}"),
        _range("trigger force", trigger.force, "N", 2),
        _range("sensing distance", trigger.sensing_distance / MICROMETRE, "µm", 1),
        _range("pretravel", pretravel, "µm", 1),
    )
    dots = PolarSeries("", azimuth_angle(trigger.directions), pretravel, colour_of(0))
    return NotebookCard("Prediction", figures, polar_picture(_OF_MAP, "µm", [dots]))


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
        _range("residuals", result.residuals[result.used] / MICROMETRE, "µm", 2),
        KeyFigure("centre", tuple(result.center.tolist()), "mm", decimals(4)),
    )  # fmt: skip
    azimuths = azimuth_angle(found.probe_directions(result.contact_normals))
    observed = result.observed / MICROMETRE
    series = [
        *_curves(found),
        PolarSeries("touches", azimuths[result.used], observed[result.used], "series4"),
    ]
    if np.any(left_out):
        series.append(PolarSeries("left out", azimuths[left_out], observed[left_out], "limit"))
    picture = polar_picture(_OF_MAP, "µm", series)
    return NotebookCard("Qualification", figures, picture, result.warnings)


@notebook_card.register
def _separation(result: Separation) -> NotebookCard:
    errors = (("machine", result.machine_error), ("probe", result.probe_error))
    variances = (("machine", result.machine_variance), ("probe", result.probe_variance))
    out = len(result.outliers) + len(result.excluded)
    figures = (
        KeyFigure("readings", f"{len(result.residuals):,}", remark=f"{out} left out"),
        KeyFigure(
            "directions",
            f"{len(result.machines)} of the machine, {len(result.probes)} of the probe",
        ),
        *(_range(f"errors of the {name}", e / MICROMETRE, "µm", 2) for name, e in errors),
        *(_range(f"variances of the {name}", v / MICROMETRE**2, "µm²", 2) for name, v in variances),
        KeyFigure("method", result.method),
    )
    series = [
        PolarSeries(
            f"errors of the {name}",
            np.linspace(0.0, 2.0 * math.pi, len(values), endpoint=False),
            values / MICROMETRE,
            colour_of(index),
            closed=True,
        )
        for index, (name, values) in enumerate(errors)
    ]
    picture = polar_picture(
        "errors by direction, in the order of their numbers", "µm", series, start="first"
    )
    return NotebookCard("Separation of machine and probe", figures, picture)


@notebook_card.register
def _document(document: Document) -> NotebookCard:
    figures = tuple(figure for figure in document.figures if not figure.detail)
    verdict = (document.verdict,) if document.verdict else ()
    return NotebookCard(document.title, figures, None, verdict + document.warnings)


def _places(positions: FloatArray) -> list[KeyFigure]:
    return [_range(axis, positions[:, index], "mm", 3) for index, axis in enumerate("xyz")]


def _range(name: str, values: FloatArray, unit: str, digits: int) -> KeyFigure:
    """The smallest and largest of the values that are numbers."""
    numbers = values[np.isfinite(values)]
    if not numbers.size:
        return KeyFigure(name, math.nan, unit)
    return KeyFigure(name, Span.of(numbers), unit, decimals(digits))
