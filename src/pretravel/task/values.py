"""Values as people type them: angles, vectors, pairs, tolerances.

A value has a type whose text is what can be typed again. Each function makes one from text, and
raises `PretravelError` with the reason.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from pretravel.base import (
    COMMAS_BETWEEN_NUMBERS,
    FEED,
    MICROMETRE,
    NUMBER,
    PretravelError,
    QuantityRange,
    checked_values,
    degrees_in,
)


def _joined(numbers: Iterable[float]) -> str:
    return ",".join(f"{number:.12g}" for number in numbers)


class Vector(NamedTuple):
    """Three numbers, x, y, z."""

    x: float
    y: float
    z: float

    def __str__(self) -> str:
        return _joined(self)


class Pair(NamedTuple):
    """Two numbers, of surface parameters or of a range."""

    first: float
    second: float

    def __str__(self) -> str:
        return _joined(self)


class Indices(NamedTuple):
    """The index of a machine and that of a probe direction."""

    machine: int
    probe: int

    def __str__(self) -> str:
        return _joined(self)


class Counts(NamedTuple):
    """Numbers of points along the parameters u and v of a face."""

    along_u: int
    along_v: int

    def __str__(self) -> str:
        return f"{self.along_u}x{self.along_v}"


class Feeds(tuple[float, ...]):
    """Feeds. [mm/min]"""

    def __str__(self) -> str:
        return _joined(self)


class StatedColumns(dict[str, str]):
    """Names or numbers of columns, by the quantity that they contain."""

    def __str__(self) -> str:
        return ",".join(f"{name}={column}" for name, column in self.items())


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
    """Angles as they are typed; `angles` makes them from text and checks it.

    Attributes
    ----------
    text : str
    """

    text: str

    @cached_property
    def degrees(self) -> tuple[float, ...]:
        """The angles. [deg]"""
        return degrees_in(self.text)

    def __str__(self) -> str:
        return self.text


def angles(text: str) -> Angles:
    """Angles as `degrees_in` reads them.

    >>> angles("0:30:10").degrees, angles("90").degrees
    ((0.0, 10.0, 20.0, 30.0), (90.0,))
    """
    found = Angles(text)
    _ = found.degrees  # refused here, not where they are used
    return found


def polar_angles(text: str) -> Angles:
    """Angles between 0 and 180 degrees, as `angles` reads them.

    >>> polar_angles("0:30:10").degrees
    (0.0, 10.0, 20.0, 30.0)
    """
    found = angles(text)
    if min(found.degrees) < 0.0 or max(found.degrees) > 180.0:
        raise PretravelError("polar angles lie between 0 and 180 degrees")
    return found


def _numbers(text: str, count: int, expected: str, quantity: QuantityRange) -> list[float]:
    try:
        numbers = [] if "_" in text else [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(value) for value in numbers):
        advice = f"; {COMMAS_BETWEEN_NUMBERS}" if len(numbers) > count else ""
        raise PretravelError(f"expected {expected}{advice}")
    checked_values(numbers, "one of the numbers", quantity)
    return numbers


def pair(text: str) -> Pair:
    """Two finite numbers from ``a,b`` or ``a:b``.

    >>> pair("0.5,-0.5")
    Pair(first=0.5, second=-0.5)
    """
    return Pair(*_numbers(text.replace(":", ","), 2, "two numbers, for example 0.5,0.5", NUMBER))


def indices(text: str) -> Indices:
    """Two whole numbers from ``machine,probe``.

    >>> indices("1,2")
    Indices(machine=1, probe=2)
    """
    expected = "two whole numbers, for example 1,1"
    first, second = _numbers(text.replace(":", ","), 2, expected, NUMBER)
    if first != round(first) or second != round(second):
        raise PretravelError(f"expected {expected}")
    return Indices(int(first), int(second))


class MovedMark(NamedTuple):
    """Where a person sees an event of a trace: ruler position, in mm."""

    trace: str
    event: str
    position: float

    def __str__(self) -> str:
        return f"{self.trace}:{self.event}={self.position:.12g}"


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
        raise PretravelError("expected a trace, an event and mm: rig_000_1:r0=1.25")
    return MovedMark(trace, name.strip(), position)


def feeds_list(text: str) -> Feeds:
    """Feeds from ``a,b,…``, in mm/min.

    >>> feeds_list("50,200")
    (50.0, 200.0)
    """
    expected = "feeds in mm/min, for example 50,200"
    return Feeds(_numbers(text, text.count(",") + 1, expected, FEED))


def stated_columns(text: str) -> StatedColumns:
    """Columns from ``x=X,nx=I,…``; a name can contain blanks and commas.

    >>> stated_columns("x=X pos,nx=-I,label=2")
    {'x': 'X pos', 'nx': '-I', 'label': '2'}
    """
    pairs = [part.partition("=") for part in re.split(r",(?=\s*\w+\s*=)", text)]
    if not all(name.strip() and sign and value.strip() for name, sign, value in pairs):
        raise PretravelError("it has the form x=X,y=Y,z=Z,nx=I,ny=J,nz=K")
    return StatedColumns({name.strip().lower(): value.strip() for name, _, value in pairs})


def length_or_none(text: str) -> Length:
    """A length between 0 and 100 µm; or ``none``.

    >>> length_or_none("1.5").micrometres, length_or_none("none").millimetres
    (1.5, None)
    """
    if text.lower() == "none":
        return Length(None)
    (value,) = _numbers(text, 1, "a number in µm, or none", NUMBER)
    if not 0.0 <= value <= 100.0:
        raise PretravelError("it must lie between 0 and 100 µm")
    return Length(value)


def counts(text: str) -> Counts:
    """Points along u and along v, from ``10x8``.

    >>> counts("10x8")
    Counts(along_u=10, along_v=8)
    """
    words = text.lower().split("x")
    if len(words) != 2 or not all(re.fullmatch(r"\s*[0-9]{1,5}\s*", word) for word in words):
        raise PretravelError("expected the points along u and the points along v, for example 10x8")
    return Counts(int(words[0]), int(words[1]))


def vector(text: str) -> Vector:
    """Three finite numbers from ``x,y,z``.

    >>> vector("0,0,1")
    Vector(x=0.0, y=0.0, z=1.0)
    """
    return Vector(*_numbers(text, 3, "three numbers x,y,z", NUMBER))


def unit_vector(text: str) -> Vector:
    """A direction from ``x,y,z`` of any length except zero, scaled to length one.

    >>> unit_vector("0,0,-2")
    Vector(x=0.0, y=0.0, z=-1.0)
    """
    x, y, z = vector(text)
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0.0):
        raise PretravelError("a direction has three finite numbers, not all zero")
    return Vector(x / length, y / length, z / length)


_NUMBER = r"[+-]?\d*\.?\d+(?:[eE][+-]?\d+)?"


class ToleranceText(NamedTuple):
    """Limits, or deviations from a nominal size, in mm; None: there is no such limit."""

    low: float | None
    high: float | None
    are_limits: bool

    def __str__(self) -> str:
        """As it can be typed."""
        if self.are_limits:
            ends = ("" if end is None else f"{end:.12g}" for end in (self.low, self.high))
            return "..".join(ends)
        return f"{self.high:+.12g}/{self.low:+.12g}"


def tolerance(text: str) -> ToleranceText:
    """Limits ``20.000..20.021``, ``20..`` or ``..20.021``, or deviations ``+0.021/0``, ``±0.01``.

    >>> tolerance("20..20.021"), tolerance("+0.021/0")
    (ToleranceText(low=20.0, high=20.021, are_limits=True), \
ToleranceText(low=0.0, high=0.021, are_limits=False))
    >>> str(tolerance("+0.021/0")), str(tolerance("20..20.021"))
    ('+0.021/+0', '20..20.021')
    >>> str(tolerance("0..")), str(tolerance("..20.021"))
    ('0..', '..20.021')
    >>> tolerance("±0.01")
    ToleranceText(low=-0.01, high=0.01, are_limits=False)
    >>> str(tolerance("19,99..20,02"))  # a decimal comma means nothing else here
    '19.99..20.02'
    """
    tight = re.sub(r"(?<=\d),(?=\d)", ".", text.replace(" ", "").replace("−", "-"))
    if both := re.fullmatch(rf"(?:±|\+-|\+/-)({_NUMBER})", tight):
        half = abs(float(both[1]))
        return _nonempty(-half, half, False)
    if limits := re.fullmatch(rf"({_NUMBER})?\.\.({_NUMBER})?", tight):
        low, high = (None if limit is None else float(limit) for limit in limits.groups())
        if low is not None and high is not None:
            return _nonempty(low, high, True)
        only = high if low is None else low
        if only is not None and math.isfinite(only):
            return ToleranceText(low, high, True)
    if parts := re.fullmatch(rf"({_NUMBER})/({_NUMBER})", tight):
        return _nonempty(float(parts[2]), float(parts[1]), False)
    raise PretravelError(
        "expected limits as 20.000..20.021, one limit as 20.. or ..20.021, or with a "
        "nominal size the upper and lower deviation as +0.021/0 or ±0.01, in mm"
    )


def _nonempty(low: float, high: float, are_limits: bool) -> ToleranceText:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        order = "the lower limit comes first" if are_limits else "the upper deviation comes first"
        raise PretravelError(f"this tolerance is empty; {order}")
    return ToleranceText(low, high, are_limits)
