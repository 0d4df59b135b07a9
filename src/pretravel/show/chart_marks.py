"""Marks: what stands in a chart, as frozen values; in a plane, around, or in space."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, frozen
from pretravel.show.colours import Colour

Symbol: TypeAlias = Literal["dot", "ring", "cross", "diamond"]


class FrozenArrays:
    """Makes the arrays of a value read-only copies; checks that those of a mark agree."""

    _rows: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray) and value.dtype.kind in "iu":
                rows = value.copy()
                rows.flags.writeable = False
                object.__setattr__(self, field.name, rows)
            elif isinstance(value, (np.ndarray, list)):
                object.__setattr__(self, field.name, frozen(value))
        given = [getattr(self, name) for name in self._rows]
        lengths = {len(value) for value in given if value is not None and len(value)}
        if len(lengths) > 1:
            raise ValueError(f"{type(self).__name__}: {self._rows} have the lengths {lengths}")


_BEYOND = 0.12
"""How far beyond the others what is left out is drawn at most, as a part of their range."""


def at_the_edge(left_out: npt.ArrayLike, others: npt.ArrayLike) -> FloatArray:
    """Values that are left out, drawn at the edge of the others where they are beyond.

    So none of them sets the scale of a picture; its label has the value.

    Parameters
    ----------
    left_out : (n,) float
    others : (m,) float

    Returns
    -------
    (n,) float

    >>> at_the_edge([60.0, 1.5], [0.0, 1.0, 2.0]).tolist()
    [2.24, 1.5]
    """
    known = np.asarray(others, dtype=np.float64)
    known = known[np.isfinite(known)]
    given = np.asarray(left_out, dtype=np.float64)
    if not len(known):
        return given
    low, high = float(known.min()), float(known.max())
    room = _BEYOND * (high - low)
    return np.clip(given, low - room, high + room)


@dataclass(frozen=True, eq=False)
class LineMark(FrozenArrays):
    """A line through points; a value that is not a number interrupts it.

    Attributes
    ----------
    x, y : (n,) float
        In a polar chart: azimuth [rad] and radius.
    name : str
        For the legend; empty: not in it.
    colour : Colour
    width : float
        [pt]
    dashed : bool
    marked : bool
        Whether each point has a dot.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = "series1"
    width: float = 1.6
    dashed: bool = False
    marked: bool = False
    _rows = ("x", "y")


