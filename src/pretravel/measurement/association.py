"""The feature of least squares through points, and how its quantities follow the points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen, unit
from pretravel.uncertainty import (
    FLAT,
    about_axis,
    across,
    checked_points,
    fit_plane,
    fit_sphere,
)

OUT_OF_PLANE = 0.05
"""Largest height of a circle's points over their plane, in parts of the radius."""

SHORTEST = 0.1
"""Smallest extent along the axis of the points of a cylinder or cone, in parts of the radius."""


@dataclass(frozen=True, eq=False)
class Association:
    """A feature of least squares (Gaussian association), and its linear dependence on the points.

    The feature has k parameters. Their change follows from movements of the points along the
    outward normals of the feature by the rows of `response`.

    Attributes
    ----------
    points : (n, 3) float
        [mm]
    outward : (n, 3) float
        Unit normals of the feature at the points; for circles and the like away from the centre.
    residuals : (n,) float
        Distances of the points from the feature, positive along `outward`. [mm]
    jacobian : (n, k) float
        Derivatives of the distances by the parameters.
    point : (3,) float
        Centre, or a point of the axis, the plane or the line. [mm]
    point_rows : (3, k) float
        Change of `point` by the parameters, in the directions in which the points determine it.
    located_along : (m, 3) float
        Unit vectors of these directions.
    direction : (3,) float or None
        Axis, normal of the plane, direction of the line.
    direction_rows : (3, k) float or None
        Its change by the parameters; None where the direction was given or is a plane's through
        the points, which is not measured.
    diameter : float or None
        Of a slot its width, of a torus that of the tube. [mm]
    diameter_row : (k,) float or None
    ring_diameter : float or None
        Of a torus: of the circle in the middle of the tube. [mm]
    ring_diameter_row : (k,) float or None
    half_angle : float or None
        Of a cone. [rad]
    half_angle_row : (k,) float or None
    stated_response : (k, n) float or None
        The response where it is not that of least squares over all points.
    criterion : str
        gaussian, or which extreme feature it is: of `extreme_association.KINDS_BY_CRITERION`.
    """

    points: FloatArray
    outward: FloatArray
    residuals: FloatArray
    jacobian: FloatArray
    point: FloatArray
    point_rows: FloatArray
    located_along: FloatArray
    direction: FloatArray | None = None
    direction_rows: FloatArray | None = None
    diameter: float | None = None
    diameter_row: FloatArray | None = None
    half_angle: float | None = None
    half_angle_row: FloatArray | None = None
    ring_diameter: float | None = None
    ring_diameter_row: FloatArray | None = None
    stated_response: FloatArray | None = None
    criterion: str = "gaussian"

    @property
    def dof(self) -> int:
        """Degrees of freedom: points less parameters."""
        return int(self.jacobian.shape[0] - self.jacobian.shape[1])

    @property
    def form(self) -> float:
        """Largest less smallest residual. [mm]"""
        return float(np.ptp(self.residuals))

    @cached_property
    def response(self) -> FloatArray:
        """Change of the parameters for a movement of each point along `outward`, (k, n)."""
        if self.stated_response is not None:
            return self.stated_response
        return np.asarray(-np.linalg.pinv(self.jacobian))

    def residual_change(self, moved: FloatArray) -> FloatArray:
        """Change of the residuals for movements along `outward`, (…, n) both. [mm]"""
        return np.asarray(moved + (moved @ self.response.T) @ self.jacobian.T)


