"""Boundaries of faces in the parameters of their surfaces, edge by edge, built by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.surface.cad.boundary import _band, _chained, _closed, face_boundary
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.curves import Conic, Curve, Line
from pretravel.surface.local_geometry import Surface
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus

TURN = 2.0 * math.pi
FACE = 3
"""Number of the surface of the face; others belong to its neighbours."""


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

    def boundary(self, surface: Surface) -> tuple[list[FloatArray], list[FloatArray]]:
        brep = Brep(self.plane, self.space, [], self.shapes, [])
        return face_boundary(brep, self.face, surface)


def _area(ring: FloatArray) -> float:
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


@pytest.mark.parametrize("turned", [False, True])
def test_reversed_edges_are_joined_against_their_own_way(turned: bool) -> None:
    """A square of 4 x 1 whose second and fourth edge run the other way. Borders keep their own
    way. The wire of the hole runs the other way as a whole; a wire that does not bound is none."""
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
    rings, borders = built.boundary(Cylinder([0.0, 0.0, 0.0], 5.0))
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
    rings, borders = built.boundary(Cylinder([0.0, 0.0, 0.0], 5.0))
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


@pytest.mark.parametrize("radius", [2.0, 50.0])
def test_chords_of_a_curved_edge_are_near_it_in_space(radius: float) -> None:
    """An ellipse in the parameters of a cylinder, which is developed without a change of lengths.
    Halved chords are a quarter as far from their arcs: from 25 to 100 nm."""
    ellipse = Conic("ellipse", np.array([1.0, 8.0]), np.eye(2)[0], np.eye(2)[1], 0.5, 6.0)
    built = _Built()
    edge = built.edge(built.wire(), ellipse)
    edge.parameter_curves[0] = (FACE, 1, 0, 0.0, TURN)
    rings, borders = built.boundary(Cylinder([0.0, 0.0, 0.0], radius))
    flat = borders[0] * [radius, 1.0]
    t = np.unwrap(np.arctan2((borders[0][:, 1] - 8.0) / 6.0, (borders[0][:, 0] - 1.0) / 0.5))
    assert t[-1] - t[0] == pytest.approx(TURN)
    middle = 0.5 * (t[1:] + t[:-1])
    arc = np.column_stack([radius * (1.0 + 0.5 * np.cos(middle)), 8.0 + 6.0 * np.sin(middle)])
    chord = flat[1:] - flat[:-1]
    away = arc - flat[:-1]
    length = np.linalg.norm(chord, axis=1)
    off = np.abs(chord[:, 0] * away[:, 1] - chord[:, 1] * away[:, 0]) / length
    assert 0.22e-4 < off.min() <= off.max() <= 1e-4
    assert np.array_equal(rings[0][0], rings[0][-1])
    # The area that chords cut off is two thirds of their lengths and distances.
    lost = 2.0 / 3.0 * float(np.sum(off * length)) / radius
    assert _area(rings[0]) == pytest.approx(math.pi * 3.0 - lost, rel=1e-8)


def test_chords_are_near_an_edge_where_the_surface_is_widest() -> None:
    """On a cone from 1 mm to 30 mm from its apex: lengths are those of the widest place. A chord
    is measured with the lengths at its middle."""
    ellipse = Conic("ellipse", np.array([1.0, 15.5]), np.eye(2)[0], np.eye(2)[1], 0.5, 14.5)
    built = _Built()
    edge = built.edge(built.wire(), ellipse)
    edge.parameter_curves[0] = (FACE, 1, 0, 0.0, TURN)
    cone = Cone([0.0, 0.0, 0.0], 0.0, 0.25 * math.pi)
    _, (border,) = built.boundary(cone)
    t = np.unwrap(np.arctan2((border[:, 1] - 15.5) / 14.5, (border[:, 0] - 1.0) / 0.5))
    middle = ellipse.value(0.5 * (t[1:] + t[:-1]))
    lengths = np.column_stack([middle[:, 1] * math.sin(0.25 * math.pi), np.ones(len(middle))])
    chord, away = lengths * (border[1:] - border[:-1]), lengths * (middle - border[:-1])
    off = np.abs(chord[:, 0] * away[:, 1] - chord[:, 1] * away[:, 0])
    off /= np.linalg.norm(chord, axis=1)
    assert 0.22e-4 < off.max() <= 1e-4


# Both limits of a gap, of a square of 4 x 0.5 far from zero: a hundredth of its longer side.
@pytest.mark.parametrize("across", [0, 1])
@pytest.mark.parametrize("start", [(0.0, 0.0), (3.0, 900.0), (-700.0, -698.0)])
@pytest.mark.parametrize(("gap", "closes"), [(0.0399, True), (0.0401, False)])
def test_a_boundary_closes_up_to_a_hundredth_of_its_size(
    across: int, start: tuple[float, float], gap: float, closes: bool
) -> None:
    way = np.array([[gap, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5], [0.0, 0.0]])
    corners = np.array(start) + (way[:, ::-1] if across else way)
    built = _Built()
    wire = built.wire()
    for one, other in pairwise(corners):
        built.edge(wire, _line(tuple(one), tuple(other)))
    surface = Cylinder([0.0, 0.0, 0.0], 5.0)
    if not closes:
        with pytest.raises(PretravelError, match="does not close"):
            built.boundary(surface)
        return
    rings, _ = built.boundary(surface)
    assert rings[0] == pytest.approx(np.concatenate([corners, corners[:1]]), abs=1e-12)


def test_a_gap_of_exactly_a_hundredth_closes() -> None:
    built = _Built()
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.0, 0.5), (0.0, 0.01)]
    wire = built.wire()
    for one, other in pairwise(corners):
        built.edge(wire, _line(other, one), reverses=True)
    rings, _ = built.boundary(Cylinder([0.0, 0.0, 0.0], 5.0))
    assert rings[0].tolist() == [list(c) for c in (*corners, corners[0])]


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_ends_a_billionth_of_the_size_apart_are_one_point(size: float) -> None:
    """A square whose edges begin 0.9e-9 or 1.5e-9 of its size after the ends of those before."""
    for share, count in ((0.9e-9, 5), (1.5e-9, 9)):
        corners = size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.0, 0.7], [0.0, 0.0]])
        gap = np.array([share * size, 0.0])
        built = _Built()
        wire = built.wire()
        for one, other in pairwise(corners):
            built.edge(wire, _line(tuple(one + gap), tuple(other)))
        rings, _ = built.boundary(Cylinder([0.0, 0.0, 0.0], 5.0))
        assert len(rings[0]) == count
        assert np.array_equal(rings[0][0], rings[0][-1])


@pytest.mark.parametrize("ends_at_start", [False, True])
def test_a_closed_ring_has_no_point_twice(ends_at_start: bool) -> None:
    """Steps up to 0.5 along both axes are no steps. Each step that counts is along one axis,
    and the last point has the first one's u."""
    points = [[8.0, 4.0], [9.0, 4.0], [9.0, 7.0], [6.0, 7.0], [6.0, 5.0], [8.0, 5.0]]
    repeated = np.array(points)[[0, 0, 1, 2, 2, 2, 3, 4, 5]]
    repeated[1] += [-0.5, 0.5]
    repeated[4] += [0.25, 0.5]
    repeated[5] += [0.5, 0.0]
    if ends_at_start:
        repeated = np.concatenate([repeated, [[8.5, 4.5]]])
        repeated[-2] = [7.0, 5.0]
        points[-1] = [7.0, 5.0]
    assert _closed(repeated, 0.5).tolist() == [*points, points[0]]


