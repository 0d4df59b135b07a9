"""The frame of a drawing from its datums, as measured features: ISO 5459.

Each datum takes the motions that it determines and those before it left: a second plane is
associated at the angle to the first that the drawing has. The frame follows from the parameters of
the datum features by linear equations, so that its errors are those of their points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import ConvergenceError, FloatArray, Placement, PretravelError, frozen
from pretravel.drawing.alignment.alignment_fit import touching
from pretravel.drawing.features.extreme_association import TANGENT
from pretravel.drawing.features.measured_feature import BARE_SURFACE, MeasuredFeature
from pretravel.measurement import Association
from pretravel.uncertainty import across

_DETERMINED = 1e-3  # of a unit motion: below it, a motion counts as not determined
_CLOSED = 1e-10  # mm
_STEPS = 50
_LARGEST_TURN = 0.5  # rad


@dataclass(frozen=True, eq=False)
class DatumFeature:
    """A measured feature that serves as a datum, with its place on the drawing.

    Attributes
    ----------
    feature : MeasuredFeature
    point : (3,) float
        Nominal: a point of the plane or axis, or the centre; of a surface the place beneath each
        touch, (n, 3). [mm]
    direction : (3,) float or None
        Nominal: outward normal of a plane, axis. None for a sphere. Of a surface the outward
        normal at each touch, (n, 3).
    middle : (3,) float or None
        Nominal: the middle of a plane's faces, where it is known. [mm]
    """

    feature: MeasuredFeature
    point: FloatArray
    direction: FloatArray | None
    middle: FloatArray | None = None

    @classmethod
    def as_measured(cls, feature: MeasuredFeature) -> DatumFeature:
        """A datum whose nominal place is where it is."""
        found = feature.association
        if feature.kind == BARE_SURFACE:
            raise PretravelError(
                f"datum {feature.label} consists of touched places: it has neither axis nor plane"
            )
        return cls(feature, found.point, found.direction)


Datums = Sequence[Sequence[DatumFeature]]
"""In the order of the drawing; several features are one common datum (A-B)."""


@dataclass(frozen=True, eq=False)
class DatumSystem:
    """The frame of a drawing in the frame of the points.

    Attributes
    ----------
    placement : Placement
        Of the frame of the drawing.
    features : tuple of MeasuredFeature
        All datum features, in order.
    by_parameters : tuple of (6, k) float
        Motion of the frame by the parameters of each: shift, and turn about the origin of the
        points. [mm, rad]
    free : (6, m) float
        Motions that the datums leave free: shift, and turn about the same origin. [mm, rad]
    by_places : (6, p) float
        Motion by one standard uncertainty each of where planes were touched: a datum plane that is
        tilted against those before it has another place where the middle of its touches is not
        that of its face. [mm, rad]
    idle : tuple of str
        Datums that fix no motion, because those before them leave none that they determine.
    """

    placement: Placement
    features: tuple[MeasuredFeature, ...]
    by_parameters: tuple[FloatArray, ...]
    free: FloatArray
    by_places: FloatArray
    idle: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """About datums without effect."""
        return tuple(
            f"datum {label} fixes no motion that the datums before it leave" for label in self.idle
        )


def moved_by_frame(points: FloatArray, along: FloatArray) -> FloatArray:
    """Movement of points along directions by the six motions of their frame, (n, 6).

    Parameters
    ----------
    points : (n, 3) float
        [mm]
    along : (n, 3) float
        Unit vectors.

    Returns
    -------
    (n, 6) float
        By shifts, and by turns about the origin. [1, mm]

    >>> moved_by_frame(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])).tolist()
    [[0.0, 1.0, 0.0, 0.0, 0.0, 1.0]]
    """
    return np.column_stack([along, np.cross(points, along)])


def datum_system(datums: Datums) -> DatumSystem:
    """The frame of a drawing from its measured datums.

    Parameters
    ----------
    datums : sequence of sequences of DatumFeature
        In the order of the drawing. None: the frame of the points, with all motions free.

    Returns
    -------
    DatumSystem
        Its placement is the one nearest to the frame of the points: what the datums leave free
        stays as it is.

    Raises
    ------
    PretravelError
        A feature that is not a datum (a line), or a nominal direction far from the measured one.
    ConvergenceError

    References
    ----------
    ISO 5459: the order of datums. The first is associated as it was measured: by least squares, or
    as the drawing's file states. A later one has the orientation that those before it leave, and
    the place in which the squares of its points' distances are least. A datum of touched places
    (by targets) that is tangent rests on them from outside the material.

    >>> datum_system(()).free.shape
    (6, 6)
    """
    for group in datums:
        for each in group:
            _refuse_no_datum(each)
    lever = _lever(datums)
    placement = Placement()
    for _ in range(_STEPS):
        motion, rows, places, free, idle = _staged(datums, placement, lever)
        size = float(np.linalg.norm(motion[3:]))
        motion = motion * min(1.0, _LARGEST_TURN / max(size, 1e-300))
        placement = placement.moved(motion)
        if max(float(np.abs(motion[:3]).max()), lever * size) < _CLOSED * lever:
            break
    else:
        raise ConvergenceError(
            "the fit of the datum system did not converge: are the nominal places those of the "
            "drawing?"
        )
    features = tuple(each.feature for group in datums for each in group)
    by_places = np.hstack([np.zeros((6, 0)), *places])
    return DatumSystem(
        placement, features, tuple(map(frozen, rows)), frozen(free), frozen(by_places), idle
    )


def _refuse_no_datum(datum: DatumFeature) -> None:
    kind, found = datum.feature.kind, datum.feature.association
    if kind == "line":
        raise PretravelError("a line is not a datum here; measure a plane, a slot or an axis")
    if kind != BARE_SURFACE and datum.direction is not None and found.direction is not None:
        cosine = abs(float(datum.direction @ found.direction))
        if cosine < math.cos(0.5):
            raise PretravelError(
                f"datum {datum.feature.label}: its nominal direction is "
                f"{math.degrees(math.acos(min(cosine, 1.0))):.0f}° from the measured one; align "
                "the points with the part first, or correct the axis"
            )


def _lever(datums: Datums) -> float:
    places = [each.point for group in datums for each in group]
    clouds = [each.feature.association.points for group in datums for each in group]
    if not places:
        return 1.0
    return max(float(np.ptp(np.vstack([*clouds, *places]), axis=0).max()), 1e-3)


def _staged(
    datums: Datums, placement: Placement, lever: float
) -> tuple[FloatArray, list[FloatArray], list[FloatArray], FloatArray, tuple[str, ...]]:
    """Motion that brings the nominal datums onto the measured ones, datum after datum.

    With its change by the parameters of each feature, by the places of touches, the motions that
    are left, and the datums that fix none.
    """
    from scipy.linalg import block_diag

    # The turns are about the middle of the datums, so that their scale is that of shifts.
    middle = np.zeros(3)
    places = [each.point for group in datums for each in group]
    if places:
        middle = placement.points(np.vstack(places)).mean(axis=0)
    to_origin = np.eye(6)
    # A turn w about the middle shifts the origin by -w x middle.
    to_origin[:3, 3:] = np.cross(np.eye(3), middle)
    scale = np.array([1.0, 1.0, 1.0, *(3 * [1.0 / lever])])
    rows: list[FloatArray] = []
    places_of_touches: list[FloatArray] = []
    left, motion = np.eye(6), np.zeros(6)
    idle: list[str] = []
    for group in datums:
        wanted = [_equations(each, placement, middle, lever) for each in group]
        matrix = np.vstack([one[0] for one in wanted]) * scale
        off = np.concatenate([one[1] for one in wanted])
        _, size, v = np.linalg.svd(matrix @ left, full_matrices=True)
        rank = int(np.sum(size > _DETERMINED))
        taken = left @ v[:rank].T
        idle += [] if rank else ["-".join(each.feature.label for each in group)]
        if rank < len(off) and all(_rests(each) for each in group):
            away, face = off - matrix @ motion, np.zeros(len(off), dtype=np.int64)
            amounts, by_distance = touching(away, -matrix @ taken, face, sizes_are_free=False)
            motion, inverse = motion + taken @ amounts, taken @ by_distance
        else:
            weight = block_diag(*(_weight(each, one[2]) for each, one in
                                  zip(group, wanted, strict=True)))  # fmt: skip
            inverse = taken @ np.linalg.pinv(weight @ matrix @ taken) @ weight
            motion = motion + inverse @ (off - matrix @ motion)
        rows, places_of_touches = (
            [row - inverse @ (matrix @ row) for row in each] for each in (rows, places_of_touches)
        )
        start, tilt = 0, off - matrix @ motion
        for each, (_, own, change) in zip(group, wanted, strict=True):
            mine = slice(start, start + len(own))
            rows.append(inverse[:, mine] @ change)
            u = _u_of_places(each, placement, tilt[mine] / lever)
            places_of_touches.append(inverse[:, mine] @ np.eye(len(own))[:, -1:] * u)
            start += len(own)
        left = left @ v[rank:].T

    def from_origin(of_middle: FloatArray) -> FloatArray:
        return np.asarray(to_origin @ (scale[:, None] * of_middle))

    return (
        from_origin(motion[:, None])[:, 0],
        [from_origin(row) for row in rows],
        [from_origin(row) for row in places_of_touches],
        from_origin(left),
        tuple(idle),
    )


def _u_of_places(datum: DatumFeature, placement: Placement, tilt: FloatArray) -> float:
    """Standard uncertainty of the place of a plane by where its touches have their middle. [mm]

    The place is that of this middle, where the tilt [rad] that the datums before it leave shows no
    more, and not of the middle of the face: where that is not known, the touches are anywhere on
    it. Its own errors tilt a plane too, but they are in u already. Zero of other features.
    """
    found, rows = datum.feature.association, datum.feature.association.direction_rows
    if datum.feature.kind != "plane" or datum.direction is None or rows is None:
        return 0.0
    sides = across(placement.vectors(datum.direction[None])[0])
    if datum.middle is not None:
        off = placement.points(datum.middle[None])[0] - found.points.mean(axis=0)
        return abs(float(sides @ off @ tilt[:2]))
    by_errors = np.asarray(sum(datum.feature.errors.parts(sides @ rows).values()))
    tilted = np.outer(tilt[:2], tilt[:2]) - by_errors
    middle = (found.points - found.points.mean(axis=0)) @ sides.T
    count = len(middle)
    squares = float(np.sum((middle @ tilted) * middle))
    return math.sqrt(max(squares, 0.0) / max(count * (count - 1), 1))


def _rests(datum: DatumFeature) -> bool:
    """Whether it is touched places from outside the material."""
    return datum.feature.kind == BARE_SURFACE and datum.feature.association.criterion == TANGENT


def _weight(datum: DatumFeature, change: FloatArray) -> FloatArray:
    """Weights of the equations of a datum with which their squares are those of its points, (e, e).

    Where the datums before it leave too few motions for its equations, the best of them is the
    feature of least squares under their constraint, which does not depend on the nominal point.
    """
    jacobian = datum.feature.association.jacobian
    scatter = change @ np.linalg.pinv(jacobian.T @ jacobian) @ change.T
    sizes, vectors = np.linalg.eigh(scatter)
    return np.asarray((vectors / np.sqrt(np.maximum(sizes, 1e-12 * sizes[-1]))).T)


def _equations(
    datum: DatumFeature, placement: Placement, middle: FloatArray, lever: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What a datum asks of a motion: matrix (e, 6), amounts (e,), their change by parameters.

    Directions are multiplied by the lever, so that all are in mm.
    """
    found: Association = datum.feature.association
    if datum.feature.kind == BARE_SURFACE:
        assert datum.direction is not None
        places, normals = placement.points(datum.point), placement.vectors(datum.direction)
        return (
            moved_by_frame(places - middle, normals),
            np.sum(normals * (found.points - places), axis=1),
            np.diag(np.sum(normals * found.outward, axis=1)),
        )
    matrix, off, change = [], [], []
    here = placement.points(datum.point[None])[0]
    if found.direction is not None and found.direction_rows is not None:
        assert datum.direction is not None
        nominal = placement.vectors(datum.direction[None])[0]
        sign = 1.0 if nominal @ found.direction >= 0.0 else -1.0
        for side in across(nominal):
            matrix.append(lever * np.concatenate([np.zeros(3), np.cross(nominal, side)]))
            off.append(lever * sign * float(side @ found.direction))
            change.append(lever * sign * (side @ found.direction_rows))
    apart = found.point - here
    for side in found.located_along:
        matrix.append(np.concatenate([side, np.cross(here - middle, side)]))
        off.append(float(side @ apart))
        change.append(side @ found.point_rows + turned_side(found, side) @ apart)
    return np.array(matrix), np.array(off), np.array(change)


def turned_side(found: Association, side: FloatArray) -> FloatArray:
    """Change of a direction of `located_along` by the parameters, (k, 3).

    That of a plane is its normal and turns with it; one across an axis turns against the axis.
    """
    rows = found.direction_rows
    if found.direction is None or rows is None:
        return np.zeros((found.point_rows.shape[1], 3))
    if abs(float(side @ found.direction)) > 0.5:
        return np.asarray(rows.T)
    return -np.outer(side @ rows, found.direction)
