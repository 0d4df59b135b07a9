"""Normals of a digitised surface from neighbouring tip centres, and how far they can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import DEGREE, BoolArray, FloatArray, IntArray, PretravelError, frozen
from pretravel.maps import PretravelMap
from pretravel.measurement.points import Points
from pretravel.surface import tangent_basis
from pretravel.touches import Touches

_NEIGHBOURS = 12  # a surface of second order has six numbers
_FEWEST = 8
_DOUBTFUL = 1.0 * DEGREE  # of a normal: it moves a point on a ball of 6 mm by 50 µm sideways
_STEP = 1e-3  # rad, of the map's slope
_FLAT = 1e-3  # of the extent of neighbours: those in a row have no normal
_LEAST = 1e-4  # rad: what fourth orders leave that the weights do not show
_NEARER = 2.0  # of the weight of neighbours, by the square of their distance
_TOGETHER = 20_000
_NAMED = 8


@dataclass(frozen=True, eq=False)
class NeighbourNormals:
    """Normals of tip centres on a digitised surface.

    Attributes
    ----------
    normals : (n, 3) float
        On the side of +z.
    turn : (n,) float
        Standard uncertainty of each, in each of two directions. [rad]
    doubtful : (n,) bool
        Where the curvature changes between the neighbours, as at an edge, or the points scatter.
    spacing : float
        Mean distance of a point from its nearest neighbour. [mm]
    """

    normals: FloatArray
    turn: FloatArray
    doubtful: BoolArray
    spacing: float


def neighbour_normals(tip_centres: FloatArray) -> NeighbourNormals:
    """Normals of a digitised surface from neighbouring tip centres.

    The tip centres lie on the surface at the distance of the tip's radius from that of the part,
    which has the same normals.

    Parameters
    ----------
    tip_centres : (n, 3) float
        [mm]

    Raises
    ------
    PretravelError
        Too few points, or points in a row.

    Notes
    -----
    A surface of second order is fitted to the twelve nearest points, near ones with more weight.
    The uncertainty of its normal is that of the fit, with the scatter of the points about it, and
    the change of the normal by equal weights, which is about that by the orders that are not
    fitted.

    >>> x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    >>> roof = np.column_stack([x.ravel(), y.ravel(), 0.5 * x.ravel()])
    >>> found = neighbour_normals(roof)
    >>> (found.normals[0].round(6) + 0.0).tolist(), bool(found.doubtful.any())
    ([-0.447214, 0.0, 0.894427], False)
    """
    from scipy.spatial import cKDTree

    points = np.asarray(tip_centres, dtype=np.float64)
    if len(points) < _FEWEST:
        raise PretravelError(
            f"{len(points)} points are too few for normals from neighbouring points; at least "
            f"{_FEWEST} are needed",
            inputs=("feature",),
        )
    tree = cKDTree(points)
    count = min(_NEIGHBOURS + 1, len(points))
    found = tree.query(points, k=count)
    distance, near = np.asarray(found[0]), np.asarray(found[1], dtype=np.int64)
    parts = [
        _normals_of(points, near[start : start + _TOGETHER], start)
        for start in range(0, len(points), _TOGETHER)
    ]
    normals, turn, bent = (np.concatenate(each) for each in zip(*parts, strict=True))
    return NeighbourNormals(
        frozen(normals),
        frozen(turn),
        np.asarray((turn > _DOUBTFUL) | (bent > 10.0 * _DOUBTFUL)),
        float(np.mean(distance[:, 1])),
    )


def _normals_of(
    points: FloatArray, near: IntArray, start: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Normals, their standard uncertainty, and how far the second order turned them. [rad]"""
    here = points[start : start + len(near)]
    offset = points[near] - here[:, None]
    middle = offset.mean(axis=1, keepdims=True)
    _, extent, axes = np.linalg.svd(offset - middle, full_matrices=False)
    row = np.flatnonzero(extent[:, 1] <= _FLAT * extent[:, 0])
    if len(row):
        raise PretravelError(
            f"the neighbours of point {start + int(row[0]) + 1} lie in a row: they have no normal. "
            "Digitise a surface in two directions, or give the normals",
            inputs=("feature",),
        )
    u, v, w = (np.einsum("nkj,nj->nk", offset, axes[:, i]) for i in range(3))
    scale = np.sqrt(np.mean(u**2 + v**2, axis=1))[:, None]
    a, b = u / scale, v / scale
    design = np.stack([np.ones_like(a), a, b, a**2, a * b, b**2], axis=2)
    if near.shape[1] < _FEWEST + 1:
        design = design[:, :, :3]
    # Near points count more; what the far ones change is that of orders that are not fitted.
    weight = np.exp(-_NEARER * (a**2 + b**2))[..., None]
    slopes, noise = _slopes(design, w, weight, scale)
    others, _ = _slopes(design, w, np.ones_like(weight), scale)
    bent = np.linalg.norm(slopes, axis=1)
    normals = axes[:, 2] - slopes[:, :1] * axes[:, 0] - slopes[:, 1:] * axes[:, 1]
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals = normals * np.where(normals[:, 2] < 0.0, -1.0, 1.0)[:, None]
    changed = np.linalg.norm(slopes - others, axis=1)
    return normals, np.sqrt(noise**2 + changed**2 + _LEAST**2), bent


