"""Uncertainty budgets as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pretravel.base import MICROMETRE
from pretravel.show import Column, Section, Table, decimals, number_text, significant
from pretravel.uncertainty import Budget

_MANY_DOF = 10_000.0
"""Above it, their number is no statement: k differs from 2 by less than 0.0002."""


def budget_table(budget: Budget, *, title: str = "") -> Table:
    """A budget of a length by source, the largest share first, then the combined uncertainty.

    Parameters
    ----------
    budget : Budget
        Its result in mm.
    title : str

    >>> from pretravel.show.terminal import table_text
    >>> from pretravel.uncertainty.gum import Component
    >>> budget = Budget((Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, dof=9)))
    >>> print(table_text(budget_table(budget)))
    source             type    u/µm  sensitivity  contribution/µm  share/%     dof
    repeats               A  0.4000            1           0.4000       64       9
    scale                 B  0.3000            1           0.3000       36       ∞
    combined                                               0.5000               22
    expanded, 95.45 %                                      1.0632           k 2.13
    """
    total = (budget.combined / MICROMETRE, budget.expanded() / MICROMETRE)
    names = [str(row["source"]) for row in budget.rows()]
    kinds = [str(row["evaluation"]) for row in budget.rows()]
    u = _numbers(budget, "standard_uncertainty", 1.0 / MICROMETRE)
    dof: list[float | str] = [
        *(_shown_dof(each) for each in (*_numbers(budget, "dof")[:-2], budget.effective_dof)),
        f"k {number_text(budget.coverage_factor())}",
    ]
    return Table(
        (
            Column.of("source", [*names, "combined", "expanded, 95.45 %"]),
            Column.of("type", [*kinds, "", ""]),
            Column.of("u", u, "µm", decimals(4)),
            Column.of("sensitivity", _numbers(budget, "sensitivity"), digits=significant(4)),
            Column.of(
                "contribution",
                [*_numbers(budget, "contribution", 1.0 / MICROMETRE)[:-2], *total],
                "µm",
                decimals(4),
            ),
            Column.of("share", _numbers(budget, "share", 100.0), "%", decimals(0)),
            Column.of("dof", dof, digits=decimals(0)),
        ),
        title=title,
        detail=True,
    )


def _shown_dof(dof: float) -> float | str:
    """Degrees of freedom; k is that of infinitely many where there are very many."""
    return "many" if _MANY_DOF < dof < math.inf else dof


def _numbers(budget: Budget, key: str, factor: float = 1.0) -> list[float]:
    """A column of a budget; its last two cells, combined and expanded, are empty."""
    return [*(factor * float(row[key]) for row in budget.rows()), math.nan, math.nan]


def budget_section(budgets: Sequence[Budget]) -> tuple[Section, ...]:
    """Budgets as tables under one heading, for the full report; none where there are none."""
    if not budgets:
        return ()
    tables = tuple(budget_table(budget, title=budget.result) for budget in budgets)
    return (Section("Uncertainty budget", tables=tables, detail=True, certificate=True),)
