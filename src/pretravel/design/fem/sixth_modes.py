"""Displacements of a symmetric body, from its sixth: one problem for each representation.

A tuple of d displacement fields that the motions of the group transform as an irreducible
representation of dimension d is known from its values on the sixth, and nodes on the mirror
planes carry fewer unknowns. The interface's loads are sums of such tuples of loads; each tuple
is one right-hand side, and no two representations are coupled.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.design.fem.elasticity import FiniteElementModel, rigid_motions
from pretravel.design.fem.free_body import free_solve
from pretravel.design.fem.symmetry import COPIES, ThreefoldSymmetry, adapted

if TYPE_CHECKING:  # a model from the cache does not need it, and loads faster without
    from scipy import sparse


def sixth_modes(
    model: FiniteElementModel,
    symmetry: ThreefoldSymmetry,
    weights: FloatArray,
    solver: str = "auto",
) -> FloatArray:
    """Displacements of the sixth under a newton on each entry of `INTERFACE`, (3 n, 22).

    Parameters
    ----------
    model : FiniteElementModel
        Of the sixth.
    symmetry : ThreefoldSymmetry
    weights : (3 n,) float
        Of each displacement in the mean rigid motion, which is zero in the whole body.
    solver : str

    Notes
    -----
    With F the tuples on the sixth, T their unknowns q (F = T q), B the adapted forces of the
    interface: all six images give the same terms, so that K q = T^T (loads) B with
    K = T^T (stiffness) T of the sixth alone, and the displacements are the sum of F B^T.
    """
    from scipy import sparse

    # Transposed it is the same, but by columns, as the transposed maps: no product converts it.
    whole = (model.stiffness + sparse.triu(model.stiffness, 1).T).T
    motions = rigid_motions(model.mesh.points)
    fixing = symmetry.fixing(model.mesh.points)
    modes = np.zeros_like(model.loads)
    for number, representation in enumerate(symmetry.representations):
        maps = _unknowns(fixing, symmetry, representation)
        forces = adapted(symmetry.interface, representation)
        rigid = adapted(symmetry.rigid, representation)
        stiffness = sum(chosen.T @ whole @ chosen for chosen in maps)
        solve = free_solve(
            sparse.triu(stiffness).tocsr(),
            _gathered(maps, motions, rigid),
            np.sum([chosen.power(2).T @ weights for chosen in maps], axis=0),
            solver,
            done=0.6 + 0.1 * number,
        )
        found = solve(_gathered(maps, model.loads, forces))
        for j, chosen in enumerate(maps):
            modes += (chosen @ found) @ forces[:, j].T
    return modes


def _gathered(maps: list[sparse.csr_matrix], fields: FloatArray, tuples: FloatArray) -> FloatArray:
    """Adapted combinations of fields (3 n, k) in the unknowns of the representation."""
    parts = [chosen.T @ (fields @ tuples[:, j]) for j, chosen in enumerate(maps)]
    return np.asarray(np.sum(parts, axis=0))


def _unknowns(
    fixing: BoolArray, symmetry: ThreefoldSymmetry, representation: FloatArray
) -> list[sparse.csr_matrix]:
    """For each field of a tuple, its displacements (3 n) by the unknowns; orthonormal columns.

    A motion that fixes a node restricts the tuple there to what it leaves unchanged.
    """
    from scipy import sparse

    size = representation.shape[1]
    on_tuple = np.einsum("gij,gkl->gikjl", symmetry.motions, representation)
    on_tuple = on_tuple.reshape(COPIES, 3 * size, 3 * size)
    patterns, pattern = np.unique(fixing, axis=1, return_inverse=True)
    rows, columns, values = [], [], []
    count = 0
    for number, fixed in enumerate(patterns.T):
        nodes = np.flatnonzero(pattern.ravel() == number)
        left, kept, _ = np.linalg.svd(on_tuple[fixed].mean(axis=0))
        allowed = left[:, kept > 0.5]
        shape = (len(nodes), *allowed.shape)
        own = count + np.arange(len(nodes) * allowed.shape[1]).reshape(len(nodes), 1, -1)
        entry = 3 * size * nodes[:, None, None] + np.arange(3 * size)[:, None]
        rows.append(np.broadcast_to(entry, shape).ravel())
        columns.append(np.broadcast_to(own, shape).ravel())
        values.append(np.broadcast_to(allowed, shape).ravel())
        count += own.size
    together = sparse.csr_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(3 * size * fixing.shape[1], count),
    )
    together.eliminate_zeros()
    return [together[field::size] for field in range(size)]
