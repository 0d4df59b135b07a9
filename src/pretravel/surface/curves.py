"""Curves of CAD files, in the plane of a surface's parameters or in space."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import REAL, FloatArray, checked_values, frozen


class Curve(ABC):
    """A curve with a parameter, in two or three dimensions."""

    @abstractmethod
    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        """Points (n, d), or derivatives of the given order."""

    @property
    def is_straight(self) -> bool:
        """Whether two points determine the curve."""
        return False

    @property
    def breaks(self) -> FloatArray:
        """Parameters between which the curve is smooth; empty if it is smooth everywhere."""
        return np.empty(0)

    @property
    def range(self) -> tuple[float, float]:
        """Range of the parameter."""
        return (-np.inf, np.inf)

    @property
    def period(self) -> float:
        """Period of the parameter; infinite for a curve that is not periodic."""
        return float("inf")


@dataclass(frozen=True, eq=False)
class Line(Curve):
    """A straight line: origin + t direction."""

    origin: FloatArray
    direction: FloatArray

    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        if order == 0:
            return self.origin + t[:, None] * self.direction
        return np.tile(self.direction if order == 1 else 0.0 * self.direction, (len(t), 1))

    @property
    def is_straight(self) -> bool:
        return True


@dataclass(frozen=True, eq=False)
class Conic(Curve):
    """A circle or ellipse, parabola or hyperbola, by its centre and two axes.

    kind: ``ellipse`` a cos t, b sin t; ``hyperbola`` a cosh t, b sinh t; ``parabola``
    t²/(4 a), t with the focal length a.
    """

    kind: str
    center: FloatArray
    x_axis: FloatArray
    y_axis: FloatArray
    a: float
    b: float = 0.0

    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        if self.kind == "ellipse":
            x, y = self.a * np.cos(t + order * np.pi / 2), self.b * np.sin(t + order * np.pi / 2)
        elif self.kind == "hyperbola":
            even = order % 2 == 0
            x = self.a * (np.cosh(t) if even else np.sinh(t))
            y = self.b * (np.sinh(t) if even else np.cosh(t))
        else:
            x = (t**2 / (4.0 * self.a), t / (2.0 * self.a), 0.0 * t + 0.5 / self.a, 0.0 * t)[order]
            y = (t, np.ones_like(t), 0.0 * t, 0.0 * t)[order]
        moved = x[:, None] * self.x_axis + y[:, None] * self.y_axis
        return np.asarray(self.center + moved if order == 0 else moved)

    @property
    def period(self) -> float:
        return 2.0 * np.pi if self.kind == "ellipse" else float("inf")


def flat_knots(
    knots: FloatArray, multiplicities: npt.ArrayLike, degree: int, periodic: bool
) -> FloatArray:
    """The knot sequence with repetitions; a periodic sequence is continued beyond its ends.

    >>> flat_knots(np.array([0.0, 1.0]), [2, 2], 1, False).tolist()
    [0.0, 0.0, 1.0, 1.0]
    """
    mult = np.asarray(multiplicities, dtype=np.int64)
    flat = np.repeat(knots, mult)
    if not periodic:
        return flat
    period = knots[-1] - knots[0]
    extra = degree + 1 - int(mult[0])
    inner = np.repeat(knots[:-1], mult[:-1])
    repeats = extra // len(inner) + 2
    before = np.concatenate([inner - (repeats - i) * period for i in range(repeats)])
    after = np.concatenate(
        [
            np.repeat(knots[1:], np.concatenate([mult[1:-1], mult[:1]])) + i * period
            for i in range(1, repeats + 1)
        ]
    )
    return np.concatenate([before[len(before) - extra :], flat, after[:extra]])


@dataclass(frozen=True, eq=False)
class SplineCurve(Curve):
    """A rational or plain B-spline or Bézier curve.

    Parameters
    ----------
    knots : (k,) float
        With repetitions.
    poles : (m, d) float
    weights : (m,) float
    degree : int
    wraps : bool
        Whether the curve is periodic; its parameter is then moved into the range of the knots.

    Raises
    ------
    PretravelError
        Poles or weights that are not finite.
    """

    knots: FloatArray
    poles: FloatArray
    weights: FloatArray
    degree: int
    wraps: bool = False

    def __post_init__(self) -> None:
        from scipy.interpolate import BSpline

        checked_values(self.poles, "a pole of a spline curve", REAL)
        checked_values(self.weights, "a weight of a spline curve", REAL)
        weighted = np.column_stack([self.poles * self.weights[:, None], self.weights])
        object.__setattr__(self, "poles", frozen(self.poles))
        object.__setattr__(self, "_spline", BSpline(self.knots, weighted, self.degree))

    @property
    def range(self) -> tuple[float, float]:
        return (float(self.knots[self.degree]), float(self.knots[-self.degree - 1]))

    @property
    def period(self) -> float:
        low, high = self.range
        return high - low if self.wraps else float("inf")

    @property
    def breaks(self) -> FloatArray:
        return np.unique(self.knots[self.degree : -self.degree or None])

    @property
    def is_straight(self) -> bool:
        return len(self.poles) == 2 and self.degree == 1

    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        spline = self._spline  # type: ignore[attr-defined]
        low, high = self.range
        t = low + np.mod(t - low, high - low) if self.wraps else np.clip(t, low, high)
        # The quotient rule on homogeneous coordinates, order by order.
        derivatives: list[FloatArray] = []
        weighted = [spline(t, nu=k) for k in range(order + 1)]
        weight = weighted[0][:, -1:]
        for k in range(order + 1):
            value = weighted[k][:, :-1].copy()
            binomial = 1.0
            for i in range(1, k + 1):
                binomial *= (k - i + 1) / i
                value -= binomial * weighted[i][:, -1:] * derivatives[k - i]
            derivatives.append(value / weight)
        return derivatives[order]


@dataclass(frozen=True, eq=False)
class TrimmedCurve(Curve):
    """A piece of a curve with the same parameter."""

    basis: Curve
    first: float
    last: float

    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        return self.basis.value(t, order)

    @property
    def is_straight(self) -> bool:
        return self.basis.is_straight

    @property
    def breaks(self) -> FloatArray:
        return self.basis.breaks

    @property
    def range(self) -> tuple[float, float]:
        return (self.first, self.last)


@dataclass(frozen=True, eq=False)
class OffsetCurve(Curve):
    """A curve at a constant distance from another, in a plane or perpendicular to a direction."""

    basis: Curve
    distance: float
    across: FloatArray | None = None
    """Reference direction in space; None in the plane."""

    def value(self, t: FloatArray, order: int = 0) -> FloatArray:
        d = [self.basis.value(t, k) for k in range(order + 2)]
        # The side vector q (the tangent rotated), its derivatives, and those of its length.
        q = [self._side(v) for v in d[1:]]
        length = np.linalg.norm(q[0], axis=1, keepdims=True)
        e = q[0] / length
        if order == 0:
            return np.asarray(d[0] + self.distance * e)
        rate = np.sum(e * q[1], axis=1, keepdims=True)
        e1 = (q[1] - e * rate) / length
        if order == 1:
            return np.asarray(d[1] + self.distance * e1)
        rate1 = np.sum(e1 * q[1] + e * q[2], axis=1, keepdims=True)
        e2 = (q[2] - 2.0 * e1 * rate - e * rate1) / length
        return np.asarray(d[2] + self.distance * e2)

    def _side(self, tangent: FloatArray) -> FloatArray:
        if self.across is None:
            return np.column_stack([tangent[:, 1], -tangent[:, 0]])
        return np.asarray(np.cross(tangent, self.across))

    @property
    def is_straight(self) -> bool:
        return self.basis.is_straight

    @property
    def breaks(self) -> FloatArray:
        return self.basis.breaks

    @property
    def range(self) -> tuple[float, float]:
        return self.basis.range


_MOST_PIECES = 2048
"""Of each of eight parts of a circle, found at once."""


def _pieces_of_circle(
    curve: Curve, step: float, tolerance: float, scale: FloatArray | float
) -> int:
    """Of a step along a circle, all alike: the power of two that halving them one by one finds."""
    units = np.atleast_1d(scale)
    if not (isinstance(curve, Conic) and curve.kind == "ellipse" and curve.a == curve.b):
        return 1
    radius = curve.a * float(units.max())
    if np.ptp(units) > 1e-9 * units.max() or not tolerance < radius < 1e9 * tolerance:
        return 1
    longest, pieces = 2.0 * math.acos(1.0 - tolerance / radius), 1
    while pieces * longest < abs(step) and pieces < _MOST_PIECES:
        pieces *= 2
    return pieces


def polyline(
    curve: Curve,
    first: float,
    last: float,
    tolerance: float,
    scale: FloatArray | None = None,
) -> FloatArray:
    """Points along a piece of a curve, between which chords deviate by at most the tolerance.

    Parameters
    ----------
    curve : Curve
    first, last : float
    tolerance : float
    scale : (d,) float, optional
        Lengths of a unit of each coordinate; ones when not given.

    Returns
    -------
    (n, d) float

    >>> line = Line(np.zeros(2), np.array([1.0, 0.0]))
    >>> polyline(line, 0.0, 2.0, 1e-6).tolist()
    [[0.0, 0.0], [2.0, 0.0]]
    """
    if curve.is_straight:
        return curve.value(np.array([first, last]))
    inner = curve.breaks[(curve.breaks > first) & (curve.breaks < last)]
    unit_lengths: FloatArray | float = 1.0 if scale is None else scale
    pieces = 8 * _pieces_of_circle(curve, (last - first) / 8.0, tolerance, unit_lengths)
    t = np.unique(np.concatenate([np.linspace(first, last, pieces + 1), inner]))
    points = curve.value(t)
    for _ in range(14):
        middle = 0.5 * (t[:-1] + t[1:])
        between = curve.value(middle)
        chord = unit_lengths * (points[1:] - points[:-1])
        rise = unit_lengths * (between - points[:-1])
        square = np.maximum(np.sum(chord * chord, axis=1), 1e-300)
        along = np.sum(rise * chord, axis=1) / square
        # Distance of the middle from the chord.
        off = np.linalg.norm(rise - np.clip(along, 0.0, 1.0)[:, None] * chord, axis=1)
        coarse = off > tolerance
        if not np.any(coarse) or len(t) > 20_000:
            break
        t = np.concatenate([t, middle[coarse]])
        order = np.argsort(t, kind="stable")
        t = t[order]
        points = np.concatenate([points, between[coarse]])[order]
    return points
