"""JCGM 100 (GUM) and JCGM 101: published examples, closed forms, and GTC as an oracle.

H.1 end gauge, H.2 resistance and reactance from correlated readings, H.3 thermometer (a line), H.4
activity of radon (correlated), H.5 Zener standard (days), JCGM 101 9.2 sum, 9.3 mass, 9.4 power of
two components (nonlinear), 9.5 gauge block. The data are recalled; where every printed result
follows from them, they are right. Printed values hold to half of their last digit.
"""

from __future__ import annotations

import math

import GTC
import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from pretravel.qualification.time_series import (
    SeriesNoise,
    TimeSeries,
    column_fit,
    states_of,
)
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.gum import Budget, Component, coverage_factor
from tests.support.monte_carlo import (
    Input,
    independent,
    joint_normal,
    monte_carlo,
    numerical_tolerance,
    shortest_interval,
    validate,
)
from tests.support.propagation import propagate

# H.1: l = ls + d - ls (da th + as dt), lengths in nm.
LS, ALPHA = 50_000_623.0, 11.5e-6
D_DOF = 9.7**4 / (5.8**4 / 24 + 3.9**4 / 5 + 6.7**4 / 8)
H1 = {
    "standard": (LS, 25.0, 18.0),
    "difference": (215.0, math.sqrt(5.8**2 + 3.9**2 + 6.7**2), D_DOF),
    "expansion of the standard": (ALPHA, 2e-6 / math.sqrt(3.0), math.inf),
    "temperature": (-0.1, math.sqrt(0.2**2 + 0.5**2 / 2.0), math.inf),
    "difference of expansions": (0.0, 1e-6 / math.sqrt(3.0), 50.0),
    "difference of temperatures": (0.0, 0.05 / math.sqrt(3.0), 2.0),
}


def _end_gauge(x: np.ndarray) -> np.ndarray:
    standard, difference, expansion, temperature, d_expansion, d_temperature = x.T
    return (
        standard + difference - standard * (d_expansion * temperature + expansion * d_temperature)
    )


def test_h1_end_gauge() -> None:
    """The GUM prints l = 50.000 838 mm, uc = 32 nm, 16 effective degrees of freedom and
    U99 = 2.92 · 32 = 93 nm."""
    estimates, u, dof = map(np.array, zip(*H1.values(), strict=True))
    result = propagate(_end_gauge, estimates, u, names=list(H1), dof=dof)
    assert result.value[0] == pytest.approx(50_000_838.0, abs=0.5)
    assert result.standard_uncertainty[0] == pytest.approx(32.0, abs=0.5)
    assert math.floor(result.effective_dof[0]) == 16
    budget = result.budgets[0]
    assert budget.coverage_factor(0.99) == pytest.approx(2.92, abs=0.005)
    assert budget.expanded(0.99) == pytest.approx(93.0, abs=1.0)
    # Table H.1's contributions in nm.
    printed = {"standard": 25.0, "difference": 9.7, "difference of expansions": 2.9,
               "difference of temperatures": 16.6}  # fmt: skip
    for component in budget.components:
        assert component.contribution == pytest.approx(printed.get(component.name, 0.0), abs=0.05)


def test_coverage_factors_of_expanded_uncertainties() -> None:
    """JCGM 100 (GUM), Table G.2, the column of 95.45 %: k = 2 is that of a normal distribution."""
    printed = {1: 13.97, 2: 4.53, 3: 3.31, 4: 2.87, 5: 2.65, 6: 2.52, 7: 2.43, 8: 2.37, 10: 2.28,
               20: 2.13, 50: 2.05, math.inf: 2.0}  # fmt: skip
    for dof, factor in printed.items():
        budget = Budget((Component("repeats", "A", 1.0, dof=dof),))
        # The table has two digits after the point.
        assert budget.coverage_factor() == pytest.approx(factor, abs=0.005)
        assert budget.expanded() == pytest.approx(factor, abs=0.005)


def test_h1_against_gtc() -> None:
    inputs = {name: GTC.ureal(value, u, dof, label=name) for name, (value, u, dof) in H1.items()}
    s, d, a, t, da, dt = inputs.values()
    theirs = s + d - s * (da * t + a * dt)
    estimates, u, dof = map(np.array, zip(*H1.values(), strict=True))
    ours = propagate(_end_gauge, estimates, u, dof=dof)
    assert ours.standard_uncertainty[0] == pytest.approx(theirs.u, rel=1e-6)
    assert ours.effective_dof[0] == pytest.approx(theirs.df, rel=1e-5)


