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
from pretravel.surface.cad.kernel_process import CadContent
from pretravel.surface.cad.step_part import _face, _face_uses, _one_side, part_from_content
from pretravel.surface.cad.trim import Trim
from pretravel.surface.curves import Curve, Line
from pretravel.surface.local_geometry import Surface
from pretravel.surface.parametric import FunctionSurface
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Torus
from pretravel.surface.swept import Offset, Placed

TURN = 2.0 * math.pi
FLAT = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])


def _shift(x: float) -> FloatArray:
    placed = np.eye(4)
    placed[:3, 3] = [x, 2.0 * x, -x]
    return placed


def _box(low: tuple[float, float], high: tuple[float, float]) -> FloatArray:
    return np.array([low, (high[0], low[1]), high, (low[0], high[1]), low])


def test_every_face_comes_once_with_its_placement_and_side() -> None:
    """A body twice in a group, one of them reversed; in it a face twice, once of them again at
    the same place. Faces of wires, edges and points are none."""
    use = ShapeUse
    shapes = {
        1: ShapeRecord("Co", [use(2, False, _shift(1.0)), use(2, True, _shift(50.0)),
                              use(6, False, np.eye(4))]),
        2: ShapeRecord("So", [use(3, False, _shift(100.0)), use(5, False, np.eye(4))]),
        3: ShapeRecord("Sh", [use(4, True, np.eye(4)), use(4, False, _shift(1000.0)),
                              use(4, False, np.eye(4))]),
        4: ShapeRecord("Fa", [use(6, False, np.eye(4))]),
        5: ShapeRecord("Fa"),
        6: ShapeRecord("Wi", [use(5, False, _shift(7.0))]),
        7: ShapeRecord("Ed", [use(5, False, _shift(8.0))]),
        8: ShapeRecord("Ve", [use(5, False, _shift(9.0))]),
    }  # fmt: skip
    roots = [use(1, True, np.eye(4)), use(7, False, np.eye(4)), use(8, False, np.eye(4)),
             use(5, True, _shift(3.0)), use(5, False, _shift(3.0 + 1e-11))]  # fmt: skip
    found = list(_face_uses(Brep([], [], [], shapes, roots)))
    assert [(u.index, u.reverses, float(u.placement[0, 3])) for u in found] == [
        (4, False, 101.0), (4, True, 1101.0), (5, True, 1.0),
        (4, True, 150.0), (4, False, 1150.0), (5, False, 50.0), (5, True, 3.0),
    ]  # fmt: skip


def _content(
    surface: Surface | None, *rings: FloatArray, along: int = 1, seams: bool = False,
    bodies: tuple[int, int] = (0, 0), kind: str = "made",
) -> CadContent:  # fmt: skip
    """One face; its edges are seams or borders."""
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
    return CadContent(Brep(curves, [], [record], shapes, roots), (), *bodies)


SQUARE = _box((1.0, 2.0), (4.0, 8.0))


@pytest.mark.parametrize("along", [1, -1])
@pytest.mark.parametrize("reverses", [False, True])
@pytest.mark.parametrize("bodies", [(0, 0), (1, 0), (0, 1)])
def test_a_mirror_and_a_sense_turn_the_outside_over(
    along: int, reverses: bool, bodies: tuple[int, int]
) -> None:
    """Each of them once. A mirrored part is refused where no bodies were made from its faces."""
    content = _content(FLAT, SQUARE, along=along, bodies=bodies)
    for mirror in (1.0, -1.0):
        placed = _shift(5.0)
        placed[:3, :3] = np.diag([mirror, 1.0, 1.0])
        use = ShapeUse(1, reverses, placed)
        if mirror < 0.0 and bodies == (0, 0):
            with pytest.raises(PretravelError, match="makes its mirror image"):
                _face(content, use, 7, "n")
            continue
        face = _face(content, use, 7, "n")
        assert face.flips == (((along < 0) + reverses + (mirror < 0.0)) % 2 == 1)
        assert (face.number, face.name, face.kind) == (7, "n", "made")
        uv = np.array([[2.0, 3.0]])
        point = FLAT.derivatives(uv)[0][0] * [mirror, 1.0, 1.0] + [5.0, 10.0, -5.0]
        assert face.derivatives(uv)[0][0] == pytest.approx(point)
        assert isinstance(face.base, Placed)
        assert len(face.borders) == 4
        assert face.trim is not None
        assert face.trim.area == pytest.approx(18.0)


@pytest.mark.parametrize(("scale", "refused"), [(4e-7, False), (-4e-7, False), (6e-7, True),
                                                 (-6e-7, True)])  # fmt: skip
def test_a_placement_that_changes_the_scale_is_refused(scale: float, refused: bool) -> None:
    """Of one direction, by more than a millionth in its square."""
    for axis in range(3):
        placed = np.eye(4)
        placed[axis, axis] += scale
        if refused:
            with pytest.raises(PretravelError, match="changes its scale"):
                _face(_content(FLAT, SQUARE), ShapeUse(1, False, placed), 1, "")
        else:
            assert isinstance(
                _face(_content(FLAT, SQUARE), ShapeUse(1, False, placed), 1, "").base, Placed
            )


def test_placements_of_face_and_surface_follow_each_other() -> None:
    """A quarter turn about z after a shift; a face in its place keeps its surface."""
    content = _content(FLAT, SQUARE)
    assert _face(content, ShapeUse(1, False, np.eye(4)), 1, "").base is FLAT
    content.brep.shapes[1].placement = _shift(3.0)
    turn = np.eye(4)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    face = _face(content, ShapeUse(1, False, turn), 1, "")
    uv = np.array([[2.0, 3.0]])
    x, y, z = FLAT.derivatives(uv)[0][0] + [3.0, 6.0, -3.0]
    assert face.derivatives(uv)[0][0] == pytest.approx([-y, x, z])


