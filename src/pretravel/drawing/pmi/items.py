"""What a model states about its faces: datums, sizes, tolerances; and what was not understood."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pretravel.drawing.pmi.measures import StatedMeasure

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Place:
    """What an item of PMI refers to.

    Attributes
    ----------
    faces : tuple of int
        Instances of the faces.
    others : tuple of str
        Other geometry of the text, such as ``#12 EDGE_CURVE``.
    around : bool
        Whether it is all around.
    between : bool
        Whether it is the faces between two.
    whole : bool
        Whether it is the whole part.
    beside : tuple of int
        Of edges alone: the faces next to them.
    """

    faces: tuple[int, ...] = ()
    others: tuple[str, ...] = ()
    around: bool = False
    between: bool = False
    whole: bool = False
    beside: tuple[int, ...] = ()


@dataclass(frozen=True)
class DatumTarget:
    """A target of a datum.

    Attributes
    ----------
    number : int
    name : str
        ``A1``.
    form : str
        point, line, rectangle, circle, area.
    place : Place
    sizes : tuple of StatedMeasure
        Its width, length or diameter.
    at : tuple of float or None
        Where it lies. [mm]
    axes : tuple of tuple of float
        The x and z axes of its placement.
    ends : tuple of tuple of float
        Of a line that is an edge of the model. [mm]
    movable : bool
        Whether it moves along a direction.
    """

    number: int
    name: str
    form: str
    place: Place
    sizes: tuple[StatedMeasure, ...] = ()
    at: Triple | None = None
    axes: tuple[Triple, ...] = ()
    ends: tuple[Triple, ...] = ()
    movable: bool = False


@dataclass(frozen=True)
class PmiDatum:
    """A datum with its features."""

    number: int
    letter: str
    place: Place
    targets: tuple[DatumTarget, ...] = ()


@dataclass(frozen=True)
class Size:
    """A size, or a distance or an angle between two places.

    Attributes
    ----------
    number : int
    quantity : str
        As the text calls it: ``diameter``, ``linear distance``.
    unit : str
    places : tuple of Place
        One of a size, two of a distance.
    nominal, lower, upper : float or None
        Value and limits. [mm or degrees]
    fit : str
        Class of ISO 286: ``H7``.
    notes : tuple of str
        ``theoretical``, ``auxiliary`` and others.
    unclear : str
        Why its tolerance has no limits, where the text states a tolerance.
    """

    number: int
    quantity: str
    unit: str
    places: tuple[Place, ...]
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    fit: str = ""
    notes: tuple[str, ...] = ()
    unclear: str = ""

    @property
    def ends(self) -> tuple[float, float]:
        """Between which the model has it: at its nominal value, else within its limits."""
        if self.nominal is not None:
            return self.nominal, self.nominal
        low = -math.inf if self.lower is None else self.lower
        return low, (math.inf if self.upper is None else self.upper)

    def limits(self, factor: float = 1.0) -> str:
        """As the file of features states them: ``11.98..12.02``, ``20..``."""
        ends = (self.lower, self.upper)
        return "..".join("" if end is None else f"{factor * end:.10g}" for end in ends)


@dataclass(frozen=True)
class DatumReference:
    """One compartment of a tolerance frame.

    Attributes
    ----------
    letters : tuple of str
        Two or more of a common datum.
    modifiers : tuple of str
        ``M``, ``L``, or the words of the text.
    """

    letters: tuple[str, ...]
    modifiers: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """As on a drawing: ``A-B``, ``C(M)``."""
        return "-".join(self.letters) + "".join(f"({each})" for each in self.modifiers)


@dataclass(frozen=True)
class Tolerance:
    """A geometric tolerance.

    Attributes
    ----------
    number : int
    kind : str
        position, profile, flatness, run-out and others.
    zone : float or None
        Its width or diameter. [mm]
    place : Place
    datums : tuple of DatumReference
        In their order.
    modifiers : tuple of str
        ``M``, ``L``, ``F`` or the words of the text.
    form : str
        Of the zone, as the text calls it; empty where it calls none.
    projected : float or None
        Length of a projected zone. [mm]
    displacement : float or None
        Of an unequally disposed zone. [mm]
    notes : tuple of str
        What else the text states: a unit length, a largest value.
    composite : int or None
        The tolerance of the upper segment, where this one is the lower of a composite frame.
    projected_from : Place
        The faces where a projected zone begins.
    """

    number: int
    kind: str
    zone: float | None
    place: Place
    datums: tuple[DatumReference, ...] = ()
    modifiers: tuple[str, ...] = ()
    form: str = ""
    projected: float | None = None
    displacement: float | None = None
    notes: tuple[str, ...] = ()
    composite: int | None = None
    projected_from: Place = Place()

    @property
    def signs(self) -> tuple[str, ...]:
        """All modifiers, with those that have values of their own."""
        return (
            *self.modifiers,
            *((f"U {self.displacement:.10g}",) if self.displacement is not None else ()),
            *((f"P {self.projected:.10g}",) if self.projected is not None else ()),
            *(("all around",) if self.place.around else ()),
            *(("all over",) if self.place.whole else ()),
            *(("between",) if self.place.between else ()),
            *((f"composite, below #{self.composite}",) if self.composite else ()),
            *self.notes,
        )


@dataclass(frozen=True)
class Unread:
    """What was not understood.

    Attributes
    ----------
    number : int
    text : str
    why : str
        What failed; empty where nothing refers to it.
    is_tolerance : bool
        Whether it is a tolerance or a size, not a part of one.
    """

    number: int
    text: str
    why: str = ""
    is_tolerance: bool = False


@dataclass(frozen=True)
class Pmi:
    """The semantic PMI of a model.

    Attributes
    ----------
    datums : tuple of PmiDatum
    sizes : tuple of Size
    tolerances : tuple of Tolerance
    unread : tuple of Unread
    standard : str
        ASME or ISO, where the text names the standard of the drawing.
    annotations : int
        Number of drawn annotations, which people read.
    texts : tuple of str
        What it says in words, such as general tolerances.
    """

    datums: tuple[PmiDatum, ...]
    sizes: tuple[Size, ...]
    tolerances: tuple[Tolerance, ...]
    unread: tuple[Unread, ...]
    standard: str = ""
    annotations: int = 0
    texts: tuple[str, ...] = ()