@dataclass(frozen=True, eq=False)
class Dots(FrozenArrays):
    """Single points.

    Attributes
    ----------
    x, y : (n,) float
        In a polar chart: azimuth [rad] and radius.
    name : str
    colour : Colour
    values : (n,) float or None
        For the scale of the chart, instead of one colour.
    u : (n,) float or None
        Half length of a bar along y.
    symbol : str
    size : float
        Diameter. [pt]
    labels : tuple of str
        What a page shows of each point when it is pointed at.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = "series1"
    values: FloatArray | None = None
    u: FloatArray | None = None
    symbol: Symbol = "dot"
    size: float = 5.0
    labels: tuple[str, ...] = ()
    _rows = ("x", "y", "values", "u", "labels")


@dataclass(frozen=True, eq=False)
class Area(FrozenArrays):
    """The area between two lines.

    Attributes
    ----------
    x, low, high : (n,) float
        In a polar chart x is the azimuth. [rad]
    name : str
    colour : Colour
    opacity : float
    """

    x: FloatArray
    low: FloatArray
    high: FloatArray
    name: str = ""
    colour: Colour = "series1"
    opacity: float = 0.18
    _rows = ("x", "low", "high")


@dataclass(frozen=True, eq=False)
class Bars(FrozenArrays):
    """Bars; with categories on the axis, places are 0, 1, ….

    Attributes
    ----------
    places : (n,) float
    values : (n,) float
        Lengths.
    name : str
    colour : Colour
    width : float
        Along the places.
    base : (n,) float or None
        Where the bars begin; None: at zero.
    u : (n,) float or None
        Half length of a whisker at the end.
    horizontal : bool
    texts : tuple of str
        At the ends of the bars.
    """

    places: FloatArray
    values: FloatArray
    name: str = ""
    colour: Colour = "series1"
    width: float = 0.7
    base: FloatArray | None = None
    u: FloatArray | None = None
    horizontal: bool = False
    texts: tuple[str, ...] = ()
    _rows = ("places", "values", "base", "u", "texts")


@dataclass(frozen=True)
class Rule:
    """A straight line through the whole plane; in a polar chart a circle.

    Attributes
    ----------
    value : float
    name : str
    colour : Colour
    upright : bool
        At a value of x instead of y.
    """

    value: float
    name: str = ""
    colour: Colour = "reference"
    upright: bool = False


@dataclass(frozen=True)
class Note:
    """Words at a place."""

    x: float
    y: float
    text: str
    colour: Colour = "ink"


@dataclass(frozen=True, eq=False)
class Contours(FrozenArrays):
    """A quantity over a plane: lines of equal values, filled with the colours of the chart's scale.

    Attributes
    ----------
    x : (m,) float
        Increasing.
    y : (n,) float
        Increasing.
    values : (n, m) float
        Not a number where there is none.
    step : float
        From line to line; the first one is at the low end of the scale.
    """

    x: FloatArray
    y: FloatArray
    values: FloatArray
    step: float


Mark: TypeAlias = LineMark | Dots | Area | Bars | Rule | Note | Contours


@dataclass(frozen=True, eq=False)
class SpacePoints(FrozenArrays):
    """Points in space.

    Attributes
    ----------
    positions : (n, 3) float
    name : str
    colour : Colour
    values : (n,) float or None
        For the scale of the chart, instead of one colour.
    symbol : str
    size : float
        [pt]
    labels : tuple of str
        What a page shows of each point when it is pointed at.
    """

    positions: FloatArray
    name: str = ""
    colour: Colour = "series1"
    values: FloatArray | None = None
    symbol: Symbol = "dot"
    size: float = 5.0
    labels: tuple[str, ...] = ()
    _rows = ("positions", "values", "labels")


@dataclass(frozen=True, eq=False)
class SpaceLines(FrozenArrays):
    """Straight lines in space, such as whiskers.

    Attributes
    ----------
    starts, ends : (n, 3) float
    name : str
    colour : Colour
    width : float
        [pt]
    """

    starts: FloatArray
    ends: FloatArray
    name: str = ""
    colour: Colour = "series1"
    width: float = 1.6
    _rows = ("starts", "ends")


@dataclass(frozen=True, eq=False)
class SpaceMesh(FrozenArrays):
    """A surface of triangles in space.

    Attributes
    ----------
    vertices : (n, 3) float
    triangles : (t, 3) int
        Rows of vertices.
    name : str
    colour : Colour
    values : (n,) float or None
        At the vertices, for the scale of the chart.
    opacity : float
    outwards : bool
        Whether the corners of each triangle are counter-clockwise as seen from outside: a file
        then leaves out points that the mesh hides.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.integer]
    name: str = ""
    colour: Colour = "body"
    values: FloatArray | None = None
    opacity: float = 1.0
    outwards: bool = False
    _rows = ("vertices", "values")


@dataclass(frozen=True, eq=False)
class SpaceArrow(FrozenArrays):
    """An arrow in space, with its name next to it.

    Attributes
    ----------
    start, vector : (3,) float
    name : str
    colour : Colour
    """

    start: FloatArray
    vector: FloatArray
    name: str = ""
    colour: Colour = "limit"


@dataclass(frozen=True, eq=False)
class SpaceNotes(FrozenArrays):
    """Words at places in space.

    Attributes
    ----------
    positions : (n, 3) float
    texts : tuple of str
    colour : Colour
    """

    positions: FloatArray
    texts: tuple[str, ...]
    colour: Colour = "ink"
    _rows = ("positions", "texts")


SpaceMark: TypeAlias = SpacePoints | SpaceLines | SpaceMesh | SpaceArrow | SpaceNotes
