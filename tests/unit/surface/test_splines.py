"""Spline surfaces against scipy's basis functions, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import COORDINATE
from pretravel.surface.spline import SplineSurface

KNOTS = {
    1: np.array([2.0, 2.0, 3.0, 5.0, 5.0]),
    2: np.array([-1.0, -1.0, -1.0, 0.5, 1.0, 1.0, 1.0]),
    3: np.array([0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 4.0]),
}
"""By degree; different domains and numbers of poles."""


def _surface(degrees: tuple[int, int], weight: float | None) -> SplineSurface:
    rng = np.random.default_rng(3)
    counts = [len(KNOTS[degree]) - degree - 1 for degree in degrees]
    weights = rng.uniform(0.5, 2.0, counts) if weight is None else np.full(counts, weight)
    poles = rng.uniform(-5.0, 5.0, (*counts, 3))
    return SplineSurface(KNOTS[degrees[0]], KNOTS[degrees[1]], poles, weights, degrees)


def _basis(degree: int, t: np.ndarray, order: int) -> np.ndarray:
    """Derivatives of the basis functions, (n, poles)."""
    knots = KNOTS[degree]
    return np.asarray(BSpline(knots, np.eye(len(knots) - degree - 1), degree)(t, nu=order))


@pytest.mark.parametrize("degrees", [(1, 3), (3, 1), (2, 1), (1, 2), (2, 3), (1, 1)])
@pytest.mark.parametrize("weight", [None, 1.0, 4.0])
def test_a_spline_and_its_derivatives_are_sums_of_basis_functions(
    degrees: tuple[int, int], weight: float | None
) -> None:
    """Of homogeneous coordinates: with A = S w, each derivative of A is the sum by Leibniz's rule
    of products of derivatives of S and w. Outside the domain the surface is that of its edge."""
    surface = _surface(degrees, weight)
    low, high = np.array([[KNOTS[d][0], KNOTS[d][-1]] for d in degrees]).T
    assert surface.domain.lower == tuple(low)
    assert surface.domain.upper == tuple(high)
    assert surface.domain.period == (math.inf, math.inf)
    uv = low + np.random.default_rng(4).uniform(0.02, 0.98, (12, 2)) * (high - low)
    s, su, sv, suu, suv, svv = surface.second_order(uv)
    first = surface.first_order(uv)
    assert all(np.array_equal(a, b) for a, b in zip(first, (s, su, sv), strict=True))

    def homogeneous(i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
        share = np.einsum(
            "ni,nj->nij", _basis(degrees[0], uv[:, 0], i), _basis(degrees[1], uv[:, 1], j)
        )
        share = share * surface.weights
        return np.einsum("nij,ijk->nk", share, surface.poles), share.sum(axis=(1, 2))[:, None]

    (a, w), (au, wu), (av, wv) = homogeneous(0, 0), homogeneous(1, 0), homogeneous(0, 1)
    (auu, wuu), (auv, wuv), (avv, wvv) = homogeneous(2, 0), homogeneous(1, 1), homogeneous(0, 2)
    # Values up to 5 mm, knots 0.5 apart at the least, weights in the ratio of 4: below 1e4.
    for sums, expected in (
        (s * w, a),
        (su * w + s * wu, au),
        (sv * w + s * wv, av),
        (suu * w + 2.0 * su * wu + s * wuu, auu),
        (suv * w + su * wv + sv * wu + s * wuv, auv),
        (svv * w + 2.0 * sv * wv + s * wvv, avv),
    ):
        assert sums == pytest.approx(expected, abs=1e-10)
    beyond = surface.second_order(np.array([high + 1.0, low - 1.0]))
    ends = surface.second_order(np.array([high, low]))
    assert all(np.array_equal(a, b) for a, b in zip(beyond, ends, strict=True))
    assert np.array_equal(
        surface.first_order(np.array([high + 1.0]))[0], surface.first_order(np.array([high]))[0]
    )
    assert surface.first_order(np.array([high]))[0][0] == pytest.approx(surface.poles[-1, -1])


@pytest.mark.parametrize("weight", [0.0, -1.0, math.nan, math.inf])
def test_one_weight_that_is_not_positive_and_finite_is_refused(weight: float) -> None:
    good = _surface((2, 1), None)
    weights = good.weights.copy()
    weights[1, 2] = weight
    with pytest.raises(PretravelError, match="weights of a rational surface must be positive"):
        SplineSurface(good.u_knots, good.v_knots, good.poles, weights, good.degrees)


def test_a_pole_beyond_the_size_of_parts_is_refused() -> None:
    good = _surface((2, 1), None)
    for largest, refused in ((0.99 * COORDINATE.highest, False), (1.01 * COORDINATE.highest, True)):
        poles = good.poles.copy()
        poles[0, 1, 2] = largest
        if refused:
            with pytest.raises(PretravelError, match="a pole of a spline surface"):
                SplineSurface(good.u_knots, good.v_knots, poles, good.weights, good.degrees)
        else:
            made = SplineSurface(good.u_knots, good.v_knots, poles, good.weights, good.degrees)
            poles[:] = 0.0
            assert made.poles[0, 1, 2] == largest
            with pytest.raises(ValueError, match="read-only"):
                made.poles[0, 0, 0] = 1.0
