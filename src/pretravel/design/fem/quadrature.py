"""Integration over the elements of a mesh and over its faces, by scikit-fem."""

from __future__ import annotations

from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from pretravel.base import FloatArray, IntArray, needed
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh

ELEMENT_DEGREE, FACE_DEGREE = 2, 6
"""Degrees to which rules are exact. Those of 3, 4 and 8 on tetrahedra and 3 and 7 on triangles have
negative weights in scikit-fem."""


class Quadrature(NamedTuple):
    """Four points in every element, exact for straight quadratic elements."""

    gradients: FloatArray
    """Of the ten shape functions, (elements, points, 10, 3). [1/mm]"""
    weights: FloatArray
    """Volume of each point, negative in an element turned inside out, (elements, points)."""


def quadrature(mesh: FiniteElementMesh) -> Quadrature:
    """Shape function gradients and weights, by scikit-fem."""
    basis = element_basis(skfem_mesh(mesh))
    gradients = np.stack([basis.basis[node][0].grad for node in range(10)])
    signs = np.sign(basis.mapping.detDF(basis.X))
    return Quadrature(
        np.ascontiguousarray(gradients.transpose(2, 3, 0, 1)), np.asarray(signs * basis.dx)
    )


def volumes(mesh: FiniteElementMesh) -> FloatArray:
    """Of the four points in every element, as the weights of `quadrature`, without gradients."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTet

    places, weights = get_quadrature(RefTet, ELEMENT_DEGREE)
    return np.asarray(skfem_mesh(mesh).mapping().detDF(places) * weights)


def skfem_mesh(mesh: FiniteElementMesh) -> Any:
    """The mesh as scikit-fem's, with the same numbering; made once, for it finds all edges."""
    needed("skfem", "fem")
    from skfem import MeshTet2

    if mesh not in _GRIDS:
        _GRIDS[mesh] = MeshTet2(
            np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.elements[:, :4].T)
        )
    return _GRIDS[mesh]


_GRIDS: WeakKeyDictionary[FiniteElementMesh, Any] = WeakKeyDictionary()


def element_basis(grid: Any, **selection: Any) -> Any:
    """Quadratic shape functions at four points of each element of a scikit-fem mesh."""
    from skfem import Basis, ElementTetP2

    return Basis(grid, ElementTetP2(), intorder=ELEMENT_DEGREE, **selection)


class FaceQuadrature(NamedTuple):
    """Points on the curved triangles of a face."""

    nodes: IntArray
    """(k, 6)."""
    shapes: FloatArray
    """Of the six nodes at each point, (q, 6)."""
    positions: FloatArray
    """(k, q, 3). [mm]"""
    normals: FloatArray
    """Times the area of each point; their sign is arbitrary, (k, q, 3). [mm²]"""

    @property
    def areas(self) -> FloatArray:
        """(k, q). [mm²]"""
        return np.asarray(np.linalg.norm(self.normals, axis=2))


def face_quadrature(mesh: FiniteElementMesh, face: str) -> FaceQuadrature:
    """Twelve points a triangle: exact to the sixth degree on flat ones."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTri

    (b, c), weights = get_quadrature(RefTri, FACE_DEGREE)
    shapes, by_b, by_c = triangle_shapes(b, c)
    nodes = mesh.faces[face]
    corners = mesh.points[nodes]
    tangents = [np.einsum("qa,kai->kqi", slope, corners) for slope in (by_b, by_c)]
    return FaceQuadrature(
        nodes,
        shapes,
        np.einsum("qa,kai->kqi", shapes, corners),
        np.cross(tangents[0], tangents[1]) * weights[:, None],
    )


def triangle_shapes(b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Quadratic shape functions of a triangle and their slopes, (..., 6) each.

    Nodes: three corners, then the middles of edges 01, 12, 02; b and c are the second and
    third barycentric coordinates.

    >>> shapes, _, _ = triangle_shapes(np.array([0.5]), np.array([0.0]))
    >>> np.abs(shapes[0]).tolist()
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    """
    a, zero = 1.0 - b - c, np.zeros_like(b)
    values = [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * a * c]
    by_b = [1 - 4 * a, 4 * b - 1, zero, 4 * (a - b), 4 * c, -4 * c]
    by_c = [1 - 4 * a, zero, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)]
    return np.stack(values, axis=-1), np.stack(by_b, axis=-1), np.stack(by_c, axis=-1)
