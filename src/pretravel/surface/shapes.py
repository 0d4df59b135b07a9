"""Analytic surfaces: plane, sphere, cylinder, cone, torus, ellipsoid.

All are in closed form and know neither poles nor seams when something moves on
them: normal and curvature are taken from the point, not from its parameters.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.directions import checked_unit
from pretravel.errors import PretravelError
from pretravel.surface.local_geometry import (
    Domain,
    LocalGeometry,
    Surface,
    outer,
    tangent_basis,
    unit_or,
)

_TURN = 2.0 * math.pi
_EVERYWHERE = (-math.inf, math.inf)


def axes_about(axis: npt.ArrayLike, x_axis: npt.ArrayLike | None = None) -> FloatArray:
    """Rows x, y, z of a right-handed frame with the given z, and x as near as can be.

    >>> axes_about([0.0, 0.0, 1.0], [3.0, 0.0, 4.0]).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    z = checked_unit(np.atleast_2d(np.asarray(axis, dtype=np.float64)), "axis")
    if x_axis is None:
        x = tangent_basis(z)[:, 0]
    else:
        given = np.atleast_2d(np.asarray(x_axis, dtype=np.float64))
        x = unit_or(given - np.sum(given * z, axis=1, keepdims=True) * z, tangent_basis(z)[0, 0])
    return np.concatenate([x, np.cross(z, x), z])


def _positive(name: str, value: float) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise PretravelError(f"{name} must be positive, got {value:g} mm")
    return float(value)


class _Shape(ABC):
    """A shape in its own frame: subclasses know it there, this class moves it."""

    origin: npt.ArrayLike
    axes: npt.ArrayLike

    def _placed(self) -> None:
        axes = np.asarray(self.axes, dtype=np.float64)
        if axes.shape != (3, 3) or np.abs(axes @ axes.T - np.eye(3)).max() > 1e-6:
            raise PretravelError("a shape's axes are three unit vectors across each other, as rows")
        object.__setattr__(self, "origin", frozen(self.origin))
        object.__setattr__(self, "axes", frozen(axes))

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """Range of the parameters."""

    @abstractmethod
    def _point(self, uv: FloatArray) -> FloatArray:
        """Points in the shape's frame."""

    @abstractmethod
    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Du and dv in the shape's frame."""

    @abstractmethod
    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outward normal and curvature tensor in the shape's frame."""

    @abstractmethod
    def _parameters(self, points: FloatArray) -> FloatArray:
        """Parameters of the nearest points, from points in the shape's frame."""

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        axes = np.asarray(self.axes)
        du, dv = self._tangents(uv)
        return np.asarray(self.origin) + self._point(uv) @ axes, du @ axes, dv @ axes

    def local(self, uv: FloatArray) -> LocalGeometry:
        axes = np.asarray(self.axes)
        normal, curvature = self._normal(uv)
        return LocalGeometry(
            point=np.asarray(self.origin) + self._point(uv) @ axes,
            normal=normal @ axes,
            curvature=axes.T @ curvature @ axes,
        )

    def nearest(self, points: FloatArray) -> FloatArray:
        return self._parameters((points - np.asarray(self.origin)) @ np.asarray(self.axes).T)

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return self._parameters(self._point(uv) + displacement @ np.asarray(self.axes).T)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.domain.contains(uv)


@dataclass(frozen=True, eq=False)
class Plane(_Shape):
    """A plane through a point; u and v are lengths along two axes in it.

    Parameters
    ----------
    point : (3,) float
        [mm]
    normal : (3,) float
        Outward unit normal.
    x_axis : (3,) float, optional
        Direction of u. Not given: down the slope as steeply as can be.

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
        self._placed()

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
class Sphere(_Shape):
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
        _positive("a sphere's radius", self.radius)
        object.__setattr__(self, "center", frozen(self.center))
        object.__setattr__(self, "origin", self.center)
        self._placed()

    @property
    def domain(self) -> Domain:
        low, high = (-0.5 * math.pi, 0.5 * math.pi) if self.latitude else (0.0, math.pi)
        return Domain((0.0, low), (_TURN, high), (_TURN, math.inf))

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
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), _TURN)
        if self.latitude:
            return np.column_stack([u, np.arctan2(points[:, 2], across)])
        return np.column_stack([u, np.arctan2(across, points[:, 2])])


def _around(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Radial and circumferential unit vectors about z."""
    zero = np.zeros(len(u))
    radial = np.column_stack([np.cos(u), np.sin(u), zero])
    return radial, np.column_stack([-np.sin(u), np.cos(u), zero])


