"""Courses of series, dates when they are too far, and breaks: sums over every noise and place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import optimize, stats

from pretravel.base.errors import PretravelError
from pretravel.qualification.series_breaks import Break, _scores, breaks_of
from pretravel.qualification.series_courses import (
    EARLY,
    HORIZON,
    Course,
    course_of,
    due_date,
    fitted_noises,
    weighed_noises,
)
from pretravel.qualification.time_series import SeriesNoise, TimeSeries
from tests.unit.qualification.test_time_series import (
    NOISES,
    least_squares,
    predicted,
    residual_variance,
    uneven,
)


def prior_of(noises: str) -> np.ndarray:
    """Probabilities of the 10 scatters and 11 walks, the first of each none: all alike; of walks of
    at least four times the variance about the line, half of it with scatter; or 0.3 % of these and
    the rest without a walk, half of it with scatter."""
    if noises == "any":
        return np.full(110, 1.0 / 110.0)
    walks, lines = np.zeros((10, 11)), np.zeros((10, 11))
    walks[0, 6:], walks[1:, 6:] = 0.5 / 5.0, 0.5 / 45.0  # 4.6, 10, 22, 46 and 100
    lines[0, 0], lines[1:, 0] = 0.5, 0.5 / 9.0
    return np.ravel({"walks": walks, "lines": lines}.get(noises, 0.003 * walks + 0.997 * lines))


SCATTERS = np.append(0.0, 0.03 * 10.0 ** (np.arange(9.0) / 2.0))
WALKS = np.append(0.0, 0.1 * 10.0 ** (np.arange(10.0) / 3.0))
"""Variances that are weighed, in that about the line: none, and even in their logarithms."""


def mixture(
    series: TimeSeries, columns: np.ndarray, noises: str = "any"
) -> list[tuple[float, SeriesNoise, np.ndarray, np.ndarray]]:
    """Every pair of the grid with its probability: none is left out."""
    size, span = residual_variance(series, columns), np.ptp(series.times)
    size = max(size, 0.1 * float(np.mean(series.u**2)))
    found = []
    for scatter in np.sqrt(size * SCATTERS):
        for walk in size / span * WALKS:
            value, u, log = least_squares(series, columns, scatter, walk)
            found.append((log, SeriesNoise(float(scatter), float(walk)), value, u))
    shares = prior_of(noises) * np.exp([log - max(one[0] for one in found) for log, *_ in found])
    return [
        (float(share / shares.sum()), *rest)
        for share, (_, *rest) in zip(shares, found, strict=True)
    ]


def counted(
    parts: list[tuple[float, SeriesNoise, np.ndarray, np.ndarray]],
) -> list[tuple[float, SeriesNoise, np.ndarray, np.ndarray]]:
    """Without noises whose probability is below 1e-4."""
    kept = [part for part in parts if part[0] > 1e-4]
    total = sum(weight for weight, *_ in kept)
    return [(weight / total, *rest) for weight, *rest in kept]


def moments_of(parts: list[tuple[float, float, float]]) -> tuple[float, float]:
    """Mean and deviation of a mixture: weights, means, variances."""
    weights, means, variances = np.array(parts).T
    weights = weights / weights.sum()
    mean = float(weights @ means)
    return mean, math.sqrt(float(weights @ (variances + means**2)) - mean**2)


SERIES = {
    "drift": uneven(9, 2.0),
    "scatter": uneven(9, 0.0),
    "random walk": TimeSeries(
        np.arange(30.0),
        4.0 * np.cumsum(np.random.default_rng(5).standard_normal(30)),
        np.full(30, 0.3),
    ),
}


@pytest.fixture(scope="module")
def courses() -> dict[str, Course]:
    return {kind: course_of(series) for kind, series in SERIES.items()}


def test_noises_are_weighed_by_their_likelihood() -> None:
    """Those below 1e-4 are left out and the rest is scaled: by less than 110 of them."""
    series = uneven()
    columns = series.times[:, None]
    known = {(n.scatter, n.walk): rest for weight, n, *rest in mixture(series, columns)}
    shares = {(n.scatter, n.walk): weight for weight, n, *_ in mixture(series, columns)}
    found = [
        (weight, one.noise, one.coefficients, one.u)
        for weight, one in weighed_noises(fitted_noises(series, columns))
    ]
    assert sum(weight for weight, *_ in found) == pytest.approx(1.0, rel=1e-12)
    kept = sum(share for share in shares.values() if share > 1e-4)
    assert len(found) == sum(share > 1e-4 for share in shares.values())
    for weight, noise, value, u in found:
        key = min(known, key=lambda pair: abs(pair[0] - noise.scatter) + abs(pair[1] - noise.walk))
        assert key == pytest.approx((noise.scatter, noise.walk), rel=1e-9)
        assert weight == pytest.approx(shares[key] / kept, rel=1e-7)
        assert value == pytest.approx(known[key][0], rel=1e-7)
        assert u == pytest.approx(known[key][1], rel=1e-7)


@pytest.mark.parametrize("kind", SERIES)
def test_a_course_is_the_mean_over_the_noises(kind: str, courses: dict[str, Course]) -> None:
    series, course = SERIES[kind], courses[kind]
    assert course.kind == kind
    time, level = series.times[:, None], np.empty((len(series), 0))
    any_noise = counted(mixture(series, time))
    below = sum(w * stats.norm.cdf(-b[0] / u[0]) for w, _, b, u in any_noise)
    above = sum(w * stats.norm.cdf(b[0] / u[0]) for w, _, b, u in any_noise)
    assert course.p_slope == pytest.approx(2.0 * min(below, above), rel=1e-4)
    assert (course.p_slope < 0.01) == (kind == "drift")
    if_walking = counted(mixture(series, time, "walks"))
    with_trend = any_noise if kind == "random walk" else counted(mixture(series, time, "usual"))
    slope, u_slope = moments_of([(w, b[0], u[0] ** 2) for w, _, b, u in with_trend])
    assert (course.slope, course.u_slope) == pytest.approx((slope, u_slope), rel=1e-6)
    walking = moments_of([(w, b[0], u[0] ** 2) for w, _, b, u in if_walking])
    assert course.walking.slope == pytest.approx(walking, rel=1e-6)
    walks = counted(mixture(series, level)) if kind == "random walk" else with_trend
    assert course.allowed.weights == pytest.approx([w for w, *_ in with_trend], rel=1e-6)
    assert course.expected.weights == pytest.approx([w for w, *_ in walks], rel=1e-6)
    # Of walks, where walks and lines are alike before.
    even = np.array([w for w, *_ in mixture(series, time)])
    of_walks, of_lines = prior_of("walks") @ even, prior_of("lines") @ even
    expected_share = of_walks / (of_walks + of_lines)
    assert course.walk_share == pytest.approx(expected_share, rel=1e-6)
    assert course.may_walk == (expected_share > 0.05)
    last = series.times[-1]
    for at, (mean, u) in (
        (series.times[2], tuple(part[2] for part in course.expected.level)),
        (last, tuple(part[-1] for part in course.expected.level)),
        (last + 9.0, tuple(float(part[0]) for part in course.expected.later(last + 9.0))),
    ):
        parts = [(w, *predicted(series, n, at, kind != "random walk")) for w, n, *_ in walks]
        assert (mean, u) == pytest.approx(moments_of(parts), rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_trend_is_stated_where_it_is_by_chance_in_less_than_a_hundredth(sign: float) -> None:
    series = SERIES["scatter"]
    time = series.times[:, None]

    def rising(slope: float) -> TimeSeries:
        return TimeSeries(series.times, series.values + slope * series.times, series.u)

    def probability_of(slope: float) -> float:
        parts = counted(mixture(rising(slope), time))
        return float(sum(2.0 * w * stats.norm.cdf(-sign * b[0] / u[0]) for w, _, b, u in parts))

    for p, drifts in ((0.0095, True), (0.0105, False)):
        slope = optimize.brentq(
            lambda x, p=p: probability_of(x) / p - 1.0, 0.0, sign * 9.0, rtol=1e-3
        )
        course = course_of(rising(slope))
        assert course.p_slope == pytest.approx(p, rel=0.01)
        assert (course.kind == "drift") == drifts


@pytest.mark.parametrize("kind", SERIES)
def test_a_walk_is_tested_by_its_likelihood_ratio(kind: str, courses: dict[str, Course]) -> None:
    """Half of chi-square with one degree of freedom, at the boundary; the noise that is stated is
    the most probable one: with a trend of drift, without a walk of scatter."""
    series, course = SERIES[kind], courses[kind]
    level = np.empty((len(series), 0))
    walking, still = series.determined_noise(level), series.determined_noise(level, walk=False)
    ratio = 2.0 * (walking.log_likelihood - still.log_likelihood)
    expected = 0.5 * stats.chi2.sf(ratio, 1.0) if ratio > 0.0 else 1.0
    assert course.p_walk == pytest.approx(expected, rel=1e-9)
    trend = series.determined_noise(series.times[:, None])
    noises = {"drift": trend, "scatter": still, "random walk": walking}
    assert course.noise == noises[kind]


@pytest.mark.parametrize("kind", SERIES)
@pytest.mark.parametrize("which", ["expected", "allowed", "walking"])
def test_a_state_beyond_the_limit_is_beyond_on_either_side(
    kind: str, which: str, courses: dict[str, Course]
) -> None:
    course = courses[kind]
    possible = getattr(course, which)
    last = course.series.times[-1]
    at, limit, start = last + np.array([1.0, 20.0]), 6.0, 2.0
    assert sum(possible.weights) == pytest.approx(1.0, rel=1e-12)
    expected = np.zeros(2)
    for weight, state in zip(possible.weights, possible.states, strict=True):
        mean, variance = state.later(at)
        inside = stats.norm.cdf(start + limit, mean, np.sqrt(variance))
        inside -= stats.norm.cdf(start - limit, mean, np.sqrt(variance))
        expected += weight * (1.0 - inside)
    assert possible.probability_beyond(limit, at, start) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("kind", SERIES)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_dates_are_those_of_half_and_of_a_twentieth(
    kind: str, side: float, courses: dict[str, Course]
) -> None:
    given = SERIES[kind]
    course = courses[kind]
    if side < 0.0:
        course = course_of(TimeSeries(given.times, -given.values, given.u))
    limit, start = 60.0, side * 3.0
    found = due_date(course, limit, start)
    last = float(given.times[-1])
    assert found.limit == limit
    assert last < found.early < found.due
    either = course.walking_or_not
    assert sum(either.weights) == pytest.approx(1.0, rel=1e-12)
    at = either.probability_beyond(limit, [found.early], start)
    assert at[0] == pytest.approx(EARLY, abs=1e-6)
    assert last < found.early_if_walking <= found.early
    if found.early_if_walking < found.early:
        at = course.walking.probability_beyond(limit, [found.early_if_walking], start)
        assert at[0] == pytest.approx(EARLY, abs=1e-6)
    if kind == "scatter":
        assert found.due == math.inf
    else:
        at = course.expected.probability_beyond(limit, [found.due], start)
        assert at[0] == pytest.approx(0.5, abs=1e-6)
    if side < 0.0:  # a mirrored series has the same dates
        mirrored = due_date(courses[kind], limit, 3.0)
        assert (found.due, found.early) == pytest.approx((mirrored.due, mirrored.early), rel=1e-6)


def test_dates_beyond_a_century_are_not_stated() -> None:
    """A line without noise reaches its limit a day before or after the horizon."""
    times = np.arange(0.0, 10_000.0, 1000.0)
    course = course_of(TimeSeries(times, 1e-3 * times, np.full(10, 1e-9)))
    for early, due in ((1.0, times[-1] + HORIZON - 1.0), (-1.0, math.inf)):
        limit = 1e-3 * (times[-1] + HORIZON - early)
        assert due_date(course, limit).due == pytest.approx(due, abs=0.1)
    assert HORIZON == 100.0 * 365.25


@pytest.mark.parametrize("after", [0.0, 2e-4, 0.3, 0.7, 2.6])
def test_a_limit_that_is_soon_reached_has_its_date(after: float) -> None:
    """A line without noise, from a millisecond to days after the last value; none before it."""
    times = np.arange(10.0)
    course = course_of(TimeSeries(times, 0.25 * times, np.full(10, 1e-9)))
    found = due_date(course, 0.25 * (9.0 + after))
    assert found.due == pytest.approx(9.0 + after, abs=1e-5)
    assert found.early == pytest.approx(9.0 + after, abs=1e-5)
    assert due_date(course, 1.0).due == due_date(course, 1.0).early == 9.0


@pytest.mark.parametrize("times", [[0.0, 1.0], [2.0, 2.0, 2.0]])
def test_too_few_days(times: list[float]) -> None:
    series = TimeSeries(np.array(times), np.ones(len(times)), np.ones(len(times)))
    with pytest.raises(PretravelError, match="at least 3 at different times"):
        course_of(series)


@pytest.mark.parametrize("limit", [0.0, -1e-3, math.nan])
def test_a_limit_is_positive(limit: float) -> None:
    with pytest.raises(PretravelError, match="; it must be positive"):
        due_date(course_of(SERIES["drift"]), limit)


# Breaks: each place by a fit of its own.


def break_fit(
    series: TimeSeries, place: int, apart: bool, scatter: float, walk: float
) -> tuple[float, float]:
    rows = np.arange(len(series))
    shape = (rows == place if apart else rows >= place).astype(float)
    value, u, _ = least_squares(series, np.column_stack([shape, series.times]), scatter, walk)
    return float(value[0]), float(u[0])


@pytest.mark.parametrize(("scatter", "walk"), NOISES)
def test_scores_are_those_of_a_fit_with_each_break(scatter: float, walk: float) -> None:
    series = uneven()
    jump, apart = _scores(series, SeriesNoise(scatter, walk))
    ratios = [
        [
            abs(b) / u
            for b, u in (break_fit(series, place, alone, scatter, walk) for place in places)
        ]
        for places, alone in ((range(1, 9), False), (range(1, 8), True))
    ]
    assert jump == pytest.approx(ratios[0], rel=1e-7)
    assert apart == pytest.approx(ratios[1], rel=1e-7)


def probability(series: TimeSeries, place: int, apart: bool) -> tuple[float, float, float]:
    """Size, u, and twice the probability of the other sign, over the noises that count."""
    rows = np.arange(len(series))
    shape = (rows == place if apart else rows >= place).astype(float)
    parts = counted(mixture(series, np.column_stack([shape, series.times])))
    size, u = moments_of([(w, b[0], e[0] ** 2) for w, _, b, e in parts])
    below = sum(w * stats.norm.cdf(-b[0] / e[0]) for w, _, b, e in parts)
    above = sum(w * stats.norm.cdf(b[0] / e[0]) for w, _, b, e in parts)
    return size, u, 2.0 * min(below, above)


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_break_has_the_probability_of_all_places_and_quantities(apart: bool, sign: float) -> None:
    """Bonferroni: two kinds at each day but the first of both quantities, and five times that."""
    rng = np.random.default_rng(2)
    rows, times = np.arange(12), np.arange(12.0)
    shape = rows == 5 if apart else rows >= 5
    values = sign * 25.0 * shape + rng.standard_normal(12)
    quiet = rng.standard_normal(12)
    known = {"level": (values, np.ones(12)), "turn": (quiet, np.ones(12))}
    (found,) = breaks_of(times, known)
    assert (found.day, found.quantity, found.apart) == (5, "level", apart)
    size, u, p = probability(TimeSeries(times, values, np.ones(12)), 5, apart)
    assert found.size == pytest.approx(size, rel=1e-6)
    assert found.u == pytest.approx(u, rel=1e-6)
    assert found.p_value == pytest.approx(5.0 * 2.0 * 2.0 * 11.0 * p, rel=1e-4)
    (alone,) = breaks_of(times, {"level": known["level"]})
    assert found.p_value == pytest.approx(2.0 * alone.p_value, rel=1e-12)


def test_breaks_have_a_probability_of_a_hundredth_at_most() -> None:
    """2 · 5 · 11 times that of the break at its place, where size decides on which side it is."""
    noise = np.random.default_rng(2).standard_normal(12)
    times = np.arange(12.0)

    def jumped(size: float) -> TimeSeries:
        return TimeSeries(times, noise + size * (times >= 5), np.ones(12))

    for p, days in ((0.009, [5]), (0.011, [])):
        size = optimize.brentq(
            lambda x, p=p: math.log(110.0 * probability(jumped(x), 5, False)[2] / p), 5.0, 30.0,
            rtol=1e-3,
        )  # fmt: skip
        found = breaks_of(times, {"a": (jumped(size).values, np.ones(12))})
        assert [one.day for one in found] == days


def exact_jump(count: int, day: int, size: float = 10.0) -> np.ndarray:
    rows = np.arange(count)
    return np.asarray(size * (rows >= day) + 1e-4 * np.random.default_rng(3).standard_normal(count))


def test_five_values_are_the_fewest_with_a_break() -> None:
    """Level, trend and break leave one degree of freedom of four, which shows nothing."""
    for count, days in ((5, [2]), (4, [])):
        values = exact_jump(count, 2, 1e6)
        found = breaks_of(np.arange(float(count)), {"a": (values, np.full(count, 1e-3))})
        assert [one.day for one in found] == days


@pytest.mark.long
def test_days_keep_their_rows_where_values_are_missing_or_parts_begin_later() -> None:
    """Rows of the whole series, of values that other quantities do not have."""
    values, u = exact_jump(24, 17), np.full(24, 1e-3)
    values[[1, 14]], u[[3, 15]] = np.nan, np.nan
    times = np.arange(24.0)
    for starts in (frozenset[int](), frozenset({0}), frozenset({9})):
        (found,) = breaks_of(times, {"a": (values, u), "b": (np.zeros(24), np.ones(24))}, starts)
        assert (found.day, found.quantity, found.apart) == (17, "a", False)
        assert found.size == pytest.approx(10.0, abs=0.01)
    assert breaks_of(times, {"a": (values, u)}, frozenset({17})) == ()


def test_a_clearer_break_of_another_quantity_names_it() -> None:
    times, u = np.arange(16.0), np.full(16, 1e-2)
    noise = 1e-2 * np.random.default_rng(4).standard_normal((2, 16))
    small, large = noise[0] + 0.2 * (times >= 7), noise[1] + 2.0 * (times >= 7)
    for known in ({"s": (small, u), "l": (large, u)}, {"l": (large, u), "s": (small, u)}):
        (found,) = breaks_of(times, known)
        assert (found.day, found.quantity) == (7, "l")


def test_breaks_before_and_after_the_clearest_are_found_in_order() -> None:
    times = np.arange(40.0)
    values = exact_jump(40, 20, 50.0) + 5.0 * (times >= 8) + 7.0 * (times >= 31)
    values[14] += 9.0
    found = breaks_of(times, {"a": (values, np.full(40, 1e-3))})
    assert [(one.day, one.apart) for one in found] == [
        (8, False), (14, True), (20, False), (31, False)]  # fmt: skip
    # The third was found first, while the others were in the values of both sides.
    assert [found[i].size for i in (0, 1, 3)] == pytest.approx([5.0, 9.0, 7.0], abs=0.01)
    assert Break(1, "a", 1.0, 0.1, 0.001).apart is False


# What simulated series show: rates of false alarms, and dates that come early enough.


def simulated(seed: int, count: int, *, slope: float = 0.0, walk: float = 0.0) -> TimeSeries:
    rng = np.random.default_rng(seed)
    times = np.arange(float(count))
    values = slope * times + math.sqrt(walk) * np.cumsum(rng.standard_normal(count))
    return TimeSeries(times, values + rng.standard_normal(count), np.ones(count))


@pytest.mark.slow
@pytest.mark.parametrize("walk", [0.0, 1.0])
def test_trends_of_unchanged_and_walking_probes(walk: float) -> None:
    """Stated at 1 %: more than 4 of 60 series have a probability of 0.03 %."""
    found = [course_of(simulated(s, 12, walk=walk)).kind == "drift" for s in range(60)]
    assert sum(found) <= 4


@pytest.mark.slow
@pytest.mark.parametrize("walk", [0.0, 1.0])
def test_breaks_of_unchanged_and_walking_probes(walk: float) -> None:
    """Stated at 1 %: more than 3 of 60 series have a probability of 0.3 %."""
    found = []
    for seed in range(60):
        series = simulated(seed, 20, walk=walk)
        found.append(bool(breaks_of(series.times, {"level": (series.values, series.u)})))
    assert sum(found) <= 3


@pytest.mark.slow
def test_the_true_date_is_not_before_the_early_one() -> None:
    """In 95 % of 15 series or more: fewer than 11 have a probability of 0.06 %."""
    true = 30.0
    early = np.array([due_date(course_of(simulated(seed, 10, slope=0.5)), 0.5 * true).early
                      for seed in range(15)])  # fmt: skip
    assert np.sum(early <= true) >= 11
    # And it says something: half of them are later than the last day by a fifth of the way.
    assert np.median(early) > 9.0 + 0.2 * (true - 9.0)
