"""Where a part may lie, from touches alone: places from which an alignment can begin.

Three touches that lie far apart are compared with all triples of points of the part that have the
same distances; each triple is a placement, which the other touches judge. The best are improved
together on points of the part, and what is left is aligned on its faces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import fdtri

from pretravel.base import FloatArray, IntArray, Placement, PretravelError, frozen
from pretravel.drawing.alignment.alignment import Alignment
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.maps import PretravelMap
from pretravel.surface import Part

_SPACING = 1.0 / 45.0  # distance between points of the part, in sizes of it
_FIRST = 500  # points of the part that the first touch is tried on
_MOST_TRIPLES = 400_000
_JUDGES = 14  # touches that judge a triple
_SUBSET = 60  # touches that improve placements
_MANY = 200  # touches, of which some judge the starts on the faces
_KEPT = 600  # placements that are improved
_STEPS = (0.5, 0.25, 0.12, 0.06, 0.03)  # scales of the robust cost, in spacings
_LIKELY = 1.0  # excess of the mean robust cost up to which placements are aligned on the faces
_MOST_ALIGNED = 40
_SAME_START = 0.5  # spacings between the corners of a part at two placements that are one start
_FACING = 0.5  # cosine between an approach and the normal it can touch, for rough placements
_SEED = 1
_FEWEST = 6  # touches: as many as motions
_ON_A_LINE = 1e-3  # least width of the touches, in their length
_SAME_PLACE = 1e-2  # movement of the part's corners below which placements are one [mm]
_RARE = 1e-4  # probability at which residuals of the right placement are larger than of another
_LEAST_SCATTER = 1e-3  # of residuals: the form of a part [mm]


@dataclass(frozen=True, eq=False)
class _Locus:
    """Where the tip's centre can be while it touches the part: sample points, and their normals."""

    points: FloatArray
    normals: FloatArray
    tree: Any
    spacing: float


def found_placements(
    tips: TipCentres,
    part: Part,
    pretravel_map: PretravelMap,
    *,
    extrapolate: bool = False,
) -> list[Alignment]:
    """Alignments that explain the touches, without knowing anything of where the part lies.

    Parameters
    ----------
    tips : TipCentres
        With approaches where they are known, which exclude most placements.
    part : Part
    pretravel_map : PretravelMap
        In the axes of the machine.
    extrapolate : bool
        As of `align`.

    Returns
    -------
    list of Alignment
        The best first; several where the touches or a symmetry of the part leave the answer open.
        Empty where nothing fits.

    Raises
    ------
    PretravelError
        Fewer than six touches, or touches on one line.
    """
    _refuse_too_little(tips.positions)
    locus = _locus(part, pretravel_map.tip_radius)
    starts = _from_triples(tips, locus)
    starts = _improved(tips, locus, starts)
    return _aligned(tips, part, pretravel_map, starts, locus, extrapolate=extrapolate)


def _locus(part: Part, radius: float) -> _Locus:
    from scipy.spatial import cKDTree

    cloud = part.cloud_of_chosen
    normals = np.empty_like(cloud.points)
    order = np.argsort(cloud.face, kind="stable")
    ends = np.flatnonzero(np.diff(cloud.face[order])) + 1
    for mine in np.split(order, ends):
        normals[mine] = part.faces[int(cloud.face[mine[0]])].local(cloud.uv[mine]).normal
    good = np.isfinite(normals).all(axis=1)
    points, normals = cloud.points[good] + radius * normals[good], normals[good]
    # Where another face is nearer than the tip's radius, the tip cannot be.
    room = cloud.tree.query(points)[0] > 0.98 * radius
    points, normals = points[room], normals[room]
    spacing = _SPACING * part.size
    cell = np.floor(points / spacing).astype(np.int64)
    facing = np.round(2.0 * normals).astype(np.int64)
    _, first = np.unique(np.hstack([cell, facing]), axis=0, return_index=True)
    points, normals = points[first], normals[first]
    return _Locus(points, normals, cKDTree(points), spacing)


def _refuse_too_little(positions: FloatArray) -> None:
    """Refuse touches that cannot say where a part lies, however it is shaped."""
    spread = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    if len(positions) < _FEWEST or spread[1] < _ON_A_LINE * max(float(spread[0]), 1.0):
        raise PretravelError(
            f"{len(positions)} touches{'' if len(positions) < _FEWEST else ' on one line'} do not "
            f"say where a part lies: at least {_FEWEST} on different faces are needed, or an "
            "approximate placement",
            inputs=("start",),
        )