def test_h1_second_order_is_seen_by_trials() -> None:
    """H.1.7: second-order terms raise uc from 32 to 34 nm. Trials contain them, so the
    interval of the GUM is not validated."""
    shapes = ["normal", "normal", "uniform", "normal", "uniform", "uniform"]
    inputs = [
        Input(value, u, shape)  # type: ignore[arg-type]
        for (value, u, _), shape in zip(H1.values(), shapes, strict=True)
    ]
    trials = monte_carlo(_end_gauge, independent(inputs), share=0.2, most_trials=2_000_000)
    assert trials.standard_uncertainty[0] == pytest.approx(34.0, abs=0.5)
    gum = propagate(_end_gauge, *map(np.array, list(zip(*H1.values(), strict=True))[:2]))
    judged = validate(gum, trials)
    assert not judged.valid[0]
    assert "Monte Carlo" in judged.message


def test_h2_correlated_readings() -> None:
    """V, I and phi from five simultaneous readings (Table H.2). The GUM prints R = 127.732(71),
    X = 219.847(295), Z = 254.260(236) ohm, r(R, X) = -0.588, r(R, Z) = -0.485, r(X, Z) = 0.993."""
    readings = np.array(
        [
            [5.007, 19.663e-3, 1.0456],
            [4.994, 19.639e-3, 1.0438],
            [5.005, 19.640e-3, 1.0468],
            [4.990, 19.685e-3, 1.0428],
            [4.999, 19.678e-3, 1.0433],
        ]
    )
    covariance = np.cov(readings, rowvar=False) / 5.0

    def impedance(x: np.ndarray) -> np.ndarray:
        z = x[:, 0] / x[:, 1]
        return np.stack([z * np.cos(x[:, 2]), z * np.sin(x[:, 2]), z], axis=1)

    result = propagate(impedance, readings.mean(axis=0), Covariance.full(covariance))
    assert result.value.round(3).tolist() == [127.732, 219.847, 254.260]
    # The GUM rounds its inputs' uncertainties first, and then prints three digits.
    assert result.standard_uncertainty == pytest.approx([0.071, 0.295, 0.236], abs=7e-4)
    root = np.sqrt(np.diag(result.covariance))
    correlation = result.covariance / np.outer(root, root)
    assert correlation[[0, 0, 1], [1, 2, 2]] == pytest.approx([-0.588, -0.485, 0.993], abs=6e-4)
    assert np.all(np.isinf(result.effective_dof))  # Welch-Satterthwaite does not apply here
    # GTC, from the same sample estimates.
    v, i, phi = GTC.multiple_ureal(
        readings.mean(axis=0).tolist(), np.sqrt(np.diag(covariance)).tolist(), 4
    )
    for a, b, k, j in ((v, i, 0, 1), (v, phi, 0, 2), (i, phi, 1, 2)):
        root = math.sqrt(covariance[k, k] * covariance[j, j])
        GTC.set_correlation(float(covariance[k, j] / root), a, b)
    assert result.standard_uncertainty[1] == pytest.approx((v / i * GTC.sin(phi)).u, rel=1e-6)


def _thermometer() -> TimeSeries:
    """Table H.6: temperature less 20 °C, and correction; u is their scatter about the line."""
    read = [21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511]
    millikelvin = [-171, -169, -166, -159, -164, -165, -156, -157, -159, -161, -160]
    at, correction = np.array(read) - 20.0, 1e-3 * np.array(millikelvin)
    left = correction - np.polyval(np.polyfit(at, correction, 1), at)
    scatter = math.sqrt(float(left @ left) / 9.0)
    assert scatter == pytest.approx(0.0035, abs=5e-5)  # printed
    return TimeSeries(at, correction, np.full(11, scatter))


