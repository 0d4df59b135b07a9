"""The part of a surface that a face covers: a region of its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import BoolArray, FloatArray, PretravelError
from pretravel.surface.local_geometry import Domain

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_SLACK = 1e-9
"""Distance beyond an edge, as a share of the region's size, at which a point counts as inside."""

_ROUGH = 0.02
"""Error of the distance of the middle from the edges, as a share of the region's width."""


@dataclass(frozen=True, eq=False)
class Trim:
    """A region of the (u, v) plane, bounded by closed rings.

    Parameters
    ----------
    rings : list of (m, 2) float
        Outer rings and holes, in any order and orientation: a point is inside where an odd
        number of rings surrounds it.
    periods : pair of float
        Of u and v; infinite where they are not periodic.
    bounds : tuple of five float, optional
        Smallest u and v, largest u and v, and area, where they are known from before.

    Raises
    ------
    PretravelError
        The rings enclose no area.

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> Trim([square], (math.inf, math.inf)).inside(np.array([[0.5, 0.5], [2.0, 0.5]])).tolist()
    [True, False]
    """

    rings: list[FloatArray]
    periods: tuple[float, float]
    bounds: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.bounds:
            region = self._built
            if not region.area > 0.0:
                raise PretravelError("its boundary encloses no area in the surface's parameters")
            bounds = (*region.bounds, region.area)
            object.__setattr__(self, "bounds", tuple(float(each) for each in bounds))

    @property
    def lower(self) -> tuple[float, float]:
        """The smallest u and v of the region."""
        return self.bounds[0], self.bounds[1]

    @property
    def upper(self) -> tuple[float, float]:
        """The largest u and v of the region."""
        return self.bounds[2], self.bounds[3]

    @property
    def area(self) -> float:
        """In the parameters."""
        return self.bounds[4]

    @cached_property
    def _built(self) -> BaseGeometry:
        import shapely

        lines = shapely.MultiLineString([shapely.LinearRing(ring) for ring in self.rings])
        if lines.is_simple:  # the area of rings that do not cross is built at once
            return shapely.build_area(lines)
        region: BaseGeometry = shapely.Polygon()
        for ring in self.rings:
            piece = shapely.Polygon(ring)
            if not piece.is_valid:
                piece = shapely.make_valid(piece)
            region = region.symmetric_difference(piece)
        return region

    @cached_property
    def _region(self) -> BaseGeometry:
        """The region with a slack beyond its edges, when it is first asked for: most faces of a
        part are never touched.
        """
        import shapely

        size = max(np.subtract(self.upper, self.lower))
        region = self._built.buffer(_SLACK * size, join_style="mitre")
        shapely.prepare(region)
        return region

    def covers(self, domain: Domain) -> bool:
        """Whether the region contains the whole domain of a surface."""
        sides = [
            period if math.isfinite(period) else high - low
            for low, high, period in zip(domain.lower, domain.upper, domain.period, strict=True)
        ]
        return self.area >= sides[0] * sides[1] * (1.0 - 1e-9)

    def middle(self, lengths: FloatArray) -> FloatArray:
        """The point of the region with the largest distance from its rings.

        Parameters
        ----------
        lengths : (2,) float
            Lengths of a unit of u and of v. [mm]

        Returns
        -------
        (2,) float

        >>> strip = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 2.0], [0.0, 2.0]])
        >>> Trim([strip], (math.inf, math.inf)).middle(np.ones(2)).round(1).tolist()[1]
        1.0
        """
        import shapely

        lengths = np.array(lengths, dtype=np.float64)
        sides = np.subtract(self.upper, self.lower) * lengths
        for axis, period in enumerate(self.periods):
            if sides[axis] > 0.999 * period * lengths[axis]:
                # The seam is no edge: the circle must not be bounded by it.
                lengths[axis] *= max(1.0, 2.0 * sides[1 - axis] / sides[axis])
        region = self._region
        scaled = shapely.transform(region, lambda points: points * lengths)
        width = float(scaled.area / np.linalg.norm(np.subtract(self.upper, self.lower) * lengths))
        rough = shapely.simplify(scaled, _ROUGH * width)
        radius = shapely.maximum_inscribed_circle(
            scaled if rough.is_empty else rough, tolerance=_ROUGH * width
        )
        return np.asarray(shapely.get_coordinates(radius)[0] / lengths)

    def inside(self, uv: FloatArray) -> BoolArray:
        """Which parameters lie in the region, (n,)."""
        import shapely

        u, v = self.wrapped(uv).T
        return np.asarray(shapely.contains_xy(self._region, u, v))

    def wrapped(self, uv: FloatArray) -> FloatArray:
        """Parameters moved by whole periods to the region."""
        result = np.asarray(uv, dtype=np.float64).copy()
        for axis, period in enumerate(self.periods):
            if math.isfinite(period):
                low, high = self.lower[axis], self.upper[axis]
                start = 0.5 * (low + high) - 0.5 * period
                result[:, axis] = start + np.mod(result[:, axis] - start, period)
                # The seam belongs to the region, although rounding may put it just below.
                just = (result[:, axis] < low) & (result[:, axis] > low - 1e-9 * period)
                result[just, axis] = low
        return result

    def domain(self, natural: Domain) -> Domain:
        """The bounding box of the region with a margin, within the surface's own domain."""
        lower, upper, period = [], [], []
        for axis in (0, 1):
            low, high = self.lower[axis], self.upper[axis]
            extra = 0.05 * (high - low)
            if math.isfinite(natural.period[axis]):
                lower.append(0.5 * (low + high) - 0.5 * natural.period[axis])
                upper.append(lower[-1] + natural.period[axis])
                period.append(natural.period[axis])
            else:
                lower.append(max(low - extra, natural.lower[axis]))
                upper.append(min(high + extra, natural.upper[axis]))
                period.append(math.inf)
        return Domain((lower[0], lower[1]), (upper[0], upper[1]), (period[0], period[1]))
