"""Tables of controls over the azimuth: eight sectors, two axis radii, and their residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, from_angles, frozen
from pretravel.maps.kinds.sectors import SECTOR_NAMES, SectorBasis
from pretravel.maps.pretravel_map import PretravelMap

RESAMPLING_CRITERIA = ("max", "rms")
_STEP = 0.5  # degrees, boundaries of sectors among them
_EQUATOR = 0.5 * np.pi


@dataclass(frozen=True, eq=False)
class SectorTable:
    """Ten radii, and the residuals of their nearest-sector lookup on the equator.

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

    def misread(self, pretravel_map: PretravelMap) -> SectorTable:
        """The same radii, each used at the azimuth opposite to its own.

        A control does so that takes directions of travel for outward normals, or the other way
        round.
        """
        return _with_residuals(pretravel_map, taken_opposite(self.pretravel))


def taken_opposite(pretravel: FloatArray) -> FloatArray:
    """Values of sectors, exchanged with those of the opposite sectors.

    Parameters
    ----------
    pretravel : (10,) float
        In the order of `SECTOR_NAMES`.

    Returns
    -------
    (10,) float
        Opposite directions share the X and the Y radius, which stay.

    >>> taken_opposite(np.arange(10.0)).tolist()
    [0.0, 1.0, 6.0, 7.0, 8.0, 9.0, 2.0, 3.0, 4.0, 5.0]
    """
    return np.concatenate([pretravel[:2], np.roll(pretravel[2:], 4)])


def equator(pretravel_map: PretravelMap, azimuth_deg: FloatArray) -> FloatArray:
    """Pretravel on the equator, at azimuths of the machine frame, (n,). [mm]

    Raises
    ------
    ExtrapolationError
        The map does not hold there.
    """
    return pretravel_map.pretravel(from_angles(_EQUATOR, azimuth_deg * DEGREE))


def touched_sectors(pretravel_map: PretravelMap) -> SectorTable:
    """The table as a control makes it: each radius is touched at the angle that it is named after.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Represents the probe.
    """
    angles = [[0.0, 180.0], [90.0, 270.0], *([float(name)] for name in SECTOR_NAMES[2:])]
    values = [float(np.mean(equator(pretravel_map, np.array(own)))) for own in angles]
    return _with_residuals(pretravel_map, np.array(values))


def resampled_sectors(pretravel_map: PretravelMap, criterion: str = "max") -> SectorTable:
    """The table with the smallest residuals.

    Parameters
    ----------
    pretravel_map : PretravelMap
    criterion : str
        ``max``: the largest residual is as small as possible; ``rms``: the mean square is.

    Raises
    ------
    PretravelError
        Another criterion.

    Notes
    -----
    Sectors do not overlap. Each radius is therefore the middle of the range of the map over its
    own directions (or the mean); for X and Y over both opposite sectors.
    """
    if criterion not in RESAMPLING_CRITERIA:
        raise PretravelError(
            f"criterion '{criterion}' is not known; there are {', '.join(RESAMPLING_CRITERIA)}",
            inputs=("criterion",),
        )
    weight, value = _samples(pretravel_map)
    found = []
    for sector in range(len(SECTOR_NAMES)):
        own = value[weight[:, sector] > 0.0]
        if criterion == "max":
            found.append(0.5 * float(own.min() + own.max()))
        else:
            share = weight[:, sector]
            found.append(float(np.sum(share * value) / np.sum(share)))
    return _with_residuals(pretravel_map, np.array(found))


def _samples(pretravel_map: PretravelMap) -> tuple[FloatArray, FloatArray]:
    azimuth = np.arange(0.0, 360.0, _STEP)
    weight = SectorBasis().design(from_angles(_EQUATOR, azimuth * DEGREE))
    return weight, equator(pretravel_map, azimuth)


def _with_residuals(pretravel_map: PretravelMap, pretravel: FloatArray) -> SectorTable:
    weight, value = _samples(pretravel_map)
    # Halfway between two sectors a control uses either: the larger residual counts.
    off = np.where(weight > 0.0, np.abs(pretravel - value[:, None]), 0.0).max(axis=1)
    share = np.sum(weight * (pretravel - value[:, None]) ** 2, axis=1)
    return SectorTable(frozen(pretravel), float(off.max()), float(np.sqrt(np.mean(share))))
