"""The picture of a finite-element model shows force, seats, scale and the highest stress."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.design.fem.elastic_field import TriggerField, field_at_trigger
from pretravel.design.tasks.fem.picture import trigger_field_view
from pretravel.prediction.catalogue import load_probe
from pretravel.show.chart import PlaneChart, SpaceChart
from pretravel.show.chart_marks import Bars, SpaceArrow, SpaceMesh, SpacePoints
from tests.support.coarse_models import coarse_reduced_sixth


@pytest.fixture(scope="module")
def field() -> TriggerField:
    return field_at_trigger(load_probe("omp40-2"), [1.0, 0.0, 0.0], coarse_reduced_sixth())


def test_the_marked_maximum_is_that_of_the_field(field: TriggerField) -> None:
    chart = trigger_field_view(field).charts[0]
    assert isinstance(chart, SpaceChart)
    assert chart.scale is not None
    assert chart.scale.high == field.stress.max()
    mark = next(m for m in chart.marks if isinstance(m, SpacePoints))
    assert mark.name == f"highest: {field.stress.max():.1f} MPa"
    mesh = field.elastic.mesh
    nodes = mesh.elements[int(np.argmax(field.stress))]
    factor = float(chart.title.split()[-2])
    moved = mesh.points[nodes] + factor * field.displacement[nodes]
    assert mark.positions[0] == pytest.approx(moved.mean(axis=0))
    # A round number with which the largest displacement is seen: 2 to 12 % of the probe's length.
    size = np.linalg.norm(np.ptp(mesh.points, axis=0))
    drawn = factor * np.linalg.norm(field.displacement, axis=1).max()
    assert 0.02 * size < drawn <= 0.12 * size


def test_the_surface_is_all_that_a_page_needs(field: TriggerField) -> None:
    chart = trigger_field_view(field).charts[0]
    assert isinstance(chart, SpaceChart)
    mesh = next(m for m in chart.marks if isinstance(m, SpaceMesh))
    assert len(mesh.triangles) == len(field.elastic.mesh.boundary)
    assert len(mesh.vertices) < 0.5 * len(field.elastic.mesh.points)  # corners, no middles of sides


def test_force_and_seats_have_their_values(field: TriggerField) -> None:
    _, solids, forces = trigger_field_view(field).charts
    assert isinstance(solids, SpaceChart)
    assert isinstance(forces, PlaneChart)
    arrow = next(m for m in solids.marks if isinstance(m, SpaceArrow))
    assert f"force on the tip {field.trigger.force[0]:.3f} N" in solids.title
    along = arrow.vector / np.linalg.norm(arrow.vector)
    assert along == pytest.approx(field.trigger.directions[0])
    seats = next(m for m in solids.marks if isinstance(m, SpacePoints))
    assert seats.positions == pytest.approx(field.points[:6])
    rest, now = (m for m in forces.marks if isinstance(m, Bars))
    assert rest.values == pytest.approx(field.rest_reactions)
    assert now.values == pytest.approx(field.trigger.reactions[0])
