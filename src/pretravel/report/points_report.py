"""Reports and pictures of touches and points: simulated touches, compensated points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.compensation.points import Points
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.report.document import Column, Document, KeyFigure, Picture, Span, Table
from pretravel.report.formatting import value_text
from pretravel.report.style import new_figure, polar_axes, some_rows
from pretravel.touches import Touches
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def points_document(
    points: Points, *, touches_name: str = "", warnings: Sequence[str] = ()
) -> Document:
    """The report of a compensation.

    Parameters
    ----------
    points : Points
    touches_name : str
        Of the file with the touches.
    warnings : sequence of str

    Returns
    -------
    Document
    """
    title = f"{touches_name}, compensated" if touches_name else "Compensated points"
    u = points.standard_uncertainty / MICROMETRE
    figures = [
        KeyFigure("pretravel", Span.of(points.pretravel / MICROMETRE), "µm"),
        KeyFigure("u of a point", Span.of(u), "µm", remark="standard uncertainty along the normal"),
    ]
    if points.deviation is not None:
        deviation = points.deviation / MICROMETRE
        figures += [
            KeyFigure(
                "deviation", Span.of(deviation), "µm", remark="from nominal, along the normal"
            ),
            KeyFigure("mean deviation", float(deviation.mean()), "µm", detail=True),
            KeyFigure(
                "spread", float(deviation.std()), "µm", remark="standard deviation", detail=True
            ),
        ]
    return Document(
        title=title,
        verdict=f"{len(points)} points{_in_short(points)}",
        figures=tuple(figures),
        tables=before_and_after(points),
        pictures=(
            Picture("Points, pretravel and uncertainty", lambda: plot_points(points, title)),
        ),
        warnings=tuple(warnings),
    )


def before_and_after(points: Points) -> tuple[Table, ...]:
    """What each correction leaves at the points: the tip radius alone, one radius, the map.

    With a nominal these are deviations from it. Without one the error of a point is not known;
    then they are distances from the compensated points, the errors that the map takes away.

    Parameters
    ----------
    points : Points

    Returns
    -------
    tuple of Table
        None for points that do not state what the control reported (`Points.uncompensated`).
    """
    if points.uncompensated is None:
        return ()
    left = _left_by_corrections(points)
    nominal = points.deviation is not None
    values = list(left.values())
    return (
        Table(
            (
                Column.of("correction", left),
                Column.of("from", [float(v.min()) for v in values], "µm"),
                Column.of("to", [float(v.max()) for v in values], "µm"),
                Column.of("mean", [float(v.mean()) for v in values], "µm"),
                Column.of("spread", [float(v.std()) for v in values], "µm"),
            ),
            title="Deviation from nominal before and after"
            if nominal
            else "Error that simpler corrections leave, by the map",
            explanation="Along the normal, positive outside; spread is the standard deviation. Tip "
            "radius alone: the tip centre less the tip radius, without compensation. One radius "
            "for all: that less the mean pretravel of these points, which suits them best in the "
            "sense of least squares; a radius from a sphere suits them less.",
        ),
    )


def _left_by_corrections(points: Points) -> dict[str, FloatArray]:
    """What corrections leave at each point, the map last. [µm]

    Without a nominal the compensated points are the reference, and the map is not listed.
    """
    assert points.uncompensated is not None
    moved = np.sum((points.uncompensated - points.positions) * points.normals, axis=1)
    reached = np.zeros(len(points)) if points.deviation is None else points.deviation
    left = {
        "tip radius alone": (reached + moved) / MICROMETRE,
        "one radius for all": (reached + moved - moved.mean()) / MICROMETRE,
    }
    if points.deviation is not None:
        left["map"] = reached / MICROMETRE
    return left


def _in_short(points: Points) -> str:
    """The verdict on before and after."""
    if points.uncompensated is None or len(points) < 2:
        return ""
    left = _left_by_corrections(points)
    if "map" not in left:
        most = value_text(float(np.abs(left["one radius for all"]).max()), "µm")
        return f"; one radius for all of them would leave errors up to {most}"
    before, after = (value_text(float(left[n].std()), "µm") for n in ("tip radius alone", "map"))
    return f"; spread of the deviation {before} before, {after} after"


def simulation_document(
    touches: Touches,
    travel: FloatArray,
    slide: FloatArray,
    *,
    title: str = "",
    warnings: Sequence[str] = (),
) -> Document:
    """The report of simulated touches.

    Parameters
    ----------
    touches : Touches
    travel : (n,) float
        From first contact to the latched point. [mm]
    slide : (m,) float
        Of the contact on the surface; not a number where a target was not touched. [mm]
    title : str
        Of the picture.
    warnings : sequence of str

    Returns
    -------
    Document
    """
    return Document(
        title=title or "Simulated touches",
        verdict=f"{len(touches)} touches",
        figures=(
            KeyFigure("travel", Span.of(travel / MICROMETRE), "µm", remark="since first contact"),
            KeyFigure(
                "largest slide",
                float(np.nanmax(slide)) / MICROMETRE,
                "µm",
                remark="of the contact on the surface",
            ),
        ),
        pictures=(
            Picture("Touches and their travel", lambda: plot_touches(touches, travel, title)),
        ),
        warnings=tuple(warnings),
    )


def plot_points(points: Points, title: str = "") -> Figure:
    """Where the points are, coloured by deviation, by pretravel and by their uncertainty.

    Parameters
    ----------
    points : Points
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 4.6, title or "Compensated points")
    panels: list[tuple[str, FloatArray, str]] = [
        ("pretravel / µm", points.pretravel / MICROMETRE, "viridis"),
        ("standard uncertainty u / µm", points.standard_uncertainty / MICROMETRE, "magma"),
    ]
    if points.deviation is not None:
        panels.insert(0, ("deviation from nominal / µm", points.deviation / MICROMETRE, "RdBu_r"))
    for index, (name, values, colours) in enumerate(panels, start=1):
        axes = figure.add_subplot(1, len(panels), index)
        axes.set_title(name, fontsize=10)
        _scatter(axes, points.positions, values, colours)
    return figure


