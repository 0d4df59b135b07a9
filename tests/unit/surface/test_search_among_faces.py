"""The search of contacts among many faces, against a search of all of them one by one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.surface import contact as contact_module
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.trim import Trim
from pretravel.surface.contact import Contact, Lines, ball_center
from pretravel.surface.local_geometry import Surface
from pretravel.surface.search import ContactProblem, ContactSearch
from pretravel.surface.shapes import Plane

BALL = 1.0


@pytest.fixture(autouse=True)
def short_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rigid ball needs neither other differences nor many iterations, which take long where
    there is no contact."""
    monkeypatch.setattr(contact_module, "_DIFFERENCES", contact_module._DIFFERENCES[:1])
    monkeypatch.setattr(contact_module, "_MOST_ITERATIONS", 15)


@dataclass(frozen=True)
class _Plate:
    """A rectangle at a height, which faces up or down."""

    low: tuple[float, float]
    high: tuple[float, float]
    z: float
    up: bool = True

    def face(self, number: int) -> Face:
        plane = Plane([self.low[0], self.low[1], self.z], [0.0, 0.0, 1.0])
        (a, b), (c, d) = self.low, self.high
        corners = np.array([[x, y, self.z] for x, y in ((a, b), (c, b), (c, d), (a, d), (a, b))])
        ring = plane.nearest(corners)
        trim = Trim([ring], plane.domain.period)
        return Face(number, "", "plane", plane, trim, not self.up, (ring,))

    def distance(self, point: FloatArray) -> float:
        low, high = np.array([*self.low, self.z]), np.array([*self.high, self.z])
        return float(np.linalg.norm(point - np.clip(point, low, high)))

    def line_is_near(self, anchor: FloatArray, way: FloatArray, reach: float) -> bool:
        """Whether the line passes the box around it, as wide as the reach: slab by slab."""
        enter, leave = -math.inf, math.inf
        for axis in range(3):
            low, high = (*self.low, self.z)[axis] - reach, (*self.high, self.z)[axis] + reach
            ends = sorted(((low - anchor[axis]) / way[axis], (high - anchor[axis]) / way[axis]))
            enter, leave = max(enter, ends[0]), min(leave, ends[1])
        return enter <= leave

    def contact(
        self, anchor: FloatArray, way: FloatArray, margin: float = 0.0
    ) -> tuple[FloatArray, float] | None:
        """Point and length of a ball that moves down, also beside it by a share of its sides."""
        if not self.up:
            return None
        length = (self.z + BALL - anchor[2]) / way[2]
        point = anchor + length * way - [0.0, 0.0, BALL]
        more = margin * np.subtract(self.high, self.low)
        within = np.all(np.clip(point[:2], self.low - more, self.high + more) == point[:2])
        return (point, length) if within else None


@dataclass(frozen=True, eq=False)
class _Counted(ContactProblem):
    """A problem that notes the iterations of each row, and can spoil the contacts."""

    iterations: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    spoil: Callable[[Contact, IntArray], None] = lambda contact, rows: None

    def solve(self, surface: Surface, rows: IntArray, start: FloatArray) -> Contact:
        contact = super().solve(surface, rows, start)
        self.iterations[rows] += contact.iterations
        self.spoil(contact, rows)
        return contact


def _plates(seed: int) -> list[_Plate]:
    rng = np.random.default_rng(seed)
    plates = []
    for i in range(14):
        low, sides = rng.uniform([170.0, -120.0], [230.0, -60.0]), rng.uniform(4.0, 14.0, 2)
        high = low + sides
        up = i % 5 != 4
        plates.append(_Plate((low[0], low[1]), (high[0], high[1]), rng.uniform(-20.0, 20.0), up))
    return plates


@pytest.mark.parametrize("chosen", [range(14), (1, 3, 4, 6, 8, 9, 11, 12)])
def test_the_other_face_is_that_of_a_search_of_all(chosen: tuple[int, ...]) -> None:
    """Plates at many heights. Each ball is expected on one of them, somewhere beside it. Faces
    count that are nearer than twice the expected one and the reach, which is 1.1 times the
    length of the stylus and 0.1 mm, of those that the line passes within the reach; that with
    the contact nearest to the place is met. Beyond an edge by a twentieth a face continues."""
    plates, rng, rows = _plates(6), np.random.default_rng(7), 300
    part = Part("plates", tuple(plate.face(i + 1) for i, plate in enumerate(plates)), tuple(chosen))
    tried = rng.choice(np.array(chosen), rows)
    near = rng.uniform([170.0, -120.0, -20.0], [240.0, -50.0, 20.0], (rows, 3))
    way = np.column_stack([rng.normal(0.0, 0.25, (rows, 2)), -np.ones(rows)])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    anchor = near - rng.uniform(1.0, 16.0, (rows, 1)) * way
    problem = _Counted(
        Lines(anchor, way), lambda rows: ball_center(BALL), way, np.zeros(rows, dtype=np.int64)
    )
    search = ContactSearch(part, rows)
    search.face[:] = tried
    for index in np.unique(tried):
        mine = tried == index
        search.uv[mine] = part.faces[index].nearest(near[mine])
    search.solve(near, problem)
    found = search.contacts()
    assert np.array_equal(found.iterations, problem.iterations)
    assert np.any(found.iterations > 1)
    others = 0
    for row in range(rows):
        own = plates[tried[row]]
        best = own.contact(anchor[row], way[row])
        face = tried[row]
        reach = 1.1 * float(np.linalg.norm(anchor[row] - near[row])) + 0.1
        limit = 2.0 * own.distance(near[row]) + reach
        if best is None:
            for index in chosen:
                plate = plates[index]
                contact = plate.contact(anchor[row], way[row])
                if index == tried[row] or contact is None or plate.distance(near[row]) > limit:
                    continue
                if not plate.line_is_near(anchor[row], way[row], reach):
                    continue
                if best is None or (
                    np.linalg.norm(contact[0] - near[row]) < np.linalg.norm(best[0] - near[row])
                ):
                    best, face = contact, index
            others += best is not None
        assert found.solved[row] == (best is not None)
        assert found.face[row] == face
        continued = own.contact(anchor[row], way[row], 0.05) is not None
        assert found.beyond_edge[row] == (best is None and continued)
        if best is not None:
            assert found.local.point[row] == pytest.approx(best[0], abs=1e-9)
            assert found.length[row] == pytest.approx(best[1], abs=1e-9)
    assert others > 25
    assert 30 < found.solved.sum() < 200
    # Far from all plates the same balls meet nothing, and nothing of before is left.
    away = Lines(anchor + 900.0 * np.eye(3)[0], way)
    search.solve(near, ContactProblem(away, lambda rows: ball_center(BALL), way))
    gone = search.contacts()
    assert not gone.solved.any()
    for values in (gone.local.point, gone.local.normal, gone.local.curvature, gone.length):
        assert np.isnan(values).all()


