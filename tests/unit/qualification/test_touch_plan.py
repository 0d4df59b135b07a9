"""The choice of few touches: closed forms and what the update then gives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
import pytest

from pretravel.arrays import FloatArray
from pretravel.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.errors import PretravelError
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.probe_drift import ProbeDrift
from pretravel.qualification.touch_plan import plan_touches
from pretravel.uncertainty.covariance import Covariance
from pretravel.units import DEGREE
from tests.support.example_maps import example_map
from tests.support.reference_touches import sphere_touches

NO_DRIFT = ProbeDrift(0.0, 0.0, 0.0, 0.0)
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
        plan = plan_touches(old, 7)
        touches = sphere_touches(old.pretravel(plan.normals), plan.normals)
        new = update_map(touches, old, 25.0).pretravel_map
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
    half = replace(example_map(), support=DirectionSupport(nodes))
    touched = plan_touches(half, 5, ring=True).directions
    assert np.abs(np.degrees(np.arctan2(touched[:, 1], touched[:, 0]))).max() < 80.1
    assert np.abs(touched[:, 2]).max() < 1e-3
