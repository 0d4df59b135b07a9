"""STEP files: every face type agrees with the CAD kernel, or is refused with a reason."""

from __future__ import annotations

import math
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.cad.step_reader import read_step_solids
from pretravel.surface.specification import parse_surface
from tests.support.examples import EXAMPLES

EXAMPLE = EXAMPLES / "part.step"


def _make(name: str) -> Any:
    """Solids and shells with all kinds of faces of the kernel."""
    from netgen.occ import (
        Axes,
        Axis,
        BezierCurve,
        Box,
        Compound,
        Cylinder,
        Pnt,
        Sphere,
        SplineApproximation,
        ThruSections,
        Vec,
        WorkPlane,
        X,
        Y,
        Z,
    )

    about_z = Axis((0, 0, 0), Z)
    wave = SplineApproximation([Pnt(5, 0, 0), Pnt(7, 0, 2), Pnt(5, 0, 5), Pnt(6, 0, 8)])
    bezier = BezierCurve([Pnt(5, 0, 0), Pnt(7, 0, 2), Pnt(5, 0, 5), Pnt(6, 0, 8)])
    upright = WorkPlane(Axes((0, 0, 0), Y, X))
    box = Box((0, 0, 0), (10, 20, 30))
    shapes = {
        "box": lambda: box,
        "rounded box": lambda: box.MakeFillet(box.edges, 2.0),
        "drilled": lambda: box - Cylinder(Pnt(5, 10, -1), Z, 3, 40) - Cylinder(
            Pnt(-1, 5, 15), X, 2, 30
        ),
        "cylinder": lambda: Cylinder(Pnt(1, 2, 3), Z, 5, 10),
        "sphere": lambda: Sphere(Pnt(1, 2, 3), 5),
        "half sphere": lambda: Sphere(Pnt(0, 0, 0), 5) * Box((-9, -9, 0), (9, 9, 9)),
        "quarter sphere": lambda: Sphere(Pnt(0, 0, 0), 5) * Box((0, -9, 0), (9, 9, 9)),
        "hollow": lambda: box - Sphere(Pnt(5, 10, 30), 4),
        "torus": lambda: upright.MoveTo(10, 0).Circle(3).Face().Revolve(about_z, 360),
        "part of a torus": lambda: upright.MoveTo(10, 0).Circle(3).Face().Revolve(about_z, 100),
        "cone": lambda: upright.MoveTo(1, 0).LineTo(5, 0).LineTo(3, 6).LineTo(1, 6).Close()
        .Face().Revolve(about_z, 360),
        "pointed cone": lambda: upright.MoveTo(0, 0).LineTo(5, 0).LineTo(0, 6).Close()
        .Face().Revolve(about_z, 360),
        "revolved spline": lambda: wave.Revolve(about_z, 360),
        "partly revolved spline": lambda: wave.Revolve(about_z, 120),
        "extruded spline": lambda: wave.Extrude(Vec(0, 10, 1)),
        "extruded Bézier": lambda: bezier.Extrude(Vec(0, 10, 1)),
        "loft": lambda: ThruSections(
            [WorkPlane().Circle(5).Wire(), WorkPlane(Axes((0, 0, 10), Z)).Rectangle(4, 4).Wire()]
        ),
        "assembly": lambda: Compound(
            [box, Sphere(Pnt(0, 0, 0), 3).Move(Vec(40, 0, 0)), box.Rotate(about_z, 30)
             .Move(Vec(0, 50, 0))]
        ),
        "mirrored": lambda: (box - Cylinder(Pnt(5, 10, -1), Z, 3, 40)).Mirror(
            Axes((0, 0, 0), X, Y)
        ),
    }  # fmt: skip
    return shapes[name]()


NAMES = (
    "box", "rounded box", "drilled", "cylinder", "sphere", "half sphere", "quarter sphere",
    "hollow", "torus", "part of a torus", "cone", "pointed cone", "revolved spline",
    "partly revolved spline", "extruded spline", "extruded Bézier", "loft", "assembly", "mirrored",
)  # fmt: skip


@cache
def _written(name: str) -> tuple[Part, Any]:
    """The part and the kernel's shape; no test changes them."""
    from netgen.occ import OCCGeometry

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "made.step"
        _make(name).WriteStep(str(file))
        return read_step_part(file), OCCGeometry(str(file)).shape


def _inner(face: Face, count: int = 400) -> np.ndarray:
    low, high = face.box
    uv = np.random.default_rng(0).uniform(low, high, (count, 2))
    return uv[face.inside(uv)]


@pytest.mark.parametrize("name", NAMES)
def test_faces_are_the_kernels(name: str) -> None:
    """Points and normals of the kernel's own surfaces, 1e-9 mm; the kernel's own areas (its
    integration) against those from 40 000 random parameters: 2 %, four standard deviations."""
    part, shape = _written(name)
    assert not part.unreadable
    kernel = list(shape.faces)
    assert [face.number for face in part.faces] == list(range(1, len(kernel) + 1))
    for face, theirs in zip(part.faces, kernel, strict=True):
        uv = _inner(face)[:20]
        local = face.local(uv)
        for (u, v), point, normal in zip(uv, local.point, local.normal, strict=True):
            value, du, dv = theirs.surf.D1(u, v)
            assert np.abs(np.array([value.x, value.y, value.z]) - point).max() < 1e-9
            across = np.cross([du.x, du.y, du.z], [dv.x, dv.y, dv.z])
            assert abs(across @ normal) > (1.0 - 1e-9) * np.linalg.norm(across)
        low, high = face.box
        many = np.random.default_rng(1).uniform(low, high, (40_000, 2))
        _, du, dv = face.derivatives(many)
        density = np.linalg.norm(np.cross(du, dv), axis=1) * face.inside(many)
        assert density.mean() * np.prod(high - low) == pytest.approx(theirs.mass, rel=0.02)


