"""The faces of an IGES file, joined to bodies with an outside; for the process of the CAD kernel.

Most IGES files contain faces that nothing connects, and an IGES face has no outside: its normal is
that of its surface. Faces that enclose a volume together have one. Files list body after body, so
faces are taken in the file's order until every edge has two faces. In an assembly this keeps bodies
apart whose edges coincide.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pretravel.base import FloatArray

SEWING = 0.01
"""Largest gap between two faces that are joined. [mm]"""


def joined(shape: Any) -> tuple[Any, int, int]:
    """The faces of a shape, joined to bodies; the normals of closed ones point out of the material.

    Parameters
    ----------
    shape : netgen.occ.TopoDS_Shape

    Returns
    -------
    shape : netgen.occ.TopoDS_Shape
    closed, open : int
        Number of bodies that enclose a volume, and of groups of faces that do not.
    """
    from netgen.occ import Compound, Solid

    solids, loose = list(shape.solids), list(shape.faces)
    if solids:  # the file itself has solids (its entity 186)
        inside = {face for solid in solids for face in solid.faces}
        loose = [face for face in loose if face not in inside]
    bodies = list(solids)
    closed, unclosed = len(solids), 0
    for group in _in_order(loose):
        for shell in _shells(group):
            if not _is_closed(shell):
                bodies.append(shell)
                unclosed += 1
                continue
            closed += 1
            body = Solid(shell)
            bodies.append(body if body.mass > 0.0 else body.Reversed())
    return (Compound(bodies) if bodies else shape), closed, unclosed


def _in_order(faces: list[Any]) -> list[list[Any]]:
    """Faces in the file's order, split where every edge before has its two faces."""
    edges = _edge_numbers(faces)
    groups: list[list[Any]] = [[]]
    unpaired: set[int] = set()
    for face, own in zip(faces, edges, strict=True):
        groups[-1].append(face)
        for edge in own:  # a seam is twice in its own face
            unpaired ^= {edge}
        if not unpaired and own:
            groups.append([])
    return [group for group in groups if group]


def _edge_numbers(faces: list[Any]) -> list[list[int]]:
    """A number for each edge of each face; edges at the same place have the same number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    own = [[_place(edge) for edge in face.edges if edge.mass > SEWING] for face in faces]
    places = [place for places in own for place in places]
    if not places:
        return [[] for _ in faces]
    pairs = cKDTree(np.array(places)).query_pairs(2.0 * SEWING, output_type="ndarray")
    size = len(places)
    links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
    _, number = connected_components(links, directed=False)
    ends = np.cumsum([len(places) for places in own])
    return [part.tolist() for part in np.split(number, ends[:-1])]


def _place(edge: Any) -> FloatArray:
    """Centre, middle of both ends and length of an edge: enough to recognize it. [mm]"""
    center, start, end = edge.center, edge.start, edge.end
    middle = [0.5 * (start[i] + end[i]) for i in range(3)]
    return np.array([center.x, center.y, center.z, *middle, edge.mass])


def _shells(faces: list[Any]) -> list[Any]:
    """Shells of sewn faces, and the faces that are joined to none."""
    from netgen.occ import Sew

    if len(faces) == 1:
        return faces
    sewn = Sew(faces, SEWING)
    shells = list(sewn.shells)
    inside = {face for shell in shells for face in shell.faces}
    return [*shells, *(face for face in sewn.faces if face not in inside)]


def _is_closed(shell: Any) -> bool:
    """Whether every edge has two faces, or twice the same; edges without a length do not count."""
    uses: dict[Any, int] = {}
    faces = list(shell.faces)
    for face in faces:
        for edge in face.edges:
            uses[edge] = uses.get(edge, 0) + 1
    return len(faces) > 1 and all(count == 2 for edge, count in uses.items() if edge.mass > SEWING)
