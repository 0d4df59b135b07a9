"""Global sections of IGES files, and bodies from loose faces, without the CAD kernel."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.surface.cad.iges_bodies import (
    SEWING,
    _edge_numbers,
    _in_order,
    _is_closed,
    _place,
    _shells,
    joined,
)
from pretravel.surface.cad.iges_header import _parameters, check_iges_header


def _lines(text: str, letter: str = "G") -> list[bytes]:
    rows = [text[i : i + 72] for i in range(0, len(text), 72)]
    return [f"{row:<72}{letter}{i:>7}".encode() for i, row in enumerate(rows, start=1)]


def _section(flag: str, before: int = 11) -> str:
    return f",,{'7,' * before}{flag},2HMM;"


@pytest.mark.parametrize("flag", ["1", "2", "9", "10", "11", "", " 6 ", "000000011"])
def test_units_from_1_to_11_or_none_are_known(flag: str) -> None:
    """The flag is parameter 14; other sections are not read."""
    check_iges_header(_lines("not a section 99H", "S") + _lines(_section(flag)))


@pytest.mark.parametrize("flag", ["0", "12", "-1", "x", "2.", "0000000011"])
def test_other_units_are_refused(flag: str) -> None:
    with pytest.raises(PretravelError, match=rf"\(parameter 14 .* is '{flag}'; .*from 1 to 11"):
        check_iges_header(_lines(_section(flag)))


def test_the_unit_is_the_fourteenth_parameter() -> None:
    """The thirteenth and the fifteenth can be any; a section can end before."""
    check_iges_header(_lines(",," + "7," * 10 + "99,2,99;"))
    check_iges_header(_lines(",," + "7," * 10 + "99;"))
    with pytest.raises(PretravelError, match="is '99'"):
        check_iges_header(_lines(",," + "7," * 11 + "99;"))


def test_a_short_line_is_filled_with_blanks() -> None:
    """Of a string over two lines, the first of which ends early: blanks belong to it."""
    first, second = b",,70Hab", b"c" + b",7" * 10 + b",2;"
    # 72 columns less the 5 before the string, and 3 of the second line.
    check_iges_header([first.ljust(72) + b"G      1", b"ccc" + second[1:].ljust(69) + b"G      2"])


@pytest.mark.parametrize("delimiters", [(",", ";"), ("/", "&"), (":", ";"), (";", "!")])
def test_parameters_are_told_apart_by_their_delimiters(delimiters: tuple[str, str]) -> None:
    """The first two state them where they are not comma and semicolon. Strings contain both and
    blanks; a string of one character further on states nothing."""
    mark, end = delimiters
    first = f"1H{mark}" if mark != "," else ""
    second = f"1H{end}" if end != ";" else ""
    inner = f"a{mark}b{end} c"
    values = [f"{len(inner)}H{inner}", "1HX", "", "3.5D0", f"2H{end}{mark}", f"12h{'z':>12}", "1Hy"]
    text = f" {first}{mark}{second} {mark}" + mark.join(f"  {v} " for v in values) + end + "rest,1;"
    expected = [first, second, *values]
    assert [value.decode() for value in _parameters(text.encode())] == expected


def test_the_first_two_strings_state_delimiters_only_if_they_have_one_character() -> None:
    assert _parameters(b"2H//,2H&&,5;") == [b"2H//", b"2H&&", b"5"]


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("1H,,1H;,4Habc,5;", 3), ("1H,,1H;,2Habc,5;", 3), (",,7", 3), ("", 1),
        (",,5,9999999999Habc;", 4), (",,5,999999999Habc;", 4),
    ],
)  # fmt: skip
def test_a_string_of_another_length_or_no_end_is_refused(text: str, number: int) -> None:
    with pytest.raises(PretravelError, match=f"parameter {number} of its global section"):
        _parameters(text.encode())


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


def test_the_place_of_an_edge_is_its_centre_its_ends_and_its_length() -> None:
    arc = _Edge(SimpleNamespace(x=1.0, y=2.0, z=3.0), (4.0, 6.0, 9.0), (8.0, 7.0, 1.0), 11.0)
    assert _place(arc).tolist() == [1.0, 2.0, 3.0, 6.0, 6.5, 5.0, 11.0]


def test_edges_at_one_place_have_one_number() -> None:
    """Up to 20 µm, in all seven numbers together; edges up to 10 µm long do not count."""
    straight = ((0.0, 0.0, 0.0), (3.0, 4.0, 0.0))
    moved = 2.0 * SEWING / np.sqrt(2.0)  # centre and middle of the ends move together
    near, far = (np.array(straight) + h * moved * np.eye(3)[2] for h in (0.99, -1.01))
    bowed = _edge(*straight, 5.3)
    short = _edge((9.0, 0.0, 0.0), (9.0, 0.0, 0.99 * SEWING))
    long = _edge((9.0, 0.0, 0.0), (9.0, 0.0, 1.01 * SEWING))
    faces = [
        _Face([_edge(*straight), bowed]),
        _Face(),
        _Face([_edge(near[0], near[1]), short]),
        _Face([_edge(far[0], far[1]), long, _edge(*straight[::-1])]),
    ]
    numbers = _edge_numbers(faces)
    assert [len(own) for own in numbers] == [2, 0, 1, 3]
    one = numbers[0][0]
    assert numbers[2] == [one]
    assert numbers[3][2] == one
    assert len({one, numbers[0][1], *numbers[3]}) == 4
    assert _edge_numbers([_Face(), _Face([short])]) == [[], []]


def test_faces_are_grouped_where_every_edge_has_two() -> None:
    """Two cubes that touch, a tube with its seam twice between two lids, a ball without edges
    between, and two faces that are left."""
    first, second = _cube((0, 0, 0), (2, 3, 4)), _cube((2, 0, 0), (2, 3, 4))
    circles = [_edge((9.0, 0.0, z), (9.0, 0.0, z), 6.3) for z in (0.0, 5.0)]
    seam = _edge((9.0, 0.0, 0.0), (9.0, 0.0, 5.0))
    tube = [_Face([circles[0]]), _Face([circles[0], seam, circles[1], seam]), _Face([circles[1]])]
    ball, left = _Face(), _cube((50, 0, 0), (1, 1, 1))[:2]
    groups = _in_order([*first, ball, *second, *tube, *left])
    assert groups == [first, [ball, *second], tube, left]
    assert _in_order([]) == []
    assert _in_order([ball]) == [[ball]]


def test_a_shell_is_closed_where_every_edge_is_used_twice() -> None:
    one, two, three = (_edge((0, 0, 0), (i, 0, 0)) for i in (1, 2, 3))
    short = _edge((0, 0, 0), (0, 0, SEWING))

    def closed(*faces: list[_Edge]) -> bool:
        return _is_closed(SimpleNamespace(faces=[_Face(list(edges)) for edges in faces]))

    assert closed([one, two, three], [three, one, two])
    assert closed([one, two, two], [one])
    assert closed([one, two, short], [one, two])
    assert not closed([one, two, three], [one, two])
    assert not closed([one, two], [one, two], [one])
    assert not closed([one, one])  # a face alone


@dataclass(frozen=True, eq=False)
class _Shell:
    faces: list[_Face]
    volume: float = 1.0


@dataclass(frozen=True, eq=False)
class _Solid:
    shell: _Shell
    mass: float = 0.0
    reversed: bool = False

    @property
    def faces(self) -> list[_Face]:
        return self.shell.faces

    def Reversed(self) -> _Solid:
        return _Solid(self.shell, -self.mass, not self.reversed)


def _lids(at: float) -> list[_Face]:
    """Two faces with one closed edge each: together they enclose something."""
    edge = _edge((at, 0.0, 0.0), (at, 0.0, 0.0), 6.3)
    return [_Face([edge]), _Face([edge])]


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A kernel that sews all faces with edges to one shell, of the noted volume."""
    notes: dict[str, Any] = {"volume": 1.0, "gaps": []}

    def sew(faces: list[_Face], gap: float) -> Any:
        notes["gaps"].append(gap)
        edged = [face for face in faces if face.edges]
        return SimpleNamespace(shells=[_Shell(edged, notes["volume"])] if edged else [],
                               faces=faces)  # fmt: skip

    fake = SimpleNamespace(Compound=list, Solid=lambda shell: _Solid(shell, shell.volume), Sew=sew)
    monkeypatch.setitem(sys.modules, "netgen.occ", fake)
    return notes


