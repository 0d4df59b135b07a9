"""The report of a qualification in a few lines: is the probe good, what is known, what is next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pretravel.base import MICROMETRE, describe
from pretravel.maps import PretravelMap
from pretravel.qualification import KindScore, Qualification
from pretravel.show import (
    Judgement,
    KeyFigure,
    Span,
    by_uncertainty,
    decimals,
    number_text,
    value_text,
)
from pretravel.uncertainty import Budget

_GRADES = {
    "good": Judgement("good", "Good"),
    "usable": Judgement("caution", "Usable"),
    "poor": Judgement("bad", "Poor"),
}
_NOT_KNOWN = Judgement("caution", "Not known")
_ACROSS = np.linspace(-1.0, 1.0, 21)


def judgement(result: Qualification) -> Judgement:
    """Whether the probe is good."""
    return _NOT_KNOWN if result.grade is None else _GRADES[result.grade]


def verdict(result: Qualification, point: Budget) -> str:
    """Whether the probe is good, which only repeats tell, and the uncertainty of a point.

    Parameters
    ----------
    result : Qualification
    point : Budget
        Of a point on a part, from `part_point_budget`.
    """
    known = (
        f"a point on a part typically has U = {value_text(point.expanded() / MICROMETRE, 'µm')} "
        f"(k = {number_text(point.coverage_factor())})"
    )
    repeats = value_text(result.repeatability / MICROMETRE, "µm")
    # The grade is of the repeats alone: a good probe can need its map.
    if result.hidden_by_step:
        return (
            "Whether the probe is good is not known, because the positions are in steps of "
            f"{result.effects.step / MICROMETRE:.4g} µm, and touches differ by less: "
            f"write them with more digits. {known[0].upper()}{known[1:]}"
        )
    if result.copies:
        return (
            f"Whether the probe is good is not known, because {result.copies} touches are copies "
            f"of others to the last digit: give each reading once. {known[0].upper()}{known[1:]}"
        )
    if result.before_contact:
        return (
            f"Whether the probe is good is not known, because {result.before_contact}. "
            f"{known[0].upper()}{known[1:]}"
        )
    if result.grade is not None:
        return f"The probe is {result.grade}: a touch repeats to {repeats}, and {known}"
    return (
        "Whether the probe is good is not known, because no direction was touched twice "
        f"(a repeatability of {repeats} is assumed, from the residuals of the map): touch each "
        "direction three "
        f"times. {known[0].upper()}{known[1:]}"
    )


def summary_figures(
    result: Qualification, scores: Sequence[KindScore], saved: bool
) -> tuple[KeyFigure, ...]:
    """What the map is, what it knows, how sure it is, and what to do next.

    Parameters
    ----------
    result : Qualification
    scores : sequence of KindScore
        Empty where the kind was given.
    saved : bool
        Whether the map was written.
    """
    pretravel_map = result.pretravel_map
    u_center = np.sqrt(np.maximum(np.diag(result.center_covariance), 0.0)) / MICROMETRE
    directions, value, u = pretravel_map.over_support()
    highest, worst = int(np.argmax(value)), int(np.argmax(u))
    return (
        KeyFigure("map kind", pretravel_map.kind, remark=_weights(scores)),
        KeyFigure(
            "centre", tuple(result.center.tolist()), "mm", decimals(5),
            tuple(u_center.tolist()), "µm", decimals(2),
        ),
        KeyFigure(
            "effective radius", result.effective_radius, "mm",
            by_uncertainty(result.u_effective_radius),
            result.u_effective_radius / MICROMETRE, "µm", decimals(2),
            coverage_factor=result.radius_budget().coverage_factor(),
        ),
        KeyFigure(
            "pretravel", map_span(pretravel_map), "µm",
            remark=f"largest at {describe(directions[highest])}"
            if np.ptp(value) > 0.0
            else "the same in all directions",
        ),
        KeyFigure(
            "u of the map", float(np.sqrt(np.mean(u**2))) / MICROMETRE, "µm",
            remark=f"rms; largest {value_text(float(u[worst]) / MICROMETRE, 'µm')} at "
            f"{describe(directions[worst])}"
            if np.ptp(u) > 1e-9
            else "the same in all directions",
        ),
        KeyFigure("next", result.next_step or _use(saved)),
    )  # fmt: skip


def map_span(pretravel_map: PretravelMap) -> Span:
    """Smallest and largest pretravel of a map, in µm.

    A map is smallest in a pit near the axis that is narrower than the directions are apart: there
    they are made denser.
    """
    directions, value, _ = pretravel_map.over_support()
    lowest, least = directions[int(np.argmin(value))], float(value.min())
    for radius in (0.1, 0.02, 0.004):
        across = np.linalg.svd(lowest[None, :])[2][1:]
        steps = radius * np.stack(np.meshgrid(_ACROSS, _ACROSS), axis=-1).reshape(-1, 2)
        near = lowest + steps @ across
        near /= np.linalg.norm(near, axis=1, keepdims=True)
        near = near[pretravel_map.support.supports(near)]
        found = pretravel_map.pretravel(near @ pretravel_map.rotation.T)
        if len(found) and found.min() < least:
            lowest, least = near[int(np.argmin(found))], float(found.min())
    return Span.of(np.array([least, value.max()]) / MICROMETRE)


def _weights(scores: Sequence[KindScore]) -> str:
    shares = [
        f"{score.kind} {number_text(score.weight, decimals(2))}"
        for score in scores
        if score.weight > 0.0
    ]
    if len(shares) == 1:
        return "chosen by cross-validation"
    return f"weights {', '.join(shares)}, by cross-validation" if shares else ""


def _use(saved: bool) -> str:
    if not saved:
        return "write the map to a file (.json), then compensate a part with it"
    return "compensate a part with the map; verify the probe from time to time"