def _circle(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    del at
    checked_points(p, "circle", 3)
    middle = p.mean(axis=0)
    normal = fit_plane(p).normal if axis is None else axis
    sideways = across(normal)
    fit = fit_sphere((p - middle) @ sideways.T)
    height = float(np.max(np.abs((p - middle) @ normal)))
    if height > OUT_OF_PLANE * fit.radius:
        ways = "" if axis is not None else ", give the direction of the axis"
        raise PretravelError(
            f"the points do not lie in one plane across the axis: they are up to {height:.3g} mm "
            f"from it, with a radius of {fit.radius:.4g} mm. Measure them as a cylinder{ways}, or "
            "select the points of one height",
            inputs=("axis",),
        )
    return _circle_at(p, middle + fit.center @ sideways, normal, fit.radius)


def _circle_at(p: FloatArray, center: FloatArray, normal: FloatArray, radius: float) -> Association:
    sideways = across(normal)
    away = ((p - center) @ sideways.T) @ sideways
    outward = unit(away)
    return Association(
        points=p,
        outward=outward,
        residuals=np.linalg.norm(away, axis=1) - radius,
        jacobian=-np.column_stack([outward @ sideways.T, np.ones(len(p))]),
        point=center,
        point_rows=np.column_stack([sideways.T, np.zeros(3)]),
        located_along=sideways,
        direction=normal,
        diameter=2.0 * radius,
        diameter_row=np.array([0.0, 0.0, 2.0]),
    )


def _sphere(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    del axis, at
    fit = fit_sphere(checked_points(p, "sphere", 4))
    return _sphere_at(p, fit.center, fit.radius)


def _sphere_at(p: FloatArray, center: FloatArray, radius: float) -> Association:
    outward = unit(p - center)
    return Association(
        points=p,
        outward=outward,
        residuals=np.linalg.norm(p - center, axis=1) - radius,
        jacobian=-np.column_stack([outward, np.ones(len(p))]),
        point=center,
        point_rows=np.eye(3, 4),
        located_along=np.eye(3),
        diameter=2.0 * radius,
        diameter_row=np.array([0.0, 0.0, 0.0, 2.0]),
    )


def _plane(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    fit = fit_plane(p)
    normal = fit.normal if axis is None or fit.normal @ axis > 0.0 else -fit.normal
    return _plane_at(p, fit.point, normal, at)


def _plane_at(
    p: FloatArray, middle: FloatArray, normal: FloatArray, at: FloatArray | None
) -> Association:
    sideways = across(normal)
    lever = (p - middle) @ sideways.T
    reach = _to_foot(middle, at) @ sideways.T
    point = middle if at is None else at - ((at - middle) @ normal) * normal
    # An offset along the normal, and two tilts: the normal moves by +x along `sideways`.
    jacobian = np.column_stack([-np.ones(len(p)), lever])
    return Association(
        points=p,
        outward=np.tile(normal, (len(p), 1)),
        residuals=(p - middle) @ normal,
        jacobian=jacobian,
        point=point,
        point_rows=np.outer(normal, [1.0, *(-reach)]),
        located_along=normal[None],
        direction=normal,
        direction_rows=np.column_stack([np.zeros(3), sideways.T]),
    )


def _to_foot(point: FloatArray, at: FloatArray | None) -> FloatArray:
    return np.zeros(3) if at is None else np.asarray(at - point)


def _line(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    """A line in the plane of its direction and the normals of its points (given as `axis`)."""
    checked_points(p, "line", 2)
    middle = p.mean(axis=0)
    _, extent, axes = np.linalg.svd(p - middle, full_matrices=False)
    if extent[0] <= 0.0:
        raise PretravelError("all points lie in one place; they do not determine a line")
    # The normals of the points say in which direction the line was measured.
    measured = axes[1] if axis is None else axis
    along = axes[0] - (axes[0] @ measured) * measured
    if np.linalg.norm(along) < FLAT:
        raise PretravelError(
            "the points lie in a row along their normals; they do not determine a line"
        )
    along = unit(along)
    along = along * np.sign(along[np.argmax(np.abs(along))])
    lever, offset = (p - middle) @ along, (p - middle) @ measured
    slope = float(lever @ offset / (lever @ lever))
    direction, outward = unit(along + slope * measured), unit(measured - slope * along)
    return _line_at(p, middle, direction, outward, at)


def _line_at(
    p: FloatArray,
    middle: FloatArray,
    direction: FloatArray,
    outward: FloatArray,
    at: FloatArray | None,
) -> Association:
    lever = (p - middle) @ direction
    reach = float(_to_foot(middle, at) @ direction)
    return Association(
        points=p,
        outward=np.tile(outward, (len(p), 1)),
        residuals=(p - middle) @ outward,
        jacobian=-np.column_stack([np.ones(len(p)), lever]),
        point=middle + reach * direction,
        point_rows=np.outer(outward, [1.0, reach]),
        located_along=outward[None],
        direction=direction,
        direction_rows=np.column_stack([np.zeros(3), outward]),
    )


def _refuse_one_height(height: FloatArray, radius: float, name: str) -> None:
    """Refuse points at one height of an axis: their errors alone would tilt it."""
    extent = float(np.ptp(height))
    if extent < SHORTEST * radius:
        raise PretravelError(
            f"the points lie within {extent:.3g} mm along the axis of the {name}, with a radius of "
            f"{radius:.4g} mm: too little for its direction. Measure them as a circle, or touch "
            "two heights",
            inputs=("feature",),
        )


def _cylinder(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    from pretravel.uncertainty import fit_cylinder

    fit = fit_cylinder(p, axis)
    _refuse_one_height((p - fit.point) @ fit.axis, fit.radius, "cylinder")
    direction = fit.axis if axis is None or fit.axis @ axis > 0.0 else -fit.axis
    return _cylinder_at(p, fit.point, direction, fit.radius, at)


def _cylinder_at(
    p: FloatArray, middle: FloatArray, axis: FloatArray, radius: float, at: FloatArray | None
) -> Association:
    sideways = across(axis)
    height, distance, outward = about_axis(p, middle, axis)
    flat = outward @ sideways.T
    reach = float(_to_foot(middle, at) @ axis)
    return Association(
        points=p,
        outward=outward,
        residuals=distance - radius,
        jacobian=-np.column_stack([flat, height[:, None] * flat, np.ones(len(p))]),
        point=middle + reach * axis,
        point_rows=np.column_stack([sideways.T, reach * sideways.T, np.zeros(3)]),
        located_along=sideways,
        direction=axis,
        direction_rows=np.column_stack([np.zeros((3, 2)), sideways.T, np.zeros(3)]),
        diameter=2.0 * radius,
        diameter_row=np.array([0.0, 0.0, 0.0, 0.0, 2.0]),
    )


def _cone(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    from pretravel.uncertainty import fit_cone

    fit = fit_cone(p, axis)
    _refuse_one_height((p - fit.point) @ fit.axis, fit.radius, "cone")
    return _cone_at(p, fit.point, fit.axis, (fit.radius, fit.half_angle), at)


def _cone_at(
    p: FloatArray,
    foot: FloatArray,
    axis: FloatArray,
    size: tuple[float, float],
    at: FloatArray | None,
) -> Association:
    """A cone with this radius and half angle at a point of its axis."""
    radius, half_angle = size
    sideways = across(axis)
    height, distance, radial = about_axis(p, foot, axis)
    sine, cosine = np.sin(half_angle), np.cos(half_angle)
    outward = cosine * radial - sine * axis
    away = _to_foot(foot, at)
    reach = float(away @ axis)
    # Of the diameter at `at`: by tilts, which change its height on the axis, and by the half angle.
    tilting = 2.0 * (sine / cosine) * (away @ sideways.T)
    widening = 2.0 * reach / cosine**2
    nothing = np.zeros((3, 2))
    return Association(
        points=p,
        outward=outward,
        residuals=(distance - radius) * cosine - height * sine,
        jacobian=np.column_stack(
            [
                -outward @ sideways.T,
                -(height * cosine + distance * sine)[:, None] * (radial @ sideways.T),
                np.full(len(p), -cosine),
                -(distance - radius) * sine - height * cosine,
            ]
        ),
        point=foot + reach * axis,
        point_rows=np.column_stack([sideways.T, reach * sideways.T, nothing]),
        located_along=sideways,
        direction=axis,
        direction_rows=np.column_stack([nothing, sideways.T, nothing]),
        diameter=2.0 * (radius + reach * sine / cosine),
        diameter_row=np.array([0.0, 0.0, *tilting, 2.0, widening]),
        half_angle=half_angle,
        half_angle_row=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    )


def _torus(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    del at
    from pretravel.uncertainty import fit_torus

    fit = fit_torus(p, axis)
    direction = fit.axis if axis is None or fit.axis @ axis > 0.0 else -fit.axis
    return _torus_at(p, fit.center, direction, (fit.ring_radius, fit.tube_radius))


def _torus_at(
    p: FloatArray, center: FloatArray, axis: FloatArray, size: tuple[float, float]
) -> Association:
    from pretravel.uncertainty import TorusParameters

    torus, sideways = TorusParameters(center, axis, *size), across(axis)
    return Association(
        points=p,
        outward=torus.normals(p),
        residuals=torus.distances(p),
        jacobian=torus.jacobian(p),
        point=center,
        point_rows=np.column_stack([sideways.T, axis, np.zeros((3, 4))]),
        located_along=np.vstack([sideways, axis]),
        direction=axis,
        direction_rows=np.column_stack([np.zeros((3, 3)), sideways.T, np.zeros((3, 2))]),
        diameter=2.0 * torus.tube,
        diameter_row=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0]),
        ring_diameter=2.0 * torus.ring,
        ring_diameter_row=np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0]),
    )


def _slot(p: FloatArray, axis: FloatArray | None, at: FloatArray | None) -> Association:
    """Two parallel planes of least squares; `axis` across them says which points lie on which."""
    checked_points(p, "slot", 4)
    if axis is None:
        raise PretravelError(
            "a slot needs the direction across its two planes: give the axis, or take points with "
            "normals",
            inputs=("axis",),
        )
    normal, middle = unit(axis), p.mean(axis=0)
    for _ in range(_SLOT_STEPS):
        side = _sides_of_slot((p - middle) @ normal)
        sideways = across(normal)
        design = np.column_stack([np.ones(len(p)), side, (p - middle) @ sideways.T])
        found, _, rank, _ = np.linalg.lstsq(design, (p - middle) @ normal, rcond=FLAT)
        if rank < design.shape[1] or abs(side.sum()) == len(p):
            raise PretravelError(
                "the points do not determine a slot: touch both planes, and at least one of them "
                "at three places that are not in a row, or both at two across each other"
            )
        turned = unit(normal - found[2:] @ sideways)
        middle = middle + found[0] * normal
        moved, normal = float(np.linalg.norm(turned - normal)), turned
        if moved < _SLOT_CLOSED:
            break
    side = _sides_of_slot((p - middle) @ normal)
    return _slot_at(p, middle, normal, float(np.mean(side * ((p - middle) @ normal))), side, at)


_SLOT_STEPS, _SLOT_CLOSED = 30, 1e-14


def _sides_of_slot(height: FloatArray) -> FloatArray:
    """1 for points on the upper plane, -1 on the lower one."""
    return np.where(height > 0.5 * (height.min() + height.max()), 1.0, -1.0)


def _slot_at(
    p: FloatArray,
    middle: FloatArray,
    normal: FloatArray,
    half_width: float,
    side: FloatArray,
    at: FloatArray | None,
) -> Association:
    sideways = across(normal)
    lever = (p - middle) @ sideways.T
    reach = _to_foot(middle, at) @ sideways.T
    point = middle if at is None else at - ((at - middle) @ normal) * normal
    return Association(
        points=p,
        outward=side[:, None] * normal,
        residuals=side * ((p - middle) @ normal) - half_width,
        jacobian=np.column_stack([-side, side[:, None] * lever, -np.ones(len(p))]),
        point=point,
        point_rows=np.outer(normal, [1.0, *(-reach), 0.0]),
        located_along=normal[None],
        direction=normal,
        direction_rows=np.column_stack([np.zeros(3), sideways.T, np.zeros(3)]),
        diameter=2.0 * half_width,
        diameter_row=np.array([0.0, 0.0, 0.0, 2.0]),
    )


_Associate = Callable[[FloatArray, FloatArray | None, FloatArray | None], Association]

ASSOCIATIONS: dict[str, _Associate] = {
    "circle": _circle,
    "bore": _circle,
    "boss": _circle,
    "sphere": _sphere,
    "plane": _plane,
    "line": _line,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
    "slot": _slot,
}
"""The features that are measured, by name."""


def associate(
    kind: str,
    points: npt.ArrayLike,
    *,
    axis: npt.ArrayLike | None = None,
    at: npt.ArrayLike | None = None,
) -> Association:
    """Fit a feature with the smallest sum of squared distances.

    Parameters
    ----------
    kind : str
        circle, bore, boss, sphere, plane, line, cylinder, cone, torus or slot.
    points : (n, 3) float
        [mm]
    axis : (3,) float, optional
        Circle: normal of its plane, by default that of the plane through the points. Cylinder,
        cone and torus: approximate axis. Line: direction in which its points were touched. Slot:
        direction across its two planes, which it needs.
    at : (3,) float, optional
        The point of an axis, a plane or a line nearest to this one is evaluated, and a cone's
        diameter there; the default is the point nearest to the centroid of the points. [mm]

    Raises
    ------
    PretravelError
        A feature of another name; points that do not determine it.

    >>> ring = associate("circle", [[3, 0, 5], [0, 3, 5], [-3, 0, 5], [0, -3, 5]])
    >>> ring.diameter, ring.point.round(9).tolist(), ring.dof
    (6.0, [0.0, 0.0, 5.0], 1)
    """
    if kind not in ASSOCIATIONS:
        raise PretravelError(
            f"'{kind}' is not a feature that is measured: {', '.join(ASSOCIATIONS)}",
            inputs=("feature",),
        )
    p = checked_points(points, kind, 1)
    along = None if axis is None else unit(np.asarray(axis, dtype=np.float64))
    reference = None if at is None else np.asarray(at, dtype=np.float64)
    return ASSOCIATIONS[kind](frozen(p), along, reference)


def moved_association(
    kind: str, association: Association, change: FloatArray, at: FloatArray | None = None
) -> Association:
    """The same kind of feature through the same points, with other parameters.

    Parameters
    ----------
    kind : str
        As of `associate`.
    association : Association
    change : (k,) float
        Of its parameters. [mm, and rad of directions]
    at : (3,) float, optional
        As of `associate`. [mm]

    Returns
    -------
    Association
        With the exact distances of the points from it.

    >>> ring = associate("circle", [[3, 0, 5], [0, 3, 5], [-3, 0, 5], [0, -3, 5]])
    >>> larger = moved_association("circle", ring, np.array([0.0, 0.0, 0.5]))
    >>> larger.diameter, larger.residuals.round(9).tolist()
    (7.0, [-0.5, -0.5, -0.5, -0.5])
    """
    p, point = association.points, association.point + association.point_rows @ change
    radius = 0.0
    if association.diameter is not None and association.diameter_row is not None:
        radius = 0.5 * (association.diameter + float(association.diameter_row @ change))
    if association.direction is None:
        return _sphere_at(p, point, radius)
    direction = association.direction
    if association.direction_rows is None:
        return _circle_at(p, point, direction, radius)
    direction = unit(direction + association.direction_rows @ change)
    if kind == "plane":
        return _plane_at(p, point, direction, at)
    if kind == "line":
        outward = association.outward[0]
        return _line_at(p, point, direction, unit(outward - (outward @ direction) * direction), at)
    if kind == "slot":
        side = _sides_of_slot((p - point) @ direction)
        return _slot_at(p, point, direction, radius, side, at)
    if association.half_angle is not None and association.half_angle_row is not None:
        angle = association.half_angle + float(association.half_angle_row @ change)
        return _cone_at(p, point, direction, (radius, angle), at)
    if association.ring_diameter is not None and association.ring_diameter_row is not None:
        ring = association.ring_diameter + float(association.ring_diameter_row @ change)
        return _torus_at(p, point, direction, (0.5 * ring, radius))
    return _cylinder_at(p, point, direction, radius, at)
