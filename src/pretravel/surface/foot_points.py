"""The point of a surface that is nearest to another point, by Newton's method in the parameters."""

from __future__ import annotations

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.surface.local_geometry import Domain
from pretravel.surface.parametric import Parametric

_CLOSED = 1e-12
"""Distance from the foot of the perpendicular at which a row is finished. [mm]"""
_ROUNDING = 4e-15
"""The same from rounding alone, relative to the coordinates."""
_MOST_ITERATIONS = 15
_MOST_HALVINGS = 6
_REGULAR = 1e-10
"""Determinant, relative to the product of its diagonal, below which du and dv span no plane."""


def foot_points(
    surface: Parametric, domain: Domain, start: FloatArray, points: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Parameters of the nearest points, from parameters near them.

    Parameters
    ----------
    surface : Parametric
    domain : Domain
        The parameters stay within it; the nearest point can lie on its border.
    start : (n, 2) float
    points : (n, 3) float
        [mm]

    Returns
    -------
    uv : (n, 2) float
    solved : (n,) bool
        False where the method does not converge: near poles, and at centres of curvature.

    >>> from pretravel.surface.parametric import FunctionSurface
    >>> floor = FunctionSurface(lambda u, v: (u, v, 0.0 * u), u=(0, 1), v=(0, 1))
    >>> point = np.array([[0.25, 3.0, 1.0]])
    >>> uv, solved = foot_points(floor, floor.domain, np.array([[0.5, 0.5]]), point)
    >>> uv.round(9).tolist(), solved.tolist()
    ([[0.25, 1.0]], [True])
    """
    uv, points = domain.confined(np.array(start)), np.asarray(points)
    solved = np.zeros(len(points), dtype=bool)
    rows = np.arange(len(points))
    second = list(surface.second_order(uv))
    for _ in range(_MOST_ITERATIONS):
        step, finished = _newton(second, uv[rows], points[rows], domain)
        solved[rows[finished]] = True
        left = np.flatnonzero(~finished)
        if len(left) == 0:
            break
        rows = rows[left]
        here = [part[left] for part in second]
        trial, second = uv[rows], here
        length = np.linalg.norm(here[0] - points[rows], axis=1)
        waiting, share = np.arange(len(rows)), 1.0
        for _ in range(_MOST_HALVINGS):
            ahead = domain.confined(uv[rows[waiting]] + share * step[left[waiting]])
            new = surface.second_order(ahead)
            with np.errstate(invalid="ignore"):
                nearer = np.linalg.norm(new[0] - points[rows[waiting]], axis=1) <= length[
                    waiting
                ] * (1.0 + 1e-13)
            taken = waiting[nearer]
            trial[taken] = ahead[nearer]
            for part, value in zip(second, new, strict=True):
                part[taken] = value[nearer]
            waiting, share = waiting[~nearer], 0.5 * share
            if len(waiting) == 0:
                break
        uv[rows] = trial
        if len(waiting):  # no step is nearer
            rest = np.setdiff1d(np.arange(len(rows)), waiting)
            rows, second = rows[rest], [part[rest] for part in second]
            if len(rows) == 0:
                break
    return uv, solved


def _newton(
    second: list[FloatArray],
    uv: FloatArray,
    points: FloatArray,
    domain: Domain,
) -> tuple[FloatArray, BoolArray]:
    """Steps of the parameters, and the rows that need none."""
    point, du, dv, duu, duv, dvv = second
    off = point - points
    slope = np.stack([np.sum(off * du, axis=1), np.sum(off * dv, axis=1)], axis=1)
    squares = np.stack([np.sum(du * du, axis=1), np.sum(dv * dv, axis=1)], axis=1)
    low, high = np.array(domain.lower), np.array(domain.upper)
    bounded = ~np.isfinite(domain.period)
    held = np.asarray(bounded & (((uv <= low) & (slope > 0.0)) | ((uv >= high) & (slope < 0.0))))
    away = np.where(held, 0.0, slope / np.sqrt(np.maximum(squares, 1e-300)))
    scale = np.abs(point).max(axis=1)
    finished = np.abs(away).max(axis=1) < np.maximum(_CLOSED, _ROUNDING * scale)
    diagonal = squares + np.stack([np.sum(off * duu, axis=1), np.sum(off * dvv, axis=1)], axis=1)
    mixed = np.sum(du * dv, axis=1)
    across = mixed + np.sum(off * duv, axis=1)
    # Where the distance is not convex, as if the surface were flat.
    convex = (diagonal > 0.0).all(axis=1) & (
        diagonal.prod(axis=1) - across**2 > _REGULAR * squares.prod(axis=1)
    )
    diagonal = np.where(convex[:, None], diagonal, squares)
    across = np.where(held.any(axis=1), 0.0, np.where(convex, across, mixed))
    determinant = diagonal.prod(axis=1) - across**2
    usable = determinant > _REGULAR * squares.prod(axis=1)
    safe = np.where(usable, determinant, 1.0)[:, None]
    step = (across[:, None] * slope[:, ::-1] - diagonal[:, ::-1] * slope) / safe
    step = np.where(held, 0.0, step)
    # A held parameter leaves a step of its own for the other one.
    alone = held[:, ::-1] & ~held
    step = np.where(alone, -slope / np.maximum(diagonal, 1e-300), step)
    return np.where(usable[:, None], step, 0.0), finished
