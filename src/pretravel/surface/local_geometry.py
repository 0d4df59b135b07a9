"""The geometry of a surface at a point: position, normal and curvature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, unit

_DEGENERATE = 1e-10
"""sin² of the angle between du and dv, or length ratio, below which they span no plane."""
_POLE = 1e-9
"""Length of a derivative, as a share of the other's, below which an end of a range is a pole."""


@dataclass(frozen=True, eq=False)
class LocalGeometry:
    """Points of a surface with their normals and curvature tensors.

    Attributes
    ----------
    point : (n, 3) float
        [mm]
    normal : (n, 3) float
        Outward unit normals.
    curvature : (n, 3, 3) float
        W of dn = W dx for tangential dx: symmetric, W n = 0, positive where the
        part is convex. [1/mm]
    along_parameters : (n, 2, 3) float or None
        Derivatives by u and by v, where a displacement on the surface follows from them; None
        where the surface finds its parameters after a displacement itself.
    """

    point: FloatArray
    normal: FloatArray
    curvature: FloatArray
    along_parameters: FloatArray | None = None

    @property
    def tangents(self) -> FloatArray:
        """Two unit vectors that span the tangent plane, (n, 2, 3)."""
        return tangent_basis(self.normal)

    @property
    def principal_curvatures(self) -> FloatArray:
        """Smaller and larger principal curvature, convex positive, (n, 2). [1/mm]"""
        t = self.tangents
        w = t @ self.curvature @ np.swapaxes(t, 1, 2)
        mean = 0.5 * (w[:, 0, 0] + w[:, 1, 1])
        half = np.hypot(0.5 * (w[:, 0, 0] - w[:, 1, 1]), w[:, 0, 1])
        return np.stack([mean - half, mean + half], axis=1)

    def take(self, rows: npt.ArrayLike) -> LocalGeometry:
        """The given rows."""
        index = np.asarray(rows)
        along = self.along_parameters
        return LocalGeometry(
            self.point[index],
            self.normal[index],
            self.curvature[index],
            None if along is None else along[index],
        )

    def flipped(self) -> LocalGeometry:
        """The same geometry with the material on the other side."""
        return replace(self, normal=-self.normal, curvature=-self.curvature)


@dataclass(frozen=True)
class Domain:
    """The range of a surface's parameters.

    Attributes
    ----------
    lower, upper : pairs of float
        Of u and v; may be infinite.
    period : pair of float
        Infinite for a parameter that is not periodic.
    """

    lower: tuple[float, float]
    upper: tuple[float, float]
    period: tuple[float, float] = (float("inf"), float("inf"))

    def confined(self, uv: FloatArray) -> FloatArray:
        """Parameters moved into the domain: wrapped where periodic, else clipped to the bounds.

        >>> Domain((0, 0), (4, 1), (4, np.inf)).confined(np.array([[5.0, 2.0]])).tolist()
        [[1.0, 1.0]]
        """
        result = uv.copy()
        for axis in (0, 1):
            low, high, period = self.lower[axis], self.upper[axis], self.period[axis]
            if np.isfinite(period):
                result[:, axis] = low + np.mod(uv[:, axis] - low, period)
            else:
                result[:, axis] = np.clip(uv[:, axis], low, high)
        return result

    def contains(self, uv: FloatArray) -> BoolArray:
        """Which parameters lie within; periodic parameters always do.

        >>> Domain((0, 0), (4, 1), (4, np.inf)).contains(np.array([[5.0, 0.5], [1, 2]])).tolist()
        [True, False]
        """
        low, high = np.asarray(self.lower), np.asarray(self.upper)
        bounded = np.isfinite(low) & np.isfinite(high)
        slack = 1e-12 * np.where(bounded, np.maximum(np.abs(low) + np.abs(high), 1.0), 1.0)
        within = (uv >= low - slack) & (uv <= high + slack)
        return np.asarray(np.all(within | np.isfinite(self.period), axis=1))


