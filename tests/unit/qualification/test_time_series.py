"""Fits, noises and states of a series against dense algebra: the whole covariance of its values."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.qualification.time_series import (
    SeriesNoise,
    TimeSeries,
    Whitened,
    column_fit,
    series_of,
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
    slope = (0.0, 0.0)
    if trend:
        value, u, _ = least_squares(series, series.times[:, None], scatter, walk)
        slope = value[0], u[0]
    assert (states.slope, states.u_slope) == pytest.approx(slope, rel=1e-8)
    assert states.walk == walk


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


def test_the_best_noise_is_that_of_any_search() -> None:
    """On a grid over four decades of scatter and walk no noise is more likely."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        values = np.cumsum(rng.standard_normal(12)) * (seed % 2) + rng.standard_normal(12)
        series = TimeSeries(np.arange(12.0), values, np.full(12, 0.1 + 0.2 * (seed % 3)))
        none = np.empty((12, 0))
        for walk in (True, False):
            found = series.determined_noise(none, walk=walk)
            grid = np.append(0.0, np.geomspace(1e-3, 10.0, 25))
            best = max(
                column_fit(series, none, scatter=s, walk=q).log_likelihood
                for s in grid
                for q in (grid if walk else [0.0])
            )
            assert found.log_likelihood > best - 1e-6
            again = column_fit(series, none, scatter=found.scatter, walk=found.walk)
            assert found.log_likelihood == pytest.approx(again.log_likelihood, abs=1e-9)
            assert found.walk == 0.0 or walk


@pytest.mark.parametrize(("unit", "day"), [(1e-3, 1.0), (1e4, 1.0), (1.0, 300.0), (1e-3, 0.01)])
@pytest.mark.parametrize("u", [0.3, 1e-7])
def test_noises_are_the_same_in_every_unit(unit: float, day: float, u: float) -> None:
    """A scatter goes with the unit, a walk with its square over the unit of time; errors that are
    too small to matter do so in no unit."""
    rng = np.random.default_rng(12)
    times = np.cumsum(rng.uniform(0.5, 1.5, 30))
    values = np.cumsum(rng.standard_normal(30)) + 3.0 * rng.standard_normal(30)
    found = TimeSeries(times, values, np.full(30, u)).determined_noise(times[:, None])
    assert found.walk > 0.1
    assert found.scatter > 0.5
    series = TimeSeries(day * times, unit * values, np.full(30, unit * u))
    other = series.determined_noise(day * times[:, None])
    assert other.scatter == pytest.approx(unit * found.scatter, rel=2e-3)
    assert other.walk == pytest.approx(unit**2 / day * found.walk, rel=5e-3)


def test_errors_without_any_variance_have_no_inverse() -> None:
    """The square of 1e-200 is zero."""
    series = TimeSeries(np.arange(3.0), np.arange(3.0), np.full(3, 1e-200))
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Whitened.of(series, 0.0, 0.0)
    assert len(Whitened.of(series, 0.0, 0.1).pivots) == 2


class TestRefusals:
    @pytest.mark.parametrize(
        ("times", "values", "u", "words"),
        [
            ([0.0, 1.0], [1.0], [1.0], "each value has one time"),
            ([0.0, 1.0], [1.0], [1.0, 1.0], "each value has one time"),
            ([0.0, 1.0], [1.0, 1.0], [1.0], "each value has one time"),
            ([0.0, 1.0], [1.0, np.inf], [1.0, 1.0], "not a finite number"),
            ([0.0, np.inf], [1.0, 1.0], [1.0, 1.0], "not a finite number"),
            ([0.0, np.nan, 1.0], [1.0, 1.0, 2.0], [1.0, 1.0, 1.0], "not a finite number"),
            ([0.0, 1.0], [1.0, 1.0], [1.0, 0.0], "is not positive"),
            ([0.0, 1.0], [1.0, 1.0], [-1.0, 1.0], "is not positive"),
            ([0.0, 1.0], [1.0, 1.0], [np.inf, 1.0], "is not positive"),
            ([0.0, 1.0], [1.0, 1.0], [1.0, np.nan], "is not positive"),
            ([1.0, 0.0], [1.0, 1.0], [1.0, 1.0], "times of a series decrease"),
            ([0.0, 2.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0], "times of a series decrease"),
        ],
    )
    def test_series_that_mean_nothing(
        self, times: list[float], values: list[float], u: list[float], words: str
    ) -> None:
        with pytest.raises(PretravelError, match=words):
            TimeSeries(np.array(times), np.array(values), np.array(u))

    def test_what_is_not_known_is_left_out(self) -> None:
        series = series_of([0.0, 1.0, 2.0], [1.0, np.nan, 3.0], [0.1, 0.1, np.nan])
        assert series.values.tolist() == [1.0]

    def test_two_values_at_one_time_are_a_series(self) -> None:
        assert len(TimeSeries([1.0, 1.0], [2.0, 3.0], [0.1, 0.2])) == 2

    def test_a_series_does_not_change(self) -> None:
        given = np.array([1.0, 2.0])
        series = TimeSeries(given, given, given)
        given[0] = 0.5
        assert series.times.tolist() == series.values.tolist() == series.u.tolist() == [1.0, 2.0]
        for part in (series.times, series.values, series.u):
            assert not part.flags.writeable
