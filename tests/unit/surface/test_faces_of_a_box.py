"""Searches among the faces of a part, against a box, whose distances are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.surface.cad import face_boxes
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.cad.brep_geometry import SurfaceRecord
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.face_boxes import FaceBoxes
from pretravel.surface.cad.kernel_process import CadContent
from pretravel.surface.cad.part import Cloud, Part
from pretravel.surface.cad.step_part import _face
from pretravel.surface.cad.trim import Trim
from pretravel.surface.contact import Lines, ball_center
from pretravel.surface.curves import Curve, Line
from pretravel.surface.search import ContactProblem, ContactSearch
from pretravel.surface.shapes import Plane, Sphere

HALF = np.array([10.0, 4.0, 2.5])
"""Half sides of the box, which are all different."""


def _rectangle(number: int, axis: int, side: float, flips: bool) -> Face:
    """The face of the box on one side of an axis; `flips`: its surface's normal points in."""
    normal = np.eye(3)[axis] * side * (-1.0 if flips else 1.0)
    plane = Plane(HALF * np.eye(3)[axis] * side, normal)
    along = np.delete(np.arange(3), axis)
    corners = np.zeros((5, 3))
    corners[:, axis] = side * HALF[axis]
    corners[:, along] = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * HALF[along]
    ring = plane.nearest(corners)
    return Face(
        number, f"side {number}", "plane", plane, Trim([ring], plane.domain.period), flips, (ring,)
    )


def _box(*chosen: int) -> Part:
    sides = [(axis, side) for axis in range(3) for side in (-1.0, 1.0)]
    faces = tuple(_rectangle(i + 1, *of, flips=i % 2 == 0) for i, of in enumerate(sides))
    return Part("box", faces, chosen or tuple(range(6)))


def _distance(points: FloatArray, face: int) -> FloatArray:
    """From a rectangle: the components beyond it."""
    axis, side = divmod(face, 2)
    low, high = -HALF, HALF.copy()
    at = (2 * side - 1) * HALF[axis]
    beyond = np.maximum(np.maximum(low - points, points - high), 0.0)
    beyond[:, axis] = points[:, axis] - at
    return np.asarray(np.linalg.norm(beyond, axis=1))


def _around(count: int = 300) -> FloatArray:
    return np.asarray(np.random.default_rng(2).uniform(-1.6, 1.6, (count, 3)) * HALF)


@pytest.mark.parametrize("face", range(6))
def test_the_distance_from_a_face_ends_at_its_edges(face: int) -> None:
    """Edges are sampled at a thousandth of the face's size, 20 µm of 20 mm at the most: an error
    of half of that at the edge itself, and less away from it."""
    search = ContactSearch(_box(), 1)
    points = _around()
    distance, uv = search._distance(face, points)
    assert distance == pytest.approx(_distance(points, face), abs=0.011)
    own = search.faces[face]
    assert isinstance(own, Face)
    assert np.linalg.norm(own.derivatives(uv)[0] - points, axis=1).min() >= 0.0
    inside = own.inside(uv)
    assert 20 < inside.sum() < 280
    assert distance[inside] == pytest.approx(_distance(points, face)[inside], abs=1e-12)
    over = search._distance(face, points[inside])[0]  # none of them beyond an edge
    assert np.array_equal(over, distance[inside])
    assert own.distance(points, 0.02) == pytest.approx(_distance(points, face), abs=0.011)


@pytest.mark.parametrize("chosen", [(0, 1, 2, 3, 4, 5), (1, 3, 4)])
def test_the_nearest_face_is_that_of_the_smallest_distance(chosen: tuple[int, ...]) -> None:
    part = _box(*chosen)
    points = _around(400)
    face, uv = ContactSearch(part, len(points)).nearest_faces(points)
    distances = np.stack([_distance(points, i) for i in chosen], axis=1)
    found = distances[np.arange(400), [chosen.index(i) for i in face]]
    # Faces whose distances differ by less than the error at sampled edges are as good.
    assert found == pytest.approx(distances.min(axis=1), abs=0.021)
    for i in np.unique(face):
        own = part.faces[i]
        foot = own.derivatives(uv[face == i])[0]
        axis, side = divmod(int(i), 2)
        assert foot[:, axis] == pytest.approx((2 * side - 1) * HALF[axis])


