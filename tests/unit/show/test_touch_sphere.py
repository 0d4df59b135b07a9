"""Touches in space: which point of the picture is which touch."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.controls.screen.touch_sphere_chart import TouchesInSpace, touches_chart
from pretravel.controls.tasks.compare.lobes_report import lobe_size, lobes_figures, lobes_sentence
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.comparison import compare_corrections
from pretravel.show.chart_marks import SpaceLines, SpacePoints
from pretravel.uncertainty.covariance import Covariance


def test_each_point_of_the_picture_is_found_again_in_the_table() -> None:
    positions = 10.0 * np.vstack([np.eye(3), -np.eye(3)])
    out = np.array([False, True, False, False, True, False])
    named = np.array([False, False, True, False, True, False])
    touches = TouchesInSpace(
        positions, np.zeros(3), 10.0, np.arange(6.0), named, out, tuple("abcdef")
    )
    chart = touches_chart(touches)
    points = [mark for mark in chart.marks[-3:] if isinstance(mark, SpacePoints)]
    for mark, rows in zip(points, touches.rows(), strict=True):
        assert np.array_equal(mark.positions, positions[rows])
    assert [rows.tolist() for rows in touches.rows()] == [[0, 3, 5], [2], [1, 4]]
    bars = chart.marks[1]
    assert isinstance(bars, SpaceLines)
    # 500 is the largest of 1, 2, 5, … times with which 5 µm are not above 0.3 of the radius; a late
    # trigger points out of the sphere.
    assert chart.note == "Bars show the residuals 500 times enlarged."
    assert np.allclose(np.linalg.norm(bars.ends, axis=1) - 10.0, [0.0, 1.5, 2.5])
    assert chart.scale is not None
    assert chart.scale.high == 5.0


def test_a_ring_is_a_circle_through_its_touches() -> None:
    azimuth = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    positions = np.stack([20.0 * np.cos(azimuth), 20.0 * np.sin(azimuth), np.full(12, 5.0)], -1)
    none = np.zeros(12, dtype=bool)
    labels = tuple(map(str, range(12)))
    center = np.array([0.0, 0.0, 5.0])
    touches = TouchesInSpace(positions, center, 20.0, np.zeros(12), none, none, labels, ring=True)
    circle = touches_chart(touches).marks[0]
    assert isinstance(circle, SpaceLines)
    assert np.allclose(np.hypot(*circle.starts[:, :2].T), 20.0)
    assert np.allclose(circle.starts[:, 2], 5.0)


def test_figures_give_lobes_and_what_is_left_of_them_and_the_sentence_gives_the_rest() -> None:
    """Woźniak, equation 4, with A = 30 µm: A between the lobes, 2 A on them."""
    pretravel_map = PretravelMap(
        WozniakBasis(0.0), np.array([0.030, 0.0, 0.0]), Covariance.independent([0.25e-6, 0.0, 0.0]),
        DirectionSupport(sphere_pattern_25()), tip_radius=3.0,
    )  # fmt: skip
    size = lobe_size(pretravel_map)
    comparison = compare_corrections(pretravel_map)
    left = {row.method: row.largest for row in comparison.rows if row.where == "equator"}
    anywhere = {row.method: row.largest for row in comparison.rows if row.where == "all"}
    sentence = lobes_sentence(comparison)
    assert size == pytest.approx(0.030)
    told = (left["eight sectors"], anywhere["mean radius"])
    assert re.findall(r"[\d.]+ µm", sentence) == [f"{1e3 * length:.1f} µm" for length in told]
    figures = lobes_figures(pretravel_map, comparison)
    numbers = [
        1e3 * length for length in (size, left["mean radius"], 2.0 * comparison.u["equator"].max())
    ]
    assert [figure.value for figure in figures] == pytest.approx(numbers)
