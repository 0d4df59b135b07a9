"""STEP files with several roots, assemblies and instances: all faces, each in its place."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.cad.step_reader import read_step_solids
from pretravel.surface.cad.step_roots import whole_shape
from tests.support.commands import rows, run
from tests.support.step_files import StepAssembly, StepPart, placement, write_step

BOX, PIN = (10.0, 20.0, 30.0), (3.0, 40.0)


def _box(name: str = "box") -> StepPart:
    from netgen.occ import Box

    return StepPart(name, Box((0, 0, 0), BOX))


def _pin(name: str = "pin") -> StepPart:
    from netgen.occ import Cylinder, Pnt, Z

    return StepPart(name, Cylinder(Pnt(0, 0, 0), Z, *PIN))


def _read(path: Path) -> Part:
    """Without any warning: nothing is missing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        part = read_part(path)
    assert not part.unreadable
    return part


def _planes(part: Part, name: str) -> np.ndarray:
    """Distance from the origin and normal of each flat face of a part, sorted, (k, 4)."""
    faces = [face for face in part.faces if face.part == name and face.kind == "plane"]
    local = [face.local(face.middle[None]) for face in faces]
    normals = np.concatenate([one.normal for one in local])
    points = np.concatenate([one.point for one in local])
    found = np.column_stack([np.sum(normals * points, axis=1), normals])
    return found[np.lexsort(found.round(6).T)]


def _placed_planes(planes: list[tuple[float, list[float]]], at: np.ndarray) -> np.ndarray:
    """The same of planes that are placed, (k, 4)."""
    found = []
    for distance, normal in planes:
        turned = at[:3, :3] @ np.array(normal)
        found.append([distance + turned @ at[:3, 3], *turned])
    placed = np.array(found)
    return placed[np.lexsort(placed.round(6).T)]


_BOX_PLANES = [
    (side * size, (side * axis).tolist())
    for size, axis in zip(BOX, np.eye(3), strict=True)
    for side in (1.0, -1.0)
]
_BOX_PLANES = [(max(distance, 0.0), normal) for distance, normal in _BOX_PLANES]
_PIN_PLANES: list[tuple[float, list[float]]] = [(PIN[1], [0, 0, 1.0]), (0.0, [0, 0, -1.0])]


class TestRoots:
    def test_every_root_is_read(self, tmp_path: Path) -> None:
        """Was: the first one alone, without a word."""
        path = write_step(tmp_path / "two.step", [_box(), _pin()])
        assert [len(solid.faces) for solid in read_step_solids(path)] == [6, 3]  # of a probe
        part = _read(path)
        assert [face.number for face in part.faces] == list(range(1, 10))
        assert [face.part for face in part.faces] == ["box"] * 6 + ["pin"] * 3

    def test_roots_in_other_units(self, tmp_path: Path) -> None:
        """The second one is in inches."""
        path = write_step(tmp_path / "units.step", [_box(), _pin()])
        first, _, second = path.read_text("ascii").rpartition("SI_UNIT(.MILLI.,.METRE.)")
        inch = (
            "( CONVERSION_BASED_UNIT('INCH',#90001) LENGTH_UNIT() NAMED_UNIT(#90002) );\n"
            "#90001=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#1004);\n"
            "#90002=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)"
        )
        start = first.rpartition("=")[0]
        path.write_text(f"{start}={inch}{second[second.index(';') :]}", "ascii")
        part = _read(path)
        assert _planes(part, "pin")[:, 0].max() == pytest.approx(25.4 * PIN[1])
        assert _planes(part, "box")[:, 0].max() == pytest.approx(30.0)

    def test_one_part_has_no_name_of_a_part(self, tmp_path: Path) -> None:
        part = _read(write_step(tmp_path / "one.step", [_box()]))
        assert {face.part for face in part.faces} == {""}


