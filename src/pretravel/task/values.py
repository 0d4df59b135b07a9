"""Values as people type them: angles, vectors, pairs, tolerances.

A value has a type whose text can be typed again. Its `parse` makes it from text, and raises
`PretravelError` with the reason; a setting of this type is read by it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

from pretravel.base import (
    COMMAS_BETWEEN_NUMBERS,
    MICROMETRE,
    NUMBER,
    PretravelError,
    QuantityRange,
    checked_values,
    degrees_in,
)


def _joined(numbers: Iterable[float]) -> str:
    return ",".join(f"{number:.12g}" for number in numbers)


def typed_numbers(
    text: str, count: int, expected: str, quantity: QuantityRange = NUMBER
) -> list[float]:
    """Finite numbers from ``a,b,…``.

    Parameters
    ----------
    text : str
    count : int
    expected : str
        What should be there, for the message.
    quantity : QuantityRange
        Limits of each number.

    Raises
    ------
    PretravelError
    """
    try:
        numbers = [] if "_" in text else [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(value) for value in numbers):
        advice = f"; {COMMAS_BETWEEN_NUMBERS}" if len(numbers) > count else ""
        if 0 < len(numbers) < count:
            advice = f", and {len(numbers)} came: also give those that do not matter, as 0"
        raise PretravelError(f"expected {expected}{advice}")
    checked_values(numbers, "one of the numbers", quantity)
    return numbers


class Vector(NamedTuple):
    """Three numbers, x, y, z."""

    x: float
    y: float
    z: float

    def __str__(self) -> str:
        return _joined(self)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Three finite numbers from ``x,y,z``.

        >>> Vector.parse("0,0,1")
        Vector(x=0.0, y=0.0, z=1.0)
        """
        return cls(*typed_numbers(text, 3, "three numbers x,y,z, such as 0,0,1"))


class UnitVector(Vector):
    """A direction."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """A direction from ``x,y,z`` of any length except zero, scaled to length one.

        >>> UnitVector.parse("0,0,-2")
        UnitVector(x=0.0, y=0.0, z=-1.0)
        """
        x, y, z = Vector.parse(text)
        length = math.hypot(x, y, z)
        if not (math.isfinite(length) and length > 0.0):
            raise PretravelError("a direction has three finite numbers, not all zero")
        return cls(x / length, y / length, z / length)


class Pair(NamedTuple):
    """Two numbers, of surface parameters or of a range."""

    first: float
    second: float

    def __str__(self) -> str:
        return _joined(self)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Two finite numbers from ``a,b`` or ``a:b``.

        >>> Pair.parse("0.5,-0.5")
        Pair(first=0.5, second=-0.5)
        """
        expected = "two numbers, for example 0.5,0.5"
        return cls(*typed_numbers(text.replace(":", ","), 2, expected))


class StatedColumns(dict[str, str]):
    """Names or numbers of columns, by the quantity that they contain."""

    def __str__(self) -> str:
        return ",".join(f"{name}={column}" for name, column in self.items())

    @classmethod
    def parse(cls, text: str) -> Self:
        """Columns from ``x=X,nx=I,…``; a name can contain blanks and commas.

        >>> StatedColumns.parse("x=X pos,nx=-I,label=2")
        {'x': 'X pos', 'nx': '-I', 'label': '2'}
        """
        pairs = [part.partition("=") for part in re.split(r",(?=\s*\w+\s*=)", text)]
        if not all(name.strip() and sign and value.strip() for name, sign, value in pairs):
            raise PretravelError("it has the form x=X,y=Y,z=Z,nx=I,ny=J,nz=K")
        return cls({name.strip().lower(): value.strip() for name, _, value in pairs})


@dataclass(frozen=True)
class Angles:
    """Angles as they are typed."""

    text: str

    @cached_property
    def degrees(self) -> tuple[float, ...]:
        """The angles. [deg]"""
        return degrees_in(self.text)

    def __str__(self) -> str:
        return self.text

    @classmethod
    def parse(cls, text: str) -> Self:
        """Angles as `degrees_in` reads them.

        >>> Angles.parse("0:30:10").degrees, Angles.parse("90").degrees
        ((0.0, 10.0, 20.0, 30.0), (90.0,))
        """
        found = cls(text)
        _ = found.degrees  # refused here, not where they are used
        return found


class PolarAngles(Angles):
    """Angles between 0 and 180 degrees."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Angles as `Angles` reads them.

        >>> PolarAngles.parse("0:30:10").degrees
        (0.0, 10.0, 20.0, 30.0)
        """
        found = super().parse(text)
        if min(found.degrees) < 0.0 or max(found.degrees) > 180.0:
            raise PretravelError("polar angles lie between 0 and 180 degrees")
        return found


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

    @classmethod
    def parse(cls, text: str) -> Self:
        """A length between 0 and 100 µm; or ``none``.

        >>> Length.parse("1.5").micrometres, Length.parse("none").millimetres
        (1.5, None)
        """
        if text.lower() == "none":
            return cls(None)
        (value,) = typed_numbers(text, 1, "a number in µm, or none")
        if not 0.0 <= value <= 100.0:
            raise PretravelError("it must lie between 0 and 100 µm")
        return cls(value)