def test_h3_thermometer_is_a_trend() -> None:
    """The line that `history` fits: y2 = 0.002 18(67) and, at 30 °C, -0.1494(41) °C; at 20 °C,
    before the values, y1 = -0.1712(29), which is the last state of the values backwards."""
    series = _thermometer()
    fit = column_fit(series, series.times[:, None])
    assert fit.coefficients[0] == pytest.approx(0.00218, abs=5e-6)
    assert fit.u[0] == pytest.approx(0.00067, abs=5e-6)
    line = states_of(series, SeriesNoise(0.0, 0.0), trend=True)
    mean, variance = line.later(10.0)
    assert float(mean) == pytest.approx(-0.1494, abs=5e-5)
    assert math.sqrt(float(variance)) == pytest.approx(0.0041, abs=5e-5)
    back = TimeSeries(-series.times[::-1], series.values[::-1], series.u)
    mean, variance = states_of(back, SeriesNoise(0.0, 0.0), trend=True).later(0.0)
    assert float(mean) == pytest.approx(-0.1712, abs=5e-5)
    assert math.sqrt(float(variance)) == pytest.approx(0.0029, abs=5e-5)


def test_h4_activity_of_radon() -> None:
    """Tables H.7 and H.8, both ways: 0.4300(83) Bq/g from the means, and 0.4304(84) from the mean
    of the ratios."""
    standard = [15380, 14978, 14394, 13254, 12516, 11058]
    blank = [4054, 3922, 4200, 3830, 3956, 3980]
    sample = [41432, 38706, 35860, 32238, 29640, 26356]
    t_standard = np.array([243.74, 984.53, 1723.87, 2463.17, 3217.56, 3956.83])
    t_sample = np.array([367.37, 1107.66, 1846.99, 2586.28, 3340.68, 4079.94])
    counts, decay = np.array([sample, standard, blank]) / 60.0, 1.25894e-4
    rates = (counts[:2] - counts[2]) * np.exp(decay * np.array([t_sample, t_standard]))
    of_rates = np.cov(rates) / 6.0
    assert rates.mean(axis=1) == pytest.approx([652.60, 206.09], abs=0.005)
    assert np.sqrt(np.diag(of_rates)) == pytest.approx([6.42, 3.79], abs=0.005)
    assert np.corrcoef(rates)[0, 1] == pytest.approx(0.646, abs=5e-4)
    known, u = [0.1368, 5.0192, 5.0571], [0.0018, 0.005, 0.001]

    def activity(x: np.ndarray) -> np.ndarray:
        return x[:, 0] * x[:, 1] / x[:, 2] * x[:, 3] / x[:, 4]

    covariance = np.zeros((5, 5))
    covariance[:3, :3], covariance[3:, 3:] = np.diag(np.square(u)), of_rates
    means = propagate(activity, [*known, *rates.mean(axis=1)], Covariance.full(covariance))
    assert means.value[0] == pytest.approx(0.4300, abs=1e-4)
    assert means.standard_uncertainty[0] == pytest.approx(0.0083, abs=5e-5)
    ratios = rates[0] / rates[1]
    assert ratios.mean() == pytest.approx(3.170, abs=5e-4)
    u_ratio = float(ratios.std(ddof=1)) / math.sqrt(6.0)
    assert u_ratio == pytest.approx(0.046, abs=5e-4)
    ways = propagate(activity, [*known, ratios.mean(), 1.0], [*u, u_ratio, 0.0])
    assert ways.value[0] == pytest.approx(0.4304, abs=5e-5)
    assert ways.standard_uncertainty[0] == pytest.approx(0.0084, abs=5e-5)


def test_h5_scatter_between_days() -> None:
    """Table H.9, ten days of five readings of a Zener standard: the mean 10.000 097 V, within a day
    85 µV, the days' means 57 µV, their scatter beyond that of the readings 43 µV, which is what
    `history` determines of days. The GUM's F = 2.25 comes from its rounded 57 and 85; it is 2.26.
    """
    microvolt = np.array([172.0, 116.0, 13.0, 144.0, 106.0, 31.0, 60.0, 125.0, 163.0, 41.0])
    deviations = np.array([60.0, 77.0, 111.0, 101.0, 67.0, 93.0, 80.0, 73.0, 88.0, 86.0])
    within = math.sqrt(float(np.mean(deviations**2)))
    between = float(microvolt.std(ddof=1))
    assert microvolt.mean() == pytest.approx(97.0, abs=0.5)
    assert (within, between) == pytest.approx((85.0, 57.0), abs=0.5)
    assert pytest.approx(2.25, abs=0.005) == 5.0 * 57.0**2 / 85.0**2
    assert 5.0 * between**2 / within**2 == pytest.approx(2.26, abs=0.005)
    days = TimeSeries(np.arange(10.0), microvolt, np.full(10, within / math.sqrt(5.0)))
    noise = days.determined_noise(np.empty((10, 0)), walk=False)
    assert noise.scatter == pytest.approx(43.0, abs=0.5)
    mean = Budget((Component("days", "A", between / math.sqrt(10.0), dof=9.0),))
    assert mean.combined == pytest.approx(18.0, abs=0.5)


