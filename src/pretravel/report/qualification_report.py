"""Report and pictures of a qualification: the map of a probe from touches on a reference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, from_angles, polar_angle
from pretravel.identification.kind_choice import KindScore
from pretravel.identification.physical import PhysicalMapFit
from pretravel.maps.grid import map_grid
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.delay import SignalDelay
from pretravel.qualification.map_warnings import some_directions
from pretravel.qualification.qualification import Qualification
from pretravel.report.document import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Span,
    Table,
)
from pretravel.report.formatting import decimals, number_text, signed_decimals, value_text
from pretravel.report.qualification_summary import summary_figures, verdict
from pretravel.report.style import COLOURS, legend_below, new_figure, polar_axes, some_rows
from pretravel.trigger.six_seats import IDEAL, PARAMETERS
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes


def qualification_document(
    result: Qualification,
    *,
    touches_name: str = "",
    scores: Sequence[KindScore] = (),
    warnings: Sequence[str] = (),
    excluded: Sequence[str] = (),
    saved: bool = True,
) -> Document:
    """The report of a qualification.

    Parameters
    ----------
    result : Qualification
    touches_name : str
        Of the file with the touches.
    scores : sequence of KindScore
        Where the kind of map was chosen among several.
    warnings : sequence of str
        Beside those of the result.
    excluded : sequence of str
        Touches that the user left out.
    saved : bool
        Whether the map was written.

    Returns
    -------
    Document
    """
    pretravel_map = result.pretravel_map
    title = f"{touches_name}, " if touches_name else "Qualification, "
    title += f"map kind {pretravel_map.kind}"
    return Document(
        title=title,
        verdict=verdict(result),
        figures=(
            *summary_figures(result, scores, saved),
            *(() if result.delay is None else (_delay_figure(result.delay),)),
            *_outlier_figures(result),
            *_map_figures(result),
            KeyFigure("reference of map", pretravel_map.provenance.gauge, detail=True),
        ),
        tables=(_scores_table(scores),) if scores else (),
        sections=_sections(result, scores),
        pictures=(
            Picture("Map, touches and residuals", lambda: plot_qualification(result, title)),
        ),
        notes=(*(f"left out as requested: {name}" for name in excluded),),
        warnings=(*warnings, *result.warnings),
    )


def _sections(result: Qualification, scores: Sequence[KindScore]) -> tuple[Section, ...]:
    problems = tuple(f"{score.kind}: {score.problem}" for score in scores if score.problem)
    fit = result.fit
    return (
        *((_six_seat_section(fit),) if isinstance(fit, PhysicalMapFit) else ()),
        *((Section("Kinds that cannot be fitted", problems, detail=True),) if problems else ()),
    )


def _outlier_figures(result: Qualification) -> tuple[KeyFigure, ...]:
    """Each outlier, and the map with and without them."""
    figures = tuple(
        KeyFigure("OUTLIER", f"{outlier.message}. {outlier.outcome}") for outlier in result.outliers
    )
    if result.used.all():
        return figures
    effect = result.effect_of_outliers / MICROMETRE
    return (
        *figures,
        KeyFigure(
            "with outliers", f"the map would differ by up to {value_text(effect, 'µm')}"
            if math.isfinite(effect)
            else "no map could be fitted",
        ),
    )  # fmt: skip


def _map_figures(result: Qualification) -> tuple[KeyFigure, ...]:
    pretravel_map = result.pretravel_map
    normals = some_directions(result.contact_normals[result.used])
    value = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
    u = pretravel_map.standard_uncertainty(normals) / MICROMETRE
    dof = result.repeatability_dof
    made = pretravel_map.provenance
    return (
        KeyFigure("qualified", f"{made.source}, {made.touches}", detail=True),
        KeyFigure("at the touches", Span.of(value), "µm", remark="pretravel", detail=True),
        KeyFigure("u at the touches", Span.of(u), "µm", remark="of the map", detail=True),
        KeyFigure(
            "repeatability", result.repeatability / MICROMETRE, "µm",
            remark=f"{number_text(dof, decimals(0))} degrees of freedom"
            if math.isfinite(dof)
            else "as given",
            detail=True,
        ),
        KeyFigure(
            "fixed scatter", pretravel_map.fixed_scatter / MICROMETRE, "µm",
            remark="of a touch, which repeats do not reduce", detail=True,
        ),
        KeyFigure(
            "residuals", float(np.std(result.residuals[result.used])) / MICROMETRE, "µm",
            remark="standard deviation, "
            f"{number_text(result.degrees_of_freedom, decimals(1))} degrees of freedom",
            detail=True,
        ),
    )  # fmt: skip


def _delay_figure(delay: SignalDelay) -> KeyFigure:
    return KeyFigure(
        "signal delay",
        delay.delay * 1e3,
        "ms",
        decimals(3),
        delay.u_delay * 1e3,
        remark=f"from feeds of {delay.slowest:g} to {delay.fastest:g} mm/min; the map is that of "
        "the probe at rest, compensation first subtracts the feed times the delay",
    )


def _scores_table(scores: Sequence[KindScore]) -> Table:
    """How the kinds of map predict touches that were left out of their fits."""
    fitted = [score for score in scores if not score.problem]
    return Table(
        (
            Column.of("kind", [score.kind for score in fitted]),
            Column.of("weight", [score.weight for score in fitted]),
            Column.of("left-out rms", [score.rms / MICROMETRE for score in fitted], "µm"),
            Column.of("±", [score.u_rms / MICROMETRE for score in fitted], "µm"),
            Column.of("(error/u)²", [score.reduced_chi_square for score in fitted]),
            Column.of(
                "score", [score.logarithmic_score for score in fitted], digits=signed_decimals(2)
            ),
        ),
        title="Directions that were left out of the fit of each kind:",
        explanation="left-out rms: of the touches that were left out, repeatability included, "
        "± its standard error; (error/u)²: mean over the touches, each with its own u, 1 where u "
        "is right; score: mean of ln(u/µm) + (error/u)²/2, the smaller the better; weight: share "
        "in the average, chosen for the largest probability of these directions.",
        detail=True,
    )


def _six_seat_section(fit: PhysicalMapFit) -> Section:
    """The numbers of a fitted six-seat probe."""
    spread = np.sqrt(np.diag(fit.parameter_covariance))
    index = {parameter.name: i for i, parameter in enumerate(PARAMETERS)}

    def figure(label: str, name: str, unit: str, factor: float, remark: str = "") -> KeyFigure:
        value, u = fit.basis.named[name], float(spread[index[name]])
        u *= value if PARAMETERS[index[name]].logarithmic else 1.0
        digits = decimals(1 if name == "support_angle" else 2)
        return KeyFigure(label, value * factor, unit, digits, u * factor, remark=remark)

    learned = ", ".join(
        f"{parameter.name.replace('_', ' ')} "
        f"{number_text(100.0 * fit.learned[index[parameter.name]], decimals(0))} %"
        for parameter in IDEAL
    )
    return Section(
        "Six-seat probe",
        figures=(
            figure("lever / radius", "lever_ratio", "", 1.0, "lever over tripod radius"),
            figure("support angle", "support_angle", "°", 1.0 / DEGREE),
            figure("first rod", "rod_azimuth", "°", 1.0 / DEGREE, "azimuth, or 120° further"),
            figure("lateral deflection", "lateral_deflection", "µm", 1.0 / MICROMETRE),
            figure("seat indentation", "seat_indentation", "µm", 1.0 / MICROMETRE, "at rest"),
            KeyFigure(
                "learned", learned, remark="share of the prior variance that the touches removed"
            ),
            KeyFigure("asymmetry", f"{fit.scales.mean('asymmetry'):.2g} of the usual (averaged)"),
        ),
        detail=True,
    )  # fmt: skip


def plot_qualification(qualification: Qualification, title: str = "") -> Figure:
    """The map from above, as polar diagrams with the touches, and the residuals.

    Parameters
    ----------
    qualification : Qualification
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    pretravel_map = qualification.pretravel_map
    figure = new_figure(13.0, 4.8, title or f"Qualification, map kind {pretravel_map.kind}")
    draw_map(polar_axes(figure, 1, 3, 1, "pretravel, seen from the spindle"), pretravel_map)
    directions = qualification.contact_normals @ pretravel_map.rotation
    _draw_touches(
        polar_axes(figure, 1, 3, 2, "pretravel / µm, ± 2 u of the map"), qualification, directions
    )
    _draw_residuals(figure.add_subplot(1, 3, 3), qualification, directions)
    return figure


