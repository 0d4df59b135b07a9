"""IGES files: faces without an outside are joined to bodies that have one; others are refused."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.surface.cad import iges_reader
from pretravel.surface.cad.iges_bodies import SEWING, joined
from pretravel.surface.cad.iges_header import check_iges_header
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.specification import parse_surface, source_file
from tests.support.iges import BOX, box_patches, write_iges

MIDDLE = np.array([[0.5, 0.5]])


def _normals_point_out(part: Part, center: np.ndarray) -> list[bool]:
    locals_ = [face.local(MIDDLE) for face in part.faces]
    return [bool((at.point[0] - center) @ at.normal[0] > 0.0) for at in locals_]


@pytest.mark.parametrize(("unit", "scale"), [("MM", 1.0), ("INCH", 25.4)])
def test_a_box_has_an_outside_and_millimetres(unit: str, scale: float, tmp_path: Path) -> None:
    """Six loose faces; as they are in the file, three of their normals point into the box."""
    part = read_part(write_iges(tmp_path / "box.igs", box_patches(), unit=unit))
    assert not part.unreadable
    assert part.box == pytest.approx(scale * BOX, abs=1e-6)
    assert _normals_point_out(part, scale * BOX.mean(axis=0)) == [True] * 6


def test_bodies_that_touch_are_kept_apart(tmp_path: Path) -> None:
    """Three boxes in an L: six faces meet at one edge; the file's order keeps the boxes apart.
    The volume by the divergence theorem has the right size only if every normal points out."""
    size = BOX[1] - BOX[0]
    places = [np.array(place) * size for place in ((0, 0, 0), (1, 0, 0), (0, 1, 0))]
    patches = [patch for at in places for patch in box_patches(BOX[0] + at, BOX[1] + at)]
    part = read_part(write_iges(tmp_path / "boxes.iges", patches))
    assert len(part.faces) == 18
    volume = 0.0
    for face in part.faces:
        at = face.local(MIDDLE)
        _, du, dv = face.derivatives(MIDDLE)
        area = float(np.linalg.norm(np.cross(du, dv)))  # over a unit square of parameters
        volume += float(at.point[0] @ at.normal[0]) * area / 3.0
    assert volume == pytest.approx(3.0 * np.prod(size), rel=1e-9)


def test_an_open_box_is_read_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"10 µm apart, do not enclose.*nx, ny, nz"):
        part = read_part(write_iges(tmp_path / "open.igs", box_patches()[:5]))
    assert len(part.faces) == 5


def test_gaps_up_to_the_tolerance_are_joined(tmp_path: Path) -> None:
    """5 µm apart joined, 50 µm apart not: the tolerance is 10 µm."""
    for gap, closes in ((0.005, True), (0.05, False)):
        patches = box_patches()
        patches[-1] = patches[-1] + [0.0, 0.0, gap]
        file = write_iges(tmp_path / "gap.igs", patches)
        if closes:
            part = read_part(file)
            assert _normals_point_out(part, BOX.mean(axis=0)) == [True] * 6
        else:
            with pytest.warns(UserWarning, match="do not enclose a volume"):
                read_part(file)


@dataclass(frozen=True, eq=False)
class _Edge:
    center: Any
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    mass: float


def _edge(start: Any, end: Any, length: float | None = None) -> _Edge:
    one, other = np.array(start, dtype=float), np.array(end, dtype=float)
    x, y, z = 0.5 * (one + other)
    size = float(np.linalg.norm(other - one)) if length is None else length
    return _Edge(SimpleNamespace(x=x, y=y, z=z), tuple(one), tuple(other), size)


@dataclass(frozen=True, eq=False)
class _Face:
    edges: list[_Edge] = field(default_factory=list)

    @property
    def faces(self) -> list[_Face]:
        return [self]


@dataclass(frozen=True, eq=False)
class _Body:
    """A shell, or the solid that it bounds."""

    faces: list[_Face]
    mass: float
    reversed: bool = False

    def Reversed(self) -> _Body:
        return _Body(self.faces, -self.mass, not self.reversed)


def _cube(at: tuple[float, float, float], sides: tuple[float, float, float]) -> list[_Face]:
    """Six faces with edges of their own."""
    faces = []
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        for side in (0, 1):
            corners = []
            for one, other in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = np.array(at, dtype=float)
                corner[axis] += side * sides[axis]
                corner[others] += np.array([one, other]) * np.array(sides)[others]
                corners.append(corner)
            faces.append(_Face([_edge(corners[i], corners[(i + 1) % 4]) for i in range(4)]))
    return faces


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A kernel that sews all faces with edges to one shell, of the noted volume, and notes them."""
    notes: dict[str, Any] = {"volume": 1.0, "groups": []}

    def sew(faces: list[_Face], gap: float) -> Any:
        assert gap == SEWING
        notes["groups"].append(faces)
        known: dict[Any, _Edge] = {}
        made = [
            _Face([known.setdefault((round(e.center.x, 1), round(e.center.y, 1),
                                     round(e.center.z, 1), round(e.mass, 1)), e)
                   for e in face.edges])
            for face in faces
        ]  # fmt: skip
        edged = [face for face in made if face.edges]
        return SimpleNamespace(shells=[_Body(edged, notes["volume"])] if edged else [], faces=made)

    fake = SimpleNamespace(
        Compound=list, Solid=lambda shell: _Body(shell.faces, shell.mass), Sew=sew
    )
    monkeypatch.setitem(sys.modules, "netgen.occ", fake)
    return notes


