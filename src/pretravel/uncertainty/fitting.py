"""Least-squares sphere, circle, plane and cylinder: what results stand on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import fibonacci_cap, unit
from pretravel.errors import ConvergenceError, PretravelError

_FLAT = 1e-4
"""Spread across a plane (line) over spread along it below which points are in it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """What every fit leaves.

    Attributes
    ----------
    residuals : (n,) float
        Distances of the points from the fitted feature, positive outside. [mm]
    dof : int
        Degrees of freedom: points less numbers fitted.
    """

    residuals: FloatArray
    dof: int

    @property
    def standard_deviation(self) -> float:
        """Root of the residuals' squares over the degrees of freedom; nan without any. [mm]"""
        return float(np.sqrt(np.sum(self.residuals**2) / self.dof)) if self.dof > 0 else math.nan

    @property
    def form(self) -> float:
        """Largest less smallest residual: roundness, flatness, cylindricity. [mm]"""
        return float(np.ptp(self.residuals))


@dataclass(frozen=True, eq=False, kw_only=True)
class SphereFit(Fit):
    """A sphere, or in two dimensions a circle, of least squared distances.

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

    def covariance(self, points: npt.ArrayLike, along: npt.ArrayLike) -> FloatArray:
        """Covariance of (center, radius) from that of the points along their normals.

        Parameters
        ----------
        points : (n, d) float
            That were fitted. [mm]
        along : (n, n) or (n,) float
            Covariance (or variances) of the points along their normals; errors of a probe's
            map are common to many points. [mm²]

        Returns
        -------
        (d + 1, d + 1) float
            [mm²]
        """
        offset = np.asarray(points, dtype=np.float64) - self.center
        outward = offset / np.linalg.norm(offset, axis=1)[:, None]
        jacobian = np.hstack([outward, np.ones((len(outward), 1))])
        return carried(self.cofactor @ jacobian.T, along)


def carried(weights: FloatArray, along: npt.ArrayLike) -> FloatArray:
    """W S W', for a covariance (n, n) or variances (n,)."""
    given = np.asarray(along, dtype=np.float64)
    if given.ndim == 1:
        return np.asarray((weights * given) @ weights.T)
    return np.asarray(weights @ given @ weights.T)


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
    if p.ndim != 2 or p.shape[1] not in (2, 3):
        raise PretravelError(f"points of a sphere or circle: expected (n, 3 or 2), got {p.shape}")
    if not np.all(np.isfinite(p)):
        raise PretravelError("points of a sphere or circle must be finite")
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


@dataclass(frozen=True, eq=False, kw_only=True)
class PlaneFit(Fit):
    """The plane of least squared distances.

    Attributes
    ----------
    point : (3,) float
        Centroid of the points. [mm]
    normal : (3,) float
        Unit; its largest component is positive.
    cofactor : (4, 4) float
        Covariance of (offset along the normal at `point`, normal) per unit variance of a
        distance; the normal's part is singular along the normal itself.
    """

    point: FloatArray
    normal: FloatArray
    cofactor: FloatArray


def fit_plane(points: npt.ArrayLike) -> PlaneFit:
    """The plane with the smallest sum of squared distances.

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
        Fewer than three points, or all in one line.

    >>> fit_plane([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]).normal.round(9).tolist()
    [0.0, 0.0, 1.0]
    """
    p = _checked(points, 3, "plane")
    middle = p.mean(axis=0)
    q = p - middle
    _, spread, axes = np.linalg.svd(q, full_matrices=False)
    if spread[1] <= _FLAT * spread[0]:
        raise PretravelError("all points lie in one line, which leaves the plane turning about it")
    normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
    # A tilt of the normal towards a principal axis scales with the spread along that axis.
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


@dataclass(frozen=True, eq=False)
class CircleFit:
    """A circle in space: its points' plane, and in it the circle of least squared distances.

    Attributes
    ----------
    center : (3,) float
        [mm]
    normal : (3,) float
    radius : float
        [mm]
    plane : PlaneFit
    in_plane : SphereFit
        Of the points projected onto the plane; two coordinates along `axes`.
    axes : (2, 3) float
        Of the plane.
    """

    center: FloatArray
    normal: FloatArray
    radius: float
    plane: PlaneFit
    in_plane: SphereFit
    axes: FloatArray


