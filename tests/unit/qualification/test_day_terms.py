"""What one day's touches say beside a map, and what a day's quantities change in it."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.terms_of_days import (
    _MEAN_ROOT,
    DayTerms,
    _fitted,
    _form,
    day_quantities,
    day_terms,
    radius_beside,
)
from pretravel.qualification.verification import touches_beside_map
from pretravel.touches import Touches
from tests.support.lobed_map import COEFFICIENTS, SETUP, TERMS, UM, N, lobed_map, lobed_touches
from tests.unit.qualification.test_verification import old_map, touches

TILT = probe_rotation((0.48, 0.6, 0.64), rotation=0.7)


def terms(new: Touches, setup: QualificationSetup = SETUP) -> DayTerms:
    return day_terms(new, old_map(), setup)


def test_what_a_map_leaves_of_single_directions_is_common_to_all_days() -> None:
    """The fixed scatter of a map is the same every day on the same directions."""
    new = touches(7)
    rough = day_terms(new, replace(old_map(), fixed_scatter=0.001), SETUP)
    smooth = day_terms(new, replace(old_map(), fixed_scatter=0.0), SETUP)
    for name in ("u_level", "u_scale", "u_turn"):
        assert getattr(rough, name) == pytest.approx(getattr(smooth, name), rel=1e-9)


def test_another_calibrated_diameter_moves_the_level_of_all_days_alike() -> None:
    """Two days differ by the same, and are as uncertain, whatever the diameter is."""
    other = replace(SETUP, diameter=25.001)
    days = [touches(8), touches(9, size=0.001)]
    first = [terms(day) for day in days]
    second = [terms(day, other) for day in days]
    assert second[0].level - first[0].level == pytest.approx(0.0005, abs=1e-6)
    assert second[1].level - second[0].level == pytest.approx(
        first[1].level - first[0].level, abs=1e-6
    )
    assert second[0].u_level == pytest.approx(first[0].u_level, rel=1e-3)


def test_terms_of_a_day_are_least_squares_with_equal_weights() -> None:
    """Their covariance is that of unweighted least squares of the touches' means (the sandwich)."""
    given = lobed_touches(2)
    beside = touches_beside_map(given, lobed_map(), 25.0).kept
    change, covariance, rest = _fitted(beside)
    found, *_ = np.linalg.lstsq(beside.design, beside.differences)
    assert change == pytest.approx(found[3:], rel=1e-9)
    of_touches = np.diag(beside.covariance - beside.of_map)
    gain = np.linalg.inv(beside.design.T @ beside.design) @ beside.design.T
    sandwich = gain @ np.diag(of_touches) @ gain.T
    assert covariance == pytest.approx(sandwich[3:, 3:], rel=1e-7)
    left = beside.differences - beside.design @ found
    assert rest @ beside.differences == pytest.approx(left, abs=1e-12)
    terms = day_terms(given, lobed_map(), SETUP)
    assert [terms.level, terms.scale, terms.turn] == pytest.approx(change)
    assert [terms.u_level, terms.u_scale, terms.u_turn] == pytest.approx(
        np.sqrt(np.diag(sandwich)[3:])
    )
    assert (terms.form, terms.u_form) == _form(beside, rest)
    assert (terms.touches, terms.directions) == (75, 25)
    assert terms.gross == ()
    assert np.isnan([terms.delay, terms.u_delay, terms.feed]).all()
    feeds = np.where(np.arange(75) % 2, 50.0, 80.0)
    own = day_terms(replace(given, feeds=feeds), lobed_map(), SETUP, own=True)
    assert own.feed == 80.0
    assert np.isnan([own.form, own.u_form]).all()
    flat = lobed_map(coefficients=np.array([10.0 * UM, 0.0, 0.0, 0.0]))
    only, u_only, _ = _fitted(touches_beside_map(given, flat, 25.0).kept)
    assert np.isfinite(only).tolist() == [True, False, False]
    assert np.isfinite(u_only).tolist() == [[True, False, False], [False] * 3, [False] * 3]


