"""Kind tabulated: linear interpolation between directions, of predictions and tables."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty import Covariance

_OF_LEFT_OUT = 0.5
"""Error between nodes over that at one left out: 0.2 of smooth lobes, about 0.5 of a tripod's."""
_NEAR = 14  # nodes from which one left out is interpolated
_TRIED = 200  # nodes at most
_ON_SUPPORT = 1e-6
TIP_AS_STATED = (
    "the map takes the stated diameter of the tip as exact: its error, half of which shifts all "
    "points alike, is not in U"
)
"""A note of maps of which touches did not determine the tip."""
_SHOW_LOBES = 7  # directions around: six can all lie where three lobes have their mean


def doubts_between(azimuths: npt.ArrayLike) -> tuple[str, ...]:
    """What a table with nodes at these azimuths does not show between them, as sentences.

    Parameters
    ----------
    azimuths : (n,) float
        Of the nodes across the probe's axis. [rad]

    >>> len(doubts_between([0, 1, 2, 3, 4, 5])), doubts_between(np.arange(12) / 2)
    (1, ())
    """
    around = len(np.unique(np.round(np.degrees(np.asarray(azimuths)), 3) % 360.0))
    if around >= _SHOW_LOBES:
        return ()
    words = (
        f"directions of the map across the probe's axis: {around}. So few do not show the three "
        "lobes of a tripod, and between them the u of the map is too small. Touch "
        f"{_SHOW_LOBES} or more, better 16 or 24"
    )
    return (words,)


@dataclass(frozen=True, eq=False)
class TabulatedBasis(MapBasis):
    """Linear interpolation between nodes on the sphere, as predicted maps have it.

    Parameters
    ----------
    support : DirectionSupport
        The nodes; one coefficient each.
    """

    support: DirectionSupport
    kind: ClassVar[str] = "tabulated"
    interpolates: ClassVar[bool] = True

    @property
    def size(self) -> int:
        return len(self.support.nodes)

    @property
    def constant(self) -> FloatArray:
        return np.ones(self.size)

    def design(self, directions: FloatArray) -> FloatArray:
        nodes, weights, _ = self.support.interpolation(directions)
        design = np.zeros((len(directions), self.size))
        np.add.at(design, (np.arange(len(directions))[:, None], nodes), weights)
        return design

    def value(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        nodes, weights, _ = self.support.interpolation(directions)
        return np.asarray(np.sum(coefficients[nodes] * weights, axis=1))

    def u_between_nodes(self, coefficients: FloatArray, covariance: Covariance) -> float:
        """Standard uncertainty of values between the nodes by linear interpolation. [mm]

        From the nodes themselves: each is left out and interpolated from the others, which are
        twice as far apart. What the nodes' own uncertainty explains is not counted. Nodes at the
        edge, and lobes with less than seven nodes around, do not show it.

        Parameters
        ----------
        coefficients : (k,) float
            [mm]
        covariance : Covariance
            Of the coefficients.

        >>> around = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
        >>> nodes = np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
        >>> basis = TabulatedBasis(DirectionSupport(nodes))
        >>> lobes = 4e-3 * np.cos(3.0 * around)
        >>> round(basis.u_between_nodes(lobes, Covariance.none(12)), 6)  # half of 4 µm / √2
        0.001414
        """
        nodes = self.support.nodes
        rows = np.unique(np.linspace(0, self.size - 1, min(self.size, _TRIED)).astype(np.int64))
        designs = []
        for row in rows.tolist():
            near = np.argsort(-(nodes @ nodes[row]), kind="stable")
            others = np.sort(near[near != row][:_NEAR])
            if len(others) == 0:
                continue
            place, weights, distance = DirectionSupport(nodes[others]).interpolation(
                nodes[row : row + 1]
            )
            if distance[0] > _ON_SUPPORT:
                continue
            design = np.zeros(self.size)
            np.add.at(design, others[place[0]], weights[0])
            design[row] -= 1.0
            designs.append(design)
        if not designs:
            return 0.0
        left_out = np.array(designs)
        explained = float(np.mean(covariance.variance_of(left_out)))
        return _OF_LEFT_OUT * math.sqrt(
            max(float(np.mean((left_out @ coefficients) ** 2)) - explained, 0.0)
        )

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        return cls(stored.support)
