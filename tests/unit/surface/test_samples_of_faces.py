"""Samples, bounds, middles, poles and triangles of single faces, whose numbers are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import shapely

from pretravel.base.arrays import FloatArray
from pretravel.surface.cad import face as face_module
from pretravel.surface.cad.face import Face, _has_no_closed_form, lattice
from pretravel.surface.cad.triangles import _lengths, _thinned, face_triangles
from pretravel.surface.cad.trim import Trim
from pretravel.surface.curves import Conic, Line, TrimmedCurve
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface
from pretravel.surface.parametric import Convex, FunctionSurface
from pretravel.surface.shapes import Ellipsoid, Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.surface.swept import Extrusion, Offset, Placed

ENDLESS = (math.inf, math.inf)
TURN = 2.0 * math.pi


def _ring(*corners: tuple[float, float]) -> FloatArray:
    return np.array([*corners, corners[0]])


def _rectangle(low: tuple[float, float], high: tuple[float, float]) -> FloatArray:
    return _ring(low, (high[0], low[1]), high, (low[0], high[1]))


def _face(base: Surface, kind: str, *rings: FloatArray, flips: bool = False) -> Face:
    trim = Trim(list(rings), base.domain.period) if rings else None
    return Face(1, "", kind, base, trim, flips, rings)


def _cylinder(radius: float, low: tuple[float, float], high: tuple[float, float]) -> Face:
    return _face(Cylinder([0.0, 0.0, 0.0], radius), "cylinder", _rectangle(low, high))


def _plane(*rings: FloatArray) -> Face:
    return _face(Plane([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]), "plane", *rings)


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A flat sheet, u along x and v along y, that states lengths of its own for du and dv."""

    lengths: Any
    upper: tuple[float, float] = (20.0, 20.0)
    broken: float = math.inf
    """Beyond this v it has no points."""
    curvature: float = 0.0

    @property
    def domain(self) -> Domain:
        return Domain((0.0, 0.0), self.upper)

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        point = np.column_stack([uv, np.zeros(len(uv))])
        point[uv[:, 1] > self.broken, 2] = np.nan
        du, dv = self.lengths(uv)
        return point, du[:, None] * np.eye(3)[0], dv[:, None] * np.eye(3)[1]

    def local(self, uv: FloatArray) -> LocalGeometry:
        bend = np.tile(np.diag([self.curvature, 0.0, 0.0]), (len(uv), 1, 1))
        bend[uv[:, 1] > self.broken] = np.nan
        return LocalGeometry(self.derivatives(uv)[0], np.tile(np.eye(3)[2], (len(uv), 1)), bend)

    def inside(self, uv: FloatArray) -> Any:
        return self.domain.contains(uv)

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return uv + displacement[:, :2]

    def nearest(self, points: FloatArray) -> FloatArray:
        return self.domain.confined(points[:, :2])


