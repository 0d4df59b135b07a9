"""Status of touches that fail: missed, edge, another face, stem, no trigger."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.design.probing.obstacles import stylus_outline
from pretravel.design.probing.simulation import Latch, simulate, simulate_some
from pretravel.design.probing.surface_touches import TouchStatus
from pretravel.design.probing.tip import PredictedTip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.contact import Lines, ball_center
from pretravel.surface.search import ContactProblem, ContactSearch
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches.targets import Targets


@pytest.fixture(scope="module")
def tip() -> PredictedTip:
    return predicted_tip(load_probe("omp40-2"))  # ball of 6 mm, stem of 4.5 mm


@pytest.fixture(scope="module")
def step(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A block 60 x 60 x 20 with a step 20 high on its back half, a slot and a hole."""
    from netgen.occ import Box, Cylinder, Pnt, Z

    solid = Box((0, 0, 0), (60, 60, 20)) + Box((0, 40, 20), (60, 60, 40))
    solid = solid - Box((28, -1, 10), (32, 30, 21)) - Cylinder(Pnt(10, 10, 5), Z, 6, 16)
    file = tmp_path_factory.mktemp("step") / "block.step"
    solid.WriteStep(str(file))
    return read_step_part(file)


UP = [0.0, 0.0, 1.0]
_PINS = tuple(31.3 + 240.0 * i for i in range(12))


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Part:
    """A plate 2700 x 400 x 0.2 mm with 12 pins of 1 x 1 x 0.2 mm."""
    from netgen.occ import Box, Fuse

    pins = [Box((x, 200, 0.2), (x + 1, 201, 0.4)) for x in _PINS]
    solid = Fuse([Box((0, 0, 0), (2700, 400, 0.2)), *pins])
    file = tmp_path_factory.mktemp("plate") / "plate.step"
    solid.WriteStep(str(file))
    return read_step_part(file)


def _one(
    tip: PredictedTip, part: Part, point: list[float], normal: list[float], **kwargs: Any
) -> tuple[int, int]:
    approach = kwargs.pop("approach", None)
    targets = Targets([point], [normal], None if approach is None else [approach])
    done = touch(tip, part, targets, **kwargs)
    face = int(done.face[0])
    return int(done.status[0]), part.faces[face].number if face >= 0 else 0


def _face_at(part: Part, point: list[float]) -> int:
    distance = [
        np.linalg.norm(f.local(f.nearest(np.array([point]))).point[0] - point)
        + (0 if f.inside(f.nearest(np.array([point])))[0] else 1e9)
        for f in part.faces
    ]
    return part.faces[int(np.argmin(distance))].number