def draw_map(axes: PolarAxes, pretravel_map: PretravelMap) -> None:
    """A map as seen from the spindle: azimuth around, polar angle outwards.

    Parameters
    ----------
    axes : matplotlib PolarAxes
    pretravel_map : PretravelMap
    """
    values = map_grid(pretravel_map, polar_step=2.0, azimuth_step=3.0)
    azimuth = np.append(values["azimuth_deg"], 360.0) * DEGREE
    pretravel = np.hstack([values["pretravel_um"], values["pretravel_um"][:, :1]])
    mesh = axes.pcolormesh(
        azimuth, values["polar_deg"], pretravel, shading="gouraud", cmap="viridis"
    )
    nodes = pretravel_map.support.nodes
    if len(nodes) <= 400:
        axes.plot(azimuth_angle(nodes), polar_angle(nodes) / DEGREE, "o", ms=3, mfc="w", mec="k",
                  mew=0.4, clip_on=False)  # fmt: skip
    axes.set_ylim(0.0, float(values["polar_deg"].max()))
    axes.grid(visible=False)
    figure = axes.get_figure()
    assert figure is not None
    figure.colorbar(mesh, ax=axes, shrink=0.75, pad=0.12, label="pretravel / µm")


def draw_polar_diagram(
    axes: PolarAxes, pretravel_map: PretravelMap, polar_deg: float, colour: str, label: str
) -> None:
    """Pretravel over azimuth at one polar angle, with a band of two uncertainties.

    Parameters
    ----------
    axes : matplotlib PolarAxes
    pretravel_map : PretravelMap
    polar_deg : float
        [deg]
    colour, label : str
    """
    azimuth = np.linspace(0.0, 2.0 * np.pi, 361)
    directions = from_angles(polar_deg * DEGREE, azimuth)
    supported = pretravel_map.support.supports(directions)
    if not supported.any():
        return
    normals = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
    u = pretravel_map.standard_uncertainty(normals) / MICROMETRE
    value[~supported] = np.nan
    axes.plot(azimuth, value, color=colour, lw=1.6, label=label)
    axes.fill_between(azimuth, value - 2.0 * u, value + 2.0 * u, color=colour, alpha=0.15, lw=0)


