"""Noises, courses and breaks of series against dense algebra: whole covariances, every place."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest
from scipy import optimize, stats

from pretravel.qualification.drift_over_time import DailyQuantity, days_from, drift_over_time
from pretravel.qualification.series_breaks import Break, _scores, breaks_of
from pretravel.qualification.series_courses import (
    _SCATTERS,
    _WALKS,
    EARLY,
    HORIZON,
    Course,
    course_of,
    due_date,
    fitted_noises,
    weighed_noises,
)
from pretravel.qualification.time_series import (
    SeriesNoise,
    TimeSeries,
    column_fit,
    determined_noise,
    states_of,
    variance_about,
)


def uneven(count: int = 9, slope: float = 0.4) -> TimeSeries:
    rng = np.random.default_rng(8)
    times = np.cumsum(rng.uniform(0.5, 2.5, count))
    u = rng.uniform(0.6, 1.5, count)
    values = slope * times + np.cumsum(0.6 * rng.standard_normal(count))
    return TimeSeries(times, values + u * rng.standard_normal(count), u)


def whole_covariance(series: TimeSeries, scatter: float, walk: float) -> np.ndarray:
    since = series.times - series.times[0]
    return np.diag(series.u**2 + scatter**2) + walk * np.minimum.outer(since, since)


def with_level(columns: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones(len(columns)), columns])


def least_squares(
    series: TimeSeries, columns: np.ndarray, scatter: float, walk: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients beside the level, their u, and the restricted likelihood (Patterson, Thompson):
    of the values with the determinant of the information, from the whole covariance. That of
    differences has the same, because all of them have the determinant of (1, …, 1) apart."""
    matrix, x = whole_covariance(series, scatter, walk), with_level(columns)
    inverse = np.linalg.inv(matrix)
    information = x.T @ inverse @ x
    covariance = np.linalg.inv(information)
    found = covariance @ x.T @ inverse @ series.values
    left = series.values - x @ found
    logs = np.linalg.slogdet(matrix)[1] + np.linalg.slogdet(information)[1]
    log = -0.5 * float(logs + left @ inverse @ left)
    return found[1:], np.sqrt(np.diag(covariance))[1:], log


def residual_variance(series: TimeSeries, columns: np.ndarray) -> float:
    x = with_level(columns)
    left = series.values - x @ np.linalg.pinv(x) @ series.values
    return float(left @ left) / (len(x) - x.shape[1])


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


def mixture(
    series: TimeSeries, columns: np.ndarray, noises: str = "any"
) -> list[tuple[float, SeriesNoise, np.ndarray, np.ndarray]]:
    """Every pair of the grid with its probability: none is left out."""
    size, span = residual_variance(series, columns), np.ptp(series.times)
    size = max(size, 0.1 * float(np.mean(series.u**2)))
    found = []
    for scatter in np.sqrt(size * _SCATTERS):
        for walk in size / span * _WALKS:
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


NOISES = [(0.0, 0.0), (0.7, 0.0), (0.0, 0.4), (0.5, 0.3)]


@pytest.mark.parametrize("powers", [(), (1,), (1, 2)])
def test_a_fit_of_differences_is_that_of_the_whole_covariance(powers: tuple[int, ...]) -> None:
    """Coefficients, u, and differences of the restricted likelihood from noise to noise."""
    series = uneven()
    columns = np.stack([series.times**power for power in powers], axis=1) if powers else None
    columns = np.empty((len(series), 0)) if columns is None else columns
    apart = []
    for scatter, walk in NOISES:
        fit = column_fit(series, columns, scatter=scatter, walk=walk)
        value, u, log = least_squares(series, columns, scatter, walk)
        assert fit.coefficients == pytest.approx(value, rel=1e-8)
        assert fit.u == pytest.approx(u, rel=1e-8)
        apart.append(fit.log_likelihood - log)
    assert np.ptp(apart) < 1e-8


