"""Report and picture of the figures of a standard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.compensation.measured_sphere import MeasuredSphere
from pretravel.laboratory.standard_check import LimitOutcome, StandardCheck, StandardFigure
from pretravel.report.budget_report import budget_table, sphere_section
from pretravel.report.document import Column, Document, KeyFigure, Picture, Section, Table
from pretravel.report.formatting import decimals
from pretravel.report.style import COLOURS, new_figure
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def standards_document(
    check: StandardCheck,
    *,
    touches_name: str = "",
    sphere: MeasuredSphere | None = None,
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
    warnings : sequence of str

    Returns
    -------
    Document
    """
    title = f"{touches_name}: {check.standard}" if touches_name else check.standard
    return Document(
        title=title,
        verdict=f"{check.standard}: {_verdict(check)}",
        tables=(_figures_table(check),),
        sections=(
            *(() if sphere is None else (sphere_section(sphere),)),
            *_test_values(check),
            Section(
                "Definitions",
                figures=tuple(KeyFigure(figure.name, figure.meaning) for figure in check.figures),
                detail=True,
            ),
        ),
        pictures=(Picture("Residuals", lambda: plot_check(check, title)),),
        notes=check.notes,
        warnings=tuple(warnings),
        budgets=(*check.budgets, *(() if sphere is None else (sphere.budget,))),
    )


def _verdict(check: StandardCheck) -> str:
    """What was found of the limits, and what that does not state."""
    reasons = ", and ".join(check.why_no_conformity)
    without = f". This is no statement of conformity to the standard: {reasons}" if reasons else ""
    return _compared(check) + without


def _compared(check: StandardCheck) -> str:
    """The figures and their limits."""
    limited = [figure for figure in check.figures if figure.limit is not None]
    if not limited:
        return "no limit given"
    exceeding = _names(limited, LimitOutcome.EXCEEDS)
    undecided = _names(limited, LimitOutcome.UNDECIDED)
    if exceeding:
        return f"{exceeding} exceed{'' if ',' in exceeding else 's'} the limit"
    if undecided:
        return f"undecided: {undecided} within U (k = 2) of the limit"
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
    return (Section("Uncertainty of the test values", tables=tables, detail=True),)


def _figures_table(check: StandardCheck) -> Table:
    def micrometres(values: Sequence[float]) -> list[float]:
        return [value / MICROMETRE for value in values]

    figures, digits = check.figures, decimals(3)
    limits = [math.nan if figure.limit is None else figure.limit for figure in figures]
    u = [math.nan if figure.u_test is None else figure.u_test for figure in figures]
    return Table(
        (
            Column.of("figure", [figure.name for figure in figures]),
            Column.of("value", micrometres([f.value for f in figures]), "µm", digits),
            Column.of("u of test", micrometres(u), "µm", digits),
            Column.of("limit", micrometres(limits), "µm", digits),
            Column.of("verdict", [figure.verdict for figure in figures]),
            Column.of("definition", [figure.status for figure in figures]),
        ),
        explanation="u of test: standard uncertainty of the test value from the calibration of the "
        "reference; empty where that is not stated. verdict: outside the zone of U = 2 u about the "
        "limit (the rule of ISO 14253-1); without u the value alone is compared.",
    )


def plot_check(check: StandardCheck, title: str = "") -> Figure:
    """Residuals of the fitted spheres or circles, touch by touch.

    Parameters
    ----------
    check : StandardCheck
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(9.0, 4.2)
    axes = figure.add_subplot(1, 1, 1)
    for k, fit in enumerate(check.sets):
        axes.plot(np.arange(1, len(fit.residuals) + 1), fit.residuals / MICROMETRE, "o-", ms=4,
                  lw=0.8, color=COLOURS[k % len(COLOURS)], label=f"run {k + 1}: range "
                  f"{fit.form / MICROMETRE:.2f} µm")  # fmt: skip
    axes.axhline(0.0, lw=0.6, color="0.4")
    axes.set_xlabel("touch, in the pattern's order")
    axes.set_ylabel("distance less radius (µm)")
    axes.set_title(title or check.standard, fontsize=11)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    return figure
