"""Faces from a tree of shapes that is built by hand: which, where, and with which outside."""

from __future__ import annotations

import logging
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import InputError, PretravelError
from pretravel.surface.cad import step_part
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.cad.brep_geometry import SurfaceRecord
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.kernel_process import CadContent
from pretravel.surface.cad.step_part import part_from_content
from pretravel.surface.curves import Curve, Line
from pretravel.surface.local_geometry import Surface
from pretravel.surface.parametric import FunctionSurface
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Torus
from pretravel.surface.swept import Offset, Placed

TURN = 2.0 * math.pi
FLAT = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
FILE = Path("folder/some.step")


def _shift(x: float) -> FloatArray:
    placed = np.eye(4)
    placed[:3, 3] = [x, 2.0 * x, -x]
    return placed


def _box(low: tuple[float, float], high: tuple[float, float]) -> FloatArray:
    return np.array([low, (high[0], low[1]), high, (low[0], high[1]), low])


SQUARE = _box((1.0, 2.0), (4.0, 8.0))


def _content(
    surface: Surface | None, *rings: FloatArray, along: int = 1, seams: bool = False,
    bodies: tuple[int, int] = (0, 0), kind: str = "made",
) -> CadContent:  # fmt: skip
    """One face, named n; its edges are seams or borders."""
    face = ShapeRecord("Fa", surface=1, placement=_shift(0.0))
    shapes, curves = {1: face}, list[Curve]()
    for ring in rings:
        wire = ShapeRecord("Wi")
        shapes[len(shapes) + 1] = wire
        face.parts.append(ShapeUse(len(shapes), False, np.eye(4)))
        for start, end in pairwise(ring):
            curves.append(Line(start, end - start))
            edge = ShapeRecord("Ed", curve=(1, np.eye(4), 0.0, 1.0))
            edge.parameter_curves.append((1, len(curves), len(curves) * seams, 0.0, 1.0))
            shapes[len(shapes) + 1] = edge
            wire.parts.append(ShapeUse(len(shapes), False, np.eye(4)))
    record = SurfaceRecord(kind, surface, along, "" if surface else "like no other")
    roots = [ShapeUse(1, False, np.eye(4))]
    return CadContent(Brep(curves, [], [record], shapes, roots), ("n",), *bodies)


def _face(content: CadContent, use: ShapeUse | None = None) -> Face:
    """The only one, as its root uses it."""
    if use is not None:
        content.brep.roots[:] = [use]
    (face,) = part_from_content(content, FILE).faces
    return face


def test_every_face_comes_once_with_its_placement_and_side() -> None:
    """A body twice in a group, one of them reversed; in it a face twice, once of them again at
    the same place. Faces of wires, edges and points are none."""
    use = ShapeUse
    content = _content(FLAT, SQUARE)
    shapes = content.brep.shapes
    other = len(shapes) + 1
    shapes |= {
        101: ShapeRecord("Co", [use(102, False, _shift(1.0)), use(102, True, _shift(50.0)),
                                use(106, False, np.eye(4))]),
        102: ShapeRecord("So", [use(103, False, _shift(100.0)), use(other, False, np.eye(4))]),
        103: ShapeRecord("Sh", [use(1, True, np.eye(4)), use(1, False, _shift(1000.0)),
                                use(1, False, np.eye(4))]),
        other: ShapeRecord("Fa", surface=2),
        106: ShapeRecord("Wi", [use(other, False, _shift(7.0))]),
        107: ShapeRecord("Ed", [use(other, False, _shift(8.0))]),
        108: ShapeRecord("Ve", [use(other, False, _shift(9.0))]),
    }  # fmt: skip
    content.brep.surfaces.append(SurfaceRecord("ball", Sphere([0.0, 0.0, 0.0], 5.0)))
    content.brep.roots[:] = [
        use(101, True, np.eye(4)), use(107, False, np.eye(4)), use(108, False, np.eye(4)),
        use(other, True, _shift(3.0)), use(other, False, _shift(3.0 + 1e-11)),
    ]  # fmt: skip
    found = part_from_content(content, FILE).faces
    at = [float(face.derivatives(np.zeros((1, 2)))[0][0, 0]) for face in found]
    ball = float(Sphere([0.0, 0.0, 0.0], 5.0).derivatives(np.zeros((1, 2)))[0][0, 0])
    assert [(f.kind, f.flips) for f in found] == [
        ("made", False), ("made", True), ("ball", True),
        ("made", True), ("made", False), ("ball", False), ("ball", True),
    ]  # fmt: skip
    zero = float(FLAT.derivatives(np.zeros((1, 2)))[0][0, 0])
    expected = [101.0, 1101.0, 1.0, 150.0, 1150.0, 50.0, 3.0]
    own = [zero if face.kind == "made" else ball for face in found]
    assert at == pytest.approx(np.add(expected, own))


