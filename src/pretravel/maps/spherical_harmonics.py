"""Real spherical harmonics: smooth functions of direction without seam or pole."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.errors import PretravelError


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
    pretravel.errors.PretravelError: harmonics of a map have degrees 0 to 60 and orders from \
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
    from scipy.special import sph_legendre_p_all

    d = np.asarray(directions, dtype=np.float64)
    degree_order = np.asarray(terms, dtype=np.int64).reshape(-1, 2)
    degree, order = degree_order[:, 0], np.abs(degree_order[:, 1])
    if not len(degree_order):
        return np.empty((len(d), 0))
    highest = int(degree.max())
    # Not assoc_legendre_p_all: with norm=True it is wrong at z = ±1 (SciPy 1.17).
    legendre = sph_legendre_p_all(highest, highest, polar_angle(d))[0]
    phase = azimuth_angle(d)
    multiples = np.arange(highest + 1)[:, None] * phase
    cosine, sine = np.cos(multiples), np.sin(multiples)
    angular = np.where((degree_order[:, 1] < 0)[:, None], sine[order], cosine[order])
    # Unit mean square instead of unit integral, and without the (-1)^m phase.
    factor = np.where(order == 0, math.sqrt(4.0 * math.pi), math.sqrt(8.0 * math.pi))
    factor *= np.where(order % 2, -1.0, 1.0)
    return np.asarray((factor[:, None] * legendre[degree, order] * angular).T)