def fit_circle(points: npt.ArrayLike) -> CircleFit:
    """The circle through points in space: first their plane, then the circle in it.

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
        Fewer than three points, or all in one line.

    >>> points = [[3.0, 0.0, 5.0], [0.0, 3.0, 5.0], [-3.0, 0.0, 5.0], [0.0, -3.0, 5.0]]
    >>> fit = fit_circle(points)
    >>> fit.center.round(9).tolist(), round(fit.radius, 9)
    ([0.0, 0.0, 5.0], 3.0)
    """
    p = _checked(points, 3, "circle")
    plane = fit_plane(p)
    axes = _across(plane.normal)
    in_plane = fit_sphere((p - plane.point) @ axes.T)
    return CircleFit(
        center=frozen(plane.point + in_plane.center @ axes),
        normal=plane.normal,
        radius=in_plane.radius,
        plane=plane,
        in_plane=in_plane,
        axes=frozen(axes),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class CylinderFit(Fit):
    """The cylinder of least squared distances.

    Attributes
    ----------
    point : (3,) float
        Of the axis, nearest to the points' centroid. [mm]
    axis : (3,) float
        Unit; its largest component is positive.
    radius : float
        [mm]
    cofactor : (7, 7) float
        Covariance of (point, axis, radius) per unit variance of a distance; singular for
        movements along the axis and lengthening of it.
    """

    point: FloatArray
    axis: FloatArray
    radius: float
    cofactor: FloatArray


def fit_cylinder(points: npt.ArrayLike, axis: npt.ArrayLike | None = None) -> CylinderFit:
    """The cylinder with the smallest sum of squared distances.

    Where no axis is told the start is searched: directions all over the half-sphere, of
    each the algebraic circle of the points seen along it, and the best few followed.

    Parameters
    ----------
    points : (n, 3) float
        [mm]
    axis : (3,) float, optional
        Roughly, to start from.

    Returns
    -------
    CylinderFit

    Raises
    ------
    PretravelError
        Fewer than five points; points in one circle, which leave the axis undetermined.
    ConvergenceError
        Points that do not look like a cylinder.

    >>> angles = np.linspace(0.0, 5.5, 12)
    >>> points = np.stack([2 * np.cos(angles), 2 * np.sin(angles), 3 * np.cos(5 * angles)], axis=1)
    >>> fit = fit_cylinder(points)
    >>> abs(fit.axis.round(9)).tolist(), round(fit.radius, 9)
    ([0.0, 0.0, 1.0], 2.0)
    """
    p = _checked(points, 5, "cylinder")
    middle = p.mean(axis=0)
    extent = np.linalg.svd(p - middle, compute_uv=False)
    if extent[1] <= _FLAT * extent[0]:
        raise PretravelError("all points lie in one line (or one place), which is no cylinder")
    scale = float(np.linalg.norm(p - middle)) / np.sqrt(len(p))
    q = (p - middle) / scale
    starts = _likely_axes(q) if axis is None else [unit(np.asarray(axis, dtype=np.float64))]
    best: tuple[float, FloatArray, FloatArray, float] | None = None
    for start in starts:
        found = _follow_cylinder(q, start)
        if found is not None and (best is None or found[0] < best[0]):
            best = found
    if best is None:
        raise ConvergenceError(
            "the cylinder fit did not settle: these points do not look like a cylinder"
        )
    _, foot, along, radius = best
    across, jacobian, residuals = _cylinder_slopes(q, foot, along, radius)
    weakest = np.linalg.svd(jacobian, compute_uv=False)
    if weakest[-1] <= _FLAT * weakest[0]:
        raise PretravelError(
            "these points leave the cylinder's axis undetermined: they lie in one circle, in one "
            "plane or along one line; take two circles apart, with three points or more"
        )
    sign = float(np.sign(along[np.argmax(np.abs(along))]))
    along = sign * along
    # From (two shifts, two tilts, radius) to point, axis and radius.
    spread = np.zeros((7, 5))
    spread[:3, :2] = across.T * scale
    spread[3:6, 2:4] = sign * across.T
    spread[6, 4] = scale
    spread /= scale
    return CylinderFit(
        point=frozen(middle + scale * foot),
        axis=frozen(along),
        radius=float(radius * scale),
        cofactor=frozen(spread @ np.linalg.inv(jacobian.T @ jacobian) @ spread.T),
        residuals=frozen(residuals * scale),
        dof=len(p) - 5,
    )


def _checked(points: npt.ArrayLike, least: int, name: str) -> FloatArray:
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3:
        raise PretravelError(f"points of a {name}: expected shape (n, 3), got {p.shape}")
    if not np.all(np.isfinite(p)):
        raise PretravelError(f"points of a {name} must be finite")
    if len(p) < least:
        raise PretravelError(f"a {name} needs at least {least} points, got {len(p)}")
    return p


def _across(direction: FloatArray) -> FloatArray:
    """Two unit vectors that make a right-handed triad with a direction, (2, 3)."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    first = unit(np.cross(helper, direction))
    return np.stack([first, np.cross(direction, first)])


def _likely_axes(q: FloatArray) -> list[FloatArray]:
    """Axes along which the points look most like a circle, the best of each neighbourhood."""
    candidates = np.concatenate([fibonacci_cap(200), np.linalg.svd(q, full_matrices=False)[2]])
    misses = []
    for candidate in candidates:
        seen = q @ _across(candidate).T
        system = np.hstack([2.0 * seen, np.ones((len(seen), 1))])
        right = np.sum(seen**2, axis=1)
        solution = np.linalg.lstsq(system, right, rcond=None)[0]
        radius = max(float(solution[2] + solution[:2] @ solution[:2]), 1e-6)
        # Algebraic residuals are distances times the diameter.
        misses.append(float(np.sum((right - system @ solution) ** 2)) / radius)
    chosen: list[FloatArray] = []
    for index in np.argsort(misses):
        if all(abs(float(candidates[index] @ other)) < 0.95 for other in chosen):
            chosen.append(candidates[index])
        if len(chosen) == 5:
            break
    return chosen


def _cylinder_slopes(
    q: FloatArray, foot: FloatArray, along: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes across the cylinder; slopes of -residual by shifts, tilts, radius; residuals."""
    across = _across(along)
    offset = q - foot
    height = offset @ along
    seen = offset @ across.T
    distance = np.linalg.norm(seen, axis=1)
    outward = seen / np.maximum(distance, 1e-300)[:, None]
    jacobian = np.hstack([outward, height[:, None] * outward, np.ones((len(q), 1))])
    return across, jacobian, distance - radius


def _follow_cylinder(
    q: FloatArray, start: FloatArray
) -> tuple[float, FloatArray, FloatArray, float] | None:
    """Damped Gauss-Newton from an axis; None where it does not settle."""
    along = start
    try:
        circle = fit_sphere(q @ _across(along).T)
    except (PretravelError, ConvergenceError):
        return None
    foot, radius = circle.center @ _across(along), circle.radius
    damping = 0.0
    _, _, residuals = _cylinder_slopes(q, foot, along, radius)
    cost = float(residuals @ residuals)
    for _ in range(200):
        across, jacobian, residuals = _cylinder_slopes(q, foot, along, radius)
        normal = jacobian.T @ jacobian
        normal[np.diag_indices(5)] *= 1.0 + damping
        try:
            step = np.linalg.solve(normal, jacobian.T @ residuals)
        except np.linalg.LinAlgError:
            return None
        turned = unit(along + step[2:4] @ across)
        moved = foot + step[:2] @ across
        moved = moved - (moved @ turned) * turned  # the foot stays nearest to the centroid
        trial = float(np.sum(_cylinder_slopes(q, moved, turned, radius + step[4])[2] ** 2))
        if trial > cost * (1.0 + 1e-12) and np.max(np.abs(step)) > 1e-13:
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e8:
                return None
            continue
        along, foot, radius = turned, moved, radius + float(step[4])
        damping *= 0.1
        cost = min(cost, trial)
        if np.max(np.abs(step)) < 1e-13 * (1.0 + abs(radius)):
            return cost, foot, along, radius
        if damping < 1e-6:
            damping = 0.0
        if np.max(np.abs(step)) < 1e-11 * (1.0 + abs(radius)) and damping == 0.0:
            return cost, foot, along, radius
    return None
