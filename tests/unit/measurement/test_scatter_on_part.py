"""Touches that scatter more on the part than on the reference: in u where repeats show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply, compensation_warnings
from pretravel.measurement.point_errors import point_sources, total_covariance
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.points_summary import TouchSummary
from pretravel.measurement.scatter_on_part import ScatterOnPart
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.touches import Touches
from tests.support.example_maps import mean_map

OF_MAP, OF_PART = 3e-4, 1.5e-3
MAP = replace(
    mean_map(0.010),
    support=DirectionSupport(fibonacci_cap(200, 1.8)),
    repeatability=OF_MAP,
    repeatability_dof=50.0,
)
SIDES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def _compensated(
    places: np.ndarray, normals: np.ndarray, errors: np.ndarray
) -> tuple[Touches, Points]:
    """Of a ball of 6 mm and a pretravel of 10 µm."""
    at = places + (3.0 - 0.010 + errors)[:, None] * normals
    touches = Touches(at, normals)
    return touches, apply(touches, MAP)


def _said(touches: Touches, points: Points) -> str:
    return " ".join(compensation_warnings(TouchSummary.of(touches, points, MAP), MAP))


@pytest.mark.parametrize("scatter", [OF_MAP, OF_PART])
def test_repeated_places_show_the_scatter_of_the_part(scatter: float) -> None:
    """Twelve places twice. χ² was 20 with five times the scatter of the map, and nothing said."""
    rng, chi = np.random.default_rng(41), []
    for _ in range(20):
        normals = np.repeat(fibonacci_cap(12, 1.4), 2, axis=0)
        errors = scatter * rng.standard_normal(24)
        touches, points = _compensated(50.0 * normals, normals, errors)
        chi.append(np.mean((errors / points.standard_uncertainty) ** 2))
        assert ("same place" in _said(touches, points)) == (scatter > OF_MAP)
    # Of 20 sets with 12 degrees of freedom of s²: 1.2 ± 0.15; 0.9 with the u of the map's mean.
    assert 0.7 < np.mean(chi) < 1.6


@pytest.mark.parametrize(
    ("scatter", "bow", "touches", "said"),
    [
        (OF_MAP, 0.0, 8, False),
        (OF_PART, 0.0, 8, True),
        (OF_MAP, 3e-3, 16, False),
        (OF_PART, 3e-3, 16, True),
    ],
)
def test_faces_show_a_scatter_that_u_does_not_contain(
    scatter: float, bow: float, touches: int, said: bool
) -> None:
    """Four faces that are bowed or not: a bow of faces with many touches is no scatter."""
    rng = np.random.default_rng(43)
    normals = np.repeat(SIDES, touches, axis=0)
    beside = rng.uniform(-30.0, 30.0, normals.shape) * (1.0 - np.abs(normals))
    bulge = bow * np.sum((beside / 30.0) ** 2, axis=1)
    errors = bulge + scatter * rng.standard_normal(len(normals))
    given, points = _compensated(40.0 * normals + beside, normals, errors)
    assert ("faces scatter by" in _said(given, points)) == said
    assert points.standard_uncertainty.max() < 1.5 * OF_MAP


def test_one_wrong_repeat_is_not_the_scatter_of_all() -> None:
    """A false trigger of 20 µm at one of six places is no reason for u of all points."""
    rng, normals = np.random.default_rng(47), np.repeat(fibonacci_cap(6, 1.4), 2, axis=0)
    errors = OF_MAP * rng.standard_normal(12)
    errors[3] += 0.020
    _, points = _compensated(50.0 * normals, normals, errors)
    assert points.standard_uncertainty.max() < 1.5 * OF_MAP


def test_parts_of_a_table_show_it_together() -> None:
    """Three places twice with twice the scatter show nothing, twenty times as many do."""
    alone = ScatterOnPart(dof_of_map=50.0)
    few = replace(alone, repeats=replace(alone.repeats, squares=1.08e-6, expected=2.7e-7, dof=3.0))
    assert few.of_touch is None
    many = few
    for _ in range(19):
        many = many.joined(few)
    assert many.of_touch == pytest.approx(few.repeats.deviation)


def _pairs(rng: np.random.Generator, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Normals of places that are touched twice, and errors with the scatter of the part."""
    normals = np.repeat(fibonacci_cap(count, 1.4), 2, axis=0)
    return normals, OF_PART * rng.standard_normal(2 * count)


def test_the_points_carry_what_their_repeats_showed() -> None:
    """Report, budgets and joined points use the comparison of the compensation."""
    normals, errors = _pairs(np.random.default_rng(53))
    touches, points = _compensated(50.0 * normals, normals, errors)
    assert points.scatter is not None
    seen = points.scatter.of_touch
    own = np.sqrt(np.mean(np.diff(errors.reshape(-1, 2), axis=1) ** 2) / 2.0)
    assert seen == pytest.approx(own, rel=0.02)  # the pretravel of inclined touches is that of all
    summary = TouchSummary.of(touches, points, MAP)
    assert summary.scatter.of_touch == seen
    sources = point_sources(touches, points, MAP)
    whole = np.diag(total_covariance(sources).matrix)
    np.testing.assert_allclose(whole, points.standard_uncertainty**2, rtol=1e-9)
    both = joined_points([points, points]).scatter
    assert both is not None
    assert both.repeats.dof == 24.0


def test_a_separation_is_widened_by_the_repeats_of_the_part() -> None:
    """u of the points was that of the separation, and the report said that it was larger."""
    around = np.arange(4) * 0.5 * np.pi
    half = np.full(4, 0.5 * OF_MAP**2)
    separated = TouchScatter(around, half, around, half)
    normals, errors = _pairs(np.random.default_rng(59))
    touches, _ = _compensated(50.0 * normals, normals, errors)
    points = apply(touches, MAP, scatter=separated)
    assert points.scatter is not None
    assert "same place" in _said(touches, points)
    seen = points.scatter.of_touch
    assert seen is not None
    # The map and the tip radius add less than a tenth to the variance of a touch.
    assert points.standard_uncertainty.min() == pytest.approx(seen, rel=0.05)
