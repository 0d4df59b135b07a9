"""Report of the figures of a standard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.laboratory.budget_report import budgets_data, sphere_section
from pretravel.laboratory.measured_spheres import MeasuredSphere
from pretravel.laboratory.standards.standard_check import (
    COMPARED,
    UNCHECKED,
    LimitOutcome,
    StandardCheck,
    StandardFigure,
)
from pretravel.laboratory.standards.standard_figures import standard_table
from pretravel.show import (
    Column,
    Document,
    Judgement,
    KeyFigure,
    Picture,
    Section,
    Table,
    budget_picture,
    decimals,
    value_text,
)
from pretravel.task import budget_table

if TYPE_CHECKING:
    from pretravel.show import View

_ORIGIN = {UNCHECKED: "not checked", COMPARED: "checked"}
"""Of a definition, by its status."""


def standards_document(
    check: StandardCheck,
    *,
    touches_name: str = "",
    sphere: MeasuredSphere | None = None,
    method: Sequence[str] = (),
    warnings: Sequence[str] = (),
) -> Document:
    """The report of the figures of a standard.

    Parameters
    ----------
    check : StandardCheck
    touches_name : str
        Of the file with the touches.
    sphere : MeasuredSphere, optional
        Through all touches, compensated.
    method : sequence of str
        What was done, and whether its definitions were compared with the text of the standard.
    warnings : sequence of str
    """
    title = f"{touches_name}: {check.standard}" if touches_name else check.standard
    budgets = (*check.budgets, *(() if sphere is None else (sphere.budget,)))
    return Document(
        title=title,
        verdict=f"{check.standard}: {_verdict(check)}",
        judgement=_judgement(check),
        tables=(_figures_table(check),),
        sections=(
            Section(
                "Definitions",
                figures=tuple(
                    KeyFigure(
                        one.name.partition(" (")[0],
                        one.meaning,
                        remark=_ORIGIN.get(one.status, one.status),
                    )
                    for one in check.figures
                ),
            ),
            *(() if sphere is None else (sphere_section(sphere),)),
            *_test_values(check),
            Section(
                "Method",
                tuple(method),
                detail=True,
                certificate=True,
            ),
        ),
        pictures=(
            *_residual_picture(check, title),
            *(budget_picture(b, b.result or "the test value") for b in check.budgets),
            *(() if sphere is None else (budget_picture(sphere.budget, "the diameter"),)),
        ),
        notes=check.notes,
        warnings=tuple(warnings),
        budgets=budgets,
        data=(
            Table.of(standard_table(check), "Figures"),
            Table.of({"reason": check.why_no_conformity}, "Why no conformity is stated"),
            budgets_data(budgets),
        ),
    )


def _residual_picture(check: StandardCheck, title: str) -> tuple[Picture, ...]:
    """None where nothing was fitted: repeats in one direction alone."""
    if not check.sets:
        return ()

    def view() -> View:
        from pretravel.laboratory.tasks.check.picture import check_view

        return check_view(check, title)

    return (Picture("Residuals at the places of the touches", view),)


def _judgement(check: StandardCheck) -> Judgement | None:
    """The worst outcome of the figures with a limit; None without one."""
    found = {figure.outcome for figure in check.figures if figure.limit is not None}
    if LimitOutcome.EXCEEDS in found:
        return Judgement("bad", "Exceeds the limit")
    if LimitOutcome.UNDECIDED in found:
        return Judgement("caution", "Undecided")
    return Judgement("good", "Within the limits") if found else None


def _verdict(check: StandardCheck) -> str:
    """What was found of the limits, and what that does not state."""
    reasons = ", and ".join(check.why_no_conformity)
    without = (
        f". This is not a statement of conformity to the standard: {reasons}" if reasons else ""
    )
    return _compared(check) + without


def _compared(check: StandardCheck) -> str:
    """The figures and their limits."""
    limited = [figure for figure in check.figures if figure.limit is not None]
    if not limited:
        values = ", ".join(
            f"{figure.name.partition(' (')[0]} {value_text(figure.value / MICROMETRE, 'µm')}"
            for figure in check.figures
        )
        return f"{values} (no limit is given)"
    exceeding = _names(limited, LimitOutcome.EXCEEDS)
    undecided = _names(limited, LimitOutcome.UNDECIDED)
    if exceeding:
        return f"{exceeding} exceed{'' if ',' in exceeding else 's'} the limit"
    if undecided:
        return f"undecided: {undecided} differ from the limit by less than U"
    count, all_figures = len(limited), len(check.figures)
    one = "figure is within its limit" if all_figures == 1 else "figures are within their limits"
    if count == all_figures:
        return f"{count} of {all_figures} {one}"
    return f"{_names(limited, LimitOutcome.WITHIN)} within the limit; the others have none"


def _names(figures: Sequence[StandardFigure], outcome: LimitOutcome) -> str:
    """The figures with an outcome, by the first part of their names."""
    return ", ".join(f.name.partition(" (")[0] for f in figures if f.outcome is outcome)


def _test_values(check: StandardCheck) -> tuple[Section, ...]:
    """The budgets of the test values; none where nothing is stated."""
    if not check.budgets:
        return ()
    tables = tuple(budget_table(budget, title=budget.result) for budget in check.budgets)
    heading = "Uncertainty of the test values"
    return (Section(heading, tables=tables, detail=True, certificate=True),)


def _figures_table(check: StandardCheck) -> Table:
    def micrometres(values: Sequence[float]) -> list[float]:
        return [value / MICROMETRE for value in values]

    figures, digits = check.figures, decimals(3)
    limits = [math.nan if figure.limit is None else figure.limit for figure in figures]
    u = [math.nan if figure.u_test is None else figure.u_test for figure in figures]
    limited = any(figure.limit is not None for figure in figures)
    unknown = not np.isfinite(u).any()
    decided = (
        Column.of("limit", micrometres(limits), "µm", digits),
        Column.of("verdict", [figure.verdict for figure in figures]),
    )
    return Table(
        (
            Column.of("test value", [figure.name for figure in figures]),
            Column.of("value", micrometres([f.value for f in figures]), "µm", digits),
            *(() if unknown else (Column.of("u of test value", micrometres(u), "µm", digits),)),
            *(decided if limited else ()),
        ),
        explanation=("" if unknown else _U_OF_TEST_VALUE) + (_BY_RULE if limited else ""),
    )


_BY_RULE = (
    "Verdict: by the rule of ISO 14253-1, with U = 2 u, or more if u has few degrees of freedom. "
    "Without u, by the value alone."
)
_U_OF_TEST_VALUE = (
    "u of test value: standard uncertainty, from the calibration of the reference; of an offset, "
    "from the touches. Empty if it is not known. "
)
