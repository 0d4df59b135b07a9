"""Form of a day by the moments of a quadratic form; what a day's quantities change in a map."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.observation import Scatter
from pretravel.maps.pretravel_map import PretravelMap, over_support
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.day_terms import (
    _MEAN_ROOT,
    DayTerms,
    _form,
    day_quantities,
    day_terms,
    radius_beside,
)
from pretravel.qualification.touch_order import between_predecessors
from pretravel.qualification.verification import _robust_scatter, touches_beside_map, verify
from pretravel.touches import Touches, at_rest
from pretravel.uncertainty.covariance import Covariance

UM = 1e-3
N = sphere_pattern_25()
TERMS = np.array([[0, 0], [2, 0], [3, 3], [3, -3]])
COEFFICIENTS = np.array([10.0, -2.0, 1.5, 0.8]) * UM
TILT = probe_rotation((0.48, 0.6, 0.64), rotation=0.7)


def _map(**changes: object) -> PretravelMap:
    made = PretravelMap(
        HarmonicBasis(TERMS), COEFFICIENTS,
        Covariance.independent(np.array([0.05, 0.1, 0.08, 0.08]) ** 2 * UM**2),
        DirectionSupport(N), tip_radius=3.0, repeatability=0.3 * UM, repeatability_dof=50.0,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


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
    setup = QualificationSetup(25.0, tip_diameter=6.0)
    old = _map(rotation=TILT, feed=0.0, delay=4e-3, u_delay=1e-4)
    given = _two_feeds(old, 6e-3)
    found = day_terms(given, old, setup)
    assert found.delay == pytest.approx(6e-3, abs=4.0 * found.u_delay)
    assert found.feed == 240.0
    still = replace(at_rest(given, found.delay), feeds=None)
    rest = day_terms(still, replace(old, delay=None, u_delay=0.0, feed=None), setup)
    for name in ("level", "scale", "turn", "form", "u_scale", "u_turn", "u_form"):
        assert getattr(found, name) == pytest.approx(getattr(rest, name), rel=1e-6, abs=1e-9)
    assert 0.0 < found.u_delay < 1e-4
    assert found.u_level == pytest.approx(math.hypot(rest.u_level, 2.5 * found.u_delay), rel=1e-6)
    assert (found.touches, found.directions) == (50, 25)
    # A map without a delay does not take one from the touches.
    none = day_terms(given, replace(old, delay=None, u_delay=0.0, feed=None), setup)
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
    made = _map(feed=0.0, delay=3e-3)
    days = [
        _terms(level=2.0 * UM, u_level=0.2 * UM, scale=0.03, u_scale=0.004, turn=0.01, u_turn=0.002,
               delay=5e-3, u_delay=1e-4, feed=90.0),
        _terms(level=-1.0 * UM, u_level=0.1 * UM, delay=2e-3, u_delay=2e-4, feed=240.0),
        _terms(),
    ]  # fmt: skip
    found = day_quantities(days, made)
    assert [one.name for one in found] == ["level", "scale", "turn", "signal delay"]
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
    spread = HarmonicBasis(TERMS).design(over_support(made)[0]) @ COEFFICIENTS
    spread = np.abs(spread - spread.mean())
    assert scale.share == pytest.approx(0.01 * spread.max(), rel=1e-6)
    assert turn.share == pytest.approx(DEGREE * np.abs(slope).max(), rel=0.02)
    assert (level.share, delay.share) == (UM, pytest.approx(4e-3))
    (form,) = day_quantities([_terms(form=-0.4 * UM, u_form=0.1 * UM)], _map())
    assert (form.name, form.unit, form.share) == ("form", "µm", UM)
    assert (form.values[0], form.u[0]) == pytest.approx((-0.4, 0.1))
    (unfed,) = day_quantities([_terms(delay=1e-3, u_delay=1e-5)], _map())
    assert (unfed.values[0], unfed.share) == (pytest.approx(1.0), 0.0)


def test_the_radius_beside_a_map_is_that_of_a_sphere_through_it() -> None:
    """With a map that grows along the axis: least squares of level and shift over its nodes."""
    terms = np.array([[0, 0], [1, 0], [2, 0], [3, 3]])
    made = _map(basis=HarmonicBasis(terms), tip_radius=2.5)
    value = HarmonicBasis(terms).design(N) @ COEFFICIENTS
    level = np.linalg.lstsq(np.column_stack([N, np.ones(25)]), value)[0][3]
    assert abs(level - value.mean()) > 0.3 * UM
    assert radius_beside(made) == pytest.approx(2.5 - level, abs=1e-12)


# Single wrong touches, and what an order shows


@pytest.mark.parametrize("known", [0.1, 5.0])
def test_scatter_of_a_touch_is_that_of_the_median_direction(known: float) -> None:
    """Sums of squares about the means of the directions, by hand: 0.5, 2, 8, 50 and 5; of 1, 2, 2,
    1 and 3 degrees of freedom. At least that of the map."""
    values = [9.0, 1.0, 2.0, 1.0, 2.0, 3.0, -2.0, 0.0, 2.0, 5.0, 15.0, 0.0, 1.0, 2.0, 3.0]
    groups = np.repeat([0, 1, 2, 3, 4, 5], [1, 2, 3, 3, 2, 4])
    compared: Any = SimpleNamespace(scatter_of_map=Scatter(known, 20.0))
    medians = sorted(stats.chi2.median(dof) for dof in (1, 2, 2, 1, 3))
    expected = max(math.sqrt(5.0 / medians[2]), known)
    found = _robust_scatter(np.array(values), groups, compared)
    assert found == pytest.approx(expected, rel=1e-9)
    assert _robust_scatter(np.arange(4.0), np.arange(4), compared) == known


def test_of_nine_touches_one_may_be_left_out() -> None:
    """A tenth of them is less than one."""
    n = fibonacci_cap(9, 1.5)
    made = _map()
    noise = 0.3 * UM * np.random.default_rng(1).standard_normal(9)
    distance = 15.5 - made.basis.value(n, made.coefficients) + noise
    distance[4] += 0.1
    given = Touches(n * distance[:, None], n)
    beside = touches_beside_map(given, made, 25.0)
    assert [one.rows for one in beside.gross] == [(4,)]
    assert len(beside.kept.differences) == 8
    assert len(beside.all.differences) == 9


def test_a_ring_is_verified_in_its_plane() -> None:
    """A map that is larger by 3 µm in all directions: on a ring on a tilted probe, wherever it is
    touched along its axis."""
    made = _map(
        rotation=TILT, repeatability=0.2 * UM, covariance=Covariance.independent([1e-12] * 4)
    )
    azimuth = np.repeat(np.arange(24) * (2.0 * np.pi / 24), 2)
    n = np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])
    noise = 0.2 * UM * np.random.default_rng(4).standard_normal(48)
    distance = 9.5 + made.basis.value(n, made.coefficients) + 3.0 * UM + noise
    place = -n * distance[:, None] + np.linspace(0.0, 2.0, 48)[:, None] * [0.0, 0.0, 1.0]
    given = Touches(place @ TILT.T + [1.0, 2.0, 3.0], n @ TILT.T)
    found = verify(given, made, 25.0, ring=True)
    assert found.changed
    assert found.size.value == pytest.approx(3.0 * UM, abs=4.0 * 0.2 * UM / math.sqrt(48.0))
    assert found.directions == pytest.approx(n[::2], abs=1e-3)
    same = verify(replace(given, positions=given.positions + 3.0 * UM * given.normals), made, 25.0,
                  ring=True)  # fmt: skip
    assert not same.changed


@pytest.mark.parametrize(("last", "known"), [([0, 2], False), ([0, 2, 3, 1, 2], True)])
def test_three_other_predecessors_tell_of_hysteresis(last: list[int], known: bool) -> None:
    """Passes in one order, and at the end a few touches after others: two and three contrasts."""
    groups = [*[0, 1, 2, 3] * (3 if not known else 2), *last]
    pairs = set(zip(groups, [-1, *groups[:-1]], strict=True))
    count = len(groups)
    values = np.random.default_rng(1).normal(size=count)
    found = between_predecessors(values, groups, np.arange(count))
    assert found.dof_between == len(pairs) - 4 == (3 if known else 2)
    assert found.dof_within == count - len(pairs)
    assert np.isfinite(found.variance) == known
    assert ("after the same direction every time" in found.warning) != known
