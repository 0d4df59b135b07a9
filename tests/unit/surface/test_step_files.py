"""STEP files: every face type agrees with the CAD kernel, or is refused with a reason."""

from __future__ import annotations

import math
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.cad.step_reader import read_step_solids
from pretravel.surface.cad.trim import Trim
from pretravel.surface.specification import parse_surface
from tests.support.examples import EXAMPLES


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


def test_the_middle_of_slivers_and_bands() -> None:
    """In a ring and in an L (the centre of area of both is outside), in a strip of 1000 x 0.1,
    and halfway along a full turn, whose seam is no edge."""
    square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
    open_plane = (math.inf, math.inf)
    assert Trim([square, square / 9.0 * 7.0 + 1.0], open_plane).inside(
        Trim([square, square / 9.0 * 7.0 + 1.0], open_plane).middle(np.ones(2))[None]
    )[0]
    corner = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 1.0], [1.0, 1.0], [1.0, 9.0], [0.0, 9.0]])
    at = Trim([corner], open_plane).middle(np.ones(2))
    assert at.min() == pytest.approx(0.55, abs=0.1)  # the circle in the corner is the largest
    strip = Trim([square / 9.0 * [1000.0, 0.1]], open_plane).middle(np.ones(2))
    assert strip[1] == pytest.approx(0.05, abs=0.005)
    band = Trim([square / 9.0 * [2.0 * math.pi, 500.0]], (2.0 * math.pi, math.inf))
    assert band.middle(np.array([3.0, 1.0]))[1] == pytest.approx(250.0, abs=25.0)


def test_kinds_are_named() -> None:
    kinds = {name: {f.kind for f in _written(name)[0].faces} for name in NAMES}
    found = set().union(*kinds.values())
    assert {"plane", "cylinder", "cone", "sphere", "torus", "B-spline", "extrusion",
            "revolution"} <= found  # fmt: skip


def _surface_file(surface: str, path: Path, unit: str = "") -> Path:
    """A STEP file of one face on a surface written by hand, bounded by a square of its
    parameters through curves of degree one."""
    length = unit or "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
    text = f"""ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('hand','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('automotive design');
#2=PRODUCT_CONTEXT('',#1,'mechanical');
#3=PRODUCT('p','p','',(#2));
#4=PRODUCT_DEFINITION_FORMATION('','',#3);
#5=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#6=PRODUCT_DEFINITION('','',#4,#5);
#7=PRODUCT_DEFINITION_SHAPE('','',#6);
#8=SHAPE_DEFINITION_REPRESENTATION(#7,#9);
#9=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#20,#30),#10);
#10=( GEOMETRIC_REPRESENTATION_CONTEXT(3) GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#14))
 GLOBAL_UNIT_ASSIGNED_CONTEXT((#11,#12,#13)) REPRESENTATION_CONTEXT('','') );
#11={length};
#12=( NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.) );
#13=( NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT() );
#14=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#11,'','');
#20=AXIS2_PLACEMENT_3D('',#21,#22,#23);
#21=CARTESIAN_POINT('',(0.,0.,0.));
#22=DIRECTION('',(0.,0.,1.));
#23=DIRECTION('',(1.,0.,0.));
#30=SHELL_BASED_SURFACE_MODEL('',(#31));
#31=OPEN_SHELL('',(#32));
#32=ADVANCED_FACE('top',(#33),#80,.T.);
#33=FACE_BOUND('',#34,.T.);
#34=EDGE_LOOP('',(#41,#42,#43,#44));
#41=ORIENTED_EDGE('',*,*,#51,.T.);
#42=ORIENTED_EDGE('',*,*,#52,.T.);
#43=ORIENTED_EDGE('',*,*,#53,.T.);
#44=ORIENTED_EDGE('',*,*,#54,.T.);
{surface}
#90=CARTESIAN_POINT('',(0.,0.,0.));
ENDSEC;
END-ISO-10303-21;
"""
    path.write_text(text, encoding="ascii")
    return path


