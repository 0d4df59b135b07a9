"""The CAD kernel's text form, record by record, as Open CASCADE's "BRep Format" describes it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline

from pretravel.base.errors import PretravelError
from pretravel.surface.cad.brep import Brep, ShapeUse, parse_brep
from pretravel.surface.cad.brep_geometry import Tokens, read_curve, read_surface

T = np.linspace(0.05, 0.95, 7)


def _tokens(text: str) -> Tokens:
    return Tokens(text.split())


def _read(text: str, dimensions: int) -> np.ndarray:
    """Points of a curve at `T`; nothing of its record may be left, nor of the next one read."""
    tokens = _tokens(f"{text} next")
    curve = read_curve(tokens, dimensions)
    assert tokens.word() == "next"
    return curve.value(T)


@pytest.mark.parametrize(
    ("text", "dimensions", "expected"),
    [
        ("1 1 2 3 0 0.6 0.8", 3, [1.0 + 0.0 * T, 2.0 + 0.6 * T, 3.0 + 0.8 * T]),
        ("1 1 2 0.6 0.8", 2, [1.0 + 0.6 * T, 2.0 + 0.8 * T]),
        # Centre, normal, x, y, radius; in the plane no normal.
        ("2 1 2 3 0 0 1 1 0 0 0 1 0 5", 3,
         [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T), 3.0 + 0.0 * T]),
        ("2 1 2 1 0 0 1 5", 2, [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T)]),
        ("3 1 2 3 0 0 1 0 1 0 -1 0 0 5 4", 3,
         [1.0 - 4.0 * np.sin(T), 2.0 + 5.0 * np.cos(T), 3.0 + 0.0 * T]),
        # Parabola with the focal length p: t² / 4p along x, t along y.
        ("4 1 2 3 0 0 1 1 0 0 0 1 0 16", 3,
         [1.0 + T**2 / 64.0, 2.0 + T, 3.0 + 0.0 * T]),
        ("5 1 2 3 0 0 1 1 0 0 0 1 0 5 4", 3,
         [1.0 + 5.0 * np.cosh(T), 2.0 + 4.0 * np.sinh(T), 3.0 + 0.0 * T]),
        ("5 1 2 1 0 0 1 5 4", 2, [1.0 + 5.0 * np.cosh(T), 2.0 + 4.0 * np.sinh(T)]),
        # Bézier: rational, degree, poles, each with its weight.
        ("6 0 2 0 1 0 1 -2 0 2 3 0", 3,
         [2.0 * T * (1 - T) + 2.0 * T**2, (1 - T) ** 2 - 4.0 * T * (1 - T) + 3.0 * T**2, 0.0 * T]),
        ("6 1 1 0 1 1 4 3 2", 2,
         [8.0 * T / (1 + T), ((1 - T) + 6.0 * T) / (1 + T)]),
        # B-spline: rational, periodic, degree, number of poles and of knots, poles, knots.
        ("7 0 0 1 3 3 0 1 0 1 -2 0 2 3 0 0 2 0.25 1 1 2", 3,
         [np.interp(T, [0, 0.25, 1], [0, 1, 2]), np.interp(T, [0, 0.25, 1], [1, -2, 3]), 0.0 * T]),
        # Trimmed: a circle between two angles keeps its parameters.
        ("8 0.5 2.5 2 1 2 3 0 0 1 1 0 0 0 1 0 5", 3,
         [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T), 3.0 + 0.0 * T]),
        # Offset: a line along x moved along tangent x direction, y x... (0, 0, 1) sets the side.
        ("9 2 0 0 1 1 1 2 3 1 0 0", 3, [1.0 + T, 0.0 * T, 3.0 + 0.0 * T]),
        ("9 2 1 1 2 1 0", 2, [1.0 + T, 0.0 * T]),
    ],
)  # fmt: skip
def test_curves(text: str, dimensions: int, expected: list[np.ndarray]) -> None:
    assert _read(text, dimensions) == pytest.approx(np.column_stack(expected), abs=1e-12)


def test_a_trimmed_curve_has_the_range_of_its_record() -> None:
    curve = read_curve(_tokens("8 0.5 2.5 2 1 2 3 0 0 1 1 0 0 0 1 0 5"), 3)
    assert curve.range == (0.5, 2.5)
    assert not curve.is_straight
    assert read_curve(_tokens("8 -4 5 1 1 2 3 1 0 0"), 3).is_straight


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("10 0 0", "a curve of unknown kind 10"),
        ("", "ends too early"),
        ("6 0 1 0 0 0 1 inf 0", "a pole of a spline curve is inf"),
        ("6 0 1 0 0 0 1 nan 0", "a pole of a spline curve is nan"),
    ],
)
def test_a_curve_that_is_refused(text: str, words: str) -> None:
    with pytest.raises((PretravelError, ValueError), match=words):
        read_curve(_tokens(text), 3)


def test_a_bounded_surface_is_the_one_within_its_bounds() -> None:
    """A plane, bounded; an offset of it; what follows is not read."""
    plane = "1 1 2 3 0 0 1 1 0 0 0 1 0"
    for text, kind, z in ((f"10 -1 3 -2 4 {plane}", "plane", 3.0),
                          (f"11 -2 {plane}", "offset of plane", 1.0)):  # fmt: skip
        tokens = _tokens(f"{text} next")
        record = read_surface(tokens)
        assert tokens.word() == "next"
        assert record.kind == kind
        assert record.surface is not None
        found = record.surface.derivatives(np.array([[2.0, 5.0]]))[0]
        assert found == pytest.approx(np.array([[3.0, 7.0, z]]))


UV = np.random.default_rng(8).uniform(0.05, 0.95, (9, 2))
RIGHT = "1 2 3  0 0.6 0.8  1 0 0  0 0.8 -0.6"
"""Origin, z, x, y of a right-handed frame: u goes from x to y."""
LEFT = "1 2 3  0 0.6 0.8  1 0 0  0 -0.8 0.6"


def _in_frame(x: np.ndarray, y: np.ndarray, z: np.ndarray, hand: float) -> np.ndarray:
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.8 * hand, -0.6 * hand], [0.0, 0.6, 0.8]])
    return np.asarray([1.0, 2.0, 3.0] + np.column_stack([x, y, z]) @ axes)


@pytest.mark.parametrize(("frame", "hand"), [(RIGHT, 1), (LEFT, -1)])
@pytest.mark.parametrize("kind", [1, 2, 3, 4, 5])
def test_elementary_surfaces(kind: int, frame: str, hand: int) -> None:
    """The equations of the description of the format: sections of surfaces 1 to 5."""
    u, v = UV.T
    around = np.stack([np.cos(u), np.sin(u)])
    name, sizes, (x, y, z) = {
        1: ("plane", "", (u, v, 0.0 * u)),
        2: ("cylinder", "7", (*(7.0 * around), v)),
        3: ("cone", "7 0.3", (*((7.0 + v * math.sin(0.3)) * around), v * math.cos(0.3))),
        4: ("sphere", "7", (*(7.0 * np.cos(v) * around), 7.0 * np.sin(v))),
        5: ("torus", "7 2", (*((7.0 + 2.0 * np.cos(v)) * around), 2.0 * np.sin(v))),
    }[kind]
    tokens = _tokens(f"{kind} {frame} {sizes} next")
    record = read_surface(tokens)
    assert tokens.word() == "next"
    assert record.surface is not None
    assert (record.kind, record.problem) == (name, "")
    point, du, dv = record.surface.derivatives(UV)
    assert point == pytest.approx(_in_frame(x, y, z, hand), abs=1e-12)
    side = np.sum(np.cross(du, dv) * record.surface.local(UV).normal, axis=1)
    assert record.along_parameters == (1 if kind == 1 else hand)
    assert np.all(np.sign(side) == record.along_parameters)


@pytest.mark.parametrize(
    ("text", "kind", "problem"),
    [
        (f"2 {RIGHT} -7", "cylinder", "must be positive"),
        (f"11 4 5 {LEFT} 7 -2", "torus", "must be positive"),
        *(
            (f"8 0 0 1 1 0 0 0 0 1 0 1 {pole} 0 1 1 0", "Bézier",
             f"a pole of a spline surface is {float(pole):g}")
            for pole in ("inf", "nan", "1e9")
        ),
    ],
)  # fmt: skip
def test_a_surface_that_cannot_be_is_a_record_of_the_reason(
    text: str, kind: str, problem: str
) -> None:
    """Its face alone is refused."""
    record = read_surface(_tokens(text))
    assert record.surface is None
    assert (record.kind, record.along_parameters) == (kind, 1)
    assert problem in record.problem


def test_surfaces_of_a_line_that_moves() -> None:
    """Extrusion: curve(u) + v direction. Revolution: curve(v), turned by u about the axis."""
    u, v = UV.T
    line = "1 5 0 1 0 0.6 0.8"  # from (5, 0, 1) along (0, 0.6, 0.8)
    tokens = _tokens(f"6 1 2 -3 {line} 7 1 2 3 0 0 1 {line} next")
    extrusion, revolution = read_surface(tokens), read_surface(tokens)
    assert tokens.word() == "next"
    assert (extrusion.kind, extrusion.along_parameters) == ("extrusion", 1)
    assert (revolution.kind, revolution.along_parameters) == ("revolution", 1)
    assert extrusion.surface is not None
    assert revolution.surface is not None
    expected = np.column_stack([5.0 + v, 0.6 * u + 2.0 * v, 1.0 + 0.8 * u - 3.0 * v])
    assert extrusion.surface.derivatives(UV)[0] == pytest.approx(expected, abs=1e-12)
    x, y, c, s = 4.0, 0.6 * v - 2.0, np.cos(u), np.sin(u)
    expected = np.column_stack([1.0 + c * x - s * y, 2.0 + s * x + c * y, 1.0 + 0.8 * v])
    assert revolution.surface.derivatives(UV)[0] == pytest.approx(expected, abs=1e-12)


def _bernstein(degree: int, t: np.ndarray) -> np.ndarray:
    """(degree + 1, n)."""
    return np.stack(
        [math.comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)]
    )


def _pole_words(poles: np.ndarray, weights: np.ndarray | None) -> str:
    rows = poles.reshape(-1, 3)
    if weights is not None:
        rows = np.column_stack([rows, weights.ravel()])
    return " ".join(f"{x:.17g}" for x in rows.ravel())


@pytest.mark.parametrize("rational", ["0 0", "1 0", "0 1"])
def test_bezier_surfaces(rational: str) -> None:
    """Sums of poles and products of Bernstein's polynomials, of degree 3 along u and 1 along v;
    each pole with its weight where the surface is rational along any parameter."""
    rng = np.random.default_rng(1)
    poles = rng.uniform(-5.0, 5.0, (4, 2, 3))
    weights = rng.uniform(0.5, 2.0, (4, 2)) if "1" in rational else None
    tokens = _tokens(f"8 {rational} 3 1 {_pole_words(poles, weights)} next")
    record = read_surface(tokens)
    assert tokens.word() == "next"
    assert (record.kind, record.along_parameters) == ("Bézier", 1)
    assert record.surface is not None
    domain = record.surface.domain
    assert (domain.lower, domain.upper) == ((0.0, 0.0), (1.0, 1.0))
    assert domain.period == (math.inf, math.inf)
    share = np.einsum("in,jn->nij", _bernstein(3, UV[:, 0]), _bernstein(1, UV[:, 1]))
    share = share * (1.0 if weights is None else weights)
    expected = np.einsum("nij,ijk->nk", share, poles) / share.sum(axis=(1, 2))[:, None]
    assert record.surface.derivatives(UV)[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("periodic", [0, 1])
def test_spline_surfaces(periodic: int) -> None:
    """Products of scipy's basis functions: along u of degree 2 with knots 1, 2.5, 4; along v of
    degree 3, with six poles; where it is periodic the knots 2 to 8 are simple, and the basis
    functions those between five neighbours of all whole numbers."""
    rng = np.random.default_rng(2)
    poles, weights = rng.uniform(-5.0, 5.0, (4, 6, 3)), rng.uniform(0.5, 2.0, (4, 6))
    ends = "2 1 3 1 4 1 5 1 6 1 7 1 8 1" if periodic else "2 4 4 1 5 1 8 4"
    tokens = _tokens(
        f"9 1 0 0 {periodic} 2 3 4 6 3 {7 if periodic else 4} {_pole_words(poles, weights)} "
        f"1 3 2.5 1 4 3 {ends} next"
    )
    record = read_surface(tokens)
    assert tokens.word() == "next"
    assert (record.kind, record.along_parameters) == ("B-spline", 1)
    assert record.surface is not None
    domain = record.surface.domain
    assert (domain.lower, domain.upper) == ((1.0, 2.0), (4.0, 8.0))
    assert domain.period == (math.inf, 6.0 if periodic else math.inf)
    uv = np.array([1.0, 2.0]) + UV * [3.0, 6.0]
    along_u = BSpline.design_matrix(uv[:, 0], [1, 1, 1, 2.5, 4, 4, 4], 2).toarray()
    if periodic:
        every = BSpline.design_matrix(uv[:, 1], np.arange(-1.0, 12.0), 3).toarray()
        along_v = every[:, :6].copy()
        along_v[:, : every.shape[1] - 6] += every[:, 6:]
    else:
        along_v = BSpline.design_matrix(uv[:, 1], [2, 2, 2, 2, 4, 5, 8, 8, 8, 8], 3).toarray()
    share = np.einsum("ni,nj->nij", along_u, along_v) * weights
    expected = np.einsum("nij,ijk->nk", share, poles) / share.sum(axis=(1, 2))[:, None]
    assert record.surface.derivatives(uv)[0] == pytest.approx(expected, abs=1e-12)


TEXT = f"""DBRep_DrawableShape