class Surface(Protocol):
    """The outside of a part's surface. Parameters are rows (u, v).

    Touches use only these members, so that analytic shapes, functions and faces of CAD files
    are treated alike.
    """

    @property
    def domain(self) -> Domain:
        """Range of the parameters."""
        ...

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points and their derivatives by u and by v, (n, 3) each. [mm]"""
        ...

    def local(self, uv: FloatArray) -> LocalGeometry:
        """Points, normals and curvatures."""
        ...

    def nearest(self, points: FloatArray) -> FloatArray:
        """Parameters (n, 2) of the surface's points nearest to (n, 3) points."""
        ...

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters after a small tangential displacement (n, 3), correct to first order."""
        ...

    def inside(self, uv: FloatArray) -> BoolArray:
        """Which parameters lie on the surface, within its edges, (n,)."""
        ...


def at_open_end(surface: Surface, uv: FloatArray) -> BoolArray:
    """Which parameters lie at an end of their range that is an edge of the surface, (n,).

    Seams of periodic parameters and poles, where the whole end is one point, are no edges.

    Parameters
    ----------
    surface : Surface
    uv : (n, 2) float

    >>> from pretravel.surface.parametric import Convex
    >>> at_open_end(Convex(), np.array([[1.0, 0.2], [0.5, 0.2]])).tolist()
    [True, False]
    """
    domain, found = surface.domain, np.zeros(len(uv), dtype=bool)
    lengths = [np.linalg.norm(slope, axis=1) for slope in surface.derivatives(uv)[1:]]
    for axis in (0, 1):
        low, high = domain.lower[axis], domain.upper[axis]
        if np.isfinite(domain.period[axis]):
            continue
        along, across = lengths[1 - axis], lengths[axis]
        no_pole = along > _POLE * across
        for end in (low, high):
            near = 1e-12 * max(abs(low) + abs(high), 1.0) if np.isfinite(end) else -1.0
            found |= (np.abs(uv[:, axis] - end) <= near) & no_pole
    return found


def signed_distance(surface: Surface, points: FloatArray) -> FloatArray:
    """Distance of points from a surface along its normal, positive outside.

    Parameters
    ----------
    surface : Surface
    points : (n, 3) float
        [mm]

    Returns
    -------
    (n,) float
        [mm]

    >>> from pretravel.surface.shapes import Sphere
    >>> signed_distance(Sphere([0, 0, 0], 10.0), np.array([[0.0, 0.0, 12.0]])).tolist()
    [2.0]
    """
    foot = surface.local(surface.nearest(np.asarray(points, dtype=np.float64)))
    return np.asarray(np.sum((points - foot.point) * foot.normal, axis=1))


def tangent_basis(normals: FloatArray) -> FloatArray:
    """Two unit vectors perpendicular to each normal, (n, 2, 3), right-handed with it.

    >>> (tangent_basis(np.array([[0.0, 0.0, 1.0]])) + 0.0).tolist()
    [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]
    """
    # Duff et al., Building an orthonormal basis, revisited (JCGT 2017).
    x, y, z = normals[:, 0], normals[:, 1], normals[:, 2]
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x**2 * a, sign * b, -sign * x], axis=1)
    second = np.stack([b, sign + y**2 * a, -y], axis=1)
    return np.stack([first, second], axis=1)


def from_second_order(
    point: FloatArray,
    du: FloatArray,
    dv: FloatArray,
    duu: FloatArray,
    duv: FloatArray,
    dvv: FloatArray,
) -> LocalGeometry:
    """Local geometry from a parametrisation's derivatives, normal along du x dv.

    Parameters
    ----------
    point, du, dv, duu, duv, dvv : (n, 3) float

    Returns
    -------
    LocalGeometry
        Not numbers where du and dv span no plane.

    Notes
    -----
    W = -E I^-1 II I^-1 E^T with E = [du dv] and the two fundamental forms.

    >>> x, y, o = np.eye(3)[[0]], np.eye(3)[[1]], np.zeros((1, 3))
    >>> from_second_order(o, x, y, o, o, o).normal.tolist()
    [[0.0, 0.0, 1.0]]
    """
    across = _cross(du, dv)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = across / length
        # Duals of du and dv within the plane: I^-1 E^T.
        dual_u = _cross(dv, normal) / length
        dual_v = _cross(normal, du) / length
    bend_uu = np.sum(normal * duu, axis=1)[:, None, None]
    bend_uv = np.sum(normal * duv, axis=1)[:, None, None]
    bend_vv = np.sum(normal * dvv, axis=1)[:, None, None]
    uu = dual_u[:, :, None] * dual_u[:, None, :]
    vv = dual_v[:, :, None] * dual_v[:, None, :]
    uv = dual_u[:, :, None] * dual_v[:, None, :]
    curvature = -(bend_uu * uu + bend_uv * (uv + np.swapaxes(uv, 1, 2)) + bend_vv * vv)
    return LocalGeometry(point, normal, curvature, np.stack([du, dv], axis=1))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """As `numpy.cross` of rows, which takes several times longer for a few rows."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def parameter_step(du: FloatArray, dv: FloatArray, displacement: FloatArray) -> FloatArray:
    """Change of (u, v) that moves the point by a tangential displacement, (n, 2).

    Zero along a direction in which the point does not move with the parameters.
    """
    e, f, g = np.sum(du * du, axis=1), np.sum(du * dv, axis=1), np.sum(dv * dv, axis=1)
    p, q = np.sum(du * displacement, axis=1), np.sum(dv * displacement, axis=1)
    determinant = e * g - f**2
    regular = determinant > _DEGENERATE * np.maximum(e, g) ** 2 * 1e-8
    safe = np.where(regular, determinant, 1.0)
    step = np.stack([(g * p - f * q) / safe, (e * q - f * p) / safe], axis=1)
    # At a pole the point does not move with one parameter: use the other.
    if not np.all(regular):
        by_u = np.where(e > 0.0, p / np.where(e > 0.0, e, 1.0), 0.0)
        by_v = np.where(g > 0.0, q / np.where(g > 0.0, g, 1.0), 0.0)
        alone = np.where(
            (e >= g)[:, None],
            np.stack([by_u, 0.0 * by_v], axis=1),
            np.stack([0.0 * by_u, by_v], axis=1),
        )
        step = np.where(regular[:, None], step, alone)
    return step


def outer(vectors: FloatArray) -> FloatArray:
    """Outer product v v^T of each row, (n, 3, 3)."""
    return np.asarray(vectors[:, :, None] * vectors[:, None, :])


def unit_or(vectors: FloatArray, fallback: npt.ArrayLike) -> FloatArray:
    """Unit vectors; where a row has no length, the fallback (3,)."""
    length = np.linalg.norm(vectors, axis=1)
    return unit(np.where(length[:, None] > 0.0, vectors, np.asarray(fallback, dtype=np.float64)))
