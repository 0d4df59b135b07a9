"""The cylinder of least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen, unit
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
from pretravel.uncertainty.sphere_fit import algebraic_sphere, fit_sphere


@dataclass(frozen=True, eq=False, kw_only=True)
class CylinderFit(Fit):
    """The cylinder of the least sum of squared distances.

    Attributes
    ----------
    point : (3,) float
        The point of the axis that is nearest to the centroid of the points. [mm]
    axis : (3,) float
        Unit vector; its largest component is positive.
    radius : float
        [mm]
    cofactor : (7, 7) float
        Covariance of (point, axis, radius) per unit variance of a distance. It is singular for
        movements along the axis and for changes of the length of `axis`.
    """

    point: FloatArray
    axis: FloatArray
    radius: float
    cofactor: FloatArray


@dataclass(frozen=True, eq=False)
class _Cylinder:
    """A cylinder near scaled points: a point of the axis, its direction, the radius."""

    foot: FloatArray
    axis: FloatArray
    radius: float

    def displaced(self, x: FloatArray) -> _Cylinder:
        """The cylinder after two shifts across the axis, two tilts and a change of radius."""
        sideways = across(self.axis)
        return _Cylinder(
            self.foot + x[:2] @ sideways,
            unit(self.axis + x[2:4] @ sideways),
            self.radius + float(x[4]),
        )

    def distances(self, q: FloatArray) -> FloatArray:
        """Of points from the cylinder, positive outside."""
        _, distance, _ = about_axis(q, self.foot, self.axis)
        return np.asarray(distance - self.radius)

    def jacobian(self, q: FloatArray, x: FloatArray) -> FloatArray:
        """Derivatives of the distances from the displaced cylinder by the displacements x."""
        sideways = across(self.axis)
        moved = self.displaced(x)
        height, _, away = about_axis(q, moved.foot, moved.axis)
        outward = away @ sideways.T
        lever = height / np.linalg.norm(self.axis + x[2:4] @ sideways)
        return -np.hstack([outward, lever[:, None] * outward, np.ones((len(q), 1))])

    def with_nearest_foot(self) -> _Cylinder:
        """The same cylinder, its point of the axis the one nearest to the points' centroid."""
        return _Cylinder(self.foot - (self.foot @ self.axis) * self.axis, self.axis, self.radius)


def fit_cylinder(points: npt.ArrayLike, axis: npt.ArrayLike | None = None) -> CylinderFit:
    """Fit a cylinder with the smallest sum of squared distances.

    Without a given axis the start is searched: for directions over the half-sphere the points are
    projected along the direction and fitted by an algebraic circle; the search continues from
    the best few.

    Parameters
    ----------
    points : (n, 3) float
        [mm]
    axis : (3,) float, optional
        Approximate direction of the axis. The search starts from it.

    Returns
    -------
    CylinderFit

    Raises
    ------
    PretravelError
        Fewer than five points; points in one circle, which do not determine the axis.
    ConvergenceError
        Points that do not look like a cylinder.

    >>> angles = np.linspace(0.0, 5.5, 12)
    >>> points = np.stack([2 * np.cos(angles), 2 * np.sin(angles), 3 * np.cos(5 * angles)], axis=1)
    >>> fit = fit_cylinder(points)
    >>> abs(fit.axis.round(9)).tolist(), round(fit.radius, 9)
    ([0.0, 0.0, 1.0], 2.0)
    """
    p = checked_points(points, "cylinder", 5)
    scaled = ScaledPoints.of(p, "cylinder")
    q, scale = scaled.q, scaled.scale
    best = fitted_from_axes(
        q, "cylinder", axis, lambda start: algebraic_sphere(q @ across(start).T)[1], _fitted_from
    )
    sign = float(np.sign(best.axis[np.argmax(np.abs(best.axis))]))
    return CylinderFit(
        point=frozen(scaled.middle + scale * best.foot),
        axis=frozen(sign * best.axis),
        radius=float(best.radius * scale),
        cofactor=frozen(_cofactor(q, best, scale, sign)),
        residuals=frozen(best.distances(q) * scale),
        dof=len(p) - 5,
    )


def _fitted_from(q: FloatArray, axis: FloatArray) -> _Cylinder | None:
    """The cylinder of least squares near an axis; None where the search does not converge."""
    sideways = across(axis)
    try:
        circle = fit_sphere(q @ sideways.T)
    except PretravelError:
        return None
    start = _Cylinder(circle.center @ sideways, axis, circle.radius)
    found = least_squares_parameters(
        lambda x: start.displaced(x).distances(q), lambda x: start.jacobian(q, x), np.zeros(5)
    )
    return None if found is None else start.displaced(found).with_nearest_foot()


def _cofactor(q: FloatArray, best: _Cylinder, scale: float, sign: float) -> FloatArray:
    """Covariance of (point, axis, radius) per unit variance of a distance, (7, 7)."""
    jacobian = best.jacobian(q, np.zeros(5))
    check_determined(
        jacobian, "the cylinder's axis: they lie in one circle, in one plane or along one line"
    )
    # From two shifts, two tilts and the radius to point, axis and radius.
    sideways = across(best.axis).T
    change = np.zeros((7, 5))
    change[:3, :2] = sideways
    change[3:6, 2:4] = sign * sideways / scale
    change[6, 4] = 1.0
    return np.asarray(change @ np.linalg.inv(jacobian.T @ jacobian) @ change.T)
