"""Pictures of points contain the values of the result, with the stated magnification."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.frames import parse_placement
from pretravel.files.touches_csv import read_touches
from pretravel.measurement.compensation import apply
from pretravel.measurement.points import Points
from pretravel.qualification.qualifying import qualify
from pretravel.show.chart import SpaceChart
from pretravel.show.chart_marks import SpaceLines, SpaceMesh, SpacePoints
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.part_pictures import body_marks, part_view
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.cad.triangles import face_triangles
from pretravel.surface.specification import parse_surface
from pretravel.tasks.compensate.picture import deviation_before, points_view, touches_view
from tests.support.examples import EXAMPLES


@pytest.fixture(scope="module")
def points() -> Points:
    made = qualify(read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, kind="mean",
                   tip_diameter=6.0)  # fmt: skip
    return apply(read_touches(EXAMPLES / "part_touches.csv"), made.pretravel_map)


@pytest.fixture(scope="module")
def part() -> Part:
    shape = parse_surface(str(EXAMPLES / "part.step"))
    assert isinstance(shape, Part)
    return shape


def _lines(chart: object, name: str) -> SpaceLines:
    assert isinstance(chart, SpaceChart)
    (found,) = (m for m in chart.marks if isinstance(m, SpaceLines) and m.name.startswith(name))
    return found


def test_whiskers_have_the_stated_magnification(points: Points, part: Part) -> None:
    view = points_view(points, nominal=part)
    before = deviation_before(points)
    assert points.deviation is not None
    assert before is not None
    for chart, name, deviation in zip(
        view.charts, ("before", "after"), (before, points.deviation), strict=False
    ):
        lines = _lines(chart, f"deviation {name}")
        factor = float(lines.name.split()[-2])
        lengths = np.sum((lines.ends - lines.starts) * points.normals, axis=1)
        assert lengths == pytest.approx(factor * deviation, abs=1e-9)
        assert lines.colour == name
    # Without compensation, points lie inside by the pretravel.
    assert before == pytest.approx(points.deviation - points.pretravel, abs=2e-3)


def test_the_part_lies_below_the_points(points: Points, part: Part) -> None:
    chart = points_view(points, nominal=part).charts[0]
    assert isinstance(chart, SpaceChart)
    mesh = next(mark for mark in chart.marks if isinstance(mark, SpaceMesh))
    foot = _lines(chart, "deviation before").starts
    corners = mesh.vertices[mesh.triangles]
    gap = np.linalg.norm(corners.mean(axis=1)[None] - foot[:, None], axis=2).min(axis=1)
    largest = np.linalg.norm(np.diff(corners, axis=1), axis=2).max()
    assert gap.max() < largest


def test_a_placed_part_moves_with_its_points(part: Part) -> None:
    place = parse_placement("100,0,0,0,0,90")
    here, there = body_marks(part)[0], body_marks(part, place)[0]
    assert isinstance(here, SpaceMesh)
    assert isinstance(there, SpaceMesh)
    assert there.vertices == pytest.approx(place.points(here.vertices))


def test_a_small_range_of_u_is_not_stretched(points: Points) -> None:
    chart = points_view(points).charts[-1]
    assert isinstance(chart, SpaceChart)
    assert chart.scale is not None
    assert chart.scale.low == 0.0
    assert chart.scale.high == pytest.approx(1e3 * points.standard_uncertainty.max())


def test_points_are_labelled_and_have_their_rows(points: Points) -> None:
    figure = plotly_figure(points_view(points).charts[1])
    trace = figure["data"][-1]
    assert trace["customdata"] == [*range(len(points))]
    assert points.deviation is not None
    assert f"after {1e3 * points.deviation[7]:+.2f} µm" in trace["text"][7]


def test_without_a_nominal_there_is_no_before(points: Points) -> None:
    view = points_view(replace(points, deviation=None))
    assert [chart.title for chart in view.charts] == ["pretravel", "standard uncertainty u"]


def test_touches_show_their_travel(points: Points) -> None:
    touches = read_touches(EXAMPLES / "part_touches.csv")
    chart = touches_view(touches, points.pretravel).charts[0]
    assert isinstance(chart, SpaceChart)
    (dots,) = chart.marks
    assert isinstance(dots, SpacePoints)
    assert dots.values is not None
    assert dots.values == pytest.approx(1e3 * points.pretravel)


def test_triangles_cover_faces_and_no_holes(tmp_path: Path) -> None:
    from netgen.occ import Box, Cylinder, Pnt, Z

    radius, height = 5.0, 10.0
    solid = Box((0, 0, 0), (40, 30, height)) - Cylinder(Pnt(15, 15, -1), Z, radius, 20)
    solid.WriteStep(str(tmp_path / "plate.step"))
    plate = read_step_part(tmp_path / "plate.step")
    area = 0.0
    for face in plate.faces:
        triangles = face_triangles(face, faces=len(plate.faces))
        a, b, c = np.moveaxis(triangles.points[triangles.corners], 1, 0)
        area += 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    flat = 2.0 * (40.0 * 30.0 - np.pi * radius**2) + 2.0 * (40.0 + 30.0) * height
    # A circle of 36 chords loses 0.5 % of its area.
    assert area == pytest.approx(flat + 2.0 * np.pi * radius * height, rel=2e-3)


def test_every_triangle_of_a_scene_has_a_normal(part: Part) -> None:
    """Plotly gives none where the square of two sides' product, in its units, is not above a limit:
    the triangle is dark."""
    figure = plotly_figure(part_view(part).charts[0])
    scene = figure["layout"]["scene"]
    unit = [
        scene["aspectratio"][name] / np.ptp(scene[f"{name}axis"]["range"])
        for name in ("x", "y", "z")
    ]
    smallest = np.inf
    for mesh in figure["data"]:
        if mesh["type"] == "mesh3d":
            places = np.column_stack([mesh["x"], mesh["y"], mesh["z"]]) * unit
            a, b, c = (places[mesh[corner]] for corner in "ijk")
            square = np.sum(np.cross(b - a, c - a) ** 2, axis=1)
            assert square.min() > mesh["lighting"].get("facenormalsepsilon", 1e-6)
            smallest = min(smallest, float(square.min()))
    assert smallest < 1e-6  # the default would be in the way


def test_every_face_has_its_number(part: Part) -> None:
    (chart,) = part_view(part).charts
    assert isinstance(chart, SpaceChart)
    dots = next(mark for mark in chart.marks if isinstance(mark, SpacePoints))
    assert [label.split(":")[0] for label in dots.labels] == [
        f"face {face.number}" for face in part.faces
    ]
