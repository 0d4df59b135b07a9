"""Separation of the signal delay from the pretravel at rest, and its compensation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25, unit
from pretravel.base.errors import PretravelError
from pretravel.base.units import delay_travel
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.kinds import kinds
from pretravel.maps.kinds.harmonic import fit_harmonic
from pretravel.maps.observation import Scatter
from pretravel.maps.provenance import U_AXIAL_PRETRAVEL, QualificationSetup
from pretravel.measurement.compensation import apply, embed
from pretravel.measurement.point_errors import point_sources
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.predict import predict
from pretravel.qualification import qualify as qualifying
from pretravel.qualification.delay import signal_delay
from pretravel.qualification.observe import observe
from pretravel.qualification.verification import verify
from pretravel.touches import Touches, at_rest

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


def test_u_of_the_delay_is_honest() -> None:
    """The delay is separated before a kind is fitted: the simplest kind has the same."""
    z = []
    for seed in range(20):
        result = qualify(_touches(np.random.default_rng(seed)), 25.0, tip_diameter=6.0,
                         kind="mean", search_outliers=False)  # fmt: skip
        assert result.delay is not None
        z.append((result.delay.delay - DELAY) / result.delay.u_delay)
    # A deviation of 20 scatters by 16 %, their mean by 0.22.
    assert 0.6 < np.std(z) < 1.4
    assert abs(np.mean(z)) < 0.75


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
    made = qualify(_touches(np.random.default_rng(1)), 25.0, tip_diameter=6.0,
                   search_outliers=False).pretravel_map  # fmt: skip
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
    made = qualify(_touches(np.random.default_rng(1)), 25.0, tip_diameter=6.0).pretravel_map
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


@pytest.mark.slow
def test_the_delays_uncertainty_reaches_centre_and_radius() -> None:
    """The quick test of this is that of the delay's share, below.

    Feeds of 50 and 100: the delay is determined to 0.1 ms, which moves all results by 0.12 um.
    Over 25 qualifications effective radius and centre height scatter as stated (25: 14 %).
    """
    radius, height, stated = [], [], []
    for seed in range(25):
        touches = _touches(np.random.default_rng(seed))
        rng = np.random.default_rng(1000 + seed)
        feeds = np.where(touches.feeds > 100.0, 100.0, 50.0)
        travel = predict(PROBE, touches.normals).pretravel + delay_travel(feeds, DELAY)
        distance = 15.5 - travel + rng.normal(0.0, NOISE, len(touches))
        result = qualify(
            Touches(touches.normals * distance[:, None], touches.normals, feeds=feeds),
            25.0, tip_diameter=6.0, search_outliers=False,
        )  # fmt: skip
        radius.append(result.effective_radius)
        height.append(result.center[2])
        # The assumed pretravel at the pole is uncertain too, which no noise shows.
        height_variance = result.center_covariance[2, 2] - U_AXIAL_PRETRAVEL**2
        stated.append((result.u_effective_radius, np.sqrt(height_variance)))
    assert np.std(radius) == pytest.approx(np.mean(stated, axis=0)[0], rel=0.45)
    assert np.std(height) == pytest.approx(np.mean(stated, axis=0)[1], rel=0.45)


def test_the_delays_share_of_the_centre() -> None:
    """With a given value at the pole, a constant error of the map is one of the height of the
    centre: mean feed times u of the delay, in addition to the u of touches at one feed."""
    touches = _touches(np.random.default_rng(1))
    two = qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False)
    assert two.delay is not None
    still = at_rest(touches, two.delay.delay)
    one = qualify(replace(still, feeds=None), 25.0, tip_diameter=6.0, search_outliers=False)
    share = delay_travel(100.0, two.delay.u_delay)
    for first, second in (
        (two.center_covariance[2, 2], one.center_covariance[2, 2]),
        (two.u_effective_radius**2, one.u_effective_radius**2),
    ):
        assert np.sqrt(first - second) == pytest.approx(share, rel=0.1)


def test_map_and_delay_err_together() -> None:
    """At the feeds of the qualification, errors of delay and map compensate each other: u of a
    point is not their sum in quadrature, and the sphere itself has no error."""
    touches = _touches(np.random.default_rng(1))
    made = qualify(touches, 25.0, tip_diameter=6.0).pretravel_map
    assert made.delay_effect is not None
    n = sphere_pattern_25()
    by_delay = made.change_by_delay(n)
    # All but the pole, which the gauge holds: minus mean feed times u.
    assert by_delay[-8:] == pytest.approx(-delay_travel(100.0, made.u_delay), rel=0.1)
    at_mean = replace(touches, feeds=np.full(100, 100.0))
    sources = point_sources(at_mean, apply(at_mean, made), made)
    equator = np.abs(touches.normals[:, 2]) < 0.01
    assert np.sqrt(sources["signal delay"].variances[equator].max()) < 0.02e-3


@pytest.mark.parametrize(
    ("kind", "ending"),
    [
        ("physical", ".json"),
        ("harmonic", ".csv"),
        pytest.param("harmonic", ".json", marks=pytest.mark.slow),
        pytest.param("physical", ".csv", marks=pytest.mark.slow),
        pytest.param("wozniak", ".json", marks=pytest.mark.slow),
        pytest.param("wozniak", ".csv", marks=pytest.mark.slow),
    ],
)
def test_files_keep_it(tmp_path: Path, ending: str, kind: str) -> None:
    touches = _touches(np.random.default_rng(1))
    made = qualify(touches, 25.0, tip_diameter=6.0, kind=kind, search_outliers=False).pretravel_map
    path = tmp_path / f"map{ending}"
    write_map(path, made)
    again = read_map(path)
    assert again.delay == pytest.approx(made.delay, rel=1e-9)
    assert again.u_delay == pytest.approx(made.u_delay, rel=1e-9)
    first, second = apply(touches, made), apply(touches, again)
    ratio = second.standard_uncertainty / first.standard_uncertainty
    if ending == ".json":
        assert np.abs(first.positions - second.positions).max() < 1e-12
        assert ratio == pytest.approx(1.0, rel=1e-9)
        return
    # The directions of the pattern are nodes of the table of 2.5°, printed with nine digits. What
    # the errors of its nodes share is not printed: u is no smaller, and by less than 5 % larger.
    assert np.abs(first.positions - second.positions).max() < 1e-6
    assert ratio.min() > 1.0 - 1e-6
    assert ratio.max() < 1.05


def test_sources_add_up_to_what_points_state() -> None:
    touches = _touches(np.random.default_rng(1))
    made = qualify(touches, 25.0, tip_diameter=6.0, u_diameter=2e-4).pretravel_map
    points = apply(touches, made)
    sources = point_sources(touches, points, made)
    total = sum(part.variances for part in sources.values())
    assert np.sqrt(total) == pytest.approx(points.standard_uncertainty, rel=1e-9)
    assert sorted(sources) == ["map", "repeatability", "signal delay", "tip radius"]


def test_embed_is_at_rest() -> None:
    made = qualify(_touches(np.random.default_rng(1)), 25.0, tip_diameter=6.0).pretravel_map
    n = sphere_pattern_25()
    back = apply(replace(embed(10.0 * n, n, made), feeds=np.full(25, 1e-9)), made)
    assert back.positions == pytest.approx(10.0 * n, abs=1e-9)
    moving = apply(embed(10.0 * n, n, made, feeds=np.full(25, 500.0)), made)
    assert moving.positions == pytest.approx(10.0 * n, abs=1e-9)


def test_feeds_that_change_with_the_directions_do_not_determine_a_delay() -> None:
    """The delay travel then looks like a shift of the reference, or like lobes."""
    n = np.tile(sphere_pattern_25(), (2, 1))
    setup = QualificationSetup(25.0, tip_diameter=6.0)
    known = []
    for feeds in (100.0 + 60.0 * n[:, 0], np.repeat([50.0, 150.0], 25)):
        noise = np.random.default_rng(1).normal(0.0, NOISE, len(n))
        touches = Touches(n * (15.49 + noise)[:, None], n, feeds=feeds)
        fit = fit_harmonic(observe(touches, setup))
        found = signal_delay(touches, fit, Scatter(NOISE, 25.0))
        assert (found.slowest, found.fastest) == (feeds.min(), feeds.max())
        known.append(found.u_delay)
    assert known[0] == np.inf
    # 50 touches at 100 mm/min between the feeds: half of 1.67 mm/s about their mean.
    assert known[1] == pytest.approx(NOISE / (np.sqrt(50.0) * 0.5 * 100.0 / 60.0), rel=0.1)
