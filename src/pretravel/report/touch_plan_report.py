"""Report and picture of a plan of few touches: where, and what they bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.qualification.touch_plan import TouchPlan
from pretravel.report.document import Column, Document, KeyFigure, Picture, Table
from pretravel.report.formatting import decimals, number_text
from pretravel.report.style import new_figure, polar_axes
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def touch_plan_document(plan: TouchPlan, *, map_name: str = "") -> Document:
    """The report of a plan.

    Parameters
    ----------
    plan : TouchPlan
    map_name : str
        Of the file of the old map.

    Returns
    -------
    Document
    """
    title = f"Touches that keep {map_name or 'a map'} good"
    drift = plan.prior.drift
    noise = plan.prior.pretravel_map.repeatability / MICROMETRE
    return Document(
        title=title,
        verdict=f"{len(plan.directions)} touches bring u of the map from "
        f"{_rms_text(plan.u_before)} to {_rms_text(plan.u_after)} µm",
        figures=(
            KeyFigure("u of the old map", _rms(plan.u_old), "µm",
                      remark="root mean square over the directions, when it was made"),
            KeyFigure("u today", _rms(plan.u_before), "µm",
                      remark="with the drift since, without new touches"),
            KeyFigure("u with the touches", _rms(plan.u_after), "µm",
                      remark=f"at most {number_text(float(plan.u_after.max()) / MICROMETRE)} µm; "
                      f"a touch has a repeatability of {number_text(noise)} µm"),
            KeyFigure("drift", f"scale {drift.scale:.1%}, level {drift.level / MICROMETRE:.2f} µm, "
                      f"turn {drift.turn / DEGREE:.2f}°, form {drift.form:.1%}",
                      remark=drift.source),
        ),
        tables=(_directions_table(plan),),
        pictures=(Picture("u before and after", lambda: plot_touch_plan(plan, title)),),
    )  # fmt: skip


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) / MICROMETRE


def _rms_text(values: FloatArray) -> str:
    return number_text(_rms(values), decimals(2))


def _directions_table(plan: TouchPlan) -> Table:
    return Table(
        (
            Column.of("touch", [str(i + 1) for i in range(len(plan.directions))]),
            Column.of("polar", polar_angle(plan.directions) / DEGREE, "°", decimals(1)),
            Column.of("azimuth", azimuth_angle(plan.directions) / DEGREE % 360.0, "°", decimals(1)),
        ),
        title="Directions, in their order:",
        explanation="probe frame; the order varies the touch before each touch",
    )


def plot_touch_plan(plan: TouchPlan, title: str = "") -> Figure:
    """Standard uncertainty of the map today and with the touches.

    Parameters
    ----------
    plan : TouchPlan
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(9.6, 4.8, title or "Plan of touches")
    order = np.argsort(plan.u_before)
    places = plan.places[order]
    highest = float(plan.u_before.max()) / MICROMETRE
    for index, (name, values) in enumerate(
        (("u today", plan.u_before), ("u with the touches", plan.u_after)), start=1
    ):
        axes = polar_axes(figure, 1, 2, index, name)
        shown = axes.scatter(
            azimuth_angle(places), polar_angle(places) / DEGREE, c=values[order] / MICROMETRE,
            s=22, cmap="viridis", vmin=0.0, vmax=highest,
        )  # fmt: skip
        axes.grid(visible=False)
        axes.set_ylim(0.0, float(polar_angle(places).max()) / DEGREE)
        figure.colorbar(shown, ax=axes, shrink=0.75, pad=0.12, label="u / µm")
        if index == 1:
            continue
        azimuth = azimuth_angle(plan.directions)
        polar = polar_angle(plan.directions) / DEGREE
        axes.plot(azimuth, polar, "o", ms=13, mfc="w", mec="k", alpha=0.85, clip_on=False)
        for number, (a, p) in enumerate(zip(azimuth, polar, strict=True), start=1):
            axes.annotate(str(number), (a, p), ha="center", va="center", fontsize=8)
    return figure