def _square(height: float, side: float = 4.0) -> str:
    """Vertices and straight edges of a square at a height."""
    corners = [(-side, -side), (side, -side), (side, side), (-side, side)]
    lines = []
    for i, (x, y) in enumerate(corners):
        lines.append(f"#{60 + i}=VERTEX_POINT('',#{64 + i});")
        lines.append(f"#{64 + i}=CARTESIAN_POINT('',({x:.6f},{y:.6f},{height:.6f}));")
        ahead = corners[(i + 1) % 4]
        dx, dy = (ahead[0] - x) / (2 * side), (ahead[1] - y) / (2 * side)
        lines.append(f"#{51 + i}=EDGE_CURVE('',#{60 + i},#{60 + (i + 1) % 4},#{70 + i},.T.);")
        lines.append(f"#{70 + i}=LINE('',#{64 + i},#{74 + i});")
        lines.append(f"#{74 + i}=VECTOR('',#{100 + i},1.);")
        lines.append(f"#{100 + i}=DIRECTION('',({dx:.6f},{dy:.6f},0.));")
    return "\n".join(lines)


class TestByHand:
    def test_an_offset_surface(self, tmp_path: Path) -> None:
        """A plane at height 5, by an offset of 5 from one at zero."""
        surface = "#80=OFFSET_SURFACE('',#81,5.,.F.);\n#81=PLANE('',#20);\n" + _square(5.0)
        (face,) = read_step_part(_surface_file(surface, tmp_path / "offset.step")).faces
        local = face.local(_inner(face))
        assert np.allclose(local.point[:, 2], 5.0)
        assert np.allclose(local.normal, [0.0, 0.0, 1.0])

    def test_inches_become_millimetres(self, tmp_path: Path) -> None:
        inch = (
            "( CONVERSION_BASED_UNIT('INCH',#15) LENGTH_UNIT() NAMED_UNIT(#16) );\n"
            "#15=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#17);\n"
            "#16=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
            "#17=( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
        )
        surface = "#80=PLANE('',#20);\n" + _square(0.0, 1.0)
        part = read_step_part(_surface_file(surface, tmp_path / "inch.step", inch))
        assert part.box[1] - part.box[0] == pytest.approx([50.8, 50.8, 0.0], abs=1e-6)

    def test_a_name_chooses_a_face(self, tmp_path: Path) -> None:
        surface = "#80=PLANE('',#20);\n" + _square(0.0)
        file = _surface_file(surface, tmp_path / "named.step")
        part = read_step_part(file)
        assert part.faces[0].name == "top"
        assert part.select("top").chosen == (0,)
        with pytest.raises(PretravelError, match="no face named 'bottom'"):
            part.select("bottom")
        with pytest.raises(PretravelError, match="has no face 7; it has 1"):
            part.select("7")


