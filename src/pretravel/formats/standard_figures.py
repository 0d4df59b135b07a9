"""Figures of a standard's test, as a table and as JSON."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from pretravel.laboratory.standard_check import StandardCheck
from pretravel.units import MICROMETRE


def standard_figures(check: StandardCheck) -> list[dict[str, Any]]:
    """The figures of a test, each as values by column; no limit is None.

    Parameters
    ----------
    check : StandardCheck

    Returns
    -------
    list of dict
        figure, value_um, u_test_um, limit_um, verdict, definition.
    """
    return [
        {
            "figure": figure.name,
            "value_um": figure.value / MICROMETRE,
            "u_test_um": figure.u_test / MICROMETRE,
            "limit_um": None if figure.limit is None else figure.limit / MICROMETRE,
            "verdict": figure.verdict,
            "definition": figure.status,
        }
        for figure in check.figures
    ]


def standard_table(check: StandardCheck) -> dict[str, npt.ArrayLike]:
    """The figures of a test as columns of a table; a cell without a limit is empty."""
    rows = standard_figures(check)
    return {name: ["" if row[name] is None else row[name] for row in rows] for name in rows[0]}


def standard_json(check: StandardCheck) -> dict[str, Any]:
    """A test as values of JSON: standard, figures, notes."""
    return {
        "standard": check.standard,
        "figures": standard_figures(check),
        "notes": list(check.notes),
    }
