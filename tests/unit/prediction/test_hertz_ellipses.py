"""Hertz's ellipse: printed factors, closed forms of equal curvatures, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import elliprd

from pretravel.base.errors import PretravelError
from pretravel.prediction.materials import Material
from pretravel.six_seats.hertz import (
    approach_coefficient,
    ball_on_flat,
    curved_part_factor,
    ellipticity,
    rod_on_ball_coefficient,
)

PRINTED = np.array([
    (30.0, 2.731, 0.493), (35.0, 2.397, 0.530), (40.0, 2.136, 0.567), (45.0, 1.926, 0.604),
    (50.0, 1.754, 0.641), (55.0, 1.611, 0.678), (60.0, 1.486, 0.717), (65.0, 1.378, 0.759),
    (70.0, 1.284, 0.802), (75.0, 1.202, 0.846), (80.0, 1.128, 0.893), (85.0, 1.061, 0.944),
    (90.0, 1.000, 1.000),
])  # fmt: skip
"""Auxiliary angle in degrees, factors of the longer and the shorter half-axis: Timoshenko and
Goodier, Theory of Elasticity, the table of contact ellipses."""


def _ratio_of(angle_deg: np.ndarray) -> np.ndarray:
    """Larger over smaller curvature; cos(angle) is their difference over their sum."""
    cosine = np.cos(np.radians(angle_deg))
    return np.asarray((1.0 + cosine) / (1.0 - cosine))


def test_half_axes_solve_the_equations_of_the_ellipse() -> None:
    """The curvature along an axis is the integral of ds / sqrt(s (a² + s)³ (b² + s)): Carlson's
    R_D in place of K and E."""
    ratios = np.array([1.01, 1.7, 3.0, 14.0, 300.0, 1e5, 9.9e5])
    b = ellipticity(ratios)
    along, across = elliprd(0.0, b**2, 1.0), elliprd(0.0, 1.0, b**2)
    assert across / along == pytest.approx(ratios, rel=1e-9)


def test_half_axes_are_those_of_the_printed_table() -> None:
    """Within 0.4 %: by Carlson's integrals, the printed values at 65° and 70° are wrong by 0.26 and
    0.34 %, the others by their last digit."""
    angle, longer, shorter = PRINTED.T
    assert ellipticity(_ratio_of(angle)) == pytest.approx(shorter / longer, rel=0.004)


def test_curvatures_that_are_nearly_equal_have_the_limit_of_the_ellipse() -> None:
    """b/a = ratio^(-2/3) near 1, from both forms of the solution, in one array with an ellipse."""
    ratios = np.array([1.0, 1.0 + 9e-6, 1.0 + 1.1e-5, 1.001, _ratio_of(np.array(60.0)).item()])
    found = ellipticity(ratios)
    assert found[:3] == pytest.approx(ratios[:3] ** (-2.0 / 3.0), abs=1e-9)
    assert found[3] == pytest.approx(1.001 ** (-2.0 / 3.0), abs=1e-6)
    assert found[4] == pytest.approx(0.717 / 1.486, rel=1.2e-3)


def test_the_approach_has_no_step_where_an_ellipse_becomes_a_circle() -> None:
    """The change of radius by 1e-5 changes the approach by a sixth of that."""
    ball = float(approach_coefficient(2.0, 2.0, 3e5))
    assert ball == pytest.approx(float(ball_on_flat(1.0, 2.0, 3e5)), rel=1e-14)
    for part in (1e-5, 1.4e-5, 1.6e-5, 1e-4):
        near = float(approach_coefficient(2.0, 2.0 / (1.0 + part), 3e5))
        assert near / ball - 1.0 == pytest.approx(part / 6.0, abs=1e-9)


@pytest.mark.parametrize(
    ("ratio", "named"), [(0.999, "2"), (1e6, r"1e\+06"), (3e6, r"3e\+06"), (np.nan, "nan")]
)
def test_ratios_that_are_no_ratio_are_refused(ratio: float, named: str) -> None:
    """The largest one is named."""
    with pytest.raises(PretravelError, match=f"ratio {named}: .*between 1 and a million"):
        ellipticity([2.0, ratio])


@pytest.mark.parametrize(("larger", "smaller"), [(1.0, 1.01), (1.0, 0.0), (1.0, -1.0)])
def test_radii_in_the_wrong_order_or_without_size_are_refused(
    larger: float, smaller: float
) -> None:
    with pytest.raises(PretravelError, match="larger one first") as refused:
        approach_coefficient([2.0, larger], [1.5, smaller], 1e5)
    assert f"radii {larger:g} and {smaller:g} mm" in str(refused.value)


def test_a_ball_in_a_bore_and_on_a_shaft() -> None:
    """One curvature is that of the ball: against the coefficient of the two radii."""
    factor = curved_part_factor(3.0, np.array([[-0.05, 0.0], [0.0, 0.05]]))
    ball = approach_coefficient(3.0, 3.0, 7.0)
    bore = approach_coefficient(1.0 / (1.0 / 3.0 - 0.05), 3.0, 7.0)
    shaft = approach_coefficient(3.0, 1.0 / (1.0 / 3.0 + 0.05), 7.0)
    assert factor == pytest.approx([bore / ball, shaft / ball], rel=1e-12)
    assert factor[0] < 1.0 < factor[1]


def test_a_ball_that_does_not_fit_has_no_factor() -> None:
    """And leaves the others theirs. The relative radius of two balls: the approach goes with its
    power -1/3."""
    curvatures = np.array([[0.02, 0.02], [-0.1, -0.1], [-0.5, 0.0], [np.nan, 0.0], [0.0, np.inf]])
    for radius, fits in ((3.0, 2), (2.0, 2), (1.9, 3)):
        factor = curved_part_factor(radius, curvatures)
        assert factor[:2] == pytest.approx(np.cbrt(1.0 + radius * curvatures[:2, 0]), rel=1e-12)
        assert np.isfinite(factor).tolist() == [row < fits for row in range(5)]
        assert np.all(np.isnan(factor[fits:]))


def test_a_hollow_of_nearly_the_ball_s_radius_counts_as_a_long_ellipse() -> None:
    """A contact longer than 1e5 to 1 in curvature has the factor of that ratio."""
    gap = 1e-7
    factor = curved_part_factor(2.0, np.array([[-0.5 + gap, 0.0]]))
    limit = approach_coefficient(2e5, 2.0, 1.0) / approach_coefficient(2.0, 2.0, 1.0)
    assert factor == pytest.approx(limit, rel=1e-9)


def test_a_rod_on_a_ball_has_the_curvatures_of_both() -> None:
    """Along the rod the ball alone is curved; across it the curvatures add up. A rod of endless
    radius is a flat."""
    across = 1.0 / (1.0 / 2.0 + 1.0 / 1.25)
    expected = approach_coefficient(2.0, across, 2.5e5)
    assert rod_on_ball_coefficient(1.25, 2.0, 2.5e5) == pytest.approx(float(expected), rel=1e-12)
    assert rod_on_ball_coefficient(1e9, 2.0, 2.5e5) == pytest.approx(
        float(ball_on_flat(1.0, 2.0, 2.5e5)), rel=1e-8
    )


def test_compliances_of_two_bodies_add_up() -> None:
    """1/E* = 0.91/2e5 + 0.96/6e5 = 6.15e-6 per MPa."""
    steel, other = Material("s", 2e5, 0.3, 7.8e-6), Material("c", 6e5, 0.2, 1e-5)
    assert steel.contact_modulus(other) == pytest.approx(1.0 / 6.15e-6, rel=1e-12)


def test_a_force_of_nothing_presses_nothing() -> None:
    """And the cube of the approach is 9 F² / (16 R E*²)."""
    approach = ball_on_flat([0.0, 2.0], 1.5, 1e5)
    assert approach[0] == 0.0
    assert approach[1] ** 3 == pytest.approx(36.0 / (24.0 * 1e10), rel=1e-12)
