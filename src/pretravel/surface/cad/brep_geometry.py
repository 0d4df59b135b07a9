"""Curves and surfaces in OpenCASCADE's text form of solids."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError
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
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cone, Cylinder, Torus
from pretravel.surface.spline import SplineSurface
from pretravel.surface.swept import Extrusion, Offset, Revolution

_PLANE = 1


@dataclass(frozen=True, eq=False)
class SurfaceRecord:
    """A surface, or why there is none.

    Attributes
    ----------
    kind : str
        In words.
    surface : Surface or None
    along_parameters : int
        +1 where its own normal is along du x dv, -1 where it is opposite.
    problem : str
        Why there is no surface.
    """

    kind: str
    surface: Surface | None
    along_parameters: int = 1
    problem: str = ""


class Tokens:
    """The words of the text form, read one after the other.

    Parameters
    ----------
    words : list of str

    Raises
    ------
    PretravelError
        From every method, where the text ends too early.
    """

    def __init__(self, words: list[str]) -> None:
        self._words = words
        self.position = 0

    def word(self) -> str:
        """The next word."""
        try:
            word = self._words[self.position]
        except IndexError:
            raise PretravelError(
                "the CAD kernel's description of the part ends too early"
            ) from None
        self.position += 1
        return word

    def peek(self) -> str:
        """The next word, which stays the next; empty at the end."""
        return self._words[self.position] if self.position < len(self._words) else ""

    def integer(self) -> int:
        """The next word as an integer."""
        return int(self.word())

    def number(self) -> float:
        """The next word as a number."""
        return float(self.word())

    def flag(self) -> bool:
        """Whether the next word is 1."""
        return self.word() == "1"

    def numbers(self, count: int) -> FloatArray:
        """The next words as numbers, (count,)."""
        start = self.position
        self.position += count
        return np.array(self._words[start : self.position], dtype=np.float64)

    def skip_to(self, word: str) -> None:
        """Continue after the given word."""
        while self.word() != word:
            pass


def read_curve(tokens: Tokens, dimensions: int) -> Curve:
    """The curve at which the tokens stand.

    Parameters
    ----------
    tokens : Tokens
    dimensions : int
        2 for a curve in the parameters of a surface, 3 for one in space.

    Raises
    ------
    PretravelError
        A curve of unknown kind.
    """
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
        return TrimmedCurve(read_curve(tokens, d), first, last)
    if kind == 9:
        distance = tokens.number()
        across = vector() if d == 3 else None
        return OffsetCurve(read_curve(tokens, d), distance, across)
    raise PretravelError(f"the CAD kernel's description has a curve of unknown kind {kind}")


def _poles(
    tokens: Tokens, count: int, dimensions: int, rational: bool
) -> tuple[FloatArray, FloatArray]:
    width = dimensions + rational
    values = tokens.numbers(count * width).reshape(count, width)
    return values[:, :dimensions], values[:, -1] if rational else np.ones(count)


def _knots(tokens: Tokens, count: int, degree: int, periodic: bool) -> FloatArray:
    pairs = tokens.numbers(2 * count).reshape(count, 2)
    return flat_knots(pairs[:, 0], pairs[:, 1].astype(np.int64), degree, periodic)


def read_surface(tokens: Tokens) -> SurfaceRecord:
    """The surface at which the tokens stand.

    Raises
    ------
    PretravelError
        A surface of unknown kind.
    """
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
        curve = read_curve(tokens, 3)
        return SurfaceRecord("extrusion", Extrusion(curve, direction))
    if kind == 7:
        origin, axis = tokens.numbers(3), tokens.numbers(3)
        curve = read_curve(tokens, 3)
        return SurfaceRecord("revolution", Revolution(curve, origin, axis))
    if kind in (8, 9):
        return _spline_surface(tokens, bezier=kind == 8)
    if kind == 10:
        tokens.numbers(4)  # bounds of the parameters; the face has edges of its own
        return read_surface(tokens)
    if kind == 11:
        distance = tokens.number()
        base = read_surface(tokens)
        if base.surface is None:
            return base
        # The distance in the file is along du x dv, that of Offset along the base's own normal.
        return SurfaceRecord(
            f"offset of {base.kind}",
            Offset(base.surface, distance * base.along_parameters),
            base.along_parameters,
        )
    raise PretravelError(f"the CAD kernel's description has a surface of unknown kind {kind}")


def _made(kind: str, make: Callable[[], Surface], along_parameters: int = 1) -> SurfaceRecord:
    """The surface, or why there is none: one bad face must not prevent the use of the others."""
    try:
        return SurfaceRecord(kind, make(), along_parameters)
    except (PretravelError, ValueError) as error:
        return SurfaceRecord(kind, None, problem=str(error))


def _plane(origin: FloatArray, axes: FloatArray) -> Surface:
    # u along x, v along y: the normal is x × y, whatever z is.
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


def _spline_surface(tokens: Tokens, *, bezier: bool) -> SurfaceRecord:
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
