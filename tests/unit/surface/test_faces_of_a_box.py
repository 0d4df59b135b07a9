"""Searches among the faces of a part, against a box, whose distances are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.surface.cad import face_boxes
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.face_boxes import FaceBoxes
from pretravel.surface.cad.part import Cloud, Part
from pretravel.surface.cad.trim import Trim
from pretravel.surface.contact import Lines, ball_center
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
    points, own = _around(), _box().faces[face]
    distance, inside = own.distance(points, 0.02), own.inside(own.nearest(points))
    assert distance == pytest.approx(_distance(points, face), abs=0.011)
    assert 20 < inside.sum() < 280
    assert distance[inside] == pytest.approx(_distance(points, face)[inside], abs=1e-12)


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
