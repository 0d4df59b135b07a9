"""Drift, random walk or scatter, and the due date; simulated with fixed seeds."""

from __future__ import annotations

import math
from datetime import datetime

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.qualification.drift_over_time import DailyQuantity, drift_over_time
from pretravel.qualification.series_courses import EARLY, course_of, due_date
from pretravel.qualification.time_series import TimeSeries


def simulated(
    seed: int, count: int, *, slope: float = 0.0, walk: float = 0.0, u: float = 1.0
) -> TimeSeries:
    rng = np.random.default_rng(seed)
    times = np.arange(float(count))
    values = slope * times + math.sqrt(walk) * np.cumsum(rng.standard_normal(count))
    return TimeSeries(times, values + u * rng.standard_normal(count), np.full(count, u))


class TestKind:
    def test_a_clear_trend_is_drift(self) -> None:
        course = course_of(simulated(1, 20, slope=1.0))
        assert course.kind == "drift"
        assert course.slope == pytest.approx(1.0, abs=4.0 * course.u_slope)

    def test_steps_that_add_up_are_a_random_walk(self) -> None:
        course = course_of(simulated(5, 60, walk=9.0, u=0.3))
        assert course.kind == "random walk"
        # The variance of 59 steps is known to 18 %: three times that.
        assert course.noise.walk == pytest.approx(9.0, rel=0.55)

    def test_independent_values_are_scatter(self) -> None:
        course = course_of(simulated(6, 30))
        assert course.kind == "scatter"
        assert due_date(course, 10.0).due == math.inf

    @pytest.mark.parametrize("walk", [pytest.param(0.0, marks=pytest.mark.slow), 1.0])
    def test_trends_of_unchanged_and_walking_probes(self, walk: float) -> None:
        """Stated at 1 %; of 60 series more than 4 have a probability of 0.03 %."""
        found = [course_of(simulated(s, 12, walk=walk)).kind == "drift" for s in range(60)]
        assert sum(found) <= 4

    @pytest.mark.parametrize("times", [[0.0, 1.0], [2.0, 2.0, 2.0]])
    def test_too_few_days(self, times: list[float]) -> None:
        series = TimeSeries(np.array(times), np.ones(len(times)), np.ones(len(times)))
        with pytest.raises(PretravelError, match="at least 3 at different times"):
            course_of(series)


class TestDueDate:
    @pytest.mark.parametrize("slope", [0.25, -0.25])
    def test_of_a_line_without_noise_it_is_exact(self, slope: float) -> None:
        times = np.arange(10.0)
        series = TimeSeries(times, slope * (times - 4.0), np.full(10, 1e-7))
        found = due_date(course_of(series), 3.0)
        assert found.due == pytest.approx(4.0 + 3.0 / 0.25, abs=1e-4)
        assert found.early == pytest.approx(found.due, abs=1e-3)

    def test_it_counts_from_the_start_that_is_given(self) -> None:
        times = np.arange(10.0)
        course = course_of(TimeSeries(times, 5.0 + 0.25 * times, np.full(10, 1e-7)))
        assert due_date(course, 3.0, start=5.0).due == pytest.approx(12.0, abs=1e-4)
        assert due_date(course, 3.0).due == 9.0  # beyond the limit now

    def test_the_true_date_is_not_before_the_early_one(self) -> None:
        """In 95 % of 30 series or more: fewer than 25 have a probability of 0.1 %."""
        true = 30.0
        early = []
        for seed in range(30):
            series = simulated(seed, 10, slope=0.5)
            early.append(due_date(course_of(series), 0.5 * true).early)
        assert sum(date <= true for date in early) >= 25
        # And it says something: half of them are later than the last day by a fifth of the way.
        assert np.median(early) > 9.0 + 0.2 * (true - 9.0)

    def test_of_a_known_walk_it_is_that_of_the_normal_distribution(self) -> None:
        """From the last value on: even odds beyond where 0.674 √(q h) is the limit."""
        from scipy.stats import norm

        course = course_of(simulated(5, 60, walk=9.0, u=0.3))
        weights, states = np.array(course.expected.weights), course.expected.states
        at = np.array([70.0, 200.0])
        expected = np.zeros(2)
        for weight, state in zip(weights, states, strict=True):
            own = norm(state.level[-1], np.sqrt(state.own + state.walk * (at - 59.0)))
            expected += weight * (own.sf(45.0) + own.cdf(-45.0))
        assert course.expected.probability_beyond(45.0, at) == pytest.approx(expected, rel=1e-9)
        found = due_date(course, 45.0)
        assert course.expected.probability_beyond(45.0, [found.due])[0] == pytest.approx(
            0.5, abs=1e-6
        )
        # The early date allows for a trend that the walk hides: it comes sooner.
        assert course.expected.probability_beyond(45.0, [found.early])[0] < EARLY
        beyond = course.allowed.probability_beyond(45.0, [found.early])
        assert beyond[0] == pytest.approx(EARLY, abs=1e-6)
        assert 59.0 < found.early < found.due

    def test_a_limit_that_means_nothing(self) -> None:
        with pytest.raises(PretravelError, match="limit of a drift is 0; it is positive"):
            due_date(course_of(simulated(1, 5)), 0.0)


@pytest.mark.parametrize("limit", [0.0, -1e-3, math.inf, math.nan])
def test_a_due_date_needs_a_positive_limit(limit: float) -> None:
    level = DailyQuantity("level", "µm", np.arange(3.0), np.ones(3), share=1e-3)
    days = [datetime(2026, 3, 1 + day) for day in range(3)]
    with pytest.raises(PretravelError, match="it is positive"):
        drift_over_time(days, [level], limit)
