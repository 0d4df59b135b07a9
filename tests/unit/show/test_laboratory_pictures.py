"""Pictures of rig, separation, standards, features and budgets contain the values of the result."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.measure.picture import features_view
from pretravel.drawing.tolerances.tolerances import FeatureTolerances, inspect_feature
from pretravel.files.touches_csv import read_touches
from pretravel.laboratory.rig.calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.rig_csv import read_rig_trace
from pretravel.laboratory.separation.separation import separate
from pretravel.laboratory.separation.separation_csv import read_multi_step_readings
from pretravel.laboratory.standards.iso230_10 import plane_pattern_36
from pretravel.laboratory.standards.standard_check import CalibratedSphere
from pretravel.laboratory.tasks.check.picture import check_view
from pretravel.laboratory.tasks.check.report import standards_document
from pretravel.laboratory.tasks.rig.report import rig_view, trace_view
from pretravel.laboratory.tasks.separate.report import separation_view
from pretravel.show.budget_pictures import budget_view
from pretravel.show.chart import PlaneChart, PolarChart, SpaceChart
from pretravel.show.chart_marks import (
    Area,
    Bars,
    Dots,
    LineMark,
    Rule,
    SpaceLines,
    SpaceMesh,
    SpacePoints,
)
from pretravel.task.standards import STANDARDS
from pretravel.touches import Touches
from pretravel.uncertainty.gum import Budget, Component
from tests.support.examples import EXAMPLES
from tests.support.feature_points import feature_points, features

TRACES = [read_rig_trace(path) for path in sorted((EXAMPLES / "rig").glob("*.csv"))]


@pytest.fixture(scope="module")
def calibration() -> RigCalibration:
    return calibrate_rig([rig_touch(trace) for trace in TRACES])


def test_rig_shows_every_touch_and_no_line_between_directions(calibration: RigCalibration) -> None:
    chart = rig_view(calibration).charts[0]
    assert isinstance(chart, PolarChart)
    assert not any(isinstance(mark, LineMark) for mark in chart.marks)
    touches = next(m for m in chart.marks if isinstance(m, Dots) and m.name == "single touches")
    wanted = {touch.trace: 1e3 * touch.pretravel for touch in calibration.touches}
    assert dict(zip(touches.labels, touches.y.tolist(), strict=True)) == pytest.approx(wanted)


def test_a_direction_along_the_axis_leaves_the_plane_a_circle(calibration: RigCalibration) -> None:
    """Ren 2020, Figure 8, with +Z: the directions across the axis stay around the circle, all of
    them are on the sphere, and forces (8c) are those of the touches, in the plane."""
    along = [replace(touch, trace=f"rig_+Z_{k}") for k, touch in enumerate(calibration.touches[:2])]
    both = calibrate_rig([*calibration.touches, *along])
    forces = [0.1 + 0.01 * k for k in range(len(both.touches))]
    forces[-2:] = [math.nan, math.nan]
    plane, sphere, repeatability, _, force = rig_view(both, "", forces).charts
    assert isinstance(plane, PolarChart)
    (means,) = [m for m in plane.marks if isinstance(m, Dots) and m.name == "mean of a direction"]
    across = [d for d in both.directions if d.across]
    assert len(across) == len(both.directions) - 1 == 3
    assert means.y == pytest.approx([1e3 * d.pretravel for d in across])
    assert isinstance(sphere, SpaceChart)
    mesh, _, placed = sphere.marks
    assert isinstance(placed, SpacePoints)
    assert isinstance(mesh, SpaceMesh)
    # A point is its pretravel away from the middle, in the direction of its name.
    cosine, sine = math.cos(math.pi / 3.0), math.sin(math.pi / 3.0)
    named = {"+Z": (0, 0, 1), "000": (1, 0, 0), "060": (cosine, sine, 0), "090": (0, 1, 0)}
    for d, point in zip(both.directions, placed.positions, strict=True):
        (way,) = [way for name, way in named.items() if d.name.endswith(name)]
        own = [1e3 * t.pretravel for t in both.touches if t.trace.startswith(f"rig_{d.name[-3:]}")]
        if d.name.endswith("+Z"):
            own = [1e3 * t.pretravel for t in both.touches[-2:]]
        assert point == pytest.approx(np.mean(own) * np.array(way), abs=1e-9)
    mean = np.mean([1e3 * d.pretravel for d in both.directions])
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(mean)
    assert isinstance(repeatability, PlaneChart)
    assert repeatability.x.unit == "°"
    assert isinstance(force, PolarChart)
    (drawn,) = [m for m in force.marks if isinstance(m, Dots)]
    wanted = [
        np.mean([f for f, t in zip(forces, both.touches, strict=True)
                 if t.trace.startswith(d.name) or d.name in t.trace])
        for d in across
    ]  # fmt: skip
    assert drawn.y == pytest.approx(wanted)
    assert np.degrees(drawn.x) == pytest.approx([0.0, 60.0, 90.0])


def test_a_touch_is_at_its_own_direction_alone(calibration: RigCalibration) -> None:
    """rig_000 is the beginning of rig_000_090, a direction of its own."""
    touches = [
        replace(touch, trace=f"{name}_{k}")
        for name in ("rig_000", "rig_000_090")
        for k, touch in enumerate(calibration.touches[:3])
    ]
    chart = rig_view(calibrate_rig(touches)).charts[0]
    assert isinstance(chart, PolarChart)
    dots = next(m for m in chart.marks if isinstance(m, Dots) and m.name == "single touches")
    assert list(dots.labels) == [touch.trace for touch in touches]
    assert np.degrees(dots.x) == pytest.approx([0.0] * 3 + [90.0] * 3)


def test_intervals_of_the_repeatability_are_whole(calibration: RigCalibration) -> None:
    chart = rig_view(calibration).charts[1]
    assert isinstance(chart, PlaneChart)
    assert chart.y.low is None
    assert chart.y.high is None
    lines = next(mark for mark in chart.marks if isinstance(mark, LineMark))
    highs = [1e3 * direction.repeatability.high for direction in calibration.directions]
    assert lines.y[1::3] == pytest.approx(np.array(highs))


def test_a_trace_keeps_its_edges_and_events(calibration: RigCalibration) -> None:
    trace, touch = TRACES[0], calibration.touches[0]
    _, signals, contact = trace_view(trace, touch).charts
    assert isinstance(signals, PlaneChart)
    assert isinstance(contact, PlaneChart)
    level = signals.marks[1]
    assert isinstance(level, LineMark)
    falls = trace.time[np.flatnonzero(np.diff(trace.trigger.astype(int)) == -1) + 1]
    assert falls[0] in level.x
    events = [mark.value for mark in contact.marks if isinstance(mark, Rule)]
    assert events == pytest.approx([1e3 * value for value in (touch.r0, touch.r1, touch.r2,
                                                               touch.r3)])  # fmt: skip


def test_separation_shows_errors_with_two_u() -> None:
    result = separate(read_multi_step_readings(EXAMPLES / "redundancy_24x24.csv"),
                      method="least-squares")  # fmt: skip
    view = separation_view(result)
    for chart, error, u in zip(
        view.charts[::2],
        (result.machine_error, result.probe_error),
        (result.u_machine_error, result.u_probe_error),
        strict=True,
    ):
        assert isinstance(chart, PlaneChart)
        dots = next(mark for mark in chart.marks if isinstance(mark, Dots))
        assert dots.y == pytest.approx(1e3 * error)
        assert dots.u == pytest.approx(2e3 * u)


def test_residuals_of_a_standard_are_at_their_places() -> None:
    touches = read_touches(EXAMPLES / "sphere_touches.csv")
    check = STANDARDS["iso10360-5"].procedure(
        touches, CalibratedSphere(24.9987), limits={"form": 0.002}
    )
    space, plane = check_view(check).charts
    worst = max((fitted.fit for fitted in check.sets), key=lambda fit: fit.form)
    assert isinstance(space, SpaceChart)
    dots = next(mark for mark in space.marks if isinstance(mark, SpacePoints))
    assert dots.values == pytest.approx(1e3 * worst.residuals)
    whisker = next(m for m in space.marks if isinstance(m, SpaceLines) and "magnified" in m.name)
    factor = float(whisker.name.split()[-2])
    lengths = np.linalg.norm(whisker.ends, axis=1) - worst.radius
    assert lengths == pytest.approx(factor * worst.residuals)
    assert isinstance(plane, PlaneChart)
    limits = [m.value for m in plane.marks if isinstance(m, Rule) and m.colour == "limit"]
    assert np.ptp(limits) == pytest.approx(2.0)


@pytest.mark.parametrize("whole", [True, False])
def test_a_limit_is_drawn_at_the_set_that_is_drawn(whole: bool) -> None:
    """The equator alone is a circle; with an upper ring that is 3 µm rougher, it is a sphere."""
    ring = plane_pattern_36()
    upper = from_angles(np.radians(30.0), np.radians(np.arange(0, 360, 45)))
    n = np.concatenate([ring, upper]) if whole else ring
    distance = np.full(len(n), 15.5)
    distance[36::2] += 0.003  # every other touch of the upper ring: no sphere takes that up
    limits = {"form2d": 0.010, "form3d": 0.020}
    touches = Touches(n * distance[:, None], n)
    check = STANDARDS["iso230-10"].procedure(touches, CalibratedSphere(25.0), limits=limits)
    place, plane = check_view(check).charts
    assert isinstance(place, SpaceChart if whole else PolarChart)
    assert place.frame == "probe"
    assert isinstance(plane, PlaneChart)
    drawn = [m.value for m in plane.marks if isinstance(m, Rule) and m.colour == "limit"]
    assert np.ptp(drawn) == pytest.approx(20.0 if whole else 10.0)  # µm


def test_repeats_alone_have_a_report_without_residuals() -> None:
    """Ten touches in one direction are not spread as a sphere: their unit is not judged."""
    n = np.tile([[0.0, 0.0, 1.0]], (10, 1))
    distance = 15.5 + np.linspace(0.0, 0.001, 10)
    check = STANDARDS["iso230-10"].procedure(
        Touches(n * distance[:, None], n), CalibratedSphere(25.0)
    )
    assert [figure.name for figure in check.figures] == ["R_SPT"]
    assert standards_document(check).pictures == ()


def test_a_feature_shows_before_after_and_its_tolerance() -> None:
    positions, normals = features()["cone"]
    cone = measure_feature(feature_points(positions, normals), "cone", at=(0.0, 0.0, 1.0))
    inspected = inspect_feature(cone, FeatureTolerances((12.0, 13.0)))
    (chart,) = features_view([inspected]).charts
    assert isinstance(chart, PolarChart)
    after = next(m for m in chart.marks if isinstance(m, Dots) and m.colour == "after")
    assert after.y == pytest.approx(1e3 * cone.association.residuals)
    zone = next(mark for mark in chart.marks if isinstance(mark, Area))
    assert cone.association.half_angle is not None
    # The zone is 1 mm wide in diameter; distances from a cone are square to its flank.
    width = 500.0 * math.cos(cone.association.half_angle)
    assert zone.high[0] - zone.low[0] == pytest.approx(width)


@pytest.mark.parametrize("kind", ["bore", "plane"])
def test_the_line_of_no_deviation_has_the_name_of_the_association(kind: str) -> None:
    """It was called least squares where the feature was an extreme one."""
    positions, normals = features()[kind]
    for association, name in (("gaussian", "least squares"), ("minimum-zone", "minimum-zone")):
        found = measure_feature(feature_points(positions, normals), kind, association=association)
        (chart,) = features_view([inspect_feature(found, FeatureTolerances())]).charts
        assert isinstance(chart, PolarChart | PlaneChart)
        assert [mark.name for mark in chart.marks if isinstance(mark, Rule)] == [name]


def test_a_budget_joins_negligible_sources() -> None:
    big = (Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, dof=9))
    small = tuple(Component(f"small {k}", "B", 1e-8) for k in range(3))
    (chart,) = budget_view(Budget((*big, *small))).charts
    assert isinstance(chart, PlaneChart)
    assert chart.y.categories[:3] == ("repeats", "scale", "3 smaller sources")
    sources, totals = chart.marks
    assert isinstance(sources, Bars)
    assert isinstance(totals, Bars)
    assert np.linalg.norm(sources.values) == pytest.approx(totals.values[0])
    assert totals.values[0] == pytest.approx(0.5)
