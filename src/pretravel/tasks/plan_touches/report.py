"""Report of a plan of few touches: where, and what they bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.qualification import TouchPlan
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Table,
    angles_deg,
    decimals,
    number_text,
)

if TYPE_CHECKING:
    from pretravel.show import View


def touch_plan_document(plan: TouchPlan, *, map_name: str = "") -> Document:
    """The report of a plan.

    Parameters
    ----------
    plan : TouchPlan
    map_name : str
        Of the file of the old map.
    """
    title = f"Touches that keep {map_name or 'a map'} good"
    drift = plan.prior.drift

    def drawn() -> View:
        from pretravel.tasks.plan_touches.picture import touch_plan_view

        return touch_plan_view(plan, title)

    noise = plan.prior.pretravel_map.repeatability / MICROMETRE
    return Document(
        title=title,
        verdict=f"{len(plan.directions)} touches reduce u of the map from "
        f"{_rms_text(plan.u_before)} to {_rms_text(plan.u_after)} µm "
        "(without the error of the centre, which shifts all points alike)",
        figures=(
            KeyFigure("u of the old map", _rms(plan.u_old), "µm",
                      remark="when the map was made: rms over the directions where the map will "
                      "be used; qualify prints the rms over all directions"),
            KeyFigure("u today", _rms(plan.u_before), "µm",
                      remark="after the usual drift"),
            KeyFigure("u with the touches", _rms(plan.u_after), "µm",
                      remark=f"at most {number_text(float(plan.u_after.max()) / MICROMETRE)} µm; "
                      f"for a repeatability of {number_text(noise)} µm"),
            KeyFigure("u of the updated map", _rms(plan.u_updated), "µm",
                      remark=_of_update(plan)),
            KeyFigure("usual drift", f"size {drift.level / MICROMETRE:.2f} µm, "
                      f"scale {100.0 * drift.scale:.1f} %, "
                      f"turn {drift.turn / DEGREE:.2f}°, form {100.0 * drift.form:.1f} %",
                      remark=f"{drift.source}; size: in all directions alike; scale: of the whole "
                      "pretravel; turn: about the axis; form: other changes, in % of the map's "
                      "variation"),
        ),
        tables=(_directions_table(plan),),
        pictures=(Picture("u today and with the touches", drawn),),
    )  # fmt: skip


def _of_update(plan: TouchPlan) -> str:
    """What u contains that a qualification with the old map says."""
    shown = "about the rms that qualify will print"
    if not plan.prior.from_center:
        return shown
    return (
        f"{shown}; unlike the values above, it contains the part of the centre's error that comes "
        "from the scatter of the touches"
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) / MICROMETRE


def _rms_text(values: FloatArray) -> str:
    return number_text(_rms(values), decimals(2))


def _directions_table(plan: TouchPlan) -> Table:
    polar, azimuth = angles_deg(plan.directions)
    return Table(
        (
            Column.of("touch", [str(i + 1) for i in range(len(plan.directions))]),
            Column.of("polar", polar, "°", decimals(1)),
            Column.of("azimuth", azimuth, "°", decimals(1)),
        ),
        title="Directions, in their order:",
        explanation="In the probe frame. In this order, the tip arrives from changing directions.",
    )
