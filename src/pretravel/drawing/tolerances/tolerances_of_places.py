"""Tolerances of centres, axes and median planes: a few places, located by their features."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pretravel.base import FloatArray, PretravelError, unit
from pretravel.drawing.features.conformity import zone_conformity
from pretravel.drawing.features.feature_uncertainty import (
    MACHINE,
    PLACES_ON_DATUMS,
    FeatureErrors,
    covariance_by_source,
    dof_of_features,
)
from pretravel.drawing.features.largest_distance import largest_distance
from pretravel.drawing.features.measured_feature import Quantity
from pretravel.drawing.tolerances.datum_system import DatumSystem, moved_by_frame
from pretravel.drawing.tolerances.tolerance_frame import (
    COAXIALITY,
    MAXIMUM,
    ORIENTATION,
    POSITION,
    ROUNDS,
    SYMMETRY,
    TO_AXIS,
    DatumWord,
    Frame,
    GeometricResult,
    GeometricTolerance,
    PlacedFeature,
    frame_of,
    independent_columns,
)
from pretravel.uncertainty import across

_SAME_AXIS = math.cos(math.radians(1.0))
_NO_TURN = 1e-9


@dataclass(frozen=True, eq=False)
class _Places:
    """Located places of derived elements, with the change of each row by its causes.

    Attributes
    ----------
    located : (g, m) float
        Distances from the nominal; places that have fewer than m directions are filled with zeros.
    own : list of (g m, k) float
        By the parameters of each toleranced feature.
    frame : (g m, 6) float
        By motions of the frame.
    free : (g m, f) float
        By motions that are fitted.
    """

    located: FloatArray
    own: list[FloatArray]
    frame: FloatArray
    free: FloatArray


def decided_places(
    features: Sequence[PlacedFeature],
    tolerance: GeometricTolerance,
    groups: Sequence[DatumWord],
    required: float,
) -> GeometricResult:
    """Compare derived elements (centres, axes, median planes) with a tolerance to datums.

    Parameters
    ----------
    features : sequence of PlacedFeature
        One, or those of a pattern.
    tolerance : GeometricTolerance
    groups : sequence of DatumWord
    required : float
        Probability at which conformity or nonconformity is proven.
    """
    frames = _about_stated_axes(
        features, [frame_of(placed, tolerance, groups) for placed in features]
    )
    places, located, remarks = _fitted_places(features, frames, tolerance, groups)
    bonus, size_row, most_bonus = _bonus(features, tolerance)
    terms = _terms(features, frames[0].system, places, size_row)
    parts = covariance_by_source(terms)
    size = located.size + (size_row is not None)
    machine = features[0].feature.errors.machine
    if machine > 0.0:
        parts[MACHINE] = machine**2 * np.eye(size)
    moved = places.frame @ frames[0].system.by_places
    if moved.any():
        moved = np.vstack([moved, np.zeros((size - len(moved), moved.shape[1]))])
        parts[PLACES_ON_DATUMS] = moved @ moved.T
    keep = _projection(places.free, size)
    along = _along(located, parts, keep)
    conformity = zone_conformity(
        tolerance.name,
        located,
        np.asarray(sum(parts.values())),
        (tolerance.zone, bonus, most_bonus),
        required,
        dof=_dof(terms, parts, along),
        refit=keep,
    )
    quantity = _quantity(tolerance.name, located, parts, (keep, along), conformity.dof)
    return GeometricResult(
        tuple(placed.label for placed in features),
        tolerance,
        quantity,
        conformity.with_value(quantity.value, quantity.u),
        bonus,
        places.free.shape[1],
        (*remarks, *frames[0].system.remarks),
    )


def _about_stated_axes(features: Sequence[PlacedFeature], frames: list[Frame]) -> list[Frame]:
    """The frames, free to turn about the axis of circles alone, if all have the same.

    Touches at one height do not show an axis: it is stated. A turn across it would move circles of
    nearly the same height sideways by their small differences in height, as far as one likes.
    """
    axes = [
        frame.direction
        for placed, frame in zip(features, frames, strict=True)
        if frame.direction is not None
        and placed.feature.association.direction is not None
        and placed.feature.association.direction_rows is None
    ]
    system = frames[0].system
    if len(axes) < len(features) or min(abs(axis @ axes[0]) for axis in axes) < _SAME_AXIS:
        return frames
    _, size, rows = np.linalg.svd(across(axes[0]) @ system.free[3:])
    turning = int(np.sum(size > _NO_TURN))
    if turning == 0:
        return frames
    system = replace(system, free=system.free @ rows[turning:].T)
    return [replace(frame, system=system) for frame in frames]


def _fitted_places(
    features: Sequence[PlacedFeature],
    frames: list[Frame],
    tolerance: GeometricTolerance,
    groups: Sequence[DatumWord],
) -> tuple[_Places, FloatArray, tuple[str, ...]]:
    """The places, and their distances after what the datums leave free and may shift, (g, m)."""
    for _ in range(ROUNDS):
        places = _places(features, frames, tolerance)
        floating, reach, remarks = _datum_float(groups, places.frame)
        amounts = _best_fit(places.located, places.free, floating, reach)
        columns = np.hstack([places.free, floating])
        located = places.located + (columns @ amounts).reshape(places.located.shape)
        if tolerance.kind in (*ORIENTATION, *TO_AXIS):
            break
        change = places.free @ amounts[: places.free.shape[1]]
        turned = [frame.moved(places.frame, change) for frame in frames]
        if not turned[0][1]:
            break
        frames = [frame for frame, _ in turned]
    return places, located, remarks


def _terms(
    features: Sequence[PlacedFeature],
    system: DatumSystem,
    places: _Places,
    size_row: tuple[int, FloatArray] | None,
) -> list[tuple[FeatureErrors, FloatArray]]:
    """Change of the distances (and of the growth of the zone) by the features and the datums."""
    terms = [
        (placed.feature.errors, rows) for placed, rows in zip(features, places.own, strict=True)
    ]
    terms += [
        (each.errors, places.frame @ rows)
        for each, rows in zip(system.features, system.by_parameters, strict=True)
    ]
    terms = _merged(terms)
    if size_row is None:
        return terms
    owner = features[size_row[0]].feature.errors
    return [
        (errors, np.vstack([rows, size_row[1] if errors is owner else 0.0 * rows[:1]]))
        for errors, rows in terms
    ]


def _along(located: FloatArray, parts: Mapping[str, FloatArray], keep: FloatArray) -> FloatArray:
    """Weights of the errors in the largest distance, after the fit of free motions."""
    worst = int(np.argmax(np.linalg.norm(located, axis=1)))
    length = float(np.linalg.norm(located[worst]))
    mine = slice(worst * located.shape[1], (worst + 1) * located.shape[1])
    whole = np.asarray(sum(parts.values()))[mine, mine]
    along = np.zeros(len(keep))
    along[mine] = located[worst] / length if length > 0.0 else np.linalg.eigh(whole)[1][:, -1]
    return np.asarray(along @ keep)


def _quantity(
    name: str,
    located: FloatArray,
    parts: Mapping[str, FloatArray],
    fit: tuple[FloatArray, FloatArray],
    dof: float,
) -> Quantity:
    """Twice the largest distance; its sources have shares as along itself.

    `fit` is what a fit of free motions leaves of errors, and their weights in the largest distance.
    """
    keep, along = fit
    share = {
        cause: 2.0 * math.sqrt(max(float(along @ part @ along), 0.0))
        for cause, part in parts.items()
    }
    count = located.size
    total = np.asarray(sum(parts.values()))[:count, :count]
    found = largest_distance(located, total, dof, keep[:count, :count])
    linear = math.sqrt(sum(each**2 for each in share.values()))
    share = {cause: each * found.u / max(linear, 1e-300) for cause, each in share.items()}
    return Quantity(name, found.value, found.u, share, dof=found.dof, ends=found.ends)


def _merged(
    terms: Sequence[tuple[FeatureErrors, FloatArray]],
) -> list[tuple[FeatureErrors, FloatArray]]:
    """One term for each feature: one may be toleranced and a datum of others."""
    found: list[tuple[FeatureErrors, FloatArray]] = []
    for errors, rows in terms:
        same = next((i for i, (known, _) in enumerate(found) if known is errors), None)
        if same is None:
            found.append((errors, rows))
        else:
            found[same] = (errors, found[same][1] + rows)
    return found


def _dof(
    terms: Sequence[tuple[FeatureErrors, FloatArray]],
    parts: Mapping[str, FloatArray],
    along: FloatArray,
) -> float:
    """Degrees of freedom of a weighted sum; of the two features that matter most, by their form."""
    u = math.sqrt(max(sum(float(along @ part @ along) for part in parts.values()), 0.0))
    if u == 0.0:
        return math.inf
    rows = [(errors, (along @ each)[None]) for errors, each in terms]
    weight = []
    for errors, row in rows:
        variances, likely = errors.form.variances((row @ errors.association.response)[0])
        weight.append(float(variances @ likely))
    chosen = np.argsort(weight)[::-1][:2]
    return dof_of_features([rows[i] for i in chosen], u)


def _places(
    features: Sequence[PlacedFeature], frames: Sequence[Frame], tolerance: GeometricTolerance
) -> _Places:
    located: list[FloatArray] = []
    own_rows: list[list[FloatArray]] = []
    frame_rows: list[FloatArray] = []
    shifts: list[FloatArray] = []
    for placed, frame in zip(features, frames, strict=True):
        for sides, away, rows, at in _located(placed, frame, tolerance):
            located.append(away)
            own_rows.append([rows if one is placed else np.zeros((len(sides), _size(one)))
                             for one in features])  # fmt: skip
            frame_rows.append(-moved_by_frame(np.tile(at, (len(sides), 1)), sides))
            shifts.append(-sides)
    width = max(len(each) for each in located)
    pad = [width - len(each) for each in located]

    def stacked(blocks: Sequence[FloatArray]) -> FloatArray:
        return np.vstack(
            [np.pad(block, ((0, more), (0, 0))) for block, more in zip(blocks, pad, strict=True)]
        )

    frame_all = stacked(frame_rows)
    free = frame_all @ frames[0].system.free
    if tolerance.kind in ORIENTATION:  # the zone may lie anywhere
        free = np.hstack([free, stacked(shifts)])
    return _Places(
        np.array([np.pad(each, (0, more)) for each, more in zip(located, pad, strict=True)]),
        [stacked([block[i] for block in own_rows]) for i in range(len(features))],
        frame_all,
        independent_columns(free),
    )


def _size(placed: PlacedFeature) -> int:
    return int(placed.feature.association.jacobian.shape[1])


_Located = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def _located(placed: PlacedFeature, frame: Frame, tolerance: GeometricTolerance) -> list[_Located]:
    """Places of a derived element: directions (m, 3), distances (m,), rows (m, k), nominal point.

    A centre is one place; an axis two, at the ends of its touched length; a median plane one for
    each touched point.
    """
    found = placed.feature.association
    if tolerance.kind == SYMMETRY and frame.direction is not None and found.direction is not None:
        along = float(found.direction @ frame.direction)
        if abs(along) < 0.5:  # an axis in a plane, or a plane with an axis in it
            frame = replace(frame, direction=unit(found.direction - along * frame.direction))
    if found.direction is None or found.direction_rows is None:
        if tolerance.kind in ORIENTATION:
            raise PretravelError(f"{placed.label}: a {placed.feature.kind} has no orientation")
        sides, at = found.located_along, frame.point
        if frame.direction is not None and (len(sides) < 3 or tolerance.kind == COAXIALITY):
            # Across the nominal axis; along it, a centre has no place.
            sides = across(frame.direction)
            at = at + float((found.point - at) @ frame.direction) * frame.direction
        away = sides @ (found.point - at)
        return [(sides, away, sides @ found.point_rows, at)]
    direction = frame.direction
    assert direction is not None
    sign = 1.0 if direction @ found.direction >= 0.0 else -1.0
    if placed.feature.kind == "slot":
        heights = (found.points - found.point) @ across(found.direction).T
        on_plane = found.point + heights @ across(found.direction)
        return [_on_plane(placed, frame, sign, place) for place in on_plane]
    height = (found.points - found.point) @ found.direction
    sides = across(direction)
    rows = []
    ends = (float(height.min()), float(height.max()))
    if tolerance.between is not None:  # a projected zone, beyond the touched length
        start = float((frame.point - found.point) @ found.direction)
        ends = (start + sign * tolerance.between[0], start + sign * tolerance.between[1])
    for end in ends:
        place = found.point + end * found.direction
        at = frame.point + float((place - frame.point) @ direction) * direction
        own = sides @ (found.point_rows + end * found.direction_rows)
        rows.append((sides, np.asarray(sides @ (place - at)), own, np.asarray(at)))
    if placed.feature.kind == "torus" and tolerance.kind == POSITION:
        return [(found.located_along, found.located_along @ (found.point - frame.point),
                 found.located_along @ found.point_rows, frame.point)]  # fmt: skip
    return rows


def _on_plane(placed: PlacedFeature, frame: Frame, sign: float, place: FloatArray) -> _Located:
    """A place of a median plane, along the nominal normal."""
    found, direction = placed.feature.association, frame.direction
    assert direction is not None
    assert found.direction is not None
    assert found.direction_rows is not None
    arm = place - found.point
    # The plane moves at a place with its point, and with its normal against the arm.
    rows = sign * (found.direction @ found.point_rows - arm @ found.direction_rows)
    at = place - float((place - frame.point) @ direction) * direction
    return (
        direction[None],
        np.array([float(direction @ (place - frame.point))]),
        rows[None],
        at,
    )


def _best_fit(
    located: FloatArray, free: FloatArray, floating: FloatArray, reach: float
) -> FloatArray:
    """Amounts of the free motions that make the largest distance least.

    The last two columns are a shift of at most `reach`.
    """
    columns = np.hstack([free, floating])
    count = columns.shape[1]
    if count == 0:
        return np.zeros(0)
    from scipy.optimize import minimize

    flat = located.ravel()
    scale = max(float(np.abs(flat).max()), 1e-9)
    start = np.zeros(count)
    if free.shape[1]:
        start[: free.shape[1]] = np.linalg.lstsq(free, -flat / scale, rcond=None)[0]

    def distances(x: FloatArray) -> FloatArray:
        left = (flat / scale + columns @ x[:count]).reshape(located.shape)
        return np.asarray(np.sum(left**2, axis=1))

    def slopes(x: FloatArray) -> FloatArray:
        left = (flat / scale + columns @ x[:count]).reshape(located.shape)
        by = columns.reshape(*located.shape, count)
        return np.asarray(2.0 * np.einsum("gm,gmk->gk", left, by))

    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[count] - distances(x),
            "jac": lambda x: np.column_stack([-slopes(x), np.ones(len(located))]),
        }
    ]
    if floating.shape[1]:
        most = (reach / scale) ** 2
        constraints.append(
            {"type": "ineq", "fun": lambda x: np.array([most - np.sum(x[count - 2 : count] ** 2)])}
        )
    begun = np.append(start, float(distances(start).max()))
    solver: Any = minimize
    found = solver(
        lambda x: float(x[count]),
        begun,
        jac=lambda _: np.eye(count + 1)[count],
        constraints=constraints,
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-14},
    )
    best = np.asarray(found.x[:count])
    if floating.shape[1]:
        size = float(np.linalg.norm(best[-2:]))
        best[-2:] *= min(1.0, reach / scale / max(size, 1e-300))
    if distances(best).max() > distances(start).max():
        best = start
    return np.asarray(scale * best)


def _projection(free: FloatArray, size: int) -> FloatArray:
    """What of errors is left after a fit of the free motions, (size, size)."""
    keep = np.eye(size)
    if free.shape[1]:
        count = len(free)
        keep[:count, :count] -= free @ np.linalg.pinv(free)
    return keep


def _bonus(
    features: Sequence[PlacedFeature], tolerance: GeometricTolerance
) -> tuple[float, tuple[int, FloatArray] | None, float]:
    """Growth of the tolerance by the size, the change of it by the parameters, its largest value.

    Of a pattern, that of the feature with the smallest growth, for all.
    """
    if not tolerance.material:
        return 0.0, None, 0.0
    found = [_departure(placed, tolerance.material) for placed in features]
    least = int(np.argmin([each[0] for each in found]))
    value, row, most = found[least]
    return value, (least, row), most


def _departure(placed: PlacedFeature, material: str) -> tuple[float, FloatArray, float]:
    """Departure from the maximum (or least) material size, its row, and the largest one. [mm]"""
    feature = placed.feature
    if feature.association.diameter is None or feature.association.diameter_row is None:
        raise PretravelError(
            f"{placed.label}: a {feature.kind} has no size, so no material condition"
        )
    limits = placed.limits
    if limits is None or not math.isfinite(limits[0] + limits[1]):
        raise PretravelError(
            f"{placed.label}: a material condition needs both limits of its size (tolerance)"
        )
    if not feature.side:
        raise PretravelError(f"{placed.label}: it is not known whether it is a bore or a boss")
    inside = feature.side == "inside"
    grows = 1.0 if inside == (material == MAXIMUM) else -1.0
    limit = limits[0] if grows > 0.0 else limits[1]
    value = grows * (feature.association.diameter - limit)
    most = limits[1] - limits[0]
    return min(max(value, 0.0), most), grows * feature.association.diameter_row[None], most


def _datum_float(
    groups: Sequence[DatumWord], frame: FloatArray
) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Shifts of a datum at maximum material: columns, their largest amount, a remark."""
    floating = [group for group in groups if group.at_maximum]
    nothing = np.zeros((len(frame), 0))
    if not floating:
        return nothing, 0.0, ()
    if len(floating) > 1 or len(floating[0].features) > 1:
        raise PretravelError(
            "only one datum can be at maximum material, and it cannot be a common datum"
        )
    datum = floating[0].features[0]
    found = datum.feature.association
    if datum.feature.kind not in ("circle", "bore", "boss", "cylinder"):
        raise PretravelError(
            f"datum {datum.label}: a {datum.feature.kind} is not a datum at maximum material here; "
            "bores, bosses and cylinders are"
        )
    assert found.direction is not None
    departure = _departure(datum, MAXIMUM)[0]
    sideways = across(found.direction)
    columns = frame[:, :3] @ sideways.T
    remark = (
        f"datum {datum.label} may shift by up to {0.5 * departure * 1e3:.1f} µm (its departure "
        "from the maximum material size, without tolerances of the datum's orientation or position)"
    )
    return columns, 0.5 * departure, (remark,)
