"""Surface points with their uncertainties: the result of a compensation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pretravel.arrays import FloatArray, frozen
from pretravel.frames import Placement


@dataclass(frozen=True, eq=False)
class Points:
    """Surface points, one for each touch, in the touches' order and frame.

    Attributes
    ----------
    positions : (n, 3) float
        Points of first contact. [mm]
    normals : (n, 3) float
        Outward unit normals that the compensation used.
    pretravel : (n,) float
        That was subtracted, along -n. [mm]
    covariance : (n, 3, 3) float
        Of each point: repeatability along the approach, map, tip radius. [mm²]
    deviation : (n,) float or None
        Distance from the nominal along its normal, positive outside. [mm]
    labels : tuple of str

    Notes
    -----
    Covariances are of single points. Errors of the map are common to points with similar normals
    (`PretravelMap.value_covariance`): the mean of n points does not have an uncertainty smaller by
    the root of n.
    """

    positions: FloatArray
    normals: FloatArray
    pretravel: FloatArray
    covariance: FloatArray
    deviation: FloatArray | None
    labels: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Standard uncertainty along the normal, (n,). [mm]"""
        variance = np.einsum("ni,nij,nj->n", self.normals, self.covariance, self.normals)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def placed(points: Points, placement: Placement) -> Points:
    """Points of a part in the frame of the machine.

    Parameters
    ----------
    points : Points
    placement : Placement
        Of the part in the machine.

    Returns
    -------
    Points
    """
    turn = placement.rotation
    return replace(
        points,
        positions=frozen(placement.points(points.positions)),
        normals=frozen(placement.vectors(points.normals)),
        covariance=frozen(turn @ points.covariance @ turn.T),
    )