@dataclass(frozen=True, eq=False)
class Cylinder(_Shape):
    """A cylinder; u is the angle about its axis, v the length along it.

    Parameters
    ----------
    origin : (3,) float
        A point of the axis. [mm]
    radius : float
        [mm]
    axes : (3, 3) float
        Rows x, y, z; z is the axis.
    length : pair of float
        Range of v. [mm]

    >>> rod = Cylinder([0.0, 0.0, 0.0], 5.0)
    >>> rod.local(np.array([[0.0, 2.0]])).normal.tolist()
    [[1.0, 0.0, 0.0]]
    """

    origin: npt.ArrayLike
    radius: float
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)
    length: tuple[float, float] = _EVERYWHERE

    def __post_init__(self) -> None:
        _positive("a cylinder's radius", self.radius)
        self._placed()

    @property
    def domain(self) -> Domain:
        low, high = self.length
        return Domain((0.0, low), (_TURN, high), (_TURN, math.inf))

    def _point(self, uv: FloatArray) -> FloatArray:
        point = self.radius * _around(uv[:, 0])[0]
        point[:, 2] = uv[:, 1]
        return point

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.radius * _around(uv[:, 0])[1], np.tile([0.0, 0.0, 1.0], (len(uv), 1))

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        radial, around = _around(uv[:, 0])
        return radial, outer(around) / self.radius

    def _parameters(self, points: FloatArray) -> FloatArray:
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), _TURN)
        return np.column_stack([u, points[:, 2]])


@dataclass(frozen=True, eq=False)
class Cone(_Shape):
    """A cone; u is the angle about its axis, v the length along its side.

    Parameters
    ----------
    origin : (3,) float
        Point of the axis where v is zero. [mm]
    radius : float
        Radius there. [mm]
    half_angle : float
        Between axis and side; positive where the radius grows along the axis. [rad]
    axes : (3, 3) float
        Rows x, y, z; z is the axis.
    length : pair of float
        Range of v; the apex always ends it. [mm]

    >>> cone = Cone([0.0, 0.0, 0.0], 5.0, -math.pi / 4)
    >>> cone.local(np.array([[0.0, 0.0]])).normal.round(9).tolist()
    [[0.707106781, 0.0, 0.707106781]]
    """

    origin: npt.ArrayLike
    radius: float
    half_angle: float
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)
    length: tuple[float, float] = _EVERYWHERE

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and self.radius >= 0.0):
            raise PretravelError(f"a cone's radius cannot be negative, got {self.radius:g} mm")
        if not 1e-9 < abs(self.half_angle) < 0.5 * math.pi - 1e-9:
            raise PretravelError(
                f"a cone's half angle lies between 0 and 90 degrees, got "
                f"{math.degrees(self.half_angle):g}"
            )
        self._placed()

    @property
    def domain(self) -> Domain:
        low, high = self.length
        apex = -self.radius / math.sin(self.half_angle)
        low, high = (max(low, apex), high) if self.half_angle > 0.0 else (low, min(high, apex))
        return Domain((0.0, low), (_TURN, high), (_TURN, math.inf))

    def _from_axis(self, v: FloatArray) -> FloatArray:
        return np.asarray(self.radius + v * math.sin(self.half_angle))

    def _point(self, uv: FloatArray) -> FloatArray:
        point = self._from_axis(uv[:, 1])[:, None] * _around(uv[:, 0])[0]
        point[:, 2] = uv[:, 1] * math.cos(self.half_angle)
        return point

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        radial, around = _around(uv[:, 0])
        by_v = math.sin(self.half_angle) * radial
        by_v[:, 2] = math.cos(self.half_angle)
        return self._from_axis(uv[:, 1])[:, None] * around, by_v

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        radial, around = _around(uv[:, 0])
        normal = math.cos(self.half_angle) * radial
        normal[:, 2] = -math.sin(self.half_angle)
        from_axis = np.maximum(self._from_axis(uv[:, 1]), 1e-12)
        return normal, outer(around) * (math.cos(self.half_angle) / from_axis)[:, None, None]

    def _parameters(self, points: FloatArray) -> FloatArray:
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), _TURN)
        outwards = np.hypot(points[:, 0], points[:, 1]) - self.radius
        v = outwards * math.sin(self.half_angle) + points[:, 2] * math.cos(self.half_angle)
        return np.column_stack([u, np.clip(v, self.domain.lower[1], self.domain.upper[1])])


