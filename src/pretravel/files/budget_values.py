"""Uncertainty budgets of lengths as values of JSON."""

from __future__ import annotations

import math
from typing import Any

from pretravel.base.units import MICROMETRE
from pretravel.uncertainty.gum import Budget


def budget_values(budget: Budget) -> dict[str, Any]:
    """A budget of a length, with its contributions, the largest first.

    Parameters
    ----------
    budget : Budget
        Its result in mm.

    Returns
    -------
    dict
        Lengths in µm; infinite degrees of freedom are None.

    >>> from pretravel.uncertainty.gum import Component
    >>> values = budget_values(Budget((Component("scale", "B", 3e-4),), "diameter"))
    >>> values["result"], values["combined_um"], values["contributions"][0]["share"]
    ('diameter', 0.3, 1.0)
    """
    return {
        "result": budget.result,
        "combined_um": budget.combined / MICROMETRE,
        "expanded_um": budget.expanded() / MICROMETRE,
        "coverage_factor": budget.coverage_factor(),
        "degrees_of_freedom": _finite(budget.effective_dof),
        "contributions": [
            {
                "source": row["source"],
                "type": row["evaluation"],
                "contribution_um": float(row["contribution"]) / MICROMETRE,
                "share": row["share"],
                "degrees_of_freedom": _finite(float(row["dof"])),
            }
            for row in budget.rows()
        ],
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
