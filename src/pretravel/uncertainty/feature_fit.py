"""The parts that all least-squares features share: the result, checks of points, the search."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    ConvergenceError,
    FloatArray,
    PretravelError,
    as_numbers,
    fibonacci_cap,
    unit,
)

FLAT = 1e-4
"""Ratio of the smallest to the largest extent of points below which they lie in one plane or line.

It also limits the singular values of a cylinder's Jacobian.
"""
_TOLERANCE = 1e-15
_CANDIDATES = 200
_STARTS = 5
_SAME_NEIGHBOURHOOD = 0.95  # cosine of the angle between two axes
_LAST_STEPS = 2
_LARGEST_FIRST_STEP = 0.1
_SHRINKAGE = 0.1
"""Of each step against the one before, so that no other minimum can be the next one."""
_SHORT_STEPS = 15
_SETTLED = 1e-13
_LARGEST_LAST_STEP = 1e-6  # a larger step shows that the search stopped before the minimum

Residuals = Callable[[FloatArray], FloatArray]
"""From the parameters of a feature (k,) to the distances of the points from it (n,)."""
Jacobian = Callable[[FloatArray], FloatArray]
"""From the parameters of a feature (k,) to the derivatives of the distances (n, k)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """The results that every fitted feature has.

    Attributes
    ----------
    residuals : (n,) float
        Distances of the points from the fitted feature, positive outside. [mm]
    dof : int
        Degrees of freedom: the number of points less the number of fitted parameters.
    """

    residuals: FloatArray
    dof: int

    @property
    def form(self) -> float:
        """Largest less smallest residual: roundness, flatness, cylindricity. [mm]"""
        return float(np.ptp(self.residuals))


def checked_points(
    points: npt.ArrayLike, name: str, fewest: int, dimensions: tuple[int, ...] = (3,)
) -> FloatArray:
    """Points (n, d) as an array of finite numbers.

    Parameters
    ----------
    points : (n, d) float
        [mm]
    name : str
        Of the feature, for messages.
    fewest : int
        Number of points that the feature needs.
    dimensions : tuple of int
        Values of d that are possible.

    Raises
    ------
    PretravelError
        Another shape, values that are not finite, too few points.

    >>> checked_points([[1, 2, 3]], "plane", 1).shape
    (1, 3)
    """
    p = as_numbers(points, f"points of a {name}")
    if p.ndim != 2 or p.shape[1] not in dimensions:
        expected = " or ".join(str(d) for d in dimensions)
        raise PretravelError(f"points of a {name}: expected (n, {expected}), got {p.shape}")
    if not np.all(np.isfinite(p)):
        raise PretravelError(f"points of a {name} must be finite")
    if len(p) < fewest:
        raise PretravelError(f"a {name} needs at least {fewest} points, got {len(p)}")
    return p


def across(direction: FloatArray) -> FloatArray:
    """Two unit vectors that form a right-handed triad with a direction, (2, 3).

    >>> (across(np.array([0.0, 0.0, 1.0])) + 0.0).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]
    """
    d = direction.tolist()  # a search asks for them often, and np.cross is slow for one vector
    smallest = int(np.argmin(np.abs(direction)))
    second, third = (smallest + 1) % 3, (smallest + 2) % 3
    length = math.hypot(d[second], d[third])
    first = [0.0, 0.0, 0.0]
    first[second], first[third] = (0.0 - d[third]) / length, d[second] / length
    return np.array(
        [
            first,
            [d[k - 2] * first[k - 1] - d[k - 1] * first[k - 2] for k in range(3)],
        ]
    )


class OfRevolution(Protocol):
    """A feature with an axis."""

    def distances(self, q: FloatArray) -> FloatArray:
        """Of points (n, 3) from the feature, (n,)."""


Found = TypeVar("Found", bound=OfRevolution)


@dataclass(frozen=True, eq=False)
class ScaledPoints:
    """Points, centred and scaled to a size of about 1: `q` = (points - middle) / scale."""

    q: FloatArray
    middle: FloatArray
    scale: float

    @staticmethod
    def of(p: FloatArray, name: str) -> ScaledPoints:
        """Scale points; those in one line do not determine a feature with an axis."""
        middle = p.mean(axis=0)
        extent = np.linalg.svd(p - middle, compute_uv=False)
        if extent[1] <= FLAT * extent[0]:
            raise PretravelError(
                "all points lie in one line (or one place); they do not determine a " + name
            )
        scale = float(np.linalg.norm(p - middle)) / np.sqrt(len(p))
        return ScaledPoints((p - middle) / scale, middle, float(scale))