def test_jcgm_101_9_2_4_one_rectangle_dominates() -> None:
    """Three rectangles of u = 1 and one of u = 10: the GUM has u = 10.1 and ±19.9, the trials
    ±17.0, which reject it."""
    inputs = [Input(0.0, 1.0, "uniform")] * 3 + [Input(0.0, 10.0, "uniform")]
    gum = Budget(tuple(Component(str(k), "B", one.standard_uncertainty)
                       for k, one in enumerate(inputs)))  # fmt: skip
    assert gum.combined == pytest.approx(10.1, abs=0.05)
    assert gum.expanded(0.95) == pytest.approx(19.9, abs=0.05)
    trials = monte_carlo(
        lambda x: x.sum(axis=1), independent(inputs), share=0.2, most_trials=2_000_000
    )
    assert trials.symmetric_interval[0] == pytest.approx([-17.0, 17.0], abs=0.05)


def test_jcgm_101_9_3_mass() -> None:
    """A mass in air, of which the first order has no term: the GUM's u is 0.0539 mg, that of the
    trials 0.0754 mg with [1.0834, 1.3825] mg."""
    low, high = np.array([1.10, 7000.0, 7950.0]), np.array([1.30, 9000.0, 8050.0])
    densities = [
        Input(float(middle), float(width), "uniform")
        for middle, width in zip(0.5 * (low + high), (high - low) / math.sqrt(12.0), strict=True)
    ]
    inputs = [Input(100_000.0, 0.050), Input(1.234, 0.020), *densities]

    def mass(x: np.ndarray) -> np.ndarray:
        buoyancy = (x[:, 2] - 1.2) * (1.0 / x[:, 3] - 1.0 / x[:, 4])
        return (x[:, 0] + x[:, 1]) * (1.0 + buoyancy) - 100_000.0

    estimates = [one.estimate for one in inputs]
    gum = propagate(mass, estimates, [one.standard_uncertainty for one in inputs])
    assert gum.value[0] == pytest.approx(1.2340, abs=5e-5)
    assert gum.budgets[0].combined == pytest.approx(0.0539, abs=5e-5)
    trials = monte_carlo(mass, independent(inputs), share=0.2, most_trials=2_000_000)
    assert trials.standard_uncertainty[0] == pytest.approx(0.0754, abs=4e-4)
    # The shortest interval slides along a distribution that is nearly symmetric: its length is
    # known better than its place. That of the document is 0.001 off 1.234 ± 0.1495.
    found = trials.shortest_interval[0]
    assert np.ptp(found) == pytest.approx(1.3825 - 1.0834, abs=1e-3)
    assert found == pytest.approx([1.0834, 1.3825], abs=3e-3)
    assert not validate(gum, trials).valid[0]


@pytest.mark.parametrize("x1", [0.0, 0.010, 0.050])
def test_jcgm_101_9_4_power_of_two_components(x1: float) -> None:
    """Y = X1² + X2², X1 ~ N(x1, 0.005²), X2 ~ N(0, 0.005²), uncorrelated. Table 6: the GUM gives
    y = x1², u = 2 x1 u(x1) (zero at x1 = 0!); the distribution is 0.005² times a noncentral
    chi-square with two degrees of freedom, a closed form."""
    u = 0.005
    noncentral = (x1 / u) ** 2

    def model(x: np.ndarray) -> np.ndarray:
        return x[:, 0] ** 2 + x[:, 1] ** 2

    gum = propagate(model, [x1, 0.0], [u, u])
    assert gum.value[0] == pytest.approx(x1**2)
    assert gum.standard_uncertainty[0] == pytest.approx(2.0 * x1 * u, abs=1e-9)
    trials = monte_carlo(
        model,
        independent([Input(x1, u), Input(0.0, u)]),
        share=0.2,
        most_trials=3_000_000,
    )
    exact = ncx2(2, noncentral) if noncentral else chi2(2)
    # Tolerances: four standard errors for the number of trials.
    error = u**2 * exact.std() / math.sqrt(trials.trials)
    assert trials.value[0] == pytest.approx(u**2 * exact.mean(), abs=4.0 * error)
    assert trials.standard_uncertainty[0] == pytest.approx(u**2 * exact.std(), rel=0.01)
    ends = u**2 * exact.ppf([0.025, 0.975])
    assert trials.symmetric_interval[0] == pytest.approx(ends, abs=0.01 * np.ptp(ends))
    if x1 == 0.0:
        # Table 6: y = 50, u = 50, shortest interval [0, 150] (all 1e-6).
        assert trials.value[0] * 1e6 == pytest.approx(50.0, abs=0.5)
        assert trials.shortest_interval[0] * 1e6 == pytest.approx(
            [0.0, -50.0 * math.log(0.05)], abs=1.0
        )
    assert not validate(gum, trials).valid[0]


