"""Uncertainty budgets as tables, and a measured sphere with the budget of its diameter."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from pretravel.compensation.measured_sphere import MeasuredSphere
from pretravel.report.document import Column, KeyFigure, Section, Table
from pretravel.report.formatting import decimals, significant
from pretravel.uncertainty.gum import Budget
from pretravel.units import MICROMETRE


def budget_table(budget: Budget, *, own_units: bool = False, title: str = "") -> Table:
    """A budget of a length by source, the largest share first, then the combined uncertainty.

    Parameters
    ----------
    budget : Budget
        Its result in mm.
    own_units : bool
        Sources are not all lengths: their uncertainties are shown as they are.
    title : str

    Returns
    -------
    Table

    >>> from pretravel.report.terminal import table_text
    >>> from pretravel.uncertainty.gum import Component
    >>> budget = Budget((Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, dof=9)))
    >>> print(table_text(budget_table(budget)))
    source          type    u/µm  sensitivity  contribution/µm  share/%     dof
    repeats            A  0.4000            1           0.4000       64       9
    scale              B  0.3000            1           0.3000       36       ∞
    combined                                            0.5000               22
    expanded, 95 %                                      1.0398           k 2.08
    """
    rows = budget.rows()

    def cells(number: Callable[[dict[str, Any]], float], *results: float | str) -> Any:
        return [*(number(row) for row in rows), *results]

    own = 1.0 if own_units else MICROMETRE
    factor = budget.coverage_factor()
    nothing = (math.nan, math.nan)
    return Table(
        (
            Column.of(
                "source", [*(str(row["source"]) for row in rows), "combined", "expanded, 95 %"]
            ),
            Column.of("type", [*(str(row["evaluation"]) for row in rows), "", ""]),
            Column.of(
                "u",
                cells(lambda row: row["standard_uncertainty"] / own, *nothing),
                "" if own_units else "µm",
                significant(4) if own_units else decimals(4),
            ),
            Column.of(
                "sensitivity",
                cells(lambda row: row["sensitivity"], *nothing),
                digits=significant(4),
            ),
            Column.of(
                "contribution",
                cells(
                    lambda row: row["contribution"] / MICROMETRE,
                    budget.combined / MICROMETRE,
                    budget.expanded() / MICROMETRE,
                ),
                "µm",
                decimals(4),
            ),
            Column.of("share", cells(lambda row: 100.0 * row["share"], *nothing), "%", decimals(0)),
            Column.of(
                "dof",
                cells(lambda row: row["dof"], budget.effective_dof, f"k {factor:.2f}"),
                digits=decimals(0),
            ),
        ),
        title=title,
        detail=True,
    )


def expanded_figure(name: str, budget: Budget, remark: str) -> KeyFigure:
    """The expanded uncertainty of a budget as a key figure."""
    return KeyFigure(
        name,
        budget.expanded() / MICROMETRE,
        "µm",
        decimals(3),
        remark=f"k = {budget.coverage_factor():.2f}, about 95 %; {remark}",
    )


def sphere_section(sphere: MeasuredSphere) -> Section:
    """A measured sphere with the budget of its diameter."""
    u = np.sqrt(np.maximum(np.diag(sphere.covariance)[:3], 0.0)) / MICROMETRE
    return Section(
        "The sphere through all touches, compensated",
        figures=(
            KeyFigure(
                "centre", tuple(sphere.fit.center.tolist()), "mm", decimals(5),
                tuple(u.tolist()), "µm", decimals(2),
            ),
            KeyFigure("diameter", sphere.diameter, "mm", decimals(6)),
            expanded_figure("expanded U", sphere.budget, "of the diameter"),
            KeyFigure("form", sphere.fit.form / MICROMETRE, "µm", decimals(3)),
        ),
        tables=(budget_table(sphere.budget, title="Uncertainty of the diameter"),),
    )  # fmt: skip