PLACES = [(5.0, 1.0), (9.0, 1.0), (9.0, 3.0), (5.0, 3.5), (5.5, 2.0), (4.0, 2.0)]


def _bowed(start: tuple[float, float], end: tuple[float, float]) -> FloatArray:
    """Three points, the second one beside the line."""
    one, other = np.array(start), np.array(end)
    way = other - one
    return np.stack([one, one + 0.4 * way + 0.1 * way[::-1], other])


@pytest.mark.parametrize("seed", range(8))
def test_pieces_in_any_order_are_joined_end_to_end(seed: int) -> None:
    """Six curved sides, which begin with the first one of the file: some start at one u or v."""
    sides = [_bowed(PLACES[i], PLACES[(i + 1) % 6]) for i in range(6)]
    order = np.random.default_rng(seed).permutation(6)
    joined = np.concatenate([sides[(order[0] + k) % 6] for k in range(6)])
    assert np.array_equal(_chained([sides[i] for i in order]), joined)


@pytest.mark.parametrize("across", [0, 1])
@pytest.mark.parametrize("start", [(0.0, 0.0), (300.0, 20.0)])
def test_the_next_piece_of_the_file_is_taken_unless_another_fits_much_better(
    across: int, start: tuple[float, float]
) -> None:
    """Pieces 8 by 1 together: up to 8e-6 the file's order is kept. The other piece ends at
    another place, by which both orders are told apart; its end fits within 1 nm."""
    for gap, kept in ((7.9e-6, True), (8.1e-6, False)):
        pieces = [
            np.array([[0.0, 0.0], [8.0, 1.0]]),
            np.array([[8.0, 1.0 - 1e-9 - gap], [3.0, 1.0]]),
            np.array([[8.0 - 1e-9, 1.0], [2.0, 0.5]]),
        ]
        placed = [np.array(start) + (p[:, ::-1] if across else p) for p in pieces]
        order = (0, 1, 2) if kept else (0, 2, 1)
        assert np.array_equal(_chained(placed), np.concatenate([placed[i] for i in order]))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("points", [2, 9])