def about_axis(
    q: FloatArray, foot: FloatArray, axis: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights of points along an axis, distances from it, and unit vectors away from it.

    >>> height, distance, outward = about_axis(
    ...     np.array([[3.0, 4.0, 7.0]]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    >>> height.tolist(), distance.tolist(), outward.tolist()
    ([7.0], [5.0], [[0.6, 0.8, 0.0]])
    """
    offset = q - foot
    height = offset @ axis
    radial = offset - np.outer(height, axis)
    distance = np.linalg.norm(radial, axis=1)
    return height, distance, radial / np.maximum(distance, 1e-300)[:, None]


def check_determined(jacobian: FloatArray, what: str) -> None:
    """Refuse points for which a change of the parameters changes no distance.

    Parameters
    ----------
    jacobian : (n, k) float
        Derivatives of the distances by the parameters.
    what : str
        What the points do not determine, and how they lie.
    """
    singular = np.linalg.svd(jacobian, compute_uv=False)
    if singular[-1] <= FLAT * singular[0]:
        raise PretravelError(
            f"these points do not determine {what}; measure two circles at different heights, with "
            "three points or more in each"
        )


def fitted_from_axes(
    q: FloatArray,
    name: str,
    axis: npt.ArrayLike | None,
    cost: Callable[[FloatArray], float],
    fitted: Callable[[FloatArray, FloatArray], Found | None],
) -> Found:
    """The best feature with an axis, of searches from a given axis or from the likely ones.

    Parameters
    ----------
    q : (n, 3) float
        Scaled points.
    name : str
        Of the feature, for messages.
    axis : (3,) float or None
        To start from.
    cost : callable
        How badly the points fit a feature with an axis.
    fitted : callable
        From the points and an axis to the fitted feature; None where the search does not converge.

    Raises
    ------
    ConvergenceError
        No search converged.
    """
    starts = likely_axes(q, cost) if axis is None else [unit(np.asarray(axis, dtype=np.float64))]
    found = [feature for start in starts if (feature := fitted(q, start)) is not None]
    if not found:
        raise ConvergenceError(
            f"the {name} fit did not converge: these points do not look like a {name}"
        )
    return min(found, key=lambda feature: float(np.sum(feature.distances(q) ** 2)))


def likely_axes(q: FloatArray, cost: Callable[[FloatArray], float]) -> list[FloatArray]:
    """Axes from which the search for a feature of revolution starts.

    Parameters
    ----------
    q : (n, 3) float
        The points, centred.
    cost : callable
        How badly the points fit a feature with this axis.

    Returns
    -------
    list of (3,) float
        Unit vectors over the half-sphere, the best of each neighbourhood, the best first.
    """
    candidates = np.concatenate(
        [fibonacci_cap(_CANDIDATES), np.linalg.svd(q, full_matrices=False)[2]]
    )
    costs = [cost(candidate) for candidate in candidates]
    chosen: list[FloatArray] = []
    for index in np.argsort(costs):
        if all(abs(float(candidates[index] @ a)) < _SAME_NEIGHBOURHOOD for a in chosen):
            chosen.append(candidates[index])
        if len(chosen) == _STARTS:
            break
    return chosen


def least_squares_parameters(
    residuals: Residuals, jacobian: Jacobian, start: FloatArray
) -> FloatArray | None:
    """The parameters of the smallest sum of squared distances.

    Parameters
    ----------
    residuals, jacobian : callable
        Of the points, which are centred and scaled to a size of about 1.
    start : (k,) float

    Returns
    -------
    (k,) float or None
        None where the search does not converge.

    Notes
    -----
    Near the minimum rounding hides changes of the sum of squares, so that the search
    (Levenberg and Marquardt) ends with an error of about 1e-8 times the scatter. A few more steps
    of Gauss and Newton, which do not compare sums, remove this error. From a start that is near
    enough these steps alone lead there, and scipy's search need not be imported.
    """
    near = _by_short_steps(residuals, jacobian, start)
    if near is not None:
        return near
    from scipy.optimize import least_squares

    found = least_squares(
        residuals,
        start,
        jac=jacobian,
        method="lm",
        xtol=_TOLERANCE,
        ftol=_TOLERANCE,
        gtol=_TOLERANCE,
    )
    if not found.success:
        return None
    parameters = np.asarray(found.x, dtype=np.float64)
    for _ in range(_LAST_STEPS):
        slopes = jacobian(parameters)
        if not np.isfinite(slopes).all():  # a point at the centre
            return None
        step = np.linalg.lstsq(slopes, -residuals(parameters), rcond=None)[0]
        if np.max(np.abs(step)) > _LARGEST_LAST_STEP * (1.0 + np.max(np.abs(parameters))):
            return None
        parameters = parameters + step
    return parameters


def _by_short_steps(
    residuals: Residuals, jacobian: Jacobian, start: FloatArray
) -> FloatArray | None:
    """The minimum near the start by steps that shrink from the first; None where they do not."""
    parameters, longest = np.asarray(start, dtype=np.float64), _LARGEST_FIRST_STEP
    for _ in range(_SHORT_STEPS):
        slopes, off = jacobian(parameters), residuals(parameters)
        if not (np.isfinite(slopes).all() and np.isfinite(off).all()):
            return None
        step, _, rank, _ = np.linalg.lstsq(slopes, -off, rcond=None)
        length = float(np.max(np.abs(step)))
        if rank < len(step) or length > longest * (1.0 + np.max(np.abs(parameters))):
            return None
        parameters = parameters + step
        if length <= _SETTLED:
            return parameters
        longest = _SHRINKAGE * length
    return None
