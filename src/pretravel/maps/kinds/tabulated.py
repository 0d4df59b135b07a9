"""Kind tabulated: linear interpolation between directions, of predictions and tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from pretravel.base import FloatArray
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.support import DirectionSupport


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

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        return cls(stored.support)