CASCADE Topology V1, (c) Matra-Datavision
Locations 4
1
 1 0 0 10
 0 1 0 20
 0 0 1 30
2 1 2 0
1
 0 -1 0 0
 1 0 0 0
 0 0 1 0
2 3 -1 1 2 0
Curve2ds 2
1 0 0 1 0
1 1 2 0.6 0.8
Curves 1
1 1 2 3 0 0.6 0.8
Polygon3D 0
PolygonOnTriangulations 0
Surfaces 2
1 {RIGHT}
2 {RIGHT} 7
Triangulations 0

TShapes 7
Ve
1e-07
1 2 3
0 0

0101101
*
Ve
1e-07
4 5 6
0.25 2 1 0
0.75 3 1 2 1
0 0

0101101
*
Ed
 1e-07 1 1 0
1  1 2 0 3
2  2 1 0 0.5 2.5
3 1 2C0 2 0 0.2 0.8
4 1 2 3 4 5
5 1 2
6 1 2 3
7 1 2 3 4
0

0101000
+7 0 -6 1 *
Wi

0101100
+5 2 i5 0 *
Fa
0  1e-07 2 1

0111000
-4 0 *
Fa
0  1e-07 1 4
2  1
0101000
*
Sh

0101100
+3 2 e2 0 *

