"""Report of a qualification: the map of a probe from touches on a reference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, MICROMETRE
from pretravel.maps import (
    AXIAL_PRETRAVEL,
    USUAL_U_DIAMETER,
    some_directions,
)
from pretravel.qualification import (
    KindScore,
    Qualification,
    SignalDelay,
)
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Span,
    Table,
    budget_picture,
    decimals,
    number_text,
    signed_decimals,
    value_text,
)
from pretravel.six_seats import IDEAL, PARAMETERS, PhysicalMapFit
from pretravel.task import budget_section
from pretravel.tasks.qualify.summary import judgement, summary_figures, verdict

if TYPE_CHECKING:
    from pretravel.show import View

_MODEL_NUMBERS = {
    "lever_ratio": "lever / radius",
    "rod_azimuth": "first rod",
    "tip_approach": "compression of tip and part",
}
"""Of the six-seat model, under the names that its other figures have."""


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
        In addition to those of the result.
    excluded : sequence of str
        Touches that the user left out.
    saved : bool
        Whether the map was written.
    """
    pretravel_map = result.pretravel_map
    title = f"{touches_name}, " if touches_name else "Qualification, "
    title += f"map kind {pretravel_map.kind}"
    budgets = (result.part_point_budget(), result.radius_budget())

    def drawn() -> View:
        from pretravel.tasks.qualify.picture import qualification_view

        return qualification_view(result, title)

    return Document(
        title=title,
        verdict=verdict(result, budgets[0]),
        judgement=judgement(result),
        figures=(
            *summary_figures(result, scores, saved),
            *(() if result.delay is None else (_delay_figure(result.delay),)),
            *_outlier_figures(result),
            *_assumed_figures(result),
            *_map_figures(result),
            KeyFigure("zero of the map", pretravel_map.provenance.gauge, detail=True),
        ),
        tables=(_scores_table(scores),) if scores else (),
        sections=(
            *_sections(result, scores),
            *budget_section(budgets),
            Section("Method", (_method(result),), detail=True, certificate=True),
        ),
        pictures=(
            Picture("Map, touches and residuals", drawn),
            *(budget_picture(budget, budget.result) for budget in budgets),
        ),
        notes=(*(f"left out as requested: {name}" for name in excluded),),
        warnings=(*warnings, *result.warnings),
        budgets=budgets,
    )


def _method(result: Qualification) -> str:
    """What was done, in sentences for a certificate."""
    made = result.pretravel_map.provenance
    return (
        f"The probe was {made.source} ({made.touches}). The pretravel of a touch is how far "
        "the machine has moved between the first contact and the trigger. Centre, effective "
        f"radius and a map of kind {result.pretravel_map.kind} were fitted to the touches; the "
        "scatter of repeats and residuals, the reference and its temperature are in the "
        "uncertainty. The U of a point on a part contains the errors of a single touch and of the "
        "map, but none of the machine."
    )


def _sections(result: Qualification, scores: Sequence[KindScore]) -> tuple[Section, ...]:
    problems = tuple(f"{score.kind}: {score.problem}" for score in scores if score.problem)
    fit = result.fit
    return (
        *((_six_seat_section(fit),) if isinstance(fit, PhysicalMapFit) else ()),
        *((Section("Kinds that were not compared", problems, detail=True),) if problems else ()),
    )


def _assumed_figures(result: Qualification) -> tuple[KeyFigure, ...]:
    """What of probe and reference was assumed: a usual value is no warning, and each reads it."""
    assumed = assumptions(result)
    return (KeyFigure("assumed", " and ".join(assumed.values())),) if assumed else ()


def assumptions(result: Qualification) -> dict[str, str]:
    """What of probe and reference was assumed, by the option that states it."""
    axial, assumed = result.setup.axial_pretravel, {}
    usual = axial == AXIAL_PRETRAVEL and result.setup.tip_diameter is not None
    if not result.setup.ring and usual and result.pretravel_map.kind == "harmonic":
        assumed["--axial-pretravel"] = (
            f"{AXIAL_PRETRAVEL / MICROMETRE:g} µm of pretravel along the probe's axis "
            "(its u is in u of the centre)"
        )
    if result.setup.u_diameter is None:
        of_what = "ring or pin" if result.setup.ring else "sphere"
        assumed["--u-diameter"] = (
            f"u of the diameter of the {of_what} = {USUAL_U_DIAMETER / MICROMETRE:g} µm"
        )
    return assumed


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
        KeyFigure("made from", f"{made.touches}; {made.source}", detail=True),
        KeyFigure("at the touches", Span.of(value), "µm", remark="pretravel of the map",
                  detail=True),
        KeyFigure("u at the touches", Span.of(u), "µm", remark="u of the map", detail=True),
        KeyFigure(
            "repeatability", result.repeatability / MICROMETRE, "µm",
            remark=f"{number_text(dof, decimals(0))} degrees of freedom"
            if math.isfinite(dof)
            else "as given",
            detail=True,
        ),
        KeyFigure(
            "fixed scatter", pretravel_map.fixed_scatter / MICROMETRE, "µm",
            remark="between places; repeats at one place do not reduce it",
            detail=True,
        ),
        KeyFigure(
            "residuals", float(np.std(result.residuals[result.used])) / MICROMETRE, "µm",
            remark="standard deviation, "
            f"{number_text(result.degrees_of_freedom, decimals(1))} degrees of freedom",
            detail=True,
        ),
        KeyFigure(
            "R²", result.explained_share, "", decimals(4),
            remark="share of the touches' variance that the map explains", detail=True,
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
        title="How each kind of map predicts directions that were left out of its fit:",
        explanation="Left-out rms: rms difference of the map from the mean of the touches in each "
        "left-out direction, which also contains the scatter of these touches; ± is its standard "
        "error. (error/u)²: mean over these directions, 1 where u is right. Score: mean of "
        "ln(u/µm) + (error/u)²/2; smaller is better. Weight: share of the kind in the averaged "
        "map; the weights are chosen to make the left-out touches most probable.",
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
        f"{_MODEL_NUMBERS.get(parameter.name, parameter.name.replace('_', ' '))} "
        f"{number_text(100.0 * fit.learned[index[parameter.name]], decimals(0))} %"
        for parameter in IDEAL
    )
    return Section(
        "Six-seat model",
        figures=(
            figure("lever / radius", "lever_ratio", "", 1.0,
                   "from the tip to the plane of the rods, over the tripod radius"),
            figure("support angle", "support_angle", "°", 1.0 / DEGREE),
            figure("first rod", "rod_azimuth", "°", 1.0 / DEGREE, "azimuth, or 120° further"),
            figure("lateral deflection", "lateral_deflection", "µm", 1.0 / MICROMETRE),
            figure("seat indentation", "seat_indentation", "µm", 1.0 / MICROMETRE, "at rest"),
            KeyFigure(
                "share of the touches", learned,
                remark="in each number; the rest is the value of usual probes",
            ),
            KeyFigure(
                "unevenness",
                f"{fit.scales.mean('asymmetry'):.2g} times that of usual probes",
                remark="differences among the rods and among the seats",
            ),
        ),
        detail=True,
    )  # fmt: skip