def _draw_touches(axes: PolarAxes, qualification: Qualification, directions: FloatArray) -> None:
    """The map at up to four polar angles, with the touches near them."""
    polar = polar_angle(directions) / DEGREE
    observed = qualification.observed / MICROMETRE
    levels = np.unique(np.round(polar / 2.5) * 2.5)[::-1]
    levels = levels[levels > 1.0][:4]
    for colour, level in zip(COLOURS, levels, strict=False):
        draw_polar_diagram(
            axes, qualification.pretravel_map, float(level), colour, f"polar {level:g}°"
        )
        rows = some_rows(np.flatnonzero(np.abs(polar - level) < 1.5))
        axes.plot(azimuth_angle(directions[rows]), observed[rows], ".", color=colour, ms=4)
    axes.set_ylim(bottom=0.0 if observed.min() > 0.0 else None)
    legend_below(axes, 4)


def _draw_residuals(axes: Axes, qualification: Qualification, directions: FloatArray) -> None:
    """The residuals of the map, before those of a least-squares sphere about its own centre."""
    observed = qualification.observed / MICROMETRE
    residuals = qualification.residuals / MICROMETRE
    number = np.arange(1, len(observed) + 1)
    sphere = np.hstack([np.ones((len(observed), 1)), directions])
    mean = observed - sphere @ np.linalg.lstsq(sphere, observed, rcond=None)[0]
    kind = qualification.pretravel_map.kind
    drawn = some_rows(np.arange(len(number)))
    share = "" if len(drawn) == len(number) else f" ({len(drawn)} of {len(number)} drawn)"
    axes.plot(
        number[drawn], mean[drawn], ".", color="#bbbbbb", ms=4, label="left by the mean radius"
    )
    axes.plot(
        number[drawn], residuals[drawn], ".", color=COLOURS[0], ms=5, label=f"left by {kind}{share}"
    )
    rows = [row for outlier in qualification.outliers for row in outlier.rows]
    if rows:
        axes.plot(number[rows], residuals[rows], "o", mfc="none", mec=COLOURS[3], ms=9,
                  label="named as outlier")  # fmt: skip
    axes.axhline(0.0, color="k", lw=0.6)
    axes.set_xlabel("touch")
    axes.set_ylabel("residual / µm")
    axes.legend(fontsize=8)
    axes.set_title("residuals", fontsize=11)
