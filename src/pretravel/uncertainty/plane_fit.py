"""The plane of least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.uncertainty.feature_fit import (
    FLAT,
    Fit,
    checked_points,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class PlaneFit(Fit):
    """The plane of the least sum of squared distances.

    Attributes
    ----------
    point : (3,) float
        Centroid of the points. [mm]
    normal : (3,) float
        Unit vector; its largest component is positive.
    cofactor : (4, 4) float
        Covariance of (offset along the normal at `point`, normal) per unit variance of a
        distance. It is singular along the normal itself.
    """

    point: FloatArray
    normal: FloatArray
    cofactor: FloatArray


def fit_plane(points: npt.ArrayLike) -> PlaneFit:
    """Fit a plane with the smallest sum of squared distances.

    Parameters
    ----------
    points : (n, 3) float
        [mm]

    Returns
    -------
    PlaneFit

    Raises
    ------
    PretravelError
        Fewer than three points, or all points in one line.

    >>> fit_plane([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]).normal.round(9).tolist()
    [0.0, 0.0, 1.0]
    """
    p = checked_points(points, "plane", 3)
    middle = p.mean(axis=0)
    q = p - middle
    _, spread, axes = np.linalg.svd(q, full_matrices=False)
    if spread[1] <= FLAT * spread[0]:
        raise PretravelError(
            "all points lie in one line; they do not determine the plane's rotation about it"
        )
    normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
    # A tilt of the normal towards a principal axis is inverse to the spread along that axis.
    cofactor = np.zeros((4, 4))
    cofactor[0, 0] = 1.0 / len(p)
    cofactor[1:, 1:] = sum(np.outer(axes[i], axes[i]) / spread[i] ** 2 for i in (0, 1))
    return PlaneFit(
        point=frozen(middle),
        normal=frozen(normal),
        cofactor=frozen(cofactor),
        residuals=frozen(q @ normal),
        dof=len(p) - 3,
    )