@pytest.mark.parametrize(
    "name",
    [n for n in NAMES if "spline" not in n and "Bézier" not in n and n != "loft"],
)
def test_normals_point_out_of_the_material(name: str) -> None:
    """A small ball a little inside has all its volume in common with a solid, one outside none."""
    from netgen.occ import Pnt, Sphere

    part, shape = _written(name)
    solids = list(shape.solids)
    for face in part.faces:
        local = face.local(_inner(face)[:2])
        for point, normal in zip(local.point, local.normal, strict=True):
            radius = 0.01
            whole = 4.0 / 3.0 * math.pi * radius**3
            for side, share in ((1.0, 0.0), (-1.0, 1.0)):
                ball = Sphere(Pnt(*(point + 2.0 * side * radius * normal)), radius)
                common = sum((solid * ball).mass for solid in solids)
                assert common / whole == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize(
    "name", ["drilled", "quarter sphere", "hollow", "part of a torus", "cone", "loft", "mirrored"]
)
def test_the_middle_of_a_face_is_far_from_its_edges(name: str) -> None:
    """At least half as far as the farthest of 2000 random points: on a curved face the largest
    circle of the parameters is not exactly the largest circle on the face."""
    from scipy.spatial import cKDTree

    part, _ = _written(name)
    for face in part.faces:
        assert face.inside(face.middle[None])[0]
        if not face.borders:
            continue
        size = float(np.linalg.norm(face.bounds[1] - face.bounds[0]))
        edges = cKDTree(face.derivatives(face.edge_samples(1e-3 * size))[0])
        own, _ = edges.query(face.derivatives(face.middle[None])[0])
        best, _ = edges.query(face.derivatives(_inner(face, 2000))[0])
        assert own[0] > 0.5 * best.max()


class TestRefusals:
    def test_no_file(self) -> None:
        with pytest.raises(InputError, match=r"nowhere\.step.*No such file"):
            parse_surface("nowhere.step#1")

    def test_not_step(self, tmp_path: Path) -> None:
        file = tmp_path / "mesh.step"
        file.write_text("solid ascii stl", encoding="ascii")
        with pytest.raises(InputError, match="is not a STEP file"):
            parse_surface(str(file))

    def test_truncated(self, tmp_path: Path) -> None:
        """The solids of a probe are read in the same way."""
        file = tmp_path / "half.step"
        whole = EXAMPLE.read_text(encoding="ascii")
        file.write_text(whole[: len(whole) // 2], encoding="ascii")
        for read in (read_step_part, read_step_solids):
            with pytest.raises(InputError, match=r"half\.step: is not complete"):
                read(file)
        with pytest.raises(InputError, match="contains no solid"):
            read_step_solids(EXAMPLE)

    def test_no_geometry(self, tmp_path: Path) -> None:
        file = tmp_path / "empty.step"
        whole = EXAMPLE.read_text(encoding="ascii")
        head = whole[: whole.index("DATA;")]
        for text, words in (
            (head, r"empty\.step: contains no faces"),
            (head.replace("AUTOMOTIVE_DESIGN", "IFC4"), "is a building model"),
        ):
            file.write_text(text + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n", encoding="ascii")
            with pytest.raises(InputError, match=words):
                read_step_part(file)

    def test_triangles_only_do_not_crash_us(self, tmp_path: Path) -> None:
        """The kernel itself crashes on some; in a process of its own."""
        file = tmp_path / "triangles.step"
        text = EXAMPLE.read_text(encoding="ascii").replace("(#11,#15)", "(#11,#9001)")
        head, mark, tail = text.rpartition("ENDSEC;")
        triangles = (
            "#9000=COORDINATES_LIST('',3,((0.,0.,0.),(1.,0.,0.),(0.,1.,0.)));\n"
            "#9001=TRIANGULATED_FACE('',#9000,3,(),$,(),((1,2,3)));\n"
        )
        file.write_text(head + triangles + mark + tail, encoding="ascii")
        for read in (read_step_part, read_step_solids):
            with pytest.raises(InputError, match="the CAD kernel cannot read it"):
                read(file)


def test_names_of_faces_and_capitals_in_the_ending(tmp_path: Path) -> None:
    file = tmp_path / "PART.STEP"
    text = EXAMPLE.read_text(encoding="ascii").replace("ADVANCED_FACE(''", "ADVANCED_FACE('top'")
    file.write_text(text, encoding="ascii")
    part = read_step_part(file)
    assert [face.name for face in part.faces] == ["top"]


def test_the_example_part() -> None:
    part = read_step_part(EXAMPLE)
    (face,) = part.faces
    assert face.kind == "B-spline"
    assert part.box[:, :2] == pytest.approx(np.array([[0.0, 0.0], [60.0, 40.0]]), abs=1e-9)
    poles = face.base.poles  # type: ignore[attr-defined]
    assert poles[..., 2].min() <= part.box[0, 2] < part.box[1, 2] <= poles[..., 2].max()
    # The normals of the surface itself point upwards.
    assert face.local(_inner(face)).normal[:, 2].min() > math.cos(math.radians(60.0))
