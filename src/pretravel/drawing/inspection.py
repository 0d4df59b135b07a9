"""Inspection plans: the points of a surface to touch."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    ANGLE,
    COORDINATE,
    DISTANCE,
    REAL,
    STEP,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    check_numbers,
    checked,
    checked_values,
    polar_angle,
    unit,
)
from pretravel.drawing.steps_around import steps_around
from pretravel.surface import (
    Face,
    LocalGeometry,
    Part,
    Surface,
    apexes_of,
    at_open_end,
    distance_from_apexes,
)

_FINE = 200
"""Points along each parameter by which lengths are measured."""
_MOST = 1_000_000
"""Largest number of points of a grid or of rows."""
_MOST_CANDIDATES = 400_000
"""Largest number of points among which those by curvature are chosen."""
_MOST_OF_AN_END = 20_000
"""Largest number of points along an end of the parameters by which distances are measured."""
_OFF_FACE = "off the face or nearer to an edge or apex than the margin"
_SAME = "at the same place as another one"
_TURNED_AWAY = "turned away"
_AT_APEX = 1e-3
"""Distance from an apex that is always kept: it has no normal. [mm]"""
_SAME_PLACE = 1e-6
"""[mm]"""


@dataclass(frozen=True, eq=False)
class InspectionPlan:
    """Points to touch, ordered by faces and rows.

    Attributes
    ----------
    face : (n,) int
        Number of the face in its part; 0 for a surface that is not a part's face.
    uv : (n, 2) float
    point, normal : (n, 3) float
        [mm]
    left_out : mapping of str to int
        Number of points that were left out, by reason.
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
        """A label for each point: its face and its number on the face."""
        names, counts = [], dict.fromkeys(np.unique(self.face).tolist(), 0)
        for face in self.face.tolist():
            counts[face] += 1
            names.append(f"face{face}-{counts[face]}" if face else f"point-{counts[face]}")
        return tuple(names)


