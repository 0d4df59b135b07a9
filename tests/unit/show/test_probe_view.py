"""The pictures of a probe and of its prediction: what they contain follows from the description."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.units import MICROMETRE
from pretravel.design.tasks.predict.view import levels_around, prediction_view
from pretravel.design.tasks.probes.view import ball_centers, probe_view, space_chart
from pretravel.prediction.catalogue import catalogue_names, load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.trigger import predict
from pretravel.show.chart import PlaneChart, PolarChart, SpaceChart
from pretravel.show.chart_marks import Area, LineMark, Note, SpaceArrow, SpaceMesh
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.solid_meshes import cylinder_mesh, sphere_mesh


def _mesh(probe: Probe, name: str) -> SpaceMesh:
    (found,) = (
        mark for mark in space_chart(probe).marks
        if isinstance(mark, SpaceMesh) and mark.name.startswith(name)
    )  # fmt: skip
    return found


@pytest.mark.parametrize("name", catalogue_names())
def test_rods_touch_their_balls(name: str) -> None:
    """From the axis of its rod, the centre of a ball is as far as both radii together."""
    probe = load_probe(name)
    radii = probe.tripod.rod_radius + probe.seats.ball_radius
    for center, azimuth in zip(
        ball_centers(probe), np.repeat(probe.tripod.rod_azimuths, 2), strict=True
    ):
        axis = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        assert np.linalg.norm(np.cross(center, axis)) == pytest.approx(radii, rel=1e-12)
        assert center @ axis == pytest.approx(probe.tripod.radius)
        assert center[2] < 0.0  # the balls carry the rods


def test_solids_have_the_sizes_of_the_description() -> None:
    probe = load_probe("omp40-2")
    balls, rods = _mesh(probe, "seat balls"), _mesh(probe, "rods")
    nearest = np.linalg.norm(balls.vertices[:, None] - ball_centers(probe), axis=2).min(axis=1)
    assert nearest == pytest.approx(probe.seats.ball_radius)
    assert np.abs(rods.vertices[:, 2]).max() == pytest.approx(probe.tripod.rod_radius)
    hub, tip, stem = (_mesh(probe, name) for name in ("hub", "tip", "stylus 2"))
    assert probe.hub is not None
    assert hub.vertices[:, 2].max() == pytest.approx(0.5 * probe.hub.height)
    assert hub.vertices[:, 2].min() == pytest.approx(-probe.hub_offset)
    assert stem.vertices[:, 2].min() == pytest.approx(-probe.lever)
    assert tip.vertices[:, 2].min() == pytest.approx(-probe.lever - probe.tip.radius)
    (spring,) = (mark for mark in space_chart(probe).marks if isinstance(mark, SpaceArrow))
    assert spring.vector[2] < 0.0  # presses the rods into their seats
    assert spring.name == "spring 5.91 N"


def test_a_hub_is_named_rigid_only_where_it_is_not_described() -> None:
    probe = load_probe("omp40-2")
    assert "rigid" not in space_chart(probe).note
    bare = replace(probe, hub=None)
    assert "rigid" in space_chart(bare).note
    assert not any(
        isinstance(mark, SpaceMesh) and mark.name.startswith("hub")
        for mark in space_chart(bare).marks
    )
    side = probe_view(bare).charts[1]
    assert isinstance(side, PlaneChart)
    assert any(isinstance(mark, Note) and "no shape" in mark.text for mark in side.marks)


def test_a_page_shows_the_note_of_a_chart() -> None:
    """As text: a part's file may have any name."""
    chart = replace(space_chart(replace(load_probe("omp40-2"), hub=None)), note="rigid <b>")
    layout = plotly_figure(chart)["layout"]
    assert "rigid &lt;b&gt;" in layout["title"]["text"]
    plain = plotly_figure(replace(chart, note=""))["layout"]
    assert layout["margin"]["t"] > plain["margin"]["t"]


def test_words_beside_short_pieces_do_not_overlap() -> None:
    probe = load_probe("omp40-2")
    pieces = tuple(replace(probe.stylus[0], length=1.0) for _ in range(8))
    side = probe_view(replace(probe, stylus=(*pieces, *probe.stylus))).charts[1]
    assert isinstance(side, PlaneChart)
    heights = [mark.y for mark in side.marks if isinstance(mark, Note)]
    assert len(heights) == 12  # hub, ten pieces, tip
    assert np.max(np.diff(heights)) < -3.0  # [mm] of a picture of about 100 mm


def test_solid_meshes_are_closed_and_show_their_outside() -> None:
    """Their volumes by the divergence theorem, little below those of the round solids."""
    for (vertices, triangles), volume in (
        (cylinder_mesh([0.0, 0.0, 0.0], [3.0, 4.0, 12.0], 2.0), np.pi * 4.0 * 13.0),
        (sphere_mesh([1.0, 2.0, 3.0], 2.0), 4.0 / 3.0 * np.pi * 8.0),
    ):
        corners = vertices[triangles]
        found = float(np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2]))) / 6.0
        assert 0.93 * volume < found < volume


class TestPrediction:
    def test_levels_do_not_squeeze_each_other(self) -> None:
        """The force near the pole is several times that of the equator."""
        polar = np.arange(0.0, 91.0, 5.0)
        trigger = predict(load_probe("omp40-2"), _grid(polar))
        force = prediction_view(trigger).charts[0]
        assert isinstance(force, PolarChart)
        assert (force.radius.unit, force.frame) == ("N", "probe")
        largest = [float(mark.y.max()) for mark in force.marks if isinstance(mark, LineMark)]
        assert len(largest) == 5
        assert max(largest) < 2.0 * min(largest)
        assert max(trigger.force) > 5.0 * min(trigger.force)

    def test_shares_end_at_the_pretravel(self) -> None:
        trigger = predict(load_probe("omp40-2"), _grid(np.array([90.0])))
        shares = prediction_view(trigger).charts[2]
        assert isinstance(shares, PlaneChart)
        top = [mark for mark in shares.marks if isinstance(mark, Area)][-1]
        assert top.high == pytest.approx(trigger.pretravel / MICROMETRE)

    def test_the_body_and_the_range_are_those_of_the_prediction(self) -> None:
        trigger = predict(load_probe("omp40-2"), _grid(np.arange(0.0, 91.0, 15.0)))
        body, force = prediction_view(trigger).charts[2:4]
        assert isinstance(body, SpaceChart)
        mesh = body.marks[0]
        assert isinstance(mesh, SpaceMesh)
        assert mesh.values is not None
        assert sorted(mesh.values) == pytest.approx(sorted(trigger.pretravel / MICROMETRE))
        assert isinstance(force, PlaneChart)
        area = force.marks[0]
        assert isinstance(area, Area)
        assert (area.low.min(), area.high.max()) == (trigger.force.min(), trigger.force.max())

    def test_few_directions(self) -> None:
        probe = load_probe("omp40-2")
        (one,) = prediction_view(predict(probe, [[1.0, 0.0, 0.0]])).charts
        assert isinstance(one, PlaneChart)
        assert levels_around(np.array([0.0, 0.0, 0.0]), np.array([0.0, 90.0, 180.0])).size == 0
        low = levels_around(np.repeat(10.0, 4), np.array([0.0, 90.0, 180.0, 270.0]))
        assert low.tolist() == [10.0]  # where nothing flatter was asked for


def _grid(polar: np.ndarray) -> np.ndarray:
    return grid(np.radians(polar), np.radians(np.arange(0.0, 360.0, 15.0)))