def _slopes(
    design: FloatArray, heights: FloatArray, weight: FloatArray, scale: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Slopes of the fitted surface at its first point, (n, 2), and their standard uncertainty."""
    inverse = np.linalg.pinv(design * weight)
    found = np.einsum("nkm,nm->nk", inverse, heights * weight[..., 0])
    left = (heights - np.einsum("nmk,nk->nm", design, found)) * weight[..., 0]
    dof = max(design.shape[1] - design.shape[2], 1)
    scatter = np.sqrt(np.sum(left**2, axis=1) / dof)
    noise = scatter * np.sqrt(np.sum(inverse[:, 1:3] ** 2, axis=(1, 2)) / 2.0) / scale[:, 0]
    return found[:, 1:3] / scale, noise


def with_errors_of_neighbours(
    touches: Touches, points: Points, pretravel_map: PretravelMap
) -> tuple[Points, tuple[str, ...]]:
    """Points whose normals are those of neighbouring touches: with the errors of these normals.

    Parameters
    ----------
    touches : Touches
    points : Points
        Compensated with these normals.
    pretravel_map : PretravelMap
        In the frame of the points.

    Returns
    -------
    Points
    tuple of str
        What to say of the normals.
    """
    found = neighbour_normals(touches.positions)
    median, largest = (float(turn) / DEGREE for turn in (np.median(found.turn), found.turn.max()))
    uncertain = (
        f"normals from neighbours {found.spacing:.3g} mm apart: uncertain by {median:.2g}° "
        f"(median) to {largest:.2g}°, which is in the covariance of the points"
    )
    said = [uncertain]
    doubtful = np.flatnonzero(found.doubtful)
    if len(doubtful):
        names = ", ".join(points.labels[row] for row in doubtful[:_NAMED].tolist())
        more = "…" if len(doubtful) > _NAMED else ""
        said.append(
            f"the normals of {len(doubtful)} touches are doubtful: the surface is curved too much "
            f"for this spacing, or has an edge there ({names}{more}). Touch more closely there, or "
            "take the normals of the nominal surface"
        )
    return with_errors_of_normals(points, pretravel_map, found.turn), tuple(said)


def with_errors_of_normals(points: Points, pretravel_map: PretravelMap, turn: FloatArray) -> Points:
    """Points with the uncertainty that the normals of their compensation bring.

    Parameters
    ----------
    points : Points
    pretravel_map : PretravelMap
        In the frame of the points.
    turn : (n,) float
        Standard uncertainty of each normal, in each of two directions. [rad]

    Returns
    -------
    Points
        Their covariance contains the tip's radius times the turn sideways. Along the normal it
        contains what the cosine leaves of the radius (of second order), and the change of the
        pretravel by the turn.

    >>> from pretravel.drawing.alignment.alignment import radius_alone
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> one = Points(up, up, np.zeros(1), np.zeros((1, 3, 3)), None, ("a",))
    >>> found = with_errors_of_normals(one, radius_alone(3.0), np.array([0.01])).covariance[0]
    >>> (np.sqrt(np.diag(found)) * 1e3).round(3).tolist()          # µm: 3 mm · 0.01, 3 mm · 0.01²
    [30.0, 30.0, 0.3]
    """
    normals = points.normals
    sides = tangent_basis(normals)
    here = np.nan_to_num(pretravel_map.pretravel(normals, extrapolate=True))
    by_turn = np.zeros(len(points))
    for k in range(2):
        turned = normals + _STEP * sides[:, k]
        turned /= np.linalg.norm(turned, axis=1)[:, None]
        there = np.nan_to_num(pretravel_map.pretravel(turned, extrapolate=True))
        by_turn += ((there - here) / _STEP * turn) ** 2
    radius = pretravel_map.tip_radius
    sideways = (radius * turn) ** 2
    along = by_turn + (radius * turn**2) ** 2  # two directions, each half the square
    each = np.einsum("nki,nkj->nij", sides, sides)
    outer = normals[:, :, None] * normals[:, None, :]
    more = sideways[:, None, None] * each + along[:, None, None] * outer
    return replace(points, covariance=frozen(points.covariance + more))