class TestOnABlock:
    @pytest.mark.parametrize(
        ("point", "normal"),
        [
            ([45.0, 20.0, 20.0], UP),
            ([45.0, 40.0, 30.0], [0.0, -1.0, 0.0]),
            ([0.0, 30.0, 10.0], [-1.0, 0.0, 0.0]),
            ([16.0, 10.0, 12.0], [-1.0, 0.0, 0.0]),
            ([10.0, 10.0, 5.0], UP),
        ],
        ids=["floor", "wall", "side", "hole", "bottom"],
    )
    def test_faces_are_touched(
        self, tip: PredictedTip, step: Part, point: list[float], normal: list[float]
    ) -> None:
        assert _one(tip, step, point, normal) == (TouchStatus.CONVERGED, _face_at(step, point))

    @pytest.mark.parametrize(
        ("point", "status"),
        [
            ([61.0, 20.0, 20.0], TouchStatus.EDGE),  # beyond the edge the ball meets it
            ([64.0, 20.0, 20.0], TouchStatus.MISSED),  # further out nothing
            ([30.0, 15.0, 10.0], TouchStatus.OTHER_FACE),  # a slot of 4 mm
            ([45.0, 36.99, 20.0], TouchStatus.CONVERGED),  # 3.01 mm from the wall
            ([45.0, 37.02, 20.0], TouchStatus.OTHER_FACE),  # 2.98 mm
        ],
    )
    def test_from_above(
        self, tip: PredictedTip, step: Part, point: list[float], status: TouchStatus
    ) -> None:
        assert _one(tip, step, point, UP)[0] == status

    def test_too_near_to_the_step_its_wall_comes_first(self, tip: PredictedTip, step: Part) -> None:
        """The wall is 2 mm away, the ball radius is 3: moving down it meets edge or wall."""
        status, face = _one(tip, step, [45.0, 38.0, 20.0], UP, clearance=5.0)
        assert status == TouchStatus.OTHER_FACE
        assert face in (_face_at(step, [45.0, 40.0, 30.0]), _face_at(step, [45.0, 50.0, 40.0]))

    def test_an_overhang_hits_the_stem(self, tip: PredictedTip, tmp_path: Path) -> None:
        from netgen.occ import Box

        roof = Box((0, 0, 0), (60, 60, 10)) + Box((0, 40, 10), (60, 60, 40)) + Box(
            (0, 20, 30), (60, 60, 40)
        )  # fmt: skip
        file = tmp_path / "roof.step"
        roof.WriteStep(str(file))
        part = read_step_part(file)
        target = ([30.0, 30.0, 10.0], UP)
        outline = stylus_outline(load_probe("omp40-2"), np.array(UP))
        assert _one(tip, part, *target)[0] == TouchStatus.CONVERGED
        status, face = _one(tip, part, *target, stylus=outline)
        assert status == TouchStatus.STEM
        assert face in {_face_at(part, [30.0, 30.0, z]) for z in (30.0, 40.0)} | {
            _face_at(part, [30.0, 20.0, 35.0])
        }
        # Outside, under no overhang, the stem is free.
        assert _one(tip, part, [30.0, 10.0, 10.0], UP, stylus=outline)[0] == 0

    def test_one_chosen_face_leaves_the_others_in_the_way(
        self, tip: PredictedTip, step: Part
    ) -> None:
        floor = step.select(str(_face_at(step, [45.0, 20.0, 20.0])))
        assert _one(tip, floor, [45.0, 20.0, 20.0], UP)[0] == TouchStatus.CONVERGED
        assert _one(tip, floor, [45.0, 38.0, 20.0], UP)[0] == TouchStatus.OTHER_FACE
        # A contact on another face is not searched for.
        assert _one(tip, floor, [45.0, 50.0, 40.0], UP)[0] in (
            TouchStatus.MISSED, TouchStatus.EDGE, TouchStatus.OTHER_FACE
        )  # fmt: skip

    def test_from_the_back_a_face_is_not_touched(self, tip: PredictedTip, step: Part) -> None:
        """Approach from within the material to the inner side of the surface."""
        status, _ = _one(tip, step, [45.0, 20.0, 0.0], [0.0, 0.0, 1.0])
        assert status != TouchStatus.CONVERGED

    def test_across_a_tangent_joint(self, tip: PredictedTip, tmp_path: Path) -> None:
        """On a rounded box the ball starts on the flat face and slides onto the rounding."""
        from netgen.occ import Box

        box = Box((0, 0, 0), (40, 40, 20))
        rounded = box.MakeFillet(box.edges, 4.0)
        file = tmp_path / "rounded.step"
        rounded.WriteStep(str(file))
        part = read_step_part(file)
        normal = from_angles(np.radians(30.0), 0.0)[0]
        # On the rounding near its joint with the top (at x = 36).
        near = from_angles(np.radians(0.02), 0.0)[0]
        n = np.array([normal, near, UP])
        done = touch(tip, part, Targets([36.0, 20.0, 16.0] + 4.0 * n, n))
        assert np.all(done.status == TouchStatus.CONVERGED)
        assert done.residual.max() < 1e-9
        flat = touch(tip, part, Targets([[x, 20.0, 20.0] for x in (20.0, 35.99)], [UP] * 2))
        assert "plane" in {part.faces[face].kind for face in flat.face.tolist()}