def _compared(size: float) -> tuple[Any, np.ndarray, np.ndarray]:
    """Twelve differences of a pattern and noise, a projection, and the covariance of the touches'
    part of what it leaves."""
    rng = np.random.default_rng(5)
    columns = np.linalg.qr(rng.normal(size=(12, 4)))[0]
    rest = np.eye(12) - columns @ columns.T
    of_means = rng.uniform(0.02, 0.2, 12) * UM**2
    of_touches = np.diag(of_means)
    root = 0.1 * UM * rng.normal(size=(12, 12))
    differences = size * UM * rng.normal(size=12)
    of_map = root @ root.T
    covariance = of_touches + of_map
    noise = SimpleNamespace(of_means=of_means)
    seen = SimpleNamespace(differences=differences, covariance=covariance, noise=noise)
    return seen, rest, rest @ of_touches @ rest.T


@pytest.mark.parametrize("size", [0.0, 0.3, 0.45, 0.7, 3.0])
def test_form_has_the_moments_of_a_quadratic_form(size: float) -> None:
    """yᵀy of normal y with the mean m and the covariance N has the variance 2 tr N² + 4 mᵀN m, and
    yᵀN y the mean mᵀN m + tr N². Its root has half of the deviation over itself far from zero, and
    at zero that of a signed root: 0.8 of the deviation is the mean size of a normal quantity."""
    seen, rest, noise = _compared(size)
    form, u = _form(seen, rest)
    left = rest @ seen.differences
    beyond = (left @ left - np.trace(rest @ seen.covariance @ rest)) / 12.0
    assert form * abs(form) == pytest.approx(beyond, rel=1e-9)
    squares = float(np.sum(np.linalg.eigvalsh(noise) ** 2))
    crossed = max(float(left @ noise @ left) - squares, 0.0)
    deviation = math.sqrt(2.0 * squares + 4.0 * crossed) / 12.0
    over = max(abs(beyond) - 2.0 * deviation, 0.0)
    expected = deviation / math.sqrt(4.0 * over + 1.25 * deviation)
    assert u == pytest.approx(expected, rel=1e-9)
    if size == 3.0:
        assert u == pytest.approx(0.5 * deviation / form, rel=0.1)
    assert pytest.approx(1.0 / math.sqrt(2.0 / math.pi), rel=0.01) == _MEAN_ROOT


def test_a_form_that_nothing_is_left_of_is_not_known() -> None:
    seen, _, _ = _compared(1.0)
    assert np.isnan(_form(seen, np.zeros((12, 12)))).all()


def _two_feeds(old: PretravelMap, delay: float) -> Touches:
    """All directions at 60 and at 240 mm/min."""
    noise = 0.3 * UM * np.random.default_rng(3).standard_normal(50)
    distance = 15.5 - old.basis.value(N, old.coefficients)
    feeds = np.repeat([60.0, 240.0], 25)
    travel = np.tile(distance, 2) + noise - feeds / 60.0 * delay
    n = np.tile(N, (2, 1))
    return Touches((n * travel[:, None]) @ TILT.T + [5.0, 6.0, 7.0], n @ TILT.T, feeds=feeds)


def test_a_day_with_its_own_delay_is_that_of_the_touches_at_rest() -> None:
    """Terms are those of the touches at rest beside the map without a delay; u of the level has
    the travel of u of the delay at the mean feed, 150 mm/min, beside."""
    old = lobed_map(rotation=TILT, feed=0.0, delay=4e-3, u_delay=1e-4)
    given = _two_feeds(old, 6e-3)
    found = day_terms(given, old, SETUP)
    assert found.delay == pytest.approx(6e-3, abs=4.0 * found.u_delay)
    assert found.feed == 240.0
    still = replace(given.at_rest(found.delay), feeds=None)
    rest = day_terms(still, replace(old, delay=None, u_delay=0.0, feed=None), SETUP)
    for name in ("level", "scale", "turn", "form", "u_scale", "u_turn", "u_form"):
        assert getattr(found, name) == pytest.approx(getattr(rest, name), rel=1e-6, abs=1e-9)
    assert 0.0 < found.u_delay < 1e-4
    assert found.u_level == pytest.approx(math.hypot(rest.u_level, 2.5 * found.u_delay), rel=1e-6)
    assert (found.touches, found.directions) == (50, 25)
    # A map without a delay does not take one from the touches.
    none = day_terms(given, replace(old, delay=None, u_delay=0.0, feed=None), SETUP)
    assert np.isnan([none.delay, none.u_delay]).all()


