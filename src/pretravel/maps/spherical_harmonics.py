"""Real spherical harmonics: smooth functions of direction without seam or pole."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.directions import azimuth_angle, polar_angle
from pretravel.base.errors import PretravelError

_BLOCK = 4096  # directions at a time


def degrees_and_orders(largest_degree: int) -> IntArray:
    """All (degree, order) pairs up to a degree, order from -degree to degree.

    >>> degrees_and_orders(1).tolist()
    [[0, 0], [1, -1], [1, 0], [1, 1]]
    """
    return np.array(
        [
            (degree, order)
            for degree in range(largest_degree + 1)
            for order in range(-degree, degree + 1)
        ],
        dtype=np.int64,
    )


HIGHEST_DEGREE = 60
"""Of harmonics in a map; fitted maps have degrees up to 30."""


def checked_terms(terms: npt.ArrayLike) -> IntArray:
    """Degrees and orders of the harmonics of a map, read-only.

    Parameters
    ----------
    terms : (k, 2) int

    Returns
    -------
    (k, 2) int

    Raises
    ------
    PretravelError
        Another shape, numbers that are not whole, degrees that no map has.

    >>> checked_terms([[3, -4]])
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: harmonics of a map have degrees 0 to 60 and orders from \
-degree to degree, each once
    """
    given = np.asarray(terms)
    whole = given.astype(np.int64) if given.size and given.dtype.kind in "iu" else np.zeros((0, 2))
    found = np.array(whole, dtype=np.int64)
    degree, order = (found[:, 0], found[:, 1]) if found.ndim == 2 else (found, found)
    if (
        given.shape != found.shape
        or found.shape[1:] != (2,)
        or np.any((degree < 0) | (degree > HIGHEST_DEGREE) | (np.abs(order) > degree))
        or len(np.unique(found, axis=0)) != len(found)
    ):
        raise PretravelError(
            f"harmonics of a map have degrees 0 to {HIGHEST_DEGREE} and orders from -degree to "
            "degree, each once"
        )
    found.setflags(write=False)
    return found


def real_spherical_harmonics(
    directions: npt.ArrayLike, terms: npt.NDArray[np.int64] | Sequence[tuple[int, int]]
) -> FloatArray:
    r"""Real spherical harmonics at unit directions.

    A positive order m stands for cos(m azimuth), a negative one for
    sin(\|m\| azimuth). Every function has mean square one over the sphere, so the
    first is the constant 1 and coefficients read as amplitudes.

    Parameters
    ----------
    directions : (n, 3) float
        Unit vectors.
    terms : (k, 2) int
        Degree and order of each function.

    Returns
    -------
    (n, k) float

    >>> up = [[0.0, 0.0, 1.0]]
    >>> real_spherical_harmonics(up, [(0, 0), (1, 0), (1, 1)]).round(6).tolist()
    [[1.0, 1.732051, 0.0]]
    """
    d = np.asarray(directions, dtype=np.float64)
    degree_order = np.asarray(terms, dtype=np.int64).reshape(-1, 2)
    if len(d) > _BLOCK:
        found = np.empty((len(d), len(degree_order)))
        for start in range(0, len(d), _BLOCK):
            part = slice(start, start + _BLOCK)
            found[part] = real_spherical_harmonics(d[part], degree_order)
        return found
    polar, phase = polar_angle(d), azimuth_angle(d)
    across, along = np.sin(polar), np.cos(polar)
    rows = np.zeros((len(degree_order), len(d)))
    orders = np.abs(degree_order[:, 1])
    existing = orders <= degree_order[:, 0]  # others are zero
    for order in np.unique(orders[existing]):
        of_order = np.flatnonzero(existing & (orders == order))
        degree = degree_order[of_order, 0]
        legendre = _legendre(int(order), int(degree.max()), across, along)
        around = np.cos(order * phase), np.sin(order * phase)
        for row, own in zip(of_order, degree, strict=True):
            rows[row] = legendre[own - order] * around[int(degree_order[row, 1] < 0)]
    return np.asarray(rows.T)


def _legendre(order: int, highest: int, across: FloatArray, along: FloatArray) -> FloatArray:
    """Legendre functions of one order, degrees from the order to the highest: (d, n).

    By the recurrence in the degree, which loses no digits (Holmes & Featherstone 2002). Libraries
    compute those of all orders, many times as many as a map has.
    """
    found = np.empty((highest - order + 1, len(along)))
    first = math.sqrt(2.0) if order else 1.0
    for m in range(1, order + 1):
        first *= math.sqrt((2.0 * m + 1.0) / (2.0 * m))
    found[0] = first * across**order
    if highest > order:
        found[1] = math.sqrt(2.0 * order + 3.0) * along * found[0]
    for degree in range(order + 2, highest + 1):
        before = degree - 1
        ratio = math.sqrt((before**2 - order**2) / (4.0 * before**2 - 1.0))
        scale = math.sqrt((4.0 * degree**2 - 1.0) / (degree**2 - order**2))
        row = degree - order
        found[row] = scale * (along * found[row - 1] - ratio * found[row - 2])
    return found
