"""Functions of direction, averaged over the touches of each direction, in blocks of directions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import real_spherical_harmonics

_BLOCK = 4096  # places at a time: 10 MB of functions


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
