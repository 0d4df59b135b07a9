"""Report and picture of an old map that a few touches have brought up to date."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.qualification import FoundDrift, MapUpdate, drifted_map
from pretravel.show import (
    Axis,
    Column,
    Document,
    Dots,
    KeyFigure,
    Picture,
    PlaneChart,
    Rule,
    Scale,
    Table,
    TopView,
    View,
    angles_deg,
    azimuth_axis,
    by_uncertainty,
    decimals,
    direction_words,
    labels_of,
    map_top_view,
    number_text,
    signed_decimals,
    top_view_grid,
)
from pretravel.tasks.qualify.summary import map_span


def map_update_document(
    result: MapUpdate,
    *,
    touches_name: str = "",
    prior_name: str = "",
    warnings: Sequence[str] = (),
) -> Document:
    """The report of an update.

    Parameters
    ----------
    result : MapUpdate
    touches_name, prior_name : str
        Of the files of the new touches and of the old map.
    warnings : sequence of str
        In addition to those of the result.
    """
    old = prior_name or "an old map"
    title = f"{touches_name or 'New touches'} and {old}"
    return Document(
        title=title,
        verdict=f"{old} is brought up to date by {len(result.residuals)} touches in "
        f"{int(result.groups.max()) + 1} directions",
        figures=(*_map_figures(result), *_drift_figures(result), _test_figure(result)),
        tables=(_touches_table(result),),
        pictures=(
            Picture(
                "The new map, its change from the old map, and the new touches",
                lambda: map_update_view(result, title),
            ),
        ),
        warnings=(*warnings, *result.warnings),
    )


def _map_figures(result: MapUpdate) -> tuple[KeyFigure, ...]:
    u_center = np.sqrt(np.maximum(np.diag(result.center_covariance), 0.0)) / MICROMETRE
    _, _, old_u = result.prior_map.over_support()
    _, _, u = result.pretravel_map.over_support()
    dof = result.repeatability_dof
    return (
        KeyFigure("map kind", result.pretravel_map.kind),
        KeyFigure(
            "centre", tuple(result.center.tolist()), "mm", decimals(5),
            tuple(u_center.tolist()), "µm", decimals(2),
        ),
        KeyFigure("pretravel", map_span(result.pretravel_map), "µm", remark="over the whole map"),
        KeyFigure(
            "u of the map", float(np.sqrt(np.mean(u**2))) / MICROMETRE, "µm",
            remark=f"rms over the whole map; {_rms_text(old_u)} µm when the old map was made"
            f"{_of_centers(result)}",
        ),
        KeyFigure(
            "repeatability", result.repeatability / MICROMETRE, "µm",
            remark=f"{number_text(dof, decimals(0))} degrees of freedom, old and new together"
            if math.isfinite(dof)
            else "as given",
        ),
    )  # fmt: skip


def _of_centers(result: MapUpdate) -> str:
    """What u is without the errors of the centres, of which few touches have the larger one."""
    prior = drifted_map(result.prior_map, ring=not result.center_covariance[2, 2] > 0.0)
    if not prior.from_center:
        return ""
    new, old = (
        _rms_text(np.sqrt(prior.variance(one.support.spread, one.covariance.matrix)))
        for one in (result.pretravel_map, result.prior_map)
    )
    return (
        "; both contain the error of the centre that comes from the scatter of the touches. "
        f"Without it: {new} µm, old map {old} µm"
    )


def _rms_text(u: FloatArray) -> str:
    return number_text(float(np.sqrt(np.mean(u**2))) / MICROMETRE, decimals(2))


def _drift_figures(result: MapUpdate) -> tuple[KeyFigure, ...]:
    def figure(
        name: str, what: str, found: FoundDrift, unit: str, factor: float, usual: float
    ) -> KeyFigure:
        usual_text, digits = f"{usual / factor:.2g}", by_uncertainty(found.u / factor)
        blank = "" if unit == "°" else " "
        return KeyFigure(
            name, found.value / factor, unit,
            replace(digits, signed=True), found.u / factor,
            u_digits=digits,
            remark=f"{what}; usual drift {usual_text}{blank}{unit}, {result.drift.source}",
        )  # fmt: skip

    return (
        figure(
            "size", "in all directions alike", result.level, "µm", MICROMETRE, result.drift.level
        ),
        figure("scale", "of the whole pretravel", result.scale, "%", 0.01, result.drift.scale),
        figure("turn", "about the axis", result.turn, "°", DEGREE, result.drift.turn),
    )


def _test_figure(result: MapUpdate) -> KeyFigure:
    return KeyFigure("test against the old map", f"p = {result.p_value:.2g}", detail=True,
                     remark="probability of differences at least as large by chance")  # fmt: skip


def _touches_table(result: MapUpdate) -> Table:
    directions = result.contact_normals @ result.pretravel_map.rotation
    polar, azimuth = angles_deg(directions)
    return Table(
        (
            Column.of("touch", [str(i + 1) for i in range(len(directions))]),
            Column.of("polar", polar, "°", decimals(1)),
            Column.of("azimuth", azimuth, "°", decimals(1)),
            Column.of("touch − old map", result.changes / MICROMETRE, "µm", signed_decimals(2)),
            Column.of("touch − new map", result.residuals / MICROMETRE, "µm", signed_decimals(2)),
        ),
        title="Touches",
        explanation="difference of each touch from the map; the centre is fitted",
        detail=True,
    )


def map_update_view(result: MapUpdate, title: str = "") -> View:
    """The new map, its change, and the touches less the old and the new map."""
    new = top_view_grid(result.pretravel_map)
    return View(
        title or "An old map brought up to date",
        (
            map_top_view(result.pretravel_map, "the new map from above", new),
            _change_chart(result, new),
            _touches_chart(result),
        ),
    )


def _change_chart(result: MapUpdate, new: Mapping[str, FloatArray]) -> TopView:
    """The new map, on the grid of a top view, less the old one."""
    old = top_view_grid(result.prior_map)
    change = new["pretravel_um"] - old["pretravel_um"]
    scale = Scale.of("change", "µm", change, signed=True)
    touched = result.contact_normals @ result.pretravel_map.rotation
    return TopView("new map − old map", new["polar_deg"], new["azimuth_deg"], change, scale,
                   "probe", *angles_deg(touched), "new touches",
                   tuple(direction_words(touched)))  # fmt: skip


def _touches_chart(result: MapUpdate) -> PlaneChart:
    """The touches by their azimuth: before and after the update."""
    touched = result.contact_normals @ result.pretravel_map.rotation
    changes, residuals = result.changes / MICROMETRE, result.residuals / MICROMETRE
    labels = labels_of(
        touched, [("touch − old map", changes, True), ("touch − new map", residuals, True)]
    )
    azimuth = angles_deg(touched)[1]
    marks = (
        Rule(0.0),
        Dots(azimuth, changes, "touches − old map", "before", symbol="ring", labels=labels),
        Dots(azimuth, residuals, "touches − new map", "after", labels=labels),
    )
    return PlaneChart("touches and map", azimuth_axis(), Axis("touches − map", "µm"), marks)
