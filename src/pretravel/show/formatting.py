"""Numbers of a document as text: the one place where a number is formatted."""

from __future__ import annotations

import math
import re

import numpy as np

from pretravel.base import DEGREE, FloatArray, azimuth_angle, polar_angle
from pretravel.show.document import Column, Digits, FigureValue, KeyFigure, Span
from pretravel.uncertainty import COVERAGE_FACTOR

UNKNOWN = "unknown"


def decimals(count: int) -> Digits:
    """Digits after the point."""
    return Digits(count)


def signed_decimals(count: int) -> Digits:
    """Digits after the point, with the sign of a positive number."""
    return Digits(count, signed=True)


def significant(count: int) -> Digits:
    """Digits from the first that is not zero; zeros at the end are left out."""
    return Digits(count, significant=True)


def by_uncertainty(u: float, *, signed: bool = False) -> Digits:
    """Digits of a value of which two of its uncertainty count; both in the unit that is shown.

    >>> [number_text(12.34567, by_uncertainty(u)) for u in (3.1, 0.26, 0.0049)]
    ['12.3', '12.35', '12.3457']
    >>> number_text(12.34567, by_uncertainty(240.0)), number_text(1.5, by_uncertainty(math.nan))
    ('12', '1.50')
    """
    if not 0.0 < u < math.inf:
        return Digits(2, signed=signed)
    return Digits(max(1 - math.floor(math.log10(u)), 0), signed=signed)


def shown_unit(unit: str) -> str:
    """A unit of a file, as people read it.

    >>> shown_unit("um"), shown_unit("N")
    ('µm', 'N')
    """
    return {"um": "µm", "deg": "°"}.get(unit, unit)


def words_of_key(key: str) -> tuple[str, str]:
    """What a key of a settings file means, in words, and its unit.

    >>> words_of_key("seats.support_angle_deg"), words_of_key("stylus.sections.0.material")
    (('seats: support angle', '°'), ('stylus: sections 0: material', ''))
    """
    name, _, unit = key.rpartition("_")
    known = name and unit in ("N", "mm", "deg", "um", "MPa", "K", "ms")
    words = name if known else key
    words = re.sub(r"\.(\d+)\b", r" \1", words)
    return words.replace("_", " ").replace(".", ": "), shown_unit(unit) if known else ""


def number_text(value: float, digits: Digits = Digits()) -> str:
    """A number as text.

    Returns
    -------
    str
        A value that is not a number is "unknown"; zero has no sign.

    >>> number_text(-0.001), number_text(2.5, signed_decimals(1)), number_text(0.00012345)
    ('0.00', '+2.5', '0.00')
    >>> number_text(12.3456, significant(3)), number_text(math.inf), number_text(math.nan)
    ('12.3', '∞', 'unknown')
    """
    if math.isnan(value):
        return UNKNOWN
    if math.isinf(value):
        return "∞" if value > 0.0 else "-∞"
    sign = "+" if digits.signed else ""
    if digits.significant:
        return f"{value + 0.0:{sign}.{digits.count}g}"
    # Rounded first, so that no value is shown as -0.00.
    return f"{round(value, digits.count) + 0.0:{sign}.{digits.count}f}"


def value_text(value: FigureValue, unit: str = "", digits: Digits = Digits()) -> str:
    """A number, vector, range or word with its unit.

    >>> value_text(Span(1.0, 2.5), "µm", decimals(1)), value_text((0.0, 1.0), "mm", decimals(0))
    ('1.0 to 2.5 µm', '(0, 1) mm')
    >>> value_text(30.0, "°", decimals(0)), value_text(math.nan, "µm")
    ('30°', 'unknown')
    """
    if isinstance(value, str):
        return value
    if isinstance(value, Span):
        low, high = number_text(value.low, digits), number_text(value.high, digits)
        text = low if low == high else f"{low} to {high}"
    elif isinstance(value, tuple):
        text = f"({', '.join(number_text(v, digits) for v in value)})"
    else:
        text = number_text(value, digits)
    if not unit or text == UNKNOWN:
        return text
    return f"{text}{unit}" if unit == "°" else f"{text} {unit}"