def _even(uv: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.ones(len(uv)), np.ones(len(uv))


def test_coarse_samples_are_a_grid_and_the_edges() -> None:
    """25 by 25 of a rectangle, and its edges, of which each side has 200 // 5 pieces. Of a plane
    with edges, the edges are all; a plane without edges has its grid."""
    for radius, low, high, gap in (
        (10.0, (0.3, 2.0), (1.5, 26.0), 1.0),
        (50.0, (0.3, 2.0), (1.5, 26.0), 2.5),
    ):
        coarse = _cylinder(radius, low, high).coarse
        assert coarse.inner == 625
        assert len(coarse.uv) == 625 + 161
        assert coarse.gap == pytest.approx(gap, rel=1e-12)
        grid = [(u, v) for v in np.linspace(2.0, 26.0, 25) for u in np.linspace(0.3, 1.5, 25)]
        assert coarse.uv[:625] == pytest.approx(np.array(grid))
        assert np.hypot(*coarse.points[:, :2].T) == pytest.approx(radius)
    ring = _rectangle((3.0, 4.0), (13.0, 6.0))
    flat = _plane(ring).coarse
    assert (flat.inner, flat.gap) == (0, 0.0)
    assert np.array_equal(flat.uv, ring)
    assert np.array_equal(flat.points, _plane(ring).base.derivatives(ring)[0])
    bare = replace(_plane(ring), borders=()).coarse
    assert (bare.inner, len(bare.uv)) == (625, 625)
    assert bare.gap == pytest.approx(10.0 / 24.0)
    corners = _ring((3.0, 4.0), (13.0, 4.6), (5.0, 9.0))
    triangle = replace(_plane(corners), borders=()).coarse
    places = lattice(np.array([3.0, 4.0]), np.array([13.0, 9.0]), np.array([25, 25]))
    within = shapely.contains_xy(shapely.Polygon(corners).buffer(1e-8), *places.T)
    assert np.array_equal(triangle.uv, places[within])


def test_a_surface_without_ends_has_nearest_points_within_the_edges() -> None:
    """A bent sheet that goes on for ever along y: of the face on it, from 20 to 30."""
    arc = Conic("ellipse", np.zeros(3), np.eye(3)[0], np.eye(3)[2], 9.0, 9.0)
    sheet = Extrusion(TrimmedCurve(arc, 0.0, 1.5), np.array([0.0, 1.0, 0.0]))
    face = _face(sheet, "extrusion", _rectangle((0.2, 20.0), (1.4, 30.0)))
    u, v = np.array([0.3, 0.8, 1.3]), np.array([21.0, 29.0, 24.0])
    points = np.column_stack([11.0 * np.cos(u), v, 11.0 * np.sin(u)])
    assert face.nearest(points) == pytest.approx(np.column_stack([u, v]), abs=1e-8)


@pytest.mark.parametrize(
    ("limit", "counts"), [(10_000, (20, 41)), (819, (15, 30)), (330, (11, 22)), (241, (9, 16))]
)
def test_a_grid_has_the_spacing_up_to_the_largest_number(
    limit: int, counts: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cone: its arcs are longest at its wide end. 18.6 spacings and 40 of them; while they
    are too many, there are three quarters of them, and 9 at the least: 820, 450, 242 points."""
    monkeypatch.setattr(face_module, "_MOST_SAMPLES", limit)
    angle, spacing = math.radians(30.0), 0.2
    wide = 18.6 * spacing / 0.3
    high = (0.7, wide / math.sin(angle))
    low = (0.4, high[1] - 40.0 * spacing + 1e-9)
    cone = Cone([0.0, 0.0, 0.0], 0.0, angle)
    face = replace(_face(cone, "cone", _rectangle(low, high)), borders=())
    uv, gap = face.sampled(spacing)
    assert np.array_equal(face.samples(spacing), uv)
    assert uv == pytest.approx(lattice(np.array(low), np.array(high), np.array(counts)))
    expected = max(0.3 * wide / (counts[0] - 1), 40.0 * spacing / (counts[1] - 1))
    assert gap == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("limit", "sides", "counts"),
    [(242, (19.0, 40.0), (11, 22)), (150, (3.2, 39.0), (9, 16)), (999, (3.2, 39.0), (9, 40))],
)
def test_a_grid_of_exactly_the_largest_number_is_allowed(
    limit: int,
    sides: tuple[float, float],
    counts: tuple[int, int],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """11 by 22 are 242. From 9 by 40, which are 360, to 9 by 30, 9 by 22 and 9 by 16."""
    monkeypatch.setattr(face_module, "_MOST_SAMPLES", limit)
    face = replace(_plane(_rectangle((5.0, 7.0), (5.0 + sides[0], 7.0 + sides[1]))), borders=())
    uv, gap = face.sampled(1.0)
    assert len(uv) == counts[0] * counts[1]
    assert len(np.unique(uv[:, 0].round(9))) == counts[0]
    assert gap == pytest.approx(max(sides[0] / (counts[0] - 1), sides[1] / (counts[1] - 1)))


def test_a_grid_is_row_by_row_along_v() -> None:
    grid = lattice(np.array([1.0, 5.0]), np.array([2.0, 9.0]), np.array([2, 3]))
    assert grid.tolist() == [[u, v] for v in (5.0, 7.0, 9.0) for u in (1.0, 2.0)]


@pytest.mark.parametrize(("radius", "angle", "length"), [(20.0, 1.2, 36.0), (0.1, 1.2, 48.0)])
def test_bounds_are_wider_than_samples_by_what_lies_between(
    radius: float, angle: float, length: float
) -> None:
    """By a thousandth of a millimetre and gap²/R, at most the gap: 1.5 mm and 2 mm here."""
    face = _cylinder(radius, (0.3, 2.0), (0.3 + angle, 2.0 + length))
    gap = length / 24.0
    slack = 1e-3 + min(gap, gap**2 / radius)
    low = [radius * math.cos(0.3 + angle), radius * math.sin(0.3), 2.0]
    high = [
        radius * math.cos(0.3),
        radius * math.sin(min(0.3 + angle, 0.5 * math.pi)),
        2.0 + length,
    ]
    assert face.bounds[0] == pytest.approx(np.array(low) - slack, rel=1e-9)
    assert face.bounds[1] == pytest.approx(np.array(high) + slack, rel=1e-9)
    flat = _plane(_rectangle((3.0, 4.0), (13.0, 6.0)))
    corners = flat.base.derivatives(np.array([[3.0, 4.0], [13.0, 6.0]]))[0]
    assert flat.bounds[0] == pytest.approx(corners.min(axis=0) - 1e-3, rel=1e-12)
    assert flat.bounds[1] == pytest.approx(corners.max(axis=0) + 1e-3, rel=1e-12)


def test_bounds_of_a_face_of_unknown_curvature_are_those_of_its_samples() -> None:
    face = _face(_Sheet(_even, curvature=math.nan), "other")
    assert face.bounds[0] == pytest.approx([-1e-3, -1e-3, -1e-3])
    assert face.bounds[1] == pytest.approx([20.0 + 1e-3, 20.0 + 1e-3, 1e-3])


def test_bounds_use_the_sharpest_bend() -> None:
    """A torus: its tube of 0.5 mm bends more than what is around its axis."""
    face = _face(Torus([0.0, 0.0, 0.0], 9.0, 0.5), "torus")
    gap = 9.5 * TURN / 24.0
    assert face.coarse.gap == pytest.approx(gap)
    assert face.bounds[1] == pytest.approx([9.5 + gap + 1e-3, 9.5 + gap + 1e-3, 0.5 + gap + 1e-3])
    assert face.bounds[0] == pytest.approx(-face.bounds[1])


def test_the_largest_convex_curvature_is_that_of_the_outside() -> None:
    """1/r of the tube of a torus; of a ball 1/r, and none from within it; numbers alone count."""
    torus, ball = Torus([0.0, 0.0, 0.0], 9.0, 4.0), Sphere([0.0, 0.0, 0.0], 20.0)
    assert _face(torus, "torus").largest_convex_curvature == pytest.approx(0.25)
    assert _face(ball, "sphere").largest_convex_curvature == pytest.approx(0.05)
    assert _face(ball, "sphere", flips=True).largest_convex_curvature == 0.0
    # Seen from within, a torus bends away from its inner side: 1 / (9 - 4).
    inside = _face(torus, "torus", flips=True)
    assert inside.largest_convex_curvature == pytest.approx(0.2)
    sheet = _Sheet(_even, broken=15.0, curvature=0.3)
    assert _face(sheet, "other").largest_convex_curvature == pytest.approx(0.3)
    nothing = replace(sheet, broken=-1.0)
    assert _face(nothing, "other").largest_convex_curvature == 0.0


def test_the_middle_is_that_in_lengths_on_the_surface() -> None:
    """A right triangle of 12 and 5 mm on a cylinder: the circle of 2 mm in it. Of the radius 10,
    u is ten times as long as it is wide. Without edges: the middle of the domain."""
    for radius in (1.0, 10.0, 40.0):
        ring = _ring((0.5, 7.0), (0.5 + 12.0 / radius, 7.0), (0.5, 12.0))
        middle = _face(Cylinder([0.0, 0.0, 0.0], radius), "cylinder", ring).middle
        assert (middle - [0.5, 7.0]) * [radius, 1.0] == pytest.approx([2.0, 2.0], abs=0.2)
    flat = _plane(_ring((0.5, 7.0), (12.5, 7.0), (0.5, 12.0)))
    assert flat.middle == pytest.approx([2.5, 9.0], abs=0.2)
    assert flat.middle.tolist() == replace(flat, kind="other").middle.tolist()
    spline = FunctionSurface(lambda u, v: (u, v, u * v), (2.0, 5.0), (-1.0, 7.0))
    assert _face(spline, "other").middle.tolist() == [3.5, 3.0]


def _odd_lengths(uv: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Usually 2 and 5; very long in one corner and unknown along one side."""
    du, dv = np.full(len(uv), 2.0), np.full(len(uv), 5.0)
    du[(uv[:, 0] < 1.0) & (uv[:, 1] < 1.0)] = 1e4
    du[uv[:, 1] > 19.9], dv[uv[:, 1] > 19.9] = np.nan, np.nan
    return du, dv


def _still(share: float) -> Any:
    return lambda uv: (np.zeros(len(uv)), np.full(len(uv), share))


def test_the_middle_of_a_face_whose_derivatives_are_odd() -> None:
    """The usual lengths count: a triangle with the legs 6 and 2.4 has legs of 12 mm. Where one
    parameter does not move the point, or none does, there is still a middle within the face."""
    ring = _ring((0.0, 0.0), (20.0, 0.0), (0.0, 20.0))
    face = _face(_Sheet(_odd_lengths), "other", ring)
    middle = face.middle * [2.0, 5.0]
    legs = 40.0 + 100.0
    inner = 0.5 * (legs - math.hypot(40.0, 100.0))
    assert middle == pytest.approx([inner, inner], abs=1.0)
    square = _rectangle((4.0, 1.0), (8.0, 5.0))
    for share in (0.0, 0.1, 3.0):
        u, v = _face(_Sheet(_still(share)), "other", square).middle
        assert 4.0 < u < 8.0
        assert 1.0 < v < 5.0


def test_points_along_edges_are_even_in_each_piece() -> None:
    """Of an edge of three pieces on a cone, for a spacing of 0.5 mm: arcs of r times the angle.
    The first piece is along u, the second along v, the third has no length."""
    angle = math.radians(30.0)
    border = np.array([[0.2, 4.0], [1.2, 4.0], [1.2, 9.2], [1.2, 9.2]])
    face = _face(Cone([0.0, 0.0, 0.0], 0.0, angle), "cone")
    face = replace(face, borders=(border, border[::-1]))
    for most, counts in ((100_000, (4, 11, 1)), (7, (4, 7, 1))):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(face_module, "_MOST_ON_EDGE", most)
            lines = face.edge_lines(0.5)
        pieces = [
            border[i] + np.arange(n)[:, None] / n * (border[i + 1] - border[i])
            for i, n in enumerate(counts)
        ]
        assert lines[0] == pytest.approx(np.concatenate([*pieces, border[-1:]]))
        assert lines[1] == pytest.approx(lines[0][::-1])
    assert np.array_equal(face.edge_samples(0.5), np.concatenate(face.edge_lines(0.5)))
    coarse = face.edge_lines(math.inf)[0]
    assert coarse == pytest.approx(
        np.concatenate([border[i] + np.arange(50)[:, None] / 50 * (border[i + 1] - border[i])
                        for i in range(3)] + [border[-1:]])
    )  # fmt: skip
    assert _face(face.base, "cone").edge_samples(0.5).shape == (0, 2)


def test_a_long_edge_keeps_its_points() -> None:
    """Of 401 points: none are put between, or one where they are two spacings apart."""
    u = 0.1 * np.arange(401)
    border = np.column_stack([u, np.sin(u)])
    face = replace(_plane(), borders=(border,))
    assert np.array_equal(face.edge_lines(math.inf)[0], border)
    assert np.array_equal(face.edge_lines(1.0)[0], border)
    assert len(face.edge_lines(0.099)[0]) > 700


def test_samples_nearest_to_points_come_in_the_order_of_their_distance() -> None:
    """All of them where more are asked for."""
    ring = _ring((0.0, 0.0), (9.0, 1.0), (5.0, 8.0), (1.0, 6.0))[:-1]
    face = replace(_plane(_ring(*map(tuple, ring))), borders=(ring,))
    points = face.derivatives(np.array([[1.0, 0.5], [6.0, 6.0], [2.0, 5.0]]))[0] + [0.0, 0.0, 2.0]
    away = np.linalg.norm(points[:, None] - face.derivatives(ring)[0], axis=2)
    order = np.argsort(away, axis=1)
    for count in (1, 3, 4, 9):
        found = list(face.starts_near(points, count))
        assert len(found) == min(count, 4)
        for rank, uv in enumerate(found):
            assert np.array_equal(uv, ring[order[:, rank]])


def test_distances_at_two_resolutions_of_an_edge() -> None:
    """Beyond the edge u = 0 of a square, at heights between its samples and its corners."""
    face = _plane(_rectangle((0.0, 0.0), (8.0, 8.0)))
    points = face.derivatives(np.array([[-0.01, 3.0], [-3.0, -4.0], [2.0, 2.0]]))[0]
    points[2] += [0.0, 0.0, 6.0]
    assert face.distance(points, 2.0) == pytest.approx([math.hypot(0.01, 1.0), 5.0, 6.0])
    assert face.distance(points, 1.0) == pytest.approx([0.01, 5.0, 6.0])
    assert face.distance(points, 2.0) == pytest.approx([math.hypot(0.01, 1.0), 5.0, 6.0])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize(
    ("width", "place", "pole"),
    [
        (0.0, 0.1, True), (0.9e-9, 0.1, True), (1.5e-9, 0.1, False), (1.0, 0.1, False),
        (0.9e-6, 1000.0, True), (1.5e-6, 1000.0, False),
    ],
)  # fmt: skip
def test_an_edge_of_the_parameters_that_is_a_point_is_a_pole(
    axis: int, end: int, width: float, place: float, pole: bool
) -> None:
    """The end of a cone of parameters from 2 to 5 and from 3 to 3.7, where its radius is `width`
    over the 0.7 or 3 of the other parameter; a pole within 1e-9 of its coordinates, or of 1 mm."""
    bounds = ((2.0, 5.0), (3.0, 3.7))
    tip, other = bounds[axis][end], bounds[1 - axis]

    def cone(u: FloatArray, v: FloatArray) -> tuple[FloatArray, ...]:
        along, across = ((u, v), (v, u))[axis]
        far = (along - tip) if end == 0 else (tip - along)
        radius = (width + 0.1 * far) * (across - other[0]) / (other[1] - other[0])
        return place + 0.1 * far, 0.01 + radius, 0.02 + 0.5 * radius

    assert _face(FunctionSurface(cone, *bounds), "other").has_poles == pole


def test_nearest_points_in_closed_form() -> None:
    """Of elementary surfaces, wherever they are placed; not of splines, sweeps and offsets."""
    here = np.array([1.0, 2.0, 3.0])
    ball = Sphere([0.0, 0.0, 0.0], 5.0)
    offset = Offset(Ellipsoid([0.0, 0.0, 0.0], [9.0, 8.0, 7.0]), 1.0)
    swept = Extrusion(Line(np.zeros(3), np.eye(3)[0]), np.eye(3)[1])
    for surface, iterated in ((ball, False), (Convex(), True), (offset, True), (swept, True)):
        placed = Placed(surface, np.eye(3), here)
        for one in (surface, placed, Placed(placed, np.eye(3), here)):
            assert _has_no_closed_form(one) is iterated


class TestTriangles:
    """Of faces, for pictures."""

    def test_they_cover_the_region(self) -> None:
        """Without its hole; each lies within it. The region is shapely's."""
        outer, hole = _rectangle((2.0, 1.0), (42.0, 31.0)), _rectangle((10.0, 6.0), (20.0, 25.0))
        notch = _ring((2.0, 1.0), (42.0, 1.0), (42.0, 31.0), (30.0, 31.0), (24.0, 5.0), (2.0, 31.0))
        for rings in ((outer,), (outer, hole), (hole, outer), (notch,)):
            face = _plane(*rings)
            shown = face_triangles(face)
            region = shapely.Polygon()
            for ring in rings:
                region = region.symmetric_difference(shapely.Polygon(ring))
            corners = face.base.nearest(shown.points)[shown.corners]
            pieces = shapely.polygons(corners)
            assert sum(shapely.area(pieces)) == pytest.approx(region.area, rel=1e-9)
            assert shapely.area(shapely.union_all(pieces)) == pytest.approx(region.area, rel=1e-6)
            assert region.buffer(1e-6).contains(shapely.MultiPoint(shapely.centroid(pieces)))
            assert region.buffer(1e-6).contains(shapely.MultiPoint(corners.reshape(-1, 2)))
            assert len(np.unique(shown.corners)) == len(np.unique(shown.points, axis=0))
            at = face.derivatives(face.middle[None])[0][0]
            assert np.array_equal(shown.middle, at)
            assert [len(edge) > 3 for edge in shown.edges] == [True] * len(rings)

    @pytest.mark.parametrize(("faces", "side"), [(1, 33), (400, 10), (100_000, 5)])
    def test_more_faces_are_shown_with_fewer_points(self, faces: int, side: int) -> None:
        """Of 40 000 on all: the side of a square grid, from 5 to 33; 5 on a plane."""
        torus = _face(Torus([0.0, 0.0, 0.0], 9.0, 4.0), "torus")
        shown = face_triangles(torus, faces=faces)
        low, high = torus.box
        grid = lattice(low, high, np.array([side, side]))
        assert shown.points == pytest.approx(torus.derivatives(grid)[0])
        assert len(shown.corners) == 2 * (side - 1) ** 2
        assert shown.edges == ()
        flat = replace(_plane(_rectangle((0.0, 0.0), (4.0, 5.0))), borders=())
        assert len(face_triangles(flat, faces=faces).points) == 25

    def test_the_grid_keeps_away_from_the_edges(self) -> None:
        """40 by 20: points farther than 0.75 of a fifth of the diagonal from those of the edges;
        on the long axis of the rectangle alone."""
        face = _plane(_rectangle((3.0, 4.0), (43.0, 24.0)))
        shown = face_triangles(face, faces=100_000)
        kept = face.base.nearest(shown.points[: -len(shown.edges[0])])
        assert kept.tolist() == [[13.0, 14.0], [23.0, 14.0], [33.0, 14.0]]
        assert np.array_equal(shown.points[3:], shown.edges[0])
        border = face.base.nearest(shown.edges[0])
        assert border[[0, -1]].tolist() == [[3.0, 4.0], [3.0, 4.0]]
        # The corners at 40, 60 and 100 mm, and the first points beyond every fifth.
        for corner in ([43.0, 4.0], [43.0, 24.0], [3.0, 24.0]):
            assert np.abs(border - corner).max(axis=1).min() < 1e-9

    def test_points_that_are_none_are_left_out(self) -> None:
        """A sheet without points beyond v = 12: four of five rows of a grid are left."""
        shown = face_triangles(_face(_Sheet(_even, broken=16.0), "other"), faces=100_000)
        assert len(shown.points) == 20
        assert np.isfinite(shown.points).all()
        assert len(shown.corners) == 2 * 4 * 3

    def test_a_face_without_width_has_no_triangles(self) -> None:
        shown = face_triangles(_face(_Sheet(_even, upper=(9.0, 0.0)), "other"), faces=100_000)
        assert shown.corners.shape == (0, 3)
        assert len(shown.points) == 25

    def test_parameters_per_length(self) -> None:
        """On a cylinder 1/R and 1; the usual ones where lengths are odd; at most a million times
        the other's where one parameter does not move the point; finite where none does."""
        assert _lengths(_cylinder(4.0, (0.3, 2.0), (0.9, 7.0))) == pytest.approx([0.25, 1.0])
        assert _lengths(_face(_Sheet(_odd_lengths), "other")) == pytest.approx([0.5, 0.2])
        assert _lengths(_face(_Sheet(_still(4.0)), "other")) == pytest.approx([0.25e6, 0.25])
        assert np.isfinite(_lengths(_face(_Sheet(_still(0.0)), "other"))).all()

    def test_triangles_are_those_of_delaunay_in_space(self) -> None:
        """On a cylinder that is developed: no point within the circle around a triangle."""
        radius = 40.0
        ring = _ring((0.3, 2.0), (0.8, 5.0), (0.7, 30.0), (0.45, 19.0))
        shown = face_triangles(_face(Cylinder([0.0, 0.0, 0.0], radius), "cylinder", ring))
        x, y, z = shown.points.T
        flat = np.column_stack([radius * np.arctan2(y, x), z])
        p, q, r = np.moveaxis(flat[shown.corners], 1, 0)
        sides = 2.0 * np.stack([q - p, r - p], axis=1)
        squares = np.stack([np.sum(q**2 - p**2, axis=1), np.sum(r**2 - p**2, axis=1)], axis=1)
        thick = np.abs(np.linalg.det(sides)) > 1e-3
        center = np.linalg.solve(sides[thick], squares[thick, :, None])[:, :, 0]
        size = np.linalg.norm(center - p[thick], axis=1)
        away = np.linalg.norm(flat[None] - center[:, None], axis=2).min(axis=1)
        assert thick.sum() > 100
        assert np.all(away > size * (1.0 - 1e-6))


PLAIN = Face(1, "", "plane", Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), None, False)


@pytest.mark.parametrize(("step", "spacing"), [(0.7, 1e9), (3.3, 1e9), (0.7, 0.9), (3.3, 0.9)])
def test_points_of_an_edge_at_bends_and_spacings(step: float, spacing: float) -> None:
    """A polygon on a circle turns by one step at each corner: the first corner at or beyond every
    ten degrees, and beyond every spacing, of the chord."""
    degrees = step * np.arange(240)
    circle = 0.2 * np.column_stack([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    kept = _thinned(PLAIN, circle, spacing)
    chord = 0.4 * math.sin(math.radians(0.5 * step))
    expected = [0]
    for i in range(1, 239):
        bends = math.floor(i * step / 10.0 + 1e-9) != math.floor((i - 1) * step / 10.0 + 1e-9)
        far = math.floor(i * chord / spacing) != math.floor((i - 1) * chord / spacing)
        if bends or far:
            expected.append(i)
    assert np.array_equal(kept, circle[[*expected, 239]])


def test_straight_edges_have_points_at_a_spacing_only() -> None:
    """Steps of 0.05 to 0.6 mm in many directions: the first point beyond every 1.5 mm."""
    rng = np.random.default_rng(3)
    for way in rng.normal(size=(20, 2)):
        along = np.cumsum(rng.uniform(0.05, 0.6, 50)) - 0.05
        along -= along[0]
        line = along[:, None] * way / np.linalg.norm(way)
        whole = np.floor(along / 1.5)
        expected = np.flatnonzero(np.diff(whole[:-1]) > 0) + 1
        kept = _thinned(PLAIN, line, 1.5)
        assert np.array_equal(kept, line[[0, *expected, 49]])


def test_edges_that_turn_back_and_stand_still_keep_their_corners() -> None:
    """There and back in many directions, with a point twice: no corner is lost."""
    for way in np.random.default_rng(4).normal(size=(60, 2)):
        line = np.outer([0.0, 1.0, 2.0, 1.0, 0.25], way)
        assert np.array_equal(_thinned(PLAIN, line, 1e9), line[[0, 2, 4]])
        twice = np.outer([0.0, 1.0, 1.0, 2.0, 0.5], way)
        kept = _thinned(PLAIN, twice, 1e9)
        assert np.array_equal(kept[[0, -2, -1]], twice[[0, 3, 4]])