def test_near_an_edge_the_nearer_of_its_faces_is_found() -> None:
    """Inside the box, 0.03 to 0.2 mm from both faces of an edge: a sample of the farther face can
    be the nearest one. The feet lie within the faces, so that the distances are exact."""
    rng, part = np.random.default_rng(6), _box()
    points = rng.uniform(-0.8, 0.8, (1500, 3)) * HALF
    beside = np.array([[0, 1], [1, 2], [2, 0]])[rng.integers(0, 3, 1500)]
    for axis in beside.T:
        inwards = rng.uniform(0.03, 0.2, 1500)
        points[np.arange(1500), axis] = rng.choice([-1.0, 1.0], 1500) * (HALF[axis] - inwards)
    face, uv = ContactSearch(part, 1500).nearest_faces(points)
    distances = np.stack([_distance(points, i) for i in range(6)], axis=1)
    found = distances[np.arange(1500), face]
    assert found == pytest.approx(distances.min(axis=1), abs=1e-9)
    nearest_sample = part.cloud.face[part.cloud.tree.query(points)[1]]
    assert np.sum(nearest_sample != face) > 10
    for i in range(6):
        foot = part.faces[i].derivatives(uv[face == i])[0]
        apart = np.linalg.norm(foot - points[face == i], axis=1)
        # A start on the face: the foot, or a sample beside it, at most 1/150 of the part away.
        assert np.all(apart <= found[face == i] + part.size / 150.0)


def _plate(number: int, low: float, high: float, z: float) -> Face:
    plane = Plane([0.0, 0.0, z], [0.0, 0.0, 1.0])
    corners = np.array([[low, -4, z], [high, -4, z], [high, 4, z], [low, 4, z], [low, -4, z]])
    ring = plane.nearest(corners)
    return Face(number, "", "plane", plane, Trim([ring], plane.domain.period), False, (ring,))


@pytest.mark.parametrize(("depth", "met"), [(7.0, True), (14.0, True), (19.0, False)])
def test_other_faces_count_up_to_twice_the_distance_of_the_expected_one(
    depth: float, met: bool
) -> None:
    """Expected 5 mm beside an upper plate, 7 mm below the start: the reach is 1.1 * 7 + 0.1 mm,
    and a lower plate counts up to 2 * 5 + 7.8 mm. Two balls beside it meet the upper one."""
    part = Part("two", (_plate(1, -10.0, 10.0, 0.0), _plate(2, 12.0, 30.0, -depth)), (0, 1))
    near = np.array([[0.0, 0.0, 0.0], [15.0, 0.0, 0.0], [-9.0, 1.0, 0.0]])
    down = np.tile([0.0, 0.0, -1.0], (3, 1))
    search = ContactSearch(part, 3)
    lines = Lines(near - 7.0 * down, down)
    search.face[:] = 0  # as found before
    search.uv = part.faces[0].nearest(near)
    search.solve(near, ContactProblem(lines, lambda rows: ball_center(1.0), against=down))
    found = search.contacts()
    assert found.solved.tolist() == [True, met, True]
    if met:
        assert found.face.tolist() == [0, 1, 0]
        assert found.length == pytest.approx([6.0, 6.0 + depth, 6.0])
        assert found.local.point[1] == pytest.approx([15.0, 0.0, -depth])


