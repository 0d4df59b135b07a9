"""A face of a part: a surface, the region of it that the face covers, and its outside."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.surface.cad.trim import Trim
from pretravel.surface.contact import nearest_contact
from pretravel.surface.foot_points import foot_points
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface
from pretravel.surface.parametric import Parametric
from pretravel.surface.swept import Placed
from pretravel.surface.undetermined import apexes

_MOST_SAMPLES = 250_000
"""Largest number of samples of one face."""
_MOST_ON_EDGE = 100_000
"""Largest number of samples of one piece of an edge."""


_PIECES = 200
"""Least number of pieces of an edge: a straight line in the parameters can be an arc in space."""
_CHORD = 1e-3
"""More than the distance between an edge and its samples. [mm]"""


@dataclass(frozen=True, eq=False)
class CoarseSamples:
    """A few points of a face.

    Attributes
    ----------
    uv : (m, 2) float
        First those of a grid, then those on edges.
    points : (m, 3) float
        [mm]
    inner : int
        Number of those of the grid.
    gap : float
        Largest distance between neighbours of the grid. [mm]
    """

    uv: FloatArray
    points: FloatArray
    inner: int
    gap: float


@dataclass(frozen=True, eq=False)
class Face:
    """A face of a part: a region of a surface, with material on one side.

    Attributes
    ----------
    number : int
        Counted from 1, in the file's order.
    name : str
        From the file; often empty.
    kind : str
        plane, cylinder, cone, sphere, torus, extrusion, revolution, B-spline, Bézier, offset.
    base : Surface
        Untrimmed.
    trim : Trim or None
        The region of the parameters that the face covers; None for a closed surface.
    flips : bool
        Whether the part's outside is opposite to the surface's own normal.
    borders : tuple of (m, 2) float
        Its edges in the surface's parameters, without seams and poles.
    part : str
        Of the file's parts the one that it belongs to, as the path of its assemblies; empty where
        there is only one.
    """

    number: int
    name: str
    kind: str
    base: Surface
    trim: Trim | None
    flips: bool
    borders: tuple[FloatArray, ...] = ()
    part: str = ""

    @cached_property
    def domain(self) -> Domain:
        return self.base.domain if self.trim is None else self.trim.domain(self.base.domain)

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.base.derivatives(uv)

    def local(self, uv: FloatArray) -> LocalGeometry:
        geometry = self.base.local(uv)
        return geometry.flipped() if self.flips else geometry

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return self.base.moved(uv, displacement)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.base.inside(uv) if self.trim is None else self.trim.inside(uv)

    def nearest(self, points: FloatArray) -> FloatArray:
        if not _has_no_closed_form(self.base):
            return self.domain.confined(self.base.nearest(points))
        uv, tree = self._seeds
        start = uv[tree.query(points)[1]]
        base: Surface = self.base
        there = points
        while isinstance(base, Placed):
            there = (there - base.shift) @ base.rotation
            base = base.surface
        if not isinstance(base, Parametric):
            return nearest_contact(self, start, points).uv
        found, solved = foot_points(base, self.domain, start, there)
        left = np.flatnonzero(~solved)
        if len(left):
            found[left] = nearest_contact(self, start[left], points[left]).uv
        return found

    @cached_property
    def has_poles(self) -> bool:
        """Whether a whole edge of the parameter range is one point of the surface."""
        if not _has_no_closed_form(self.base):
            return False
        low, high = self.box
        ends = np.linspace(0.0, 1.0, 5)[:, None]
        for axis in (0, 1):
            for end in (low, high):
                line = low + ends * (high - low)
                line[:, axis] = end[axis]
                points = self.derivatives(line)[0]
                if np.ptp(points, axis=0).max() < 1e-9 * max(1.0, float(np.abs(points).max())):
                    return True
        return False

    @cached_property
    def apexes(self) -> FloatArray:
        """Points of the face that have no normal, such as the tip of a cone, (k, 3). [mm]"""
        return apexes(self, *self.box)

    def starts_near(self, points: FloatArray, count: int) -> Iterator[FloatArray]:
        """Yield parameters (n, 2) of the samples nearest to points, in the order of distance."""
        uv, tree = self._seeds
        count = min(count, len(uv))
        _, index = tree.query(points, k=count)
        for rank in range(count):
            yield uv[index.reshape(len(points), count)[:, rank]]

    @cached_property
    def _seeds(self) -> tuple[FloatArray, Any]:
        from scipy.spatial import cKDTree

        return self.coarse.uv, cKDTree(self.coarse.points)

    @cached_property
    def coarse(self) -> CoarseSamples:
        """A few points spread over the face, which show its shape."""
        if self.kind == "plane" and self.borders:  # its edges show all of it
            uv = np.concatenate(self.borders)
            return CoarseSamples(uv, self.derivatives(uv)[0], 0, 0.0)
        grid, gap = self._grid(np.inf)
        uv = np.concatenate([grid, self.edge_samples(np.inf)])
        return CoarseSamples(uv, self.derivatives(uv)[0], len(grid), gap)

    @cached_property
    def middle(self) -> FloatArray:
        """Parameters of a point of the face that is far from its edges, (2,)."""
        low, high = self.box
        if self.trim is None:
            return 0.5 * (low + high)
        if self.kind == "plane":  # its parameters are lengths
            return self.trim.middle(np.ones(2))
        _, du, dv = self.derivatives(lattice(low, high, np.array([5, 5])))
        lengths = np.array([np.nanmedian(np.linalg.norm(d, axis=1)) for d in (du, dv)])
        longest = float(lengths.max()) or 1.0
        return self.trim.middle(np.maximum(lengths, 1e-6 * longest))

    @cached_property
    def bounds(self) -> FloatArray:
        """Smallest and largest coordinates, (2, 3): no point of the face lies outside. [mm]"""
        coarse = self.coarse
        low, high = np.nanmin(coarse.points, axis=0), np.nanmax(coarse.points, axis=0)
        slack = _CHORD
        if self.kind != "plane":
            # Between samples the face rises over them by its curvature, at most by their distance.
            bend = float(np.nanmax(np.abs(self.local(coarse.uv).principal_curvatures), initial=0.0))
            slack += min(coarse.gap, bend * coarse.gap**2)
        return np.stack([low - slack, high + slack])

    def samples(self, spacing: float) -> FloatArray:
        """Parameters of points spread over the face and its edges.

        Parameters
        ----------
        spacing : float
            Largest distance between neighbours; infinite: a coarse grid that shows the shape. [mm]

        Returns
        -------
        (m, 2) float
        """
        return self.sampled(spacing)[0]

    def sampled(self, spacing: float) -> tuple[FloatArray, float]:
        """As `samples`, with the distance between neighbours that was reached.

        The number of points is limited, so the distance can be larger than the spacing.
        """
        grid, gap = self._grid(spacing)
        return np.concatenate([grid, self.edge_samples(spacing)]), gap

    def _grid(self, spacing: float) -> tuple[FloatArray, float]:
        """Parameters of a grid on the face, and the distance between its neighbours."""
        low, high = self.box
        counts = np.array([25, 25])
        _, du, dv = self.derivatives(lattice(low, high, np.array([9, 9])))
        longest = [float(np.nanmax(np.linalg.norm(d, axis=1))) for d in (du, dv)]
        lengths = (high - low) * np.array(longest)
        if np.isfinite(spacing):
            counts = np.maximum(np.ceil(lengths / spacing).astype(int) + 1, 9)
            while counts[0] * counts[1] > _MOST_SAMPLES:
                counts = np.maximum(counts * 3 // 4, 9)
        grid = lattice(low, high, counts)
        grid = grid[self.inside(grid)]
        return grid, float(np.max(lengths / (counts - 1)))

    @cached_property
    def largest_convex_curvature(self) -> float:
        """Largest convex curvature of the face; zero where there is none. [1/mm]"""
        local = self.local(lattice(*self.box, np.array([9, 9])))
        bends = local.principal_curvatures
        return max(float(np.nanmax(bends)) if np.isfinite(bends).any() else 0.0, 0.0)

    def distance(self, points: FloatArray, resolution: float) -> FloatArray:
        """Distance of points from the face, within its edges.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        resolution : float
            Distance between the samples of its edges. [mm]

        Returns
        -------
        (n,) float
            [mm]
        """
        uv = self.nearest(points)
        foot = np.linalg.norm(self.derivatives(uv)[0] - points, axis=1)
        result = np.where(self.inside(uv), foot, np.inf)
        if self.borders:
            result = np.minimum(result, self._edge_tree(resolution).query(points)[0])
        return np.asarray(result)

    def _edge_tree(self, resolution: float) -> Any:
        from scipy.spatial import cKDTree

        key = f"_edge_tree_{resolution:.3g}"
        if key not in self.__dict__:
            edge = self.derivatives(self.edge_samples(resolution))[0]
            self.__dict__[key] = cKDTree(edge)
        return self.__dict__[key]

    def edge_lines(self, spacing: float) -> list[FloatArray]:
        """Parameters of points along each edge.

        Parameters
        ----------
        spacing : float
            Largest distance between neighbours; infinite: a coarse line that shows the shape. [mm]

        Returns
        -------
        list of (m, 2) float
        """
        return [self._along(border, spacing) for border in self.borders]

    def edge_samples(self, spacing: float) -> FloatArray:
        """As `edge_lines`, in one array, (m, 2)."""
        return np.concatenate([np.empty((0, 2)), *self.edge_lines(spacing)])

    def _along(self, ring: FloatArray, spacing: float) -> FloatArray:
        pieces = max(1, _PIECES // len(ring))
        counts = np.full(len(ring) - 1, pieces)
        if np.isfinite(spacing):
            # A straight line in the parameters can be curved in space: measured in pieces.
            share = np.arange(pieces)[:, None, None] / pieces
            fine = ring[:-1] + share * (ring[1:] - ring[:-1])
            line = np.concatenate([np.swapaxes(fine, 0, 1).reshape(-1, 2), ring[-1:]])
            steps = np.linalg.norm(np.diff(self.derivatives(line)[0], axis=0), axis=1)
            length = steps.reshape(-1, pieces).sum(axis=1)
            counts = np.clip(np.ceil(length / spacing).astype(int), 1, _MOST_ON_EDGE)
        start = np.repeat(np.arange(len(counts)), counts)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        share = (np.arange(len(start)) - first[start]) / counts[start]
        along = ring[start] + share[:, None] * (ring[start + 1] - ring[start])
        return np.concatenate([along, ring[-1:]])

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest parameters of the face, (2,) each."""
        domain = self.domain
        if self.trim is None:
            return np.array(domain.lower), np.array(domain.upper)
        return np.array(self.trim.lower), np.array(self.trim.upper)


def _has_no_closed_form(surface: Surface) -> bool:
    """Whether nearest points of a surface are found by iteration from samples."""
    while isinstance(surface, Placed):
        surface = surface.surface
    return isinstance(surface, Parametric) or hasattr(surface, "basis")


def lattice(low: FloatArray, high: FloatArray, counts: IntArray) -> FloatArray:
    """A grid of parameters, row by row along v.

    Parameters
    ----------
    low, high : (2,) float
    counts : (2,) int
        Along u and v.

    Returns
    -------
    (m, 2) float

    >>> lattice(np.zeros(2), np.ones(2), np.array([2, 1])).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    grid = np.empty((int(counts[1]), int(counts[0]), 2))
    grid[:, :, 0] = np.linspace(low[0], high[0], int(counts[0]))
    grid[:, :, 1] = np.linspace(low[1], high[1], int(counts[1]))[:, None]
    return grid.reshape(-1, 2)
