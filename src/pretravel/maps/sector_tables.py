"""Tables of controls over the azimuth: eight sectors and two axis radii, and what they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import from_angles
from pretravel.errors import PretravelError
from pretravel.maps.kinds.sectors import SECTOR_NAMES, SectorBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.units import DEGREE

CRITERIA = ("max", "rms")
_STEP = 0.5  # degrees, boundaries of sectors among them
_EQUATOR = 0.5 * np.pi


@dataclass(frozen=True, eq=False)
class SectorTable:
    """Ten radii, and how far their nearest-sector lookup stays off the map on the equator.

    Attributes
    ----------
    pretravel : (10,) float
        In the order of `SECTOR_NAMES`. [mm]
    largest, rms : float
        Of lookup less map. [mm]
    """

    pretravel: FloatArray
    largest: float
    rms: float


def equator(pretravel_map: PretravelMap, azimuth_deg: FloatArray) -> FloatArray:
    """The map's values on the equator of the machine's axes, (n,). [mm]

    Raises
    ------
    ExtrapolationError
        A map that does not hold there.
    """
    return pretravel_map.pretravel(from_angles(_EQUATOR, azimuth_deg * DEGREE))


def touched_sectors(pretravel_map: PretravelMap) -> SectorTable:
    """The table as a control fills it: radii touched at the angles of their names.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Stands for the probe.

    Returns
    -------
    SectorTable
    """
    angles = [[0.0, 180.0], [90.0, 270.0], *([float(name)] for name in SECTOR_NAMES[2:])]
    values = [float(np.mean(equator(pretravel_map, np.array(own)))) for own in angles]
    return _judged(pretravel_map, np.array(values))


def resampled_sectors(pretravel_map: PretravelMap, criterion: str = "max") -> SectorTable:
    """The table that leaves the least of the map.

    Parameters
    ----------
    pretravel_map : PretravelMap
    criterion : str
        ``max``: the largest residual is as small as it can be; ``rms``: their mean square is.

    Returns
    -------
    SectorTable

    Raises
    ------
    PretravelError
        Another criterion.

    Notes
    -----
    Sectors do not overlap, so each radius is the middle of the map's range over its own
    directions (or the mean), both of its opposite sectors for X and Y.
    """
    if criterion not in CRITERIA:
        raise PretravelError(f"--criterion {criterion}: it is {' or '.join(CRITERIA)}")
    weight, value = _samples(pretravel_map)
    found = []
    for sector in range(len(SECTOR_NAMES)):
        own = value[weight[:, sector] > 0.0]
        if criterion == "max":
            found.append(0.5 * float(own.min() + own.max()))
        else:
            share = weight[:, sector]
            found.append(float(np.sum(share * value) / np.sum(share)))
    return _judged(pretravel_map, np.array(found))


def _samples(pretravel_map: PretravelMap) -> tuple[FloatArray, FloatArray]:
    azimuth = np.arange(0.0, 360.0, _STEP)
    weight = SectorBasis().design(from_angles(_EQUATOR, azimuth * DEGREE))
    return weight, equator(pretravel_map, azimuth)


def _judged(pretravel_map: PretravelMap, pretravel: FloatArray) -> SectorTable:
    weight, value = _samples(pretravel_map)
    # Halfway between two sectors a control takes one of them: the worse counts.
    off = np.where(weight > 0.0, np.abs(pretravel - value[:, None]), 0.0).max(axis=1)
    share = np.sum(weight * (pretravel - value[:, None]) ** 2, axis=1)
    return SectorTable(frozen(pretravel), float(off.max()), float(np.sqrt(np.mean(share))))