class TestBodies:
    @pytest.mark.parametrize(("volume", "turned"), [(2.0, False), (-2.0, True), (0.0, True)])
    def test_loose_faces_are_joined_in_the_order_of_the_file(
        self, kernel: dict[str, Any], volume: float, turned: bool
    ) -> None:
        """Two cubes that touch, a tube with its seam twice between two lids, a ball without edges
        between, and two faces that are left. Faces of the file's own solids are not joined again.
        Edges up to 10 µm long do not count, and of one face all edges are 12 µm off."""
        kernel["volume"] = volume
        own, first, second = (_cube((x, 0, 0), (2, 3, 4)) for x in (-9, 0, 2))
        first[0].edges.append(_edge((0.0, 0.0, 0.0), (0.0, 0.0, 0.99 * SEWING)))
        aside = 0.012 * np.eye(3)[0]
        moved = [_edge(edge.start + aside, edge.end + aside) for edge in first[3].edges]
        first[3] = _Face(moved)
        circles = [_edge((9.0, 0.0, z), (9.0, 0.0, z), 6.3) for z in (0.0, 5.0)]
        seam = _edge((9.0, 0.0, 0.0), (9.0, 0.0, 5.0))
        tube = [_Face([circles[0]]), _Face([circles[0], seam, circles[1], seam]),
                _Face([circles[1]])]  # fmt: skip
        ball, left = _Face(), _cube((50, 0, 0), (1, 1, 1))[:2]
        solid = _Body(own, 3.0)
        faces = [*first, *own, ball, *second, *tube, *left]
        bodies, closed, unclosed = joined(SimpleNamespace(solids=[solid], faces=faces))
        assert kernel["groups"] == [first, [ball, *second], tube, left]
        assert (closed, unclosed) == (4, 2)
        assert bodies[0] is solid
        sizes = [len(body.faces) for body in bodies[1:]]
        assert sizes == [6, 6, 1, 3, 2]
        assert [bodies[i].reversed for i in (1, 2, 4)] == [turned] * 3

    def test_a_face_alone_is_not_sewn_and_no_face_is_no_body(self, kernel: dict[str, Any]) -> None:
        ball, empty = _Face(), SimpleNamespace(solids=[], faces=[])
        assert joined(SimpleNamespace(solids=[], faces=[ball])) == ([ball], 0, 1)
        assert joined(empty) == (empty, 0, 0)
        assert kernel["groups"] == []


def _with_kinds(path: Path, kinds: list[int]) -> Path:
    """A file of lines whose entities have other types in the directory: two lines for each."""
    rows = write_iges(path, [], lines=len(kinds)).read_text(encoding="ascii").splitlines()
    directory = [i for i, row in enumerate(rows) if row[72:73] == "D"]
    for i, place in enumerate(directory):
        rows[place] = f"{kinds[i // 2]:>8}" + rows[place][8:]
    path.write_text("\n".join(rows) + "\n", encoding="ascii")
    return path


def _lines(text: str, letter: str = "G") -> list[bytes]:
    rows = [text[i : i + 72] for i in range(0, len(text), 72)]
    return [f"{row:<72}{letter}{i:>7}".encode() for i, row in enumerate(rows, start=1)]


