"""Kind sectors: the nearest of eight sector radii and two axis radii, in one plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, azimuth_angle, polar_angle
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.kind import KindOfMap, MapFit
from pretravel.maps.kinds.mean import averaged
from pretravel.maps.observation import Observation, Scatter

SECTOR_NAMES = ("X", "Y", "30", "60", "120", "150", "210", "240", "300", "330")
"""Radii of the vector table of a control: one for both X directions, one for both Y directions,
eight at the angles (in degrees) that are their names."""

NEAR_EQUATOR = 60.0 * DEGREE
"""Sector tables are made from touches with at least this polar angle. [rad]"""

_SECTOR_OF_TWELFTH = np.array([0, 2, 3, 1, 4, 5, 0, 6, 7, 1, 8, 9])


@dataclass(frozen=True)
class SectorBasis(MapBasis):
    """The nearest of ten radii in the xy plane, as vector tables of controls use them.

    There are radii at 30, 60, 120, 150, 210, 240, 300 and 330 degrees, one that +X and -X share,
    and one that +Y and -Y share. The radius nearest in azimuth is used at every polar angle.
    Halfway between two sectors both count half. Such a table leaves up to 0.71 of the amplitude
    of a lobe within a sector, and all of it where opposite directions share a radius.

    >>> basis = SectorBasis()
    >>> SECTOR_NAMES[int(basis.design(np.array([[0.8, 0.6, 0.0]])).argmax())]
    '30'
    """

    kind: ClassVar[str] = "sectors"
    follows_probe: ClassVar[bool] = False

    @property
    def size(self) -> int:
        return len(SECTOR_NAMES)

    @property
    def constant(self) -> FloatArray:
        return np.ones(self.size)

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

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        del stored
        return cls()


@dataclass(frozen=True)
class SectorsKind(KindOfMap):
    """The mean of each sector over the touches near the equator that fall into it."""

    name: ClassVar[str] = "sectors"
    title: ClassVar[str] = "sector table"
    summary: ClassVar[str] = "a table"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (SectorBasis,)
    takes_means: ClassVar[bool] = True
    needs_all_directions: ClassVar[bool] = True

    def fit(self, observation: Observation, repeats: Scatter) -> MapFit:
        del repeats
        return averaged(
            observation, SectorBasis(), lambda centred, _: _sector_values(observation, centred)
        )

    def refit(self, fit: MapFit, observation: Observation) -> MapFit:
        del fit
        return self.fit(observation, Scatter(0.0, 0.0))


def _sector_values(observation: Observation, centred: FloatArray) -> FloatArray:
    near = polar_angle(observation.directions) >= NEAR_EQUATOR - 1e-6
    share = SectorBasis().design(observation.directions[near])
    weight = share.sum(axis=0)
    if np.any(weight == 0.0):
        empty = [
            f"the sector at {name}°" if name.isdigit() else f"the sector {name}"
            for name, w in zip(SECTOR_NAMES, weight, strict=True)
            if w == 0.0
        ]
        raise PretravelError(
            f"no touch near the equator (polar 60° or more) falls into {' or '.join(empty)}. A "
            "sector table needs touches at every 30° of azimuth; the kinds mean and harmonic need "
            "fewer"
        )
    return np.asarray(share.T @ centred[near] / weight)
