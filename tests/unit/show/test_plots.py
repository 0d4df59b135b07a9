"""`plot()` of results: the pictures of the reports, as axes of matplotlib."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import pretravel
from pretravel.base.directions import grid
from pretravel.task.plots import plotted
from tests.support.example_maps import example_qualification
from tests.support.examples import EXAMPLES


@pytest.fixture(autouse=True)
def _without_a_screen() -> Iterator[None]:
    before = plt.get_backend()
    plt.switch_backend("agg")
    plt.close("all")  # what other tests left open
    yield
    plt.close("all")
    plt.switch_backend(before)


def _values() -> dict[str, Any]:
    made = example_qualification("mean")
    touches = pretravel.read_touches(EXAMPLES / "part_touches.csv")
    on_sphere = pretravel.read_touches(EXAMPLES / "sphere_touches.csv")
    points = pretravel.apply(on_sphere, made)
    directions = grid(np.radians([45.0, 90.0]), np.radians(np.arange(0.0, 360.0, 15.0)))
    return {
        "touches": touches,
        "points": points,
        "map": made.pretravel_map,
        "qualification": made,
        "feature": pretravel.measure_feature(points, "sphere"),
        "prediction": pretravel.predict(pretravel.load_probe("omp40-2"), directions),
    }


FIRST = {
    "touches": "places of the tip",
    "points": "pretravel",
    "map": "pretravel from above",
    "qualification": "pretravel from above",
    "feature": "sphere",
    "prediction": "force",
}


@pytest.mark.parametrize("name", FIRST)
def test_a_result_is_drawn_in_a_figure_of_pyplot(name: str) -> None:
    """Of pyplot: notebooks show it, and plt.show() opens it."""
    axes = _values()[name].plot()
    assert FIRST[name] in " ".join(each.get_title() for each in axes)
    assert plt.get_fignums() == [axes[0].figure.number]
    assert any(each.has_data() for each in axes)


def test_many_touches_are_thinned_and_that_is_said() -> None:
    n = np.tile([0.0, 0.0, 1.0], (4000, 1))
    places = np.random.default_rng(1).random((4000, 3))
    figure = pretravel.Touches(places, n).plot()[0].figure
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert any("3,000 of 4,000 touches are drawn" in text for text in texts)


def test_what_has_no_picture_is_told() -> None:
    with pytest.raises(TypeError, match="a float has no picture"):
        plotted(1.0)
