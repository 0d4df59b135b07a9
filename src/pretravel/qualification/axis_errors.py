"""Errors of an axis that repeat at the same place of it, as those of a screw once for each turn.

All touches of a face have such an error in common, and repeats do not show it; touches at other
places of the axis do. Of each axis it is a random function of the position, either of a usual pitch
or of none, with one standard deviation for all axes: hypotheses whose weights the touches give.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray

_SIZES_OF_ERRORS = tuple(MICROMETRE * size for size in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0))
"""Standard deviations that are tried in addition to none. [mm]"""
WITHIN_A_TURN = 6.0 * MICROMETRE
"""What ISO 3408-3 allows a screw of grade 3, from valley to peak (from memory). [mm]"""
_USUAL = WITHIN_A_TURN / 3.0
"""Of machines in good order, standard deviation: of a sine it is 0.35 of valley to peak. Larger
ones are rarer, and touches outweigh this. [mm]"""
PITCHES = {2.0: 1.0, 2.5: 3.0, 4.0: 1.0, 5.0: 3.0, 6.0: 1.0, 8.0: 1.0, 10.0: 3.0}
"""Of usual screws [mm], with weights: ISO 3408-2 prefers 2.5, 5 and 10 mm (from memory)."""
_ANY_PITCH = 1.0
_IN_ADVANCE = 2.0
"""Odds of such errors, before the touches are seen."""
_REACHES = (0.4, 0.8, 1.6)
"""Ways over which an error without a pitch changes. [mm]"""


@dataclass(frozen=True, eq=False)
class AxisErrors:
    """A hypothesis.

    Attributes
    ----------
    size : float
        Standard deviation of the error. [mm]
    shared : (n, n) float
        Covariance of the errors of the touches, for a size of one.
    log_prior : float
        Logarithm of its weight in advance.
    """

    size: float
    shared: FloatArray
    log_prior: float


def hypotheses(positions: FloatArray, normals: FloatArray) -> Iterator[AxisErrors]:
    """No such errors; then those of each kind and size.

    Parameters
    ----------
    positions, normals : (n, 3) float
        [mm, –]

    >>> places, x = np.array([[0.0, 0, 0], [0.0, 9, 0], [2.5, 0, 0]]), np.array([[1.0, 0, 0]] * 3)
    >>> found = list(hypotheses(places, x))
    >>> len(found), found[0].size, found[-1].shared.round(2).tolist()[0]
    (49, 0.0, [1.0, 1.0, 0.1])
    """
    apart = positions[:, None, :] - positions[None, :, :]
    both = normals[:, None, :] * normals[None, :, :]
    kinds = [
        (np.sum(both * np.cos(2.0 * math.pi * apart / pitch), axis=2), weight)
        for pitch, weight in PITCHES.items()
    ]
    alike = np.mean([np.exp(-0.5 * (apart / reach) ** 2) for reach in _REACHES], axis=0)
    kinds.append((np.sum(both * alike, axis=2), _ANY_PITCH))
    yield AxisErrors(0.0, kinds[-1][0], 0.0)
    usual = [1.0 / math.hypot(1.0, size / _USUAL) for size in _SIZES_OF_ERRORS]
    share = _IN_ADVANCE / (sum(usual) * sum(weight for _, weight in kinds))
    for shared, weight in kinds:
        for size, own in zip(_SIZES_OF_ERRORS, usual, strict=True):
            yield AxisErrors(size, shared, math.log(share * weight * own))
