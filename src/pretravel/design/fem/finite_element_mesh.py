"""A mesh of curved quadratic tetrahedra."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class FiniteElementMesh:
    """Ten-node tetrahedra with named regions and faces.

    Attributes
    ----------
    points : (n, 3) float
        Corner nodes first, then middle nodes. [mm]
    elements : (m, 10) int
        Four corners, then the middles of edges 01, 12, 02, 03, 13, 23 (VTK's order).
    regions : (m,) int
        Index into `region_names`.
    region_names : tuple of str
    faces : mapping of name to (k, 6) int
        Triangles of each named face, nodes as in `boundary`.
    boundary : (b, 6) int
        All outer triangles: three corners, then the middles of edges 01, 12, 02.
    quality : (m,) float
        3 inner radius / outer radius of the straight tetrahedron; 1 is regular.
    notes : tuple of str
        The refinements, with their reasons.
    """

    points: FloatArray
    elements: IntArray
    regions: IntArray
    region_names: tuple[str, ...]
    faces: Mapping[str, IntArray]
    boundary: IntArray
    quality: FloatArray
    notes: tuple[str, ...] = ()

    @property
    def corners(self) -> int:
        """Number of corner nodes."""
        return int(self.elements[:, :4].max()) + 1

    @property
    def unknowns(self) -> int:
        """Number of displacements: three for each node."""
        return 3 * len(self.points)


def element_unknowns(mesh: FiniteElementMesh) -> IntArray:
    """Indices of each element's thirty displacements, (m, 30)."""
    unknowns = 3 * mesh.elements[:, :, None] + np.arange(3)
    return np.asarray(unknowns.reshape(len(mesh.elements), 30))


def mesh_quality(corners: FloatArray) -> FloatArray:
    """3 inner radius / outer radius of straight tetrahedra, (m, 4, 3) to (m,); 1 is regular."""
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    volume6 = np.abs(np.einsum("ei,ei->e", a, np.cross(b, c)))
    areas2 = sum(
        np.linalg.norm(n, axis=1)
        for n in (np.cross(a, b), np.cross(b, c), np.cross(c, a), np.cross(b - a, c - a))
    )
    lengths = [np.linalg.norm(v, axis=1) for v in (a, b, c)]
    opposite = [np.linalg.norm(v, axis=1) for v in (b - c, c - a, a - b)]
    p, q, r = (lengths[i] * opposite[i] for i in range(3))
    circum = np.sqrt(np.maximum((p + q + r) * (p + q - r) * (q + r - p) * (r + p - q), 0.0))
    outer = circum / (4.0 * np.maximum(volume6, 1e-300))
    inner = volume6 / areas2
    return np.asarray(3.0 * inner / np.maximum(outer, 1e-300))
