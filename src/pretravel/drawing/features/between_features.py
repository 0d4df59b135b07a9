"""Distances and angles between features: with the errors that their points have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, FloatArray
from pretravel.drawing.features.feature_uncertainty import (
    MACHINE,
    covariance_by_source,
    dof_of_features,
)
from pretravel.drawing.features.largest_distance import largest_distance
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity
from pretravel.measurement import Association
from pretravel.uncertainty import across as directions_across

_DISTANCE, _ANGLE = "distance", "angle"
_FLAT = ("plane", "line", "slot")
_PARALLEL = 1.0 * DEGREE  # largest angle of features that have a distance
_ALL_PAIRS = 6  # features up to this number: all pairs; more: neighbours alone
_SAME_PLACE = 1e-12  # mm
_FAR = 8.0  # standard uncertainties of a distance from which errors across it make it no longer


@dataclass(frozen=True)
class FeatureRelation:
    """A distance or an angle between two features.

    Attributes
    ----------
    first, second : str
        Their labels.
    quantity : Quantity
        "distance" or "angle".
    """

    first: str
    second: str
    quantity: Quantity


@dataclass(frozen=True, eq=False)
class _Derived:
    """A value between two features, and its change by the parameters of both.

    A length that is never negative has its components (m,) and their changes (m, k) too.
    """

    value: float
    first: FloatArray
    second: FloatArray
    components: tuple[FloatArray, FloatArray, FloatArray] | None = None


_Derive = Callable[[MeasuredFeature, MeasuredFeature, Association, Association], _Derived | None]


def relations_between(features: Sequence[MeasuredFeature]) -> tuple[FeatureRelation, ...]:
    """Compute distances and angles between features of one set of points.

    Parameters
    ----------
    features : sequence of MeasuredFeature
        Through points of one compensation, so that all have the same causes of common errors.

    Returns
    -------
    tuple of FeatureRelation
        Of all pairs of up to six features; of more features, of neighbours in their order. None of
        two features that share touches.
        Centres have a distance (across their axes, where these are parallel within 1°), and so
        have planes, lines and slots that are parallel within 1°: of the point of the second. A
        centre, or an axis that is parallel to it, has a distance from a plane. An
        angle is that between the directions that both features determine.

    Raises
    ------
    PretravelError
        Features whose points do not have the same causes of common errors.

    Notes
    -----
    JCGM 102: covariances between the parameters of both features by each common error. An error
    that moves both alike (a shift by the map, the tip radius of two bores) leaves their distance.

    >>> from pretravel.drawing.features.measured_feature import measure_feature
    >>> from pretravel.measurement.points import Points
    >>> angle = np.arange(8) * np.pi / 4
    >>> outward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> one = 1e-6 * outward[:, :, None] * outward[:, None, :]     # u = 1 µm ...
    >>> common = {"map 1": 0.8e-3 * outward[:, 0]}                 # ... 0.8 µm of it a shift in x
    >>> bores = [measure_feature(Points(10.0 * outward + [x, 0.0, 0.0], -outward, np.zeros(8), one,
    ...                                 None, tuple("12345678"), common), "bore", label=name)
    ...          for x, name in ((0.0, "A"), (50.0, "B"))]
    >>> (found,) = relations_between(bores)
    >>> bores[0].quantity("x").parts["map"] > 0.79e-3, round(found.quantity.value, 9)
    (True, 50.0)
    >>> found.quantity.parts["map"] < 1e-9
    True
    """
    found = []
    for first, second in _pairs(features):
        for name, derive in ((_DISTANCE, _distance), (_ANGLE, _angle)):
            here = derive(first, second, first.association, second.association)
            if here is not None:
                before = _uncompensated(first, second, derive)
                quantity = _quantity(name, first, second, here, before)
                found.append(FeatureRelation(first.label, second.label, quantity))
    return tuple(found)


def covariance_of_positions(features: Sequence[MeasuredFeature]) -> FloatArray:
    """Compute the joint covariance of the positions of features.

    Parameters
    ----------
    features : sequence of MeasuredFeature
        Through points of one compensation.

    Returns
    -------
    (3 n, 3 n) float
        Of x, y, z of the first feature, of the second, …; zero in directions in which a feature
        determines no position. The machine's part is that of each length and not in it. [mm²]

    Raises
    ------
    PretravelError
        Features whose points do not have the same causes of common errors.
    """
    size = 3 * len(features)
    terms = []
    for index, feature in enumerate(features):
        rows = np.zeros((size, feature.association.jacobian.shape[1]))
        rows[3 * index : 3 * index + 3] = feature.association.point_rows
        terms.append((feature.errors, rows))
    return np.asarray(sum(covariance_by_source(terms).values(), np.zeros((size, size))))


def _pairs(
    features: Sequence[MeasuredFeature],
) -> Iterator[tuple[MeasuredFeature, MeasuredFeature]]:
    for i, first in enumerate(features):
        last = len(features) if len(features) <= _ALL_PAIRS else min(i + 2, len(features))
        for second in features[i + 1 : last]:
            if not _share_touches(first, second):
                yield first, second


def _share_touches(first: MeasuredFeature, second: MeasuredFeature) -> bool:
    """Whether a touch belongs to both: its own error would be common to them."""
    here = {place.tobytes() for place in first.points.positions}
    return any(place.tobytes() in here for place in second.points.positions)


def _uncompensated(
    first: MeasuredFeature, second: MeasuredFeature, derive: _Derive
) -> float | None:
    if first.uncompensated is None or second.uncompensated is None:
        return None
    found = derive(first, second, first.uncompensated, second.uncompensated)
    return None if found is None else found.value


def _quantity(
    name: str,
    first: MeasuredFeature,
    second: MeasuredFeature,
    derived: _Derived,
    before: float | None,
) -> Quantity:
    terms = [(first.errors, derived.first[None]), (second.errors, derived.second[None])]
    parts = {
        cause: float(np.sqrt(max(part[0, 0], 0.0)))
        for cause, part in covariance_by_source(terms).items()
    }
    if first.errors.machine > 0.0 and name == _DISTANCE:
        parts[MACHINE] = first.errors.machine
    u = float(np.sqrt(sum(part**2 for part in parts.values())))
    dof = dof_of_features(terms, u)
    if derived.components is not None and derived.value < _FAR * u:
        away, by_first, by_second = derived.components
        covariance = sum(
            covariance_by_source([(first.errors, by_first), (second.errors, by_second)]).values(),
            first.errors.machine**2 * np.eye(len(away)),
        )
        found = largest_distance(0.5 * away[None], 0.25 * covariance, dof)
        parts = {cause: part * found.u / u for cause, part in parts.items()}
        return Quantity(name, found.value, found.u, parts, before, dof=found.dof, ends=found.ends)
    return Quantity(name, derived.value, u, parts, before, name == _ANGLE, dof)


def _off_parallel(first: FloatArray, second: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), abs(float(first @ second))))


def _distance(
    first: MeasuredFeature, second: MeasuredFeature, a: Association, b: Association
) -> _Derived | None:
    flat = [each.kind in _FLAT for each in (first, second)]
    if all(flat) and first.kind == second.kind:
        return _distance_of_parallels(a, b)
    if "plane" in (first.kind, second.kind) and flat.count(True) == 1:
        return _distance_from_plane(a, b) if flat[0] else _reversed(_distance_from_plane(b, a))
    return None if any(flat) else _distance_of_centres(a, b)


def _reversed(found: _Derived | None) -> _Derived | None:
    return None if found is None else _Derived(found.value, found.second, found.first)


def _distance_from_plane(plane: Association, b: Association) -> _Derived | None:
    """Of a centre, or of the middle of an axis that is parallel to the plane."""
    assert plane.direction is not None
    across = 0.0 if b.direction is None else abs(float(plane.direction @ b.direction))
    if across > np.sin(_PARALLEL) or plane.direction_rows is None:
        return None
    apart = b.point - plane.point
    value = float(plane.direction @ apart)
    sign = 1.0 if value >= 0.0 else -1.0
    by_plane = apart @ plane.direction_rows - plane.direction @ plane.point_rows
    return _Derived(abs(value), sign * by_plane, sign * (plane.direction @ b.point_rows))


def _distance_of_parallels(a: Association, b: Association) -> _Derived | None:
    """Of the point of the second plane or line from the first."""
    assert a.direction is not None
    assert b.direction is not None
    if _off_parallel(a.direction, b.direction) > _PARALLEL or a.direction_rows is None:
        return None
    normal = a.outward[0]
    apart = b.point - a.point
    value = float(normal @ apart)
    sign = 1.0 if value >= 0.0 else -1.0
    # The normal of a plane turns as its direction does, that of a line against it.
    turned = apart if _is_normal(a) else -float(apart @ a.direction) * normal
    by_first = turned @ a.direction_rows - normal @ a.point_rows
    return _Derived(abs(value), sign * by_first, sign * (normal @ b.point_rows))


def _is_normal(a: Association) -> bool:
    return a.direction is not None and abs(float(a.outward[0] @ a.direction)) > 0.5


def _distance_of_centres(a: Association, b: Association) -> _Derived | None:
    """Of centres or axes; across the axes, along which there is no position."""
    apart = b.point - a.point
    axes = [each.direction for each in (a, b) if each.direction is not None]
    if len(axes) == 2 and _off_parallel(axes[0], axes[1]) > _PARALLEL:
        return None
    along = float(apart @ axes[0]) if axes else 0.0
    across = apart - along * axes[0] if axes else apart
    value = float(np.linalg.norm(across))
    toward = across / value if value > _SAME_PLACE else a.located_along[0]
    # Across the axis; of two centres, in all directions.
    sides = directions_across(axes[0]) if axes else np.eye(3)
    by_first, by_second = -sides @ a.point_rows, sides @ b.point_rows
    owner = a if a.direction is not None else b
    if owner.direction_rows is not None:
        turned = -along * (sides @ owner.direction_rows)
        by_first, by_second = (
            (by_first + turned, by_second) if owner is a else (by_first, by_second + turned)
        )
    weight = sides @ toward
    components = (sides @ across, by_first, by_second)
    return _Derived(value, weight @ by_first, weight @ by_second, components)


def _angle(
    first: MeasuredFeature, second: MeasuredFeature, a: Association, b: Association
) -> _Derived | None:
    """Between normals of planes as they point out of the part; between axes and lines, acute."""
    if a.direction_rows is None or b.direction_rows is None:
        return None
    assert a.direction is not None
    assert b.direction is not None
    cosine = float(a.direction @ b.direction)
    planes = first.kind == second.kind == "plane"
    turn = -1.0 if cosine < 0.0 and not planes else 1.0
    other, cosine = turn * b.direction, turn * cosine
    sideways = other - cosine * a.direction
    sine = float(np.linalg.norm(sideways))
    value = float(np.arctan2(sine, cosine))
    if sine > _SAME_PLACE:
        by_first = -(sideways / sine) @ a.direction_rows
        by_second = ((cosine * other - a.direction) / sine) @ (turn * b.direction_rows)
    else:
        rows = (a.direction_rows, -np.sign(cosine) * turn * b.direction_rows)
        terms = [(first.errors, rows[0]), (second.errors, rows[1])]
        scatter = sum(covariance_by_source(terms).values(), np.zeros((3, 3)))
        largest = np.linalg.eigh(scatter)[1][:, -1]
        by_first, by_second = largest @ rows[0], largest @ rows[1]
    return _Derived(value, by_first, by_second)
