"""The cone of least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, frozen, unit
from pretravel.uncertainty.feature_fit import (
    Fit,
    ScaledPoints,
    about_axis,
    across,
    check_determined,
    checked_points,
    fitted_from_axes,
    least_squares_parameters,
)

_STEEPEST = np.radians(89.0)  # half angle of a search's start: a wider cone is almost a plane


@dataclass(frozen=True, eq=False, kw_only=True)
class ConeFit(Fit):
    """The cone of the least sum of squared distances.

    Attributes
    ----------
    point : (3,) float
        The point of the axis that is nearest to the centroid of the points. [mm]
    axis : (3,) float
        Unit vector in the direction in which the cone becomes wider.
    radius : float
        At `point`, across the axis. [mm]
    half_angle : float
        Between the axis and the surface. [rad]
    cofactor : (8, 8) float
        Covariance of (point, axis, radius, half_angle) per unit variance of a distance. It is
        singular for changes of the length of `axis`; `point` moves across the axis only.
    """

    point: FloatArray
    axis: FloatArray
    radius: float
    half_angle: float
    cofactor: FloatArray

    def jacobian(self, points: npt.ArrayLike) -> FloatArray:
        """Derivatives of the distances of points, (n, 6).

        By two shifts of `point` and two tilts along `across(axis)`, by the radius and by the half
        angle.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        """
        cone = _Cone(self.point, self.axis, self.radius, self.half_angle)
        return cone.jacobian(np.asarray(points, dtype=np.float64), np.zeros(6))


@dataclass(frozen=True, eq=False)
class _Cone:
    """A cone: a point of the axis, its direction, the radius at this point, the half angle."""

    foot: FloatArray
    axis: FloatArray
    radius: float
    angle: float

    def displaced(self, x: FloatArray) -> _Cone:
        """The cone after two shifts across the axis, two tilts, changes of radius and angle."""
        sideways = across(self.axis)
        return _Cone(
            self.foot + x[:2] @ sideways,
            unit(self.axis + x[2:4] @ sideways),
            self.radius + float(x[4]),
            self.angle + float(x[5]),
        )

    def distances(self, q: FloatArray) -> FloatArray:
        """Of points from the cone, positive outside."""
        height, distance, _ = about_axis(q, self.foot, self.axis)
        return np.asarray(
            (distance - self.radius) * np.cos(self.angle) - height * np.sin(self.angle)
        )

    def jacobian(self, q: FloatArray, x: FloatArray) -> FloatArray:
        """Derivatives of the distances from the displaced cone by the displacements x."""
        sideways = across(self.axis)
        moved = self.displaced(x)
        height, distance, outward = about_axis(q, moved.foot, moved.axis)
        sine, cosine = np.sin(moved.angle), np.cos(moved.angle)
        normal = cosine * outward - sine * moved.axis
        tilt = (outward @ sideways.T) / np.linalg.norm(self.axis + x[2:4] @ sideways)
        return np.hstack(
            [
                -normal @ sideways.T,
                -(height * cosine + distance * sine)[:, None] * tilt,
                np.full((len(q), 1), -cosine),
                (-(distance - moved.radius) * sine - height * cosine)[:, None],
            ]
        )

    def settled(self) -> _Cone:
        """The same cone, widening along its axis, its foot the point nearest to the origin."""
        along = -float(self.foot @ self.axis)
        foot = self.foot + along * self.axis
        radius = self.radius + along * np.tan(self.angle)
        if self.angle < 0.0:
            return _Cone(foot, -self.axis, float(radius), -self.angle)
        return _Cone(foot, self.axis, float(radius), self.angle)


def fit_cone(points: npt.ArrayLike, axis: npt.ArrayLike | None = None) -> ConeFit:
    """Fit a cone with the smallest sum of squared distances.

    Without a given axis the start is searched over the half-sphere, as for a cylinder.

    Parameters
    ----------
    points : (n, 3) float
        On one side of the apex. [mm]
    axis : (3,) float, optional
        Approximate direction of the axis. The search starts from it.

    Returns
    -------
    ConeFit

    Raises
    ------
    PretravelError
        Fewer than six points; points in one circle, which do not determine the angle.
    ConvergenceError
        Points that do not look like a cone.

    >>> angles = np.linspace(0.0, 5.5, 12)
    >>> heights = np.tile([0.0, 2.0], 6)
    >>> radii = 5.0 + heights * np.tan(np.radians(30.0))
    >>> points = np.stack([radii * np.cos(angles), radii * np.sin(angles), heights], axis=1)
    >>> fit = fit_cone(points)
    >>> abs(fit.axis.round(9)).tolist(), float(np.degrees(fit.half_angle).round(9))
    ([0.0, 0.0, 1.0], 30.0)
    """
    p = checked_points(points, "cone", 6)
    scaled = ScaledPoints.of(p, "cone")
    q, scale = scaled.q, scaled.scale
    best = fitted_from_axes(
        q, "cone", axis, lambda start: _algebraic_cone(q, start)[1], _fitted_cone
    )
    return ConeFit(
        point=frozen(scaled.middle + scale * best.foot),
        axis=frozen(best.axis),
        radius=float(best.radius * scale),
        half_angle=float(best.angle),
        cofactor=frozen(_cone_cofactor(q, best, scale)),
        residuals=frozen(best.distances(q) * scale),
        dof=len(p) - 6,
    )


def _algebraic_cone(q: FloatArray, axis: FloatArray) -> tuple[_Cone, float]:
    """Cone about a direction from linear equations, |q'|² = 2 q'·c + A + B h + C h²."""
    sideways = across(axis)
    flat, height = q @ sideways.T, q @ axis
    equations = np.column_stack([2.0 * flat, np.ones(len(q)), height, height**2])
    right = np.sum(flat**2, axis=1)
    solution = np.linalg.lstsq(equations, right, rcond=None)[0]
    center = solution[:2]
    squared = float(solution[2] + center @ center)
    radius = float(np.sqrt(max(squared, 1e-6)))
    angle = float(np.clip(np.arctan(0.5 * solution[3] / radius), -_STEEPEST, _STEEPEST))
    cost = float(np.sum((right - equations @ solution) ** 2)) / max(squared, 1e-6)
    return _Cone(center @ sideways, axis, radius, angle), cost * float(np.cos(angle)) ** 2


def _fitted_cone(q: FloatArray, axis: FloatArray) -> _Cone | None:
    """The cone of least squares near an axis; None where the search does not converge."""
    start = _algebraic_cone(q, axis)[0]
    found = least_squares_parameters(
        lambda x: start.displaced(x).distances(q), lambda x: start.jacobian(q, x), np.zeros(6)
    )
    if found is None:
        return None
    cone = start.displaced(found).settled()
    height, _, _ = about_axis(q, cone.foot, cone.axis)
    one_sided = bool(np.all(cone.radius + height * np.tan(cone.angle) > 0.0))
    return cone if one_sided and cone.angle < 0.5 * np.pi else None


def _cone_cofactor(q: FloatArray, best: _Cone, scale: float) -> FloatArray:
    """Covariance of (point, axis, radius, half angle) per unit variance of a distance, (8, 8)."""
    jacobian = best.jacobian(q, np.zeros(6))
    check_determined(jacobian, "the cone's axis and angle: they lie in one circle or in one plane")
    sideways = across(best.axis).T
    change = np.zeros((8, 6))
    change[:3, :2] = sideways
    change[3:6, 2:4] = sideways / scale
    change[6, 4] = 1.0
    change[7, 5] = 1.0 / scale
    return np.asarray(change @ np.linalg.inv(jacobian.T @ jacobian) @ change.T)
