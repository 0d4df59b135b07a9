"""Inspection plans: where on a surface to touch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.directions import polar_angle
from pretravel.errors import PretravelError
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import LocalGeometry, Surface

_FINE = 200
"""Points along each parameter with which lengths are measured."""
_MOST = 1_000_000
_MOST_CANDIDATES = 400_000


@dataclass(frozen=True, eq=False)
class InspectionPlan:
    """Points to touch, face by face, row by row.

    Attributes
    ----------
    face : (n,) int
        Number of the face in its part; 0 for a surface that is not of one.
    uv : (n, 2) float
    point, normal : (n, 3) float
        [mm]
    left_out : mapping of str to int
        How many points were not taken, by reason.
    """

    face: IntArray
    uv: FloatArray
    point: FloatArray
    normal: FloatArray
    left_out: dict[str, int]

    def __len__(self) -> int:
        return len(self.point)

    @property
    def labels(self) -> tuple[str, ...]:
        """One for each point: face and number on it."""
        names, counts = [], dict.fromkeys(np.unique(self.face).tolist(), 0)
        for face in self.face.tolist():
            counts[face] += 1
            names.append(f"face{face}-{counts[face]}" if face else f"point-{counts[face]}")
        return tuple(names)


def plan_inspection(
    surface: Surface | Part,
    *,
    grid: tuple[int, int] | None = None,
    spacing: float | None = None,
    curvature: float | None = None,
    margin: float = 1.0,
    u_range: tuple[float, float] | None = None,
    v_range: tuple[float, float] | None = None,
    largest_polar: float = 0.5 * math.pi,
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> InspectionPlan:
    """Choose points by a grid of parameters, by distance, or by curvature.

    Parameters
    ----------
    surface : Surface or Part
        Of a part the chosen faces.
    grid : pair of int
        Points along u and along v, evenly in the parameters.
    spacing : float
        Distance of neighbours in rows and of rows at the most. [mm]
    curvature : float
        Neighbours so close that a chord between them leaves the surface by no more
        than this; flat regions get `spacing`, or a tenth of the surface's size. [mm]
    margin : float
        Distance kept from edges. [mm]
    u_range, v_range : pairs of float, optional
        Only there; needed where a surface has no bounds.
    largest_polar : float
        Normals further from the axis than this are left out. [rad]
    axis : (3,) float
        Of the probe, up to the spindle, in the surface's frame.

    Returns
    -------
    InspectionPlan

    Raises
    ------
    PretravelError
        Not exactly one way to choose, a surface without bounds, nothing left.

    >>> from pretravel.surface.shapes import Sphere
    >>> len(plan_inspection(Sphere([0, 0, 0], 10.0), grid=(8, 3), margin=0.0,
    ...                     v_range=(0.3, 1.5)))
    24
    """
    ways = [name for name, value in (("grid", grid), ("curvature", curvature)) if value is not None]
    if spacing is not None and curvature is None:
        ways.append("spacing")
    if len(ways) != 1:
        raise PretravelError(
            "a plan needs one way to choose its points: a grid, a spacing or a curvature"
            + (f"; there are {' and '.join(ways)}" if ways else "")
        )
    for name, value in (("spacing", spacing), ("curvature", curvature)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PretravelError(f"the {name} is {value:g} mm; it must be above zero")
    if not margin >= 0.0:
        raise PretravelError(f"the margin is {margin:g} mm; it cannot be negative")
    if isinstance(surface, Part):
        pieces: list[tuple[int, Surface]] = [
            (surface.faces[i].number, surface.faces[i]) for i in surface.chosen
        ]
    else:
        pieces = [(0, surface)]
    found: list[tuple[int, FloatArray, LocalGeometry]] = []
    left_out = {"off the face or nearer to an edge than the margin": 0, "turned away": 0}
    for number, piece in pieces:
        low, high = _box(piece, u_range, v_range)
        if grid is not None:
            uv = _grid(low, high, grid, _comes_round(piece))
            usable = _usable(piece, uv, margin)
            left_out["off the face or nearer to an edge than the margin"] += int(np.sum(~usable))
            uv = uv[usable]
        elif curvature is None:
            assert spacing is not None  # one way was chosen above
            uv = _rows(piece, low, high, spacing, margin)
        else:
            uv = _by_curvature(piece, low, high, curvature, spacing, margin)
        local = piece.local(uv)
        away = polar_angle(_seen_along(local.normal, axis)) > largest_polar + 1e-9
        left_out["turned away"] += int(np.sum(away))
        found.append((number, uv[~away], local.take(np.flatnonzero(~away))))
    if not any(len(uv) for _, uv, _ in found):
        reasons = ", ".join(f"{count} {why}" for why, count in left_out.items() if count)
        raise PretravelError(
            f"no point is left to touch ({reasons or 'the surface is too small'}); choose a finer "
            "grid or spacing, a smaller margin or a larger --max-polar"
        )
    return InspectionPlan(
        face=np.concatenate([np.full(len(uv), number) for number, uv, _ in found]),
        uv=np.concatenate([uv for _, uv, _ in found]),
        point=np.concatenate([local.point for *_, local in found]),
        normal=np.concatenate([local.normal for *_, local in found]),
        left_out={why: count for why, count in left_out.items() if count},
    )


def _seen_along(normals: FloatArray, axis: tuple[float, float, float]) -> FloatArray:
    """Normals as (across, 0, along) of an axis, so that polar angles are measured from it."""
    along = normals @ np.asarray(axis)
    across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    return np.column_stack([across, 0.0 * along, along])


def _box(
    surface: Surface, u_range: tuple[float, float] | None, v_range: tuple[float, float] | None
) -> tuple[FloatArray, FloatArray]:
    if isinstance(surface, Face):
        low, high = (bound.copy() for bound in surface.box)
    else:
        low, high = np.array(surface.domain.lower), np.array(surface.domain.upper)
    for axis, (name, wanted) in enumerate((("u", u_range), ("v", v_range))):
        if wanted is not None:
            if not wanted[0] < wanted[1]:
                raise PretravelError(f"the range of {name} {wanted} must go upwards")
            low[axis], high[axis] = wanted
        if not (np.isfinite(low[axis]) and np.isfinite(high[axis])):
            raise PretravelError(
                f"this surface has no end along {name}: say from where to where, --{name} from,to"
            )
    return low, high


def _comes_round(surface: Surface) -> list[bool]:
    return [bool(np.isfinite(period)) for period in surface.domain.period]


def _grid(
    low: FloatArray, high: FloatArray, counts: tuple[int, int], round_: list[bool]
) -> FloatArray:
    if min(counts) < 1 or counts[0] * counts[1] > _MOST:
        raise PretravelError(f"a grid of {counts[0]} x {counts[1]}: 1 to {_MOST} points can be")
    axes = []
    for axis in (0, 1):
        n, span = counts[axis], high[axis] - low[axis]
        closed = round_[axis] and span > 2.0 * math.pi - 1e-9
        # A full turn must not have its seam twice; a single point goes to the middle.
        share = np.arange(n) / n if closed else np.linspace(0.0, 1.0, n) if n > 1 else [0.5]
        axes.append(low[axis] + np.asarray(share) * span)
    v, u = np.meshgrid(axes[1], axes[0], indexing="ij")
    return np.column_stack([u.ravel(), v.ravel()])


def _usable(surface: Surface, uv: FloatArray, margin: float) -> BoolArray:
    """On the surface and no nearer to its edges than the margin."""
    from scipy.spatial import cKDTree

    inside = surface.inside(uv)
    if margin > 0.0 and isinstance(surface, Face) and surface.borders:
        edges = surface.derivatives(surface.edge_samples(0.2 * margin))[0]
        distance, _ = cKDTree(edges).query(surface.derivatives(uv)[0])
        inside &= distance >= margin * (1.0 - 1e-9)
    return np.asarray(inside)


def _rows(
    surface: Surface,
    low: FloatArray,
    high: FloatArray,
    spacing: float,
    margin: float,
    most: int = _MOST,
) -> FloatArray:
    """Rows along u, evenly spaced along their length; rows no further apart than the spacing."""
    share = np.linspace(0.0, 1.0, _FINE)
    u, v = low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1])
    uu, vv = np.meshgrid(u, v)
    points = surface.derivatives(np.column_stack([uu.ravel(), vv.ravel()]))[0]
    points = points.reshape(_FINE, _FINE, 3)
    across = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0).max()
    along = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).max()
    if (across / spacing + 1.0) * (along / spacing + 1.0) > most:
        raise PretravelError(
            f"a spacing of {spacing:g} mm on {along:.3g} x {across:.3g} mm is more than {most} "
            "points; choose a larger one"
        )
    count = max(int(np.ceil(across / spacing)), 1)
    rows = []
    for height in low[1] + (np.arange(count) + 0.5) / count * (high[1] - low[1]):
        line = np.column_stack([u, np.full(_FINE, height)])
        steps = np.linalg.norm(np.diff(surface.derivatives(line)[0], axis=0), axis=1)
        length = np.concatenate([[0.0], np.cumsum(steps)])
        n = max(int(np.ceil(length[-1] / spacing)), 1)
        at = np.interp((np.arange(n) + 0.5) / n * length[-1], length, u)
        rows.append(np.column_stack([at, np.full(n, height)]))
    uv = np.concatenate(rows)
    return uv[_usable(surface, uv, margin)]


def _by_curvature(
    surface: Surface,
    low: FloatArray,
    high: FloatArray,
    chord: float,
    widest: float | None,
    margin: float,
) -> FloatArray:
    """Points whose distance follows the curvature: c²/8 times it is the chord's height."""
    from scipy.spatial import cKDTree

    probe = _grid(low, high, (60, 60), [False, False])
    probe = probe[surface.inside(probe)]
    local = surface.local(probe)
    size = float(np.linalg.norm(np.ptp(local.point, axis=0)))
    widest = 0.1 * size if widest is None else widest
    wanted = _distance(local, chord, widest)
    # Candidates twice as dense as the most curved place needs.
    dense = 0.5 * float(wanted.min())
    try:
        uv = _rows(surface, low, high, dense, margin, _MOST_CANDIDATES)
    except PretravelError as error:
        raise PretravelError(
            f"a chord height of {chord:g} mm needs points every {wanted.min():.3g} mm; {error}"
        ) from None
    local = surface.local(uv)
    reach = _distance(local, chord, widest)
    tree = cKDTree(local.point)
    free = np.ones(len(uv), dtype=bool)
    taken = []
    # The most curved first: their neighbours are the nearest.
    for row in np.argsort(reach, kind="stable").tolist():
        if free[row]:
            taken.append(row)
            free[tree.query_ball_point(local.point[row], reach[row] * (1.0 - 1e-9))] = False
    return np.asarray(uv[np.sort(taken)])


def _distance(local: LocalGeometry, chord: float, widest: float) -> FloatArray:
    bend = np.abs(local.principal_curvatures).max(axis=1)
    return np.asarray(np.minimum(np.sqrt(8.0 * chord / np.maximum(bend, 1e-12)), widest))
