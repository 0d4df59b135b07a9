"""The sphere of least squares, and in two dimensions the circle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import ConvergenceError, FloatArray, PretravelError, as_numbers, frozen
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.feature_fit import (
    FLAT,
    Fit,
    checked_points,
    least_squares_parameters,
)

_FARTHEST_CENTRE = 1e6  # in extents of the points: a patch of such a sphere is flat


@dataclass(frozen=True, eq=False, kw_only=True)
class SphereFit(Fit):
    """A sphere, or in two dimensions a circle, of the least sum of squared distances.

    Attributes
    ----------
    center : (d,) float
        d = 3 for a sphere, 2 for a circle. [mm]
    radius : float
        [mm]
    cofactor : (d + 1, d + 1) float
        Covariance of (center, radius) per unit variance of a distance.
    """

    center: FloatArray
    radius: float
    cofactor: FloatArray

    def covariance(self, points: npt.ArrayLike, along_normals: Covariance) -> FloatArray:
        """Covariance of (center, radius) that follows from the covariance of the points.

        Parameters
        ----------
        points : (n, d) float
            The points that were fitted. [mm]
        along_normals : Covariance
            Of the n points along their normals; errors of a probe's map are common to many
            points. [mm²]

        Returns
        -------
        (d + 1, d + 1) float
            [mm²]
        """
        jacobian = -_jacobian(
            np.asarray(points, dtype=np.float64), np.append(self.center, self.radius)
        )
        return along_normals.carried(self.cofactor @ jacobian.T)


def fit_sphere(points: npt.ArrayLike) -> SphereFit:
    """Fit a sphere (or circle) with the smallest sum of squared distances.

    The search starts from the algebraic fit. Coordinates are centred and scaled first, so that a
    small sphere far from the origin keeps its digits.

    Parameters
    ----------
    points : (n, d) float
        d = 3 for a sphere, 2 for a circle. [mm]

    Returns
    -------
    SphereFit

    Raises
    ------
    PretravelError
        Too few points, or all points in one plane (line).
    ConvergenceError
        Points so different from a sphere that the search does not converge.

    >>> square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
    >>> fit_sphere(square).radius
    1.0
    """
    p = as_numbers(points, "points of a sphere")
    name, fewest = ("circle", 3) if p.shape[1:] == (2,) else ("sphere", 4)
    p = checked_points(p, name, fewest, (3, 2))
    count, dimension = p.shape
    middle = p.mean(axis=0)
    centred = p - middle
    extent = np.linalg.svd(centred, compute_uv=False)
    if extent[-1] <= FLAT * extent[0]:
        raise PretravelError(
            f"all points lie in one {'plane' if dimension == 3 else 'line'}; they do not determine "
            f"the {name}'s centre across it"
        )
    scale = extent[0] / np.sqrt(count)
    q = centred / scale
    found = least_squares_parameters(
        lambda x: _distances(q, x), lambda x: _jacobian(q, x), algebraic_sphere(q)[0]
    )
    if found is None or np.linalg.norm(found[:-1]) > _FARTHEST_CENTRE:
        raise ConvergenceError(
            f"the {name} fit did not converge: these points do not look like a {name}"
        )
    jacobian = _jacobian(q, found)
    try:
        cofactor = np.linalg.inv(jacobian.T @ jacobian)
    except np.linalg.LinAlgError:
        raise ConvergenceError(
            f"these points are so flat that they do not determine the {name}'s centre"
        ) from None
    return SphereFit(
        center=frozen(middle + scale * found[:-1]),
        radius=float(found[-1] * scale),
        cofactor=frozen(cofactor),
        residuals=frozen(_distances(q, found) * scale),
        dof=count - dimension - 1,
    )


def algebraic_sphere(points: FloatArray) -> tuple[FloatArray, float]:
    """Sphere (or circle) from linear equations, |q|² = 2 q·c + (R² - |c|²).

    Parameters
    ----------
    points : (n, d) float

    Returns
    -------
    parameters : (d + 1,) float
        Centre and radius.
    cost : float
        Sum of squared residuals of the equations over R², about four times that of the distances.

    >>> parameters, _ = algebraic_sphere(np.array([[3.0, 1.0], [2.0, 2.0], [1.0, 1.0]]))
    >>> parameters.round(9).tolist()
    [2.0, 1.0, 1.0]
    """
    equations = np.hstack([2.0 * points, np.ones((len(points), 1))])
    right = np.sum(points**2, axis=1)
    solution = np.linalg.lstsq(equations, right, rcond=None)[0]
    center = solution[:-1]
    squared_radius = float(solution[-1] + center @ center)
    # Algebraic residuals are distances times the diameter.
    cost = float(np.sum((right - equations @ solution) ** 2)) / max(squared_radius, 1e-6)
    return np.append(center, np.sqrt(squared_radius)), cost


def _distances(points: FloatArray, parameters: FloatArray) -> FloatArray:
    """Of points from the sphere with the parameters (centre, radius)."""
    return np.asarray(np.linalg.norm(points - parameters[:-1], axis=1) - parameters[-1])


def _jacobian(points: FloatArray, parameters: FloatArray) -> FloatArray:
    """Derivatives of the distances by centre and radius."""
    offset = points - parameters[:-1]
    outward = offset / np.linalg.norm(offset, axis=1)[:, None]
    return -np.hstack([outward, np.ones((len(points), 1))])
