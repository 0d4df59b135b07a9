"""Level, trend, scatter and random walk of a series, against closed forms and dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.qualification.time_series import (
    SeriesNoise,
    TimeSeries,
    Whitened,
    column_fit,
    determined_noise,
    series_of,
    states_of,
)

NONE = SeriesNoise(0.0, 0.0)


def uneven(count: int = 20) -> TimeSeries:
    rng = np.random.default_rng(3)
    times = np.cumsum(rng.uniform(0.2, 3.0, count))
    u = rng.uniform(0.5, 2.0, count)
    return TimeSeries(times, 0.1 * times + u * rng.standard_normal(count), u)


def design(series: TimeSeries) -> np.ndarray:
    return np.column_stack([np.ones(len(series)), series.times])


class TestWeightedLine:
    def test_slope_and_its_u_are_those_of_the_textbook(self) -> None:
        """Bevington and Robinson, equations 6.12 and 6.22: sums of 1/u², t/u², …"""
        series = uneven()
        t, y, w = series.times, series.values, 1.0 / series.u**2
        s, sx, sy, sxx, sxy = (
            w.sum(),
            (w * t).sum(),
            (w * y).sum(),
            (w * t * t).sum(),
            (w * t * y).sum(),
        )
        delta = s * sxx - sx**2
        fit, states = column_fit(series, t[:, None]), states_of(series, NONE, trend=True)
        slope, u_slope = (s * sxy - sx * sy) / delta, np.sqrt(s / delta)
        assert fit.coefficients[0] == pytest.approx(slope, rel=1e-9)
        assert fit.u[0] == pytest.approx(u_slope, rel=1e-9)
        assert (states.slope, states.u_slope) == pytest.approx((slope, u_slope), rel=1e-9)
        level = (sxx * sy - sx * sxy) / delta
        assert states.level == pytest.approx(level + slope * t, rel=1e-9)
        variance = (sxx - 2.0 * sx * t + s * t**2) / delta
        assert states.variance == pytest.approx(variance, rel=1e-9)

    def test_the_mean_without_a_trend(self) -> None:
        series = uneven()
        states = states_of(series, NONE, trend=False)
        mean = np.average(series.values, weights=1.0 / series.u**2)
        assert states.level == pytest.approx(mean, rel=1e-9)
        assert states.variance == pytest.approx(1.0 / np.sum(1.0 / series.u**2), rel=1e-9)


class TestRandomWalk:
    def test_states_are_those_of_dense_prediction(self) -> None:
        """Best linear unbiased prediction with the whole covariance (universal kriging)."""
        series, scatter, walk = uneven(), 0.7, 0.3
        t, since = series.times, series.times - series.times[0]
        matrix = np.diag(series.u**2 + scatter**2) + walk * np.minimum.outer(since, since)
        weights, x = np.linalg.inv(matrix), design(series)
        covariance = np.linalg.inv(x.T @ weights @ x)
        found = covariance @ x.T @ weights @ series.values
        states = states_of(series, SeriesNoise(scatter, walk), trend=True)
        assert states.slope == pytest.approx(found[1], rel=1e-9)
        assert states.u_slope == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-9)
        for at in (t[4], t[-1], t[-1] + 11.0):
            own = walk * np.minimum(at - t[0], since)
            row = np.array([1.0, at])
            expected = row @ found + own @ weights @ (series.values - x @ found)
            rest = row - x.T @ weights @ own
            spread = walk * (at - t[0]) - own @ weights @ own + rest @ covariance @ rest
            if at < t[-1]:
                mean, variance = states.level[4], states.variance[4]
            else:
                mean, variance = states.later(at)
            assert (float(mean), float(variance)) == pytest.approx((expected, spread), rel=1e-8)

    def test_bands_of_the_inverse(self) -> None:
        series = uneven()
        steps = np.diff(np.eye(len(series)), axis=0)
        since = series.times - series.times[0]
        matrix = np.diag(series.u**2 + 0.25) + 0.3 * np.minimum.outer(since, since)
        inverse = np.linalg.inv(steps @ matrix @ steps.T)
        main, beside = Whitened.of(series, 0.5, 0.3).inverse_bands()
        assert main == pytest.approx(np.diag(inverse), rel=1e-9)
        assert beside == pytest.approx(np.diag(inverse, 1), rel=1e-9)


class TestDeterminedNoise:
    """Tolerances: those of the search for the largest likelihood, about 1e-3 of the variance."""

    def test_a_walk_without_errors_has_the_mean_square_step(self) -> None:
        """For equal intervals d: sum of squared steps over (n - 1) d."""
        times = 2.0 * np.arange(40.0)
        values = np.cumsum(np.random.default_rng(1).standard_normal(40))
        series = TimeSeries(times, values, np.full(40, 1e-4))
        walk = np.sum(np.diff(values) ** 2) / (39.0 * 2.0)
        found = determined_noise(series, np.empty((40, 0)))
        assert found.walk == pytest.approx(walk, rel=5e-3)
        assert found.scatter**2 < 0.01 * walk

    def test_a_walk_about_a_trend_has_the_variance_of_its_steps(self) -> None:
        """The mean step is the trend, which costs one degree of freedom. (Steps of this seed are
        not opposite to each other, so that the likelihood is largest without scatter.)"""
        times = np.arange(40.0)
        values = 0.8 * times + np.cumsum(np.random.default_rng(6).standard_normal(40))
        series = TimeSeries(times, values, np.full(40, 1e-4))
        found = determined_noise(series, times[:, None])
        assert found.walk == pytest.approx(np.var(np.diff(values), ddof=1), rel=5e-3)

    def test_scatter_is_what_equal_uncertainties_leave_of_the_variance(self) -> None:
        values = np.random.default_rng(4).standard_normal(25)
        series = TimeSeries(np.arange(25.0), values, np.full(25, 0.6))
        found = determined_noise(series, np.empty((25, 0)), walk=False)
        assert found.scatter**2 == pytest.approx(np.var(values, ddof=1) - 0.36, rel=5e-3)
        assert found.walk == 0.0


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


@pytest.mark.parametrize(("unit", "day"), [(1e-3, 1.0), (1e4, 1.0), (1.0, 300.0), (1e-3, 0.01)])
@pytest.mark.parametrize("u", [0.3, 1e-7])
def test_noises_are_the_same_in_every_unit(unit: float, day: float, u: float) -> None:
    """A scatter goes with the unit, a walk with its square over the unit of time; errors that are
    too small to matter do so in no unit."""
    rng = np.random.default_rng(12)
    times = np.cumsum(rng.uniform(0.5, 1.5, 30))
    values = np.cumsum(rng.standard_normal(30)) + 3.0 * rng.standard_normal(30)
    found = determined_noise(TimeSeries(times, values, np.full(30, u)), times[:, None])
    assert found.walk > 0.1
    assert found.scatter > 0.5
    other = determined_noise(
        TimeSeries(day * times, unit * values, np.full(30, unit * u)), day * times[:, None]
    )
    assert other.scatter == pytest.approx(unit * found.scatter, rel=2e-3)
    assert other.walk == pytest.approx(unit**2 / day * found.walk, rel=5e-3)


def test_the_best_noise_is_that_of_any_search() -> None:
    """On a grid over four decades of scatter and walk no noise is more likely."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        values = np.cumsum(rng.standard_normal(12)) * (seed % 2) + rng.standard_normal(12)
        series = TimeSeries(np.arange(12.0), values, np.full(12, 0.1 + 0.2 * (seed % 3)))
        none = np.empty((12, 0))
        for walk in (True, False):
            found = determined_noise(series, none, walk=walk)
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


def test_errors_without_any_variance_have_no_inverse() -> None:
    """The square of 1e-200 is zero."""
    series = TimeSeries(np.arange(3.0), np.arange(3.0), np.full(3, 1e-200))
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        Whitened.of(series, 0.0, 0.0)
    assert len(Whitened.of(series, 0.0, 0.1).pivots) == 2
