"""What a result leaves out sets no scale of its pictures: those of pages, files and screens."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from pretravel.base import MICROMETRE, from_angles
from pretravel.qualification import qualify
from pretravel.show import at_the_edge, drawn_figure
from pretravel.show.chart import Chart, PlaneChart, PolarChart, Scale, SpaceChart, View
from pretravel.show.chart_marks import Dots, SpacePoints
from pretravel.task.notebook_card import notebook_card
from pretravel.tasks.qualify import qualification_view
from tests.support.reference_touches import sphere_touches

GROSS = 60.0
"""Of one touch. [µm]"""


def _ring(noise: float = 0.2) -> np.ndarray:
    """Pretravel of 36 directions around, with lobes of a micrometre; the fifth is gross. [mm]"""
    azimuth = np.radians(np.arange(0.0, 360.0, 10.0))
    rng = np.random.default_rng(4)
    values = 5.0 + np.cos(3.0 * azimuth) + noise * rng.standard_normal(36)
    values[5] += GROSS
    return values * MICROMETRE


def _largest(charts: Sequence[Chart]) -> float:
    """The largest number of the marks that have an axis."""
    dots = [
        mark
        for chart in charts
        if isinstance(chart, PlaneChart | PolarChart)
        for mark in chart.marks
        if isinstance(mark, Dots)
    ]
    assert dots
    return max(float(np.nanmax(np.abs(mark.y))) for mark in dots)


@pytest.fixture(scope="module")
def qualified() -> object:
    normals = -from_angles(np.full(36, np.pi / 2.0), np.radians(np.arange(0.0, 360.0, 10.0)))
    touches = sphere_touches(_ring(), normals, radius=-12.5)  # of a ring: outwards
    made = qualify(touches, 25.0, ring=True, tip_diameter=6.0, kind="harmonic")
    assert [row for outlier in made.outliers for row in outlier.rows] == [5]
    assert not made.used[5]
    return made


def test_an_outlier_on_a_ring_is_at_the_edge(qualified: object) -> None:
    view = qualification_view(qualified)  # type: ignore[arg-type]
    assert _largest(view.charts) < 0.5 * GROSS
    names = {mark.name for chart in view.charts for mark in chart.marks if isinstance(mark, Dots)}  # type: ignore[union-attr]
    assert "named as outlier" in names  # it is there


def test_an_outlier_is_at_the_edge_of_the_card_of_a_notebook(qualified: object) -> None:
    card = notebook_card(qualified)
    assert card.picture is not None
    assert _largest([card.picture]) < 0.5 * GROSS


def test_what_is_within_the_others_stays_where_it_is() -> None:
    assert at_the_edge([0.5, -9.0], [0.0, 1.0]).tolist() == pytest.approx([0.5, -0.12])
    assert at_the_edge([3.0], [np.nan]).tolist() == [3.0]


def test_a_point_without_a_deviation_is_seen_in_a_file(tmp_path: Path) -> None:
    """The colour of zero is that of the paper."""
    point = SpacePoints(np.zeros((1, 3)), values=np.zeros(1), size=40.0)
    corners = SpacePoints(np.array([[-1.0, -1, -1], [1, 1, 1]]), size=0.1)
    scale = Scale("deviation", "µm", -8.0, 8.0, signed=True)
    view = View("", (SpaceChart("", (corners, point), "", scale=scale, bare=True),))
    path = tmp_path / "points.png"
    drawn_figure(view).savefig(path)
    pixels = imread(path)[:, :, :3]
    middle = pixels[pixels.shape[0] // 4 : -pixels.shape[0] // 4, : pixels.shape[1] // 2]
    assert int(np.sum(middle.max(axis=2) < 0.6)) > 50