def test_gum_and_trials_agree_where_they_should() -> None:
    """A linear model of normal inputs: JCGM 101, 9.2.2."""
    gum = propagate(lambda x: x.sum(axis=1), np.zeros(4), np.ones(4))
    trials = monte_carlo(
        lambda x: x.sum(axis=1),
        independent([Input(0.0, 1.0)] * 4),
        share=0.2,
        most_trials=5_000_000,
    )
    assert trials.settled[0]
    assert gum.interval()[0] == pytest.approx([-3.92, 3.92], abs=0.005)
    assert validate(gum, trials).valid[0]


def test_four_rectangular_inputs() -> None:
    """JCGM 101, 9.2.3: u = 2.00, interval [-3.88, 3.88], where the GUM has ±3.92."""
    trials = monte_carlo(
        lambda x: x.sum(axis=1),
        independent([Input(0.0, 1.0, "uniform")] * 4),
        share=0.2,
        most_trials=5_000_000,
    )
    assert trials.standard_uncertainty[0] == pytest.approx(2.0, abs=0.005)
    assert trials.symmetric_interval[0] == pytest.approx([-3.88, 3.88], abs=0.01)


@pytest.mark.parametrize(
    ("u", "tolerance"),
    [(0.35, 0.005), (0.996, 0.05), (32.0, 0.5), (1e-3, 5e-5), (9.94, 0.05), (9.96, 0.5)],
)
def test_numerical_tolerance(u: float, tolerance: float) -> None:
    """JCGM 101, 7.9.2, two digits: u = c·10^l with c between 10 and 99, half of 10^l."""
    assert float(numerical_tolerance(u)) == pytest.approx(tolerance)


@pytest.mark.parametrize("shape", ["normal", "uniform", "triangular", "arcsine"])
def test_distributions_have_their_standard_uncertainty(shape: str) -> None:
    values = Input(3.0, 0.2, shape).draw(np.random.default_rng(1), 400_000)  # type: ignore[arg-type]
    assert values.mean() == pytest.approx(3.0, abs=4 * 0.2 / 632)
    assert values.std() == pytest.approx(0.2, rel=0.005)


def test_joint_normal_has_its_covariance() -> None:
    covariance = np.array([[4.0, 1.9], [1.9, 1.0]])
    values = joint_normal([1.0, 2.0], Covariance.full(covariance))(
        np.random.default_rng(2), 400_000
    )
    assert np.cov(values, rowvar=False) == pytest.approx(covariance, rel=0.01)


def test_shortest_interval_of_an_exponential_starts_at_its_edge() -> None:
    """Closed form: the densest 95 % of an exponential are [0, -ln 0.05]."""
    values = np.sort(np.random.default_rng(3).exponential(size=(400_000, 1)), axis=0)
    assert shortest_interval(values)[0] == pytest.approx([0.0, -math.log(0.05)], abs=0.03)


def test_coverage_factor_of_many_degrees_of_freedom(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 1e20 degrees of freedom, more than 64 bits count, it is that of a normal distribution.
    Student's distribution of scipy gets a float: some versions refuse larger whole numbers."""
    import scipy.special

    seen: list[object] = []
    quantile = scipy.special.stdtrit

    def noting(dof: object, probability: float) -> float:
        seen.append(dof)
        return float(quantile(dof, probability))

    monkeypatch.setattr(scipy.special, "stdtrit", noting)
    for dof in (1e16, 1e20, 1e300):
        assert coverage_factor(dof, 0.95) == pytest.approx(1.959963984540054, rel=1e-12)
    assert all(type(dof) is float for dof in seen)
    assert len(seen) == 3