@dataclass(frozen=True)
class InspectionRegion:
    """The part of a surface on which points are chosen.

    Parameters
    ----------
    margin : float
        Distance kept from edges. [mm]
    u, v : pairs of float, optional
        Ranges of the parameters; needed where a surface is unbounded.
    max_polar : float
        Largest angle between a normal and the axis. [rad]
    axis : (3,) float
        Direction of the probe, up to the spindle, in the surface's frame; of any length.

    Raises
    ------
    PretravelError
        A negative margin, an axis without a direction, or a range that does not increase.

    >>> region = InspectionRegion(max_polar=math.radians(60.0))
    >>> region.turned_away(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])).tolist()
    [False, True]
    """

    margin: float = 1.0
    u: tuple[float, float] | None = None
    v: tuple[float, float] | None = None
    max_polar: float = 0.5 * math.pi
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        check_numbers(self, margin=DISTANCE, max_polar=ANGLE)
        if not np.any(checked_values(self.axis, "the axis", REAL)):
            raise PretravelError(
                "the axis (0, 0, 0) has no direction: give the one towards the spindle",
                inputs=("axis",),
            )
        for name, wanted in (("u", self.u), ("v", self.v)):
            if wanted is not None:
                checked_values(wanted, f"the range of {name}", COORDINATE)
        for name, wanted in (("u", self.u), ("v", self.v)):
            if wanted is not None and not wanted[0] < wanted[1]:
                raise PretravelError(f"the range of {name} {wanted} must increase", inputs=(name,))

    def box(self, surface: Surface) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest parameters of a surface within the region, (2,) each.

        Raises
        ------
        PretravelError
            An unbounded surface without a range.
        """
        if isinstance(surface, Face):
            low, high = (bound.copy() for bound in surface.box)
        else:
            low, high = np.array(surface.domain.lower), np.array(surface.domain.upper)
        for axis, (name, wanted) in enumerate((("u", self.u), ("v", self.v))):
            if wanted is not None:
                low[axis], high[axis] = wanted
            if not (np.isfinite(low[axis]) and np.isfinite(high[axis])):
                raise PretravelError(
                    f"this surface has no end along {name}: give a range of {name}",
                    inputs=(name,),
                )
        return low, high

    def turned_away(self, normals: FloatArray) -> BoolArray:
        """Which normals are further from the axis than allowed."""
        axis = unit(self.axis)
        along = normals @ axis
        across = np.linalg.norm(normals - along[:, None] * axis, axis=1)
        seen = np.column_stack([across, np.zeros_like(along), along])
        return np.asarray(polar_angle(seen) > self.max_polar + 1e-9)


def plan_inspection(
    surface: Surface | Part,
    *,
    grid: tuple[int, int] | None = None,
    spacing: float | None = None,
    chord: float | None = None,
    region: InspectionRegion | None = None,
) -> InspectionPlan:
    """Choose points by a grid of parameters, by distance, or by curvature.

    Parameters
    ----------
    surface : Surface or Part
        Points are chosen on the chosen faces of a part.
    grid : pair of int
        Number of points along u and along v, evenly spaced in the parameters.
    spacing : float
        Largest distance between neighbours in a row, and between rows. [mm]
    chord : float
        Largest distance between the surface and a chord from neighbour to neighbour. Flat regions
        have neighbours at `spacing`, or at a tenth of the surface's size. [mm]
    region : InspectionRegion, optional
        The whole surface, 1 mm from its edges, when not given.

    Returns
    -------
    InspectionPlan

    Raises
    ------
    PretravelError
        No way to choose the points or more than one; an unbounded surface; no point left.

    >>> from pretravel.surface.shapes import Sphere
    >>> region = InspectionRegion(margin=0.0, v=(0.3, 1.5))
    >>> len(plan_inspection(Sphere([0, 0, 0], 10.0), grid=(8, 3), region=region))
    24
    """
    _check_one_way(grid, spacing, chord)
    region = region or InspectionRegion()
    chosen: list[tuple[int, FloatArray, LocalGeometry]] = []
    left_out = {_OFF_FACE: 0, _SAME: 0, _TURNED_AWAY: 0}
    for number, piece in _pieces(surface):
        if grid is not None:
            uv, usable = _grid_on(piece, region, grid)
            left_out[_OFF_FACE] += int(np.sum(~usable))
            uv = uv[usable]
            again = _repeated(piece.derivatives(uv)[0])
            left_out[_SAME] += int(np.sum(again))
            uv = uv[~again]
        elif chord is not None:
            uv = _by_curvature(piece, region, chord, spacing)
        else:
            assert spacing is not None  # one way was chosen above
            uv = _rows(piece, region, spacing)
        local = piece.local(uv)
        away = region.turned_away(local.normal)
        left_out[_TURNED_AWAY] += int(np.sum(away))
        chosen.append((number, uv[~away], local.take(np.flatnonzero(~away))))
    return _plan(chosen, {why: count for why, count in left_out.items() if count})


def _check_one_way(
    grid: tuple[int, int] | None, spacing: float | None, chord: float | None
) -> None:
    ways = [name for name, value in (("grid", grid), ("chord", chord)) if value is not None]
    if spacing is not None and chord is None:
        ways.append("spacing")
    if len(ways) != 1:
        raise PretravelError(
            "a plan needs one way to choose its points: a grid, a spacing or a chord (by curvature)"
            + (f"; there are {' and '.join(ways)}" if ways else ""),
            inputs=("grid", "spacing", "curvature"),
        )
    for name, value in (("spacing", spacing), ("chord", chord)):
        if value is not None:
            checked(value, f"the {name}", STEP, inputs=(name,))


def _pieces(surface: Surface | Part) -> list[tuple[int, Surface]]:
    if isinstance(surface, Part):
        return [(surface.faces[i].number, surface.faces[i]) for i in surface.chosen]
    return [(0, surface)]


def _plan(
    chosen: list[tuple[int, FloatArray, LocalGeometry]], left_out: dict[str, int]
) -> InspectionPlan:
    if not any(len(uv) for _, uv, _ in chosen):
        reasons = ", ".join(f"{count} {why}" for why, count in left_out.items())
        raise PretravelError(
            f"no point is left to touch ({reasons or 'the surface is too small'}); choose a finer "
            "grid or spacing, a smaller margin or a larger polar angle",
            inputs=("margin", "max_polar"),
        )
    return InspectionPlan(
        face=np.concatenate([np.full(len(uv), number) for number, uv, _ in chosen]),
        uv=np.concatenate([uv for _, uv, _ in chosen]),
        point=np.concatenate([local.point for *_, local in chosen]),
        normal=np.concatenate([local.normal for *_, local in chosen]),
        left_out=left_out,
    )


def _periodic(surface: Surface) -> list[bool]:
    return [bool(np.isfinite(period)) for period in surface.domain.period]


def _grid_on(
    surface: Surface, region: InspectionRegion, counts: tuple[int, int]
) -> tuple[FloatArray, BoolArray]:
    """A grid on a surface, and which of its points can be used."""
    low, high = region.box(surface)
    uv = _grid(low, high, counts, _periodic(surface))
    return uv, _usable(surface, uv, region.margin)


def _grid(
    low: FloatArray, high: FloatArray, counts: tuple[int, int], periodic: list[bool]
) -> FloatArray:
    if min(counts) < 1 or counts[0] * counts[1] > _MOST:
        raise PretravelError(
            f"a grid of {counts[0]} x {counts[1]}: it can have 1 to {_MOST} points"
        )
    axes = []
    for axis in (0, 1):
        n, span = counts[axis], high[axis] - low[axis]
        closed = periodic[axis] and span > 2.0 * math.pi - 1e-9
        # A full turn must not contain its seam twice; a single point lies in the middle.
        if closed:
            share = steps_around(n) / (2.0 * math.pi)
        else:
            share = np.linspace(0.0, 1.0, n) if n > 1 else np.array([0.5])
        axes.append(low[axis] + share * span)
    v, u = np.meshgrid(axes[1], axes[0], indexing="ij")
    return np.column_stack([u.ravel(), v.ravel()])


def _usable(surface: Surface, uv: FloatArray, margin: float) -> BoolArray:
    """Which points lie on the surface, and not closer to its edges than the margin."""
    from scipy.spatial import cKDTree

    inside = surface.inside(uv)
    if isinstance(surface, Face):
        ends = surface.edge_samples(0.2 * margin) if margin > 0.0 and surface.borders else None
    else:
        # A touch slides: on an end of the parameters it may leave the surface.
        inside &= ~at_open_end(surface, uv)
        ends = _samples_of_ends(surface, 0.2 * margin) if margin > 0.0 else None
    if ends is not None and len(ends):
        distance, _ = cKDTree(surface.derivatives(ends)[0]).query(surface.derivatives(uv)[0])
        inside &= distance >= margin * (1.0 - 1e-9)
    places = apexes_of(surface)
    if len(places):
        distance = distance_from_apexes(surface.derivatives(uv)[0], places)
        inside &= distance >= max(margin * (1.0 - 1e-9), _AT_APEX)
    return np.asarray(inside)


def _repeated(points: FloatArray) -> BoolArray:
    """Which points are at the place of an earlier one, as those of a pole are."""
    _, first = np.unique(np.round(points / _SAME_PLACE), axis=0, return_index=True)
    repeated = np.ones(len(points), dtype=bool)
    repeated[first] = False
    return repeated


def _samples_of_ends(surface: Surface, spacing: float) -> FloatArray:
    """Parameters along the ends of a bounded surface that are edges, (n, 2)."""
    low, high = np.array(surface.domain.lower), np.array(surface.domain.upper)
    lines = []
    for axis in (0, 1):
        other = 1 - axis
        if not (np.isfinite(low[other]) and np.isfinite(high[other])):
            continue  # an edge of infinite length: only shapes without ends have it
        for end in (low[axis], high[axis]):
            if not np.isfinite(end):
                continue
            line = np.full((_FINE, 2), end)
            line[:, other] = np.linspace(low[other], high[other], _FINE)
            steps = np.linalg.norm(np.diff(surface.derivatives(line)[0], axis=0), axis=1)
            count = int(min(np.ceil(_FINE * steps.max() / spacing) + _FINE, _MOST_OF_AN_END))
            line = np.full((count, 2), end)
            line[:, other] = np.linspace(low[other], high[other], count)
            lines.append(line[at_open_end(surface, line)])
    return np.concatenate(lines) if lines else np.zeros((0, 2))


def _rows(
    surface: Surface, region: InspectionRegion, spacing: float, most: int = _MOST
) -> FloatArray:
    """Rows of points along u; points in a row, and rows, are at most the spacing apart."""
    low, high = region.box(surface)
    share = np.linspace(0.0, 1.0, _FINE)
    u, v = low[0] + share * (high[0] - low[0]), low[1] + share * (high[1] - low[1])
    uu, vv = np.meshgrid(u, v)
    points = surface.derivatives(np.column_stack([uu.ravel(), vv.ravel()]))[0]
    points = points.reshape(_FINE, _FINE, 3)
    across = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0).max()
    along = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).max()
    if (across / spacing + 1.0) * (along / spacing + 1.0) > most:
        raise PretravelError(
            f"a spacing of {spacing:g} mm on {along:.3g} x {across:.3g} mm makes more than "
            f"{most} points; choose a larger spacing"
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
    return uv[_usable(surface, uv, region.margin)]


def _by_curvature(
    surface: Surface, region: InspectionRegion, chord: float, widest: float | None
) -> FloatArray:
    """Points whose distance c depends on the curvature k: the height of a chord is k c²/8."""
    from scipy.spatial import cKDTree

    samples = _grid(*region.box(surface), (60, 60), [False, False])
    kept = _usable(surface, samples, region.margin)  # not at an apex, whose curvature has no end
    local = surface.local(samples[kept if kept.any() else surface.inside(samples)])
    size = float(np.linalg.norm(np.ptp(local.point, axis=0)))
    widest = 0.1 * size if widest is None else widest
    wanted = _distance(local, chord, widest)
    # Candidates are twice as dense as the most curved place needs.
    dense = 0.5 * float(wanted.min())
    try:
        uv = _rows(surface, region, dense, _MOST_CANDIDATES)
    except PretravelError as error:
        raise PretravelError(
            f"a chord height of {chord:g} mm needs points every {wanted.min():.3g} mm; {error}"
        ) from None
    local = surface.local(uv)
    reach = _distance(local, chord, widest)
    tree = cKDTree(local.point)
    free = np.ones(len(uv), dtype=bool)
    taken = []
    # The most curved places first: their neighbours are the nearest.
    for row in np.argsort(reach, kind="stable").tolist():
        if free[row]:
            taken.append(row)
            free[tree.query_ball_point(local.point[row], reach[row] * (1.0 - 1e-9))] = False
    return np.asarray(uv[np.sort(taken)])


def _distance(local: LocalGeometry, chord: float, widest: float) -> FloatArray:
    bend = np.abs(local.principal_curvatures).max(axis=1)
    return np.asarray(np.minimum(np.sqrt(8.0 * chord / np.maximum(bend, 1e-12)), widest))
