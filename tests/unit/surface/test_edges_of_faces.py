"""Edges of faces, boundaries of periodic surfaces, and surfaces of Python files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.probing.obstacles import _meets_edges
from pretravel.surface.cad.boundary import _band, face_boundary
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.cad.face import Face
from pretravel.surface.curves import Curve, Line
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


def _on_cylinder(lines: list[list[tuple[float, float, float, float]]]) -> Brep:
    """A face on a cylinder; each wire a list of lines in its parameters: start and way."""
    curves: list[Curve] = []
    face = ShapeRecord("Fa", surface=1)
    shapes = {1: face}
    for wire in lines:
        record = ShapeRecord("Wi")
        shapes[len(shapes) + 1] = record
        face.parts.append(ShapeUse(len(shapes), False, np.eye(4)))
        for u, v, du, dv in wire:
            curves.append(Line(np.array([u, v]), np.array([du, dv])))
            edge = ShapeRecord("Ed", curve=(1, np.eye(4), 0.0, 1.0))
            edge.parameter_curves.append((1, len(curves), 0, 0.0, 1.0))
            shapes[len(shapes) + 1] = edge
            record.parts.append(ShapeUse(len(shapes), False, np.eye(4)))
    return Brep(curves, [], [], shapes, [])


TURN = 2.0 * math.pi


def _area(ring: np.ndarray) -> float:
    x, y = ring.T
    return 0.5 * abs(float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])))


@pytest.mark.parametrize("height", [0.0, 5.0, 1000.0])
def test_two_circles_without_a_seam_are_the_band_between_them(height: float) -> None:
    """Wherever on the axis they lie: an open chain is told by its own length."""
    surface = Cylinder([0.0, 0.0, 0.0], 5.0)
    brep = _on_cylinder([[(1.0, height, TURN, 0.0)], [(1.0 + TURN, height + 3.0, -TURN, 0.0)]])
    rings, borders = face_boundary(brep, brep.shapes[1], surface)
    assert len(rings) == 1
    assert len(borders) == 2
    assert _area(rings[0] - [0.0, height]) == pytest.approx(3.0 * TURN, rel=1e-9)


def test_edges_are_joined_in_the_order_in_which_they_fit() -> None:
    """A square whose third and fourth edge are exchanged in the file, and a hole in it."""
    sides = [
        (0.0, 0.0, 2.0, 0.0),
        (2.0, 0.0, 0.0, 2.0),
        (2.0, 2.0, -2.0, 0.0),
        (0.0, 2.0, 0.0, -2.0),
    ]
    square = [sides[row] for row in (0, 1, 3, 2)]
    hole = [(0.5 + 0.5 * u, 0.5 + 0.5 * v, 0.5 * du, 0.5 * dv) for u, v, du, dv in sides]
    surface = Cylinder([0.0, 0.0, 0.0], 5.0)
    brep = _on_cylinder([square, hole])
    rings, borders = face_boundary(brep, brep.shapes[1], surface)
    assert [_area(ring) for ring in rings] == pytest.approx([4.0, 1.0], rel=1e-12)
    assert [len(ring) for ring in rings] == [5, 5]
    assert all(np.array_equal(ring[0], ring[-1]) for ring in rings)
    assert len(borders) == 8


@pytest.mark.parametrize(
    "lines",
    [
        [[(0.0, 0.0, 2.0, 0.0), (2.0, 0.0, 0.0, 2.0)]],
        [[(0.0, 0.0, TURN, 0.0)], [(0.0, 1.0, 1.0, 0.0)]],
        [[(0.0, float(i), TURN, 0.0)] for i in range(3)],
    ],
)
def test_a_boundary_that_does_not_close_is_refused(
    lines: list[list[tuple[float, float, float, float]]],
) -> None:
    brep = _on_cylinder(lines)
    with pytest.raises(PretravelError, match="does not close in the surface's parameters"):
        face_boundary(brep, brep.shapes[1], Cylinder([0.0, 0.0, 0.0], 5.0))


def test_an_edge_without_a_curve_is_refused_and_a_wire_without_edges_is_none() -> None:
    brep = _on_cylinder([[(0.0, 0.0, TURN, 0.0)], []])
    assert brep.shapes[2].parts
    brep.shapes[3].parameter_curves.clear()
    brep.shapes[3].curve = None
    with pytest.raises(PretravelError, match="one of its edges has no curve"):
        face_boundary(brep, brep.shapes[1], Cylinder([0.0, 0.0, 0.0], 5.0))
    empty = _on_cylinder([[]])
    assert face_boundary(empty, empty.shapes[1], Cylinder([0.0, 0.0, 0.0], 5.0)) == ([], [])