def test_a_contact_that_faces_away_does_not_count_on_a_single_surface() -> None:
    """A ball inside a sphere, which moves along +z: it meets the upper half from below."""
    ball = Sphere([0.0, 0.0, 0.0], 10.0)
    up = np.array([[0.0, 0.0, 1.0]])
    start = np.array([[0.0, 0.0, 0.0]])
    for against, solved in ((None, True), (up, False)):
        search = ContactSearch(ball, 1)
        problem = ContactProblem(Lines(start, up), lambda rows: ball_center(1.0), against)
        search.solve(np.array([[0.1, 0.2, 10.0]]), problem)
        found = search.contacts()
        assert found.solved.tolist() == [solved]
        assert found.face.tolist() == [0]
        if solved:
            assert found.length == pytest.approx([11.0])
            assert found.local.point[0] == pytest.approx([0.0, 0.0, 10.0], abs=1e-9)


def test_balls_meet_the_side_that_they_are_sent_to() -> None:
    """A ball of 1 mm, from 7 mm above a point of a side, against its normal: 6 mm of travel. The
    expected point is wrong by 1 mm along the surface, so that it can lie on another side."""
    part, rng = _box(), np.random.default_rng(4)
    face = rng.integers(0, 6, 60)
    axis, side = face // 2, 2.0 * (face % 2) - 1.0
    normal = np.eye(3)[axis] * side[:, None]
    at = rng.uniform(-0.95, 0.95, (60, 3)) * HALF
    at[np.arange(60), axis] = side * HALF[axis]
    wrong = rng.normal(size=(60, 3))
    near = at + wrong / np.linalg.norm(wrong, axis=1, keepdims=True)
    search = ContactSearch(part, 60)
    lines = Lines(at + 7.0 * normal, -normal)
    problem = ContactProblem(lines, lambda rows: ball_center(1.0), against=-normal)
    search.solve(near, problem)
    found = search.contacts()
    assert found.solved.all()
    assert np.array_equal(found.face, face)
    assert found.length == pytest.approx(np.full(60, 6.0), abs=1e-9)
    assert found.local.point == pytest.approx(at, abs=1e-9)
    assert found.local.normal == pytest.approx(normal, abs=1e-12)
    assert found.local.curvature == pytest.approx(np.zeros((60, 3, 3)), abs=1e-12)
    assert not found.beyond_edge.any()
    assert found.residual.max() < 1e-9
    # From inside, the normals do not point against the way: no contact counts.
    search = ContactSearch(part, 60)
    search.solve(at, ContactProblem(Lines(at, normal), lambda rows: ball_center(1.0), normal))
    assert not search.contacts().solved.any()


def test_a_ball_that_passes_beside_its_only_face_is_beyond_the_edge() -> None:
    top = _box(5).faces[5]
    part = Part("plate", (top,), (0,))
    points = np.array([[0.0, 0.0, 9.0], [10.5, 0.0, 9.0]])
    down = np.tile([0.0, 0.0, -1.0], (2, 1))
    search = ContactSearch(part, 2)
    problem = ContactProblem(Lines(points, down), lambda rows: ball_center(1.0), against=down)
    search.solve(points * [1.0, 1.0, 0.0] + [0.0, 0.0, 2.5], problem)
    found = search.contacts()
    assert found.solved.tolist() == [True, False]
    assert found.beyond_edge.tolist() == [False, True]
    assert found.length[0] == pytest.approx(5.5)
    assert found.face.tolist() == [0, 0]
    assert np.isnan(found.length[1])
    search.restrict(np.array([True, True]))
    assert search.open.tolist() == [True, False]