class TestLargePart:
    """A plate of 2.7 m: samples are 18 mm apart on it, and much closer on the small faces."""

    @pytest.mark.long
    def test_the_nearest_face_is_found_among_small_ones(
        self, tip: PredictedTip, plate: Part
    ) -> None:
        """The nearest samples are all on a pin; the nearest face is that of the plate. On a flat
        face the first contact is the target itself."""
        points = [[x + beside, 200.5, 0.2] for x in _PINS for beside in (-3.5, 4.5, 7.0)]
        done = touch(tip, plate, Targets(points, np.tile(UP, (len(points), 1))))
        assert np.all(done.status == TouchStatus.CONVERGED)
        assert np.abs(done.first_point - points).max() < 1e-9

    def test_both_sides_of_a_thin_plate(self, tip: PredictedTip, plate: Part) -> None:
        """The other side is 0.2 mm away, the next sample up to 9 mm."""
        points = [[x + 20.0, y, z] for x in _PINS for y in (50.0, 333.0) for z in (0.0, 0.2)]
        normals = [[0.0, 0.0, 1.0 if point[2] > 0.1 else -1.0] for point in points]
        search = ContactSearch(plate, len(points))
        lines = Lines(np.array(points) + 3.0 * np.array(normals), -np.array(normals))
        rigid = ball_center(3.0)
        search.solve(np.array(points), ContactProblem(lines, lambda _: rigid, -np.array(normals)))
        found = search.contacts()
        assert np.all(found.solved)
        assert np.abs(found.local.point - points).max() < 1e-9

    def test_a_pin_in_the_way_is_named(self, tip: PredictedTip, plate: Part) -> None:
        """The ball of 6 mm stands 0.5 mm beside a pin; 0.5 mm off its axis it is 0.04 mm high."""
        status, face = _one(tip, plate, [_PINS[3] + 1.5, 200.5, 0.2], UP)
        assert status == TouchStatus.OTHER_FACE
        low, high = plate.faces[face - 1].bounds
        assert low[0] >= _PINS[3] - 0.1
        assert high[0] <= _PINS[3] + 1.1

    def test_only_beside_the_plate_it_is_missed(self, tip: PredictedTip, plate: Part) -> None:
        """2.9 mm beside the plate's edge a ball of 3 mm meets the edge, 3.1 mm beside it nothing;
        the samples of the edge are 18 mm apart."""
        for beside, status in ((2.9, TouchStatus.EDGE), (3.1, TouchStatus.MISSED)):
            assert _one(tip, plate, [1234.5, -beside, 0.2], UP)[0] == status


class TestOthers:
    def test_from_below_it_never_triggers(self, tip: PredictedTip) -> None:
        ceiling = Plane([0, 0, 0], [0.0, 0.0, -1.0])
        done = touch(tip, ceiling, Targets([[0, 0, 0]], [[0.0, 0.0, -1.0]]))
        assert done.status[0] == TouchStatus.NEVER_TRIGGERS

    def test_a_line_beside_a_ball(self, tip: PredictedTip) -> None:
        ball = Sphere([0, 0, 0], 5.0)
        done = touch(tip, ball, Targets([[9.0, 0.0, 0.0]], [UP]))
        assert done.status[0] == TouchStatus.MISSED
        assert np.isnan(done.travel[0])

    def test_simulate_refuses_or_leaves_out(self, step: Part) -> None:
        probe = load_probe("omp40-2")
        targets = Targets([[45, 20, 20], [64, 20, 20], [45, 30, 20]], [UP] * 3, labels=("a",) * 3)
        with pytest.raises(PretravelError, match="1 of 3 targets cannot be touched: 1 missed"):
            simulate(probe, step, targets)
        some = simulate_some(probe, step, targets, latch=Latch(noise=1e-3, rng=1))
        assert some.touches is not None
        assert len(some.touches) == 2
        # Noise belongs to the target, not to its position among the successful touches.
        good = Targets(targets.points[[0, 2]], targets.normals[[0, 2]])
        draws = np.random.default_rng(1).normal(0.0, 1e-3, 3)
        quiet = simulate(probe, step, good)
        moved = quiet.positions[:, 2] - some.touches.positions[:, 2]
        assert moved == pytest.approx(draws[[0, 2]], abs=1e-12)
