"""A map in a form that a control evaluates: its range of directions and its error.

The forms are the map's own formula (`pretravel.controls.lookup_formula`) and an interpolated table
(`pretravel.controls.lookup_table`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, PretravelError, from_angles, grid
from pretravel.maps import DirectionSupport, PretravelMap

_FINE = 1.0 * DEGREE
"""Scale of the steps between the directions at which a form is compared with its map. [rad]"""


@dataclass(frozen=True)
class Band:
    """The polar angles between which a map is supported at every azimuth. [rad]"""

    lowest: float
    highest: float


def supported_band(pretravel_map: PretravelMap) -> Band:
    """The widest range of polar angles in which every azimuth is supported.

    Raises
    ------
    PretravelError
        There is no such range: the map holds at some azimuths only.
    """
    return _band_of(pretravel_map.support)


@lru_cache(maxsize=8)
def _band_of(support: DirectionSupport) -> Band:
    """The same; formula and table of one map ask for it."""
    polar = np.arange(0.0, 180.0 + 1e-9, 0.25) * DEGREE
    azimuth = np.arange(0.0, 360.0, 3.0) * DEGREE
    held = np.ones(len(polar), dtype=bool)
    # A few azimuths first: most rows outside the band fail there, and such directions cost time.
    for some in (azimuth[::8], azimuth[np.arange(len(azimuth)) % 8 > 0]):
        rows = np.flatnonzero(held)
        supported = support.supports(grid(polar[rows], some))
        held[rows] = supported.reshape(len(rows), len(some)).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    if not len(edges):
        raise PretravelError(
            "the map does not hold all around the probe's axis at any polar angle, but a control "
            "needs all azimuths: touch the reference all around, or export the map to csv"
        )
    starts, stops = edges[::2], edges[1::2] - 1
    widest = int(np.argmax(stops - starts))
    return Band(float(polar[starts[widest]]), float(polar[stops[widest]]))


class Lookup(Protocol):
    """A map in a form that a control evaluates."""

    template: ClassVar[str]
    """Template of the subroutine's part for LinuxCNC that evaluates the form."""

    needs_table: ClassVar[bool]
    """Whether the control needs the values of a table in its variables."""

    @property
    def band(self) -> Band:
        """The polar angles for which the form holds."""
        ...

    @property
    def largest_error(self) -> float:
        """The largest difference from the map within the band. [mm]"""
        ...

    @property
    def description(self) -> str:
        """The form in words, for the header of a file."""
        ...

    def value(self, directions: FloatArray) -> FloatArray:
        """The pretravel that a control computes at (n, 3) directions, probe frame: (n,). [mm]"""
        ...

    def template_values(self) -> Mapping[str, object]:
        """The names that the template uses besides the form itself."""
        ...


@runtime_checkable
class FormOnGrid(Protocol):
    """A form that is evaluated faster at all azimuths of each polar angle than one by one."""

    def on_grid(self, polar: FloatArray, azimuth: FloatArray) -> FloatArray:
        """As `Lookup.value`, at each polar angle (p,) and azimuth (a,): (p, a). [mm]"""
        ...


def describe_form(form: Lookup) -> str:
    """A form and its error, for the header of a file.

    >>> from pretravel.controls.lookup_table import LookupTable
    >>> table = LookupTable(Band(0.0, np.pi / 2), np.zeros((4, 4)), 2e-5)
    >>> describe_form(table)
    'table of 2 x 4, cubic between; largest difference from the map 0.020 um'
    """
    error = f"{form.largest_error / MICROMETRE:.3f} um"
    return f"{form.description}; largest difference from the map {error}"


def probe_frame_pretravel(pretravel_map: PretravelMap, directions: FloatArray) -> FloatArray:
    """Pretravel of a map at (n, 3) directions in the probe frame, (n,). [mm]"""
    # The band's edge may lie in the support's margin, outside it by the last digit.
    return pretravel_map.pretravel(directions @ pretravel_map.rotation.T, extrapolate=True)


_AZIMUTH_STEP = 0.41 * DEGREE
"""Between the directions in which forms are compared with their map; no part of steps of tables."""
FEW = 29
"""One direction in so many is a first look; a prime number, so that all azimuths occur."""


class MapSamples:
    """The values of a map at many directions of a band, to compare forms with.

    Parameters
    ----------
    pretravel_map : PretravelMap
    band : Band
    every : int
        One of so many directions is looked at. A formula differs from its map by rounding alone:
        one of `FEW` tells the same as all.
    """

    def __init__(self, pretravel_map: PretravelMap, band: Band, every: int = 1) -> None:
        self._map, self._band, self._step = pretravel_map, band, every

    @cached_property
    def _grid(self) -> tuple[FloatArray, FloatArray]:
        """Polar angles and azimuths: the borders, and not the nodes, where a table is exact."""
        band = self._band
        polar = np.arange(band.lowest + 0.15 * _FINE, band.highest, 0.37 * _FINE)
        polar = np.concatenate([[band.lowest], polar, [band.highest]])
        return polar, np.arange(0.17 * DEGREE, 2.0 * np.pi, _AZIMUTH_STEP)

    def _every(self, step: int) -> tuple[FloatArray, FloatArray]:
        """One of so many directions, and the map there."""
        polar, azimuth = self._grid
        row, column = np.divmod(np.arange(0, len(polar) * len(azimuth), step), len(azimuth))
        directions = from_angles(polar[row], azimuth[column])
        return directions, probe_frame_pretravel(self._map, directions)

    @cached_property
    def _all(self) -> tuple[FloatArray, FloatArray]:
        return self._every(self._step)

    @cached_property
    def _few(self) -> tuple[FloatArray, FloatArray]:
        return self._every(self._step * FEW)

    def largest_error(self, form: Lookup) -> float:
        """The largest difference between the map and its form on the control. [mm]"""
        directions, values = self._all
        if self._step == 1 and isinstance(form, FormOnGrid):
            return float(np.max(np.abs(form.on_grid(*self._grid).ravel() - values)))
        return _largest_error(form, directions, values)

    def error_at_least(self, form: Lookup, enough: float = np.inf) -> float:
        """The same at a few of the directions: the largest of all is not less. [mm]

        At still fewer of them, where the error is larger than `enough` there.
        """
        directions, values = self._few
        least = _largest_error(form, directions[::FEW], values[::FEW])
        return least if least > enough else _largest_error(form, directions, values)


def _largest_error(form: Lookup, directions: FloatArray, values: FloatArray) -> float:
    return float(np.max(np.abs(form.value(directions) - values)))
