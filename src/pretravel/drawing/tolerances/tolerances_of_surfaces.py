"""Tolerances of surfaces: the zone contains the touched points themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError
from pretravel.drawing.features.conformity import form_conformity
from pretravel.drawing.features.extreme_association import TANGENT
from pretravel.drawing.features.feature_form import (
    FormResult,
    form_by_trials,
    trials_for,
    zone_load,
    zone_widths,
)
from pretravel.drawing.features.feature_uncertainty import (
    FeatureErrors,
    covariance_by_weights,
    noise_of_features,
)
from pretravel.drawing.features.form_of_part import NO_FORM
from pretravel.drawing.features.measured_feature import (
    MeasuredFeature,
    Quantity,
    measure_feature,
)
from pretravel.drawing.tolerances.datum_system import DatumSystem, moved_by_frame
from pretravel.drawing.tolerances.tolerance_frame import (
    CYLINDRICITY,
    FORM_KINDS,
    ORIENTATION,
    PROFILE,
    ROUNDNESS,
    ROUNDS,
    RUN_OUT,
    TOTAL_RUN_OUT,
    DatumWord,
    Frame,
    GeometricResult,
    GeometricTolerance,
    PlacedFeature,
    frame_of,
    independent_columns,
    own_faces,
)
from pretravel.surface import feet_on_faces
from pretravel.uncertainty import about_axis, across

_SEED = 1
_MOST_WEIGHTS = 4000  # points of a surface whose common errors may be unknown
_FEWEST_IN_SECTION = {RUN_OUT: 3, ROUNDNESS: 4}
_SECTION = 0.02  # of the length of a cylinder: heights nearer than this are one section


def decided_surface(
    placed: PlacedFeature,
    tolerance: GeometricTolerance,
    groups: Sequence[DatumWord],
    required: float,
) -> GeometricResult:
    """Compare the touched points of a surface with a tolerance to datums.

    Parameters
    ----------
    placed : PlacedFeature
    tolerance : GeometricTolerance
    groups : sequence of DatumWord
    required : float
        Probability at which conformity or nonconformity is proven.
    """
    if tolerance.material or any(group.at_maximum for group in groups):
        raise PretravelError("a surface has no material condition; its axis or median plane has")
    if tolerance.tangent:
        placed = replace(placed, feature=_tangent(placed))
    frame = frame_of(placed, tolerance, groups)
    system = frame.system
    points = placed.feature.association.points
    for _ in range(ROUNDS):
        distance, normals, section = _distances(placed, frame, tolerance)
        if tolerance.tangent:  # of the plane at the touched places, not of the points
            distance = (
                distance - _along_zone(placed, normals) * placed.feature.association.residuals
            )
        if tolerance.offset:
            outside = np.sign(np.sum(normals * placed.feature.points.normals, axis=1))
            distance = distance - outside * tolerance.offset
        frame_rows = -moved_by_frame(points, normals)
        columns = _free_of_surface(frame_rows, system, tolerance, section)
        if tolerance.kind == ROUNDNESS:
            columns = _circles(normals, frame, columns)
        fitted = _flattest(distance, columns)
        left = distance + columns @ fitted
        if section is not None or tolerance.kind in (*ORIENTATION, *FORM_KINDS):
            break
        frame, turned = frame.moved(frame_rows, columns @ fitted)
        if not turned:
            break
    factor = _along_zone(placed, normals)
    form = _form(placed, tolerance, factor, left, columns, frame_rows, system)
    conformity = form_conformity(tolerance.name, form, tolerance.zone, required)
    quantity = Quantity(tolerance.name, form.value, form.u, {}, ends=form.interval)
    return GeometricResult(
        (placed.label,), tolerance, quantity, conformity, 0.0, columns.shape[1], system.remarks,
    )  # fmt: skip


def _along_zone(placed: PlacedFeature, normals: FloatArray) -> FloatArray:
    """Distances in the zone by movements along the outward normals of the feature, (n,).

    Errors move a point along these; the zone may be seen otherwise.
    """
    touched = placed.feature.points.normals
    along = np.sum(normals * touched, axis=1)
    sign = np.sum(placed.feature.association.outward * touched, axis=1)
    return np.asarray(along / np.where(np.abs(sign) > 0.1, sign, 1.0))


def _tangent(placed: PlacedFeature) -> MeasuredFeature:
    """The plane outside the material that rests on the highest points."""
    feature = placed.feature
    return measure_feature(
        feature.points,
        "plane",
        u_machine=feature.errors.machine,
        label=feature.label,
        association=TANGENT,
    )


def _free_of_surface(
    frame_rows: FloatArray,
    system: DatumSystem,
    tolerance: GeometricTolerance,
    section: IntArray | None,
) -> FloatArray:
    """What moves the distances freely: motions, the place of an orientation, each section."""
    if section is not None:
        return np.asarray((section[:, None] == np.unique(section)).astype(float))
    free = [frame_rows @ system.free]
    if tolerance.kind in (*ORIENTATION, CYLINDRICITY):  # of a place, or of a radius
        free.append(np.ones((len(frame_rows), 1)))
    return independent_columns(np.hstack(free))


def _circles(normals: FloatArray, frame: Frame, sections: FloatArray) -> FloatArray:
    """What moves the distances of each section freely: its radius, and its centre across."""
    assert frame.direction is not None
    sideways = normals @ across(frame.direction).T
    return np.hstack([sections, *(sections * each[:, None] for each in sideways.T)])


def _distances(
    placed: PlacedFeature, frame: Frame, tolerance: GeometricTolerance
) -> tuple[FloatArray, FloatArray, IntArray | None]:
    """Distances of the points from the nominal surface, its normals, and sections of a run-out."""
    feature, points = placed.feature, placed.feature.association.points
    kind, direction = feature.kind, frame.direction
    if tolerance.kind in (RUN_OUT, TOTAL_RUN_OUT, ROUNDNESS, CYLINDRICITY):
        assert direction is not None
        height, radius, outward = about_axis(points, frame.point, direction)
        axial = kind in ("plane", "line")
        value = height if axial else radius
        normals = np.tile(direction, (len(points), 1)) if axial else outward
        if tolerance.kind == CYLINDRICITY:
            return value - value.mean(), normals, None
        whole = tolerance.kind == TOTAL_RUN_OUT
        of_section = np.zeros(len(points), dtype=int) if whole else _sections(
            placed, radius if axial else height, tolerance.kind
        )  # fmt: skip
        return value - value.mean(), normals, of_section
    if placed.part is not None and tolerance.kind == PROFILE:
        place = frame.system.placement
        feet = feet_on_faces(placed.part, place.inverse.points(points), own_faces(placed))
        return feet.distance, place.vectors(feet.local.normal), None
    if kind in ("plane", "line"):
        assert direction is not None
        normals = np.tile(direction, (len(points), 1))
        return (points - frame.point) @ direction, normals, None
    if placed.size is None:
        raise PretravelError(
            f"{placed.label}: a profile needs the nominal diameter, or the part: give nominal_mm"
        )
    nominal = 0.5 * placed.size
    if kind == "sphere":
        away = points - frame.point
        length = np.linalg.norm(away, axis=1)
        return np.asarray(length - nominal), away / length[:, None], None
    if kind in ("circle", "bore", "boss", "cylinder"):
        assert direction is not None
        _, distance, outward = about_axis(points, frame.point, direction)
        return distance - nominal, outward, None
    raise PretravelError(f"the profile of a {kind} needs the part, with whose faces it is compared")


def _sections(placed: PlacedFeature, place: FloatArray, kind: str) -> IntArray:
    """Numbers of the sections that the points of a run-out or a roundness form by their place."""
    order = np.argsort(place)
    steps = np.diff(place[order])
    near = max(_SECTION * float(np.ptp(place)), 1e-2)
    number = np.concatenate([[0], np.cumsum(steps > near)])
    found = np.empty(len(place), dtype=int)
    found[order] = number
    fewest = _FEWEST_IN_SECTION[kind]
    few = np.flatnonzero(np.bincount(number) < fewest)
    if len(few):
        label = placed.feature.points.labels[int(np.flatnonzero(found == few[0])[0])]
        raise PretravelError(
            f"{placed.label}: a {kind} is evaluated in single sections, and the section of point "
            f"{label} has fewer than {fewest} points. Touch several places of each section"
            + (", or give the total run-out" if kind == RUN_OUT else "")
        )
    return found


def _flattest(distance: FloatArray, columns: FloatArray) -> FloatArray:
    """Amounts of the columns with the smallest largest distance: a linear program (HiGHS)."""
    if columns.shape[1] == 0:
        return np.zeros(0)
    from scipy.optimize import linprog

    scale = max(float(np.abs(distance).max()), 1e-9)
    one = -np.ones((len(distance), 1))
    found = linprog(
        np.eye(columns.shape[1] + 1)[-1],
        A_ub=np.vstack([np.hstack([columns, one]), np.hstack([-columns, one])]),
        b_ub=np.concatenate([-distance, distance]) / scale,
        bounds=[(None, None)] * (columns.shape[1] + 1),
        method="highs",
    )
    if not found.success:
        raise PretravelError(f"the zone was not found: {found.message}")
    return np.asarray(scale * np.asarray(found.x)[:-1])


def _form(
    placed: PlacedFeature,
    tolerance: GeometricTolerance,
    factor: FloatArray,
    left: FloatArray,
    columns: FloatArray,
    frame_rows: FloatArray,
    system: DatumSystem,
) -> FormResult:
    """The extent of the zone with its bounds, as `feature_form.form_result` finds those of a form.

    The errors of the datums move the zone. The form of the surface itself is no error.
    """
    generator, own = np.random.default_rng(_SEED), placed.feature.errors
    surface = replace(own, form=NO_FORM)
    involved = [surface, *(each.errors for each in system.features)]
    trials = trials_for(len(left))
    drawn = noise_of_features(involved, trials, generator)
    found, noise = own.association, drawn[0]
    if tolerance.tangent:
        noise = -(noise @ found.response.T) @ found.jacobian.T
    moved = factor * noise
    for each, rows, noise in zip(system.features, system.by_parameters, drawn[1:], strict=True):
        moved = moved + (noise @ each.errors.association.response.T) @ (frame_rows @ rows).T
    amounts = generator.standard_normal((trials, system.by_places.shape[1]))
    moved = moved + amounts @ (frame_rows @ system.by_places).T
    opposed, load = None, zone_load(left, columns)
    if not own.correlation_known:
        fit = np.linalg.pinv(columns) if columns.shape[1] else np.zeros((0, len(left)))
        points = -found.jacobian @ found.response if tolerance.tangent else np.eye(len(left))
        own_rows = np.asarray(factor[:, None] * points, dtype=np.float64)
        fit = np.asarray(fit, dtype=np.float64)
        u = _largest_u(involved, own_rows, columns, fit, frame_rows, system)
        opposed = generator.standard_normal((trials, 1)) * np.sign(load) * u
    return form_by_trials(
        left,
        moved,
        partial(zone_widths, columns=columns),
        load,
        opposed=opposed,
        u_machine=placed.feature.errors.machine,
        generator=generator,
    )


def _largest_u(
    involved: Sequence[FeatureErrors],
    own: FloatArray,
    columns: FloatArray,
    fit: FloatArray,
    frame_rows: FloatArray,
    system: DatumSystem,
) -> FloatArray:
    """Largest standard uncertainties of the distances that any correlation allows, (n,)."""
    count = len(own)
    if count > _MOST_WEIGHTS:
        raise PretravelError(
            f"{count} points whose common errors are not given are too many for this tolerance; "
            "compensate the touches with this version"
        )
    weights = [own]
    for each, rows in zip(system.features, system.by_parameters, strict=True):
        weights.append(frame_rows @ rows @ each.errors.association.response)
    joint = np.hstack(weights)
    joint = joint - columns @ (fit @ joint)
    return np.array(
        [math.sqrt(sum(float(part[0, 0]) for part in
                       covariance_by_weights(involved, row[None]).values())) for row in joint]
    )  # fmt: skip
