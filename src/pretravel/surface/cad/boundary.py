"""The boundary of a face, in the parameters of its surface."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.surface.cad.brep import Brep, ShapeRecord, ShapeUse
from pretravel.surface.curves import polyline
from pretravel.surface.local_geometry import Domain, Surface

_CHORD = 1e-4
"""Largest distance between a chord and its edge. [mm]"""
_OPEN = 1e-2
"""A boundary with a gap above this share of its size is not closed."""


def face_boundary(
    brep: Brep, face: ShapeRecord, surface: Surface
) -> tuple[list[FloatArray], list[FloatArray]]:
    """The boundary of a face, in the parameters of its surface.

    Parameters
    ----------
    brep : Brep
    face : ShapeRecord
    surface : Surface
        Of the face, untrimmed.

    Returns
    -------
    rings : list of (m, 2) float
        The boundary as closed polylines.
    borders : list of (m, 2) float
        Its edges without seams and poles.

    Raises
    ------
    PretravelError
        A boundary that does not close, or an edge without a curve.
    """
    rings: list[FloatArray] = []
    borders: list[FloatArray] = []
    open_chains: list[FloatArray] = []
    for wire in (part for part in face.parts if part.bounds):
        pieces = []
        for edge in (part for part in brep.shapes[wire.index].parts if part.bounds):
            backwards = wire.reverses != edge.reverses
            piece = _edge_in_parameters(brep, face, wire, edge, backwards, surface)
            pieces.append(piece[::-1] if backwards else piece)
            if not _is_seam(brep.shapes[edge.index], face):
                borders.append(piece)
        if not pieces:
            continue
        chain = _chained(pieces)
        size = float(np.max(np.ptp(chain, axis=0)))
        if np.abs(chain[0] - chain[-1]).max() <= _OPEN * size:
            rings.append(_closed(chain, 1e-9 * size))
        else:
            open_chains.append(chain)
    if open_chains:
        rings.append(_band(open_chains, surface.domain))
    return rings, borders


def _is_seam(edge: ShapeRecord, face: ShapeRecord) -> bool:
    """Whether the surface meets itself at this edge (a seam), or the edge is a point (a pole)."""
    if edge.curve is None:
        return True
    return any(of == face.surface and other for of, _, other, _, _ in edge.parameter_curves)


def _edge_in_parameters(
    brep: Brep,
    face: ShapeRecord,
    wire: ShapeUse,
    edge: ShapeUse,
    backwards: bool,
    surface: Surface,
) -> FloatArray:
    record = brep.shapes[edge.index]
    for of_surface, curve, other_side, first, last in record.parameter_curves:
        if of_surface == face.surface:
            which = other_side if backwards and other_side else curve
            shape = brep.plane_curves[which - 1]
            if shape.is_straight:
                return shape.value(np.array([first, last]))
            _, du, dv = surface.derivatives(shape.value(np.linspace(first, last, 9)))
            lengths = np.array([np.nanmax(np.linalg.norm(d, axis=1)) for d in (du, dv)])
            return polyline(shape, first, last, _CHORD, np.maximum(lengths, 1e-9))
    if record.curve is None:
        raise PretravelError("one of its edges has no curve")
    index, placement, first, last = record.curve
    shape = brep.space_curves[index - 1]
    points = polyline(shape, first, last, _CHORD)
    into_face = np.linalg.inv(face.placement) @ wire.placement @ edge.placement @ placement
    return surface.nearest(points @ into_face[:3, :3].T + into_face[:3, 3])


def _closed(chain: FloatArray, distinct: float) -> FloatArray:
    """A ring that ends at its start, without repeated points."""
    steps = np.abs(np.diff(chain, axis=0)).max(axis=1)
    ring = chain[np.concatenate([[True], steps > distinct])]
    if np.abs(ring[-1] - ring[0]).max() <= distinct:
        ring = ring[:-1]
    return np.concatenate([ring, ring[:1]])


def _chained(pieces: list[FloatArray]) -> FloatArray:
    """Pieces of a boundary joined end to end; the file may have them in any order."""
    chain, waiting = [pieces[0]], list(pieces[1:])
    while waiting:
        end = chain[-1][-1]
        gaps = [float(np.abs(piece[0] - end).max()) for piece in waiting]
        # The next piece of the file, unless another piece fits much better.
        best = int(np.argmin(gaps))
        size = float(np.max(np.ptp(np.concatenate([*chain, *waiting]), axis=0)))
        chain.append(waiting.pop(0 if gaps[0] <= gaps[best] + 1e-6 * size else best))
    return np.concatenate(chain)


def _band(chains: list[FloatArray], domain: Domain) -> FloatArray:
    """Joins two boundaries, each once around a periodic surface, into one ring."""
    if len(chains) == 2:
        first, second = chains
        for axis in (0, 1):
            period = domain.period[axis]  # infinite where it is not periodic: no turn
            turns = [float((c[-1] - c[0])[axis]) / period for c in chains]
            if all(abs(abs(turn) - 1.0) < _OPEN for turn in turns):
                if turns[0] * turns[1] > 0.0:
                    second = second[::-1]
                shift = np.zeros(2)
                shift[axis] = np.round((first[-1] - second[0])[axis] / period) * period
                return np.concatenate([first, second + shift, first[:1]])
    raise PretravelError("its boundary does not close in the surface's parameters")
