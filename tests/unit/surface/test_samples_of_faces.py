"""Samples, bounds, middles, poles and triangles of single faces, whose numbers are known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree

from pretravel.base.arrays import FloatArray
from pretravel.surface.cad import face as face_module
from pretravel.surface.cad.face import Face, lattice
from pretravel.surface.cad.triangles import face_triangles
from pretravel.surface.cad.trim import Trim
from pretravel.surface.curves import Conic, TrimmedCurve
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface
from pretravel.surface.parametric import FunctionSurface
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.surface.swept import Extrusion

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


TRIANGLE = _ring((3.0, 4.0), (13.0, 4.6), (5.0, 9.0))
FACES = {
    "cylinder": _cylinder(10.0, (0.3, 2.0), (1.5, 26.0)),
    "cone": _face(Cone([0.0, 0.0, 0.0], 0.0, 0.5), "cone", _rectangle((0.4, 20.0), (0.7, 33.0))),
    "torus": _face(Torus([0.0, 0.0, 0.0], 9.0, 0.5), "torus"),
    "triangle": replace(_plane(TRIANGLE), borders=()),
    "triangle with edges": _plane(TRIANGLE),
    "sphere": _face(Sphere([1.0, 2.0, 3.0], 20.0), "sphere", _rectangle((0.1, -0.7), (1.1, 0.9))),
}


def _anywhere(face: Face) -> FloatArray:
    """Points of the face by chance, (n, 3)."""
    uv = np.random.default_rng(6).uniform(*face.box, (3000, 2))
    return face.derivatives(uv[face.inside(uv)])[0]


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize(
    ("spacing", "limit"), [(0.3, 250_000), (1.0, 250_000), (0.3, 300), (math.inf, 250_000)]
)
def test_samples_cover_a_face(
    name: str, spacing: float, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the spacing, unless it takes too many: no point is farther from a sample than half the
    diagonal of a cell, or half its side at an edge. The stated gap is not wider than needed."""
    monkeypatch.setattr(face_module, "_MOST_SAMPLES", limit)
    face = FACES[name]
    uv, gap = replace(face, borders=()).sampled(spacing)
    assert face.inside(uv).all()
    tree = cKDTree(face.derivatives(uv)[0])
    away = tree.query(_anywhere(face))[0].max()
    # A triangle ends within cells.
    ends = 2.0 if "triangle" in name else 1.0
    assert away <= ends * gap * math.sqrt(0.5) * 1.001
    assert len(uv) <= limit
    next_ones = tree.query(face.derivatives(uv)[0], k=2)[0][:, 1]
    if limit > 300 and math.isfinite(spacing):
        assert 0.6 * spacing < gap <= spacing
        assert np.median(next_ones) > 0.3 * spacing
    whole = face.samples(spacing)
    edges = face.edge_samples(spacing)
    assert np.array_equal(whole, np.concatenate([uv, edges]))


@pytest.mark.parametrize("name", [name for name in FACES if name != "triangle"])
def test_no_point_of_a_face_is_outside_its_bounds(name: str) -> None:
    """Which are not wider than the face by more than the distance of its coarse samples."""
    face = FACES[name]
    low, high = face.bounds
    points = _anywhere(face)
    assert np.all((low <= points) & (points <= high))
    wide = 2e-3 if face.kind == "plane" else face.coarse.gap + 2e-3
    at = np.concatenate([points, face.coarse.points])
    assert np.all(low >= at.min(axis=0) - wide)
    assert np.all(high <= at.max(axis=0) + wide)
    assert face.coarse.points == pytest.approx(face.derivatives(face.coarse.uv)[0], abs=1e-12)