@pytest.mark.parametrize("along", [1, -1])
@pytest.mark.parametrize("reverses", [False, True])
@pytest.mark.parametrize("bodies", [(0, 0), (1, 0), (0, 1)])
@pytest.mark.parametrize("excess", [-1e-9, 1e-9])
def test_a_mirror_and_a_sense_turn_the_outside_over(
    along: int, reverses: bool, bodies: tuple[int, int], excess: float
) -> None:
    """Each of them once, also where rounding leaves the determinant of the turn above one or
    below. A mirrored part is refused where no bodies were made from its faces."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn) * (1.0 + excess)
    content = _content(FLAT, SQUARE, along=along, bodies=bodies)
    for mirror in (1.0, -1.0):
        placed = _shift(5.0)
        placed[:3, :3] = turn * [mirror, 1.0, 1.0]
        use = ShapeUse(1, reverses, placed)
        if mirror < 0.0 and bodies == (0, 0):
            with pytest.raises(PretravelError, match="mirrors it"):
                _face(content, use)
            continue
        face = _face(content, use)
        assert face.flips == (((along < 0) + reverses + (mirror < 0.0)) % 2 == 1)
        assert (face.number, face.name, face.kind) == (1, "n", "made")
        uv = np.array([[2.0, 3.0]])
        point = placed[:3, :3] @ FLAT.derivatives(uv)[0][0] + [5.0, 10.0, -5.0]
        assert face.derivatives(uv)[0][0] == pytest.approx(point)
        if mirror > 0.0:
            outside = turn[:, 2] * (-1.0 if face.flips else 1.0)
            assert face.local(uv).normal[0] == pytest.approx(outside, abs=1e-8)
        assert isinstance(face.base, Placed)
        assert len(face.borders) == 4
        assert face.trim is not None
        assert face.trim.area == pytest.approx(18.0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("scale", "refused"), [(4e-7, False), (-4e-7, False), (6e-7, True), (-6e-7, True)]
)
def test_a_placement_that_changes_the_scale_is_refused(
    scale: float, refused: bool, axis: int
) -> None:
    """Of one direction, by more than a millionth in its square. A small one is a placement."""
    placed = np.eye(4)
    placed[axis, axis] += scale
    if refused:
        with pytest.raises(PretravelError, match="changes its scale"):
            _face(_content(FLAT, SQUARE), ShapeUse(1, False, placed))
    else:
        assert isinstance(_face(_content(FLAT, SQUARE), ShapeUse(1, False, placed)).base, Placed)


def test_placements_of_face_and_surface_follow_each_other() -> None:
    """A quarter turn about z after a shift; a face in its place keeps its surface."""
    content = _content(FLAT, SQUARE)
    assert _face(content).base is FLAT
    content.brep.shapes[1].placement = _shift(3.0)
    turn = np.eye(4)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    face = _face(content, ShapeUse(1, False, turn))
    uv = np.array([[2.0, 3.0]])
    x, y, z = FLAT.derivatives(uv)[0][0] + [3.0, 6.0, -3.0]
    assert face.derivatives(uv)[0][0] == pytest.approx([-y, x, z])


def test_a_face_all_over_a_closed_surface_has_no_region() -> None:
    """A ball whose edges are seams; with borders, or over a part of it, the region stays. A plane
    without edges has no end."""
    ball = Sphere([0.0, 0.0, 0.0], 5.0)
    whole, half = _box((0.0, 0.0), (TURN, math.pi)), _box((0.0, 0.0), (TURN, 0.5 * math.pi))
    assert _face(_content(ball, whole, seams=True)).trim is None
    assert _face(_content(ball)).trim is None
    assert _face(_content(ball, whole)).trim is not None
    assert _face(_content(ball, half, seams=True)).trim is not None
    with pytest.raises(PretravelError, match="plane without edges, which is unbounded"):
        _face(_content(FLAT, kind="plane"))


CROSSING = math.acos(-2.0 / 3.0)
"""Where the tube of 3 mm, 2 mm from the axis, crosses it."""


@pytest.mark.parametrize(
    ("low", "high", "side"),
    [
        (-1.0, 1.0, "outer"), (CROSSING, TURN - CROSSING, "inner"), (2.5, 3.6, "inner"),
        (-CROSSING, CROSSING, "outer"), (CROSSING - 0.9e-6, 3.0, "inner"),
        (-1.0, CROSSING + 0.9e-6, "outer"), (CROSSING - 2e-6, 3.0, "both"),
        (-1.0, CROSSING + 2e-6, "both"), (1.0, 3.0, "both"), (0.0, TURN, "both"),
    ],
)  # fmt: skip
def test_a_torus_through_its_axis_has_the_part_on_which_the_face_lies(
    low: float, high: float, side: str
) -> None:
    """Within a millionth of the tube's radius, 3 nm, of which the slope there makes 1.3e-6."""
    torus = Torus([1.0, 2.0, 3.0], 2.0, 3.0, np.linalg.qr(np.ones((3, 3)) + np.eye(3))[0])
    content = _content(torus, _box((0.5, low), (1.5, high)), along=-1)
    if side == "both":
        with pytest.raises(PretravelError, match="on both sides of the axis"):
            _face(content)
        return
    face = _face(content)
    assert face.flips == (side == "outer")
    if side == "outer":
        assert face.base is torus
        return
    assert isinstance(face.base, Torus)
    assert face.base.inner
    assert (face.base.radius, face.base.tube_radius) == (2.0, 3.0)
    assert np.array_equal(face.base.origin, torus.origin)
    assert np.array_equal(face.base.axes, torus.axes)


