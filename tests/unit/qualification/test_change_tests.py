"""The spread of the statistic that compares all directions with a map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.maps.observation import Observation, Scatter
from pretravel.qualification.change_tests import TouchesAndMap, _p_value, _spread_of_statistic
from pretravel.qualification.touch_noise import TouchNoise
from pretravel.qualification.verification import _robust_scatter

NOISE = 3e-4  # mm
AXES = np.vstack([np.eye(3), -np.eye(3)])


def _compared(spread: float, repeats: Scatter, of_map: Scatter) -> TouchesAndMap:
    """One touch each along the six half axes, of a certain map."""
    same = np.full(6, NOISE**2)
    noise = TouchNoise(repeats, NOISE, same, same, np.full(6, spread), np.ones(6), 0.0)
    zeros, covariance = np.zeros(6), np.diag(same)
    columns = np.column_stack([AXES, np.ones(6), zeros, zeros])
    observation = Observation(15.5 * AXES, np.arange(6), np.zeros(3), 12.5, 3.0, False)
    return TouchesAndMap(
        observation, noise, repeats, 0.0, zeros, zeros, columns, np.zeros((6, 6)), covariance,
        of_map, math.nan, math.nan, math.nan,
    )  # fmt: skip


@pytest.mark.parametrize("spread", [0.0, 0.2, 1.0])
def test_uncertain_variances_widen_the_statistic(spread: float) -> None:
    """A quadratic form y'Wy of independent values with the variances v and the excess kurtoses k
    has the variance 2 tr(WVWV) + sum(k (w v)²). On six half axes the centre takes half of each
    value, so that w v is 1/2 and the form has three degrees of freedom: with k = 3 c the relative
    variance is 2/3 + 6 (3 c) / 4 / 9 = 2/3 + c/2."""
    found, dof = _spread_of_statistic(
        _compared(spread, Scatter(NOISE, 12.0), Scatter(NOISE, math.inf)), 3.0
    )
    assert found == pytest.approx(2.0 / 3.0 + 0.5 * spread, rel=1e-12)
    # All of the variance is that of the repeats, and so are its degrees of freedom.
    assert dof == pytest.approx(12.0, rel=1e-12)


def test_without_repeats_the_scale_is_as_well_known_as_that_of_the_map() -> None:
    compared = _compared(0.0, Scatter(NOISE, 0.0), Scatter(NOISE, 40.0))
    assert _spread_of_statistic(compared, 3.0)[1] == pytest.approx(40.0, rel=1e-12)


def test_probabilities_of_a_mean_square() -> None:
    """Tables of chi-square and F: 5 % of 3 degrees lie above 7.815, of 3 and 10 above 3.708."""
    assert _p_value(7.815 / 3.0, 3.0, math.inf) == pytest.approx(0.05, rel=1e-3)
    assert _p_value(3.708, 3.0, 10.0) == pytest.approx(0.05, rel=1e-3)


def test_scatter_beside_a_map_is_the_median_of_its_directions() -> None:
    """Variances 2, 8 and 18 of pairs: the median over that of chi-square with one degree, 0.4549;
    at least that of the map, which alone counts where nothing is repeated."""
    groups = np.array([0, 0, 1, 1, 2, 2, 3])
    among = 1e-3 * np.array([-0.2, 1.8, 1.0, -3.0, 3.0, -3.0, 0.7])
    compared = _compared(0.0, Scatter(NOISE, 12.0), Scatter(NOISE, math.inf))
    assert _robust_scatter(among, groups, compared) == pytest.approx(
        1e-3 * math.sqrt(8.0 / 0.454936), rel=1e-5
    )
    quiet = _compared(0.0, Scatter(NOISE, 12.0), Scatter(0.05, math.inf))
    assert _robust_scatter(among, groups, quiet) == 0.05
    assert _robust_scatter(among[:3], np.arange(3), compared) == NOISE