class TestAssemblies:
    """Placements that do not commute, three levels deep, with instances."""

    def _roots(self) -> tuple[StepAssembly, dict[str, np.ndarray]]:
        box, pin = _box(), _pin()
        a, b = placement(1, 0, 0, turn=30), placement(0, 50, 0, turn=20, axis="x")
        c, d = placement(0, 100, 7, turn=40, axis="x"), placement(9, 9, 9, turn=15, axis="y")
        e, f = placement(200, 1, 2, turn=10, axis="y"), placement(0, 0, 500, turn=50)
        inner = StepAssembly("inner", [(box, a), (pin, b)])
        mid = StepAssembly("mid", [(inner, c), (pin, d)])
        top = StepAssembly("top", [(mid, e), (mid, f), (box, placement(0, 0, -100))])
        places = {"top/box": placement(0, 0, -100)}
        for name, at in (("mid", e), ("mid (2)", f)):
            places |= {
                f"top/{name}/inner/box": at @ c @ a,
                f"top/{name}/inner/pin": at @ c @ b,
                f"top/{name}/pin": at @ d,
            }
        return top, places

    def _check(self, part: Part, places: dict[str, np.ndarray]) -> None:
        for name, at in places.items():
            planes = _BOX_PLANES if name.endswith("box") else _PIN_PLANES
            # The file states places with 15 decimals.
            assert _planes(part, name) == pytest.approx(_placed_planes(planes, at), abs=1e-9)

    def test_every_instance_in_its_place_and_by_its_name(self, tmp_path: Path) -> None:
        top, places = self._roots()
        part = _read(write_step(tmp_path / "top.step", [top]))
        assert len(part.faces) == 3 * 6 + 4 * 3
        assert {face.part for face in part.faces} == set(places)
        self._check(part, places)
        for word, count in {
            "box": 18, "pin": 12, "mid": 24, "mid (2)": 12, "inner/pin": 6, "top/box": 6,
            "mid (2)/pin": 3,
        }.items():  # fmt: skip
            assert len(part.select(word).chosen) == count, word
        with pytest.raises(PretravelError, match="no face or part named 'lid'"):
            part.select("lid")

    @pytest.mark.parametrize("first", [True, False])
    def test_assemblies_among_several_roots(self, first: bool, tmp_path: Path) -> None:
        top, places = self._roots()
        other = StepAssembly("other", [(_pin("axle"), placement(5, 6, 7, turn=25, axis="y"))])
        roots = [top, _box("plate"), other]
        part = _read(write_step(tmp_path / "mixed.step", roots if first else roots[::-1]))
        assert len(part.faces) == 30 + 6 + 3
        self._check(part, places)
        assert _planes(part, "plate") == pytest.approx(_placed_planes(_BOX_PLANES, np.eye(4)))
        at = placement(5, 6, 7, turn=25, axis="y")
        assert _planes(part, "other/axle") == pytest.approx(
            _placed_planes(_PIN_PLANES, at), abs=1e-9
        )

    def test_the_list_of_faces_names_the_parts(self, tmp_path: Path) -> None:
        file = write_step(tmp_path / "two.step", [_box(), _pin()])
        printed = run("faces", file, "-o", tmp_path / "faces.csv")
        assert "two.step: 9 faces of 2 parts, 13.00 x 23.00 x 40.00 mm" in printed
        table = rows(tmp_path / "faces.csv")
        assert [row["part"] for row in table] == ["box"] * 6 + ["pin"] * 3


class _Geometry:
    """What `OCCGeometry` makes of a file: the kernel's own class has the method too."""

    GetAssemblyTree = None

    def __init__(self, made: Callable[[], SimpleNamespace]) -> None:
        self._made = made

    def __call__(self, _: str) -> SimpleNamespace:
        return self._made()


class TestNothingIsMissing:
    def test_faces_that_belong_to_no_part_are_counted(self, tmp_path: Path) -> None:
        """The product of the pin has lost its shape; its three faces are still in the text."""
        path = write_step(tmp_path / "lost.step", [_box(), _pin()])
        head, mark, tail = path.read_text("ascii").rpartition("SHAPE_DEFINITION_REPRESENTATION")
        path.write_text(head.rpartition("#")[0] + tail[tail.index(";") + 1 :], "ascii")
        assert mark
        with pytest.warns(UserWarning, match=r"lost\.step defines 9 faces, and 6 of them were"):
            assert len(read_part(path).faces) == 6

    def test_a_tree_that_places_the_first_root_elsewhere(
        self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        """Of a kernel that does so, several roots are refused; one root is its own shape."""

        def node(name: str, *faces: str, children: tuple[Any, ...] = ()) -> SimpleNamespace:
            shape = None if children else SimpleNamespace(faces=list(faces))
            return SimpleNamespace(name=name, shape=shape, children=list(children))

        def geometry(roots: tuple[Any, ...]) -> SimpleNamespace:
            return SimpleNamespace(
                shape=SimpleNamespace(faces=["a", "b"]),
                GetAssemblyTree=lambda: node("", children=roots),
            )

        def fake(*roots: Any) -> None:
            occ = SimpleNamespace(OCCGeometry=_Geometry(lambda: geometry(roots)), Compound=list)
            monkeypatch.setitem(sys.modules, "netgen.occ", occ)  # type: ignore[arg-type]

        fake(node("one", "a", "moved"), node("two", "c"))
        with pytest.raises(RuntimeError, match="2 roots, and 1 faces of the first one are not"):
            whole_shape(tmp_path / "x.step")
        fake(node("one", "a", "b"), node("two", "c"))
        assert len(whole_shape(tmp_path / "x.step")[0]) == 2
        fake(node("one", children=(node("p", "a"), node("q", "moved"))))
        assert whole_shape(tmp_path / "x.step")[0].faces == ["a", "b"]

    def test_a_kernel_without_the_tree_is_refused(
        self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        """It would give the first root alone."""
        occ = SimpleNamespace(OCCGeometry=lambda _: None, Compound=list)
        monkeypatch.setitem(sys.modules, "netgen.occ", occ)  # type: ignore[arg-type]
        with pytest.raises(RuntimeError, match=r"netgen-mesher 6\.2\.2608 or a later"):
            whole_shape(tmp_path / "x.step")
