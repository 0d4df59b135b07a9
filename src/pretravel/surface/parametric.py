"""Surfaces defined by a parametrisation: a Python function, the convex surface of the thesis."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray, PretravelError
from pretravel.surface.contact import nearest_contact
from pretravel.surface.local_geometry import (
    Domain,
    LocalGeometry,
    from_second_order,
    parameter_step,
)

SecondOrder: TypeAlias = tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray
]
"""Point, du, dv, duu, duv, dvv; (n, 3) each."""

_SEEDS = 24
"""Starting points along each parameter for the nearest point."""
_NEAR_POLE, _AT_POLE = 1e-3, 1e-5
"""Ratio of the derivatives, times the sides of the domain, below which curvature and normal
are dominated by rounding."""
_FROM_POLE = 2e-3
"""Distance from a pole, as a share of the domain, at which its curvature is determined."""


class Parametric(ABC):
    """A surface defined by its parametrisation and the derivatives of it."""

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """Range of the parameters."""

    @abstractmethod
    def second_order(self, uv: FloatArray) -> SecondOrder:
        """Points with first and second derivatives."""

    def first_order(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points with first derivatives."""
        return self.second_order(uv)[:3]

    def derivatives(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.first_order(uv)

    def local(self, uv: FloatArray) -> LocalGeometry:
        second = self.second_order(uv)
        geometry = from_second_order(*second)
        sides = np.asarray(self.domain.upper) - np.asarray(self.domain.lower)
        if not np.all(np.isfinite(sides)):  # extruded: no poles
            return geometry
        lengths = np.stack([np.linalg.norm(d, axis=1) for d in second[1:3]], axis=1) * sides
        for standing in (0, 1):  # the parameter with which, at a pole, the point does not move
            near = lengths[:, standing] < _NEAR_POLE * lengths[:, 1 - standing]
            if np.any(near):
                self._near_pole(geometry, uv, np.flatnonzero(near), standing, second)
        return geometry

    def _near_pole(
        self,
        geometry: LocalGeometry,
        uv: FloatArray,
        rows: IntArray,
        standing: int,
        second: SecondOrder,
    ) -> None:
        """Correct normals and curvatures near a pole, in place.

        Near a pole one derivative is almost zero and rounding determines its direction. At a
        distance d from the pole it is d times the mixed derivative halfway, with an error of
        order d³. The curvature is determined a little further away.
        """
        other = 1 - standing
        low, high = self.domain.lower[other], self.domain.upper[other]
        distance = np.stack([uv[rows, other] - low, high - uv[rows, other]])
        at_low = distance[0] <= distance[1]
        sense = np.where(at_low, 1.0, -1.0)
        further = uv[rows].copy()
        further[:, other] += sense * _FROM_POLE * (high - low)
        geometry.curvature[rows] = from_second_order(*self.second_order(further)).curvature
        sides = np.asarray(self.domain.upper) - np.asarray(self.domain.lower)
        lengths = np.linalg.norm(np.stack(second[1:3]), axis=2)[:, rows] * sides[:, None]
        noise = lengths[standing] < _AT_POLE * lengths[other]
        close = rows[noise]
        halfway = uv[close].copy()
        halfway[:, other] -= 0.5 * sense[noise] * np.min(distance, axis=0)[noise]
        standing_one = sense[noise][:, None] * self.second_order(halfway)[4]
        moving = second[2 - standing][close]
        pair = (standing_one, moving) if standing == 0 else (moving, standing_one)
        normal = np.cross(*pair)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        geometry.normal[close] = normal / np.where(length > 0.0, length, np.nan)

    def nearest(self, points: FloatArray) -> FloatArray:
        seeds, tree = self._seeds
        _, index = tree.query(points, k=1)
        return nearest_contact(self, seeds[index], points).uv

    @cached_property
    def _seeds(self) -> tuple[FloatArray, Any]:
        from scipy.spatial import cKDTree

        low, high = self.domain.lower, self.domain.upper
        if not np.all(np.isfinite([*low, *high])):
            raise PretravelError(
                "nearest points can be found only on a surface with bounded parameters"
            )
        u, v = np.meshgrid(
            np.linspace(low[0], high[0], _SEEDS), np.linspace(low[1], high[1], _SEEDS)
        )
        seeds = np.column_stack([u.ravel(), v.ravel()])
        return seeds, cKDTree(self.first_order(seeds)[0])

    def moved(self, uv: FloatArray, displacement: FloatArray) -> FloatArray:
        _, du, dv = self.first_order(uv)
        return uv + parameter_step(du, dv, displacement)

    def inside(self, uv: FloatArray) -> BoolArray:
        return self.domain.contains(uv)


@dataclass(frozen=True, eq=False)
class FunctionSurface(Parametric):
    """A surface from a function of u and v.

    Parameters
    ----------
    function : callable
        ``(u, v) -> (x, y, z)``, arrays in and arrays out, twice differentiable and written
        for NumPy. Derivatives are determined by complex steps and differences of these, so
        the function must accept complex arguments. [mm]
    u, v : pairs of float
        Ranges.
    outwards : int
        +1 where the part's outside is along du x dv, -1 where it is opposite.

    Raises
    ------
    PretravelError
        A function that does not accept complex arrays, or is not finite.

    >>> saddle = FunctionSurface(lambda u, v: (u, v, u * v), u=(-5.0, 5.0), v=(-5.0, 5.0))
    >>> saddle.local(np.array([[0.0, 0.0]])).principal_curvatures.round(6).tolist()
    [[-1.0, 1.0]]
    """

    function: Callable[..., Sequence[object]]
    u: tuple[float, float]
    v: tuple[float, float]
    outwards: int = 1

    def __post_init__(self) -> None:
        if not (self.u[0] < self.u[1] and self.v[0] < self.v[1]):
            raise PretravelError(f"the ranges u {self.u} and v {self.v} must increase")
        # Also away from the middle, where symmetry could hide an error.
        share = np.array([[0.5, 0.5], [0.31, 0.67], [0.78, 0.23]])
        uv = np.array([self.u[0], self.v[0]]) + share * [self._span(0), self._span(1)]
        try:
            with np.errstate(all="ignore"):
                count = len(self.function(uv[:, 0], uv[:, 1]))
            values = self.second_order(uv)
        except (TypeError, ValueError) as error:
            raise PretravelError(
                "the surface's function must take arrays u, v (complex ones too) and return x, y, "
                f"z: {error}"
            ) from error
        if count != 3:
            raise PretravelError(f"the surface's function must return x, y, z; it returns {count}")
        if not all(np.all(np.isfinite(value)) for value in values):
            raise PretravelError(
                "the surface's function is not finite, or has no derivatives, near "
                f"u = {uv[0, 0]:g}, v = {uv[0, 1]:g}"
            )
        for axis, by_complex in enumerate(values[1:3]):
            step = 1e-6 * self._span(axis) * np.eye(2)[axis]
            difference = (self._real(uv + step) - self._real(uv - step)) / (2.0 * step[axis])
            scale = np.abs(by_complex).max() + np.abs(difference).max()
            if np.abs(difference - by_complex).max() > 1e-5 * scale:
                raise PretravelError(
                    "the surface's function loses its derivative with complex arguments (abs, "
                    "maximum, real and comparisons do that): use smooth functions, for "
                    "example sqrt(u * u) instead of abs(u)"
                )

    def _span(self, axis: int) -> float:
        low, high = (self.u, self.v)[axis]
        return high - low

    def _real(self, uv: FloatArray) -> FloatArray:
        return np.asarray(self._complex(uv[:, 0] + 0j, uv[:, 1] + 0j).real)

    @property
    def domain(self) -> Domain:
        return Domain((self.u[0], self.v[0]), (self.u[1], self.v[1]))

    def local(self, uv: FloatArray) -> LocalGeometry:
        geometry = super().local(uv)
        return geometry if self.outwards > 0 else geometry.flipped()

    def _complex(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):  # the callers check for values that are not finite
            x, y, z = np.broadcast_arrays(*(np.asarray(c) for c in self.function(u, v)), u)[:3]
        return np.stack([x, y, z], axis=1)

    def first_order(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        u, v, h = uv[:, 0], uv[:, 1], 1e-100
        by_u, by_v = self._complex(u + 1j * h, v + 0j), self._complex(u + 0j, v + 1j * h)
        return by_u.real, by_u.imag / h, by_v.imag / h

    def second_order(self, uv: FloatArray) -> SecondOrder:
        point, du, dv = self.first_order(uv)
        # First derivatives are exact, so their central difference is accurate to 1e-10.
        steps = 6e-6 * np.array([self.u[1] - self.u[0], self.v[1] - self.v[0]])
        by_u, by_v = np.diag(steps)
        up, down = uv + by_u, uv - by_u
        _, du_up, dv_up = self.first_order(up)
        _, du_down, dv_down = self.first_order(down)
        right, left = uv + by_v, uv - by_v
        dvv = (self.first_order(right)[2] - self.first_order(left)[2]) / (2.0 * steps[1])
        duu = (du_up - du_down) / (2.0 * steps[0])
        duv = (dv_up - dv_down) / (2.0 * steps[0])
        return point, du, dv, duu, duv, dvv


@dataclass(frozen=True, eq=False)
class Convex(Parametric):
    """The convex surface of the thesis: a paraboloid rotated about an axis between x and z.

    Parameters
    ----------
    a, b : float
        (a u, a v, -b (u² + v²)) before the rotation, u and v from -1 to 1. [mm]
    turn : float
        About the axis in the xz plane 45° from x. [rad]

    Notes
    -----
    The thesis states 70°; its coefficients and its Table 4.10 are those of 45°.

    References
    ----------
    Rodrigues 2021, equations 4.1 (whose second row should read a v) to 4.3 (whose
    0.464 should read 0.1464).

    >>> Convex().local(np.array([[0.5, 0.5]])).point.round(3).tolist()
    [[2.803, 14.571, 2.197]]
    """

    a: float = 20.0
    b: float = 10.0
    turn: float = 0.25 * math.pi

    def __post_init__(self) -> None:
        if not (self.a > 0.0 and math.isfinite(self.a) and math.isfinite(self.b)):
            raise PretravelError(f"convex: a = {self.a:g} mm must be positive, b finite")

    @property
    def domain(self) -> Domain:
        return Domain((-1.0, -1.0), (1.0, 1.0))

    @property
    def _rotation(self) -> FloatArray:
        tilt = 0.25 * math.pi
        c, s = math.cos(tilt), math.sin(tilt)
        about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        c, s = math.cos(self.turn), math.sin(self.turn)
        about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(about_y @ about_z @ about_y.T)

    def second_order(self, uv: FloatArray) -> SecondOrder:
        u, v = uv[:, 0], uv[:, 1]
        zero = np.zeros(len(uv))
        one = np.ones(len(uv))
        bowl = np.column_stack([zero, zero, -2.0 * self.b * one])
        plain = (
            np.column_stack([self.a * u, self.a * v, -self.b * (u**2 + v**2)]),
            np.column_stack([self.a * one, zero, -2.0 * self.b * u]),
            np.column_stack([zero, self.a * one, -2.0 * self.b * v]),
            bowl,
            np.zeros((len(uv), 3)),
            bowl,
        )
        point, du, dv, duu, duv, dvv = (vectors @ self._rotation.T for vectors in plain)
        return point, du, dv, duu, duv, dvv
