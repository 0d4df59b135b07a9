"""The circle of least squares in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy.typing as npt

from pretravel.base import FloatArray, frozen
from pretravel.uncertainty.feature_fit import across, checked_points
from pretravel.uncertainty.plane_fit import PlaneFit, fit_plane
from pretravel.uncertainty.sphere_fit import SphereFit, fit_sphere


@dataclass(frozen=True, eq=False)
class CircleFit:
    """A circle in space: the plane of its points, and the circle of least squares in that plane.

    Attributes
    ----------
    center : (3,) float
        [mm]
    normal : (3,) float
        Of the plane; unit vector.
    radius : float
        [mm]
    plane : PlaneFit
    in_plane : SphereFit
        Of the points projected onto the plane; its two coordinates are along `axes`.
    axes : (2, 3) float
        Unit vectors in the plane.
    """

    center: FloatArray
    normal: FloatArray
    radius: float
    plane: PlaneFit
    in_plane: SphereFit
    axes: FloatArray


def fit_circle(points: npt.ArrayLike) -> CircleFit:
    """Fit a plane to points in space, and in this plane a circle.

    Parameters
    ----------
    points : (n, 3) float
        [mm]

    Returns
    -------
    CircleFit

    Raises
    ------
    PretravelError
        Fewer than three points, or all points in one line.

    >>> points = [[3.0, 0.0, 5.0], [0.0, 3.0, 5.0], [-3.0, 0.0, 5.0], [0.0, -3.0, 5.0]]
    >>> fit = fit_circle(points)
    >>> fit.center.round(9).tolist(), round(fit.radius, 9)
    ([0.0, 0.0, 5.0], 3.0)
    """
    p = checked_points(points, "circle", 3)
    plane = fit_plane(p)
    axes = across(plane.normal)
    in_plane = fit_sphere((p - plane.point) @ axes.T)
    return CircleFit(
        center=frozen(plane.point + in_plane.center @ axes),
        normal=plane.normal,
        radius=in_plane.radius,
        plane=plane,
        in_plane=in_plane,
        axes=frozen(axes),
    )