def _terms(**values: float) -> DayTerms:
    unknown = dict.fromkeys(
        ("level", "u_level", "scale", "u_scale", "turn", "u_turn", "form", "u_form", "delay",
         "u_delay", "feed"), math.nan,
    )  # fmt: skip
    return DayTerms(touches=75, directions=25, **(unknown | values))


def test_quantities_of_days_in_their_units_and_what_they_change() -> None:
    """µm, %, degrees and ms; a scale changes the map by its largest deviation from the mean, a
    turn by its steepest slope around the axis, a delay by its travel at the fastest feed."""
    made = lobed_map(feed=0.0, delay=3e-3)
    days = [
        _terms(level=2.0 * UM, u_level=0.2 * UM, scale=0.03, u_scale=0.004, turn=0.01, u_turn=0.002,
               delay=5e-3, u_delay=1e-4, feed=90.0),
        _terms(level=-1.0 * UM, u_level=0.1 * UM, delay=2e-3, u_delay=2e-4, feed=240.0),
        _terms(),
    ]  # fmt: skip
    found = day_quantities(days, made)
    assert [one.name for one in found] == ["size", "amplitude", "turn", "signal delay"]
    assert [one.unit for one in found] == ["µm", "%", "°", "ms"]
    level, scale, turn, delay = found
    assert level.values == pytest.approx([2.0, -1.0, math.nan], nan_ok=True)
    assert level.u == pytest.approx([0.2, 0.1, math.nan], nan_ok=True)
    assert scale.values == pytest.approx([3.0, math.nan, math.nan], nan_ok=True)
    assert scale.u[0] == pytest.approx(0.4)
    assert turn.values[0] == pytest.approx(math.degrees(0.01))
    assert turn.u[0] == pytest.approx(math.degrees(0.002))
    assert delay.values == pytest.approx([2.0, -1.0, math.nan], nan_ok=True)
    assert delay.u == pytest.approx([0.1, 0.2, math.nan], nan_ok=True)
    dense = fibonacci_cap(4000, 0.5 * math.pi)
    value = HarmonicBasis(TERMS).design(dense) @ COEFFICIENTS
    c, s = math.cos(1e-4), math.sin(1e-4)
    turned = dense @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    slope = (HarmonicBasis(TERMS).design(turned) @ COEFFICIENTS - value) / 1e-4
    spread = HarmonicBasis(TERMS).design(made.over_support()[0]) @ COEFFICIENTS
    spread = np.abs(spread - spread.mean())
    assert scale.share == pytest.approx(0.01 * spread.max(), rel=1e-6)
    assert turn.share == pytest.approx(DEGREE * np.abs(slope).max(), rel=0.02)
    assert (level.share, delay.share) == (UM, pytest.approx(4e-3))
    (form,) = day_quantities([_terms(form=-0.4 * UM, u_form=0.1 * UM)], lobed_map())
    assert (form.name, form.unit, form.share) == ("form", "µm", UM)
    assert (form.values[0], form.u[0]) == pytest.approx((-0.4, 0.1))
    (unfed,) = day_quantities([_terms(delay=1e-3, u_delay=1e-5)], lobed_map())
    assert (unfed.values[0], unfed.share) == (pytest.approx(1.0), 0.0)


def test_the_radius_beside_a_map_is_that_of_a_sphere_through_it() -> None:
    """With a map that grows along the axis: least squares of level and shift over its nodes."""
    terms = np.array([[0, 0], [1, 0], [2, 0], [3, 3]])
    made = lobed_map(basis=HarmonicBasis(terms), tip_radius=2.5)
    value = HarmonicBasis(terms).design(N) @ COEFFICIENTS
    level = np.linalg.lstsq(np.column_stack([N, np.ones(25)]), value)[0][3]
    assert abs(level - value.mean()) > 0.3 * UM
    assert radius_beside(made) == pytest.approx(2.5 - level, abs=1e-12)
