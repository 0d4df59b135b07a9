"""Analytic surfaces about an axis: cylinder, cone, torus.

All are in closed form. Normal and curvature follow from the point, not from its parameters, so
poles and seams of the parametrisation do not disturb a motion on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError
from pretravel.surface.local_geometry import Domain, outer
from pretravel.surface.placed_shape import TURN, PlacedShape, check_positive

_EVERYWHERE = (-math.inf, math.inf)


def _around(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Radial and circumferential unit vectors about z."""
    zero = np.zeros(len(u))
    radial = np.column_stack([np.cos(u), np.sin(u), zero])
    return radial, np.column_stack([-np.sin(u), np.cos(u), zero])


@dataclass(frozen=True, eq=False)
class Cylinder(PlacedShape):
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
        check_positive("a cylinder's radius", self.radius)
        self.set_frame()

    @property
    def domain(self) -> Domain:
        low, high = self.length
        return Domain((0.0, low), (TURN, high), (TURN, math.inf))

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
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), TURN)
        return np.column_stack([u, points[:, 2]])


@dataclass(frozen=True, eq=False)
class Cone(PlacedShape):
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
        Range of v; it ends at the apex in any case. [mm]

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
        self.set_frame()

    @property
    def domain(self) -> Domain:
        low, high = self.length
        apex = -self.radius / math.sin(self.half_angle)
        low, high = (max(low, apex), high) if self.half_angle > 0.0 else (low, min(high, apex))
        return Domain((0.0, low), (TURN, high), (TURN, math.inf))

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
        u = np.mod(np.arctan2(points[:, 1], points[:, 0]), TURN)
        outwards = np.hypot(points[:, 0], points[:, 1]) - self.radius
        v = outwards * math.sin(self.half_angle) + points[:, 2] * math.cos(self.half_angle)
        return np.column_stack([u, np.clip(v, self.domain.lower[1], self.domain.upper[1])])


@dataclass(frozen=True, eq=False)
class Torus(PlacedShape):
    """A torus; u is the angle about its axis, v the angle about its tube.

    Parameters
    ----------
    origin : (3,) float
        Its centre. [mm]
    radius : float
        From the axis to the centre of the tube. [mm]
    tube_radius : float
        [mm]
    axes : (3, 3) float
        Rows x, y, z; z is the axis.
    inner : bool
        Of a torus whose tube crosses the axis, the inner part: a barrel.

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
        check_positive("a torus's radius", self.radius)
        check_positive("a torus's tube radius", self.tube_radius)
        self.set_frame()

    @property
    def domain(self) -> Domain:
        return Domain((0.0, 0.0), (TURN, TURN), (TURN, TURN))

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
        # On the inner part a point lies opposite to its angle about the axis.
        side = -1.0 if self.inner else 1.0
        u = np.mod(np.arctan2(side * points[:, 1], side * points[:, 0]), TURN)
        outwards = side * np.hypot(points[:, 0], points[:, 1]) - self.radius
        return np.column_stack([u, np.mod(np.arctan2(points[:, 2], outwards), TURN)])
