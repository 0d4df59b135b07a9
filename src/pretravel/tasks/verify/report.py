"""Report of a verification: whether a probe has changed since it was qualified."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, describe
from pretravel.qualification import Cause, Change, LikelyCause, Verification
from pretravel.show import (
    Document,
    Judgement,
    KeyFigure,
    Picture,
    Table,
    by_uncertainty,
    decimals,
    number_text,
    value_text,
)
from pretravel.tasks.history import decision_words

if TYPE_CHECKING:
    from pretravel.base import FloatArray
    from pretravel.files import Entry
    from pretravel.qualification import Qualification
    from pretravel.show import View


def verification_document(
    result: Verification,
    decision: str,
    *,
    title: str = "Verification",
    entries: Sequence[Entry] = (),
    warnings: Sequence[str] = (),
    center_moved: FloatArray | None = None,
    accepted: Qualification | None = None,
) -> Document:
    """The report of a verification.

    Parameters
    ----------
    result : Verification
    decision : str
        What was done with the map: "kept", or "accepted" and the name of the new one.
    title : str
        Touches and map.
    entries : sequence of Entry
        The history of the probe, for the control chart.
    warnings : sequence of str
        In addition to those of the result.
    center_moved : (3,) float, optional
        Shift of the centre of the reference since the qualification. [mm]
    accepted : Qualification, optional
        With the new map, whose doubts are the user's from now on.
    """
    shifted = _shift_figures(center_moved)
    verdict = "CHANGED" if result.changed else "no change found"
    unseen = _unseen_warnings(result)

    def drawn() -> View:
        from pretravel.tasks.verify.picture import verification_view

        return verification_view(result, entries, title)

    keep = decision == "kept" and result.changed
    return Document(
        title=title,
        verdict=f"{verdict} since the qualification{_but_unseen(result)}: "
        f"{result.touches} touches in "
        f"{len(result.directions)} directions, false-alarm rate "
        f"{100.0 * result.false_alarm_rate:g} %",
        judgement=verification_judgement(result),
        figures=(
            *_cause_figures(result),
            *_change_figures(result),
            *shifted,
            *_test_figures(result),
            KeyFigure("new map", decision_words(decision) + _UNTIL_THEN * keep),
            *_new_map_figures(accepted),
        ),
        pictures=(
            Picture("Differences, and the control chart" if entries else "Differences", drawn),
        ),
        notes=(_CHECK_STYLUS,) * (keep and not _drifted(result))
        + (_NOT_SHOWN,) * (keep or (bool(shifted) and not _stands_elsewhere(center_moved))),
        warnings=(
            *unseen, *warnings, *result.warnings,
            *(f"new map: {said}" for said in (accepted.warnings if accepted else ())),
        ),
        data=_data(result, decision),
    )  # fmt: skip


def _new_map_figures(accepted: Qualification | None) -> tuple[KeyFigure, ...]:
    """How good the new map is, and which touches it leaves out."""
    if accepted is None:
        return ()
    u = accepted.pretravel_map.over_support()[2]
    return (
        KeyFigure("u of the new map", float(np.sqrt(np.mean(u**2))) / MICROMETRE, "µm",
                  remark=f"rms; made from these {int(accepted.used.sum())} touches alone"),
        *(KeyFigure("OUTLIER", f"{one.message}. {one.outcome}") for one in accepted.outliers),
    )  # fmt: skip


def _drifted(result: Verification) -> bool:
    """Whether the reference, not the probe, is what has most likely moved."""
    return result.causes[0].name == Cause.DRIFT if result.causes else False


def verification_judgement(result: Verification) -> Judgement:
    """Whether the probe has changed, in a word."""
    if result.changed:
        return Judgement("bad", "Changed")
    if result.unseen_turn is not None:
        return Judgement("caution", "Not decided: a turn would not be seen")
    if result.size_is_unseen:
        return Judgement("caution", "Not decided: a change of size would not be seen")
    return Judgement("good", "No change found")


def _unseen_warnings(result: Verification) -> tuple[str, ...]:
    found = []
    if result.unseen_turn is not None:
        found.append(
            f"{result.unseen_turn}. Touch the directions of pretravel plan-touches, or eight or "
            "more around the probe axis"
        )
    if result.size_is_unseen:
        limit = value_text(result.size.detectable / MICROMETRE, "µm")
        found.append(
            "in these directions a change of size looks like a shift of the reference: one below "
            f"{limit} would not be detected. Did the program stop early? Touch the reference from "
            "the pole to the equator"
        )
    return tuple(found)


def _but_unseen(result: Verification) -> str:
    unseen = ["A TURN OF THE PROBE"] if result.unseen_turn is not None else []
    unseen += ["A CHANGE OF SIZE"] if result.size_is_unseen else []
    return f", BUT {' AND '.join(unseen)} CANNOT BE SEEN" if unseen else ""


_LARGE_TURN = 10.0 * DEGREE
"""Beyond it the lobes of a map are no longer its slope times the turn."""
_LIKELY = 0.5
_NOT_SEPARATED = 2.0
"""An amplitude that could change by so much unseen follows from size and centre alone."""
_FEWER = 0.95
"""Share of the degrees of freedom below which a report gives the reason."""
_TESTS = 3
"""They share the rate of false alarms: each has a third of it, as the report says."""
_UNTIL_THEN = "; do not use the old map until the cause is found"
_CHECK_STYLUS = (
    "check the stylus and its mount, then touch the reference again, or accept the map of the new "
    "touches"
)
_NOT_SHOWN = (
    "a bent stylus or a moved tip shifts only the centre, which verify fits again: measure the "
    "offsets of the tip"
)


_SHIFT = 0.02
"""Shift of the centre that is far above its uncertainty, and of a bent stylus. [mm]"""
_ELSEWHERE = 5.0
"""A larger one is of the reference: no probe works with a tip so far off. [mm]"""


def _stands_elsewhere(moved: FloatArray | None) -> bool:
    return moved is not None and float(np.linalg.norm(moved)) > _ELSEWHERE


def _shift_figures(moved: FloatArray | None) -> tuple[KeyFigure, ...]:
    if moved is None or float(np.linalg.norm(moved)) < _SHIFT:
        return ()
    shift = ", ".join(f"{value:+.3f}" for value in moved)
    bent = "if the reference was not moved, the stylus is bent or the tip has moved"
    remark = "the reference stands elsewhere" if _stands_elsewhere(moved) else bent
    return (KeyFigure("centre moved", f"({shift}) mm since the qualification", remark=remark),)


def _cause_figures(result: Verification) -> tuple[KeyFigure, ...]:
    if not result.causes:
        return ()
    named = [cause for cause in result.causes if cause.mentioned]
    texts = [f"{cause_text(cause)}, probability {cause.probability:.2f}" for cause in named]
    return (KeyFigure("likely cause", "; or ".join(texts)),)


def cause_text(cause: LikelyCause) -> str:
    """A cause of a change in words, with its size.

    >>> cause_text(LikelyCause("spring preload", 0.9, -0.12, 0.03))
    'spring preload lower by 12 % (u = 3 %)'
    >>> cause_text(LikelyCause("unknown", 0.9))
    'none of the known causes'
    """
    size = abs(cause.value)

    def amount(unit: float, word: str, digits: int) -> str:
        if 0.0 < cause.u < math.inf:
            digits = max(digits, -math.floor(math.log10(cause.u / unit)))
        value, u = (value_text(x / unit, word, decimals(digits)) for x in (size, cause.u))
        return f"{value} (u = {u})"

    more = cause.value > 0.0
    texts: dict[str, Callable[[], str]] = {
        Cause.PRELOAD: lambda: (
            f"spring preload {'higher' if more else 'lower'} by {amount(0.01, '%', 0)}"
        ),
        Cause.STYLUS_LENGTH: lambda: (
            f"stylus {'longer' if more else 'shorter'} by {amount(0.01, '%', 0)}"
        ),
        Cause.TURNED: lambda: (
            f"probe turned about its axis by {'+' if more else '-'}{amount(DEGREE, '°', 1)}"
        ),
        Cause.TIP_SIZE: lambda: (
            f"tip {'larger' if more else 'smaller'} by {amount(0.5 * MICROMETRE, 'µm', 1)} in "
            "diameter, a wrong diameter of the reference, or a changed delay (touches alone cannot "
            "distinguish these three)"
        ),
        Cause.LOOSE: lambda: f"loose stylus or tip: scatter times {amount(1.0, '', 1)}",
        Cause.SOFT_SIDE: lambda: (
            f"stylus or seat softer to one side by {amount(MICROMETRE, 'µm', 1)} (loose, cracked)"
        ),
        Cause.ONE_DIRECTION: lambda: (
            f"dirt or a chip on the reference at {describe(np.array(cause.direction))}: "
            f"{amount(MICROMETRE, 'µm', 1)}"
        ),
        Cause.DRIFT: lambda: (
            f"the reference drifted by {amount(MICROMETRE, 'µm', 1)} against the machine during "
            "the touches; no fault of the probe. Let the machine warm up, and touch again"
        ),
        Cause.STEADIER: lambda: "less noise than in the touches of the map; no fault of the probe",
        Cause.UNKNOWN: lambda: "none of the known causes",
        Cause.CHANCE: lambda: "chance: a false alarm",
    }
    return texts[cause.name]()


def _change_figures(result: Verification) -> tuple[KeyFigure, ...]:
    def figure(name: str, what: str, change: Change, unit: str, factor: float) -> KeyFigure:
        if not math.isfinite(change.u):
            return KeyFigure(name, "cannot be determined from this map")
        digits = by_uncertainty(change.u / factor)
        limit = value_text(change.detectable / factor, unit, digits)
        return KeyFigure(
            name, change.value / factor, unit, replace(digits, signed=True),
            change.u / factor, "", digits,
            remark=f"{what}; {limit} would be detected in 95 % of cases",
        )  # fmt: skip

    turn = figure(
        "turn", "of the probe about its axis, since the qualification", result.turn, "°", DEGREE
    )
    if result.unseen_turn is not None:
        turn = KeyFigure("turn", "cannot be determined in these directions")
    others: tuple[KeyFigure, ...] = (
        figure("size", "change of the mean pretravel", result.size, "µm", MICROMETRE),
        figure("amplitude", "change of the variation about the mean", result.amplitude, "%", 0.01),
    )
    if math.isfinite(result.amplitude.u) and result.amplitude.detectable > _NOT_SEPARATED:
        others = (KeyFigure("size, amplitude", "cannot be separated in these directions"),)
    turned = any(each.name == Cause.TURNED and each.probability > _LIKELY for each in result.causes)
    if turned and abs(result.turn.value) > _LARGE_TURN:
        others = (KeyFigure("size, amplitude", "cannot be determined after so large a turn"),)
    return (
        *others,
        turn,
        KeyFigure(
            "largest difference",
            result.largest / MICROMETRE,
            "µm",
            remark="between the map and the mean of the touches in a direction",
        ),
    )


def _test_figures(result: Verification) -> tuple[KeyFigure, ...]:
    def p_value(p: float) -> str:
        return "not tested: no touch is repeated" if math.isnan(p) else f"{p:.2g}"

    tests = KeyFigure(
        "p of each test",
        f"size, amplitude and turn together {p_value(result.p_form)}; all directions together "
        f"{p_value(result.p_map)}; "
        f"repeatability {p_value(result.p_repeatability)}",
        remark="probability of differences at least as large if nothing has changed. The probe is "
        f"reported as changed if one p is below {result.false_alarm_rate / _TESTS:.2g}, a third "
        "of the false-alarm rate",
        detail=True,
    )
    if math.isnan(result.repeatability):
        return (tests,)
    dof = f"{number_text(result.repeatability_dof, decimals(0))} effective degrees of freedom"
    all_dof = result.touches - sum(len(each.rows) for each in result.gross)
    all_dof -= len(result.directions)
    if result.repeatability_dof < _FEWER * all_dof:
        dof += f", not {all_dof}: allows for heavy tails and for directions that scatter more"
    step = f"; positions in steps of {value_text(result.step / MICROMETRE, 'µm')}"
    return (
        KeyFigure("repeatability", result.repeatability / MICROMETRE, "µm",
                  remark=dof + (step if result.step else "")),
        tests,
    )  # fmt: skip


def _data(result: Verification, decision: str) -> tuple[Table, ...]:
    """All values, for programs."""
    unseen = result.unseen_turn
    outcome: dict[str, float | str] = {
        "changed": result.changed,
        "changed_with_touches_left_out": result.changed_with_gross,
        "unseen_turn_deg": unseen.angle / DEGREE if unseen else math.nan,
        "unseen_turn_changes_map_um": unseen.change / MICROMETRE if unseen else math.nan,
        "false_alarm_rate": result.false_alarm_rate,
        "p_form": result.p_form,
        "p_map": result.p_map,
        "p_repeatability": result.p_repeatability,
        "size_um": result.size.value / MICROMETRE,
        "u_size_um": result.size.u / MICROMETRE,
        "amplitude_percent": 100.0 * result.amplitude.value,
        "u_amplitude_percent": 100.0 * result.amplitude.u,
        "turn_deg": result.turn.value / DEGREE,
        "u_turn_deg": result.turn.u / DEGREE,
        "repeatability_um": result.repeatability / MICROMETRE,
        "step_um": result.step / MICROMETRE,
        "largest_difference_um": result.largest / MICROMETRE,
        "touches": result.touches,
        "directions": len(result.directions),
        "decision": decision,
    }
    causes = {
        "cause": [cause.name for cause in result.causes],
        "probability": [cause.probability for cause in result.causes],
        "text": [
            cause_text(cause)
            if math.isfinite(cause.value + cause.u) or cause.name in _WITHOUT_SIZE
            else cause.name
            for cause in result.causes
        ],
    }
    left_out = [row + 1 for outlier in result.gross for row in outlier.rows]
    return (
        Table.of({name: [value] for name, value in outcome.items()}, "Verification"),
        Table.of(causes, "Likely causes"),
        Table.of({"touch": left_out}, "Touches left out"),
    )


_WITHOUT_SIZE = (Cause.STEADIER, Cause.UNKNOWN, Cause.CHANCE)
