"""OpenCASCADE's text form of solids, read into surfaces, curves and the tree of shapes.

The CAD kernel reads STEP and puts it right; its text form then tells exactly what
the kernel holds, down to poles and knots, which its Python members do not.

Format: OpenCASCADE documentation, "BRep format", versions 1 to 3.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.surface.curves import (
    Conic,
    Curve,
    Line,
    OffsetCurve,
    SplineCurve,
    TrimmedCurve,
    flat_knots,
)
from pretravel.surface.local_geometry import Surface
from pretravel.surface.shapes import Cone, Cylinder, Plane, Sphere, Torus
from pretravel.surface.spline import SplineSurface
from pretravel.surface.swept import Extrusion, Offset, Revolution

_IDENTITY = np.eye(4)
_PLANE = 1
_SEAM = re.compile(r"^(\d+)(C\d|CN|G\d)$")


@dataclass(frozen=True, eq=False)
class SurfaceRecord:
    """A surface, or why there is none.

    Attributes
    ----------
    kind : str
        In words.
    surface : Surface or None
    along_parameters : int
        +1 where its own normal is du x dv, -1 where it is against that.
    problem : str
    """

    kind: str
    surface: Surface | None
    along_parameters: int = 1
    problem: str = ""


@dataclass(frozen=True, eq=False)
class ShapeUse:
    """A shape as part of another: which, turned round or not, placed where.

    Seams within a face (orientation internal or external) bound nothing: `bounds` is False.
    """

    index: int
    reverses: bool
    placement: FloatArray
    bounds: bool = True


@dataclass(eq=False)
class ShapeRecord:
    """One entry of the tree: Ve, Ed, Wi, Fa, Sh, So, CS or Co.

    Edges have curves in the parameters of surfaces: (surface, placement) ->
    (curve, curve of the other side of a seam or None, first, last); and a curve in space.
    """

    kind: str
    parts: list[ShapeUse] = field(default_factory=list)
    surface: int = 0
    placement: FloatArray = field(default_factory=lambda: _IDENTITY)
    parameter_curves: list[tuple[int, int, int, float, float]] = field(default_factory=list)
    curve: tuple[int, FloatArray, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Brep:
    """Everything in a file."""

    plane_curves: list[Curve]
    space_curves: list[Curve]
    surfaces: list[SurfaceRecord]
    shapes: dict[int, ShapeRecord]
    roots: list[ShapeUse]


class _Tokens:
    """The words of the file, one after the other."""

    def __init__(self, words: list[str]) -> None:
        self._words = words
        self.position = 0

    def word(self) -> str:
        try:
            word = self._words[self.position]
        except IndexError:
            raise PretravelError(
                "the CAD kernel's description of the part ends too early"
            ) from None
        self.position += 1
        return word

    def peek(self) -> str:
        return self._words[self.position] if self.position < len(self._words) else ""

    def integer(self) -> int:
        return int(self.word())

    def number(self) -> float:
        return float(self.word())

    def flag(self) -> bool:
        return self.word() == "1"

    def numbers(self, count: int) -> FloatArray:
        start = self.position
        self.position += count
        return np.array(self._words[start : self.position], dtype=np.float64)

    def skip_to(self, word: str) -> None:
        while self.word() != word:
            pass


def parse_brep(text: str) -> Brep:
    """Read the text form.

    Parameters
    ----------
    text : str

    Returns
    -------
    Brep

    Raises
    ------
    PretravelError
        Text that is not of this form.
    """
    tokens = _Tokens(text.split())
    tokens.skip_to("Locations")
    placements = list(_placements(tokens))
    _expect(tokens, "Curve2ds")
    plane_curves = [_curve(tokens, 2) for _ in range(tokens.integer())]
    _expect(tokens, "Curves")
    space_curves = [_curve(tokens, 3) for _ in range(tokens.integer())]
    tokens.skip_to("Surfaces")
    surfaces = [_surface(tokens) for _ in range(tokens.integer())]
    tokens.skip_to("TShapes")
    count = tokens.integer()
    # Shapes refer to one another by their number from the end.
    shapes = {count - i: _shape(tokens, placements) for i in range(count)}
    roots = list(_uses(tokens, placements, end=""))
    return Brep(plane_curves, space_curves, surfaces, shapes, roots)


def _expect(tokens: _Tokens, word: str) -> None:
    came = tokens.word()
    if came != word:
        raise PretravelError(f"the CAD kernel's description has '{came}' where '{word}' belongs")


def _placements(tokens: _Tokens) -> Iterator[FloatArray]:
    known: list[FloatArray] = []
    for _ in range(tokens.integer()):
        if tokens.integer() == 1:
            placement = np.eye(4)
            placement[:3] = tokens.numbers(12).reshape(3, 4)
        else:
            placement = np.eye(4)
            while (index := tokens.integer()) != 0:
                power = tokens.integer()
                placement = placement @ np.linalg.matrix_power(known[index - 1], power)
        known.append(placement)
        yield placement


def _placement(placements: list[FloatArray], index: int) -> FloatArray:
    return _IDENTITY if index == 0 else placements[index - 1]


def _curve(tokens: _Tokens, dimensions: int) -> Curve:
    kind = tokens.integer()
    d = dimensions

    def vector() -> FloatArray:
        return tokens.numbers(d)

    if kind == 1:
        return Line(vector(), vector())
    if kind in (2, 3, 4, 5):
        center = vector()
        if d == 3:
            vector()  # the conic's normal follows from its axes
        x_axis, y_axis = vector(), vector()
        a = tokens.number()
        if kind == 2:
            return Conic("ellipse", center, x_axis, y_axis, a, a)
        if kind == 4:
            return Conic("parabola", center, x_axis, y_axis, a)
        name = "ellipse" if kind == 3 else "hyperbola"
        return Conic(name, center, x_axis, y_axis, a, tokens.number())
    if kind == 6:
        rational, degree = tokens.flag(), tokens.integer()
        poles, weights = _poles(tokens, degree + 1, d, rational)
        return SplineCurve(np.repeat([0.0, 1.0], degree + 1), poles, weights, degree)
    if kind == 7:
        rational, periodic = tokens.flag(), tokens.flag()
        degree, pole_count, knot_count = (tokens.integer() for _ in range(3))
        poles, weights = _poles(tokens, pole_count, d, rational)
        knots = _knots(tokens, knot_count, degree, periodic)
        wrapped = np.arange(len(knots) - degree - 1) % pole_count
        return SplineCurve(knots, poles[wrapped], weights[wrapped], degree, wraps=periodic)
    if kind == 8:
        first, last = tokens.number(), tokens.number()
        return TrimmedCurve(_curve(tokens, d), first, last)
    if kind == 9:
        distance = tokens.number()
        across = vector() if d == 3 else None
        return OffsetCurve(_curve(tokens, d), distance, across)
    raise PretravelError(f"the CAD kernel's description has a curve of unknown kind {kind}")


def _poles(
    tokens: _Tokens, count: int, dimensions: int, rational: bool
) -> tuple[FloatArray, FloatArray]:
    width = dimensions + rational
    values = tokens.numbers(count * width).reshape(count, width)
    return values[:, :dimensions], values[:, -1] if rational else np.ones(count)


def _knots(tokens: _Tokens, count: int, degree: int, periodic: bool) -> FloatArray:
    pairs = tokens.numbers(2 * count).reshape(count, 2)
    return flat_knots(pairs[:, 0], pairs[:, 1].astype(np.int64), degree, periodic)


def _surface(tokens: _Tokens) -> SurfaceRecord:
    kind = tokens.integer()
    if kind in _ELEMENTARY:
        name, make, extra = _ELEMENTARY[kind]
        origin, z, x, y = (tokens.numbers(3) for _ in range(4))
        sizes = tokens.numbers(extra)
        # A left-handed frame turns du x dv inwards; a plane's normal is du x dv itself.
        handed = 1 if kind == _PLANE or float(np.cross(x, y) @ z) > 0.0 else -1
        return _made(name, lambda: make(origin, np.stack([x, y, z]), *sizes), handed)
    if kind == 6:
        direction = tokens.numbers(3)
        curve = _curve(tokens, 3)
        return SurfaceRecord("extrusion", Extrusion(curve, direction))
    if kind == 7:
        origin, axis = tokens.numbers(3), tokens.numbers(3)
        curve = _curve(tokens, 3)
        return SurfaceRecord("revolution", Revolution(curve, origin, axis))
    if kind in (8, 9):
        return _spline_surface(tokens, bezier=kind == 8)
    if kind == 10:
        tokens.numbers(4)  # the face's own edges trim it
        return _surface(tokens)
    if kind == 11:
        distance = tokens.number()
        base = _surface(tokens)
        if base.surface is None:
            return base
        # The file's distance goes along du x dv, ours along the base's own normal.
        return SurfaceRecord(
            f"offset of {base.kind}",
            Offset(base.surface, distance * base.along_parameters),
            base.along_parameters,
        )
    raise PretravelError(f"the CAD kernel's description has a surface of unknown kind {kind}")


def _made(kind: str, make: Callable[[], Surface], along_parameters: int = 1) -> SurfaceRecord:
    """The surface, or why it cannot be: one bad face must not keep the others from being read."""
    try:
        return SurfaceRecord(kind, make(), along_parameters)
    except (PretravelError, ValueError) as error:
        return SurfaceRecord(kind, None, problem=str(error))


def _plane(origin: FloatArray, axes: FloatArray) -> Surface:
    # u along x, v along y, so that the normal is x × y whatever z says.
    return Plane(origin, np.cross(axes[0], axes[1]), axes[0])


def _cone(origin: FloatArray, axes: FloatArray, radius: float, half_angle: float) -> Surface:
    return Cone(origin, float(radius), float(half_angle), axes)


_ELEMENTARY: dict[int, tuple[str, Callable[..., Surface], int]] = {
    _PLANE: ("plane", _plane, 0),
    2: ("cylinder", lambda o, axes, r: Cylinder(o, float(r), axes), 1),
    3: ("cone", _cone, 2),
    4: ("sphere", lambda o, axes, r: Sphere(o, float(r), axes, latitude=True), 1),
    5: ("torus", lambda o, axes, big, small: Torus(o, float(big), float(small), axes), 2),
}


def _spline_surface(tokens: _Tokens, *, bezier: bool) -> SurfaceRecord:
    rational = [tokens.flag(), tokens.flag()]
    periodic = [False, False] if bezier else [tokens.flag(), tokens.flag()]
    degrees = [tokens.integer(), tokens.integer()]
    if bezier:
        counts = [degrees[0] + 1, degrees[1] + 1]
        knot_counts = [2, 2]
    else:
        counts = [tokens.integer(), tokens.integer()]
        knot_counts = [tokens.integer(), tokens.integer()]
    poles, weights = _poles(tokens, counts[0] * counts[1], 3, any(rational))
    poles, weights = poles.reshape(*counts, 3), weights.reshape(counts)
    knots, periods = [], []
    for axis in (0, 1):
        if bezier:
            sequence = np.repeat([0.0, 1.0], degrees[axis] + 1)
        else:
            sequence = _knots(tokens, knot_counts[axis], degrees[axis], periodic[axis])
        wrapped = np.arange(len(sequence) - degrees[axis] - 1) % counts[axis]
        poles, weights = np.take(poles, wrapped, axis), np.take(weights, wrapped, axis)
        knots.append(sequence)
        degree = degrees[axis]
        length = float(sequence[-degree - 1] - sequence[degree])
        periods.append(length if periodic[axis] else math.inf)
    return _made(
        "Bézier" if bezier else "B-spline",
        lambda: SplineSurface(
            knots[0], knots[1], poles, weights, (degrees[0], degrees[1]), (periods[0], periods[1])
        ),
    )


def _shape(tokens: _Tokens, placements: list[FloatArray]) -> ShapeRecord:
    kind = tokens.word()
    shape = ShapeRecord(kind)
    if kind == "Ve":
        tokens.numbers(4)
        while tokens.peek() != "*" and len(tokens.peek()) != 7:
            tokens.word()  # other forms of the point; the flags that end them have 7 digits
    elif kind == "Ed":
        _edge(tokens, shape, placements)
    elif kind == "Fa":
        tokens.word(), tokens.word()
        shape.surface = tokens.integer()
        shape.placement = _placement(placements, tokens.integer())
        if tokens.peek() == "2":
            tokens.word(), tokens.word()
    elif kind not in ("Wi", "Sh", "So", "CS", "Co"):
        raise PretravelError(f"the CAD kernel's description has an unknown shape '{kind}'")
    tokens.word()  # flags
    shape.parts = list(_uses(tokens, placements, end="*"))
    return shape


def _edge(tokens: _Tokens, shape: ShapeRecord, placements: list[FloatArray]) -> None:
    tokens.numbers(4)
    while (form := tokens.integer()) != 0:
        if form == 1:
            index, placement = tokens.integer(), tokens.integer()
            first, last = tokens.number(), tokens.number()
            shape.curve = (index, _placement(placements, placement), first, last)
        elif form == 2:
            curve, surface, _ = tokens.integer(), tokens.integer(), tokens.integer()
            first, last = tokens.number(), tokens.number()
            shape.parameter_curves.append((surface, curve, 0, first, last))
        elif form == 3:
            curve = tokens.integer()
            # The second curve's number and the seam's continuity stand without a space.
            glued = _SEAM.match(tokens.word())
            if glued is None:
                raise PretravelError("the CAD kernel's description has a seam that is not one")
            surface, _ = tokens.integer(), tokens.integer()
            first, last = tokens.number(), tokens.number()
            shape.parameter_curves.append((surface, curve, int(glued.group(1)), first, last))
        elif form == 4:
            for _ in range(5):
                tokens.word()
        elif form == 5:
            tokens.word(), tokens.word()
        elif form == 6:
            for _ in range(3):
                tokens.word()
        elif form == 7:
            for _ in range(4):
                tokens.word()
        else:
            raise PretravelError(f"the CAD kernel's description has an edge of unknown form {form}")


def _uses(tokens: _Tokens, placements: list[FloatArray], end: str) -> Iterator[ShapeUse]:
    while (word := tokens.peek()) != end:
        tokens.word()
        placement = _placement(placements, tokens.integer())
        yield ShapeUse(int(word[1:]), word[0] == "-", placement, word[0] in "+-")
    if end:
        tokens.word()
