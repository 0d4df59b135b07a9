"""Analytic surfaces: plane, sphere, ellipsoid, and any surface reversed.

All are in closed form. Normal and curvature follow from the point, not from its parameters, so
poles and seams of the parametrisation do not disturb a motion on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, checked_unit, frozen
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface, outer
from pretravel.surface.placed_shape import TURN, PlacedShape, axes_about, check_positive


@dataclass(frozen=True, eq=False)
class Plane(PlacedShape):
    """A plane through a point; u and v are lengths along two axes in it.

    Parameters
    ----------
    point : (3,) float
        [mm]
    normal : (3,) float
        Outward unit normal.
    x_axis : (3,) float, optional
        Direction of u; that of the steepest descent when not given.

    >>> from pretravel.surface.local_geometry import signed_distance
    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> signed_distance(floor, np.array([[5.0, 5.0, 0.25]])).tolist()
    [0.25]
    """

    point: npt.ArrayLike
    normal: npt.ArrayLike
    x_axis: npt.ArrayLike | None = None
    origin: npt.ArrayLike = field(init=False, repr=False)
    axes: npt.ArrayLike = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen(self.point))
        n = checked_unit(np.atleast_2d(np.asarray(self.normal, dtype=float)), "plane normal")[0]
        object.__setattr__(self, "normal", frozen(n))
        across = math.hypot(n[0], n[1])
        steepest = (
            np.array([n[2] * n[0] / across, n[2] * n[1] / across, -across])
            if across > 1e-12
            else np.array([1.0, 0.0, 0.0])
        )
        object.__setattr__(self, "origin", self.point)
        object.__setattr__(
            self, "axes", axes_about(n, steepest if self.x_axis is None else self.x_axis)
        )
        self.set_frame()

    @property
    def domain(self) -> Domain:
        return Domain((-math.inf, -math.inf), (math.inf, math.inf))

    def _point(self, uv: FloatArray) -> FloatArray:
        return np.column_stack([uv, np.zeros(len(uv))])

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y, _ = np.eye(3)
        return np.tile(x, (len(uv), 1)), np.tile(y, (len(uv), 1))

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.tile([0.0, 0.0, 1.0], (len(uv), 1)), np.zeros((len(uv), 3, 3))

    def _parameters(self, points: FloatArray) -> FloatArray:
        return points[:, :2].copy()


@dataclass(frozen=True, eq=False)
class Sphere(PlacedShape):
    """A sphere; u is the azimuth, v the angle from the pole (or the latitude).

    Parameters
    ----------
    center : (3,) float
        [mm]
    radius : float
        [mm]
    axes : (3, 3) float
        Rows x, y, z of its frame.
    latitude : bool
        v is the latitude, as in STEP files.

    >>> ball = Sphere([0.0, 0.0, 0.0], 10.0)
    >>> ball.local(np.array([[0.0, 0.0]])).point.tolist()
    [[0.0, 0.0, 10.0]]
    """

    center: npt.ArrayLike
    radius: float
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)
    latitude: bool = False
    origin: npt.ArrayLike = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_positive("a sphere's radius", self.radius)
        object.__setattr__(self, "center", frozen(self.center))
        object.__setattr__(self, "origin", self.center)
        self.set_frame()

    @property
    def domain(self) -> Domain:
        low, high = (-0.5 * math.pi, 0.5 * math.pi) if self.latitude else (0.0, math.pi)
        return Domain((0.0, low), (TURN, high), (TURN, math.inf))

    def _angles(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        polar = 0.5 * math.pi - uv[:, 1] if self.latitude else uv[:, 1]
        return np.cos(uv[:, 0]), np.sin(uv[:, 0]), np.cos(polar), np.sin(polar)

    def _radial(self, uv: FloatArray) -> FloatArray:
        cu, su, cv, sv = self._angles(uv)
        return np.column_stack([cu * sv, su * sv, cv])

    def _point(self, uv: FloatArray) -> FloatArray:
        return self.radius * self._radial(uv)

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        cu, su, cv, sv = self._angles(uv)
        by_u = self.radius * np.column_stack([-su * sv, cu * sv, np.zeros(len(uv))])
        by_v = self.radius * np.column_stack([cu * cv, su * cv, -sv])
        return by_u, -by_v if self.latitude else by_v

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        n = self._radial(uv)
        return n, (np.eye(3) - outer(n)) / self.radius

    def _parameters(self, points: FloatArray) -> FloatArray:
        across = np.hypot(points[:, 0], points[:, 1])
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), TURN)
        if self.latitude:
            return np.column_stack([u, np.arctan2(points[:, 2], across)])
        return np.column_stack([u, np.arctan2(across, points[:, 2])])


@dataclass(frozen=True, eq=False)
class Ellipsoid(PlacedShape):
    """An ellipsoid; u goes around z, v from the pole, as in the thesis.

    Parameters
    ----------
    origin : (3,) float
        Its centre. [mm]
    half_axes : (3,) float
        a, b, c along x, y, z. [mm]
    axes : (3, 3) float
        Rows x, y, z.

    References
    ----------
    Rodrigues 2021, equation 4.14. Its normal, equation 4.18, is correct only for a sphere;
    here the normal is the gradient of x²/a² + y²/b² + z²/c².

    >>> Ellipsoid([0.0, 0.0, 0.0], [10.0, 10.0, 6.0]).local(np.array([[0.0, 0.0]])).point.tolist()
    [[0.0, 0.0, 6.0]]
    """

    origin: npt.ArrayLike
    half_axes: npt.ArrayLike
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)

    def __post_init__(self) -> None:
        half = np.asarray(self.half_axes, dtype=np.float64)
        for value in half:
            check_positive("an ellipsoid's half-axis", float(value))
        object.__setattr__(self, "half_axes", frozen(half))
        self.set_frame()

    @property
    def domain(self) -> Domain:
        return Domain((0.0, 0.0), (TURN, math.pi), (TURN, math.inf))

    def _point(self, uv: FloatArray) -> FloatArray:
        u, v = uv[:, 0], uv[:, 1]
        ball = np.column_stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
        return np.asarray(ball * np.asarray(self.half_axes))

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        half, u, v = np.asarray(self.half_axes), uv[:, 0], uv[:, 1]
        by_u = np.column_stack([-np.sin(u) * np.sin(v), np.cos(u) * np.sin(v), 0.0 * u])
        by_v = np.column_stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), -np.sin(v)])
        return by_u * half, by_v * half

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        form = np.asarray(self.half_axes) ** -2.0
        gradient = self._point(uv) * form
        length = np.linalg.norm(gradient, axis=1)
        normal = gradient / length[:, None]
        across = np.eye(3) - outer(normal)
        return normal, across @ np.diag(form) @ across / length[:, None, None]

    def _parameters(self, points: FloatArray) -> FloatArray:
        half = np.asarray(self.half_axes)
        square = half**2
        # The nearest point is a²x / (a² + t); t is the rightmost root of a convex decreasing
        # function, to which Newton's method converges from the left without overshoot.
        t = np.max(half * np.abs(points) - square, axis=1)
        for _ in range(100):
            ratio = half * points / (square + t[:, None])
            value = np.sum(ratio**2, axis=1) - 1.0
            slope = 2.0 * np.sum(ratio**2 / (square + t[:, None]), axis=1)
            step = np.where(slope > 0.0, value / np.where(slope > 0.0, slope, 1.0), 0.0)
            t = t + np.maximum(step, 0.0)
            if np.all(step <= 1e-15 * (square.max() + np.abs(t))):
                break
        ball = half * points / (square + t[:, None])
        u = np.mod(np.arctan2(ball[:, 1], ball[:, 0]), TURN)
        return np.column_stack([u, np.arctan2(np.hypot(ball[:, 0], ball[:, 1]), ball[:, 2])])


@dataclass(frozen=True, eq=False)
class Reversed:
    """The same surface with the material on the other side: a hole, a cup.

    >>> cup = Reversed(Sphere([0.0, 0.0, 0.0], 10.0))
    >>> cup.local(np.array([[0.0, math.pi]])).normal.round(9).tolist()
    [[-0.0, -0.0, 1.0]]
    """

    surface: Surface

    @property
    def domain(self) -> Domain:
        return self.surface.domain

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.surface.derivatives(uv)

    def local(self, uv: FloatArray) -> LocalGeometry:
        return self.surface.local(uv).flipped()

    def nearest(self, points: FloatArray) -> FloatArray:
        return self.surface.nearest(points)

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return self.surface.moved(uv, displacement)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.surface.inside(uv)
