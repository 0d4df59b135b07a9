"""Physical quantities and their ranges: numbers that no probe, part or machine has are refused.

The command line, the readers of files and the public functions take their limits from here.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any, NamedTuple

from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.base.arrays import FloatArray

_DECIMAL_COMMA = re.compile(r"[+-]?(?:\d+|\d{1,3}(?:[. ']\d{3})+),\d+(?:[eE][+-]?\d+)?")
_SIGNS_OF_THOUSANDS = "[. ']"
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+")


def decimal_point_advice(text: str) -> str:
    """What to write instead of a number with a decimal comma; empty for another text.

    >>> decimal_point_advice("24,9987")
    'the decimal sign is a point: write 24.9987'
    >>> decimal_point_advice("1.024,5")
    'the decimal sign is a point: write 1024.5'
    >>> decimal_point_advice("12,345")
    'the decimal sign is a point: write 12.345 (or 12345, if the comma separates thousands)'
    >>> decimal_point_advice("x")
    ''
    """
    tight = text.strip()
    start = "the decimal sign is a point: write"
    if _THOUSANDS.fullmatch(tight):
        whole = tight.replace(",", "")
        if tight.count(",") > 1:
            return f"thousands have no sign: write {whole}"
        return f"{start} {tight.replace(',', '.')} (or {whole}, if the comma separates thousands)"
    if _DECIMAL_COMMA.fullmatch(tight):
        whole, _, decimals = tight.partition(",")
        return f"{start} {re.sub(_SIGNS_OF_THOUSANDS, '', whole)}.{decimals}"
    return ""


class QuantityRange(NamedTuple):
    """A quantity with its range.

    Attributes
    ----------
    lowest, highest : float
        In the units of the library: mm, rad, s, …
    unit : str
        For messages.
    """

    lowest: float
    highest: float
    unit: str = ""

    def limits(self, unit: float = 1.0) -> dict[str, Any]:
        """The range as ``min`` and ``max`` of an option, which is given in another unit.

        >>> NOISE.limits(1e-3)
        {'min': 0.0, 'max': 10000.0}
        """
        return {
            "min": _rounded(self.lowest / unit),
            "max": _rounded(self.highest / unit),
        }


COMPONENT = QuantityRange(-1.0 - 1e-6, 1.0 + 1e-6)
"""Of a unit vector, rounded as files round."""
COORDINATE = QuantityRange(-1e6, 1e6, "mm")
NUMBER = QuantityRange(-1e6, 1e6)
"""Of a vector, a placement or the parameters of a surface: a length, an angle or an index."""
REFERENCE_DIAMETER = QuantityRange(1e-3, 1e4, "mm")
DEGREES = QuantityRange(-3600.0, 3600.0, "°")
TIP_BALL = QuantityRange(1e-3, 1e3, "mm")
TIP_RADIUS = QuantityRange(0.5e-3, 500.0, "mm")
DISTANCE = QuantityRange(0.0, 1e5, "mm")
STEP = QuantityRange(1e-6, 1e5, "mm")
"""A length that is not zero: the spacing of points, the height of a chord."""
UNCERTAINTY = QuantityRange(0.0, 1e3, "mm")
"""Of a length; also scatter and deviations of form."""
U_OF_DIAMETER = QuantityRange(0.0, 0.05, "mm")
"""Of a calibrated reference: a hundred times that of a usual certificate."""
DEVIATION_OF_FORM = QuantityRange(0.0, 0.1, "mm")
"""Of a reference."""
NOISE = QuantityRange(0.0, 10.0, "mm")
PRETRAVEL = QuantityRange(-1e3, 1e3, "mm")
FEED = QuantityRange(0.5, 1e6, "mm/min")
"""A smaller one was typed in m/min: at 0.5 mm/min, 10 µm of pretravel take more than a second."""
FEED_OR_NONE = QuantityRange(0.0, 1e6, "mm/min")
"""Zero where the delay travel was subtracted."""
DELAY = QuantityRange(0.0, 10.0, "s")
MEASURED_DELAY = QuantityRange(-10.0, 10.0, "s")
"""Negative by errors of the touches."""
ANGLE = QuantityRange(-3600.0 * DEGREE, 3600.0 * DEGREE, "rad")
PROBABILITY = QuantityRange(0.0, 1.0)
REAL = QuantityRange(-1e150, 1e150)
"""A number of any kind; its square is finite too."""
FRICTION = QuantityRange(0.0, 1e3)
U_OF_FRICTION = QuantityRange(0.0, 1.0)
VARIANCE = QuantityRange(0.0, 1.0, "mm²")
COUNT = QuantityRange(0.0, 1e9)
TEMPERATURE_DIFFERENCE = QuantityRange(0.0, 1e3, "K")
LARGEST_PRETRAVEL = 0.15
"""A pretravel above this is refused: a diameter or a unit is wrong. [mm]"""
STEEL_EXPANSION = 11.5e-6
"""Coefficient of thermal expansion of steel. [1/K]"""

_SMALL = 1.0
"""Lengths up to this one are often thought of in micrometres. [mm]"""


def checked(
    value: float, what: str, quantity: QuantityRange, *, inputs: tuple[str, ...] = ()
) -> float:
    """A number within the range of its quantity.

    Parameters
    ----------
    value : float
    what : str
        For the message: "the tip's diameter".
    quantity : QuantityRange
    inputs : tuple of str
        See `PretravelError`.

    Raises
    ------
    PretravelError
        Not a number, not finite, or outside the range.

    >>> checked(6.0, "the tip's diameter", TIP_BALL)
    6.0
    >>> checked(-1.0, "the noise", NOISE)
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the noise is -1 mm; it cannot be negative
    """
    try:
        if "_" in str(value):  # 1_0 is ten in a program of Python, and a mistake elsewhere
            raise ValueError
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        shown = str(value)[:40] if not isinstance(value, int) else "a number of too many digits"
        raise PretravelError(f"{what} is {shown}; it must be a number", inputs=inputs) from None
    if not quantity.lowest <= number <= quantity.highest:
        unit = f" {quantity.unit}" if quantity.unit else ""
        raise PretravelError(
            f"{what} is {number:g}{unit}; {_rule(number, quantity)}", inputs=inputs
        )
    return number


def _rule(number: float, quantity: QuantityRange) -> str:
    """What a refused number must be."""
    if quantity.lowest > 0.0 and not 0.0 < number < math.inf:
        return "it must be positive" + ("" if math.isfinite(number) else " and finite")
    if quantity.lowest == 0.0 and not 0.0 <= number < math.inf:
        return "it cannot be negative" if number < 0.0 else "it must be finite and not negative"
    unit = f" {quantity.unit}" if quantity.unit else ""
    rule = f"it must lie between {quantity.lowest:g} and {quantity.highest:g}{unit}"
    micrometres = quantity.unit == "mm" and quantity.highest <= _SMALL
    return f"{rule}. Were µm meant? 1 µm is 0.001 mm" if micrometres else rule


def check_numbers(owner: object, **quantities: QuantityRange) -> None:
    """Check attributes of an object; those that are None are not stated.

    Parameters
    ----------
    owner : object
    quantities : QuantityRange
        By the names of the attributes.

    Raises
    ------
    PretravelError
        See `checked`.
    """
    for name, quantity in quantities.items():
        value = getattr(owner, name)
        if value is not None:
            checked(value, f"the {name.replace('_', ' ')}", quantity, inputs=(name,))


_MOST_VALUES = 100_000
COMMAS_BETWEEN_NUMBERS = "the decimal sign is a point, as in 2.5; commas are between numbers"
"""Advice for a list of numbers with too many commas."""


def degrees_in(text: str) -> tuple[float, ...]:
    """Angles from ``start:stop:step`` (the stop included), ``a,b,c`` or one number.

    Parameters
    ----------
    text : str
        [deg]

    Returns
    -------
    tuple of float
        [deg]

    Raises
    ------
    PretravelError
        Another text; an angle that is out of range; too many angles.

    >>> degrees_in("0:30:10"), degrees_in("90")
    ((0.0, 10.0, 20.0, 30.0), (90.0,))
    """
    try:
        if "_" in text:
            raise ValueError
        numbers = tuple(float(part) for part in text.replace(":", ",").split(","))
        start, stop, step = numbers if ":" in text else (0.0, 0.0, 1.0)
    except ValueError:
        raise PretravelError(
            "expected one angle, a list 0,30,60 or start:stop:step in degrees"
            + (f"; {COMMAS_BETWEEN_NUMBERS}" if ":" in text and "," in text else "")
        ) from None
    checked_values(numbers, "an angle", DEGREES)
    if ":" not in text:
        return numbers
    if not step > 0.0 or stop < start:
        raise PretravelError(
            "in start:stop:step the stop must not lie below the start, with a step above 0"
        )
    count = int((stop - start) / step + 1e-9) + 1
    if count > _MOST_VALUES:
        raise PretravelError(f"{count} angles are more than {_MOST_VALUES}")
    return tuple(start + step * i for i in range(count))


def checked_values(values: npt.ArrayLike, what: str, quantity: QuantityRange) -> FloatArray:
    """Numbers within the range of their quantity, of any shape.

    Raises
    ------
    PretravelError
        Not numbers, not finite, or outside the range; it states the first.

    >>> checked_values([[0.0, 0.0, 25.0]], "the positions", COORDINATE).shape
    (1, 3)
    """
    import numpy as np  # with the first array: descriptions of commands do without

    array = as_numbers(values, what)
    inside = (array >= quantity.lowest) & (array <= quantity.highest)
    if not np.all(inside):
        checked(float(array[~inside].flat[0]), what, quantity)
    return array


def as_numbers(values: npt.ArrayLike, what: str) -> FloatArray:
    """Values as `frozen` numbers, which may be not finite.

    Raises
    ------
    PretravelError
        Text, complex numbers, or integers of too many digits.

    >>> as_numbers([10**400], "the positions")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the positions must be numbers, none of them too large
    """
    import numpy as np

    from pretravel.base.arrays import frozen

    try:
        if np.iscomplexobj(values):  # NumPy would take the real part
            raise TypeError
        return frozen(values)
    except (TypeError, ValueError, OverflowError):
        raise PretravelError(f"{what} must be numbers, none of them too large") from None


def _rounded(value: float) -> float:
    """Without the last digits, which come from the conversion of the unit."""
    return float(f"{value:.12g}") if math.isfinite(value) else value


def extent(values: npt.ArrayLike, decimals: int = 1) -> str:
    """The smallest and the largest of several numbers, in words.

    Parameters
    ----------
    values : (n,) float
        Those that are not numbers are left out.
    decimals : int

    >>> extent([2.0, 0.5, float("nan")]), extent([2.0]), extent([])
    ('0.5 to 2.0', '2.0', 'none')
    """
    import numpy as np

    numbers = np.asarray(values, dtype=np.float64)
    numbers = numbers[np.isfinite(numbers)]
    if not numbers.size:
        return "none"
    # Rounded first, so that no value is shown as -0.0.
    low, high = (
        f"{round(float(v), decimals) + 0.0:.{decimals}f}" for v in (numbers.min(), numbers.max())
    )
    return low if low == high else f"{low} to {high}"
