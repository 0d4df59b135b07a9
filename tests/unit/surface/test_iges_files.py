"""IGES files: faces without an outside are joined to bodies that have one; others are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.surface.cad import iges_reader
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


def _with_kinds(path: Path, kinds: list[int]) -> Path:
    """A file of lines whose entities have other types in the directory: two lines for each."""
    rows = write_iges(path, [], lines=len(kinds)).read_text(encoding="ascii").splitlines()
    directory = [i for i, row in enumerate(rows) if row[72:73] == "D"]
    for i, place in enumerate(directory):
        rows[place] = f"{kinds[i // 2]:>8}" + rows[place][8:]
    path.write_text("\n".join(rows) + "\n", encoding="ascii")
    return path


class TestHeader:
    def test_a_wrong_length_of_a_string_is_refused(self, tmp_path: Path) -> None:
        """The kernel itself takes the millimetres of this file for inches, without a message."""
        file = write_iges(tmp_path / "box.igs", box_patches())
        text = file.read_text(encoding="ascii")
        file.write_text(text.replace("8Hpart.igs", "9Hpart.igs"), encoding="ascii")
        with pytest.raises(InputError, match=r"parameter 4 of its .*the unit would"):
            read_part(file)

    def test_an_unknown_unit_is_refused(self, tmp_path: Path) -> None:
        file = write_iges(tmp_path / "box.igs", box_patches())
        text = file.read_text(encoding="ascii")
        file.write_text(text.replace(",1.,2,2HMM,", ",1.,0,2HMM,"), encoding="ascii")
        with pytest.raises(InputError, match=r"its unit .* is '0'; .*from 1 to 11"):
            read_part(file)

    def test_other_delimiters_and_strings_over_lines(self) -> None:
        """A string may contain delimiters and end in the next line; parameters may be empty, and
        there may be blanks before and after a string."""
        text = f"1H//1H,/  {'90H' + 'a/,b' * 22 + 'ab'}  //'32/38/6/308/15//1.0D0/ 2/2HMM,"
        rows = [text[i : i + 72] for i in range(0, len(text), 72)]
        check_iges_header([f"{row:<72}G{i:>7}".encode() for i, row in enumerate(rows, start=1)])
        spoilt = text.replace("90H", "89H")
        rows = [spoilt[i : i + 72] for i in range(0, len(spoilt), 72)]
        with pytest.raises(PretravelError, match="parameter 3"):
            check_iges_header([f"{row:<72}G{i:>7}".encode() for i, row in enumerate(rows, 1)])


class TestRefusals:
    def test_only_curves(self, tmp_path: Path) -> None:
        file = write_iges(tmp_path / "wires.igs", [], lines=3)
        with pytest.raises(InputError, match=r"wires\.igs: contains no surfaces, only curves; exp"):
            read_part(file)

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

    @pytest.mark.parametrize("name", ["part.stl", "part.OBJ", "part.3mf"])
    def test_meshes(self, name: str) -> None:
        with pytest.raises(InputError, match=r"is a mesh .*no exact normals.*as STEP"):
            parse_surface(f"{name}#1")
        assert source_file(name) == [name]

    def test_files_of_cad_programs(self) -> None:
        with pytest.raises(InputError, match=r"file of SolidWorks, .*export the part as STEP"):
            parse_surface("part.SLDPRT")
