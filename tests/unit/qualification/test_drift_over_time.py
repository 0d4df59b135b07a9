"""Drift of a probe over many days: series that begin at jumps and new maps, and due dates."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.qualification.drifts import DailyQuantity, days_from, drift_over_time

START = datetime(2026, 3, 1, 8)


def days(times: np.ndarray) -> list[datetime]:
    return [START + timedelta(days=float(t)) for t in times]


def test_series_begin_at_jumps_and_new_maps_and_count_from_them() -> None:
    """0.2 µm a day with a jump on day 10, a new map on day 20 and a day apart: 1 µm of level is
    1 µm of the map. The last series counts from its map, the one after the jump from its first
    state; the limit is 3 µm."""
    times = np.arange(30.0)
    noise = 1e-4 * np.random.default_rng(1).standard_normal(30)
    level = 0.2 * np.where(times < 20, times, times - 20.0) + 9.0 * ((times >= 10) & (times < 20))
    level[25] += 6.0
    known = DailyQuantity("level", "µm", level + noise, np.full(30, 1e-3), share=1e-3)
    unknown = DailyQuantity("other", "1", 0.0 * times, np.full(30, np.nan), share=0.0)
    found = drift_over_time(days(times), [known, unknown], 3e-3, new_maps=[20])
    assert [(one.day, one.apart) for one in found.breaks] == [(10, False), (25, True)]
    assert found.starts == (0, 10, 20)
    assert found.quantities == (known, unknown)
    assert found.limit == 3e-3
    assert found.times == pytest.approx(times)
    assert [[one.quantity.name for one in part] for part in found.courses] == [["level"]] * 3
    assert [len(part[0].course.series) for part in found.courses] == [10, 10, 9]
    assert found.last is found.courses[-1]
    assert [one.quantity.name for one in found.drifting] == ["level"]
    starts = [part[0].start for part in found.courses]
    assert starts == pytest.approx([0.0, 9.0 + 2.0, 0.0], abs=1e-3)
    due = [part[0].due for part in found.courses]
    assert [one.limit for one in due if one] == pytest.approx([3.0] * 3)
    assert [one.due for one in due if one] == pytest.approx([15.0, 25.0, 35.0], abs=0.01)
    first, time = found.first_due()
    assert first is found.last[0]
    assert time == pytest.approx(35.0, abs=0.01)
    assert due[2] is not None
    assert found.first_due(early=True) == (found.last[0], due[2].early)
    assert found.moment(1.5) == START + timedelta(hours=36)
    assert found.moment(math.inf) is None


@pytest.mark.long
def test_the_first_of_several_due_dates_counts() -> None:
    """0.1 and 0.3 a day of which a unit is 1 µm, and one of 0.2 of which a unit is 2 µm."""
    times = np.arange(4.0)  # too few for a break
    many = [
        DailyQuantity(name, "1", rise * times, np.full(4, 1e-6), share)
        for name, rise, share in (
            ("a", 0.1, 1e-3), ("b", 0.3, 1e-3), ("c", 0.2, 2e-3), ("d", 0.1, 0.0))
    ]  # fmt: skip
    found = drift_over_time(days(times), many, 6e-3)
    assert [one.due.due for one in found.last if one.due] == pytest.approx([60.0, 20.0, 15.0])
    assert found.last[3].due is None
    first, time = found.first_due()
    assert first is found.last[2]
    assert time == pytest.approx(15.0, abs=1e-3)
    still = drift_over_time(days(times[:2]), many, 6e-3)
    assert still.courses == ((),)
    assert still.first_due() == (None, math.inf)
    same = drift_over_time(
        [START] * 4, [DailyQuantity("a", "1", np.ones(4), np.ones(4), 1e-3)], 1.0
    )
    assert same.courses == ((),)


def test_three_values_within_a_day_have_a_course() -> None:
    times = np.array([0.0, 0.25, 0.5])
    one = DailyQuantity("a", "1", 8.0 * times, np.full(3, 1e-6), 1e-3)
    for count, courses in ((3, 1), (2, 0)):
        found = drift_over_time(days(times[:count]), [replace(one, values=one.values[:count],
                                u=one.u[:count])], 6e-3)  # fmt: skip
        assert len(found.last) == courses
    assert drift_over_time(days(times), [one], 6e-3).last[0].course.slope == pytest.approx(8.0)


def test_days_of_an_unknown_uncertainty_show_their_scatter_themselves() -> None:
    """A thousandth of the median where u is not that of the day alone; nothing without a value."""
    values = np.array([1.0, np.nan, 3.0])
    quantity = DailyQuantity("form", "µm", values, np.array([0.2, 0.3, 0.9]), 1e-3)
    assert quantity.own_u.tolist() == [0.2, 0.3, 0.9]
    assert not quantity.values.flags.writeable
    assert not quantity.u.flags.writeable
    unknown = DailyQuantity("form", "µm", values, np.array([0.2, np.nan, 0.9]), 1e-3, known_u=False)
    assert unknown.own_u == pytest.approx([0.55e-3, np.nan, 0.55e-3], nan_ok=True)
    none = DailyQuantity("form", "µm", values, np.full(3, np.nan), 1e-3, known_u=False)
    assert np.isnan(none.own_u).all()


def test_days_are_counted_from_the_first() -> None:
    moments = [START, START + timedelta(hours=6), START + timedelta(days=10, minutes=36)]
    assert days_from(moments) == pytest.approx([0.0, 0.25, 10.025], rel=1e-12)


@pytest.mark.parametrize("limit", [0.0, -1e-3, math.inf, math.nan])
def test_a_due_date_needs_a_positive_limit(limit: float) -> None:
    level = DailyQuantity("level", "µm", np.arange(3.0), np.ones(3), share=1e-3)
    days = [datetime(2026, 3, 1 + day) for day in range(3)]
    with pytest.raises(PretravelError, match="it must be positive"):
        drift_over_time(days, [level], limit)