class TestBoxes:
    LOW = np.random.default_rng(1).uniform(-5.0, 5.0, (30, 3))
    HIGH = LOW + np.random.default_rng(2).uniform(0.0, 3.0, (30, 3))
    INDEX = np.arange(30)[::-1] + 100
    POINTS = np.random.default_rng(3).uniform(-8.0, 8.0, (40, 3))
    REACH = np.random.default_rng(4).uniform(0.2, 6.0, 40)

    @pytest.mark.parametrize("pairs", [1, 70, 2_000_000])
    def test_near_points(self, pairs: int, monkeypatch: pytest.MonkeyPatch) -> None:
        """Also in chunks, of which the last is smaller."""
        monkeypatch.setattr(face_boxes, "_PAIRS", pairs)
        boxes = FaceBoxes(self.LOW, self.HIGH, self.INDEX)
        expected = [
            (row, int(self.INDEX[k]))
            for row in range(40)
            for k in range(30)
            if np.linalg.norm(
                self.POINTS[row] - np.clip(self.POINTS[row], self.LOW[k], self.HIGH[k])
            )
            <= self.REACH[row]
        ]
        rows, faces = boxes.within(self.POINTS, self.REACH)
        assert list(zip(rows.tolist(), faces.tolist(), strict=True)) == expected
        assert 100 < len(expected) < 1100

    @pytest.mark.parametrize("pairs", [70, 2_000_000])
    def test_in_the_way_of_lines(self, pairs: int, monkeypatch: pytest.MonkeyPatch) -> None:
        """Boxes widened by the reach, against points all along each line; also for lines in a
        plane of two axes of the boxes, and along one."""
        monkeypatch.setattr(face_boxes, "_PAIRS", pairs)
        way = np.random.default_rng(5).normal(size=(12, 3))
        way[3:6] *= 1.0 - np.eye(3)
        way[6:] = [*np.eye(3), *-np.eye(3)]
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        start, reach = self.POINTS[:12], 0.2 * self.REACH[:12]
        boxes = FaceBoxes(self.LOW, self.HIGH, self.INDEX)
        rows, faces = boxes.along(start, way, reach)
        assert np.all(np.diff(rows) >= 0)
        found = np.zeros((12, 30), dtype=bool)
        found[rows, 129 - faces] = True
        along = np.linspace(-25.0, 25.0, 2501)[:, None, None]
        decided = np.zeros_like(found)
        for row in range(12):
            on_line = start[row] + along * way[row]
            # Points are 20 µm apart: boxes that 10 µm decide about are left out.
            narrow, wide = (
                np.all(
                    (self.LOW - reach[row] - more <= on_line)
                    & (on_line <= self.HIGH + reach[row] + more),
                    axis=2,
                ).any(axis=0)
                for more in (0.0, 0.01)
            )
            decided[row] = narrow == wide
            assert np.array_equal(found[row, decided[row]], narrow[decided[row]])
        assert decided.mean() > 0.9
        assert found.sum() > 20

    def test_around_faces(self) -> None:
        part = _box()
        boxes = FaceBoxes.around(part.faces, (5, 2))
        assert boxes.index.tolist() == [5, 2]
        for row, (axis, side) in enumerate(((2, 1.0), (1, -1.0))):
            low, high = -HALF, HALF.copy()
            low[axis] = high[axis] = side * HALF[axis]
            assert np.all(boxes.low[row] <= low)
            assert np.all(boxes.high[row] >= high)
            # Only as much wider as chords of edges are away from them.
            assert boxes.low[row] == pytest.approx(low, abs=2e-3)
            assert boxes.high[row] == pytest.approx(high, abs=2e-3)


def test_points_of_a_part_know_their_faces() -> None:
    part = _box()
    cloud = Cloud.of(part.faces, 0.8)
    for face in range(6):
        mine = cloud.face == face
        assert mine.sum() > 20
        assert _distance(cloud.points[mine], face) == pytest.approx(0.0, abs=1e-12)
        again = part.faces[face].derivatives(cloud.uv[mine])[0]
        assert np.array_equal(again, cloud.points[mine])
        # No point of the face is farther from a sample than the diagonal of a cell.
        spread = _around(50)
        axis, side = divmod(face, 2)
        spread = np.clip(spread, -HALF, HALF)
        spread[:, axis] = (2 * side - 1) * HALF[axis]
        assert cloud.on((face,)).tree.query(spread)[0].max() < 0.8 / math.sqrt(2.0) + 1e-9
    some = cloud.on((1, 4))
    assert np.unique(some.face).tolist() == [1, 4]
    assert len(some.points) == len(some.uv) == np.isin(cloud.face, (1, 4)).sum()
    assert part.box == pytest.approx(np.stack([-HALF, HALF]))
    assert part.size == pytest.approx(2.0 * np.linalg.norm(HALF))