def test_a_surface_without_ends_has_nearest_points_within_the_edges() -> None:
    """A bent sheet that goes on for ever along y: of the face on it, from 20 to 30."""
    arc = Conic("ellipse", np.zeros(3), np.eye(3)[0], np.eye(3)[2], 9.0, 9.0)
    sheet = Extrusion(TrimmedCurve(arc, 0.0, 1.5), np.array([0.0, 1.0, 0.0]))
    face = _face(sheet, "extrusion", _rectangle((0.2, 20.0), (1.4, 30.0)))
    u, v = np.array([0.3, 0.8, 1.3]), np.array([21.0, 29.0, 24.0])
    points = np.column_stack([11.0 * np.cos(u), v, 11.0 * np.sin(u)])
    assert face.nearest(points) == pytest.approx(np.column_stack([u, v]), abs=1e-8)


def test_bounds_of_a_face_of_unknown_curvature_are_those_of_its_samples() -> None:
    face = _face(_Sheet(_even, curvature=math.nan), "other")
    assert face.bounds[0] == pytest.approx([-1e-3, -1e-3, -1e-3])
    assert face.bounds[1] == pytest.approx([20.0 + 1e-3, 20.0 + 1e-3, 1e-3])


def test_bounds_rise_by_the_sharpest_bend_between_samples() -> None:
    """A tube of 0.5 mm bends more than what is around the axis: by the gap. A cylinder of 20 mm
    with 1.5 mm between samples: by gap²/R."""
    face = FACES["torus"]
    gap = 9.5 * TURN / 24.0 + 1e-3
    assert face.bounds[1] == pytest.approx([9.5 + gap, 9.5 + gap, 0.5 + gap])
    assert face.bounds[0] == pytest.approx(-face.bounds[1])
    face = _cylinder(20.0, (0.3, 2.0), (1.5, 38.0))
    assert face.bounds[0][2] == pytest.approx(2.0 - 1e-3 - 1.5**2 / 20.0, rel=1e-9)


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


