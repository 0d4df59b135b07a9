"""Separation of the signal delay from the pretravel at rest, and its compensation."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25, unit
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import delay_travel
from pretravel.maps.kinds import kinds
from pretravel.maps.kinds.harmonic import fit_harmonic
from pretravel.maps.observation import Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import point_sources
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification import qualifying
from pretravel.qualification.delay import several_feeds, signal_delay, travel_per_second
from pretravel.qualification.observe import observe
from pretravel.qualification.qualifying import prepare
from pretravel.qualification.verification import verify
from pretravel.touches import Touches
from tests.support.simulated_probe import simulated_pretravel

# One kind, and a perfect sphere: the average of kinds and the usual u have tests of their own.
qualify = partial(
    qualifying.qualify, kind="harmonic", u_diameter=0.0, u_temperature=0.0, sphere_form=0.0
)


# Rodrigues 2021, section 2.9.2: 14.5 ms; his 50 mm/min, and a second feed.
DELAY, FEEDS = 14.5e-3, (50.0, 150.0)
PROBE = load_probe("omp40-2-100mm-carbide")
NOISE = 0.3e-3


def _touches(rng: np.random.Generator, noise: float = NOISE) -> Touches:
    """25 directions twice at each feed."""
    n = np.tile(sphere_pattern_25(), (4, 1))
    feeds = np.repeat([FEEDS[0], FEEDS[1]] * 2, 25)
    travel = predict(PROBE, n).pretravel + delay_travel(feeds, DELAY)
    distance = 15.5 - travel + rng.normal(0.0, noise, len(n))
    return Touches(n * distance[:, None] + [10.0, 20.0, 30.0], n, feeds=feeds)


# The estimate.


UM = 1e-3
N = sphere_pattern_25()
AXIS = (0.48, 0.6, 0.64)
TILT = probe_rotation(AXIS)
UPRIGHT = QualificationSetup(25.0, tip_diameter=6.0, sphere_form=0.0)
TILTED = replace(UPRIGHT, axis=AXIS)


def _fed(delay: float, noise: float = 0.3 * UM) -> Touches:
    """At 50 and 150 mm/min with the same noise: the delay is as made. On a tilted probe."""
    feeds = np.tile(np.repeat([50.0, 150.0], 25), 2)
    errors = np.random.default_rng(3).standard_normal((2, 1, 25))
    errors = noise * np.tile(errors, (1, 2, 1)).ravel()
    n = np.tile(N, (4, 1))
    distance = 15.49 + errors - feeds / 60.0 * delay
    return Touches((n * distance[:, None]) @ TILT.T, n @ TILT.T, feeds=feeds)


def test_feeds_within_a_hundredth_are_one_feed() -> None:
    def fed(*feeds: float) -> bool:
        n = np.eye(3)[: len(feeds)]
        return several_feeds(Touches(n, n, feeds=feeds))

    assert not fed(99.01, 100.0)
    assert fed(98.99, 100.0)
    assert not several_feeds(Touches(np.eye(3), np.eye(3)))


def test_delay_travel_is_that_along_the_normal() -> None:
    """60° and 0° off the normal, and away from it."""
    n = np.tile([[0.0, 0.0, 1.0]], (2, 1))
    oblique = np.array([[math.sqrt(0.75), 0.0, -0.5], [0.0, 0.0, -1.0]])
    found = travel_per_second(Touches(n, n, approaches=oblique, feeds=[120.0, 90.0]))
    assert found == pytest.approx([1.0, 1.5], rel=1e-12)


@pytest.mark.parametrize("repeats", [Scatter(0.2 * UM, 10.0), Scatter(0.2 * UM, 9.0)])
def test_a_delay_is_generalised_least_squares_with_the_map_integrated_out(repeats: Scatter) -> None:
    """f M y / f M f with the hat matrix column by column; noise from ten repeats on is theirs, of
    fewer it is pooled with what is left of the map and with 0.3 µm, which counts four."""
    given = _fed(1e-3)
    fit = fit_harmonic(observe(given, TILTED, probe_rotation(TILTED.axis)))
    hat = np.stack(
        [fit.smoothing.fitted(row, fit.observation.groups) for row in np.eye(100)], axis=1
    )
    f = np.repeat(1.0, 100) * np.tile(np.repeat([50.0, 150.0], 25), 2) / 60.0
    assert travel_per_second(given) == pytest.approx(f, rel=1e-12)
    left = f - hat @ f
    found = signal_delay(given, fit, repeats)
    delay = f @ fit.residuals / (f @ left)
    assert found.delay == pytest.approx(delay, rel=1e-9)
    sigma = 0.2 * UM
    if repeats.dof < 10.0:
        rest = float(np.sum((fit.residuals - left * delay) ** 2))
        squares = rest + 9.0 * sigma**2 + 4.0 * (0.3 * UM) ** 2
        sigma = math.sqrt(squares / (fit.dof - 1.0 + 9.0 + 4.0))
    assert found.u_delay == pytest.approx(sigma / math.sqrt(f @ left), rel=1e-9)


def test_residuals_of_few_touches_count_as_one_degree_of_freedom() -> None:
    """A map that leaves 1.4 degrees: one of them, of repeats 2, of the usual noise four."""
    feeds = np.array([60.0, 60.0, 120.0, 240.0])
    given = Touches(N[:4] * 15.5, N[:4], feeds=feeds)
    residuals = np.array([0.5, -0.3, 0.1, 0.9]) * UM
    fit: Any = SimpleNamespace(
        residuals=residuals,
        smoothing=SimpleNamespace(fitted=lambda f, _: np.full(4, f.mean())),
        observation=SimpleNamespace(groups=np.arange(4)),
        dof=1.4,
    )
    f = feeds / 60.0
    left = f - f.mean()
    delay = float(f @ residuals / (f @ left))
    found = signal_delay(given, fit, Scatter(0.2 * UM, 2.0))
    assert found.delay == pytest.approx(delay, rel=1e-9)
    squares = float(np.sum((residuals - left * delay) ** 2)) + 2.0 * (0.2 * UM) ** 2
    squares += 4.0 * (0.3 * UM) ** 2
    assert found.u_delay == pytest.approx(math.sqrt(squares / 7.0 / float(f @ left)), rel=1e-9)
    assert (found.slowest, found.fastest) == (60.0, 240.0)


def test_feeds_that_change_with_the_directions_do_not_determine_a_delay() -> None:
    """The delay travel then looks like a shift of the reference, or like lobes."""
    n = np.tile(sphere_pattern_25(), (2, 1))
    setup = QualificationSetup(25.0, tip_diameter=6.0)
    known = []
    for feeds in (100.0 + 60.0 * n[:, 0], np.repeat([50.0, 150.0], 25)):
        noise = np.random.default_rng(1).normal(0.0, NOISE, len(n))
        touches = Touches(n * (15.49 + noise)[:, None], n, feeds=feeds)
        fit = fit_harmonic(observe(touches, setup, probe_rotation(setup.axis)))
        found = signal_delay(touches, fit, Scatter(NOISE, 25.0))
        assert (found.slowest, found.fastest) == (feeds.min(), feeds.max())
        known.append(found.u_delay)
    assert known[0] == np.inf
    # 50 touches at 100 mm/min between the feeds: half of 1.67 mm/s about their mean.
    assert known[1] == pytest.approx(NOISE / (np.sqrt(50.0) * 0.5 * 100.0 / 60.0), rel=0.1)


def test_a_delay_may_be_three_u_below_zero() -> None:
    quick = replace(TILTED, search_outliers=False)
    first = prepare(_fed(0.0), quick).delay
    assert first is not None
    found = prepare(_fed(-2.8 * first.u_delay), quick)
    assert found.delay is not None
    assert found.delay.delay == pytest.approx(-2.8 * first.u_delay, rel=0.02)
    still = np.linalg.norm(_fed(0.0).positions, axis=1)
    assert np.linalg.norm(found.touches.positions, axis=1) == pytest.approx(still, abs=5e-6)
    with pytest.raises(PretravelError, match="cannot come before its trigger"):
        prepare(_fed(-3.2 * first.u_delay), quick)


@pytest.mark.parametrize(("noise", "told"), [(1.9, False), (3.3, True)])
def test_a_delay_that_moves_the_map_by_half_a_micrometre_is_not_separated(
    noise: float, told: bool
) -> None:
    """u is the noise over 8.33 mm/s; the map moves by 1.67 mm/s times that: limit 2.5 µm."""
    found = prepare(_fed(20e-3, noise * UM), replace(TILTED, search_outliers=False))
    assert (found.delay is None) == told
    assert any("not determine the signal delay" in words for words in found.warnings) == told


# In qualifications, maps and points.


@cache
def _made() -> PretravelMap:
    touches = _touches(np.random.default_rng(1))
    return qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False).pretravel_map


@pytest.mark.parametrize("kind", [k for k in kinds() if k != "sectors"])
def test_delay_is_told_apart(kind: str) -> None:
    """Four standard uncertainties; u itself is 0.07 ms: noise over the root of 100 touches over the
    spread of 1.67 mm/s between the feeds.
    """
    result = qualify(
        _touches(np.random.default_rng(1)), 25.0, tip_diameter=6.0, kind=kind,
        search_outliers=False,
    )  # fmt: skip
    delay = result.delay
    assert delay is not None
    assert delay.u_delay == pytest.approx(NOISE / (10.0 * 0.5 * 100.0 / 60.0), rel=0.3)
    assert abs(delay.delay - DELAY) < 4.0 * delay.u_delay
    assert (result.pretravel_map.delay, result.pretravel_map.feed) == (delay.delay, 0.0)


@pytest.mark.long
def test_without_noise_the_map_is_that_of_the_probe_at_rest() -> None:
    touches = _touches(np.random.default_rng(1), noise=0.0)
    moving = qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False)
    n = sphere_pattern_25()
    still = Touches(n * (15.5 - predict(PROBE, n).pretravel)[:, None] + [10.0, 20.0, 30.0], n)
    resting = qualify(still, 25.0, tip_diameter=6.0, search_outliers=False)
    assert moving.delay is not None
    assert moving.delay.delay == pytest.approx(DELAY, abs=1e-6)
    value = moving.pretravel_map.pretravel(n) - resting.pretravel_map.pretravel(n)
    # The centre across the axis is determined only to 0.3 um; distances are the same.
    value -= n @ np.linalg.lstsq(n, value)[0]
    assert np.abs(value).max() < 0.02e-3


def test_oblique_approach_at_another_feed() -> None:
    """A floor, probed 30° off its normal at 300 mm/min: pretravel is proportional to 1 / cos,
    delay travel is not. A map that contains the delay would have an error of 11 um."""
    made = qualify(_touches(np.random.default_rng(1), noise=0.0), 25.0, tip_diameter=6.0,
                   search_outliers=False).pretravel_map  # fmt: skip
    n = np.array([[0.0, 0.6, 0.8]])
    a = unit(-n + np.tan(np.radians(30.0)) * np.array([[1.0, 0.0, 0.0]]))
    closing = -np.sum(a * n)
    travel = made.pretravel(n) / closing + delay_travel(300.0, DELAY)
    position = 3.0 * n + travel[:, None] * a
    touch = Touches(position, n, approaches=a, feeds=np.array([300.0]))
    points = apply(touch, made)
    assert np.sum(points.positions * n) == pytest.approx(0.0, abs=0.03e-3)


@pytest.mark.parametrize("later", [0.0, 1e-3])
def test_verification_at_another_feed(later: float) -> None:
    """At 300 mm/min the delay is 72 µm of travel, which the map does not contain, and no change of
    the probe. A delay that has grown by 1 ms since is one: 5 µm in all directions."""
    made = _made()
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    rng = np.random.default_rng(2)
    travel = predict(PROBE, n).pretravel + delay_travel(300.0, DELAY + later)
    distance = 15.5 - travel + rng.normal(0.0, NOISE, len(n))
    new = Touches(n * distance[:, None], n, feeds=np.full(len(n), 300.0))
    result = verify(new, made, 25.0)
    # The map's own delay is uncertain by 0.07 ms, which is 0.4 µm at this feed.
    assert made.u_delay < 0.1e-3
    assert result.changed == (later > 0.0)
    assert result.size.value == pytest.approx(
        delay_travel(300.0, later), abs=3.0 * (result.size.u + delay_travel(300.0, made.u_delay))
    )


def test_touches_must_tell_their_feed() -> None:
    made = _made()
    with pytest.raises(PretravelError, match="feed_mm_min"):
        apply(Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]]), made)


def test_feeds_that_go_with_directions_cannot_tell() -> None:
    """Pole slow, equator fast: the zonal form of the map is an equally likely explanation."""
    touches = _touches(np.random.default_rng(1)).take(np.arange(25))
    feeds = np.where(touches.normals[:, 2] > 0.9, 50.0, 150.0)
    result = qualify(replace(touches, feeds=feeds), 25.0, tip_diameter=6.0)
    assert result.delay is None
    assert any("change with the directions" in warning for warning in result.warnings)


def test_feeds_that_hardly_differ_cannot_tell() -> None:
    """A log with 50 and 51 mm/min is one of a single feed: no guess falsifies the map."""
    touches = _touches(np.random.default_rng(1))
    jitter = replace(touches, feeds=np.where(np.arange(100) % 2, 50.0, 51.0))
    result = qualify(jitter, 25.0, tip_diameter=6.0)
    assert result.delay is None
    assert result.pretravel_map.feed == pytest.approx(50.5)
    assert any("were made at 50 to 51 mm/min" in words for words in result.warnings)


def test_the_delays_share_of_the_centre() -> None:
    """With a given value at the pole, a constant error of the map is one of the height of the
    centre: mean feed times u of the delay, in addition to the u of touches at one feed."""
    touches = _touches(np.random.default_rng(1))
    two = qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False)
    assert two.delay is not None
    still = touches.at_rest(two.delay.delay)
    at_rest = np.full(len(still), 0.5)
    one = qualify(replace(still, feeds=at_rest), 25.0, tip_diameter=6.0, search_outliers=False)
    share = delay_travel(100.0, two.delay.u_delay)
    for first, second in (
        (two.center_covariance[2, 2], one.center_covariance[2, 2]),
        (two.u_effective_radius**2, one.u_effective_radius**2),
    ):
        assert np.sqrt(first - second) == pytest.approx(share, rel=0.1)


def test_a_travel_at_one_feed_is_no_shift_of_the_centre() -> None:
    """300 mm/min for 2 ms are 10 µm in all directions. A fit without a constant took them for a
    height of the centre that was 7.7 µm off at u = 0.9 µm."""
    n = np.repeat(sphere_pattern_25(), 3, axis=0)
    pretravel = simulated_pretravel(n) + delay_travel(300.0, 2e-3)
    pretravel += 3e-4 * np.random.default_rng(1).standard_normal(75)
    touches = Touches(n * (15.5 - pretravel)[:, None], n, feeds=np.full(75, 300.0))
    found = qualifying.qualify(
        touches, 25.0, tip_diameter=6.0, kind="physical", search_outliers=False
    )
    u = np.sqrt(np.diag(found.center_covariance))
    assert np.all(np.abs(found.center) < 2.0 * u)
    assert u[2] < 3e-3


def test_map_and_delay_err_together() -> None:
    """At the feeds of the qualification, errors of delay and map compensate each other: u of a
    point is not their sum in quadrature, and the sphere itself has no error."""
    touches = _touches(np.random.default_rng(1))
    made = _made()
    assert made.delay_effect is not None
    n = sphere_pattern_25()
    by_delay = made.change_by_delay(n)
    # All but the pole, which the gauge holds: minus mean feed times u.
    assert by_delay[-8:] == pytest.approx(-delay_travel(100.0, made.u_delay), rel=0.1)
    at_mean = replace(touches, feeds=np.full(100, 100.0))
    sources = point_sources(at_mean, apply(at_mean, made), made)
    equator = np.abs(touches.normals[:, 2]) < 0.01
    assert np.sqrt(sources["signal delay"].variances[equator].max()) < 0.02e-3
