"""Reports and pictures of touches and points: simulated touches, compensated points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, Placement
from pretravel.measurement import Moments, Points, PointsSummary
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Span,
    Table,
    budget_picture,
    number_text,
    value_text,
)
from pretravel.task import budget_section
from pretravel.touches import Touches
from pretravel.uncertainty import COVERAGE_FACTOR, Budget

if TYPE_CHECKING:
    from pretravel.show import View
    from pretravel.surface import Part, Surface


def points_document(
    points: Points,
    *,
    touches_name: str = "",
    nominal: Surface | Part | None = None,
    placement: Placement | None = None,
    warnings: Sequence[str] = (),
    budgets: Sequence[Budget] = (),
) -> Document:
    """The report of a compensation.

    Parameters
    ----------
    points : Points
    touches_name : str
        Of the file with the touches.
    nominal : Surface, Part or None
        The picture shows the faces of a CAD file.
    placement : Placement or None
        Of the part in the machine, where the points are in the frame of the machine.
    warnings : sequence of str
    budgets : sequence of Budget
        Of the points on average, or of single ones.
    """
    title = f"{touches_name}, compensated" if touches_name else "Compensated points"

    def view() -> View:
        from pretravel.tasks.compensate.picture import points_view

        return points_view(points, title, nominal=nominal, placement=placement)

    before_and_after = "The part before and after compensation, pretravel and uncertainty"
    picture = Picture(before_and_after, view)
    summary = PointsSummary.of(points)
    return summary_document(summary, picture, title=title, warnings=warnings, budgets=budgets)


def summary_document(
    summary: PointsSummary,
    picture: Picture,
    *,
    title: str,
    warnings: Sequence[str] = (),
    budgets: Sequence[Budget] = (),
) -> Document:
    """The report of a compensation from a summary of its points.

    Parameters
    ----------
    summary : PointsSummary
    picture : Picture
        Of the points, or of some of them.
    title : str
    warnings : sequence of str
    budgets : sequence of Budget
    """
    figures = [
        KeyFigure("pretravel", _span(summary.pretravel), "µm"),
        KeyFigure(
            "u of a point", _span(summary.u), "µm", remark="standard uncertainty along the normal"
        ),
    ]
    if summary.deviation is not None:
        reached = summary.deviation
        figures += [
            KeyFigure("deviation", _span(reached), "µm", remark="from nominal, along the normal"),
            KeyFigure("mean deviation", reached.mean / MICROMETRE, "µm", detail=True),
            KeyFigure(
                "standard deviation",
                reached.spread / MICROMETRE,
                "µm",
                detail=True,
            ),
        ]
    # The k of the budget: few touches of a map have few degrees of freedom.
    factor = budgets[0].coverage_factor() if budgets else COVERAGE_FACTOR
    return Document(
        title=title,
        verdict=f"{len(summary)} points{_in_short(summary)}; U of a point up to "
        f"{value_text(factor * summary.u.high / MICROMETRE, 'µm')} (k = {number_text(factor)})",
        figures=tuple(figures),
        tables=before_and_after(summary),
        sections=budget_section(budgets),
        pictures=(picture, *(budget_picture(budget, budget.result) for budget in budgets)),
        warnings=tuple(warnings),
        budgets=tuple(budgets),
    )


def _span(moments: Moments) -> Span:
    """The range of lengths. [µm]"""
    return Span(moments.low / MICROMETRE, moments.high / MICROMETRE)


def before_and_after(points: PointsSummary) -> tuple[Table, ...]:
    """What each correction leaves at the points: the tip radius alone, one radius, the map.

    With a nominal these are deviations from it. Without one the error of a point is not known;
    then they are distances from the compensated points, the errors that the map takes away.

    Returns
    -------
    tuple of Table
        None for points that do not state what the control reported (`Points.uncompensated`).
    """
    if points.before is None:
        return ()
    left = _left_by_corrections(points)
    nominal = points.deviation is not None
    values = list(left.values())
    return (
        Table(
            (
                Column.of("correction", left),
                Column.of("from", [v.low / MICROMETRE for v in values], "µm"),
                Column.of("to", [v.high / MICROMETRE for v in values], "µm"),
                Column.of("mean", [v.mean / MICROMETRE for v in values], "µm"),
                Column.of("standard deviation", [v.spread / MICROMETRE for v in values], "µm"),
            ),
            title="Deviation from nominal before and after compensation, with the form of the part"
            if nominal
            else "Errors that simpler corrections would leave, according to the map (along the "
            "normal, positive out of the material)",
            explanation="Along the normal, positive out of the material. "
            + ("What the map leaves is the part's own deviation, apart from u. " if nominal else "")
            + "Tip radius alone: the reading (spindle point) minus the tip radius, uncompensated. "
            "One radius, best for these points: the reading minus one radius, chosen so that the "
            "points agree best (least squares) with those compensated by the map. The radius in a "
            "control, from a sphere or ring, agrees less well.",
        ),
    )


def _left_by_corrections(points: PointsSummary) -> dict[str, Moments]:
    """What corrections leave at the points, the map last. [mm]

    Without a nominal the compensated points are the reference, and the map is not listed.
    """
    assert points.before is not None
    reached = 0.0 if points.deviation is None else points.deviation.mean
    left = {
        "tip radius alone": points.before,
        "one radius, best for these points": points.before.shifted(reached - points.before.mean),
    }
    if points.deviation is not None:
        left["map"] = points.deviation
    return left


def _in_short(points: PointsSummary) -> str:
    """The verdict on before and after."""
    if points.before is None or len(points) < 2:
        return ""
    left = _left_by_corrections(points)
    if "map" not in left:
        return ""
    before, after = (
        value_text(left[name].spread / MICROMETRE, "µm") for name in ("tip radius alone", "map")
    )
    return f"; standard deviation from nominal {before} before, {after} after"


def simulation_document(
    touches: Touches,
    travel: FloatArray,
    slide: FloatArray,
    *,
    title: str = "",
    surface: Surface | Part | None = None,
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
    surface : Surface, Part or None
        The picture shows the faces of a CAD file.
    warnings : sequence of str
    """

    def view() -> View:
        from pretravel.tasks.compensate.picture import touches_view

        return touches_view(touches, travel, title, surface)

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
        pictures=(Picture("Touches and their travel", view),),
        warnings=tuple(warnings),
    )
