"""What a probe may drift by: the prior of an update and of a plan."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, polar_angle, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.probe_drift import (
    ProbeDrift,
    drift_of_changes,
    drifted_map,
    slope_around_axis,
    spread_of,
    spread_over_support,
)
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map
from tests.support.lobed_map import COEFFICIENTS, TERMS, UM, N, lobed_map, value_of


def test_a_drifted_map_is_wider_by_its_ways() -> None:
    """Scale: the map itself; level: 1 in all directions; turn: less the slope around the axis, in
    closed form of lobes. Their variances add to that of the map."""
    made = lobed_map()
    drift = ProbeDrift(scale=0.03, level=0.4 * UM, turn=0.02, form=0.0)
    found = drifted_map(made, drift)
    design = HarmonicBasis(TERMS).design(N)
    lobes = design[:, 2:] @ np.array([[0.0, 3.0], [-3.0, 0.0]])  # cos 3φ → -3 sin 3φ
    slope = (
        lobes @ COEFFICIENTS[2:] * np.sign(lobes @ COEFFICIENTS[2:] @ slope_around_axis(made, N))
    )
    # A difference over 0.4°: sin(3 · 0.2°) over its angle.
    assert slope_around_axis(made, N) == pytest.approx(slope, rel=3e-5, abs=1e-9)
    assert design @ found.ways.T == pytest.approx(
        np.column_stack([value_of(N), np.ones(25), -slope]), rel=1e-4, abs=1e-8
    )
    spread = [0.03, 0.4 * UM, 0.02]
    assert spread_of(drift) == pytest.approx(spread)
    by_ways = sum(s**2 * np.outer(way, way) for s, way in zip(spread, found.ways, strict=True))
    assert found.covariance == pytest.approx(made.covariance.matrix + by_ways, rel=1e-12)
    assert (found.pretravel_map, found.drift, found.axes) == (made, drift, 3)
    assert drifted_map(made, drift, ring=True).axes == 2
    variance = np.diag(design @ found.covariance @ design.T)
    assert found.variance(N, found.covariance) == pytest.approx(variance, rel=1e-9)
    # The basis has no first harmonic: nothing of it is a shift.
    assert found.without_shift == pytest.approx(np.eye(4))
    assert not found.from_center


def test_the_drift_of_verifications_is_their_variance_less_that_of_their_u() -> None:
    """By hand: three times 0.3² of the default, and 1² + 2² - 2 · 0.5² µm² of two; five of them."""
    found = drift_of_changes(
        [1.0 * UM, -2.0 * UM, np.nan], np.full(3, 0.5 * UM), [0.01, np.nan, np.nan], np.zeros(3)
    )
    assert found.level == pytest.approx(UM * math.sqrt((0.27 + 4.5) / 5.0), rel=1e-12)
    default = math.radians(0.3)
    assert found.turn == pytest.approx(math.sqrt((3.0 * default**2 + 1e-4) / 4.0), rel=1e-12)
    assert (found.scale, found.form) == (ProbeDrift().scale, ProbeDrift().form)
    assert found.source == "size and turn from 2 verifications, the rest assumed"
    one = drift_of_changes([0.1 * UM], [0.5 * UM], [np.nan], [1.0])
    assert one.level == pytest.approx(0.3 * UM * math.sqrt(0.75), rel=1e-12)
    assert one.source == "size and turn from 1 verification, the rest assumed"
    assert drift_of_changes([np.nan], [1.0], [0.1], [0.0]) == ProbeDrift()
    for name in ("scale", "level", "turn", "form"):
        assert getattr(ProbeDrift(**{name: 0.0}), name) == 0.0
        for value in (-1e-9, math.inf):
            with pytest.raises(PretravelError, match=f"drift of {name} is"):
                ProbeDrift(**{name: value})


@pytest.mark.parametrize("kind", ["harmonic", "physical"])
def test_a_change_of_form_has_its_share_of_the_variation(kind: str) -> None:
    """Over the directions: the mean variance that it adds to the pretravel is the square of 2 % of
    the map's standard deviation there. Other points of the same cap: 5 %."""
    old = example_map(kind)
    form = drifted_map(old, ProbeDrift(0.0, 0.0, 0.0, 0.02)).covariance
    added = form - drifted_map(old, ProbeDrift(0.0, 0.0, 0.0, 0.0, change=0.0)).covariance
    directions = fibonacci_cap(500, float(polar_angle(old.support.nodes).max()))
    design = old.basis.design(directions)
    variance = np.sum((design @ added) * design, axis=1)
    variation = np.std(old.pretravel(directions @ old.rotation.T))
    assert np.sqrt(np.mean(variance)) == pytest.approx(0.02 * variation, rel=0.05)


def test_maps_that_cannot_be_updated() -> None:
    with pytest.raises(PretravelError, match="kind mean does not follow"):
        drifted_map(example_map("mean"))
    silent = replace(example_map(), covariance=Covariance.none(example_map().basis.size))
    with pytest.raises(PretravelError, match="has no uncertainty"):
        drifted_map(silent)


def test_directions_over_a_support_are_within_it_and_contain_its_nodes() -> None:
    """Of more nodes than are asked for as many as asked; the cap ends at the lowest node."""
    few = lobed_map(support=DirectionSupport(sphere_pattern_25()))
    found = spread_over_support(few, 200)
    assert found[-25:] == pytest.approx(sphere_pattern_25())
    assert len(found) == pytest.approx(225, abs=15)
    assert few.support.supports(found).all()
    assert found[:-25, 2].min() < 0.03
    many = fibonacci_cap(300, 1.2)
    found = spread_over_support(lobed_map(support=DirectionSupport(many)), 100)
    held = len(found) - 100
    assert 90 <= held <= 100
    assert found[held:] == pytest.approx(many[:100])