@pytest.mark.parametrize("turns", [-2, 0, 3])
@pytest.mark.parametrize("ways", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_two_circles_of_a_torus_bound_the_band_between_them(
    axis: int, points: int, turns: int, ways: tuple[int, int]
) -> None:
    """Around either axis, from 1 rad and from 1.3 rad, whole turns apart, each in either way:
    both circles in one ring against each other, which has the area of a turn times 0.8."""
    share = np.linspace(0.0, 1.0, points)
    circles = []
    for begin, across, way in ((1.0, 0.5, ways[0]), (1.3 + turns * TURN, 1.3, ways[1])):
        around = begin + TURN * (share if way > 0 else 1.0 - share)
        columns = [around, np.full(points, across)]
        circles.append(np.column_stack(columns[::-1] if axis else columns))
    ring = _band(circles, Torus([0.0, 0.0, 0.0], 9.0, 2.0).domain)
    assert len(ring) == 2 * points + 1
    assert np.array_equal(ring[:points], circles[0])
    assert np.array_equal(ring[-1], ring[0])
    second = circles[1] if ways[0] != ways[1] else circles[1][::-1]
    moved = ring[points:-1] - second
    assert np.ptp(moved, axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert moved[0, 1 - axis] == 0.0
    assert moved[0, axis] / TURN == pytest.approx(round(moved[0, axis] / TURN), abs=1e-9)
    assert np.abs(ring[points] - ring[points - 1])[axis] < 0.5 * TURN
    # The slanted ends are parallel.
    assert abs(_area(ring)) == pytest.approx(0.8 * TURN, rel=1e-12)


@pytest.mark.parametrize(("turn", "closes"), [(0.992, True), (1.008, True), (0.988, False),
                                               (1.012, False)])  # fmt: skip
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_circle_goes_around_within_a_hundredth(turn: float, closes: bool, way: float) -> None:
    """Both circles in the same way: the second one is turned over, also where both lack a bit."""
    circles = [np.array([[1.0, v], [1.0 + way * turn * TURN, v]]) for v in (0.0, 3.0)]
    domain = Cylinder([0.0, 0.0, 0.0], 5.0).domain
    if closes:
        ring = _band(circles, domain)
        assert abs(_area(ring)) == pytest.approx(3.0 * turn * TURN, rel=1e-12)
        return
    with pytest.raises(PretravelError, match="does not close"):
        _band(circles, domain)
    with pytest.raises(PretravelError, match="does not close"):
        _band([circles[0], np.array([[1.0, 3.0], [1.0 + TURN, 3.0]])], domain)
