"""Least-squares sphere and circle: what qualifications stand on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.errors import ConvergenceError, PretravelError

_FLAT = 1e-4
"""Spread across a plane (line) over spread along it below which points are in it."""


@dataclass(frozen=True, eq=False)
class SphereFit:
    """A sphere, or in two dimensions a circle, of least squared distances.

    Attributes
    ----------
    center : (d,) float
        d = 3 for a sphere, 2 for a circle. [mm]
    radius : float
        [mm]
    cofactor : (d + 1, d + 1) float
        Covariance of (center, radius) per unit variance of a distance.
    residuals : (n,) float
        Distance from the center less the radius, positive outside. [mm]
    dof : int
        Degrees of freedom, n - d - 1.
    """

    center: FloatArray
    radius: float
    cofactor: FloatArray
    residuals: FloatArray
    dof: int

    @property
    def standard_deviation(self) -> float:
        """Root of the residuals' squares over the degrees of freedom; nan without any. [mm]"""
        if self.dof <= 0:
            return float("nan")
        return float(np.sqrt(np.sum(self.residuals**2) / self.dof))


def fit_sphere(points: npt.ArrayLike) -> SphereFit:
    """The sphere (or circle) with the smallest sum of squared distances.

    Starts from the algebraic fit and iterates Gauss-Newton on the distances
    themselves. Coordinates are centred and scaled first, so that a small sphere far
    from the origin keeps its digits.

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
        Too few points, or all in one plane (line).
    ConvergenceError
        Points so unlike a sphere that the iteration does not settle.

    >>> square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
    >>> fit_sphere(square).radius
    1.0
    """
    p = np.asarray(points, dtype=np.float64)
    count, dimension = p.shape
    name = "sphere" if dimension == 3 else "circle"
    if count < dimension + 1:
        raise PretravelError(f"a {name} needs at least {dimension + 1} points, got {count}")
    middle = p.mean(axis=0)
    centred = p - middle
    spread = np.linalg.svd(centred, compute_uv=False)
    if spread[-1] <= _FLAT * spread[0]:
        raise PretravelError(
            f"all points lie in one {'plane' if dimension == 3 else 'line'}, "
            f"which leaves the {name}'s centre undetermined across it"
        )
    scale = spread[0] / np.sqrt(count)
    q = centred / scale
    # Algebraic start: |q|² = 2 q·c + (R² - |c|²).
    system = np.hstack([2.0 * q, np.ones((count, 1))])
    start = np.linalg.lstsq(system, np.sum(q**2, axis=1), rcond=None)[0]
    center, radius = start[:-1], float(np.sqrt(start[-1] + start[:-1] @ start[:-1]))
    for _ in range(100):
        offset = q - center
        distance = np.linalg.norm(offset, axis=1)
        jacobian = np.hstack([offset / distance[:, None], np.ones((count, 1))])
        step = np.linalg.lstsq(jacobian, distance - radius, rcond=None)[0]
        center = center + step[:-1]
        radius += float(step[-1])
        if np.max(np.abs(step)) < 1e-14 * (1.0 + radius):
            break
    else:
        if np.max(np.abs(step)) > 1e-9 * (1.0 + radius):
            raise ConvergenceError(
                f"the {name} fit did not settle (last step {np.max(np.abs(step)) * scale:.3g} mm): "
                f"these points do not look like a {name}"
            )
    offset = q - center
    distance = np.linalg.norm(offset, axis=1)
    jacobian = np.hstack([offset / distance[:, None], np.ones((count, 1))])
    return SphereFit(
        center=frozen(middle + scale * center),
        radius=float(radius * scale),
        cofactor=frozen(np.linalg.inv(jacobian.T @ jacobian)),
        residuals=frozen((distance - radius) * scale),
        dof=count - dimension - 1,
    )