def test_a_face_all_over_a_closed_surface_has_no_region() -> None:
    """A ball whose edges are seams; with borders, or over a part of it, the region stays. A plane
    without edges has no end."""
    ball = Sphere([0.0, 0.0, 0.0], 5.0)
    use = ShapeUse(1, False, np.eye(4))
    whole, half = _box((0.0, 0.0), (TURN, math.pi)), _box((0.0, 0.0), (TURN, 0.5 * math.pi))
    assert _face(_content(ball, whole, seams=True), use, 1, "").trim is None
    assert _face(_content(ball), use, 1, "").trim is None
    assert _face(_content(ball, whole), use, 1, "").trim is not None
    assert _face(_content(ball, half, seams=True), use, 1, "").trim is not None
    with pytest.raises(PretravelError, match="plane without edges, which is unbounded"):
        _face(_content(FLAT, kind="plane"), use, 1, "")
    with pytest.raises(PretravelError, match="cone: like no other"):
        _face(_content(None, kind="cone"), use, 1, "")


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
    record = SurfaceRecord("torus", torus, -1)
    trim = Trim([_box((0.5, low), (1.5, high))], (TURN, TURN))
    if side == "both":
        with pytest.raises(PretravelError, match="on both sides of the axis"):
            _one_side(record, trim)
        return
    made = _one_side(record, trim)
    if side == "outer":
        assert made is record
        return
    assert made.along_parameters == 1
    assert isinstance(made.surface, Torus)
    assert made.surface.inner
    assert (made.surface.radius, made.surface.tube_radius) == (2.0, 3.0)
    assert np.array_equal(made.surface.origin, torus.origin)
    assert np.array_equal(made.surface.axes, torus.axes)


def test_a_whole_torus_is_on_both_sides_only_where_it_crosses_its_axis() -> None:
    for radius, crosses in ((2.9, True), (3.0, False), (3.1, False)):
        record = SurfaceRecord("torus", Torus([0.0, 0.0, 0.0], radius, 3.0), 1)
        if crosses:
            with pytest.raises(PretravelError, match="on both sides of the axis"):
                _one_side(record, None)
        else:
            assert _one_side(record, None) is record


@pytest.mark.parametrize(
    ("distance", "refused"), [(5.0, False), (-4.9, False), (-5.0, True), (-5.1, True)]
)
def test_an_offset_beyond_a_centre_of_curvature_is_refused(distance: float, refused: bool) -> None:
    """Of a ball of 5 mm, inwards."""
    record = SurfaceRecord("offset", Offset(Sphere([0.0, 0.0, 0.0], 5.0), distance), 1)
    if refused:
        with pytest.raises(PretravelError, match=rf"offset by {distance:g} mm, beyond its centre"):
            _one_side(record, None)
    else:
        assert _one_side(record, None) is record


def test_the_face_alone_decides_how_far_an_offset_may_go() -> None:
    """A bowl z = -x²/32 bends by 1/16 at x = 0 and by 1/16 (1 + x²/256)^-1.5 elsewhere: at x from
    13 to 15, 13 at least with its margin of 0.1, the radius is 34 mm."""
    for x, most in ((0.0, 16.0), (14.0, 16.0 * (1.0 + 12.9**2 / 256.0) ** 1.5)):
        for share, refused in ((0.98, False), (1.02, True)):
            bowl = FunctionSurface(lambda u, v: (u, v, -(u**2) / 32.0), (-20.0, 20.0), (-9.0, 9.0))
            trim = Trim([_box((x - 1.0, -2.0), (x + 1.0, 3.0))], (math.inf, math.inf))
            record = SurfaceRecord("offset", Offset(bowl, -share * most), 1)
            if refused:
                with pytest.raises(PretravelError, match="beyond its centre of curvature"):
                    _one_side(record, trim)
            else:
                assert _one_side(record, trim) is record


def _several(count: int, bad: tuple[int, ...], names: tuple[str, ...]) -> CadContent:
    content = _content(FLAT, SQUARE)
    brep = content.brep
    broken = SurfaceRecord("cone", None, 1, "like no other")
    brep.surfaces.append(broken)
    number = len(brep.shapes)
    brep.shapes[number + 1] = ShapeRecord("Fa", surface=2)
    brep.roots[:] = [
        ShapeUse(number + 1 if i + 1 in bad else 1, False, _shift(float(i))) for i in range(count)
    ]
    return CadContent(brep, names)


def test_faces_are_numbered_and_those_that_cannot_be_used_have_reasons(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names count where there is one for each face. Progress is told after every second face."""
    monkeypatch.setattr(step_part, "_PROGRESS", 2)
    five = ("a", "b", "c", "d", "e")
    with caplog.at_level(logging.INFO, "pretravel"):
        part = part_from_content(_several(5, (2, 5), five), Path("folder/some.step"))
    assert [r.getMessage() for r in caplog.records] == ["face 2 of 5", "face 4 of 5"]
    assert part.name == "some.step"
    assert [(f.number, f.name) for f in part.faces] == [(1, "a"), (3, "c"), (4, "d")]
    assert part.chosen == (0, 1, 2)
    assert part.unreadable == dict.fromkeys((2, 5), "cone: like no other")
    part = part_from_content(_several(3, (), five), Path("some.step"))
    assert [(f.number, f.name) for f in part.faces] == [(1, ""), (2, ""), (3, "")]
    with pytest.raises(InputError, match="none of its 2 faces can be used; face 1: cone: like"):
        part_from_content(_several(2, (1, 2), ()), Path("some.step"))
    with pytest.raises(InputError, match="has no faces"):
        part_from_content(_several(0, (), ()), Path("some.step"))