class TestHeader:
    @pytest.mark.parametrize("flag", ["1", "2", "9", "10", "11", "", " 6 ", "000000011"])
    def test_units_from_1_to_11_or_none_are_known(self, flag: str) -> None:
        """The flag is parameter 14, others can be any; a section can end before it, and other
        sections are not read."""
        section = f",,{'7,' * 10}99,{flag},99;"
        check_iges_header(_lines("not a section 99H", "S") + _lines(section))
        check_iges_header(_lines(f",,{'7,' * 10}99;"))

    @pytest.mark.parametrize("flag", ["0", "12", "-1", "x", "2.", "0000000011"])
    def test_other_units_are_refused(self, flag: str) -> None:
        with pytest.raises(PretravelError, match=rf"\(parameter 14 .* is '{flag}'; .*from 1 to 11"):
            check_iges_header(_lines(f",,{'7,' * 11}{flag},2HMM;"))

    def test_a_short_line_is_filled_with_blanks(self) -> None:
        """Of a string over two lines, the first of which ends early: blanks belong to it."""
        # 72 columns less the 5 before the string, and 3 of the second line.
        first, second = b",,70Hab".ljust(72), (b"ccc" + b",7" * 10 + b",2;").ljust(72)
        check_iges_header([first + b"G      1", second + b"G      2"])

    @pytest.mark.parametrize("delimiters", [(",", ";"), ("/", "&"), (":", ";"), (";", "!")])
    @pytest.mark.parametrize(("flag", "known"), [("2", True), ("99", False)])
    def test_parameters_are_told_apart_by_their_delimiters(
        self, delimiters: tuple[str, str], flag: str, known: bool
    ) -> None:
        """The first two state them where they are not comma and semicolon. Strings contain both
        and blanks, and may go on in the next line; a string of one character further on states
        nothing, nor does one of two characters."""
        mark, end = delimiters
        first = f"1H{mark}" if mark != "," else ""
        second = f"1H{end}" if end != ";" else ""
        inner = f"a{mark}b{end} c" * 20
        values = [
            f"{len(inner)}H{inner}", "1HX", "", "3.5D0", f"2H{end}{mark}", f"12h{'z':>12}", "1Hy",
            *("8" * 4), flag, "",
        ]  # fmt: skip
        text = f" {first}{mark}{second} {mark}"
        text += mark.join(f"  {value} " for value in values) + end + "rest,1;"
        if known:
            check_iges_header(_lines(text))
            return
        with pytest.raises(PretravelError, match=f"is '{flag}'"):
            check_iges_header(_lines(text))

    @pytest.mark.parametrize(
        ("text", "number"),
        [
            ("1H,,1H;,4Habc,5;", 3), ("1H,,1H;,2Habc,5;", 3), (",,7", 3), ("", 1),
            (",,5,9999999999Habc;", 4), (",,5,999999999Habc;", 4),
        ],
    )  # fmt: skip
    def test_a_string_of_another_length_or_no_end_is_refused(self, text: str, number: int) -> None:
        with pytest.raises(PretravelError, match=f"parameter {number} of its global section"):
            check_iges_header(_lines(text))

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("8Hpart.igs", "9Hpart.igs", r"parameter 4 of its .*the unit would"),
            (",1.,2,2HMM,", ",1.,0,2HMM,", r"its unit .* is '0'; .*from 1 to 11"),
        ],
    )
    def test_it_is_checked_before_a_file_is_read(
        self, old: str, new: str, words: str, tmp_path: Path
    ) -> None:
        """With the wrong length, the kernel takes the millimetres for inches, without a message."""
        file = write_iges(tmp_path / "box.igs", box_patches())
        file.write_text(file.read_text(encoding="ascii").replace(old, new), encoding="ascii")
        with pytest.raises(InputError, match=words):
            read_part(file)


class TestRefusals:
    @pytest.mark.parametrize(
        ("kinds", "has"),
        [
            *(([kind], ", only curves") for kind in (100, 102, 104, 106, 110, 112, 126, 130)),
            ([116], ", only points"),
            ([110, 116], ", only curves and points"),
            ([124], ""),  # a transformation matrix
            ([], ""),
        ],
    )
    def test_what_a_file_has_instead_of_surfaces(
        self, kinds: list[int], has: str, tmp_path: Path
    ) -> None:
        """Types of entities of IGES 5.3, table 3: curves and points are geometry without faces."""
        file = _with_kinds(tmp_path / "wires.igs", kinds)
        with pytest.raises(InputError, match=rf"contains no surfaces{has}; export the part"):
            read_part(file)

    @pytest.mark.parametrize(
        "kind", [108, 114, 118, 120, 122, 128, 140, 143, 144, 186, 190, 192, 194, 196, 198]
    )
    def test_every_kind_of_surface_is_left_to_the_kernel(
        self, kind: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Types of entities of IGES 5.3, tables 3 and 4: surfaces, and a solid (186)."""

        def kernel(copy: Path, folder: Path) -> None:
            assert copy.suffix == ".iges"
            raise NotImplementedError

        monkeypatch.setattr(iges_reader, "run_kernel", kernel)
        with pytest.raises(NotImplementedError):
            read_part(_with_kinds(tmp_path / "part.igs", [110, kind]))

    def test_no_iges_and_half_of_one(self, tmp_path: Path) -> None:
        file = tmp_path / "text.igs"
        file.write_text("ISO-10303-21;\n", encoding="ascii")
        with pytest.raises(InputError, match="is not an IGES file"):
            read_part(file)
        whole = write_iges(file, box_patches()).read_text(encoding="ascii")
        file.write_text(whole[: len(whole) // 2], encoding="ascii")
        with pytest.raises(InputError, match="is not complete"):
            read_part(file)
        with pytest.raises(InputError, match=r"nowhere\.igs.*No such file"):
            read_part(tmp_path / "nowhere.igs")

    @pytest.mark.parametrize(
        ("name", "words"),
        [
            ("part.stl", r"is a mesh .*no exact normals.*as STEP"),
            ("part.OBJ", r"is a mesh .*no exact normals.*as STEP"),
            ("part.3mf", r"is a mesh .*no exact normals.*as STEP"),
            ("part.SLDPRT", r"file of SolidWorks, .*export the part as STEP"),
        ],
    )
    def test_files_without_exact_faces(self, name: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            parse_surface(f"{name}#1")
        assert source_file(name) == [name]