def figure_text(figure: KeyFigure) -> str:
    """A key figure with its unit, its uncertainty and its remark.

    >>> figure_text(KeyFigure("radius", 2.9836, "mm", decimals(4), 0.06, "µm", decimals(2)))
    '2.9836 mm, u = 0.06 µm'
    >>> figure_text(KeyFigure("spread", 0.3, "µm", interval=Span(0.2, 0.5), remark="3 touches"))
    '0.30 µm, 95 % interval 0.20 to 0.50 µm (3 touches)'
    """
    return value_text(figure.value, figure.unit, figure.digits) + addition_text(figure)


def addition_text(figure: KeyFigure) -> str:
    """What follows the value of a key figure: uncertainty, interval and remark."""
    text = f", u = {uncertainty_text(figure)}" if figure.u is not None else ""
    if figure.interval is not None:
        text += f", 95 % interval {value_text(figure.interval, figure.unit, figure.digits)}"
    if figure.remark:
        text += f" ({figure.remark})"
    return text


def uncertainty_text(figure: KeyFigure) -> str:
    """The standard uncertainty of a key figure with its unit; empty where there is none."""
    if figure.u is None:
        return ""
    return value_text(figure.u, figure.u_unit or figure.unit, figure.u_digits or figure.digits)


def heading_text(column: Column) -> str:
    """The heading of a column: its name and unit."""
    return f"{column.name}/{column.unit}" if column.unit else column.name


def cell_texts(column: Column) -> list[str]:
    """The cells of a column; a value that is not a number is an empty cell.

    >>> cell_texts(Column("u", (0.5, math.nan, "as given")))
    ['0.50', '', 'as given']
    >>> cell_texts(Column.of("u", (0.5, 12.34), "", (decimals(2), decimals(1))))
    ['0.50', '12.3']
    """
    digits = column.digits_of_rows or (column.digits,) * len(column.values)
    return [
        value if isinstance(value, str) else "" if math.isnan(value) else number_text(value, each)
        for value, each in zip(column.values, digits, strict=True)
    ]


def expanded_text(figure: KeyFigure) -> str:
    """The expanded uncertainty U = k · u of a key figure with its unit; empty where u is unknown.

    A coverage factor of the figure's own is stated.

    >>> expanded_text(KeyFigure("radius", 2.9836, "mm", decimals(4), 0.06, "µm", decimals(2)))
    '0.12 µm'
    >>> expanded_text(KeyFigure("size", 3.0, "µm", u=0.5, coverage_factor=2.87))
    '1.44 µm (k = 2.87)'
    """
    if figure.u is None:
        return ""
    u = figure.u if isinstance(figure.u, tuple) else (figure.u,)
    own = figure.coverage_factor
    expanded = tuple((COVERAGE_FACTOR if own is None else own) * part for part in u)
    text = value_text(
        expanded if isinstance(figure.u, tuple) else expanded[0],
        figure.u_unit or figure.unit,
        figure.u_digits or figure.digits,
    )
    return text if own is None else f"{text} (k = {number_text(own)})"


def remark_text(figure: KeyFigure) -> str:
    """The coverage interval and the remark of a key figure.

    >>> remark_text(KeyFigure("spread", 0.3, "µm", interval=Span(0.2, 0.5), remark="3 touches"))
    '95 % interval 0.20 to 0.50 µm; 3 touches'
    """
    interval = figure.interval
    words = [] if interval is None else [
        f"95 % interval {value_text(interval, figure.unit, figure.digits)}"
    ]  # fmt: skip
    return "; ".join([*words, *([figure.remark] if figure.remark else [])])


def angles_deg(directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Polar angle and azimuth, (n,) each; the azimuth from 0 to below 360. [deg]

    Parameters
    ----------
    directions : (n, 3) float

    >>> angles_deg(np.array([[0.0, -1.0, 0.0]]))
    (array([90.]), array([270.]))
    """
    azimuth = np.round(azimuth_angle(directions) / DEGREE, 9) % 360.0
    return np.asarray(polar_angle(directions) / DEGREE), azimuth
