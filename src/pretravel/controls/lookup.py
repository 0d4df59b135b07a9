"""A map in a form that a control can work out: a series, six seats, or an interpolated table."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import azimuth_angle, grid, polar_angle
from pretravel.errors import PretravelError
from pretravel.maps.basis import CondensedProbe, SeriesForm, SixSeatForm
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.units import DEGREE, MICROMETRE

_FINE = 1.0 * DEGREE
"""Steps of the directions over which errors of a form are looked for. [rad]"""
_LADDER = (30.0, 20.0, 15.0, 10.0, 7.5, 6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0)
"""Steps of tables that are tried, degrees."""


@dataclass(frozen=True)
class Band:
    """Polar angles between which a map is supported all around. [rad]"""

    lowest: float
    highest: float


def supported_band(pretravel_map: PretravelMap) -> Band:
    """The widest range of polar angles in which every azimuth is supported.

    Parameters
    ----------
    pretravel_map : PretravelMap

    Returns
    -------
    Band

    Raises
    ------
    PretravelError
        There is none: the map holds in some azimuths only.
    """
    polar = np.arange(0.0, 180.0 + 1e-9, 0.25) * DEGREE
    azimuth = np.arange(0.0, 360.0, 3.0) * DEGREE
    held = pretravel_map.support.supports(grid(polar, azimuth)).reshape(len(polar), -1).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    if not len(edges):
        raise PretravelError(
            "the map does not hold all around the probe's axis at any polar angle, and a control's "
            "table does: touch the reference all around, or export to csv"
        )
    starts, stops = edges[::2], edges[1::2] - 1
    widest = int(np.argmax(stops - starts))
    return Band(float(polar[starts[widest]]), float(polar[stops[widest]]))


@dataclass(frozen=True, eq=False)
class LookupSeries:
    """Real spherical harmonics, summed by order.

    Attributes
    ----------
    cosines, sines : (d + 1, d + 1) float
        Of degree and order; functions of mean square one over the sphere. [mm]
    band : Band
    largest_error : float
        Against the map, within the band. [mm]
    """

    cosines: FloatArray
    sines: FloatArray
    band: Band
    largest_error: float = 0.0

    @property
    def orders(self) -> list[int]:
        """Orders with anything in them."""
        used = np.any((self.cosines != 0.0) | (self.sines != 0.0), axis=0)
        return [int(order) for order in np.flatnonzero(used)]

    def highest_degree(self, order: int) -> int:
        """Highest degree of an order that is in use."""
        used = (self.cosines[:, order] != 0.0) | (self.sines[:, order] != 0.0)
        return int(np.flatnonzero(used)[-1])

    def value(self, directions: FloatArray) -> FloatArray:
        """What a control works out, step by step as it does it: (n,). [mm]"""
        z = directions[:, 2]
        across = np.hypot(directions[:, 0], directions[:, 1])
        azimuth = azimuth_angle(directions)
        total = np.zeros(len(directions))
        for order in self.orders:
            before = np.zeros(len(directions))
            now = sectoral_factor(order) * across**order
            for degree in range(order, self.highest_degree(order) + 1):
                if degree > order:
                    a, b = recurrence(degree, order)
                    before, now = now, a * z * now - b * before
                total += now * (
                    self.cosines[degree, order] * np.cos(order * azimuth)
                    + self.sines[degree, order] * np.sin(order * azimuth)
                )
        return total


def sectoral_factor(order: int) -> float:
    """Of the function of equal degree and order: it times the sine of polar to that power.

    >>> round(sectoral_factor(1), 6)
    1.732051
    """
    index = np.arange(2, order + 1)
    first = 1.0 if order == 0 else math.sqrt(3.0)
    return float(first * np.prod(np.sqrt((2 * index + 1) / (2 * index))))


def recurrence(degree: int, order: int) -> tuple[float, float]:
    """Factors a, b of P(l, m) = a z P(l-1, m) - b P(l-2, m), mean square one.

    >>> recurrence(1, 0)
    (1.7320508075688772, 0.0)
    """
    both = (degree - order) * (degree + order)
    a = math.sqrt((2 * degree - 1) * (2 * degree + 1) / both)
    if degree == order + 1:
        return a, 0.0
    b = math.sqrt(
        (2 * degree + 1) * (degree + order - 1) * (degree - order - 1) / (both * (2 * degree - 3))
    )
    return a, b


@dataclass(frozen=True, eq=False)
class LookupTable:
    """Pretravel over polar angle and azimuth in equal steps; cubic between (Catmull-Rom).

    Attributes
    ----------
    band : Band
        Polar angles of its first row of nodes and of its last but for the borders'.
    values : (p + 2, a) float
        Rows over polar angle, with one more before the first and after the last; columns over
        azimuth from zero, all around. [mm]
    largest_error : float
        Against the map, within the band. [mm]
    """

    band: Band
    values: FloatArray
    largest_error: float = 0.0

    @property
    def rows(self) -> int:
        """Rows of nodes, without the borders'."""
        return len(self.values) - 2

    @property
    def polar_step(self) -> float:
        """[rad]"""
        width = self.band.highest - self.band.lowest
        return width / (self.rows - 1) if width > 0.0 else float(_FINE)

    @property
    def azimuth_step(self) -> float:
        """[rad]"""
        return float(2.0 * math.pi / self.values.shape[1])

    @cached_property
    def number(self) -> int:
        """A number that tells this table from others."""
        return zlib.crc32(np.ascontiguousarray(self.values).tobytes()) % 900_000 + 100_000

    def value(self, directions: FloatArray) -> FloatArray:
        """What a control works out: (n,). [mm]"""
        columns = self.values.shape[1]
        down = (polar_angle(directions) - self.band.lowest) / self.polar_step
        i = np.clip(np.floor(down).astype(np.int64), 0, self.rows - 2)
        around = azimuth_angle(directions) / self.azimuth_step
        j = np.floor(around).astype(np.int64)
        weights_down = _catmull_rom(np.clip(down - i, 0.0, 1.0))
        weights_around = _catmull_rom(around - j)
        total = np.zeros(len(directions))
        for a in range(4):
            for b in range(4):
                node = self.values[i + a, (j + b - 1) % columns]
                total += weights_down[a] * weights_around[b] * node
        return total