+1 1 -2 0
"""


def _uses(uses: list[ShapeUse]) -> list[tuple[int, bool, bool, float]]:
    """Number, reversal, whether it bounds, and how far its placement moves along x."""
    for use in uses:
        assert use.placement.shape == (4, 4)
        shift = use.placement[:, 3] - [0.0, 0.0, 0.0, 1.0]
        assert np.array_equal(use.placement[:, :3], np.eye(4)[:, :3])
        assert np.array_equal(shift, shift[0] * np.array([1.0, 2.0, 3.0, 0.0]))
    return [(u.index, u.reverses, u.bounds, float(u.placement[0, 3])) for u in uses]


def test_a_whole_text() -> None:
    """Two faces of a shell. Shapes are counted from the end: the shell, the last, is number 1.
    The second placement moves twice as far as the first, which is by (10, 20, 30); the fourth is
    a quarter turn back and then this way (TopTools_LocationSet: L = L1.Powered(p) * L). Of forms
    1 to 7 of an edge: a curve, a curve on a surface, a seam, and four that are skipped."""
    brep: Brep = parse_brep(TEXT)
    assert [len(curve.value(np.zeros(1))[0]) for curve in brep.plane_curves] == [2, 2]
    assert [len(curve.value(np.zeros(1))[0]) for curve in brep.space_curves] == [3]
    assert [record.kind for record in brep.surfaces] == ["plane", "cylinder"]
    assert _uses(brep.roots) == [(1, False, True, 10.0), (2, True, True, 0.0)]
    kinds = {number: shape.kind for number, shape in brep.shapes.items()}
    assert kinds == {1: "Sh", 2: "Fa", 3: "Fa", 4: "Wi", 5: "Ed", 6: "Ve", 7: "Ve"}
    assert {number: _uses(shape.parts) for number, shape in brep.shapes.items()} == {
        1: [(3, False, True, 20.0), (2, False, False, 0.0)],
        2: [],
        3: [(4, True, True, 0.0)],
        4: [(5, False, True, 20.0), (5, False, False, 0.0)],
        5: [(7, False, True, 0.0), (6, True, True, 10.0)],
        6: [],
        7: [],
    }
    # The surface and its placement of each face; other shapes have none.
    assert [brep.shapes[i].surface for i in range(1, 8)] == [0, 1, 2, 0, 0, 0, 0]
    shift = brep.shapes[3].placement
    assert _uses([ShapeUse(3, False, shift)]) == [(3, False, True, 10.0)]
    turn = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    assert brep.shapes[2].placement == pytest.approx(shift @ shift @ np.linalg.inv(turn))
    assert np.array_equal(brep.shapes[1].placement, np.eye(4))
    edge = brep.shapes[5]
    assert edge.curve is not None
    assert (edge.curve[0], *edge.curve[2:]) == (1, 0.0, 3.0)
    assert np.array_equal(edge.curve[1], shift @ shift)
    assert edge.parameter_curves == [(1, 2, 0, 0.5, 2.5), (2, 1, 2, 0.2, 0.8)]


@pytest.mark.parametrize(
    ("part", "spoilt", "words"),
    [
        ("Curve2ds ", "Curve2d ", "has 'Curve2d' where 'Curve2ds' belongs"),
        ("Curves ", "Curve ", "has 'Curve' where 'Curves' belongs"),
        ("Locations ", "Others ", "ends too early"),
        ("Surfaces ", "Others ", "ends too early"),
        ("TShapes ", "Others ", "ends too early"),
        ("\nSh\n", "\nXx\n", "unknown shape 'Xx'"),
        ("5 1 2\n", "9 0\n", "edge of unknown form 9"),
        ("2C0", "C0", "a seam of unknown form"),
        (f"1 {RIGHT}", "12 0 0", "a surface of unknown kind 12"),
    ],
)  # fmt: skip
def test_a_text_that_is_not_of_this_form_is_refused(part: str, spoilt: str, words: str) -> None:
    with pytest.raises((PretravelError, ValueError), match=words):
        parse_brep(TEXT.replace(part, spoilt, 1))
