"""What was observed where a reference was touched: it is kept with the map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError, frozen

MOST_KEPT = 5000
"""A map of more directions does not keep what was observed in each of them."""


@dataclass(frozen=True, eq=False)
class TouchedMeans:
    """Mean observed pretravel in each touched direction: the nodes of the support of a map.

    A map smooths what was observed. A model that is fitted to the touches needs the touches: their
    errors are independent, those of a map are not, and a map has no kinks between its touches.

    Parameters
    ----------
    pretravel : (n,) float
        Mean of the touches of each direction, about the centre and with the tip radius of the map.
        [mm]
    counts : (n,) float
        Number of touches of each direction.

    Raises
    ------
    PretravelError
        Shapes that differ, values that are not finite, a direction without a touch.

    >>> TouchedMeans(np.array([0.010, 0.012]), np.array([3, 3])).counts.tolist()
    [3.0, 3.0]
    """

    pretravel: FloatArray
    counts: FloatArray

    def __post_init__(self) -> None:
        pretravel, counts = frozen(self.pretravel), frozen(self.counts)
        if pretravel.ndim != 1 or pretravel.shape != counts.shape:
            raise PretravelError(
                "observed pretravel and numbers of touches must be of the same directions, got "
                f"{pretravel.shape} and {counts.shape}"
            )
        if not (np.all(np.isfinite(pretravel)) and np.all(np.isfinite(counts))):
            raise PretravelError("observed pretravel and numbers of touches must be finite")
        if not np.all(counts >= 1.0):
            raise PretravelError("each touched direction has one touch at least")
        object.__setattr__(self, "pretravel", pretravel)
        object.__setattr__(self, "counts", counts)
