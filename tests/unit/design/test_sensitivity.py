"""Shares of factors in a variance, against closed forms and scipy's estimators."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import sobol_indices

from pretravel.design.studies.outputs import OutputMeaning
from pretravel.design.studies.results import StudyResults
from pretravel.design.studies.sensitivity import (
    Sensitivity,
    sensitivities,
    sensitivity,
    sobol_shares,
)


def results(
    plan: str, factors: dict[str, np.ndarray], values: np.ndarray, samples: int = 0
) -> StudyResults:
    return StudyResults(
        "", "", plan, samples, factors, {"y": values}, {"y": OutputMeaning("um", "")},
        ("",) * len(values),
    )  # fmt: skip


def found(
    plan: str, factors: dict[str, np.ndarray], values: np.ndarray, samples: int = 0
) -> Sensitivity:
    shares = sensitivity(results(plan, factors, values, samples), "y")
    assert shares is not None
    return shares


def test_sobol_shares_are_those_of_scipy() -> None:
    """Estimators of Saltelli 2010, on the Ishigami function."""
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (2, 3, 256))
    mixed = [np.where(np.arange(3)[:, None] == k, x[1], x[0]) for k in range(3)]

    def ishigami(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(x[0]) + 7.0 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0]))

    values = np.array([ishigami(part) for part in (x[0], x[1], *mixed)])
    theirs = sobol_indices(
        func={"f_A": values[:1], "f_B": values[1:2], "f_AB": values[2:, None]}, n=256
    )
    np.testing.assert_allclose(sobol_shares(values)[0], theirs.first_order.ravel(), atol=1e-12)
    np.testing.assert_allclose(sobol_shares(values)[1], theirs.total_order.ravel(), atol=1e-12)


def _sobol_of(n: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """y = a + 2 b + 3 a b of uniform a, b about zero: shares from the variances of the terms."""
    generator = np.random.default_rng(2)
    a, b = generator.uniform(-1.0, 1.0, (2, 2, n))
    # A and B, then A with the first factor from B, A with the second from B.
    first = np.concatenate([a[0], a[1], a[1], a[0]])
    second = np.concatenate([b[0], b[1], b[0], b[1]])
    return {"a": first, "b": second}, first + 2.0 * second + 3.0 * first * second


def test_sobol_indices_of_a_closed_form() -> None:
    """Variances: a 1/3, b 4/3, ab 9/9; the sum is 8/3."""
    factors, values = _sobol_of(4096)
    shares = found("sobol", factors, values, 4096)
    np.testing.assert_allclose(shares.first, [1 / 8, 4 / 8], atol=0.06)  # 3 standard errors
    np.testing.assert_allclose(shares.total, [4 / 8, 7 / 8], atol=0.06)
    for share, interval in ((1 / 8, shares.first_interval[0]), (7 / 8, shares.total_interval[1])):
        assert interval[0] < share < interval[1]
        assert np.ptp(interval) < 0.12


def test_a_sample_with_a_failed_design_is_left_out_whole() -> None:
    factors, values = _sobol_of(64)
    values[64 + 3] = np.nan
    shares = found("sobol", factors, values, 64)
    keep = np.arange(64) != 3
    np.testing.assert_allclose(
        [shares.first, shares.total], sobol_shares(values.reshape(4, 64)[:, keep])
    )
    assert shares.samples == 63


def test_main_effects_of_a_full_plan_are_exact() -> None:
    """y = 3 i + 4 j + i j with i, j in (-1, 0, 1): variances 6, 32/3 and 4/9."""
    rows = np.array(list(product((-1.0, 0.0, 1.0), repeat=2)))
    values = 3.0 * rows[:, 0] + 4.0 * rows[:, 1] + rows[:, 0] * rows[:, 1]
    shares = found("full-factorial", {"i": rows[:, 0], "j": rows[:, 1]}, values)
    whole = 6.0 + 32.0 / 3.0 + 4.0 / 9.0
    np.testing.assert_allclose(shares.first, [6.0 / whole, 32.0 / 3.0 / whole])
    assert np.isnan(shares.total).all()


def test_shares_of_a_hypercube_with_a_text() -> None:
    """y = x² + (1 for steel): variances 4/45 and 1/4."""
    generator = np.random.default_rng(3)
    x = generator.uniform(-1.0, 1.0, 2000)
    material = np.array(["steel", "ceramic"], dtype=object)[generator.integers(0, 2, 2000)]
    shares = found("latin-hypercube", {"x": x, "material": material}, x**2 + (material == "steel"))
    exact = np.array([4 / 45, 1 / 4]) / (4 / 45 + 1 / 4)
    np.testing.assert_allclose(shares.first, exact, atol=0.03)  # chance of 2000 samples
    assert (shares.first_interval[:, 0] < exact).all()
    assert (shares.first_interval[:, 1] > exact).all()


@pytest.mark.long
def test_outputs_of_a_hypercube_are_resampled_together() -> None:
    """Each as if it were alone; y = a has the shares 1 and 0, y = a + 2 b has 1/5 and 4/5."""
    a, b = np.random.default_rng(4).uniform(-1.0, 1.0, (2, 2000))
    failed = a + 2.0 * b
    failed[::7] = np.nan
    numbers = {"only a": a, "constant": np.ones(2000), "failed": failed, "both": a + 2.0 * b}
    factors = {"a": a, "b": b}
    made = replace(results("latin-hypercube", factors, a), numbers=numbers)
    shares = sensitivities(made)
    assert [one.output for one in shares] == ["only a", "failed", "both"]
    np.testing.assert_allclose(shares[0].first, [1.0, 0.0], atol=1e-12)
    for one in shares[1:]:  # chance of 2000 samples
        np.testing.assert_allclose(one.first, [1 / 5, 4 / 5], atol=0.05)
    for one in shares:
        alone = sensitivity(made, one.output)
        assert alone is not None
        assert one.samples == alone.samples
        np.testing.assert_allclose(one.first_interval, alone.first_interval, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("plan", ["one-at-a-time", "sobol", "latin-hypercube"])
def test_nothing_is_said_of_too_few_designs(plan: str) -> None:
    x = np.linspace(0.0, 1.0, 8)
    assert sensitivity(results(plan, {"x": x, "z": x}, x, 2), "y") is None


def test_nothing_is_said_of_an_output_that_does_not_vary() -> None:
    x = np.linspace(0.0, 1.0, 8)
    assert sensitivity(results("full-factorial", {"x": x}, np.full(8, 0.1)), "y") is None
