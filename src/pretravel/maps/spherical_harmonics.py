"""Real spherical harmonics: smooth functions of direction without seam or pole."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray, PretravelError, azimuth_angle, polar_angle
from pretravel.maps.observation import Places

_BLOCK = 4096  # directions at a time: 10 MB of functions


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


@dataclass(frozen=True, eq=False)
class DirectionMeans:
    """Means of spherical harmonics over the touches of each direction.

    They are computed when they are asked for, and not kept where they are many.

    Parameters
    ----------
    places : Places
    terms : (k, 2) int
        Degree and order.
    """

    places: Places
    terms: IntArray

    @cached_property
    def _order(self) -> tuple[FloatArray, IntArray]:
        """Directions of the places, by their groups, and the number of places of each group."""
        order = np.argsort(self.places.groups, kind="stable")
        return self.places.directions[order], np.bincount(self.places.groups)

    def rows(self) -> FloatArray:
        """Means of all directions, (g, k)."""
        return np.concatenate([rows for _, rows in self.blocks()])

    def blocks(self) -> Iterator[tuple[slice, FloatArray]]:
        """Blocks of directions, each with its means (b, k)."""
        directions, count = self._order
        ends = np.cumsum(count)
        first = 0
        while first < len(count):
            before = int(ends[first - 1]) if first else 0
            last = max(int(np.searchsorted(ends, before + _BLOCK, side="right")), first + 1)
            block = directions[before : int(ends[last - 1])]
            yield slice(first, last), self._means(block, count[first:last])
            first = last

    def _means(self, directions: FloatArray, count: IntArray) -> FloatArray:
        if len(count) > 1 or len(directions) <= _BLOCK:
            rows = real_spherical_harmonics(directions, self.terms)
            starts = np.cumsum(count) - count
            return np.asarray(np.add.reduceat(rows, starts, axis=0) / count[:, None])
        parts = range(0, len(directions), _BLOCK)  # one direction with very many touches
        total = sum(
            real_spherical_harmonics(directions[at : at + _BLOCK], self.terms).sum(axis=0)
            for at in parts
        )
        return np.asarray(total)[None] / count[:, None]

    def values(self, coefficients: FloatArray) -> FloatArray:
        """The sum of the harmonics with these coefficients at each touch, (n,)."""
        directions = self.places.directions
        found = np.empty(len(directions))
        for at in range(0, len(directions), _BLOCK):
            part = slice(at, at + _BLOCK)
            found[part] = real_spherical_harmonics(directions[part], self.terms) @ coefficients
        return found[self.places.of_touches]

    def weighted(self, weights: FloatArray) -> FloatArray:
        """Weighted sums of the harmonics over the touches, (m, n) to (m, k)."""
        directions, of_touches = self.places.directions, self.places.of_touches
        of_places = np.array([np.bincount(of_touches, own) for own in weights])
        found = np.zeros((len(weights), len(self.terms)))
        for at in range(0, len(directions), _BLOCK):
            part = slice(at, at + _BLOCK)
            rows = real_spherical_harmonics(directions[part], self.terms)
            found += of_places[:, part] @ rows
        return found


@dataclass(frozen=True, eq=False)
class Smoothing:
    """What a linear fit makes of observed values: the product with its hat matrix.

    The hat matrix itself has as many numbers as pairs of touches.

    Attributes
    ----------
    means : DirectionMeans
    count : (g,) float
        Touches of each direction.
    gains : (c, k, k) float
        Covariance of the coefficients over the variance of a touch, for each class of directions.
    classes : (g,) int
        Of the directions.
    """

    means: DirectionMeans
    count: FloatArray
    gains: FloatArray
    classes: IntArray

    @cached_property
    def leverage(self) -> FloatArray:
        """Fitted value per observed value, summed over the touches of each direction, (g,)."""
        found = np.empty(len(self.count))
        for part, rows in self.means.blocks():
            own = self.classes[part]
            for number in np.unique(own):
                here = np.flatnonzero(own == number)
                found[part.start + here] = np.sum((rows[here] @ self.gains[number]) * rows[here], 1)
        return np.asarray(found * self.count)

    def fitted(self, values: FloatArray, groups: IntArray) -> FloatArray:
        """The fit to other values of the same touches, (n,) to (n,)."""
        total = np.bincount(groups, values)
        coefficients = np.zeros(self.gains.shape[1])
        for part, rows in self.means.blocks():
            own = self.classes[part]
            for number in np.unique(own):
                here = np.flatnonzero(own == number)
                coefficients += self.gains[number] @ (rows[here].T @ total[part][here])
        return self.means.values(coefficients)