def _catmull_rom(f: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Weights of four neighbours, at a share f from the second to the third."""
    return (
        0.5 * f * (f * (2.0 - f) - 1.0),
        0.5 * (f * f * (3.0 * f - 5.0) + 2.0),
        0.5 * f * (f * (4.0 - 3.0 * f) + 1.0),
        0.5 * f * f * (f - 1.0),
    )


def catmull_rom_text(share: str) -> tuple[str, str, str, str]:
    """The same weights as expressions of a control, of a variable that holds the share.

    >>> catmull_rom_text("#1")[3]
    '0.5*#1*#1*[#1-1]'
    """
    f = share
    return (
        f"0.5*{f}*[{f}*[2-{f}]-1]",
        f"0.5*[{f}*{f}*[3*{f}-5]+2]",
        f"0.5*{f}*[{f}*[4-3*{f}]+1]",
        f"0.5*{f}*{f}*[{f}-1]",
    )


def _with_borders(values: FloatArray) -> FloatArray:
    """One more row at either end, where a parabola through the three nearest leads."""
    if len(values) < 3:
        return np.vstack([values[:1], values, values[-1:]])
    before = 3.0 * values[0] - 3.0 * values[1] + values[2]
    after = 3.0 * values[-1] - 3.0 * values[-2] + values[-3]
    return np.vstack([before, values, after])


@dataclass(frozen=True, eq=False)
class LookupSeats:
    """Six seats: the trigger force in closed form, and what gives under it.

    Attributes
    ----------
    response : CondensedProbe
        With the criterion first_contact.
    scale, constant : float
        Of its pretravel, and added to it. [mm]
    shift : (3,) float
        Times the direction, added too. [mm]
    band : Band
    largest_error : float
        Against the map, within the band. [mm]
    """

    response: CondensedProbe
    scale: float
    constant: float
    shift: FloatArray
    band: Band
    largest_error: float = 0.0

    def value(self, directions: FloatArray) -> FloatArray:
        """What a control works out: (n,). [mm]"""
        own = self.response.pretravel(directions)
        return np.asarray(self.scale * own + self.constant + directions @ self.shift)


Lookup: TypeAlias = "LookupSeries | LookupSeats | LookupTable"


def exact_lookup(pretravel_map: PretravelMap) -> LookupSeries | LookupSeats | None:
    """The map's own formula where a control can work it out; None where it takes a table.

    Parameters
    ----------
    pretravel_map : PretravelMap
    """
    form = pretravel_map.basis.form_on_control(pretravel_map.coefficients)
    if isinstance(form, SeriesForm):
        return lookup_series(pretravel_map)
    if isinstance(form, SixSeatForm):
        return _lookup_seats(pretravel_map, form)
    return None


def _lookup_seats(pretravel_map: PretravelMap, form: SixSeatForm) -> LookupSeats:
    band = supported_band(pretravel_map)
    seats = LookupSeats(form.probe, form.scale, form.constant, form.shift, band)
    return replace(seats, largest_error=_Judge(pretravel_map, band).largest_error(seats))


def lookup_series(pretravel_map: PretravelMap) -> LookupSeries:
    """The map's own series: exact.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Of kind harmonic or mean.

    Raises
    ------
    PretravelError
        A map of another kind.
    """
    form = pretravel_map.basis.form_on_control(pretravel_map.coefficients)
    if not isinstance(form, SeriesForm):
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} is no series; export it as a table",
            inputs=("form",),
        )
    terms = form.terms
    size = int(terms[:, 0].max()) + 1
    cosines, sines = np.zeros((size, size)), np.zeros((size, size))
    for (degree, order), value in zip(terms, form.coefficients, strict=True):
        (sines if order < 0 else cosines)[degree, abs(order)] += value
    band = supported_band(pretravel_map)
    series = LookupSeries(frozen(cosines), frozen(sines), band)
    return replace(series, largest_error=_Judge(pretravel_map, band).largest_error(series))


def lookup_table(pretravel_map: PretravelMap, *, tolerance: float, most_values: int) -> LookupTable:
    """The coarsest table that keeps to a tolerance; else the finest that fits.

    Parameters
    ----------
    pretravel_map : PretravelMap
    tolerance : float
        Largest error against the map within the band. [mm]
    most_values : int
        Variables that the control has for it.

    Returns
    -------
    LookupTable

    Raises
    ------
    PretravelError
        Room for less than the coarsest table.
    """
    band = supported_band(pretravel_map)
    judge = _Judge(pretravel_map, band)
    width = (band.highest - band.lowest) / DEGREE
    best: LookupTable | None = None
    for polar_step in _LADDER:
        rows = max(round(width / polar_step), 1) + 1
        for azimuth_step in _LADDER:
            columns = round(360.0 / azimuth_step)
            # Steps of like size, azimuth up to three times finer: lobes are around the axis.
            fits = polar_step / 3.0 <= azimuth_step <= polar_step
            if not fits or (rows + 2) * columns > most_values:
                continue
            polar = np.linspace(band.lowest, band.highest, rows)
            azimuth = 2.0 * math.pi / columns * np.arange(columns)
            values = _value(pretravel_map, grid(polar, azimuth)).reshape(rows, columns)
            table = LookupTable(band, frozen(_with_borders(values)))
            error = judge.largest_error(table)
            if best is None or error < best.largest_error:
                best = replace(table, largest_error=error)
            if error <= tolerance:
                return best
    if best is None:
        raise PretravelError(
            f"{most_values} variables are too few for a table over polar angle and azimuth"
        )
    return best


def _value(pretravel_map: PretravelMap, directions: FloatArray) -> FloatArray:
    """Of directions in the probe frame. [mm]"""
    # The band's edge may lie within the support's margin, to the last digit outside it.
    return pretravel_map.pretravel(directions @ pretravel_map.rotation.T, extrapolate=True)


class _Judge:
    """A map in many directions of a band, against which forms are held."""

    def __init__(self, pretravel_map: PretravelMap, band: Band) -> None:
        # Off the nodes of tables, borders included.
        polar = np.arange(band.lowest + 0.15 * _FINE, band.highest, 0.37 * _FINE)
        polar = np.concatenate([[band.lowest], polar, [band.highest]])
        # Steps that share nothing with those of tables, whose nodes are exact.
        azimuth = np.arange(0.17, 360.0, 0.41) * DEGREE
        self.directions = grid(polar, azimuth)
        self.truth = _value(pretravel_map, self.directions)

    def largest_error(self, form: Lookup) -> float:
        """[mm]"""
        return float(np.max(np.abs(form.value(self.directions) - self.truth)))


def describe_form(form: Lookup) -> str:
    """What a form is, and its error, for the header of a file.

    >>> table = LookupTable(Band(0.0, math.pi / 2), np.zeros((4, 4)), 2e-5)
    >>> describe_form(table)
    'table of 2 x 4, cubic between; largest error against the map 0.020 um'
    """
    error = f"largest error against the map {form.largest_error / MICROMETRE:.3f} um"
    if isinstance(form, LookupTable):
        return f"table of {form.rows} x {form.values.shape[1]}, cubic between; {error}"
    if isinstance(form, LookupSeats):
        return f"six seats, in closed form; {error}"
    terms = int(np.sum(form.cosines != 0.0) + np.sum(form.sines != 0.0))
    return f"harmonic series of {terms} terms; {error}"
