"""Report and picture of an old map that a few touches have brought up to date."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.directions import azimuth_angle, polar_angle
from pretravel.qualification.map_warnings import over_support
from pretravel.qualification.prior_update import FoundDrift, MapUpdate
from pretravel.report.document import Column, Document, KeyFigure, Picture, Span, Table
from pretravel.report.formatting import decimals, number_text, signed_decimals
from pretravel.report.qualification_report import draw_map
from pretravel.report.style import COLOURS, new_figure, polar_axes
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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
        Beside those of the result.

    Returns
    -------
    Document
    """
    old = prior_name or "an old map"
    title = f"{touches_name or 'New touches'} and {old}"
    return Document(
        title=title,
        verdict=f"{old}, brought up to date by {len(result.residuals)} touches in "
        f"{int(result.groups.max()) + 1} directions; they fit it (p = {result.p_value:.2g})",
        figures=(*_map_figures(result), *_drift_figures(result)),
        tables=(_touches_table(result),),
        pictures=(Picture("The new map, and its change", lambda: plot_map_update(result, title)),),
        warnings=(*warnings, *result.warnings),
    )


def _map_figures(result: MapUpdate) -> tuple[KeyFigure, ...]:
    u_center = np.sqrt(np.maximum(np.diag(result.center_covariance), 0.0)) / MICROMETRE
    _, _, old_u = over_support(result.prior_map)
    _, value, u = over_support(result.pretravel_map)
    dof = result.repeatability_dof
    return (
        KeyFigure("map kind", result.pretravel_map.kind),
        KeyFigure(
            "centre", tuple(result.center.tolist()), "mm", decimals(5),
            tuple(u_center.tolist()), "µm", decimals(2),
        ),
        KeyFigure("pretravel", Span.of(value / MICROMETRE), "µm", remark="over the whole map"),
        KeyFigure(
            "u of the map", float(np.sqrt(np.mean(u**2))) / MICROMETRE, "µm",
            remark="root mean square over the whole map; of the old map when it was made: "
            f"{number_text(float(np.sqrt(np.mean(old_u**2))) / MICROMETRE, decimals(2))} µm",
        ),
        KeyFigure(
            "repeatability", result.repeatability / MICROMETRE, "µm",
            remark=f"{number_text(dof, decimals(0))} degrees of freedom, old and new together"
            if math.isfinite(dof)
            else "as given",
        ),
    )  # fmt: skip


def _drift_figures(result: MapUpdate) -> tuple[KeyFigure, ...]:
    def figure(name: str, found: FoundDrift, unit: str, factor: float, usual: float) -> KeyFigure:
        usual_text = number_text(usual / factor, decimals(2))
        return KeyFigure(
            f"drift of {name}", found.value / factor, unit, signed_decimals(2), found.u / factor,
            u_digits=decimals(2), remark=f"usual: {usual_text} {unit} ({result.drift.source})",
        )  # fmt: skip

    return (
        figure("scale", result.scale, "%", 0.01, result.drift.scale),
        figure("level", result.level, "µm", MICROMETRE, result.drift.level),
        figure("turn", result.turn, "°", DEGREE, result.drift.turn),
    )


def _touches_table(result: MapUpdate) -> Table:
    directions = result.contact_normals @ result.pretravel_map.rotation
    return Table(
        (
            Column.of("touch", [str(i + 1) for i in range(len(directions))]),
            Column.of("polar", polar_angle(directions) / DEGREE, "°", decimals(1)),
            Column.of("azimuth", azimuth_angle(directions) / DEGREE % 360.0, "°", decimals(1)),
            Column.of("less old map", result.changes / MICROMETRE, "µm", signed_decimals(2)),
            Column.of("less new map", result.residuals / MICROMETRE, "µm", signed_decimals(2)),
        ),
        title="Touches",
        explanation="pretravel of each touch less that of the map; the centre is fitted",
        detail=True,
    )


def plot_map_update(result: MapUpdate, title: str = "") -> Figure:
    """The new map, its change, and the touches less the old and the new map.

    Parameters
    ----------
    result : MapUpdate
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(13.0, 4.8, title or "An old map brought up to date")
    draw_map(polar_axes(figure, 1, 3, 1, "pretravel, seen from the spindle"), result.pretravel_map)
    change = polar_axes(figure, 1, 3, 2, "new map less old map")
    directions = over_support(result.pretravel_map)[0]
    normals = directions @ result.pretravel_map.rotation.T
    difference = result.pretravel_map.pretravel(normals, extrapolate=True)
    difference = (difference - result.prior_map.pretravel(normals, extrapolate=True)) / MICROMETRE
    limit = max(float(np.abs(difference).max()), 0.05)
    shown = change.scatter(
        azimuth_angle(directions), polar_angle(directions) / DEGREE, c=difference, s=14,
        cmap="RdBu_r", vmin=-limit, vmax=limit,
    )  # fmt: skip
    touched = result.contact_normals @ result.pretravel_map.rotation
    change.plot(azimuth_angle(touched), polar_angle(touched) / DEGREE, "o", ms=6, mfc="none",
                mec="k", clip_on=False)  # fmt: skip
    change.grid(visible=False)
    figure.colorbar(shown, ax=change, shrink=0.75, pad=0.12, label="change / µm")
    _draw_touches(figure.add_subplot(1, 3, 3), result)
    return figure


def _draw_touches(axes: Axes, result: MapUpdate) -> None:
    number = np.arange(1, len(result.changes) + 1)
    axes.plot(number, result.changes / MICROMETRE, "o", ms=4, color="#bbbbbb", label="less old map")
    axes.plot(number, result.residuals / MICROMETRE, ".", color=COLOURS[0], label="less new map")
    axes.axhline(0.0, color="k", lw=0.6)
    axes.set_xlabel("touch")
    axes.set_ylabel("pretravel / µm")
    axes.legend(fontsize=8)