class TestBrepText:
    @pytest.mark.parametrize("handed", [1.0, -1.0])
    @pytest.mark.parametrize(
        ("kind", "sizes"), [(1, []), (2, [5]), (3, [5, 0.3]), (4, [5]), (5, [9, 2])]
    )
    def test_left_handed_frames_turn_the_parameters(
        self, kind: int, sizes: list[float], handed: float
    ) -> None:
        """The reader gives the sense of du x dv relative to the normal of the shape."""
        from pretravel.surface.cad.brep_geometry import Tokens, read_surface

        numbers = [1, 2, 3, 0, 0, 1, 1, 0, 0, 0, handed, 0, *sizes]
        record = read_surface(Tokens([str(kind), *map(str, numbers)]))
        assert record.surface is not None
        uv = np.array([[0.4, 0.5]])
        point, du, dv = record.surface.derivatives(uv)
        normal = record.surface.local(uv).normal
        side = float(np.cross(du, dv)[0] @ normal[0])
        assert np.sign(side) == record.along_parameters
        # The parametrisation of the file: P(u, v) with y reversed.
        if kind == 2:
            own = [1 + 5 * math.cos(0.4), 2 + handed * 5 * math.sin(0.4), 3.5]
            assert point[0] == pytest.approx(own)

    @pytest.mark.parametrize("pole", ["inf", "nan", "1e9"])
    def test_a_spline_surface_with_a_pole_that_no_part_has(self, pole: str) -> None:
        """Its face alone is refused, with this reason."""
        from pretravel.surface.cad.brep_geometry import Tokens, read_surface

        corners = ["0", "0", "0", "0", "1", "0", "1", pole, "0", "1", "1", "0"]
        record = read_surface(Tokens(["8", "0", "0", "1", "1", *corners]))
        assert record.surface is None
        assert record.problem.startswith(f"a pole of a spline surface is {float(pole):g}")

    @pytest.mark.parametrize("pole", ["inf", "nan"])
    def test_a_curve_with_a_pole_that_is_not_finite(self, pole: str) -> None:
        from pretravel.surface.cad.brep_geometry import Tokens, read_curve

        with pytest.raises(PretravelError, match=f"a pole of a spline curve is {pole}"):
            read_curve(Tokens(["6", "0", "1", "0", "0", "0", "1", pole, "0"]), 3)

    def test_placements_within_placements(self, tmp_path: Path) -> None:
        """A box is twice in a group, the group twice in another: rotated, moved, moved again."""
        from netgen.occ import Axis, Box, Compound, TopLoc_Location, Vec, Z, gp_Trsf

        from pretravel.surface.cad.brep import parse_brep
        from pretravel.surface.cad.kernel_process import CadContent
        from pretravel.surface.cad.step_part import part_from_content

        def there(*moves: Any) -> Any:
            whole = moves[0]
            for move in moves[1:]:
                whole = whole * move
            return TopLoc_Location(whole)

        box = Box((0, 0, 0), (10, 20, 30))
        turn = gp_Trsf.Rotation(Axis((0, 0, 0), Z), 30)
        group = Compound([box, box.Located(there(gp_Trsf.Translation(Vec(40, 0, 0)), turn))])
        both = Compound([group, group.Located(there(gp_Trsf.Translation(Vec(0, 50, 0))))])
        file = tmp_path / "groups.brep"
        both.WriteBrep(str(file), withTriangles=False)
        part = part_from_content(CadContent(parse_brep(file.read_text(encoding="ascii")), ()), file)
        assert len(part.faces) == 24
        ours = np.array([f.derivatives(f.samples(np.inf))[0].mean(axis=0) for f in part.faces])
        theirs = np.array([[f.center.x, f.center.y, f.center.z] for f in both.faces])
        assert np.abs(ours - theirs).max() < 0.2  # of samples, and of area
        corner = np.array([[40.0, 0.0, 0.0]]) + np.array([[0.0, 50.0, 0.0]])
        points = np.concatenate([f.derivatives(f.samples(np.inf))[0] for f in part.faces])
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-9

    def test_a_part_that_is_moved_by_a_little_is_moved(self, tmp_path: Path) -> None:
        """By 0.3 mm and 0.2°: less than 1 in every number of the placement."""
        from netgen.occ import Axis, Box, TopLoc_Location, Vec, Z, gp_Trsf

        from pretravel.surface.cad.brep import parse_brep
        from pretravel.surface.cad.kernel_process import CadContent
        from pretravel.surface.cad.step_part import part_from_content

        little = gp_Trsf.Translation(Vec(0.3, 0, 0)) * gp_Trsf.Rotation(Axis((0, 0, 0), Z), 0.2)
        file = tmp_path / "little.brep"
        moved = Box((0, 0, 0), (10, 20, 30)).Located(TopLoc_Location(little))
        moved.WriteBrep(str(file), withTriangles=False)
        part = part_from_content(CadContent(parse_brep(file.read_text(encoding="ascii")), ()), file)
        points = np.concatenate([f.derivatives(f.samples(np.inf))[0] for f in part.faces])
        turn = np.radians(0.2)
        corner = [0.3 + 10.0 * np.cos(turn), 10.0 * np.sin(turn), 30.0]
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-9

    def test_a_part_placed_as_its_mirror_image_is_refused(self, tmp_path: Path) -> None:
        from netgen.occ import Box

        from pretravel.surface.cad.brep import parse_brep
        from pretravel.surface.cad.kernel_process import CadContent
        from pretravel.surface.cad.step_part import part_from_content

        file = tmp_path / "box.brep"
        Box((0, 0, 0), (1, 2, 3)).WriteBrep(str(file), withTriangles=False)
        text = file.read_text(encoding="ascii")
        head, tail = text.split("Locations 0")
        for matrix, refused in (
            ("-1 0 0 9 0 1 0 0 0 0 1 0", True),
            ("0 -1 0 9 1 0 0 0 0 0 1 0", 0),
        ):
            moved = head + "Locations 1\n1 " + matrix + tail.rstrip()[: -len("+1 0")] + "+1 1"
            if refused:
                with pytest.raises(InputError, match="mirror image"):
                    part_from_content(CadContent(parse_brep(moved), ("",) * 6), file)
            else:
                part = part_from_content(CadContent(parse_brep(moved), ("",) * 6), file)
                assert part.box == pytest.approx(np.array([[7.0, 0, 0], [9, 1, 3]]))


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
        file = tmp_path / "half.step"
        whole = (EXAMPLES / "part.step").read_text(encoding="ascii")
        file.write_text(whole[: len(whole) // 2], encoding="ascii")
        with pytest.raises(InputError, match=r"half\.step: is not complete"):
            read_step_part(file)

    def test_no_geometry(self, tmp_path: Path) -> None:
        file = tmp_path / "empty.step"
        whole = (EXAMPLES / "part.step").read_text(encoding="ascii")
        head = whole[: whole.index("DATA;")]
        file.write_text(head + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n", encoding="ascii")
        with pytest.raises(InputError, match=r"empty\.step: contains no faces"):
            read_step_part(file)
        building = head.replace("AUTOMOTIVE_DESIGN", "IFC4")
        file.write_text(building + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n", encoding="ascii")
        with pytest.raises(InputError, match="is a building model"):
            read_step_part(file)

    def test_triangles_only_do_not_crash_us(self, tmp_path: Path) -> None:
        """The kernel itself crashes on some; in a process of its own."""
        file = tmp_path / "triangles.step"
        surface = (
            "#80=PLANE('',#20);\n" + _square(0.0)
            + "\n#200=COORDINATES_LIST('',3,((0.,0.,0.),(1.,0.,0.),(0.,1.,0.)));\n"
            "#201=TRIANGULATED_FACE('',#200,3,(),$,(),((1,2,3)));"
        )  # fmt: skip
        text = _surface_file(surface, file).read_text(encoding="ascii")
        file.write_text(text.replace("(#20,#30)", "(#20,#201)"), encoding="ascii")
        with pytest.raises(InputError):
            read_step_part(file)
        with pytest.raises(InputError):  # the solids of a probe are read in the same way
            read_step_solids(file)

    def test_solids_of_a_probe_are_refused_with_the_reason(self, tmp_path: Path) -> None:
        file = tmp_path / "half.step"
        whole = (EXAMPLES / "part.step").read_text(encoding="ascii")
        file.write_text(whole[: len(whole) // 2], encoding="ascii")
        with pytest.raises(InputError, match=r"half\.step: is not complete"):
            read_step_solids(file)
        with pytest.raises(InputError, match="contains no solid"):
            read_step_solids(EXAMPLES / "part.step")

    def test_a_bad_face_does_not_take_the_others_with_it(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from pretravel.surface.cad import brep_geometry

        def broken(*_: object) -> None:
            raise PretravelError("a cone like no other")

        kinds = brep_geometry._ELEMENTARY
        monkeypatch.setattr(brep_geometry, "_ELEMENTARY", {**kinds, 3: ("cone", broken, 2)})
        _make("cone").WriteStep(str(tmp_path / "made.step"))
        part = read_step_part(tmp_path / "made.step")
        assert list(part.unreadable.values()) == ["cone: a cone like no other"]
        assert len(part.faces) == 3
        (number,) = part.unreadable
        with pytest.raises(PretravelError, match=f"face {number} cannot be used.*no other"):
            part.select(str(number))
        with pytest.raises(InputError, match=f"face {number}: cone: a cone like no other"):
            parse_surface(str(tmp_path / "made.step"))


def test_capitals_in_the_ending(tmp_path: Path) -> None:
    file = tmp_path / "PART.STEP"
    file.write_bytes((EXAMPLES / "part.step").read_bytes())
    assert len(read_step_part(file).faces) == 1


def test_the_example_part() -> None:
    part = read_step_part(EXAMPLES / "part.step")
    (face,) = part.faces
    assert face.kind == "B-spline"
    assert part.box[:, :2] == pytest.approx(np.array([[0.0, 0.0], [60.0, 40.0]]), abs=1e-9)
    poles = face.base.poles  # type: ignore[attr-defined]
    assert poles[..., 2].min() <= part.box[0, 2] < part.box[1, 2] <= poles[..., 2].max()
    # The normals of the surface itself point upwards.
    assert face.local(_inner(face)).normal[:, 2].min() > math.cos(math.radians(60.0))