def _triple(positions: FloatArray) -> IntArray:
    """Three touches that lie far apart and span a wide triangle."""
    middle = positions.mean(axis=0)
    first = int(np.argmax(np.linalg.norm(positions - middle, axis=1)))
    second = int(np.argmax(np.linalg.norm(positions - positions[first], axis=1)))
    along = positions[second] - positions[first]
    away = positions - positions[first]
    off = np.linalg.norm(np.cross(away, along), axis=1)
    return np.array([first, second, int(np.argmax(off))])


def _spread(positions: FloatArray, count: int) -> IntArray:
    """Touches that lie far from each other, one after the other."""
    chosen = [int(np.argmax(np.linalg.norm(positions - positions.mean(axis=0), axis=1)))]
    away = np.linalg.norm(positions - positions[chosen[0]], axis=1)
    while len(chosen) < min(count, len(positions)):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(positions - positions[chosen[-1]], axis=1))
    return np.array(chosen)


def _from_triples(tips: TipCentres, locus: _Locus) -> tuple[FloatArray, FloatArray]:
    """Rotations (s, 3, 3) and shifts (s, 3) of the most likely triples."""
    rng = np.random.default_rng(_SEED)
    own = _triple(tips.positions)
    a, b, c = tips.positions[own]
    wanted = (np.linalg.norm(b - a), np.linalg.norm(c - a), np.linalg.norm(c - b))
    points, near = locus.points, locus.spacing
    firsts = rng.permutation(len(points))[:_FIRST]
    each = max(_MOST_TRIPLES // len(firsts), 1)
    triples = []
    for first in firsts:
        away = np.linalg.norm(points - points[first], axis=1)
        seconds = np.flatnonzero(np.abs(away - wanted[0]) < near)
        thirds = np.flatnonzero(np.abs(away - wanted[1]) < near)
        if len(seconds) == 0 or len(thirds) == 0:
            continue
        between = np.linalg.norm(points[seconds][:, None] - points[thirds], axis=2)
        one, two = np.nonzero(np.abs(between - wanted[2]) < near)
        if len(one) > each:
            some = rng.choice(len(one), each, replace=False)
            one, two = one[some], two[some]
        triples.append(np.column_stack([np.full(len(one), first), seconds[one], thirds[two]]))
    if not triples:
        return np.zeros((0, 3, 3)), np.zeros((0, 3))
    found = np.vstack(triples)
    turn, shift = _onto(points[found], tips.positions[own])
    if tips.approaches is not None:
        normals = locus.normals[found] @ np.swapaxes(turn, 1, 2)
        facing = -np.sum(normals * tips.approaches[own], axis=2)
        good = np.all(facing > _FACING, axis=1)
        turn, shift = turn[good], shift[good]
    judges = _spread(tips.positions, _JUDGES)
    cost = np.empty(len(turn))
    for rows in np.array_split(np.arange(len(turn)), max(len(turn) // 20_000, 1)):
        part_points = _into_part(tips.positions[judges], turn[rows], shift[rows])
        distance, at = locus.tree.query(part_points, workers=-1)
        apart = np.minimum(distance / near, 3.0) ** 2
        if tips.approaches is not None:
            normals = np.einsum("sij,snj->sni", turn[rows], locus.normals[at])
            facing = -np.sum(normals * tips.approaches[judges], axis=2)
            apart = np.where(facing < 0.0, 9.0, apart)
        cost[rows] = apart.mean(axis=1)
    best = np.argsort(cost, kind="stable")[:_KEPT]
    return turn[best], shift[best]


def _onto(points: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations and shifts that bring triples, (s, 3, 3), onto three measured points."""
    middle, there = points.mean(axis=1), measured.mean(axis=0)
    product = np.einsum("ki,skj->sij", measured - there, points - middle[:, None])
    left, _, right = np.linalg.svd(product)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    turn = left @ right
    return turn, there - np.einsum("sij,sj->si", turn, middle)


def _into_part(positions: FloatArray, turn: FloatArray, shift: FloatArray) -> FloatArray:
    """Positions of the machine in the part's frame, for each placement, (s, n, 3)."""
    return np.asarray((positions - shift[:, None]) @ turn)


def _improved(
    tips: TipCentres, locus: _Locus, starts: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """All placements improved together, by the planes of the nearest points of the part."""
    from scipy.spatial.transform import Rotation

    turn, shift = starts
    if len(turn) == 0:
        return starts
    rows = _spread(tips.positions, _SUBSET)
    positions = tips.positions[rows]
    cost = np.zeros(len(turn))
    for size in np.repeat(_STEPS, 4):
        scale = size * locus.spacing
        part_points = _into_part(positions, turn, shift)
        _, at = locus.tree.query(part_points, workers=-1)
        normals = locus.normals[at]
        distance = np.sum((part_points - locus.points[at]) * normals, axis=2)
        middle = part_points.mean(axis=1, keepdims=True)
        arms = part_points - middle
        lever = np.sqrt(np.mean(np.sum(arms**2, axis=2), axis=1))[:, None, None]
        slopes = np.concatenate([normals, np.cross(arms / lever, normals)], axis=2)
        weight = 1.0 / (1.0 + (distance / scale) ** 2)
        cost = np.mean(np.log1p((distance / scale) ** 2), axis=1)
        matrix = np.einsum("sn,sni,snj->sij", weight, slopes, slopes)
        matrix += 1e-6 * len(rows) * np.eye(6)
        right = np.einsum("sn,sni,sn->si", weight, slopes, distance)
        step = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
        # The touches move by -step in the part's frame, the part by step.
        turned = step[:, 3:] / lever[:, 0]
        size_of_turn = np.linalg.norm(turned, axis=1, keepdims=True)
        turned *= np.minimum(1.0, 0.3 / np.maximum(size_of_turn, 1e-12))
        small = np.asarray(Rotation.from_rotvec(turned).as_matrix())
        # x = turn (small (p - middle) + middle + step) + shift, for points p of the part.
        held = middle[:, 0]
        moved = held + step[:, :3] - np.einsum("sij,sj->si", small, held)
        shift = shift + np.einsum("sij,sj->si", turn, moved)
        turn = turn @ small
    best = np.argsort(cost, kind="stable")
    likely = best[cost[best] < cost[best[0]] + _LIKELY]
    return turn[likely], shift[likely]


def _aligned(
    tips: TipCentres,
    part: Part,
    pretravel_map: PretravelMap,
    starts: tuple[FloatArray, FloatArray],
    locus: _Locus,
    *,
    extrapolate: bool,
) -> list[Alignment]:
    """Alignments from the best starts: the best one, and those that fit as well.

    Of many touches some judge the starts, and all of them those that are left.
    """
    if len(tips) > _MANY:
        few = _aligned(
            tips[_spread(tips.positions, _SUBSET)], part, pretravel_map, starts, locus,
            extrapolate=extrapolate,
        )  # fmt: skip
        kept = [each.placement for each in few]
        starts = np.array([each.rotation for each in kept]), np.array([each.shift for each in kept])
    corners = part.box[np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).T.reshape(-1, 3), [0, 1, 2]]
    starts_seen: list[Placement] = []
    found: list[Alignment] = []
    for turn, shift in zip(*starts, strict=True):
        start = Placement(frozen(_orthogonal(turn)), frozen(shift))
        if any(
            _apart(start, other, corners) < _SAME_START * locus.spacing for other in starts_seen
        ):
            continue
        starts_seen.append(start)
        if len(starts_seen) > _MOST_ALIGNED:
            break
        try:
            new = align(tips, part, pretravel_map, start, extrapolate=extrapolate)
        except PretravelError:
            continue  # a placement of chance, whose touches leave the map or the faces
        same = [k for k, old in enumerate(found) if _alike(new, old, corners)]
        if not same:
            found.append(new)
    if not found:
        return []
    found.sort(key=lambda each: (int(each.gross.sum()), each.scatter))
    best = found[0]
    free = best.association.dof
    if free < 1:
        return found
    worst = float(fdtri(free, free, 1.0 - _RARE)) * max(best.scatter, _LEAST_SCATTER) ** 2
    return [each for each in found if _as_good(each, best, worst)]


def _alike(new: Alignment, old: Alignment, corners: FloatArray) -> bool:
    """Whether two alignments are one, but for motions that the touches do not determine."""
    if _apart(new.placement, old.placement, corners) < _SAME_PLACE:
        return True
    undetermined = new.undetermined.shape[1] > 0
    foot, other = new.feet.local.point, old.feet.local.point
    # A part that has slid along itself has the same faces under the touches.
    return (
        undetermined
        and bool(np.all(new.feet.face == old.feet.face))
        and (
            float(np.abs(new.residuals - old.residuals).max()) < _SAME_PLACE
            and foot.shape == other.shape
        )
    )


def _as_good(each: Alignment, best: Alignment, largest_variance: float) -> bool:
    """Whether touches speak as much for one placement as for the best, within chance."""
    return each is best or (
        each.gross.sum() <= best.gross.sum() + 0.1 * len(best.points)
        and each.scatter**2 <= largest_variance
    )


def _orthogonal(turn: FloatArray) -> FloatArray:
    left, _, right = np.linalg.svd(turn)
    return np.asarray(left @ right)


def _apart(one: Placement, other: Placement, corners: FloatArray) -> float:
    """Largest distance between the corners of a part at two placements. [mm]"""
    return float(np.linalg.norm(one.points(corners) - other.points(corners), axis=1).max())
