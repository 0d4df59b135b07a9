"""Analytic surfaces: where a ball that moves along a line touches them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import checked_unit, unit
from pretravel.errors import PretravelError


class Surface(Protocol):
    """The outside of a part's surface, in the machine's frame."""

    def ball_contact(
        self, start: FloatArray, direction: FloatArray, radius: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        """Where balls that move along lines first touch the surface.

        Parameters
        ----------
        start : (n, 3) float
            Points of the lines; contact may lie before or behind them. [mm]
        direction : (n, 3) float
            Unit directions of travel.
        radius : (n,) float
            Ball radii. [mm]

        Returns
        -------
        travel : (n,) float
            From the start to the contact, nan where the ball misses. [mm]
        normal : (n, 3) float
            Outward unit normal at the contact.
        """
        ...

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """Distance of (n, 3) points from the surface, positive outside, (n,). [mm]"""
        ...


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane through a point.

    Parameters
    ----------
    point : (3,) float
        [mm]
    normal : (3,) float
        Outward unit normal.

    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> floor.signed_distance(np.array([[5.0, 5.0, 0.25]])).tolist()
    [0.25]
    """

    point: npt.ArrayLike
    normal: npt.ArrayLike

    def __post_init__(self) -> None:
        normal = checked_unit(np.atleast_2d(np.asarray(self.normal, dtype=float)), "plane normal")
        object.__setattr__(self, "point", frozen(self.point))
        object.__setattr__(self, "normal", frozen(normal[0]))

    def ball_contact(
        self, start: FloatArray, direction: FloatArray, radius: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        normal = np.asarray(self.normal)
        closing = -(direction @ normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            travel = np.where(
                closing > 0.0, (self.signed_distance(start) - np.asarray(radius)) / closing, np.nan
            )
        return travel, np.broadcast_to(normal, start.shape)

    def signed_distance(self, points: FloatArray) -> FloatArray:
        return np.asarray((points - np.asarray(self.point)) @ np.asarray(self.normal))


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball of material, touched from outside.

    Parameters
    ----------
    center : (3,) float
        [mm]
    radius : float
        [mm]

    >>> ball = Sphere([0.0, 0.0, 0.0], 10.0)
    >>> travel, normal = ball.ball_contact(np.array([[0.0, 0.0, 20.0]]),
    ...                                    np.array([[0.0, 0.0, -1.0]]), 3.0)
    >>> travel.tolist(), normal.tolist()
    ([7.0], [[0.0, 0.0, 1.0]])
    """

    center: npt.ArrayLike
    radius: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise PretravelError(f"a sphere's radius must be positive, got {self.radius:g} mm")
        object.__setattr__(self, "center", frozen(self.center))

    def ball_contact(
        self, start: FloatArray, direction: FloatArray, radius: npt.ArrayLike
    ) -> tuple[FloatArray, FloatArray]:
        reach = self.radius + np.asarray(radius)
        to_center = np.asarray(self.center) - start
        foot = np.sum(to_center * direction, axis=1)
        miss = to_center - foot[:, None] * direction
        with np.errstate(invalid="ignore"):
            travel = foot - np.sqrt(reach**2 - np.sum(miss**2, axis=1))
        hit = np.isfinite(travel)
        normal = np.zeros_like(start)
        normal[hit] = unit(travel[hit, None] * direction[hit] - to_center[hit])
        return np.asarray(travel), normal

    def signed_distance(self, points: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.norm(points - np.asarray(self.center), axis=1) - self.radius)
