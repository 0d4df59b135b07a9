"""Surfaces made from curves or other surfaces: extrusions, revolutions, offsets, placements."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.surface.curves import Curve
from pretravel.surface.local_geometry import Domain, LocalGeometry, Surface, parameter_step
from pretravel.surface.parametric import Parametric, SecondOrder


@dataclass(frozen=True, eq=False)
class Extrusion(Parametric):
    """A curve displaced along a direction: curve(u) + v direction."""

    curve: Curve
    direction: FloatArray

    @property
    def domain(self) -> Domain:
        low, high = self.curve.range
        return Domain((low, -math.inf), (high, math.inf), (self.curve.period, math.inf))

    def second_order(self, uv: FloatArray) -> SecondOrder:
        u, v = uv[:, 0], uv[:, 1]
        none = np.zeros((len(uv), 3))
        return (
            self.curve.value(u) + v[:, None] * self.direction,
            self.curve.value(u, 1),
            np.tile(self.direction, (len(uv), 1)),
            self.curve.value(u, 2),
            none,
            none,
        )


@dataclass(frozen=True, eq=False)
class Revolution(Parametric):
    """A curve rotated about an axis by u; v is the curve's parameter."""

    curve: Curve
    origin: FloatArray
    axis: FloatArray

    @property
    def domain(self) -> Domain:
        low, high = self.curve.range
        return Domain((0.0, low), (2.0 * math.pi, high), (2.0 * math.pi, self.curve.period))

    def _turned(self, vectors: FloatArray, u: FloatArray, order: int = 0) -> FloatArray:
        along = np.sum(vectors * self.axis, axis=1, keepdims=True) * self.axis
        across = vectors - along
        side = np.cross(self.axis, across)
        c, s = np.cos(u + order * math.pi / 2)[:, None], np.sin(u + order * math.pi / 2)[:, None]
        return np.asarray(c * across + s * side + (along if order == 0 else 0.0))

    def second_order(self, uv: FloatArray) -> SecondOrder:
        u, v = uv[:, 0], uv[:, 1]
        arm, by_v, by_vv = (
            self.curve.value(v) - self.origin,
            self.curve.value(v, 1),
            self.curve.value(v, 2),
        )
        return (
            self.origin + self._turned(arm, u),
            self._turned(arm, u, 1),
            self._turned(by_v, u),
            self._turned(arm, u, 2),
            self._turned(by_v, u, 1),
            self._turned(by_vv, u),
        )


@dataclass(frozen=True, eq=False)
class Offset:
    """A surface at a constant distance from another one, along the normal of the other one."""

    basis: Surface
    distance: float

    @property
    def domain(self) -> Domain:
        return self.basis.domain

    def local(self, uv: FloatArray) -> LocalGeometry:
        base = self.basis.local(uv)
        along = np.eye(3) + self.distance * base.curvature
        tangents = base.along_parameters
        return LocalGeometry(
            point=base.point + self.distance * base.normal,
            normal=base.normal,
            curvature=np.asarray(np.linalg.solve(along, base.curvature)),
            along_parameters=None if tangents is None else tangents @ along,
        )

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        point, du, dv = self.basis.derivatives(uv)
        base = self.basis.local(uv)
        along = np.eye(3) + self.distance * base.curvature
        du, dv = (np.einsum("nij,nj->ni", along, d) for d in (du, dv))
        return point + self.distance * base.normal, du, dv

    def nearest(self, points: FloatArray) -> FloatArray:
        return self.basis.nearest(points)

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        _, du, dv = self.derivatives(uv)
        return uv + parameter_step(du, dv, displacement)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.basis.inside(uv)


@dataclass(frozen=True, eq=False)
class Placed:
    """A surface rotated and displaced: x -> rotation x + shift.

    Parameters
    ----------
    surface : Surface
    rotation : (3, 3) float
        Orthonormal.
    shift : (3,) float
        [mm]

    >>> from pretravel.surface.shapes import Plane
    >>> floor = Placed(Plane([0, 0, 0], [0, 0, 1]), np.eye(3), np.array([0.0, 0.0, 5.0]))
    >>> floor.local(np.array([[1.0, 2.0]])).point.tolist()
    [[1.0, 2.0, 5.0]]
    """

    surface: Surface
    rotation: FloatArray
    shift: FloatArray

    @property
    def domain(self) -> Domain:
        return self.surface.domain

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        point, du, dv = self.surface.derivatives(uv)
        turn = self.rotation.T
        return point @ turn + self.shift, du @ turn, dv @ turn

    def local(self, uv: FloatArray) -> LocalGeometry:
        own = self.surface.local(uv)
        tangents = own.along_parameters
        return LocalGeometry(
            point=own.point @ self.rotation.T + self.shift,
            normal=own.normal @ self.rotation.T,
            curvature=self.rotation @ own.curvature @ self.rotation.T,
            along_parameters=None if tangents is None else tangents @ self.rotation.T,
        )

    def nearest(self, points: FloatArray) -> FloatArray:
        return self.surface.nearest((points - self.shift) @ self.rotation)

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        return self.surface.moved(uv, displacement @ self.rotation)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.surface.inside(uv)
