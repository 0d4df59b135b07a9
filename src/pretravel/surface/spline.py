"""B-spline and Bézier surfaces, plain or rational, periodic or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import COORDINATE, REAL, FloatArray, PretravelError, checked_values, frozen
from pretravel.surface.local_geometry import Domain
from pretravel.surface.parametric import Parametric, SecondOrder

_SECOND = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
"""Orders of the derivatives by u and v, to the second."""


@dataclass(frozen=True, eq=False)
class SplineSurface(Parametric):
    """A B-spline surface in homogeneous coordinates.

    Parameters
    ----------
    u_knots, v_knots : (k,) float
        With repetitions; continued beyond the ends where the surface is periodic.
    poles : (m, l, 3) float
        [mm]
    weights : (m, l) float
    degrees : pair of int
    periods : pair of float
        Infinite where the surface is not periodic.

    Raises
    ------
    PretravelError
        Poles beyond the size of parts, weights that are not positive.

    >>> poles = np.array([[[0, 0, 0], [0, 2, 0]], [[3, 0, 0], [3, 2, 0]]], dtype=float)
    >>> flat = SplineSurface(np.array([0.0, 0, 1, 1]), np.array([0.0, 0, 1, 1]), poles,
    ...                      np.ones((2, 2)), (1, 1))
    >>> flat.local(np.array([[0.5, 0.5]])).point.tolist()
    [[1.5, 1.0, 0.0]]
    """

    u_knots: FloatArray
    v_knots: FloatArray
    poles: FloatArray
    weights: FloatArray
    degrees: tuple[int, int]
    periods: tuple[float, float] = (float("inf"), float("inf"))

    def __post_init__(self) -> None:
        from scipy.interpolate import NdBSpline

        checked_values(self.poles, "a pole of a spline surface", COORDINATE)
        if not np.all((self.weights > 0.0) & (self.weights <= REAL.highest)):
            raise PretravelError("the weights of a rational surface must be positive and finite")
        weighted = np.concatenate(
            [self.poles * self.weights[..., None], self.weights[..., None]], 2
        )
        spline = NdBSpline((self.u_knots, self.v_knots), weighted, self.degrees)
        object.__setattr__(self, "poles", frozen(self.poles))
        object.__setattr__(self, "_spline", spline)
        object.__setattr__(self, "_rational", bool(np.ptp(self.weights) > 0.0))

    @property
    def domain(self) -> Domain:
        (p, q), u, v = self.degrees, self.u_knots, self.v_knots
        return Domain(
            (float(u[p]), float(v[q])), (float(u[-p - 1]), float(v[-q - 1])), self.periods
        )

    def _homogeneous(self, uv: FloatArray, order: tuple[int, int]) -> FloatArray:
        if order[0] > self.degrees[0] or order[1] > self.degrees[1]:
            return np.zeros((len(uv), 4))
        values = self._spline(uv, nu=order)  # type: ignore[attr-defined]
        return np.asarray(values, dtype=np.float64)

    def first_order(self, uv: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        uv = self.domain.confined(uv)
        s, u, v = (self._homogeneous(uv, order) for order in ((0, 0), (1, 0), (0, 1)))
        w = s[:, 3:]
        point = s[:, :3] / w
        return point, (u[:, :3] - u[:, 3:] * point) / w, (v[:, :3] - v[:, 3:] * point) / w

    def second_order(self, uv: FloatArray) -> SecondOrder:
        uv = self.domain.confined(uv)
        s, u, v, uu, mixed, vv = (self._homogeneous(uv, order) for order in _SECOND)
        w, wu, wv = s[:, 3:], u[:, 3:], v[:, 3:]
        point = s[:, :3] / w
        du, dv = (u[:, :3] - wu * point) / w, (v[:, :3] - wv * point) / w
        if not self._rational:  # type: ignore[attr-defined]
            weight = self.weights[0, 0]
            return point, du, dv, uu[:, :3] / weight, mixed[:, :3] / weight, vv[:, :3] / weight
        duu = (uu[:, :3] - 2.0 * wu * du - uu[:, 3:] * point) / w
        duv = (mixed[:, :3] - wu * dv - wv * du - mixed[:, 3:] * point) / w
        dvv = (vv[:, :3] - 2.0 * wv * dv - vv[:, 3:] * point) / w
        return point, du, dv, duu, duv, dvv
