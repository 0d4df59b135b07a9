"""Charts over directions: what they contain is what the result contains, with its unit."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import azimuth_angle, fibonacci_cap, from_angles, polar_angle
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.touch_plan import plan_touches
from pretravel.show.chart import PlaneChart, PolarChart, Scale, SpaceChart, TopView
from pretravel.show.chart_marks import Dots
from pretravel.show.direction_charts import (
    body_chart,
    chart_by_place,
    grid_triangles,
    scattered_top_view,
    touched_levels,
)
from pretravel.tasks.plan_touches.picture import touch_plan_view
from pretravel.tasks.qualify.picture import qualification_view
from pretravel.tasks.qualify.update_report import map_update_view
from tests.support.example_maps import example_map, example_qualification
from tests.support.reference_touches import sphere_touches


class TestQualification:
    def test_a_residual_stands_where_its_touch_was_made(self) -> None:
        """The middle of the repeats of a direction is the direction, in the view from above."""
        made = example_qualification()
        by_place = qualification_view(made).charts[2]
        assert isinstance(by_place, PolarChart)
        assert (by_place.radius.unit, by_place.scale and by_place.scale.unit) == ("°", "µm")
        dots = by_place.marks[0]
        assert isinstance(dots, Dots)
        assert dots.values == pytest.approx(made.residuals / MICROMETRE)
        inside = made.contact_normals @ made.pretravel_map.rotation
        polar, azimuth = polar_angle(inside) / DEGREE, azimuth_angle(inside)
        for group in np.unique(made.groups):
            rows = made.groups == group
            drawn = np.mean(dots.y[rows] * np.exp(1j * dots.x[rows]))
            touched = np.mean(polar[rows] * np.exp(1j * azimuth[rows]))
            assert abs(drawn - touched) < 0.05  # [deg]

    def test_every_touch_has_its_label(self) -> None:
        made = example_qualification()
        by_place = qualification_view(made).charts[2]
        assert isinstance(by_place, PolarChart)
        dots = by_place.marks[0]
        assert isinstance(dots, Dots)
        assert dots.labels[4].startswith("touch 5: polar ")
        assert dots.labels[4].endswith(f"residual {made.residuals[4] / MICROMETRE:+.2f} µm")

    def test_the_body_is_as_far_away_as_the_pretravel(self) -> None:
        made = example_qualification()
        body = qualification_view(made).charts[3]
        assert isinstance(body, SpaceChart)
        assert (body.frame, body.unit) == ("probe", "µm")
        points = body.marks[1]
        assert np.linalg.norm(points.positions, axis=1) == pytest.approx(  # type: ignore[union-attr]
            made.observed / MICROMETRE
        )

    def test_the_map_from_above_has_the_values_of_the_map(self) -> None:
        made = example_qualification()
        top = qualification_view(made).charts[0]
        assert isinstance(top, TopView)
        at = from_angles(top.polar_deg[20] * DEGREE, np.array([top.azimuth_deg[40] * DEGREE]))
        value = made.pretravel_map.pretravel(at @ made.pretravel_map.rotation.T)
        assert top.values[20, 40] == pytest.approx(value[0] / MICROMETRE)


def test_triangles_of_a_body_show_their_outside() -> None:
    azimuth = np.arange(0.0, 360.0, 10.0)
    body = body_chart(np.arange(10.0, 91.0, 10.0), azimuth, np.full((9, 36), 5.0))
    mesh = body.marks[0]
    corners = mesh.vertices[mesh.triangles.astype(int)]  # type: ignore[union-attr]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sum(normals * corners.mean(axis=1), axis=1) > 0.0).all()


def test_no_body_where_there_is_no_pretravel() -> None:
    values = np.full((2, 4), 5.0)
    values[1, 0] = np.nan
    body = body_chart(np.array([45.0, 90.0]), np.arange(0.0, 360.0, 90.0), values)
    assert not np.any(body.marks[0].triangles == 4)  # type: ignore[union-attr]
    assert len(grid_triangles(2, 4)) == 8
    values[1, 0] = -1.0
    assert "below zero" in body_chart(np.array([45.0, 90.0]), np.arange(0.0, 360, 90), values).note


def test_levels_are_spread_from_the_equator_to_the_pole() -> None:
    many = touched_levels(fibonacci_cap(2000))
    assert len(many) == 4
    assert many[0] == 90.0
    assert many[-1] >= 15.0
    assert np.ptp(np.diff(many)) <= 5.0


def test_a_ring_around_what_is_named() -> None:
    places = from_angles(0.5 * np.pi, np.radians([0.0, 90.0, 180.0]))
    scale = Scale("a", "µm", -1.0, 1.0, signed=True)
    chart = chart_by_place(places, np.zeros(3), scale, "", ringed=("outlier", [1]))
    ring = chart.marks[1]
    assert isinstance(ring, Dots)
    assert (ring.name, ring.x.tolist()) == ("outlier", pytest.approx([0.5 * np.pi]))


def test_scattered_values_of_a_plane_are_that_plane() -> None:
    """Linear interpolation of a linear function is exact inside of the directions."""
    places = fibonacci_cap(400)
    polar, azimuth = polar_angle(places) / DEGREE, azimuth_angle(places)
    top = scattered_top_view("", places, polar * np.cos(azimuth), Scale("", "", 0.0, 1.0))
    inside = top.polar_deg < 80.0
    expected = top.polar_deg[inside, None] * np.cos(np.radians(top.azimuth_deg))
    assert top.values[inside] == pytest.approx(expected, abs=1e-6)
    assert np.isfinite(top.values).mean() > 0.99  # a few at the rim are far from all places


def test_the_update_shows_the_touches_before_and_after() -> None:
    old = example_map()
    normals = fibonacci_cap(9)
    result = update_map(sphere_touches(1.01 * old.pretravel(normals), normals), old, 25.0)
    new, change, touches = map_update_view(result).charts
    assert isinstance(new, TopView)
    assert isinstance(change, TopView)
    assert change.scale.signed
    assert isinstance(touches, PlaneChart)
    before, after = touches.marks[1:]
    assert isinstance(before, Dots)
    assert isinstance(after, Dots)
    assert (before.colour, after.colour, touches.y.unit) == ("before", "after", "µm")
    assert before.y == pytest.approx(result.changes / MICROMETRE)
    assert after.y == pytest.approx(result.residuals / MICROMETRE)


def test_a_plan_is_drawn_in_one_scale_with_numbered_touches() -> None:
    plan = plan_touches(example_map(), 6)
    today, then = touch_plan_view(plan).charts
    assert isinstance(today, TopView)
    assert isinstance(then, TopView)
    assert today.scale == then.scale
    assert then.numbered
    assert then.node_polar_deg == pytest.approx(polar_angle(plan.directions) / DEGREE)
    assert np.nanmax(then.values) < np.nanmax(today.values)
