"""What compensation warns about, from both sides of each condition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Origin, Provenance
from pretravel.measurement.points_summary import TouchSummary
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map

MEASURED = replace(
    mean_map(0.01), covariance=Covariance.independent([1e-8]), repeatability=3e-4, feed=60.0
)
QUALIFIED = replace(MEASURED, provenance=Provenance(origin=Origin.QUALIFIED))
DELAYED = {"delay": 1e-3, "u_delay": 1e-5, "delay_effect": np.zeros(1)}
QUIET = TouchSummary(10, 1.0, (60.0, 60.0), 0.0, 0)


def _told(summary: TouchSummary, made: PretravelMap, words: str) -> bool:
    warnings = [w for w in summary.warnings(made) if words in w]
    assert len(warnings) <= 1
    return bool(warnings)


def test_nothing_is_said_of_a_usual_case() -> None:
    for made in (MEASURED, QUALIFIED, replace(QUALIFIED, feed=None, **DELAYED)):  # type: ignore[arg-type]
        assert QUIET.warnings(made) == []
    assert TouchSummary(10, 1.0).warnings(replace(MEASURED, feed=None)) == []
    # By rounding, the cosine between two unit vectors may exceed one.
    rounded = replace(QUIET, least_closing=float(np.nextafter(1.0, 2.0)))
    assert rounded.warnings(MEASURED) == []


def test_normals_outside_the_map() -> None:
    (said,) = replace(QUIET, outside=1).warnings(MEASURED)
    assert said.startswith("1 of 10 normals lie outside the map")


@pytest.mark.parametrize(
    ("feeds", "expected"),
    [
        ((60.0, 60.0), ""),
        ((60.5, 60.5), ""),
        ((59.5, 59.5), ""),
        ((60.7, 60.7), "at 60.7;"),
        ((59.3, 59.3), "at 59.3;"),
        ((60.0, 60.1), "at 60 to 60.1;"),
        ((30.0, 60.0), "at 30 to 60;"),
        (None, ""),
    ],
)
def test_feeds_within_a_per_cent_are_the_same(
    feeds: tuple[float, float] | None, expected: str
) -> None:
    """One feed, that of the map within 1 %: 0.6 mm/min of 60."""
    summary = replace(QUIET, feeds=feeds)
    told = " ".join(summary.warnings(MEASURED))
    assert ("was made at 60 mm/min, these touches" in told) == bool(expected)
    assert expected in told
    for other in (replace(MEASURED, **DELAYED), replace(MEASURED, feed=None)):  # type: ignore[arg-type]
        assert summary.warnings(other) == []


@pytest.mark.parametrize("origin", list(Origin))
@pytest.mark.parametrize("feeds", [None, (60.0, 60.0)])
@pytest.mark.parametrize("made_at", [None, 60.0])
@pytest.mark.parametrize("delayed", [False, True])
def test_feeds_that_are_not_known_matter_to_qualified_maps_without_a_delay(
    origin: Origin, feeds: tuple[float, float] | None, made_at: float | None, delayed: bool
) -> None:
    made = replace(MEASURED, feed=made_at, provenance=Provenance(origin=origin))
    made = replace(made, **DELAYED) if delayed else made  # type: ignore[arg-type]
    told = " ".join(replace(QUIET, feeds=feeds).warnings(made))
    noted = replace(QUIET, feeds=feeds).feed_note(made)
    unknown = origin is Origin.QUALIFIED and not delayed
    both = made_at is None and feeds is None
    assert ("no file states a feed" in noted) == (unknown and both)
    of_map = "the touches have a feed, the map does not (column" in told
    assert of_map == (unknown and made_at is None and feeds is not None)
    assert of_map == ("Qualify again and give the feed of the touches on the reference" in told)
    of_touches = "the map has a feed, the touches do not (column" in told
    assert of_touches == (unknown and made_at is not None and feeds is None)
    assert of_touches == ("Give the feed of these touches" in told)
    assert ("twice the known feed × 2 ms" in told) == (of_map or of_touches)


def test_predicted_maps_contain_neither_uncertainty_nor_delay() -> None:
    predicted = replace(MEASURED, covariance=Covariance.none(1), feed=None)
    no_uncertainty = "this map is a prediction without an uncertainty"
    no_delay = "the touches were made at 80 mm/min, and a predicted map contains no signal delay"
    fed = replace(QUIET, feeds=(60.0, 80.0))
    assert _told(fed, predicted, no_uncertainty)
    assert _told(fed, predicted, no_delay)
    assert _told(replace(fed, feeds=None), predicted, no_uncertainty)
    assert not _told(replace(fed, feeds=None), predicted, "signal delay")
    measured = replace(predicted, covariance=Covariance.independent([1e-8]))
    assert fed.warnings(measured) == []


@pytest.mark.parametrize(("degrees", "expected"), [(9.9, False), (10.1, True), (45.0, True)])
def test_approaches_more_than_ten_degrees_off(degrees: float, expected: bool) -> None:
    """Of a map that can contain a delay: measured, and without one of its own."""
    summary = replace(QUIET, least_closing=float(np.cos(np.radians(degrees))))
    words = f"approaches are up to {degrees:.0f}° off the normal"
    assert _told(summary, MEASURED, words) == expected
    assert not _told(summary, replace(MEASURED, repeatability=0.0), "off the normal")
    assert not _told(summary, replace(MEASURED, **DELAYED), "off the normal")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("middle", "expected"),
    [(None, False), (0.59, False), (0.61, True), (-0.59, False), (-0.61, True)],
)
def test_deviations_of_a_fifth_of_the_tip_radius(middle: float | None, expected: bool) -> None:
    """The radius is 3 mm."""
    words = "" if middle is None else f"deviations are about {middle:+.3f} mm, of the size"
    summary = replace(QUIET, middle=middle)
    assert bool(summary.warnings(MEASURED)) == expected
    assert _told(summary, MEASURED, words) == expected
