"""The choice of few touches: closed forms and what the update then gives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.probe_drift import ProbeDrift, drifted_map
from pretravel.qualification.touch_plan import (
    _exchanged,
    _greedy,
    _in_one_plane,
    _Problem,
    plan_touches,
)
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map
from tests.support.reference_touches import sphere_touches

NO_DRIFT = ProbeDrift(0.0, 0.0, 0.0, 0.0, change=0.0)
PEAK = from_angles(70.0 * DEGREE, 40.0 * DEGREE)[0]


@dataclass(frozen=True, eq=False)
class BumpBasis(MapBasis):
    """One Gaussian bump of 10° around a direction."""

    kind: ClassVar[str] = "bump"

    @property
    def size(self) -> int:
        return 1

    @property
    def constant(self) -> None:
        return None

    def design(self, directions: FloatArray) -> FloatArray:
        angle = np.arccos(np.clip(directions @ PEAK, -1.0, 1.0))
        return np.asarray(np.exp(-0.5 * (angle / (10.0 * DEGREE)) ** 2)[:, None])

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self | None:
        return None


def _bump() -> PretravelMap:
    return PretravelMap(
        BumpBasis(), np.array([5e-3]), Covariance.independent([1e-6]),
        DirectionSupport(sphere_pattern_25()), tip_radius=3.0, repeatability=0.3e-3,
    )  # fmt: skip


def test_the_largest_variance_is_touched() -> None:
    """With one unknown beside the centre, one touch is on the bump, where the map is unknown;
    candidates are 7° apart. The others find the centre: they lie where the bump is not."""
    plan = plan_touches(_bump(), 5, drift=NO_DRIFT)
    away = np.degrees(np.arccos(np.clip(plan.directions @ PEAK, -1.0, 1.0)))
    assert away.min() < 6.0
    assert np.sum(away > 20.0) >= 3


def test_the_plan_promises_what_the_update_keeps() -> None:
    """Variances do not depend on the readings: u of the plan is that of the updated map."""
    for kind in ("harmonic", "physical"):
        old = example_map(kind)
        still = ProbeDrift(change=0.0)  # a plan does not expect larger changes than the drift
        plan = plan_touches(old, 7, drift=still)
        touches = sphere_touches(old.pretravel(plan.normals), plan.normals)
        new = update_map(touches, old, 25.0, drift=still).pretravel_map
        u = np.sqrt(plan.prior.variance(plan.places, new.covariance.matrix))
        # The normals of touches and plan differ by 1e-4 rad; tiny u at the pole are rounding.
        np.testing.assert_allclose(u, plan.u_after, rtol=2e-3, atol=1e-7)
        assert np.all(plan.u_after <= plan.u_before + 1e-9)


def test_chosen_touches_are_better_than_an_even_pattern() -> None:
    old = example_map("harmonic")
    plan = plan_touches(old, 9)
    normals = fibonacci_cap(9)
    even = update_map(sphere_touches(old.pretravel(normals), normals), old, 25.0).pretravel_map
    u_even = even.standard_uncertainty(plan.places)
    assert np.mean(plan.u_after**2) < np.mean(u_even**2)
    six = plan_touches(old, 6)
    assert np.mean(plan.u_after**2) < np.mean(six.u_after**2)


def test_touches_go_where_the_part_needs_them() -> None:
    """A part with walls towards +x only: u there falls below that of the general plan."""
    old = example_map("harmonic")
    walls = from_angles(np.full(21, 85.0 * DEGREE), np.linspace(-0.5, 0.5, 21))
    own = plan_touches(old, 6, normals=walls)
    general = plan_touches(old, 6)
    u_general = update_map(
        sphere_touches(old.pretravel(general.normals), general.normals), old, 25.0
    ).pretravel_map.standard_uncertainty(walls)
    assert np.mean(own.u_after**2) < np.mean(u_general**2)


def test_plans_determine_a_sphere_and_vary_the_order() -> None:
    for count in (5, 9, 15):
        plan = plan_touches(example_map("harmonic"), count)
        assert len(np.unique(plan.directions.round(6), axis=0)) == count
        extent = np.linalg.svd(plan.directions - plan.directions.mean(axis=0))[1]
        assert extent[-1] > 0.04 * extent[0]
        turns = np.diff(np.arctan2(plan.directions[:, 1], plan.directions[:, 0]))
        assert np.abs(np.exp(1j * turns).mean()) < 0.5


def test_too_few_touches() -> None:
    with pytest.raises(PretravelError, match="4 touches are too few"):
        plan_touches(example_map("harmonic"), 4)


def test_in_a_ring_all_touches_are_on_its_equator() -> None:
    """Also where the map holds over a part of it alone: its edge is touched, nothing beyond."""
    whole = plan_touches(example_map(), 6, ring=True)
    assert np.abs(whole.directions[:, 2]).max() < 1e-3
    assert whole.prior.axes == 2
    # The centre needs touches on all sides.
    assert np.linalg.norm(whole.directions.mean(axis=0)) < 0.5
    assert np.all(whole.u_after <= whole.u_before + 1e-12)
    azimuth = np.arange(-80.0, 81.0, 20.0) * DEGREE
    nodes = np.concatenate([from_angles(polar * DEGREE, azimuth) for polar in (30.0, 60.0, 90.0)])
    half = replace(example_map(), support=DirectionSupport(nodes), touched=None)
    touched = plan_touches(half, 5, ring=True).directions
    assert np.abs(np.degrees(np.arctan2(touched[:, 1], touched[:, 0]))).max() < 80.1
    assert np.abs(touched[:, 2]).max() < 1e-3


def _problem(ring: bool) -> _Problem:
    made = example_map()
    places = made.support.nodes[::4]
    return _Problem.of(drifted_map(made, ProbeDrift(), ring=ring), made.support.nodes, places)


@pytest.mark.parametrize("ring", [False, True])
def test_gains_are_what_touches_take_from_the_aim(ring: bool) -> None:
    """Updates one at a time, all at once, and by adding information are the same."""
    problem = _problem(ring)
    start = problem.covariance
    gains = problem.gains(start)
    for candidate in (0, 5, 11):
        after = problem.touched(start, candidate)
        taken = problem.value(start) - problem.value(after)
        assert gains[candidate] == pytest.approx(taken, rel=1e-6)
        assert after == pytest.approx(problem.covariance_after(np.array([candidate])), abs=1e-12)
    both = problem.touched(problem.touched(start, 3), 8)
    assert both == pytest.approx(problem.covariance_after(np.array([8, 3])), abs=1e-10)
    rows = problem.rows[[8, 3]]
    regular = start + 1e-6 * np.eye(len(start))
    stated = replace(problem, covariance=regular).covariance_after(np.array([8, 3]))
    information = np.linalg.inv(regular) + rows.T @ rows / problem.noise
    assert stated == pytest.approx(np.linalg.inv(information), abs=1e-6)


def test_the_first_touch_is_the_one_that_helps_most() -> None:
    problem = _problem(False)
    chosen = _greedy(problem, 4)
    assert len(set(chosen.tolist())) == 4
    assert chosen[0] == np.argmax(problem.gains(problem.covariance))
    second = problem.gains(problem.touched(problem.covariance, int(chosen[0])))
    assert chosen[1] == np.argmax(np.where(np.arange(len(second)) == chosen[0], -1.0, second))


def test_exchanges_never_make_a_plan_worse() -> None:
    problem = _problem(False)
    start = np.arange(6)
    better = _exchanged(problem, start)
    assert len(set(better.tolist())) == 6
    before, after = (problem.value(problem.covariance_after(c)) for c in (start, better))
    assert after < 0.9 * before
    assert start.tolist() == list(range(6))


def test_directions_in_one_plane_with_the_others_are_seen() -> None:
    """Of a sphere: four on the circle at a height of 0.6, and one above it."""
    azimuth = np.radians([0.0, 90.0, 180.0, 270.0, 45.0, 45.0])
    height = np.array([0.6, 0.6, 0.6, 0.6, 0.6, 0.9])
    candidates = np.column_stack([np.sqrt(1.0 - height**2) * np.cos(azimuth),
                                  np.sqrt(1.0 - height**2) * np.sin(azimuth), height])  # fmt: skip
    planar = _in_one_plane(candidates, np.arange(4))
    assert planar.tolist() == [True] * 5 + [False]
    assert not _in_one_plane(candidates, np.array([0, 1, 2, 5])).any()
    ring = np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])
    assert not _in_one_plane(ring, np.arange(4)).any()
