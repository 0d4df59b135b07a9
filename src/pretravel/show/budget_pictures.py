"""A budget of uncertainty as bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.show.document import Picture
from pretravel.show.formatting import number_text, significant
from pretravel.uncertainty import Budget

if TYPE_CHECKING:
    from pretravel.show.chart import View

_MOST_BARS = 12
"""More sources than these share one bar."""
_NEGLIGIBLE = 1e-3
"""Of the combined uncertainty: sources below it share one bar."""


def budget_view(budget: Budget, title: str = "") -> View:
    """The contributions to an uncertainty as bars, the largest first, then u and U.

    Parameters
    ----------
    budget : Budget
        Of a length in mm.
    title : str

    >>> from pretravel.uncertainty.gum import Component
    >>> budget = Budget((Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, dof=9)))
    >>> chart = budget_view(budget).charts[0]
    >>> chart.y.categories
    ('repeats', 'scale', 'combined u', 'expanded U (k = 2.13)')
    >>> [mark.values.round(3).tolist() for mark in chart.marks]
    [[0.4, 0.3], [0.5, 1.063]]
    """
    from pretravel.show.chart import Axis, PlaneChart, View
    from pretravel.show.chart_marks import Bars

    names, values = _sources(budget)
    factor = budget.coverage_factor()
    totals = np.array([budget.combined, factor * budget.combined]) / MICROMETRE
    lengths = np.array(values) / MICROMETRE
    rows = np.arange(len(names) + 2.0)
    top = 1.25 * max(float(totals[1]), 1e-9)
    marks = (
        Bars(rows[:-2], lengths, horizontal=True, texts=_texts(lengths)),
        Bars(rows[-2:], totals, colour="series2", horizontal=True,
             texts=_texts(totals)),
    )  # fmt: skip
    total_names = ("combined u", f"expanded U (k = {number_text(factor)})")
    chart = PlaneChart(
        title or "Contributions to the uncertainty",
        Axis("u and U", "µm", 0.0, top),
        Axis("", categories=(*names, *total_names)),
        marks,
        note="contributions: their squares add up to the square of u",
    )
    return View(title, (chart,))


def budget_picture(budget: Budget, what: str) -> Picture:
    """A budget as a picture of a report.

    Parameters
    ----------
    budget : Budget
    what : str
        Whose uncertainty it is, such as "the diameter".

    >>> budget_picture(Budget(()), "the diameter").caption
    'Uncertainty of the diameter: contributions of its sources'
    """
    title = f"Uncertainty of {what}"
    return Picture(f"{title}: contributions of its sources", lambda: budget_view(budget, title))


def _sources(budget: Budget) -> tuple[list[str], list[float]]:
    """Names and contributions of the sources; negligible ones, and the last of many, as one."""
    rows = budget.rows()
    names = [str(row["source"]) for row in rows]
    values = [float(row["contribution"]) for row in rows]
    shown = min(sum(value >= _NEGLIGIBLE * budget.combined for value in values), _MOST_BARS)
    if len(rows) - shown < 2:
        return names, values
    rest = float(np.linalg.norm(values[shown:]))
    return [*names[:shown], f"{len(rows) - shown} smaller sources"], [*values[:shown], rest]


def _texts(values: np.ndarray) -> tuple[str, ...]:
    return tuple(
        number_text(value, significant(3)) if value >= 1e-4 else "below 0.0001"
        for value in values.tolist()
    )
