"""A study of two parameters shows its main output as contours over both."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.design.studies.outputs import OutputMeaning
from pretravel.design.studies.results import StudyResults
from pretravel.design.tasks.study.report import study_document
from pretravel.show import plotly_figure
from pretravel.show.chart import PlaneChart
from pretravel.show.chart_marks import Contours

KEYS = ("spring.preload_N", "seats.support_angle_deg", "stylus.length_mm")


def _results(columns: list[np.ndarray], plan: str) -> StudyResults:
    """The pretravel is a plane over the factors, which linear interpolation gives exactly."""
    values = 2.0 + sum((k + 1.0) * column for k, column in enumerate(columns))
    return StudyResults(
        "made up", "probe", plan, 0,
        dict(zip(KEYS, columns, strict=False)),
        {"pretravel_range": np.asarray(values)},
        {"pretravel_range": OutputMeaning("um", "range of the pretravel")},
        ("",) * len(columns[0]),
    )  # fmt: skip


def _first(results: StudyResults) -> PlaneChart:
    chart = study_document(results).pictures[0].charts[0]
    assert isinstance(chart, PlaneChart)
    return chart


@pytest.mark.parametrize("plan", ["full-factorial", "latin-hypercube"])
def test_two_factors_make_contours(plan: str) -> None:
    rng = np.random.default_rng(1)
    grid = np.meshgrid(np.linspace(4.0, 8.0, 5), np.linspace(20.0, 50.0, 7))
    columns = [part.ravel() for part in grid]
    if plan == "latin-hypercube":
        columns = [rng.permutation(np.linspace(4.0, 8.0, 40)) for _ in range(2)]
    chart = _first(_results(columns, plan))
    field = next(mark for mark in chart.marks if isinstance(mark, Contours))
    x, y = np.meshgrid(field.x, field.y)
    known = np.isfinite(field.values)
    assert known.mean() > 0.5  # of a hypercube the corners are not known
    assert field.values[known] == pytest.approx((2.0 + x + 2.0 * y)[known], rel=1e-9)
    assert chart.scale is not None
    assert chart.scale.low <= np.nanmin(field.values)
    assert chart.scale.high >= np.nanmax(field.values)
    drawn = plotly_figure(chart)["data"][0]
    assert (drawn["type"], drawn["contours"]["size"]) == ("contour", field.step)


def test_three_factors_make_none() -> None:
    rng = np.random.default_rng(1)
    chart = _first(_results([rng.uniform(4.0, 8.0, 30) for _ in range(3)], "latin-hypercube"))
    assert not any(isinstance(mark, Contours) for mark in chart.marks)
