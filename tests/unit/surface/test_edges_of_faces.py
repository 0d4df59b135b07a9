"""Edges of faces, boundaries of periodic surfaces, and surfaces of Python files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.errors import InputError
from pretravel.probing.obstacles import _meets_edges
from pretravel.surface.cad.boundary import _band
from pretravel.surface.cad.face import Face
from pretravel.surface.shapes import Plane
from pretravel.surface.shapes_of_revolution import Cone, Cylinder
from pretravel.surface.specification import parse_surface


def _rectangle(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    (a, b), (c, d) = low, high
    return np.array([[a, b], [c, b], [c, d], [a, d], [a, b]])


def test_samples_of_an_edge_are_within_the_spacing() -> None:
    """The arcs of a cone grow with the distance from its apex: 0.1 mm is kept on all of them.
    40 chords of an arc of 3 rad are shorter than it by less than 0.1 %."""
    ring = _rectangle((0.0, 1.0), (3.0, 20.0))
    cone = Cone([0.0, 0.0, 0.0], 0.0, math.pi / 4)
    face = Face(1, "", "cone", cone, None, False, (ring,))
    (line,) = face.edge_lines(0.1)
    steps = np.linalg.norm(np.diff(face.derivatives(line)[0], axis=0), axis=1)
    assert steps.max() < 0.1 * 1.001


def test_a_ball_meets_the_far_edge_of_a_face() -> None:
    """A square of 20 mm: a line that goes down through the edge at x = -10, and below the rest."""
    ring = _rectangle((-10.0, -10.0), (10.0, 10.0))
    face = Face(1, "", "plane", Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), None, False, (ring,))
    points = face.derivatives(ring)[0]
    assert np.ptp(points, axis=0) == pytest.approx([20.0, 20.0, 0.0])
    down = np.array([[1.0, 0.0, -0.3]]) / math.sqrt(1.09)
    through = np.array([[-10.0, 0.0, 0.0]]) - 20.0 * down
    assert _meets_edges(face, through, down, 1.0).all()
    # 2 mm beside the edge the ball of 1 mm passes.
    beside = through - np.array([[0.0, 0.0, 4.0]])
    assert not _meets_edges(face, beside, down, 1.0).any()


def test_a_band_around_a_cylinder_covers_its_area() -> None:
    """Two circles, 3 apart, that begin at 1 rad: 2 pi times 3, by the trapezoids of the ring."""
    u = np.linspace(1.0, 1.0 + 2.0 * math.pi, 9)
    lower = np.column_stack([u, np.zeros(9)])
    upper = np.column_stack([u[::-1], np.full(9, 3.0)])
    domain = Cylinder([0.0, 0.0, 0.0], 5.0).domain
    for second in (upper, upper[::-1]):
        x, y = _band([lower, second], domain).T
        area = 0.5 * abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))
        assert area == pytest.approx(6.0 * math.pi, rel=1e-12)


def test_an_object_with_a_part_of_the_members_is_no_surface(tmp_path: Path) -> None:
    file = tmp_path / "half.py"
    file.write_text("class Half:\n    def local(self, uv): ...\n\nsurface = Half()\n")
    with pytest.raises(InputError, match="not a surface"):
        parse_surface(f"{file}#surface")
