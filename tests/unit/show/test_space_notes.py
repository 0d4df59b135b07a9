"""Words at places in space: none covers another one in a file."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from pretravel.show import SpaceChart, SpaceMesh, SpaceNotes, SpacePoints, View, drawn_figure

CORNERS = SpacePoints(np.array([[-10.0, -10, -10], [10, 10, 10]]), size=1.0)


@pytest.mark.parametrize("apart", [0.01, 0.5])
def test_notes_of_close_places_stand_beside_each_other(apart: float, tmp_path: Path) -> None:
    places = apart * np.column_stack([np.arange(6.0), np.zeros(6), np.zeros(6)])
    notes = SpaceNotes(places, tuple(f"face {number}" for number in range(6)))
    figure = drawn_figure(View("", (SpaceChart("", (CORNERS, notes), ""),)))
    figure.savefig(tmp_path / "notes.png")
    boxes = {
        text.get_text(): text.get_bbox_patch().get_window_extent()  # without the line
        for text in figure.axes[0].texts
        if text.get_text().startswith("face")
    }
    assert len(boxes) == 6
    for (one, a), (other, b) in combinations(boxes.items(), 2):
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide <= 1.0 or high <= 1.0, (one, other)


def test_notes_behind_a_body_are_left_out() -> None:
    """A slab seen from above: what lies below it is hidden, beside it and above it is seen."""
    slab = SpaceMesh(
        np.array([[0.0, 0, 1], [4, 0, 1], [4, 4, 1], [0, 4, 1]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    places = np.array([[1.0, 2, 0], [3, 1, 0], [6, 2, 0], [1, 2, 2]])
    notes = SpaceNotes(places, ("below", "below too", "beside", "above"))
    chart = SpaceChart("", (CORNERS, slab, notes), "", elevation=90.0, azimuth=-90.0, bare=True)
    axes = drawn_figure(View("", (chart,))).axes[0]
    assert {text.get_text() for text in axes.texts} == {"beside", "above"}
