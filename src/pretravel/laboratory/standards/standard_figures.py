"""Figures of a standard's test as a table."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from pretravel.base import MICROMETRE
from pretravel.laboratory.standards.standard_check import StandardCheck


def standard_figures(check: StandardCheck) -> list[dict[str, Any]]:
    """The figures of a test, each as values by column; no limit is None.

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
