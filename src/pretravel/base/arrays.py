"""Types of arrays; frozen values contain read-only copies in float64."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

FEW_PLACES = 200
"""All distances between so many take less time than the import of a tree."""


def frozen(values: npt.ArrayLike) -> FloatArray:
    """A read-only float64 copy; what a masked array hides is no number.

    >>> frozen([1, 2]).flags.writeable
    False
    """
    if isinstance(values, np.ma.MaskedArray):  # a copy of its numbers has NetCDF's filling, 1e37
        values = np.ma.filled(values.astype(np.float64), np.nan)
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def near_pairs(places: FloatArray, distance: float) -> IntArray:
    """Pairs of places (n, k) that are at most so far apart, (p, 2).

    >>> near_pairs(np.array([[0.0], [1.0], [3.0]]), 1.5).tolist()
    [[0, 1]]
    """
    if len(places) <= FEW_PLACES:
        apart = np.linalg.norm(places[:, None] - places, axis=2)
        return np.argwhere(np.triu(apart <= distance, 1))
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query_pairs(distance, output_type="ndarray"))


def connected(count: int, pairs: IntArray) -> IntArray:
    """The lowest number that each of so many is connected with by pairs, (count,).

    >>> connected(4, np.array([[1, 3]])).tolist()
    [0, 1, 2, 1]
    """
    label = np.arange(count)
    while True:
        lowest = np.min(label[pairs], axis=1)
        joined = label.copy()
        for side in (0, 1):
            np.minimum.at(joined, pairs[:, side], lowest)
            np.minimum.at(joined, label[pairs[:, side]], lowest)
        joined = joined[joined]
        if np.array_equal(joined, label):
            return label
        label = joined
