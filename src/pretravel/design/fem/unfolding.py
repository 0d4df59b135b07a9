"""The whole body from the sixth that was meshed: mesh and displacements of its six images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pretravel.base import FloatArray, IntArray, frozen, needed
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.mesh import frozen_integers, six_nodes
from pretravel.design.fem.regions import seat_face
from pretravel.design.fem.symmetry import COPIES, ThreefoldSymmetry

_MIRRORED = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
"""Nodes of a mirrored element in an order that keeps its volume positive."""


class Unfolded(NamedTuple):
    """A whole mesh, and where its nodes come from."""

    mesh: FiniteElementMesh
    motion: IntArray
    """Of the symmetry, that brings a node of the sixth to each node, (n,)."""
    node: IntArray
    """That node, (n,)."""

    def modes(self, sixth: FloatArray, symmetry: ThreefoldSymmetry) -> FloatArray:
        """Displacements of the whole under the interface's loads, (n, 3, k), from the sixth's."""
        whole = np.empty((len(self.node), *sixth.shape[1:]))
        for copy in range(COPIES):
            own = self.motion == copy
            whole[own] = np.matmul(
                symmetry.motions[copy], sixth[self.node[own]] @ symmetry.interface[copy].T
            )
        return whole


def unfolded_mesh(sixth: FiniteElementMesh, symmetry: ThreefoldSymmetry) -> Unfolded:
    """The whole mesh: images share the nodes on the mirror planes."""
    needed("skfem", "fem")  # the sixth may come from the cache
    from skfem import MeshTet

    numbers, corner_points = _corner_images(sixth, symmetry)
    sources = [
        sixth.elements[:, _MIRRORED] if np.linalg.det(motion) < 0.0 else sixth.elements
        for motion in symmetry.motions
    ]
    corners = np.concatenate([numbers[copy][nodes[:, :4]] for copy, nodes in enumerate(sources)])
    linear = MeshTet(np.ascontiguousarray(corner_points.T), np.ascontiguousarray(corners.T))
    elements = np.concatenate([corners, len(corner_points) + linear.t2e.T], axis=1)
    count = len(corner_points) + linear.edges.shape[1]
    motion, node = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    motion[elements] = np.repeat(np.arange(COPIES), len(sixth.elements))[:, None]
    node[elements] = np.concatenate(sources)
    points = np.einsum("nij,nj->ni", symmetry.motions[motion], sixth.points[node])
    with_middles = six_nodes(linear)
    faces: dict[str, list[IntArray]] = {}
    for name, triangles in sixth.faces.items():
        for copy in range(COPIES):
            image = numbers[copy][triangles[:, :3]]
            faces.setdefault(_image_of(name, copy, symmetry), []).append(image)
    mesh = FiniteElementMesh(
        points=frozen(points),
        elements=frozen_integers(elements),
        regions=frozen_integers(np.tile(sixth.regions, COPIES)),
        region_names=sixth.region_names,
        faces={
            name: frozen_integers(with_middles(np.concatenate(parts)))
            for name, parts in sorted(faces.items())
        },
        boundary=frozen_integers(with_middles(linear.facets[:, linear.boundary_facets()].T)),
        quality=frozen(np.tile(sixth.quality, COPIES)),
        notes=sixth.notes,
    )
    return Unfolded(mesh, motion, node)


def _corner_images(
    sixth: FiniteElementMesh, symmetry: ThreefoldSymmetry
) -> tuple[IntArray, FloatArray]:
    """Number in the whole of each image of each corner, (6, n), and the corners' positions."""
    points = sixth.points[: sixth.corners]
    fixing = symmetry.fixing(points)
    numbers = np.empty((COPIES, len(points)), dtype=np.int64)
    positions: list[FloatArray] = []
    count = 0
    for copy, motion in enumerate(symmetry.motions):
        new = np.ones(len(points), dtype=np.bool_)
        for earlier in range(copy):
            between = symmetry.motions[earlier].T @ motion
            same = int(np.argmin(np.abs(symmetry.motions - between).sum(axis=(1, 2))))
            shared = fixing[same] & new
            numbers[copy, shared] = numbers[earlier, shared]
            new &= ~shared
        numbers[copy, new] = count + np.arange(new.sum())
        positions.append(points[new] @ motion.T)
        count += int(new.sum())
    return numbers, np.concatenate(positions)


def _image_of(name: str, copy: int, symmetry: ThreefoldSymmetry) -> str:
    """Name of the face that a face of the sixth becomes."""
    for seat in range(6):
        if name == seat_face(seat):
            return seat_face(int(np.argmax(symmetry.interface[copy, :6, seat])))
    return name
