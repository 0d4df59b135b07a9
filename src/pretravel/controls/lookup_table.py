"""Maps as tables over polar angle and azimuth, with cubic interpolation on the control."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, islice
from operator import itemgetter
from typing import ClassVar, TypeAlias

import numpy as np

from pretravel.base import (
    DEGREE,
    FloatArray,
    IntArray,
    PretravelError,
    azimuth_angle,
    frozen,
    grid,
    polar_angle,
)
from pretravel.controls.lookup import (
    Band,
    MapSamples,
    probe_frame_pretravel,
    supported_band,
)
from pretravel.maps import PretravelMap

_Weights: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
_STEP_OF_A_RING = 1.0 * DEGREE
"""Step of the polar angle where a band has no width. [rad]"""
_FEWEST_COLUMNS = 12
_AT_A_TIME = 16
"""Tables whose nodes are evaluated together: a call of the map takes as long as 300 nodes."""
_LADDER = (30.0, 20.0, 15.0, 10.0, 7.5, 6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0)
"""Steps of the tables that are tried. [degrees]"""


@dataclass(frozen=True, eq=False)
class LookupTable:
    """Pretravel over polar angle and azimuth in equal steps; cubic between (Catmull-Rom).

    Attributes
    ----------
    band : Band
        Polar angles of the first and the last row of nodes, borders not counted.
    values : (p + 2, a) float
        Rows over the polar angle, with one border row before the first and one after the last;
        columns over the azimuth from zero, all around. [mm]
    largest_error : float
        Largest difference from the map within the band. [mm]
    """

    template: ClassVar[str] = "linuxcnc/table_lookup.ngc"
    needs_table: ClassVar[bool] = True

    band: Band
    values: FloatArray
    largest_error: float = 0.0

    @property
    def rows(self) -> int:
        """Number of rows of nodes, without the borders."""
        return len(self.values) - 2

    @property
    def polar_step(self) -> float:
        """Step of the polar angle. [rad]"""
        width = self.band.highest - self.band.lowest
        return width / (self.rows - 1) if width > 0.0 else _STEP_OF_A_RING

    @property
    def azimuth_step(self) -> float:
        """Step of the azimuth. [rad]"""
        return float(2.0 * math.pi / self.values.shape[1])

    @cached_property
    def number(self) -> int:
        """A number that identifies this table."""
        return zlib.crc32(np.ascontiguousarray(self.values).tobytes()) % 900_000 + 100_000

    @property
    def description(self) -> str:
        """See `Lookup`."""
        return f"table of {self.rows} x {self.values.shape[1]}, cubic between"

    def template_values(self) -> Mapping[str, object]:
        """See `Lookup`."""
        return {
            "columns": self.values.shape[1],
            "polar_step_deg": self.polar_step / DEGREE,
            "azimuth_step_deg": self.azimuth_step / DEGREE,
            "catmull_rom": catmull_rom_text,
        }

    def value(self, directions: FloatArray) -> FloatArray:
        """See `Lookup`."""
        i, weights_down = self._rows_at(polar_angle(directions))
        j, weights_around = self._columns_at(azimuth_angle(directions))
        total = np.zeros(len(directions))
        for a in range(4):
            for b in range(4):
                node = self.values[i + a, (j + b - 1) % self.values.shape[1]]
                total += weights_down[a] * weights_around[b] * node
        return total

    def on_grid(self, polar: FloatArray, azimuth: FloatArray) -> FloatArray:
        """See `FormOnGrid`: rows between the nodes first, then all azimuths of each."""
        i, weights_down = self._rows_at(polar)
        j, weights_around = self._columns_at(azimuth)
        rows = sum(weights_down[a][:, None] * self.values[i + a] for a in range(4))
        columns = np.zeros((self.values.shape[1], len(azimuth)))
        for b in range(4):
            np.add.at(columns, ((j + b - 1) % len(columns), np.arange(len(j))), weights_around[b])
        return np.asarray(rows @ columns)

    def _rows_at(self, polar: FloatArray) -> tuple[IntArray, _Weights]:
        """First of the four rows about each polar angle, and their weights."""
        down = (polar - self.band.lowest) / self.polar_step
        i = np.clip(np.floor(down).astype(np.int64), 0, self.rows - 2)
        return i, _catmull_rom(np.clip(down - i, 0.0, 1.0))

    def _columns_at(self, azimuth: FloatArray) -> tuple[IntArray, _Weights]:
        """Second of the four columns about each azimuth, and their weights."""
        around = azimuth / self.azimuth_step
        j = np.floor(around).astype(np.int64)
        return j, _catmull_rom(around - j)


def _catmull_rom(f: FloatArray) -> _Weights:
    """Weights of four neighbours at a share f of the way from the second to the third."""
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
    """One more row at each end, on the parabola through the three nearest rows."""
    if len(values) < 3:
        return np.vstack([values[:1], values, values[-1:]])
    before = 3.0 * values[0] - 3.0 * values[1] + values[2]
    after = 3.0 * values[-1] - 3.0 * values[-2] + values[-3]
    return np.vstack([before, values, after])


def lookup_table(pretravel_map: PretravelMap, *, tolerance: float, most_values: int) -> LookupTable:
    """The coarsest table within a tolerance; where there is none, the most accurate one.

    Coarse tables are tried first. Where none of them is within the tolerance, every number of rows
    is tried with as many columns as there are variables.

    Parameters
    ----------
    pretravel_map : PretravelMap
    tolerance : float
        Largest difference from the map within the band. [mm]
    most_values : int
        Number of variables that the control has for the table.

    Raises
    ------
    PretravelError
        There are too few variables for the coarsest table.
    """
    table = lookup_table_within(
        pretravel_map, tolerance=tolerance, most_values=most_values, allowed=math.inf
    )
    assert table is not None
    return table


def lookup_table_within(
    pretravel_map: PretravelMap, *, tolerance: float, most_values: int, allowed: float
) -> LookupTable | None:
    """The same, or None where no table is within the error that is allowed at most. [mm]"""
    band = supported_band(pretravel_map)
    samples = MapSamples(pretravel_map, band)
    too_coarse: list[tuple[float, LookupTable]] = []
    sizes = chain(_sizes(band, most_values), _full_sizes(band, most_values))
    for table in _tables(pretravel_map, band, sizes):
        least = samples.error_at_least(table, max(tolerance, allowed))
        if least <= tolerance:
            error = samples.largest_error(table)
            if error <= tolerance:
                return replace(table, largest_error=error)
        too_coarse.append((least, table))
    if not too_coarse:
        raise PretravelError(
            f"{most_values} variables are too few for a table over polar angle and azimuth"
        )
    if min(least for least, _ in too_coarse) > allowed:
        return None
    table = _most_accurate(too_coarse, samples)
    return table if table.largest_error <= allowed else None


def _tables(
    pretravel_map: PretravelMap, band: Band, sizes: Iterator[tuple[int, int]]
) -> Iterator[LookupTable]:
    """Tables of rows and columns in turn; the map is evaluated for some of them at a time."""
    while some := list(islice(sizes, _AT_A_TIME)):
        nodes = [
            grid(
                np.linspace(band.lowest, band.highest, rows),
                2.0 * math.pi / columns * np.arange(columns),
            )
            for rows, columns in some
        ]
        values = probe_frame_pretravel(pretravel_map, np.concatenate(nodes))
        ends = np.cumsum([len(each) for each in nodes])[:-1]
        for size, own in zip(some, np.split(values, ends), strict=True):
            yield LookupTable(band, frozen(_with_borders(own.reshape(size))))


def _most_accurate(tables: list[tuple[float, LookupTable]], samples: MapSamples) -> LookupTable:
    """The table of the smallest error, of tables with errors that they have at least."""
    best: LookupTable | None = None
    for least, table in sorted(tables, key=itemgetter(0)):
        if best is not None and least > best.largest_error:
            break
        error = samples.largest_error(table)
        if best is None or error < best.largest_error:
            best = replace(table, largest_error=error)
    assert best is not None
    return best


def _sizes(band: Band, most_values: int) -> Iterator[tuple[int, int]]:
    """Rows and columns of the tables that are tried, coarse ones first."""
    width = (band.highest - band.lowest) / DEGREE
    for polar_step in _LADDER:
        rows = max(round(width / polar_step), 1) + 1
        for azimuth_step in _LADDER:
            columns = round(360.0 / azimuth_step)
            # Similar steps; that of the azimuth up to three times finer, because lobes lie there.
            similar = polar_step / 3.0 <= azimuth_step <= polar_step
            if similar and (rows + 2) * columns <= most_values:
                yield rows, columns


def _full_sizes(band: Band, most_values: int) -> Iterator[tuple[int, int]]:
    """Rows and columns that take all variables, or nearly so, for any number of rows."""
    if band.highest == band.lowest:
        return
    for rows in range(3, most_values // _FEWEST_COLUMNS - 1):
        columns = most_values // (rows + 2)
        # Lobes come in threes: nodes at the same places of each.
        yield from {(rows, columns), (rows, columns - columns % 3), (rows, columns - columns % 6)}