@pytest.mark.parametrize(("spacing", "most"), [(0.5, 100_000), (0.1, 100_000), (0.5, 7)])
def test_points_along_edges_are_even_in_each_piece(
    spacing: float, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an edge of three pieces on a cone: arcs of r times the angle. The first piece is along u,
    the second along v, the third has no length."""
    monkeypatch.setattr(face_module, "_MOST_ON_EDGE", most)
    angle = math.radians(30.0)
    border = np.array([[0.2, 4.0], [1.2, 4.0], [1.2, 9.2], [1.2, 9.2]])
    face = _face(Cone([0.0, 0.0, 0.0], 0.0, angle), "cone")
    face = replace(face, borders=(border, border[::-1]))
    lines = face.edge_lines(spacing)
    lengths = (4.0 * math.sin(angle), 5.2)
    counts = [*(min(math.ceil(each / spacing), most) for each in lengths), 1]
    pieces = [
        border[i] + np.arange(n)[:, None] / n * (border[i + 1] - border[i])
        for i, n in enumerate(counts)
    ]
    assert lines[0] == pytest.approx(np.concatenate([*pieces, border[-1:]]))
    assert lines[1] == pytest.approx(lines[0][::-1])
    assert np.array_equal(face.edge_samples(spacing), np.concatenate(lines))
    assert _face(face.base, "cone").edge_samples(spacing).shape == (0, 2)


def test_coarse_points_of_an_edge_show_its_shape() -> None:
    """Of a straight line in the parameters, which can be an arc: many. A polyline keeps its own."""
    (line,) = FACES["cylinder"].edge_lines(math.inf)
    assert len(line) > 100
    for corner in FACES["cylinder"].borders[0]:
        assert np.abs(line - corner).max(axis=1).min() < 1e-12
    u = 0.1 * np.arange(401)
    border = np.column_stack([u, np.sin(u)])
    face = replace(_plane(), borders=(border,))
    for spacing in (math.inf, 1.0):
        assert np.array_equal(face.edge_lines(spacing)[0], border)
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
    ("width", "place", "pole"), [(0.0, 0.1, True), (1.5e-9, 0.1, False), (0.9e-6, 1000.0, True)]
)
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

    def test_more_faces_are_shown_with_fewer_points(self) -> None:
        """Without edges, the points are a grid on the face."""
        torus = FACES["torus"]
        shown = [face_triangles(torus, faces=count) for count in (1, 400, 100_000)]
        counts = [len(each.points) for each in shown]
        assert counts[0] > counts[1] > counts[2] >= 16
        for each in shown:
            side = math.isqrt(len(each.points))
            grid = lattice(*torus.box, np.array([side, side]))
            assert each.points == pytest.approx(torus.derivatives(grid)[0])
            assert len(each.corners) == 2 * (side - 1) ** 2
            assert each.edges == ()

    def test_edges_keep_their_corners_and_bends(self) -> None:
        """Of a circle of 0.2 mm, in steps of 0.7°: no chord is longer than its bend of 10°; of a
        rectangle of 40 by 20 its corners, and points along its sides."""
        turn = np.radians(np.arange(0.0, 360.7, 0.7))
        circle = 0.2 * np.column_stack([np.cos(turn), np.sin(turn)])
        circle[-1] = circle[0]
        for scale in (1.0, 100.0):
            (edge,) = face_triangles(_plane(scale * circle)).edges
            chords = np.linalg.norm(np.diff(edge, axis=0), axis=1)
            assert chords.max() <= 0.2 * scale * 2.0 * math.sin(math.radians(0.5 * 10.7)) * 1.001
            assert chords[0] > 2.0 * 0.2 * scale * math.radians(0.7)
            assert len(edge) < 0.5 * len(circle)
        face = _plane(_rectangle((3.0, 4.0), (43.0, 24.0)))
        shown = face_triangles(face, faces=100_000)
        border = face.base.nearest(shown.edges[0])
        assert border[[0, -1]].tolist() == [[3.0, 4.0], [3.0, 4.0]]
        for corner in ([43.0, 4.0], [43.0, 24.0], [3.0, 24.0]):
            assert np.abs(border - corner).max(axis=1).min() < 1e-9
        assert len(border) > 8
        # The grid keeps away from the edges.
        kept = face.base.nearest(shown.points[: -len(border)])
        assert len(kept) >= 3
        assert np.abs(kept[:, 1] - 14.0).max() < 1.0

    def test_edges_that_turn_back_keep_their_corners(self) -> None:
        """There and back, with a point twice: of a face whose one edge is such a line."""
        for way in np.random.default_rng(4).normal(size=(20, 2)):
            for share, corners in (((0.0, 1.0, 2.0, 1.0, 0.25), (0, 2, 4)),
                                   ((0.0, 1.0, 1.0, 2.0, 0.5), (0, 3, 4))):  # fmt: skip
                line = np.outer(share, way) + 5.0
                face = replace(_plane(_rectangle((0.0, 0.0), (10.0, 10.0))), borders=(line,))
                (edge,) = face_triangles(face).edges
                found = face.base.nearest(edge)
                for corner in corners:
                    assert np.abs(found - line[corner]).max(axis=1).min() < 1e-9

    def test_points_that_are_none_are_left_out(self) -> None:
        """A sheet without points beyond v = 12: four of five rows of a grid are left."""
        shown = face_triangles(_face(_Sheet(_even, broken=16.0), "other"), faces=100_000)
        assert len(shown.points) == 20
        assert np.isfinite(shown.points).all()
        assert len(shown.corners) == 2 * 4 * 3

    @pytest.mark.parametrize("share", [0.0, 4.0])
    def test_a_face_without_width_has_no_triangles(self, share: float) -> None:
        """One has some whose parameters, one or both, do not move a point."""
        shown = face_triangles(_face(_Sheet(_even, upper=(9.0, 0.0)), "other"), faces=100_000)
        assert shown.corners.shape == (0, 3)
        assert len(shown.points) == 25
        shown = face_triangles(_face(_Sheet(_still(share)), "other"), faces=100_000)
        assert np.isfinite(shown.points).all()
        assert len(shown.corners) > 0

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
