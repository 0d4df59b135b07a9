"""The functions that maps are sums of: one radius, sectors, harmonics, tables, models."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from pretravel.arrays import FloatArray, IntArray
from pretravel.directions import azimuth_angle
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.maps.support import DirectionSupport
from pretravel.units import DEGREE


class MapBasis(Protocol):
    """Functions of direction that a map is a sum of."""

    @property
    def kind(self) -> str:
        """The word of the command line: mean, sectors, wozniak, harmonic, physical, tabulated."""
        ...

    @property
    def size(self) -> int:
        """Number of functions."""
        ...

    def design(self, directions: FloatArray) -> FloatArray:
        """Values of the functions at (n, 3) directions in the probe frame: (n, size)."""
        ...


@runtime_checkable
class KnowsDisplacement(Protocol):
    """A basis that tells where the tip goes, not only how far along the normal."""

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None = None
    ) -> FloatArray:
        """Of the tip at the trigger, compression included, (n, 3), probe frame. [mm]

        With principal curvatures (n, 2) of the part, its compression is that of the curved part.
        """
        ...


@runtime_checkable
class KnowsValue(Protocol):
    """A basis that sums faster than by forming every one of its functions."""

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        """What ``design(directions) @ coefficients`` is, (n,). [mm]"""
        ...


@dataclass(frozen=True)
class MeanBasis:
    """One number for all directions: the mean effective radius of today's controls.

    >>> MeanBasis().design(np.array([[0.0, 0.0, 1.0]])).tolist()
    [[1.0]]
    """

    kind: str = "mean"
    size: int = 1

    def design(self, directions: FloatArray) -> FloatArray:
        return np.ones((len(directions), 1))


SECTOR_NAMES = ("X", "Y", "30", "60", "120", "150", "210", "240", "300", "330")
"""Radii of the vector table of a control: one for both X directions, one for both Y,
eight at the angles (in degrees) of their names."""

_SECTOR_OF_TWELFTH = np.array([0, 2, 3, 1, 4, 5, 0, 6, 7, 1, 8, 9])


@dataclass(frozen=True)
class SectorBasis:
    """The nearest of ten radii in the xy plane, as vector tables of controls have it.

    Radii at 30, 60, 120, 150, 210, 240, 300 and 330 degrees, one shared by +X and
    -X, one shared by +Y and -Y; the nearest in azimuth is taken, whatever the
    polar angle. Halfway between two sectors both count half. For comparison: it leaves up to
    0.71 of a lobe's amplitude in a sector, and all of it where opposite directions share one.

    >>> basis = SectorBasis()
    >>> SECTOR_NAMES[int(basis.design(np.array([[0.8, 0.6, 0.0]])).argmax())]
    '30'
    """

    kind: str = "sectors"
    size: int = len(SECTOR_NAMES)

    def design(self, directions: FloatArray) -> FloatArray:
        twelfths = azimuth_angle(directions) / (30.0 * DEGREE)
        lower = np.floor(twelfths)
        fraction = twelfths - lower
        # The 1e-6 keeps a touch meant for 45° a tie however its decimals fall.
        upper_share = np.where(np.abs(fraction - 0.5) < 1e-6, 0.5, (fraction > 0.5) * 1.0)
        rows = np.arange(len(directions))
        design = np.zeros((len(directions), self.size))
        first = lower.astype(np.int64) % 12
        np.add.at(design, (rows, _SECTOR_OF_TWELFTH[first]), 1.0 - upper_share)
        np.add.at(design, (rows, _SECTOR_OF_TWELFTH[(first + 1) % 12]), upper_share)
        # On the axis there is no azimuth: all ten alike.
        on_axis = np.hypot(directions[:, 0], directions[:, 1]) < 0.5 * DEGREE
        design[on_axis] = 1.0 / self.size
        return design


@dataclass(frozen=True, eq=False)
class HarmonicBasis:
    """Real spherical harmonics about the probe axis.

    Parameters
    ----------
    terms : (k, 2) int
        Degree and order of each function.

    >>> HarmonicBasis(np.array([[0, 0], [3, 3]])).size
    2
    """

    terms: IntArray
    kind: str = "harmonic"

    @property
    def size(self) -> int:
        return len(self.terms)

    def design(self, directions: FloatArray) -> FloatArray:
        return real_spherical_harmonics(directions, self.terms)


@dataclass(frozen=True, eq=False)
class TabulatedBasis:
    """Linear interpolation between nodes on the sphere, as predicted maps have it.

    Parameters
    ----------
    support : DirectionSupport
        The nodes; one coefficient each.
    """

    support: DirectionSupport
    kind: str = "tabulated"

    @property
    def size(self) -> int:
        return len(self.support.nodes)

    def design(self, directions: FloatArray) -> FloatArray:
        nodes, weights, _ = self.support.interpolation(directions)
        design = np.zeros((len(directions), self.size))
        np.add.at(design, (np.arange(len(directions))[:, None], nodes), weights)
        return design

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        nodes, weights, _ = self.support.interpolation(directions)
        return np.asarray(np.sum(coefficients[nodes] * weights, axis=1))


TRANSDUCERS = ("contact", "piezo")
"""What switches: electric contacts at three arms (lobes), or a piezo element (none)."""

_LOBE = 2.0 * math.pi / 3.0


@dataclass(frozen=True)
class WozniakBasis:
    r"""Woźniak's simple map: one constant, lobes of known shape.

    Pretravel is A cos²γ / cos((β mod 120°) - 60°): γ is the elevation above the
    equator, β the azimuth from a lobe. It is A between lobes, 2 A on them and
    nothing along the axis. With a piezo transducer the lobes are absent.

    Parameters
    ----------
    lobe_azimuth : float
        Azimuth of a lobe, where pretravel is largest: opposite a rod. [rad]
    transducer : str
        contact or piezo.

    Notes
    -----
    Three functions: the shape, its slope with the lobe's azimuth, and a constant. Maps
    have the coefficients (A, 0, 0); the other two carry the variances of the azimuth and of
    what this shape misses.

    References
    ----------
    Woźniak, equation 4, its angle folded about the middle of a lobe (as printed it has a
    pole).

    >>> basis = WozniakBasis(0.0)
    >>> n = np.array([[1.0, 0.0, 0.0], [0.5, math.sqrt(0.75), 0.0], [0.0, 0.0, 1.0]])
    >>> basis.design(n)[:, 0].round(9).tolist()
    [2.0, 1.0, 0.0]
    """

    lobe_azimuth: float
    transducer: str = "contact"
    kind: str = "wozniak"
    size: int = 3

    def design(self, directions: FloatArray) -> FloatArray:
        across = directions[:, 0] ** 2 + directions[:, 1] ** 2
        shape, slope = np.ones(len(across)), np.zeros(len(across))
        if self.transducer == "contact":
            folded = np.mod(azimuth_angle(directions) - self.lobe_azimuth, _LOBE) - 0.5 * _LOBE
            shape = 1.0 / np.cos(folded)
            slope = -shape * np.tan(folded)
        return np.stack([across * shape, across * slope, np.ones(len(across))], axis=1)
