"""The pictures of a drift: dates on the axis, the limit and the dates that are due."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import pytest

from pretravel.qualification.drifts import DailyQuantity, drift_over_time
from pretravel.show.chart import Axis, PlaneChart, View
from pretravel.show.chart_files import drawn_figure
from pretravel.show.chart_marks import Dots, LineMark, Rule
from pretravel.show.chart_plotly import plotly_figure
from pretravel.tasks.history.drift_report import drift_charts, drift_verdict

DAYS = [datetime(2026, 3, 1) + timedelta(days=day) for day in range(10)]
LEVEL = DailyQuantity("level", "µm", 0.1 * np.arange(10.0), np.full(10, 0.001), 1e-3)


def test_the_forecast_is_in_the_picture() -> None:
    """0.1 µm a day reach 1.5 µm on the fifteenth day after the first."""
    drift = drift_over_time(DAYS, [LEVEL], 1.5e-3)
    (chart,) = drift_charts(drift)
    rules = {(mark.name, round(mark.value, 1)) for mark in chart.marks if isinstance(mark, Rule)}
    assert {("limit", 1.5), ("", -1.5), ("due date", 15.0)} <= rules
    (dots,) = [mark for mark in chart.marks if isinstance(mark, Dots)]
    assert dots.u is not None
    assert np.allclose(dots.u, 0.002)
    assert chart.x.tick_names[0] == "2026-03-01"
    assert drift_verdict(drift).startswith("drift: level +0.1000")
    assert "due on 2026-03-15" in drift_verdict(drift)


def test_a_limit_that_is_passed_says_so() -> None:
    told = drift_verdict(drift_over_time(DAYS, [LEVEL], 0.5e-3))
    assert "QUALIFY NOW: level has probably changed the map by more than 0.50 µm" in told


@pytest.mark.parametrize(("days", "last"), [(4, 1.8), (2, 1.8), (4, -1.8), (4, 0.6)])
def test_a_change_of_the_last_day_alone_is_said(days: int, last: float) -> None:
    """It is no trend and no jump yet; within the limit and two u it is not said."""
    values = np.array([0.05, -0.03, 0.02, -0.04])[-days:]
    values[-1] = last
    level = DailyQuantity("level", "µm", values, np.full(days, 0.16), 1e-3)
    told = drift_verdict(drift_over_time(DAYS[:days], [level], 0.4e-3))
    assert (f"on the last day level is {last:+.2f} µm (u = 0.16 µm)" in told) == (abs(last) > 0.72)
    assert ("VERIFY AGAIN" in told) == (abs(last) > 0.72)


@pytest.mark.parametrize(
    ("row", "size", "said"), [(1, 1.8, True), (0, -1.8, True), (1, 0.6, False)]
)
def test_one_earlier_day_is_said(row: int, size: float, said: bool) -> None:
    """Of four days: too few for a day apart, which five show."""
    values = np.array([0.05, -0.03, 0.02, -0.04])
    values[row] = size
    level = DailyQuantity("level", "µm", values, np.full(4, 0.16), 1e-3)
    told = drift_verdict(drift_over_time(DAYS[:4], [level], 0.4e-3))
    words = f"but on {DAYS[row]:%Y-%m-%d} alone level was {size:+.2f} µm (u = 0.16 µm)"
    assert (words in told) == said


def test_a_random_walk_beyond_the_limit_says_qualify_whatever_the_last_day_shows() -> None:
    days = [DAYS[0] + timedelta(days=day) for day in range(16)]
    walk = np.cumsum(np.random.default_rng(0).normal(0.0, 0.4, 16))
    level = DailyQuantity("level", "µm", walk - walk[0], np.full(16, 0.02), 1e-3)
    drift = drift_over_time(days, [level], 0.5e-3)
    assert drift.beyond_on_last_day() is not None
    assert "QUALIFY NOW" in drift_verdict(drift)


def test_words_at_ticks_are_in_files_and_pages() -> None:
    x = Axis("date", "", 0.0, 2.0, ticks=(0.0, 2.0), tick_names=("1 March", "3 March"))
    line = LineMark(np.arange(3.0), np.arange(3.0))
    chart = PlaneChart("level", x, Axis("level", "µm"), (line,))
    (axes,) = drawn_figure(View("drift", (chart,))).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1 March", "3 March"]
    assert "3 March" in str(plotly_figure(chart))
