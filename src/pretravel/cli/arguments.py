"""Values as people type them: angles, vectors, pairs, and names from a registry.

Each function is a `parser` for an option of typer. It raises `typer.BadParameter` with the value
and the reason; `pretravel.cli.command.Command` adds the name of the option.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import (
    COMMAS_BETWEEN_NUMBERS,
    FEED,
    NUMBER,
    QuantityRange,
    checked_values,
    degrees_in,
)
from pretravel.base.units import MICROMETRE

T = TypeVar("T")


class Vector(NamedTuple):
    """Three numbers, x, y, z."""

    x: float
    y: float
    z: float


class Pair(NamedTuple):
    """Two numbers, of surface parameters or of a range."""

    first: float
    second: float


class Indices(NamedTuple):
    """The index of a machine and that of a probe direction."""

    machine: int
    probe: int


class Counts(NamedTuple):
    """Numbers of points along the parameters u and v of a face."""

    along_u: int
    along_v: int


class Feeds(tuple[float, ...]):
    """Feeds. [mm/min]"""


class StatedColumns(dict[str, str]):
    """Names or numbers of columns, by the quantity that they contain."""


@dataclass(frozen=True)
class Length:
    """A length, or none.

    Attributes
    ----------
    micrometres : float or None
        [µm]
    """

    micrometres: float | None

    @property
    def millimetres(self) -> float | None:
        """The length inside the library. [mm]"""
        return None if self.micrometres is None else self.micrometres * MICROMETRE

    def __str__(self) -> str:
        return "none" if self.micrometres is None else str(self.micrometres)


@dataclass(frozen=True)
class Angles:
    """Angles, and the text that they come from.

    Attributes
    ----------
    text : str
    degrees : tuple of float
        [deg]
    """

    text: str
    degrees: tuple[float, ...]

    @classmethod
    def of(cls, text: str) -> Angles:
        """The angles that `text` means; see `angles`."""
        return angles(text)

    def __str__(self) -> str:
        return self.text


def parser(value_type: type[T]) -> Callable[[Callable[[str], T]], Callable[[str], T]]:
    """Make a function a parser for typer, which passes the default value through it too."""

    def decorate(read: Callable[[str], T]) -> Callable[[str], T]:
        @functools.wraps(read)
        def parse(text: str) -> T:
            if isinstance(text, value_type):
                return text
            try:
                return read(text)
            except PretravelError as error:
                raise typer.BadParameter(f"{text}: {error}") from error

        return parse

    return decorate


@parser(Angles)
def angles(text: str) -> Angles:
    """Angles as `degrees_in` reads them.

    >>> angles("0:30:10").degrees, angles("90").degrees
    ((0.0, 10.0, 20.0, 30.0), (90.0,))
    """
    return Angles(text, degrees_in(text))


@parser(Angles)
def polar_angles(text: str) -> Angles:
    """Angles between 0 and 180 degrees, as `angles` reads them.

    >>> polar_angles("0:30:10").degrees
    (0.0, 10.0, 20.0, 30.0)
    """
    found = angles(text)
    if min(found.degrees) < 0.0 or max(found.degrees) > 180.0:
        raise typer.BadParameter(f"{text}: polar angles lie between 0 and 180 degrees")
    return found


def _numbers(text: str, count: int, expected: str, quantity: QuantityRange) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(value) for value in numbers):
        advice = f"; {COMMAS_BETWEEN_NUMBERS}" if len(numbers) > count else ""
        raise typer.BadParameter(f"{text}: expected {expected}{advice}")
    checked_values(numbers, "one of the numbers", quantity)
    return numbers


@parser(Pair)
def pair(text: str) -> Pair:
    """Two finite numbers from ``a,b`` or ``a:b``.

    >>> pair("0.5,-0.5")
    Pair(first=0.5, second=-0.5)
    """
    return Pair(*_numbers(text.replace(":", ","), 2, "two numbers, for example 0.5,0.5", NUMBER))


@parser(Indices)
def indices(text: str) -> Indices:
    """Two whole numbers from ``machine,probe``.

    >>> indices("1,2")
    Indices(machine=1, probe=2)
    """
    expected = "two whole numbers, for example 1,1"
    first, second = _numbers(text.replace(":", ","), 2, expected, NUMBER)
    if first != round(first) or second != round(second):
        raise typer.BadParameter(f"{text}: expected {expected}")
    return Indices(int(first), int(second))


class MovedMark(NamedTuple):
    """Where a person sees an event of a trace: ruler position, in mm."""

    trace: str
    event: str
    position: float


@parser(MovedMark)
def trace_mark(text: str) -> MovedMark:
    """An event of a trace from ``trace:event=position``, in mm.

    >>> trace_mark("rig_000_1:r0=1.25")
    MovedMark(trace='rig_000_1', event='r0', position=1.25)
    """
    trace, colon, event = text.rpartition(":")
    name, equals, number = event.partition("=")
    try:
        position = float(number)
    except ValueError:
        position = math.nan
    if not (trace and colon and equals and math.isfinite(position)):
        raise typer.BadParameter(f"{text}: expected a trace, an event and mm: rig_000_1:r0=1.25")
    return MovedMark(trace, name.strip(), position)


@parser(Feeds)
def feeds_list(text: str) -> Feeds:
    """Feeds from ``a,b,…``, in mm/min.

    >>> feeds_list("50,200")
    (50.0, 200.0)
    """
    expected = "feeds in mm/min, for example 50,200"
    return Feeds(_numbers(text, text.count(",") + 1, expected, FEED))


@parser(StatedColumns)
def stated_columns(text: str) -> StatedColumns:
    """Columns from ``x=X,nx=I,…``; a name can contain blanks and commas.

    >>> stated_columns("x=X pos,nx=-I,label=2")
    {'x': 'X pos', 'nx': '-I', 'label': '2'}
    """
    pairs = [part.partition("=") for part in re.split(r",(?=\s*\w+\s*=)", text)]
    if not all(name.strip() and sign and value.strip() for name, sign, value in pairs):
        raise typer.BadParameter(f"{text}: it has the form x=X,y=Y,z=Z,nx=I,ny=J,nz=K")
    return StatedColumns({name.strip().lower(): value.strip() for name, _, value in pairs})


@parser(Length)
def length_or_none(text: str) -> Length:
    """A length between 0 and 100 µm; or ``none``.

    >>> length_or_none("1.5").micrometres, length_or_none("none").millimetres
    (1.5, None)
    """
    if text.lower() == "none":
        return Length(None)
    (value,) = _numbers(text, 1, "a number in µm, or none", NUMBER)
    if not 0.0 <= value <= 100.0:
        raise typer.BadParameter(f"{text}: it lies between 0 and 100 µm")
    return Length(value)


@parser(Counts)
def counts(text: str) -> Counts:
    """Points along u and along v, from ``10x8``.

    >>> counts("10x8")
    Counts(along_u=10, along_v=8)
    """
    words = text.lower().split("x")
    if len(words) != 2 or not all(re.fullmatch(r"\s*[0-9]{1,5}\s*", word) for word in words):
        raise typer.BadParameter(
            f"{text}: expected the points along u and the points along v, for example 10x8"
        )
    return Counts(int(words[0]), int(words[1]))


@parser(Vector)
def vector(text: str) -> Vector:
    """Three finite numbers from ``x,y,z``.

    >>> vector("0,0,1")
    Vector(x=0.0, y=0.0, z=1.0)
    """
    return Vector(*_numbers(text, 3, "three numbers x,y,z", NUMBER))


@parser(Vector)
def unit_vector(text: str) -> Vector:
    """A direction from ``x,y,z`` of any length except zero, scaled to length one.

    >>> unit_vector("0,0,-2")
    Vector(x=0.0, y=0.0, z=-1.0)
    """
    x, y, z = vector(text)
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0.0):
        raise typer.BadParameter(f"{text}: a direction has three finite numbers, not all zero")
    return Vector(x / length, y / length, z / length)


def one_of(names: Callable[[], Iterable[str]]) -> Callable[[str], str]:
    """A parser for a name from a registry of the library, which is read when a command runs.

    Parameters
    ----------
    names : callable
        Returns the names that are known.

    >>> one_of(lambda: ("mm", "inch"))("mm")
    'mm'
    """

    def name(text: str) -> str:
        known = list(names())
        if text not in known:
            raise typer.BadParameter(f"{text}: it is not known; there are {', '.join(known)}")
        return text

    return name
