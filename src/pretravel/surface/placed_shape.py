"""Shapes in a frame of their own: the frame, and what all such shapes have in common."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from pretravel.base import BoolArray, FloatArray, PretravelError, checked_unit, frozen
from pretravel.surface.local_geometry import Domain, LocalGeometry, tangent_basis, unit_or

TURN = 2.0 * math.pi
"""A full turn. [rad]"""


def axes_about(axis: npt.ArrayLike, x_axis: npt.ArrayLike | None = None) -> FloatArray:
    """Rows x, y, z of a right-handed frame with the given z and nearly the given x.

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


def check_positive(name: str, value: float) -> None:
    """Refuse a length that is not positive."""
    if not (math.isfinite(value) and value > 0.0):
        raise PretravelError(f"{name} must be positive, got {value:g} mm")


class PlacedShape(ABC):
    """A shape in a frame of its own: subclasses define it there, this class places it."""

    origin: npt.ArrayLike
    axes: npt.ArrayLike

    def set_frame(self) -> None:
        """Check and freeze origin and axes."""
        axes = np.asarray(self.axes, dtype=np.float64)
        if axes.shape != (3, 3) or np.abs(axes @ axes.T - np.eye(3)).max() > 1e-6:
            raise PretravelError("a shape's axes are three perpendicular unit vectors, as rows")
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