def plot_touches(touches: Touches, travel: FloatArray, title: str = "") -> Figure:
    """Simulated touches: where they are, and pretravel over their azimuth.

    Parameters
    ----------
    touches : Touches
    travel : (n,) float
        From first contact to the latched point. [mm]
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.6, title or "Simulated touches")
    place = figure.add_subplot(1, 2, 1)
    place.set_title("travel since first contact / µm", fontsize=10)
    _scatter(place, touches.positions, travel / MICROMETRE, "viridis")
    diagram = polar_axes(figure, 1, 2, 2, "travel / µm over azimuth of n")
    shown = some_rows(np.arange(len(touches)))
    normals = touches.normals[shown]
    points = diagram.scatter(azimuth_angle(normals), travel[shown] / MICROMETRE,
                             c=polar_angle(normals) / DEGREE, s=12, cmap="plasma")  # fmt: skip
    diagram.set_ylim(bottom=0.0 if travel.min() >= 0.0 else None)
    figure.colorbar(points, ax=diagram, shrink=0.75, pad=0.12, label="polar angle of n / °")
    return figure


def _scatter(axes: Axes, positions: FloatArray, values: FloatArray, colours: str) -> None:
    """Positions along their two widest axes, in the colours of their values.

    The colours "RdBu_r" are for signed values: white is zero.
    """
    shown = some_rows(np.arange(len(positions)))
    positions, values = positions[shown], values[shown]
    widest = np.argsort(np.ptp(positions, axis=0), kind="stable")[::-1][:2]
    first, second = sorted(widest.tolist())
    limit = float(np.max(np.abs(values))) if colours == "RdBu_r" else None
    drawn = axes.scatter(positions[:, first], positions[:, second], c=values, cmap=colours,
                         vmin=None if limit is None else -limit, vmax=limit, s=28,
                         edgecolors="0.3", linewidths=0.3)  # fmt: skip
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{'xyz'[first]} / mm")
    axes.set_ylabel(f"{'xyz'[second]} / mm")
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.9, aspect=30)
