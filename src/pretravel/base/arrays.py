"""Types of arrays; frozen values contain read-only copies in float64."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


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
