"""JCGM 100 (GUM) and JCGM 101: published examples, closed forms, and GTC as an oracle.

H.1 end gauge, H.2 resistance and reactance from correlated readings, JCGM 101 9.4 power of
two components (nonlinear).
"""

from __future__ import annotations

import math

import GTC
import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.gum import Budget, Component
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
