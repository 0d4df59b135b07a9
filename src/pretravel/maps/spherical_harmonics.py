"""Real spherical harmonics: smooth functions of direction without seam or pole."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray, PretravelError
from pretravel.maps.observation import Places

_BLOCK = 4096  # directions at a time: 10 MB of functions
_AT_A_TIME = 512  # so that the functions stay in the cache


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


LOBE_DEGREES = (15, 24)
"""Largest degree of zonal and three-lobed harmonics, for few and for many directions.

Twenty-five directions resolve degree 15 at most. Kinks contribute 0.2 um of a 25 um map above it,
which hundreds of directions resolve."""
ASYMMETRY_DEGREE = 8
"""Largest degree of all others on a sphere."""
RING_DEGREE = 30
"""Largest order on a ring, where all orders are resolved."""


def sphere_terms(directions: int) -> IntArray:
    """Degrees and orders used on a sphere: without degrees 0 and 1.

    Parameters
    ----------
    directions : int
        Number of touched directions.

    Returns
    -------
    (k, 2) int

    >>> sphere_terms(25).max(), sphere_terms(1000).max()
    (np.int64(15), np.int64(24))
    """
    lowest, highest = LOBE_DEGREES
    terms = degrees_and_orders(min(max(12 + directions // 8, lowest), highest))
    lobed = terms[:, 1] % 3 == 0
    return np.asarray(terms[(terms[:, 0] > 1) & (lobed | (terms[:, 0] <= ASYMMETRY_DEGREE))])


def ring_terms() -> IntArray:
    """Orders used on a ring: harmonics of degree = order, from 2.

    >>> ring_terms()[:2].tolist()
    [[2, 2], [2, -2]]
    """
    return np.array(
        [(m, sign * m) for m in range(2, RING_DEGREE + 1) for sign in (1, -1)], dtype=np.int64
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
    given = np.asarray(terms, dtype=np.int64).reshape(-1, 2)
    recurrence = _recurrence(given.tobytes())
    found = np.empty((len(given), len(d)))
    for start in range(0, len(d), _AT_A_TIME):
        part = slice(start, start + _AT_A_TIME)
        _evaluate(recurrence, d[part], found[:, part])
    return np.asarray(found.T)


def _evaluate(recurrence: _Recurrence, directions: FloatArray, out: FloatArray) -> None:
    """Harmonics at some directions, into (k, n).

    Legendre functions by the recurrence in the degree, which loses no digits (Holmes &
    Featherstone 2002), of all orders together; here without the power of the sine, which belongs to
    the powers of x + i y: no function of an angle is needed. Libraries compute those of all orders,
    many times as many as a map has.
    """
    length = np.sqrt(np.einsum("ni,ni->n", directions, directions))
    x, y, along = directions.T / length
    orders = recurrence.orders
    powers = np.empty((1 + int(orders.max(initial=0)), len(directions)), dtype=np.complex128)
    powers[0], powers[1:] = 1.0, x + 1j * y
    np.multiply.accumulate(powers, axis=0, out=powers)
    legendre = np.empty((recurrence.size + 1, len(directions)))
    legendre[-1] = 0.0
    count = len(orders)
    legendre[:count] = recurrence.first
    before, last = slice(0, 0), slice(0, count)
    for scale, ratio in recurrence.steps:
        going = len(scale)
        end = last.stop
        now = slice(end, end + going)
        rows = along * legendre[last.start : last.start + going]
        if before.stop:
            rows -= ratio * legendre[before.start : before.start + going]
        np.multiply(scale, rows, out=legendre[now])
        before, last = last, now
    around = np.concatenate([powers.real[orders], powers.imag[orders]])
    np.multiply(legendre[recurrence.rows], around[recurrence.around], out=out)


class _Recurrence(NamedTuple):
    """How the Legendre functions of some terms follow from each other.

    A step goes from the functions of degree order + j to those of order + j + 1, of all orders that
    need it: the orders that need most steps are first.
    """

    orders: IntArray
    """The different ones, (o,)."""
    first: FloatArray
    """Of the functions of degree = order, without the power of the sine, (o, 1)."""
    steps: list[tuple[FloatArray, FloatArray]]
    """Scale, and ratio of the function before the last, each (s, 1)."""
    size: int
    """Number of Legendre functions; after them is one that is zero."""
    rows: IntArray
    """Legendre function of each term, (k,): zero where the order is above the degree."""
    around: IntArray
    """Cosine or sine of each term: the number of its order, cosines first."""


@lru_cache(maxsize=64)
def _recurrence(terms: bytes) -> _Recurrence:
    degree, signed = np.frombuffer(terms, dtype=np.int64).reshape(-1, 2).T
    order = np.abs(signed)
    orders, number = np.unique(order, return_inverse=True)
    highest = orders.copy()
    np.maximum.at(highest, number, degree)
    by_steps = np.argsort(orders - highest, kind="stable")
    place = np.argsort(by_steps)[number]
    orders, needed = orders[by_steps], (highest - orders)[by_steps]
    size = len(orders)
    starts, steps = [0], []
    for step in range(1, int(needed.max(initial=0)) + 1):
        starts.append(size)
        m = orders[needed >= step].astype(np.float64)
        size += len(m)
        reached = m + step
        scale = np.sqrt((4.0 * reached**2 - 1.0) / (reached**2 - m**2))
        ratio = np.sqrt(((reached - 1.0) ** 2 - m**2) / (4.0 * (reached - 1.0) ** 2 - 1.0))
        steps.append((scale[:, None], ratio[:, None]))
    first_of_step = np.array(starts)
    return _Recurrence(
        orders=orders,
        first=np.array([_first_factor(int(m)) for m in orders])[:, None],
        steps=steps,
        size=size,
        rows=np.where(order > degree, size, place + first_of_step[np.maximum(degree - order, 0)]),
        around=place + np.where(signed < 0, len(orders), 0),
    )


def _first_factor(order: int) -> float:
    """Of the function whose degree is its order."""
    first = math.sqrt(2.0) if order else 1.0
    for m in range(1, order + 1):
        first *= math.sqrt((2.0 * m + 1.0) / (2.0 * m))
    return first


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