@dataclass(frozen=True, eq=False)
class Torus(_Shape):
    """A torus; u is the angle about its axis, v the angle about its tube.

    Parameters
    ----------
    origin : (3,) float
        Its middle. [mm]
    radius : float
        From the axis to the middle of the tube. [mm]
    tube_radius : float
        [mm]
    axes : (3, 3) float
        Rows x, y, z; z is the axis.
    inner : bool
        Of a tube that crosses its own axis the part beyond it: a barrel.

    >>> ring = Torus([0.0, 0.0, 0.0], 10.0, 2.0)
    >>> ring.local(np.array([[0.0, 0.0]])).principal_curvatures.round(6).tolist()
    [[0.083333, 0.5]]
    """

    origin: npt.ArrayLike
    radius: float
    tube_radius: float
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)
    inner: bool = False

    def __post_init__(self) -> None:
        _positive("a torus's radius", self.radius)
        _positive("a torus's tube radius", self.tube_radius)
        self._placed()

    @property
    def domain(self) -> Domain:
        return Domain((0.0, 0.0), (_TURN, _TURN), (_TURN, _TURN))

    def _frame(
        self, uv: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        radial, around = _around(uv[:, 0])
        c, s = np.cos(uv[:, 1]), np.sin(uv[:, 1])
        normal = c[:, None] * radial
        normal[:, 2] = s
        over = -s[:, None] * radial
        over[:, 2] = c
        return radial, around, normal, over, self.radius + self.tube_radius * c

    def _point(self, uv: FloatArray) -> FloatArray:
        radial, _, normal, _, _ = self._frame(uv)
        return np.asarray(self.radius * radial + self.tube_radius * normal)

    def _tangents(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        _, around, _, over, from_axis = self._frame(uv)
        return from_axis[:, None] * around, self.tube_radius * over

    def _normal(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        _, around, normal, over, from_axis = self._frame(uv)
        # A spindle torus (radius below tube_radius) crosses its axis at an apex.
        safe = np.where(np.abs(from_axis) > 1e-12, from_axis, 1e-12)
        hoop = (np.cos(uv[:, 1]) / safe)[:, None, None]
        return normal, outer(around) * hoop + outer(over) / self.tube_radius

    def _parameters(self, points: FloatArray) -> FloatArray:
        # Beyond the axis a point is on the other side of where its angle says.
        side = -1.0 if self.inner else 1.0
        u = np.mod(np.arctan2(side * points[:, 1], side * points[:, 0]), _TURN)
        outwards = side * np.hypot(points[:, 0], points[:, 1]) - self.radius
        return np.column_stack([u, np.mod(np.arctan2(points[:, 2], outwards), _TURN)])


@dataclass(frozen=True, eq=False)
class Ellipsoid(_Shape):
    """An ellipsoid; u goes around z, v from the pole, as in the thesis.

    Parameters
    ----------
    origin : (3,) float
        Its middle. [mm]
    half_axes : (3,) float
        a, b, c along x, y, z. [mm]
    axes : (3, 3) float
        Rows x, y, z.

    References
    ----------
    Rodrigues 2021, equation 4.14. Its normal, equation 4.18, is right only for a ball;
    here it is the gradient of x²/a² + y²/b² + z²/c².

    >>> Ellipsoid([0.0, 0.0, 0.0], [10.0, 10.0, 6.0]).local(np.array([[0.0, 0.0]])).point.tolist()
    [[0.0, 0.0, 6.0]]
    """

    origin: npt.ArrayLike
    half_axes: npt.ArrayLike
    axes: npt.ArrayLike = field(default_factory=lambda: np.eye(3), repr=False)

    def __post_init__(self) -> None:
        half = np.asarray(self.half_axes, dtype=np.float64)
        for value in half:
            _positive("an ellipsoid's half-axis", float(value))
        object.__setattr__(self, "half_axes", frozen(half))
        self._placed()

    @property
    def domain(self) -> Domain:
        return Domain((0.0, 0.0), (_TURN, math.pi), (_TURN, math.inf))

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
        # The foot is a²x / (a² + t); t is the rightmost root of a convex decreasing
        # function, which Newton reaches from the left without ever overshooting.
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
        u = np.mod(np.arctan2(ball[:, 1], ball[:, 0]), _TURN)
        return np.column_stack([u, np.arctan2(np.hypot(ball[:, 0], ball[:, 1]), ball[:, 2])])


@dataclass(frozen=True, eq=False)
class Reversed:
    """The same surface with material on its other side: a hole, a cup.

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
