"""Boundaries of faces in the parameters of their surfaces, of edges that are built by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.surface.cad.boundary import face_boundary
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.curves import Conic, Curve, Line
from pretravel.surface.local_geometry import Surface
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus

TURN = 2.0 * math.pi
FACE = 3
"""Number of the surface of the face; others belong to its neighbours."""
ROUND = Cylinder([0.0, 0.0, 0.0], 5.0)


def _line(start: tuple[float, float], end: tuple[float, float]) -> Line:
    return Line(np.array(start), np.subtract(end, start))


@dataclass
class _Built:
    """A face, to which wires and edges are added."""

    face: ShapeRecord = field(default_factory=lambda: ShapeRecord("Fa", surface=FACE))
    plane: list[Curve] = field(default_factory=list)
    space: list[Curve] = field(default_factory=list)
    shapes: dict[int, ShapeRecord] = field(default_factory=dict)

    def _number(self, shape: ShapeRecord) -> int:
        self.shapes[len(self.shapes) + 10] = shape
        return len(self.shapes) + 9

    def wire(self, *, reverses: bool = False, bounds: bool = True) -> ShapeRecord:
        wire = ShapeRecord("Wi")
        self.face.parts.append(ShapeUse(self._number(wire), reverses, np.eye(4), bounds))
        return wire

    def edge(
        self, wire: ShapeRecord, *curves: Curve, reverses: bool = False, bounds: bool = True
    ) -> ShapeRecord:
        """An edge with a curve on the face, and a second one where it is a seam; 0 to 1."""
        edge = ShapeRecord("Ed", curve=(1, np.eye(4), 0.0, 1.0))
        self.plane.extend(curves)
        if curves:
            last = len(self.plane)
            one, other = (last - 1, last) if len(curves) == 2 else (last, 0)
            edge.parameter_curves.append((FACE, one, other, 0.0, 1.0))
        wire.parts.append(ShapeUse(self._number(edge), reverses, np.eye(4), bounds))
        return edge

    def boundary(self, surface: Surface = ROUND) -> tuple[list[FloatArray], list[FloatArray]]:
        brep = Brep(self.plane, self.space, [], self.shapes, [])
        return face_boundary(brep, self.face, surface)


def _of_lines(*wires: list[tuple[tuple[float, float], tuple[float, float]]]) -> _Built:
    """A face whose wires are lines from a start to an end."""
    built = _Built()
    for lines in wires:
        wire = built.wire()
        for start, end in lines:
            built.edge(wire, _line(start, end))
    return built


def _area(ring: FloatArray) -> float:
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


@pytest.mark.parametrize("turned", [False, True])
def test_reversed_edges_are_joined_against_their_own_way(turned: bool) -> None:
    """A square of 4 x 1 whose second and fourth edge run the other way. Borders keep their own
    way. The whole wire can run the other way; what does not bound is no boundary."""
    corners = [(7.0, -3.0), (11.0, -3.0), (11.0, -2.0), (7.0, -2.0)]
    built = _Built()
    wire = built.wire(reverses=turned)
    for i in range(4):
        ends = corners[i], corners[(i + 1) % 4]
        back = i in (1, 3)
        built.edge(wire, _line(*(ends[::-1] if back else ends)), reverses=back != turned)
    built.edge(wire, _line((8.0, -3.0), (8.0, -2.0)), bounds=False)
    seam = built.wire(bounds=False)
    built.edge(seam, _line((9.0, -3.0), (9.0, -2.5)))
    rings, borders = built.boundary()
    assert len(rings) == 1
    assert rings[0].tolist() == [list(c) for c in (*corners, corners[0])]
    assert len(borders) == 4
    for i, border in enumerate(borders):
        own = np.array([corners[i], corners[(i + 1) % 4]])
        assert np.array_equal(border, own[::-1] if i in (1, 3) else own)


@pytest.mark.parametrize("reverses", [False, True])
def test_a_seam_is_taken_on_its_side_and_is_no_border(reverses: bool) -> None:
    """Around a cylinder, up the one side of its seam and down the other. The circles are also
    seams of a surface beside the face, and the seam is also a plain edge of one."""
    built = _Built()
    built.plane = [_line((50.0, 60.0), (70.0, 80.0)) for _ in range(3)]  # of neighbours
    wire = built.wire(reverses=reverses)
    low = built.edge(wire, _line((0.5, 2.0), (0.5 + TURN, 2.0)), reverses=reverses)
    sides = [_line((u, 2.0), (u, 9.0)) for u in (0.5 + TURN, 0.5)]
    seam = built.edge(wire, *sides, reverses=reverses)
    high = built.edge(wire, _line((0.5, 9.0), (0.5 + TURN, 9.0)), reverses=not reverses)
    wire.parts.append(ShapeUse(wire.parts[1].index, not reverses, np.eye(4)))
    for circle in (low, high):
        circle.parameter_curves.insert(0, (2, 1, 3, 0.0, 1.0))
    seam.parameter_curves.insert(0, (4, 2, 0, 0.0, 1.0))
    pole = built.edge(wire, _line((0.5, 2.0), (0.5, 2.0)), reverses=reverses)
    pole.curve = None
    rings, borders = built.boundary()
    expected = [[0.5, 2.0], [0.5 + TURN, 2.0], [0.5 + TURN, 9.0], [0.5, 9.0], [0.5, 2.0]]
    assert rings[0] == pytest.approx(np.array(expected), abs=1e-12)
    assert len(borders) == 2
    assert [border[0, 1] for border in borders] == [2.0, 9.0]


def _rigid(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    placed = np.eye(4)
    placed[:3, :3], placed[:3, 3] = turn * np.linalg.det(turn), rng.uniform(-9.0, 9.0, 3)
    return placed


def test_an_edge_with_a_curve_in_space_alone_is_projected_to_the_surface() -> None:
    """A circle on a cylinder, at the height 3 from 0.4 to 5 rad. Its placements are those of
    curve, edge, wire and face. Chords of an angle a are r (1 - cos a/2) from the arc."""
    built, radius = _Built(), 20.0
    cylinder = Cylinder([1.0, 2.0, 3.0], radius)
    of_wire, of_edge, of_curve = (_rigid(seed) for seed in (1, 2, 3))
    built.face.placement = _rigid(4)
    out = np.linalg.inv(np.linalg.inv(built.face.placement) @ of_wire @ of_edge @ of_curve)
    frame = cylinder.local(np.array([[0.0, 3.0], [0.5 * math.pi, 3.0]]))
    center = frame.point[0] - radius * frame.normal[0]
    x, y = frame.normal @ out[:3, :3].T
    circle = Conic("ellipse", out[:3, :3] @ center + out[:3, 3], x, y, radius, radius)
    built.space = [Line(np.zeros(3), np.eye(3)[i]) for i in range(3)] + [circle]
    built.space.append(built.space[0])
    wire, pieces = built.wire(), [(5.0, 3.0), (5.0, -6.0), (0.4, -6.0), (0.4, 3.0)]
    edge = built.edge(wire)
    edge.curve = (4, of_curve, 0.4, 5.0)
    for start, end in pairwise(pieces):
        built.edge(wire, _line(start, end))
    wire.parts[0] = ShapeUse(wire.parts[0].index, False, of_edge)
    built.face.parts[0] = ShapeUse(built.face.parts[0].index, False, of_wire)
    rings, borders = built.boundary(cylinder)
    angle = np.diff(borders[0][:, 0])
    assert borders[0][[0, -1], 0] == pytest.approx([0.4, 5.0], abs=1e-9)
    assert borders[0][:, 1] == pytest.approx(3.0, abs=1e-9)
    off = radius * (1.0 - np.cos(0.5 * angle))
    assert np.all(angle > 0.0)
    # Chords are halved until the limit is kept: none is as good as half a chord.
    assert 0.9 * 0.25e-4 < off.min() <= off.max() < 1e-4
    assert _area(rings[0]) == pytest.approx(-4.6 * 9.0, rel=1e-9)


@pytest.mark.parametrize(
    ("surface", "center", "height", "widths"),
    [
        (Cylinder([0.0, 0.0, 0.0], 2.0), 8.0, 6.0, (2.0, 0.0)),
        (Cylinder([0.0, 0.0, 0.0], 50.0), 8.0, 6.0, (50.0, 0.0)),
        (Cone([0.0, 0.0, 0.0], 0.0, 0.25 * math.pi), 15.5, 14.5, (0.0, math.sqrt(0.5))),
    ],
)
def test_chords_of_a_curved_edge_are_near_it_in_space(
    surface: Surface, center: float, height: float, widths: tuple[float, float]
) -> None:
    """An ellipse in the parameters: u is as long as `widths` state, a constant and a part that
    grows with v. On a cone it leads from 1 mm to 30 mm from the apex, and lengths are those of
    the widest place. Halved chords are a quarter as far from their arcs: from 25 to 100 nm."""
    ellipse = Conic("ellipse", np.array([1.0, center]), np.eye(2)[0], np.eye(2)[1], 0.5, height)
    built = _Built()
    edge = built.edge(built.wire(), ellipse)
    edge.parameter_curves[0] = (FACE, 1, 0, 0.0, TURN)
    rings, (border,) = built.boundary(surface)
    t = np.unwrap(np.arctan2((border[:, 1] - center) / height, (border[:, 0] - 1.0) / 0.5))
    assert t[-1] - t[0] == pytest.approx(TURN)
    middle = ellipse.value(0.5 * (t[1:] + t[:-1]))
    lengths = np.column_stack([widths[0] + widths[1] * middle[:, 1], np.ones(len(middle))])
    chord, away = lengths * (border[1:] - border[:-1]), lengths * (middle - border[:-1])
    length = np.linalg.norm(chord, axis=1)
    off = np.abs(chord[:, 0] * away[:, 1] - chord[:, 1] * away[:, 0]) / length
    assert 0.22e-4 < off.max() <= 1e-4
    assert np.array_equal(rings[0][0], rings[0][-1])
    if isinstance(surface, Cylinder):
        assert off.min() > 0.22e-4
        # The area that chords cut off is two thirds of their lengths and distances.
        lost = 2.0 / 3.0 * float(np.sum(off * length)) / surface.radius
        assert _area(rings[0]) == pytest.approx(math.pi * 3.0 - lost, rel=1e-8)


@pytest.mark.parametrize("across", [0, 1])
@pytest.mark.parametrize("start", [(0.0, 0.0), (3.0, 900.0), (-700.0, -698.0)])
@pytest.mark.parametrize(("gap", "closes"), [(0.0399, True), (0.0401, False)])
def test_a_boundary_closes_up_to_a_hundredth_of_its_size(
    across: int, start: tuple[float, float], gap: float, closes: bool
) -> None:
    """Of the longer side of a rectangle of 4 x 0.5, also far from zero."""
    way = np.array([[gap, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5], [0.0, 0.0]])
    corners = np.array(start) + (way[:, ::-1] if across else way)
    built = _of_lines([(tuple(one), tuple(other)) for one, other in pairwise(corners)])
    if not closes:
        with pytest.raises(PretravelError, match="does not close in the surface's parameters"):
            built.boundary()
        return
    rings, _ = built.boundary()
    assert rings[0] == pytest.approx(np.concatenate([corners, corners[:1]]), abs=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(("share", "count"), [(0.9e-9, 5), (1.5e-9, 9)])
def test_ends_a_billionth_of_the_size_apart_are_one_point(
    size: float, share: float, count: int
) -> None:
    """A rectangle whose edges begin a little after the ends of those before."""
    corners = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.0, 0.7], [0.0, 0.0]])
    gap = np.array([share * size, 0.0])
    built = _of_lines([(tuple(one + gap), tuple(other)) for one, other in pairwise(corners)])
    rings, _ = built.boundary()
    assert len(rings[0]) == count
    assert np.array_equal(rings[0][0], rings[0][-1])


PLACES = [(5.0, 1.0), (9.0, 1.0), (9.0, 3.0), (5.0, 3.5), (5.5, 2.0), (4.0, 2.0)]


@pytest.mark.parametrize("seed", range(6))
def test_edges_in_any_order_are_joined_end_to_end(seed: int) -> None:
    """Six bowed sides, of which some start at one u or v, joined from the first one of the file;
    and a hole with straight ones, which is a ring of its own."""
    built, order = _Built(), np.random.default_rng(seed).permutation(6)
    wire = built.wire()
    for i in order:
        start, end = np.array(PLACES[i]), np.array(PLACES[(i + 1) % 6])
        way = 0.5 * (end - start)
        bow = Conic("ellipse", 0.5 * (start + end), way, 0.05 * way[::-1] * [1.0, -1.0], 1.0, 1.0)
        edge = built.edge(wire, bow)
        edge.parameter_curves[0] = (FACE, len(built.plane), 0, math.pi, TURN)
    wire = built.wire()
    corners = [(x - 20.0, y) for x, y in [*PLACES, PLACES[0]]]
    for start, end in pairwise(corners):
        built.edge(wire, _line(start, end))
    (ring, hole), borders = built.boundary()
    assert len(borders) == 12
    assert hole.tolist() == [list(corner) for corner in corners]
    joined = np.array([PLACES[(order[0] + k) % 6] for k in range(7)])
    assert ring[0] == pytest.approx(joined[0], abs=1e-9)
    assert ring[-1] == pytest.approx(joined[0], abs=1e-9)
    places = [int(np.linalg.norm(ring - corner, axis=1).argmin()) for corner in joined[1:6]]
    assert np.all(np.diff([0, *places, len(ring) - 1]) > 1)
    assert ring[places] == pytest.approx(joined[1:6], abs=1e-9)
    assert np.linalg.norm(np.diff(ring, axis=0), axis=1).max() < 0.5


@pytest.mark.parametrize(
    ("surface", "axis", "far"),
    [
        (Torus([0.0, 0.0, 0.0], 9.0, 2.0), 0, 0.0),
        (Torus([0.0, 0.0, 0.0], 9.0, 2.0), 1, 0.0),
        (ROUND, 0, 1000.0),
    ],
    ids=["around a torus", "around its tube", "far along a cylinder"],
)
@pytest.mark.parametrize("turns", [-2, 0, 3])
@pytest.mark.parametrize("ways", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_two_circles_without_a_seam_bound_the_band_between_them(
    surface: Surface, axis: int, far: float, turns: int, ways: tuple[int, int]
) -> None:
    """From 1 rad and from 1.3 rad, whole turns apart, each in either way: both circles in one ring
    against each other, which has the area of a turn times 0.8."""
    circles = []
    for begin, across, way in ((1.0, far + 0.5, ways[0]), (1.3 + turns * TURN, far + 1.3, ways[1])):
        ends = [(begin, across), (begin + TURN, across)][::way]
        circles.append([(end[::-1] if axis else end) for end in ends])
    rings, borders = _of_lines(*([(one, other)] for one, other in circles)).boundary(surface)
    assert len(borders) == 2
    (ring,) = rings
    assert ring[:2] == pytest.approx(np.array(circles[0]), abs=1e-12)
    assert np.array_equal(ring[-1], ring[0])
    # The second one by whole turns, so that the way to it is short.
    second = np.array(circles[1] if ways[0] != ways[1] else circles[1][::-1])
    moved = ring[2:4] - second
    assert np.ptp(moved, axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert moved[0, axis] / TURN == pytest.approx(round(moved[0, axis] / TURN), abs=1e-9)
    assert np.abs(ring[2] - ring[1])[axis] < 0.5 * TURN
    assert abs(_area(ring)) == pytest.approx(0.8 * TURN, rel=1e-9)


@pytest.mark.parametrize(
    ("first", "second", "closes"),
    [
        *((turn, turn, True) for turn in (0.992, 1.008, -0.992, -1.008)),
        *((turn, turn, False) for turn in (0.988, 1.012, -0.988, -1.012)),
        (0.988, 1.0, False),
        (1.0, 0.2, False),
    ],
)
def test_a_circle_goes_around_within_a_hundredth(first: float, second: float, closes: bool) -> None:
    """Both circles in the same way: the second one is turned over, also where both lack a bit."""
    ends = [((1.0, v), (1.0 + turn * TURN, v)) for v, turn in ((0.0, first), (3.0, second))]
    built = _of_lines([ends[0]], [ends[1]])
    if closes:
        (ring,), _ = built.boundary()
        assert abs(_area(ring)) == pytest.approx(3.0 * abs(first) * TURN, rel=1e-12)
        return
    with pytest.raises(PretravelError, match="does not close"):
        built.boundary()


def test_three_circles_are_no_band() -> None:
    built = _of_lines(*([((0.0, float(i)), (TURN, float(i)))] for i in range(3)))
    with pytest.raises(PretravelError, match="does not close"):
        built.boundary()


def test_an_edge_without_a_curve_is_refused_and_a_wire_without_edges_is_none() -> None:
    assert _of_lines([]).boundary() == ([], [])
    built = _Built()
    built.edge(built.wire()).curve = None
    with pytest.raises(PretravelError, match="one of its edges has no curve"):
        built.boundary()