@pytest.mark.parametrize(("volume", "turned"), [(2.0, False), (-2.0, True), (0.0, True)])
def test_closed_shells_are_bodies_with_their_material_inside(
    kernel: dict[str, Any], volume: float, turned: bool
) -> None:
    """Faces of the file's own solids are not joined again; groups that are open stay shells."""
    kernel["volume"] = volume
    own, first, second, rest = _lids(0.0), _lids(5.0), _lids(9.0), _cube((30, 0, 0), (1, 1, 1))[:3]
    solid = _Solid(_Shell(own), 3.0)
    shape = SimpleNamespace(solids=[solid], faces=[*first, *own, *second, *rest])
    bodies, closed, unclosed = joined(shape)
    assert (closed, unclosed) == (3, 1)
    assert bodies[0] is solid
    assert [body.faces for body in bodies[1:]] == [first, second, rest]
    assert [body.reversed for body in bodies[1:3]] == [turned, turned]
    assert isinstance(bodies[3], _Shell)
    assert kernel["gaps"] == [SEWING] * 3


def test_faces_that_are_joined_to_none_are_kept(kernel: dict[str, Any]) -> None:
    """A face alone is not sewn; of several, those in no shell stay. A shape without faces is
    returned as it is."""
    ball, lids = _Face(), _lids(3.0)
    assert _shells([ball]) == [ball]
    assert kernel["gaps"] == []
    shell, alone = _shells([ball, *lids])
    assert shell.faces == lids
    assert alone is ball
    empty = SimpleNamespace(solids=[], faces=[])
    assert joined(empty) == (empty, 0, 0)
