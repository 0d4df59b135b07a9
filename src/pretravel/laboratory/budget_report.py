"""Budgets of lengths in reports of a laboratory; a measured sphere with that of its diameter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.laboratory.measured_spheres import MeasuredSphere
from pretravel.show import KeyFigure, Section, Table, decimals, number_text
from pretravel.task import budget_table
from pretravel.uncertainty import Budget


def budgets_data(budgets: Sequence[Budget]) -> Table:
    """Budgets of lengths for programs: combined and expanded uncertainty, k, degrees of freedom.

    >>> from pretravel.uncertainty.gum import Component
    >>> table = budgets_data([Budget((Component("scale", "B", 3e-4),), "diameter")])
    >>> [column.values[0] for column in table.columns[:2]]
    ['diameter', 0.3]
    """
    return Table.of(
        {
            "result": [budget.result for budget in budgets],
            "combined_um": [budget.combined / MICROMETRE for budget in budgets],
            "expanded_um": [budget.expanded() / MICROMETRE for budget in budgets],
            "coverage_factor": [budget.coverage_factor() for budget in budgets],
            "degrees_of_freedom": [budget.effective_dof for budget in budgets],
        },
        "Budgets",
    )


def expanded_figure(name: str, budget: Budget, remark: str) -> KeyFigure:
    """The expanded uncertainty of a budget as a key figure."""
    return KeyFigure(
        name,
        budget.expanded() / MICROMETRE,
        "µm",
        decimals(3),
        remark=f"k = {number_text(budget.coverage_factor())}, about 95 %; {remark}",
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
            KeyFigure("measured range", sphere.fit.form / MICROMETRE, "µm", decimals(3),
                      remark="of the residuals, noise included: not the form of the sphere"),
        ),
        tables=(budget_table(sphere.budget, title="Uncertainty of the diameter"),),
    )  # fmt: skip
