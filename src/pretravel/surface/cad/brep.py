"""OpenCASCADE's text form of solids, read into surfaces, curves and the tree of shapes.

The CAD kernel reads STEP files and corrects them. Its text form contains the exact result, with
poles and knots, which the kernel's Python interface does not offer.

Format: OpenCASCADE documentation, "BRep format", versions 1 to 3.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.surface.cad.brep_geometry import SurfaceRecord, Tokens, read_curve, read_surface
from pretravel.surface.curves import Curve

_IDENTITY = np.eye(4)
_SEAM = re.compile(r"^(\d+)(C\d|CN|G\d)$")


@dataclass(frozen=True, eq=False)
class ShapeUse:
    """A shape as a part of another one.

    Attributes
    ----------
    index : int
        Number of the shape.
    reverses : bool
        Whether its orientation is reversed.
    placement : (4, 4) float
        Homogeneous; of the shape in the other one.
    bounds : bool
        False for seams within a face (orientation internal or external), which bound nothing.
    """

    index: int
    reverses: bool
    placement: FloatArray
    bounds: bool = True


@dataclass(eq=False)
class ShapeRecord:
    """One entry of the tree: Ve, Ed, Wi, Fa, Sh, So, CS or Co.

    Attributes
    ----------
    kind : str
        One of these words.
    parts : list of ShapeUse
    surface : int
        Of a face: number of its surface, from 1.
    placement : (4, 4) float
        Of a face: placement of its surface.
    parameter_curves : list of tuple
        Of an edge: its curves in the parameters of surfaces, each as number of the surface, number
        of the curve, number of the curve on the other side of a seam (0: none), first and last
        parameter.
    curve : tuple or None
        Of an edge: its curve in space, as number, placement, first and last parameter.
    """

    kind: str
    parts: list[ShapeUse] = field(default_factory=list)
    surface: int = 0
    placement: FloatArray = field(default_factory=lambda: _IDENTITY)
    parameter_curves: list[tuple[int, int, int, float, float]] = field(default_factory=list)
    curve: tuple[int, FloatArray, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Brep:
    """The content of the text form: curves, surfaces, and the tree of shapes from its roots."""

    plane_curves: list[Curve]
    space_curves: list[Curve]
    surfaces: list[SurfaceRecord]
    shapes: dict[int, ShapeRecord]
    roots: list[ShapeUse]


def parse_brep(text: str) -> Brep:
    """Read the kernel's text form.

    Raises
    ------
    PretravelError
        A text that is not of this form.
    """
    tokens = Tokens(text.split())
    tokens.skip_to("Locations")
    placements = list(_placements(tokens))
    _expect(tokens, "Curve2ds")
    plane_curves = [read_curve(tokens, 2) for _ in range(tokens.integer())]
    _expect(tokens, "Curves")
    space_curves = [read_curve(tokens, 3) for _ in range(tokens.integer())]
    tokens.skip_to("Surfaces")
    surfaces = [read_surface(tokens) for _ in range(tokens.integer())]
    tokens.skip_to("TShapes")
    count = tokens.integer()
    # Shapes refer to each other by their number from the end.
    shapes = {count - i: _shape(tokens, placements) for i in range(count)}
    roots = list(_uses(tokens, placements, end=""))
    return Brep(plane_curves, space_curves, surfaces, shapes, roots)


def _expect(tokens: Tokens, word: str) -> None:
    came = tokens.word()
    if came != word:
        raise PretravelError(f"the CAD kernel's description has '{came}' where '{word}' belongs")


def _placements(tokens: Tokens) -> Iterator[FloatArray]:
    known: list[FloatArray] = []
    for _ in range(tokens.integer()):
        if tokens.integer() == 1:
            placement = np.eye(4)
            placement[:3] = tokens.numbers(12).reshape(3, 4)
        else:
            placement = np.eye(4)
            while (index := tokens.integer()) != 0:
                power = tokens.integer()
                # The last one is the outermost: OpenCASCADE's TopTools_LocationSet reads it so.
                placement = np.linalg.matrix_power(known[index - 1], power) @ placement
        known.append(placement)
        yield placement


def _placement(placements: list[FloatArray], index: int) -> FloatArray:
    return _IDENTITY if index == 0 else placements[index - 1]


def _shape(tokens: Tokens, placements: list[FloatArray]) -> ShapeRecord:
    kind = tokens.word()
    shape = ShapeRecord(kind)
    if kind == "Ve":
        tokens.numbers(4)
        while tokens.peek() != "*" and len(tokens.peek()) != 7:
            tokens.word()  # other forms of the point; the flags after them have 7 digits
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


def _edge(tokens: Tokens, shape: ShapeRecord, placements: list[FloatArray]) -> None:
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
            # No space separates the second curve's number from the continuity at the seam.
            glued = _SEAM.match(tokens.word())
            if glued is None:
                raise PretravelError("the CAD kernel's description has a seam of unknown form")
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


def _uses(tokens: Tokens, placements: list[FloatArray], end: str) -> Iterator[ShapeUse]:
    while (word := tokens.peek()) != end:
        tokens.word()
        placement = _placement(placements, tokens.integer())
        yield ShapeUse(int(word[1:]), word[0] == "-", placement, word[0] in "+-")
    if end:
        tokens.word()
