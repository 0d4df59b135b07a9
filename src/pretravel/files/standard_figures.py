"""Figures of a standard's test, as a table and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy.typing as npt

from pretravel.base.units import MICROMETRE
from pretravel.files.budget_values import budget_values
from pretravel.laboratory.standard_check import StandardCheck
from pretravel.measurement.measured_sphere import MeasuredSphere


def standard_figures(check: StandardCheck) -> list[dict[str, Any]]:
    """The figures of a test, each as values by column; no limit is None.

    Parameters
    ----------
    check : StandardCheck

    Returns
    -------
    list of dict
        figure, value_um, u_test_um, limit_um, verdict, definition; None where something is not
        stated.
    """
    return [
        {
            "figure": figure.name,
            "value_um": figure.value / MICROMETRE,
            "u_test_um": None if figure.u_test is None else figure.u_test / MICROMETRE,
            "limit_um": None if figure.limit is None else figure.limit / MICROMETRE,
            "verdict": figure.verdict,
            "definition": figure.status,
        }
        for figure in check.figures
    ]


def standard_table(check: StandardCheck) -> dict[str, npt.ArrayLike]:
    """The figures of a test as columns of a table; a cell of what is not stated is empty."""
    rows = standard_figures(check)
    return {name: ["" if row[name] is None else row[name] for row in rows] for name in rows[0]}


def standard_json(
    check: StandardCheck, sphere: MeasuredSphere | None = None, warnings: Sequence[str] = ()
) -> dict[str, Any]:
    """A test as values of JSON.

    Parameters
    ----------
    check : StandardCheck
    sphere : MeasuredSphere, optional
        Through all touches, compensated.
    warnings : sequence of str

    Returns
    -------
    dict
        standard, conformity_stated, why_no_conformity, figures, budgets (of the test values, and
        of the diameter of the sphere), notes, warnings.
    """
    budgets = [*check.budgets, *(() if sphere is None else (sphere.budget,))]
    return {
        "standard": check.standard,
        "conformity_stated": not check.why_no_conformity,
        "why_no_conformity": list(check.why_no_conformity),
        "figures": standard_figures(check),
        "budgets": [budget_values(budget) for budget in budgets],
        "notes": list(check.notes),
        "warnings": list(warnings),
    }
