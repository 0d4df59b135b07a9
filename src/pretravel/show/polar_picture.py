"""A small polar picture as values: curves and dots over azimuth, for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.show.colours import LIGHT, Colour
from pretravel.show.formatting import significant, value_text

PICTURE_RADIUS, PICTURE_MARGIN = 88.0, 22.0
MOST_DOTS = 400
"""More dots are thinned out evenly; the picture says so."""
_RINGS = 3


@dataclass(frozen=True, eq=False)
class PolarSeries:
    """Values over azimuth.

    Attributes
    ----------
    name : str
    azimuths : (n,) float
        [rad]
    values : (n,) float
        In the unit of the picture; those that are not numbers are not drawn.
    colour : str
        Of `pretravel.show.colours`.
    closed : bool
        A closed curve in the order of the values; else dots.
    """

    name: str
    azimuths: FloatArray
    values: FloatArray
    colour: Colour
    closed: bool = False


@dataclass(frozen=True)
class DrawnSeries:
    """A series in the coordinates of the picture: the path of a curve, or dots."""

    name: str
    colour: str
    path: str
    dots: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class PolarPicture:
    """What a template draws.

    Attributes
    ----------
    title : str
    size : float
        Width and height of the square.
    rings : tuple of (radius, text)
        Circles and their values with the unit.
    series : tuple of DrawnSeries
    note : str
        What is not drawn.
    start : str
        What the direction to the right is.
    """

    title: str
    size: float
    rings: tuple[tuple[float, str], ...]
    series: tuple[DrawnSeries, ...]
    note: str = ""
    start: str = "0°"


def polar_picture(
    title: str, unit: str, series: Sequence[PolarSeries], *, start: str = "0°"
) -> PolarPicture | None:
    """Place curves and dots; azimuth 0 is at the right, +90° at the top.

    Parameters
    ----------
    title : str
    unit : str
        Of the values.
    series : sequence of PolarSeries
        The centre is zero, or a lower value where there are negative ones.
    start : str
        What the direction to the right is.

    Returns
    -------
    PolarPicture or None
        None where there is no finite value.
    """
    parts = [each.values[np.isfinite(each.values)] for each in series]
    numbers = np.concatenate([*parts, np.empty(0)])
    if not numbers.size:
        return None
    step = _step(max(float(numbers.max()), 0.0) - min(float(numbers.min()), 0.0))
    low = step * math.floor(min(float(numbers.min()), 0.0) / step)
    high = step * max(math.ceil(float(numbers.max()) / step), round(low / step) + 1)
    rings = tuple(
        (PICTURE_RADIUS * (value - low) / (high - low), value_text(value, unit, significant(4)))
        for value in (low + step * np.arange(1, round((high - low) / step) + 1)).tolist()
    )
    drawn = tuple(_drawn(each, low, high) for each in series)
    most = max((len(each.values) for each in series if not each.closed), default=0)
    note = f"{MOST_DOTS} of {most:,} dots are drawn" if most > MOST_DOTS else ""
    return PolarPicture(title, 2 * (PICTURE_RADIUS + PICTURE_MARGIN), rings, drawn, note, start)


def _step(span: float) -> float:
    """The distance of rings: 1, 2 or 5 times a power of ten, two to four of them.

    >>> _step(12.0), _step(0.9)
    (5.0, 0.5)
    """
    if span <= 0.0:
        return 1.0
    power: float = 10.0 ** math.floor(math.log10(span / _RINGS))
    return next(power * n for n in (1.0, 2.0, 5.0, 10.0) if span / (power * n) <= _RINGS)


def _drawn(series: PolarSeries, low: float, high: float) -> DrawnSeries:
    azimuths, values = series.azimuths, series.values
    if not series.closed and len(values) > MOST_DOTS:
        rows = np.linspace(0, len(values) - 1, MOST_DOTS).astype(int)
        azimuths, values = azimuths[rows], values[rows]
    radius = PICTURE_RADIUS * (values - low) / (high - low)
    middle = PICTURE_RADIUS + PICTURE_MARGIN
    x, y = middle + radius * np.cos(azimuths), middle - radius * np.sin(azimuths)
    places = [(round(float(a), 1), round(float(b), 1)) for a, b in zip(x, y, strict=True)]
    kept = np.isfinite(values)
    if series.closed:
        return DrawnSeries(series.name, LIGHT[series.colour], _path(places, kept.tolist()), ())
    dots = tuple(place for place, there in zip(places, kept, strict=True) if there)
    return DrawnSeries(series.name, LIGHT[series.colour], "", dots)


def _path(places: Sequence[tuple[float, float]], kept: Sequence[bool]) -> str:
    """A closed path, with gaps where values are missing."""
    around = [*range(len(places)), 0] if all(kept) else list(range(len(places)))
    words, before = [], False
    for index in around:
        if kept[index]:
            x, y = places[index]
            words.append(f"{'L' if before else 'M'}{x:g} {y:g}")
        before = kept[index]
    return "".join(words)
