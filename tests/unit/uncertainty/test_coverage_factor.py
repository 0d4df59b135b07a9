"""k by the sum of Student's distribution against SciPy."""

from __future__ import annotations

import math

import pytest
from scipy.special import stdtrit

from pretravel.uncertainty.gum import coverage_factor


@pytest.mark.parametrize("probability", [0.01, 0.6827, 0.9545, 0.9973])
def test_whole_degrees_of_freedom(probability: float) -> None:
    """SciPy's inverse is good to 1e-13 here."""
    for dof in (1, 2, 3, 4, 5, 17, 50, 299, 300, 5000):
        wanted = float(stdtrit(float(dof), 0.5 + 0.5 * probability))
        assert coverage_factor(dof, probability) == pytest.approx(wanted, rel=1e-12), dof


def test_degrees_of_freedom_are_rounded_down_or_kept() -> None:
    assert coverage_factor(16.7, 0.99) == coverage_factor(16.0, 0.99)
    wanted = float(stdtrit(16.7, 0.995))
    assert math.isclose(coverage_factor(16.7, 0.99, whole_dof=False), wanted, rel_tol=1e-14)