def test_touches_of_known_faces_are_not_searched_again() -> None:
    """Of two plates, one above the other: the lower one, as found before, stays the expected
    one; the third touch is closed and keeps nothing."""
    plates = (_Plate((0.0, 0.0), (9.0, 5.0), -3.0), _Plate((0.0, 0.0), (9.0, 5.0), 0.0))
    part = Part("two", tuple(plate.face(i + 1) for i, plate in enumerate(plates)), (0, 1))
    near = np.array([[1.0, 2.0, 0.1], [4.0, 3.0, 0.1], [6.0, 1.0, 0.1]])
    down = np.tile([0.0, 0.0, -1.0], (3, 1))
    lines = Lines(near + 8.0 * np.eye(3)[2], down)
    search = ContactSearch(part, 3)
    search.face[0], search.uv[0] = 0, [1.0, 2.0]
    search.open[2] = False
    search.solve(near, ContactProblem(lines, lambda rows: ball_center(BALL), down))
    found = search.contacts()
    assert found.face.tolist() == [0, 1, -1]
    assert found.solved.tolist() == [True, True, False]
    assert found.length[:2] == pytest.approx([10.1, 7.1])


def test_without_a_way_the_nearest_point_of_another_face_is_found() -> None:
    """The expected plate ends before the point; the foot of it on the other one is below it."""
    plates = (_Plate((0.0, 0.0), (9.0, 5.0), 0.0), _Plate((8.0, 0.0), (30.0, 5.0), -2.0))
    part = Part("two", tuple(plate.face(i + 1) for i, plate in enumerate(plates)), (0, 1))
    points = np.array([[11.0, 2.0, 3.0], [4.0, 2.0, 1.0]])
    search = ContactSearch(part, 2)
    search.face[:] = 0
    search.uv = part.faces[0].nearest(points)
    search.solve(points, ContactProblem(Lines(points), lambda rows: ball_center(0.0)))
    found = search.contacts()
    assert found.face.tolist() == [1, 0]
    assert found.local.point == pytest.approx(np.array([[11.0, 2.0, -2.0], [4.0, 2.0, 0.0]]))


def test_only_solved_contacts_count_and_nearly_solved_ones_are_kept_to_start_from() -> None:
    """On a plate of 9 by 5, of balls that move to three places of it and to one beside it; below
    1e-9 mm a contact is solved, and below 1e-6 mm worth to start from."""
    plate = _Plate((0.0, 0.0), (9.0, 5.0), 0.0).face(1)
    places = np.array([[2.0, 1.0], [3.0, 2.0], [4.0, 3.0], [11.0, 4.0], [12.0, 4.0], [5.0, 4.0]])
    residuals = np.array([0.0, 0.9e-6, 1.1e-6, 0.0, 0.9e-6, 0.5])
    down = np.tile([0.0, 0.0, -1.0], (6, 1))
    lines = Lines(np.column_stack([places, np.full(6, 7.0)]), down)

    def spoil(contact: Contact, rows: IntArray) -> None:
        contact.residual[:] = residuals[rows]

    for surface in (plate, Part("plate", (plate,), (0,))):
        problem = _Counted(
            lines, lambda rows: ball_center(BALL), down, np.zeros(6, dtype=np.int64), spoil
        )
        search = ContactSearch(surface, 6)
        search.face[:] = 0
        before = plate.base.nearest(np.tile([1.0, 1.0, 0.0], (6, 1)))
        search.uv = before.copy()
        search.solve(lines.anchor * [1.0, 1.0, 0.0], problem)
        found = search.contacts()
        assert found.solved.tolist() == [True, False, False, False, False, False]
        assert found.beyond_edge.tolist() == [False, False, False, True, False, False]
        assert np.isnan(found.residual[1:]).all()
        at = plate.derivatives(search.uv)[0][:, :2]
        assert at[:2] == pytest.approx(places[:2], abs=1e-6)
        assert np.array_equal(search.uv[2:], before[2:])