def _placed_square(turn: FloatArray, reverses: bool, closed: int) -> Face:
    """A square on a plane whose normal is +z, placed in a part."""
    shapes = {1: ShapeRecord("Fa", surface=1)}
    shapes[2] = ShapeRecord("Wi")
    shapes[1].parts.append(ShapeUse(2, False, np.eye(4)))
    curves: list[Curve] = []
    for u, v, du, dv in ((-1, -1, 2, 0), (1, -1, 0, 2), (1, 1, -2, 0), (-1, 1, 0, -2)):
        curves.append(Line(np.array([u, v], dtype=float), np.array([du, dv], dtype=float)))
        edge = ShapeRecord("Ed", curve=(1, np.eye(4), 0.0, 1.0))
        edge.parameter_curves.append((1, len(curves), 0, 0.0, 1.0))
        shapes[len(shapes) + 1] = edge
        shapes[2].parts.append(ShapeUse(len(shapes), False, np.eye(4)))
    record = SurfaceRecord("plane", Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = turn, [5.0, 6.0, 7.0]
    brep = Brep(curves, [], [record], shapes, [])
    content = CadContent(brep, (), closed=closed)
    return _face(content, ShapeUse(1, reverses, placement), 3, "lid")


@pytest.mark.parametrize("reverses", [False, True])
@pytest.mark.parametrize("excess", [-1e-9, 1e-9])
def test_the_outside_of_a_turned_face_turns_with_it(reverses: bool, excess: float) -> None:
    """Whether rounding leaves the determinant of the turn above one or below."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn) * (1.0 + excess)
    face = _placed_square(turn, reverses, closed=0)
    local = face.local(np.array([[0.2, -0.3]]))
    outside = turn[:, 2] * (-1.0 if reverses else 1.0)
    assert local.normal[0] == pytest.approx(outside, abs=1e-8)
    assert local.point[0] == pytest.approx(turn @ [*_on_plane(0.2, -0.3)] + [5.0, 6.0, 7.0])
    assert (face.number, face.name, face.kind) == (3, "lid", "plane")
    assert len(face.borders) == 4


def _on_plane(u: float, v: float) -> FloatArray:
    return Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).local(np.array([[u, v]])).point[0]


def test_of_several_other_faces_that_with_the_nearest_contact_counts() -> None:
    """Expected 5 mm beside an upper plate. Plates lie below at 7 and 9 mm, and one faces down at
    3 mm; in either order in the part. A ball that no plate is below is beyond the edge of the
    upper one only where that one faces it."""
    upper = _plate(1, -10.0, 10.0, 0.0)
    below = [_plate(2, 12.0, 30.0, -7.0), _plate(3, 12.0, 30.0, -9.0), _plate(4, 12.0, 30.0, -3.0)]
    below[2] = replace(below[2], flips=True)
    near = np.array([[15.0, 0.0, 0.0], [10.5, 0.0, 0.0]])
    down = np.tile([0.0, 0.0, -1.0], (2, 1))
    for order in ((0, 1, 2), (2, 1, 0)):
        part = Part("plates", (upper, *(below[i] for i in order)), (0, 1, 2, 3))
        for flips in (False, True):
            faces = (replace(upper, flips=flips), *part.faces[1:])
            search = ContactSearch(replace(part, faces=faces), 2)
            search.face[:] = 0  # as found before
            search.uv = upper.nearest(near)
            lines = Lines(near - 7.0 * down, down)
            search.solve(near, ContactProblem(lines, lambda rows: ball_center(1.0), against=down))
            found = search.contacts()
            assert found.solved.tolist() == [True, False]
            assert found.face[0] == 1 + order.index(0)
            assert found.length[0] == pytest.approx(13.0)
            assert found.beyond_edge.tolist() == [False, not flips]
            assert np.all(found.iterations >= 0)