@pytest.mark.parametrize("walk", [True, False])
@pytest.mark.parametrize("trend", [True, False])
def test_the_noise_is_where_the_whole_likelihood_is_largest(trend: bool, walk: bool) -> None:
    """By another search (Nelder and Mead's, from many starts) of the logarithms. The series of 40
    values has both scatter and walk."""
    rng = np.random.default_rng(21)
    times = np.cumsum(rng.uniform(0.5, 1.5, 40))
    values = np.cumsum(rng.standard_normal(40)) + 1.2 * rng.standard_normal(40)
    series = TimeSeries(times, values, np.full(40, 0.3))
    columns = times[:, None] if trend else np.empty((40, 0))

    def cost(logs: np.ndarray) -> float:
        q = math.exp(logs[1]) if walk else 0.0
        return -least_squares(series, columns, math.exp(0.5 * logs[0]), q)[2]

    found = optimize.minimize(cost, [0.0, -0.5], method="Nelder-Mead", options={"xatol": 1e-5})
    noise = determined_noise(series, columns, walk=walk)
    # The search ends where the likelihood is flat: 1e-6 of it is a thousandth of a variance.
    assert noise.scatter**2 == pytest.approx(math.exp(found.x[0]), rel=5e-3)
    assert noise.walk == pytest.approx(math.exp(found.x[1]) if walk else 0.0, rel=5e-3)
    at_none = column_fit(series, columns).log_likelihood
    gain = -found.fun - least_squares(series, columns, 0.0, 0.0)[2]
    assert noise.log_likelihood - at_none == pytest.approx(gain, abs=1e-5)


def test_the_variance_about_columns_has_their_degrees_of_freedom() -> None:
    series = uneven()
    for columns in (np.empty((9, 0)), series.times[:, None], series.times[:, None] ** [1, 2]):
        assert variance_about(series, columns) == pytest.approx(
            residual_variance(series, columns), rel=1e-9
        )
    still = TimeSeries(series.times, 3.0 + 0.1 * series.times, series.u)
    assert variance_about(still, series.times[:, None]) == pytest.approx(
        0.1 * np.mean(series.u**2), rel=1e-12
    )
    # Three coefficients of three values: nothing is free, and one is counted.
    few = TimeSeries(series.times[:3], [0.0, 3.0, 0.0], np.full(3, 1e-3))
    assert variance_about(few, np.empty((3, 0))) == pytest.approx(3.0, rel=1e-9)
    assert variance_about(few, few.times[:, None] ** [1, 2]) == pytest.approx(1e-7, rel=1e-6)


def predicted(
    series: TimeSeries, noise: SeriesNoise, at: float, trend: bool
) -> tuple[float, float]:
    """Best linear unbiased prediction of the state with the whole covariance."""
    since = series.times - series.times[0]
    x = with_level(series.times[:, None] if trend else np.empty((len(series), 0)))
    weights = np.linalg.inv(whole_covariance(series, noise.scatter, noise.walk))
    covariance = np.linalg.inv(x.T @ weights @ x)
    found = covariance @ x.T @ weights @ series.values
    own = noise.walk * np.minimum(at - series.times[0], since)
    row = np.array([1.0, at][: x.shape[1]])
    rest = row - x.T @ weights @ own
    mean = row @ found + own @ weights @ (series.values - x @ found)
    spread = noise.walk * (at - series.times[0]) - own @ weights @ own + rest @ covariance @ rest
    return float(mean), float(spread)


@pytest.mark.parametrize("trend", [True, False])
@pytest.mark.parametrize(("scatter", "walk"), NOISES)
def test_states_are_the_best_predictions_at_all_times(
    scatter: float, walk: float, trend: bool
) -> None:
    series, noise = uneven(), SeriesNoise(scatter, walk)
    states = states_of(series, noise, trend=trend)
    expected = np.array([predicted(series, noise, t, trend) for t in series.times])
    assert states.level == pytest.approx(expected[:, 0], rel=1e-8)
    assert states.variance == pytest.approx(expected[:, 1], rel=1e-8)
    later = series.times[-1] + np.array([0.0, 2.0, 30.0])
    ahead = np.array([predicted(series, noise, t, trend) for t in later])
    mean, variance = states.later(later)
    assert mean == pytest.approx(ahead[:, 0], rel=1e-8)
    assert variance == pytest.approx(ahead[:, 1], rel=1e-8)
    if not trend:
        assert (states.slope, states.u_slope) == (0.0, 0.0)
    assert states.walk == walk


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


def test_noises_are_none_or_even_in_their_logarithms() -> None:
    for grid in (_SCATTERS, _WALKS):
        assert grid[0] == 0.0
        assert np.ptp(np.diff(np.log(grid[1:]))) < 1e-12


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
    walking, still = determined_noise(series, level), determined_noise(series, level, walk=False)
    ratio = 2.0 * (walking.log_likelihood - still.log_likelihood)
    expected = 0.5 * stats.chi2.sf(ratio, 1.0) if ratio > 0.0 else 1.0
    assert course.p_walk == pytest.approx(expected, rel=1e-9)
    trend = determined_noise(series, series.times[:, None])
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
    at = course.allowed.probability_beyond(limit, [found.early], start)
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


# Drift over many days.

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