@pytest.mark.parametrize(("radius", "crosses"), [(2.9, True), (3.0, False), (3.1, False)])
def test_a_whole_torus_is_on_both_sides_where_it_crosses_its_axis(
    radius: float, crosses: bool
) -> None:
    content = _content(Torus([0.0, 0.0, 0.0], radius, 3.0))
    if crosses:
        with pytest.raises(PretravelError, match="on both sides of the axis"):
            _face(content)
    else:
        assert _face(content).base is content.brep.surfaces[0].surface


BALL = Sphere([0.0, 0.0, 0.0], 5.0)
BOWL = FunctionSurface(lambda u, v: (u, v, -(u**2) / 32.0), (-20.0, 20.0), (-9.0, 9.0))
RISING = 16.0 * (1.0 + 12.9**2 / 256.0) ** 1.5


@pytest.mark.parametrize(
    ("surface", "middle", "distance", "refused"),
    [
        *((BALL, None, distance, distance <= -5.0) for distance in (5.0, -4.9, -5.0, -5.1)),
        *((BOWL, 0.0, -share * 16.0, share > 1.0) for share in (0.98, 1.02)),
        *((BOWL, 14.0, -share * RISING, share > 1.0) for share in (0.98, 1.02)),
    ],
)
def test_an_offset_beyond_a_centre_of_curvature_is_refused(
    surface: Surface, middle: float | None, distance: float, refused: bool
) -> None:
    """Inwards, of a ball of 5 mm, and of a part of a bowl: it bends by 1/16 at x = 0 and by
    1/16 (1 + x²/256)^-1.5 elsewhere: at x from 13 to 15, 13 at least with its margin of 0.1, the
    radius is 34 mm. The face alone decides how far the offset may go."""
    offset = Offset(surface, distance)  # type: ignore[arg-type]
    rings = () if middle is None else (_box((middle - 1.0, -2.0), (middle + 1.0, 3.0)),)
    content = _content(offset, *rings, kind="offset")
    if refused:
        with pytest.raises(PretravelError, match=rf"offset by {distance:g} mm, beyond its centre"):
            _face(content)
    else:
        assert _face(content).base is offset


def _several(count: int, bad: tuple[int, ...], names: tuple[str, ...]) -> CadContent:
    brep = _content(FLAT, SQUARE).brep
    brep.surfaces.append(SurfaceRecord("cone", None, 1, "like no other"))
    number = len(brep.shapes) + 1
    brep.shapes[number] = ShapeRecord("Fa", surface=2)
    brep.roots[:] = [
        ShapeUse(number if i + 1 in bad else 1, False, _shift(float(i))) for i in range(count)
    ]
    return CadContent(brep, names)


def test_faces_are_numbered_and_those_that_cannot_be_used_have_reasons(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names count where there is one for each face. Progress is told after every second face."""
    monkeypatch.setattr(step_part, "_PROGRESS", 2)
    five = ("a", "b", "c", "d", "d")
    with caplog.at_level(logging.INFO, "pretravel"):
        part = part_from_content(_several(5, (2,), five), FILE)
    assert [r.getMessage() for r in caplog.records] == ["face 2 of 5", "face 4 of 5"]
    assert part.name == "some.step"
    assert [(f.number, f.name) for f in part.faces] == [(1, "a"), (3, "c"), (4, "d"), (5, "d")]
    assert part.chosen == (0, 1, 2, 3)
    assert part.unreadable == {2: "cone: like no other"}
    assert (part.select("d").chosen, part.select("3").chosen) == ((2, 3), (1,))
    for word, said in (
        ("2", "face 2 cannot be used: cone: like no other"),
        ("b", "no face named 'b'"),
        ("7", "has no face 7; it has 4"),
    ):
        with pytest.raises(PretravelError, match=said):
            part.select(word)
    part = part_from_content(_several(3, (), five), FILE)
    assert [(f.number, f.name) for f in part.faces] == [(1, ""), (2, ""), (3, "")]
    with pytest.raises(InputError, match="none of its 2 faces can be used; face 1: cone: like"):
        part_from_content(_several(2, (1, 2), ()), FILE)
    with pytest.raises(InputError, match="has no faces"):
        part_from_content(_several(0, (), ()), FILE)
